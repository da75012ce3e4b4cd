"""Marks for a blind trial: every figure that is claimed for the diagnosis, each with its interval."""

from dataclasses import asdict
from typing import Any

import numpy as np

from analysis.blind.causes.named import CAUSES
from analysis.blind.scoring.intervals import Figure, mean, proportion
from analysis.blind.scoring.marks import EITHER, Row

LARGE = 0.7  # severities from here on are called large; 1 is what an experimenter would notice
NOISES = ("white", "ar1", "warp")


def figures_of(rows: list[Row], rng: np.random.Generator) -> list[Figure]:
    """All figures of the trial. The oracle (true cause, true parameters) shrinks the gap to the noise
    floor: 1."""
    groups = ("none", "listed", "pair", "triple", "unknown", "beside")
    by = {group: [r for r in rows if r.truth.group == group] for group in groups}
    listed, none = by["listed"], by["none"]
    large, small = [r for r in listed if r.truth.size >= LARGE], [r for r in listed if r.truth.size < LARGE]
    left = by["unknown"] + by["beside"]
    found = [r for r in listed if r.marks.first_right]
    return [
        proportion("right in every point", [r.right for r in rows]),
        proportion("cause named first, large size", [r.marks.first_right for r in large], 0.97),
        proportion("cause named first, small size", [r.marks.first_right for r in small], 0.97),
        proportion("truth in the set", [r.marks.in_set for r in listed], 0.97),
        mean(
            "causes in the set",
            [len(r.answer.equivalent) for r in listed if r.answer.equivalent],
            rng,
            1.5,
            at_most=True,
        ),
        proportion("stage", [r.marks.stage_right for r in listed], 0.97),
        proportion("a further cause named beside the true one", [bool(r.marks.extra) for r in listed]),
        proportion("false alarms", _alarms(none), 0.03, at_most=True),
        *(proportion(f"false alarms, {n} noise", _alarms(none, n), 0.03, True) for n in NOISES),
        proportion("two causes: both named", [r.marks.all_named for r in by["pair"]], 0.95),
        proportion("two causes: nothing else said", [r.right for r in by["pair"] if r.marks.all_named]),
        proportion("three causes: all named", [r.marks.all_named for r in by["triple"]], 0.80),
        proportion("three causes: nothing else said", [r.right for r in by["triple"] if r.marks.all_named]),
        proportion("unlisted cause: answered unknown", [r.answer.verdict == "unknown" for r in by["unknown"]], 0.95),
        proportion("unlisted cause: in the right stage", [r.marks.left_found for r in by["unknown"]]),
        proportion("unlisted cause: given a listed name", [r.answer.verdict == "effect" for r in by["unknown"]]),
        proportion("listed beside unlisted: the listed one named", [r.marks.all_named for r in by["beside"]]),
        proportion(
            "listed beside unlisted: the rest found, in the right stage", [r.marks.left_found for r in by["beside"]]
        ),
        proportion(
            "listed beside unlisted: both", [r.marks.all_named and r.marks.left_found for r in by["beside"]], 0.8
        ),
        proportion("unlisted cause: a law written", [r.answer.law for r in left]),
        proportion(
            "a law where there is nothing unlisted", [r.answer.law for r in rows if r not in left], 0.05, at_most=True
        ),
        _coverage([c["inside"] for r in rows for c in r.marks.parameters if c["cause"] in r.answer.named]),
        proportion("causes found with an interval for their size", [bool(r.marks.parameters) for r in found]),
        proportion(
            "missed though above the stated limit of detection",
            [r.marks.missed_above_limit for r in listed if r.marks.missed_above_limit is not None],
        ),
        mean("shrinkage, one cause (oracle: 1)", _shrunk(found), rng, 0.95),
        mean("shrinkage, several listed causes (oracle: 1)", _shrunk(by["pair"] + by["triple"]), rng),
        mean(
            "seconds per series",
            [r.answer.seconds for r in rows if r.answer.seconds is not None],
            rng,
            60.0,
            at_most=True,
        ),
    ]


def oracle_figure(shares: list[float], rng: np.random.Generator) -> Figure:
    """What the named effects close of what an oracle closes, of cases whose causes all lie in the flights."""
    return mean("flights: closed of what an oracle closes", shares, rng, 0.95)


def _alarms(rows: list[Row], noise: str | None = None) -> list[bool]:
    """Whether something was said of each of the series without effect, with one kind of noise or any."""
    return [r.answer.verdict != "none" for r in rows if noise in (None, r.truth.noise)]


def _shrunk(rows: list[Row]) -> list[float]:
    return [r.answer.shrinkage for r in rows if r.answer.shrinkage is not None]


def _coverage(checks: list[bool]) -> Figure:
    figure = proportion("90 % intervals holding the true size", checks)
    if figure.value is None:
        return figure
    return Figure(**asdict(figure) | {"goal": "0.85 to 0.95", "met": 0.85 <= figure.value <= 0.95})


def per_cause(rows: list[Row], answers: dict[str, dict[str, Any]]) -> list[dict[str, Any]]:
    """One entry per cause: how often it was answered rightly when large and when small, alone and beside others, what
    it was taken for, its intervals, and the smallest detectable size that the answers to series without effect state.

    A listed cause is answered rightly when it is named, an unlisted one when something is said to be left in its stage.
    """
    out = []
    for cause in sorted({name for r in rows for name in r.truth.sizes}):
        mine = [r for r in rows if cause in r.truth.sizes]
        names = set(EITHER.get(cause, (cause,)))
        right = {
            r.truth.case: bool(names & set(r.answer.named)) if CAUSES[cause].listed else r.marks.left_found
            for r in mine
        }
        sizes = {
            "large": [r for r in mine if r.truth.sizes[cause] >= LARGE],
            "small": [r for r in mine if r.truth.sizes[cause] < LARGE],
        }
        alone = [r for r in mine if len(r.truth.sizes) == 1]
        limits = [
            limit["size"]
            for r in rows
            if r.truth.group == "none" and r.answer.verdict == "none"
            for name, limit in (answers[r.truth.case].get("detectable") or {}).items()
            if name == cause and limit.get("size") is not None
        ]
        checks = [c["inside"] for r in mine for c in r.marks.parameters if c["cause"] == cause and right[r.truth.case]]
        shrunk = _shrunk([r for r in alone if right[r.truth.case]])
        out.append(
            {
                "cause": cause,
                "found": {
                    name: [sum(right[r.truth.case] for r in some), len(some)] for name, some in sizes.items() if some
                },
                "alone": [sum(right[r.truth.case] for r in alone), len(alone)],
                "answered": sorted(r.answer.word for r in alone if not right[r.truth.case]),
                "shrinkage": float(np.mean(shrunk)) if shrunk else None,
                "coverage": [int(np.sum(checks)), len(checks)],
                "detectable": float(np.median(limits)) if limits else None,
            }
        )
    return out
