"""Solving the two small systems of a disc's fit, and the step that follows: held back where the model is not linear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.row import (
    CONTRAST,
    CONTRAST_U,
    CONTRAST_V,
    D_CONTRAST,
    D_CONTRAST_U,
    D_CONTRAST_V,
    D_LEVEL,
    D_LEVEL_U,
    D_LEVEL_V,
    D_M11,
    D_M12,
    D_M22,
    D_S11,
    D_S12,
    D_S22,
    D_U,
    D_V,
    FIRST_ODD,
    LEVEL,
    LEVEL_U,
    LEVEL_V,
    M11,
    M22,
    N_ODD,
    N_ODD_SHARED,
    S11,
    S12,
    S22,
    U,
    V,
    determinant,
)

Array = NDArray[np.float64]
SMALL_PX = 2.5  # radius below which JPEG and noise leave the blur open
MIN_BLUR_PX2 = 0.04  # below this the edge is thinner than a pixel and the model's gradient falls between pixels
# A blur wider than this leaves no plateau in the disc's middle: 0.6 radii, and a pixel for the smallest [px^2].
_MOST_BLUR_SHARE2, _MOST_BLUR_PX2 = 0.36, 1.0
_OF_MOST_BLUR = 0.98  # as far as a small disc's blur may go: the fit is still believed
_MOST_CORRELATION = 0.95  # of the blur along the two axes: its matrix stays positive definite
# Parts of the radius, the shape and the blur by which one step may change them: beyond, the model is not linear.
_STEP_RADII, _STEP_SHAPE, _STEP_BLUR = 0.35, 0.3, 0.7
_SMALLEST_PX = 1.5  # radius below which a disc has no edge pixels to speak of
# A fit that ends farther from its start than so many radii, or as large or small, is one of something else.
_STRAYED_RADII, _GROWN, _GROWN_PX, _SHRUNK = 1.5, 2.0, 2.0, 0.5
_ODD_CONTRAST_U, _ODD_CONTRAST_V = D_CONTRAST_U - FIRST_ODD, D_CONTRAST_V - FIRST_ODD
_ODD_U, _ODD_V = D_U - FIRST_ODD, D_V - FIRST_ODD


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
    """Solve for position and slopes; with `n_odd` N_ODD_SHARED the contrast's own slope stays out of it.

    Returns what that slope, let free, would take off the sum of squares, and by how far [px] it would move the
    centre: the factor is ordered so that it comes last, and the test costs nothing.
    """
    if n_odd == N_ODD:
        solve(odd, rhs, FIRST_ODD, N_ODD)
        return 0.0, 0.0
    free = rhs[FIRST_ODD : FIRST_ODD + N_ODD].copy()
    for i in range(N_ODD):
        s = free[i]
        for k in range(i):
            s -= odd[i, k] * free[k]
        free[i] = s / odd[i, i]
    gain = free[_ODD_CONTRAST_U] ** 2 + free[_ODD_CONTRAST_V] ** 2
    for i in range(N_ODD - 1, -1, -1):
        s = free[i]
        for k in range(i + 1, N_ODD):
            s -= odd[k, i] * free[k]
        free[i] = s / odd[i, i]
    rhs[D_CONTRAST_U] = rhs[D_CONTRAST_V] = 0.0
    solve(odd, rhs, FIRST_ODD, N_ODD_SHARED)
    return gain, math.hypot(free[_ODD_U] - rhs[D_U], free[_ODD_V] - rhs[D_V])


@compiled
def _most_blur_px2(r: float) -> float:
    """Squared blur of a disc of radius r up to which a fit is one of a disc."""
    return _MOST_BLUR_SHARE2 * r * r + _MOST_BLUR_PX2


@compiled
def shape_change(p: Array, rhs: Array) -> tuple[float, float]:
    """Largest step of the ellipse's matrix and of the blur's, in parts of their largest diagonal element."""
    shape = max(abs(rhs[D_M11]), abs(rhs[D_M12]), abs(rhs[D_M22])) / max(p[M11], p[M22])
    return shape, max(abs(rhs[D_S11]), abs(rhs[D_S12]), abs(rhs[D_S22])) / max(p[S11], p[S22])


@compiled
def apply_step(p: Array, rhs: Array, r0: float) -> float:
    """Add the step `rhs`, held back where it leaves the model's linear range; length of the centre's step [px]."""
    length = math.sqrt(rhs[D_U] * rhs[D_U] + rhs[D_V] * rhs[D_V])
    scale = 1.0 if length < _STEP_RADII * r0 else _STEP_RADII * r0 / length
    p[U] += scale * rhs[D_U]
    p[V] += scale * rhs[D_V]
    p[LEVEL] += rhs[D_LEVEL]
    p[LEVEL_U] += rhs[D_LEVEL_U]
    p[LEVEL_V] += rhs[D_LEVEL_V]
    p[CONTRAST] += rhs[D_CONTRAST]
    p[CONTRAST_U] += rhs[D_CONTRAST_U]
    p[CONTRAST_V] += rhs[D_CONTRAST_V]
    shape, blur = shape_change(p, rhs)
    shrink = 1.0 if shape < _STEP_SHAPE else _STEP_SHAPE / shape
    for k in range(3):
        p[M11 + k] += shrink * rhs[D_M11 + k]
    shrink = 1.0 if blur < _STEP_BLUR else _STEP_BLUR / blur
    for k in range(3):
        p[S11 + k] += shrink * rhs[D_S11 + k]
    p[S11] = max(p[S11], MIN_BLUR_PX2)
    p[S22] = max(p[S22], MIN_BLUR_PX2)
    det = determinant(p)
    if det > SMALL_PX**-4:
        # Of so small a disc blur and radius say nearly the same: the blur stays where the fit is still believed, the
        # centre is well.
        most = _OF_MOST_BLUR * _most_blur_px2(det**-0.25)
        p[S11] = min(p[S11], most)
        p[S22] = min(p[S22], most)
    bound = _MOST_CORRELATION * math.sqrt(p[S11] * p[S22])
    p[S12] = min(max(p[S12], -bound), bound)
    return length


@compiled
def believable(p: Array, r0: float, start_u: float, start_v: float) -> bool:
    """False once the fit has left what it was started on."""
    det = determinant(p)
    if not det > 0.0 or p[M11] <= 0.0 or p[M22] <= 0.0:
        return False
    r = det**-0.25
    moved = math.hypot(p[U] - start_u, p[V] - start_v)
    as_large = _SMALLEST_PX < r < _GROWN * r0 + _GROWN_PX and r > _SHRUNK * r0
    return as_large and moved < _STRAYED_RADII * r0 and max(p[S11], p[S22]) < _most_blur_px2(r)
