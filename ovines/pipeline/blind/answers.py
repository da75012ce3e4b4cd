"""The diagnosis of every case of a trial, and of cases whose true cause is taken out of the library."""

from __future__ import annotations

import json
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from analysis.blind import trial
from analysis.blind.scoring.withheld import Withheld, judge_withheld, to_withhold
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.law_file import read_law
from ovines.pipeline.blind.processes import Say, of_each, well_formed
from ovines.pipeline.series.written_diagnosis import DIAGNOSIS, Asked, write_diagnosis

# What is said of a case whose diagnosis ended in an error.
NO_ANSWER = "no answer"


def diagnose(series: Path, out: Path, withheld: Sequence[str] = ()) -> None:
    """`ovines diagnose` on one series, in this process so that compiled code is compiled once."""
    write_diagnosis(Asked(series, out, withheld=withheld))


def read_answer(folder: Path) -> dict[str, Any]:
    """`diagnosis.json` of a folder of results."""
    answer: dict[str, Any] = json.loads((folder / DIAGNOSIS).read_text())
    return answer


def case_names(folder: Path) -> list[str]:
    """The cases of a trial by its manifest; `ValueError` where a name is none of a folder."""
    return [_plain(entry["case"]) for entry in trial.read_manifest(folder)["cases"]]


def _plain(case: Any) -> str:
    if not isinstance(case, str) or not case or case in (".", "..") or "/" in case or "\0" in case:
        raise ValueError(f"case {case!r}")
    return case


class Unanswered(NamedTuple):
    """Cases of a trial without an answer (``left``), and how many there are in all (``cases``)."""

    left: list[str]
    cases: int


def unanswered(folder: Path) -> Unanswered:
    """What is left to answer in a trial's ``folder``."""
    with well_formed(folder):
        cases = case_names(folder)
    return Unanswered([case for case in cases if not (folder / "answers" / case / "seconds.json").exists()], len(cases))


def answer_cases(folder: Path, asked: Unanswered, jobs: int, say: Say) -> list[str]:
    """Answer the cases that are left; the names of those whose diagnosis ended in an error."""
    failed = []
    answered = of_each(_answer_case, ((folder, case) for case in asked.left), jobs)
    for done, (case, answer) in enumerate(answered, asked.cases - len(asked.left) + 1):
        say(f"{done}/{asked.cases} {case}: {answer}")
        failed += [case] if answer.startswith(NO_ANSWER) else []
    return sorted(failed)


def _answer_case(folder: Path, case: str) -> tuple[str, str]:
    out = folder / "answers" / case
    start = time.monotonic()
    try:
        diagnose(folder / "cases" / case, out)
    except Exception as error:  # whatever it is: the other cases have their answers
        out.mkdir(parents=True, exist_ok=True)
        write_text_whole(traceback.format_exc(), out / "failed.txt")
        return case, f"{NO_ANSWER} ({type(error).__name__}: {error}; see failed.txt)".replace("\n", " ")
    (out / "failed.txt").unlink(missing_ok=True)
    write_text_whole(json.dumps(time.monotonic() - start), out / "seconds.json")
    verdict = read_answer(out)
    return case, ", ".join(verdict["effects"]) or verdict["verdict"]


def cases_to_withhold(folder: Path, seed: int | None, most: int | None) -> list[dict[str, Any]]:
    """Truths of the cases with a single listed cause, the first ``most``; `InputError` where there is none."""
    with well_formed(folder):
        truths = [truth for truth in trial.read_truths(folder, seed).values() if to_withhold(truth)][:most]
    if not truths:
        raise InputError(
            f"no case with a single listed cause in {folder}", "at least one", "make one with --kinds listed"
        )
    return truths


def answer_withheld(folder: Path, truths: Sequence[dict[str, Any]], jobs: int, say: Say) -> list[Withheld]:
    """The cases answered without their cause, each beside its truth."""
    rows: list[Withheld] = []
    for row in of_each(_withhold_case, ((folder, truth) for truth in truths), jobs):
        rows.append(row)
        say(f"{len(rows)}/{len(truths)} {row.case} without {row.kind}: {', '.join(row.named) or row.verdict}")
    return rows


def _withhold_case(folder: Path, truth: dict[str, Any]) -> Withheld:
    out = folder / "withheld" / truth["case"]
    if not (out / DIAGNOSIS).exists():
        diagnose(folder / "cases" / truth["case"], out, to_withhold(truth))
    answer = read_answer(out)
    laws = [read_law(out / entry["file"]) for entry in answer.get("laws") or []]
    return judge_withheld(truth, answer, laws)
