"""From a circle's picture to the picture of its centre, and from pixels to points on a plane."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.markers.row import U, V, radius_px

Array = NDArray[np.float64]


def on_plane(camera: Camera, uv_px: Array, height_m: Array | float) -> Array:
    """World points (n, 3) where the rays of full-sensor pixels (n, 2) intersect the plane(s) z = height_m."""
    return where_on_plane(camera, camera.normalise(uv_px), height_m)


def where_on_plane(camera: Camera, xy: Array, height_m: Array | float) -> Array:
    """As `on_plane`, of undistorted image coordinates x/z, y/z (n, 2)."""
    direction = xy @ camera.rotation[:2] + camera.rotation[2]
    distance = (np.asarray(height_m, float) - camera.centre_m[2]) / direction[:, 2]
    return camera.centre_m + distance[:, None] * direction


def circle_centres(
    fits: Array, camera: Camera, height_m: Array | float, window_offset_px: tuple[float, float] = (0.0, 0.0)
) -> tuple[Array, Array]:
    """Image of each circle's centre, from the centre of its image ellipse.

    The picture of a circle's centre is not the centre of its elliptic picture, by about
    f r^2 sin(a) cos(a) / (Z^2 - r^2 sin^2(a)).  The circle lies in the plane z = height_m facing +z; its
    radius follows from the ellipse's area.  The offset is the exact one of the pinhole (from the dual conic);
    distortion enters through its slope only.

    Returns
    -------
    uv_px : (n, 2) corrected centres in window pixels;  radius_m : (n,) radii of the circles
    """
    centre = on_plane(camera, fits[:, [U, V]] + np.asarray(window_offset_px, float), height_m)
    jacobian = camera.project_with_jacobian(centre)[1][..., :2]
    radius_m = radius_px(fits) / np.sqrt(np.abs(np.linalg.det(jacobian)))
    seen = centre @ camera.rotation.T + camera.translation_m
    h1, h2 = camera.rotation[:, 0], camera.rotation[:, 1]
    lean = (radius_m**2)[:, None] * (h1[2] * h1[:2] + h2[2] * h2[:2]) - seen[:, 2:] * seen[:, :2]
    ellipse = lean / ((radius_m**2) * (h1[2] ** 2 + h2[2] ** 2) - seen[:, 2] ** 2)[:, None]
    offset = ellipse - seen[:, :2] / seen[:, 2:]
    focal = np.diag(camera.matrix)[:2]
    return fits[:, [U, V]] - offset * focal, radius_m
