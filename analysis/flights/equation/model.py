"""The equation of motion of a flight, compiled: nominal terms, every flight effect, and probes that nobody lists.

State of the disk: x, y, angle, vx, vy, spin of its centre of mass in the world.  Parameters are one vector with the
entries of :mod:`analysis.flights.equation.parameters`, so that the derivative of a flight with respect to any of them
is the same call with one entry changed.  What does not change within a fit is a :class:`FlightRig`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled, inlined, making_arrays
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.cutting.way_slid import remembered
from analysis.flights.equation import parameters as P
from analysis.motion.host_table import HostState, host_acceleration_at, host_at
from ovines.core.laws import words as W
from ovines.core.laws.kernel import push
from ovines.core.laws.memory import memory_units
from ovines.core.system.friction import farkas

Array = NDArray[np.float64]

# As the thesis and the simulator have it (ovines.core).
GRAVITY_M_PER_S2 = 9.81
# Below this sliding speed the friction is smoothed; 1 mm/s is a thousandth of what the disk usually slides with.
REGULARISATION_M_PER_S = 1e-3
# From so many times that speed on, its hyperbolic tangent is 1 to the last digit.
SMOOTHED = 20.0
# How long a floor may remember an impact, for the probe that asks (a hop lasts about as long).
SETTLING_S = 0.015
# Longest Runge-Kutta step: a frame at 800 fps keeps the error of a flight below 1e-8 m away from v = 0.
LONGEST_STEP_S = 1.3e-3
# Where the disk slides the other way its friction turns within the time in which the sliding speed changes by itself: a
# step changes it by this share at most.  Whole frames across such turns left up to 1 mm/s each, which a flight of 0.8 s
# shows.
SHARE_OF_SPEED = 0.4
# Square of a distance within which a force of one size towards the Host's centre turns (m^2).
CENTRE_M2 = 1e-8

# Sliding and rim speeds below this (m/s) count as this: what is divided by them then has its limit.
TINY_M_PER_S = 1e-12

#: places of the state's numbers
X, Y, ANGLE, VX, VY, SPIN = range(6)
STATES = 6


class Acceleration(NamedTuple):
    """x'', y'' (m/s^2), spin' (rad/s^2), and the speed against the floor, sliding and rim together (m/s)."""

    x: float
    y: float
    spin: float
    floor_speed: float


class Workspace(NamedTuple):
    """Arrays that the integration works in: ``slopes`` (4, 6) of the Runge-Kutta stages, ``trial`` (6,) state; what a
    written law may know (``known``) and what it has ``given`` (3,)."""

    slopes: Array
    trial: Array
    known: Array
    given: Array


@inlined
def middle_of(angle: float, rig: FlightRig) -> tuple[float, float]:
    """Geometric centre of a disk turned by ``angle`` (rad) from its centre of mass, in the room (m)."""
    if rig.middle_x_m == 0.0 and rig.middle_y_m == 0.0:
        return 0.0, 0.0
    c, s = np.cos(angle), np.sin(angle)
    return c * rig.middle_x_m - s * rig.middle_y_m, s * rig.middle_x_m + c * rig.middle_y_m


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
    rx, ry = y[X] - host.x, y[Y] - host.y
    cosine, sine = 0.0, 0.0
    if driven:
        drive = rig.omega_rad_per_s * t + rig.phase_rad
        cosine, sine = np.cos(drive), np.sin(drive)
    cx, cy = middle_of(y[ANGLE], rig)
    spin = y[SPIN] - host.spin
    ux, uy = y[VX] - host.vx + host.spin * ry - spin * cy, y[VY] - host.vy - host.spin * rx + spin * cx
    return Moment(t, host, cosine, sine, rx, ry, y[VX], y[VY], ux, uy, y[SPIN], cx, cy)


@compiled
def known_of(t: float, y: Array, p: Array, rig: FlightRig, known: Array) -> None:
    """Fill ``known`` (:mod:`ovines.core.laws.words`) with what a written law may ask of a flight, without friction.

    Places and velocities are those of the disk's geometric centre, as the simulator has them."""
    host = host_at(t, rig.host)
    cx, cy = middle_of(y[ANGLE], rig)
    x, y_m, vx, vy = y[X] + cx, y[Y] + cy, y[VX] - y[SPIN] * cy, y[VY] + y[SPIN] * cx
    rx, ry = x - host.x, y_m - host.y
    known[W.VX], known[W.VY] = vx, vy
    known[W.UX], known[W.UY] = vx - host.vx + host.spin * ry, vy - host.vy - host.spin * rx
    known[W.X], known[W.Y], known[W.HX], known[W.HY] = x, y_m, rx, ry
    known[W.CONTACT_RADIUS], known[W.ANGLE], known[W.SPIN] = rig.contact_radius_m, y[ANGLE], y[SPIN]
    known[W.TIME], known[W.RUN] = t - rig.start_s, rig.number
    known[W.PHASE] = rig.omega_rad_per_s * t + rig.phase_rad
    known[W.CLOCK] = rig.omega_rad_per_s * (t - rig.start_s)
    since = t - p[P.IMPACT_BEFORE_S]
    known[W.SINCE] = since if since >= 0.0 else W.LONG_AGO_S
    known[W.LAST_X], known[W.LAST_Y] = p[P.CONTACT_BEFORE_X], p[P.CONTACT_BEFORE_Y]
    known[W.LAST_APPROACH], known[W.LAST_ANGLE] = p[P.APPROACH_BEFORE], p[P.ANGLE_BEFORE_RAD]
    known[W.LAST_SLIP], known[W.LAST_LEFT], known[W.START_ANGLE] = p[P.SLIP_BEFORE], p[P.LEFT_BEFORE], rig.start_rad
    for i in range(W.MOST_BLOWS):
        known[W.BLOW_TIMES + i], known[W.BLOW_SPEEDS + i] = p[P.BLOW_TIMES + i] - rig.start_s, p[P.BLOW_SPEEDS + i]
        known[W.BLOW_WAYS + i], known[W.BLOW_SIDES + i] = p[P.BLOW_WAYS + i], p[P.BLOW_SIDES + i]
        known[W.BLOW_SLIPS + i] = p[P.BLOW_SLIPS + i]
    known[W.BLOWS] = p[P.BLOWS]
    known[W.DISK_RADIUS] = rig.radius_m
    remembered(t, rig.way, known, W.WAY)
    known[W.WAY_BEFORE], known[W.BEFORE_X], known[W.BEFORE_Y] = p[P.WAY_BEFORE], p[P.TWO_BEFORE_X], p[P.TWO_BEFORE_Y]
    known[W.MEMORY_M], known[W.MEMORY_S] = memory_units(rig.contact_radius_m)
    known[W.HOST_AX], known[W.HOST_AY] = host_acceleration_at(t, rig.host)
    known[W.APPROACH], known[W.SLIP], known[W.FX], known[W.FY], known[W.FT] = 0.0, 0.0, 0.0, 0.0, 0.0


@compiled
def follows_drive(p: Array) -> bool:
    """Whether any term of the parameters ``p`` follows the drive's phase."""
    return (
        p[P.FRICTION_COS] != 0.0
        or p[P.FRICTION_SIN] != 0.0
        or p[P.FORCE_COS_X] != 0.0
        or p[P.FORCE_SIN_X] != 0.0
        or p[P.FORCE_COS_Y] != 0.0
        or p[P.FORCE_SIN_Y] != 0.0
    )


@making_arrays
def acceleration(t: float, y: Array, p: Array, rig: FlightRig) -> Acceleration:
    """Acceleration of a disk in state ``y`` (6,) at t under the parameters ``p``."""
    return accelerated(t, y, p, rig, workspace())


@compiled
def accelerated(t: float, y: Array, p: Array, rig: FlightRig, work: Workspace) -> Acceleration:
    """:func:`acceleration` without new arrays."""
    host = host_at(t, rig.host)
    rx, ry = y[X] - host.x, y[Y] - host.y
    spin = y[SPIN] - host.spin
    cx, cy = middle_of(y[ANGLE], rig)
    ux = y[VX] - host.vx + host.spin * ry - spin * cy
    uy = y[VY] - host.vy - host.spin * rx + spin * cx
    slide = np.sqrt(ux * ux + uy * uy)
    rim = rig.radius_m * abs(spin)
    total = np.sqrt(slide * slide + rim * rim)
    ax, ay, torque = p[P.TILT_X], p[P.TILT_Y], p[P.SPIN_DRIVE]
    friction_x, friction_y, friction_spin = 0.0, 0.0, 0.0
    cosine, sine = 0.0, 0.0
    if follows_drive(p):
        drive = rig.omega_rad_per_s * t + rig.phase_rad
        cosine, sine = np.cos(drive), np.sin(drive)
    if p[P.FRICTION] != 0.0 and total > 0.0:
        load = GRAVITY_M_PER_S2 + p[P.LOAD] * host.lift
        load = max(load, 0.0)
        distance = np.sqrt(rx * rx + ry * ry)
        mu = p[P.FRICTION] * (
            1
            + p[P.DRIFT] * t
            + (p[P.FRICTION_RADIUS] * distance + p[P.FRICTION_X] * rx + p[P.FRICTION_Y] * ry
               + p[P.FRICTION_ROOM_X] * y[X]) / rig.contact_radius_m
            + p[P.FRICTION_SPEED] * slide
            + p[P.FRICTION_COS] * cosine
            + p[P.FRICTION_SIN] * sine
        )  # fmt: skip
        if p[P.FRICTION_SINCE] != 0.0 and t >= p[P.IMPACT_BEFORE_S]:
            mu += p[P.FRICTION] * p[P.FRICTION_SINCE] * np.exp(-(t - p[P.IMPACT_BEFORE_S]) / SETTLING_S)
        smooth = np.tanh(total / REGULARISATION_M_PER_S) if total < SMOOTHED * REGULARISATION_M_PER_S else 1.0
        # F/slide and T/rim stay finite where either vanishes: Coulomb's force is along u, Farkas' along both.
        f, tau = 1.0, 0.0
        if p[P.COUPLING] != 0.0:
            ff, ft = farkas(slide / rim) if rim > 1e-12 else (1.0, 0.0)
            f = 1.0 + p[P.COUPLING] * (ff - 1.0)
            tau = p[P.COUPLING] * ft
        strength = mu * load * smooth
        if slide > 1e-12:
            friction_x = -strength * f * ((1 + p[P.FRICTION_AXIS]) * ux + p[P.FRICTION_SKEW] * uy) / slide
            friction_y = -strength * f * ((1 - p[P.FRICTION_AXIS]) * uy + p[P.FRICTION_SKEW] * ux) / slide
        if rim > 1e-12:
            friction_spin = -strength * tau / (rig.inertia_factor * rig.radius_m) * np.sign(spin)
        friction_spin += (cx * friction_y - cy * friction_x) / (rig.inertia_factor * rig.radius_m**2)
        ax, ay, torque = ax + friction_x, ay + friction_y, torque + friction_spin
    vx, vy = y[VX], y[VY]
    speed = np.sqrt(vx * vx + vy * vy)
    drag = p[P.VISCOUS] + p[P.AIR] * speed
    ax -= drag * vx
    ay -= drag * vy
    ratio2 = (rx * rx + ry * ry) / rig.contact_radius_m**2
    pull = (
        p[P.CENTRE_HOST]
        + p[P.RADIAL_CUBIC] * ratio2
        + (p[P.RADIAL_UNIT] + p[P.WALL_PULL] * ratio2**4) / np.sqrt(rx * rx + ry * ry + CENTRE_M2)
    )
    ax += (
        -pull * rx - p[P.CURL_HOST] * ry + p[P.SADDLE_HOST] * rx + p[P.SKEW_HOST] * ry
        - p[P.CENTRE_ROOM] * y[X] + p[P.SADDLE_ROOM] * y[X] + p[P.SKEW_ROOM] * y[Y]
    )  # fmt: skip
    ay += (
        -pull * ry + p[P.CURL_HOST] * rx - p[P.SADDLE_HOST] * ry + p[P.SKEW_HOST] * rx
        - p[P.CENTRE_ROOM] * y[Y] - p[P.SADDLE_ROOM] * y[Y] + p[P.SKEW_ROOM] * y[X]
    )  # fmt: skip
    turn = p[P.MAGNUS] * y[SPIN] + p[P.GYRO]
    ax += -turn * vy - p[P.HOST_DRAG] * (vx - host.vx) + p[P.FORCE_COS_X] * cosine + p[P.FORCE_SIN_X] * sine
    ay += turn * vx - p[P.HOST_DRAG] * (vy - host.vy) + p[P.FORCE_COS_Y] * cosine + p[P.FORCE_SIN_Y] * sine
    torque -= p[P.SPIN_DECAY] * y[SPIN]
    if rig.law.shape[0] > 0:
        known, given = work.known, work.given
        given[0] = given[1] = given[2] = 0.0
        known_of(t, y, p, rig, known)
        known[W.FX], known[W.FY], known[W.FT] = friction_x, friction_y, friction_spin
        for j in range(rig.law.shape[0]):
            push(rig.law[j], p[P.LAW + j], known, given)
        ax, ay, torque = ax + given[0], ay + given[1], torque + given[2]
    return Acceleration(ax, ay, torque, total)


@compiled
def strongest_acceleration(p: Array, rig: FlightRig) -> float:
    """Upper bound of the acceleration of disk against floor (m/s^2), for :func:`advance`."""
    return 2 * abs(p[P.FRICTION]) * GRAVITY_M_PER_S2 + 1e-3 + rig.host.strongest_m_per_s2


@making_arrays
def workspace() -> Workspace:
    """Arrays for :func:`advance`."""
    return Workspace(np.empty((4, STATES)), np.empty(STATES), np.empty(W.KNOWN_SIZE), np.zeros(3))


@compiled
def step_within(span: float, floor_speed: float, p: Array, strongest: float) -> float:
    """Step (s) for the next part of ``span`` (s, either sign) of a disk with this speed against the floor (m/s):
    LONGEST_STEP_S at most, shorter where the floor's friction turns, which ``strongest`` (m/s^2) bounds."""
    limit = LONGEST_STEP_S
    if p[P.FRICTION] != 0.0:
        limit = min(limit, SHARE_OF_SPEED * max(REGULARISATION_M_PER_S, floor_speed) / strongest)
    return span / np.ceil(abs(span) / limit)


@compiled
def advance(
    y: Array, t: float, span: float, p: Array, rig: FlightRig, strongest: float, work: Workspace, out: Array
) -> None:
    """out = state ``span`` seconds (either sign) after ``y`` at t, by classical Runge-Kutta of fourth order.

    By steps of :func:`step_within`, ``strongest`` (m/s^2) being that of :func:`strongest_acceleration`.  ``out`` may be
    ``y``.
    """
    k, trial = work.slopes, work.trial
    for j in range(STATES):
        out[j] = y[j]
    while span != 0.0:
        h = span
        for stage in range(4):
            c = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for j in range(STATES):
                trial[j] = out[j] if stage == 0 else out[j] + c * h * k[stage - 1, j]
            a = accelerated(t + c * h, trial, p, rig, work)
            k[stage, X], k[stage, Y], k[stage, ANGLE] = trial[VX], trial[VY], trial[SPIN]
            k[stage, VX], k[stage, VY], k[stage, SPIN] = a.x, a.y, a.spin
            if stage == 0:
                h = step_within(span, a.floor_speed, p, strongest)
        for j in range(STATES):
            out[j] += h / 6 * (k[0, j] + 2 * k[1, j] + 2 * k[2, j] + k[3, j])
        t += h
        span = span - h if 0.0 < abs(h) < abs(span) else 0.0  # also where a law has no number: then no path has


@compiled
def first_after(times: Array, t0: float) -> int:
    """Number of the first of the sorted ``times`` that is not before t0."""
    before = 0
    while before < len(times) and times[before] < t0:
        before += 1
    return before


@compiled
def in_turn(number: int, before: int, count: int) -> int:
    """Which of ``count`` sorted times, ``before`` of them before a flight's t0, comes as ``number``: first those after
    it in order, then those before it, backwards; each side starts from t0."""
    return before + number if number < count - before else count - 1 - number


@making_arrays
def fly(start: Array, t0: float, times: Array, p: Array, rig: FlightRig, out: Array) -> None:
    """States (len(times), 6) at sorted ``times`` on either side of t0, by classical Runge-Kutta of fourth order."""
    work, y = workspace(), np.empty(STATES)
    strongest = strongest_acceleration(p, rig)
    before = first_after(times, t0)
    t = t0
    for number in range(len(times)):
        i: int = in_turn(number, before, len(times))
        if number == 0 or number == len(times) - before:
            t = t0
            y[:] = start
        advance(y, t, times[i] - t, p, rig, strongest, work, y)
        out[i] = y
        t = times[i]
