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
from vision.markers.row import M11, M12, M22, S11, S12, S22, U, V, determinant

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

# Rows of a list of pixels: place from the centre [px], and grey.
X, Y, GREY = range(3)
N_EDGE_ROWS = 3
# Of plain pixels too: 1 where the left neighbour came just before, 1 inside the disc.
ADJACENT, INSIDE = 3, 4
N_PLAIN_ROWS = 5
# Rows of a list's work: residual and weight; derivatives by the even unknowns (level, contrast, shape and blur, three
# rows each) and by the odd ones (position, slopes of light and contrast); what they are made of: slope of the edge
# [grey levels/px], its normal, distance from it [sigmas], scales of shape and blur.
RESIDUAL, WEIGHT = range(2)
ONE, STEP, SHAPE, BLUR = 2, 3, 4, 7
GX, GY, LIT_X, LIT_Y, STEP_X, STEP_Y = range(10, 16)
SLOPE, NX, NY, DISTANCE, PER_PX, PER_SIGMA, SCRATCH = range(16, 23)
N_WORK = 23
_EDGE_SIGMAS = 3.2  # beyond, the Gaussian step is within 0.1 % of its level
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_EDGE_PX = 0.5  # beyond them: a pixel's own half width
# Width of the ring of plain background about the edge: it holds the light's slope (2 px cost a disc of 6 px 15 % of its
# precision).
_RING_PX = 4.0
_NARROW_RING_PX = 1.0  # its width where something else is near
_NARROW_SIGMAS = 1.8  # what is left beyond the edge where even that is too near: a marker on its own small paper
NARROWEST = 2
# The largest grey of 8-bit pictures and, in 16-bit ones, of 10, 12, 14 and 16 bits, counted from the lowest bit or the
# highest.
_FULL = np.array([255.0, 1023.0, 4095.0, 16383.0, 65535.0, 65472.0, 65520.0, 65532.0])
_FAR_GREY = 1e12  # of a black or white that the window does not touch


class Window(NamedTuple):
    """What a fit reads of the picture.

    ``edge`` (N_EDGE_ROWS, enough), ``plain`` (N_PLAIN_ROWS, enough): pixels, ``n_edge`` and ``n_plain`` of them;
    ``n_wanted``: edge pixels there would be without the picture's border; ``work``: room for the sums; ``black``,
    ``white``: greys at which the window's pixels are clipped, far away where none is.
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
    half_trace = 0.5 * (p[M11] + p[M22])
    root = math.sqrt(max(half_trace * half_trace - determinant(p), 0.0))
    r_max = 1.0 / math.sqrt(half_trace - root)
    r_min = 1.0 / math.sqrt(half_trace + root)
    blur = math.sqrt(0.5 * (p[S11] + p[S22]) + math.sqrt(0.25 * (p[S11] - p[S22]) ** 2 + p[S12] * p[S12]))
    band = _EDGE_SIGMAS * blur + _EDGE_PX
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
    middle = -p[M12] * y / p[M11]
    square = middle * middle - (p[M22] * y * y - q2) / p[M11]
    if square <= 0.0:
        return 1, 0
    half = math.sqrt(square)
    return math.ceil(p[U] + middle - half), math.floor(p[U] + middle + half)


@compiled
def take(image: NDArray[Any], row: int, first: int, last: int, p: Array, pixels: Singles, n: int) -> int:
    """Append the pixels first..last of a row that lie in the picture; how many the list now has."""
    first, last = max(first, 0), min(last, image.shape[1] - 1)
    x, y = np.float32(first - p[U]), np.float32(row - p[V])
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
        pixels[ADJACENT, k] = _ONE if k > n else _ZERO
        pixels[INSIDE, k] = inside
    return until


@compiled
def collect(image: NDArray[Any], p: Array, narrow: int) -> Window:
    """The window of the ellipse and blur `p`; `narrow` 0 to NARROWEST: how little of its surroundings it holds."""
    q_in2, q_edge2, q_out2, half_width = _reach(p, narrow)
    side = 2 * int(half_width) + 5
    edge = np.empty((N_EDGE_ROWS, side * side), np.float32)
    plain = np.empty((N_PLAIN_ROWS, side * side), np.float32)
    n_edge = n_plain = n_wanted = 0
    for row in range(math.floor(p[V] - half_width), math.ceil(p[V] + half_width) + 1):
        y = row - p[V]
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
    black, white = _clipping_levels(edge, n_edge, plain, n_plain)
    return Window(
        edge, plain, n_edge, n_plain, n_wanted, np.empty((N_WORK, max(n_edge, n_plain) + 1), np.float32), black, white
    )


@compiled
def _clipping_levels(edge: Singles, n_edge: int, plain: Singles, n_plain: int) -> tuple[float, float]:
    """Black and white, where the window touches them (`Window`)."""
    least, most = np.int32(65535), np.int32(0)  # whole numbers: least and most of them are found several at a time
    for k in range(n_edge):
        grey = np.int32(edge[GREY, k])
        least, most = min(least, grey), max(most, grey)
    for k in range(n_plain):
        grey = np.int32(plain[GREY, k])
        least, most = min(least, grey), max(most, grey)
    white = _FAR_GREY
    for full in _FULL:
        if most == full:
            white = full
    return 0.0 if least == 0 else -_FAR_GREY, white


@compiled
def is_clipped(window: Window) -> bool:
    """Whether the window holds black or white pixels."""
    return window.black > -_FAR_GREY or window.white < _FAR_GREY


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
