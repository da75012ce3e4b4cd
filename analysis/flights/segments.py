"""Where a flight ends: kinks of the path, and stretches of sustained wall contact, before any model is fitted.

A kink is a sudden change of velocity between two frames.  Around each gap between frames a parabola is fitted with and
without a hinge; the significance of the hinge is scanned, the strongest is taken, and the scan is repeated on the
pieces, so that neighbouring impacts a few frames apart do not blur each other.  Positions only: no differentiation of
noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled

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
# Sustained contact: so many frames in a row, and so long (rig units: an impact of 0.1 m/s stays within CONTACT_MARGIN_M
# of the wall for 3 ms).
FEWEST_IN_CONTACT, LEAST_CONTACT_S = 4, 0.004
# So near to the wall, but in hops: from so many frames of one, whose dip stands out by so many sd and is a tenth of
# CONTACT_MARGIN_M (a disk that rolls on a wall off its place seems to dip by less).  Seen only where frames are fast.
FEWEST_IN_HOP, HOP_SD, LEAST_HOP_M = 6, 6.0, 1.5e-5
# A wall that is off its place or shape by this share is still the wall; an impact in a gap is as far from its frames as
# the disk moves in one, and half again.
WALL_OFF_SHARE, MOVED_SHARE = 0.05, 1.5
# Velocity step below which no frame is called smeared: 0.5 m/s over half of 0.4 ms is 0.1 mm, the length of a slow
# sequence's hops.
LEAST_SMEARED_STEP_M_PER_S = 0.5
# Kinks this near each other may be one frame's.
TOGETHER_FRAMES = 3
# ... or one that was taken a frame off and needed another: where one between them leaves no kink of so many sd.
DOUBLE_SD = 4.0
# Two frames on each side of a kink give its velocities; a run of fewer frames than this has no kink.
FEWEST_A_SIDE, FEWEST_FOR_KINKS = 2, 4
# Whole numbers of frames are whole, however the clock's numbers were rounded (frames).
ROUNDING_FRAMES = 0.1
# A hinge of 6 sd: of 600 frames x 3 coordinates none by chance.  At 800 Hz all of 40 velocity steps of 0.2 m/s were
# found at 10 um of noise, of 0.3 m/s at 15 um, of 0.4 m/s at 20 um; weaker impacts are left to bounce
# sequences.
SIGNIFICANCE = 6.0


@compiled
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


@compiled
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
    return int(np.clip(_frames_in(REACH_S, time_s), FEWEST_REACH, MOST_REACH))


def _frames_in(duration_s: float, time_s: Array) -> int:
    """Frames that ``duration_s`` takes."""
    return int(np.ceil(duration_s / float(np.median(np.diff(time_s))) - ROUNDING_FRAMES))


@compiled
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


@dataclass(frozen=True, eq=False)
class Segments:
    """``smeared`` frames were exposed across an impact and belong to neither flight; ``gaps`` (K,) frame indices after
    which the path kinks; ``contact`` (C, 2) first and last index of sustained contact.
    """

    gaps: NDArray[np.int64]
    steps_m_per_s: Array
    contact: NDArray[np.int64]
    smeared: NDArray[np.int64]


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


def segment(
    time_s: Array, xy_m: Array, sd_m: Array, relative_m: Array, gap_m: Array, margin_m: Array | float, size_m: float
) -> Segments:
    """Kinks and contact stretches of one run.

    ``relative_m`` (N, 2) from the Host's centre, ``gap_m`` (N,) past the wall; a frame counts as at the wall from
    ``margin_m`` inside it (one, or one per frame: a disk that smears is not seen as well); ``size_m`` of the wall.
    """
    margin_m = np.broadcast_to(margin_m, gap_m.shape)
    at_least = max(FEWEST_IN_CONTACT, _frames_in(LEAST_CONTACT_S, time_s)) if len(time_s) > 1 else FEWEST_IN_CONTACT
    contact = find_contact(gap_m, margin_m, at_least)
    x, y = xy_m[:, 0].copy(), xy_m[:, 1].copy()
    if len(time_s) < FEWEST_FOR_KINKS:
        return Segments(np.zeros(0, np.int64), np.zeros((0, 2)), contact, np.zeros(0, np.int64))
    reach = reach_frames(time_s)
    kinks = find_kinks(time_s, x, y, sd_m, 0, len(time_s) - 1, SIGNIFICANCE, reach)
    smeared = find_smeared(time_s, x, y, sd_m, kinks, reach)
    if len(smeared):
        x[smeared] = y[smeared] = np.nan
        kinks = find_kinks(time_s, x, y, sd_m, 0, len(time_s) - 1, SIGNIFICANCE, reach)
    kinks = without_doubles(time_s, x, y, sd_m, kinks, reach)
    # Hops between kinks are none of the contact, however near to the wall.
    gaps = kinks[:, 0].astype(np.int64)
    hopping = find_hops(gap_m, margin_m, sd_m, gaps) | find_rebounds(time_s, gap_m, sd_m, gaps, reach)
    contact = find_contact(np.where(hopping, -size_m, gap_m), margin_m, at_least)
    off_m = float(np.median(margin_m))
    off_m += WALL_OFF_SHARE * (size_m - off_m)
    kinks = kinks[_near_wall(relative_m, gap_m, off_m, kinks[:, 0].astype(np.int64))]
    gaps = kinks[:, 0].astype(np.int64)
    # Inside a stretch of contact the wall itself bends the path: those are not impacts.
    inside = np.zeros(len(gaps), bool)
    for first, last in contact:
        inside |= (gaps >= first) & (gaps < last)
    return Segments(gaps[~inside], kinks[~inside, 1:3], contact, smeared)


def without_doubles(time_s: Array, x: Array, y: Array, sd_m: Array, kinks: Array, reach: int) -> Array:
    """``kinks`` (rows of :func:`find_kinks`) with one for two a few frames apart, where one between them explains the
    frames as well: the strongest is taken first, and noise may place it a frame off.
    """
    kept: list[Array] = []
    gaps = kinks[:, 0].astype(np.int64)
    k = 0
    while k < len(gaps):
        one = None
        if k + 1 < len(gaps) and gaps[k + 1] - gaps[k] <= TOGETHER_FRAMES:
            left = int(gaps[k - 1]) + 1 if k > 0 else 0
            right = int(gaps[k + 2]) if k + 2 < len(gaps) else len(x) - 1
            for gap in range(int(gaps[k]) + 1, int(gaps[k + 1])):
                lo, hi = max(left, gap - 2 * reach + 1), min(right, gap + 2 * reach)
                sides = ((lo, gap), (gap + 1, hi))
                if not any(len(find_kinks(time_s, x, y, sd_m, *side, DOUBLE_SD, reach)) for side in sides):
                    one = np.array([gap, *hinge(time_s, x, y, sd_m, lo, hi, gap, reach)])
                    break
        kept.append(kinks[k] if one is None else one)
        k += 1 if one is None else 2
    return np.array(kept).reshape(-1, 4)


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


def _near_wall(relative_m: Array, gap_m: Array, margin_m: float, gaps: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which kinks lie where the disk may have come within ``margin_m`` of the wall between two frames, as far as it
    moves against the Host there; a kink elsewhere is no impact (a force that sets in)."""
    if not len(gaps):
        return np.zeros(0, bool)
    moved = np.hypot(*np.diff(relative_m, axis=0).T)
    near = [moved[np.clip(gaps + k, 0, len(moved) - 1)] for k in (-1, 0, 1)]
    out = np.maximum(gap_m[gaps], gap_m[gaps + 1])
    reached = out + MOVED_SHARE * np.maximum.reduce(near) >= -margin_m
    return np.asarray(reached | ~np.isfinite(out) | ~np.isfinite(np.sum(near, 0)), bool)


def find_smeared(time_s: Array, x: Array, y: Array, sd_m: Array, kinks: Array, reach: int) -> NDArray[np.int64]:
    """Frames exposed across an impact: without the one frame, several kinks within a few frames become a single one.

    Its position is a mean over both flights, up to a quarter of exposure times velocity step off either.  Looked for
    only where the step is large; a sequence of slow impacts stays one, for no single frame explains it.
    """
    found: list[int] = []
    gaps = kinks[:, 0].astype(np.int64)
    k = 0
    while k < len(gaps):
        last = k
        while last + 1 < len(gaps) and gaps[last + 1] - gaps[last] <= TOGETHER_FRAMES:
            last += 1
        total = np.hypot(*kinks[k : last + 1, 1:3].sum(0))
        if last > k and total > LEAST_SMEARED_STEP_M_PER_S:
            found += _one_frame(time_s, x, y, sd_m, int(gaps[k]), int(gaps[last]), reach)
        k = last + 1
    return np.array(found, np.int64)


def _one_frame(time_s: Array, x: Array, y: Array, sd_m: Array, first: int, last: int, reach: int) -> list[int]:
    """The frame of first..last + 1 without which one kink remains near it, or none."""
    lo, hi = max(0, first - 2 * reach), min(len(x) - 1, last + 1 + 2 * reach)
    for frame in range(first, last + 2):
        if not np.isfinite(x[frame]):
            continue
        trial_x, trial_y = x.copy(), y.copy()
        trial_x[frame] = trial_y[frame] = np.nan
        kinks = find_kinks(time_s, trial_x, trial_y, sd_m, lo, hi, SIGNIFICANCE, reach)
        near = np.count_nonzero((kinks[:, 0] >= first - 2) & (kinks[:, 0] <= last + 2))
        if near == 1:
            return [frame]
    return []
