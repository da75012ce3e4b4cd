"""Regression of impacts' residuals, of which some follow something else or nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def regress(x: Array, y: Array, sd: Array) -> tuple[float, Array, Array, float, float]:
    """Robust weighted regression: gain of the columns after the first over the first alone, as the fall of a sum of squares that is cut
    at 5 sd, in units of the variance that the whole model leaves."""
    z0, _, _ = _robust(x[:, :1], y, sd)
    z1, c, covariance = _robust(x, y, sd)
    left = _scale(z1)
    gain = _cut_squares(z0 / left) - _cut_squares(z1 / left)
    k = c[1:]
    significance = float(np.sqrt(max(float(k @ np.linalg.pinv(covariance[1:, 1:], hermitian=True) @ k), 0.0)))
    return gain, k, np.sqrt(np.diag(covariance))[1:], float(np.std(x[:, 1:] @ k)), significance


def _scale(z: Array) -> float:
    return max(1.0, 1.4826 * float(np.median(np.abs(z))))


def _cut_squares(z: Array) -> float:
    return float(np.sum(np.minimum(z**2, 25.0)))


def _robust(columns: Array, y: Array, sd: Array) -> tuple[Array, Array, Array]:
    """Standardised residuals (K,), coefficients and covariance by iterated weights, from two starts: where a part of the impacts follows
    something else (a third of them in one sense of slip, say), mean and median lie in different basins."""
    flat = np.zeros(columns.shape[1])
    flat[0] = float(np.median(y))
    mean = np.asarray(np.linalg.lstsq(columns / sd[:, None], y / sd, rcond=None)[0], float)
    fits = [_reweighted(columns, y, sd, c) for c in (flat, mean)]
    left = min(_scale(z) for z, _, _ in fits)
    return min(fits, key=lambda f: _cut_squares(f[0] / left))


def _reweighted(columns: Array, y: Array, sd: Array, c: Array) -> tuple[Array, Array, Array]:
    covariance: Array = np.zeros((len(c), len(c)))
    for _ in range(30):
        z = (y - columns @ c) / sd
        s = _scale(z)
        a = columns / (sd * s * np.sqrt(1 + (z / s / 3) ** 2))[:, None]
        covariance = np.asarray(np.linalg.pinv(a.T @ a, hermitian=True), float)
        last, c = c, covariance @ (a.T @ (y / (sd * s * np.sqrt(1 + (z / s / 3) ** 2))))
        if np.all(np.abs(c - last) < 1e-3 * np.sqrt(np.diag(covariance)) + 1e-12):
            break
    return (y - columns @ c) / sd, c, covariance
