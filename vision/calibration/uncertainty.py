"""What the calibration's own uncertainty does to points in space: a term beside that of the pixels, shared by all
frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.bundle.unknowns import N_CAMERA, POSE, n_parameters, spline_places
from vision.pinhole import INTRINSICS, intrinsics_of, pinhole

Array = NDArray[np.float64]

PARAMETERS = (*INTRINSICS, *POSE)
_AT_ONCE = 400_000  # derivatives by parameters, of as many points as have them


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
    """The matrix (p, p) over ``PARAMETERS`` of each camera, then the splines of those that have one; 0 for what was
    held.
    """
    splines = [camera.spline for camera in cameras]
    place = {
        (camera.name, name): N_CAMERA * c + k for c, camera in enumerate(cameras) for k, name in enumerate(PARAMETERS)
    }
    for c, (camera, spline) in enumerate(zip(cameras, splines, strict=True)):
        if spline is not None:
            place.update(zip([(camera.name, name) for name in spline.labels], spline_places(splines, c), strict=True))
    matrix = np.zeros((n_parameters(splines),) * 2)
    named = [table[["camera", "parameter"]], table[["other_camera", "other_parameter"]]]
    at, other = (np.array([place.get(pair, -1) for pair in one.itertuples(False, None)], int) for one in named)
    known = (at >= 0) & (other >= 0)
    at, other = at[known], other[known]
    matrix[at, other] = matrix[other, at] = table["covariance"].to_numpy(float)[known]
    return matrix


def by_parameters(points_m: Array, cameras: Sequence[Camera], c: int) -> tuple[Array, Array]:
    """How pixels of points (n, 3) in camera ``c`` move with each parameter of all cameras (n, 2, p), as
    `covariance_of` orders them, and with the points (n, 2, 3).
    """
    camera, splines = cameras[c], [one.spline for one in cameras]
    rotated = points_m @ camera.rotation.T
    _, by_intrinsics, by_place = pinhole(rotated + camera.translation_m, intrinsics_of(camera))
    x, y, z = rotated.T
    zero = 0 * x
    turned = -np.stack([np.stack([zero, -z, y], -1), np.stack([z, zero, -x], -1), np.stack([-y, x, zero], -1)], -2)
    own = np.zeros((len(points_m), 2, n_parameters(splines)))
    own[..., N_CAMERA * c : N_CAMERA * (c + 1)] = np.concatenate([by_intrinsics, by_place @ turned, by_place], -1)
    if camera.spline is not None:
        own[..., spline_places(splines, c)] = camera.spline.slopes(camera.project(points_m))
    return own, by_place @ camera.rotation


def shifts(points_m: Array, cameras: Sequence[Camera]) -> Array:
    """How points (n, 3), triangulated from fixed pixels, move with each parameter of the cameras, as `covariance_of`
    orders them: (n, 3, p).  Of one camera they move in their planes: their heights are given.
    """
    by_parameter, by_point = zip(*(by_parameters(points_m, cameras, c) for c in range(len(cameras))), strict=True)
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
    at_once = max(1, _AT_ONCE // len(matrix))
    for first in range(0, len(places), at_once):
        moved = shifts(places[first : first + at_once], cameras)
        sd[first : first + at_once] = np.sqrt(np.sum((moved @ matrix) * moved, axis=-1))
    names = [f"{axis}_calibration_sd_m" for axis in "xyz"]
    if heights is not None:
        sd[:, :2] = np.hypot(sd[:, :2], points[names[:2]].to_numpy(float))
        sd[:, 2] = np.nan
    return points.assign(**dict(zip(names, sd.T, strict=True)))
