"""A value with its confidence interval."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from analysis.statistics.student import NORMAL_90

LEVEL = 0.90


@dataclass(frozen=True)
class Interval:
    """``value`` NaN where the data give a bound only; ``low`` or ``high`` NaN on a side that they leave open."""

    value: float
    sd: float
    low: float
    high: float


def widened(interval: Interval, sd: float) -> Interval:
    """``interval`` with a further, independent error ``sd``; bounds stay bounds."""
    if not np.isfinite(interval.value) or not np.isfinite(interval.sd) or not sd > 0:
        return interval
    low, high = (
        interval.value + side * np.hypot(end - interval.value, NORMAL_90 * sd)
        for side, end in ((-1, interval.low), (1, interval.high))
    )
    return Interval(interval.value, float(np.hypot(interval.sd, sd)), float(low), float(high))


def normal_interval(value: float, sd: float) -> Interval:
    """The interval of a normal error."""
    return Interval(float(value), float(sd), float(value - NORMAL_90 * sd), float(value + NORMAL_90 * sd))
