"""OpenCV's lens of up to twelve distortion terms with its derivatives, its numbers in one row."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovines.camera import LENS_TERMS, Camera
from vision.compiled import compiled

Array = NDArray[np.float64]
INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
FX, FY, CX, CY, K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4 = range(16)  # their places
N_INTRINSICS = len(INTRINSICS)


def lens_of(intrinsics: Array) -> tuple[Array, Array]:
    """Camera matrix (3, 3) and the distortion in OpenCV's order, as short as its terms allow (5, 8 or 12)."""
    fx, fy, cx, cy = intrinsics[:K1]
    terms = next(n for n in LENS_TERMS if not intrinsics[K1 + n :].any())
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(intrinsics[K1 : K1 + terms])


def intrinsics_of(camera: Camera) -> Array:
    """The camera's lens as ``State`` has it (N_INTRINSICS,)."""
    k, missing = camera.matrix, N_INTRINSICS - K1 - len(camera.distortion)
    return np.concatenate([[k[0, 0], k[1, 1], k[0, 2], k[1, 2]], camera.distortion, np.zeros(missing)])


def pinhole(x_camera: Array, intrinsics: Array) -> tuple[Array, Array, Array]:
    """OpenCV's lens of up to twelve terms: pixels (n, 2), derivatives by the intrinsics (n, 2, N_INTRINSICS) and by the
    point (n, 2, 3).
    """
    count = len(x_camera)
    pixels, by_intrinsics, by_point = np.empty((count, 2)), np.zeros((count, 2, N_INTRINSICS)), np.empty((count, 2, 3))
    fill(np.ascontiguousarray(x_camera), np.ascontiguousarray(intrinsics), pixels, by_intrinsics, by_point)
    return pixels, by_intrinsics, by_point


@compiled
def fill(x_camera: Array, intrinsics: Array, pixels: Array, by_intrinsics: Array, by_point: Array) -> None:
    """What :func:`pinhole` returns, into its arrays: a view's few dozen points took a hundred calls of numpy."""
    fx, fy, cx, cy = intrinsics[FX], intrinsics[FY], intrinsics[CX], intrinsics[CY]
    k1, k2, k3, k4, k5, k6 = (
        intrinsics[K1], intrinsics[K2], intrinsics[K3], intrinsics[K4], intrinsics[K5], intrinsics[K6]
    )  # fmt: skip
    p1, p2 = intrinsics[P1], intrinsics[P2]
    s1, s2, s3, s4 = intrinsics[S1], intrinsics[S2], intrinsics[S3], intrinsics[S4]
    for i in range(len(x_camera)):
        inverse = 1 / x_camera[i, 2]
        x, y = x_camera[i, 0] * inverse, x_camera[i, 1] * inverse
        r2 = x * x + y * y
        below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
        radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below
        slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
        xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2)
        yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + r2 * s4)
        pixels[i, 0], pixels[i, 1] = fx * xd + cx, fy * yd + cy
        across, down = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
        mixed = x * y * slope + 2 * p1 * x + 2 * p2 * y
        across_x = fx * (radial + x * x * slope + 2 * p1 * y + 6 * p2 * x + across * x)
        down_y = fy * (radial + y * y * slope + 6 * p1 * y + 2 * p2 * x + down * y)
        across_y, down_x = fx * (mixed + across * y), fy * (mixed + down * x)
        by_point[i, 0, 0], by_point[i, 0, 1] = across_x * inverse, across_y * inverse
        by_point[i, 0, 2] = -(across_x * x + across_y * y) * inverse
        by_point[i, 1, 0], by_point[i, 1, 1] = down_x * inverse, down_y * inverse
        by_point[i, 1, 2] = -(down_x * x + down_y * y) * inverse
        by_intrinsics[i, 0, FX], by_intrinsics[i, 1, FY] = xd, yd
        by_intrinsics[i, 0, CX], by_intrinsics[i, 1, CY] = 1.0, 1.0
        for axis in range(2):
            power = (fx * x if axis == 0 else fy * y) * r2 / below
            for above, under in ((K1, K4), (K2, K5), (K3, K6)):
                by_intrinsics[i, axis, above], by_intrinsics[i, axis, under] = power, -radial * power
                power *= r2
        by_intrinsics[i, 0, P1], by_intrinsics[i, 0, P2] = 2 * fx * x * y, fx * (r2 + 2 * x * x)
        by_intrinsics[i, 1, P1], by_intrinsics[i, 1, P2] = fy * (r2 + 2 * y * y), 2 * fy * x * y
        by_intrinsics[i, 0, S1], by_intrinsics[i, 0, S2] = fx * r2, fx * r2 * r2
        by_intrinsics[i, 1, S3], by_intrinsics[i, 1, S4] = fy * r2, fy * r2 * r2
