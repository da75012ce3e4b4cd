"""Places that hold something of the frames beside them: tracks that were smoothed, a tracker that goes on from before.

Where a path is straight that changes nothing, or is late by one time.  At a blow it cuts the corner, or overshoots it:
places are off along the change of velocity, in a few frames before it or after it, by the more the harder the blow.
Between two straight ways that meet, the ways tell where each frame should be."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.choice.shortlist import AS_GOOD
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import RANGES
from analysis.gap.laws.dictionary.parts import SCALE_STEP, plain
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.corners import corners_of, seen_poses
from analysis.gap.laws.frames.bodies.sharpened import REACHES, reach_of
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.series import Series
from analysis.statistics.robust import least_squares
from ovines.core.laws import words as W
from ovines.core.laws.targets import MARKER_NEIGHBOUR
from ovines.core.laws.terms import Factor, Term
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Rounds in which a law is found, each linear about what the one before has found: what is not alike before and after
# makes all late, by the square of its shares.
ROUNDS = 3


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
    return tuple(Term(MARKER_NEIGHBOUR, 1.0, x=k * period_s) for k in range(first, last + 1) if k)


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
        fitted = zip(found.terms, found.coefficients, strict=True)
        terms = tuple(replace(term, coefficient=float(value)) for term, value in fitted)
        law = reported_law(rows, found, p, series.frame)
        rows = first.about(terms)
    return replace(law, size=float(np.sqrt(np.mean(first.off_m(terms) ** 2))), evidence=None)
