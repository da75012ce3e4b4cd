"""Slopes of tangents in flight: the linearised right-hand side with the floor's friction, without a wall.

Columns of a tangent ``s`` (12 rows: NES x, y, vx, vy, angle, spin, then the Host's) belong to columns of ``q`` (13
rows: what the numbers do, :mod:`ovines.core.sensitivity.columns`).  Every function differentiates the one of
:mod:`ovines.core.system` that its docstring names, line by line.
"""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled, inlined
from ovines.core.sensitivity import tangents as T
from ovines.core.sensitivity.columns import (
    Q_AMPLITUDE,
    Q_FLOOR,
    Q_FREQUENCY,
    Q_INVERSE_INERTIA,
    Q_MASS,
    Q_PHASE,
    Q_RADIUS,
)
from ovines.core.sensitivity.host_slopes import drive_slopes, load_slope
from ovines.core.sensitivity.tangents import Columns
from ovines.core.system import parameters as P
from ovines.core.system.friction import SATURATED, farkas_slope, smooth_step
from ovines.core.system.host import ROTATION, rows_of, vertical_acceleration
from ovines.core.system.packed import System


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
def floor_tangents(t: float, y: Floats, at: Floats, system: System, columns: Columns, ds: Floats) -> None:
    """The floor's part: :func:`ovines.core.system.dynamics.floor`."""
    s, q, f = columns.s, columns.q, columns.room.friction
    p, k = system.p, system.k
    grounded = k[P.ON_GROUND] != 0
    moving = (k[P.HOST_KIND] == P.FREE or k[P.HOST_KIND] == P.SPRUNG) and not grounded
    rx, ry = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    turn = 0.0 if grounded else at[S.HOST_SPIN]
    vx, vy, load = at[S.VX], at[S.VY], p[P.FLOOR_LOAD]
    if not grounded:
        vx, vy = vx - at[S.HOST_VX] + turn * ry, vy - at[S.HOST_VY] - turn * rx
        load += vertical_acceleration(t, k, system.drive, system.table)
    wears = 1.0 + p[P.DRIFT_PER_S] * t
    strength = max(p[P.FLOOR_FRICTION] * wears, 0.0) * max(load, 0.0)
    floor_slopes(vx, vy, y[S.SPIN] - turn, p[P.RADIUS], p[P.REGULARISATION], p[P.COUPLING], f)
    mass, per_inertia = p[P.MASS], p[P.MASS] / p[P.INERTIA]
    for j in range(q.shape[1]):
        sx, sy, spin = s[S.VX, j], s[S.VY, j], s[S.SPIN, j]
        if not grounded:
            sx += -s[T.HOST_VX, j] + s[T.HOST_SPIN, j] * ry + turn * (s[S.Y, j] - s[T.HOST_Y, j])
            sy += -s[T.HOST_VY, j] - s[T.HOST_SPIN, j] * rx - turn * (s[S.X, j] - s[T.HOST_X, j])
            spin -= s[T.HOST_SPIN, j]
        stronger = q[Q_FLOOR, j] * max(wears, 0.0) * max(load, 0.0)
        if not grounded and load > 0.0:
            stronger += max(p[P.FLOOR_FRICTION] * wears, 0.0) * load_slope(t, q, j, system)
        radius = q[Q_RADIUS, j]
        ax = strength * (f[3] * sx + f[4] * sy + f[5] * spin + f[6] * radius) + stronger * f[0]
        ay = strength * (f[7] * sx + f[8] * sy + f[9] * spin + f[10] * radius) + stronger * f[1]
        torque = strength * (f[11] * sx + f[12] * sy + f[13] * spin + f[14] * radius) + stronger * f[2]
        ds[S.VX, j] += ax
        ds[S.VY, j] += ay
        changed = q[Q_MASS, j] / p[P.INERTIA] + mass * q[Q_INVERSE_INERTIA, j]
        ds[S.SPIN, j] += torque * per_inertia + strength * f[2] * changed
        if moving:
            heavier = q[Q_MASS, j] * strength
            ds[T.HOST_VX, j] -= (ax * mass + f[0] * heavier) * p[P.INVERSE_HOST_MASS]
            ds[T.HOST_VY, j] -= (ay * mass + f[1] * heavier) * p[P.INVERSE_HOST_MASS]
            arm = (
                rx * ay
                - ry * ax
                + strength * ((s[S.X, j] - s[T.HOST_X, j]) * f[1] - (s[S.Y, j] - s[T.HOST_Y, j]) * f[0])
            )
            whole = f[2] + rx * f[1] - ry * f[0]
            ds[T.HOST_SPIN, j] -= ((torque + arm) * mass + whole * heavier) * p[P.INVERSE_HOST_INERTIA]


@compiled
def flight_tangents(t: float, y: Floats, at: Floats, system: System, columns: Columns, ds: Floats) -> None:
    """Slopes of the tangents without wall force: :func:`ovines.core.system.dynamics.free_accelerations`."""
    p, k = system.p, system.k
    s, q, base = columns.s, columns.q, columns.room.base
    kind = k[P.HOST_KIND]
    moving = kind == P.FREE or kind == P.SPRUNG
    m = q.shape[1]
    for j in range(m):
        ds[S.X, j], ds[S.Y, j], ds[S.ANGLE, j] = s[S.VX, j], s[S.VY, j], s[S.SPIN, j]
        ds[S.VX, j], ds[S.VY, j], ds[S.SPIN, j] = 0.0, 0.0, 0.0
        if moving:
            ds[T.HOST_X, j], ds[T.HOST_Y, j], ds[T.HOST_ANGLE, j] = s[T.HOST_VX, j], s[T.HOST_VY, j], s[T.HOST_SPIN, j]
            ds[T.HOST_VX, j], ds[T.HOST_VY, j], ds[T.HOST_SPIN, j] = 0.0, 0.0, 0.0
    if p[P.VISCOUS_DRAG] != 0.0 or p[P.AIR_DRAG] != 0.0:
        speed = math.hypot(y[S.VX], y[S.VY])
        rate = p[P.VISCOUS_DRAG] + p[P.AIR_DRAG] * speed
        steep = p[P.AIR_DRAG] / speed if speed > 0.0 else 0.0
        for j in range(m):
            along = steep * (y[S.VX] * s[S.VX, j] + y[S.VY] * s[S.VY, j])
            ds[S.VX, j] -= rate * s[S.VX, j] + along * y[S.VX]
            ds[S.VY, j] -= rate * s[S.VY, j] + along * y[S.VY]
    if kind == P.SPRUNG:
        drive_slopes(t, system.drive, base)
        for axis in range(3):
            place, rate = rows_of(axis)
            place_row, rate_row = T.HOST_X + place, T.HOST_X + rate
            inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
            stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
            for j in range(m):
                a, f, phase = q[Q_AMPLITUDE, j], q[Q_FREQUENCY, j], q[Q_PHASE, j]
                ground = base[axis, 0] * a + base[axis, 1] * f + base[axis, 2] * phase
                moving = base[S.RATES + axis, 0] * a + base[S.RATES + axis, 1] * f + base[S.RATES + axis, 2] * phase
                ds[rate_row, j] -= stiffness * (s[place_row, j] - ground) + damping * (s[rate_row, j] - moving)
    if p[P.FLOOR_FRICTION] > 0.0:
        floor_tangents(t, y, at, system, columns, ds)
