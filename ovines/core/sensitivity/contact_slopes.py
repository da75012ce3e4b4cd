"""Slopes of tangents along a wall: what they do to the contact's geometry and forces, sliding or rolling.

Columns as in :mod:`ovines.core.sensitivity.flight_slopes`.
"""

from __future__ import annotations

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled
from ovines.core.sensitivity import tangents as T
from ovines.core.sensitivity.columns import (
    Q_CONTACT,
    Q_INVERSE_INERTIA,
    Q_INVERSE_MASS,
    Q_OBSTACLE,
    Q_RADIUS,
    Q_WALL_FRICTION,
)
from ovines.core.sensitivity.flight_slopes import flight_tangents
from ovines.core.sensitivity.host_slopes import host_tangents
from ovines.core.sensitivity.tangents import (
    GAP,
    K_NN,
    K_NT,
    K_TT,
    LEVER_N,
    LEVER_T,
    NORMAL,
    RVX,
    RVY,
    SLIPS,
    TURN,
    Columns,
)
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import contact_bias, free_accelerations
from ovines.core.system.kinematics import inverse_mass, levers, normal_here, place, relative_acceleration
from ovines.core.system.packed import Contact, Face, System


@compiled
def geometry_tangents(
    wall: int, face: Face, spin: float, at: Floats, p: Floats, s: Floats, q: Floats, g: Floats
) -> None:
    """What the tangents do to the contact: :func:`contact_frame`, :func:`contact_velocity`, :func:`inverse_mass`.

    ``s`` may have one column more than ``q``: the flow itself, so that its column holds rates.
    """
    nx, ny, bent = face.x, face.y, face.curvature
    radius, turn = p[P.RADIUS], at[S.HOST_SPIN]
    rx, ry = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    vx, vy = at[S.VX] - at[S.HOST_VX] + turn * ry, at[S.VY] - at[S.HOST_VY] - turn * rx
    rn, rt = rx * nx + ry * ny, ry * nx - rx * ny
    vn, vt = vx * nx + vy * ny, vy * nx - vx * ny
    _nes_n, _nes_t, host_n, host_t = levers(face, at, p)
    nes, host = 1.0 / p[P.INERTIA], p[P.INVERSE_HOST_INERTIA]
    for j in range(s.shape[1]):
        own = j < q.shape[1]
        larger = q[Q_RADIUS, j] if own else 0.0
        dx, dy = s[S.X, j] - s[T.HOST_X, j], s[S.Y, j] - s[T.HOST_Y, j]
        dn, dt = dx * nx + dy * ny, dy * nx - dx * ny
        angle = s[T.HOST_ANGLE, j] * (1.0 - bent * rn) + bent * dt
        room = 0.0
        if own:
            room = q[Q_CONTACT, j] if wall == P.ROUND else (-q[Q_OBSTACLE, j] if wall == P.OBSTACLE else -larger)
        dvx = s[S.VX, j] - s[T.HOST_VX, j] + s[T.HOST_SPIN, j] * ry + turn * dy
        dvy = s[S.VY, j] - s[T.HOST_VY, j] - s[T.HOST_SPIN, j] * rx - turn * dx
        g[TURN, j], g[GAP, j] = angle, room - dn - s[T.HOST_ANGLE, j] * rt
        g[RVX, j], g[RVY, j] = dvx, dvy
        g[NORMAL, j] = dvx * nx + dvy * ny + vt * angle
        g[SLIPS, j] = (
            dvy * nx - dvx * ny - vn * angle + larger * (spin - turn) + radius * (s[S.SPIN, j] - s[T.HOST_SPIN, j])
        )
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
def push_tangents(face: Face, at: Floats, p: Floats, columns: Columns, out: Floats) -> None:
    """Add what the tangents of the contact's forces (normal, tangential), both in the room, do to ``out`` (12, m)."""
    q, g, forces, d_forces = columns.q, columns.room.geometry, columns.room.forces, columns.room.d_forces
    nx, ny = face.x, face.y
    normal, along = forces[0], forces[1]
    fx, fy = normal * nx - along * ny, normal * ny + along * nx
    _nes_n, _nes_t, host_n, host_t = levers(face, at, p)
    radius = p[P.RADIUS]
    for j in range(q.shape[1]):
        dn, dt, angle = d_forces[0, j], d_forces[1, j], g[TURN, j]
        dfx, dfy = dn * nx - dt * ny - fy * angle, dn * ny + dt * nx + fx * angle
        out[S.VX, j] += dfx / p[P.MASS] + fx * q[Q_INVERSE_MASS, j]
        out[S.VY, j] += dfy / p[P.MASS] + fy * q[Q_INVERSE_MASS, j]
        out[S.SPIN, j] += (q[Q_RADIUS, j] * along + radius * dt) / p[P.INERTIA] + radius * along * q[
            Q_INVERSE_INERTIA, j
        ]
        if p[P.INVERSE_HOST_MASS] > 0.0:
            out[T.HOST_VX, j] -= dfx * p[P.INVERSE_HOST_MASS]
            out[T.HOST_VY, j] -= dfy * p[P.INVERSE_HOST_MASS]
            turned = g[LEVER_N, j] * along + host_n * dt - g[LEVER_T, j] * normal - host_t * dn
            out[T.HOST_SPIN, j] -= turned * p[P.INVERSE_HOST_INERTIA]


@compiled
def contact_tangents(
    t: float, y: Floats, contact: Contact, system: System, work: Floats, columns: Columns, ds: Floats
) -> None:
    """Slopes of the tangents in flight, or sliding or rolling along a wall: :func:`derivatives`.

    A driven Host's rows of the tangents are filled.
    """
    p, k = system.p, system.k
    scratch, at, free = work[P.SCRATCH], work[P.PLACE], work[P.SPARE]
    s, q, room = columns.s, columns.q, columns.room
    turning, g, forces, d_forces = room.turning, room.geometry, room.forces, room.d_forces
    kind = k[P.HOST_KIND]
    m = q.shape[1]
    place(t, y, system, scratch, at)
    if kind == P.DRIVEN:
        host_tangents(t, system, columns)
    flight_tangents(t, y, at, system, columns, ds)
    if contact.mode == P.FLIGHT:
        return
    free_accelerations(t, y, at, system, scratch, free)
    face = normal_here(contact.wall, at, p, k, system.polygon)
    bias_n, bias_t = contact_bias(y, at, face, free, p, k, scratch)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    ax, ay, alpha = relative_acceleration(y, at, free, k, scratch)
    geometry_tangents(contact.wall, face, y[S.SPIN], at, p, s[:, :m], q, g)
    nx, ny, bent, spin, radius = face.x, face.y, face.curvature, at[S.HOST_SPIN], p[P.RADIUS]
    rx, ry = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    vx, vy = at[S.VX] - at[S.HOST_VX] + spin * ry, at[S.VY] - at[S.HOST_VY] - spin * rx
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
        dax, day, dalpha = ds[S.VX, j], ds[S.VY, j], 0.0
        if kind == P.DRIVEN:
            dax, day, dalpha = dax - turning[0, j], day - turning[1, j], turning[2, j]
        elif kind != P.FIXED:
            dax, day, dalpha = dax - ds[T.HOST_VX, j], day - ds[T.HOST_VY, j], ds[T.HOST_SPIN, j]
        dx, dy, dspin = s[S.X, j] - s[T.HOST_X, j], s[S.Y, j] - s[T.HOST_Y, j], s[T.HOST_SPIN, j]
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
        d_t = day * nx - dax * ny - (ax * nx + ay * ny) * angle + q[Q_RADIUS, j] * (free[S.SPIN] - alpha)
        d_t += radius * (ds[S.SPIN, j] - dalpha) - dalpha * rn - alpha * (dn + rt * angle)
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
    push_tangents(face, at, p, columns, ds)
