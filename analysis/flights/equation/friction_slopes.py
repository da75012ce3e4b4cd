"""How the floor's friction on a flying disk answers its state and its parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import inlined
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.equation import parameters as P
from analysis.flights.equation.model import (
    ANGLE,
    GRAVITY_M_PER_S2,
    REGULARISATION_M_PER_S,
    SETTLING_S,
    SMOOTHED,
    SPIN,
    TINY_M_PER_S,
    VX,
    VY,
    Moment,
    X,
    Y,
)
from ovines.core.system.friction import farkas_slope

Array = NDArray[np.float64]


class Rubbing(NamedTuple):
    """The floor's friction at one instant: force ``-strength g (wx, wy)`` and torque ``-strength h arm`` per mass.

    ``strength`` friction times load (m/s^2), ``shape`` what the friction coefficient is over ``p[P.FRICTION]``, ``w``
    the sliding velocity by the floor's axes (m/s), ``g`` and ``h`` functions of the sliding and the rim speed, with
    their slopes; ``ff``, ``ft`` Farkas' functions; ``turn`` the sign of the spin against the floor, ``arm`` that over
    q R (1/m); ``distance`` from the Host's centre (m); ``since`` what the floor remembers of the impact before."""

    slide: float
    total: float
    load: float
    shape: float
    strength: float
    wx: float
    wy: float
    g: float
    h: float
    g_slide: float
    g_rim: float
    h_slide: float
    h_rim: float
    smooth: float
    ff: float
    ft: float
    turn: float
    arm: float
    distance: float
    since: float


@inlined
def rubbing_at(at: Moment, y: Array, p: Array, rig: FlightRig) -> Rubbing:
    """The floor's friction at ``at``, as :func:`analysis.flights.equation.model.acceleration` has it."""
    spin = at.spin - at.host.spin
    turn = 1.0 if spin >= 0.0 else -1.0
    slide = max(np.sqrt(at.ux * at.ux + at.uy * at.uy), TINY_M_PER_S)
    rim = max(rig.radius_m * abs(spin), TINY_M_PER_S)
    total = np.sqrt(slide * slide + rim * rim)
    load = max(GRAVITY_M_PER_S2 + p[P.LOAD] * at.host.lift, 0.0)
    distance = np.sqrt(at.rx * at.rx + at.ry * at.ry)
    since = np.exp(-(at.t - p[P.IMPACT_BEFORE_S]) / SETTLING_S) if at.t >= p[P.IMPACT_BEFORE_S] else 0.0
    shape = (
        1
        + p[P.DRIFT] * at.t
        + (p[P.FRICTION_RADIUS] * distance + p[P.FRICTION_X] * at.rx + p[P.FRICTION_Y] * at.ry
           + p[P.FRICTION_ROOM_X] * y[X]) / rig.contact_radius_m
        + p[P.FRICTION_SPEED] * slide
        + p[P.FRICTION_COS] * at.cosine
        + p[P.FRICTION_SIN] * at.sine
        + p[P.FRICTION_SINCE] * since
    )  # fmt: skip
    smooth, rise = 1.0, 0.0
    if total < SMOOTHED * REGULARISATION_M_PER_S:
        smooth = np.tanh(total / REGULARISATION_M_PER_S)
        rise = (1 - smooth * smooth) / (REGULARISATION_M_PER_S * total)
    ratio = slide / rim
    ff, ft, steep = farkas_slope(ratio)
    coupling, steep = p[P.COUPLING], p[P.COUPLING] * smooth * steep / rim
    force, torque = 1.0 + coupling * (ff - 1.0), coupling * ft
    # Of Farkas' functions T' = -ratio F'.
    g = smooth * force / slide
    return Rubbing(
        slide,
        total,
        load,
        shape,
        p[P.FRICTION] * shape * load,
        (1 + p[P.FRICTION_AXIS]) * at.ux + p[P.FRICTION_SKEW] * at.uy,
        (1 - p[P.FRICTION_AXIS]) * at.uy + p[P.FRICTION_SKEW] * at.ux,
        g,
        smooth * torque,
        (rise * slide * force + steep - g) / slide,
        (rise * rim * force - steep * ratio) / slide,
        rise * slide * torque - ratio * steep,
        rise * rim * torque + ratio * ratio * steep,
        smooth,
        ff,
        ft,
        turn,
        turn / (rig.inertia_factor * rig.radius_m),
        distance,
        since,
    )


@inlined
def friction_by_state(at: Moment, p: Array, rig: FlightRig, rub: Rubbing, state: Array) -> None:
    """Fill ``state`` (3, 6) with the derivatives of friction with respect to the state."""
    sx, sy = at.ux / rub.slide, at.uy / rub.slide
    skew = p[P.FRICTION_SKEW]
    faster = p[P.FRICTION] * p[P.FRICTION_SPEED] * rub.load
    outwards = p[P.FRICTION_RADIUS] / max(rub.distance, TINY_M_PER_S)
    share = p[P.FRICTION] * rub.load / rig.contact_radius_m
    along_x = share * (outwards * at.rx + p[P.FRICTION_X] + p[P.FRICTION_ROOM_X])
    along_y = share * (outwards * at.ry + p[P.FRICTION_Y])
    rim = rub.strength * rig.radius_m * rub.turn
    for m in range(3):
        if m == 2:
            given, slide, spun, ux, uy = rub.h * rub.arm, rub.h_slide * rub.arm, rub.h_rim * rub.arm, 0.0, 0.0
        elif m == 1:
            given, slide, spun = rub.g * rub.wy, rub.g_slide * rub.wy, rub.g_rim * rub.wy
            ux, uy = rub.g * skew, rub.g * (1 - p[P.FRICTION_AXIS])
        else:
            given, slide, spun = rub.g * rub.wx, rub.g_slide * rub.wx, rub.g_rim * rub.wx
            ux, uy = rub.g * (1 + p[P.FRICTION_AXIS]), rub.g * skew
        # The velocity is felt as the one against the floor, which the place changes where the floor turns.
        state[m, VX] = -rub.strength * (slide * sx + ux) - faster * given * sx
        state[m, VY] = -rub.strength * (slide * sy + uy) - faster * given * sy
        state[m, SPIN] = -rim * spun
        state[m, X] = -at.host.spin * state[m, VY] - along_x * given
        state[m, Y] = at.host.spin * state[m, VX] - along_y * given
        # A disk that turns moves its geometric centre about the centre of mass.
        turning = at.spin - at.host.spin
        state[m, ANGLE] = -turning * (at.cx * state[m, VX] + at.cy * state[m, VY])
        state[m, SPIN] += at.cx * state[m, VY] - at.cy * state[m, VX]


@inlined
def lever_of_friction(at: Moment, rig: FlightRig, push_x: float, push_y: float, state: Array, every: Array) -> float:
    """Spin (rad/s^2) that friction (m/s^2) gives a disk by acting at its geometric centre; its derivatives are added
    to those of friction."""
    square_m2 = rig.inertia_factor * rig.radius_m**2
    arm_x, arm_y = at.cx / square_m2, at.cy / square_m2
    for derivative in (state, every):
        for k in range(derivative.shape[1] if len(derivative) > 0 else 0):
            derivative[2, k] += arm_x * derivative[1, k] - arm_y * derivative[0, k]
    state[2, ANGLE] -= arm_x * push_x + arm_y * push_y
    return arm_x * push_y - arm_y * push_x


@inlined
def friction_columns(at: Moment, y: Array, p: Array, rig: FlightRig, rub: Rubbing, every: Array) -> None:
    """Fill ``every`` (3, P) with the derivatives of friction with respect to its parameters."""
    for m in range(3):
        # What a unit of friction gives.
        unit = -rub.load * (rub.h * rub.arm if m == 2 else rub.g * (rub.wx if m == 0 else rub.wy))
        every[m, P.FRICTION] = rub.shape * unit
        every[m, P.LOAD] = p[P.FRICTION] * rub.shape * at.host.lift * unit / rub.load if rub.load > 0.0 else 0.0
        unit *= p[P.FRICTION]
        every[m, P.DRIFT] = at.t * unit
        every[m, P.FRICTION_RADIUS] = rub.distance / rig.contact_radius_m * unit
        every[m, P.FRICTION_X] = at.rx / rig.contact_radius_m * unit
        every[m, P.FRICTION_Y] = at.ry / rig.contact_radius_m * unit
        every[m, P.FRICTION_ROOM_X] = y[X] / rig.contact_radius_m * unit
        every[m, P.FRICTION_SPEED] = rub.slide * unit
        every[m, P.FRICTION_COS], every[m, P.FRICTION_SIN] = at.cosine * unit, at.sine * unit
        every[m, P.FRICTION_SINCE] = rub.since * unit
    less = rub.strength * rub.smooth * (1.0 - rub.ff) / rub.slide
    every[0, P.COUPLING], every[1, P.COUPLING] = less * rub.wx, less * rub.wy
    every[2, P.COUPLING] = -rub.strength * rub.smooth * rub.ft * rub.arm
    strength = rub.strength * rub.g
    every[0, P.FRICTION_AXIS], every[1, P.FRICTION_AXIS] = -strength * at.ux, strength * at.uy
    every[0, P.FRICTION_SKEW], every[1, P.FRICTION_SKEW] = -strength * at.uy, -strength * at.ux
