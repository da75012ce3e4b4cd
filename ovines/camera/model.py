"""OpenCV's pinhole with five, eight or twelve distortion terms, a spline where needed, in numpy.

``X_camera = R X_world + t``; pixels are of the full sensor, the centre of the top-left one is (0, 0).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.lens_field import LensField

Array = NDArray[np.float64]
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
        x, y, _ = self._plane(points_m)
        return self._pixels(*_distorted(x, y, self.distortion)[:2])

    def project_with_jacobian(self, points_m: ArrayLike) -> tuple[Array, Array]:
        """Pixels (..., 2) and their derivative with respect to the world point (..., 2, 3), px/m."""
        x, y, z = self._plane(points_m)
        xd, yd, jd = _distort(x, y, self.distortion)
        inverse, zero = 1.0 / z, np.zeros_like(z)
        jn = np.stack([np.stack([inverse, zero, -x * inverse], -1), np.stack([zero, inverse, -y * inverse], -1)], -2)
        # The bends change by a thousandth from pixel to pixel: no part of the derivative.
        return self._pixels(xd, yd), self.matrix[:2, :2] @ jd @ jn @ self.rotation

    def _plane(self, points_m: ArrayLike) -> tuple[Array, Array, Array]:
        """World points (..., 3) as x/z, y/z and the depth z [m], each (...); NaN behind the camera."""
        camera = np.asarray(points_m, float) @ self.rotation.T + self.translation_m
        z = np.where(camera[..., 2] > 0, camera[..., 2], np.nan)
        return camera[..., 0] / z, camera[..., 1] / z, z

    def _pixels(self, xd: Array, yd: Array) -> Array:
        """Full-sensor pixels (..., 2) of distorted image coordinates, each (...)."""
        uv = np.stack([xd, yd], -1) @ self.matrix[:2, :2].T + self.matrix[:2, 2]
        for bend in (self.spline, self.field):
            if bend is not None:
                uv = bend.seen(uv)
        return uv

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
        xd, yd, *_ = _distorted(guess[..., 0], guess[..., 1], self.distortion)
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


def _distorted(x: Array, y: Array, distortion: Array) -> tuple[Array, Array, Array, Array | float]:
    """OpenCV's radial-tangential model, with its denominator and thin prism where given: the image coordinates x and y,
    the radial factor and its denominator.
    """
    k1, k2, p1, p2, k3 = distortion[:5]
    r2 = x * x + y * y
    radial, below = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), 1.0
    if len(distortion) > 5:
        k4, k5, k6 = distortion[5:8]
        below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = radial / below
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    if len(distortion) > 8:
        s1, s2, s3, s4 = distortion[8:12]
        xd, yd = xd + r2 * (s1 + r2 * s2), yd + r2 * (s3 + r2 * s4)
    return xd, yd, radial, below


def _distort(x: Array, y: Array, distortion: Array) -> tuple[Array, Array, Array]:
    """:func:`_distorted` x and y, and their (..., 2, 2) derivative."""
    xd, yd, radial, below = _distorted(x, y, distortion)
    k1, k2, p1, p2, k3 = distortion[:5]
    r2 = x * x + y * y
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3))
    if len(distortion) > 5:
        k4, k5, k6 = distortion[5:8]
        slope = (slope - radial * 2 * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
    dxdx = radial + x * x * slope + 2 * p1 * y + 6 * p2 * x
    dxdy = x * y * slope + 2 * p1 * x + 2 * p2 * y
    dydx = dxdy
    dydy = radial + y * y * slope + 6 * p1 * y + 2 * p2 * x
    if len(distortion) > 8:
        s1, s2, s3, s4 = distortion[8:12]
        across, down = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
        dxdx, dxdy, dydx, dydy = dxdx + across * x, dxdy + across * y, dydx + down * x, dydy + down * y
    return xd, yd, np.stack([np.stack([dxdx, dxdy], -1), np.stack([dydx, dydy], -1)], -2)


def with_fields(cameras: Sequence[Camera], fields: Mapping[str, LensField]) -> list[Camera]:
    """The cameras with their fields by name (:func:`ovines.lens_field.lens_fields`); one without stays as it is."""
    return [replace(camera, field=fields.get(camera.name, camera.field)) for camera in cameras]
