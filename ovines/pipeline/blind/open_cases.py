"""The open cases of a trial, and the further runs that the plant makes of each until its cause stands alone."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np

from analysis.blind import trial
from analysis.blind.series import Outline
from ovines.errors import InputError
from ovines.pipeline.blind.answers import diagnose, read_answer
from ovines.pipeline.blind.closed_loop import WAYS, Course, is_open, settle
from ovines.pipeline.blind.processes import Say, of_each, well_formed
from ovines.pipeline.series.written_diagnosis import DIAGNOSIS


def open_cases(folder: Path, seed: int, most: int | None) -> list[tuple[int, Outline]]:
    """Outlines of the answered cases whose cause was found, but not alone, the first ``most``, each with its place in
    the trial; `InputError` where there is none."""
    with well_formed(folder):
        truths = trial.read_truths(folder, seed)
        answers = {case: folder / "answers" / case for case in truths}
        given = {case: read_answer(path) for case, path in answers.items() if (path / DIAGNOSIS).exists()}
        found = [case for case, answer in given.items() if is_open(truths[case], answer)][:most]
    if not found:
        raise InputError(
            f"no open case in {folder}",
            "answers in which the true cause stands beside others under `equivalent`",
            "make a trial of few runs and small sizes: --kinds listed --runs 3 --sizes 0.3",
        )
    return [(index, one) for index, one in enumerate(trial.outlines_again(folder, seed)) if one.truth["case"] in found]


def settle_cases(folder: Path, cases: list[tuple[int, Outline]], seed: int, jobs: int, say: Say) -> list[Course]:
    """How each of the ``cases`` goes in both ways of :data:`WAYS`, by case."""
    asked = [
        (folder, outline, way, [seed, index, WAYS.index(way)]) for index, outline in cases for way in WAYS
    ]  # each way draws by itself
    courses: list[Course] = []
    for course in of_each(_settle_case, asked, jobs):
        courses.append(course)
        end = "not settled" if course.settled is None else f"settled after {course.settled}"
        say(f"{len(courses)}/{len(asked)} {course.case}, {course.way}: {end}")
    return sorted(courses, key=lambda one: (one.case, WAYS.index(one.way)))


def _settle_case(folder: Path, outline: Outline, way: str, seed: list[int]) -> Course:
    case = outline.truth["case"]
    series = folder / "loop" / f"{case}-{way}"
    shutil.rmtree(series, ignore_errors=True)
    shutil.copytree(folder / "cases" / case, series)
    answer = read_answer(folder / "answers" / case)
    return settle(outline, series, answer, way, _answered_again, np.random.default_rng(seed))


def _answered_again(series: Path, out: Path) -> dict[str, Any]:
    diagnose(series, out)
    return read_answer(out)
