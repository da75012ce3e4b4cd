"""What columns of a robust regression gain over none: residuals of which some follow something else or nothing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.statistics.robust import RobustFit, at_least_noise, least_squares

Array = NDArray[np.float64]

# A residual beyond this counts as if it were this large: of a thousand impacts none by chance.
CUT_SD = 5.0
# Steps within this share of the coefficients' sds end the fit.
RESTS_SD = 1e-3


def regress(x: Array, y: Array, sd: Array) -> tuple[float, Array, Array, float, float]:
    """Robust weighted regression: gain of the columns after the first over the first alone, as the fall of a sum of
    squares that is cut at 5 sd, in units of the variance that the whole model leaves."""
    first, whole = _robust(x[:, :1], y, sd), _robust(x, y, sd)
    scale = at_least_noise(whole.residual)
    gain = _cut_squares(first.residual / scale) - _cut_squares(whole.residual / scale)
    k, covariance = whole.coefficients[1:], whole.covariance
    significance = float(np.sqrt(max(float(k @ np.linalg.pinv(covariance[1:, 1:], hermitian=True) @ k), 0.0)))
    return gain, k, np.sqrt(np.diag(covariance))[1:], float(np.std(x[:, 1:] @ k)), significance


def _cut_squares(z: Array) -> float:
    return float(np.sum(np.minimum(z**2, CUT_SD**2)))


def _robust(columns: Array, y: Array, sd: Array) -> RobustFit:
    """Reweighted least squares from two starts: where a part of the impacts follows something else (a third of them in
    one sense of slip, say), mean and median lie in different basins."""
    flat = np.zeros(columns.shape[1])
    flat[0] = float(np.median(y))
    mean = np.asarray(np.linalg.lstsq(columns / sd[:, None], y / sd, rcond=None)[0], float)
    fits = [least_squares(columns, y, sd, start, rests_sd=RESTS_SD) for start in (flat, mean)]
    scale = min(at_least_noise(fit.residual) for fit in fits)
    return min(fits, key=lambda fit: _cut_squares(fit.residual / scale))
