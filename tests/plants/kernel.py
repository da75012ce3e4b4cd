"""The plant's compiled motion: Runge-Kutta steps, each impact located by bisection of its step, sustained contact as a
constraint.

All in the rig's frame: origin at the Host's mean place, x along the drive.  Everything compiled stands in this one
file, whose hash says whether what is kept on disk is still of it.  How it is compiled is its only loan from the core
(:mod:`ovines.core.compiled`): helpers go into the one function that Python calls, each once.
"""

from __future__ import annotations

import hashlib
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.special import ellipe, ellipk

from ovines.core.compiled import STAMP as CORES
from ovines.core.compiled import compiler

GRAVITY_M_PER_S2 = 9.81
# Longest hop, in steps, that is no longer followed: the disk then stays at the wall until the wall lets go.
SHORTEST_HOP = 4.0
# Slip below which friction at the wall grows linearly, over that of the floor: both only have to be far below the slips
# that count.
WALL_SMOOTHING = 2.0
BISECTIONS = 60


class Physics(NamedTuple):
    """What moves the disk, per unit mass.  A zero switches a term off."""

    reach_m: float  # contact radius: Host's inner radius less the disk's
    radius_m: float
    inertia_factor: float  # about the centre of mass
    restitution: float
    restitution_scatter: float
    restitution_fall_s_per_m: float  # restitution falls by this per m/s of approach
    wall_friction: float
    tangential_restitution: float
    wall_roughness_rad: float  # scatter of the wall normal's direction from impact to impact
    friction: float  # floor, Coulomb
    coupling: float  # 1: sliding and spinning share the friction (Farkas); 0: plain sliding, no torque
    smoothing_m_per_s: float
    static_share: float  # Stribeck: friction at rest is larger by this share ...
    static_m_per_s: float  # ... and falls off within this speed
    patch_share: float  # friction larger by this share at a place of the floor
    patch_x_m: float
    patch_y_m: float
    patch_width_m: float
    gradient_x: float  # relative change of friction from the Host's centre to the reach
    gradient_y: float
    anisotropy: float  # friction along an axis larger, across it smaller, by this share
    anisotropy_rad: float
    memory_share: float  # friction larger by this share once the disk has been slow, until it has been fast
    memory_slow_m_per_s: float
    memory_fast_m_per_s: float
    settling_share: float  # friction smaller by this share just after an impact ...
    settling_s: float  # ... recovering within this time
    spin_decay_per_s: float
    viscous_per_s: float
    air_per_m: float
    lift: float  # force across the velocity: this times the spin times it
    tilt_x_m_per_s2: float
    tilt_y_m_per_s2: float
    pull_m_per_s2: float  # towards the wall, at the wall ...
    pull_width_m: float  # ... and falling off within this distance
    mass_x_m: float  # centre of mass from the disk's middle, in the disk
    mass_y_m: float
    recoil_share: float  # the disk's mass over the Host's, which steps back at impacts ...
    recoil_rad_per_s: float  # ... and swings about where it was, so fast, ...
    recoil_decay_per_s: float  # ... for so long
    sides: float  # flat sides of a regular wall whose contact edge has the reach as its inner radius; 0: a ring
    sides_rad: float  # where the first side's normal points
    cylinder_m: float  # contact radius of a cylinder in the Host's middle; 0: none
    step_s: float


def sliding_table(count: int = 4001) -> np.ndarray:
    """Farkas' force and torque (thesis eqs 48, 49 as ERRATA has them) over atan2(rim speed, speed) from 0 to pi/2:
    (count, 2).

    Force 1 where nothing spins, torque 2/3 (of mu N R) where nothing slides.
    """
    out = np.empty((count, 2))
    for i, angle in enumerate(np.linspace(0.0, 0.5 * np.pi, count)):
        speed, rim = math.cos(angle), math.sin(angle)
        k = min(speed, rim) / max(speed, rim)
        if k < 1e-6:
            out[i] = (1.0, 0.25 * k) if speed > rim else (k, 2.0 / 3.0)
            continue
        m, left = k * k, max((1.0 - k) * (1.0 + k), 1e-300)
        whole, second = ellipk(min(m, 1.0 - 1e-15)), ellipe(m)
        b, d = (second - left * whole) / m, (whole - second) / m
        c = (d - b) / m
        if k < 0.03:  # differences of nearly equal numbers: the series of C about 0
            c = np.pi / 16.0 * (1.0 + 0.75 * m)
        if speed <= rim:
            out[i] = 4 * k / (3 * np.pi) * (b + second), 4 / (9 * np.pi) * ((4 - 2 * m) * second - left * whole)
        else:
            out[i] = 4 / (3 * np.pi) * (second + b), 4 * k / (9 * np.pi) * (c + 3 * b - d)
    return out


LINE_COLUMNS = 8
STAMP = hashlib.sha256(CORES.encode() + Path(__file__).read_bytes()).hexdigest()
# What makes no array counts no references on those that it is given.
compiled = compiler(STAMP, counting=False)
making_arrays = compiler(STAMP)


@compiled
def host_at(time, lines):
    """Host's position, velocity and acceleration (each x, y, rotation, z).

    ``lines`` (n, 8): axis (negative: no more lines), amplitude, rad/s, phase, sweep (rad/s^2), since (s; nothing
    before), rise (s; 0: at once) and decay (1/s): a sine, a chirp, a start-up, or what rings after an impact, and any
    sum of them.
    """
    x0, y0, r0, z0 = 0.0, 0.0, 0.0, 0.0
    x1, y1, r1, z1 = 0.0, 0.0, 0.0, 0.0
    x2, y2, r2, z2 = 0.0, 0.0, 0.0, 0.0
    for i in range(lines.shape[0]):
        if lines[i, 0] < 0.0:
            break
        late = time - lines[i, 5]
        rise, decay = lines[i, 6], lines[i, 7]
        if late < 0.0 or lines[i, 1] == 0.0 or decay * late > 40.0:
            continue
        axis, size, sweep = int(lines[i, 0]), lines[i, 1], lines[i, 4]
        phase = lines[i, 3] + (lines[i, 2] * time if decay == 0.0 else lines[i, 2] * late) + 0.5 * sweep * time * time
        omega = lines[i, 2] + sweep * time
        sine, cosine = math.sin(phase), math.cos(phase)
        # the envelope g and its derivatives
        g, g1, g2 = 1.0, 0.0, 0.0
        if rise > 0.0:
            left = math.exp(-late / rise)
            g, g1, g2 = 1.0 - left, left / rise, -left / rise**2
        elif decay > 0.0:
            g = math.exp(-decay * late)
            g1, g2 = -decay * g, decay * decay * g
        moved = size * g * sine
        moves = size * (g1 * sine + g * omega * cosine)
        changes = size * (g2 * sine + 2.0 * g1 * omega * cosine + g * (sweep * cosine - omega * omega * sine))
        if axis == 0:
            x0, x1, x2 = x0 + moved, x1 + moves, x2 + changes
        elif axis == 1:
            y0, y1, y2 = y0 + moved, y1 + moves, y2 + changes
        elif axis == 2:
            r0, r1, r2 = r0 + moved, r1 + moves, r2 + changes
        else:
            z0, z1, z2 = z0 + moved, z1 + moves, z2 + changes
    return (x0, y0, r0, z0), (x1, y1, r1, z1), (x2, y2, r2, z2)


@compiled
def _floor(p, x, y, slip_x, slip_y, spin, level, since_s, load, table):
    """Friction of the floor on the disk, per unit mass: force at its middle, torque about it."""
    speed, rim = math.hypot(slip_x, slip_y), p.radius_m * abs(spin)
    mu = p.friction
    if p.static_share != 0.0:
        mu *= 1.0 + p.static_share * math.exp(-speed / p.static_m_per_s)
    if p.patch_share != 0.0:
        mu *= 1.0 + p.patch_share * math.exp(
            -0.5 * ((x - p.patch_x_m) ** 2 + (y - p.patch_y_m) ** 2) / p.patch_width_m**2
        )
    mu *= max(1.0 + (p.gradient_x * x + p.gradient_y * y) / p.reach_m, 0.0)
    mu *= 1.0 + p.memory_share * level
    if p.settling_share != 0.0:
        mu *= 1.0 - p.settling_share * math.exp(-since_s / p.settling_s)
    place = math.atan2(rim, speed) / (0.5 * math.pi) * (table.shape[0] - 1)
    low = min(int(place), table.shape[0] - 2)
    share = place - low
    both = math.tanh(math.hypot(speed, rim) / p.smoothing_m_per_s)
    force = p.coupling * both * (table[low, 0] + share * (table[low + 1, 0] - table[low, 0]))
    if p.coupling != 1.0:
        force += (1.0 - p.coupling) * math.tanh(speed / p.smoothing_m_per_s)
    torque = p.coupling * both * (table[low, 1] + share * (table[low + 1, 1] - table[low, 1])) * p.radius_m
    if spin > 0.0:
        torque = -torque
    if spin == 0.0:
        torque = 0.0
    along_x, along_y = 0.0, 0.0
    if speed > 0.0:
        along_x, along_y = -force * slip_x / speed, -force * slip_y / speed
    if p.anisotropy != 0.0:
        c, s = math.cos(p.anisotropy_rad), math.sin(p.anisotropy_rad)
        a, b = (c * along_x + s * along_y) * (1.0 + p.anisotropy), (c * along_y - s * along_x) * (1.0 - p.anisotropy)
        along_x, along_y = c * a - s * b, s * a + c * b
    return mu * load * along_x, mu * load * along_y, mu * load * torque


@compiled
def middle_of(state, p):
    """From the centre of mass to the disk's middle, in the rig's frame."""
    if p.mass_x_m == 0.0 and p.mass_y_m == 0.0:
        return 0.0, 0.0
    c, s = math.cos(state[2]), math.sin(state[2])
    return -(c * p.mass_x_m - s * p.mass_y_m), -(s * p.mass_x_m + c * p.mass_y_m)


@compiled
def free_rate(time, host, state, p, gust, table, out):
    """Rate of (x, y, angle, vx, vy, spin, memory, time of the last impact) away from the wall, into ``out``; x, y of
    the centre of mass; ``host``: what :func:`host_at` says of that time.
    """
    where, speed, change = host
    arm_x, arm_y = middle_of(state, p)
    vx, vy, spin = state[3], state[4], state[5]
    x, y = state[0] + arm_x - where[0], state[1] + arm_y - where[1]
    slip_x = vx - spin * arm_y - (speed[0] - speed[2] * y)
    slip_y = vy + spin * arm_x - (speed[1] + speed[2] * x)
    load = max(GRAVITY_M_PER_S2 + change[3], 0.0)
    fx, fy, torque = _floor(p, x, y, slip_x, slip_y, spin - speed[2], state[6], time - state[7], load, table)
    inertia = p.inertia_factor * p.radius_m**2
    out[0], out[1], out[2], out[6], out[7] = vx, vy, spin, 0.0, 0.0
    drag = p.viscous_per_s + p.air_per_m * math.hypot(vx, vy)
    lift = p.lift * spin
    out[3] = fx - drag * vx - lift * vy + p.tilt_x_m_per_s2
    out[4] = fy - drag * vy + lift * vx + p.tilt_y_m_per_s2
    out[5] = (torque + arm_x * fy - arm_y * fx) / inertia - p.spin_decay_per_s * (spin - speed[2])
    if p.pull_m_per_s2 != 0.0:
        far = math.hypot(x, y) + 1e-300
        pull = p.pull_m_per_s2 * math.exp((far - p.reach_m) / p.pull_width_m)
        out[3] += pull * x / far
        out[4] += pull * y / far
    if gust.shape[0] > 1:  # rows: time, acceleration x, y at equal steps
        place = (time - gust[0, 0]) / (gust[1, 0] - gust[0, 0])
        low = min(max(int(place), 0), gust.shape[0] - 2)
        share = place - low
        out[3] += gust[low, 1] + share * (gust[low + 1, 1] - gust[low, 1])
        out[4] += gust[low, 2] + share * (gust[low + 1, 2] - gust[low, 2])


@compiled
def nearest(x, y, turn, p):
    """Gap, outward normal, how much it bends (1/m, a ring's > 0) and number of the surface next to the disk's middle at
    x, y from the Host's; ``turn`` of the Host.  0: the ring, 1 and on: sides, -1: the cylinder.
    """
    far = math.hypot(x, y) + 1e-300
    gap, nx, ny, bend, number = p.reach_m - far, x / far, y / far, 1.0 / p.reach_m, 0
    for k in range(int(p.sides)):
        angle = p.sides_rad + turn + 2.0 * math.pi * k / p.sides
        left = p.reach_m - x * math.cos(angle) - y * math.sin(angle)
        if k == 0 or left < gap:
            gap, nx, ny, bend, number = left, math.cos(angle), math.sin(angle), 0.0, k + 1
    if p.cylinder_m > 0.0 and far - p.cylinder_m < gap:
        gap, nx, ny, bend, number = far - p.cylinder_m, -x / far, -y / far, -1.0 / p.cylinder_m, -1
    return gap, nx, ny, bend, number


@compiled
def surface_at(host, state, p):
    """How much the surface next to the disk bends, and its number."""
    where, _, _ = host
    arm_x, arm_y = middle_of(state, p)
    _, _, _, bend, number = nearest(state[0] + arm_x - where[0], state[1] + arm_y - where[1], where[2], p)
    return bend, number


@compiled
def wall_at(host, state, p):
    """Gap to the wall, its outward normal, approach speed and slip at the contact, arm of the contact from the centre
    of mass.
    """
    where, speed, _ = host
    arm_x, arm_y = middle_of(state, p)
    x, y = state[0] + arm_x - where[0], state[1] + arm_y - where[1]
    gap, nx, ny, _, _ = nearest(x, y, where[2], p)
    cx, cy = arm_x + p.radius_m * nx, arm_y + p.radius_m * ny
    from_host_x, from_host_y = x + p.radius_m * nx, y + p.radius_m * ny
    ux = state[3] - state[5] * cy - speed[0] + speed[2] * from_host_y
    uy = state[4] + state[5] * cx - speed[1] - speed[2] * from_host_x
    return gap, nx, ny, ux * nx + uy * ny, -ux * ny + uy * nx, cx, cy


@compiled
def pressed(time, host, state, p, gust, table, out):
    """Rate of the free state into ``out``; what the wall must push per unit mass to keep the disk at it; <= 0 where it
    would have to pull.
    """
    free_rate(time, host, state, p, gust, table, out)
    _, nx, ny, _, slip, cx, cy = wall_at(host, state, p)
    _, speed, change = host
    arm_x, arm_y = middle_of(state, p)
    spin = state[5]
    # the middle's own velocity and acceleration, against the Host's
    vx, vy = state[3] - spin * arm_y - speed[0], state[4] + spin * arm_x - speed[1]
    ax = out[3] - out[5] * arm_y - spin * spin * arm_x - change[0]
    ay = out[4] + out[5] * arm_x - spin * spin * arm_y - change[1]
    along = -vx * ny + vy * nx
    outward = ax * nx + ay * ny + along * along * surface_at(host, state, p)[0]
    rub = p.wall_friction * math.tanh(slip / (WALL_SMOOTHING * p.smoothing_m_per_s))
    fx, fy = -nx + rub * ny, -ny - rub * nx
    turn = (cx * fy - cy * fx) / (p.inertia_factor * p.radius_m**2)
    yields = (fx - turn * arm_y) * nx + (fy + turn * arm_x) * ny
    return -outward / yields, fx, fy, turn


@compiled
def held_rate(time, host, state, p, gust, table, out):
    """Rate of the state while the wall holds the disk, into ``out``."""
    push, fx, fy, turn = pressed(time, host, state, p, gust, table, out)
    push = max(push, 0.0)
    out[3] += push * fx
    out[4] += push * fy
    out[5] += push * turn


@compiled
def stepped(time, state, step, held, p, here, harmonics, gust, table, work, new):
    """One classical Runge-Kutta step into ``new``; ``work`` (5, 8): the four rates and where they are asked; ``here``:
    the Host at ``time``.  Gives the Host at the step's end.
    """
    at, now, host = work[4], time, here
    middle, there = host_at(time + 0.5 * step, harmonics), host_at(time + step, harmonics)
    for i in range(8):
        at[i] = state[i]
    for stage in range(4):
        if held:
            held_rate(now, host, at, p, gust, table, work[stage])
        else:
            free_rate(now, host, at, p, gust, table, work[stage])
        if stage < 3:
            part = step if stage == 2 else 0.5 * step
            now, host = time + part, there if stage == 2 else middle
            for i in range(8):
                at[i] = state[i] + part * work[stage, i]
    for i in range(8):
        new[i] = state[i] + step / 6.0 * (work[0, i] + 2.0 * work[1, i] + 2.0 * work[2, i] + work[3, i])
    return there


@compiled
def kicked(vx, vy, spin, nx, ny, cx, cy, restitution, wall_friction, tangential_restitution, inertia):
    """Changes of vx, vy and spin by the impulse at a contact with arm (cx, cy) and outward normal (nx, ny), velocities
    against a wall at rest.

    Luding's law as the thesis has it: rebound with the restitution, reversal of the slip with the tangential one, the
    tangential impulse never above mu_c times the normal.  Solved with both arms, so that an eccentric mass is treated
    as exactly as a centred one. Returns also whether the contact slid.
    """
    un = (vx - spin * cy) * nx + (vy + spin * cx) * ny
    ut = -(vx - spin * cy) * ny + (vy + spin * cx) * nx
    turn_n, turn_t = cx * ny - cy * nx, cx * nx + cy * ny
    nn, tt, nt = 1.0 + turn_n**2 / inertia, 1.0 + turn_t**2 / inertia, turn_n * turn_t / inertia
    want_n, want_t = -(1.0 + restitution) * un, -(1.0 + tangential_restitution) * ut
    solved = nn * tt - nt * nt
    jn, jt = (tt * want_n - nt * want_t) / solved, (nn * want_t - nt * want_n) / solved
    slid = abs(jt) > wall_friction * abs(jn)
    if slid:
        side = -1.0 if ut > 0.0 else 1.0
        jn = want_n / (nn - side * wall_friction * nt)
        jt = side * wall_friction * abs(jn)
    return jn * nx - jt * ny, jn * ny + jt * nx, (jn * turn_n + jt * turn_t) / inertia, slid


@making_arrays
def struck(state, nx, ny, cx, cy, restitution, wall_friction, tangential_restitution, inertia):
    """State after :func:`kicked`, and whether the contact slid."""
    new = state.copy()
    x, y, turn, slid = kicked(
        state[3], state[4], state[5], nx, ny, cx, cy, restitution, wall_friction, tangential_restitution, inertia
    )
    new[3] += x
    new[4] += y
    new[5] += turn
    return new, slid


@compiled
def strike(time, host, state, p, drawn, record):
    """Impact with the moving wall, in place; ``record``: approach, slip, restitution, azimuth, leaving speed, slip
    after, slid.
    """
    gap, nx, ny, approach, slip, cx, cy = wall_at(host, state, p)
    where, speed, _ = host
    state[0] += gap * nx
    state[1] += gap * ny
    from_x, from_y = state[0] + cx - where[0], state[1] + cy - where[1]
    record[0], record[1], record[2], record[3] = approach, slip, 0.0, math.atan2(from_y, from_x)
    record[4], record[5], record[6] = -approach, slip, 0.0
    if approach <= 0.0:
        return
    value = p.restitution - p.restitution_fall_s_per_m * approach + p.restitution_scatter * drawn[0]
    value = min(max(value, 0.05), 0.98)
    away = p.wall_roughness_rad * drawn[1]
    rx, ry = nx * math.cos(away) - ny * math.sin(away), nx * math.sin(away) + ny * math.cos(away)
    # seen from the wall's contact point
    wall_x, wall_y = speed[0] - speed[2] * from_y, speed[1] + speed[2] * from_x
    vx, vy, inertia = state[3] - wall_x, state[4] - wall_y, p.inertia_factor * p.radius_m**2
    x, y, turn, slid = kicked(
        vx, vy, state[5], rx, ry, cx, cy, value, p.wall_friction, p.tangential_restitution, inertia
    )
    state[3] = vx + x + wall_x
    state[4] = vy + y + wall_y
    state[5] += turn
    state[7] = time
    _, _, _, after, slip_after, _, _ = wall_at(host, state, p)
    record[2], record[4], record[5], record[6] = value, -after, slip_after, 1.0 if slid else 0.0


@compiled
def _note(node, time, state, held):
    node[0], node[7] = time, held
    for i in range(6):
        node[1 + i] = state[i]


@making_arrays
def run(duration_s, longest_hold_s, state, p, harmonics, gust, table, drawn):
    """Move the disk for ``duration_s`` from time 0, or until the wall has held it for ``longest_hold_s``.

    Nodes (n, 8): time, x, y, angle, vx, vy, spin, held, an impact having one before and one after; impacts (k, 8): time
    and what :func:`strike` tells; sustained contacts (h, 2).
    """
    nodes = np.empty((int(duration_s / p.step_s) + 4 * drawn.shape[0] + 10, 8))
    impacts, holds = np.empty((drawn.shape[0], 8)), np.empty((drawn.shape[0], 2))
    work = np.zeros((8, 8))
    work[0] = state
    n, k, h = _move(duration_s, longest_hold_s, p, harmonics, gust, table, drawn, work, nodes, impacts, holds)
    return nodes[:n].copy(), impacts[:k].copy(), holds[:h].copy()


@compiled
def _move(duration_s, longest_hold_s, p, harmonics, gust, table, drawn, work, nodes, impacts, holds):
    """Fill them; how many there are of each.  ``work`` (8, 8): the state to begin with, and room."""
    state, new, rate, rates = work[0], work[1], work[2], work[3:]
    n, k, h = 0, 0, 0
    time, held, here = 0.0, False, host_at(0.0, harmonics)
    while True:
        _note(nodes[n], time, state, 1.0 if held else 0.0)
        n += 1
        left = duration_s - time
        if left < 1e-9 * p.step_s or k == drawn.shape[0] or h == holds.shape[0] - 1:
            break
        if held and time - holds[h, 0] > longest_hold_s:
            break
        step = min(p.step_s, left)
        if held and pressed(time, here, state, p, gust, table, rate)[0] <= 0.0:
            held = False
            holds[h, 1] = time
            h += 1
        there = stepped(time, state, step, held, p, here, harmonics, gust, table, rates, new)
        gap, nx, ny, approach, _, _, _ = wall_at(there, new, p)
        if p.memory_share != 0.0:
            _, speed, _ = here
            sliding = math.hypot(new[3] - speed[0], new[4] - speed[1])
            if sliding < p.memory_slow_m_per_s:
                new[6] = 1.0
            elif sliding > p.memory_fast_m_per_s:
                new[6] = 0.0
        if held and surface_at(there, new, p)[1] != surface_at(here, state, p)[1]:
            # along one side into the next: an impact there
            time, here = time + step, there
            strike(time, here, new, p, drawn[k], impacts[k, 1:])
            for i in range(8):
                state[i] = new[i]
            held = False
            holds[h, 1] = time
            h += 1
            impacts[k, 0] = time
            k += 1
            continue
        if held:  # rounding of the constraint, removed without rebound
            new[0] += gap * nx
            new[1] += gap * ny
            new[3] -= approach * nx
            new[4] -= approach * ny
        if held or gap >= 0.0:
            time, here = time + step, there
            for i in range(8):
                state[i] = new[i]
            continue
        low, high = 0.0, step
        for _ in range(BISECTIONS):
            half = 0.5 * (low + high)
            there = stepped(time, state, half, False, p, here, harmonics, gust, table, rates, new)
            if wall_at(there, new, p)[0] < 0.0:
                high = half
            else:
                low = half
        here = stepped(time, state, high, False, p, here, harmonics, gust, table, rates, new)
        for i in range(8):
            state[i] = new[i]
        time += high
        _note(nodes[n], time, state, 0.0)
        n += 1
        record = impacts[k, 1:]
        strike(time, here, state, p, drawn[k], record)
        if p.recoil_share != 0.0 and record[0] > 0.0:  # the Host takes the momentum and swings back
            for axis in range(2):
                row = harmonics.shape[0] - 2 * drawn.shape[0] + 2 * k + axis
                kick = -p.recoil_share * (state[3 + axis] - new[3 + axis]) / p.recoil_rad_per_s
                harmonics[row, 0], harmonics[row, 1], harmonics[row, 2] = axis, kick, p.recoil_rad_per_s
                harmonics[row, 5], harmonics[row, 7] = time, p.recoil_decay_per_s
            here = host_at(time, harmonics)
        impacts[k, 0] = time
        k += 1
        press = pressed(time, here, state, p, gust, table, rate)[0]
        if press > 0.0 and 2.0 * record[4] < SHORTEST_HOP * p.step_s * press:
            held = True
            holds[h, 0] = time
            _, nx, ny, approach, _, _, _ = wall_at(here, state, p)
            state[3] -= approach * nx
            state[4] -= approach * ny
    if held:
        holds[h, 1] = time
        h += 1
    return n, k, h
