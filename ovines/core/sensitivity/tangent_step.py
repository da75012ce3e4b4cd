"""Tangents over one step of the integrator: of a disk in flight by eight columns, of anything else column by column."""

from __future__ import annotations

import math
from typing import NamedTuple

from ovines.core.compiled import Floats, compiled, copy_into, inlined
from ovines.core.integration.disk_step import Disk, disk_of
from ovines.core.integration.dop853 import ERROR_3, ERROR_5, NODES, STAGES, WEIGHTS
from ovines.core.integration.stepper import finish_step, step
from ovines.core.sensitivity.columns import (
    Q_AMPLITUDE,
    Q_CONTACT,
    Q_FLOOR,
    Q_FREQUENCY,
    Q_MASS,
    Q_PHASE,
    Q_RADIUS,
)
from ovines.core.sensitivity.slopes import contact_tangents, floor_slopes
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives
from ovines.core.system.host import ROTATION, Z
from ovines.core.system.packed import Contact, System

N_ROOM = 28
# rows of the quick tangents' room, after the slopes of twelve stages
STAGE_BASIS, BASIS, WAYS, FIFTH, THIRD, N_QUICK = 12, 24, 25, 26, 27, 28
WHOLE = 0.4  # of a path's step: tangents that allow less begin with a part of it
LITTLE = 1e-3  # of the scenario's speed or length: what a number changes is not resolved finer than relative to this


class Tangents(NamedTuple):
    """Tangents of the state (12, m + 1; the last column is room) and of the numbers (13, m), and room: rows of what is
    needed on the way, the slopes of twelve stages (12, 12, m), a stage's tangents (12, m); the room of
    :func:`quick_tangents` (28, 24): slopes and tangents of twelve stages, those at the step's end, the ways, two
    errors; three states (3, 19); the step that the quick tangents allow where they were last (1,).
    """

    s: Floats
    q: Floats
    room: Floats
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
        axis, omega = int(drive[row, 0]), drive[row, 2]
        if omega == 0.0 or axis == ROTATION:
            continue
        argument = omega * t + drive[row, 3]
        sine, cosine = drive[row, 1] * math.sin(argument), drive[row, 1] * math.cos(argument)
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
def stage_velocities(stage: int, h: float, y: Floats, work: Floats) -> None:
    """Velocities and spin of the path at a stage, from the slopes of those before it, into ``work[stage]``."""
    vx, vy, spin = 0.0, 0.0, 0.0
    for m in range(stage):
        a = STAGES[stage, m]
        vx += a * work[m, 2]
        vy += a * work[m, 3]
        spin += a * work[m, 5]
    work[stage, 0], work[stage, 1], work[stage, 4] = y[2] + h * vx, y[3] + h * vy, y[5] + h * spin


@inlined
def quick_stage(
    t: float, stage: int, work: Floats, disk: Disk, driven: bool, again: bool, f: Floats, shaken: Floats, quick: Floats
) -> None:
    """Slopes of the quick tangents at a stage, whose velocities stand in ``work``: a row of ``quick``.

    ``again``: the path's own slopes there are written, too; force and slopes of friction come from one evaluation.
    """
    vx, vy, spin, load = work[stage, 0], work[stage, 1], work[stage, 4], disk.load
    if driven:
        carried_slopes(t, disk.drive, shaken)
        load += shaken[6]  # per unit amplitude factor: the motion itself
        vx, vy = vx - shaken[0], vy - shaken[3]
    wears = max(1.0 + disk.drift * t, 0.0)
    friction, load = disk.friction * wears, max(load, 0.0)
    strength = friction * load
    floor_slopes(vx, vy, spin, disk.radius, disk.regularisation, disk.coupling, f)
    around = disk.mass_over_inertia * strength
    if again:
        work[stage, 2], work[stage, 3] = disk.gravity_x + strength * f[0], disk.gravity_y + strength * f[1]
        work[stage, 5] = around * f[2]
    xx, xy, xs = strength * f[3], strength * f[4], strength * f[5]
    yx, yy, ys = strength * f[7], strength * f[8], strength * f[9]
    sx, sy, ss = around * f[11], around * f[12], around * f[13]
    if disk.viscous != 0.0 or disk.air != 0.0:
        wx, wy = work[stage, 0], work[stage, 1]
        speed = math.sqrt(wx * wx + wy * wy)
        rate = disk.viscous + disk.air * speed
        steep = disk.air / speed if speed > 0.0 else 0.0
        if again:
            work[stage, 2] -= rate * wx
            work[stage, 3] -= rate * wy
        xx, xy = xx - rate - steep * wx * wx, xy - steep * wx * wy
        yx, yy = yx - steep * wx * wy, yy - rate - steep * wy * wy
    basis = STAGE_BASIS + stage
    for j in range(8):
        gx, gy, turn = quick[basis, j], quick[basis, 8 + j], quick[basis, 16 + j]
        quick[stage, j] = xx * gx + xy * gy + xs * turn
        quick[stage, 8 + j] = yx * gx + yy * gy + ys * turn
        quick[stage, 16 + j] = sx * gx + sy * gy + ss * turn
    for row in range(3):
        scale = disk.mass_over_inertia if row == 2 else 1.0
        own, a, first = scale * f[row], 3 + 4 * row, 8 * row
        quick[stage, first + 3] += own * wears * load
        quick[stage, first + 7] += scale * strength * f[a + 3]
        if driven:
            steeper = own * friction if load > 0.0 else 0.0
            for n in range(3):
                dragged = scale * strength * (f[a] * shaken[n] + f[a + 1] * shaken[3 + n])
                quick[stage, first + 4 + n] += steeper * shaken[6 + n] - dragged
    quick[stage, 23] -= 2.0 * around * f[2] / disk.radius  # its inertia grows with its radius


@inlined
def quick_error(h: float, quick: Floats, p: Floats) -> float:
    """Largest error of a step's columns over what is allowed."""
    worst, radius = 0.0, p[P.RADIUS]
    weighed(h, ERROR_5, 5, 12, 0, FIFTH, quick)
    weighed(h, ERROR_3, 5, 12, 0, THIRD, quick)
    for j in range(8):
        size = LITTLE * p[P.SPEED] / (radius if j == 7 else 1.0)
        size = max(size, abs(quick[BASIS, j]), abs(quick[BASIS, 8 + j]), radius * abs(quick[BASIS, 16 + j]))
        e5 = quick[FIFTH, j] ** 2 + quick[FIFTH, 8 + j] ** 2 + (radius * quick[FIFTH, 16 + j]) ** 2
        e3 = quick[THIRD, j] ** 2 + quick[THIRD, 8 + j] ** 2 + (radius * quick[THIRD, 16 + j]) ** 2
        worst = max(worst, blended(e5, e3) / size)
    return worst / allowed(p)


@compiled
def combine(quick: Floats, s: Floats, q: Floats, begun: Floats) -> None:
    """Tangents after a step from the basis of velocities and spin after it and the ways of it; in place.

    ``begun`` (3 or more, m) is room.  Coefficients are scalars outside of the columns' loop: a slice of an array for
    each column takes most of a step's time.
    """
    m = q.shape[1]
    for j in range(m):
        begun[0, j], begun[1, j], begun[2, j] = s[2, j], s[3, j], s[5, j]
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
def quick_tangents(
    t: float, y: Floats, h: float, again: bool, system: System, work: Floats, tangents: Tangents
) -> float:
    """Tangents over a step of a centred disk above a floor that does not turn: what
    :func:`ovines.core.integration.disk_step.disk_step` steps.

    Only velocities and spin feed back, so that three columns of their own and one for each number that forces them
    give all: friction, the drive's amplitude, frequency and phase, the disk's radius.  They stand in one row, eight
    for vx, eight for vy, eight for the spin.  ``again``: the path's step from ``y`` is made here, too; else its slopes
    stand in ``work``.  Returns the error over what is allowed; above 1 no tangent is changed.
    """
    quick, f, shaken, disk = tangents.quick, tangents.room[12], tangents.room[13], disk_of(system)
    driven = disk.carried and system.k[P.HOST_KIND] == P.DRIVEN
    for i in range(12):
        if i == 0:
            quick[STAGE_BASIS, :] = 0.0
        else:  # stages after the fifth leave the second and the third out
            weighed(h, STAGES[i], 1 if i < 5 else 3, i, 0, STAGE_BASIS + i, quick)
        for row in range(3):
            quick[STAGE_BASIS + i, 9 * row] += 1.0
        if again:
            stage_velocities(i, h, y, work)
        quick_stage(t + NODES[i] * h, i, work, disk, driven, again, f, shaken, quick)
    weighed(h, WEIGHTS, 5, 12, 0, BASIS, quick)  # the second to the fifth weigh nothing
    weighed(h, WEIGHTS, 5, 12, STAGE_BASIS, WAYS, quick)
    for row in range(3):
        quick[BASIS, 9 * row] += 1.0
    worst = quick_error(h, quick, system.p)
    if worst <= 1.0:
        combine(quick, tangents.s, tangents.q, tangents.stage)
    return worst


@compiled
def full_tangents(
    t: float, y: Floats, h: float, contact: Contact, system: System, work: Floats, trial: Floats, tangents: Tangents
) -> float:
    """Tangents over the step just made from ``y``, any mode and Host; as :func:`quick_tangents`."""
    p, k = system.p, system.k
    s, q, slopes, stage = tangents.s, tangents.q, tangents.slopes, tangents.stage
    m, n = q.shape[1], k[P.STATE_SIZE]
    rows = 12 if k[P.HOST_KIND] == P.FREE or k[P.HOST_KIND] == P.SPRUNG else 6
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
        contact_tangents(t + NODES[i] * h, trial, contact, system, work, stage, q, tangents.room, slopes[i])
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
    """Tangents over the step just made from ``y``: its twelve slopes stand in ``work``; in place.

    Friction turns its direction sharply where a slip passes zero, and tangents feel that more than the path does:
    there the step is made again in parts, as large as ``tangents.pace`` found them to be allowed before.
    """
    k = system.k
    quick = contact.mode == P.FLIGHT and k[P.PLAIN] != 0 and k[P.FLOOR_TURNS] == 0
    quick = quick and (k[P.HAS_TABLE] == 0 or k[P.ON_GROUND] != 0)
    part, after, trial = tangents.states[0], tangents.states[1], tangents.states[2]
    copy_into(part, y)
    done, size, again = 0.0, h, False
    if quick and tangents.pace[0] < WHOLE * h:
        size, again = tangents.pace[0], True
    while done < h:
        last = size >= h - done
        size = h - done if last else size
        if quick:
            error = quick_tangents(t + done, part, size, again, system, work, tangents)
        else:
            if again:
                derivatives(t + done, part, contact, system, work[P.SCRATCH], work[P.PLACE], work[0])
                step(t + done, part, size, contact, system, work, after)
            error = full_tangents(t + done, part, size, contact, system, work, trial, tangents)
        again = True
        if error > 1.0 and size > 1e-4 * h:
            size *= max(0.1, 0.85 * error ** (-0.125))
            tangents.pace[0] = size
            continue
        next_part = size * min(5.0, 0.75 * max(error, 1e-9) ** (-0.125))
        if size >= tangents.pace[0] or not last:  # what is left of a step is no measure of the next
            tangents.pace[0] = next_part
        if last:
            return
        if quick:
            finish_step(part, size, system.p, k, work, after)
        copy_into(part, after)
        done += size
        size = next_part
