"""An effect withheld: with the true cause taken out of the library the answer must be `unknown`, in the right place,
and the law that is written must be the effect's own formula."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from analysis.blind.scoring.forms import Law, judge_law
from analysis.blind.scoring.intervals import Figure, proportion
from analysis.blind.scoring.marks import EITHER, group_of


@dataclass(frozen=True)
class Withheld:
    """One case answered without its cause: verdict, what was named instead, stage and what the structure goes with;
    ``form``: whether the law that was written is the withheld one, ``in_interval``: and whether its intervals hold the
    true sizes (None: no law can say it); ``said``: the laws."""

    case: str
    kind: str
    size: float
    noise: str
    verdict: str
    named: tuple[str, ...]
    stage: str | None
    stage_right: bool
    goes_with: str
    form: bool | None = None
    in_interval: bool | None = None
    said: str = ""


def to_withhold(truth: dict[str, Any]) -> tuple[str, ...]:
    """Effects to take out for a case: its single listed cause, and what counts for the same; nothing for other
    cases.
    """
    return EITHER.get(truth["effect"], (truth["effect"],)) if group_of(truth) == "listed" else ()


def judge_withheld(truth: dict[str, Any], answer: dict[str, Any], laws: Sequence[Law] = ()) -> Withheld:
    """Compare the answer that was given without the true cause, and the ``laws`` that it wrote, with the truth of its
    case."""
    entries = (answer.get("laws") or [])[: len(laws)]
    law = judge_law(truth, laws, entries)
    named = tuple(answer.get("effects") or ())
    structure = answer.get("left") or []
    stage = answer.get("stage")
    return Withheld(
        truth["case"],
        truth["effect"],
        truth["size"],
        truth["noise"],
        answer["verdict"],
        named,
        stage,
        stage in truth["stages"],
        structure[0]["goes_with"] if structure else "",
        None if law is None else law[0],
        None if law is None else law[1],
        "; ".join(one.get("formula", "") for one in entries),
    )


def withheld_figures(rows: list[Withheld]) -> list[Figure]:
    """Shares with Wilson's 90 % interval."""
    large = [r for r in rows if r.size >= 1]
    return [
        proportion("unknown when the cause is withheld, large size", [r.verdict == "unknown" for r in large], 0.9),
        proportion(
            "unknown when the cause is withheld, small size",
            [r.verdict == "unknown" for r in rows if r.size < 1],
        ),
        proportion("given another name", [r.verdict == "effect" for r in rows]),
        proportion("unknown: in the right stage", [r.stage_right for r in rows if r.verdict == "unknown"], 0.9),
        proportion("the law is the withheld one", [r.form for r in rows if r.form is not None], 0.8),
        proportion(
            "the law is the withheld one, its sizes within their 90 % intervals",
            [bool(r.in_interval) for r in rows if r.form is not None],
        ),
    ]


def withheld_markdown(rows: list[Withheld], made_by: str) -> str:
    """Figures and cases as Markdown."""
    out = ["# Causes withheld from the library", "", made_by, ""]
    out += ["| figure | value | interval | cases | goal |", "|---|---|---|---|---|"]
    for f in withheld_figures(rows):
        value, interval = ("-", "-") if f.value is None else (f"{f.value:.3g}", f"{f.low:.3g} to {f.high:.3g}")
        out.append(f"| {f.name} | {value} | {interval} | {f.n} | {f.goal} |")
    out += ["", "| case | withheld | size | noise | answer | stage | goes with | law | right form; size |"]
    out += ["|---|---|---|---|---|---|---|---|---|"]
    for r in sorted(rows, key=lambda r: (r.kind, -r.size)):
        answer = ", ".join(r.named) or r.verdict
        right = "" if r.stage_right or r.verdict != "unknown" else " (wrong)"
        stage = f"{r.stage}{right}"
        right = "-" if r.form is None else f"{_word(r.form)}; {_word(bool(r.in_interval))}"
        place = f"| {r.case} | {r.kind} | {r.size:g} | {r.noise} | {answer} | {stage} | {r.goes_with} |"
        out.append(f"{place} {r.said.replace('|', chr(92) + '|') or 'none'} | {right} |")
    return "\n".join(out) + "\n"


def _word(fine: bool) -> str:
    return "yes" if fine else "no"
