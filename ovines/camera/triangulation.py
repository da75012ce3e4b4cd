"""Points from the pixels of two cameras or more, and what two views lack of meeting."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.camera.model import Camera
from ovines.errors import InputError

Array = NDArray[np.float64]
# Rounds of residuals and steps, the last without one; a point rests where its step is smaller than this share of the
# first camera's distance, after two or three as a rule: residuals and covariance are then those of where it rests, too.
MOST_STEPS, RESTS_SHARE = 5, 1e-11


@dataclass(frozen=True, eq=False)
class Triangulated:
    """What :func:`triangulate_points` gives for N points.

    ``points_m`` (N, 3); ``covariance_m2`` (N, 3, 3) from the pixels' sd; ``epipolar_px`` (N,) the one
    residual two views leave over, signed, scaled to the pixel sd of a single coordinate;
    ``reprojection_px`` (N,) RMS over the four coordinates.
    """

    points_m: Array
    covariance_m2: Array
    epipolar_px: Array
    reprojection_px: Array


def triangulate_points(
    cameras: Sequence[Camera], uv_px: Sequence[ArrayLike], sd_px: Sequence[ArrayLike]
) -> Triangulated:
    """World points seen by two cameras or more: the minimum of the weighted squared pixel errors.

    Parameters
    ----------
    cameras : two or more
    uv_px : per camera (N, 2), full-sensor pixels; NaN where one of more than two did not see the point
    sd_px : per camera (N,), standard deviation of each coordinate

    Notes
    -----
    Starts from the point nearest to all rays and takes Gauss-Newton steps (Hartley and Zisserman,
    Multiple View Geometry, ch. 12); vectorised over the points.  More than two views leave more than one residual:
    ``epipolar_px`` is then NaN.  A point that fewer than two saw is NaN.

    Examples
    --------
    >>> from ovines.camera import read_calibration, triangulate_points
    >>> cameras = read_calibration("sample_data/series_tilted/calibration.json")
    >>> pixels = [camera.project([[0.01, 0.02, 0.005]]) for camera in cameras]
    >>> triangulate_points(cameras, pixels, [[0.1], [0.1]]).points_m.round(9).tolist()
    [[0.01, 0.02, 0.005]]
    """
    if len(cameras) < 2:
        raise InputError(
            f"{len(cameras)} camera to triangulate with", "two or more", "give two [[cameras]] in recording.toml"
        )
    pixels = [camera.by_terms(uv) for camera, uv in zip(cameras, uv_px, strict=True)]
    cameras = [replace(camera, field=None, spline=None) for camera in cameras]
    weights = [1.0 / np.asarray(sd, float) for sd in sd_px]
    if len(cameras) > 2:
        return _triangulate_many(cameras, pixels, weights)
    points, residual, jacobian, covariance = _nearest(cameras, pixels, weights, midpoints(cameras, pixels))
    usable = np.asarray(np.isfinite(covariance).all((-1, -2)), bool)
    # The left null vector of the 4 x 3 Jacobian (its signed 3 x 3 minors) carries all of the misfit; its sign is fixed
    # by the second view's v.
    rows = np.where(usable[:, None, None], jacobian, np.nan).transpose(1, 0, 2)
    first, second = np.cross(rows[0], rows[1]), np.cross(rows[2], rows[3])
    pairs = ((rows[1], second), (-rows[0], second), (rows[3], first), (-rows[2], first))
    null = np.stack([np.einsum("ni,ni->n", row, other) for row, other in pairs], -1)
    with np.errstate(invalid="ignore"):
        null /= np.linalg.norm(null, axis=-1, keepdims=True) * np.where(null[:, 3:] < 0, -1.0, 1.0)
    scale = np.sqrt(np.mean([1 / w**2 for w in weights], 0))
    pixel_residual = residual / np.repeat(np.stack(weights, -1), 2, -1)
    return Triangulated(
        points, covariance, np.einsum("ni,ni->n", null, residual) * scale, np.sqrt(np.mean(pixel_residual**2, -1))
    )


def _triangulate_many(cameras: Sequence[Camera], pixels: Sequence[Array], weights: Sequence[Array]) -> Triangulated:
    """As `triangulate_points` of more than two cameras, each of which need not see every point."""
    seen = np.stack([np.isfinite(uv).all(-1) & np.isfinite(w) for uv, w in zip(pixels, weights, strict=True)])
    weights = [np.where(own, w, 0.0) for own, w in zip(seen, weights, strict=True)]
    # The nearest point to all rays: sum of (1 - d d') over them, times x, is the same sum times their origins.
    normal, right = np.zeros((seen.shape[1], 3, 3)), np.zeros((seen.shape[1], 3))
    for camera, uv, own in zip(cameras, pixels, seen, strict=True):
        ray = np.where(own[:, None], camera.rays(np.where(own[:, None], uv, camera.matrix[:2, 2])), 0.0)
        across = own[:, None, None] * np.eye(3) - ray[:, :, None] * ray[:, None, :]
        normal, right = normal + across, right + across @ camera.centre_m
    enough = seen.sum(0) >= 2
    normal[~enough] = np.nan
    known = [np.where(own[:, None], uv, 0.0) for own, uv in zip(seen, pixels, strict=True)]
    points, residual, _, covariance = _nearest(cameras, known, weights, _solve(normal, right))
    usable = np.isfinite(covariance).all((-1, -2))
    square = np.zeros(len(points))
    for k, weight in enumerate(weights):
        off = residual[:, 2 * k : 2 * k + 2] / np.where(weight > 0, weight, 1.0)[:, None]
        square += np.where(weight > 0, np.sum(off**2, -1), 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        reprojection = np.sqrt(square / (2 * seen.sum(0)))
    return Triangulated(points, covariance, np.full(len(points), np.nan), np.where(usable, reprojection, np.nan))


def baseline(cameras: Sequence[Camera]) -> Array:
    """Direction (2,) in the plane z = 0 from the first of two cameras to the second; x where one stands over the
    other.
    """
    apart = (cameras[1].centre_m - cameras[0].centre_m)[:2]
    length = float(np.hypot(*apart))
    return apart / length if length > 0 else np.array([1.0, 0.0])


def epipolar_residual_px(cameras: Sequence[Camera], first_xy: ArrayLike, second_xy: ArrayLike) -> Array:
    """What undistorted coordinates (..., 2) of two views (:meth:`Camera.normalise`) lack of meeting, in pixels.

    To first order (Sampson; Hartley and Zisserman, Multiple View Geometry, ch. 11.4), scaled to the sd of a single
    coordinate as :func:`triangulate_points` gives it, at a tenth of the work.  Its sign is its own.
    """
    rotation = cameras[1].rotation @ cameras[0].rotation.T
    x, y, z = cameras[1].translation_m - rotation @ cameras[0].translation_m
    essential = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ rotation
    a, b = np.asarray(first_xy, float), np.asarray(second_xy, float)
    ahead = a @ essential[:, :2].T + essential[:, 2]
    back = b @ essential[:2] + essential[2]
    focal = [float(np.sqrt(camera.matrix[0, 0] * camera.matrix[1, 1])) for camera in cameras]
    missed = (b * ahead[..., :2]).sum(-1) + ahead[..., 2]
    return missed / np.sqrt(
        (ahead[..., :2] ** 2).sum(-1) / focal[1] ** 2 + (back[..., :2] ** 2).sum(-1) / focal[0] ** 2
    )


def midpoints(cameras: Sequence[Camera], pixels: Sequence[Array]) -> Array:
    """Points (N, 3) half-way between the rays of two cameras' full-sensor pixels, two (N, 2): quick, nearly as good."""
    first, second = (camera.rays(uv) for camera, uv in zip(cameras, pixels, strict=True))
    base = cameras[1].centre_m - cameras[0].centre_m
    cosine = np.sum(first * second, -1)
    along_first, along_second = first @ base, second @ base
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (along_first - cosine * along_second) / (1 - cosine**2)
        t = (cosine * along_first - along_second) / (1 - cosine**2)
    return 0.5 * (cameras[0].centre_m + s[:, None] * first + cameras[1].centre_m + t[:, None] * second)


def _nearest(
    cameras: Sequence[Camera], pixels: Sequence[Array], weights: Sequence[Array], points: Array
) -> tuple[Array, Array, Array, Array]:
    """Gauss-Newton steps from ``points`` (N, 3) to where they rest, the weighted residuals (N, 2 C) and Jacobian
    (N, 2 C, 3) there, and the covariance (N, 3, 3)."""
    away_m = float(np.linalg.norm(cameras[0].centre_m)) or 1.0
    points = points.copy()
    residual, jacobian = np.full((len(points), 2 * len(cameras)), np.nan), np.empty((len(points), 2 * len(cameras), 3))
    normal, moves = np.empty((len(points), 3, 3)), np.arange(len(points))
    for left in reversed(range(MOST_STEPS)):
        own_px, own_weights = ([each[moves] for each in of] for of in (pixels, weights))
        residual[moves], jacobian[moves] = _stacked(cameras, own_px, own_weights, points[moves])
        normal[moves] = np.swapaxes(jacobian[moves], -1, -2) @ jacobian[moves]
        if not left:
            break
        step = _solve(normal[moves], np.einsum("nij,ni->nj", jacobian[moves], residual[moves]))
        points[moves] += step
        moves = moves[np.any(np.abs(step) > RESTS_SHARE * away_m, 1)]
        if not len(moves):
            break
    usable = np.isfinite(normal).all((-1, -2))
    covariance = np.full_like(normal, np.nan)
    covariance[usable] = np.linalg.inv(normal[usable])
    return points, residual, jacobian, covariance


def _stacked(
    cameras: Sequence[Camera], pixels: Sequence[Array], weights: Sequence[Array], points: Array
) -> tuple[Array, Array]:
    """Weighted residuals (N, 4), measured minus projected, and the weighted Jacobian (N, 4, 3)."""
    residuals, jacobians = [], []
    for camera, uv, weight in zip(cameras, pixels, weights, strict=True):
        projected, jacobian = camera.project_with_jacobian(points)
        residuals.append((uv - projected) * weight[:, None])
        jacobians.append(jacobian * weight[:, None, None])
    return np.concatenate(residuals, -1), np.concatenate(jacobians, -2)


def _solve(normal: Array, right: Array) -> Array:
    step = np.full_like(right, np.nan)
    good = np.isfinite(normal).all((-1, -2)) & np.isfinite(right).all(-1)
    step[good] = np.linalg.solve(normal[good], right[good][..., None])[..., 0]
    return step
