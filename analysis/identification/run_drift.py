"""Floor friction that changes from run to run: a line through the runs, fitted with all that their flights share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.evidence import Evidence, columns_of
from analysis.flights.fit import LENS_TERMS, ORIGIN, SHARED
from analysis.flights.parameters import INDEX
from analysis.flights.runs import Run
from analysis.identification.floor import RESTS_SD, FloorFit, disagreement, fit_floor, prior_of

Array = NDArray[np.float64]
#: the column of the change per run, beyond those that flights know
PER_RUN = len(SHARED)
# Fits until the change rests.
MOST_FITS = 4


def numbers_of(count: int) -> Array:
    """Numbers (R,) of so many runs, counted from the middle one."""
    return np.arange(count, dtype=np.float64) - 0.5 * (count - 1)


def with_run_drift(
    runs: Sequence[Run], floor: FloorFit, held: Mapping[str, float]
) -> tuple[list[Run], FloorFit, tuple[float, float] | None]:
    """``runs`` with the friction that each has of its own, ``floor`` fitted with it, and the relative change per run
    about the middle one, with its sd; None of a single run, or without friction."""
    if len(runs) < 2 or "friction" not in floor.names:
        return list(runs), floor, None
    change = 0.0
    number = numbers_of(len(runs))
    own = [run.data.friction_share for run in runs]
    for _ in range(MOST_FITS):
        step, sd = _step(floor, change, number)
        change += step
        runs = [
            replace(run, data=replace(run.data, friction_share=float(share * (1 + change * n))))
            for run, share, n in zip(runs, own, number, strict=True)
        ]
        if abs(step) < RESTS_SD * sd:
            break
        floor = fit_floor(runs, floor.names, held, floor)
    return list(runs), floor, (change, sd)


def _step(floor: FloorFit, change: float, number: Array) -> tuple[float, float]:
    """Step of the change per run from where it stands, and its sd, all other unknowns fitted along."""
    friction = float(floor.fits[0].parameters[INDEX["friction"]])
    evidence = [_with_column(e, friction * n / (1 + change * n)) for e, n in zip(floor.evidence, number, strict=True)]
    shared = columns_of([*floor.names, *ORIGIN, *LENS_TERMS])
    columns = [*shared, PER_RUN]
    prior, pull = prior_of(shared, floor.fits[0].shared, floor.lens_sd_m)
    information, score = np.diag([*prior, 0.0]), np.append(pull, 0.0)
    for e in evidence:
        a, b = e.take(columns)
        information, score = information + a, score + b
    # Unit diagonal first: friction, metres and rates differ by ten orders of magnitude.
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
    step = covariance @ score
    wider = disagreement([e.only(columns) for e in evidence], step, covariance)
    return float(step[-1]), float(np.sqrt(covariance[-1, -1]) * wider[-1])


def _with_column(evidence: Evidence, slope: float) -> Evidence:
    """Evidence with the column of the change per run: ``slope`` times that of the run's friction."""
    at = evidence.columns.index(INDEX["friction"])
    turn = np.vstack([np.eye(len(evidence.columns)), np.zeros(len(evidence.columns))]).T
    turn[at, -1] = slope
    return replace(
        evidence,
        columns=(*evidence.columns, PER_RUN),
        information=turn.T @ evidence.information @ turn,
        score=turn.T @ evidence.score,
        parts=tuple((turn.T @ a @ turn, turn.T @ b) for a, b in evidence.parts),
    )
