"""The normal equations of a blurred disc: what every pixel of its window says of the model's parameters.

Two facts keep it cheap: only pixels near the edge show where it is, and about the centre the unknowns split into those
that keep their sign under reflection (levels, shape, blur) and those that change it (position, slopes), so that the
equations fall apart into 8 and 6.

A lamp from one side multiplies disc and background alike: the contrast's slope is the level's slope times contrast over
level, and only what differs from that (a glare, a shadow's edge) is a free parameter.  Left free throughout it would
cost a small disc up to three quarters of its precision; held at zero it pulls the centre of a disc under strong light.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, compiled_fast
from vision.markers.row import (
    CONTRAST,
    CONTRAST_U,
    CONTRAST_V,
    D_LEVEL,
    D_LEVEL_U,
    FIRST_ODD,
    LEVEL,
    LEVEL_U,
    LEVEL_V,
    M11,
    M12,
    M22,
    N_EVEN,
    N_EVEN_HELD,
    N_ODD,
    N_UNKNOWNS,
    S11,
    S12,
    S22,
)
from vision.markers.window import (
    ADJACENT,
    BLUR,
    DISTANCE,
    GREY,
    GX,
    GY,
    INSIDE,
    LIT_X,
    LIT_Y,
    NX,
    NY,
    ONE,
    PER_PX,
    PER_SIGMA,
    RESIDUAL,
    SCRATCH,
    SHAPE,
    SLOPE,
    STEP,
    STEP_X,
    STEP_Y,
    WEIGHT,
    Window,
    X,
    Y,
    is_clipped,
)

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

# Constants in single precision, as the pixels: one double among them would turn its sums into doubles.
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)
_FARTHEST = np.float32(6.0)  # sigmas; beyond, the step is 0 or 1
_PEAK = np.float32(0.3989422804014327)
_BELL = tuple(np.float32(c) for c in (-0.5 / 32.0, 1 / 2, 1 / 6, 1 / 24, 1 / 120, 1 / 720))
_TAIL = tuple(np.float32(c) for c in (0.2316419, 0.319381530, -0.356563782, 1.781477937, -1.821255978, 1.330274429))
# What `sums` counts: edge squares, edge pixels, pixels wanted, pixels inside the picture, edge pixels held back, flat
# pixels inside the disc and their squares, outside and their squares, neighbouring flat pixels and squares of their
# differences, squared slopes of the edge pixels, and those times their residuals' squares, flat pixels outside that are
# something else, 1 where the window holds black or white.
(
    EDGE2,
    N_EDGE,
    N_WANTED,
    N_SEEN,
    N_HELD_BACK,
    N_IN,
    IN2,
    N_OUT,
    OUT2,
    N_PAIRS,
    PAIRS2,
    SLOPE2,
    SLOPE2_EDGE2,
    N_FOREIGN,
    CLIPPED,
) = range(15)
N_SUMS = 15
# Share of the contrast from which a flat pixel is something else: what is nearer to the background's level is the
# background.
_FOREIGN = np.float32(0.05)
# Share of the contrast so near to black and white that a pixel counts as clipped, while the noise is not yet known.
_FIRST_MARGIN = 0.03
_DARKEST = 0.03  # share of the contrast that a level has at least where light's slopes are compared


class Equations(NamedTuple):
    """The normal equations, changed in place: matrices of the even (8, 8) and odd (6, 6) unknowns (lower triangles),
    right-hand sides (14,) in the order of `vision.markers.row`, and the ``sums`` (N_SUMS,).
    """

    even: Array
    odd: Array
    rhs: Array
    sums: Array


class Limits(NamedTuple):
    """Grey levels: residual beyond which a pixel is held back, and model values beyond which the picture is
    clipped.
    """

    residual: np.float32
    black: np.float32
    white: np.float32


@compiled
def no_equations() -> Equations:
    """Room for the normal equations of a disc."""
    return Equations(np.zeros((N_EVEN, N_EVEN)), np.zeros((N_ODD, N_ODD)), np.zeros(N_UNKNOWNS), np.zeros(N_SUMS))


@compiled
def light_ratio(p: Array) -> float:
    """Contrast over level: how much of the level's slope the contrast shares when the light alone varies."""
    return p[CONTRAST] / max(p[LEVEL], _DARKEST * abs(p[CONTRAST]) + 1e-9)


@compiled_fast
def _plain(p: Singles, ratio: float, clip: float, pixels: Singles, n: int, rows: Singles, sums: Array) -> None:
    """Residuals, weights and derivatives of the pixels away from the edge, which depend on levels and slopes
    only.
    """
    clip2, little, level, contrast = clip * clip, np.float32(1e-9), p[LEVEL], p[CONTRAST]
    foreign2 = max(clip2, _FOREIGN * contrast * _FOREIGN * contrast)
    n_in = in2 = out2 = n_pairs = pairs2 = n_foreign = _ZERO
    for k in range(n):
        x, y, inside = pixels[X, k], pixels[Y, k], pixels[INSIDE, k]
        light = p[LEVEL_U] * x + p[LEVEL_V] * y
        r = pixels[GREY, k] - (
            level + light + inside * (contrast + ratio * light + p[CONTRAST_U] * x + p[CONTRAST_V] * y)
        )
        lit = _ONE + ratio * inside
        square = r * r
        rows[RESIDUAL, k] = r
        # A neighbour in the ring is no light: it shall not lean the level.
        rows[WEIGHT, k] = min(_ONE, clip2 / (square + little))
        rows[STEP, k], rows[LIT_X, k], rows[LIT_Y, k], rows[STEP_X, k], rows[STEP_Y, k] = (
            inside,
            lit * x,
            lit * y,
            inside * x,
            inside * y,
        )
        n_foreign += (_ONE - inside) * (_ONE if square > foreign2 else _ZERO)
        square = min(square, clip2)
        n_in += inside
        in2 += inside * square
        out2 += (_ONE - inside) * square
    for k in range(1, n):
        apart = rows[RESIDUAL, k] - rows[RESIDUAL, k - 1]
        n_pairs += pixels[ADJACENT, k]
        pairs2 += pixels[ADJACENT, k] * min(apart * apart, clip2 + clip2)
    sums[N_IN], sums[IN2], sums[N_OUT], sums[OUT2], sums[N_PAIRS], sums[PAIRS2], sums[N_FOREIGN] = (
        n_in,
        in2,
        n - n_in,
        out2,
        n_pairs,
        pairs2,
        n_foreign,
    )


@compiled_fast
def at_edge(p: Singles, pixels: Singles, n: int, rows: Singles) -> None:
    """At edge pixels: the step (1 inside, 0 outside), its slope per px (SLOPE), normal (NX, NY), DISTANCE in sigmas,
    scales.
    """
    m11, m12, m22, s11, s12, s22 = p[M11], p[M12], p[M22], p[S11], p[S12] + p[S12], p[S22]
    little = np.float32(1e-30)
    for k in range(n):
        x, y = pixels[X, k], pixels[Y, k]
        mx, my = m11 * x + m12 * y, m12 * x + m22 * y
        inverse = _ONE / np.sqrt(mx * mx + my * my + little)
        nx, ny = mx * inverse, my * inverse
        inverse_s = _ONE / np.sqrt(s11 * nx * nx + s12 * nx * ny + s22 * ny * ny)
        q = np.sqrt(x * mx + y * my)
        rows[NX, k], rows[NY, k], rows[PER_PX, k], rows[PER_SIGMA, k] = nx, ny, inverse, inverse_s
        rows[DISTANCE, k] = (q - _ONE) * q * inverse * inverse_s
    b1, b2, b3, b4, b5, b6 = _BELL
    z0, z1, z2, z3, z4, z5 = _TAIL
    for k in range(n):
        t = min(max(rows[DISTANCE, k], -_FARTHEST), _FARTHEST)
        # exp(-t^2 / 2) as the 32nd power of its Taylor series, erfc after Abramowitz and Stegun 26.2.17: within 1e-7,
        # in single precision 1e-6.
        u = t * t * b1
        bell = _ONE + u * (_ONE + u * (b2 + u * (b3 + u * (b4 + u * (b5 + u * b6)))))
        bell = bell * bell
        bell = bell * bell
        bell = bell * bell
        bell = bell * bell
        bell = _PEAK * bell * bell
        z = _ONE / (_ONE + z0 * abs(t))
        tail = bell * z * (z1 + z * (z2 + z * (z3 + z * (z4 + z * z5))))
        rows[STEP, k] = tail if t > _ZERO else _ONE - tail
        rows[SLOPE, k] = bell * rows[PER_SIGMA, k]


@compiled_fast
def _edge(p: Singles, ratio: float, limits: Limits, window: Window, free_shape: bool, sums: Array) -> None:
    """Residuals, weights and derivatives of edge pixels, from what `at_edge` found."""
    clip, low, high = limits
    pixels, n, rows = window.edge, window.n_edge, window.work
    edge2 = n_seen = n_held_back = slope2 = steep2 = _ZERO
    level, clip2 = p[LEVEL], clip * clip
    # In short loops: of one that fills more rows the compiler cannot tell whether they overlap, and runs it pixel by
    # pixel.
    for k in range(n):
        x, y = pixels[X, k], pixels[Y, k]
        light = p[LEVEL_U] * x + p[LEVEL_V] * y
        contrast = p[CONTRAST] + ratio * light + p[CONTRAST_U] * x + p[CONTRAST_V] * y
        model = level + light + contrast * rows[STEP, k]
        seen = (_ONE if model >= low else _ZERO) * (_ONE if model <= high else _ZERO)
        r = pixels[GREY, k] - model
        held = clip / max(abs(r), clip)
        square = seen * min(r * r, clip2)
        edge2 += square
        n_seen += seen
        n_held_back += seen * (_ONE if held < _ONE else _ZERO)
        g = rows[SLOPE, k] * contrast
        slope2 += seen * g * g
        steep2 += g * g * square
        rows[RESIDUAL, k], rows[WEIGHT, k], rows[SLOPE, k] = r, seen * held, g
    for k in range(n):
        x, y, step = pixels[X, k], pixels[Y, k], rows[STEP, k]
        lit = _ONE + ratio * step
        rows[GX, k], rows[GY, k] = rows[SLOPE, k] * rows[NX, k], rows[SLOPE, k] * rows[NY, k]
        rows[LIT_X, k], rows[LIT_Y, k], rows[STEP_X, k], rows[STEP_Y, k] = lit * x, lit * y, step * x, step * y
    if free_shape:
        half = np.float32(0.5)
        for k in range(n):
            x, y = pixels[X, k], pixels[Y, k]
            g = -half * rows[SLOPE, k] * rows[PER_PX, k]
            both = g * x * y
            rows[SHAPE, k], rows[SHAPE + 1, k], rows[SHAPE + 2, k] = g * x * x, both + both, g * y * y
        for k in range(n):
            nx, ny = rows[NX, k], rows[NY, k]
            g = half * rows[SLOPE, k] * rows[DISTANCE, k] * rows[PER_SIGMA, k]
            both = g * nx * ny
            rows[BLUR, k], rows[BLUR + 1, k], rows[BLUR + 2, k] = g * nx * nx, both + both, g * ny * ny
    sums[EDGE2], sums[N_EDGE], sums[N_HELD_BACK], sums[SLOPE2], sums[SLOPE2_EDGE2] = (
        edge2,
        n_seen,
        n_held_back,
        slope2,
        steep2,
    )


@compiled_fast
def _add(rows: Singles, n: int, first: int, count: int, full: bool, matrix: Array, right: Array, at: int) -> None:
    """Add weighted products of `count` derivative rows, from row `first`, to a matrix' lower triangle and a right-hand
    side.
    """
    weighted = rows[SCRATCH]
    for i in range(count):
        own = rows[first + i]
        total = _ZERO
        for k in range(n):
            weighted[k] = rows[WEIGHT, k] * own[k]
        for k in range(n):
            total += weighted[k] * rows[RESIDUAL, k]
        right[at + i] += total
        if full:
            for j in range(i + 1):
                other = rows[first + j]
                total = _ZERO
                for k in range(n):
                    total += weighted[k] * other[k]
                matrix[i, j] += total


@compiled_fast
def normal_equations(window: Window, p: Array, clip: float, full: bool, n_even: int, equations: Equations) -> None:
    """Accumulate the Gauss-Newton normal equations of `p` over the disc's window; residuals beyond `clip` are held
    back.

    `full` false leaves the right-hand sides only; `n_even` N_EVEN_HELD holds shape and blur.  Where the window touches
    black or white, edge pixels whose model comes within `clip` of it do not count: what they saw was clipped.  The
    plain ones do: they hold the level, and without them a small disc on a black ground loses it (real dot grid:
    0.0104 px in place of 0.0061).
    """
    even, odd, rhs, sums = equations
    if full:
        even[:] = 0.0
        odd[:] = 0.0
    rhs[:] = 0.0
    sums[:] = 0.0
    rows, n_edge, n_plain, single = window.work, window.n_edge, window.n_plain, p.astype(np.float32)
    ratio = np.float32(light_ratio(p))
    margin = min(clip, _FIRST_MARGIN * abs(p[CONTRAST]))
    limits = Limits(np.float32(clip), np.float32(window.black + margin), np.float32(window.white - margin))
    _plain(single, ratio, limits.residual, window.plain, n_plain, rows, sums)
    rows[ONE, :n_plain] = 1.0
    _add(rows, n_plain, ONE, 2, full, even, rhs, D_LEVEL)
    _add(rows, n_plain, LIT_X, 4, full, odd[2:, 2:], rhs, D_LEVEL_U)
    at_edge(single, window.edge, n_edge, rows)
    _edge(single, ratio, limits, window, n_even > N_EVEN_HELD, sums)
    rows[ONE, :n_edge] = 1.0
    _add(rows, n_edge, ONE, n_even, full, even, rhs, D_LEVEL)
    _add(rows, n_edge, GX, N_ODD, full, odd, rhs, FIRST_ODD)
    sums[N_WANTED], sums[N_SEEN] = window.n_wanted, n_edge
    sums[CLIPPED] = 1.0 if is_clipped(window) else 0.0
