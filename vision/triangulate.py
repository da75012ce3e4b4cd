"""Tracks of two cameras or more, or of one camera over the plane, to points in the world, with standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import gammaincinv

from ovines.camera import Camera, Triangulated, triangulate_points
from ovines.errors import InputError
from ovines.robust import spread
from vision.one_view import Height, points_in_plane

Mask = NDArray[np.bool_]
# Where a track carries no sd, this stands in until the residuals of the recording give the real one.
FIRST_GUESS_SD_PX = 0.1


def triangulate(
    tracks: pd.DataFrame,
    cameras: Sequence[Camera],
    window_offset_px: Mapping[str, Sequence[float]],
    heights: Mapping[str, Height] | None = None,
) -> pd.DataFrame:
    """Points in metres of every marker that two cameras saw in a frame, or one camera where the heights are known.

    Parameters
    ----------
    tracks : table ``tracks`` (window pixels)
    cameras : calibrated cameras; those that the tracks name are used
    window_offset_px : per camera name, top-left corner (u, v) of its window on the sensor
    heights : per marker its height over the sliding plane: what tracks of one camera need
        (:func:`vision.one_view.marker_heights`)

    Returns
    -------
    table ``points``: frame, time_s (of the first camera), marker, position and sd in metres,
    ``reprojection_px`` (RMS of all coordinates) and, of two cameras, ``epipolar_px`` (signed, the one residual that
    two views leave over; null of more).  A marker that only one of several cameras saw has no row.  One camera alone
    gives no z: it is null, see :func:`vision.one_view.points_in_plane`.

    Where ``sd_px`` is null, the sd is taken from the robust spread of the residuals of the same markers.
    """
    by_name = {camera.name: camera for camera in cameras}
    names = _tracked(tracks, by_name, heights is not None)
    if len(names) == 1 and heights is not None:
        return points_in_plane(tracks, by_name[names[0]], window_offset_px.get(names[0], (0, 0)), heights)
    rows = _side_by_side(tracks, names, window_offset_px)
    uv = [rows[[f"u_px_{k}", f"v_px_{k}"]].to_numpy(float) for k in range(len(names))]
    seen = np.stack([np.isfinite(one).all(1) for one in uv])
    sd = [rows[f"sd_px_{k}"].to_numpy(float) for k in range(len(names))]
    unknown = np.any([own & np.isnan(s) for own, s in zip(seen, sd, strict=True)], axis=0)
    sd = [np.where(unknown, FIRST_GUESS_SD_PX, s) for s in sd]
    chosen = [by_name[name] for name in names]
    result = triangulate_points(chosen, uv, sd)
    if unknown.any():
        measured_px = _sd_of_residuals(result, seen, unknown)
        if measured_px > 0:
            sd = [np.where(unknown, measured_px, s) for s in sd]
            result = triangulate_points(chosen, uv, sd)
    position_sd = np.sqrt(np.diagonal(result.covariance_m2, axis1=1, axis2=2))
    times = rows[[f"time_s_{k}" for k in range(len(names))]].to_numpy(float)
    points = pd.DataFrame(
        {
            "frame": rows["frame"].to_numpy(),
            "time_s": times[np.arange(len(times)), seen.argmax(0)],
            "marker": rows["marker"].to_numpy(),
            **{f"{axis}_m": result.points_m[:, i] for i, axis in enumerate("xyz")},
            **{f"{axis}_sd_m": position_sd[:, i] for i, axis in enumerate("xyz")},
            "reprojection_px": result.reprojection_px,
            "epipolar_px": result.epipolar_px,
        }
    )
    points = points[np.isfinite(points["x_m"])]
    return points.sort_values(["frame", "marker"], kind="stable").reset_index(drop=True)


def _tracked(tracks: pd.DataFrame, by_name: Mapping[str, Camera], over_the_plane: bool) -> list[str]:
    """Names of the calibrated cameras that the tracks name; refused where they cannot give points."""
    seen_by = set(tracks["camera"].unique())
    names = [name for name in by_name if name in seen_by]
    strangers = sorted(seen_by - set(by_name))
    if strangers:
        raise InputError(
            f"tracks of camera {strangers[0]!r}",
            f"one of the calibrated cameras {sorted(by_name)}",
            "give recording.toml and calibration.json the same camera names",
        )
    if not names or (len(names) < 2 and not over_the_plane):
        raise InputError(
            f"tracks of {len(names)} camera(s): {names}",
            "tracks of every [[cameras]] of recording.toml",
            "one camera alone gives no depth: check the second camera's tracks, or leave its [[cameras]] out if one "
            "camera over the plane is all there is",
        )
    if (tracks["sd_px"] <= 0).any():
        raise InputError(
            "tracks with sd_px of 0 or below",
            "a standard deviation above 0, or null where it is unknown",
            "write null where it is unknown",
        )
    return names


def _side_by_side(
    tracks: pd.DataFrame, names: Sequence[str], window_offset_px: Mapping[str, Sequence[float]]
) -> pd.DataFrame:
    """A row per frame and marker, pixels of the full sensor: columns of camera ``k`` of ``names`` end in ``_k``."""
    views = []
    for k, name in enumerate(names):
        view = tracks.loc[tracks["camera"] == name, ["frame", "time_s", "marker", "u_px", "v_px", "sd_px"]].copy()
        offset = window_offset_px.get(name, (0, 0))
        view["u_px"] = view["u_px"].astype(float) + offset[0]
        view["v_px"] = view["v_px"].astype(float) + offset[1]
        views.append(view.rename(columns={column: f"{column}_{k}" for column in ("time_s", "u_px", "v_px", "sd_px")}))
    how = "inner" if len(names) == 2 else "outer"
    return reduce(lambda one, other: one.merge(other, on=["frame", "marker"], how=how), views)


def _sd_of_residuals(result: Triangulated, seen: Mask, unknown: Mask) -> float:
    """Sd of a coordinate (px) by what the points ``unknown`` (N,) leave over; ``seen`` (cameras, N)."""
    if len(seen) == 2:
        return spread(result.epipolar_px[unknown])
    # the sum of squares of 2 n coordinates has the median of chi squared with 2 n - 3
    count = 2.0 * seen.sum(0)[unknown]
    square = count * result.reprojection_px[unknown] ** 2 / (2 * gammaincinv(0.5 * np.maximum(count - 3.0, 1.0), 0.5))
    return float(np.sqrt(np.nanmedian(square)))
