"""Tangents over one step of the integrator: of a disk in flight by eight columns, of anything else column by column."""

from __future__ import annotations

import math
from typing import NamedTuple

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled, copy_into, inlined
from ovines.core.integration import collocation as C
from ovines.core.integration.disk_step import (
    MOST_SWEEPS,
    SPIN,
    UNSETTLED,
    VX,
    VY,
    Disk,
    disk_of,
    disk_slopes,
    disk_step,
)
from ovines.core.integration.dop853 import ERROR_3, ERROR_5, NODES, STAGES, WEIGHTS
from ovines.core.integration.stepper import step
from ovines.core.sensitivity.columns import (
    Q_AMPLITUDE,
    Q_CONTACT,
    Q_FLOOR,
    Q_FREQUENCY,
    Q_MASS,
    Q_PHASE,
    Q_RADIUS,
)
from ovines.core.sensitivity.contact_slopes import contact_tangents
from ovines.core.sensitivity.flight_slopes import floor_slopes
from ovines.core.sensitivity.tangents import N_ROWS, Columns, Room
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives
from ovines.core.system.host import ROTATION, Z
from ovines.core.system.packed import Contact, System

# rows of the quick tangents' room: at each node slopes, velocities, what numbers force, how velocities feed back; then
# the ways, the slopes' last four coefficients
SLOPES, BASES, FORCED, FEEDS, WAYS, LATE = (*range(0, 4 * C.N_NODES, C.N_NODES), 4 * C.N_NODES, 4 * C.N_NODES + 1)
N_QUICK = LATE + 4
BASIS = BASES + C.N_NODES - 1  # after the step
WHOLE = 0.4  # of a path's step: tangents that allow less begin with a part of it
LITTLE = 1e-3  # of the scenario's speed or length: what a number changes is not resolved finer than relative to this


class Tangents(NamedTuple):
    """The tangents and their room (a column of the state's more than of the numbers', room, too), the slopes of twelve
    stages (12, 12, m), a stage's tangents (12, m); the room of :func:`quick_tangents` (33, 24); three states (3, 19);
    the step that the quick tangents allow where they were last (1,).
    """

    columns: Columns
    slopes: Floats
    stage: Floats
    quick: Floats
    states: Floats
    pace: Floats


@inlined
def allowed(p: Floats) -> float:
    """Error of a step's tangents over their size."""
    return max(1e4 * p[P.TOLERANCE], 1e-11)


@inlined
def blended(e5: float, e3: float) -> float:
    """Error of a step from its squared estimates of orders 5 and 3: Hairer's blend, as for the state."""
    return e5 / math.sqrt(e5 + 0.01 * e3) if e5 > 0.0 else 0.0


@inlined
def carried_slopes(t: float, drive: Floats, out: Floats) -> None:
    """What amplitude factor, frequency factor and phase shift do to the velocity of a Host's floor, along x (three
    numbers of ``out``) and y, and to its vertical acceleration.
    """
    for n in range(9):
        out[n] = 0.0
    for row in range(drive.shape[0]):
        axis, omega = int(drive[row, P.AXIS]), drive[row, P.OMEGA]
        if omega == 0.0 or axis == ROTATION:
            continue
        argument = omega * t + drive[row, P.PHASE]
        sine, cosine = drive[row, P.AMPLITUDE] * math.sin(argument), drive[row, P.AMPLITUDE] * math.cos(argument)
        if axis == Z:
            out[6] -= omega * omega * sine
            out[7] -= omega * omega * (2.0 * sine + omega * t * cosine)
            out[8] -= omega * omega * cosine
        else:
            out[3 * axis] += omega * cosine
            out[3 * axis + 1] += omega * (cosine - omega * t * sine)
            out[3 * axis + 2] -= omega * sine


@inlined
def weighed(h: float, weights: Floats, begin: int, end: int, first: int, into: int, quick: Floats) -> None:
    """``h`` times a weighed sum of rows of ``quick``, the row ``first`` and those ``begin`` to ``end`` after it, into
    row ``into``.

    Four columns at a time: one by one, or row by row, takes three times as long.
    """
    for c in range(0, 24, 4):
        w = weights[0]
        one, two = w * quick[first, c], w * quick[first, c + 1]
        three, four = w * quick[first, c + 2], w * quick[first, c + 3]
        for b in range(begin, end):
            w = weights[b]
            one += w * quick[first + b, c]
            two += w * quick[first + b, c + 1]
            three += w * quick[first + b, c + 2]
            four += w * quick[first + b, c + 3]
        quick[into, c], quick[into, c + 1] = h * one, h * two
        quick[into, c + 2], quick[into, c + 3] = h * three, h * four


@inlined
def quick_node(t: float, node: int, work: Floats, disk: Disk, driven: bool, room: Room, quick: Floats) -> float:
    """What forces the quick tangents' slopes at a node of the path's step, whose velocities stand in ``work``, and how
    velocities feed back: two rows of ``quick``; the size of the feedback (1/s).
    """
    f, shaken = room.friction, room.shaken
    wx, wy, spin, load = work[VX, node], work[VY, node], work[SPIN, node], disk.load
    vx, vy = wx, wy
    if driven:
        carried_slopes(t, disk.drive, shaken)
        load += shaken[6]  # per unit amplitude factor: the motion itself
        vx, vy = vx - shaken[0], vy - shaken[3]
    wears = max(1.0 + disk.drift * t, 0.0)
    friction, load = disk.friction * wears, max(load, 0.0)
    strength = friction * load
    floor_slopes(vx, vy, spin, disk.radius, disk.regularisation, disk.coupling, f)
    around = disk.mass_over_inertia * strength
    feed, forced = FEEDS + node, FORCED + node
    for n in range(3):
        quick[feed, n], quick[feed, 3 + n] = strength * f[3 + n], strength * f[7 + n]
        quick[feed, 6 + n] = around * f[11 + n]
    if disk.viscous != 0.0 or disk.air != 0.0:
        speed = math.sqrt(wx * wx + wy * wy)
        rate = disk.viscous + disk.air * speed
        steep = disk.air / speed if speed > 0.0 else 0.0
        quick[feed, 0] -= rate + steep * wx * wx
        quick[feed, 1] -= steep * wx * wy
        quick[feed, 3] -= steep * wx * wy
        quick[feed, 4] -= rate + steep * wy * wy
    for j in range(24):
        quick[forced, j] = 0.0
    for row in range(3):
        scale = disk.mass_over_inertia if row == 2 else 1.0
        own, a, first = scale * f[row], 3 + 4 * row, 8 * row
        quick[forced, first + 3] = own * wears * load
        quick[forced, first + 7] = scale * strength * f[a + 3]
        if driven:
            steeper = own * friction if load > 0.0 else 0.0
            for n in range(3):
                dragged = scale * strength * (f[a] * shaken[n] + f[a + 1] * shaken[3 + n])
                quick[forced, first + 4 + n] = steeper * shaken[6 + n] - dragged
    quick[forced, 23] -= 2.0 * around * f[2] / disk.radius  # its inertia grows with its radius
    by_x, by_y = abs(quick[feed, 0]) + abs(quick[feed, 3]), abs(quick[feed, 1]) + abs(quick[feed, 4])
    by_spin = (abs(quick[feed, 2]) + abs(quick[feed, 5])) / disk.radius + abs(quick[feed, 8])
    turned = disk.radius * (abs(quick[feed, 6]) + abs(quick[feed, 7]))
    return max(by_x, by_y, by_spin) + turned


@inlined
def quick_sweep(h: float, quick: Floats) -> None:
    """Slopes at the nodes from the tangents there, and these again from the slopes."""
    for i in range(C.N_NODES):
        feed, base = FEEDS + i, BASES + i
        xx, xy, xs = quick[feed, 0], quick[feed, 1], quick[feed, 2]
        yx, yy, ys = quick[feed, 3], quick[feed, 4], quick[feed, 5]
        sx, sy, ss = quick[feed, 6], quick[feed, 7], quick[feed, 8]
        for j in range(8):
            gx, gy, turn = quick[base, j], quick[base, 8 + j], quick[base, 16 + j]
            quick[i, j] = xx * gx + xy * gy + xs * turn + quick[FORCED + i, j]
            quick[i, 8 + j] = yx * gx + yy * gy + ys * turn + quick[FORCED + i, 8 + j]
            quick[i, 16 + j] = sx * gx + sy * gy + ss * turn + quick[FORCED + i, 16 + j]
    for i in range(1, C.N_NODES):
        weighed(h, C.TO_NODES[i], 1, C.N_NODES, SLOPES, BASES + i, quick)
        for row in range(3):
            quick[BASES + i, 9 * row] += 1.0


@inlined
def quick_error(h: float, quick: Floats, p: Floats) -> float:
    """Largest error of a step's columns over what is allowed."""
    worst, radius = 0.0, p[P.RADIUS]
    for m in range(4):
        weighed(1.0, C.TAIL[m], 1, C.N_NODES, SLOPES, LATE + m, quick)
    for j in range(8):
        size = LITTLE * p[P.SPEED] / (radius if j == 7 else 1.0)
        size = max(size, abs(quick[BASIS, j]), abs(quick[BASIS, 8 + j]), radius * abs(quick[BASIS, 16 + j]))
        last, before = 0.0, 0.0
        for row in range(3):
            unit, at = radius if row == 2 else 1.0, 8 * row + j
            before = max(before, unit * abs(quick[LATE, at]), unit * abs(quick[LATE + 1, at]))
            last = max(last, unit * abs(quick[LATE + 2, at]), unit * abs(quick[LATE + 3, at]))
        worst = max(worst, C.left_over(h, last, before) / size)
    return worst / allowed(p)


@compiled
def combine(quick: Floats, s: Floats, q: Floats, begun: Floats) -> None:
    """Tangents after a step from the basis of velocities and spin after it and the ways of it; in place.

    ``begun`` (3 or more, m) is room.  Coefficients are scalars outside of the columns' loop: a slice of an array for
    each column takes most of a step's time.
    """
    m = q.shape[1]
    for j in range(m):
        begun[0, j], begun[1, j], begun[2, j] = s[S.VX, j], s[S.VY, j], s[S.SPIN, j]
    for row in range(3):
        place_row, rate_row, at = (4, 5, 16) if row == 2 else (row, 2 + row, 8 * row)
        for moved in range(2):
            whose = WAYS if moved else BASIS
            by_vx, by_vy, by_spin, by_floor = (
                quick[whose, at], quick[whose, at + 1], quick[whose, at + 2], quick[whose, at + 3]
            )  # fmt: skip
            louder, faster, later, by_radius = (
                quick[whose, at + 4], quick[whose, at + 5], quick[whose, at + 6], quick[whose, at + 7]
            )  # fmt: skip
            target = place_row if moved else rate_row
            for j in range(m):
                change = by_vx * begun[0, j] + by_vy * begun[1, j] + by_spin * begun[2, j] + by_floor * q[Q_FLOOR, j]
                change += louder * q[Q_AMPLITUDE, j] + faster * q[Q_FREQUENCY, j] + later * q[Q_PHASE, j]
                change += by_radius * q[Q_RADIUS, j]
                s[target, j] = s[target, j] + change if moved else change


@compiled
def quick_tangents(t: float, h: float, system: System, work: Floats, tangents: Tangents) -> float:
    """Tangents over the step just made of a centred disk above a floor that does not turn, on the nodes that
    :func:`ovines.core.integration.disk_step.disk_step` left in ``work``.

    Only velocities and spin feed back, so that three columns of their own and one for each number that forces them
    give all: friction, the drive's amplitude, frequency and phase, the disk's radius.  They stand in one row, eight
    for vx, eight for vy, eight for the spin.  Returns the error over what is allowed; above 1 no tangent is changed.
    """
    quick, disk = tangents.quick, disk_of(system)
    s, q, room = tangents.columns.s, tangents.columns.q, tangents.columns.room
    driven = disk.carried and system.k[P.HOST_KIND] == P.DRIVEN
    feedback = 0.0
    for i in range(C.N_NODES):
        feedback = max(feedback, quick_node(t + C.NODES[i] * h, i, work, disk, driven, room, quick))
        for j in range(24):
            quick[BASES + i, j] = 0.0
        for row in range(3):
            quick[BASES + i, 9 * row] = 1.0
    left, sweeps = 1.0, 0  # a sweep leaves of the error what the exponential series leaves after as many terms
    enough = 0.1 * allowed(system.p)
    while left > enough and sweeps < MOST_SWEEPS:
        quick_sweep(h, quick)
        sweeps += 1
        left *= feedback * h / sweeps
    weighed(h, C.WEIGHTS, 1, C.N_NODES, BASES, WAYS, quick)
    worst = quick_error(h, quick, system.p) if left <= enough else UNSETTLED
    if worst <= 1.0:
        combine(quick, s, q, tangents.stage)
    return worst


@compiled
def full_tangents(
    t: float, y: Floats, h: float, contact: Contact, system: System, work: Floats, trial: Floats, tangents: Tangents
) -> float:
    """Tangents over the step just made from ``y`` by twelve slopes, any mode and Host: as :func:`quick_tangents`."""
    p, k = system.p, system.k
    s, q, slopes, stage = tangents.columns.s, tangents.columns.q, tangents.slopes, tangents.stage
    columns = Columns(stage, q, tangents.columns.room)
    m, n = q.shape[1], k[P.STATE_SIZE]
    rows = N_ROWS if k[P.HOST_KIND] == P.FREE or k[P.HOST_KIND] == P.SPRUNG else 6
    for i in range(12):
        for j in range(n):
            total = 0.0
            for b in range(i):
                total += STAGES[i, b] * work[b, j]
            trial[j] = y[j] + h * total
        for row in range(rows):
            for j in range(m):
                stage[row, j] = s[row, j]
            for b in range(i):
                weight = h * STAGES[i, b]
                if weight != 0.0:
                    for j in range(m):
                        stage[row, j] += weight * slopes[b, row, j]
        contact_tangents(t + NODES[i] * h, trial, contact, system, work, columns, slopes[i])
    worst, time = 0.0, p[P.LENGTH] / p[P.SPEED]
    for j in range(m):
        natural = max(
            abs(q[Q_RADIUS, j]) / p[P.RADIUS], abs(q[Q_CONTACT, j]) / p[P.LENGTH], abs(q[Q_MASS, j]) / p[P.MASS]
        )
        for i in range(Q_RADIUS):
            natural = max(natural, abs(q[i, j]))
        size, error = LITTLE * p[P.LENGTH] * natural, 0.0
        for row in range(rows):
            unit = (1.0, 1.0, time, time, p[P.RADIUS], p[P.RADIUS] * time)[row % 6]
            size = max(size, unit * abs(s[row, j]))
            e5, e3 = 0.0, 0.0
            for b in range(12):
                e5 += ERROR_5[b] * slopes[b, row, j]
                e3 += ERROR_3[b] * slopes[b, row, j]
            error = max(error, h * unit * blended(e5 * e5, e3 * e3))
        worst = max(worst, error / (allowed(p) * size)) if size > 0.0 else worst
    if worst > 1.0:
        return worst
    for row in range(rows):
        for b in range(12):
            weight = h * WEIGHTS[b]
            if weight != 0.0:
                for j in range(m):
                    s[row, j] += weight * slopes[b, row, j]
    return worst


@compiled
def step_tangents(
    t: float, y: Floats, h: float, contact: Contact, system: System, work: Floats, tangents: Tangents
) -> None:
    """Tangents over the step just made from ``y``, whose slopes stand in ``work``; in place.

    Friction turns its direction sharply where a slip passes zero, and tangents feel that more than the path does:
    there the step is made again in parts, as large as ``tangents.pace`` found them to be allowed before.
    """
    k = system.k
    plain = contact.mode == P.FLIGHT and k[P.PLAIN] != 0
    quick = plain and k[P.FLOOR_TURNS] == 0 and (k[P.HAS_TABLE] == 0 or k[P.ON_GROUND] != 0)
    part, after, trial = tangents.states[0], tangents.states[1], tangents.states[2]
    copy_into(part, y)
    again = plain and not quick  # what `full_tangents` needs are a Runge-Kutta step's slopes
    done, size, known, growth = 0.0, h, h, 5.0
    if quick and tangents.pace[0] < WHOLE * h:
        size, again = tangents.pace[0], True
    while done < h:
        last = size >= h - done
        size = h - done if last else size
        if quick:
            if again:
                disk_slopes(t + done, part, system, work[0])
                disk_step(t + done, part, size, known, system, work, after)
            error = quick_tangents(t + done, size, system, work, tangents)
        else:
            if again:
                derivatives(t + done, part, contact, system, work[P.SCRATCH], work[P.PLACE], work[0])
                step(t + done, part, size, contact, system, work, after)
            error = full_tangents(t + done, part, size, contact, system, work, trial, tangents)
        again, known = True, size
        if error > 1.0 and size > 1e-4 * h:
            size *= max(0.1, 0.85 * error ** (-0.125))
            tangents.pace[0], growth = size, 1.0  # what made it too long is still ahead
            continue
        next_part = size * min(growth, 0.75 * max(error, 1e-9) ** (-0.125))
        if size >= tangents.pace[0] or not last:  # what is left of a step is no measure of the next
            tangents.pace[0] = next_part
        if last:
            return
        copy_into(part, after)
        done += size
        size, known, growth = next_part, 0.0, 5.0
