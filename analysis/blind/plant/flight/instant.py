"""What the laws of a flight are given at one instant."""

from typing import NamedTuple

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.host import Four, pose_of
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, APPROACH, COUNT, IMPACT_S, NORMAL, SPIN, VX, VY, X, Y

KICKED_S = 0.04  # in which a floor that a blow has kicked comes to rest by two thirds: most of a flight


class Instant(NamedTuple):
    """The disk in flight at one time; the Host's position, velocity and acceleration are x, y, rotation, z."""

    time: float
    state: Floats
    x: float  # of the disk's middle, from the Host's centre (m)
    y: float
    rate_x: float  # its velocity against the Host (m/s)
    rate_y: float
    slip_x: float  # and over the floor
    slip_y: float
    spin: float  # against the Host (rad/s)
    turning: float  # and over the floor
    arm_x: float  # from the centre of mass to the disk's middle (m)
    arm_y: float
    host_position: Four
    host_velocity: Four
    host_acceleration: Four


@inlined
def instant_of(time: float, state: Floats, p: PlantParameters, host: Floats) -> Instant:
    """The disk at `time`, over a floor that may stay behind the Host (`loose_floor`) or turn below it
    (`floor_turn_rad_per_s`), or swing about its one screw by `swing_rad_per_m` times the Host's way along x.

    A floor plate on soft pads is kicked by each blow on the ring that stands on it, and swings: along the blow's normal
    at `kicked` v exp(-t / `KICKED_S`) cos(`kicked_rad_per_s` t), v the blow's approach, t the time since then.
    """
    position, velocity, acceleration = pose_of(time, host)
    cosine, sine = np.cos(state[ANGLE]), np.sin(state[ANGLE])
    arm_x = -(cosine * p.mass_x_m - sine * p.mass_y_m)
    arm_y = -(sine * p.mass_x_m + cosine * p.mass_y_m)
    spin = state[SPIN]
    x = state[X] + arm_x - position[0]
    y = state[Y] + arm_y - position[1]
    rate_x = state[VX] - spin * arm_y - (velocity[0] - velocity[2] * y)
    rate_y = state[VY] + spin * arm_x - (velocity[1] + velocity[2] * x)
    slip_x = rate_x + p.loose_floor * velocity[0] + p.floor_turn_rad_per_s * y
    slip_y = rate_y + p.loose_floor * velocity[1] - p.floor_turn_rad_per_s * x
    against = spin - velocity[2]
    turning = against - p.floor_turn_rad_per_s
    if p.swing_rad_per_m != 0.0:
        swings = p.swing_rad_per_m * velocity[0]
        slip_x, slip_y = slip_x + swings * (y - p.swing_y_m), slip_y - swings * (x - p.swing_x_m)
        turning -= swings
    late = time - state[IMPACT_S]
    if p.kicked != 0.0 and state[COUNT] > 0.5 and late >= 0.0:
        moves = p.kicked * state[APPROACH] * np.exp(-late / KICKED_S) * np.cos(p.kicked_rad_per_s * late)
        slip_x, slip_y = slip_x - moves * np.cos(state[NORMAL]), slip_y - moves * np.sin(state[NORMAL])
    return Instant(
        time,
        state,
        x,
        y,
        rate_x,
        rate_y,
        slip_x,
        slip_y,
        against,
        turning,
        arm_x,
        arm_y,
        position,
        velocity,
        acceleration,
    )
