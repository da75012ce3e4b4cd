"""Places that hold something of the frames beside them: tracks that were smoothed, a tracker that goes on from before.

Where a path is straight that changes nothing, or is late by one time.  At a blow it cuts the corner, or overshoots it:
places are off along the change of velocity, in a few frames before it or after it, by the more the harder the blow.
Between two straight ways that meet, the ways tell where each frame should be."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.gap.laws.choice.search import AS_GOOD, find_law
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import RANGES
from analysis.gap.laws.dictionary.parts import SCALE_STEP, plain
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back, at_frames
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.laws.linear_law import told_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.loose_markers import angle_at
from analysis.gap.series import Series
from analysis.statistics.robust import least_squares
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term
from ovines.robust import residual_sd

Array = NDArray[np.float64]
#: frames to either side of one that a place may hold something of: few, which short flights tell, too, and many
REACHES = 3, 6
# Each way is a parabola (a flight's friction bends it) through so many frames, no nearer to the blow than it reaches;
# fewer do not tell its slope there.
OF_WAY, FEWEST, DEGREE = 9, 6, 2
# Two ways meet within so many frames of those that part the flights.
MEET = 1.5
# Rounds in which it is found when.
MEETINGS = 3
# Rounds in which a law is found, each linear about what the one before has found: what is not alike before and after
# makes all late, by the square of its shares.
ROUNDS = 3


class Straight(NamedTuple):
    """A way as polynomials of x, y and angle (DEGREE + 1, 3) over frames, and what they make of a power more (DEGREE +
    1, 1)."""

    pose: Array
    power: Array


class Corner(NamedTuple):
    """A blow: the ``frames`` (K,) about it, how many frames ``after`` it (K,) each of them is, the ways ``before`` and
    ``behind`` it over the frames from frame ``origin`` on, and what the velocity changes by (2,; m per frame)."""

    frames: NDArray[np.int64]
    after: Array
    before: Straight
    behind: Straight
    origin: int
    jump_m: Array

    def way(self, frames: Array) -> Array:
        """Pose (K, 3; m, rad) at ``frames`` (K,), whole or not, by the way that each is on."""
        time = frames - self.origin
        before, behind = _at(self.before.pose, time), _at(self.behind.pose, time)
        blow = self.frames[0] - self.origin - self.after[0]
        return np.where(time[:, None] < blow, before, behind)

    def bends(self) -> Array:
        """How far (K, 2) a power more takes the way before the blow, and that behind it, away from what is fitted to
        it."""
        time = (self.frames - self.origin).astype(float)
        away = [time ** (DEGREE + 1) - _at(way.power, time)[:, 0] for way in (self.before, self.behind)]
        return np.column_stack([away[0] * (self.after < 0), away[1] * (self.after >= 0)])


@dataclass(frozen=True, eq=False)
class CornerRows:
    """The ``problem`` without a law, what laws ``known`` of each frame (N, KNOWN_SIZE), how many frames ``after`` its
    blow each is (N,), what the velocity changes by there (``jump_m`` (N,), per frame), the rows' ``weight`` (N,; 1/m),
    what passes from frame to frame, ``period_s``, how many frames away what places hold may be (``reach``), and terms
    about which all is linear (``held``)."""

    problem: Regression
    known: Array
    after: Array
    jump_m: Array
    weight: Array
    period_s: float
    reach: int
    held: tuple[Term, ...] = ()

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (N, T) that a unit of each term adds to the residuals' model."""
        return self.weight[:, None] * self.moved_m(terms)

    def moved_m(self, terms: Sequence[Term]) -> Array:
        """How far a unit of each term moves a place along the change of velocity (N, T; m)."""
        shares, ahead = size_of(self.held, self.known), [term.x / self.period_s for term in self.held]
        off = np.column_stack([off_by(self.after, term.x / self.period_s, shares, ahead) for term in terms])
        return np.asarray(off * self.jump_m[:, None] * size_of(terms, self.known), float)

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (N, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        return self.columns([term]) * cut(self.known)

    def off_m(self, terms: Sequence[Term]) -> Array:
        """How far (N,; m) terms move the places along the change of velocity."""
        shares, ahead = size_of(terms, self.known), [term.x / self.period_s for term in terms]
        return seen_off(self.after, shares, ahead) * self.jump_m

    def about(self, terms: tuple[Term, ...]) -> CornerRows:
        """The same, linear about ``terms`` instead of none."""
        rows = replace(self, held=terms)
        more_m = rows.moved_m(terms).sum(1) - self.off_m(terms)
        return replace(rows, problem=replace(self.problem, residual=self.problem.residual + self.weight * more_m))


def seen_off(after: Array, shares: Array, ahead: Sequence[float]) -> Array:
    """How far (N,) places that hold ``shares`` (N, T) of what is ``ahead`` so many frames are off two ways that meet
    where those meet, in what the way changes by in a frame."""
    late = shares @ np.asarray(ahead, float) if len(ahead) else np.zeros(len(after))
    true = after - late
    here = np.maximum(true, 0.0)
    off = here - np.maximum(after, 0.0)
    for share, frames in zip(shares.T, ahead, strict=True):
        off = off + share * (np.maximum(true + frames, 0.0) - here)
    return np.asarray(off, float)


def off_by(after: Array, ahead: float, shares: Array | None = None, others: Sequence[float] = ()) -> Array:
    """What a unit more of what is ``ahead`` so many frames adds to :func:`seen_off` (N,), beside ``shares`` (N, T) of
    ``others``."""
    held = np.zeros((len(after), 0)) if shares is None else shares
    true = after - (held @ np.asarray(others, float) if len(others) else 0.0)
    begun = (1.0 - held.sum(1)) * (true > 0)
    for share, frames in zip(held.T, others, strict=True):
        begun = begun + share * (true + frames > 0)
    return np.asarray(np.maximum(true + ahead, 0.0) - np.maximum(true, 0.0) - ahead * begun, float)


def _at(polynomial: Array, time: Array) -> Array:
    return np.asarray(np.vander(time, DEGREE + 1) @ polynomial, float)


def seen_poses(run: Run, motion: pd.DataFrame) -> Array:
    """Pose (N, 3; m, rad) of the disk in the frames of a run, by its ``motion``: those about blows, too, that flights
    leave out; NaN where it was not seen."""
    return np.column_stack([motion[["nes_x_m", "nes_y_m"]].to_numpy(float), angle_at(run.data)])


def corners_of(run: Run, pose: Array, reach: int) -> list[Corner]:
    """Blows of a run between two flights that are long enough to tell where they would meet, by frames that hold
    nothing of what is more than ``reach`` frames away."""
    seen = np.asarray(np.isfinite(pose).all(1), bool)
    found = []
    for one, other in zip(run.flights[:-1], run.flights[1:], strict=True):
        # What cuts a corner may pass for a contact that lasts: flights are not always joined.
        if one.goes_on or other.first - one.last > 2 * reach:
            continue
        first = max(one.first + reach, one.last - reach - OF_WAY)
        last = min(other.last - reach, other.first + reach + OF_WAY)
        before = _fitted(pose, seen, np.arange(first + 1, one.last - reach), one.last)
        behind = _fitted(pose, seen, np.arange(other.first + reach + 1, last), one.last)
        near = np.arange(max(one.last - reach, 0), min(other.first + reach + 1, len(pose)))
        if before is None or behind is None:
            continue
        corner = _met(before, behind, one.last, other.first, near)
        if corner is not None:
            found.append(corner)
    return found


def _fitted(pose: Array, seen: NDArray[np.bool_], frames: NDArray[np.int64], origin: int) -> Straight | None:
    """The way in ``frames`` as far as they were ``seen``; None where too few were."""
    frames = frames[seen[frames]]
    if len(frames) < FEWEST:
        return None
    time = (frames - origin).astype(float)
    seen_there = np.column_stack([pose[frames], time ** (DEGREE + 1)])
    fitted = np.asarray(np.linalg.lstsq(np.vander(time, DEGREE + 1), seen_there, rcond=None)[0], float)
    return Straight(fitted[:, :3], fitted[:, 3:])


def _met(before: Straight, behind: Straight, last: int, first: int, near: NDArray[np.int64]) -> Corner | None:
    """The blow where two ways come nearest along what the velocity changes by, from frame ``last`` of one to ``first``
    of the other; None where they do not."""
    apart, middle = np.asarray(behind.pose - before.pose, float)[:, :2], 0.5 * (first - last)
    time, slope = middle, apart[1]
    for _ in range(MEETINGS):
        slope = np.asarray(2 * time * apart[0] + apart[1], float)
        square = float(slope @ slope)
        if square == 0:
            return None
        time -= float(_at(apart, np.array([time]))[0] @ slope) / square
    if abs(time - middle) > middle + MEET:
        return None
    return Corner(near, np.asarray(near - last - time, float), before, behind, last, slope)


def corner_rows(series: Series, reach: int) -> CornerRows | None:
    """What the frames next to blows say of those beside them, up to ``reach`` frames away; None without blows that
    tell."""
    parts: list[tuple[Array, ...]] = []
    for number, run in enumerate(series.runs):
        known = known_frames(run.data.time_s, run.data, run.flights)
        pose = seen_poses(run, series.motions[number])
        for corner in corners_of(run, pose, reach):
            off = pose[corner.frames, :2] - corner.way(corner.frames.astype(float))[:, :2]
            there = np.isfinite(off).all(1)
            jump_m = float(np.hypot(*corner.jump_m))
            x, y = corner.jump_m / jump_m
            same = np.ones(len(off))
            own = (off @ [x, y], off @ [-y, x], jump_m * same, corner.after, len(parts) * same, number * same)
            every = (*own, known[corner.frames], jump_m * corner.bends())
            parts.append(tuple(column[there] for column in every))
    if not parts:
        return None
    joined = [np.concatenate(own) for own in zip(*parts, strict=True)]
    along, across, jump_m_at, after, blow, of_run, known, bends = joined
    noise = _noise(across, after)
    if not (noise > 0).all():
        return None
    at = (blow.astype(np.int64), of_run.astype(np.int64))
    free = np.zeros(bends.shape[1])
    rows = CornerRows(Regression(along, bends, free, *at), known, after, jump_m_at, 1 / noise, series.period_s, reach)
    # What is gross beside all that is asked weighs little.
    asked = np.column_stack([rows.moved_m(_neighbours(-reach, reach, series.period_s)), bends])
    fit = least_squares(asked, along, noise)
    weight = fit.weight / np.sqrt(_at_once(asked * fit.weight[:, None], fit.weight * noise * fit.residual, at[0]))
    return replace(rows, problem=Regression(along * weight, bends * weight[:, None], free, *at), weight=weight)


def _at_once(columns: Array, left: Array, blow: NDArray[np.int64]) -> float:
    """How many times the variance of what is fitted to rows (N, C) is that of rows that know nothing of each other, 1
    at the least: frames about one blow share its two ways' errors (``left`` (N,))."""
    sums = np.array([np.bincount(blow, column * left) for column in columns.T])
    return max(1.0, float(np.median(np.sum(sums**2, 1) / np.maximum(np.sum(columns**2, 0), 1e-300))))


def _noise(across: Array, after: Array) -> Array:
    """Noise (N,) of frames so many ``after`` a blow: what they are off ``across`` its change of velocity, where nothing
    that cuts a corner moves them."""
    step = np.floor(np.abs(after)).astype(int)
    out = np.zeros(len(across))
    for one in np.unique(step):
        out[step == one] = residual_sd(across[step == one])
    return out


def _neighbours(first: int, last: int, period_s: float) -> tuple[Term, ...]:
    """Terms of the frames from ``first`` to ``last`` but for the frame itself."""
    return tuple(Term(W.MARKER_NEIGHBOUR, 1.0, x=k * period_s) for k in range(first, last + 1) if k)


def blow_candidates(rows: CornerRows) -> list[Candidate]:
    """Every candidate for what a place holds of the frames beside it."""
    out = []
    for reach in range(1, rows.reach + 1):
        for last, word in ((-1, "before"), (reach, "before and after")):
            terms = _neighbours(-reach, last, rows.period_s)
            out.append(plain(f"places that hold {reach} frames {word}", *terms))
    return out


def candidates_near_the_wall(rows: CornerRows) -> list[Candidate]:
    """Every candidate for what a place near the wall holds of the frames before: where the wall hides markers, a
    tracker goes on by them."""
    radius_m = float(np.median(rows.known[:, W.CONTACT_RADIUS]))
    out = []
    for reach in (1, 2):
        terms = _neighbours(-reach, -1, rows.period_s)

        def near(range_m: float, terms: tuple[Term, ...] = terms) -> tuple[Term, ...]:
            return tuple(replace(one, factors=(Factor("gap", "exponential", 1.0, range_m),)) for one in terms)

        name = f"places that hold {reach} frames before near the wall"
        out += [Candidate(name, near, (share * radius_m,), (SCALE_STEP,), (True,)) for share in RANGES]
    return out


def find_blow_law(series: Series, rng: np.random.Generator) -> LawFound | None:
    """What every place holds of the frames beside it; None where chance would find as much."""
    few, many = REACHES
    far = corner_rows(series, many)
    law = None if far is None else _found(far, blow_candidates, series, rng)
    if law is not None and reach_of(law.rig_law.terms, series.period_s) > few:
        return law
    rows = corner_rows(series, few)
    if rows is None:
        return None
    everywhere, near = (_found(rows, asked, series, rng) for asked in (blow_candidates, candidates_near_the_wall))
    if everywhere is None or near is None:
        return everywhere or near
    # Half of a lag passes for one near the wall as long as its law is not linear: the simpler where both say as much.
    more = float(np.sum(everywhere.after) - np.sum(near.after)) * len(rows.problem.residual)
    return near if more > AS_GOOD else everywhere


def reach_of(terms: Sequence[Term], period_s: float) -> int:
    """Frames to the farthest of which places hold something."""
    return max(round(abs(term.x) / period_s) for term in terms)


def _found(
    first: CornerRows,
    asked: Callable[[CornerRows], list[Candidate]],
    series: Series,
    rng: np.random.Generator,
) -> LawFound | None:
    rows = first
    for _ in range(ROUNDS):
        found, p = find_law(rows.problem, rows.columns, asked(rows), rng, most_parts=1)
        if found is None:
            return None
        told = zip(found.terms, found.coefficients, strict=True)
        terms = tuple(replace(term, coefficient=float(value)) for term, value in told)
        law = told_law(rows, found, p, series.frame)
        rows = first.about(terms)
    return replace(law, size=float(np.sqrt(np.mean(first.off_m(terms) ** 2))), evidence=None)


def without_neighbours(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the points of Host and NES back from what ``terms`` say that they hold of the frames beside them,
    and their pixels alike; `InputError` where there are no markers."""

    ahead_s = np.array([term.x for term in terms])
    reach = max(REACHES[0], reach_of(terms, series.period_s))

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        data = run.data
        size = size_of(terms, known_frames(data.time_s, data, run.flights))
        pose = seen_poses(run, series.motions[data.number])
        yield from moved("nes", size, partial(_sharp, run, pose, reach), data)
        # What goes with the disk's gap is nothing of the Host.
        yield from moved("host", size * [not term.factors for term in terms], partial(_of_host, data), data)

    def moved(body: str, shares: Array, path: Way, data: RunData) -> Iterator[tuple[str, Way]]:
        assert series.layouts is not None
        # Of each frame and those beside it, as late as what places hold makes what is seen.
        true_s = data.time_s - shares @ ahead_s
        poses = [path(true_s + later_s) for later_s in (0.0, *ahead_s)]
        for marker, place in zip(series.recordings[0].bodies[body].markers, series.layouts[body], strict=True):
            here, *beside = (_of_marker(pose, place) for pose in poses)
            steps_m = np.stack([there - here for there in beside], 1)
            yield marker, partial(at_frames, np.nan_to_num(np.sum(shares[:, :, None] * steps_m, 1)), data)

    return all_moved_back(series, "a law of every marker", ways)


def _of_marker(pose: Array, place: Array) -> Array:
    """Places (N, 2; m) of a marker that stands at ``place`` on a body whose ``pose`` (N, 3) is given."""
    c, s = np.cos(pose[:, 2]), np.sin(pose[:, 2])
    return np.asarray(pose[:, :2] + np.column_stack([c * place[0] - s * place[1], s * place[0] + c * place[1]]), float)


def _of_host(data: RunData, time_s: Array) -> Array:
    """Pose (N, 3) of the Host at times."""
    return np.asarray(data.host.at(time_s)[:, [0, 1, 3]], float)


def _sharp(run: Run, pose: Array, reach: int, time_s: Array) -> Array:
    """Pose (N, 3) of the disk at times (N,; s), ``pose`` in the frames: up to ``reach`` frames about blows as the two
    ways have it, which no frame beside blurs; NaN before and after all that was seen."""
    data = run.data
    seen = np.isfinite(pose).all(1)
    if not seen.any():
        return np.full((len(time_s), 3), np.nan)
    at = data.time_s[seen]
    out = np.column_stack([np.interp(time_s, at, column[seen]) for column in pose.T])
    out[(time_s < at[0]) | (time_s > at[-1])] = np.nan
    frames = np.interp(time_s, data.time_s, np.arange(len(data.time_s)))
    for corner in corners_of(run, pose, reach):
        own = (frames >= corner.frames[0]) & (frames <= corner.frames[-1])
        out[own] = corner.way(frames[own])
    return out
