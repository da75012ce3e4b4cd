"""One flight alone, compiled: its path with derivatives, and its fit - a parabola to start from, then
Levenberg-Marquardt on its six unknowns.

Derivatives follow from the variational equation, along the one path that is integrated: each step of the integration is
differentiated as it is taken.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, making_arrays
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation.law_slopes import LawWork, law_work
from analysis.flights.equation.model import (
    ANGLE,
    SPIN,
    STATES,
    VX,
    VY,
    X,
    Y,
    first_after,
    fly,
    in_turn,
    step_within,
    strongest_acceleration,
)
from analysis.flights.equation.slopes import acceleration_slopes
from analysis.flights.noise import CLIP_SD

Array = NDArray[np.float64]

#: of the classical Runge-Kutta method
STAGES = 4
# Levenberg-Marquardt of a flight's state.  A thousandth in chi-square moves a state by a thirtieth of its sd at most.
MOST_STEPS, FIRST_DAMPING, LEAST_DAMPING, RAISED_DAMPING, MOST_DAMPING = 25, 1e-6, 1e-12, 1e-4, 1e8
LESS_DAMPING, MORE_DAMPING = 0.2, 10.0
CONVERGED, CONVERGED_SHARE = 1e-3, 1e-7
# Ridges, relative and absolute, that keep an angle which nobody measured from a singular matrix: rounding's size.
RELATIVE_RIDGE, RIDGE = 1e-9, 1e-12
# Unit of time of the parabola that a fit starts from (1/s): a flight of a tenth of a second gives it numbers about 1.
PER_S, START_RIDGE = 100.0, 1e-9


class SlopeWork(NamedTuple):
    """Arrays that the integration works in: ``rates`` (4, 6) of the Runge-Kutta stages, ``trial`` (6,) state, of each
    stage the acceleration's derivatives ``state`` (4, 3, 6) and ``columns`` (4, 3, 6 + F: none of the start state's);
    ``every`` (3, P), without rows where no parameter is free; what a
    ``law`` is asked in."""

    rates: Array
    trial: Array
    state: Array
    columns: Array
    every: Array
    law: LawWork


class Course(NamedTuple):
    """What stays the same along a flight: parameters, rig, and the bound of its acceleration (m/s^2)."""

    parameters: Array
    rig: FlightRig
    strongest: float


@compiled
def _carry(h: float, state: Array, columns: Array, derivative: Array) -> None:
    """``derivative`` (6, K) of the state after a Runge-Kutta step of h with stages as in :class:`SlopeWork`, from that
    before it."""
    for j in range(derivative.shape[1]):
        x, y, a = derivative[0, j], derivative[1, j], derivative[2, j]
        u, v, w = derivative[3, j], derivative[4, j], derivative[5, j]
        # Rates of the velocities at the stage before, and their sums for velocities and for places.
        du, dv, dw = 0.0, 0.0, 0.0
        eu, ev, ew = 0.0, 0.0, 0.0
        su, sv, sw, px, py, pa = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for stage in range(STAGES):
            c = 0.0 if stage == 0 else (h if stage == STAGES - 1 else 0.5 * h)
            b = 0.0 if stage < 2 else 0.5 * h * (h if stage == STAGES - 1 else 0.5 * h)
            q0, q1, q2 = x + c * u + b * eu, y + c * v + b * ev, a + c * w + b * ew
            q3, q4, q5 = u + c * du, v + c * dv, w + c * dw
            eu, ev, ew = du, dv, dw
            s = state[stage]
            du = s[0, 0] * q0 + s[0, 1] * q1 + s[0, 2] * q2 + s[0, 3] * q3 + s[0, 4] * q4 + s[0, 5] * q5
            dv = s[1, 0] * q0 + s[1, 1] * q1 + s[1, 2] * q2 + s[1, 3] * q3 + s[1, 4] * q4 + s[1, 5] * q5
            dw = s[2, 0] * q0 + s[2, 1] * q1 + s[2, 2] * q2 + s[2, 3] * q3 + s[2, 4] * q4 + s[2, 5] * q5
            du, dv, dw = du + columns[stage, 0, j], dv + columns[stage, 1, j], dw + columns[stage, 2, j]
            weight = 1.0 if stage == 0 or stage == STAGES - 1 else 2.0
            su, sv, sw = su + weight * du, sv + weight * dv, sw + weight * dw
            if stage < STAGES - 1:
                px, py, pa = px + du, py + dv, pa + dw
        derivative[0, j], derivative[1, j] = x + h * u + h * h / 6 * px, y + h * v + h * h / 6 * py
        derivative[2, j] = a + h * w + h * h / 6 * pa
        derivative[3, j], derivative[4, j], derivative[5, j] = u + h / 6 * su, v + h / 6 * sv, w + h / 6 * sw


@compiled
def _advance(
    y: Array, t: float, span: float, course: Course, free: NDArray[np.int64], work: SlopeWork, derivative: Array
) -> None:
    """``y`` (6,) and its ``derivative`` (6, 6 + F) taken ``span`` seconds (either sign) on from t, in place, by the
    steps of :func:`analysis.flights.equation.model.advance`."""
    p, k, trial = course.parameters, work.rates, work.trial
    while span != 0.0:
        h = span
        for stage in range(STAGES):
            c = 0.0 if stage == 0 else (1.0 if stage == STAGES - 1 else 0.5)
            for j in range(STATES):
                trial[j] = y[j] if stage == 0 else y[j] + c * h * k[stage - 1, j]
            a = acceleration_slopes(t + c * h, trial, p, course.rig, work.law, work.state[stage], work.every)
            k[stage, X], k[stage, Y], k[stage, ANGLE] = trial[VX], trial[VY], trial[SPIN]
            k[stage, VX], k[stage, VY], k[stage, SPIN] = a.x, a.y, a.spin
            for m in range(3):
                for j in range(len(free)):
                    work.columns[stage, m, STATES + j] = work.every[m, free[j]]
            if stage == 0:
                h = step_within(span, a.floor_speed, p, course.strongest)
        for j in range(STATES):
            y[j] += h / 6 * (k[0, j] + 2 * k[1, j] + 2 * k[2, j] + k[3, j])
        _carry(h, work.state, work.columns, derivative)
        t += h
        span = span - h if 0.0 < abs(h) < abs(span) else 0.0  # also where a law has no number: then no path has


@making_arrays
def fly_with_derivatives(
    start: Array,
    t0: float,
    times: Array,
    p: Array,
    free: NDArray[np.int64],
    rig: FlightRig,
    out: Array,
    derivative: Array,
) -> None:
    """As ``fly`` (:mod:`analysis.flights.equation.model`), and derivatives (len(times), 6, 6 + len(free)) with respect
    to start state and parameters ``free``, none where ``derivative`` has no rows.
    """
    if len(derivative) == 0:
        fly(start, t0, times, p, rig, out)
        return
    columns = STATES + len(free)
    work = SlopeWork(
        np.empty((STAGES, STATES)),
        np.empty(STATES),
        np.empty((STAGES, 3, STATES)),
        np.zeros((STAGES, 3, columns)),
        np.empty((3 if len(free) > 0 else 0, len(p))),
        law_work(),
    )
    course = Course(p, rig, strongest_acceleration(p, rig))
    y, moved = np.empty(STATES), np.empty((STATES, columns))
    before = first_after(times, t0)
    t = t0
    for number in range(len(times)):
        i: int = in_turn(number, before, len(times))
        if number == 0 or number == len(times) - before:
            t = t0
            y[:] = start
            moved[:] = 0.0
            for j in range(STATES):
                moved[j, j] = 1.0
        _advance(y, t, times[i] - t, course, free, work, moved)
        out[i] = y
        derivative[i] = moved
        t = times[i]


class WhiteFrames(NamedTuple):
    """A flight's frames as its fit takes them: ``time_s`` (N,), ``observed`` (N, 3: x, y, angle) without the lens
    residual, and what whitens their errors: ``place``, ``angle`` (N, N) of
    :meth:`analysis.flights.noise.FlightNoise.whitening`.
    """

    time_s: Array
    observed: Array
    place: Array
    angle: Array


@making_arrays
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


@making_arrays
def whiten(rows: Array, residual: Array, place: Array, angle: Array) -> None:
    """``residual`` (N, 3: x, y, angle) and its derivatives ``rows`` (N, 3, P) to those of independent errors, in place.

    ``place``, ``angle`` (N, N): :meth:`analysis.flights.noise.FlightNoise.whitening`."""
    for m in range(3):
        triangle = angle if m == 2 else place
        residual[:, m] = triangle @ np.ascontiguousarray(residual[:, m])
        rows[:, m, :] = triangle @ np.ascontiguousarray(rows[:, m, :])


@making_arrays
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
def _normal_equations(rows: Array, residual: Array, normal: Array, right: Array) -> tuple[float, float]:
    """Huber-weighted ``normal`` (6, 6) and ``right`` (6,) of whitened rows; returns Huber's loss, of which ``right`` is
    half the slope, and the misfit."""
    loss, misfit = 0.0, 0.0
    normal[:] = 0.0
    right[:] = 0.0
    for i in range(len(rows)):
        for m in range(3):
            r = residual[i, m]
            robust = 1.0 if abs(r) < CLIP_SD else CLIP_SD / abs(r)
            misfit += r * r * robust
            loss += r * r * robust * (2.0 - robust)
            for a in range(STATES):
                da = rows[i, m, a]
                right[a] += da * r * robust
                for b in range(a + 1):
                    normal[a, b] += da * rows[i, m, b] * robust
    for a in range(STATES):
        for b in range(a):
            normal[b, a] = normal[a, b]
    return loss, misfit


@making_arrays
def fit_single(
    start: Array, t0: float, frames: WhiteFrames, p: Array, origin: Array, rig: FlightRig, covariance: Array
) -> float:
    """One flight alone: Levenberg-Marquardt on its six unknowns; ``start`` is moved to the best state at t0.

    ``p`` parameters of the flight, ``origin`` (2,) of the markers (m).  Returns the misfit (sum of squares of whitened
    residuals, with Huber's weights beyond :data:`analysis.flights.noise.CLIP_SD`) and fills ``covariance`` (6, 6).
    """
    n = len(frames.time_s)
    out, derivative = np.empty((n, STATES)), np.empty((n, STATES, STATES))
    rows, residual = np.empty((n, 3, STATES)), np.empty((n, 3))
    damping, best, misfit, none = FIRST_DAMPING, np.inf, np.inf, np.zeros(0, np.int64)
    normal, right = np.zeros((STATES, STATES)), np.zeros(STATES)
    state, trial = start.copy(), start.copy()
    fitted, kept_right = np.zeros((STATES, STATES)), np.zeros(STATES)
    for _ in range(MOST_STEPS):
        fly_with_derivatives(trial, t0, frames.time_s, p, none, rig, out, derivative)
        _rows(out, derivative, frames, origin, rows, residual)
        # What the weights' step makes smaller is Huber's loss: the weighted squares may grow on the way there.
        loss, missed = _normal_equations(rows, residual, normal, right)
        if loss <= best and loss < np.inf:  # a force may throw a flight out of all numbers
            gained = best - loss
            best, misfit = loss, missed
            state[:] = trial
            fitted[:] = normal
            kept_right[:] = right
            damping = max(damping * LESS_DAMPING, LEAST_DAMPING)
            if gained < CONVERGED + CONVERGED_SHARE * loss:
                break
        else:
            if loss - best < CONVERGED + CONVERGED_SHARE * loss:
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
        # What so small a step gains is as good as the parabola says.
        gained = np.dot(step, kept_right)
        if damping < RAISED_DAMPING and gained < CONVERGED + CONVERGED_SHARE * best:
            state[:] = trial
            misfit -= gained
            break
    for a in range(STATES):
        fitted[a, a] += RELATIVE_RIDGE * fitted[a, a] + RIDGE
    covariance[:] = np.linalg.inv(fitted)
    start[:] = state
    return misfit
