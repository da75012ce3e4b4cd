"""Markers where they would be seen without what a law of them says, in points and in pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.series import Series, with_points
from ovines.errors import InputError

Array = NDArray[np.float64]
#: how far (N, 2 or, with its height, 3; m) in the room a marker has been moved at times (N,; s)
Way = Callable[[Array], Array]


def all_moved_back(series: Series, law: str, ways: Callable[[Run], Iterable[tuple[str, Way]]]) -> Series:
    """``series`` with markers back from where they have been moved in each run, ``ways`` giving their names and how
    far; `InputError` where there are no markers, which ``law`` needs."""
    if series.points is None or series.layouts is None:
        raise InputError(
            f"{law}, and a series without markers",
            "points.parquet, tracks.parquet or frames in every recording",
            "leave the law away, or bring the markers",
        )
    points, tracks = list(series.points), None if series.tracks is None else list(series.tracks)
    for k, run in enumerate(series.runs):
        for marker, way in ways(run):
            points[k], moved = _moved_back(points[k], None if tracks is None else tracks[k], series, marker, way)
            if tracks is not None and moved is not None:
                tracks[k] = moved
    return with_points(replace(series, tracks=None if tracks is None else tuple(tracks)), points)


def body_moved_back(series: Series, body: str, law: str, moved: Callable[[Array], Array]) -> Series:
    """``series`` with all markers of a ``body`` back from where it is seen, ``moved`` giving how far (N, 2; m) in the
    room by what laws know of frames (N, KNOWN_SIZE); `InputError` where there are no markers, which ``law`` needs."""

    def ways(run: Run) -> list[tuple[str, Way]]:
        def way(time_s: Array) -> Array:
            return np.nan_to_num(moved(known_frames(time_s, run.data, run.flights)))

        return [(marker, way) for marker in series.recordings[0].bodies[body].markers]

    return all_moved_back(series, law, ways)


def _moved_back(
    points: pd.DataFrame,
    tracks: pd.DataFrame | None,
    series: Series,
    marker: str,
    way: Way,
) -> tuple[pd.DataFrame, pd.DataFrame | None]:
    """Points and tracks of a run with a ``marker`` back from where ``way`` of its times (N,; s) has moved it in the
    room (N, 2 or 3; m)."""
    here = (points["marker"] == marker).to_numpy()
    seen = points[here]
    if not len(seen):
        return points, tracks
    gone = way(seen["time_s"].to_numpy(float))
    if tracks is not None and series.cameras is not None:
        tracks = _tracks_moved(tracks, series, seen, gone)
    points = points.copy()
    points.loc[here, ["x_m", "y_m", "z_m"][: gone.shape[1]]] -= gone
    return points, tracks


def _tracks_moved(tracks: pd.DataFrame, series: Series, seen: pd.DataFrame, way: Array) -> pd.DataFrame:
    """Tracks whose marker ``seen`` as points has not gone its ``way`` (N, 2 or 3; m)."""
    assert series.cameras is not None
    place = seen[["x_m", "y_m", "z_m"]].to_numpy(float)
    still = place - np.column_stack([way, np.zeros((len(way), 3 - way.shape[1]))])
    moved = tracks.copy()
    for camera in series.cameras:
        by_frame = pd.DataFrame(camera.project(place) - camera.project(still), index=seen["frame"].to_numpy())
        here = ((tracks["camera"] == camera.name) & (tracks["marker"] == seen["marker"].iloc[0])).to_numpy()
        shift = by_frame.reindex(tracks["frame"].to_numpy()[here]).fillna(0.0).to_numpy()
        moved.loc[here, ["u_px", "v_px"]] -= shift
    return moved


def at_frames(moved_m: Array, data: RunData, time_s: Array) -> Array:
    """What stands for the frames of a run (N, 2) at those next to ``time_s``."""
    return np.asarray(moved_m[np.clip(np.searchsorted(data.time_s, time_s - 0.5 * data.period_s), 0, len(moved_m) - 1)])
