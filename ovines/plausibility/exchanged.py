"""Two markers of a body that a tracker has taken for each other for a while, in one camera alone.

Their two views do not meet, and meet when their names are exchanged in one of them.

The bodies' fits leave such markers out, frame by frame, so nothing else shows what was wrong with the tracks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.robust import residual_sd

Triangulate = Callable[[pd.DataFrame], pd.DataFrame]
# Views do not meet where they miss each other by so many robust sds of all points, and meet within so many.
APART_SD, MEETING_SD = 8.0, 5.0
# So many frames in a row, but for gaps of so many: where the line between both runs along the epipolar lines, they meet
# either way.
FEWEST_FRAMES, LONGEST_GAP = 3, 8
VIEWS = 2


class Exchange(NamedTuple):
    """Two ``markers`` from frame ``first`` to ``last``, seen in so many ``frames`` in which their views miss each other
    by up to ``apart_px``."""

    markers: tuple[str, str]
    first: int
    last: int
    frames: int
    apart_px: float


def exchanged_labels(
    points: pd.DataFrame,
    tracks: pd.DataFrame,
    cameras: Sequence[Camera],
    bodies: Mapping[str, Sequence[str]],
    triangulate: Triangulate,
) -> list[Exchange]:
    """Exchanges in a run's tables ``points`` and ``tracks``; none with more or fewer than two cameras.

    ``bodies``: names of the markers of each; ``triangulate``: table ``points`` of a table ``tracks``."""
    if len(cameras) != VIEWS or not len(points) or "epipolar_px" not in points:
        return []
    off_px = points["epipolar_px"].to_numpy(float)
    sd_px = residual_sd(off_px[np.isfinite(off_px)])
    if np.count_nonzero(np.abs(off_px) > APART_SD * sd_px) < VIEWS * FEWEST_FRAMES:
        return []
    apart = points.pivot_table(index="frame", columns="marker", values="epipolar_px").abs()
    gross = apart > APART_SD * sd_px
    out = []
    for markers in bodies.values():
        for pair in combinations([name for name in markers if name in gross], 2):
            frames = gross.index[gross[pair[0]] & gross[pair[1]]].to_numpy(np.int64)
            if len(frames) < FEWEST_FRAMES:
                continue
            meeting = _crossed(frames, pair, tracks, cameras[1].name)
            crossed = triangulate(meeting)
            crossed = crossed.pivot_table(index="frame", columns="marker", values="epipolar_px").abs()
            swapped = crossed.index[(crossed < MEETING_SD * sd_px).all(axis=1)].to_numpy(np.int64)
            out += [_exchange(pair, stretch, apart) for stretch in _stretches(swapped) if len(stretch) >= FEWEST_FRAMES]
    return sorted(out, key=lambda one: one.first)


def exchange_notes(found: Sequence[Exchange]) -> list[str]:
    """Exchanges in words, with what to do."""
    return [
        f"{' and '.join(one.markers)} have each other's name in one of the cameras from frame {one.first} to "
        f"{one.last}: their views miss each other by up to {one.apart_px:.0f} px, and meet with the names exchanged. "
        "Those frames are measured without them; exchange the names in tracks.parquet, or track again."
        for one in found
    ]


def _crossed(frames: NDArray[np.int64], pair: tuple[str, str], tracks: pd.DataFrame, camera: str) -> pd.DataFrame:
    """Tracks of both in ``frames``, with their names exchanged in one ``camera``."""
    own = tracks[tracks["frame"].isin(frames) & tracks["marker"].isin(pair)].copy()
    there = own["camera"] == camera
    own.loc[there, "marker"] = own.loc[there, "marker"].map({pair[0]: pair[1], pair[1]: pair[0]})
    return own


def _stretches(frames: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """``frames`` (N,) cut where more than :data:`LONGEST_GAP` are between two."""
    return np.split(frames, np.flatnonzero(np.diff(frames) > LONGEST_GAP) + 1)


def _exchange(pair: tuple[str, str], frames: NDArray[np.int64], apart: pd.DataFrame) -> Exchange:
    largest = float(apart.loc[frames, list(pair)].to_numpy().max())
    return Exchange(pair, int(frames[0]), int(frames[-1]), len(frames), largest)
