"""One step of a centred disk over a floor whose motion is given: the case that nearly every flight is.

Only velocities and spin feed back, and weakly: collocation by sweeps (:mod:`ovines.core.integration.collocation`), with
scalars and rows of numbers only.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled, inlined
from ovines.core.integration.collocation import (
    N_NODES,
    NODES,
    WEIGHTS,
    integrate,
    left_over,
    settle,
    stretch,
    tail,
)
from ovines.core.integration.stepper import step
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives
from ovines.core.system.friction import SATURATED, floor_friction
from ovines.core.system.host import X, Y, Z, table_piece
from ovines.core.system.packed import Contact, System

FLYING = Contact(P.FLIGHT, 0, 0.0)

# Rows of the work array, whose columns are the nodes: slopes of the velocities and of the spin, these themselves, the
# floor (its velocity at the room's origin, its spin, the friction's strength), the centre (above a floor that turns);
# the rates at which friction takes a slip within its regularisation and its spin (1/s), room.
AX, AY, TURN, VX, VY, SPIN, FLOOR_VX, FLOOR_VY, FLOOR_SPIN, STRENGTH, PLACE_X, PLACE_Y = range(1, 13)
DAMPING, SPIN_DAMPING, ROOM = P.SPARE + 1, P.SPARE + 2, P.SPARE + 3
MOST_SWEEPS = 20
SETTLED = 0.3  # of the tolerance: what a sweep may still change
FASTEST = 0.03  # what a sweep leaves of the change before it, at least: a poor guess makes the second look better
FARTHEST = 2.0  # of a step's length: as far as its slopes are a guess
UNSETTLED = 1e3  # error of a step whose sweeps do not settle
NEAR = 0.03  # of a step: a place as near to its start is behind it
CLEAR = 0.5  # of the way to where friction is not smooth, beside the real times: as far as a step goes


class Disk(NamedTuple):
    """Numbers of a run that every stage needs: out of the vectors, so that they stay in registers."""

    gravity_x: float
    gravity_y: float
    friction: float
    load: float
    regularisation: float
    coupling: float
    drift: float
    radius: float
    mass: float
    mass_over_inertia: float
    viscous: float
    air: float
    carried: bool  # by the Host's floor, not by the ground
    turned: bool
    has_table: bool
    drive: Floats
    table: Floats


@inlined
def disk_of(system: System) -> Disk:
    """The numbers of a packed scenario."""
    p, k = system.p, system.k
    return Disk(
        p[P.GRAVITY_X],
        p[P.GRAVITY_Y],
        p[P.FLOOR_FRICTION],
        p[P.FLOOR_LOAD],
        p[P.REGULARISATION],
        p[P.COUPLING],
        p[P.DRIFT_PER_S],
        p[P.RADIUS],
        p[P.MASS],
        p[P.MASS] / p[P.INERTIA],
        p[P.VISCOUS_DRAG],
        p[P.AIR_DRAG],
        k[P.ON_GROUND] == 0,
        k[P.FLOOR_TURNS] != 0,
        k[P.HAS_TABLE] != 0,
        system.drive,
        system.table,
    )


@inlined
def floor_at(t: float, disk: Disk) -> tuple[float, float, float, float]:
    """Velocity that the floor would have at the room's origin, its spin, and the friction's strength (m/s^2):
    coefficient times the load with which the disk presses on it.
    """
    vx, vy, spin, load = 0.0, 0.0, 0.0, disk.load
    host_x, host_y = 0.0, 0.0
    drive, table = disk.drive, disk.table
    rows = drive.shape[0] if disk.carried else 0
    for row in range(rows):
        axis, amplitude, omega = drive[row, P.AXIS], drive[row, P.AMPLITUDE], drive[row, P.OMEGA]
        if omega == 0.0:  # a constant place
            if axis == X:
                host_x += amplitude
            elif axis == Y:
                host_y += amplitude
            continue
        argument = omega * t + drive[row, P.PHASE]
        if axis == Z:
            load -= amplitude * omega * omega * math.sin(argument)
            continue
        rate = amplitude * omega * math.cos(argument)
        place = amplitude * math.sin(argument) if disk.turned else 0.0
        if axis == X:
            vx += rate
            host_x += place
        elif axis == Y:
            vy += rate
            host_y += place
        else:
            spin += rate
    if disk.has_table and disk.carried:
        i = table_piece(t, table)
        s = t - table[i, 0]
        host_x += table[i, 4] + s * (table[i, 3] + s * (table[i, 2] + s * table[i, 1]))
        host_y += table[i, 8] + s * (table[i, 7] + s * (table[i, 6] + s * table[i, 5]))
        vx += table[i, 3] + s * (2.0 * table[i, 2] + 3.0 * s * table[i, 1])
        vy += table[i, 7] + s * (2.0 * table[i, 6] + 3.0 * s * table[i, 5])
        spin += table[i, 11] + s * (2.0 * table[i, 10] + 3.0 * s * table[i, 9])
        load += 2.0 * table[i, 14] + 6.0 * s * table[i, 13]
    if disk.turned and disk.carried:
        vx += spin * host_y
        vy -= spin * host_x
    return vx, vy, spin, max(disk.friction * (1.0 + disk.drift * t), 0.0) * max(load, 0.0)


@inlined
def disk_slope(
    vx: float, vy: float, spin: float, slip_x: float, slip_y: float, slip_spin: float, strength: float, disk: Disk
) -> tuple[float, float, float]:
    """Accelerations of the centre and of the angle."""
    ax, ay, torque = floor_friction(
        slip_x, slip_y, slip_spin, disk.radius, strength, disk.regularisation, disk.coupling
    )
    ax += disk.gravity_x
    ay += disk.gravity_y
    if disk.viscous != 0.0 or disk.air != 0.0:
        rate = disk.viscous + disk.air * math.sqrt(vx * vx + vy * vy)
        ax -= rate * vx
        ay -= rate * vy
    return ax, ay, torque * disk.mass_over_inertia


@compiled
def disk_slopes(t: float, y: Floats, system: System, out: Floats) -> None:
    """Slopes of the state, without its energies, into ``out``."""
    disk = disk_of(system)
    floor_vx, floor_vy, floor_spin, strength = floor_at(t, disk)
    vx, vy, spin = y[S.VX], y[S.VY], y[S.SPIN]
    slip_x, slip_y = vx - floor_vx + floor_spin * y[S.Y], vy - floor_vy - floor_spin * y[S.X]
    ax, ay, turn = disk_slope(vx, vy, spin, slip_x, slip_y, spin - floor_spin, strength, disk)
    out[S.X], out[S.Y], out[S.VX], out[S.VY], out[S.ANGLE], out[S.SPIN] = vx, vy, ax, ay, spin, turn


@inlined
def singular_ahead(start: float, middle: float, end: float) -> float:
    """First place where the parabola through three values at 0, 1/2 and 1 is zero, or how far a step may go beside a
    zero in complex time; infinity where there is none ahead.
    """
    bend, slope = 2.0 * (start - 2.0 * middle + end), 4.0 * middle - 3.0 * start - end
    root = slope * slope - 4.0 * bend * start
    if root < 0.0:
        return CLEAR * math.sqrt(start / bend) if slope * bend < 0.0 else math.inf
    half = -0.5 * (slope + math.copysign(math.sqrt(root), slope))
    one, other = half / bend, start / half
    first, second = min(one, other), max(one, other)
    return first if first > NEAR else (second if second > NEAR else math.inf)


@compiled
def smooth_span(t: float, y: Floats, h: float, system: System, slopes: Floats) -> float:
    """How much of ``h`` (s) a step may take so that friction is smooth inside of it, by the path that the slopes of
    state ``y`` lead to.

    Farkas' functions have a logarithm where the sliding speed passes the rim's, and friction turns over within the
    regularisation's speed: a step that ends there, or well before, needs no second attempt.
    """
    if not system.k[P.PLAIN] or system.p[P.FLOOR_FRICTION] == 0.0:
        return h
    disk = disk_of(system)
    narrow = (0.5 * math.pi * disk.regularisation) ** 2  # tanh's own pole
    slide_0, slide_1, slide_2, rim_0, rim_1, rim_2 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        s = 0.5 * i * h
        floor_vx, floor_vy, floor_spin, _strength = floor_at(t + s, disk)
        x, yy = y[S.VX] + s * slopes[S.VX] - floor_vx, y[S.VY] + s * slopes[S.VY] - floor_vy
        if disk.turned:
            x += floor_spin * (y[S.Y] + s * (y[S.VY] + 0.5 * s * slopes[S.VY]))
            yy -= floor_spin * (y[S.X] + s * (y[S.VX] + 0.5 * s * slopes[S.VX]))
        rim = disk.radius * (y[S.SPIN] + s * slopes[S.SPIN] - floor_spin)
        slide_0, slide_1, slide_2 = slide_1, slide_2, x * x + yy * yy
        rim_0, rim_1, rim_2 = rim_1, rim_2, rim * rim
    part = 1.0
    if disk.coupling > 0.0:
        part = min(part, singular_ahead(slide_0 - rim_0, slide_1 - rim_1, slide_2 - rim_2))
        part = min(part, singular_ahead(slide_0 + rim_0 + narrow, slide_1 + rim_1 + narrow, slide_2 + rim_2 + narrow))
    if disk.coupling < 1.0:
        part = min(part, singular_ahead(slide_0 + narrow, slide_1 + narrow, slide_2 + narrow))
    return part * h


@inlined
def sweep(y: Floats, h: float, disk: Disk, work: Floats) -> tuple[float, bool]:
    """Slopes at the nodes from the velocities there; the largest change (m/s^2), and whether friction damps slips: at
    the mean of its rates along a slip and across it, a spin's by Farkas' torque where either is small.
    """
    change, damped = 0.0, False
    narrow = (SATURATED * disk.regularisation) ** 2
    if disk.turned:
        integrate(work, VX, y[S.X], h, PLACE_X)
        integrate(work, VY, y[S.Y], h, PLACE_Y)
    for i in range(1, N_NODES):
        vx, vy, spin = work[VX, i], work[VY, i], work[SPIN, i]
        slip_x, slip_y, slip_spin = vx - work[FLOOR_VX, i], vy - work[FLOOR_VY, i], spin - work[FLOOR_SPIN, i]
        if disk.turned:
            slip_x += work[FLOOR_SPIN, i] * work[PLACE_Y, i]
            slip_y -= work[FLOOR_SPIN, i] * work[PLACE_X, i]
        ax, ay, turn = disk_slope(vx, vy, spin, slip_x, slip_y, slip_spin, work[STRENGTH, i], disk)
        change = max(change, abs(ax - work[AX, i]), abs(ay - work[AY, i]), disk.radius * abs(turn - work[TURN, i]))
        work[AX, i], work[AY, i], work[TURN, i] = ax, ay, turn
        work[DAMPING, i], work[SPIN_DAMPING, i] = 0.0, 0.0
        slide = slip_x * slip_x + slip_y * slip_y
        rim = (disk.radius * slip_spin) ** 2 if disk.coupling > 0.0 else 0.0
        if slide + rim < narrow:
            ratio = math.sqrt(slide + rim) / disk.regularisation
            smooth = math.tanh(ratio)
            across = smooth / ratio if ratio > 0.0 else 1.0
            rate = 0.5 * work[STRENGTH, i] / disk.regularisation * (across + 1.0 - smooth * smooth)
            turning = disk.coupling * disk.mass_over_inertia * disk.radius * disk.radius
            work[DAMPING, i], work[SPIN_DAMPING, i] = rate, rate * turning * (0.25 if slide > rim else 2.0 / 3.0)
            damped = True
    return change, damped


@compiled
def disk_step(t: float, y: Floats, h: float, known: float, system: System, work: Floats, out: Floats) -> float:
    """Advance ``y`` by ``h`` into ``out``; ``work[0]`` holds the slopes at ``t``.  Returns error over tolerance.

    ``known``: length of the step from the same state that was made last, whose slopes stand in ``work`` and are a good
    guess of these (0: none).
    """
    p, k = system.p, system.k
    disk = disk_of(system)
    for i in range(N_NODES):
        floor = floor_at(t + NODES[i] * h, disk)
        work[FLOOR_VX, i], work[FLOOR_VY, i], work[FLOOR_SPIN, i], work[STRENGTH, i] = floor
    for row, start in ((AX, work[0, 2]), (AY, work[0, 3]), (TURN, work[0, 5])):
        if 0.0 < h <= FARTHEST * known:
            stretch(work, row, h / known, ROOM)
        else:
            for i in range(N_NODES):
                work[row, i] = start
        work[row, 0] = start
    size = max(abs(y[S.VX]), abs(y[S.VY]), disk.radius * abs(y[S.SPIN]))
    allowed = p[P.TOLERANCE] * (p[P.SPEED] + size)
    rest, last = 2.0 * SETTLED * allowed, 0.0
    sweeps, damped = 0, False
    while rest > SETTLED * allowed and sweeps < MOST_SWEEPS:
        if damped:
            settle(work, AX, y[S.VX], h, VX, DAMPING, ROOM)
            settle(work, AY, y[S.VY], h, VY, DAMPING, ROOM)
            settle(work, TURN, y[S.SPIN], h, SPIN, SPIN_DAMPING, ROOM)
        else:
            integrate(work, AX, y[S.VX], h, VX)
            integrate(work, AY, y[S.VY], h, VY)
            integrate(work, TURN, y[S.SPIN], h, SPIN)
        change, damped = sweep(y, h, disk, work)
        change *= h
        rest = change * min(max(change / last, FASTEST), 1.0) if last > 0.0 else change  # what the next one changes
        last = change
        sweeps += 1
    advance(y, h, disk, k[P.STATE_SIZE] > P.ENERGIES, work, out)
    late_x, early_x = tail(work, AX)
    late_y, early_y = tail(work, AY)
    late_spin, early_spin = tail(work, TURN)
    late, early = max(late_x, late_y, disk.radius * late_spin), max(early_x, early_y, disk.radius * early_spin)
    error = left_over(h, late, early) / allowed
    return error if rest <= SETTLED * allowed else max(error, UNSETTLED)


@inlined
def advance(y: Floats, h: float, disk: Disk, energies: bool, work: Floats, out: Floats) -> None:
    """The state after the step from the slopes at its nodes."""
    vx, vy, spin, x, yy, angle = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    sliding, spinning, dragging, working = 0.0, 0.0, 0.0, 0.0
    for i in range(N_NODES):
        weight = h * WEIGHTS[i]
        ax, ay, turn = work[AX, i], work[AY, i], work[TURN, i]
        vx += weight * ax
        vy += weight * ay
        spin += weight * turn
        x += weight * work[VX, i]
        yy += weight * work[VY, i]
        angle += weight * work[SPIN, i]
        if energies:
            own_x, own_y, floor_spin = work[VX, i], work[VY, i], work[FLOOR_SPIN, i]
            floor_vx, floor_vy = work[FLOOR_VX, i], work[FLOOR_VY, i]
            if disk.turned:
                floor_vx -= floor_spin * work[PLACE_Y, i]
                floor_vy += floor_spin * work[PLACE_X, i]
            rate = disk.viscous + disk.air * math.sqrt(own_x * own_x + own_y * own_y)
            fx, fy = ax - disk.gravity_x + rate * own_x, ay - disk.gravity_y + rate * own_y
            torque = turn / disk.mass_over_inertia
            weight *= disk.mass
            sliding -= weight * (fx * (own_x - floor_vx) + fy * (own_y - floor_vy))
            spinning -= weight * torque * (work[SPIN, i] - floor_spin)
            dragging += weight * rate * (own_x * own_x + own_y * own_y)
            working += weight * (fx * floor_vx + fy * floor_vy + torque * floor_spin)
    out[S.X], out[S.Y], out[S.ANGLE] = y[S.X] + x, y[S.Y] + yy, y[S.ANGLE] + angle
    out[S.VX], out[S.VY], out[S.SPIN] = y[S.VX] + vx, y[S.VY] + vy, y[S.SPIN] + spin
    if energies:
        for i in range(P.ENERGIES, P.HOST):
            out[i] = y[i]
        out[P.LOST_SLIDING] += sliding
        out[P.LOST_SPINNING] += spinning
        out[P.LOST_DRAG] += dragging
        out[P.WORK] += working


@compiled
def flight_step(
    t: float,
    y: Floats,
    h: float,
    known: float,
    system: System,
    work: Floats,
    out: Floats,
) -> float:
    """One step of free flight, by the quick way where the disk is centred and the Host's motion given.

    ``known``: as for :func:`disk_step`.
    """
    k = system.k
    if k[P.PLAIN]:
        return disk_step(t, y, h, known, system, work, out)
    return step(t, y, h, FLYING, system, work, out)


@compiled
def flight_slopes(t: float, y: Floats, system: System, work: Floats, out: Floats) -> None:
    """Slopes of the state in free flight."""
    k = system.k
    if k[P.PLAIN]:
        disk_slopes(t, y, system, out)
    else:
        derivatives(t, y, FLYING, system, work[P.SCRATCH], work[P.PLACE], out)
