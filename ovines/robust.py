"""Robust scatter: what a few wrong values do not move."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

MEDIAN_TO_SD = 1.482602218505602  # sd of a normal distribution over its median absolute deviation
_QUARTILE = 1 / MEDIAN_TO_SD  # of a normal distribution of sd 1


def spread(values: ArrayLike) -> float:
    """Sd of ``values`` (any shape) about their median, from the median of their deviations; NaN among them is left
    out, NaN of none.
    """
    known = _known(values)
    return _sd(known - np.median(known)) if known.size else float("nan")


def residual_sd(residual: ArrayLike) -> float:
    """The same of residuals (any shape), which scatter about zero."""
    known = _known(residual)
    return _sd(known) if known.size else float("nan")


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
