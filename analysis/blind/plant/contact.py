"""What the plant's wall does: an impulse through a compliance matrix, or a spring-dashpot of finite
duration."""

import numpy as np

from analysis.blind.plant.accelerations import derivative, host_pose
from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.newest import SPRINGY_AT_M_PER_S2, chip_reach, newest_grip, newest_losses, newest_reach
from analysis.blind.plant.plausible import plausible_reach, plausible_rebound, plausible_slide
from analysis.blind.plant.state import PlantParameters
from analysis.blind.plant.undreamt import (
    band_slips,
    mount_gives,
    press_down,
    sleeve_speed,
    tiredness,
    tyre_at,
)
from analysis.blind.plant.unexpected import orbit, orbiting, swinging_speed, unexpected_rebound, unexpected_slide
from analysis.blind.plant.unforeseen import edge_gain, joint_reach, rolled, taped_grip
from analysis.blind.plant.unimagined import slipped, slipping, squashed, unimagined_grip, unimagined_rebound
from analysis.blind.plant.unsuspected import flattened, split_reach, trailing, unsuspected_rebound, unsuspected_slide
from analysis.blind.plant.untold import corner_lever, leaked, swollen, untold_rebound, untold_slide

JERK_S = 1e-5  # a difference over a thousandth of the drive's period
STEP_EDGE = 0.1  # rad within which one half of a stepped wall goes over into the other


@compiled
def _reach(time: float, azimuth: float, disk_angle: float, p: PlantParameters) -> tuple[float, float]:
    """How far the disk's middle gets along `azimuth`, and its slope (m per rad)."""
    ellipse = 2.0 * (azimuth - p.ellipticity_phase_rad)
    lobe = p.lobe_order * (azimuth - p.lobe_phase_rad)
    oval = 2.0 * (azimuth - disk_angle - p.oval_rad)
    reach = 1.0 + p.ellipticity * np.cos(ellipse) + p.lobes * np.cos(lobe) - p.oval * np.cos(oval)
    rise = -2.0 * p.ellipticity * np.sin(ellipse) - p.lobe_order * p.lobes * np.sin(lobe) + 2.0 * p.oval * np.sin(oval)
    away = np.arctan2(np.sin(azimuth - p.dent_rad), np.cos(azimuth - p.dent_rad)) / p.dent_width_rad
    dent = p.dent_m * np.exp(-0.5 * away**2)
    lobe = 3.0 * (azimuth - disk_angle - p.trilobe_rad)
    reach, rise = reach - p.trilobe * np.cos(lobe), rise + 3.0 * p.trilobe * np.sin(lobe)
    edge = np.tanh(np.sin(azimuth - p.step_rad) / STEP_EDGE)
    back = 0.5 * p.step_m * edge + p.breathing_m * (2.0 * time / p.duration_s - 1.0)
    slope = 0.5 * p.step_m * (1.0 - edge**2) * np.cos(azimuth - p.step_rad) / STEP_EDGE
    more, steeper = newest_reach(time, azimuth, disk_angle, p)
    joint, along = joint_reach(azimuth, p)
    split, askew = split_reach(azimuth, p)
    back, slope = back + more + joint + split + p.packed_m, slope + steeper + along + askew
    more, steeper = plausible_reach(azimuth, p)
    back, slope = back + more, slope + steeper
    return p.contact_radius_m * reach - dent + back, p.contact_radius_m * rise + dent * away / p.dent_width_rad + slope


@compiled
def _flat_gap(x: float, y: float, host_angle: float, p: PlantParameters) -> tuple[float, float, float]:
    """Distance from the nearest side of the polygon and that side's outward normal."""
    gap, nx, ny = 1e300, 1.0, 0.0
    for side in range(int(p.wall_sides)):
        angle = host_angle + p.wall_turn_rad + 2.0 * np.pi * side / p.wall_sides
        ax, ay = np.cos(angle), np.sin(angle)
        if p.contact_radius_m - ax * x - ay * y < gap:
            gap, nx, ny = p.contact_radius_m - ax * x - ay * y, ax, ay
    return gap, nx, ny


@compiled
def wall_gap(time: float, state: Floats, p: PlantParameters, host: Floats) -> tuple[float, float, float]:
    """Distance of the disk's middle from the curve it may reach, and the wall's outward normal (x, y)."""
    position, velocity, acceleration = host_pose(time, host)
    cosine, sine = np.cos(state[4]), np.sin(state[4])
    turn_c, turn_s = np.cos(position[2]), np.sin(position[2])
    x = state[0] - (cosine * p.mass_x_m - sine * p.mass_y_m) - position[0] - (turn_c * p.wall_x_m - turn_s * p.wall_y_m)
    y = state[1] - (sine * p.mass_x_m + cosine * p.mass_y_m) - position[1] - (turn_s * p.wall_x_m + turn_c * p.wall_y_m)
    x, y = x - p.refit_x_m, y - p.refit_y_m
    if p.tyre_m != 0.0:
        rim_x, rim_y = tyre_at(state[4], p)
        x, y = x + rim_x, y + rim_y
    if p.springy_m != 0.0:
        x += p.springy_m * acceleration[0] / SPRINGY_AT_M_PER_S2
        y += p.springy_m * acceleration[1] / SPRINGY_AT_M_PER_S2
    if p.loose_ring_m != 0.0 and state[13] > 0.5:  # there was an impact before
        x, y = x - p.loose_ring_m * np.cos(state[14]), y - p.loose_ring_m * np.sin(state[14])
    if p.slipping_m != 0.0:
        off_x, off_y = slipped(time, p)
        x, y = x - off_x, y - off_y
    if p.trailing_m != 0.0:
        off_x, off_y = trailing(velocity, p)
        x, y = x - off_x, y - off_y
    if p.orbit_m != 0.0:
        off_x, off_y = orbit(time, p)
        x, y = x - off_x, y - off_y
    radius = np.sqrt(x * x + y * y) + 1e-300
    if p.wall_sides > 0.0:
        gap, nx, ny = _flat_gap(x, y, position[2], p)
    else:
        reach, rise = _reach(time, np.arctan2(y, x), state[4], p)
        if p.squash_m != 0.0:
            more, steeper = squashed(np.arctan2(y, x), acceleration, p)
            reach, rise = reach + more, rise + steeper
        nx, ny = x / radius + rise / radius * y / radius, y / radius - rise / radius * x / radius
        size = np.sqrt(nx * nx + ny * ny)
        gap, nx, ny = (reach - radius) / size, nx / size, ny / size
    if p.leaking_m != 0.0:
        gap += leaked(tiredness(time, state), p)
    wider = swollen(state[5], p)
    gap -= wider
    if p.obstacle_m > 0.0 and radius - p.obstacle_m - wider < gap:
        return radius - p.obstacle_m - wider, -x / radius, -y / radius
    return gap, nx, ny


@compiled
def _jerk(time: float, host: Floats) -> Floats:
    """Rate of the Host's acceleration (x, y, rotation, z)."""
    return (host_pose(time + JERK_S, host)[2] - host_pose(time - JERK_S, host)[2]) / (2.0 * JERK_S)


@compiled
def _contact_velocity(
    time: float, state: Floats, p: PlantParameters, host: Floats, nx: float, ny: float
) -> tuple[float, float, float, float]:
    """Approach speed along the normal, slip along the tangent (-ny, nx), and the contact's arm from the
    centre of mass."""
    position, velocity, acceleration = host_pose(time, host)
    cosine, sine = np.cos(state[4]), np.sin(state[4])
    arm_x = p.disk_radius_m * nx - (cosine * p.mass_x_m - sine * p.mass_y_m)
    arm_y = p.disk_radius_m * ny - (sine * p.mass_x_m + cosine * p.mass_y_m)
    if p.tyre_m != 0.0:
        rim_x, rim_y = tyre_at(state[4], p)
        arm_x, arm_y = arm_x + rim_x, arm_y + rim_y
    if p.chip_m != 0.0:  # at a chip's flank the contact lies beside the normal through the disk's middle
        from_x = state[0] + arm_x - p.disk_radius_m * nx - position[0]
        from_y = state[1] + arm_y - p.disk_radius_m * ny - position[1]
        beside = -chip_reach(np.arctan2(from_y, from_x), state[4], p)[1]
        arm_x, arm_y = arm_x - beside * ny, arm_y + beside * nx
    from_host_x, from_host_y = state[0] + arm_x - position[0], state[1] + arm_y - position[1]
    ux = state[2] - state[5] * arm_y - velocity[0] + velocity[2] * from_host_y
    uy = state[3] + state[5] * arm_x - velocity[1] - velocity[2] * from_host_x
    if p.springy_m != 0.0:  # the liner's own speed, against the Host's jerk
        jerk = _jerk(time, host)
        ux += p.springy_m * jerk[0] / SPRINGY_AT_M_PER_S2
        uy += p.springy_m * jerk[1] / SPRINGY_AT_M_PER_S2
    if p.squash_m != 0.0 and from_host_x * nx + from_host_y * ny > 0.0:  # the ring's own speed, not a cylinder's
        moves = squashed(np.arctan2(from_host_y, from_host_x), _jerk(time, host), p)[0]
        ux, uy = ux - moves * nx, uy - moves * ny
    if p.slipping_m != 0.0:
        moves_x, moves_y = slipping(p)
        ux, uy = ux - moves_x, uy - moves_y
    if p.trailing_m != 0.0:
        moves_x, moves_y = trailing(acceleration, p)
        ux, uy = ux - moves_x, uy - moves_y
    if p.orbit_m != 0.0:
        moves_x, moves_y = orbiting(time, p)
        ux, uy = ux - moves_x, uy - moves_y
    return ux * nx + uy * ny, -ux * ny + uy * nx, arm_x, arm_y


@compiled
def restitution_at(
    time: float,
    azimuth: float,
    approach: float,
    slip: float,
    spin: float,
    since_s: float,
    p: PlantParameters,
    scatter: float,
) -> float:
    """The normal restitution of this impact with every cause that acts on it."""
    value = p.restitution
    if p.restitution_speed_m_per_s > 0.0:
        value = p.restitution_floor + (value - p.restitution_floor) * np.exp(-approach / p.restitution_speed_m_per_s)
    value += p.direction_amplitude * np.cos(azimuth - p.direction_phase_rad)
    away = np.arctan2(np.sin(azimuth - p.soft_azimuth_rad), np.cos(azimuth - p.soft_azimuth_rad))
    value -= p.soft_amplitude * np.exp(-0.5 * (away / p.soft_width_rad) ** 2)
    value += p.phase_amplitude * np.sin(p.drive_rad_per_s * time + p.phase_rad)
    value -= p.spin_restitution_s * abs(spin)
    value -= p.slip_restitution_s_per_m * abs(slip)
    if p.rest_amplitude != 0.0:
        value -= p.rest_amplitude * np.exp(-since_s / p.rest_s)
    value -= p.glancing * slip**2 / (slip**2 + approach**2 + 1e-300)
    value *= 1.0 - p.ageing_per_s * time
    return min(max(value + p.restitution_scatter * scatter, 0.05), 0.98)


@compiled
def _wall_friction(time: float, azimuth: float, slip: float, p: PlantParameters) -> float:
    """The wall's coefficient of friction at this time and place, but for what the blow itself does to it."""
    mu = p.wall_friction * (
        1.0 + p.wall_friction_amplitude * np.cos(p.wall_friction_lobes * (azimuth - p.wall_friction_phase_rad))
    )
    mu *= 1.0 + p.handed * (1.0 if slip > 0.0 else -1.0)
    away = np.arctan2(np.sin(azimuth - p.tacky_rad), np.cos(azimuth - p.tacky_rad))
    mu *= 1.0 - p.polish * (1.0 - np.exp(-max(time, 0.0) / p.polish_s))
    return mu * (1.0 + p.tacky * np.exp(-0.5 * (away / 0.35) ** 2))


@compiled
def _impulses(
    change_n: float, change_t: float, slip: float, mu: float, glue: float, w_nn: float, w_tt: float, w_nt: float
) -> tuple[float, float]:
    """Normal and tangential impulse per unit mass of a contact of compliances w that change its velocity as asked for;
    the tangential one is cut at mu times the normal one and `glue`."""
    determinant = w_nn * w_tt - w_nt**2
    push_n = (w_tt * change_n - w_nt * change_t) / determinant
    push_t = (w_nn * change_t - w_nt * change_n) / determinant
    if abs(push_t) > mu * abs(push_n) + glue:
        sign = -1.0 if slip > 0.0 else 1.0
        push_n = (change_n - sign * glue * w_nt) / (w_nn - sign * mu * w_nt)  # push_n < 0: |push_n| = -push_n
        push_t = sign * (mu * abs(push_n) + glue)
    return push_n, push_t


@compiled
def impact(
    time: float, state: Floats, p: PlantParameters, host: Floats, scatter: Floats, bounce: float
) -> tuple[Floats, float, float]:
    """State after the impulse, approach speed, slip before. `bounce` 0 holds the disk: no rebound, stick at
    best; `scatter` (2,): this impact's own chances, of its restitution and of the wall's normal.

    Both impulses come from the target velocities through the contact's compliance matrix; beyond the
    Coulomb limit the tangential one is cut and the normal one solved again. The disk is put back onto the
    wall.
    """
    gap, nx, ny = wall_gap(time, state, p, host)
    leans = (p.rough_rad + p.ragged_rad) * scatter[1] + p.saw_rad * bounce  # what is held lies against the teeth's tips
    if leans != 0.0:
        c, s = np.cos(leans), np.sin(leans)
        nx, ny = c * nx - s * ny, s * nx + c * ny
    tx, ty = -ny, nx
    approach, slip, arm_x, arm_y = _contact_velocity(time, state, p, host, nx, ny)
    new = state.copy()
    if gap < 0.0:
        new[0] += gap * nx
        new[1] += gap * ny
    if approach <= 0.0:
        return new, 0.0, slip
    position, velocity, acceleration = host_pose(time, host)
    if p.cornered_m != 0.0:
        beside = corner_lever(approach, np.arctan2(ny, nx) - state[4], p) * bounce
        arm_x, arm_y = arm_x + beside * tx, arm_y + beside * ty
        approach -= beside * (state[5] - velocity[2])
    from_x, from_y = state[0] + arm_x - position[0], state[1] + arm_y - position[1]
    azimuth = np.arctan2(from_y, from_x)  # of the contact, seen from the Host's centre
    outer = from_x * nx + from_y * ny > 0.0  # the wall, not a cylinder
    carried, tired, over_wall = sleeve_speed(time, state, p), tiredness(time, state), slip
    if outer:
        slip -= (carried + swinging_speed(velocity, p)) * bounce
    rebound = restitution_at(time, azimuth, approach, slip, state[5], time - state[6], p, scatter[0])
    rim = azimuth - state[4] - p.nick_rad
    rebound -= p.nick * np.exp(-0.5 * (np.arctan2(np.sin(rim), np.cos(rim)) / 0.5) ** 2)
    rebound += edge_gain(state[13], p)
    rebound = unsuspected_rebound(rebound, time, azimuth, state[4], p)
    rebound = unexpected_rebound(rebound, slip, np.arctan2(ny, nx), state, p)
    rebound = untold_rebound(rebound, azimuth - state[4], acceleration, state, p)
    rebound = plausible_rebound(rebound, approach, slip, np.arctan2(ny, nx), p)
    rebound += p.clamps * np.cos(3.0 * (azimuth - p.clamps_rad))
    rebound += p.yielding_s_per_m * (velocity[0] * nx + velocity[1] * ny)
    rebound -= newest_losses(azimuth, state, scatter[1], p)
    rebound = unimagined_rebound(rebound, time, state, (nx, ny), acceleration, p) - p.tired * tired
    if p.adhesion_m_per_s != 0.0:
        rebound = np.sqrt(max(rebound**2 - (p.adhesion_m_per_s / approach) ** 2, 0.0))
    rebound = max(rebound - (p.damage if state[9] > p.damage_m_per_s else 0.0), 0.05) * bounce
    new[9], new[12], new[14] = max(state[9], approach), azimuth, np.arctan2(ny, nx)
    grip, slide = newest_grip(approach, slip, p)
    elastic, pressed = unimagined_grip(approach, slip, p)
    mu = _wall_friction(time, azimuth, slip, p) * (slide * pressed) * unsuspected_slide(time, approach, slip, state, p)
    mu *= unexpected_slide(azimuth - state[4], slip, state, p) * untold_slide(slip, np.arctan2(ny, nx), p)
    mu *= plausible_slide(slip, p)
    back = p.tangential_restitution * grip * elastic * taped_grip(azimuth - state[4], p) * bounce
    inertia = p.inertia_factor * p.disk_radius_m**2  # everything per unit mass
    lever_n, lever_t = arm_x * ny - arm_y * nx, arm_x * ty - arm_y * tx
    w_nn, w_tt, w_nt = 1.0 + lever_n**2 / inertia, 1.0 + lever_t**2 / inertia, lever_n * lever_t / inertia
    change_n, change_t = -(1.0 + rebound) * approach, -(1.0 + back) * (slip - p.teeth_m_per_s * bounce)
    if p.mount != 0.0:
        more_n, more_t, more_nt = mount_gives(nx, ny, p)
        w_nn, w_tt, w_nt = w_nn + more_n * bounce, w_tt + more_t * bounce, w_nt + more_nt * bounce
    turns = p.sleeve * bounce if outer else 0.0
    push_n, push_t = _impulses(change_n, change_t, slip, mu, p.cohesion_m_per_s * bounce, w_nn, w_tt + turns, w_nt)
    if bounce > 0.0:
        push_n, push_t = band_slips(push_n, push_t, change_n, w_nn, w_nt, p)
        new[15], new[16], new[17] = approach, tired + approach**2, carried - turns * push_t
        new[23], new[24] = over_wall, azimuth - state[4]
    new[2] += push_n * nx + push_t * tx
    new[3] += push_n * ny + push_t * ty
    new[5] += (push_n * lever_n + push_t * lever_t) / inertia
    new[5] += p.offset_blow_m * push_n / inertia * bounce
    new[5] = flattened(new[5], approach * bounce, p) * (1.0 - p.rolling_loss * bounce)
    if p.rolling_arm_m != 0.0:
        new[5] = rolled(new[5], push_n * bounce, velocity[2], p)
    if p.leaning != 0.0:
        press_down(new, push_n * bounce, (arm_x, arm_y), velocity, p)
    if p.swollen_m != 0.0:  # where it may be at its new spin
        gap, nx, ny = wall_gap(time, new, p, host)
        if gap < 0.0:
            new[0] += gap * nx
            new[1] += gap * ny
    return new, approach, over_wall


@compiled
def spring_dashpot(p: PlantParameters) -> tuple[float, float, float]:
    """Stiffness and damping of the normal, stiffness of the tangential spring, per unit mass.

    The contact's duration is the damped half period, the restitution its loss in one; the wall never pulls.
    The tangential spring is a share of the normal one (Mindlin, J. Appl. Mech. 16, 259 (1949): 0.82 for
    steel on steel).
    """
    loss = -np.log(p.restitution) / np.pi
    ratio = loss / np.sqrt(1.0 + loss * loss)
    natural = np.pi / p.contact_time_s / np.sqrt(1.0 - ratio * ratio)
    return natural**2, 2.0 * ratio * natural, p.contact_shear_share * natural**2


@compiled
def compliant_step(
    time: float,
    state: Floats,
    step: float,
    p: PlantParameters,
    host: Floats,
    table: Floats,
    spring: tuple[float, float, float],
) -> Floats:
    """Advance by `step` in contact through a Kelvin-Voigt normal and a tangential spring with a Coulomb
    limit.

    State 7 is the stretch of the tangential spring. Midpoint steps of a four-hundredth of the contact's
    duration.
    """
    count = int(np.ceil(step / p.contact_time_s * 400.0))
    h = step / count
    for _ in range(count):
        first = _pushed(time, state, p, host, table, spring)[0]
        middle, force = _pushed(time + 0.5 * h, state + 0.5 * h * first, p, host, table, spring)
        state = state + h * middle
        limit = p.wall_friction * force / spring[2]
        state[7] = min(max(state[7], -limit), limit)
        time += h
    return state


@compiled
def _pushed(
    time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats, spring: tuple[float, float, float]
) -> tuple[Floats, float]:
    """Rate of the state and the wall's normal force per unit mass (never pulling)."""
    stiffness, damping, tangential = spring
    out = derivative(time, state, p, host, table)
    gap, nx, ny = wall_gap(time, state, p, host)
    if gap >= 0.0:
        return out, 0.0
    approach, slip, arm_x, arm_y = _contact_velocity(time, state, p, host, nx, ny)
    force = max(-stiffness * gap + damping * approach, 0.0)
    limit = p.wall_friction * force
    shear = min(max(-tangential * state[7], -limit), limit)
    fx, fy = -force * nx - shear * ny, -force * ny + shear * nx
    out[2] += fx
    out[3] += fy
    out[5] += (arm_x * fy - arm_y * fx) / (p.inertia_factor * p.disk_radius_m**2)
    out[7] = slip
    return out, force
