"""Energy that passes through a sprung Host's suspension during a closed-form flight."""

from __future__ import annotations

import math

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled
from ovines.core.system import parameters as P
from ovines.core.system.host import ROTATION, base_motion, host_after, host_starts
from ovines.core.system.packed import System

_GAUSS_X, _GAUSS_W = np.polynomial.legendre.leggauss(12)


@compiled
def suspension_work(t0: float, start: float, stop: float, y: Floats, system: System, work: Floats) -> None:
    """Add to the energies in ``y``, the state at ``t0``, the ground's work and the dampers' loss from ``start`` to
    ``stop`` (s after ``t0``).

    Gauss-Legendre on pieces of a quarter of the fastest period: rounding-level for these smooth integrands.
    """
    p, k, drive, table = system.p, system.k, system.drive, system.table
    pieces = math.ceil((stop - start) / p[P.MAX_STEP]) if stop > start else 0
    host, base = work[P.TRIAL], work[P.SCRATCH]
    host_starts(t0, y, system, host)
    for piece in range(pieces):
        width = (stop - start) / pieces
        for node in range(_GAUSS_X.shape[0]):
            at = start + width * (piece + 0.5 * (1.0 + _GAUSS_X[node]))
            host_after(t0, at, y, system, host)
            base_motion(t0 + at, k, drive, table, base)
            for axis in range(ROTATION + 1):
                stretch, stretching = host[axis] - base[axis], host[S.RATES + axis] - base[S.RATES + axis]
                damping = p[P.DAMPING_X + axis]
                force = p[P.STIFFNESS_X + axis] * stretch + damping * stretching
                y[P.LOST_DAMPING] += 0.5 * width * _GAUSS_W[node] * damping * stretching * stretching
                y[P.WORK] -= 0.5 * width * _GAUSS_W[node] * force * base[S.RATES + axis]
