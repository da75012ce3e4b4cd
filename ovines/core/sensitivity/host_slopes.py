"""Slopes of the Host's motion, of its steady response and of the floor's load over the drive's numbers.

Every function differentiates the one of :mod:`ovines.core.system` that its docstring names, line by line.
"""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled
from ovines.core.sensitivity import tangents as T
from ovines.core.sensitivity.columns import Q_AMPLITUDE, Q_FREQUENCY, Q_PHASE
from ovines.core.sensitivity.tangents import Columns
from ovines.core.system import parameters as P
from ovines.core.system.host import ROTATION, Z, rows_of
from ovines.core.system.packed import System


@compiled
def drive_slopes(t: float, drive: Floats, out: Floats) -> None:
    """What amplitude factor, frequency factor and phase shift (columns) do to :func:`base_motion` (9 rows)."""
    out[:] = 0.0
    for row in range(drive.shape[0]):
        axis, amplitude, omega = int(drive[row, P.AXIS]), drive[row, P.AMPLITUDE], drive[row, P.OMEGA]
        if axis == Z:
            continue
        if omega == 0.0:
            out[axis, 0] += amplitude
            continue
        argument = omega * t + drive[row, P.PHASE]
        sine, cosine = amplitude * math.sin(argument), amplitude * math.cos(argument)
        out[axis, 0] += sine
        out[S.RATES + axis, 0] += omega * cosine
        out[S.SECOND_RATES + axis, 0] -= omega * omega * sine
        out[axis, 1] += omega * t * cosine
        out[S.RATES + axis, 1] += omega * (cosine - omega * t * sine)
        out[S.SECOND_RATES + axis, 1] -= omega * omega * (2.0 * sine + omega * t * cosine)
        out[axis, 2] += cosine
        out[S.RATES + axis, 2] -= omega * sine
        out[S.SECOND_RATES + axis, 2] -= omega * omega * cosine


@compiled
def response_slopes(t: float, p: Floats, drive: Floats, out: Floats) -> None:
    """The same for a sprung Host's steady response (:func:`sprung_response`; 6 rows)."""
    out[:] = 0.0
    for row in range(drive.shape[0]):
        axis, amplitude, omega = int(drive[row, P.AXIS]), drive[row, P.AMPLITUDE], drive[row, P.OMEGA]
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
        argument = omega * t + drive[row, P.PHASE]
        turned = amplitude * complex(math.cos(argument), math.sin(argument))
        by_amplitude, by_frequency = gain * turned, omega * (change + 1j * t * gain) * turned
        by_phase = 1j * gain * turned
        out[axis, 0] += by_amplitude.imag
        out[S.RATES + axis, 0] += omega * by_amplitude.real
        out[axis, 1] += by_frequency.imag
        out[S.RATES + axis, 1] += omega * (by_frequency.real + by_amplitude.real)
        out[axis, 2] += by_phase.imag
        out[S.RATES + axis, 2] += omega * by_phase.real


@compiled
def host_tangents(t: float, system: System, columns: Columns) -> None:
    """A driven Host's rows of the tangents at ``t``, and its accelerations' into the room."""
    s, q, base, turning = columns.s, columns.q, columns.room.base, columns.room.turning
    drive_slopes(t, system.drive, base)
    for j in range(q.shape[1]):
        a, f, phase = q[Q_AMPLITUDE, j], q[Q_FREQUENCY, j], q[Q_PHASE, j]
        for axis in range(3):
            place, rate = rows_of(axis)
            second = S.SECOND_RATES + axis
            s[T.HOST_X + place, j] = base[axis, 0] * a + base[axis, 1] * f + base[axis, 2] * phase
            s[T.HOST_X + rate, j] = (
                base[S.RATES + axis, 0] * a + base[S.RATES + axis, 1] * f + base[S.RATES + axis, 2] * phase
            )
            turning[axis, j] = base[second, 0] * a + base[second, 1] * f + base[second, 2] * phase


@compiled
def load_slope(t: float, q: Floats, j: int, system: System) -> float:
    """What column ``j`` does to the floor's load: the vertical harmonics' part in it."""
    total = 0.0
    drive = system.drive
    for row in range(drive.shape[0]):
        if int(drive[row, P.AXIS]) == Z:
            omega = drive[row, P.OMEGA]
            argument = omega * t + drive[row, P.PHASE]
            sine, cosine = drive[row, P.AMPLITUDE] * math.sin(argument), drive[row, P.AMPLITUDE] * math.cos(argument)
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
