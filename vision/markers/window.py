"""The pixels that a disc's fit looks at, in two lists: those at its edge, and the plain ones in its middle and around
it.

Lists without holes let the sums over them run several pixels at a time, and in single precision twice as many as in
double.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, inlined

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

X, Y, GREY = range(3)  # from the centre [px], and grey
AGAIN, INSIDE = 3, 4  # of plain pixels: 1 where the left neighbour came just before, 1 inside the disc
# Rows of a list's work: residual, weight; derivatives by level, contrast, shape and blur (the even unknowns) and by
# position, light's slopes, contrast's slopes (the odd ones); what they are made of.
R, W, ONE, STEP, SHAPE, GX, GY, LIT_X, LIT_Y, STEP_X, STEP_Y = 0, 1, 2, 3, 4, 10, 11, 12, 13, 14, 15
SLOPE, NX, NY, T, PER_PX, PER_SIGMA, SCRATCH = range(16, 23)
N_WORK = 23
_EDGE_SIGMAS = 3.2  # beyond, the Gaussian step is within 0.1 % of its level
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
# of plain background about the edge: it holds the light's slope (2 px cost a disc of 6 px 15 % of its precision)
_RING_PX = 4.0
_NARROW_RING_PX = 1.0  # of it where something else is near
_NARROW_SIGMAS = 1.8  # beyond the edge, where even that is too near: a marker on its own small paper
NARROWEST = 2
# The largest grey of 8-bit pictures and, in 16-bit ones, of 10, 12, 14 and 16 bits, counted from the lowest bit or the
# highest.
_FULL = np.array([255.0, 1023.0, 4095.0, 16383.0, 65535.0, 65472.0, 65520.0, 65532.0])


class Window(NamedTuple):
    """Pixels at the edge (3, enough) and plain ones (5, enough), how many of each, edge pixels wanted, room for the
    sums' work, and the greys at which the window's pixels are cut off (far away where none is).
    """

    edge: Singles
    plain: Singles
    n_edge: int
    n_plain: int
    n_wanted: int
    work: Singles
    black: float
    white: float


@compiled
def _reach(p: Array, narrow: int) -> tuple[float, float, float, float]:
    """Where the edge band begins and ends and the window ends, as x' M x, and the window's half width [px]."""
    half_trace = 0.5 * (p[2] + p[4])
    root = math.sqrt(max(half_trace * half_trace - (p[2] * p[4] - p[3] * p[3]), 0.0))
    r_max = 1.0 / math.sqrt(half_trace - root)
    r_min = 1.0 / math.sqrt(half_trace + root)
    blur = math.sqrt(0.5 * (p[5] + p[7]) + math.sqrt(0.25 * (p[5] - p[7]) ** 2 + p[6] * p[6]))
    band = _EDGE_SIGMAS * blur + 0.5
    outer = band if narrow < NARROWEST else _NARROW_SIGMAS * blur
    ring = outer if narrow == NARROWEST else band + (_NARROW_RING_PX if narrow else _RING_PX)
    return (
        max(1.0 - band / r_min, 0.0) ** 2,
        (1.0 + outer / r_min) ** 2,
        (1.0 + ring / r_min) ** 2,
        r_max * (1.0 + ring / r_min),
    )


@inlined
def span(p: Array, q2: float, y: float) -> tuple[int, int]:
    """First and last column where x' M x < q2 along the row `y` px below the centre; none: first > last."""
    middle = -p[3] * y / p[2]
    square = middle * middle - (p[4] * y * y - q2) / p[2]
    if square <= 0.0:
        return 1, 0
    half = math.sqrt(square)
    return math.ceil(p[0] + middle - half), math.floor(p[0] + middle + half)


@compiled
def take(image: NDArray[Any], row: int, first: int, last: int, p: Array, pixels: Singles, n: int) -> int:
    """Append the pixels first..last of a row that lie in the picture; how many the list now has."""
    first, last = max(first, 0), min(last, image.shape[1] - 1)
    x, y = np.float32(first - p[0]), np.float32(row - p[1])
    for col in range(first, last + 1):
        pixels[X, n] = x
        pixels[Y, n] = y
        pixels[GREY, n] = image[row, col]
        x += _ONE
        n += 1
    return n


@compiled
def _take_plain(
    image: NDArray[Any], row: int, first: int, last: int, p: Array, inside: float, pixels: Singles, n: int
) -> int:
    """As `take`, for pixels away from the edge."""
    until = take(image, row, first, last, p, pixels, n)
    for k in range(n, until):
        pixels[AGAIN, k] = _ONE if k > n else _ZERO
        pixels[INSIDE, k] = inside
    return until


@compiled
def collect(image: NDArray[Any], p: Array, narrow: int) -> Window:
    """The window of the ellipse and blur `p`; `narrow` 0 to NARROWEST: how little of its surroundings it holds."""
    q_in2, q_edge2, q_out2, half_width = _reach(p, narrow)
    side = 2 * int(half_width) + 5
    edge, plain = np.empty((3, side * side), np.float32), np.empty((5, side * side), np.float32)
    n_edge = n_plain = n_wanted = 0
    for row in range(math.floor(p[1] - half_width), math.ceil(p[1] + half_width) + 1):
        y = row - p[1]
        out_first, out_last = span(p, q_out2, y)
        if out_first > out_last:
            continue
        edge_first, edge_last = span(p, q_edge2, y)
        in_first, in_last = span(p, q_in2, y)
        if in_first > in_last:  # no middle in this row: the edge's two sides meet
            in_first, in_last = edge_last + 1, edge_last
        n_wanted += max(edge_last - edge_first + 1, 0) - (in_last - in_first + 1)
        if row < 0 or row >= image.shape[0]:
            continue
        if edge_first > edge_last:
            n_plain = _take_plain(image, row, out_first, out_last, p, 0.0, plain, n_plain)
            continue
        n_plain = _take_plain(image, row, out_first, edge_first - 1, p, 0.0, plain, n_plain)
        n_edge = take(image, row, edge_first, in_first - 1, p, edge, n_edge)
        n_plain = _take_plain(image, row, in_first, in_last, p, 1.0, plain, n_plain)
        n_edge = take(image, row, in_last + 1, edge_last, p, edge, n_edge)
        n_plain = _take_plain(image, row, edge_last + 1, out_last, p, 0.0, plain, n_plain)
    black, white = _cut_off(edge, n_edge, plain, n_plain)
    return Window(
        edge, plain, n_edge, n_plain, n_wanted, np.empty((N_WORK, max(n_edge, n_plain) + 1), np.float32), black, white
    )


@compiled
def _cut_off(edge: Singles, n_edge: int, plain: Singles, n_plain: int) -> tuple[float, float]:
    """Black and white, where the window touches them."""
    least, most = np.int32(65535), np.int32(0)  # whole numbers: least and most of them are found several at a time
    for k in range(n_edge):
        grey = np.int32(edge[GREY, k])
        least, most = min(least, grey), max(most, grey)
    for k in range(n_plain):
        grey = np.int32(plain[GREY, k])
        least, most = min(least, grey), max(most, grey)
    white = 1e12
    for full in _FULL:
        if most == full:
            white = full
    return 0.0 if least == 0 else -1e12, white


@compiled
def recentre(window: Window, du: float, dv: float) -> None:
    """Count the pixels from a centre moved by (du, dv): for a small step the same pixels serve."""
    x, y = np.float32(du), np.float32(dv)
    for k in range(window.n_edge):
        window.edge[X, k] -= x
        window.edge[Y, k] -= y
    for k in range(window.n_plain):
        window.plain[X, k] -= x
        window.plain[Y, k] -= y
