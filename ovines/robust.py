"""Robust scatter: what a few wrong values do not move."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

MEDIAN_TO_SD = 1.482602218505602  # sd of a normal distribution over its median absolute deviation


def _zero(_: ArrayLike, axis: int | None = None) -> float:
    return 0.0


def spread(values: ArrayLike) -> float:
    """Sd of ``values`` (any shape) about their median, from the median of their deviations; NaN among them is left
    out, NaN of none.
    """
    return _deviation(values, np.median)


def residual_sd(residual: ArrayLike) -> float:
    """The same of residuals (any shape), which scatter about zero."""
    return _deviation(residual, _zero)


def _deviation(values: ArrayLike, center: Any) -> float:
    from scipy.stats import median_abs_deviation  # slow to load: a second, which most commands do without

    known = np.asarray(values, float)
    known = known[~np.isnan(known)]
    return float(median_abs_deviation(known, center=center, scale="normal")) if known.size else float("nan")
