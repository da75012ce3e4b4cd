"""Bodies that jump by about the spacing of their markers and go on as before: names that slipped along a lattice.

A body flies on, or an impact turns it from one velocity to another; neither moves it in one frame by what lies far
beside both velocities.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.identity.layouts import Layout

Array = NDArray[np.float64]
SPACINGS = 0.6  # of a body's markers, from which a jump may be a slip by one of them; a spin of 0.6 rad/frame makes 0.3
LEAST_PX = 3.0
TINY = 1e-12  # px^2
FEWEST = 3  # markers seen through four frames, or all of a body of two
SHOWN = 3  # frames named in a note


def jump_notes(
    camera: str, layout: Layout, frames: NDArray[np.int64], marker: NDArray[np.int64], uv_px: Array
) -> list[str]:
    """A note per body whose markers (rows of one camera: ``frames``, ``marker``, ``uv_px``) jump together."""
    notes = []
    for index, body in enumerate(layout.bodies):
        members = np.arange(len(layout.markers))[layout.of(index)]
        own = np.isin(marker, members)
        if len(members) < 2 or not own.any():
            continue
        numbers, row = np.unique(frames[own], return_inverse=True)
        place = np.full((len(numbers), len(members), 2), np.nan)
        place[row, marker[own] - members[0]] = uv_px[own]
        at = jumps(place)
        found = numbers[at[numbers[at + 1] - numbers[at - 2] == 3]]  # of frames that follow each other
        if len(found):
            shown = ", ".join(str(frame) for frame in found[:SHOWN])
            notes.append(
                f"{camera}: {body} jumps by about the spacing of its markers and goes on as before, in frame {shown}"
                f"{f' and {len(found) - SHOWN} more' if len(found) > SHOWN else ''}: on a regular grid of "
                f"dots its names may have slipped; place its markers at unequal distances"
            )
    return notes


def jumps(place: Array) -> NDArray[np.int64]:
    """Frames into which a body jumps: ``place`` (frames, markers, 2) [px], NaN where not seen."""
    seen = np.asarray(np.isfinite(place).all(-1), bool)
    # The same markers in all four frames: of others the middle lies elsewhere in a body that turns.
    common = seen[:-3] & seen[1:-2] & seen[2:-1] & seen[3:]
    at = np.flatnonzero(common.sum(1) >= min(FEWEST, place.shape[1]))
    if not len(at):
        return np.empty(0, np.int64)
    weight = common[at][:, None, :, None] / common[at].sum(1)[:, None, None, None]
    four = np.stack([place[at + k] for k in range(4)], 1)
    before, here, after = np.moveaxis(np.diff((np.nan_to_num(four) * weight).sum(2), axis=1), 1, 0)
    between = after - before
    share = np.sum((here - before) * between, 1) / np.maximum(np.sum(between**2, 1), TINY)
    off = np.linalg.norm(here - before - np.clip(share, 0, 1)[:, None] * between, axis=1)
    suspect = off > LEAST_PX  # few: only of these are the spacings needed
    apart = np.linalg.norm(four[suspect, 1][:, :, None] - four[suspect, 1][:, None], axis=-1)
    spacing = np.where(apart > 0, apart, np.inf).min((1, 2))
    return np.asarray(at[suspect][off[suspect] > SPACINGS * spacing] + 2, np.int64)
