"""Robust scatter, and the weights of robust least squares: what a few wrong values do not move."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

MEDIAN_TO_SD = 1.482602218505602  # sd of a normal distribution over its median absolute deviation
# Tukey's biweight at 4.685 sd keeps 95 % of the efficiency on Gaussian errors (Huber, Robust Statistics, ch. 4).
TUKEY_SD = 4.685
_QUARTILE = 1 / MEDIAN_TO_SD  # of a normal distribution of sd 1
_TINY = 1e-300  # no residual is divided by: its weight is 1 beside any clip


def spread(values: ArrayLike) -> float:
    """Sd of ``values`` (any shape) about their median, from the median of their deviations; NaN among them is left
    out, NaN of none.
    """
    known = _known(values)
    return _sd(known - middle(known)) if known.size else float("nan")


def residual_sd(residual: ArrayLike) -> float:
    """The same of residuals (any shape), which scatter about zero."""
    known = _known(residual)
    return _sd(known) if known.size else float("nan")


def tukey_weight(share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Tukey's biweights of residuals (any shape) over the size at which they drop out; NaN stays NaN."""
    return np.asarray(np.maximum(1 - share**2, 0) ** 2, float)


def huber_weight(residual: NDArray[np.float64], clip: float) -> NDArray[np.float64]:
    """Huber's weights of residuals (any shape), which fall beyond ``clip``."""
    return np.asarray(np.minimum(1.0, clip / np.maximum(np.abs(residual), _TINY)), float)


def huber_loss(residual: NDArray[np.float64], clip: float) -> NDArray[np.float64]:
    """Huber's loss of residuals (any shape): their squares, linear beyond ``clip``."""
    size = np.abs(residual)
    return np.where(size < clip, size**2, 2 * clip * size - clip**2)


def middle(values: NDArray[np.float64]) -> float:
    """Median of ``values`` (N,), N > 0, none of them NaN: of a few dozen numpy's own takes ten times as long."""
    half = len(values) // 2
    if len(values) % 2:
        return float(np.partition(values, half)[half])
    low, high = np.partition(values, (half - 1, half))[half - 1 : half + 1]
    return float(0.5 * (low + high))


def _known(values: ArrayLike) -> NDArray[np.float64]:
    flat = np.asarray(values, float)
    return flat[~np.isnan(flat)]


def _sd(off: NDArray[np.float64]) -> float:
    # As scipy's median_abs_deviation, whose handling of its arguments took a tenth of a diagnosis.
    return middle(np.abs(off)) / _QUARTILE
