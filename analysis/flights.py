"""Flights between impacts, each fitted with the simulator's own flight model to the positions, never to derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flight_model import PARAMETERS, STATES, fly_with_derivatives, fly_with_velocity_derivatives
from analysis.host_motion import HostMotion

Array = NDArray[np.float64]

WARP_DEGREE = 4
#: powers (i, j) of the lens-residual polynomials x^i y^j in units of the contact radius
WARP_POWERS = [(d - j, j) for d in range(1, WARP_DEGREE + 1) for j in range(d + 1)]
ORIGIN = ["origin_x", "origin_y"]
WARP = [f"warp_{axis}_{i}{j}" for axis in "xy" for i, j in WARP_POWERS]
# Frames whose parabola is the first guess of a flight: friction turns within longer stretches.
START_FRAMES = 12
# A Host's overtone known to 0.2 um leaves the mean speed of a disk that slides to and fro open by 40 um/s, which no covariance of a flight
# holds: over this time it stays near the cameras' noise, and impacts under a strong drive are closer.
LONGEST_FLIGHT_S = 0.15
FEWEST_IN_PIECE = 8
#: every shared unknown, in the order of the columns of the evidence
SHARED: list[str] = [*PARAMETERS, *ORIGIN, *WARP]

@dataclass(frozen=True, eq=False)
class RunData:
    """What the fit needs of one run: N frames; NaN where the NES was not seen."""

    name: str
    time_s: Array
    xy_m: Array
    angle_rad: Array
    xy_sd_m: Array
    angle_sd_rad: Array
    host: HostMotion
    contact_radius_m: float
    radius_m: float
    inertia_factor: float


@dataclass(frozen=True, eq=False)
class Flight:
    """Frames ``first..last`` of free flight; ``joined``: the next flight starts where this one ends, at an impact; ``goes_on``: the next
    is the same flight, cut for its length."""

    first: int
    last: int
    joined: bool
    goes_on: bool = False


def _arguments(run: RunData) -> tuple[Any, ...]:
    return (run.host.harmonics, run.host.omega_rad_per_s, run.radius_m, run.inertia_factor, run.contact_radius_m, run.host.phase_rad)


def flights_from_segments(seen: NDArray[np.bool_], gaps: Sequence[int], contact: NDArray[np.int64], longest_hole: int = 6,
                          fewest: int = 3) -> list[Flight]:
    """Flights between kinks, contact stretches and holes of more than ``longest_hole`` unseen frames; too short ones are dropped."""
    n = len(seen)
    blocked = np.zeros(n, bool)
    for first, last in contact:
        blocked[first:last + 1] = True
    cuts = {int(g) for g in gaps}
    flights: list[Flight] = []
    start: int | None = None
    last_seen = -1
    pieces: list[tuple[int, int, bool]] = []
    for i in range(n):
        if blocked[i]:
            if start is not None:
                pieces.append((start, last_seen, False))
                start = None
            continue
        if seen[i]:
            if start is not None and i - last_seen > longest_hole + 1:
                pieces.append((start, last_seen, False))
                start = i
            start = i if start is None else start
            last_seen = i
        if i in cuts and start is not None:
            pieces.append((start, last_seen, i + 1 < n and not blocked[i + 1]))
            start = None
    if start is not None:
        pieces.append((start, last_seen, False))
    for k, (first, last, joined) in enumerate(pieces):
        if np.count_nonzero(seen[first:last + 1]) < fewest:
            # A single frame between two kinks was exposed across an impact: the flights on both sides still meet there.  (A real
            # flight that short means impacts below 0.1 m/s, which are not looked for.)
            smeared = np.count_nonzero(seen[first:last + 1]) <= 1 and joined and last - first <= 1
            if flights and not smeared:
                flights[-1] = Flight(flights[-1].first, flights[-1].last, False)
            continue
        follows = joined and k + 1 < len(pieces)
        flights.append(Flight(first, last, follows))
    return flights


def shortened(flights: Sequence[Flight], time_s: Array, seen: NDArray[np.bool_]) -> list[Flight]:
    """``flights`` with those longer than :data:`LONGEST_FLIGHT_S` cut into equal pieces, each of which is fitted by itself."""
    pieces: list[Flight] = []
    for flight in flights:
        frames = np.flatnonzero(seen[flight.first:flight.last + 1]) + flight.first
        count = int(np.ceil((time_s[flight.last] - time_s[flight.first]) / LONGEST_FLIGHT_S))
        parts = np.array_split(frames, max(min(count, len(frames) // FEWEST_IN_PIECE), 1))
        pieces += [Flight(int(part[0]), int(part[-1]), False, goes_on=True) for part in parts[:-1]]
        pieces.append(replace(flight, first=int(parts[-1][0]) if len(parts) > 1 else flight.first))
    return pieces


@compiled
def start_state(time: Array, x: Array, y: Array, angle: Array, first: int, last: int, t0: float, out: Array) -> None:
    """Parabola through a flight's positions and straight line through its angles: where the fit starts."""
    for quantity in range(3):
        size = 2 if quantity == 2 or last - first < 3 else 3
        normal, right = np.zeros((size, size)), np.zeros(size)
        row = np.empty(3)
        for i in range(first, last + 1):
            value = x[i] if quantity == 0 else (y[i] if quantity == 1 else angle[i])
            if not np.isfinite(value) or not np.isfinite(x[i]):
                continue
            s = (time[i] - t0) * 100
            row[0], row[1], row[2] = 1.0, s, s * s
            for a in range(size):
                right[a] += row[a] * value
                for b in range(size):
                    normal[a, b] += row[a] * row[b]
        for a in range(size):
            normal[a, a] += 1e-9
        solution = np.linalg.solve(normal, right)
        out[quantity] = solution[0]
        out[3 + quantity] = solution[1] * 100


def warp_basis(xy_m: Array, contact_radius_m: float) -> Array:
    """(N, len(WARP_POWERS)) polynomials of the place in the room."""
    x, y = xy_m[:, 0] / contact_radius_m, xy_m[:, 1] / contact_radius_m
    return np.stack([x**i * y**j for i, j in WARP_POWERS], -1)


@compiled
def whiten(rows: Array, residual: Array, decay: Array) -> None:
    """Standardised ``residual`` (N, 3) and its derivatives ``rows`` (N, 3, P) to those of independent errors, in place."""
    for i in range(len(decay) - 1, 0, -1):
        rho = decay[i]
        if rho == 0.0:
            continue
        scale = 1.0 / np.sqrt(1.0 - rho * rho)
        for m in range(3):
            residual[i, m] = (residual[i, m] - rho * residual[i - 1, m]) * scale
            for a in range(rows.shape[2]):
                rows[i, m, a] = (rows[i, m, a] - rho * rows[i - 1, m, a]) * scale


def decay_between(index: NDArray[np.int64], correlation: float) -> Array:
    """Correlation (N,) of the error in each of the frames ``index`` with that in the one before it in the list; 0 for the first."""
    decay = np.zeros(len(index))
    if correlation > 0.0:
        decay[1:] = correlation ** np.diff(index)
    return decay


@compiled
def fit_single(start: Array, t0: float, time: Array, x: Array, y: Array, angle: Array, sd: Array, sd_angle: Array, decay: Array,
               parameters: Array, origin: Array, harmonics: Array, omega: float, radius: float, inertia: float, contact_radius: float,
               phase: float, covariance: Array) -> float:
    """One flight alone: Levenberg-Marquardt on its six unknowns; ``start`` is moved to the best state.

    ``decay`` (N,): correlation of each frame's error with that of the frame before (AR(1)); residuals are whitened by it.  Returns the misfit
    (sum of squares of Huber-clipped standardised residuals, cut at 5) and fills ``covariance`` (6, 6).
    """
    n = len(time)
    out, derivative = np.empty((n, 6)), np.empty((n, 6, 6))
    rows, residual = np.empty((n, 3, 6)), np.empty((n, 3))
    damping, best = 1e-6, np.inf
    normal, right = np.zeros((6, 6)), np.zeros(6)
    state, trial = start.copy(), start.copy()
    fitted = np.zeros((6, 6))
    for _ in range(25):
        fly_with_velocity_derivatives(trial, t0, time, parameters, harmonics, omega, radius, inertia, contact_radius, phase, out,
                                      derivative)
        misfit = 0.0
        normal[:] = 0.0
        right[:] = 0.0
        for i in range(n):
            c, s = np.cos(out[i, 2]), np.sin(out[i, 2])
            residual[i, 0] = (x[i] - out[i, 0] - c * origin[0] + s * origin[1]) / sd[i]
            residual[i, 1] = (y[i] - out[i, 1] - s * origin[0] - c * origin[1]) / sd[i]
            residual[i, 2] = (angle[i] - out[i, 2]) / sd_angle[i]
            for a in range(6):
                rows[i, 0, a], rows[i, 1, a] = derivative[i, 0, a] / sd[i], derivative[i, 1, a] / sd[i]
                rows[i, 2, a] = derivative[i, 2, a] / sd_angle[i]
        whiten(rows, residual, decay)
        for i in range(n):
            for m in range(3):
                r = residual[i, m]
                robust = 1.0 if abs(r) < 5.0 else 5.0 / abs(r)
                misfit += r * r * robust
                for a in range(6):
                    da = rows[i, m, a]
                    right[a] += da * r * robust
                    for b in range(a + 1):
                        normal[a, b] += da * rows[i, m, b] * robust
        for a in range(6):
            for b in range(a):
                normal[b, a] = normal[a, b]
        if misfit <= best:
            gained = best - misfit
            best = misfit
            state[:] = trial
            fitted[:] = normal
            kept_right = right.copy()
            damping = max(damping * 0.2, 1e-12)
            # A thousandth in chi-square moves a state by a thirtieth of its sd at most.
            if gained < 1e-3 + 1e-7 * misfit:
                break
        else:
            if misfit - best < 1e-3 + 1e-7 * misfit:
                break
            damping = max(damping * 10, 1e-4)
            if damping > 1e8:
                break
        system = fitted.copy()
        for a in range(6):
            system[a, a] = system[a, a] * (1 + damping) + 1e-12
        step = np.linalg.solve(system, kept_right)
        for a in range(6):
            trial[a] = state[a] + step[a]
    for a in range(6):
        fitted[a, a] += 1e-9 * fitted[a, a] + 1e-12
    covariance[:] = np.linalg.inv(fitted)
    start[:] = state
    return best


def fit_flights(run: RunData, flights: Sequence[Flight], parameters: Array, shared: Array, start: FlightFits | None = None,
                correlation: float = 0.0) -> FlightFits:
    """Each flight alone (no continuity): states, covariances and misfits, robust against single wrong frames.

    ``correlation`` of neighbouring frames' errors (AR(1)).  ``start``: an earlier fit of the same flights to begin from (other parameters, say); the minimum is the same, found sooner."""
    states, covariances = np.empty((len(flights), STATES)), np.empty((len(flights), STATES, STATES))
    reference, misfit, freedom = np.empty(len(flights)), np.empty(len(flights)), np.empty(len(flights), np.int64)
    arguments = _arguments(run)
    for k, f in enumerate(flights):
        index = np.arange(f.first, f.last + 1)
        index = index[np.isfinite(run.xy_m[index, 0])]
        # From the first frame on: friction forgets what it has stopped, so that from behind a rest no path leads back.
        reference[k] = run.time_s[f.first]
        if start is None:
            few = int(index[:START_FRAMES][-1])
            start_state(run.time_s, run.xy_m[:, 0], run.xy_m[:, 1], run.angle_rad, f.first, few, reference[k], states[k])
        else:
            states[k] = start.states[k]
        lens = warp_basis(run.xy_m[index], run.contact_radius_m)
        n = len(WARP_POWERS)
        misfit[k] = fit_single(states[k], reference[k], run.time_s[index], run.xy_m[index, 0] - lens @ shared[2:2 + n],
                               run.xy_m[index, 1] - lens @ shared[2 + n:], run.angle_rad[index], run.xy_sd_m[index],
                               run.angle_sd_rad[index], decay_between(index, correlation), parameters, shared[:2], *arguments,
                               covariances[k])
        freedom[k] = 3 * len(index) - STATES
    return FlightFits(run, tuple(flights), reference, states, covariances, misfit, freedom, parameters, shared)


@dataclass(frozen=True, eq=False)
class FlightFits:
    """Flights fitted one by one: ``states`` (F, 6) at ``reference_s``, ``covariances`` (F, 6, 6), ``misfit`` against ``freedom``."""

    run: RunData
    flights: tuple[Flight, ...]
    reference_s: Array
    states: Array
    covariances: Array
    misfit: Array
    freedom: NDArray[np.int64]
    parameters: Array
    shared: Array

    def propagate(self, k: int, times: Array) -> tuple[Array, Array]:
        """States (n, 6) of flight k at sorted ``times`` and their covariances (n, 6, 6)."""
        out, derivative = np.empty((len(times), STATES)), np.empty((len(times), STATES, STATES))
        fly_with_derivatives(self.states[k], self.reference_s[k], np.ascontiguousarray(times), self.parameters,
                             np.zeros(0, np.int64), np.zeros(0), *_arguments(self.run), out, derivative)
        return out, derivative @ self.covariances[k] @ derivative.transpose(0, 2, 1)
