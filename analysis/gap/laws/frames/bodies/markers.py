"""A marker that moves on its body as a regression: what all markers of the body do beyond any rigid motion, along what
this one may do of it, and the points without it.

What the marker cannot do is the noise, however much it does itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.flights.cutting.runs import Run
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back
from analysis.gap.laws.frames.evidence.known import every_frame, known_frames
from analysis.gap.laws.frames.evidence.rows import Key, key_of, problem_of, size_of
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.loose_markers import apart
from analysis.gap.series import Series
from analysis.statistics.correlation import slow_mean
from ovines.core.laws.terms import Term
from ovines.errors import InputError
from ovines.robust import residual_sd

Array = NDArray[np.float64]
#: target of a marker on each body
TARGETS = {"host": "host_marker", "nes": "nes_marker"}
BODIES = {target: body for body, target in TARGETS.items()}
# Gross errors count as so many sds, off the median of so many frames.
CLIP_SD, NEIGHBOURS = 5.0, 5
# A marker whose residuals are larger than those of the others, in their squares, may be asked for a law unprompted.
RESTLESS = 1.5


@dataclass(frozen=True, eq=False)
class MarkerRows:
    """The ``problem`` without a law, what laws ``known`` of each frame (N, KNOWN_SIZE), the frame ``at`` (M,) of each
    row, and what the marker of ``key`` adds to it by a unit along x and y (M, 2)."""

    problem: Regression
    known: Array
    at: NDArray[np.int64]
    key: Key
    unit: Array

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        size = size_of(terms, self.known)
        out = np.zeros((len(self.at), len(terms)))
        for j, term in enumerate(terms):
            if key_of(term) == self.key:
                out[:, j] = (self.unit @ _direction(term)) * size[self.at, j]
        return out

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        size = size_of([term], self.known)
        return (self.unit @ _direction(term))[:, None] * (cut(self.known) * size)[self.at]

    def moved_rms(self, terms: Sequence[Term], coefficients: Array) -> float:
        """RMS over all frames of how far the terms move the marker off its mean place (m)."""
        size = size_of(terms, self.known)
        way = (size * coefficients) @ np.array([_direction(term) for term in terms])
        return float(np.sqrt(np.sum(np.var(way, axis=0))))


def _direction(term: Term) -> Array:
    return np.array([np.cos(term.y), np.sin(term.y)])


def marker_rows(series: Series, body: str, marker: int) -> MarkerRows | None:
    """What the markers of a body say of one of them; None where too few frames show all of them."""
    known, begins = every_frame(series)
    values: list[Array] = []
    units: list[Array] = []
    ats: list[NDArray[np.int64]] = []
    for one in apart(series, body):
        # Along the first two columns of `own` lies all that the marker may do; the others tell the noise.
        own, along = np.linalg.qr(one.basis[2 * marker : 2 * marker + 2].T, mode="complete")
        turned = one.values @ own
        others = turned[:, 2:] - np.median(turned[:, 2:], 0)
        sd = float(np.median([residual_sd(column) for column in others.T]))
        if not sd > 0:
            continue
        calm = np.all(np.abs(others) < CLIP_SD * sd, 1)
        noise = sd * slow_mean(others / sd)
        value = turned[calm, :2] / noise
        values.append(_without_gross(value).reshape(-1))
        units.append(np.tile(along[:2] / noise, (len(value), 1)))
        ats.append(np.repeat(begins[one.run] + one.frames[calm], 2))
    if not values:
        return None
    at, unit = np.concatenate(ats).astype(np.int64), np.vstack(units)
    # Where the marker stands on its body is unknown.
    problem = problem_of(np.concatenate(values), unit, known, at)
    return MarkerRows(problem, known, at, (TARGETS[body], marker), unit)


def restless_markers(series: Series) -> list[MarkerRows]:
    """The marker of each body that moves most beside what the others do, by their noise; none that moves hardly
    more."""
    out = []
    for body in TARGETS if series.points is not None and series.layouts is not None else ():
        count = len(series.recordings[0].bodies[body].markers)
        every = [rows for rows in (marker_rows(series, body, marker) for marker in range(count)) if rows is not None]
        most = max(every, key=lambda rows: rows.problem.excess, default=None)
        if most is not None and most.problem.excess > RESTLESS:
            out.append(most)
    return out


def _without_gross(values: Array) -> Array:
    """``values`` (N, 2) with frames that stand out of their neighbours cut: a motion, however uneven, does not."""
    middle = median_filter(values, (NEIGHBOURS, 1), mode="nearest")
    limit = CLIP_SD * np.array([residual_sd(column) for column in (values - middle).T])
    return np.clip(values, middle - limit, middle + limit)


def without_markers(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the points of markers moved back by what ``terms`` say, and their pixels alike; `InputError`
    where there is no such marker."""
    keys = sorted({key_of(term) for term in terms})
    for target, number in keys:
        markers = series.recordings[0].bodies[BODIES[target]].markers
        if number >= len(markers):
            raise InputError(
                f"a law of marker {number + 1} of the {BODIES[target]}",
                f"one of its {len(markers)} markers",
                "correct x of its terms",
            )

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        for key in keys:
            own = [term for term in terms if key_of(term) == key]
            yield series.recordings[0].bodies[BODIES[key[0]]].markers[key[1]], partial(_way, own, key[0], run=run)

    return all_moved_back(series, "a law of a marker", ways)


def _way(terms: Sequence[Term], target: str, time_s: Array, run: Run) -> Array:
    """How far terms move a marker in the room (N, 2; m) at the times of a run; not at all where the disk's angle is not
    known."""
    data = run.data
    way = size_of(terms, known_frames(time_s, data, run.flights)) @ np.array([_direction(term) for term in terms])
    if target == TARGETS["host"]:
        return way
    angle = data.angle_rad[np.clip(np.searchsorted(data.time_s, time_s), 0, len(data.time_s) - 1)]
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = way[:, :1], way[:, 1:]
    return np.nan_to_num(np.hstack([c * x - s * y, s * x + c * y]))
