"""The card with the disk's markers as a whole: play on its pin, soft glue, a blow that shifts or turns it on the disk.

All markers in both views are off alike, so that neither bodies nor views know of it, and what stays from blow to blow
stands in no flight's residuals either.  It stands between flights: where two of them meet, the disk is in one place and
at one angle, and what its markers do there beside is a step of the card.  What changes along a flight stands in its
residuals, too."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import CONTINUITY_M, intersect
from analysis.flights.cutting.runs import Run, turned
from analysis.flights.equation.model import STATES
from analysis.flights.evidence import flight_rows, usable_flights
from analysis.flights.fit import FlightFits
from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import QUARTER, Candidate, waves
from analysis.gap.laws.flight_rows import FlightRegression, flight_regression
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.moved_back import Way, all_moved_back
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.laws.frames.forms.followed import after_blows, settled, struck_rim, swung_round, with_spin
from analysis.gap.laws.frames.forms.making import followed
from analysis.gap.laws.linear_law import reported_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.body_residuals import loose_m
from analysis.gap.measurement.loose_markers import angle_at
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.series import Series
from ovines.core.laws import words as W
from ovines.core.laws.targets import NES_CARD
from ovines.core.laws.terms import Factor, Term
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Meetings fewer than this tell nothing.  Gross errors count as so many times what all but one in ten miss: a card that
# stays at its stop for half of the blows steps at the other half alone.
FEWEST_MEETINGS, MOST_MISSED, USUAL = 8, 3.0, 0.9
# ... and beside a law so many sds.
CLIP_SD = 5.0
# Shares that are rounding alone.
ROUNDING = 1e-9
# Parts of a law at the most.
MOST_PARTS = 2
# What moves markers by less than this share of what counts does not come to count without the gross blows.
CLEARLY_LESS = 0.5


@dataclass(frozen=True, eq=False)
class _Meeting:
    """Two flights where they meet: what the pose there ``missed`` (3,) over its noise, the ``nuisances`` (3, P) that a
    contact which lasts makes of it, and how it answers shifts of the pose at the frames ``before`` and ``after`` of a
    run (3, 3 N)."""

    run: int
    missed: Array
    nuisances: Array
    before: tuple[NDArray[np.int64], Array]
    after: tuple[NDArray[np.int64], Array]

    def columns(self, moved: Array) -> Array:
        """What shifts (F, 3, T) of the pose at the frames of its run make of it, (3, T)."""
        (first, left), (second, right) = self.before, self.after
        flat = (moved[first].reshape(-1, moved.shape[2]), moved[second].reshape(-1, moved.shape[2]))
        return np.asarray(right @ flat[1] - left @ flat[0], float)


@dataclass(frozen=True, eq=False)
class CardRows:
    """The ``problem`` without a law: ``flights``, then ``meetings``; what laws know at all frames of each run
    (``every``); ``at``: run and frames of each flight."""

    problem: Regression
    flights: FlightRegression
    meetings: tuple[_Meeting, ...]
    every: tuple[Array, ...]
    at: tuple[tuple[int, NDArray[np.int64]], ...]

    @property
    def known(self) -> Array:
        """What laws know at all frames, (N, KNOWN_SIZE)."""
        return np.vstack(self.every)

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        return self._rows([pose_shift(terms, known) for known in self.every])

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (N, B) that ``cut`` gives what is known."""
        return self._rows([pose_shift([term], known) * cut(known)[:, None, :] for known in self.every])

    def _rows(self, moved: Sequence[Array]) -> Array:
        flown = self.flights.seen_beside([moved[run][frames] for run, frames in self.at])
        met = np.vstack([one.columns(moved[one.run]) for one in self.meetings])
        # What stays all along a flight is its start state: nothing of it is left but rounding.
        flown[np.abs(flown) < ROUNDING * np.abs(met).max(initial=0.0)] = 0.0
        return np.vstack([flown, met])


def pose_shift(terms: Sequence[Term], known: Array) -> Array:
    """How far a unit of each term moves the pose that is read off the markers: x, y and angle (N, 3, T; m, rad)."""
    sizes, out = size_of(terms, known), np.zeros((len(known), 3, len(terms)))
    for j, term in enumerate(terms):
        if term.target == NES_CARD[1]:
            out[:, 2, j] = sizes[:, j]
        elif term.target == NES_CARD[0]:
            way = known[:, W.ANGLE] + term.x
            out[:, 0, j], out[:, 1, j] = np.cos(way) * sizes[:, j], np.sin(way) * sizes[:, j]
    return out


def card_rows(fitted: FlightFit) -> CardRows | None:
    """What flights, and where they meet, say of the card; None where few meet."""
    flights, fits = flight_regression(fitted), fitted.fits
    meetings = _meetings(fits)
    if len(meetings) < FEWEST_MEETINGS or not flights.flights:
        return None
    missed = np.array([one.missed for one in meetings])
    limit = MOST_MISSED * np.maximum(1.0, np.quantile(np.abs(missed), USUAL, axis=0))
    of_flights, own = flights.problem, np.array([one.nuisances for one in meetings])
    count, shared = 3 * len(meetings), of_flights.nuisances.shape[1]
    nuisances = np.zeros((len(of_flights.residual) + count, shared + own.shape[2]))
    nuisances[: len(of_flights.residual), :shared] = of_flights.nuisances
    nuisances[len(of_flights.residual) :, shared:] = own.reshape(count, -1)
    last = int(of_flights.block.max()) + 1
    problem = Regression(
        np.concatenate([of_flights.residual, np.clip(missed, -limit, limit).reshape(-1)]),
        nuisances,
        np.concatenate([of_flights.prior, np.zeros(own.shape[2])]),
        np.concatenate([of_flights.block, last + np.repeat(np.arange(len(meetings)), 3)]),
        np.concatenate([of_flights.run, np.repeat([one.run for one in meetings], 3)]),
    )
    every = tuple(known_frames(fit.run.time_s, fit.run, fit.flights) for fit in fits)
    return CardRows(problem, flights, meetings, every, _frames_of(flights, fits))


def _frames_of(flights: FlightRegression, fits: Sequence[FlightFits]) -> tuple[tuple[int, NDArray[np.int64]], ...]:
    """Run and frames of each flight of a regression."""
    firsts = np.flatnonzero(np.diff(flights.problem.block, prepend=-1))
    out = []
    for one, first in zip(flights.flights, firsts, strict=True):
        run = int(flights.problem.run[first])
        time_s = fits[run].run.time_s
        out.append((run, np.searchsorted(time_s, one.times[one.at] - 0.1 * fits[run].run.period_s).astype(np.int64)))
    return tuple(out)


def _meetings(fits: Sequence[FlightFits]) -> tuple[_Meeting, ...]:
    """Of all usable flights that meet, each fitted by itself: the instant is free, as for any impact."""
    junctions, out = intersect(fits), []
    usable = [usable_flights(fit) for fit in fits]
    for r, k, t in zip(junctions.run.tolist(), junctions.flight.tolist(), junctions.time_s, strict=True):
        if usable[r][k] and usable[r][k + 1]:
            out.append(_meeting(fits[r], r, k, np.array([t])))
    return tuple(out)


def _meeting(fits: FlightFits, number: int, k: int, at: Array) -> _Meeting:
    (a,), (before,) = fits.propagate(k, at)
    (b,), (after,) = fits.propagate(k + 1, at)
    run, step = fits.run, a[3:] - b[3:]
    exact_m = CONTINUITY_M * run.own_units[0]
    spread = before[:3, :3] + after[:3, :3] + np.outer(step, step) * run.period_s**2
    spread += np.diag([exact_m, exact_m, exact_m / run.radius_m]) ** 2
    whitened = np.linalg.inv(np.linalg.cholesky(spread))
    # A contact that lasts leaves the pose farther on by what the disk went and turned meanwhile.
    lasts = np.zeros((3, 4))
    lasts[:2, 0], lasts[:2, 1], lasts[2, 2], lasts[2, 3] = a[3:5], b[3:5], a[5], b[5]
    sides = [_answers(fits, flight, at) for flight in (k, k + 1)]
    left, right = ((frames, whitened @ answers) for frames, answers in sides)
    return _Meeting(number, whitened @ (b - a)[:3], whitened @ lasts, left, right)


def _answers(fits: FlightFits, k: int, at: Array) -> tuple[NDArray[np.int64], Array]:
    """Frames (N,) of a flight, and how its pose at a time answers shifts of the pose there (3, 3 N)."""
    seen = flight_rows(fits, k, ())
    local = (seen.rows[:, :, :STATES] / seen.sd[:, :, None]).reshape(-1, STATES)
    size = np.maximum(np.sqrt(np.sum(local**2, 0)), 1e-300)
    start = np.linalg.pinv(local / size) / size[:, None] / seen.sd.reshape(-1)
    pose = fits.flown(k, at)[1][0][:3, :STATES]
    return seen.index, np.asarray(pose @ start, float)


def card_candidates(known: Array) -> list[Candidate]:
    """Every candidate for how the card lies on the disk."""
    out = list[Candidate]()
    for make, word in ((_turned, "card of the NES turned"), (_shifted, "card of the NES shifted")):
        out += [*settled(word, make, known), *after_blows(word, make, known), *with_spin(word, make, known)]
        out += swung_round(word, make, known)
    # Markers that are printed about another point than the disk's middle: their angle is read wrong as it turns.
    follows = partial(followed, "card of the NES turned", _turned)
    out += [follows(f"with its angle, order {order:g}", *waves("angle", order)) for order in (1.0, 2.0)]
    return [*out, *struck_rim("card of the NES shifted", _shifted)]


def _turned(*factors: Factor) -> tuple[Term, ...]:
    return (Term(NES_CARD[1], 1.0, factors),)


def _shifted(*factors: Factor) -> tuple[Term, ...]:
    return tuple(Term(NES_CARD[0], 1.0, factors, x=way_rad) for way_rad in (0.0, QUARTER))


def find_card_law(fitted: FlightFit, series: Series, rng: np.random.Generator) -> LawFound | None:
    """The formula of how the card lies on the disk, None where chance would find as much or where it moves less than
    markers are glued."""
    rows = None if series.points is None else card_rows(fitted)
    if rows is None:
        return None
    asked = card_candidates(rows.known)
    found, p = find_law(rows.problem, rows.columns, asked, rng, most_parts=MOST_PARTS)
    radius_m = fitted.fits[0].run.radius_m
    if found is None or _size_m(found, rows, radius_m) < CLEARLY_LESS * loose_m(series):
        return None
    # Once the form is known, a blow whose sense was read wrongly is a gross error as any other.
    rows = _without_gross(rows, rows.columns(found.terms) @ found.coefficients)
    found, p = find_law(rows.problem, rows.columns, asked, rng, most_parts=MOST_PARTS)
    if found is None:
        return None
    return replace(reported_law(rows, found, p, series.frame), size=_size_m(found, rows, radius_m))


def _size_m(found: Found, rows: CardRows, radius_m: float) -> float:
    """RMS over all frames of how far a law moves the markers at the rim off their mean place."""
    moved = pose_shift(found.terms, rows.known) @ found.coefficients
    return float(np.sqrt(np.sum(np.var(moved * [1.0, 1.0, radius_m], axis=0))))


def _without_gross(rows: CardRows, explained: Array) -> CardRows:
    """``rows`` with what a law that has ``explained`` (M,) of them leaves of meetings cut where it is gross."""
    residual, first = rows.problem.residual.copy(), len(rows.problem.residual) - 3 * len(rows.meetings)
    left = (residual - explained)[first:].reshape(-1, 3)
    limit = CLIP_SD * np.maximum(1.0, [residual_sd(column) for column in left.T])
    residual[first:] = explained[first:] + np.clip(left, -limit, limit).reshape(-1)
    return replace(rows, problem=replace(rows.problem, residual=residual))


def without_card(series: Series, terms: Sequence[Term]) -> Series:
    """``series`` with the disk's markers where the card would have them without what ``terms`` say; `InputError` where
    there are none."""

    def ways(run: Run) -> Iterator[tuple[str, Way]]:
        assert series.layouts is not None
        markers = series.recordings[0].bodies["nes"].markers
        for place_m, marker in zip(series.layouts["nes"][:, :2], markers, strict=True):
            yield marker, partial(_way, terms, place_m, run=run)

    return all_moved_back(series, "a law of the NES' markers", ways)


def _way(terms: Sequence[Term], place_m: Array, time_s: Array, run: Run) -> Array:
    """How far terms move a marker at a place (2,; m) of the disk in the room (N, 2; m) at the times of a run."""
    known = known_frames(time_s, run.data, run.flights)
    moved = pose_shift(terms, known).sum(2)
    seen = np.interp(time_s, run.data.time_s, angle_at(run.data))
    return np.nan_to_num(moved[:, :2] + turned(place_m, seen) - turned(place_m, seen - moved[:, 2]))
