"""Do the next tests settle what a series leaves open?  The plant makes further runs, as `next_test` recommends or in
settings drawn at random, and the diagnosis answers again, until the true cause stands alone.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from analysis.blind.recording.files import write_run
from analysis.blind.scoring.marks import group_of
from analysis.blind.series import Outline, Wish, further_run
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS
from ovines.io.atomic_write import write_text_whole

MOST_RUNS = 4  # further ones; then a set counts as not settled
WAYS = ("recommended", "random")
WISHES = {one.words: Wish(one.level, one.frequency, one.launch) for one in SETTINGS}
Diagnose = Callable[[Path, Path], dict[str, Any]]  # a series' folder, where its answer goes -> diagnosis.json


@dataclass(frozen=True)
class Course:
    """How one open case went: ``settings`` of the further runs, and the names still possible after each; ``settled``:
    how many runs it took until the true cause stood alone, None where it did not.
    """

    case: str
    cause: str
    way: str
    begun: tuple[str, ...]
    settings: tuple[str, ...]
    possible: tuple[tuple[str, ...], ...]
    settled: int | None


def is_open(truth: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Whether a single listed cause was found, but not alone: other names explain these data as well."""
    return group_of(truth) == "listed" and _names(answer) > {truth["effect"]}


def _names(answer: dict[str, Any]) -> set[str]:
    return {*(answer.get("effects") or ()), *(answer.get("equivalent") or ())}


def settle(
    outline: Outline,
    folder: Path,
    answer: dict[str, Any],
    way: str,
    diagnose: Diagnose,
    rng: np.random.Generator,
) -> Course:
    """Add runs to the series in ``folder`` (which has the ``answer``) until its true cause stands alone, at most
    :data:`MOST_RUNS`; settings as ``way`` says (of :data:`WAYS`).
    """
    cause = outline.truth["effect"]
    begun, settings, possible = tuple(sorted(_names(answer))), [], []
    count = len(list(folder.glob("run-*")))
    for further in range(1, MOST_RUNS + 1):
        words = _chosen(answer, way, rng)
        write_run(folder, count + further, *further_run(outline, WISHES[words], rng))
        out = folder.with_name(f"{folder.name}-answer")
        shutil.rmtree(out, ignore_errors=True)
        answer = diagnose(folder, out)
        settings.append(words)
        possible.append(tuple(sorted(_names(answer))))
        if _names(answer) == {cause}:
            return Course(outline.truth["case"], cause, way, begun, tuple(settings), tuple(possible), further)
    return Course(outline.truth["case"], cause, way, begun, tuple(settings), tuple(possible), None)


def _chosen(answer: dict[str, Any], way: str, rng: np.random.Generator) -> str:
    if way == "random":
        return str(rng.choice(list(WISHES)))
    tests = answer.get("next_tests") or {}
    return str(tests.get("recommended", AS_RECORDED))


def runs_needed(courses: Sequence[Course]) -> float:
    """Median number of further runs; a case that was not settled counts as one more than the most."""
    return float(np.median([MOST_RUNS + 1 if c.settled is None else c.settled for c in courses]))


def markdown(courses: Sequence[Course]) -> str:
    """The courses as a table, and the medians of both ways."""
    lines = ["| way | cases | settled | further runs, median |", "|---|---|---|---|"]
    for way in WAYS:
        own = [c for c in courses if c.way == way]
        if own:
            settled = sum(c.settled is not None for c in own)
            lines.append(f"| {way} | {len(own)} | {settled} | {runs_needed(own):g} |")
    lines += [
        "",
        "| case | cause | way | at first | further runs, and what was left after each |",
        "|---|---|---|---|---|",
    ]
    for c in courses:
        went = "; ".join(f"{s}: {', '.join(p) or 'none'}" for s, p in zip(c.settings, c.possible, strict=True))
        lines.append(f"| {c.case} | {c.cause} | {c.way} | {', '.join(c.begun)} | {went} |")
    return "\n".join([*lines, ""])


def write_courses(courses: Sequence[Course], folder: Path) -> str:
    """Write loop.md and loop.json into a trial's folder; the text of loop.md."""
    text = markdown(courses)
    write_text_whole(text, folder / "loop.md")
    write_text_whole(json.dumps([asdict(one) for one in courses], indent=1), folder / "loop.json")
    return text
