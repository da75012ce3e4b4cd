"""How the Host moves, by the lines of its path."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled

# What goes with the Host's acceleration or speed is stated for 8 g at 11 Hz.
HOST_M_PER_S2 = 78.5
HOST_M_PER_S = 1.136
JERK_S = 1e-5  # a difference over a thousandth of the drive's period


@compiled
def host_pose(time: float, host: Floats) -> tuple[Floats, Floats, Floats]:
    """Host position, velocity and acceleration (each: x, y, rotation, z) from its lines: rows (n, 7) of axis,
    amplitude, angular frequency, phase, of a line that dies out (rate > 0) the time of that phase and the rate, and how
    fast the angular frequency rises."""
    position, velocity, acceleration = np.zeros(4), np.zeros(4), np.zeros(4)
    for i in range(host.shape[0]):
        axis, amplitude, omega = int(host[i, 0]), host[i, 1], host[i, 2]
        if host[i, 5] > 0.0:
            late, decay = time - host[i, 4], host[i, 5]
            size = amplitude * np.exp(-decay * late)
            s, c = np.sin(omega * late + host[i, 3]), np.cos(omega * late + host[i, 3])
            position[axis] += size * s
            velocity[axis] += size * (omega * c - decay * s)
            acceleration[axis] += size * ((decay**2 - omega**2) * s - 2.0 * decay * omega * c)
            continue
        phase = (omega + 0.5 * host[i, 6] * time) * time + host[i, 3]
        omega += host[i, 6] * time
        s, c = np.sin(phase), np.cos(phase)
        position[axis] += amplitude * s
        velocity[axis] += amplitude * omega * c
        acceleration[axis] += amplitude * host[i, 6] * c - amplitude * omega**2 * s
    return position, velocity, acceleration


@compiled
def host_jerk(time: float, host: Floats) -> Floats:
    """Rate of the Host's acceleration (x, y, rotation, z)."""
    return (host_pose(time + JERK_S, host)[2] - host_pose(time - JERK_S, host)[2]) / (2.0 * JERK_S)


def host_rise(x_m: Floats, arc_per_m: float) -> Floats:
    """How far a Host on leaf springs has risen (n,) where it stands off its middle along x."""
    return 0.5 * arc_per_m * x_m**2
