"""A camera from four or more known points: what there is where nobody photographed a board.

A homography of the plane, but for markers above it: the camera behind it has square pixels, its centre near the
picture's middle and a lens that bends little, each within a prior sd.  What the points leave open is in the
covariance, which the chain carries to every place.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ovines.camera import Camera
from ovines.errors import InputError
from vision.calibration.bundle.unknowns import N_CAMERA, POSE
from vision.calibration.single_camera import CENTRE_SD_SHARE
from vision.pinhole import CX, CY, FX, FY, INTRINSICS, K1, K2, N_INTRINSICS

Array = NDArray[np.float64]

FEWEST = 4
CORNER_SD = 0.05  # of the radius at the image's corner, by k1 and as much by k2: phones and machine lenses keep within
FOCAL_WIDTHS = np.geomspace(0.4, 12.0, 18)  # focal lengths tried, in image widths
FOCAL_MIDDLE, FOCAL_SD = 1.5, 1.0  # of a lens nobody knows: widths, and sd of the logarithm
FOLD_STEPS = 100  # places from the axis to the farthest point at which the distortion is looked at
FLAT = 1e-3  # second singular value of the points about their middle, over the first: less is a line
MOST_STEPS = 300  # of a fit: one that finds its camera takes some forty, one of points that no camera sees a thousand
MISFIT_SDS = 5.0  # rms over the stated sd from which on a point is wrong
_LOG_F, _CU, _CV, _D1, _D2, _R, _T = 0, 1, 2, 3, 4, slice(5, 8), slice(8, 11)


@dataclass(frozen=True, eq=False)
class KnownPointsCamera:
    """The camera, its covariance (N_CAMERA, N_CAMERA) with labels as `vision.calibrate` gives it, and the RMS misfit.

    ``focal_sd`` is the focal length's relative sd.
    """

    camera: Camera
    covariance: Array
    labels: list[tuple[str, str]]
    rms_px: float
    focal_sd: float


def camera_of_known_points(
    name: str, sensor_size_px: tuple[int, int], uv_px: Array, points_m: Array, sd_px: Array
) -> KnownPointsCamera:
    """The camera that sees points (n, 3) of the world at full-sensor pixels (n, 2), known to ``sd_px`` (n,).

    `InputError` for fewer than four, for points on one line, points seen from below, and points that no camera sees so.

    Examples
    --------
    >>> import numpy as np
    >>> from ovines.camera import read_calibration
    >>> from vision.known_points import camera_of_known_points
    >>> camera = read_calibration("sample_data/series_tilted/calibration.json")[0]
    >>> corners = np.array([[-0.1, -0.06, 0], [0.1, -0.06, 0], [0.1, 0.06, 0], [-0.1, 0.06, 0]])
    >>> found = camera_of_known_points("VW1", camera.sensor_size_px, camera.project(corners), corners, np.full(4, 0.3))
    >>> bool(found.rms_px < 0.1)
    True
    """
    _refuse_poor(name, uv_px, points_m)
    width, height = sensor_size_px
    middle = np.array([(width - 1) / 2, (height - 1) / 2])
    corner = 0.5 * float(np.hypot(width, height)) / width  # in image widths: a focal length makes it a tangent

    def residuals(p: Array) -> Array:
        uv = _project(p, points_m, width)
        off = ((uv - uv_px) / sd_px[:, None]).ravel()
        tangent = corner * np.exp(-p[_LOG_F])
        prior = [
            (p[_LOG_F] - np.log(FOCAL_MIDDLE)) / FOCAL_SD,
            *((p[[_CU, _CV]] - middle) / (CENTRE_SD_SHARE * width)),
            p[_D1] * tangent**2 / CORNER_SD,
            p[_D2] * tangent**4 / CORNER_SD,
        ]
        return np.concatenate([off, prior])

    starts = _starts(uv_px, points_m, middle, width)
    if not starts:
        raise _no_camera(name)
    tried = [least_squares(residuals, start, x_scale="jac", method="trf", max_nfev=MOST_STEPS) for start in starts]
    above = [one for one in tried if _centre(one.x)[2] > 0 and np.isfinite(one.cost)]
    if not above:
        raise InputError(
            f"{name}: the points are seen as if from below the plane",
            "x, y of a right-handed world whose z points up, towards the camera",
            "check that x and y are not exchanged, and the points' order",
        )
    above = [one for one in above if _lens_holds(one.x, points_m)]
    if not above:
        raise _no_camera(name)
    best = min(above, key=lambda one: one.cost)
    off = best.fun[: 2 * len(uv_px)]
    misfit = float(np.sqrt(np.mean(off**2)))
    rms_px = float(np.sqrt(2 * np.mean((off * np.repeat(sd_px, 2)) ** 2)))
    free = max(2 * len(uv_px) - 7, 1)
    if misfit > MISFIT_SDS:
        raise InputError(
            f"{name}: no camera sees these points: they miss by {rms_px:.3g} px rms, {misfit:.2g} of their sd",
            "pixels and places of the same points, in the same order",
            "check the file, or say in a column sd_px how well the pixels are known",
        )
    scale = max(1.0, float(np.sum(off**2)) / free)
    try:
        own = scale * np.linalg.inv(best.jac.T @ best.jac)
    except np.linalg.LinAlgError:
        raise _no_camera(name) from None
    camera = _camera(name, sensor_size_px, best.x, rms_px)
    # The covariance is wanted over focal lengths in pixels, and over a turn after the camera's own rotation.
    change = np.zeros((N_CAMERA, len(best.x)))
    change[FX, _LOG_F] = change[FY, _LOG_F] = camera.matrix[0, 0]
    change[CX, _CU] = change[CY, _CV] = change[K1, _D1] = change[K2, _D2] = 1.0
    change[N_INTRINSICS : N_INTRINSICS + 3, _R] = _left_turns(best.x[_R])
    change[N_INTRINSICS + 3 :, _T] = np.eye(3)
    covariance = change @ own @ change.T
    held = np.ones(N_CAMERA, bool)
    held[[FX, FY, CX, CY, K1, K2, *range(N_INTRINSICS, N_CAMERA)]] = False
    covariance[held, :] = covariance[:, held] = np.nan
    labels = [(name, parameter) for parameter in (*INTRINSICS, *POSE)]
    return KnownPointsCamera(camera, covariance, labels, rms_px, float(np.sqrt(own[_LOG_F, _LOG_F])))


def _refuse_poor(name: str, uv_px: Array, points_m: Array) -> None:
    if len(points_m) < FEWEST:
        raise InputError(f"{name}: {len(points_m)} known points", f"{FEWEST} or more", "add points to the file")
    for values, where in ((uv_px, "in the picture"), (points_m, "in the world")):
        size = np.linalg.svd(values - values.mean(0), compute_uv=False)
        if size[1] <= FLAT * size[0]:
            raise InputError(
                f"{name}: the known points lie on one line {where}",
                "points spread over the plane, best about its corners",
                "take others",
            )


def _starts(uv_px: Array, points_m: Array, middle: Array, width: int) -> list[Array]:
    """Unknowns to begin with: poses that OpenCV finds at several focal lengths, the few that miss least."""
    found: list[tuple[float, Array]] = []
    flat = np.ptp(points_m[:, 2]) < FLAT * np.ptp(points_m[:, :2], axis=0).max()
    level = float(points_m[:, 2].mean()) if flat else 0.0
    local = np.ascontiguousarray(points_m - [0.0, 0.0, level])
    for widths in FOCAL_WIDTHS:
        matrix = np.array([[widths * width, 0, middle[0]], [0, widths * width, middle[1]], [0, 0, 1.0]])
        way = cv2.SOLVEPNP_IPPE if flat else cv2.SOLVEPNP_SQPNP
        try:
            _, turns, shifts, _ = cv2.solvePnPGeneric(local, np.ascontiguousarray(uv_px), matrix, None, flags=way)
        except cv2.error:
            continue
        for turn, shift in zip(turns, shifts, strict=True):
            shift = shift.ravel() - cv2.Rodrigues(turn)[0][:, 2] * level
            start = np.concatenate([[np.log(widths), *middle, 0.0, 0.0], turn.ravel(), shift])
            miss = float(np.sum((_project(start, points_m, width) - uv_px) ** 2))
            if np.isfinite(miss):
                found.append((miss, start))
    found.sort(key=lambda one: one[0])
    return [start for _, start in found[:6]]


def _project(p: Array, points_m: Array, width: int) -> Array:
    seen = points_m @ cv2.Rodrigues(p[_R])[0].T + p[_T]
    depth = np.where(seen[:, 2] > 1e-9, seen[:, 2], 1e-9)  # behind the camera: far off, and no infinity
    x, y = seen[:, 0] / depth, seen[:, 1] / depth
    r2 = x * x + y * y
    scale = np.exp(p[_LOG_F]) * width * (1 + r2 * (p[_D1] + r2 * p[_D2]))
    return np.column_stack([scale * x + p[_CU], scale * y + p[_CV]])


def _lens_holds(p: Array, points_m: Array) -> bool:
    """Whether all points lie before the camera, and where its distortion still takes what is farther out farther out:
    beyond, it folds the picture, in which points exchanged may stand as well.
    """
    seen = points_m @ cv2.Rodrigues(p[_R])[0].T + p[_T]
    if not (seen[:, 2] > 0).all():
        return False
    r2 = np.linspace(0.0, float(np.max(np.sum((seen[:, :2] / seen[:, 2:]) ** 2, axis=1))), FOLD_STEPS)
    return bool((1 + r2 * (3 * p[_D1] + 5 * r2 * p[_D2]) > 0).all())


def _camera(name: str, size_px: tuple[int, int], p: Array, rms_px: float) -> Camera:
    f = float(np.exp(p[_LOG_F])) * size_px[0]
    matrix = np.array([[f, 0.0, p[_CU]], [0.0, f, p[_CV]], [0.0, 0.0, 1.0]])
    lens = np.array([p[_D1], p[_D2], 0.0, 0.0, 0.0])
    return Camera(name, size_px, matrix, lens, np.asarray(cv2.Rodrigues(p[_R])[0]), p[_T].copy(), rms_px)


def _centre(p: Array) -> Array:
    return np.asarray(-cv2.Rodrigues(p[_R])[0].T @ p[_T])


def _left_turns(rotation_vector: Array) -> Array:
    """Derivative (3, 3) of the turn that follows a rotation by its rotation vector's change: the left Jacobian."""
    angle = float(np.linalg.norm(rotation_vector))
    x, y, z = rotation_vector
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    if angle < 1e-8:
        return np.asarray(np.eye(3) + 0.5 * cross)
    first, second = (1 - np.cos(angle)) / angle**2, (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


def _no_camera(name: str) -> InputError:
    return InputError(
        f"{name}: no camera sees these points so",
        "pixels and places of the same points, in the same order",
        "check the file",
    )
