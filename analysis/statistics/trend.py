"""Does a parameter drift over a series (wear, heating)?  A weighted straight line with the tests' own scatter
allowed for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc, stdtr


@dataclass(frozen=True)
class Trend:
    """A weighted mean and slope over ``n`` tests.

    ``mean`` and ``mean_sd`` hold at ``centre`` (weighted mean number of the test); ``slope`` is per test;
    their sd are enlarged by the scatter where the tests scatter more than their own sd (Birge's ratio);
    ``p_slope`` is the two-sided p-value of no trend (Student's t, n - 2 degrees); ``p_scatter`` the p-value
    of the tests agreeing with one value within their sd.
    """

    n: int
    mean: float
    mean_sd: float
    centre: float
    slope: float
    slope_sd: float
    p_slope: float
    p_scatter: float


def weighted_trend(number: ArrayLike, values: ArrayLike, sds: ArrayLike) -> Trend | None:
    """Weighted mean and straight trend of the tests that have both value and sd; None where fewer than two
    have.

    With two tests there is a mean and no trend: slope and its p-value are NaN.
    """
    x, value, sd = np.asarray(number, float), np.asarray(values, float), np.asarray(sds, float)
    good = np.isfinite(value) & np.isfinite(sd) & (sd > 0)
    n = int(good.sum())
    if n < 2:
        return None
    x, value, weight = x[good], value[good], sd[good] ** -2
    mean, centre = float(np.average(value, weights=weight)), float(np.average(x, weights=weight))
    misfit = float(np.sum(weight * (value - mean) ** 2))
    mean_sd = float(weight.sum() ** -0.5) * max(1.0, (misfit / (n - 1)) ** 0.5)
    slope = slope_sd = p_slope = float("nan")
    leverage = float(np.sum(weight * (x - centre) ** 2))
    if n > 2 and leverage > 0:
        slope = float(np.sum(weight * (x - centre) * (value - mean)) / leverage)
        residual = float(np.sum(weight * (value - mean - slope * (x - centre)) ** 2))
        slope_sd = leverage**-0.5 * max(1.0, (residual / (n - 2)) ** 0.5)
        p_slope = float(2 * stdtr(n - 2, -abs(slope) / slope_sd))
    return Trend(n, mean, mean_sd, centre, slope, slope_sd, p_slope, float(chdtrc(n - 1, misfit)))
