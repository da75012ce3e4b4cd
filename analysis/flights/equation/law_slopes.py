"""How a written law answers the state and the parameters of a flight (:mod:`analysis.flights.equation.slopes`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, making_arrays
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation import parameters as P
from analysis.flights.equation.model import ANGLE, STATES, Acceleration, Moment, known_of
from ovines.core.laws import words as W
from ovines.core.laws.kernel import (
    FIXED,
    FLOOR_LEVER,
    FLOOR_TORQUE,
    FRICTION,
    MIRRORED_FRICTION,
    POLAR_FRICTION,
    SPIN,
    push,
)
from ovines.core.laws.quantities import Q_CLOCK, Q_PHASE, Q_RUN, Q_SINCE, Q_TIME

Array = NDArray[np.float64]

# Steps of the differences that a written law is asked by, the only ones: micrometres, tenths of milliradians, 10 um/s
# and mrad/s, each far above rounding and far below what bends a flight.
PLACE_STEP_M, ANGLE_STEP_RAD, VELOCITY_STEP_M_PER_S, SPIN_STEP_RAD_PER_S = 1e-6, 1e-4, 1e-5, 1e-3
LAW_STEPS = (PLACE_STEP_M, PLACE_STEP_M, ANGLE_STEP_RAD, VELOCITY_STEP_M_PER_S, VELOCITY_STEP_M_PER_S,
             SPIN_STEP_RAD_PER_S)  # fmt: skip


class LawWork(NamedTuple):
    """Arrays that a written law is asked in: what is ``known``, what it gives there and with a state ``moved`` (3,),
    and how it answers ``friction`` (3, 3)."""

    known: Array
    given: Array
    moved: Array
    friction: Array


@making_arrays
def law_work() -> LawWork:
    """Arrays for :func:`analysis.flights.equation.slopes.acceleration_slopes`."""
    return LawWork(np.empty(W.KNOWN_SIZE), np.empty(3), np.empty(3), np.empty((3, 3)))


@compiled
def _follows_friction(target: int) -> bool:
    """Whether what a term acts on is friction, or a part of it."""
    of_friction = target == FRICTION or target == MIRRORED_FRICTION or target == POLAR_FRICTION
    return of_friction or target == FLOOR_LEVER or target == FLOOR_TORQUE


@compiled
def _varies(row: Array) -> bool:
    """Whether a term of a written law may follow the disk's state other than through friction."""
    target = int(row[W.TARGET])
    of_friction_alone = _follows_friction(target) and target != POLAR_FRICTION and target != FLOOR_LEVER
    if target != FIXED and target != SPIN and not of_friction_alone:
        return True
    for i in range(int(row[W.FACTORS])):
        code = int(row[W.FIRST + W.FACTOR_SIZE * i + W.QUANTITY])
        if code != Q_TIME and code != Q_PHASE and code != Q_CLOCK and code != Q_SINCE and code != Q_RUN:
            return True
    return False


@compiled
def _pushed(p: Array, rig: FlightRig, known: Array, out: Array) -> None:
    """``out`` (3,) = what the written law of ``rig`` gives where ``known`` is known."""
    out[:] = 0.0
    for j in range(rig.law.shape[0]):
        push(rig.law[j], p[P.LAW + j], known, out)


@compiled
def _through(friction: Array, derivative: Array) -> None:
    """Add to ``derivative`` (3, N) of friction what a law makes of it, ``friction`` (3, 3)."""
    for k in range(derivative.shape[1]):
        one, two, three = derivative[0, k], derivative[1, k], derivative[2, k]
        for m in range(3):
            derivative[m, k] += friction[m, 0] * one + friction[m, 1] * two + friction[m, 2] * three


@compiled
def _move(known: Array, j: int, step: float, at: Moment) -> None:
    """What is ``known`` of the flight (``known_of``) with entry ``j`` of the state moved."""
    host_spin, turning = at.host.spin, known[W.SPIN] - at.host.spin
    if j == 0:
        known[W.X] += step
        known[W.HX] += step
        known[W.UY] -= host_spin * step
    elif j == 1:
        known[W.Y] += step
        known[W.HY] += step
        known[W.UX] += host_spin * step
    elif j == ANGLE:
        known[W.ANGLE] += step
        for k in (W.X, W.HX):
            known[k] -= step * at.cy
            known[k + 1] += step * at.cx
        known[W.VX] -= step * known[W.SPIN] * at.cx
        known[W.VY] -= step * known[W.SPIN] * at.cy
        known[W.UX] -= step * turning * at.cx
        known[W.UY] -= step * turning * at.cy
    elif j == STATES - 1:
        known[W.SPIN] += step
        for k in (W.VX, W.UX):
            known[k] -= step * at.cy
            known[k + 1] += step * at.cx
    else:
        known[W.VX + j - 3] += step
        known[W.UX + j - 3] += step


@compiled
def _law_by_friction(p: Array, rig: FlightRig, work: LawWork, state: Array, every: Array) -> None:
    """Where a law follows the floor's friction: ``state`` and ``every``, the derivatives of friction, with what the law
    makes of them.  It is linear in friction, so that a step of any size gives the derivative."""
    follows = False
    for j in range(rig.law.shape[0]):
        follows = follows or _follows_friction(int(rig.law[j, W.TARGET]))
    if not follows:
        return
    for m in range(3):
        work.known[W.FX + m] += 1.0
        _pushed(p, rig, work.known, work.moved)
        work.known[W.FX + m] -= 1.0
        for q in range(3):
            work.friction[q, m] = work.moved[q] - work.given[q]
    _through(work.friction, state)
    if len(every) > 0:
        _through(work.friction, every)


@compiled
def pushed_by_law(
    at: Moment, y: Array, p: Array, rig: FlightRig, rubbed: Acceleration, work: LawWork, state: Array, every: Array
) -> Acceleration:
    """``rubbed`` by friction and pushed by the written law: ``state`` and ``every`` hold the derivatives of friction
    alone at first, with the law's afterwards.  Those with respect to the state are differences, the only ones."""
    known, given = work.known, work.given
    known_of(at.t, y, p, rig, known)
    known[W.FX], known[W.FY], known[W.FT] = rubbed.x, rubbed.y, rubbed.spin
    _pushed(p, rig, known, given)
    pushed = Acceleration(rubbed.x + given[0], rubbed.y + given[1], rubbed.spin + given[2], rubbed.floor_speed)
    _law_by_friction(p, rig, work, state, every)
    for j in range(rig.law.shape[0] if len(every) > 0 else 0):
        work.moved[:] = 0.0
        push(rig.law[j], 1.0, known, work.moved)
        for m in range(3):
            every[m, P.LAW + j] = work.moved[m]
    for k in range(rig.law.shape[0]):
        if not _varies(rig.law[k]):
            continue
        work.given[:] = 0.0
        push(rig.law[k], p[P.LAW + k], known, work.given)
        for j in range(STATES):
            _move(known, j, LAW_STEPS[j], at)
            work.moved[:] = 0.0
            push(rig.law[k], p[P.LAW + k], known, work.moved)
            _move(known, j, -LAW_STEPS[j], at)
            for m in range(3):
                state[m, j] += (work.moved[m] - work.given[m]) / LAW_STEPS[j]
    return pushed
