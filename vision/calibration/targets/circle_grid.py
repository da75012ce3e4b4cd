"""Grids of plain circles, symmetric or asymmetric: OpenCV's patterns, seen whole."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.targets.boards import Board
from vision.calibration.targets.dot_grid import NOTHING, dark_blobs, fit_dots, lights

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
OFF_SHARE = 0.3  # of the pitch, by which a dot may miss the grid's perspective: lens
MOST_BLOBS = 4  # times the grid's dots: among more, OpenCV's search takes minutes


def detect_circles(image: Image, board: Board) -> tuple[NDArray[np.int64], Array]:
    """Numbers of the circles and their fits (``vision.markers.fit.fit_discs`` rows); nothing unless all are seen.

    A symmetric grid looks the same turned by half (`Board.ends_alike`): which end is first is then OpenCV's choice.
    """
    count = board.squares[0] * board.squares[1]
    for lit in lights(image):
        dots, rings = dark_blobs(lit)
        places = np.array([centre for centre, _ in [*dots, *rings]], np.float32).reshape(-1, 2)
        if not count <= len(places) <= MOST_BLOBS * count:
            continue
        order = _numbered(places, board)
        if order is not None:
            return fit_dots(image, [(number, [*dots, *rings][k]) for number, k in enumerate(order)])
    return NOTHING


def _numbered(places: NDArray[np.float32], board: Board) -> list[int] | None:
    """Which place is each point of the board; None where no grid is seen."""
    shape = cv2.CALIB_CB_ASYMMETRIC_GRID if board.kind == "asymmetric circles" else cv2.CALIB_CB_SYMMETRIC_GRID
    for way in (0, cv2.CALIB_CB_CLUSTERING):
        try:
            found, centres = cv2.findCirclesGrid(  # type: ignore[call-overload]  # points in place of a picture
                places.reshape(-1, 1, 2),
                board.squares,
                flags=shape | way,
                blobDetector=None,
                parameters=cv2.CirclesGridFinderParameters(),
            )
        except cv2.error:
            continue
        if found:
            return _turned_right(np.asarray(centres, float).reshape(-1, 2), places, board)
    return None


def _turned_right(centres: Array, places: NDArray[np.float32], board: Board) -> list[int] | None:
    """The order under which the grid is seen from the front and fits the board's perspective best."""
    model = board.points_m()[:, :2]
    grid = np.arange(len(model)).reshape(board.squares[1], board.squares[0])
    best, least = None, OFF_SHARE * board.square_size_m
    for way in (grid, grid[::-1, ::-1], grid[:, ::-1], grid[::-1]):
        order = way.ravel()
        matrix, _ = cv2.findHomography(centres[order], model)
        if matrix is None or np.linalg.det(matrix) <= 0:  # as if seen from behind
            continue
        off = cv2.perspectiveTransform(centres[order][None], matrix)[0] - model
        worst = float(np.linalg.norm(off, axis=1).max())
        if worst < 0.99 * least:  # of two that fit alike the first
            best, least = order, worst
    if best is None:
        return None
    apart = np.linalg.norm(places[None] - centres[best][:, None], axis=-1)
    return [int(k) for k in apart.argmin(1)]
