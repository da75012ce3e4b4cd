"""Flights as a regression: how far each candidate's acceleration would have moved the frames.

A term's acceleration along the path is integrated twice, with what friction and drag make of the velocity that it adds
(a disk that hardly slides follows the floor, whatever pulls at it); the flight's own start state, which no law knows,
is projected out of residual, nuisances and candidates alike.  The law that is chosen is fitted again by the flights'
own equation of motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import making_arrays
from analysis.flights.along_flights import known_states
from analysis.flights.equation.model import STATES
from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import columns_of, flight_rows, usable_flights
from analysis.flights.fit import SHARED, FlightFits
from analysis.flights.noise import GROSS_SD, FlightNoise
from analysis.flights.single_flight import whiten
from analysis.gap.laws.regression.forms import Table
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.laws.regression.splines import spline_rows
from analysis.gap.selection.flights.fit import FlightFit, prior_of
from analysis.gap.selection.flights.model import run_places
from ovines.core.laws.kernel import SharedTerms, pushes, shared_pushes, shared_terms, shared_values
from ovines.core.laws.terms import Term, rows_of
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]
# Steps of the integration in a frame: a force of 4 mm range beside the wall is crossed in two frames.
SUBSTEPS = 3
# Frames from one knot to the next of the splines that a dictionary is asked with.  Of practice-30's 5,739 columns (800
# fps) they hold all but 1e-7 of the square of most, 0.0007 of all but one in a hundred, and 0.005 of those that ring
# fastest, in 10,860 rows for 28,368.
KNOT_FRAMES = 4
# So many terms, a whole dictionary, are worth a thread for each processor.
MANY_TERMS = 64
# And so many are answered at a time, flight by flight: their numbers stay near the processor.
AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class _Flight:
    """One flight: ``times`` (S,) of the integration with what laws ``know`` there, what each step makes of the
    velocity (``turn``, (S - 1, 3, 3)) and of the accelerations at its ends (``pushed``, (S - 1, 3, 3)), the frames'
    places ``at`` (N,) among them, whitening, robust weights (N, 3) and an
    orthonormal basis (3 N, 6) of what the start state moves."""

    times: Array
    know: Array
    turn: Array
    pushed: Array
    at: NDArray[np.int64]
    place: Array
    angle: Array
    weight: Array
    own: Array

    def projected(self, rows: Array, out: Array | None = None) -> Array:
        """Whitened rows (N, 3, C), which it weighs in place, without what the start state takes, (3 N, C)."""
        rows *= self.weight[:, :, None]
        flat = rows.reshape(-1, rows.shape[2])
        return np.asarray(np.subtract(flat, self.own @ (self.own.T @ flat), out=out), float)

    @cached_property
    def smooth(self) -> _Smooth:
        """The frames as smooth functions of time see them."""
        splines, functions, sums = spline_rows(self.at // SUBSTEPS, KNOT_FRAMES), [], []
        for m, triangle in enumerate((self.place, self.place, self.angle)):
            seen = self.weight[:, m, None] * triangle
            functions.append(np.linalg.qr(seen @ splines)[0])
            sums.append(functions[m].T @ seen)
        seen_own = np.vstack(list(np.array(functions).mT @ self._by_coordinate(self.own)))
        return _Smooth(np.array(functions), np.array(sums), np.linalg.qr(seen_own)[0])

    def summed(self, rows: Array) -> Array:
        """Whitened rows (3 N, C) as smooth functions see them, (3 K, C)."""
        return self.smooth.left(np.vstack(list(self.smooth.functions.mT @ self._by_coordinate(rows))))

    def _by_coordinate(self, rows: Array) -> Array:
        """Rows (3 N, C) along x, along y and of the angle, (3, N, C)."""
        return rows.reshape(len(self.at), 3, -1).swapaxes(0, 1)


class _Smooth(NamedTuple):
    """Orthonormal ``functions`` (3, N, K) of the whitened frames that hold what forces move, splines along x, along y
    and by the angle; ``sums`` (3, K, N), what they see of displacements; what they see of the start state, ``own``
    (3 K, 6)."""

    functions: Array
    sums: Array
    own: Array

    def left(self, seen: Array) -> Array:
        """What is ``seen`` (3 K, C) without what the start state takes, in place."""
        seen -= self.own @ (self.own.T @ seen)
        return seen


@dataclass(frozen=True, eq=False)
class FlightRegression:
    """The flights of a series: the ``problem`` without a law, and columns of any law's terms."""

    problem: Regression
    flights: tuple[_Flight, ...]

    @property
    def known(self) -> Array:
        """What laws know at all the frames, (N, KNOWN_SIZE)."""
        return np.vstack(self.knowns)

    @property
    def knowns(self) -> list[Array]:
        """The same flight by flight."""
        return [one.know[one.at] for one in self.flights]

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        packed = rows_of(terms)
        out = np.empty((len(self.problem.residual), len(packed)))
        if len(packed) < MANY_TERMS:
            for one, own in self._by_flight(out):
                _columns(one, _given(one, packed), own)
            return out
        shared = shared_terms(packed)
        in_threads(_fill, [(one, shared, own, _columns) for one, own in self._by_flight(out)])
        return out

    def sums(self, terms: Sequence[Term]) -> Table:
        """:meth:`columns` as smooth functions see them, (R, T), in single precision: fewer rows, and their products are
        the same but for the shares at :data:`KNOT_FRAMES`."""
        shared = shared_terms(rows_of(terms))
        ends = np.cumsum([len(one.smooth.own) for one in self.flights])
        out = np.empty((int(ends[-1]), len(terms)), np.float32)
        in_threads(
            _fill,
            [(one, shared, own, _sums) for one, own in zip(self.flights, np.split(out, ends[:-1]), strict=True)],
        )
        return out

    def summed(self, problem: Regression) -> Regression:
        """A problem of these flights whose rows are those of :meth:`sums`."""
        seen = np.column_stack([problem.residual, problem.nuisances])
        seen = np.vstack([one.summed(own) for one, own in self._by_flight(seen)])
        first = np.cumsum([0, *(3 * len(one.at) for one in self.flights[:-1])])
        rows = [len(one.smooth.own) for one in self.flights]
        block, run = (np.repeat(number[first], rows) for number in (problem.block, problem.run))
        return replace(problem, residual=seen[:, 0], nuisances=seen[:, 1:], block=block, run=run)

    def _by_flight(self, out: Array) -> Iterator[tuple[_Flight, Array]]:
        """Each flight with its rows of ``out`` (M, T)."""
        first = 0
        for one in self.flights:
            last = first + 3 * len(one.at)
            yield one, out[first:last]
            first = last

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (S, B) that ``cut`` gives what is known."""
        packed = rows_of([term])
        parts = []
        for one in self.flights:
            given = _given(one, packed) * cut(one.know)[:, None, :]
            acts = np.any(given != 0.0, (0, 1))  # most parts of a run are none of this flight's
            part = np.zeros((3 * len(one.at), given.shape[2]))
            if acts.any():  # a law that is nil all along a flight moves nothing of it
                part[:, acts] = _columns(one, np.ascontiguousarray(given[:, :, acts]))
            parts.append(part)
        return np.vstack(parts)

    def pushed_columns(self, given: Sequence[Array]) -> Array:
        """Columns (M, C) of accelerations ``given`` (S, 3, C; m/s^2 along x and y, rad/s^2) at the ``times`` of each
        flight."""
        return np.vstack([_columns(one, own) for one, own in zip(self.flights, given, strict=True)])

    def seen_beside(self, moved: Sequence[Array]) -> Array:
        """Columns (M, C) of what moves the disk's picture, not the disk: ``moved`` at the frames of each flight, along
        x and y and, where it turns, by an angle (N, 2 or 3, C; m, rad)."""
        parts = []
        for one, shift in zip(self.flights, moved, strict=True):
            rows = np.zeros((len(shift), 3, shift.shape[2]))
            rows[:, : shift.shape[1]] = shift
            whiten(rows, np.zeros(rows.shape[:2]), one.place, one.angle)
            parts.append(one.projected(rows))
        return np.vstack(parts)


@lru_cache(maxsize=1)
def flight_regression(fitted: FlightFit) -> FlightRegression:
    """The flights of a fit that may speak for what all share, its free parameters as nuisances; of the fit that was
    asked for last it is at hand."""
    columns = columns_of([n for n in fitted.columns if n in SHARED])
    prior = prior_of([SHARED[c] for c in columns], fitted.fits[0].run.contact_radius_m)
    rows = regression_of(fitted.fits, fitted.noise, columns, prior)
    return replace(rows, problem=_drifting_from_starts(rows.problem, columns, fitted))


def _drifting_from_starts(problem: Regression, columns: Sequence[int], fitted: FlightFit) -> Regression:
    """The ``problem`` whose friction drifts from each run's start on, as the fit has it, not about each run's
    middle."""
    friction, drift = INDEX["friction"], INDEX["drift"]
    if friction not in columns or drift not in columns:
        return problem
    places = run_places([one.run for one in fitted.fits])
    more = np.array([fitted.model.friction_per_drift(place) for place in places])[problem.run]
    nuisances = problem.nuisances.copy()
    nuisances[:, list(columns).index(drift)] += more * nuisances[:, list(columns).index(friction)]
    return replace(problem, nuisances=nuisances)


def regression_of(
    every: Sequence[FlightFits], noise: FlightNoise, columns: Sequence[int], prior: Array
) -> FlightRegression:
    """The flights of runs that may speak for what all share, with the frames' ``noise``; nuisances are the ``columns``
    (P indices into ``SHARED``, ascending) with prior weights (P,)."""
    flights: list[_Flight] = []
    residuals: list[Array] = []
    nuisances: list[Array] = []
    block: list[int] = []
    run: list[int] = []
    for number, fits in enumerate(every):
        for k in np.flatnonzero(usable_flights(fits)):
            one, residual, rows = _linearised(fits, int(k), columns, noise)
            residuals.append(residual)
            nuisances.append(rows)
            block += [len(flights)] * len(residual)
            run += [number] * len(residual)
            flights.append(one)
    problem = Regression(
        np.concatenate(residuals) if residuals else np.zeros(0),
        np.vstack(nuisances) if nuisances else np.zeros((0, len(columns))),
        prior,
        np.array(block, np.int64),
        np.array(run, np.int64),
    )
    return FlightRegression(problem, tuple(flights))


def _linearised(fits: FlightFits, k: int, columns: Sequence[int], noise: FlightNoise) -> tuple[_Flight, Array, Array]:
    seen = flight_rows(fits, k, columns)
    white = noise.whitening(
        seen.index, seen.time_s, np.ascontiguousarray(seen.sd[:, 0]), np.ascontiguousarray(seen.sd[:, 2])
    )
    rows, residual = seen.rows.copy(), seen.residual.copy()
    whiten(rows, residual, *white)
    weight = np.minimum(1.0, GROSS_SD / np.maximum(np.abs(residual), 1e-300))
    local = (rows[:, :, :STATES] * weight[:, :, None]).reshape(-1, STATES)
    size = np.sqrt(np.sum(local**2, 0))
    u, s, _ = np.linalg.svd(local / np.where(size > 0, size, 1.0), full_matrices=False)
    times, at = _grid(seen.time_s)
    know, damping = known_states(fits, k, times)
    one = _Flight(times, know, *_steps(times, damping), at, *white, weight, u[:, s > 1e-9 * s.max()])
    moved = one.projected(np.concatenate([residual[:, :, None], rows[:, :, STATES:]], 2))
    return one, moved[:, 0], moved[:, 1:]


def _grid(time_s: Array) -> tuple[Array, NDArray[np.int64]]:
    """Times (S,) that divide every interval between seen frames, no step longer than a frame's share, and where the
    frames are among them."""
    period = float(np.median(np.diff(time_s)))
    steps = np.maximum(np.round(np.diff(time_s) / period).astype(int), 1) * SUBSTEPS
    at = np.concatenate([[0], np.cumsum(steps)])
    return np.interp(np.arange(at[-1] + 1), at, time_s), at


def _steps(times: Array, damping: Array) -> tuple[Array, Array]:
    """What each step of the trapezoid rule makes of the velocity, and of the sum of the accelerations at its ends
    (S - 1, 3, 3), implicit in what ``damping`` (S, 3, 3; 1/s) makes of the velocity."""
    half = 0.5 * np.diff(times)[:, None, None]
    inverse = np.linalg.inv(np.eye(3) - half * damping[1:])
    return np.ascontiguousarray(inverse @ (np.eye(3) + half * damping[:-1])), np.ascontiguousarray(half * inverse)


@making_arrays
def _respond(times: Array, turn: Array, pushed: Array, given: Array, at: NDArray[np.int64], rows: Array) -> None:
    """``rows`` (N, 3, T): displacements at the places ``at`` (N,) under accelerations ``given`` (S, 3, T), from rest at
    the first, by the steps of :func:`_steps`."""
    count = given.shape[2]
    speed, ahead, moved = np.zeros((3, count)), np.zeros((3, count)), np.zeros((3, count))
    rows[0] = 0.0
    seen = 1
    for i in range(len(times) - 1):
        half = 0.5 * (times[i + 1] - times[i])
        for m in range(3):
            a, b, c = turn[i, m, 0], turn[i, m, 1], turn[i, m, 2]
            d, e, f = pushed[i, m, 0], pushed[i, m, 1], pushed[i, m, 2]
            for j in range(count):  # one expression in its order: many terms at once
                ahead[m, j] = (
                    a * speed[0, j] + d * (given[i, 0, j] + given[i + 1, 0, j])
                    + b * speed[1, j] + e * (given[i, 1, j] + given[i + 1, 1, j])
                    + c * speed[2, j] + f * (given[i, 2, j] + given[i + 1, 2, j])
                )  # fmt: skip
        for m in range(3):
            for j in range(count):
                moved[m, j] += half * (speed[m, j] + ahead[m, j])
        speed, ahead = ahead, speed
        if seen < len(at) and at[seen] == i + 1:
            rows[seen] = moved
            seen += 1


def _fill(one: _Flight, shared: SharedTerms, out: Array, answered: Callable[[_Flight, Array, Array], object]) -> None:
    """What terms make of one flight (``out``, a column each), so many at a time as stay near the processor;
    ``answered``: what accelerations do, :func:`_columns` or :func:`_sums`."""
    states = len(one.times)
    pushed, value = np.empty((states, len(shared.directions), 3)), np.empty((states, len(shared.factors)))
    shared_values(shared, one.know, pushed, value)
    room = np.empty(states * 3 * AT_ONCE)
    for first in range(0, out.shape[1], AT_ONCE):
        own = out[:, first : first + AT_ONCE]
        given = room[: states * 3 * own.shape[1]].reshape(states, 3, own.shape[1])
        shared_pushes(shared, first, pushed, value, given)
        answered(one, given, own)


def _given(one: _Flight, packed: Array) -> Array:
    """Accelerations (S, 3, T) of packed terms."""
    given = np.empty((len(one.times), 3, len(packed)))
    pushes(packed, one.know, given)
    return given


def _columns(one: _Flight, given: Array, out: Array | None = None) -> Array:
    """What accelerations ``given`` (S, 3, C) make of the frames: whitened, without the start state, (3 N, C)."""
    rows = _moved(one, given)
    whiten(rows, np.zeros(rows.shape[:2]), one.place, one.angle)
    return one.projected(rows, out)


def _sums(one: _Flight, given: Array, out: NDArray[np.float32]) -> None:
    """The same as smooth functions see it, (R, C)."""
    seen = np.matmul(one.smooth.sums, _moved(one, given).swapaxes(0, 1)).reshape(out.shape)
    out[:] = one.smooth.left(seen)


def _moved(one: _Flight, given: Array) -> Array:
    """By how much accelerations ``given`` (S, 3, C) move the frames (N, 3, C)."""
    rows = np.empty((len(one.at), *given.shape[1:]))
    _respond(one.times, one.turn, one.pushed, given, one.at, rows)
    return rows
