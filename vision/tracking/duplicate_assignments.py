"""One disc is one marker: where two bodies match the same, it is that body's of which the camera sees more."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SAME = 0.4  # radii of a disc: discs do not overlap, and a covered one draws a fit aside


def unshared(
    frames: NDArray[np.int64],
    marker: NDArray[np.int64],
    uv_px: NDArray[np.float64],
    radius_px: NDArray[np.float64],
    body_of: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which rows of one camera, each a marker in a frame (n,), at `uv_px` (n, 2) and of `radius_px` (n,), keep their
    disc.

    A covered marker may be taken for a neighbour's of another body that lies beside it (the ring over the ground).  Of
    two bodies with equally many markers in the frame neither keeps the disc.  ``body_of`` (markers,): each marker's
    body.
    """
    keep = np.ones(len(frames), bool)
    if not len(frames):
        return keep
    numbers, row = np.unique(frames, return_inverse=True)
    place = np.full((len(numbers), len(body_of), 2), np.nan)
    place[row, marker] = uv_px
    size = np.full(place.shape[:2], np.nan)
    size[row, marker] = radius_px
    seen = np.isfinite(place[..., 0])
    count = np.stack([seen[:, body_of == body].sum(1) for body in range(body_of.max() + 1)], 1)[:, body_of]
    lost = np.zeros_like(seen)
    low, high = np.fmin.reduce(place, axis=0) - SAME * radius_px.max(), np.fmax.reduce(place, axis=0)
    for i in range(len(body_of)):
        overlaps = np.all((low[i] <= high) & (low <= high[i]), axis=1)  # few markers ever come near another body's
        for j in np.flatnonzero((body_of != body_of[i]) & overlaps):
            same = np.hypot(*(place[:, i] - place[:, j]).T) < SAME * np.minimum(size[:, i], size[:, j])
            lost[:, i] |= same & (count[:, i] <= count[:, j])
    keep &= ~lost[row, marker]
    return keep
