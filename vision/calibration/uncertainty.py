"""What the calibration's own uncertainty does to points in space: a term beside that of the pixels, shared by all
frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.bundle_adjustment import INTRINSICS, N_CAMERA, POSE, intrinsics_of, pinhole

Array = NDArray[np.float64]

PARAMETERS = (*INTRINSICS, *POSE)
_AT_ONCE = 10_000  # points: each takes 2 kB of derivatives


def covariance_table(covariance: Array, labels: Sequence[tuple[str, str]]) -> pd.DataFrame:
    """Table ``calibration_covariance`` of a (p, p) covariance over (camera, parameter); what was held (NaN) has no
    row.
    """
    rows = [
        (*labels[i], *labels[j], covariance[i, j])
        for i in range(len(labels))
        for j in range(i, len(labels))
        if np.isfinite(covariance[i, j])
    ]
    return pd.DataFrame(rows, columns=["camera", "parameter", "other_camera", "other_parameter", "covariance"])


def covariance_of(table: pd.DataFrame, cameras: Sequence[Camera]) -> Array:
    """The matrix (p, p), p = N_CAMERA C, over ``PARAMETERS`` of each camera; 0 for what was held."""
    place = {
        (camera.name, name): N_CAMERA * c + k for c, camera in enumerate(cameras) for k, name in enumerate(PARAMETERS)
    }
    matrix = np.zeros((N_CAMERA * len(cameras), N_CAMERA * len(cameras)))
    for camera, name, other, other_name, value in table.itertuples(index=False):
        if (camera, name) in place and (other, other_name) in place:
            i, j = place[camera, name], place[other, other_name]
            matrix[i, j] = matrix[j, i] = value
    return matrix


def shifts(points_m: Array, cameras: Sequence[Camera]) -> Array:
    """How points (n, 3), triangulated from fixed pixels, move with each parameter of the cameras: (n, 3, N_CAMERA
    C).  Of one camera they move in their planes: their heights are given.
    """
    by_point, by_parameter = [], []
    for c, camera in enumerate(cameras):
        rotated = points_m @ camera.rotation.T
        _, by_intrinsics, by_place = pinhole(rotated + camera.translation_m, intrinsics_of(camera))
        x, y, z = rotated.T
        zero = 0 * x
        turned = -np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
        own = np.zeros((len(points_m), 2, N_CAMERA * len(cameras)))
        own[..., N_CAMERA * c : N_CAMERA * (c + 1)] = np.concatenate([by_intrinsics, by_place @ turned, by_place], -1)
        by_parameter.append(own)
        by_point.append(by_place @ camera.rotation)
    jacobian, moved = np.concatenate(by_point, 1), np.concatenate(by_parameter, 1)
    if len(cameras) == 1:
        in_plane = -np.linalg.solve(jacobian[..., :2], moved)
        return np.concatenate([in_plane, np.zeros_like(in_plane[:, :1])], 1)
    transposed = jacobian.transpose(0, 2, 1)
    return np.asarray(-np.linalg.solve(transposed @ jacobian, transposed @ moved), float)


def with_calibration_sd(
    points: pd.DataFrame,
    cameras: Sequence[Camera],
    covariance: pd.DataFrame,
    heights: Mapping[str, float] | None = None,
) -> pd.DataFrame:
    """Table ``points`` with ``x_calibration_sd_m`` and so on: sd of each coordinate from the calibration alone.

    Not in ``x_sd_m``: it hardly changes from frame to frame, and does not average out.  Of one camera, with the
    markers' ``heights``, it joins what the heights' own sd does; z stays null.
    """
    matrix, places = covariance_of(covariance, cameras), points[["x_m", "y_m", "z_m"]].to_numpy(float, copy=True)
    if heights is not None:
        places[:, 2] = [heights[marker] for marker in points["marker"]]
    sd = np.empty(places.shape)
    for first in range(0, len(places), _AT_ONCE):
        moved = shifts(places[first : first + _AT_ONCE], cameras)
        sd[first : first + _AT_ONCE] = np.sqrt(np.sum((moved @ matrix) * moved, axis=-1))
    names = [f"{axis}_calibration_sd_m" for axis in "xyz"]
    if heights is not None:
        sd[:, :2] = np.hypot(sd[:, :2], points[names[:2]].to_numpy(float))
        sd[:, 2] = np.nan
    return points.assign(**dict(zip(names, sd.T, strict=True)))
