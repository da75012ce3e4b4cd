"""Chessboards: corners found and numbered from the right end, and the size of one that is not as its TOML says."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from vision.calibration.targets.boards import Board
from vision.calibration.targets.corners import refine_corners

Array = NDArray[np.float64]
Image = NDArray[np.uint8]
# Longer side in which a board is looked for first: on 8 megapixels that takes seconds, and finds no more.
SEARCHED_PX = 2000
# About a corner, in parts of the squares: OpenCV's window, and the neighbourhood that holds nothing else.
WINDOW_SHARE, CLEAN_SHARE = 0.3, 0.42
SUBPIX = (3, 50, 1e-3)  # OpenCV's criteria: 50 steps, or one below 1e-3 px
LIKELY = 3  # sizes counted most often that are tried
SMALLEST = (3, 3)  # inner corners from which OpenCV lets a chessboard grow to what is there


def detect_chessboard(image: Image, board: Board) -> tuple[Array, Array] | None:
    """Inner corners (n, 2) of a chessboard, numbered from its dark end, and their sd (n,) [px]; None when it is not
    seen whole.
    """
    columns, rows = board.squares[0] - 1, board.squares[1] - 1
    corners = _search(image, (columns, rows))
    if corners is None:
        return None
    grid = turned_right(image, corners.reshape(rows, columns, 2))
    spacing = min(
        np.linalg.norm(np.diff(grid, axis=0), axis=-1).min(), np.linalg.norm(np.diff(grid, axis=1), axis=-1).min()
    )
    uv = grid.reshape(-1, 2)
    uv = (
        cv2.cornerSubPix(
            image, uv.astype(np.float32).reshape(-1, 1, 2), (int(max(2, WINDOW_SHARE * spacing)),) * 2, (-1, -1), SUBPIX
        )
        .reshape(-1, 2)
        .astype(float)
    )
    return refine_corners(image, uv, np.full(len(uv), CLEAN_SHARE * spacing))


def _search(image: Image, size: tuple[int, int], thorough: bool = True) -> Array | None:
    """Corners (n, 2) to about a pixel, in whatever order OpenCV has them; `thorough`: by its slow finder too."""
    scale = _scale(image)
    small = _shrunk(image, scale)
    found, corners = cv2.findChessboardCorners(
        small, size, flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    )
    if not found and thorough:
        found, corners = cv2.findChessboardCornersSB(small, size, flags=cv2.CALIB_CB_EXHAUSTIVE)
    if not found and thorough and scale > 1:
        scale = 1.0
        found, corners = cv2.findChessboardCornersSB(image, size, flags=cv2.CALIB_CB_EXHAUSTIVE)
    return (corners.reshape(-1, 2).astype(float) + 0.5) * scale - 0.5 if found else None


def _scale(image: Image) -> float:
    return max(1.0, max(image.shape) / SEARCHED_PX)


def _shrunk(image: Image, scale: float) -> Image:
    if scale == 1:
        return image
    return np.asarray(cv2.resize(image, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA), np.uint8)


def turned_right(image: Image, grid: Array) -> Array:
    """The grid (rows, columns, 2) of corners as seen from the front, from the end whose first square is dark.

    OpenCV's two finders begin at opposite ends.  Where the counts of inner corners are both even or both odd, both ends
    are alike (`Board.ends_alike`), and the numbering stays as it was found.
    """
    (ax, ay), (bx, by) = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if ax * by - ay * bx < 0:  # numbered as if seen from behind
        grid = grid[:, ::-1]
    middle = 0.25 * (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:])
    u, v = (np.rint(middle[..., k]).astype(int).clip(0, image.shape[1 - k] - 1) for k in (0, 1))
    grey = image[v, u].astype(float)
    even = np.add.outer(np.arange(grey.shape[0]), np.arange(grey.shape[1])) % 2 == 0
    # The square between the first four inner corners touches the board's first one at a corner: they are of one colour.
    return grid[::-1, ::-1] if grey[even].mean() > grey[~even].mean() and sum(grid.shape[:2]) % 2 else grid


def refuse_other_size(images: Sequence[Image], board: Board) -> None:
    """`InputError` when the images show a chessboard of another number of squares, which OpenCV then counts."""
    flags = cv2.CALIB_CB_LARGER | cv2.CALIB_CB_EXHAUSTIVE
    sizes = []
    for image in images:
        found, _, meta = cv2.findChessboardCornersSBWithMeta(_shrunk(image, _scale(image)), SMALLEST, flags)
        if found:
            sizes.append(tuple(sorted(np.shape(meta)[:2], reverse=True)))
    # A board partly covered counts smaller, and its frame may count as one row more: right is what is then found whole
    # most often, and of two found alike the larger: OpenCV finds a board of one row less in nearly all pictures of it.
    stated = (board.squares[0] - 1, board.squares[1] - 1)
    likely = sorted(set(sizes), key=lambda one: -sizes.count(one))[:LIKELY]
    seen = {one: sum(_search(image, one, False) is not None for image in images) for one in {*likely, stated}}
    whole, _, best = max((seen[one], one[0] * one[1], (one[0] + 1, one[1] + 1)) for one in seen)
    if whole and set(best) != set(board.squares):
        raise InputError(
            f"a chessboard of {best[0]} x {best[1]} squares in {whole} of {len(images)} images",
            f"{board.squares[0]} x {board.squares[1]} squares, as board {board.name} says",
            f"set squares = [{best[0]}, {best[1]}] in the board's TOML, or show the whole board",
        )
