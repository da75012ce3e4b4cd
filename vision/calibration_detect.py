"""A board found in an image: which of its points, where, how surely; and what is wrong when it is not found."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from vision.boards import DICTIONARIES, Board
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
    corners, numbers, markers, _ = _detector(board, image.shape).detectBoard(image)
    if corners is None or len(corners) == 0:
        return _empty(name)
    uv = corners.reshape(-1, 2).astype(float)
    numbers = numbers.ravel().astype(np.int64)
    edge = np.mean([np.linalg.norm(np.diff(m.reshape(4, 2), axis=0), axis=1).mean() for m in markers])
    gap = 0.5 * (board.square_size_m / board.marker_size_m - 1)
    # The markers tell pixels per metre; a tilted board's narrower direction has the smaller gap.
    narrow = min(np.linalg.norm(np.diff(m.reshape(4, 2), axis=0), axis=1).min() for m in markers)
    uv, sd = refine_corners(image, uv, np.full(len(uv), CLEAN_SHARE * gap * 0.5 * (edge + narrow)))
    return View(name, numbers, uv, sd, float(edge))


def _empty(name: str) -> View:
    return View(name, np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))


def _detector(board: Board, shape: tuple[int, ...]) -> cv2.aruco.CharucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    # OpenCV's smallest perimeter is 3 % of the image's longer side: 123 px on 4096, so a 30 px marker vanishes.
    parameters.minMarkerPerimeterRate = min(0.03, 40.0 / max(shape))
    return cv2.aruco.CharucoDetector(board.opencv(), cv2.aruco.CharucoParameters(), parameters)


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


def alternatives(images: list[NDArray[np.uint8]], board: Board) -> tuple[Board, str]:
    """The board as it really is, when ``board`` was found in none of the images.

    Tries, in this order: inverted print, legacy pattern, both; then mirrored images, other dictionaries.  The first
    three give the altered board and a sentence that says so; the others are refused by name, because no setting of the
    board makes them right.  `InputError` when nothing fits.
    """
    if board.kind != "charuco":
        changed = board.altered(inverted=not board.inverted)
        if any(len(detect(image, changed).points) for image in images):
            return changed, (f"the board is printed {'inverted' if changed.inverted else 'black on white'}; set inverted = " \
                            f"{str(changed.inverted).lower()}")
        raise InputError(f"board {board.name} in none of {len(images)} images", f"a {board.kind} of {board.squares}",
                         "check squares in the board's TOML, focus and light")
    for inverted in (board.inverted, not board.inverted):
        for legacy in (board.legacy_pattern, not board.legacy_pattern):
            changed = board.altered(inverted=inverted, legacy_pattern=legacy)
            if changed != board and any(len(detect(image, changed).points) for image in images):
                told = [f"{key} = {str(getattr(changed, key)).lower()}" for key in ("inverted", "legacy_pattern")
                        if getattr(changed, key) != getattr(board, key)]
                return changed, f"the board fits with {' and '.join(told)}, not as {board.name} says; correct its TOML"
    _refuse_mirrored(images, board)
    _refuse_dictionary(images, board)
    raise InputError(f"board {board.name} in none of {len(images)} images",
                     f"{board.squares[0]} x {board.squares[1]} squares with markers of {board.dictionary}",
                     "check that these are the board's images, that it is in focus and lit, and markers are above 20 px")


def _refuse_mirrored(images: list[NDArray[np.uint8]], board: Board) -> None:
    for inverted in (board.inverted, not board.inverted):
        for legacy in (board.legacy_pattern, not board.legacy_pattern):
            changed = board.altered(inverted=inverted, legacy_pattern=legacy)
            if any(len(detect(np.ascontiguousarray(image[:, ::-1]), changed).points) for image in images):
                raise InputError(f"the board {board.name} fits only when the images are mirrored", "images as the camera saw them",
                                 "switch off the mirroring in the camera's software, or flip all images, the recording's too")


def _refuse_dictionary(images: list[NDArray[np.uint8]], board: Board) -> None:
    best, seen = "", 0
    for name in DICTIONARIES:
        dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
        parameters = cv2.aruco.DetectorParameters()
        parameters.minMarkerPerimeterRate = min(0.03, 40.0 / max(images[0].shape))
        parameters.detectInvertedMarker = True
        detector = cv2.aruco.ArucoDetector(dictionary, parameters)
        found = 0
        for image in images[:3]:
            numbers = detector.detectMarkers(image)[1]
            # a board counts its markers from 0 without gaps: chance hits of large dictionaries do not
            found += 0 if numbers is None else int(np.sum(np.unique(numbers) < board.squares[0] * board.squares[1]))
        if found > seen and name != board.dictionary:
            best, seen = name, found
    if seen >= 4:
        raise InputError(f"markers of {best} in the images, none of {board.dictionary}", f"the dictionary of board {board.name}",
                         f'set dictionary = "{best}" in the board\'s TOML, or name the right board')
