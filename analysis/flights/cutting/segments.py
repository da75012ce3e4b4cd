"""Where a flight ends: kinks of the path, and stretches of sustained wall contact, before any model is fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.kinks import FEWEST_FOR_KINKS, SIGNIFICANCE, find_kinks, frames_in, hinge, reach_frames
from analysis.flights.cutting.sides import on_their_sides
from analysis.flights.cutting.wall_contact import (
    FEWEST_IN_CONTACT,
    LEAST_CONTACT_S,
    find_contact,
    find_hops,
    find_rebounds,
)

Array = NDArray[np.float64]

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


@dataclass(frozen=True, eq=False)
class Segments:
    """``smeared`` frames were exposed across an impact and belong to neither flight; ``gaps`` (K,) frame indices after
    which the path kinks; ``contact`` (C, 2) first and last index of sustained contact.
    """

    gaps: NDArray[np.int64]
    steps_m_per_s: Array
    contact: NDArray[np.int64]
    smeared: NDArray[np.int64]


def segment(
    time_s: Array, xy_m: Array, sd_m: Array, relative_m: Array, gap_m: Array, margin_m: Array | float, size_m: float
) -> Segments:
    """Kinks and contact stretches of one run.

    ``relative_m`` (N, 2) from the Host's centre, ``gap_m`` (N,) past the wall; a frame counts as at the wall from
    ``margin_m`` inside it (one, or one per frame: a disk that smears is not seen as well); ``size_m`` of the wall.
    """
    margin_m = np.broadcast_to(margin_m, gap_m.shape)
    at_least = max(FEWEST_IN_CONTACT, frames_in(LEAST_CONTACT_S, time_s)) if len(time_s) > 1 else FEWEST_IN_CONTACT
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
    # Inside a stretch of contact the wall itself bends the path: those are not impacts, nor is it a flight's.
    inside = np.zeros(len(gaps), bool)
    for first, last in contact:
        inside |= (gaps >= first) & (gaps < last)
        x[first : last + 1] = y[first : last + 1] = np.nan
    return Segments(on_their_sides(time_s, x, y, sd_m, gaps[~inside]), kinks[~inside, 1:3], contact, smeared)


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
            found += _one_frame(time_s, x, y, sd_m, gaps[k : last + 1], reach)
        k = last + 1
    return np.array(found, np.int64)


def _one_frame(time_s: Array, x: Array, y: Array, sd_m: Array, gaps: NDArray[np.int64], reach: int) -> list[int]:
    """The frame among the kinks at ``gaps``, which follow each other, without which one of them remains; or none."""
    first, last = int(gaps[0]), int(gaps[-1])
    lo, hi = max(0, first - 2 * reach), min(len(x) - 1, last + 1 + 2 * reach)
    for frame in range(first, last + 2):
        # A frame has no say in kinks farther off than their reach, and one kink may remain.
        beyond = np.count_nonzero((gaps + 1 + reach < frame) | (gaps - reach > frame))
        if not np.isfinite(x[frame]) or beyond > 1:
            continue
        trial_x, trial_y = x.copy(), y.copy()
        trial_x[frame] = trial_y[frame] = np.nan
        kinks = find_kinks(time_s, trial_x, trial_y, sd_m, lo, hi, SIGNIFICANCE, reach)
        near = np.count_nonzero((kinks[:, 0] >= first - 2) & (kinks[:, 0] <= last + 2))
        if near == 1:
            return [frame]
    return []
