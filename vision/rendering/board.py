"""Board views: a board in perspective, through the lens, on a full sensor or a window of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.calibration.targets.boards import Board, printed_rectangles
from vision.compiled import compiled, uncounted
from vision.rendering.images import Look, View, finish

Array = NDArray[np.float64]
FINE = 4  # sub-samples per pixel and axis, each a box average of the print
_REACH_BLURS, _REACH_PX = 5, 3  # about the board that are drawn: blurs, and pixels
DOT_SHARE, RING_SHARE = 0.3, 0.55  # radius of a dot in pitches, and of a ring's hole in radii
_PIXEL_REACH = 5.0  # half sides of a pixel that hold it from its corner on, tilted or near too
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
        fine = _print(board, camera, xn, yn, paper)
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
        fine = np.ascontiguousarray(_row_means(fine, weights, reach).T)
    return fine


@compiled
def _row_means(fine: Array, weights: Array, reach: int) -> Array:
    """Of every ``FINE`` rows the sum of those from ``reach`` before on times ``weights``; the picture's first and last
    row go on beyond it.
    """
    last, columns = len(fine) - 1, fine.shape[1]
    total = np.zeros((len(fine) // FINE, columns))
    for i in range(len(total)):
        for k in range(len(weights)):
            row = min(max(FINE * i + k - reach, 0), last)
            for j in range(columns):
                total[i, j] += weights[k] * fine[row, j]
    return total


class Rays(NamedTuple):
    """Rays (xn, yn, 1) of pixels' centres and what the next row and column add to them, each (rows, columns)."""

    xn: Array
    yn: Array
    xn_down: Array
    yn_down: Array
    xn_right: Array
    yn_right: Array


class Sheet(NamedTuple):
    """A board before a camera: ``turn`` (3, 3) from the camera's axes to its own, ``away`` (3,) its first point along
    them; half the side [m] of a sub-sample's box on it.  ``gx``, ``gy``: lines of the print, with the ``greys`` of the
    cells between them, whose integral ``sums`` has at the lines' crossings.
    """

    turn: Array
    away: Array
    half: float
    gx: Array
    gy: Array
    greys: Array
    sums: Array


def _print(board: Board, camera: Camera, xn: Array, yn: Array, paper: Paper) -> Array:
    """Grey at the sub-samples of pixels on the rays (``xn``, ``yn``, 1): the mean of the print over the sub-sample's
    box, exact by an integral over the grid of lines.
    """
    (xn_down, xn_right), (yn_down, yn_right) = np.gradient(xn), np.gradient(yn)
    rays = Rays(*map(np.ascontiguousarray, (xn, yn, xn_down, yn_down, xn_right, yn_right)))
    turn, point = np.ascontiguousarray(camera.rotation.T), camera.translation_m
    depth = (turn[2] @ point) / (turn[2, 0] * xn + turn[2, 1] * yn + turn[2, 2])
    half = 0.5 / FINE * float(np.median(depth)) / camera.matrix[0, 0]
    if board.of_dots:  # no lines
        sheet = Sheet(turn, turn @ point, half, *(np.zeros(0),) * 2, *(np.zeros((0, 0)),) * 2)
        return _dot_means(rays, sheet, _dots_of(board), _greys_of(board, paper))
    margin_m, background = paper.margin_m, paper.background_grey
    gx, gy, black = printed_rectangles(board)
    gx = np.concatenate([[-_FAR_M, gx[0] - margin_m], gx, [gx[-1] + margin_m, _FAR_M]])
    gy = np.concatenate([[-_FAR_M, gy[0] - margin_m], gy, [gy[-1] + margin_m, _FAR_M]])
    cells = np.full((len(gy) - 1, len(gx) - 1), background)
    cells[1:-1, 1:-1] = paper.ink_grey if board.inverted else paper.paper_grey
    cells[2:-2, 2:-2] = np.where(black, paper.ink_grey, paper.paper_grey)
    cells = cells - background  # so that the far rim adds no large numbers to the integral
    sums = np.zeros((len(gy), len(gx)))
    sums[1:, 1:] = (cells * np.diff(gy)[:, None] * np.diff(gx)).cumsum(0).cumsum(1)
    return np.asarray(background + _box_means(rays, Sheet(turn, turn @ point, half, gx, gy, cells, sums)))


@uncounted
def _place(rays: Rays, sheet: Sheet, i: int, j: int, a: int, b: int) -> tuple[float, float]:
    """Where on the board sub-sample (a, b) of pixel (i, j) lies: linear within a pixel (a lens bends by 1e-6 px
    there).
    """
    down, right, turn, away = (a + 0.5) / FINE - 0.5, (b + 0.5) / FINE - 0.5, sheet.turn, sheet.away
    u = rays.xn[i, j] + rays.xn_down[i, j] * down + rays.xn_right[i, j] * right
    v = rays.yn[i, j] + rays.yn_down[i, j] * down + rays.yn_right[i, j] * right
    depth = away[2] / (turn[2, 0] * u + turn[2, 1] * v + turn[2, 2])
    x = depth * (turn[0, 0] * u + turn[0, 1] * v + turn[0, 2]) - away[0]
    return x, depth * (turn[1, 0] * u + turn[1, 1] * v + turn[1, 2]) - away[1]


@uncounted
def _cell(lines: Array, at: float, near: int) -> int:
    """Number of the cell between ``lines`` that holds ``at``, sought from the cell ``near`` on; the first or last for
    what is beyond.
    """
    while near > 0 and at <= lines[near]:
        near -= 1
    while near < len(lines) - 2 and at > lines[near + 1]:
        near += 1
    return near


@uncounted
def _box_mean(sheet: Sheet, x: float, y: float, row: int, column: int) -> float:
    """Mean over the box about (x, y), near that cell: the grey of the cell that holds all of it, or bilinear in each of
    its corners' cells, which is exact.
    """
    gx, gy, sums, half = sheet.gx, sheet.gy, sheet.sums, sheet.half
    row, column = _cell(gy, y - half, row), _cell(gx, x - half, column)
    if y + half <= gy[row + 1] and x + half <= gx[column + 1]:
        return sheet.greys[row, column]
    integral = 0.0
    for sign_y in (-1.0, 1.0):
        v = y + sign_y * half
        row = _cell(gy, v, row)
        down = (v - gy[row]) / (gy[row + 1] - gy[row])
        for sign_x in (-1.0, 1.0):
            u = x + sign_x * half
            column = _cell(gx, u, column)
            along = (u - gx[column]) / (gx[column + 1] - gx[column])
            upper = (1.0 - along) * sums[row, column] + along * sums[row, column + 1]
            lower = (1.0 - along) * sums[row + 1, column] + along * sums[row + 1, column + 1]
            integral += sign_y * sign_x * ((1.0 - down) * upper + down * lower)
    return integral / (2 * half) ** 2


@uncounted
def _one_grey(sheet: Sheet, low: tuple[float, float], high: tuple[float, float], row: int, column: int) -> bool:
    """Whether all cells between ``low`` and ``high`` (x, y) have the grey of that one, which is one of them."""
    first_row, last_row = _cell(sheet.gy, low[1], row), _cell(sheet.gy, high[1], row)
    first, last = _cell(sheet.gx, low[0], column), _cell(sheet.gx, high[0], column)
    for r in range(first_row, last_row + 1):
        for c in range(first, last + 1):
            if sheet.greys[r, c] != sheet.greys[row, column]:
                return False
    return True


@compiled
def _box_means(rays: Rays, sheet: Sheet) -> Array:
    """Mean of the print over each sub-sample's box, (rows, columns).  Where all cells that the boxes at a pixel's four
    corners span have one grey, so have the boxes between them.
    """
    end, half = FINE - 1, sheet.half
    rows, columns = rays.xn.shape
    out = np.empty((FINE * rows, FINE * columns))
    row = column = 0
    for i in range(rows):
        for j in range(columns):
            x, y = _place(rays, sheet, i, j, 0, 0)
            row, column = _cell(sheet.gy, y, row), _cell(sheet.gx, x, column)
            left, right, low, high = x, x, y, y
            for a, b in ((0, end), (end, 0), (end, end)):
                x, y = _place(rays, sheet, i, j, a, b)
                left, right, low, high = min(left, x), max(right, x), min(low, y), max(high, y)
            alike = _one_grey(sheet, (left - half, low - half), (right + half, high + half), row, column)
            grey = sheet.greys[row, column]
            for a in range(FINE):
                for b in range(FINE):
                    if not alike:
                        x, y = _place(rays, sheet, i, j, a, b)
                        grey = _box_mean(sheet, x, y, row, column)
                    out[FINE * i + a, FINE * j + b] = grey
    return out


class Dots(NamedTuple):
    """A grid of circles: its ``pitch`` and their ``radius`` [m]; ``columns``, ``rows``; whether every second row is
    ``shifted`` by half a step; places (R, 2) of circles with a hole; ``low``, ``high`` (2,): the paper's ends [m].
    """

    pitch: float
    radius: float
    columns: int
    rows: int
    shifted: bool
    rings: Array
    low: Array
    high: Array


class DotGreys(NamedTuple):
    """Greys of the circles, of the paper and of what lies behind."""

    ink: float
    paper: float
    background: float


def _dots_of(board: Board) -> Dots:
    pitch, points = board.square_size_m, board.points_m()[:, :2]
    rings = pitch * np.array(board.rings, float).reshape(-1, 2)
    shifted = board.kind == "asymmetric circles"
    return Dots(pitch, DOT_SHARE * pitch, *board.squares, shifted, rings, points.min(0) - pitch, points.max(0) + pitch)


def _greys_of(board: Board, paper: Paper) -> DotGreys:
    ink, sheet = (paper.paper_grey, paper.ink_grey) if board.inverted else (paper.ink_grey, paper.paper_grey)
    return DotGreys(ink, sheet, paper.background_grey)


@uncounted
def _from_dot(dots: Dots, x: float, y: float) -> float:
    """Distance [m] from the middle of the nearest circle."""
    row = min(max(np.rint(y / dots.pitch), 0.0), dots.rows - 1.0)
    step, shift = (2.0, row % 2) if dots.shifted else (1.0, 0.0)
    column = min(max(np.rint((x / dots.pitch - shift) / step), 0.0), dots.columns - 1.0)
    return np.hypot(x - dots.pitch * (step * column + shift), y - dots.pitch * row)


@uncounted
def _on_paper(dots: Dots, x: float, y: float, reach: float) -> bool:
    """Whether the paper goes on for so far about (x, y)."""
    across = dots.low[0] + reach < x < dots.high[0] - reach
    return across and dots.low[1] + reach < y < dots.high[1] - reach


@uncounted
def _dot(dots: Dots, greys: DotGreys, half: float, x: float, y: float) -> float:
    """Grey at (x, y) of the board; each edge as a ramp as wide as the sub-sample's box."""
    if not _on_paper(dots, x, y, 0.0):
        return greys.background
    dark = min(max(0.5 + (dots.radius - _from_dot(dots, x, y)) / (2 * half), 0.0), 1.0)
    if dark > 0.0:
        for k in range(len(dots.rings)):
            away = np.hypot(x - dots.rings[k, 0], y - dots.rings[k, 1])
            dark *= min(max(0.5 + (away - RING_SHARE * dots.radius) / (2 * half), 0.0), 1.0)
    return greys.paper + dark * (greys.ink - greys.paper)


@compiled
def _dot_means(rays: Rays, sheet: Sheet, dots: Dots, greys: DotGreys) -> Array:
    """:func:`_dot` of all sub-samples, (rows, columns).  A pixel whose first one has bare paper about it, farther than
    the pixel reaches, has nothing else.
    """
    rows, columns = rays.xn.shape
    out, reach = np.empty((FINE * rows, FINE * columns)), _PIXEL_REACH * FINE * sheet.half
    for i in range(rows):
        for j in range(columns):
            x, y = _place(rays, sheet, i, j, 0, 0)
            bare = _on_paper(dots, x, y, reach) and _from_dot(dots, x, y) > dots.radius + reach
            for a in range(FINE):
                for b in range(FINE):
                    if bare:
                        grey = greys.paper
                    else:
                        x, y = _place(rays, sheet, i, j, a, b)
                        grey = _dot(dots, greys, sheet.half, x, y)
                    out[FINE * i + a, FINE * j + b] = grey
    return out
