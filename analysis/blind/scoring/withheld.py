"""An effect withheld: with the true cause taken out of the library the answer must be `unknown`, in the right place."""

from dataclasses import dataclass
from typing import Any

from analysis.blind.scoring.intervals import Figure, proportion
from analysis.blind.scoring.score import EITHER, group_of


@dataclass(frozen=True)
class Withheld:
    """One case answered without its cause: verdict, what was named instead, stage and what the structure goes with."""

    case: str
    kind: str
    size: float
    noise: str
    verdict: str
    named: tuple[str, ...]
    stage: str | None
    stage_right: bool
    goes_with: str


def to_withhold(truth: dict[str, Any]) -> tuple[str, ...]:
    """Effects to take out for a case: its single listed cause, and what counts for the same; nothing for other
    cases.
    """
    return EITHER.get(truth["effect"], (truth["effect"],)) if group_of(truth) == "listed" else ()


def judge_withheld(truth: dict[str, Any], answer: dict[str, Any]) -> Withheld:
    """Compare the answer that was given without the true cause with the truth of its case."""
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
    ]


def withheld_markdown(rows: list[Withheld], told: str) -> str:
    """Figures and cases as Markdown."""
    out = ["# Causes withheld from the library", "", told, ""]
    out += ["| figure | value | interval | cases | goal |", "|---|---|---|---|---|"]
    for f in withheld_figures(rows):
        value, interval = ("-", "-") if f.value is None else (f"{f.value:.3g}", f"{f.low:.3g} to {f.high:.3g}")
        out.append(f"| {f.name} | {value} | {interval} | {f.n} | {f.goal} |")
    out += ["", "| case | withheld | size | noise | answer | stage | goes with |", "|---|---|---|---|---|---|---|"]
    for r in sorted(rows, key=lambda r: (r.kind, -r.size)):
        answer = ", ".join(r.named) or r.verdict
        right = "" if r.stage_right or r.verdict != "unknown" else " (wrong)"
        stage = f"{r.stage}{right}"
        out.append(f"| {r.case} | {r.kind} | {r.size:g} | {r.noise} | {answer} | {stage} | {r.goes_with} |")
    return "\n".join(out) + "\n"
