"""Robust scatter: what a few wrong values do not move."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

MEDIAN_TO_SD = 1.482602218505602  # sd of a normal distribution over its median absolute deviation


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


def _known(values: ArrayLike) -> NDArray[np.float64]:
    known = np.asarray(values, float)
    return known[~np.isnan(known)]


def _sd(deviations: NDArray[np.float64]) -> float:
    # scipy.stats.median_abs_deviation gives the same five to ten times as slowly; robust fits ask thousands of times.
    return MEDIAN_TO_SD * float(np.median(np.abs(deviations)))
