"""What to photograph next: of many poses of the board, the one that would tell most about the lens.

Simulated by the covariance: a view adds what its points say of the lens once its own pose is taken out.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf, dpotri

from vision.calibration.bundle.equations import project
from vision.calibration.bundle.unknowns import Observation, State
from vision.calibration.single_camera import Single
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import MINIMUM_POINTS
from vision.pinhole import lens_of
from vision.validation.image_map import ImageMap

Array = NDArray[np.float64]
TILT_RAD = 0.6
PLACES = {-0.35: ("left", "top"), 0.0: ("", ""), 0.35: ("right", "bottom")}  # shares of the image from its middle
TILTS = {
    "facing the camera": (0.0, 0.0),
    "its top tilted away": (TILT_RAD, 0.0),
    "its top tilted towards the camera": (-TILT_RAD, 0.0),
    "its left side tilted away": (0.0, -TILT_RAD),
    "its right side tilted away": (0.0, TILT_RAD),
}
NEARER = (1.0, 0.7)  # of the distance that the views had


@dataclass(frozen=True)
class NextView:
    """How to hold the board, and the RMS over the image of the lens' sd [px], now and with the view added."""

    pose: str
    now_px: float
    then_px: float


def next_views(single: Single, board: Board, size_px: tuple[int, int], at: ImageMap, count: int = 3) -> list[NextView]:
    """The views that would help most, one after the other, each in addition to those before."""
    free = single.setting.lens_free(single.adjusted.state, 0)
    covariance = single.adjusted.lens_covariance(0)[np.ix_(free, free)]
    scale = np.sqrt(np.diag(covariance))
    known = np.linalg.inv(covariance / np.outer(scale, scale))
    candidates = [
        (pose, _says(pose_of, single, board, size_px, scale)) for pose, pose_of in _poses(single, board, size_px)
    ]
    candidates = [(pose, says) for pose, says in candidates if says is not None]
    views: list[NextView] = []
    slopes = at.slopes[..., free].reshape(-1, len(scale)) * scale
    squares = slopes.T @ slopes / len(slopes)  # the mean variance is the trace of these times the covariance
    now = _spread(known, squares)
    while candidates and len(views) < count:
        after = [_spread(known + says, squares) for _, says in candidates]
        best = int(np.argmin(after))
        views.append(NextView(candidates[best][0], now, after[best]))
        now, known = after[best], known + candidates[best][1]
    return views


def _spread(known: Array, squares: Array) -> float:
    """RMS over the image of the lens' sd [px], by the information ``known`` on its scaled numbers."""
    # By its root, in half of the time: hundreds of views are tried beside a spline's hundreds of numbers.
    root, failed = dpotrf(known)
    if failed:  # numbers of which rounding leaves no information
        return float(np.sqrt(max(np.sum(np.linalg.inv(known) * squares), 0.0)))
    inverse = np.triu(dpotri(root)[0])  # symmetric, and filled above its diagonal only
    return float(np.sqrt(max(2 * np.sum(inverse * squares) - np.diag(inverse) @ np.diag(squares), 0.0)))


def _poses(single: Single, board: Board, size_px: tuple[int, int]) -> Iterator[tuple[str, tuple[Array, Array]]]:
    """Poses of the board about the image, in words and as rotation and translation to the camera."""
    matrix, _ = lens_of(single.adjusted.state.intrinsics[0])
    usual_m = float(np.median(single.adjusted.state.translation[:, 2]))
    width_m, height_m = board.size_m
    for share in NEARER:
        distance_m = share * usual_m
        for across, (side, _) in PLACES.items():
            for down, (_, end) in PLACES.items():
                middle = (
                    np.array([across * size_px[0] / matrix[0, 0], down * size_px[1] / matrix[1, 1], 1]) * distance_m
                )
                where = " ".join(word for word in (end, side) if word) or "middle"
                for words, tilt in TILTS.items():
                    turn = np.asarray(cv2.Rodrigues(np.array([*tilt, 0.0]))[0], float)
                    shift = middle - turn @ np.array([width_m / 2, height_m / 2, 0])
                    yield f"board in the {where} of the image, {words}, at {distance_m:.2g} m", (turn, shift)


def _says(
    pose: tuple[Array, Array], single: Single, board: Board, size_px: tuple[int, int], scale: Array
) -> Array | None:
    """Information of a view on the lens' free numbers; None where too little of the board would be seen."""
    points_m = board.points_m()
    solved = single.adjusted.state
    state = State(solved.intrinsics, np.eye(3)[None], np.zeros((1, 3)), pose[0][None], pose[1][None], solved.splines)
    if ((points_m @ pose[0].T + pose[1])[:, 2] <= 0).any():
        return None
    uv, by_lens, _, by_pose = project(Observation(0, 0, False, points_m, points_m), state, single.setting, True)
    seen = ((uv > 0) & (uv < np.array(size_px) - 1)).all(1)
    if seen.sum() < max(MINIMUM_POINTS, len(points_m) / 2):
        return None
    lenses = by_lens[seen][..., single.setting.lens_free(solved, 0)].reshape(2 * seen.sum(), -1) * scale
    posed = np.linalg.qr(by_pose[seen].reshape(2 * seen.sum(), -1))[0]
    lenses = lenses - posed @ (posed.T @ lenses)
    return np.asarray(lenses.T @ lenses / single.adjusted.sigma_px[0] ** 2)
