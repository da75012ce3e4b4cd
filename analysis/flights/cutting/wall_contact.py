"""Which frames the disk spends at the wall, and which in hops and rebounds however near to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.kinks import FEWEST_A_SIDE, SIGNIFICANCE, SMALLEST_STEP_M_PER_S

Array = NDArray[np.float64]

# Sustained contact: so many frames in a row, and so long (rig units: an impact of 0.1 m/s stays within CONTACT_MARGIN_M
# of the wall for 3 ms).
FEWEST_IN_CONTACT, LEAST_CONTACT_S = 4, 0.004
# So near to the wall, but in hops: from so many frames of one, whose dip stands out by so many sd and is a tenth of
# CONTACT_MARGIN_M (a disk that rolls on a wall off its place seems to dip by less).  Seen only where frames are fast.
FEWEST_IN_HOP, HOP_SD, LEAST_HOP_M = 6, 6.0, 1.5e-5


def find_contact(gap_m: Array, margin_m: Array | float, at_least: int = FEWEST_IN_CONTACT) -> NDArray[np.int64]:
    """Stretches of at least ``at_least`` frames in a row no farther than ``margin_m`` (one, or one per frame) inside
    the wall (a missing frame does not end one); ``gap_m`` (N,) past it.
    """
    near = gap_m >= -np.asarray(margin_m)
    unknown = ~np.isfinite(gap_m)
    stretches, start, last = [], -1, -1
    for i in range(len(gap_m)):
        if near[i]:
            start = i if start < 0 else start
            last = i
        elif not unknown[i]:
            if start >= 0 and np.count_nonzero(near[start : last + 1]) >= at_least:
                stretches.append((start, last))
            start = -1
    if start >= 0 and np.count_nonzero(near[start : last + 1]) >= at_least:
        stretches.append((start, last))
    return np.array(stretches, np.int64).reshape(-1, 2)


def find_hops(gap_m: Array, margin_m: Array, sd_m: Array, gaps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which frames (N,) belong to hops near the wall: pieces between kinks at ``gaps`` all of whose frames are within
    ``margin_m`` of it, and whose way past it (``gap_m``) dips as a flight's does.
    """
    found = np.zeros(len(gap_m), bool)
    edges = np.sort(gaps)
    for first, last in zip(edges[:-1] + 1, edges[1:], strict=True):
        index = np.arange(first, last + 1)[np.isfinite(gap_m[first : last + 1])]
        if len(index) < FEWEST_IN_HOP or not np.all(gap_m[index] > -margin_m[index]):
            continue
        along = (2 * index - first - last) / (last - first)
        dip_m = float(np.polyfit(along, gap_m[index], 2)[0])
        # The mean square of a parabola's coefficient over evenly spread frames of unit noise.
        dip_sd_m = float(np.median(sd_m[index])) * np.sqrt(45 / (4 * len(index)))
        found[index] = dip_m > max(HOP_SD * dip_sd_m, LEAST_HOP_M)
    return found


def find_rebounds(time_s: Array, gap_m: Array, sd_m: Array, gaps: NDArray[np.int64], reach: int) -> NDArray[np.bool_]:
    """Which frames (N,) belong to a rebound, however near to the wall: those around a kink at ``gaps`` before which the
    disk approaches the wall (``gap_m`` grows) and after which it leaves, both faster than half of the smallest step and
    beyond doubt.
    """
    found = np.zeros(len(gap_m), bool)
    edges = np.concatenate([[-1], np.sort(gaps), [len(gap_m) - 1]])
    for before, gap, after in zip(edges[:-2], edges[1:-1], edges[2:], strict=True):
        frames = (np.arange(max(before + 1, gap - reach + 1), gap + 1), np.arange(gap + 1, min(after, gap + reach) + 1))
        sides = [side[np.isfinite(gap_m[side])] for side in frames]
        if min(map(len, sides)) < FEWEST_A_SIDE:
            continue
        for side, sign in zip(sides, (1.0, -1.0), strict=True):
            t = time_s[side] - time_s[side].mean()
            speed = sign * float(t @ gap_m[side]) / float(t @ t)
            speed_sd = float(np.median(sd_m[side])) / np.sqrt(float(t @ t))
            if speed < max(0.5 * SMALLEST_STEP_M_PER_S, SIGNIFICANCE * speed_sd):
                break
        else:
            found[np.concatenate(sides)] = True
    return found
