"""A board found in an image: which of its points, where, and their sds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.targets.boards import Board
from vision.calibration.targets.chessboard import detect_chessboard
from vision.calibration.targets.circle_grid import detect_circles
from vision.calibration.targets.corners import refine_corners
from vision.calibration.targets.dot_grid import detect_dots
from vision.calibration.targets.tag_grid import detect_tags
from vision.markers.row import SD, U, V, radius_px

Array = NDArray[np.float64]
MINIMUM_POINTS = 6
CLEAN_SHARE = 0.81  # of a corner's way to the next marker, whose blurred edge begins before it
# Smallest perimeter of a marker: OpenCV's over the image's longer side, and in pixels for large images.
PERIMETER_RATE, PERIMETER_PX = 0.03, 40.0


@dataclass(frozen=True, eq=False)
class View:
    """What one image shows of the board: ``points`` (n,) numbers into ``board.points_m()``, their pixels (n, 2), sd
    (n,).

    ``marker_px``: mean edge of the markers (diameter of the dots) in pixels, NaN for a chessboard.  ``discs``: rows of
    ``vision.markers.fit.fit_discs`` of a dot grid, from which the perspective bias of the centres is taken away later.
    ``instant``: what views that cameras may have taken at once have in common, the name without the camera's; empty:
    the name.
    """

    name: str
    points: NDArray[np.int64]
    uv_px: Array
    sd_px: Array
    marker_px: float = float("nan")
    discs: Array | None = None
    instant: str = ""

    @property
    def when(self) -> str:
        """What views of other cameras have too that may have been taken at once."""
        return self.instant or self.name

    def only(self, chosen: NDArray[np.bool_]) -> View:
        """The view with the chosen points."""
        return replace(
            self,
            points=self.points[chosen],
            uv_px=self.uv_px[chosen],
            sd_px=self.sd_px[chosen],
            discs=None if self.discs is None else self.discs[chosen],
        )


def detect(image: NDArray[np.uint8], board: Board, name: str = "") -> View:
    """Points of ``board`` in a grey image; a view without points when it is not there.  Never raises for content."""
    if board.inverted:
        image = 255 - image
    if board.of_dots:
        known, fits = detect_dots(image, board) if board.kind == "dots" else detect_circles(image, board)
        return View(
            name, known, fits[:, [U, V]], fits[:, SD], 2 * float(radius_px(fits).mean()) if len(fits) else np.nan, fits
        )
    if board.kind == "chessboard":
        seen = detect_chessboard(image, board)
        return _empty(name) if seen is None else View(name, np.arange(len(seen[0])), *seen)
    if board.of_tags:
        return View(name, *detect_tags(image, board))
    corners, numbers, markers, _ = _detector(board, image.shape).detectBoard(image)
    if corners is None or len(corners) == 0:
        return _empty(name)
    uv = corners.reshape(-1, 2).astype(float)
    outlines = np.array([marker.reshape(4, 2) for marker in markers], float)
    edges = np.linalg.norm(np.diff(outlines, axis=1), axis=-1)
    gap = 0.5 * (board.square_size_m / board.marker_size_m - 1)
    # Two opposite fields of a corner hold markers: seen askew, those of blunt angles come nearest.  A field seen flat
    # is twice the gap away at most: where both markers were missed, the next is farther.
    away = np.linalg.norm(uv[:, None] - outlines.reshape(-1, 2), axis=-1).min(1)
    uv, sd = refine_corners(image, uv, CLEAN_SHARE * np.minimum(away, 2 * gap * edges.max()))
    return View(name, np.asarray(numbers, np.int64).ravel(), uv, sd, float(edges.mean()))


def _empty(name: str) -> View:
    return View(name, np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))


def _detector(board: Board, shape: tuple[int, ...]) -> cv2.aruco.CharucoDetector:
    return cv2.aruco.CharucoDetector(board.opencv(), cv2.aruco.CharucoParameters(), marker_parameters(shape))


def marker_parameters(shape: tuple[int, ...]) -> cv2.aruco.DetectorParameters:
    """OpenCV's, but for its smallest perimeter of 3 % of the image's longer side: 123 px on 4096, so a 30 px marker
    vanishes.
    """
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = min(PERIMETER_RATE, PERIMETER_PX / max(shape))
    return parameters
