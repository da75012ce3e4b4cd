"""How the acceleration of a flight answers its state and its parameters.

Every term of :func:`analysis.flights.model.acceleration` has its derivatives here, term by term; a test holds them
against differences, each parameter of :mod:`analysis.flights.parameters` among them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, inlined
from analysis.flights import parameters as P
from analysis.flights.model import (
    ANGLE,
    CENTRE_M2,
    GRAVITY_M_PER_S2,
    REGULARISATION_M_PER_S,
    SETTLING_S,
    SMOOTHED,
    STATES,
    Acceleration,
    FlightRig,
    follows_drive,
    known_of,
    middle_of,
)
from analysis.motion.host_table import HostState, host_at
from ovines.core.laws import words as W
from ovines.core.laws.kernel import (
    FIXED,
    FLOOR_LEVER,
    FLOOR_TORQUE,
    FRICTION,
    MIRRORED_FRICTION,
    POLAR_FRICTION,
    Q_CLOCK,
    Q_PHASE,
    Q_RUN,
    Q_SINCE,
    Q_TIME,
    SPIN,
    push,
)
from ovines.core.system.friction import farkas_slope

Array = NDArray[np.float64]

# Sliding and rim speeds below this (m/s) count as this: what is divided by them then has its limit.
TINY_M_PER_S = 1e-12
# Steps of the differences that a written law is asked by, the only ones: micrometres, tenths of milliradians, 10 um/s
# and mrad/s, each far above rounding and far below what bends a flight.
PLACE_STEP_M, ANGLE_STEP_RAD, VELOCITY_STEP_M_PER_S, SPIN_STEP_RAD_PER_S = 1e-6, 1e-4, 1e-5, 1e-3
LAW_STEPS = (PLACE_STEP_M, PLACE_STEP_M, ANGLE_STEP_RAD, VELOCITY_STEP_M_PER_S, VELOCITY_STEP_M_PER_S,
             SPIN_STEP_RAD_PER_S)  # fmt: skip


class Moment(NamedTuple):
    """Where the disk is at one instant: time (s), the Host, cosine and sine of the drive's phase, place from the Host's
    centre (m), velocity in the room (m/s), that of the disk's geometric centre against the floor, spin in the room
    (rad/s), the geometric centre from the centre of mass (m)."""

    t: float
    host: HostState
    cosine: float
    sine: float
    rx: float
    ry: float
    vx: float
    vy: float
    ux: float
    uy: float
    spin: float
    cx: float
    cy: float


@inlined
def moment_of(t: float, y: Array, rig: FlightRig, driven: bool) -> Moment:
    """What the terms ask of the state ``y`` (6,) at t; cosine and sine only where ``driven``."""
    host = host_at(t, rig.host)
    rx, ry = y[0] - host.x, y[1] - host.y
    cosine, sine = 0.0, 0.0
    if driven:
        drive = rig.omega_rad_per_s * t + rig.phase_rad
        cosine, sine = np.cos(drive), np.sin(drive)
    cx, cy = middle_of(y[ANGLE], rig)
    spin = y[5] - host.spin
    ux, uy = y[3] - host.vx + host.spin * ry - spin * cy, y[4] - host.vy - host.spin * rx + spin * cx
    return Moment(t, host, cosine, sine, rx, ry, y[3], y[4], ux, uy, y[5], cx, cy)


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
def _rubbing(at: Moment, y: Array, p: Array, rig: FlightRig) -> Rubbing:
    """The floor's friction at ``at``, as :func:`analysis.flights.model.acceleration` has it."""
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
           + p[P.FRICTION_ROOM_X] * y[0]) / rig.contact_radius_m
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
def _friction_by_state(at: Moment, p: Array, rig: FlightRig, rub: Rubbing, state: Array) -> None:
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
        state[m, 3] = -rub.strength * (slide * sx + ux) - faster * given * sx
        state[m, 4] = -rub.strength * (slide * sy + uy) - faster * given * sy
        state[m, 5] = -rim * spun
        state[m, 0] = -at.host.spin * state[m, 4] - along_x * given
        state[m, 1] = at.host.spin * state[m, 3] - along_y * given
        # A disk that turns moves its geometric centre about the centre of mass.
        turning = at.spin - at.host.spin
        state[m, ANGLE] = -turning * (at.cx * state[m, 3] + at.cy * state[m, 4])
        state[m, 5] += at.cx * state[m, 4] - at.cy * state[m, 3]


@inlined
def _lever(at: Moment, rig: FlightRig, push_x: float, push_y: float, state: Array, every: Array) -> float:
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
def _friction_columns(at: Moment, y: Array, p: Array, rig: FlightRig, rub: Rubbing, every: Array) -> None:
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
        every[m, P.FRICTION_ROOM_X] = y[0] / rig.contact_radius_m * unit
        every[m, P.FRICTION_SPEED] = rub.slide * unit
        every[m, P.FRICTION_COS], every[m, P.FRICTION_SIN] = at.cosine * unit, at.sine * unit
        every[m, P.FRICTION_SINCE] = rub.since * unit
    less = rub.strength * rub.smooth * (1.0 - rub.ff) / rub.slide
    every[0, P.COUPLING], every[1, P.COUPLING] = less * rub.wx, less * rub.wy
    every[2, P.COUPLING] = -rub.strength * rub.smooth * rub.ft * rub.arm
    strength = rub.strength * rub.g
    every[0, P.FRICTION_AXIS], every[1, P.FRICTION_AXIS] = -strength * at.ux, strength * at.uy
    every[0, P.FRICTION_SKEW], every[1, P.FRICTION_SKEW] = -strength * at.uy, -strength * at.ux


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
    state[0, 0] += -pull - steep * at.rx * at.rx + p[P.SADDLE_HOST] - p[P.CENTRE_ROOM] + p[P.SADDLE_ROOM]
    state[0, 1] += -steep * at.rx * at.ry - p[P.CURL_HOST] + p[P.SKEW_HOST] + p[P.SKEW_ROOM]
    state[1, 0] += -steep * at.rx * at.ry + p[P.CURL_HOST] + p[P.SKEW_HOST] + p[P.SKEW_ROOM]
    state[1, 1] += -pull - steep * at.ry * at.ry - p[P.SADDLE_HOST] - p[P.CENTRE_ROOM] - p[P.SADDLE_ROOM]
    state[0, 3] += -drag - grows * at.vx * at.vx - p[P.HOST_DRAG]
    state[0, 4] += -grows * at.vx * at.vy - turn
    state[1, 3] += -grows * at.vx * at.vy + turn
    state[1, 4] += -drag - grows * at.vy * at.vy - p[P.HOST_DRAG]
    state[0, 5] -= p[P.MAGNUS] * at.vy
    state[1, 5] += p[P.MAGNUS] * at.vx
    state[2, 5] -= p[P.SPIN_DECAY]
    host_x, host_y = at.vx - at.host.vx, at.vy - at.host.vy
    return Acceleration(
        p[P.TILT_X] - drag * at.vx - pull * at.rx - p[P.CURL_HOST] * at.ry + p[P.SADDLE_HOST] * at.rx
        + p[P.SKEW_HOST] * at.ry + (p[P.SADDLE_ROOM] - p[P.CENTRE_ROOM]) * y[0] + p[P.SKEW_ROOM] * y[1]
        - turn * at.vy - p[P.HOST_DRAG] * host_x + p[P.FORCE_COS_X] * at.cosine + p[P.FORCE_SIN_X] * at.sine,
        p[P.TILT_Y] - drag * at.vy - pull * at.ry + p[P.CURL_HOST] * at.rx - p[P.SADDLE_HOST] * at.ry
        + p[P.SKEW_HOST] * at.rx - (p[P.SADDLE_ROOM] + p[P.CENTRE_ROOM]) * y[1] + p[P.SKEW_ROOM] * y[0]
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
    every[0, P.CENTRE_ROOM], every[1, P.CENTRE_ROOM] = -y[0], -y[1]
    every[0, P.SADDLE_ROOM], every[1, P.SADDLE_ROOM] = y[0], -y[1]
    every[0, P.SKEW_ROOM], every[1, P.SKEW_ROOM] = y[1], y[0]
    every[0, P.RADIAL_CUBIC], every[1, P.RADIAL_CUBIC] = -share * at.rx, -share * at.ry
    every[0, P.RADIAL_UNIT], every[1, P.RADIAL_UNIT] = -at.rx / root, -at.ry / root
    every[0, P.WALL_PULL], every[1, P.WALL_PULL] = -(share**4) * at.rx / root, -(share**4) * at.ry / root
    every[0, P.GYRO], every[1, P.GYRO] = -at.vy, at.vx
    every[0, P.MAGNUS], every[1, P.MAGNUS] = -at.spin * at.vy, at.spin * at.vx
    every[2, P.SPIN_DECAY] = -at.spin
    every[0, P.FORCE_COS_X] = every[1, P.FORCE_COS_Y] = at.cosine
    every[0, P.FORCE_SIN_X] = every[1, P.FORCE_SIN_Y] = at.sine


class LawWork(NamedTuple):
    """Arrays that a written law is asked in: what is ``known``, what it gives there and with a state ``moved`` (3,),
    and how it answers ``friction`` (3, 3)."""

    known: Array
    given: Array
    moved: Array
    friction: Array


@compiled
def law_work() -> LawWork:
    """Arrays for :func:`acceleration_slopes`."""
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
    """What is ``known`` of the flight (:func:`analysis.flights.model.known_of`) with entry ``j`` of the state moved."""
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
def _law(
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


@compiled
def acceleration_slopes(
    t: float, y: Array, p: Array, rig: FlightRig, work: LawWork, state: Array, every: Array
) -> Acceleration:
    """As :func:`analysis.flights.model.acceleration`; fills ``state`` (3, 6) with its derivatives with respect to the
    state ``y`` (6,) and ``every`` (3, P) with those with respect to the parameters, where that has rows."""
    at = moment_of(t, y, rig, len(every) > 0 or follows_drive(p))
    state[:] = 0.0
    every[:] = 0.0
    speed = np.sqrt(at.ux * at.ux + at.uy * at.uy + (rig.radius_m * (at.spin - at.host.spin)) ** 2)
    rubbed = Acceleration(0.0, 0.0, 0.0, speed)
    if p[P.FRICTION] != 0.0 or len(every) > 0:
        rub = _rubbing(at, y, p, rig)
        push_x, push_y = -rub.strength * rub.g * rub.wx, -rub.strength * rub.g * rub.wy
        turn_by = -rub.strength * rub.h * rub.arm
        _friction_by_state(at, p, rig, rub, state)
        if len(every) > 0:
            _friction_columns(at, y, p, rig, rub, every)
        if at.cx != 0.0 or at.cy != 0.0:
            turn_by += _lever(at, rig, push_x, push_y, state, every)
        rubbed = Acceleration(push_x, push_y, turn_by, speed)
    given = _law(at, y, p, rig, rubbed, work, state, every) if rig.law.shape[0] > 0 else rubbed
    fields = _fields(at, y, p, rig, state)
    if len(every) > 0:
        _field_columns(at, y, rig, every)
    return Acceleration(given.x + fields.x, given.y + fields.y, given.spin + fields.spin, speed)
