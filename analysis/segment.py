"""Where a flight ends: kinks of the path, and stretches of sustained wall contact, before any model is fitted.

A kink is a sudden change of velocity between two frames.  Around each gap between frames a parabola is fitted
with and without a hinge; the significance of the hinge is scanned, the strongest is taken, and the scan is repeated on the pieces, so
that neighbouring impacts a few frames apart do not blur each other.  Positions only: no differentiation of noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled

Array = NDArray[np.float64]

# Frames on each side of a suspected kink: a flight stays a parabola that long.
REACH_FRAMES = 4
# Friction that turns bends a flight away from its parabola by some mm/s over the reach: below a micrometre of noise that
# is significant and still no impact.
SMALLEST_STEP_M_PER_S = 0.04
# Velocity step below which no frame is called smeared: 0.5 m/s over half of 0.4 ms is 0.1 mm, the length of a slow chain's hops.
LEAST_SMEARED_STEP_M_PER_S = 0.5
# A hinge of 6 sd: of 600 frames x 3 coordinates none by chance.  At 800 Hz all of 40 velocity steps of 0.2 m/s were found at 10 um of
# noise, of 0.3 m/s at 15 um, of 0.4 m/s at 20 um; weaker impacts are the chains' (identification_chatter).
SIGNIFICANCE = 6.0


@compiled
def hinge(time: Array, x: Array, y: Array, sd: Array, left: int, right: int, gap: int, reach: int) -> tuple[float, float, float]:
    """Velocity step (x, y) between frames gap and gap + 1 and its significance (in sd), frames left..right only.

    Significance 0 where there are fewer than two frames on a side or no freedom left.  A parabola where six frames or more
    are at hand, a straight line on fewer: over four frames the floor friction bends the path by 4 um only.
    """
    lo, hi = max(left, gap - reach + 1), min(right, gap + reach)
    count = 0
    before = after = 0
    for i in range(lo, hi + 1):
        if np.isfinite(x[i]):
            count += 1
            if i <= gap:
                before += 1
            else:
                after += 1
    if before < 2 or after < 2:
        return 0.0, 0.0, 0.0
    size = 4 if (count >= 7 and before >= 3 and after >= 3) else 3
    # Midway between the frames that were seen: an unseen one says nothing of which side it was on.
    first, last = gap, gap + 1
    while not np.isfinite(x[first]):
        first -= 1
    while not np.isfinite(x[last]):
        last += 1
    origin = 0.5 * (time[first] + time[last])
    scale = time[hi] - time[lo]
    normal = np.zeros((size, size))
    right_x, right_y = np.zeros(size), np.zeros(size)
    row = np.empty(4)
    for i in range(lo, hi + 1):
        if not np.isfinite(x[i]):
            continue
        s = (time[i] - origin) / scale
        row[0], row[1] = 1.0, s
        row[2] = max(0.0, s)
        row[3] = s * s
        w = 1.0 / (sd[i] * sd[i])
        for a in range(size):
            right_x[a] += w * row[a] * x[i]
            right_y[a] += w * row[a] * y[i]
            for b in range(size):
                normal[a, b] += w * row[a] * row[b]
    inverse = np.linalg.inv(normal)
    step_x = 0.0
    step_y = 0.0
    for a in range(size):
        step_x += inverse[2, a] * right_x[a]
        step_y += inverse[2, a] * right_y[a]
    return step_x / scale, step_y / scale, np.sqrt((step_x * step_x + step_y * step_y) / inverse[2, 2])


@compiled
def find_kinks(time: Array, x: Array, y: Array, sd: Array, left: int, right: int, significance: float, reach: int) -> Array:
    """Gaps (i between frames i and i + 1) of frames left..right at which the velocity jumps: rows (gap, step x, step y, sd's)."""
    found = np.zeros((right - left + 1, 4))
    number = 0
    edges = np.zeros(right - left + 3, np.int64)
    edges[0], edges[1] = left - 1, right
    pieces = 2
    scores = np.zeros((right - left + 1, 3))
    stale = np.ones(right - left + 1, np.bool_)
    while number < right - left:
        best, where = significance, -1
        for e in range(pieces - 1):
            first, last = edges[e] + 1, edges[e + 1]
            for gap in range(first, last):
                if stale[gap - left]:
                    a, b, z = hinge(time, x, y, sd, first, last, gap, reach)
                    if a * a + b * b < SMALLEST_STEP_M_PER_S**2:
                        z = 0.0
                    scores[gap - left, 0], scores[gap - left, 1], scores[gap - left, 2] = a, b, z
                    stale[gap - left] = False
                if scores[gap - left, 2] > best:
                    best, where = scores[gap - left, 2], gap
        if where < 0:
            break
        found[number, 0] = where
        found[number, 1:] = scores[where - left]
        number += 1
        position = 1
        while edges[position] < where:
            position += 1
        for e in range(pieces, position, -1):
            edges[e] = edges[e - 1]
        edges[position] = where
        pieces += 1
        for gap in range(max(left, where - 2 * reach), min(right, where + 2 * reach) + 1):
            stale[gap - left] = True
            scores[gap - left, 2] = 0.0
    order = np.argsort(found[:number, 0])
    return found[:number][order]


@dataclass(frozen=True, eq=False)
class Segments:
    """``smeared`` frames were exposed across an impact and belong to neither flight; ``gaps`` (K,) frame indices after which the path kinks; ``contact`` (C, 2) first and last index of sustained contact."""

    gaps: NDArray[np.int64]
    steps_m_per_s: Array
    contact: NDArray[np.int64]
    smeared: NDArray[np.int64]


def find_contact(distance_m: Array, limit_m: Array, at_least: int = 4) -> NDArray[np.int64]:
    """Stretches of at least ``at_least`` frames in a row with ``distance_m >= limit_m`` (a missing frame does not end one)."""
    near = distance_m >= limit_m
    unknown = ~np.isfinite(distance_m)
    stretches, start, last = [], -1, -1
    for i in range(len(distance_m)):
        if near[i]:
            start = i if start < 0 else start
            last = i
        elif not unknown[i]:
            if start >= 0 and np.count_nonzero(near[start:last + 1]) >= at_least:
                stretches.append((start, last))
            start = -1
    if start >= 0 and np.count_nonzero(near[start:last + 1]) >= at_least:
        stretches.append((start, last))
    return np.array(stretches, np.int64).reshape(-1, 2)


def segment(time_s: Array, xy_m: Array, sd_m: Array, distance_m: Array, limit_m: Array) -> Segments:
    """Kinks and contact stretches of one run.

    ``distance_m`` (N,) from the Host's centre, ``limit_m`` (N,) the distance from which a frame counts as at the wall.
    """
    contact = find_contact(distance_m, limit_m)
    x, y = xy_m[:, 0].copy(), xy_m[:, 1].copy()
    if len(time_s) <= 3:
        return Segments(np.zeros(0, np.int64), np.zeros((0, 2)), contact, np.zeros(0, np.int64))
    kinks = find_kinks(time_s, x, y, sd_m, 0, len(time_s) - 1, SIGNIFICANCE, REACH_FRAMES)
    smeared = find_smeared(time_s, x, y, sd_m, kinks)
    if len(smeared):
        x[smeared] = y[smeared] = np.nan
        kinks = find_kinks(time_s, x, y, sd_m, 0, len(time_s) - 1, SIGNIFICANCE, REACH_FRAMES)
    gaps = kinks[:, 0].astype(np.int64)
    # Inside a stretch of contact the wall itself bends the path: those are not impacts.
    inside = np.zeros(len(gaps), bool)
    for first, last in contact:
        inside |= (gaps >= first) & (gaps < last)
    return Segments(gaps[~inside], kinks[~inside, 1:3], contact, smeared)


def find_smeared(time_s: Array, x: Array, y: Array, sd_m: Array, kinks: Array) -> NDArray[np.int64]:
    """Frames exposed across an impact: without the one frame, several kinks within a few frames become a single one.

    Its position is a mean over both flights, up to a quarter of exposure times velocity step off either.  Looked for only where the step is large;
    a chain of slow impacts stays a chain, for no single frame explains it.
    """
    found: list[int] = []
    gaps = kinks[:, 0].astype(np.int64)
    k = 0
    while k < len(gaps):
        last = k
        while last + 1 < len(gaps) and gaps[last + 1] - gaps[last] <= 2:
            last += 1
        total = np.hypot(*kinks[k:last + 1, 1:3].sum(0))
        if last > k and total > LEAST_SMEARED_STEP_M_PER_S:
            found += _one_frame(time_s, x, y, sd_m, int(gaps[k]), int(gaps[last]))
        k = last + 1
    return np.array(found, np.int64)


def _one_frame(time_s: Array, x: Array, y: Array, sd_m: Array, first: int, last: int) -> list[int]:
    """The frame of first..last + 1 without which one kink is left within the reach, or none."""
    lo, hi = max(0, first - 2 * REACH_FRAMES), min(len(x) - 1, last + 1 + 2 * REACH_FRAMES)
    for frame in range(first, last + 2):
        if not np.isfinite(x[frame]):
            continue
        trial_x, trial_y = x.copy(), y.copy()
        trial_x[frame] = trial_y[frame] = np.nan
        left = find_kinks(time_s, trial_x, trial_y, sd_m, lo, hi, SIGNIFICANCE, REACH_FRAMES)
        near = np.count_nonzero((left[:, 0] >= first - 2) & (left[:, 0] <= last + 2))
        if near == 1:
            return [frame]
    return []
