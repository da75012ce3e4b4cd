"""Discs too small for their centres to be as exact as their standard deviations say."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.identity.layouts import Layout

# Radius [px] of the smallest disc whose sd is honest: of discs of 2.8 px 92 % of the errors lie within 1.645 sd, of 1.8
# px 81 % (benchmarks/tracking/track_rigs.py, whose cameras look down at 20 degrees).
SMALLEST_PX = 2.5
# Radius of the largest asked for: `vision.markers.detect` finds those a little larger that lie nearer.
LARGEST_PX = 60.0


def size_notes(camera: str, layout: Layout, marker: NDArray[np.int64], radius_px: NDArray[np.float64]) -> list[str]:
    """A note on the bodies whose discs, rows of `marker` (n,) and `radius_px` (n,), one camera sees too small; none
    where there are none.
    """
    small = {}
    for body, name in enumerate(layout.bodies):
        part = layout.of(body)
        own = radius_px[(marker >= part.start) & (marker < part.stop)]
        if len(own) and np.median(own) < SMALLEST_PX:
            small[name] = float(np.median(own))
    if not small:
        return []
    listed = ", ".join(f"{name} {radius:.1f} px" for name, radius in small.items())
    note = (
        f"{camera} sees discs of small radius ({listed}): below {SMALLEST_PX:g} px centres are less exact than sd_px "
        f"says, and some are not found; "
        "larger markers or a closer view help"
    )
    return [note]
