"""Solving the two small systems of a disc's fit, and the step that follows: held back where the model is not linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled

Array = NDArray[np.float64]
_SMALL_PX = 2.5  # radius below which JPEG and noise leave the blur open
MIN_BLUR_PX2 = 0.04  # below this the edge is thinner than a pixel and the model's gradient falls between pixels


@compiled
def factor(a: Array, n: int) -> bool:
    """Cholesky factor of the lower triangle, in place; False if not positive definite."""
    for i in range(n):
        for j in range(i):
            s = a[i, j]
            for k in range(j):
                s -= a[i, k] * a[j, k]
            a[i, j] = s / a[j, j]
        s = a[i, i]
        for k in range(i):
            s -= a[i, k] * a[i, k]
        if not s > 0.0:
            return False
        a[i, i] = math.sqrt(s)
    return True


@compiled
def solve(a: Array, b: Array, first: int, n: int) -> None:
    """Solve with the factor of `factor`; the solution replaces b[first:first + n]."""
    for i in range(n):
        s = b[first + i]
        for k in range(i):
            s -= a[i, k] * b[first + k]
        b[first + i] = s / a[i, i]
    for i in range(n - 1, -1, -1):
        s = b[first + i]
        for k in range(i + 1, n):
            s -= a[k, i] * b[first + k]
        b[first + i] = s / a[i, i]


@compiled
def solve_odd(odd: Array, rhs: Array, n_odd: int) -> tuple[float, float]:
    """Solve for position and slopes; with `n_odd` 4 the contrast's own slope stays out of it.

    Returns what that slope, let free, would take off the sum of squares, and by how far [px] it would move the
    centre: the factor is ordered so that it comes last, and the test costs nothing.
    """
    if n_odd == 6:
        solve(odd, rhs, 8, 6)
        return 0.0, 0.0
    free = rhs[8:14].copy()
    for i in range(6):
        s = free[i]
        for k in range(i):
            s -= odd[i, k] * free[k]
        free[i] = s / odd[i, i]
    gain = free[4] ** 2 + free[5] ** 2
    for i in range(5, -1, -1):
        s = free[i]
        for k in range(i + 1, 6):
            s -= odd[k, i] * free[k]
        free[i] = s / odd[i, i]
    rhs[12] = rhs[13] = 0.0
    solve(odd, rhs, 8, 4)
    return gain, math.hypot(free[0] - rhs[8], free[1] - rhs[9])


@compiled
def _most_blur_px2(r: float) -> float:
    """Squared blur of a disc of radius r up to which a fit is one of a disc."""
    return 0.36 * r * r + 1.0


@compiled
def apply_step(p: Array, rhs: Array, r0: float) -> float:
    """Add the step `rhs`, held back where it leaves the model's linear range; length of the centre's step [px]."""
    length = math.sqrt(rhs[8] * rhs[8] + rhs[9] * rhs[9])
    scale = 1.0 if length < 0.35 * r0 else 0.35 * r0 / length
    p[0] += scale * rhs[8]
    p[1] += scale * rhs[9]
    p[8] += rhs[0]
    p[9] += rhs[10]
    p[10] += rhs[11]
    p[11] += rhs[1]
    p[12] += rhs[12]
    p[13] += rhs[13]
    size = max(abs(rhs[2]), abs(rhs[3]), abs(rhs[4])) / max(p[2], p[4])
    shrink = 1.0 if size < 0.3 else 0.3 / size
    for i in range(2, 5):
        p[i] += shrink * rhs[i]
    size = max(abs(rhs[5]), abs(rhs[6]), abs(rhs[7])) / max(p[5], p[7])
    shrink = 1.0 if size < 0.7 else 0.7 / size
    for i in range(5, 8):
        p[i] += shrink * rhs[i]
    p[5] = max(p[5], MIN_BLUR_PX2)
    p[7] = max(p[7], MIN_BLUR_PX2)
    det = p[2] * p[4] - p[3] * p[3]
    if det > _SMALL_PX**-4:
        # Of so small a disc blur and radius say nearly the same: the blur stays where the fit is still believed, the
        # centre is well.
        most = 0.98 * _most_blur_px2(det**-0.25)
        p[5] = min(p[5], most)
        p[7] = min(p[7], most)
    bound = 0.95 * math.sqrt(p[5] * p[7])
    p[6] = min(max(p[6], -bound), bound)
    return length


@compiled
def believable(p: Array, r0: float, start_u: float, start_v: float) -> bool:
    """False once the fit has left what it was started on."""
    det = p[2] * p[4] - p[3] * p[3]
    if not det > 0.0 or p[2] <= 0.0 or p[4] <= 0.0:
        return False
    r = det**-0.25
    moved = math.hypot(p[0] - start_u, p[1] - start_v)
    return 1.5 < r < 2.0 * r0 + 2.0 and r > 0.5 * r0 and moved < 1.5 * r0 and max(p[5], p[7]) < _most_blur_px2(r)
