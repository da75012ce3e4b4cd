"""Grids of square tags: Kalibr's AprilGrid, whose tags touch small squares at their corners, and plain ones."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.targets.boards import Board
from vision.calibration.targets.corners import refine_corners

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
PERIMETER_RATE, PERIMETER_PX = 0.03, 40.0  # as `vision.calibration.targets.detection.marker_parameters` has them
# Pixels by which black is thinned until the tags come apart from the squares at their corners; 0: as it is.
THINNED_PX = (0, 2, 4, 6, 10)
ENOUGH = 0.5  # share of the tags from which on nothing more is tried
OFF_SHARE = 0.15  # of a tag's edge, by which a corner may miss the board's perspective: lens, and not another tag
CLEAN_INSIDE = 1.3  # of a tag's frame: no bit is nearer to its corner than the diagonal of that frame
CLEAN_GAP = 0.9  # of the gap beside it


def detect_tags(image: Image, board: Board) -> tuple[NDArray[np.int64], Array, Array, float]:
    """Numbers (n,) of the corners into ``board.points_m()``, their pixels (n, 2), sd (n,), and the tags' mean edge.

    A tag's own first corner differs between makers (OpenCV's, AprilTag's): which one it is, the grid says.
    """
    best = np.empty(0, np.int64), np.empty((0, 4, 2))
    for thinned in THINNED_PX if board.kind == "aprilgrid" else THINNED_PX[:1]:
        found = _markers(image, board, thinned)
        best = max(best, found, key=lambda one: len(one[0]))
        if len(best[0]) >= ENOUGH * board.squares[0] * board.squares[1]:
            break
    tags, corners = _on_grid(*best, board)
    if not len(tags):
        return np.empty(0, np.int64), np.empty((0, 2)), np.empty(0), float("nan")
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1)
    cell = edges.min(1) / (_bits(board) + 2 * board.border_bits)
    gap = edges.min(1) * (board.square_size_m / board.marker_size_m - 1.0)
    reach = np.minimum(CLEAN_INSIDE * board.border_bits * cell, CLEAN_GAP * gap)
    numbers = (4 * tags[:, None] + np.arange(4)).ravel()
    directions = None
    if board.kind == "tags":  # a dark corner on paper; with a square at its corner it is a chessboard's
        ahead, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
        along = [np.arctan2(side[..., 1], side[..., 0]).ravel() for side in (ahead, back)]
        directions = np.column_stack([along[0], along[1] + np.pi])
    uv, sd = refine_corners(image, corners.reshape(-1, 2), np.repeat(reach, 4), directions)
    fitted = np.isfinite(sd)
    return numbers[fitted], uv[fitted], sd[fitted], float(edges.mean())


def _bits(board: Board) -> int:
    return int(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary)).markerSize)


def _markers(image: Image, board: Board, thinned: int) -> tuple[NDArray[np.int64], Array]:
    """Numbers (n,) and corners (n, 4, 2) as OpenCV has them, clockwise from the one it calls first."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerPerimeterRate = min(PERIMETER_RATE, PERIMETER_PX / max(image.shape))
    parameters.markerBorderBits = board.border_bits
    seen = image if not thinned else cv2.dilate(image, np.ones((thinned + 1, thinned + 1), np.uint8))
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    corners, numbers, _ = cv2.aruco.ArucoDetector(known, parameters).detectMarkers(seen)
    if numbers is None:
        return np.empty(0, np.int64), np.empty((0, 4, 2))
    places = np.reshape(corners, (-1, 4, 2)).astype(float)
    if thinned:  # back to where the black began
        middle = places.mean(1, keepdims=True)
        reach = np.linalg.norm(places - middle, axis=-1, keepdims=True)
        places = middle + (places - middle) * (1 + thinned / np.sqrt(2) / reach)
    flat = numbers.ravel()
    own = [k for k in range(len(flat)) if np.sum(flat == flat[k]) == 1]  # seen twice: one is another thing
    return flat[own].astype(np.int64), places[own]


def _on_grid(numbers: NDArray[np.int64], corners: Array, board: Board) -> tuple[NDArray[np.int64], Array]:
    """Tags in the board's order, row by row from the top left, with their corners clockwise from their top left one."""
    columns, rows = board.squares
    known = numbers < columns * rows
    numbers, corners = numbers[known], corners[known]
    nothing = np.empty(0, np.int64), np.empty((0, 4, 2))
    if len(numbers) < 2:
        return nothing
    row, column = np.divmod(numbers, columns)
    tags = (rows - 1 - row if board.kind == "aprilgrid" else row) * columns + column
    model = board.points_m().reshape(-1, 4, 3)[tags][..., :2]
    edge = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=-1).mean()
    best = nothing
    for turn in range(4):
        turned = np.roll(corners, turn, axis=1)
        matrix, _ = cv2.findHomography(model.reshape(-1, 2), turned.reshape(-1, 2), cv2.RANSAC, OFF_SHARE * edge)
        if matrix is None:
            continue
        off = cv2.perspectiveTransform(model.reshape(1, -1, 2), matrix)[0] - turned.reshape(-1, 2)
        good = (np.linalg.norm(off, axis=1).reshape(-1, 4) < OFF_SHARE * edge).all(1)
        if good.sum() > len(best[0]):
            best = tags[good], turned[good]
    return best if len(best[0]) >= 2 else nothing
