"""Paths of markers on an even clock, as motion-capture formats keep them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError

BODIES = ("nes", "host")


@dataclass(frozen=True)
class MarkerPaths:
    """Places ``xyz_m`` (frames, markers, 3), NaN where not seen, at ``times_s`` (frames,) from frame ``first`` on."""

    names: tuple[str, ...]
    first: int
    times_s: NDArray[np.float64]
    xyz_m: NDArray[np.float64]

    @property
    def rate_hz(self) -> float:
        """Frames per second, by the first and the last frame."""
        span_s = float(self.times_s[-1] - self.times_s[0])
        return (len(self.times_s) - 1) / span_s if span_s > 0 else 1.0

    @property
    def off_clock_s(self) -> float:
        """How far the times lie from the even clock of ``rate_hz`` at most."""
        even = self.times_s[0] + np.arange(len(self.times_s)) / self.rate_hz
        return float(np.abs(self.times_s - even).max())


def marker_paths(tables: Mapping[str, pd.DataFrame], source: Path) -> MarkerPaths:
    """Paths of the table ``points``, else of the bodies' centres of ``motion``; `InputError` where there is neither.

    Frames that no camera saw have a row too, with times between their neighbours'.
    """
    points, motion = tables.get("points"), tables.get("motion")
    if points is not None and len(points):
        rows = points
    elif motion is not None and len(motion):
        rows = pd.concat(
            [
                motion[["frame", "time_s"]].assign(
                    marker=body, **{f"{axis}_m": motion[f"{body}_{axis}_m"] for axis in "xyz"}
                )
                for body in BODIES
            ]
        )
    else:
        raise InputError(f"{source}: no points.parquet and no motion.parquet", "the results of `ovines run`",
                         "run `ovines run` first, or name its --out")  # fmt: skip
    names = tuple(sorted(rows["marker"].unique(), key=str))
    instants = rows.drop_duplicates("frame").sort_values("frame")
    frames = instants["frame"].to_numpy(np.int64)
    every = np.arange(frames[0], frames[-1] + 1)
    times_s = np.interp(every, frames, instants["time_s"].to_numpy(float))
    xyz_m = np.full((len(every), len(names), 3), np.nan)
    columns = rows["marker"].map({name: i for i, name in enumerate(names)}).to_numpy(np.int64)
    xyz_m[rows["frame"].to_numpy(np.int64) - frames[0], columns] = rows[["x_m", "y_m", "z_m"]].to_numpy(float)
    xyz_m[~np.isfinite(xyz_m).all(-1)] = np.nan
    return MarkerPaths(names, int(frames[0]), times_s, xyz_m)
