"""One flight alone, compiled: a parabola to start from, then Levenberg-Marquardt on its six unknowns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flights.model import STATES, FlightRig, fly_with_velocity_derivatives
from analysis.flights.noise import CLIP_SD

Array = NDArray[np.float64]

# Levenberg-Marquardt of a flight's state.  A thousandth in chi-square moves a state by a thirtieth of its sd at most.
MOST_STEPS, FIRST_DAMPING, LEAST_DAMPING, RAISED_DAMPING, MOST_DAMPING = 25, 1e-6, 1e-12, 1e-4, 1e8
LESS_DAMPING, MORE_DAMPING = 0.2, 10.0
CONVERGED, CONVERGED_SHARE = 1e-3, 1e-7
# Ridges, relative and absolute, that keep an angle which nobody measured from a singular matrix: rounding's size.
RELATIVE_RIDGE, RIDGE = 1e-9, 1e-12
# Unit of time of the parabola that a fit starts from (1/s): a flight of a tenth of a second gives it numbers about 1.
PER_S, START_RIDGE = 100.0, 1e-9


class WhiteFrames(NamedTuple):
    """A flight's frames as its fit takes them: ``time_s`` (N,), ``observed`` (N, 3: x, y, angle) without the lens
    residual, and what whitens their errors: ``place``, ``angle`` (N, N) of
    :meth:`analysis.flights.noise.FlightNoise.whitening`.
    """

    time_s: Array
    observed: Array
    place: Array
    angle: Array


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
            s = (time[i] - t0) * PER_S
            row[0], row[1], row[2] = 1.0, s, s * s
            for a in range(size):
                right[a] += row[a] * value
                for b in range(size):
                    normal[a, b] += row[a] * row[b]
        for a in range(size):
            normal[a, a] += START_RIDGE
        solution = np.linalg.solve(normal, right)
        out[quantity] = solution[0]
        out[3 + quantity] = solution[1] * PER_S


@compiled
def whiten(rows: Array, residual: Array, place: Array, angle: Array) -> None:
    """``residual`` (N, 3: x, y, angle) and its derivatives ``rows`` (N, 3, P) to those of independent errors, in place.

    ``place``, ``angle`` (N, N): :meth:`analysis.flights.noise.FlightNoise.whitening`."""
    for m in range(3):
        triangle = angle if m == 2 else place
        residual[:, m] = triangle @ np.ascontiguousarray(residual[:, m])
        rows[:, m, :] = triangle @ np.ascontiguousarray(rows[:, m, :])


@compiled
def _rows(out: Array, derivative: Array, frames: WhiteFrames, origin: Array, rows: Array, residual: Array) -> None:
    """Whitened ``residual`` (N, 3) of the ``frames`` against states ``out`` and its derivatives ``rows`` (N, 3, 6)."""
    for i in range(len(out)):
        c, s = np.cos(out[i, 2]), np.sin(out[i, 2])
        residual[i, 0] = frames.observed[i, 0] - out[i, 0] - c * origin[0] + s * origin[1]
        residual[i, 1] = frames.observed[i, 1] - out[i, 1] - s * origin[0] - c * origin[1]
        residual[i, 2] = frames.observed[i, 2] - out[i, 2]
        for m in range(3):
            for a in range(STATES):
                rows[i, m, a] = derivative[i, m, a]
    whiten(rows, residual, frames.place, frames.angle)


@compiled
def _normal_equations(rows: Array, residual: Array, normal: Array, right: Array) -> float:
    """Huber-weighted ``normal`` (6, 6) and ``right`` (6,) of whitened rows; returns the misfit."""
    misfit = 0.0
    normal[:] = 0.0
    right[:] = 0.0
    for i in range(len(rows)):
        for m in range(3):
            r = residual[i, m]
            robust = 1.0 if abs(r) < CLIP_SD else CLIP_SD / abs(r)
            misfit += r * r * robust
            for a in range(STATES):
                da = rows[i, m, a]
                right[a] += da * r * robust
                for b in range(a + 1):
                    normal[a, b] += da * rows[i, m, b] * robust
    for a in range(STATES):
        for b in range(a):
            normal[b, a] = normal[a, b]
    return misfit


@compiled
def fit_single(
    start: Array, t0: float, frames: WhiteFrames, p: Array, origin: Array, rig: FlightRig, covariance: Array
) -> float:
    """One flight alone: Levenberg-Marquardt on its six unknowns; ``start`` is moved to the best state at t0.

    ``p`` parameters of the flight, ``origin`` (2,) of the markers (m).  Returns the misfit (sum of squares of whitened
    residuals, Huber's weights beyond :data:`analysis.flights.noise.CLIP_SD`) and fills ``covariance`` (6, 6).
    """
    n = len(frames.time_s)
    out, derivative = np.empty((n, STATES)), np.empty((n, STATES, STATES))
    rows, residual = np.empty((n, 3, STATES)), np.empty((n, 3))
    damping, best = FIRST_DAMPING, np.inf
    normal, right = np.zeros((STATES, STATES)), np.zeros(STATES)
    state, trial = start.copy(), start.copy()
    fitted, kept_right = np.zeros((STATES, STATES)), np.zeros(STATES)
    for _ in range(MOST_STEPS):
        fly_with_velocity_derivatives(trial, t0, frames.time_s, p, rig, out, derivative)
        _rows(out, derivative, frames, origin, rows, residual)
        misfit = _normal_equations(rows, residual, normal, right)
        if misfit <= best:
            gained = best - misfit
            best = misfit
            state[:] = trial
            fitted[:] = normal
            kept_right[:] = right
            damping = max(damping * LESS_DAMPING, LEAST_DAMPING)
            if gained < CONVERGED + CONVERGED_SHARE * misfit:
                break
        else:
            if misfit - best < CONVERGED + CONVERGED_SHARE * misfit:
                break
            damping = max(damping * MORE_DAMPING, RAISED_DAMPING)
            if damping > MOST_DAMPING:
                break
        system = fitted.copy()
        for a in range(STATES):
            system[a, a] = system[a, a] * (1 + damping) + RIDGE
        step = np.linalg.solve(system, kept_right)
        for a in range(STATES):
            trial[a] = state[a] + step[a]
    for a in range(STATES):
        fitted[a, a] += RELATIVE_RIDGE * fitted[a, a] + RIDGE
    covariance[:] = np.linalg.inv(fitted)
    start[:] = state
    return best
