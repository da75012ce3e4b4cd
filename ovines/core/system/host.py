"""Motion of the Host (or of the ground under a sprung Host): harmonics, a measured table, closed-form springs."""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, inlined
from ovines.core.system import parameters as P
from ovines.core.system.packed import System

X, Y, ROTATION, Z = 0, 1, 2, 3  # axes of a drive


@inlined
def rows_of(axis: int) -> tuple[int, int]:
    """Which of a body's six numbers are the place along an axis (or the angle) and its rate."""
    return (S.ANGLE, S.SPIN) if axis == ROTATION else (S.X + axis, S.VX + axis)


@inlined
def base_motion(t: float, k: Ints, drive: Floats, table: Floats, out: Floats) -> None:
    """Driven motion at ``t``: ``out`` = x, y, angle, their rates, their second rates (9 values).

    ``drive`` rows are axis, amplitude, angular frequency, phase of a sine.  ``table`` holds cubic pieces:
    column 0 the knots, then four coefficients (highest power first) for x, y, angle and z.
    """
    for i in range(9):
        out[i] = 0.0
    for row in range(drive.shape[0]):
        axis = int(drive[row, P.AXIS])
        if axis == Z:
            continue
        amplitude, omega = drive[row, P.AMPLITUDE], drive[row, P.OMEGA]
        if omega == 0.0:  # a constant: its sine is in the amplitude already
            out[axis] += amplitude
            continue
        argument = omega * t + drive[row, P.PHASE]
        sine, cosine = math.sin(argument), math.cos(argument)
        out[axis] += amplitude * sine
        out[S.RATES + axis] += amplitude * omega * cosine
        out[S.SECOND_RATES + axis] -= amplitude * omega * omega * sine
    if k[P.HAS_TABLE]:
        i = table_piece(t, table)
        s = t - table[i, 0]
        for axis in range(3):
            c3, c2 = table[i, 1 + 4 * axis], table[i, 2 + 4 * axis]
            c1, c0 = table[i, 3 + 4 * axis], table[i, 4 + 4 * axis]
            out[axis] += c0 + s * (c1 + s * (c2 + s * c3))
            out[S.RATES + axis] += c1 + s * (2.0 * c2 + 3.0 * s * c3)
            out[S.SECOND_RATES + axis] += 2.0 * c2 + 6.0 * s * c3


@compiled
def base_motion_at(t: float, k: Ints, drive: Floats, table: Floats, out: Floats) -> None:
    """:func:`base_motion` for Python: what is inlined would be compiled anew in every process that calls it."""
    base_motion(t, k, drive, table, out)


@compiled
def table_piece(t: float, table: Floats) -> int:
    """Index of the cubic piece that holds ``t`` (the first or last one beyond the ends)."""
    low, high = 0, table.shape[0] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if table[middle, 0] <= t:
            low = middle
        else:
            high = middle - 1
    return low


@inlined
def vertical_acceleration(t: float, k: Ints, drive: Floats, table: Floats) -> float:
    """Host's acceleration along z (m/s^2); it modulates the load on the Host's floor."""
    total = 0.0
    for row in range(drive.shape[0]):
        if int(drive[row, P.AXIS]) == Z:
            omega = drive[row, P.OMEGA]
            total -= drive[row, P.AMPLITUDE] * omega * omega * math.sin(omega * t + drive[row, P.PHASE])
    if k[P.HAS_TABLE]:
        i = table_piece(t, table)
        total += 2.0 * table[i, 14] + 6.0 * (t - table[i, 0]) * table[i, 13]
    return total


@compiled
def vertical_motion(t: float, k: Ints, drive: Floats, table: Floats) -> tuple[float, float]:
    """Host's z and its rate (m, m/s)."""
    z, rate = 0.0, 0.0
    for row in range(drive.shape[0]):
        if int(drive[row, P.AXIS]) == Z:
            argument = drive[row, P.OMEGA] * t + drive[row, P.PHASE] if drive[row, P.OMEGA] > 0.0 else 0.5 * math.pi
            z += drive[row, P.AMPLITUDE] * math.sin(argument)
            rate += drive[row, P.AMPLITUDE] * drive[row, P.OMEGA] * math.cos(argument)
    if k[P.HAS_TABLE]:
        i = table_piece(t, table)
        s = t - table[i, 0]
        z += table[i, 16] + s * (table[i, 15] + s * (table[i, 14] + s * table[i, 13]))
        rate += table[i, 15] + s * (2.0 * table[i, 14] + 3.0 * s * table[i, 13])
    return z, rate


@compiled
def decay(stiffness: float, damping: float, s: float) -> tuple[float, float]:
    """Free solutions S, C of q'' + damping q' + stiffness q = 0 after ``s`` seconds (both per unit mass).

    q = q0 (C + a S) + v0 S and q' = -stiffness q0 S + v0 (C - a S) with a = damping/2; right for weak,
    critical and strong damping and for no spring at all.
    """
    a = 0.5 * damping
    square = stiffness - a * a
    if square > 0.0:
        root = math.sqrt(square)
        envelope = math.exp(-a * s)
        return envelope * math.sin(root * s) / root, envelope * math.cos(root * s)
    root = math.sqrt(-square)
    slow, fast = math.exp((root - a) * s), math.exp(-(root + a) * s)
    if root * s < 1e-6:
        return math.exp(-a * s) * s, 0.5 * (slow + fast)
    return 0.5 * (slow - fast) / root, 0.5 * (slow + fast)


@compiled
def sprung_response(t: float, axis: int, p: Floats, drive: Floats) -> tuple[float, float]:
    """Steady response of a sprung Host's axis to the ground's harmonics: displacement and rate."""
    inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
    stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
    q, rate = 0.0, 0.0
    for row in range(drive.shape[0]):
        if int(drive[row, P.AXIS]) != axis:
            continue
        omega = drive[row, P.OMEGA]
        # (k + i c w) / (k - w^2 + i c w), both per unit mass
        real, imaginary = stiffness - omega * omega, damping * omega
        size = real * real + imaginary * imaginary
        gain = (stiffness * real + imaginary * imaginary) / size
        lag = imaginary * (real - stiffness) / size
        argument = omega * t + drive[row, P.PHASE] if omega > 0.0 else 0.5 * math.pi
        sine, cosine = math.sin(argument), math.cos(argument)
        q += drive[row, P.AMPLITUDE] * (gain * sine + lag * cosine)
        rate += drive[row, P.AMPLITUDE] * omega * (gain * cosine - lag * sine)
    return q, rate


@compiled
def host_starts(t0: float, y0: Floats, system: System, scratch: Floats) -> None:
    """What a sprung Host's free motion starts from at state ``y0``: three places and three rates beside its steady
    response, into ``scratch`` from FREE_PLACES on; needed once for a flight.
    """
    if system.k[P.HOST_KIND] != P.SPRUNG:
        return
    for axis in range(3):
        at, rate_at = rows_of(axis)
        q, rate = sprung_response(t0, axis, system.p, system.drive)
        scratch[S.FREE_PLACES + axis] = y0[P.HOST + at] - q
        scratch[S.FREE_RATES + axis] = y0[P.HOST + rate_at] - rate


@compiled
def host_after(t0: float, s: float, y0: Floats, system: System, out: Floats) -> None:
    """Host state (x, y, angle and rates: first six of ``out``) ``s`` seconds after state ``y0`` at ``t0``, no contact.

    Closed form for a fixed, free, driven and sprung Host; ``out`` has 15 places: the next three are second rates for
    a driven Host and scratch otherwise, the last six what :func:`host_starts` left for ``y0``.
    """
    p, k, drive, table = system.p, system.k, system.drive, system.table
    kind = k[P.HOST_KIND]
    if kind == P.DRIVEN:
        base_motion(t0 + s, k, drive, table, out)
    elif kind == P.FIXED:
        for i in range(9):
            out[i] = 0.0
    elif kind == P.FREE:
        out[S.BASE_X] = y0[P.HOST] + s * y0[P.HOST + S.VX]
        out[S.BASE_Y] = y0[P.HOST + S.Y] + s * y0[P.HOST + S.VY]
        out[S.BASE_ANGLE] = y0[P.HOST + S.ANGLE] + s * y0[P.HOST + S.SPIN]
        out[S.BASE_VX], out[S.BASE_VY] = y0[P.HOST + S.VX], y0[P.HOST + S.VY]
        out[S.BASE_SPIN] = y0[P.HOST + S.SPIN]
    else:
        sine, cosine, last_stiffness, last_damping = 0.0, 1.0, math.nan, math.nan
        for axis in range(3):
            inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
            stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
            q0, v0 = out[S.FREE_PLACES + axis], out[S.FREE_RATES + axis]
            q, rate = sprung_response(t0 + s, axis, p, drive)
            if q0 != 0.0 or v0 != 0.0:
                if stiffness != last_stiffness or damping != last_damping:  # most springs are alike along x and y
                    sine, cosine = decay(stiffness, damping, s)
                    last_stiffness, last_damping = stiffness, damping
                q += q0 * (cosine + 0.5 * damping * sine) + v0 * sine
                rate += v0 * (cosine - 0.5 * damping * sine) - stiffness * q0 * sine
            out[axis], out[S.RATES + axis] = q, rate
