"""Forces on the plant's disk between contacts."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.newest import add_newest_forces, newest_traction
from analysis.blind.plant.plausible import add_dish, plausible_friction, ring_torque
from analysis.blind.plant.state import STATES, PlantParameters
from analysis.blind.plant.undreamt import add_undreamt_forces, rim_traction, undreamt_friction, undreamt_load
from analysis.blind.plant.unexpected import add_unexpected_forces, unexpected_friction
from analysis.blind.plant.unforeseen import add_coil, add_unforeseen_forces, friction_of_flight, grain_traction
from analysis.blind.plant.unimagined import add_unimagined_forces, unimagined_friction
from analysis.blind.plant.unsuspected import add_unsuspected_forces, concentric_traction, unsuspected_friction
from analysis.blind.plant.untold import add_untold_forces, untold_friction


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
def floor_traction(
    slip_x: float, slip_y: float, spin: float, p: PlantParameters, table: Floats
) -> tuple[float, float, float]:
    """Friction per unit of mu N: force (x, y) and torque / R, smoothed by one tanh of the overall rim
    speed."""
    speed = np.sqrt(slip_x**2 + slip_y**2)
    stands = 1.0 - p.dome  # share of its radius within which the disk touches the floor
    rim = p.disk_radius_m * stands * abs(spin)
    place = np.arctan2(rim, speed) / (0.5 * np.pi) * (table.shape[0] - 1)
    low = min(int(place), table.shape[0] - 2)
    share = place - low
    force = table[low, 0] * (1.0 - share) + table[low + 1, 0] * share
    torque = table[low, 1] * (1.0 - share) + table[low + 1, 1] * share
    both = np.tanh(np.sqrt(speed**2 + rim**2) / p.smoothing_m_per_s)
    plain = np.tanh(speed / p.smoothing_m_per_s)
    size = p.spin_share * force * both + (1.0 - p.spin_share) * plain
    sign = 1.0 if spin > 0.0 else (-1.0 if spin < 0.0 else 0.0)
    turn = p.spin_share * torque * both * sign * stands
    if speed < 1e-12:
        return 0.0, 0.0, turn
    return size * slip_x / speed, size * slip_y / speed, turn


@compiled
def _add_later_forces(time: float, x: float, y: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """Forces of `causes.later`."""
    if p.stream_per_s != 0.0:
        a, b = np.cos(p.stream_rad), np.sin(p.stream_rad)
        across = (b * x - a * y) / p.stream_width_m
        carried = p.stream_per_s * np.exp(-0.5 * across**2)
        out[2] += carried * (p.stream_m_per_s * a - state[2])
        out[3] += carried * (p.stream_m_per_s * b - state[3])
    if p.saddle_per_s2 != 0.0:
        a, b = np.cos(2.0 * p.saddle_rad), np.sin(2.0 * p.saddle_rad)
        out[2] += p.saddle_per_s2 * (a * x + b * y)
        out[3] += p.saddle_per_s2 * (b * x - a * y)
    if p.sag_m_per_s2 != 0.0:
        push = p.sag_m_per_s2 * (2.0 * time / p.duration_s - 1.0)
        out[2] += push * np.cos(p.sag_rad)
        out[3] += push * np.sin(p.sag_rad)


@compiled
def _add_latest_forces(time: float, x: float, y: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """Forces and torques of `causes.latest`."""
    if p.tether_per_s2 != 0.0:
        away_x, away_y = p.tether_x_m - x, p.tether_y_m - y
        length = np.sqrt(away_x**2 + away_y**2) + 1e-12
        taut = p.tether_per_s2 * max(length - p.tether_slack_m, 0.0) / length
        out[2] += taut * away_x
        out[3] += taut * away_y
    if p.bowl_m_per_s2 != 0.0:
        share = (x * x + y * y) / p.contact_radius_m**2
        out[2] -= p.bowl_m_per_s2 * share**2.5 * x / p.contact_radius_m
        out[3] -= p.bowl_m_per_s2 * share**2.5 * y / p.contact_radius_m
    if p.cubic_s_per_m2 != 0.0:
        slowed = p.cubic_s_per_m2 * (state[2] ** 2 + state[3] ** 2)
        out[2] -= slowed * state[2]
        out[3] -= slowed * state[3]
    late = time - p.slam_s
    if p.slam_m_per_s2 != 0.0 and late > 0.0:
        push = p.slam_m_per_s2 * np.exp(-late / p.slam_decay_s) * np.sin(p.slam_rad_per_s * late)
        out[2] += push * np.cos(p.slam_rad)
        out[3] += push * np.sin(p.slam_rad)
    out[5] -= p.windmill_per_s * (state[5] - p.windmill_rad_per_s)
    out[5] -= p.bistable_rad_per_s2 * np.sin(2.0 * (state[4] - p.bistable_rad))


@compiled
def _friction_share(x: float, y: float, state: Floats, p: PlantParameters) -> float:
    """What `causes.later` and `causes.latest` multiply the floor's friction by; x, y from the Host's centre."""
    share = 1.0
    if p.seam != 0.0 and np.cos(p.seam_rad) * x + np.sin(p.seam_rad) * y > p.seam_m:
        share *= 1.0 + p.seam
    if p.lift != 0.0:
        share *= 1.0 - p.lift * min((state[2] ** 2 + state[3] ** 2) / p.lift_m_per_s**2, 1.0)
    if p.groove != 0.0:
        along = np.cos(p.groove_rad) * x + np.sin(p.groove_rad) * y
        share *= 1.0 + p.groove * np.cos(2.0 * np.pi * along / p.groove_m + p.groove_phase_rad)
    if p.warming != 0.0:
        share *= 1.0 - p.warming * (1.0 - np.exp(-state[8] / p.warming_m))
    if p.film != 0.0:
        share *= 1.0 - p.film * (1.0 - np.exp(-abs(state[5]) / p.film_rad_per_s))
    if p.rim != 0.0:
        late = (np.sqrt(x * x + y * y) / p.contact_radius_m - p.rim_share) / 0.03
        share *= 1.0 + p.rim * 0.5 * (1.0 + np.tanh(late))
    return share


@compiled
def _add_strange_forces(time: float, x: float, y: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """Forces that nobody would put into a model: x, y from the Host's centre."""
    radius = np.sqrt(x * x + y * y) + 1e-12
    if p.wall_pull_m_per_s2 != 0.0:
        pull = p.wall_pull_m_per_s2 * np.exp((radius - p.contact_radius_m) / p.wall_pull_m)
        out[2] += pull * x / radius
        out[3] += pull * y / radius
    out[2] -= p.swirl_per_s2 * y
    out[3] += p.swirl_per_s2 * x
    if p.rail_per_s != 0.0:
        a, b = np.cos(p.rail_rad), np.sin(p.rail_rad)
        along = p.rail_per_s * (a * state[2] + b * state[3])
        out[2] -= along * a
        out[3] -= along * b
    if p.sway_m_per_s2 != 0.0:
        push = p.sway_m_per_s2 * np.sin(p.sway_rad_per_s * time)
        out[2] += push * np.cos(p.sway_rad)
        out[3] += push * np.sin(p.sway_rad)
    _add_later_forces(time, x, y, state, p, out)
    if p.ridge_m_per_s2 != 0.0:
        a, b = np.cos(p.ridge_rad), np.sin(p.ridge_rad)
        across = (a * x + b * y - p.ridge_m) / 0.004
        push = p.ridge_m_per_s2 * across * np.exp(0.5 - 0.5 * across**2)
        out[2] += push * a
        out[3] += push * b


@compiled
def derivative(time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats) -> Floats:
    """Rate of (x, y, vx, vy, angle, spin, time of last impact, stretch at the wall, way slid, hardest
    impact so far, lagging friction (x, y), azimuth of last impact, number of impacts, direction of the last one's
    normal, its approach speed, a liner's tiredness and a sleeve's speed after it, a mat's print (x, y in the Host), way
    slid before the last impact, a loose core's spin, oil on the disk, the last impact's slip and where on the rim it
    was); x, y: centre of mass."""
    position, velocity, acceleration = host_pose(time, host)
    cosine, sine = np.cos(state[4]), np.sin(state[4])
    arm_x = -(cosine * p.mass_x_m - sine * p.mass_y_m)  # from the centre of mass to the disk's middle
    arm_y = -(sine * p.mass_x_m + cosine * p.mass_y_m)
    spin = state[5]
    x = state[0] + arm_x - position[0]
    y = state[1] + arm_y - position[1]
    slip_x = state[2] - spin * arm_y - (velocity[0] - velocity[2] * y)
    slip_y = state[3] + spin * arm_x - (velocity[1] + velocity[2] * x)
    from_host = (slip_x, slip_y)
    slip_x, slip_y = slip_x + p.loose_floor * velocity[0], slip_y + p.loose_floor * velocity[1]
    slip_x, slip_y = slip_x + p.floor_turn_rad_per_s * y, slip_y - p.floor_turn_rad_per_s * x
    turning = spin - velocity[2] - p.floor_turn_rad_per_s  # over the floor
    traction = rim_traction(floor_traction(slip_x, slip_y, turning, p, table), slip_x, slip_y, turning, p)
    force_x, force_y, turn = grain_traction(traction, slip_x, slip_y, turning, state[4], p)
    if p.anisotropy != 0.0:
        a, b = np.cos(p.anisotropy_phase_rad), np.sin(p.anisotropy_phase_rad)
        along, across = force_x * a + force_y * b, -force_x * b + force_y * a
        along, across = along * (1.0 + p.anisotropy), across * (1.0 - p.anisotropy)
        force_x, force_y = along * a - across * b, along * b + across * a
    force_x, force_y = newest_traction(force_x, force_y, slip_x, slip_y, turning, state[4], p)
    force_x, force_y = concentric_traction(force_x, force_y, x, y, p)
    load = undreamt_load(time, state, position, velocity, acceleration, p)
    if p.hop_s > 0.0 and 0.0 <= time - state[6] < p.hop_s:
        load = 0.0
    mu = p.floor_friction * (1.0 + p.friction_change_per_s * (time - 0.5 * p.duration_s))
    mu *= 1.0 + p.weakening * np.exp(-np.sqrt(slip_x**2 + slip_y**2) / p.weakening_m_per_s)
    if p.settling != 0.0 and time > state[6] >= 0.0:
        mu *= 1.0 - p.settling * np.exp(-(time - state[6]) / p.settling_s)
    if p.patch_amplitude != 0.0:
        far = ((x - p.patch_x_m) ** 2 + (y - p.patch_y_m) ** 2) / p.patch_width_m**2
        mu *= 1.0 + p.patch_amplitude * np.exp(-0.5 * far)
    mu *= _friction_share(x, y, state, p) * friction_of_flight(state[13], p) * unsuspected_friction(x, y, p)
    mu *= unimagined_friction((x, y), (slip_x, slip_y), turning, acceleration, p) * undreamt_friction(state[4], p)
    mu *= unexpected_friction((slip_x, slip_y), turning, state, velocity, p)
    mu *= untold_friction(time, (x, y), (slip_x, slip_y), turning, acceleration, p)
    mu *= plausible_friction(time, (x, y), (slip_x, slip_y), state[6], p)
    force_x, force_y, turn = -mu * load * force_x, -mu * load * force_y, -mu * load * turn * ring_torque(p)
    speed = np.sqrt(state[2] ** 2 + state[3] ** 2)
    drag = p.viscous_per_s + p.air_per_m * speed
    out = np.zeros(STATES)
    if p.lag_s > 0.0:
        out[10], out[11] = (force_x - state[10]) / p.lag_s, (force_y - state[11]) / p.lag_s
        force_x, force_y = state[10], state[11]
    out[8] = np.sqrt(slip_x**2 + slip_y**2)
    out[0], out[1], out[4] = state[2], state[3], spin
    out[2] = force_x - drag * state[2] + p.tilt_x_m_per_s2 - p.central_per_s2 * x - p.magnus * spin * state[3]
    out[3] = force_y - drag * state[3] + p.tilt_y_m_per_s2 - p.central_per_s2 * y + p.magnus * spin * state[2]
    if p.pull_m_per_s2 != 0.0:
        away_x, away_y = p.pull_x_m - state[0], p.pull_y_m - state[1]
        near = p.pull_m_per_s2 / p.pull_width_m * np.exp(0.5 - 0.5 * (away_x**2 + away_y**2) / p.pull_width_m**2)
        out[2] += near * away_x
        out[3] += near * away_y
    _add_strange_forces(time, x, y, state, p, out)
    torque = arm_x * force_y - arm_y * force_x + p.disk_radius_m * turn
    out[5] = torque / (p.inertia_factor * p.disk_radius_m**2) - p.spin_drag_per_s * spin
    out[5] -= p.needle_rad_per_s2 * np.sin(state[4] - p.needle_rad)
    _add_latest_forces(time, x, y, state, p, out)
    add_newest_forces(x, y, from_host[0], from_host[1], acceleration, p, out)
    add_unforeseen_forces(time, x, y, from_host, state, p, out)
    add_coil(acceleration, p, out)
    add_unimagined_forces(x, y, state[4], velocity, p, out)
    add_undreamt_forces(x, y, from_host, state, acceleration, p, out)
    add_unsuspected_forces((slip_x, slip_y), state, velocity, p, out)
    add_unexpected_forces(time, x, y, (slip_x, slip_y), state, p, out)
    add_untold_forces(x, y, from_host, state, spin - velocity[2], acceleration, p, out)
    add_dish(x, y, p, out)
    return out
