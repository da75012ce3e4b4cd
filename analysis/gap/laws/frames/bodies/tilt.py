"""A Host whose markers tilt: a plate that pitches on soft spacers, a shaker's head that nods.

In each frame the markers' heights say how they lean.  Four of them say more than any lean explains, and that is the
noise."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back
from analysis.gap.laws.frames.evidence.known import every_frame, known_frames
from analysis.gap.laws.frames.evidence.rows import problem_of, size_of
from analysis.gap.laws.frames.forms.followed import after_blows, settled, with_host
from analysis.gap.laws.frames.forms.rates import best_rates
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.body_residuals import FEWEST_FRAMES, LOOSE_SHARE
from analysis.gap.series import Series
from analysis.motion.bodies import bodies_clouds
from analysis.statistics.correlation import slow_mean
from ovines.core.laws.targets import HOST_TILT
from ovines.core.laws.terms import Factor, Term
from ovines.robust import residual_sd

Array = NDArray[np.float64]
WORD = "tilt of the Host's markers"
# A lean and a height are three numbers: of fewer markers nothing tells how well they are known.
FEWEST_MARKERS = 4
# Gross errors are so many sds off the middle of their run.
CLIP_SD = 5.0
# Leans that scatter by less than so many times their noise's variance are asked for no law.
RESTLESS = 1.5
#: a lean that counts lifts a marker at the contact radius by what counts of one that is loose
LEAST_TILT = LOOSE_SHARE


@dataclass(frozen=True, eq=False)
class TiltRows:
    """The ``problem`` without a law: rises of the markers per way along x and y, two rows a frame; what laws ``known``
    of each frame (N, KNOWN_SIZE), the frame ``at`` (M,) of each row, and what a unit of tilt along x and y adds to it
    (M, 2)."""

    problem: Regression
    known: Array
    at: NDArray[np.int64]
    unit: Array

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        return np.asarray((self.unit @ _ways(terms).T) * size_of(terms, self.known)[self.at], float)

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        size = size_of([term], self.known)
        return (self.unit @ _ways([term])[0])[:, None] * (cut(self.known) * size)[self.at]


def _ways(terms: Sequence[Term]) -> Array:
    """Directions (T, 2) along which terms tilt."""
    return np.array([[np.cos(term.x), np.sin(term.x)] for term in terms]).reshape(len(terms), 2)


def tilt_rows(series: Series) -> TiltRows | None:
    """What the heights of the Host's markers say of its tilt; None of too few markers or frames."""
    if series.points is None:
        return None
    known, begins = every_frame(series)
    values, units, ats = list[Array](), list[Array](), list[NDArray[np.int64]]()
    for number, (points, recording) in enumerate(zip(series.points, series.recordings, strict=True)):
        place = bodies_clouds(points, recording)["host"].position_m
        if len(place) != len(series.runs[number].data.time_s) or place.shape[1] < FEWEST_MARKERS:
            continue
        frames = np.flatnonzero(np.isfinite(place).all((1, 2)))
        if len(frames) < FEWEST_FRAMES:
            continue
        leans, noise = _leans(place[frames])
        ats.append(np.repeat(begins[number] + frames, 2))
        values.append((leans / noise).reshape(-1))
        units.append(np.tile(np.diag(1 / noise), (len(frames), 1)))
    if not values:
        return None
    at, unit = np.concatenate(ats).astype(np.int64), np.vstack(units)
    # How the markers lean in the middle of the series is no tilt, but how high each was glued.
    return TiltRows(problem_of(np.concatenate(values), unit, known, at), known, at, unit)


def _leans(place: Array) -> tuple[Array, Array]:
    """How markers at places (N, M, 3) lean in each frame, their rise per way along x and y (N, 2) off that of the run,
    gross ones cut, and its sds (2,)."""
    middle = np.median(place, axis=0)
    flat = np.column_stack([np.ones(len(middle)), middle[:, :2] - middle[:, :2].mean(0)])
    own, _ = np.linalg.qr(flat, mode="complete")
    rise = place[:, :, 2] - middle[:, 2]
    others = rise @ own[:, 3:]
    others = others - np.median(others, 0)
    sd = float(np.median([residual_sd(column) for column in others.T]))
    noise = sd * slow_mean(others / sd) if sd > 0 else 1.0
    inverse = np.linalg.pinv(flat)
    leans = rise @ inverse[1:].T
    limit = CLIP_SD * np.array([residual_sd(column) for column in (leans - np.median(leans, 0)).T])
    leans = np.clip(leans, np.median(leans, 0) - limit, np.median(leans, 0) + limit)
    return leans, noise * np.linalg.norm(inverse[1:], axis=1)


def find_tilt_law(series: Series, rng: np.random.Generator) -> LawFound | None:
    """The formula by which the Host's markers tilt, where its size (RMS) is above :data:`LEAST_TILT`; None where chance
    would find as much."""
    rows = tilt_rows(series)
    if rows is None or rows.problem.excess < RESTLESS:
        return None
    found, p = find_law(rows.problem, rows.columns, tilt_candidates(rows, rng), rng)
    if found is None:
        return None
    moved = (size_of(found.terms, rows.known) * found.coefficients) @ _ways(found.terms)
    size = float(np.sqrt(np.sum(np.var(moved, axis=0))))
    law = reported_law(rows, found, p, series.frame)
    return replace(law, size=size) if size > LEAST_TILT else None


def tilt_candidates(rows: TiltRows, rng: np.random.Generator) -> list[Candidate]:
    """Every candidate for the tilt of the Host's markers: with time, the drive, the Host's motion, and after blows."""
    known = rows.known
    out = [*settled(WORD, _both_ways, known), *with_host(WORD, _both_ways, known)]
    return [*out, *after_blows(WORD, _both_ways, known), *best_rates({WORD: (_both_ways, rows.unit)}, rows, rng)]


def _both_ways(*factors: Factor) -> tuple[Term, ...]:
    return tuple(Term(HOST_TILT, 1.0, factors, way_rad) for way_rad in (0.0, QUARTER))


def without_tilt(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the Host's markers as high as they are without what ``terms`` say of their tilt, and their pixels
    alike; `InputError` where there are no markers."""

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        for number, marker in enumerate(series.recordings[0].bodies["host"].markers):
            yield marker, partial(_rise, series, terms, run, number)

    return all_moved_back(series, "a law of the Host's tilt", ways)


def _rise(series: Series, terms: Sequence[Term], run: Run, marker: int, time_s: Array) -> Array:
    """How far terms lift a marker of the Host (N, 3; m) at the times of a run."""
    assert series.layouts is not None, "markers without a layout"
    data = run.data
    tilt = size_of(terms, known_frames(time_s, data, run.flights)) @ _ways(terms)
    angle, (x, y) = data.host.at(time_s)[:, 3], series.layouts["host"][marker, :2]
    place = np.column_stack([np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y])
    return np.column_stack([np.zeros((len(time_s), 2)), np.nan_to_num(np.sum(tilt * place, 1))])
