"""Ground markers stand still: what they do instead is the cameras' doing."""

from __future__ import annotations

import numpy as np

from analysis.gap.cause import Structure, two_sided
from analysis.gap.series import Series
from ovines.robust import spread

# Ground markers that move together by more than this are no longer noise (m); a lens residual leaves a still marker
# still.
STILL_M = 1.2e-5


def ground_motion(series: Series) -> list[Structure]:
    """:class:`analysis.gap.cause.Structure` when the ground markers move together by more than their noise, else
    nothing.
    """
    ground = series.recordings[0].bodies.get("ground")
    if ground is None or series.points is None or not ground.markers:
        return []
    excess, noise = [], []
    for points in series.points:
        part = points[points["marker"].isin(list(ground.markers))]
        if part.empty:
            continue
        for axis in "xyz":
            wide = part.pivot_table(index="frame", columns="marker", values=f"{axis}_m")
            moved = wide - wide.median()
            together = moved.mean(axis=1).to_numpy()
            count = wide.notna().sum(axis=1).to_numpy()
            sd = float(part[f"{axis}_sd_m"].median()) / np.sqrt(max(np.median(count), 1))
            excess.append(max(spread(together) ** 2 - sd**2, 0.0) if axis != "z" else 0.0)
            noise.append(sd)
    if not excess:
        return []
    size = float(np.sqrt(np.median([max(excess[i : i + 3]) for i in range(0, len(excess), 3)])))
    if size < STILL_M or size < 0.7 * float(np.median(noise)):
        return []
    return [
        Structure(
            "measurement",
            "all",
            "x",
            "the ground markers, which move together",
            size / STILL_M,
            (size / np.median(noise)) ** 2,
            size,
            "m",
            two_sided(size / float(np.median(noise))),
        )
    ]
