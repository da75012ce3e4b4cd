"""Board views: a board in perspective, through the lens, on a full sensor or a window of it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.boards import Board, printed_rectangles
from vision.compiled import compiled
from vision.rendering.images import Look, View, finish

Array = NDArray[np.float64]
FINE = 4  # sub-samples per pixel and axis, each a box average of the print
_REACH_BLURS, _REACH_PX = 5, 3  # about the board that are drawn: blurs, and pixels
DOT_SHARE, RING_SHARE = 0.3, 0.55  # radius of a dot in pitches, and of a ring's hole in radii
_BLUR_TRUNCATE = 5  # sds at which the blur ends
_FAR_M = 1e3  # of a line of the print that is beyond every picture


@dataclass(frozen=True)
class Paper:
    """Greys of paper, ink and what lies behind, and the rim of paper around the print."""

    paper_grey: float = 215.0
    ink_grey: float = 30.0
    background_grey: float = 120.0
    margin_m: float = 0.004


def render_board(
    view: View,
    board: Board,
    rotation: Array,
    translation_m: Array,
    look: Look = Look(),
    rng: np.random.Generator | None = None,
    paper: Paper = Paper(),
) -> tuple[NDArray[np.uint8], Array]:
    """One view of a board.

    Parameters
    ----------
    view : camera and window; its pose in the world is not used
    rotation, translation_m : ``X_camera = rotation @ X_board + translation_m`` (board frame: OpenCV's)
    look, rng : as for :func:`vision.rendering.images.render_frame`
    paper : greys and margin of the print

    Returns
    -------
    image : (height, width) uint8
    corners_px : (N, 2) true window pixels of ``board.points_m()``
    """
    camera = replace(view.camera, rotation=np.asarray(rotation, float), translation_m=np.asarray(translation_m, float))
    width, height = view.size_px
    image = np.full((height, width), paper.background_grey)
    (w, h), margin_m = board.size_m, paper.margin_m
    if board.of_dots or board.of_tags:  # both reach beyond the first point, by a pitch at most
        margin_m += board.square_size_m
    outline = np.array(
        [
            [-margin_m, -margin_m, 0],
            [w + margin_m, -margin_m, 0],
            [w + margin_m, h + margin_m, 0],
            [-margin_m, h + margin_m, 0],
        ]
    )
    seen = camera.project(outline) - view.window_offset_px
    reach = int(np.ceil(_REACH_BLURS * look.blur_px)) + _REACH_PX
    low = np.maximum(np.floor(seen.min(0)).astype(int) - reach, 0)
    high = np.minimum(np.ceil(seen.max(0)).astype(int) + reach, [width - 1, height - 1])
    if (low <= high).all():
        xn, yn = view.normalised((low[0], high[0]), (low[1], high[1]))
        fine = _print(board, camera, _finer(xn), _finer(yn), paper)
        image[low[1] : high[1] + 1, low[0] : high[0] + 1] = _seen(fine, look.blur_px)
    return finish(image, look, rng), camera.project(board.points_m()) - view.window_offset_px


def _seen(fine: Array, blur_px: float) -> Array:
    """Pixels' greys (rows, columns) of the sub-samples ``fine``: blurred, and the mean of each pixel's; nothing is
    blurred that no pixel asks for.
    """
    reach = round(_BLUR_TRUNCATE * blur_px * FINE)
    bell = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (blur_px * FINE)) ** 2)
    weights = np.convolve(bell / bell.sum(), np.full(FINE, 1 / FINE))
    for _ in range(2):  # rows, then columns
        padded = np.pad(fine, ((reach, reach), (0, 0)), mode="edge")
        count = len(fine) // FINE
        ends = FINE * (count - 1) + 1
        total = np.zeros((count, fine.shape[1]))
        for k, weight in enumerate(weights):
            total += weight * padded[k : k + ends : FINE]
        fine = np.ascontiguousarray(total.T)
    return fine


def _finer(grid: Array) -> Array:
    """Pixel-centre values to sub-sample values, linear within a pixel (a lens bends by 1e-6 px there)."""
    step = (np.arange(FINE) + 0.5) / FINE - 0.5
    dv, du = np.asarray(np.gradient(grid), float)
    fine = grid[:, None, :, None] + dv[:, None, :, None] * step[:, None, None] + du[:, None, :, None] * step
    return np.asarray(fine.reshape(grid.shape[0] * FINE, grid.shape[1] * FINE))


def _print(board: Board, camera: Camera, xn: Array, yn: Array, paper: Paper) -> Array:
    """Grey on each ray: the mean of the print over the sub-sample's box, exact by an integral over the grid of
    lines.
    """
    normal, point = camera.rotation[:, 2], camera.translation_m
    depth = (normal @ point) / (normal[0] * xn + normal[1] * yn + normal[2])
    x, y = (depth * (along[0] * xn + along[1] * yn + along[2]) - along @ point for along in camera.rotation.T[:2])
    half = 0.5 / FINE * float(np.median(depth)) / camera.matrix[0, 0]
    margin_m, background = paper.margin_m, paper.background_grey
    if board.of_dots:
        return _dots(board, x, y, half, paper)
    gx, gy, black = printed_rectangles(board)
    gx = np.concatenate([[-_FAR_M, gx[0] - margin_m], gx, [gx[-1] + margin_m, _FAR_M]])
    gy = np.concatenate([[-_FAR_M, gy[0] - margin_m], gy, [gy[-1] + margin_m, _FAR_M]])
    cells = np.full((len(gy) - 1, len(gx) - 1), background)
    cells[1:-1, 1:-1] = paper.ink_grey if board.inverted else paper.paper_grey
    cells[2:-2, 2:-2] = np.where(black, paper.ink_grey, paper.paper_grey)
    cells = cells - background  # so that the far rim adds no large numbers to the integral
    sums = np.zeros((len(gy), len(gx)))
    sums[1:, 1:] = (cells * np.diff(gy)[:, None] * np.diff(gx)).cumsum(0).cumsum(1)
    return np.asarray(background + _box_sums(gx, gy, sums, x, y, half) / (2 * half) ** 2)


@compiled
def _cell(lines: Array, at: float) -> int:
    """Number of the cell between ``lines`` that holds ``at``; the first or last for what is beyond."""
    return min(max(int(np.searchsorted(lines, at)) - 1, 0), len(lines) - 2)


@compiled
def _box_sums(gx: Array, gy: Array, sums: Array, x: Array, y: Array, half: float) -> Array:
    """Integrals (as ``x``) over boxes of ``2 * half`` about (x, y) of what is constant in each cell between the lines
    ``gx`` and ``gy``, at whose crossings ``sums`` has the integral: bilinear in a cell, which is exact.
    """
    total = np.zeros(x.shape)
    for i in range(x.shape[0]):
        for j in range(x.shape[1]):
            above, left = _cell(gy, y[i, j] - half), _cell(gx, x[i, j] - half)
            if y[i, j] + half <= gy[above + 1] and x[i, j] + half <= gx[left + 1]:  # one cell holds the box
                whole = sums[above + 1, left + 1] - sums[above, left + 1] - sums[above + 1, left] + sums[above, left]
                area = (gy[above + 1] - gy[above]) * (gx[left + 1] - gx[left])
                total[i, j] = whole * (2 * half) ** 2 / area
                continue
            for sign_y in (-1.0, 1.0):
                v = y[i, j] + sign_y * half
                row = _cell(gy, v)
                down = (v - gy[row]) / (gy[row + 1] - gy[row])
                for sign_x in (-1.0, 1.0):
                    u = x[i, j] + sign_x * half
                    column = _cell(gx, u)
                    along = (u - gx[column]) / (gx[column + 1] - gx[column])
                    upper = (1.0 - along) * sums[row, column] + along * sums[row, column + 1]
                    lower = (1.0 - along) * sums[row + 1, column] + along * sums[row + 1, column + 1]
                    total[i, j] += sign_y * sign_x * ((1.0 - down) * upper + down * lower)
    return total


def _dots(board: Board, x: Array, y: Array, half: float, paper: Paper) -> Array:
    """Grey of a grid of circles at places (x, y) of the board; each edge as a ramp as wide as the sub-sample's box."""
    radius, pitch = DOT_SHARE * board.square_size_m, board.square_size_m
    columns, rows = board.squares
    row = np.clip(np.rint(y / pitch), 0, rows - 1)
    step, shift = (2, row % 2) if board.kind == "asymmetric circles" else (1, 0)
    column = np.clip(np.rint((x / pitch - shift) / step), 0, columns - 1)
    nearest = np.hypot(x - pitch * (step * column + shift), y - pitch * row)
    dark = np.clip(0.5 + (radius - nearest) / (2 * half), 0.0, 1.0)
    for at in board.rings:
        away = np.hypot(x - pitch * at[0], y - pitch * at[1])
        dark = dark * np.clip(0.5 + (away - RING_SHARE * radius) / (2 * half), 0.0, 1.0)
    low, high = board.points_m()[:, :2].min(0) - pitch, board.points_m()[:, :2].max(0) + pitch
    on_paper = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
    ink, sheet = (paper.paper_grey, paper.ink_grey) if board.inverted else (paper.ink_grey, paper.paper_grey)
    return np.asarray(np.where(on_paper, sheet + dark * (ink - sheet), paper.background_grey))
