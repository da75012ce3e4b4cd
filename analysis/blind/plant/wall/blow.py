"""A blow as its laws get it: where and in which direction the wall strikes, with which lever, how fast."""

from typing import NamedTuple

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, inlined
from analysis.blind.plant.host import Four, pose_of
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, IMPACT_S, SPIN, X, Y
from analysis.blind.plant.wall.motion import humming, sleeve_speed, swinging_speed

PILED_M_PER_S = 0.4  # slip from which on a soft lining is piled up the whole way
CORNER_M_PER_S = 0.2  # approach from which on a rim strikes with one corner: a slower one leans on two


class Blow(NamedTuple):
    """One blow; the Host's velocity and acceleration are x, y, rotation, z."""

    time: float
    approach: float  # along the normal (m/s)
    slip: float  # along the tangent, counterclockwise, over the wall's surface (m/s)
    slip_host: float  # and against the Host
    sleeve: float  # speed of a turning sleeve's surface as the blow begins (m/s)
    outer: bool  # the wall, not a cylinder in it
    nx: float  # the outward normal
    ny: float
    normal_rad: float  # its direction
    azimuth: float  # of the contact, seen from the Host's centre (rad)
    rim_rad: float  # the struck place, in the disk
    middle_x: float  # of the centre of mass, from the Host's centre (m)
    middle_y: float
    arm_x: float  # of the contact from the centre of mass (m)
    arm_y: float
    lever_n: float  # torque of a unit impulse along the normal, and along the tangent (m)
    lever_t: float
    since_s: float  # since the blow before
    chance: float  # of its own, standard normal: of the restitution ...
    other_chance: float  # ... and another one
    host_velocity: Four
    host_acceleration: Four


@compiled
def blow_of(
    time: float,
    state: Floats,
    p: PlantParameters,
    host: Floats,
    scatter: Floats,
    bounce: float,
    normal: tuple[float, float],
    meeting: tuple[float, float, float, float],
) -> Blow:
    """The blow along `normal` of a disk that meets the wall with an approach, a slip and an arm (x, y)."""
    (nx, ny), (approach, slip, arm_x, arm_y) = normal, meeting
    position, velocity, acceleration = pose_of(time, host)
    normal_rad = np.arctan2(ny, nx)
    beside = corner_lever(approach, normal_rad - state[ANGLE], p) * bounce
    arm_x, arm_y = arm_x - beside * ny, arm_y + beside * nx
    from_x, from_y = state[X] + arm_x - position[0], state[Y] + arm_y - position[1]
    azimuth, outer = np.arctan2(from_y, from_x), from_x * nx + from_y * ny > 0.0
    sleeve = sleeve_speed(time, state, p)
    surface = (sleeve + swinging_speed(velocity, p)) * bounce if outer else 0.0
    away_n, away_t = humming(time, approach, normal_rad, p) if outer and bounce > 0.0 else (0.0, 0.0)
    return Blow(
        time,
        approach - beside * (state[SPIN] - velocity[2]) - away_n,
        slip - surface - away_t,
        slip,
        sleeve,
        outer,
        nx,
        ny,
        normal_rad,
        azimuth,
        azimuth - state[ANGLE],
        state[X] - position[0],
        state[Y] - position[1],
        arm_x,
        arm_y,
        arm_x * ny - arm_y * nx,
        arm_x * nx + arm_y * ny,
        time - state[IMPACT_S],
        scatter[0],
        scatter[1],
        velocity,
        acceleration,
    )


@inlined
def leaning(nx: float, ny: float, chance: float, bounce: float, p: PlantParameters) -> tuple[float, float]:
    """The wall's normal where a rough or ragged wall, by `chance`, or one with teeth that lean turns the blow; what is
    held (`bounce` 0) lies against the teeth's tips.

    A turning tool that chattered has left the wall wavy: `marks_rad` sin(`marks` (the normal's direction) +
    `marks_phase_rad`).
    """
    leans = (p.rough_rad + p.ragged_rad) * chance + p.saw_rad * bounce
    if p.marks_rad != 0.0:
        leans += p.marks_rad * bounce * np.sin(p.marks * np.arctan2(ny, nx) + p.marks_phase_rad)
    if leans == 0.0:
        return nx, ny
    c, s = np.cos(leans), np.sin(leans)
    return c * nx - s * ny, s * nx + c * ny


@inlined
def piled(nx: float, ny: float, slip: float, p: PlantParameters) -> tuple[float, float]:
    """The normal of a soft lining that bulges before a disk which slips along it: turned from the wall's own towards
    where it slips, by `piled_rad` tanh(slip / `PILED_M_PER_S`), and so the blow against the slip."""
    leans = p.piled_rad * np.tanh(slip / PILED_M_PER_S)
    c, s = np.cos(leans), np.sin(leans)
    return c * nx - s * ny, s * nx + c * ny


@inlined
def corner_lever(approach: float, rim_rad: float, p: PlantParameters) -> float:
    """How far beside the normal through the disk's middle (m, counterclockwise) the wall touches a rim that was filed
    to so many blunt corners: `cornered_m` sin(`corners` (`rim_rad` - `cornered_rad`)) tanh(`approach` /
    `CORNER_M_PER_S`), `rim_rad` the normal's direction in the disk."""
    if p.cornered_m == 0.0:
        return 0.0
    return p.cornered_m * np.tanh(approach / CORNER_M_PER_S) * np.sin(p.corners * (rim_rad - p.cornered_rad))
