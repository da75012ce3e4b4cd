"""Deviance of the contact law: how much less likely the impacts are with other values of its parameters."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.compiled import compiled, making_arrays
from analysis.contact.law import (
    FEWEST_FOR_OUTLIERS,
    FRICTIONS,
    LEAST_SCATTER,
    OUTLIER_SHARE,
    OUTLIER_SPREAD,
    TANGENTIAL_RESTITUTIONS,
    LawData,
    outlier_share,
)

Array = NDArray[np.float64]

# Ranges of the two parameters: friction of steel on plastic is far below 2; -1 is smooth, 1 full reversal.
FRICTION_RANGE = (0.0, 2.0)
TANGENTIAL_RANGE = (-1.0, 1.0)
# Restitutions lie between 0 and 1: they scatter by no more.
MOST_SCATTER = 0.5
# Far from where a product of a double and one more factor would be none.
TINY = 1e-150
# Golden section.
GOLDEN = 0.6180339887498949


@compiled
def scatter_deviance(scatter: float, residual: Array, variance: Array, size: Array, share: float) -> float:
    """-2 log L of residuals of variance + (scatter size)^2, of which ``share`` are outliers (as
    :func:`analysis.contact.law.fit_restitution`).
    """
    # Logarithms of products: one of each impact's took most of the time of an interval.
    total, product = 0.0, 1.0
    for i in range(len(residual)):
        v, r2 = variance[i] + (scatter * size[i]) ** 2, residual[i] ** 2
        if share > 0.0:
            broad = v + (OUTLIER_SPREAD * size[i]) ** 2
            total += r2 / broad
            likelier = 1 + (1 - share) / share * np.sqrt(broad / v) * np.exp(0.5 * (r2 / broad - r2 / v))
            product *= broad / (likelier * likelier)
        else:
            total += r2 / v
            product *= v
        if not TINY < product < 1 / TINY:
            total += np.log(product)
            product = 1.0
    total += np.log(product)
    return total - 2 * len(residual) * np.log(share) if share > 0.0 else total


@making_arrays
def best_scatter(residual: Array, variance: Array, size: Array, share: float) -> float:
    """Least -2 log L over the scatter: a coarse scan of its logarithm, then golden section."""

    def value(s: float) -> float:
        return scatter_deviance(s, residual, variance, size, share)

    best, at = np.inf, 0
    grid = np.empty(18)
    for k in range(18):
        grid[k] = np.log(LEAST_SCATTER) + k * (np.log(MOST_SCATTER) - np.log(LEAST_SCATTER)) / 17
        f = value(np.exp(grid[k]))
        if f < best:
            best, at = f, k
    low, high = grid[max(at - 1, 0)], grid[min(at + 1, 17)]
    g = GOLDEN
    a, b = high - g * (high - low), low + g * (high - low)
    fa, fb = value(np.exp(a)), value(np.exp(b))
    for _ in range(12):
        if fa < fb:
            high, b, fb = b, a, fa
            a = high - g * (high - low)
            fa = value(np.exp(a))
        else:
            low, a, fa = a, b, fb
            b = low + g * (high - low)
            fb = value(np.exp(b))
    return min(best, fa, fb)


@making_arrays
def _tangential(
    slip: Array,
    normal_impulse: Array,
    impulse: Array,
    variance: Array,
    mobility: Array,
    coupling: Array,
    mu: float,
    beta: float,
) -> float:
    """-2 log L of the tangential impulses; those that slide scatter with the wall friction, those that stick with the
    tangential restitution.

    Each regime has a scatter and outliers of its own: that many impacts stick as the law has it says nothing of those
    that slide.
    """
    n = len(slip)
    residual, size = np.empty(n), np.empty(n)
    slides = np.zeros(n, np.bool_)
    for i in range(n):
        stick = -((1 + beta) * slip[i] + coupling[i] * normal_impulse[i]) / mobility[i]
        slide = mu * normal_impulse[i]
        slides[i] = slide < abs(stick)
        residual[i] = impulse[i] - np.sign(stick) * min(abs(stick), slide)
        size[i] = normal_impulse[i] if slides[i] else abs(slip[i]) / mobility[i]
    total = 0.0
    for regime in range(2):
        at = slides == (regime == 0)
        count = np.count_nonzero(at)
        if count:
            outliers = OUTLIER_SHARE if count >= FEWEST_FOR_OUTLIERS else 0.0
            total += best_scatter(residual[at], variance[at], size[at], outliers)
    return total


def restitution_deviance(data: LawData) -> Callable[[float], float]:
    """-2 log L of a restitution, the scatter chosen best."""
    variance, outliers = data.normal_sd**2, outlier_share(len(data))
    return lambda eps: float(best_scatter(data.after - eps * data.before, variance, data.before, outliers))


def tangential_deviance(data: LawData) -> Callable[[float, float], float]:
    """-2 log L of (wall friction, tangential restitution), the scatters of both chosen best."""
    known = data.slip, data.normal_impulse, data.tangential_impulse, data.tangential_sd**2, data.mobility, data.coupling
    return lambda mu, beta: float(_tangential(*known, float(mu), float(beta)))


def best_tangential(data: LawData, friction: float, beta: float) -> tuple[float, float, float]:
    """Wall friction, tangential restitution and -2 log L where :func:`tangential_deviance` is least.

    From a first guess and a grid of others, for ``min(beta_0, beta_1)`` has local minima.
    """
    cost = tangential_deviance(data)
    starts = sorted([(friction, beta), *product(FRICTIONS, TANGENTIAL_RESTITUTIONS)], key=lambda one: cost(*one))[:3]
    tried = []
    for mu, b in starts:
        simplex = np.array([[mu, b], [1.1 * mu + 1e-3, b], [mu, b + 0.1]])
        options = {"initial_simplex": simplex, "xatol": 1e-7, "fatol": 1e-4, "maxiter": 400}
        tried.append(minimize(lambda x: cost(*x), simplex[0], method="Nelder-Mead", options=options))
    best = min(tried, key=lambda one: one.fun)
    return float(best.x[0]), float(best.x[1]), float(best.fun)
