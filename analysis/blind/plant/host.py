"""How the Host moves, by the lines of its path."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, making_arrays

# What goes with the Host's acceleration, speed or way is stated for 8 g at 11 Hz.
HOST_M_PER_S2 = 78.5
HOST_M_PER_S = 1.136
HOST_M = 0.01643
JERK_S = 1e-5  # a difference over a thousandth of the drive's period


Four = tuple[float, float, float, float]  # x, y, rotation, z


@compiled
def pose_of(time: float, host: Floats) -> tuple[Four, Four, Four]:
    """Host position, velocity and acceleration from its lines: rows (n, 7) of axis, amplitude, angular frequency,
    phase, of a line that dies out (rate > 0) the time of that phase and the rate, and how fast the angular frequency
    rises."""
    x0, y0, r0, z0 = 0.0, 0.0, 0.0, 0.0
    x1, y1, r1, z1 = 0.0, 0.0, 0.0, 0.0
    x2, y2, r2, z2 = 0.0, 0.0, 0.0, 0.0
    for i in range(host.shape[0]):
        axis, amplitude, omega = int(host[i, 0]), host[i, 1], host[i, 2]
        if host[i, 5] > 0.0:
            late, decay = time - host[i, 4], host[i, 5]
            size = amplitude * np.exp(-decay * late)
            s, c = np.sin(omega * late + host[i, 3]), np.cos(omega * late + host[i, 3])
            moved = size * s
            speed = size * (omega * c - decay * s)
            rate = size * ((decay**2 - omega**2) * s - 2.0 * decay * omega * c)
        else:
            phase = (omega + 0.5 * host[i, 6] * time) * time + host[i, 3]
            omega += host[i, 6] * time
            s, c = np.sin(phase), np.cos(phase)
            moved = amplitude * s
            speed = amplitude * omega * c
            rate = amplitude * host[i, 6] * c - amplitude * omega**2 * s
        if axis == 0:
            x0, x1, x2 = x0 + moved, x1 + speed, x2 + rate
        elif axis == 1:
            y0, y1, y2 = y0 + moved, y1 + speed, y2 + rate
        elif axis == 2:
            r0, r1, r2 = r0 + moved, r1 + speed, r2 + rate
        else:
            z0, z1, z2 = z0 + moved, z1 + speed, z2 + rate
    return (x0, y0, r0, z0), (x1, y1, r1, z1), (x2, y2, r2, z2)


@making_arrays
def host_pose(time: float, host: Floats) -> tuple[Floats, Floats, Floats]:
    """`pose_of` as arrays (4,), for Python."""
    position, velocity, acceleration = pose_of(time, host)
    return np.array(position), np.array(velocity), np.array(acceleration)


@compiled
def jerk_of(time: float, host: Floats) -> Four:
    """Rate of the Host's acceleration."""
    after, before = pose_of(time + JERK_S, host)[2], pose_of(time - JERK_S, host)[2]
    return (
        (after[0] - before[0]) / (2.0 * JERK_S),
        (after[1] - before[1]) / (2.0 * JERK_S),
        (after[2] - before[2]) / (2.0 * JERK_S),
        (after[3] - before[3]) / (2.0 * JERK_S),
    )


def host_rise(x_m: Floats, arc_per_m: float) -> Floats:
    """How far a Host on leaf springs has risen (n,) where it stands off its middle along x."""
    return 0.5 * arc_per_m * x_m**2
