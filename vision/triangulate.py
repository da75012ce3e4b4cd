"""Tracks of two cameras to points in the world, with standard deviations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from ovines.camera import Camera, triangulate_points
from ovines.errors import InputError
from ovines.robust import spread

# Where a track carries no sd, this stands in until the epipolar residuals of the recording give the real one.
FIRST_GUESS_SD_PX = 0.1


def triangulate(
    tracks: pd.DataFrame, cameras: Sequence[Camera], window_offset_px: Mapping[str, Sequence[float]]
) -> pd.DataFrame:
    """Points in metres of every marker that both cameras saw in a frame.

    Parameters
    ----------
    tracks : table ``tracks`` (window pixels)
    cameras : calibrated cameras; the two that the tracks name are used
    window_offset_px : per camera name, top-left corner (u, v) of its window on the sensor

    Returns
    -------
    table ``points``: frame, time_s (of the first camera), marker, position and sd in metres,
    ``reprojection_px`` (RMS of the four coordinates) and ``epipolar_px`` (signed, the one residual that
    two views leave over).  A marker that only one camera saw has no row.

    Where ``sd_px`` is null, the sd is taken from the robust spread of the epipolar residual of the same markers.
    """
    by_name = {camera.name: camera for camera in cameras}
    names = [name for name in by_name if name in set(tracks["camera"])]
    strangers = sorted(set(tracks["camera"]) - set(by_name))
    if strangers:
        raise InputError(
            f"tracks of camera {strangers[0]!r}",
            f"one of the calibrated cameras {sorted(by_name)}",
            "give recording.toml and calibration.json the same camera names",
        )
    if len(names) != 2:
        raise InputError(
            f"tracks of {len(names)} camera(s): {names}",
            "tracks of two cameras",
            "one camera alone gives no depth: check the second camera's tracks",
        )
    views = []
    for name in names:
        view = tracks.loc[tracks["camera"] == name, ["frame", "time_s", "marker", "u_px", "v_px", "sd_px"]].copy()
        offset = window_offset_px.get(name, (0, 0))
        view["u_px"] = view["u_px"].astype(float) + offset[0]
        view["v_px"] = view["v_px"].astype(float) + offset[1]
        views.append(view)
    pairs = views[0].merge(views[1], on=["frame", "marker"], suffixes=("", "_2"))
    uv = [pairs[["u_px", "v_px"]].to_numpy(float), pairs[["u_px_2", "v_px_2"]].to_numpy(float)]
    sd = [pairs[column].to_numpy(float) for column in ("sd_px", "sd_px_2")]
    if any((s <= 0).any() for s in sd):
        raise InputError(
            "tracks with sd_px of 0 or below",
            "a standard deviation above 0, or null where it is unknown",
            "write null where it is unknown",
        )
    unknown = np.isnan(sd[0]) | np.isnan(sd[1])
    sd = [np.where(unknown, FIRST_GUESS_SD_PX, s) for s in sd]
    pair = [by_name[name] for name in names]
    result = triangulate_points(pair, uv, sd)
    if unknown.any():
        measured_px = spread(result.epipolar_px[unknown])
        if measured_px > 0:
            sd = [np.where(unknown, measured_px, s) for s in sd]
            result = triangulate_points(pair, uv, sd)
    position_sd = np.sqrt(np.diagonal(result.covariance_m2, axis1=1, axis2=2))
    points = pd.DataFrame(
        {
            "frame": pairs["frame"].to_numpy(),
            "time_s": pairs["time_s"].to_numpy(float),
            "marker": pairs["marker"].to_numpy(),
            **{f"{axis}_m": result.points_m[:, i] for i, axis in enumerate("xyz")},
            **{f"{axis}_sd_m": position_sd[:, i] for i, axis in enumerate("xyz")},
            "reprojection_px": result.reprojection_px,
            "epipolar_px": result.epipolar_px,
        }
    )
    points = points[np.isfinite(points["x_m"])]
    return points.sort_values(["frame", "marker"], kind="stable").reset_index(drop=True)
