"""A board found in an image: which of its points, where, how surely."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.boards import Board
from vision.calibration_corner import refine_corners
from vision.calibration_dots import detect_dots
from vision.centre import SD, U, V, radius_px

Array = NDArray[np.float64]
MINIMUM_POINTS = 6
# Of the printed gap between a square's edge and its marker: the corner's neighbourhood is clean to sqrt(2) of it.
CLEAN_SHARE = 1.15


@dataclass(frozen=True, eq=False)
class View:
    """What one image shows of the board: ``points`` (n,) numbers into ``board.points_m()``, their pixels (n, 2), sd (n,).

    ``marker_px``: mean edge of the markers (diameter of the dots) in pixels, NaN for a chessboard.  ``discs``: rows of
    ``vision.centre.fit_discs`` of a dot grid, from which the perspective bias of the centres is taken away later.
    """

    name: str
    points: NDArray[np.int64]
    uv_px: Array
    sd_px: Array
    marker_px: float = float("nan")
    discs: Array | None = None

    def only(self, chosen: NDArray[np.bool_]) -> View:
        """The view with the chosen points."""
        return View(self.name, self.points[chosen], self.uv_px[chosen], self.sd_px[chosen], self.marker_px,
                    None if self.discs is None else self.discs[chosen])


def detect(image: NDArray[np.uint8], board: Board, name: str = "") -> View:
    """Points of ``board`` in a grey image; a view without points when it is not there.  Never raises for content."""
    if board.inverted:
        image = 255 - image
    if board.kind == "dots":
        numbers, fits = detect_dots(image, board)
        return View(name, numbers, fits[:, [U, V]], fits[:, SD], 2 * float(radius_px(fits).mean()) if len(fits) else np.nan, fits)
    if board.kind == "chessboard":
        return _chessboard(image, board, name)
    corners, found, markers, _ = _detector(board, image.shape).detectBoard(image)
    if corners is None or len(corners) == 0:
        return _empty(name)
    uv = corners.reshape(-1, 2).astype(float)
    edge = np.mean([np.linalg.norm(np.diff(m.reshape(4, 2), axis=0), axis=1).mean() for m in markers])
    gap = 0.5 * (board.square_size_m / board.marker_size_m - 1)
    # The markers tell pixels per metre; a tilted board's narrower direction has the smaller gap.
    narrow = min(np.linalg.norm(np.diff(m.reshape(4, 2), axis=0), axis=1).min() for m in markers)
    uv, sd = refine_corners(image, uv, np.full(len(uv), CLEAN_SHARE * gap * 0.5 * (edge + narrow)))
    return View(name, np.asarray(found, np.int64).ravel(), uv, sd, float(edge))


def _empty(name: str) -> View:
    return View(name, np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))


def _detector(board: Board, shape: tuple[int, ...]) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(board.opencv(), cv2.aruco.CharucoParameters(), marker_parameters(shape))


def marker_parameters(shape: tuple[int, ...]) -> cv2.aruco.DetectorParameters:
    """OpenCV's, but for its smallest perimeter of 3 % of the image's longer side: 123 px on 4096, so a 30 px marker vanishes."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = min(0.03, 40.0 / max(shape))
    return parameters


def _chessboard(image: NDArray[np.uint8], board: Board, name: str) -> View:
    columns, rows = board.squares[0] - 1, board.squares[1] - 1
    found, corners = cv2.findChessboardCorners(image, (columns, rows),
                                               flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not found:
        found, corners = cv2.findChessboardCornersSB(image, (columns, rows), flags=cv2.CALIB_CB_EXHAUSTIVE)
    if not found:
        return _empty(name)
    grid = corners.reshape(rows, columns, 2).astype(float)
    (ax, ay), (bx, by) = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if ax * by - ay * bx < 0:  # numbered as if seen from behind: a chessboard has no markers to tell
        grid = grid[:, ::-1]
    spacing = min(np.linalg.norm(np.diff(grid, axis=0), axis=-1).min(), np.linalg.norm(np.diff(grid, axis=1), axis=-1).min())
    uv = grid.reshape(-1, 2)
    uv = cv2.cornerSubPix(image, uv.astype(np.float32).reshape(-1, 1, 2), (int(max(2, 0.3 * spacing)),) * 2, (-1, -1),
                          (3, 50, 1e-3)).reshape(-1, 2).astype(float)
    uv, sd = refine_corners(image, uv, np.full(len(uv), 0.42 * spacing))
    return View(name, np.arange(len(uv)), uv, sd)
