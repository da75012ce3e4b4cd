"""Contact of disk and wall: the gap, how they approach, the impulses of a blow and what it leaves behind."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, copy_into, making_arrays
from analysis.blind.plant.host import jerk_of, pose_of
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, COUNT, IMPACT_S, LEFT, SPIN, VX, VY, X, Y
from analysis.blind.plant.wall.after_blow import press_down, remember, remember_swing, spin_after
from analysis.blind.plant.wall.blow import blow_of, leaning, piled
from analysis.blind.plant.wall.impulses import impulses
from analysis.blind.plant.wall.motion import leaked, receded, squashed, wall_offset, wall_velocity
from analysis.blind.plant.wall.shape import (
    climbed,
    flat_gap,
    flattened,
    heating_speed,
    kneaded,
    peeled,
    planed,
    pressed,
    quiver_speed,
    quivered,
    reach,
    relaxed,
    rim_middle,
    rim_reach,
    spooled,
    swollen,
    tipped,
    widening,
)


@compiled
def wall_gap(time: float, state: Floats, p: PlantParameters, host: Floats) -> tuple[float, float, float]:
    """Distance of the disk's middle from the curve it may reach, and the wall's outward normal (x, y)."""
    position, velocity, acceleration = pose_of(time, host)
    cosine, sine = np.cos(state[ANGLE]), np.sin(state[ANGLE])
    turn_c, turn_s = np.cos(position[2]), np.sin(position[2])
    x = state[X] - (cosine * p.mass_x_m - sine * p.mass_y_m) - position[0] - (turn_c * p.wall_x_m - turn_s * p.wall_y_m)
    y = state[Y] - (sine * p.mass_x_m + cosine * p.mass_y_m) - position[1] - (turn_s * p.wall_x_m + turn_c * p.wall_y_m)
    off_x, off_y = wall_offset(time, state, position, velocity, acceleration, p)
    rim_x, rim_y = rim_middle(state[ANGLE], state[SPIN], p)
    x, y = x - off_x + rim_x, y - off_y + rim_y
    radius = np.sqrt(x * x + y * y) + 1e-300
    if p.wall_sides > 0.0:
        gap, nx, ny = flat_gap(x, y, position[2], p)
    else:
        azimuth = np.arctan2(y, x)
        far, rise = reach(time, azimuth, state[ANGLE], p)
        if p.squash_m != 0.0:
            more, steeper = squashed(azimuth, acceleration, p)
            far, rise = far + more, rise + steeper
        if p.pressed_m != 0.0:
            more, steeper = pressed(azimuth, state, p)
            far, rise = far + more, rise + steeper
        if p.quiver_m != 0.0:
            more, steeper = quivered(time, azimuth, state, p)
            far, rise = far + more, rise + steeper
        if p.clay_m != 0.0:
            more, steeper = kneaded(azimuth, state, p)
            far, rise = far + more, rise + steeper
        if p.peeling_m != 0.0:
            more, steeper = peeled(azimuth, state, p)
            far, rise = far + more, rise + steeper
        if p.flattened_m != 0.0:
            more, steeper = flattened(azimuth, state, p)
            far, rise = far + more, rise + steeper
        nx, ny = x / radius + rise / radius * y / radius, y / radius - rise / radius * x / radius
        size = np.sqrt(nx * nx + ny * ny)
        gap, nx, ny = (far - radius) / size, nx / size, ny / size
    gap += leaked(time, state, p) + receded(state, p)
    if p.coved_m != 0.0:
        gap += climbed(((state[VX] - velocity[0]) * x + (state[VY] - velocity[1]) * y) / radius, p)
    wider = swollen(state[SPIN], p) - tipped(time, state, p) + spooled(state[ANGLE], p) + planed(state, p)
    gap -= wider
    if p.obstacle_m > 0.0 and radius - p.obstacle_m - wider < gap:
        return radius - p.obstacle_m - wider, -x / radius, -y / radius
    return gap, nx, ny


@compiled
def contact_velocity(
    time: float, state: Floats, p: PlantParameters, host: Floats, nx: float, ny: float
) -> tuple[float, float, float, float]:
    """Approach speed along the normal, slip along the tangent (-ny, nx), and the contact's arm from the
    centre of mass."""
    position, velocity, acceleration = pose_of(time, host)
    cosine, sine = np.cos(state[ANGLE]), np.sin(state[ANGLE])
    rim_x, rim_y = rim_middle(state[ANGLE], state[SPIN], p)
    arm_x = p.disk_radius_m * nx - (cosine * p.mass_x_m - sine * p.mass_y_m) + rim_x
    arm_y = p.disk_radius_m * ny - (sine * p.mass_x_m + cosine * p.mass_y_m) + rim_y
    # At a chip's flank, a chamfer's end or a tape's the contact lies beside the normal through the disk's middle; a
    # cylinder meets the disk below its tape.
    outer = (state[X] - position[0]) * nx + (state[Y] - position[1]) * ny > 0.0
    worn = p.lap_m != 0.0 or p.peeling_m != 0.0 or p.chamfer_m != 0.0 or p.flattened_m != 0.0
    if p.chip_m != 0.0 or (worn and outer):
        from_x = state[X] + arm_x - p.disk_radius_m * nx - position[0]
        from_y = state[Y] + arm_y - p.disk_radius_m * ny - position[1]
        beside = -rim_reach(np.arctan2(from_y, from_x), state[ANGLE], p)[1]
        if p.peeling_m != 0.0:
            beside -= peeled(np.arctan2(from_y, from_x), state, p)[1]
        if p.flattened_m != 0.0:
            beside -= flattened(np.arctan2(from_y, from_x), state, p)[1]
        arm_x, arm_y = arm_x - beside * ny, arm_y + beside * nx
    from_x, from_y = state[X] + arm_x - position[0], state[Y] + arm_y - position[1]
    ux = state[VX] - state[SPIN] * arm_y - velocity[0] + velocity[2] * from_y
    uy = state[VY] + state[SPIN] * arm_x - velocity[1] - velocity[2] * from_x
    if p.squash_m != 0.0 and from_x * nx + from_y * ny > 0.0:  # the ring's own speed, not a cylinder's
        moves = squashed(np.arctan2(from_y, from_x), jerk_of(time, host), p)[0]
        ux, uy = ux - moves * nx, uy - moves * ny
    if p.relaxing_m != 0.0 and from_x * nx + from_y * ny > 0.0:
        moves = relaxed(np.arctan2(from_y, from_x), 2.0 / p.duration_s, p)[0]
        ux, uy = ux - moves * nx, uy - moves * ny
    if p.quiver_m != 0.0 and from_x * nx + from_y * ny > 0.0:
        moves = quiver_speed(time, np.arctan2(from_y, from_x), state, p)
        ux, uy = ux - moves * nx, uy - moves * ny
    if p.heating_m != 0.0 and from_x * nx + from_y * ny > 0.0:
        moves = heating_speed(time, p)
        ux, uy = ux - moves * nx, uy - moves * ny
    moves_x, moves_y = wall_velocity(time, state, velocity, acceleration, p, host)
    ux, uy = ux - moves_x, uy - moves_y
    return ux * nx + uy * ny + widening(time, state, p), -ux * ny + uy * nx, arm_x, arm_y


@making_arrays
def impact(
    time: float, state: Floats, p: PlantParameters, host: Floats, scatter: Floats, bounce: float
) -> tuple[Floats, float, float]:
    """`strike`'s state in a new array and what it gives, for Python."""
    new = state.copy()
    speed, slip = strike(time, state, p, host, scatter, bounce, new)
    return new, speed, slip


@compiled
def strike(
    time: float, state: Floats, p: PlantParameters, host: Floats, scatter: Floats, bounce: float, new: Floats
) -> tuple[float, float]:
    """State after the impulse into `new`; approach speed, slip before. `bounce` 0 holds the disk: no rebound, stick at
    best; `scatter` (2,): this impact's own chances, of its restitution and of the wall's normal.

    Both impulses come from the target velocities through the contact's compliance matrix; beyond the
    Coulomb limit the tangential one is cut and the normal one solved again. The disk is put back onto the
    wall.
    """
    gap, nx, ny = wall_gap(time, state, p, host)
    nx, ny = leaning(nx, ny, scatter[1], bounce, p)
    meeting = contact_velocity(time, state, p, host, nx, ny)
    if p.piled_rad != 0.0 and bounce > 0.0:
        nx, ny = piled(nx, ny, meeting[1], p)
        meeting = contact_velocity(time, state, p, host, nx, ny)
    copy_into(new, state)
    _put_back(new, gap, nx, ny)
    if meeting[0] <= 0.0:
        if bounce > 0.0:
            remember_swing(new, state, time, p)
        return 0.0, meeting[1]
    blow = blow_of(time, state, p, host, scatter, bounce, (nx, ny), meeting)
    push_n, push_t = impulses(blow, state, bounce, p)
    remember(new, state, blow, push_n, push_t, bounce, p)
    new[VX] += push_n * nx - push_t * ny
    new[VY] += push_n * ny + push_t * nx
    new[SPIN] = spin_after(state[SPIN], blow, push_n, push_t, bounce, p)
    press_down(new, blow, push_n * bounce, p)
    if (p.tipped_m != 0.0 or p.quiver_m != 0.0) and bounce > 0.0:
        new[IMPACT_S] = time
    if p.peeling_m != 0.0 and bounce > 0.0:
        new[COUNT] += 1.0
    if (p.planing_m != 0.0 or p.primed != 0.0) and bounce > 0.0:
        new[LEFT] = np.sqrt((new[VX] - blow.host_velocity[0]) ** 2 + (new[VY] - blow.host_velocity[1]) ** 2)
    # Where it may be at its new spin and speed, as it now lies, with tape and ring as this blow has left them.
    by_motion = p.swollen_m != 0.0 or p.thrown_m != 0.0 or p.coved_m != 0.0
    if by_motion or p.tipped_m != 0.0 or p.peeling_m != 0.0 or p.planing_m != 0.0 or p.quiver_m != 0.0:
        gap, nx, ny = wall_gap(time, new, p, host)
        _put_back(new, gap, nx, ny)
    return blow.approach, blow.slip_host


@compiled
def _put_back(state: Floats, gap: float, nx: float, ny: float) -> None:
    """Put a disk that is past the wall back onto it."""
    if gap < 0.0:
        state[X] += gap * nx
        state[Y] += gap * ny
