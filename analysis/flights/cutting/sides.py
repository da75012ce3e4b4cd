"""On which side of an impact a frame is that lies just beside it.

A kink is placed by the few frames about it, and at one in twenty impacts a frame off: that frame then lies on the path
of the flight beside its own, as a dozen frames of both show, whatever bends them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.kinks import SMOOTH_M_PER_S2

Array = NDArray[np.float64]
# Frames of a flight that say where it is a frame further: within this time of its end (rig units), so many at the most,
# which a parabola follows whatever acts, and so many at least for one.
REACH_S, MOST_FRAMES, FEWEST_FRAMES = 0.015, 12, 4
# A frame is denied by its own flight from here (in one of two hundred series of 200 impacts by chance), and taken by
# the other where it is within this share of that.
DENIED_SD, ACCEPTED_SHARE = 4.5, 0.5


def on_their_sides(time_s: Array, x: Array, y: Array, sd_m: Array, gaps: NDArray[np.int64]) -> NDArray[np.int64]:
    """``gaps`` (K,) of a path x, y (N,), in order, moved by a frame where that frame is off the flight that it counts
    to and on the one beside; ``sd_m`` (N,), NaN where nothing was seen."""
    out = gaps.copy()
    for k, gap in enumerate(gaps):
        first = int(out[k - 1]) + 1 if k else 0
        last = int(gaps[k + 1]) if k + 1 < len(gaps) else len(x) - 1
        before, after = np.arange(first, gap + 1), np.arange(gap + 1, last + 1)
        before, after = before[np.isfinite(x[before])], after[np.isfinite(x[after])]
        for own, other, end in ((before, after, -1), (after, before, 0)):
            if not len(own):
                continue
            at = int(own[end])
            rest = own[own != at]
            if min(len(rest), len(other)) < FEWEST_FRAMES:
                continue
            off_sd = _off_sd(time_s, x, y, sd_m, rest, at)
            if off_sd > DENIED_SD and _off_sd(time_s, x, y, sd_m, other, at) < ACCEPTED_SHARE * off_sd:
                out[k] = int(rest[-1]) if own is before else at
                break
    return out


def _off_sd(time_s: Array, x: Array, y: Array, sd_m: Array, flight: NDArray[np.int64], at: int) -> float:
    """How far frame ``at`` lies off a ``flight`` (frames that were seen) that ends or begins beside it: the larger of x
    and y, in sds of both."""
    near = flight[np.argsort(np.abs(flight - at), kind="stable")[:MOST_FRAMES]]
    near = near[np.abs(time_s[near] - time_s[at]) <= max(REACH_S, np.abs(time_s[near[FEWEST_FRAMES - 1]] - time_s[at]))]
    t = time_s[near] - time_s[at]
    scale = float(np.max(np.abs(t)))
    rows = np.vander(t / scale, 3, increasing=True) / sd_m[near, None]
    prior = np.array([0.0, 0.0, 2 / (SMOOTH_M_PER_S2 * scale**2)])
    covariance = np.linalg.inv(rows.T @ rows + np.diag(prior**2))
    places = np.column_stack([x[near], y[near]]) - [x[at], y[at]]
    there = (covariance @ rows.T @ (places / sd_m[near, None]))[0]
    return float(np.max(np.abs(there)) / np.sqrt(covariance[0, 0] + sd_m[at] ** 2))
