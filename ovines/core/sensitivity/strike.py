"""What an event does to tangents: saltation matrices of impacts and of changes of the mode, exact to first order.

At an event the state's variation at a fixed time, S, becomes that at the moved instant, S + f dt, goes through the
linearised law, and comes back to the fixed time with the flow after: - f' dt.  dt follows from what defines the event.
Sources: Aizerman and Gantmacher (1958); Mueller, Chaos Solitons Fractals 5, 1671 (1995); Leine and Nijmeijer (2004).
"""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled
from ovines.core.sensitivity import tangents as T
from ovines.core.sensitivity.columns import Q_RADIUS, Q_RESTITUTION, Q_REVERSAL, Q_WALL_FRICTION
from ovines.core.sensitivity.contact_slopes import geometry_tangents, push_tangents
from ovines.core.sensitivity.tangents import GAP, K_NN, K_NT, K_TT, NORMAL, SLIPS, TURN, Columns
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives
from ovines.core.system.host import base_motion
from ovines.core.system.impact import effective_restitution, impulses
from ovines.core.system.kinematics import contact_velocity, inverse_mass, normal_here, place
from ovines.core.system.packed import Contact, System

GRAZE = 1e-9  # of the contact radius: an impact that enters a receding wall less deep than this is a graze


@compiled
def flow(t: float, y: Floats, contact: Contact, system: System, work: Floats, out: Floats) -> None:
    """Rates of the twelve rows in a mode, a driven Host's included."""
    slopes = work[P.SPARE]
    derivatives(t, y, contact, system, work[P.SCRATCH], work[P.PLACE], slopes)
    for i in range(6):
        out[i] = slopes[i]
    kind = system.k[P.HOST_KIND]
    for i in range(T.HOST_X, T.N_ROWS):
        out[i] = 0.0
    if kind == P.DRIVEN:
        base = work[P.SCRATCH]
        base_motion(t, system.k, system.drive, system.table, base)
        out[T.HOST_X], out[T.HOST_Y], out[T.HOST_ANGLE] = base[S.BASE_VX], base[S.BASE_VY], base[S.BASE_SPIN]
        out[T.HOST_VX], out[T.HOST_VY], out[T.HOST_SPIN] = base[S.BASE_AX], base[S.BASE_AY], base[S.BASE_SPIN_RATE]
    elif kind != P.FIXED:
        for i in range(6):
            out[T.HOST_X + i] = slopes[P.HOST + i]


@compiled
def restitution_tangent(speed: float, azimuth: float, time: float, p: Floats) -> tuple[float, float, float, float]:
    """Slopes of :func:`effective_restitution` over the constant, speed, azimuth and time; none where it is cut."""
    value, own, by_speed, by_azimuth = p[P.RESTITUTION], 1.0, 0.0, 0.0
    if p[P.RESTITUTION_SPEED] > 0.0:
        fast = p[P.RESTITUTION_FAST]
        own = math.exp(-speed / p[P.RESTITUTION_SPEED])
        by_speed = -(value - fast) * own / p[P.RESTITUTION_SPEED]
        value = fast + (value - fast) * own
    if p[P.RESTITUTION_SWING] != 0.0:
        value += p[P.RESTITUTION_SWING] * math.cos(azimuth - p[P.RESTITUTION_DIRECTION])
        by_azimuth = -p[P.RESTITUTION_SWING] * math.sin(azimuth - p[P.RESTITUTION_DIRECTION])
    of_run = 1.0 + p[P.RESTITUTION_OF_RUN]
    factor = (1.0 + p[P.RESTITUTION_PER_S] * time) * of_run
    if not 0.0 <= value * factor <= 1.0:
        return 0.0, 0.0, 0.0, 0.0
    return own * factor, by_speed * factor, by_azimuth * factor, value * p[P.RESTITUTION_PER_S] * of_run


@compiled
def reach_event(row: int, g: Floats, s: Floats, delay: Floats) -> None:
    """Bring tangents and geometry to the moved instant: row ``row`` of ``g`` must vanish there.

    The last column of ``s`` and ``g`` is the flow.  ``delay`` (m,) gets each column's change of the instant.
    """
    m = delay.shape[0]
    rate = g[row, m]
    for j in range(m):
        delay[j] = -g[row, j] / rate
        for i in range(s.shape[0]):
            s[i, j] += s[i, m] * delay[j]
        for i in range(g.shape[0]):
            g[i, j] += g[i, m] * delay[j]


@compiled
def strike_tangents(
    t: float, y: Floats, wall: int, system: System, work: Floats, columns: Columns, delay: Floats
) -> bool:
    """Tangents through an impact at state ``y`` before it, with the flow before as the last column of the state's.

    The flow after is not taken off yet (:func:`leave_event`).  False where the path grazes the wall.
    """
    p, k = system.p, system.k
    s, q, room = columns.s, columns.q, columns.room
    at, g, forces, d_forces = work[P.PLACE], room.geometry, room.forces, room.d_forces
    place(t, y, system, work[P.SCRATCH], at)
    face = normal_here(wall, at, p, k, system.polygon)
    normal, slip = contact_velocity(face, y[S.SPIN], at, p)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    m = q.shape[1]
    geometry_tangents(wall, face, y[S.SPIN], at, p, s, q, g)
    pull = g[NORMAL, m]
    if normal <= 0.0 or (pull < 0.0 and normal * normal < -2.0 * pull * GRAZE * p[P.LENGTH]):
        return False
    reach_event(GAP, g, s, delay)
    rx, ry = at[S.X] - at[S.HOST_X] + p[P.RADIUS] * face.x, at[S.Y] - at[S.HOST_Y] + p[P.RADIUS] * face.y
    azimuth = math.atan2(ry, rx)
    eps = effective_restitution(normal, azimuth, t, p)
    mu, beta = p[P.WALL_FRICTION], p[P.TANGENTIAL_RESTITUTION]
    forces[0], forces[1], stuck = impulses(normal, slip, k_nn, k_nt, k_tt, eps, mu, beta)
    stuck = stuck and mu > 0.0  # a smooth wall never holds, not even what does not slip
    own, by_speed, by_azimuth, by_time = restitution_tangent(normal, azimuth, t, p)
    determinant = k_nn * k_tt - k_nt * k_nt
    rub = mu if slip > 0.0 else -mu
    for j in range(m):
        dx = s[S.X, j] - s[T.HOST_X, j] - p[P.RADIUS] * face.y * g[TURN, j] + q[Q_RADIUS, j] * face.x
        dy = s[S.Y, j] - s[T.HOST_Y, j] + p[P.RADIUS] * face.x * g[TURN, j] + q[Q_RADIUS, j] * face.y
        turned = (rx * dy - ry * dx) / (rx * rx + ry * ry)
        d_eps = own * q[Q_RESTITUTION, j] + by_speed * g[NORMAL, j] + by_azimuth * turned + by_time * delay[j]
        want_n = -d_eps * normal - (1.0 + eps) * g[NORMAL, j]
        if stuck:
            want_t = -q[Q_REVERSAL, j] * slip - (1.0 + beta) * g[SLIPS, j]
            rest_n = want_n - g[K_NN, j] * forces[0] - g[K_NT, j] * forces[1]
            rest_t = want_t - g[K_NT, j] * forces[0] - g[K_TT, j] * forces[1]
            d_forces[0, j] = (k_tt * rest_n - k_nt * rest_t) / determinant
            d_forces[1, j] = (k_nn * rest_t - k_nt * rest_n) / determinant
        else:
            d_rub = q[Q_WALL_FRICTION, j] if slip > 0.0 else -q[Q_WALL_FRICTION, j]
            change = g[K_NN, j] + d_rub * k_nt + rub * g[K_NT, j]
            d_forces[0, j] = (want_n - forces[0] * change) / (k_nn + rub * k_nt)
            d_forces[1, j] = d_rub * forces[0] + rub * d_forces[0, j]
    push_tangents(face, at, p, columns, s)
    return True


@compiled
def leave_event(
    t: float, y: Floats, contact: Contact, system: System, work: Floats, s: Floats, delay: Floats, after: Floats
) -> None:
    """Bring tangents back from the moved instant to the fixed one with the flow after the event."""
    flow(t, y, contact, system, work, after)
    for j in range(delay.shape[0]):
        for i in range(s.shape[0]):
            s[i, j] -= after[i] * delay[j]


@compiled
def slip_ends_tangents(
    t: float, y: Floats, contact: Contact, system: System, work: Floats, columns: Columns, delay: Floats
) -> None:
    """Bring tangents to the moved instant at which a slip along a wall comes to nothing."""
    s, q, g, rates = columns.s, columns.q, columns.room.geometry, columns.room.flow
    m = q.shape[1]
    flow(t, y, contact, system, work, rates)
    for i in range(s.shape[0]):
        s[i, m] = rates[i]
    at = work[P.PLACE]
    place(t, y, system, work[P.SCRATCH], at)
    face = normal_here(contact.wall, at, system.p, system.k, system.polygon)
    geometry_tangents(contact.wall, face, y[S.SPIN], at, system.p, s, q, g)
    reach_event(SLIPS, g, s, delay)


@compiled
def hold_tangents(t: float, y: Floats, mode: int, wall: int, system: System, work: Floats, columns: Columns) -> None:
    """Tangents onto the wall: neither gap nor normal speed (nor slip where it rolls) change (:func:`stand_on`)."""
    p, k = system.p, system.k
    s, q, room = columns.s, columns.q, columns.room
    at, g, forces, d_forces = work[P.PLACE], room.geometry, room.forces, room.d_forces
    place(t, y, system, work[P.SCRATCH], at)
    face = normal_here(wall, at, p, k, system.polygon)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    m = q.shape[1]
    geometry_tangents(wall, face, y[S.SPIN], at, p, s[:, :m], q, g)
    both = 1.0 / p[P.MASS] + p[P.INVERSE_HOST_MASS]
    for j in range(m):  # the lighter body gives way
        nes, host = g[GAP, j] / (p[P.MASS] * both), g[GAP, j] * p[P.INVERSE_HOST_MASS] / both
        s[S.X, j] += nes * face.x
        s[S.Y, j] += nes * face.y
        s[T.HOST_X, j] -= host * face.x
        s[T.HOST_Y, j] -= host * face.y
    geometry_tangents(wall, face, y[S.SPIN], at, p, s[:, :m], q, g)
    forces[0], forces[1] = 0.0, 0.0
    determinant = k_nn * k_tt - k_nt * k_nt
    for j in range(m):
        if mode == P.ROLL:
            d_forces[0, j] = (k_nt * g[SLIPS, j] - k_tt * g[NORMAL, j]) / determinant
            d_forces[1, j] = (k_nt * g[NORMAL, j] - k_nn * g[SLIPS, j]) / determinant
        else:
            d_forces[0, j], d_forces[1, j] = -g[NORMAL, j] / k_nn, 0.0
    push_tangents(face, at, p, columns, s)
