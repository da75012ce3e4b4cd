"""Why a board is not found: another print, mirrored images, another dictionary, another number of squares, each by
name.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from vision.calibration.targets.boards import DICTIONARIES, Board
from vision.calibration.targets.detection import detect, marker_parameters

Image = NDArray[np.uint8]
Array = NDArray[np.float64]
FEWEST_MARKERS = 4
EXAMINED = 3  # images in which markers of other boards are looked for: each takes every dictionary
MOST_COLUMNS = 30
# Corners of markers laid out as the board says fit a flat board's perspective to this share of a marker's edge, lens
# and all.
FLAT_SHARE = 0.1


def alternatives(images: Sequence[Image], board: Board) -> tuple[Board, str]:
    """The board as it really is, when ``board`` was found in none of the images.

    Tries, in this order: inverted print, legacy pattern, both; then mirrored images, another number of squares, other
    dictionaries; a chessboard's squares were counted before (``refuse_other_size``).
    The first three give the altered board and a sentence that says so; the others are refused by name,
    because the board's TOML or the images have to be changed.  `InputError` when nothing fits.
    """
    if board.kind != "charuco":
        changed = board.altered(inverted=not board.inverted)
        if any(len(detect(image, changed).points) for image in images):
            return changed, (
                f"the board is printed {'inverted' if changed.inverted else 'black on white'}; set inverted = "
                f"{str(changed.inverted).lower()}"
            )
        raise InputError(
            f"board {board.name} in none of {len(images)} images",
            f"a {board.kind} of {board.squares}",
            "check squares in the board's TOML, focus and light",
        )
    for changed in _prints(board)[1:]:
        if any(len(detect(image, changed).points) for image in images):
            settings = [
                f"{key} = {str(getattr(changed, key)).lower()}"
                for key in ("inverted", "legacy_pattern")
                if getattr(changed, key) != getattr(board, key)
            ]
            return changed, f"the board fits with {' and '.join(settings)}, not as {board.name} says; correct its TOML"
    refuse_mirrored(images, board)
    if not _refuse_squares(images, board):
        _refuse_dictionary(images, board)
    raise InputError(
        f"board {board.name} in none of {len(images)} images",
        f"{board.squares[0]} x {board.squares[1]} squares with markers of {board.dictionary}",
        "check that these are the board's images, that it is in focus and lit, and markers are above 20 px",
    )


def refuse_mirrored(images: Sequence[Image], board: Board, whose: str = "") -> None:
    """`InputError` when the board is there once the images are mirrored; ``whose``: the camera, where the others are
    right.
    """
    if board.kind != "charuco":
        return  # nothing on a chessboard shows left and right
    for changed in _prints(board):
        if any(len(detect(np.ascontiguousarray(image[:, ::-1]), changed).points) for image in images):
            found = f"{whose}: " if whose else ""
            raise InputError(
                f"{found}the board {board.name} fits only when the images are mirrored",
                "images as the camera saw them",
                "switch off the mirroring in the camera's software, or flip all images, the recording's too",
            )


def _prints(board: Board) -> list[Board]:
    """The board as its TOML says, then the other prints of it."""
    return [
        board.altered(inverted=inverted, legacy_pattern=legacy)
        for inverted in (board.inverted, not board.inverted)
        for legacy in (board.legacy_pattern, not board.legacy_pattern)
    ]


def _markers(image: Image, dictionary: str) -> tuple[NDArray[np.int64], Array]:
    """Numbers (n,) and corners (n, 4, 2) of the markers of a dictionary, printed either way."""
    parameters = marker_parameters(image.shape)
    parameters.detectInvertedMarker = True
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    corners, numbers, _ = cv2.aruco.ArucoDetector(known, parameters).detectMarkers(image)
    if numbers is None:
        return np.empty(0, np.int64), np.empty((0, 4, 2))
    return numbers.ravel().astype(np.int64), np.reshape(corners, (-1, 4, 2)).astype(float)


def _refuse_squares(images: Sequence[Image], board: Board) -> bool:
    """`InputError` when the markers lie as on a board of other squares; False when there are none of the dictionary."""
    seen = [_markers(image, board.dictionary) for image in images[:EXAMINED]]
    most = max(seen, key=lambda one: len(one[0]))
    if len(most[0]) < FEWEST_MARKERS:
        return False
    highest = int(max(numbers.max() for numbers, _ in seen if len(numbers)))
    edge = float(np.median(np.linalg.norm(np.diff(most[1], axis=1), axis=-1)))
    misfits = {columns: _misfit_px(most, board, columns, highest) for columns in range(2, MOST_COLUMNS + 1)}
    columns = min(misfits, key=lambda one: misfits[one])
    if misfits[columns] > FLAT_SHARE * edge:
        return True  # the board's markers, but not as any board lays them out: bent, or several boards
    rows = -(-2 * (highest + 1) // columns)
    if (columns, rows) == board.squares:
        return True
    raise InputError(
        f"markers 0 to {highest} of {board.dictionary} laid out as on a board of {columns} columns and {rows} rows or "
        f"more",
        f"{board.squares[0]} columns and {board.squares[1]} rows, as board {board.name} says",
        f"set squares = [{columns}, {rows}] in the board's TOML, or name the right board",
    )


def _misfit_px(seen: tuple[NDArray[np.int64], Array], board: Board, columns: int, highest: int) -> float:
    """RMS distance of the markers' corners from the perspective of a board with that many columns."""
    rows = -(-2 * (highest + 1) // columns) + 1
    laid_out = board.altered(squares=(columns, rows)).opencv_layout()
    known = np.isin(seen[0], list(laid_out))
    if known.sum() < FEWEST_MARKERS:
        return np.inf
    flat = np.concatenate([laid_out[int(number)] for number in seen[0][known]])
    pixels = seen[1][known].reshape(-1, 2)
    matrix, _ = cv2.findHomography(flat, pixels, 0)
    if matrix is None:
        return np.inf
    off = cv2.perspectiveTransform(flat[None], matrix)[0] - pixels
    return float(np.sqrt(np.mean(np.sum(off**2, -1))))


def _refuse_dictionary(images: Sequence[Image], board: Board) -> None:
    best, seen = "", FEWEST_MARKERS - 1
    for name in DICTIONARIES:
        # a board counts its markers from 0 without gaps: chance hits of large dictionaries do not
        found = sum(
            int(np.sum(np.unique(_markers(image, name)[0]) < board.squares[0] * board.squares[1]))
            for image in images[:EXAMINED]
        )
        if found > seen:
            best, seen = name, found
    if best:
        raise InputError(
            f"markers of {best} in the images, none of {board.dictionary}",
            f"the dictionary of board {board.name}",
            f'set dictionary = "{best}" in the board\'s TOML, or name the right board',
        )
