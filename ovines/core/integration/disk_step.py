"""One step of a centred disk over a floor whose motion is given: the case that nearly every flight is.

The general step of :mod:`ovines.core.integration.stepper` hands arrays from function to function, and numba counts
references on each: four times the time of the arithmetic.  Here a stage is scalars only.  Same pair, same error, same
answer to the last digit.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from ovines.core.compiled import Floats, compiled, inlined
from ovines.core.integration.dop853 import NODES, STAGES
from ovines.core.integration.stepper import finish_step, step
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import derivatives
from ovines.core.system.friction import floor_friction
from ovines.core.system.host import X, Y, Z, table_piece
from ovines.core.system.packed import Contact, System

# columns of a row of slopes: those of the state; positions' slopes are velocities
FLYING = Contact(P.FLIGHT, 0, 0.0)


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
def floor_below(t: float, x: float, y: float, disk: Disk) -> tuple[float, float, float, float]:
    """Velocity of the floor under (x, y), its spin, and the load (m/s^2) with which the disk presses on it."""
    vx, vy, spin, load = 0.0, 0.0, 0.0, disk.load
    host_x, host_y = 0.0, 0.0
    drive, table = disk.drive, disk.table
    rows = drive.shape[0] if disk.carried else 0
    for row in range(rows):
        axis, amplitude, omega = drive[row, 0], drive[row, 1], drive[row, 2]
        if omega == 0.0:  # a constant place
            if axis == X:
                host_x += amplitude
            elif axis == Y:
                host_y += amplitude
            continue
        argument = omega * t + drive[row, 3]
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
        vx -= spin * (y - host_y)
        vy += spin * (x - host_x)
    return vx, vy, spin, max(load, 0.0)


@inlined
def disk_slope(
    t: float, x: float, y: float, vx: float, vy: float, spin: float, disk: Disk
) -> tuple[float, float, float, float, float, float, float]:
    """Accelerations of the centre, of the angle, and the powers lost to sliding, to spinning and to drag, and done
    by the driver.
    """
    ax, ay, turn = disk.gravity_x, disk.gravity_y, 0.0
    sliding, spinning, dragging, working = 0.0, 0.0, 0.0, 0.0
    if disk.viscous != 0.0 or disk.air != 0.0:
        square = vx * vx + vy * vy
        rate = disk.viscous + disk.air * math.sqrt(square)
        ax -= rate * vx
        ay -= rate * vy
        dragging = disk.mass * rate * square
    if disk.friction > 0.0:
        floor_vx, floor_vy, floor_spin, load = floor_below(t, x, y, disk)
        strength = max(disk.friction * (1.0 + disk.drift * t), 0.0) * load
        slip_x, slip_y, slip_spin = vx - floor_vx, vy - floor_vy, spin - floor_spin
        fx, fy, torque = floor_friction(
            slip_x, slip_y, slip_spin, disk.radius, strength, disk.regularisation, disk.coupling
        )
        ax += fx
        ay += fy
        turn = torque * disk.mass_over_inertia
        sliding = -disk.mass * (fx * slip_x + fy * slip_y)
        spinning = -disk.mass * torque * slip_spin
        working = disk.mass * (fx * floor_vx + fy * floor_vy + torque * floor_spin)
    return ax, ay, turn, sliding, spinning, dragging, working


@inlined
def keep_powers(sliding: float, spinning: float, dragging: float, working: float, out: Floats) -> None:
    """Powers into the slopes of the energies: in flight over a given floor no wall and no damper takes any."""
    out[P.LOST_NORMAL], out[P.LOST_TANGENT], out[P.LOST_DAMPING] = 0.0, 0.0, 0.0
    out[P.LOST_SLIDING], out[P.LOST_SPINNING], out[P.LOST_DRAG], out[P.WORK] = sliding, spinning, dragging, working


@compiled
def disk_slopes(t: float, y: Floats, system: System, out: Floats) -> None:
    """Slopes of the whole state into ``out``."""
    k = system.k
    ax, ay, turn, sliding, spinning, dragging, working = disk_slope(t, y[0], y[1], y[2], y[3], y[5], disk_of(system))
    out[0], out[1], out[2], out[3], out[4], out[5] = y[2], y[3], ax, ay, y[5], turn
    if k[P.STATE_SIZE] > P.ENERGIES:
        keep_powers(sliding, spinning, dragging, working, out)


@compiled
def disk_step(t: float, y: Floats, h: float, system: System, work: Floats, out: Floats) -> float:
    """Advance ``y`` by ``h`` into ``out``; ``work[0]`` holds the slopes at ``t``.  Returns error over tolerance."""
    p, k = system.p, system.k
    disk = disk_of(system)
    energies, turns = k[P.STATE_SIZE] > P.ENERGIES, disk.turned
    x0, y0, vx0, vy0, spin0 = y[0], y[1], y[2], y[3], y[5]
    for i in range(1, 12):
        x, yy = 0.0, 0.0
        first = STAGES[i, 0]
        vx, vy, spin = first * work[0, 2], first * work[0, 3], first * work[0, 5]
        for m in range(1 if i < 5 else 3, i):  # later stages leave the second and the third out
            a = STAGES[i, m]
            vx += a * work[m, 2]
            vy += a * work[m, 3]
            spin += a * work[m, 5]
        if turns:
            for m in range(i):
                x += STAGES[i, m] * work[m, 0]
                yy += STAGES[i, m] * work[m, 1]
        vx, vy, spin = vx0 + h * vx, vy0 + h * vy, spin0 + h * spin
        ax, ay, turn, sliding, spinning, dragging, working = disk_slope(
            t + NODES[i] * h, x0 + h * x, y0 + h * yy, vx, vy, spin, disk
        )
        work[i, 0], work[i, 1], work[i, 2], work[i, 3], work[i, 4], work[i, 5] = vx, vy, ax, ay, spin, turn
        if energies:
            keep_powers(sliding, spinning, dragging, working, work[i])
    return finish_step(y, h, p, k, work, out)


@compiled
def flight_step(
    t: float,
    y: Floats,
    h: float,
    system: System,
    work: Floats,
    out: Floats,
) -> float:
    """One step of free flight, by the quick way where the disk is centred and the Host's motion given."""
    k = system.k
    if k[P.PLAIN]:
        return disk_step(t, y, h, system, work, out)
    return step(t, y, h, FLYING, system, work, out)


@compiled
def flight_slopes(t: float, y: Floats, system: System, work: Floats, out: Floats) -> None:
    """Slopes of the state in free flight."""
    k = system.k
    if k[P.PLAIN]:
        disk_slopes(t, y, system, out)
    else:
        derivatives(t, y, FLYING, system, work[P.SCRATCH], work[P.PLACE], out)
