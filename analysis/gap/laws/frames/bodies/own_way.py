"""A tracker that stays behind what it follows: every marker is off along its own velocity.

Where all are late by one time, the disk is where it was a moment ago: it is as rigid as before, and no body tells.
Where they are off by one length, as by a dead band, or by more than in proportion to the speed, each marker is off
otherwise, for a disk that spins moves each of them another way.  What no rigid motion explains tells how far.

A tracker knows the way up to a frame, not the one after it: velocities here are those since the frame before."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import BEYOND, SPEEDS
from analysis.gap.laws.dictionary.parts import plain, scaled
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back, at_frames
from analysis.gap.laws.frames.evidence.known import FEWEST_SEEN, every_frame, known_frames
from analysis.gap.laws.frames.evidence.rows import problem_of, size_of
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.loose_markers import angle_at, apart
from analysis.gap.series import Series
from analysis.statistics.correlation import slow_mean
from ovines.core.laws import words as W
from ovines.core.laws.targets import MARKER_WAY
from ovines.core.laws.terms import Factor, Term
from ovines.robust import residual_sd

Array = NDArray[np.float64]
#: powers of a marker's speed; by the first it would be late by one time, which bodies do not tell
POWERS = (0.0, 2.0, 3.0)
BEYOND_A_SPEED = "markers along their way beyond a speed"
# A velocity is one of so many times its noise on; below, markers are less far off.
SURE_SD = 3.0
# Gross errors count as so many sds.
CLIP_SD = 5.0


@dataclass(frozen=True, eq=False)
class WayRows:
    """The ``problem`` without a law, what laws ``known`` of each frame (N, KNOWN_SIZE) and of each of the disk's
    markers there (M of them, (N, KNOWN_SIZE) each), and what moving each of them by a unit along its own way adds to
    the frame's ``units`` rows (N, M, Q)."""

    problem: Regression
    known: Array
    of_markers: tuple[Array, ...]
    units: Array

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (N Q, T) that a unit of each term adds to the residuals' model."""
        return _columns(terms, self.of_markers, self.units)

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (N Q, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        return np.asarray(self.columns([term]) * np.repeat(cut(self.known), self.units.shape[2], axis=0), float)

    def moved_rms(self, terms: Sequence[Term], coefficients: Array) -> float:
        """RMS over frames and markers of how far the terms move a marker (m)."""
        moved = [size_of(terms, known) @ coefficients for known in self.of_markers]
        return float(np.sqrt(np.mean(np.square(moved))))


def way_rows(series: Series) -> WayRows | None:
    """What the disk's markers say against each other; None where too few frames show all of them."""
    if series.points is None or series.layouts is None:
        return None
    every, begins = every_frame(series)
    layout = series.layouts["nes"][:, :2]
    frames: list[Array] = []
    of_markers: list[list[Array]] = [[] for _ in layout]
    units: list[Array] = []
    values: list[Array] = []
    for one in apart(series, "nes"):
        data = series.runs[one.run].data
        known = _since_before(every[begins[one.run] : begins[one.run + 1]], data)[one.frames]
        moving = [_of_marker(known, place) for place in layout]
        # Rows of the disk are along its own axes.
        c, s = np.cos(known[:, W.ANGLE]), np.sin(known[:, W.ANGLE])
        ways = [_way(marker, data) for marker in moving]
        seen = [np.column_stack([c * x + s * y, c * y - s * x]) for x, y in (way.T for way in ways)]
        unit = np.stack([way @ one.basis[2 * i : 2 * i + 2] for i, way in enumerate(seen)], 1)
        frames.append(known)
        for own, marker in zip(of_markers, moving, strict=True):
            own.append(marker)
        units.append(unit)
        values.append(one.values)
    if not frames:
        return None
    joined = tuple(np.vstack(own) for own in of_markers)
    return _over_noise(np.concatenate(values), np.vstack(frames), joined, np.concatenate(units))


def _columns(terms: Sequence[Term], of_markers: Sequence[Array], units: Array) -> Array:
    """Rows (N Q, T) that a unit of each term adds, by what is known ``of_markers`` and what moving them adds."""
    out = np.zeros((len(units), units.shape[2], len(terms)))
    for i, known in enumerate(of_markers):
        out += units[:, i, :, None] * size_of(terms, known)[:, None, :]
    return out.reshape(-1, len(terms))


def _over_noise(values: Array, known: Array, of_markers: tuple[Array, ...], units: Array) -> WayRows | None:
    """Rows of ``values`` (N, Q; m) over their noise: what is left beside all powers of the speed."""
    count, across = values.shape
    # Where each marker stands on the disk is unknown: it is the same in all frames.
    constants = np.tile(np.eye(across), (count, 1))
    flat = values.reshape(-1)
    powers = _columns([_power(power) for power in POWERS], of_markers, units)
    model = np.column_stack([constants, powers])
    left = (flat - model @ np.linalg.lstsq(model, flat, rcond=None)[0]).reshape(values.shape)
    sds = np.array([residual_sd(column) for column in left.T])
    if not (sds > 0).all():
        return None
    noise = sds * np.array([slow_mean(column / sd) for column, sd in zip(left.T, sds, strict=True)])
    kept = values - left + np.clip(left, -CLIP_SD * sds, CLIP_SD * sds)
    at = np.repeat(np.arange(count), across)
    problem = problem_of((kept / noise).reshape(-1), constants / np.tile(noise, count)[:, None], known, at)
    return WayRows(problem, known, of_markers, units / noise)


def _since_before(known: Array, data: RunData) -> Array:
    """What laws know of the frames of a run, with the disk's velocity and spin since the frame before."""
    out = known.copy()
    seen = np.flatnonzero(np.isfinite(data.xy_m).all(1))
    if len(seen) < FEWEST_SEEN:
        return out
    at, way = data.time_s[seen], np.column_stack([data.xy_m[seen], angle_at(data)[seen]])
    rate = np.diff(way, axis=0) / np.diff(at)[:, None]
    later = np.clip(np.searchsorted(at, data.time_s) - 1, 0, len(rate) - 1)
    out[:, [W.VX, W.VY, W.SPIN]] = rate[later]
    return out


def _of_marker(known: Array, place: Array) -> Array:
    """What laws know of a marker that stands at ``place`` (2,; m) on the disk: what they know of the disk, but for its
    own velocity."""
    c, s, spin = np.cos(known[:, W.ANGLE]), np.sin(known[:, W.ANGLE]), known[:, W.SPIN]
    out = known.copy()
    out[:, W.VX] -= spin * (s * place[0] + c * place[1])
    out[:, W.VY] += spin * (c * place[0] - s * place[1])
    return out


def _way(known: Array, data: RunData) -> Array:
    """Direction (N, 2) of a velocity in the room, shorter than 1 where that is hardly more than noise."""
    velocity = known[:, [W.VX, W.VY]]
    sure = SURE_SD * np.sqrt(2) * float(np.median(data.xy_sd_m)) / data.period_s
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    return np.asarray(velocity / np.maximum(speed, sure)[:, None], float)


def _power(power: float) -> Term:
    return Term(MARKER_WAY, 1.0, (Factor("speed", "power", power),) if power else ())


def way_candidates(rows: WayRows) -> list[Candidate]:
    """Every candidate for how far behind a tracker stays."""
    speed = np.concatenate([np.hypot(known[:, W.VX], known[:, W.VY]) for known in rows.of_markers])
    usual = float(np.sqrt(np.mean(speed**2)))
    out = [plain(f"markers along their way, by their speed to the power {power:g}", _power(power)) for power in POWERS]
    slow, fast = ([share * usual for share in shares] for shares in (SPEEDS, BEYOND))
    out += scaled("markers along their way while they are slow", MARKER_WAY, ("speed", "exponential", 1.0), slow)
    # What has gone farther than a search window in a frame is found at its edge.
    return out + scaled(BEYOND_A_SPEED, MARKER_WAY, ("speed", "above", 1.0), fast)


def find_way_law(series: Series, rng: np.random.Generator) -> LawFound | None:
    """The formula of how far every marker stays behind on its own way; None where chance would find as much."""
    rows = way_rows(series)
    if rows is None:
        return None
    asked = way_candidates(rows)
    found, p = find_law(rows.problem, rows.columns, asked, rng, most_parts=1)
    if found is not None and found.parts[0].name == BEYOND_A_SPEED and found.coefficients[0] > 0:
        # Ahead in proportion to the speed beyond one is behind by one length, but for what all are late by alike.
        asked = [one for one in asked if one.name != BEYOND_A_SPEED]
        found, p = find_law(rows.problem, rows.columns, asked, rng, most_parts=1)
    # What is ahead of where it goes is no tracker that stays behind: a guess where the wall hides markers is.
    if found is None or found.coefficients[0] > 0:
        return None
    law = reported_law(rows, found, p, series.frame)
    size_m = rows.moved_rms(found.terms, found.coefficients)
    # No figure in bins of the speed: what is in proportion to it no body tells, so that any line may lie beside them.
    return replace(law, size=size_m, evidence=None)


def without_way(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the points of Host and NES moved back by what ``terms`` say, and their pixels alike;
    `InputError` where there are no markers."""

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        assert series.layouts is not None
        every = known_frames(run.data.time_s, run.data, run.flights)
        disk, host = _since_before(every, run.data), every.copy()
        host[:, [W.VX, W.VY]] = _host_since_before(run.data)
        for body in ("host", "nes"):
            for marker, place in zip(series.recordings[0].bodies[body].markers, series.layouts[body], strict=True):
                own = _of_marker(disk, place[:2]) if body == "nes" else host
                moved_m = size_of(terms, own).sum(1)[:, None] * _way(own, run.data)
                yield marker, partial(at_frames, np.nan_to_num(moved_m), run.data)

    return all_moved_back(series, "a law of every marker", ways)


def _host_since_before(data: RunData) -> Array:
    """Velocity of the Host since the frame before (N, 2; m/s) in the frames of a run."""
    gone = data.host.at(data.time_s)[:, :2] - data.host.at(data.time_s - data.period_s)[:, :2]
    return np.asarray(gone / data.period_s, float)
