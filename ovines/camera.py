"""A calibrated camera: OpenCV's pinhole with five, eight or twelve distortion terms, a spline where needed, in numpy.

``X_camera = R X_world + t``; pixels are of the full sensor, the centre of the
top-left one is (0, 0).  The file format ``calibration.json`` is read and
written here, so that every part of the application speaks of the same camera.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.lens_field import LensField, field_from_json, field_json

Array = NDArray[np.float64]
MOST_SIDE_PX = 1_000_000  # as recording.toml allows
MOST_NUMBER = 1e9  # of a matrix, a lens or a place (m): what no camera has, by far
LENS_TERMS = {5: "five terms", 8: "rational", 12: "thin prism"}  # lengths of `distortion`, and what the lens is called


@dataclass(frozen=True, eq=False)
class Camera:
    """One camera of the rig.

    Attributes
    ----------
    name : str
    sensor_size_px : (width, height)
    matrix : (3, 3) intrinsic matrix, pixels of the full sensor
    distortion : (5,) k1, k2, p1, p2, k3 (OpenCV's order); (8,) with k4, k5, k6 (rational); (12,) with s1 to s4 (thin
        prism) after them
    rotation : (3, 3), translation_m : (3,)   ``X_camera = rotation @ X_world + translation_m``
    rms_px : float, reprojection RMS of the calibration (NaN where unknown)
    field : what the lens model leaves over, where recordings have taught it; no part of calibration.json
    spline : the lens model's part that the distortion terms cannot say, where the calibration has one
    """

    name: str
    sensor_size_px: tuple[int, int]
    matrix: Array
    distortion: Array
    rotation: Array
    translation_m: Array
    rms_px: float = float("nan")
    field: LensField | None = None
    spline: LensField | None = None

    @property
    def centre_m(self) -> Array:
        """Optical centre in the world, shape (3,)."""
        return -self.rotation.T @ self.translation_m

    def project(self, points_m: ArrayLike) -> Array:
        """World points (..., 3) to full-sensor pixels (..., 2); NaN behind the camera."""
        return self.project_with_jacobian(points_m)[0]

    def project_with_jacobian(self, points_m: ArrayLike) -> tuple[Array, Array]:
        """Pixels (..., 2) and their derivative with respect to the world point (..., 2, 3), px/m."""
        camera = np.asarray(points_m, float) @ self.rotation.T + self.translation_m
        z = np.where(camera[..., 2] > 0, camera[..., 2], np.nan)
        x, y = camera[..., 0] / z, camera[..., 1] / z
        xd, yd, jd = _distort(x, y, self.distortion)
        focal = self.matrix[:2, :2]
        uv = np.stack([xd, yd], -1) @ focal.T + self.matrix[:2, 2]
        for bend in (self.spline, self.field):
            if bend is not None:  # a thousandth from pixel to pixel: no part of the derivative
                uv = bend.seen(uv)
        inverse, zero = 1.0 / z, np.zeros_like(z)
        jn = np.stack([np.stack([inverse, zero, -x * inverse], -1), np.stack([zero, inverse, -y * inverse], -1)], -2)
        return uv, focal @ jd @ jn @ self.rotation

    def normalise(self, uv_px: ArrayLike) -> Array:
        """Full-sensor pixels (..., 2) to undistorted image coordinates x/z, y/z (..., 2).

        Newton's iteration on the distortion polynomial; NaN where it does not converge
        (a pixel outside the range in which the polynomial can be inverted).
        """
        uv = self.by_terms(uv_px)
        target = (uv - self.matrix[:2, 2]) @ np.linalg.inv(self.matrix[:2, :2]).T
        guess = target.copy()
        for _ in range(12):
            xd, yd, jacobian = _distort(guess[..., 0], guess[..., 1], self.distortion)
            error = np.stack([xd, yd], -1) - target
            determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
            step = np.stack(
                [
                    jacobian[..., 1, 1] * error[..., 0] - jacobian[..., 0, 1] * error[..., 1],
                    jacobian[..., 0, 0] * error[..., 1] - jacobian[..., 1, 0] * error[..., 0],
                ],
                -1,
            )
            step /= determinant[..., None]
            guess = guess - step
            if not (np.abs(step) > 1e-14).any():
                break
        xd, yd, _ = _distort(guess[..., 0], guess[..., 1], self.distortion)
        missed = np.hypot(xd - target[..., 0], yd - target[..., 1]) > 1e-9
        return np.where(missed[..., None], np.nan, guess)

    def by_terms(self, uv_px: ArrayLike) -> Array:
        """Full-sensor pixels (..., 2) where matrix and distortion terms alone would have seen the same points."""
        uv = np.asarray(uv_px, float)
        for bend in (self.field, self.spline):
            if bend is not None:
                uv = uv - bend.at(uv)
        return uv

    def rays(self, uv_px: ArrayLike) -> Array:
        """Unit directions in the world (..., 3) in which full-sensor pixels (..., 2) look."""
        xy = self.normalise(uv_px)
        direction = np.concatenate([xy, np.ones_like(xy[..., :1])], -1) @ self.rotation
        return direction / np.linalg.norm(direction, axis=-1, keepdims=True)


def _distort(x: Array, y: Array, distortion: Array) -> tuple[Array, Array, Array]:
    """OpenCV's radial-tangential model, with its denominator and thin prism where given, and its (..., 2, 2)
    derivative.
    """
    k1, k2, p1, p2, k3 = distortion[:5]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
    if len(distortion) > 5:
        k4, k5, k6 = distortion[5:8]
        below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = radial / below
        slope = (slope - radial * 2 * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    dxdx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
    dxdy = x * y * slope + 2 * p1 * x + 2 * p2 * y
    dydx = dxdy
    dydy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
    if len(distortion) > 8:
        s1, s2, s3, s4 = distortion[8:12]
        xd, yd = xd + r2 * (s1 + r2 * s2), yd + r2 * (s3 + r2 * s4)
        across, down = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
        dxdx, dxdy, dydx, dydy = dxdx + across * x, dxdy + across * y, dydx + down * x, dydy + down * y
    return xd, yd, np.stack([np.stack([dxdx, dxdy], -1), np.stack([dydx, dydy], -1)], -2)


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
    points = midpoints(cameras, pixels)
    for _ in range(4):
        residual, jacobian = _stacked(cameras, pixels, weights, points)
        normal = np.swapaxes(jacobian, -1, -2) @ jacobian
        points = points + _solve(normal, np.einsum("nij,ni->nj", jacobian, residual))
    residual, jacobian = _stacked(cameras, pixels, weights, points)
    normal = np.swapaxes(jacobian, -1, -2) @ jacobian
    usable = np.isfinite(normal).all((-1, -2))
    covariance = np.full_like(normal, np.nan)
    covariance[usable] = np.linalg.inv(normal[usable])
    # The left null vector of the 4 x 3 Jacobian carries all of the misfit; its sign is fixed by the second view's v.
    null = np.full(residual.shape, np.nan)
    null[usable] = np.linalg.svd(jacobian[usable])[0][..., 3]
    null *= np.where(null[:, 3:] < 0, -1.0, 1.0)
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
    points = _solve(normal, right)
    known = [np.where(own[:, None], uv, 0.0) for own, uv in zip(seen, pixels, strict=True)]
    for _ in range(4):
        residual, jacobian = _stacked(cameras, known, weights, points)
        normal = np.swapaxes(jacobian, -1, -2) @ jacobian
        points = points + _solve(normal, np.einsum("nij,ni->nj", jacobian, residual))
    residual, jacobian = _stacked(cameras, known, weights, points)
    normal = np.swapaxes(jacobian, -1, -2) @ jacobian
    usable = np.isfinite(normal).all((-1, -2))
    covariance = np.full_like(normal, np.nan)
    covariance[usable] = np.linalg.inv(normal[usable])
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


def with_fields(cameras: Sequence[Camera], fields: Mapping[str, LensField]) -> list[Camera]:
    """The cameras with their fields by name (:func:`ovines.lens_field.lens_fields`); one without stays as it is."""
    return [replace(camera, field=fields.get(camera.name, camera.field)) for camera in cameras]


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


def read_calibration(path: Path) -> list[Camera]:
    """The cameras of a ``calibration.json`` (format 1); `InputError` with reasons when it is not one.

    Examples
    --------
    >>> from ovines.notebook import read_calibration
    >>> left, right = read_calibration("sample_data/series_tilted/calibration.json")
    >>> left.project([0.0, 0.0, 0.0]).round(1).tolist()  # the world's origin, pixels of the whole sensor
    [2031.3, 1539.7]
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(
            f"no file {path}",
            "a calibration.json",
            "check [calibration] file in recording.toml, or run `ovines calibrate`",
        ) from None
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: {error}", "a JSON file with format = 1", "write the calibration again") from None
    if not isinstance(content, dict) or content.get("format") != 1 or not isinstance(content.get("cameras"), list):
        raise InputError(
            f"{path}: no `format: 1` with a list of cameras",
            '{"format": 1, "world": "board", "cameras": [...]}',
            "see calibration.json in docs/reference/files.md",
        )
    cameras = [_camera_from_json(entry, f"{path}: cameras[{i}]") for i, entry in enumerate(content["cameras"])]
    names = [camera.name for camera in cameras]
    if len(set(names)) != len(names):
        raise InputError(f"{path}: camera names {names}", "each name once", "rename one of them")
    return cameras


def _camera_from_json(entry: Any, where: str) -> Camera:
    if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
        raise InputError(f"{where} has no name", "an object with a name", "name the camera as recording.toml does")

    def numbers(key: str, *shapes: tuple[int, ...]) -> Array:
        try:
            value = np.asarray(entry.get(key), float)
        except (TypeError, ValueError, OverflowError):
            value = np.empty(0)
        if value.shape not in shapes or not (np.abs(value) <= MOST_NUMBER).all():
            raise InputError(
                f"{where} ({entry['name']}): {key} = {str(entry.get(key))[:120]}",
                f"finite numbers up to {MOST_NUMBER:g}, of shape {' or '.join(map(str, shapes))}",
                f"write {key} again, e.g. with `ovines calibrate`",
            )
        return value

    rotation = numbers("rotation", (3, 3))
    if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4) or np.linalg.det(rotation) < 0:
        raise InputError(
            f"{where} ({entry['name']}): rotation is not one (R R^T differs from 1, or det R < 0)",
            "a proper rotation matrix",
            "check rows and columns, and that no axis is mirrored",
        )
    matrix = numbers("matrix", (3, 3))
    if matrix[0, 0] <= 0 or matrix[1, 1] <= 0:
        raise InputError(
            f"{where} ({entry['name']}): focal lengths {matrix[0, 0]}, {matrix[1, 1]}",
            "positive numbers of pixels",
            "check the intrinsic matrix",
        )
    rms_px = float("nan") if entry.get("rms_px") is None else float(numbers("rms_px", ()))
    width, height = numbers("sensor_size_px", (2,))
    if not all(0 < side <= MOST_SIDE_PX and side == int(side) for side in (width, height)):
        raise InputError(
            f"{where} ({entry['name']}): sensor_size_px = [{width:g}, {height:g}]",
            f"whole numbers from 1 to {MOST_SIDE_PX}",
            "write the sensor's size as recording.toml has it",
        )
    return Camera(
        entry["name"],
        (int(width), int(height)),
        matrix,
        numbers("distortion", *((terms,) for terms in LENS_TERMS)),
        rotation,
        numbers("translation_m", (3,)),
        rms_px,
        spline=field_from_json(entry.get("spline"), f"{where} ({entry['name']})"),
    )


def write_calibration(cameras: Sequence[Camera], path: Path, world: str = "board", **extra: Any) -> None:
    """Write ``calibration.json``; ``extra`` keys (provenance, standard deviations) go beside the cameras.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from ovines.camera import read_calibration, write_calibration
    >>> cameras = read_calibration("sample_data/series_tilted/calibration.json")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_calibration(cameras, Path(folder) / "calibration.json")
    ...     [camera.name for camera in read_calibration(Path(folder) / "calibration.json")]
    ['VW1', 'VW2']
    """
    write_text_whole(json.dumps({**calibration_json(cameras, world), **extra}, indent=1), path)


def calibration_json(cameras: Sequence[Camera], world: str = "board") -> dict[str, Any]:
    """The cameras as ``calibration.json`` has them, in JSON's own values."""
    entries = [
        {
            "name": c.name,
            "sensor_size_px": list(c.sensor_size_px),
            "matrix": c.matrix.tolist(),
            "distortion": c.distortion.tolist(),
            "rotation": c.rotation.tolist(),
            "translation_m": c.translation_m.tolist(),
            "rms_px": c.rms_px if np.isfinite(c.rms_px) else None,
            **({} if c.spline is None else {"spline": field_json(c.spline)}),
        }
        for c in cameras
    ]
    return {"format": 1, "world": world, "cameras": entries}
