"""The equation of motion of a flight, compiled: nominal terms, every flight effect, and probes that nobody lists.

State of the disk: x, y, angle, vx, vy, spin of its centre of mass in the world.  Parameters are one vector in the order of
:data:`PARAMETERS`; a zero switches its term off, so that the derivative of a flight with respect to any of them is the
same call with one entry changed.  The Host's motion comes as harmonics (:class:`analysis.host_motion.HostMotion`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from ovines.core.friction import farkas

Array = NDArray[np.float64]

#: name -> (unit, what it adds to the acceleration); the order is that of the parameter vector
PARAMETERS: dict[str, tuple[str, str]] = {
    "friction": ("1", "floor friction coefficient mu_s"),
    "coupling": ("1", "0 plain Coulomb friction, 1 Farkas' coupling of sliding and spinning"),
    "viscous": ("1/s", "-c v, v against the room"),
    "air": ("1/m", "-c |v| v, v against the room"),
    "tilt_x": ("m/s^2", "constant acceleration along x"),
    "tilt_y": ("m/s^2", "constant acceleration along y"),
    "load": ("1", "share of the Host's measured z'' that acts on the floor load"),
    "drift": ("1/s", "relative change of mu_s per second"),
    # Probes: structure outside the library is found through them, never named by them.
    "centre_host": ("1/s^2", "-k (r - r_Host)"),
    "centre_room": ("1/s^2", "-k r"),
    "curl_host": ("1/s^2", "k z x (r - r_Host)"),
    "saddle_host": ("1/s^2", "k (x, -y) from the Host's centre"),
    "skew_host": ("1/s^2", "k (y, x) from the Host's centre"),
    "saddle_room": ("1/s^2", "k (x, -y) in the room"),
    "skew_room": ("1/s^2", "k (y, x) in the room"),
    "magnus": ("1", "k omega z x v"),
    "gyro": ("1/s", "k z x v"),
    "spin_decay": ("1/s", "-k omega on the spin"),
    "spin_drive": ("rad/s^2", "constant angular acceleration"),
    "friction_radius": ("1", "relative change of mu_s with the distance from the Host's centre over R_c"),
    "friction_x": ("1", "relative change of mu_s with x from the Host's centre over R_c"),
    "friction_y": ("1", "relative change of mu_s with y from the Host's centre over R_c"),
    "friction_room_x": ("1", "relative change of mu_s with x in the room over R_c"),
    "friction_speed": ("s/m", "relative change of mu_s with the sliding speed"),
    "friction_axis": ("1", "friction larger along x than along y by this share"),
    "friction_skew": ("1", "friction larger along x = y than across it by this share"),
    "friction_cos": ("1", "relative change of mu_s with cos(drive phase)"),
    "friction_sin": ("1", "relative change of mu_s with sin(drive phase)"),
    "host_drag": ("1/s", "-c (v - v_Host)"),
    "force_cos_x": ("m/s^2", "cos(drive phase) along x"),
    "force_sin_x": ("m/s^2", "sin(drive phase) along x"),
    "force_cos_y": ("m/s^2", "cos(drive phase) along y"),
    "force_sin_y": ("m/s^2", "sin(drive phase) along y"),
    "radial_cubic": ("1/s^2", "-k (|r - r_Host|/R_c)^2 (r - r_Host)"),
    "radial_unit": ("m/s^2", "-k (r - r_Host)/|r - r_Host|"),
    "wall_pull": ("m/s^2", "-k (|r - r_Host|/R_c)^8 along the radius: felt in the last few millimetres before the wall"),
    "friction_since": ("1", "relative change of mu_s that dies out within 15 ms of the impact before"),
    "impact_before_s": ("s", "time of the impact before: no unknown, it differs from flight to flight"),
}
INDEX = {name: i for i, name in enumerate(PARAMETERS)}
GRAVITY_M_PER_S2 = 9.81
# Below this sliding speed the friction is smoothed; 1 mm/s is a thousandth of what the disk usually slides with.
REGULARISATION_M_PER_S = 1e-3
# How long a floor may remember an impact, for the probe that asks (a hop lasts about as long).
SETTLING_S = 0.015
# Longest Runge-Kutta step: a frame at 800 fps keeps the error of a flight below 1e-8 m away from v = 0.
LONGEST_STEP_S = 1.3e-3
# Where the disk slides the other way its friction turns within the time in which the sliding speed changes by itself: a step
# changes it by this share at most.  Whole frames across such turns left up to 1 mm/s each, which a flight of 0.8 s shows.
SHARE_OF_SPEED = 0.4

STATES = 6


@compiled
def host_at(t: float, harmonics: Array, omega: float, out: Array) -> None:
    """Host at time t: out[0:4] x, y, z, angle; [4:8] their rates; [8] z''. ``harmonics`` (4, 1 + 2 K): mean, cos, sin, ..."""
    for axis in range(4):
        out[axis] = harmonics[axis, 0]
        out[4 + axis] = 0.0
    out[8] = 0.0
    for k in range((harmonics.shape[1] - 1) // 2):
        w = omega * (k + 1)
        c, s = np.cos(w * t), np.sin(w * t)
        for axis in range(4):
            a, b = harmonics[axis, 1 + 2 * k], harmonics[axis, 2 + 2 * k]
            out[axis] += a * c + b * s
            out[4 + axis] += w * (b * c - a * s)
        out[8] -= w * w * (harmonics[2, 1 + 2 * k] * c + harmonics[2, 2 + 2 * k] * s)


@compiled
def acceleration(t: float, y: Array, p: Array, harmonics: Array, omega: float, radius: float, inertia: float,
                 contact_radius: float, phase: float, host: Array, out: Array) -> None:
    """out[0:3] = x'', y'', spin'; out[3] the speed against the floor, sliding and rim together (m/s).

    ``phase`` is the drive's phase at t = 0; ``inertia`` the factor q of I = q m R^2."""
    host_at(t, harmonics, omega, host)
    rx, ry = y[0] - host[0], y[1] - host[1]
    ux = y[3] - host[4] + host[7] * ry
    uy = y[4] - host[5] - host[7] * rx
    spin = y[5] - host[7]
    slide = np.sqrt(ux * ux + uy * uy)
    rim = radius * abs(spin)
    total = np.sqrt(slide * slide + rim * rim)
    ax, ay, torque = p[4], p[5], p[18]
    drive = omega * t + phase
    cosine, sine = np.cos(drive), np.sin(drive)
    if p[0] != 0.0 and total > 0.0:
        load = GRAVITY_M_PER_S2 + p[6] * host[8]
        load = max(load, 0.0)
        distance = np.sqrt(rx * rx + ry * ry)
        mu = p[0] * (1 + p[7] * t + (p[19] * distance + p[20] * rx + p[21] * ry + p[22] * y[0]) / contact_radius
                     + p[23] * slide + p[26] * cosine + p[27] * sine)
        if p[36] != 0.0 and t >= p[37]:
            mu += p[0] * p[36] * np.exp(-(t - p[37]) / SETTLING_S)
        smooth = np.tanh(total / REGULARISATION_M_PER_S)
        # F/slide and T/rim stay finite where either vanishes: Coulomb's force is along u, Farkas' along both.
        f, tau = 1.0, 0.0
        if p[1] != 0.0:
            ff, ft = farkas(slide / rim) if rim > 1e-12 else (1.0, 0.0)
            f = 1.0 + p[1] * (ff - 1.0)
            tau = p[1] * ft
        strength = mu * load * smooth
        if slide > 1e-12:
            ax -= strength * f * ((1 + p[24]) * ux + p[25] * uy) / slide
            ay -= strength * f * ((1 - p[24]) * uy + p[25] * ux) / slide
        if rim > 1e-12:
            torque -= strength * tau / (inertia * radius) * np.sign(spin)
    vx, vy = y[3], y[4]
    speed = np.sqrt(vx * vx + vy * vy)
    drag = p[2] + p[3] * speed
    ax -= drag * vx
    ay -= drag * vy
    ratio2 = (rx * rx + ry * ry) / contact_radius**2
    pull = p[8] + p[33] * ratio2 + (p[34] + p[35] * ratio2**4) / np.sqrt(rx * rx + ry * ry + 1e-8)
    ax += -pull * rx - p[10] * ry + p[11] * rx + p[12] * ry - p[9] * y[0] + p[13] * y[0] + p[14] * y[1]
    ay += -pull * ry + p[10] * rx - p[11] * ry + p[12] * rx - p[9] * y[1] - p[13] * y[1] + p[14] * y[0]
    turn = p[15] * y[5] + p[16]
    ax += -turn * vy - p[28] * (vx - host[4]) + p[29] * cosine + p[30] * sine
    ay += turn * vx - p[28] * (vy - host[5]) + p[31] * cosine + p[32] * sine
    torque -= p[17] * y[5]
    out[0], out[1], out[2], out[3] = ax, ay, torque, total


@compiled
def strongest_acceleration(p: Array, harmonics: Array, omega: float) -> float:
    """Upper bound of the acceleration of disk against floor (m/s^2), for :func:`advance`."""
    total = 2 * abs(p[0]) * GRAVITY_M_PER_S2 + 1e-3
    for k in range((harmonics.shape[1] - 1) // 2):
        w = omega * (k + 1)
        for axis in range(2):
            total += w * w * np.sqrt(harmonics[axis, 1 + 2 * k] ** 2 + harmonics[axis, 2 + 2 * k] ** 2)
    return total


@compiled
def advance(y: Array, t: float, span: float, p: Array, harmonics: Array, omega: float, radius: float, inertia: float,
            contact_radius: float, phase: float, strongest: float, k: Array, trial: Array, host: Array, a: Array, out: Array) -> None:
    """out = state ``span`` seconds (either sign) after ``y`` at t, by classical Runge-Kutta of fourth order.

    Steps of at most LONGEST_STEP_S, shorter where the floor's friction turns.  ``out`` may be ``y``; ``k`` (4, 6), ``trial`` (6,),
    ``host`` (9,) and ``a`` (4,) are room to work in."""
    for j in range(6):
        out[j] = y[j]
    shortest = SHARE_OF_SPEED * REGULARISATION_M_PER_S / strongest
    while span != 0.0:
        h = span
        for stage in range(4):
            c = 0.0 if stage == 0 else (1.0 if stage == 3 else 0.5)
            for j in range(6):
                trial[j] = out[j] if stage == 0 else out[j] + c * h * k[stage - 1, j]
            acceleration(t + c * h, trial, p, harmonics, omega, radius, inertia, contact_radius, phase, host, a)
            k[stage, 0], k[stage, 1], k[stage, 2] = trial[3], trial[4], trial[5]
            k[stage, 3], k[stage, 4], k[stage, 5] = a[0], a[1], a[2]
            if stage == 0:
                limit = LONGEST_STEP_S
                if p[0] != 0.0:
                    limit = min(limit, max(shortest, SHARE_OF_SPEED * a[3] / strongest))
                h = span / np.ceil(abs(span) / limit)
        for j in range(6):
            out[j] += h / 6 * (k[0, j] + 2 * k[1, j] + 2 * k[2, j] + k[3, j])
        t += h
        span = 0.0 if h == span else span - h


@compiled
def fly(start: Array, t0: float, times: Array, p: Array, harmonics: Array, omega: float, radius: float, inertia: float,
        contact_radius: float, phase: float, out: Array) -> None:
    """States (len(times), 6) at sorted ``times`` on either side of t0, by classical Runge-Kutta of fourth order."""
    host, a = np.empty(9), np.empty(4)
    k = np.empty((4, 6))
    y, trial = np.empty(6), np.empty(6)
    strongest = strongest_acceleration(p, harmonics, omega)
    n = len(times)
    before = 0
    while before < n and times[before] < t0:
        before += 1
    t = t0
    for number in range(n):
        # First the times after t0 in order, then those before it, backwards, each side starting from t0.
        i = before + number if number < n - before else n - 1 - number
        if number == 0 or number == n - before:
            t = t0
            y[:] = start
        advance(y, t, times[i] - t, p, harmonics, omega, radius, inertia, contact_radius, phase, strongest, k, trial, host, a, y)
        out[i] = y
        t = times[i]


@compiled
def fly_with_derivatives(start: Array, t0: float, times: Array, p: Array, free: NDArray[np.int64], steps: Array, harmonics: Array,
                         omega: float, radius: float, inertia: float, contact_radius: float, phase: float,
                         out: Array, derivative: Array) -> None:
    """As :func:`fly`, and differences (len(times), 6, 6 + len(free)) with respect to start state and parameters ``free``."""
    n = len(times)
    fly(start, t0, times, p, harmonics, omega, radius, inertia, contact_radius, phase, out)
    moved = np.empty((n, 6))
    s, q = start.copy(), p.copy()
    for j in range(6 + len(free)):
        if j == 2:
            # The law of flight does not know the disk's angle: it only adds to the angle itself.
            derivative[:, :, 2] = 0.0
            derivative[:, 2, 2] = 1.0
            continue
        if j < 6:
            h = 1e-6 if j < 2 else (1e-5 if j < 5 else 1e-3)
            s[j] += h
        else:
            h = steps[j - 6]
            q[free[j - 6]] += h
        fly(s, t0, times, q, harmonics, omega, radius, inertia, contact_radius, phase, moved)
        if j < 6:
            s[j] = start[j]
        else:
            q[free[j - 6]] = p[free[j - 6]]
        for i in range(n):
            for m in range(6):
                derivative[i, m, j] = (moved[i, m] - out[i, m]) / h


@compiled
def fly_with_velocity_derivatives(start: Array, t0: float, times: Array, p: Array, harmonics: Array, omega: float, radius: float,
                                  inertia: float, contact_radius: float, phase: float, out: Array, derivative: Array) -> None:
    """As :func:`fly`, and (len(times), 6, 6) with a displaced start taken to displace the whole flight.

    That is exact but for fields that vary with place (the Host's rotation among them) and enough to find a minimum with."""
    n = len(times)
    fly(start, t0, times, p, harmonics, omega, radius, inertia, contact_radius, phase, out)
    moved = np.empty((n, 6))
    s = start.copy()
    derivative[:, :, :3] = 0.0
    for i in range(n):
        for j in range(3):
            derivative[i, j, j] = 1.0
    for j in range(3, 6):
        h = 1e-5 if j < 5 else 1e-3
        s[j] += h
        fly(s, t0, times, p, harmonics, omega, radius, inertia, contact_radius, phase, moved)
        s[j] = start[j]
        for i in range(n):
            for m in range(6):
                derivative[i, m, j] = (moved[i, m] - out[i, m]) / h
