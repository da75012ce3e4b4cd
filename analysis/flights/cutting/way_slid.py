"""The disk's way over the floor as the frames show it, for written laws that remember it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from ovines.core.laws import words as W
from ovines.core.laws.memory import memory_units, slid_on

Array = NDArray[np.float64]
# Frames of the straight line whose slope is a frame's velocity, to either side of it; and by how much a line that lies
# to one side of the frame must miss less, in squares, before it is taken: a kink then lies on the other side.
BESIDE, KINK = 2, 4.0


def way_slid(time_s: Array, xy_m: Array, host: tuple[Array, Array], contact_radius_m: float) -> Array:
    """Time (s) of each frame and what the disk remembers then (N, 1 + MEMORY_SIZE), of places in the room (N, 2; NaN
    where it was not seen) and the ``host``'s pose with its rates (N, 4)."""
    out = np.zeros((len(time_s), 1 + W.MEMORY_SIZE))
    out[:, 0] = time_s
    seen = np.flatnonzero(np.isfinite(xy_m).all(1))
    if len(seen) <= 2 * BESIDE:
        return out
    pose, rate = host
    place = np.column_stack([np.interp(time_s, time_s[seen], xy_m[seen, i]) for i in range(2)])
    velocity = np.column_stack(
        [np.interp(time_s, time_s[seen], one) for one in _velocities(time_s[seen], xy_m[seen]).T]
    )
    arm = place - pose[:, :2]
    slip = velocity - rate[:, :2] - rate[:, 3:4] * np.column_stack([-arm[:, 1], arm[:, 0]])
    _remember(time_s, np.ascontiguousarray(slip), memory_units(contact_radius_m), out)
    return out


def _velocities(time_s: Array, xy_m: Array) -> Array:
    """Velocities (N, 2; m/s) at frames: slopes of straight lines through their neighbours, on the side where the path
    has no kink."""
    count, width = len(time_s), 2 * BESIDE + 1
    frames = np.arange(count - width + 1)[:, None] + np.arange(width)
    t = time_s[frames] - time_s[frames].mean(1, keepdims=True)
    places = xy_m[frames] - xy_m[frames].mean(1, keepdims=True)
    slope = np.einsum("ij,ijk->ik", t, places) / np.sum(t**2, 1)[:, None]
    missed = np.sum((places - t[:, :, None] * slope[:, None]) ** 2, (1, 2))
    last = len(slope) - 1
    middle = np.clip(np.arange(count) - BESIDE, 0, last)
    sides = np.stack([np.clip(middle - BESIDE, 0, last), np.clip(middle + BESIDE, 0, last)])
    best = sides[np.argmin(missed[sides], 0), np.arange(count)]
    return np.asarray(slope[np.where(KINK * missed[best] < missed[middle], best, middle)], float)


@compiled
def _remember(time_s: Array, slip: Array, units: tuple[float, float], out: Array) -> None:
    """Fill ``out`` (N, 1 + MEMORY_SIZE) with what velocities against the floor ``slip`` (N, 2; m/s) leave, each for
    half of the way to its neighbours."""
    for i in range(1, len(time_s)):
        half = 0.5 * (time_s[i] - time_s[i - 1])
        slid_on(out[i - 1], 1, (half * slip[i - 1, 0], half * slip[i - 1, 1], half), units, out[i], 1)
        slid_on(out[i], 1, (half * slip[i, 0], half * slip[i, 1], half), units, out[i], 1)


@compiled
def remembered(time_s: float, way: Array, out: Array, at: int) -> None:
    """What the disk remembers at a time (s) of the table ``way`` (:func:`way_slid`) into ``out`` from ``at`` on;
    nothing without a table."""
    count = way.shape[0]
    if count == 0:
        for i in range(W.MEMORY_SIZE):
            out[at + i] = 0.0
        return
    last = min(max(np.searchsorted(way[:, 0], time_s), 1), count - 1)
    first = max(last - 1, 0)
    span = way[last, 0] - way[first, 0]
    share = min(max((time_s - way[first, 0]) / span, 0.0), 1.0) if span > 0.0 else 0.0
    for i in range(W.MEMORY_SIZE):
        out[at + i] = way[first, 1 + i] + share * (way[last, 1 + i] - way[first, 1 + i])
