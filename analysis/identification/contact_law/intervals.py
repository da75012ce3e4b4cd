"""90 % intervals of the contact law by profile likelihood; a bound where the likelihood never comes down on one side.

``min(beta_0, beta_1)``: an impact that sticks says nothing of wall friction but that it is larger than it needed; one
that slides says the same of tangential restitution.  The profile of each parameter over the other (and over the
scatter) shows it: it stays flat to the end of the range, and the answer is a bound.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

from analysis.contact.law import (
    LEAST_SCATTER,
    LEAST_SLIP_M_PER_S,
    LawData,
    fit_restitution,
    outlier_share,
    predicted_tangential,
    sticks,
)
from analysis.identification.contact_law.deviance import (
    FRICTION_RANGE,
    MOST_SCATTER,
    TANGENTIAL_RANGE,
    restitution_deviance,
    scatter_deviance,
    tangential_deviance,
)
from analysis.identification.contact_law.interval import LEVEL, Interval, widened
from analysis.statistics.student import NORMAL_90

Array = NDArray[np.float64]
# How far above full reversal the likelihood is asked whether it comes down: nothing turns back more, but impacts that
# stick with beta_0 = 1 do determine it, and only those that slide leave it open.
ABOVE_FULL_REVERSAL = 0.5
# A crossing is looked for in steps that grow by this, then halved so often or to this share of the first step, which is
# a fraction of an sd.
LONGER, BISECTIONS, CROSSED_SHARE = 1.7, 24, 1e-3


def threshold(count: int, unknowns: int) -> float:
    """Rise of -2 log L that bounds a 90 % interval, of ``count`` impacts with the scatter unknown too.

    n log(1 + t^2/(n - p)), exact for a normal error of unknown variance; chi-square's 2.71 for many impacts."""
    free = max(count - unknowns, 1)
    return float(count * np.log1p(stdtrit(free, 0.5 + LEVEL / 2) ** 2 / free))


def minimum(
    cost: Callable[[float], float], low: float, high: float, points: int, rounds: int = 3
) -> tuple[float, float]:
    """Least value on a grid that is refined around its best point (``cost`` may have several minima)."""
    for _ in range(rounds):
        grid = np.linspace(low, high, points)
        values = [cost(float(x)) for x in grid]
        k = int(np.argmin(values))
        best = float(grid[k]), float(values[k])
        low, high = float(grid[max(k - 1, 0)]), float(grid[min(k + 1, points - 1)])
    return best


def crossing(profile: Callable[[float], float], inside: float, limit: float, level: float, first_step: float) -> float:
    """Where ``profile`` rises above ``level`` going from ``inside`` towards ``limit``; NaN when it never does."""
    step, here = first_step, inside
    direction = np.sign(limit - inside)
    if direction == 0:
        return float("nan")
    while True:
        further = here + direction * step
        if (limit - further) * direction <= 0:
            further = limit
        if profile(float(further)) > level:
            break
        if further == limit:
            return float("nan")
        here, step = further, step * LONGER
    outside = float(further)
    for _ in range(BISECTIONS):
        middle = 0.5 * (here + outside)
        if profile(middle) > level:
            outside = middle
        else:
            here = middle
        if abs(outside - here) < CROSSED_SHARE * first_step:
            break
    return 0.5 * (here + outside)


def restitution_interval(data: LawData, value: float, sd: float) -> Interval:
    """Restitution with its 90 % interval, and the sd that goes with it (its width over 3.29); with one impact the
    measured sd alone bounds it."""
    if len(data) < 2:
        half = NORMAL_90 * sd
        return Interval(value, sd, value - half, value + half)
    profile = restitution_deviance(data)
    best, least = minimum(profile, value - 5 * sd, value + 5 * sd, 11)
    level = least + threshold(len(data), 1)
    low, high = (crossing(profile, best, best + side * 50 * sd, level, 0.5 * sd) for side in (-1, 1))
    return Interval(value, (high - low) / (2 * NORMAL_90), low, high)


def scatter_interval(data: LawData, restitution: float) -> Interval:
    """Impact-to-impact scatter of the restitution; ``low`` 0 where none explains the impacts as well.

    By the likelihood restricted to what the restitution's own estimate leaves (Patterson and Thompson 1971): three
    impacts show two scatters."""
    residual, variance, size, outliers = (
        data.after - restitution * data.before,
        data.normal_sd**2,
        data.before,
        outlier_share(len(data)),
    )

    def deviance(scatter: float) -> float:
        restricted = np.log(np.sum(size**2 / (variance + (scatter * size) ** 2)))
        return float(scatter_deviance(scatter, residual, variance, size, outliers) + restricted)

    best, least = minimum(lambda x: deviance(float(np.exp(x))), np.log(LEAST_SCATTER), np.log(MOST_SCATTER), 41)
    value, level = float(np.exp(best)), least + threshold(len(data), 1)
    high = crossing(deviance, value, 1.0, level, 0.1 * value)
    low = 0.0 if deviance(0.0) <= level else crossing(deviance, value, 0.0, level, 0.1 * value)
    return Interval(value, (high - low) / (2 * NORMAL_90), low, high)


def _tangential_threshold(data: LawData, friction: float, beta: float, sliding: bool) -> float:
    """:func:`threshold` as far as the errors' size is read off the impacts that slide (or stick); 2.71 as far as it is
    the measurement's, which is known.
    """
    own = sticks(data, friction, beta) != sliding
    if not np.any(own):
        return float(NORMAL_90**2)
    residual = (data.tangential_impulse - predicted_tangential(data, friction, beta))[own]
    size = data.normal_impulse[own] if sliding else np.abs(data.slip[own]) / data.mobility[own]
    variance, outliers = data.tangential_sd[own] ** 2, outlier_share(len(residual))
    scatters = np.concatenate([[0.0], np.geomspace(LEAST_SCATTER, MOST_SCATTER, 40)])
    scatter = scatters[
        int(np.argmin([scatter_deviance(float(s), residual, variance, size, outliers) for s in scatters]))
    ]
    scattered = (scatter * size) ** 2
    unknown = float(np.mean(scattered / (variance + scattered)))
    return unknown * threshold(len(residual), 1) + (1 - unknown) * NORMAL_90**2


def _unseen_scatter(data: LawData, friction: float, beta: float, sliding: bool) -> float:
    """Error (sd) of the wall friction (``sliding``; else of the tangential restitution) where one impact alone tells
    it: one shows no scatter, so its impulse is as uncertain as those of all are, by the restitution's scatter and by
    what those of the other regime miss the law by.

    A rough wall turns all impulses: one impact that slid among 44 gave a friction of 0.2499 +- 0.0001 for 0.2405
    (rough_wall, seed 907 of ``benchmarks/identification/other_laws.py``)."""
    own = sticks(data, friction, beta) != sliding
    if np.count_nonzero(own) != 1:
        return 0.0
    (restitution,), _, scatter, _ = fit_restitution(data)
    missed = np.abs(data.tangential_impulse - predicted_tangential(data, friction, beta))[~own]
    others = float(np.median(missed / data.normal_impulse[~own])) if len(missed) else 0.0
    share = max(float(scatter / (1 + restitution)), others)
    if sliding:
        return share
    slip = max(float(np.abs(data.slip[own])[0]), LEAST_SLIP_M_PER_S)
    return share * float((data.normal_impulse * data.mobility)[own][0]) / slip


def tangential_intervals(data: LawData, friction: float, beta: float) -> tuple[Interval, Interval]:
    """Wall friction and tangential restitution, each profiled over the other.

    A side on which the profile never rises is left open (NaN), and then there is no value: the data do not determine
    the parameter. The sd is that of the interval (its width over 3.29), and where one impact alone tells a parameter
    it holds the scatter that one cannot show.
    """
    cost = tangential_deviance(data)
    least = cost(friction, beta)
    level, level_beta = (least + _tangential_threshold(data, friction, beta, sliding) for sliding in (True, False))
    width = 0.6 * np.sqrt(np.median(data.tangential_sd**2 + 1e-8) / max(np.sum(data.normal_impulse**2), 1e-9)) + 2e-4
    noise = np.sqrt(np.median(data.tangential_sd**2 + 1e-8) / max(np.sum(data.slip**2), 1e-9))
    width_beta = 0.6 * float(np.median(data.mobility)) * noise + 5e-4

    def over_beta(mu: float) -> float:
        near = minimum(
            lambda b: cost(mu, b), max(beta - 12 * width_beta, -1.0), min(beta + 12 * width_beta, 1.0), 9, 2
        )[1]
        return near if near <= level else min(near, minimum(lambda b: cost(mu, b), *TANGENTIAL_RANGE, 25, 2)[1])

    def over_friction(b: float) -> float:
        near = minimum(lambda m: cost(m, b), max(friction - 12 * width, 0.0), friction + 12 * width, 9, 2)[1]
        return near if near <= level_beta else min(near, minimum(lambda m: cost(m, b), *FRICTION_RANGE, 41, 2)[1])

    first = _interval(over_beta, friction, FRICTION_RANGE, level, width)
    beyond = (TANGENTIAL_RANGE[0], TANGENTIAL_RANGE[1] + ABOVE_FULL_REVERSAL)
    second = _interval(over_friction, beta, beyond, level_beta, width_beta)
    first = widened(first, _unseen_scatter(data, friction, beta, True))
    second = widened(second, _unseen_scatter(data, friction, beta, False))
    most = TANGENTIAL_RANGE[1]
    return first, replace(second, value=min(second.value, most), low=min(second.low, most), high=min(second.high, most))


def _interval(
    profile: Callable[[float], float], value: float, limits: tuple[float, float], level: float, step: float
) -> Interval:
    inside = float(np.clip(value, *limits))
    low = crossing(profile, inside, limits[0], level, step)
    high = crossing(profile, inside, limits[1], level, step)
    closed = np.isfinite(low) and np.isfinite(high)
    return Interval(value if closed else np.nan, (high - low) / (2 * NORMAL_90) if closed else np.nan, low, high)
