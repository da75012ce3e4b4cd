"""How the acceleration of a flight answers its state and its parameters.

Every term of ``acceleration`` (:mod:`analysis.flights.equation.model`) has its derivatives, term by term: friction's in
``friction_slopes``, a written law's in ``law_slopes``, all others here.  A test holds them against differences, each
parameter of :mod:`analysis.flights.equation.parameters` among them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, inlined
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation import parameters as P
from analysis.flights.equation.friction_slopes import friction_by_state, friction_columns, lever_of_friction, rubbing_at
from analysis.flights.equation.law_slopes import LawWork, pushed_by_law
from analysis.flights.equation.model import (
    CENTRE_M2,
    SPIN,
    TINY_M_PER_S,
    VX,
    VY,
    Acceleration,
    Moment,
    X,
    Y,
    follows_drive,
    moment_of,
)

Array = NDArray[np.float64]


@inlined
def _fields(at: Moment, y: Array, p: Array, rig: FlightRig, state: Array) -> Acceleration:
    """Everything but friction and written laws; its derivatives with respect to the state are added to ``state``."""
    speed = np.sqrt(at.vx * at.vx + at.vy * at.vy)
    drag = p[P.VISCOUS] + p[P.AIR] * speed
    grows = p[P.AIR] / max(speed, TINY_M_PER_S)
    square, reach = at.rx * at.rx + at.ry * at.ry, rig.contact_radius_m**2
    share, root = square / reach, np.sqrt(square + CENTRE_M2)
    unit = (p[P.RADIAL_UNIT] + p[P.WALL_PULL] * share**4) / root
    pull = p[P.CENTRE_HOST] + p[P.RADIAL_CUBIC] * share + unit
    # Twice what the pull grows by with the square of the radius.
    steep = 2 * (p[P.RADIAL_CUBIC] / reach + 4 * p[P.WALL_PULL] * share**3 / (reach * root)) - unit / (root * root)
    turn = p[P.MAGNUS] * at.spin + p[P.GYRO]
    state[0, X] += -pull - steep * at.rx * at.rx + p[P.SADDLE_HOST] - p[P.CENTRE_ROOM] + p[P.SADDLE_ROOM]
    state[0, Y] += -steep * at.rx * at.ry - p[P.CURL_HOST] + p[P.SKEW_HOST] + p[P.SKEW_ROOM]
    state[1, X] += -steep * at.rx * at.ry + p[P.CURL_HOST] + p[P.SKEW_HOST] + p[P.SKEW_ROOM]
    state[1, Y] += -pull - steep * at.ry * at.ry - p[P.SADDLE_HOST] - p[P.CENTRE_ROOM] - p[P.SADDLE_ROOM]
    state[0, VX] += -drag - grows * at.vx * at.vx - p[P.HOST_DRAG]
    state[0, VY] += -grows * at.vx * at.vy - turn
    state[1, VX] += -grows * at.vx * at.vy + turn
    state[1, VY] += -drag - grows * at.vy * at.vy - p[P.HOST_DRAG]
    state[0, SPIN] -= p[P.MAGNUS] * at.vy
    state[1, SPIN] += p[P.MAGNUS] * at.vx
    state[2, SPIN] -= p[P.SPIN_DECAY]
    host_x, host_y = at.vx - at.host.vx, at.vy - at.host.vy
    return Acceleration(
        p[P.TILT_X] - drag * at.vx - pull * at.rx - p[P.CURL_HOST] * at.ry + p[P.SADDLE_HOST] * at.rx
        + p[P.SKEW_HOST] * at.ry + (p[P.SADDLE_ROOM] - p[P.CENTRE_ROOM]) * y[X] + p[P.SKEW_ROOM] * y[Y]
        - turn * at.vy - p[P.HOST_DRAG] * host_x + p[P.FORCE_COS_X] * at.cosine + p[P.FORCE_SIN_X] * at.sine,
        p[P.TILT_Y] - drag * at.vy - pull * at.ry + p[P.CURL_HOST] * at.rx - p[P.SADDLE_HOST] * at.ry
        + p[P.SKEW_HOST] * at.rx - (p[P.SADDLE_ROOM] + p[P.CENTRE_ROOM]) * y[Y] + p[P.SKEW_ROOM] * y[X]
        + turn * at.vx - p[P.HOST_DRAG] * host_y + p[P.FORCE_COS_Y] * at.cosine + p[P.FORCE_SIN_Y] * at.sine,
        p[P.SPIN_DRIVE] - p[P.SPIN_DECAY] * at.spin,
        0.0,
    )  # fmt: skip


@inlined
def _field_columns(at: Moment, y: Array, rig: FlightRig, every: Array) -> None:
    """Fill ``every`` (3, P) with the derivatives with respect to the parameters of :func:`_fields`."""
    speed = np.sqrt(at.vx * at.vx + at.vy * at.vy)
    square = at.rx * at.rx + at.ry * at.ry
    share, root = square / rig.contact_radius_m**2, np.sqrt(square + CENTRE_M2)
    every[0, P.TILT_X] = every[1, P.TILT_Y] = every[2, P.SPIN_DRIVE] = 1.0
    every[0, P.VISCOUS], every[1, P.VISCOUS] = -at.vx, -at.vy
    every[0, P.AIR], every[1, P.AIR] = -speed * at.vx, -speed * at.vy
    every[0, P.HOST_DRAG], every[1, P.HOST_DRAG] = at.host.vx - at.vx, at.host.vy - at.vy
    every[0, P.CENTRE_HOST], every[1, P.CENTRE_HOST] = -at.rx, -at.ry
    every[0, P.CURL_HOST], every[1, P.CURL_HOST] = -at.ry, at.rx
    every[0, P.SADDLE_HOST], every[1, P.SADDLE_HOST] = at.rx, -at.ry
    every[0, P.SKEW_HOST], every[1, P.SKEW_HOST] = at.ry, at.rx
    every[0, P.CENTRE_ROOM], every[1, P.CENTRE_ROOM] = -y[X], -y[Y]
    every[0, P.SADDLE_ROOM], every[1, P.SADDLE_ROOM] = y[X], -y[Y]
    every[0, P.SKEW_ROOM], every[1, P.SKEW_ROOM] = y[Y], y[X]
    every[0, P.RADIAL_CUBIC], every[1, P.RADIAL_CUBIC] = -share * at.rx, -share * at.ry
    every[0, P.RADIAL_UNIT], every[1, P.RADIAL_UNIT] = -at.rx / root, -at.ry / root
    every[0, P.WALL_PULL], every[1, P.WALL_PULL] = -(share**4) * at.rx / root, -(share**4) * at.ry / root
    every[0, P.GYRO], every[1, P.GYRO] = -at.vy, at.vx
    every[0, P.MAGNUS], every[1, P.MAGNUS] = -at.spin * at.vy, at.spin * at.vx
    every[2, P.SPIN_DECAY] = -at.spin
    every[0, P.FORCE_COS_X] = every[1, P.FORCE_COS_Y] = at.cosine
    every[0, P.FORCE_SIN_X] = every[1, P.FORCE_SIN_Y] = at.sine


@compiled
def acceleration_slopes(
    t: float, y: Array, p: Array, rig: FlightRig, work: LawWork, state: Array, every: Array
) -> Acceleration:
    """As ``acceleration``; fills ``state`` (3, 6) with its derivatives with respect to the state ``y`` (6,) and
    ``every`` (3, P) with those with respect to the parameters, where that has rows."""
    at = moment_of(t, y, rig, len(every) > 0 or follows_drive(p))
    state[:] = 0.0
    every[:] = 0.0
    speed = np.sqrt(at.ux * at.ux + at.uy * at.uy + (rig.radius_m * (at.spin - at.host.spin)) ** 2)
    rubbed = Acceleration(0.0, 0.0, 0.0, speed)
    if p[P.FRICTION] != 0.0 or len(every) > 0:
        rub = rubbing_at(at, y, p, rig)
        push_x, push_y = -rub.strength * rub.g * rub.wx, -rub.strength * rub.g * rub.wy
        turn_by = -rub.strength * rub.h * rub.arm
        friction_by_state(at, p, rig, rub, state)
        if len(every) > 0:
            friction_columns(at, y, p, rig, rub, every)
        if at.cx != 0.0 or at.cy != 0.0:
            turn_by += lever_of_friction(at, rig, push_x, push_y, state, every)
        rubbed = Acceleration(push_x, push_y, turn_by, speed)
    given = pushed_by_law(at, y, p, rig, rubbed, work, state, every) if rig.law.shape[0] > 0 else rubbed
    fields = _fields(at, y, p, rig, state)
    if len(every) > 0:
        _field_columns(at, y, rig, every)
    return Acceleration(given.x + fields.x, given.y + fields.y, given.spin + fields.spin, speed)
