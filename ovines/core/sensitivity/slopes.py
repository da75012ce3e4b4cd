"""Slopes of tangents: the linearised right-hand side in flight and along a wall.

Columns of a tangent ``s`` (12 rows: NES x, y, vx, vy, angle, spin, then the Host's) belong to columns of ``q`` (13
rows: what the numbers do, :mod:`ovines.core.sensitivity.columns`).  Every function differentiates the one of
:mod:`ovines.core.system` that its docstring names, line by line.
"""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled, inlined
from ovines.core.sensitivity.columns import (
    Q_AMPLITUDE,
    Q_CONTACT,
    Q_FLOOR,
    Q_FREQUENCY,
    Q_INVERSE_INERTIA,
    Q_INVERSE_MASS,
    Q_MASS,
    Q_OBSTACLE,
    Q_PHASE,
    Q_RADIUS,
    Q_WALL_FRICTION,
)
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import contact_bias, free_accelerations
from ovines.core.system.friction import SATURATED, farkas_slope, smooth_step
from ovines.core.system.host import ROTATION, Z, vertical_acceleration
from ovines.core.system.kinematics import inverse_mass, levers, normal_here, place, relative_acceleration
from ovines.core.system.packed import Contact, Face, System

# Rows of what the contact's geometry does: turn of the normal, gap, relative velocity (x, y; normal; slip), the Host's
# lever arms, the inverse masses.
TURN, GAP, RVX, RVY, NORMAL, SLIPS, LEVER_N, LEVER_T, K_NN, K_NT, K_TT = range(11)
N_GEOMETRY = 11


@inlined
def floor_slopes(
    vx: float, vy: float, spin: float, radius: float, regularisation: float, coupling: float, out: Floats
) -> None:
    """Floor friction per unit strength and its slopes over slip velocity, slip spin and radius, into ``out`` (15).

    ``out``: force x, y, torque (of :func:`ovines.core.system.friction.floor_friction` at strength 1); then each one's
    slopes over vx, vy, spin, radius.
    """
    speed, rim = math.sqrt(vx * vx + vy * vy), radius * abs(spin)
    side = 1.0 if spin > 0.0 else -1.0
    total = math.sqrt(speed * speed + rim * rim)
    force, by_speed, by_rim = 0.0, 0.0, 0.0
    turn, turn_by_speed, turn_by_rim = 0.0, 0.0, 0.0
    inverse = 1.0 / speed if speed > 0.0 else 0.0
    if coupling > 0.0:
        smooth, along_speed, along_rim = smooth_step(total / regularisation), 0.0, 0.0
        if total < SATURATED * regularisation:
            slope = (1.0 - smooth * smooth) / regularisation
            along_speed, along_rim = (slope * speed / total, slope * rim / total) if total > 0.0 else (slope, 0.0)
        f, torque, f_speed, cross, t_rim = 1.0, 0.0, 0.0, 0.0, 0.0  # cross: of the force over the rim's speed, and back
        if rim > 1e-12 * speed:
            per_rim = 1.0 / rim
            ratio = speed * per_rim
            f, torque, steep = farkas_slope(ratio)
            f_speed = steep * per_rim
            cross = -f_speed * ratio
            t_rim = -cross * ratio
        elif speed > 0.0:
            t_rim = 0.25 * inverse
        force = coupling * f * smooth
        by_speed = coupling * (f_speed * smooth + f * along_speed)
        by_rim = coupling * (cross * smooth + f * along_rim)
        turn = coupling * torque * smooth
        turn_by_speed = coupling * (cross * smooth + torque * along_speed)
        turn_by_rim = coupling * (t_rim * smooth + torque * along_rim)
        if total == 0.0:
            turn_by_rim = 0.25 * coupling / regularisation
    if coupling < 1.0:
        smooth = smooth_step(speed / regularisation)
        force += (1.0 - coupling) * smooth
        if speed < SATURATED * regularisation:
            by_speed += (1.0 - coupling) * (1.0 - smooth * smooth) / regularisation
    per_speed = force * inverse if speed > 1e-14 * rim and speed > 0.0 else by_speed
    ux, uy = vx * inverse, vy * inverse
    bent = by_speed - per_speed
    out[0], out[1], out[2] = -per_speed * vx, -per_speed * vy, -radius * turn * side
    out[3], out[4] = -per_speed - bent * ux * ux, -bent * ux * uy
    out[5], out[6] = -by_rim * radius * side * ux, -by_rim * abs(spin) * ux
    out[7], out[8] = -bent * ux * uy, -per_speed - bent * uy * uy
    out[9], out[10] = -by_rim * radius * side * uy, -by_rim * abs(spin) * uy
    out[11], out[12] = -radius * side * turn_by_speed * ux, -radius * side * turn_by_speed * uy
    out[13] = -radius * radius * turn_by_rim
    out[14] = -side * (turn + radius * abs(spin) * turn_by_rim)


@compiled
def drive_slopes(t: float, drive: Floats, out: Floats) -> None:
    """What amplitude factor, frequency factor and phase shift (columns) do to :func:`base_motion` (9 rows)."""
    out[:] = 0.0
    for row in range(drive.shape[0]):
        axis, amplitude, omega = int(drive[row, 0]), drive[row, 1], drive[row, 2]
        if axis == Z:
            continue
        if omega == 0.0:
            out[axis, 0] += amplitude
            continue
        argument = omega * t + drive[row, 3]
        sine, cosine = amplitude * math.sin(argument), amplitude * math.cos(argument)
        out[axis, 0] += sine
        out[3 + axis, 0] += omega * cosine
        out[6 + axis, 0] -= omega * omega * sine
        out[axis, 1] += omega * t * cosine
        out[3 + axis, 1] += omega * (cosine - omega * t * sine)
        out[6 + axis, 1] -= omega * omega * (2.0 * sine + omega * t * cosine)
        out[axis, 2] += cosine
        out[3 + axis, 2] -= omega * sine
        out[6 + axis, 2] -= omega * omega * cosine


@compiled
def response_slopes(t: float, p: Floats, drive: Floats, out: Floats) -> None:
    """The same for a sprung Host's steady response (:func:`sprung_response`; 6 rows)."""
    out[:] = 0.0
    for row in range(drive.shape[0]):
        axis, amplitude, omega = int(drive[row, 0]), drive[row, 1], drive[row, 2]
        if axis == Z:
            continue
        if omega == 0.0:
            out[axis, 0] += amplitude
            continue
        inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
        stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
        top, below = complex(stiffness, damping * omega), complex(stiffness - omega * omega, damping * omega)
        gain = top / below
        change = (1j * damping - gain * (-2.0 * omega + 1j * damping)) / below
        argument = omega * t + drive[row, 3]
        turned = amplitude * complex(math.cos(argument), math.sin(argument))
        by_amplitude, by_frequency = gain * turned, omega * (change + 1j * t * gain) * turned
        by_phase = 1j * gain * turned
        out[axis, 0] += by_amplitude.imag
        out[3 + axis, 0] += omega * by_amplitude.real
        out[axis, 1] += by_frequency.imag
        out[3 + axis, 1] += omega * (by_frequency.real + by_amplitude.real)
        out[axis, 2] += by_phase.imag
        out[3 + axis, 2] += omega * by_phase.real


@compiled
def host_tangents(t: float, system: System, s: Floats, q: Floats, base: Floats, turning: Floats) -> None:
    """A driven Host's rows of ``s`` at ``t``, and its accelerations' (3 rows) into ``turning``; ``base`` (9, 3)."""
    drive_slopes(t, system.drive, base)
    for j in range(q.shape[1]):
        a, f, phase = q[Q_AMPLITUDE, j], q[Q_FREQUENCY, j], q[Q_PHASE, j]
        for i in range(9):
            value = base[i, 0] * a + base[i, 1] * f + base[i, 2] * phase
            if i < 2:
                s[6 + i, j] = value
            elif i == 2:
                s[10, j] = value
            elif i < 5:
                s[5 + i, j] = value
            elif i == 5:
                s[11, j] = value
            else:
                turning[i - 6, j] = value


@compiled
def load_slope(t: float, q: Floats, j: int, system: System) -> float:
    """What column ``j`` does to the floor's load: the vertical harmonics' part in it."""
    total = 0.0
    drive = system.drive
    for row in range(drive.shape[0]):
        if int(drive[row, 0]) == Z:
            omega = drive[row, 2]
            argument = omega * t + drive[row, 3]
            sine, cosine = drive[row, 1] * math.sin(argument), drive[row, 1] * math.cos(argument)
            total -= (
                omega
                * omega
                * (
                    q[Q_AMPLITUDE, j] * sine
                    + q[Q_FREQUENCY, j] * (2.0 * sine + omega * t * cosine)
                    + q[Q_PHASE, j] * cosine
                )
            )
    return total


@compiled
def flight_tangents(
    t: float, y: Floats, at: Floats, system: System, s: Floats, q: Floats, friction: Floats, base: Floats, ds: Floats
) -> None:
    """Slopes of the tangents without wall force: :func:`ovines.core.system.dynamics.free_accelerations`."""
    p, k = system.p, system.k
    kind = k[P.HOST_KIND]
    moving = kind == P.FREE or kind == P.SPRUNG
    m = q.shape[1]
    for j in range(m):
        ds[0, j], ds[1, j], ds[4, j] = s[2, j], s[3, j], s[5, j]
        ds[2, j], ds[3, j], ds[5, j] = 0.0, 0.0, 0.0
        if moving:
            ds[6, j], ds[7, j], ds[10, j] = s[8, j], s[9, j], s[11, j]
            ds[8, j], ds[9, j], ds[11, j] = 0.0, 0.0, 0.0
    if p[P.VISCOUS_DRAG] != 0.0 or p[P.AIR_DRAG] != 0.0:
        speed = math.hypot(y[2], y[3])
        rate = p[P.VISCOUS_DRAG] + p[P.AIR_DRAG] * speed
        steep = p[P.AIR_DRAG] / speed if speed > 0.0 else 0.0
        for j in range(m):
            along = steep * (y[2] * s[2, j] + y[3] * s[3, j])
            ds[2, j] -= rate * s[2, j] + along * y[2]
            ds[3, j] -= rate * s[3, j] + along * y[3]
    if kind == P.SPRUNG:
        drive_slopes(t, system.drive, base)
        for axis in range(3):
            place_row, rate_row = (10, 11) if axis == ROTATION else (6 + axis, 8 + axis)
            inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
            stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
            for j in range(m):
                a, f, phase = q[Q_AMPLITUDE, j], q[Q_FREQUENCY, j], q[Q_PHASE, j]
                ground = base[axis, 0] * a + base[axis, 1] * f + base[axis, 2] * phase
                rate = base[3 + axis, 0] * a + base[3 + axis, 1] * f + base[3 + axis, 2] * phase
                ds[rate_row, j] -= stiffness * (s[place_row, j] - ground) + damping * (s[rate_row, j] - rate)
    if p[P.FLOOR_FRICTION] > 0.0:
        floor_tangents(t, y, at, system, s, q, friction, ds)


@compiled
def floor_tangents(
    t: float, y: Floats, at: Floats, system: System, s: Floats, q: Floats, friction: Floats, ds: Floats
) -> None:
    """The floor's part: :func:`ovines.core.system.dynamics.floor`."""
    p, k = system.p, system.k
    grounded = k[P.ON_GROUND] != 0
    moving = (k[P.HOST_KIND] == P.FREE or k[P.HOST_KIND] == P.SPRUNG) and not grounded
    rx, ry = at[0] - at[4], at[1] - at[5]
    turn = 0.0 if grounded else at[9]
    vx, vy, load = at[2], at[3], p[P.FLOOR_LOAD]
    if not grounded:
        vx, vy = vx - at[7] + turn * ry, vy - at[8] - turn * rx
        load += vertical_acceleration(t, k, system.drive, system.table)
    wears = 1.0 + p[P.DRIFT_PER_S] * t
    strength = max(p[P.FLOOR_FRICTION] * wears, 0.0) * max(load, 0.0)
    floor_slopes(vx, vy, y[5] - turn, p[P.RADIUS], p[P.REGULARISATION], p[P.COUPLING], friction)
    f = friction
    mass, per_inertia = p[P.MASS], p[P.MASS] / p[P.INERTIA]
    for j in range(q.shape[1]):
        sx, sy, spin = s[2, j], s[3, j], s[5, j]
        if not grounded:
            sx += -s[8, j] + s[11, j] * ry + turn * (s[1, j] - s[7, j])
            sy += -s[9, j] - s[11, j] * rx - turn * (s[0, j] - s[6, j])
            spin -= s[11, j]
        stronger = q[Q_FLOOR, j] * max(wears, 0.0) * max(load, 0.0)
        if not grounded and load > 0.0:
            stronger += max(p[P.FLOOR_FRICTION] * wears, 0.0) * load_slope(t, q, j, system)
        radius = q[Q_RADIUS, j]
        ax = strength * (f[3] * sx + f[4] * sy + f[5] * spin + f[6] * radius) + stronger * f[0]
        ay = strength * (f[7] * sx + f[8] * sy + f[9] * spin + f[10] * radius) + stronger * f[1]
        torque = strength * (f[11] * sx + f[12] * sy + f[13] * spin + f[14] * radius) + stronger * f[2]
        ds[2, j] += ax
        ds[3, j] += ay
        changed = q[Q_MASS, j] / p[P.INERTIA] + mass * q[Q_INVERSE_INERTIA, j]
        ds[5, j] += torque * per_inertia + strength * f[2] * changed
        if moving:
            heavier = q[Q_MASS, j] * strength
            ds[8, j] -= (ax * mass + f[0] * heavier) * p[P.INVERSE_HOST_MASS]
            ds[9, j] -= (ay * mass + f[1] * heavier) * p[P.INVERSE_HOST_MASS]
            arm = rx * ay - ry * ax + strength * ((s[0, j] - s[6, j]) * f[1] - (s[1, j] - s[7, j]) * f[0])
            whole = f[2] + rx * f[1] - ry * f[0]
            ds[11, j] -= ((torque + arm) * mass + whole * heavier) * p[P.INVERSE_HOST_INERTIA]


@compiled
def geometry_tangents(
    wall: int, face: Face, spin: float, at: Floats, p: Floats, s: Floats, q: Floats, g: Floats
) -> None:
    """What the tangents do to the contact: :func:`contact_frame`, :func:`contact_velocity`, :func:`inverse_mass`.

    ``s`` may have one column more than ``q``: the flow itself, so that its column holds rates.
    """
    nx, ny, bent = face.x, face.y, face.curvature
    radius, turn = p[P.RADIUS], at[9]
    rx, ry = at[0] - at[4], at[1] - at[5]
    vx, vy = at[2] - at[7] + turn * ry, at[3] - at[8] - turn * rx
    rn, rt = rx * nx + ry * ny, ry * nx - rx * ny
    vn, vt = vx * nx + vy * ny, vy * nx - vx * ny
    _nes_n, _nes_t, host_n, host_t = levers(face, at, p)
    nes, host = 1.0 / p[P.INERTIA], p[P.INVERSE_HOST_INERTIA]
    for j in range(s.shape[1]):
        own = j < q.shape[1]
        larger = q[Q_RADIUS, j] if own else 0.0
        dx, dy = s[0, j] - s[6, j], s[1, j] - s[7, j]
        dn, dt = dx * nx + dy * ny, dy * nx - dx * ny
        angle = s[10, j] * (1.0 - bent * rn) + bent * dt
        room = 0.0
        if own:
            room = q[Q_CONTACT, j] if wall == P.ROUND else (-q[Q_OBSTACLE, j] if wall == P.OBSTACLE else -larger)
        dvx = s[2, j] - s[8, j] + s[11, j] * ry + turn * dy
        dvy = s[3, j] - s[9, j] - s[11, j] * rx - turn * dx
        g[TURN, j], g[GAP, j] = angle, room - dn - s[10, j] * rt
        g[RVX, j], g[RVY, j] = dvx, dvy
        g[NORMAL, j] = dvx * nx + dvy * ny + vt * angle
        g[SLIPS, j] = dvy * nx - dvx * ny - vn * angle + larger * (spin - turn) + radius * (s[5, j] - s[11, j])
        lever_n, lever_t = dn + rt * angle + larger, dt - rn * angle
        if host_t == 0.0:
            lever_t = 0.0
        g[LEVER_N, j], g[LEVER_T, j] = lever_n, lever_t
        lighter = q[Q_INVERSE_MASS, j] if own else 0.0
        turned = q[Q_INVERSE_INERTIA, j] if own else 0.0
        g[K_NN, j] = lighter + 2.0 * host_t * lever_t * host
        g[K_NT, j] = -(lever_n * host_t + host_n * lever_t) * host
        g[K_TT, j] = lighter + radius * radius * turned + 2.0 * radius * larger * nes + 2.0 * host_n * lever_n * host


@compiled
def push_tangents(
    face: Face, at: Floats, p: Floats, g: Floats, q: Floats, forces: Floats, d_forces: Floats, out: Floats
) -> None:
    """Add what tangents ``d_forces`` (2, m) of the contact's ``forces`` (normal, tangential) do to ``out`` (12, m)."""
    nx, ny = face.x, face.y
    normal, along = forces[0], forces[1]
    fx, fy = normal * nx - along * ny, normal * ny + along * nx
    _nes_n, _nes_t, host_n, host_t = levers(face, at, p)
    radius = p[P.RADIUS]
    for j in range(q.shape[1]):
        dn, dt, angle = d_forces[0, j], d_forces[1, j], g[TURN, j]
        dfx, dfy = dn * nx - dt * ny - fy * angle, dn * ny + dt * nx + fx * angle
        out[2, j] += dfx / p[P.MASS] + fx * q[Q_INVERSE_MASS, j]
        out[3, j] += dfy / p[P.MASS] + fy * q[Q_INVERSE_MASS, j]
        out[5, j] += (q[Q_RADIUS, j] * along + radius * dt) / p[P.INERTIA] + radius * along * q[Q_INVERSE_INERTIA, j]
        if p[P.INVERSE_HOST_MASS] > 0.0:
            out[8, j] -= dfx * p[P.INVERSE_HOST_MASS]
            out[9, j] -= dfy * p[P.INVERSE_HOST_MASS]
            turned = g[LEVER_N, j] * along + host_n * dt - g[LEVER_T, j] * normal - host_t * dn
            out[11, j] -= turned * p[P.INVERSE_HOST_INERTIA]


@compiled
def contact_tangents(
    t: float, y: Floats, contact: Contact, system: System, work: Floats, s: Floats, q: Floats, room: Floats, ds: Floats
) -> None:
    """Slopes of the tangents in flight, or sliding or rolling along a wall: :func:`derivatives`.

    ``room`` (40, m + 1) holds what is needed on the way; a driven Host's rows of ``s`` are filled.
    """
    p, k = system.p, system.k
    scratch, at, free = work[P.SCRATCH], work[P.PLACE], work[P.SPARE]
    base = room[0:9, 0:3]
    turning = room[9:12]
    friction = room[12, :15]
    g = room[13:24]
    forces, d_forces = room[24, :2], room[25:27]
    kind = k[P.HOST_KIND]
    m = q.shape[1]
    place(t, y, system, scratch, at)
    if kind == P.DRIVEN:
        host_tangents(t, system, s, q, base, turning)
    flight_tangents(t, y, at, system, s, q, friction, base, ds)
    if contact.mode == P.FLIGHT:
        return
    free_accelerations(t, y, at, system, scratch, free)
    face = normal_here(contact.wall, at, p, k, system.polygon)
    bias_n, bias_t = contact_bias(y, at, face, free, p, k, scratch)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    ax, ay, alpha = relative_acceleration(y, at, free, k, scratch)
    geometry_tangents(contact.wall, face, y[5], at, p, s[:, :m], q, g)
    nx, ny, bent, spin, radius = face.x, face.y, face.curvature, at[9], p[P.RADIUS]
    rx, ry = at[0] - at[4], at[1] - at[5]
    vx, vy = at[2] - at[7] + spin * ry, at[3] - at[8] - spin * rx
    rn, rt, along = rx * nx + ry * ny, ry * nx - rx * ny, vy * nx - vx * ny
    vn = vx * nx + vy * ny
    bx = ax + alpha * ry + spin * spin * rx + 2.0 * spin * vy
    by = ay - alpha * rx + spin * spin * ry - 2.0 * spin * vx
    determinant = k_nn * k_tt - k_nt * k_nt
    rub = contact.side * p[P.WALL_FRICTION]
    if contact.mode == P.SLIDE:
        forces[0] = -bias_n / (k_nn + rub * k_nt)
        forces[1] = rub * forces[0]
    else:
        forces[0] = -(k_tt * bias_n - k_nt * bias_t) / determinant
        forces[1] = -(k_nn * bias_t - k_nt * bias_n) / determinant
    for j in range(m):
        dax, day, dalpha = ds[2, j], ds[3, j], 0.0
        if kind == P.DRIVEN:
            dax, day, dalpha = dax - turning[0, j], day - turning[1, j], turning[2, j]
        elif kind != P.FIXED:
            dax, day, dalpha = dax - ds[8, j], day - ds[9, j], ds[11, j]
        dx, dy, dspin = s[0, j] - s[6, j], s[1, j] - s[7, j], s[11, j]
        angle, dvx, dvy = g[TURN, j], g[RVX, j], g[RVY, j]
        dbx = dax + dalpha * ry + alpha * dy + spin * (2.0 * dspin * rx + spin * dx) + 2.0 * (dspin * vy + spin * dvy)
        dby = day - dalpha * rx - alpha * dx + spin * (2.0 * dspin * ry + spin * dy) - 2.0 * (dspin * vx + spin * dvx)
        flatter = 0.0
        if contact.wall == P.ROUND:
            flatter = -q[Q_CONTACT, j] * bent * bent
        elif contact.wall == P.OBSTACLE:
            flatter = q[Q_OBSTACLE, j] * bent * bent
        d_n = dbx * nx + dby * ny + (by * nx - bx * ny) * angle + flatter * along * along
        d_n += 2.0 * bent * along * (dvy * nx - dvx * ny - vn * angle)
        dn, dt = dx * nx + dy * ny, dy * nx - dx * ny
        d_t = day * nx - dax * ny - (ax * nx + ay * ny) * angle + q[Q_RADIUS, j] * (free[5] - alpha)
        d_t += radius * (ds[5, j] - dalpha) - dalpha * rn - alpha * (dn + rt * angle)
        d_t += spin * (2.0 * dspin * rt + spin * (dt - rn * angle))
        if contact.mode == P.SLIDE:
            d_rub = contact.side * q[Q_WALL_FRICTION, j]
            change = g[K_NN, j] + d_rub * k_nt + rub * g[K_NT, j]
            d_forces[0, j] = -(d_n + forces[0] * change) / (k_nn + rub * k_nt)
            d_forces[1, j] = d_rub * forces[0] + rub * d_forces[0, j]
        else:
            rest_n = -d_n - g[K_NN, j] * forces[0] - g[K_NT, j] * forces[1]
            rest_t = -d_t - g[K_NT, j] * forces[0] - g[K_TT, j] * forces[1]
            d_forces[0, j] = (k_tt * rest_n - k_nt * rest_t) / determinant
            d_forces[1, j] = (k_nn * rest_t - k_nt * rest_n) / determinant
    push_tangents(face, at, p, g, q, forces, d_forces, ds)
