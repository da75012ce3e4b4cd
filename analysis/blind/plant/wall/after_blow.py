"""What a blow does to the spin beside its two impulses, to the disk on the floor, and to what is remembered of it."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    APPROACH,
    AZIMUTH,
    BLOWS,
    DENTS,
    HARDEST,
    HEAT,
    HERE_X,
    HERE_Y,
    NOD_VX,
    NOD_VY,
    NOD_X,
    NOD_Y,
    NORMAL,
    RIM_DENTS,
    SLEEVE,
    SLIPPED,
    SPIN,
    STRUCK,
    THERE_X,
    THERE_Y,
    TIRED,
    VX,
    VY,
    WALK_X,
    WALK_Y,
)
from analysis.blind.plant.wall.blow import Blow
from analysis.blind.plant.wall.motion import swing, tiredness
from analysis.blind.plant.wall.restitution import struck_sector

TOUCH_M_PER_S = 0.3  # approach of an impact that is a mere touch: of a disk that comes to rest at the wall
KNEADING_M_PER_S = 0.7  # approach from which clay or a soft rim yields: a disk that hops round the wall is slower
LEANING_PARTS = 8  # in which the floor takes its share of one blow: its friction turns with the slip


@inlined
def spin_after(spin: float, blow: Blow, push_n: float, push_t: float, bounce: float, p: PlantParameters) -> float:
    """Spin of a disk that had `spin`, after both impulses (m/s) at their levers and all else that turns it.

    A chamfer leads the normal impulse past the disk's middle, by `offset_blow_m`.
    A rubber ring around the rim is held on a flat, the larger the harder the blow: `o_ring_s_per_m` times the approach
    of the spin is lost.
    A soft rim resists being turned, in proportion to the blow and at most to rest: `rolling_arm_m`.
    """
    inertia = p.inertia_factor * p.disk_radius_m**2
    spin += (push_n * blow.lever_n + push_t * blow.lever_t) / inertia
    spin += p.offset_blow_m * push_n / inertia * bounce
    spin *= max(1.0 - p.o_ring_s_per_m * (blow.approach * bounce), 0.0)
    spin *= 1.0 - p.rolling_loss * bounce
    if p.rolling_arm_m == 0.0:
        return spin
    against = spin - blow.host_velocity[2]
    most = p.rolling_arm_m * abs(push_n * bounce) / inertia
    return blow.host_velocity[2] + (max(against - most, 0.0) if against > 0.0 else min(against + most, 0.0))


@inlined
def press_down(new: Floats, blow: Blow, push_n: float, p: PlantParameters) -> None:
    """A wall that leans over the disk presses it down where it strikes: there the floor's friction takes its share of
    the blow `push_n` (m/s) from the slip that the blow has left."""
    if p.leaning == 0.0:
        return
    part = p.leaning * p.floor_friction * abs(push_n) / LEANING_PARTS
    for _ in range(LEANING_PARTS):
        ux = new[VX] - new[SPIN] * blow.arm_y - blow.host_velocity[0]
        uy = new[VY] + new[SPIN] * blow.arm_x - blow.host_velocity[1]
        speed = np.sqrt(ux * ux + uy * uy) + 1e-300
        held = min(part / speed, 1.0 / 3.0)  # along the tangent a point of the rim has a third of the mass: no reversal
        new[VX] -= held * ux
        new[VY] -= held * uy
        new[SPIN] -= held * (blow.arm_x * uy - blow.arm_y * ux) / (p.inertia_factor * p.disk_radius_m**2)


@inlined
def remember(
    new: Floats, state: Floats, blow: Blow, push_n: float, push_t: float, bounce: float, p: PlantParameters
) -> None:
    """What later flights and blows follow, into the state after this one; of what is held (`bounce` 0) only where it
    is."""
    new[HARDEST], new[AZIMUTH], new[NORMAL] = max(state[HARDEST], blow.approach), blow.azimuth, blow.normal_rad
    if bounce > 0.0:
        new[APPROACH], new[TIRED] = blow.approach, tiredness(blow.time, state) + blow.approach**2
        new[SLEEVE] = blow.sleeve - (p.sleeve * push_t if blow.outer else 0.0)
        new[BLOWS] = state[BLOWS] + (1.0 if blow.approach > TOUCH_M_PER_S else 0.0)
        new[SLIPPED], new[STRUCK] = blow.slip_host, blow.rim_rad
        new[THERE_X], new[THERE_Y] = state[HERE_X], state[HERE_Y]
        new[HERE_X], new[HERE_Y] = blow.middle_x, blow.middle_y
        remember_swing(new, state, blow.time, p)
        if (p.hammered != 0.0 or p.burnished != 0.0) and blow.approach > TOUCH_M_PER_S:
            new[DENTS + struck_sector(blow.azimuth)] += 1.0
        if p.clay_m != 0.0 and blow.outer and blow.approach > KNEADING_M_PER_S:
            new[DENTS + struck_sector(blow.azimuth)] += 1.0
        on_the_rim = p.peened != 0.0 or (p.flattened_m != 0.0 and blow.outer)
        if on_the_rim and blow.approach > KNEADING_M_PER_S:
            new[RIM_DENTS + struck_sector(blow.rim_rad)] += 1.0
        if p.walked_m != 0.0 and blow.outer and blow.approach > TOUCH_M_PER_S:
            new[WALK_X], new[WALK_Y] = state[WALK_X] + blow.nx, state[WALK_Y] + blow.ny
        if p.heated != 0.0:
            new[HEAT] = state[HEAT] + taken(blow, push_n, push_t, p)
        if p.nodding != 0.0:
            new[NOD_VX] -= push_n * blow.nx - push_t * blow.ny
            new[NOD_VY] -= push_n * blow.ny + push_t * blow.nx


@inlined
def taken(blow: Blow, push_n: float, push_t: float, p: PlantParameters) -> float:
    """Energy per unit mass (m^2/s^2) that both impulses (m/s) take from the disk against the wall: each times the mean
    of its point's velocity before and after."""
    inertia = p.inertia_factor * p.disk_radius_m**2
    turn = (push_n * blow.lever_n + push_t * blow.lever_t) / inertia
    along_n = blow.approach + 0.5 * (push_n + blow.lever_n * turn)
    along_t = blow.slip + 0.5 * (push_t + blow.lever_t * turn)
    return max(-push_n * along_n - push_t * along_t, 0.0)


@inlined
def remember_swing(new: Floats, state: Floats, time: float, p: PlantParameters) -> None:
    """How far and how fast a wall swings at `time`, which is that of the last impact from now on."""
    if p.nodding != 0.0:
        x, y, moves_x, moves_y = swing(time, state, p)
        new[NOD_X], new[NOD_Y], new[NOD_VX], new[NOD_VY] = x, y, moves_x, moves_y
