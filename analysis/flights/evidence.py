"""What the flights of a run say about the parameters that all flights share, as one quadratic form.

Shared unknowns - floor friction, every effect and probe of :mod:`analysis.flights.equation.model`, the markers' origin
against the centre of mass, the lens residual - enter linearised about the current fit.  Eliminating each flight's own
start state (Schur complement) leaves
``misfit - 2 d.score + d.information.d`` per run, on which candidates are fitted, ranked and cross-validated by linear
algebra alone.  Errors of the frames of a flight go together (:mod:`analysis.flights.noise`); residuals are whitened
before they are squared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, making_arrays
from analysis.flights.cutting.pieces import seen_frames
from analysis.flights.equation.model import ANGLE, STATES, X, Y
from analysis.flights.equation.parameters import PARAMETERS
from analysis.flights.fit import SHARED, FlightFits
from analysis.flights.noise import GROSS_SD, PLAIN, FlightNoise
from analysis.flights.single_flight import whiten
from analysis.statistics.robust import covariance_of
from ovines.robust import middle

Array = NDArray[np.float64]

# A flight whose misfit per degree of freedom is this many times the run's median holds something else than flight (a
# hidden impact, a wrong track); it is counted and left out, not allowed to speak for the floor.
OUTLYING_FLIGHT = 8.0
# ... of at least so much: stated sds may be too large.
LEAST_USUAL_MISFIT = 0.3
# Ridge of a flight's own state, over its information and absolute: rounding's.
STATE_RIDGE, LEAST_INFORMATION = 1e-10, 1e-12


@dataclass(frozen=True, eq=False)
class Evidence:
    """Quadratic form of one run in the shared unknowns ``columns`` (indices into ``SHARED``).

    ``count`` observations, ``flights`` used, ``left_out`` flights (too much misfit); ``parts``: information and score
    of each flight.
    """

    columns: tuple[int, ...]
    information: Array
    score: Array
    misfit: float
    count: int
    flights: int
    left_out: int
    parts: tuple[tuple[Array, Array], ...] = ()

    def take(self, columns: Sequence[int]) -> tuple[Array, Array]:
        """Information and score of a subset of the columns."""
        at = [self.columns.index(c) for c in columns]
        return self.information[np.ix_(at, at)], self.score[at]

    def only(self, columns: Sequence[int]) -> Evidence:
        """The same in some of the columns, the others held."""
        at = [self.columns.index(c) for c in columns]
        information, score = self.take(columns)
        parts = tuple((one[np.ix_(at, at)], other[at]) for one, other in self.parts)
        return replace(self, columns=tuple(columns), information=information, score=score, parts=parts)


@dataclass(frozen=True, eq=False)
class FlightRows:
    """One flight linearised: frames ``index`` (N,) at ``time_s``, derivatives ``rows`` (N, 3, STATES + P) of x, y and
    angle with respect to its own state and the shared columns, their ``residual`` and ``sd`` (N, 3)."""

    index: NDArray[np.int64]
    time_s: Array
    rows: Array
    residual: Array
    sd: Array
    #: what :mod:`analysis.flights.unknown_force` makes of it, by the noise
    kept: dict[Any, Any] = field(default_factory=dict)

    @cached_property
    def period_s(self) -> float:
        """Median time between two of its frames."""
        return middle(np.diff(self.time_s))

    @cached_property
    def usual_sd(self) -> Array:
        """Sd (2,) of a place (m) and of the angle (rad) in its usual frame."""
        return np.array([middle(self.sd[:, 0]), middle(self.sd[:, 2])])


@dataclass(frozen=True, eq=False)
class RunRows:
    """Flights of one run that may speak for what all share, linearised in the shared ``columns``; ``left_out``: how
    many may not.
    """

    columns: tuple[int, ...]
    flights: tuple[FlightRows, ...]
    left_out: int


def linearised(fits: FlightFits, columns: Sequence[int], good: NDArray[np.bool_] | None = None) -> RunRows:
    """The flights of one run about where they were fitted: those that are ``good`` (F,), by default
    :func:`usable_flights`.
    """
    good = usable_flights(fits) if good is None else good
    return RunRows(
        tuple(columns), tuple(flight_rows(fits, int(k), columns) for k in np.flatnonzero(good)), int((~good).sum())
    )


def gather(
    fits: FlightFits, columns: Sequence[int], noise: FlightNoise = PLAIN, median_misfit: float | None = None
) -> Evidence:
    """The quadratic form of one run at its fitted flights, the frames' errors being ``noise``."""
    return weighed(linearised(fits, columns, usable_flights(fits, median_misfit)), noise)


def weighed(run: RunRows, noise: FlightNoise) -> Evidence:
    """The quadratic form of one run, the frames' errors being ``noise``."""
    p = len(run.columns)
    sums = np.zeros(2)
    informations, scores = np.zeros((len(run.flights), p, p)), np.zeros((len(run.flights), p))
    for flight, information, score in zip(run.flights, informations, scores, strict=True):
        sd = flight.sd
        white = noise.whitening(
            flight.index, flight.time_s, np.ascontiguousarray(sd[:, 0]), np.ascontiguousarray(sd[:, 2])
        )
        _weigh(flight, white, information, score, sums)
    return Evidence(
        run.columns,
        informations.sum(0),
        scores.sum(0),
        float(sums[0]),
        int(sums[1]),
        len(run.flights),
        run.left_out,
        tuple(zip(informations, scores, strict=True)),
    )


def without_own(evidence: Evidence, own: Sequence[int], weight: Array) -> Evidence:
    """``evidence`` of a run with the unknowns ``own``, which the run shares with no other, solved for; ``weight``:
    their prior 1/variance about zero.

    ``parts`` hold the flights' information and score with the run's own unknowns at their best; the prior's is none of
    them."""
    if not own:
        return evidence
    kept = [c for c in evidence.columns if c not in own]
    at, out = ([evidence.columns.index(c) for c in some] for some in (kept, own))
    inverse = covariance_of(evidence.information[np.ix_(out, out)] + np.diag(weight))
    gain = evidence.information[np.ix_(at, out)] @ inverse

    def reduced(information: Array, score: Array) -> tuple[Array, Array]:
        shown = information[:, out] @ inverse
        information = information[:, at] - shown @ evidence.information[np.ix_(out, at)]
        score = score - shown @ evidence.score[out]
        return information[at] - gain @ information[out], score[at] - gain @ score[out]

    return replace(
        evidence,
        columns=tuple(kept),
        information=evidence.information[np.ix_(at, at)] - gain @ evidence.information[np.ix_(out, at)],
        score=evidence.score[at] - gain @ evidence.score[out],
        misfit=evidence.misfit - float(evidence.score[out] @ inverse @ evidence.score[out]),
        parts=tuple(reduced(*part) for part in evidence.parts),
    )


def usable_flights(fits: FlightFits, median_misfit: float | None = None) -> NDArray[np.bool_]:
    """Which flights may speak for what all share: with frames enough, and no misfit far above the usual one
    (``median_misfit``, or this run's).

    A disk at rest shows no force: whatever acts on it, the floor's friction takes up."""
    ratio = fits.misfit / np.maximum(fits.freedom, 1)
    moving = np.array([not fits.rests(k) for k in range(len(fits.flights))], bool)
    usual = (
        median_misfit
        if median_misfit is not None
        else (float(np.median(ratio[fits.freedom > 0])) if np.any(fits.freedom > 0) else 1.0)
    )
    good = np.asarray((ratio < OUTLYING_FLIGHT * max(usual, LEAST_USUAL_MISFIT)) & (fits.freedom >= 3) & moving, bool)
    good[list(fits.gross)] = False
    return good


def flight_rows(fits: FlightFits, k: int, columns: Sequence[int]) -> FlightRows:
    """Flight ``k`` linearised in its own state and the shared ``columns``, those of the flight model first."""
    run = fits.run
    free, offsets = _free_and_offsets(tuple(columns))
    index = seen_frames(run, fits.flights[k])
    time_s = run.time_s[index]
    states, derivative = fits.flown(k, time_s, free=free)
    rows, residual = np.empty((len(index), 3, STATES + len(columns))), np.empty((len(index), 3))
    _fill(states, derivative, fits.measured(index), run.lens_terms[index], fits.shared[:2], offsets, rows, residual)
    sd = np.empty((len(index), 3))
    sd[:, 0] = sd[:, 1] = run.xy_sd_m[index]
    sd[:, 2] = run.angle_sd_rad[index]
    return FlightRows(index, time_s, rows, residual, sd)


@lru_cache(maxsize=256)
def _free_and_offsets(columns: tuple[int, ...]) -> tuple[tuple[int, ...], NDArray[np.int64]]:
    """The ``columns`` of the flight model, and those of the markers' origin and the lens residual, counted from the
    first of these."""
    free = tuple(c for c in columns if c < len(PARAMETERS))
    return free, np.array([c - len(PARAMETERS) for c in columns[len(free) :]], np.int64)


@compiled
def _fill(
    states: Array,
    derivative: Array,
    seen: Array,
    lens: Array,
    origin: Array,
    offsets: NDArray[np.int64],
    rows: Array,
    residual: Array,
) -> None:
    """``rows`` (N, 3, S + P) and ``residual`` (N, 3) of frames ``seen`` (N, 3): markers' x, y and angle against
    ``states`` (N, 6) and their ``derivative`` (N, 6, S + F), ``lens`` (N, L) polynomials at the frames' places."""
    known, powers = derivative.shape[2], lens.shape[1]
    for i in range(len(states)):
        c, s = np.cos(states[i, ANGLE]), np.sin(states[i, ANGLE])
        residual[i, 0] = seen[i, 0] - (states[i, X] + c * origin[0] - s * origin[1])
        residual[i, 1] = seen[i, 1] - (states[i, Y] + s * origin[0] + c * origin[1])
        residual[i, 2] = seen[i, 2] - states[i, ANGLE]
        for m in range(3):
            for j in range(known):
                rows[i, m, j] = derivative[i, m, j]
        rows[i, 0, ANGLE] -= s * origin[0] + c * origin[1]
        rows[i, 1, ANGLE] += c * origin[0] - s * origin[1]
        for j in range(len(offsets)):
            o, x, y = offsets[j], 0.0, 0.0
            if o == 0:
                x, y = c, s
            elif o == 1:
                x, y = -s, c
            elif o < 2 + powers:
                x = lens[i, o - 2]
            else:
                y = lens[i, o - 2 - powers]
            rows[i, 0, known + j], rows[i, 1, known + j], rows[i, 2, known + j] = x, y, 0.0


def _weigh(flight: FlightRows, white: tuple[Array, Array], total: Array, score: Array, sums: Array) -> None:
    """Add what a flight says of the shared unknowns (:func:`_without_states`), its frames whitened by the triangles
    ``white`` of places and angles (N, N)."""
    own_rows, own = flight.rows.copy(), flight.residual.copy()
    whiten(own_rows, own, white[0], white[1])
    _without_states(own_rows, own, total, score, sums)


@making_arrays
def _without_states(rows: Array, residual: Array, total: Array, score: Array, sums: Array) -> None:
    """Add to ``total`` (P, P), ``score`` (P,) and ``sums`` (2,) what whitened ``rows`` (N, 3, STATES + P) say of the
    shared unknowns once the flight's own state is solved for.
    """
    n = len(rows)
    for i in range(n):
        for m in range(3):
            if abs(residual[i, m]) > GROSS_SD:
                less = GROSS_SD / abs(residual[i, m])
                residual[i, m] *= less
                rows[i, m] *= less
    rows, residual = rows.reshape(3 * n, rows.shape[2]), residual.reshape(3 * n)
    local = np.ascontiguousarray(rows[:, :STATES])
    outer = np.ascontiguousarray(rows[:, STATES:])
    normal = local.T @ local
    size = np.empty(STATES)
    for a in range(STATES):
        normal[a, a] += STATE_RIDGE * normal[a, a] + LEAST_INFORMATION
        size[a] = np.sqrt(normal[a, a])
    # Unit diagonal first: an angle that nobody saw has twenty orders of magnitude less information than a place.
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    # Residual rows first, then their squares: the difference of the squares may come out below zero.
    own = outer - local @ (inverse @ (local.T @ outer))
    unexplained = residual - local @ (inverse @ (local.T @ residual))
    total += own.T @ own
    score += own.T @ unexplained
    sums[0] += np.dot(unexplained, unexplained)
    sums[1] += len(residual) - STATES


def columns_of(names: Sequence[str]) -> list[int]:
    """Indices into ``SHARED``; those of the flight model come first, as :func:`gather` orders them."""
    indices = [SHARED.index(name) for name in names]
    return sorted(indices)


def solve(evidence: Sequence[Evidence], columns: Sequence[int], prior: Array) -> tuple[Array, Array, float]:
    """Estimate, covariance and gain (fall of -2 log L) of the shared unknowns ``columns`` over runs; ``prior`` their
    1/variance.
    """
    information = np.diag(np.asarray(prior, float))
    score = np.zeros(len(columns))
    for e in evidence:
        a, b = e.take(columns)
        information = information + a
        score = score + b
    covariance = covariance_of(information)
    score = np.where(np.diag(covariance) > 0, score, 0.0)
    estimate = covariance @ score
    return estimate, covariance, float(estimate @ score)
