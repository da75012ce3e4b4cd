"""Kinks of a path: sudden changes of velocity between two frames.

Around each gap between frames a parabola is fitted with and without a hinge; the significance of the hinge is scanned,
the strongest is taken, and the scan is repeated on the pieces, so that neighbouring impacts a few frames apart do not
blur each other.  Positions only: no differentiation of noise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import making_arrays

Array = NDArray[np.float64]

# Frames on each side of a suspected kink: 5 ms (rig units), at least so many that a step and curvature tell apart, at
# most what costs little.
REACH_S, FEWEST_REACH, MOST_REACH = 0.005, 4, 24
# What bends a path without an impact: accelerations of half of gravity (sd; friction of a coefficient of 0.25 has that
# size), which may jump by as much where friction turns, and change all along within 20 ms.  A path of few frames thus
# says no more of a step than it can.
SMOOTH_M_PER_S2, SMOOTH_CHANGES_S = 5.0, 0.02
# The path about a gap: powers of the time from it, those of the whole path first, then those that set in there
# (HINGED): the change of the curvature, and the step itself.
POWERS, HINGED, HIGHEST = (0, 1, 2, 3, 2, 1), (False, False, False, False, True, True), 6
# Slower impacts are left to bounce sequences (analysis.identification.bounce_search); a force that jumps is misplaced
# by a frame and a half at most and makes a step of that, twice over where friction turns.
SMALLEST_STEP_M_PER_S, JUMP_FRAMES = 0.04, 3.0
# Two frames on each side of a kink give its velocities; a run of fewer frames than this has no kink.
FEWEST_A_SIDE, FEWEST_FOR_KINKS = 2, 4
# Whole numbers of frames are whole, however the clock's numbers were rounded (frames).
ROUNDING_FRAMES = 0.1
# A hinge of 6 sd: of 600 frames x 3 coordinates none by chance.  At 800 Hz all of 40 velocity steps of 0.2 m/s were
# found at 10 um of noise, of 0.3 m/s at 15 um, of 0.4 m/s at 20 um; weaker impacts are left to bounce
# sequences.
SIGNIFICANCE = 6.0


@making_arrays
def hinge(
    time: Array, x: Array, y: Array, sd: Array, left: int, right: int, gap: int, reach: int
) -> tuple[float, float, float]:
    """Velocity step (x, y) between frames gap and gap + 1 and its significance (in sd), frames left..right only.

    Significance 0 where there are fewer than two frames on a side.  Besides place, velocity and its step the path may
    be curved, differently on both sides, as far as :data:`SMOOTH_M_PER_S2` makes likely."""
    lo, hi = max(left, gap - reach + 1), min(right, gap + reach)
    before = after = 0
    for i in range(lo, hi + 1):
        if np.isfinite(x[i]):
            if i <= gap:
                before += 1
            else:
                after += 1
    if before < FEWEST_A_SIDE or after < FEWEST_A_SIDE:
        return 0.0, 0.0, 0.0
    # Midway between the frames that were seen: an unseen one says nothing of which side it was on.
    first, last = gap, gap + 1
    while not np.isfinite(x[first]):
        first -= 1
    while not np.isfinite(x[last]):
        last += 1
    origin = 0.5 * (time[first] + time[last])
    scale = time[hi] - time[lo]
    # Sums over the frames, and over those after the gap, of powers of the time from it: alone, with x, with y.
    sums, later = np.zeros((3, HIGHEST + 1)), np.zeros((3, HIGHEST + 1))
    for i in range(lo, hi + 1):
        if not np.isfinite(x[i]):
            continue
        s = (time[i] - origin) / scale
        w = 1.0 / (sd[i] * sd[i])
        for k in range(HIGHEST + 1):
            sums[0, k] += w
            sums[1, k] += w * x[i]
            sums[2, k] += w * y[i]
            if s > 0.0:
                later[0, k] += w
                later[1, k] += w * x[i]
                later[2, k] += w * y[i]
            w *= s
    return _step_at(sums, later, scale)


@making_arrays
def _step_at(sums: Array, later: Array, scale: float) -> tuple[float, float, float]:
    """:func:`hinge` from sums (3, HIGHEST + 1) over the frames and over those after the gap, whose times span ``scale``
    seconds: by the root of the normal equations (Cholesky), of which the step is the last unknown."""
    size = len(POWERS)
    root, seen = np.empty((size, size)), np.empty((size, 2))
    curvature = 0.5 * SMOOTH_M_PER_S2 * scale * scale
    for a in range(size):
        for b in range(a + 1):
            total = (later if HINGED[a] or HINGED[b] else sums)[0, POWERS[a] + POWERS[b]]
            if a == b and POWERS[a] == 2:
                total += 1 / curvature**2
            elif a == b and POWERS[a] == 3:
                total += (3 * SMOOTH_CHANGES_S / (curvature * scale)) ** 2
            for c in range(b):
                total -= root[a, c] * root[b, c]
            root[a, b] = np.sqrt(total) if a == b else total / root[b, b]
        for q in range(2):
            total = (later if HINGED[a] else sums)[1 + q, POWERS[a]]
            for c in range(a):
                total -= root[a, c] * seen[c, q]
            seen[a, q] = total / root[a, a]
    last = size - 1
    step_x, step_y = seen[last, 0] / root[last, last], seen[last, 1] / root[last, last]
    return step_x / scale, step_y / scale, np.sqrt(step_x * step_x + step_y * step_y) * root[last, last]


def reach_frames(time_s: Array) -> int:
    """Frames on each side of a gap that speak of a kink there."""
    return int(np.clip(frames_in(REACH_S, time_s), FEWEST_REACH, MOST_REACH))


def frames_in(duration_s: float, time_s: Array) -> int:
    """Frames that ``duration_s`` takes."""
    return int(np.ceil(duration_s / float(np.median(np.diff(time_s))) - ROUNDING_FRAMES))


@making_arrays
def find_kinks(
    time: Array, x: Array, y: Array, sd: Array, left: int, right: int, significance: float, reach: int
) -> Array:
    """Gaps (i between frames i and i + 1) of frames left..right at which the velocity jumps: rows (gap, step x, step y,
    sd's).
    """
    found = np.zeros((right - left + 1, 4))
    number = 0
    edges = np.zeros(right - left + 3, np.int64)
    edges[0], edges[1] = left - 1, right
    pieces = 2
    scores = np.zeros((right - left + 1, 3))
    smallest = max(
        SMALLEST_STEP_M_PER_S, JUMP_FRAMES * SMOOTH_M_PER_S2 * (time[right] - time[left]) / max(right - left, 1)
    )
    stale = np.ones(right - left + 1, np.bool_)
    while number < right - left:
        best, where = significance, -1
        for e in range(pieces - 1):
            first, last = edges[e] + 1, edges[e + 1]
            for gap in range(first, last):
                if stale[gap - left]:
                    a, b, z = hinge(time, x, y, sd, first, last, gap, reach)
                    if a * a + b * b < smallest**2:
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
        # Those that this cut takes frames from.
        for gap in range(max(left, where - reach), min(right, where + reach) + 1):
            stale[gap - left] = True
            scores[gap - left, 2] = 0.0
    order = np.argsort(found[:number, 0])
    return found[:number][order]
