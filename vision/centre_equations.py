"""The normal equations of a blurred disc: what every pixel of its window says of the model's parameters.

Two facts keep it cheap: only pixels near the edge tell where it is, and about the centre the unknowns split into those
that keep their sign under reflection (levels, shape, blur) and those that change it (position, slopes), so that the
equations fall apart into 8 and 6.

A lamp from one side multiplies disc and background alike: the contrast's slope is the level's slope times contrast over
level, and only what differs from that (a glare, a shadow's edge) is a free parameter.  Left free throughout it would cost
a small disc up to three quarters of its precision; held at zero it pulls the centre of a disc under strong light.
"""

from __future__ import annotations

import math

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.special import erfc

Array = NDArray[np.float64]

_EDGE_SIGMAS = 3.2  # beyond, the Gaussian step is within 0.1 % of its level
_RING_PX = 4.0  # of plain background about the edge: it holds the light's slope (2 px cost a disc of 6 px 15 % of its precision)
FAST = {"reassoc", "contract", "arcp", "nsz"}  # not "nnan": comparisons with NaN must stay false
# The Gaussian step and its slope, interpolated linearly (error 4e-6): erfc and exp were two thirds of the time.
_TABLE_END, _TABLE_PER_UNIT = 6.0, 90.0
_TABLE_SIZE = int(2 * _TABLE_END * _TABLE_PER_UNIT) + 1
_TABLE_T = np.linspace(-_TABLE_END, _TABLE_END, _TABLE_SIZE)
_STEP = 0.5 * erfc(_TABLE_T / math.sqrt(2.0))
_BELL = np.exp(-0.5 * _TABLE_T**2) / math.sqrt(2 * math.pi)
# What `sums` counts: edge squares, edge pixels, pixels wanted, pixels inside the picture, clipped edge pixels, flat pixels
# inside the disc and their squares, outside and their squares, neighbouring flat pixels and squares of their differences.
EDGE2, N_EDGE, N_WANTED, N_SEEN, N_CLIPPED, N_IN, IN2, N_OUT, OUT2, N_PAIRS, PAIRS2 = range(11)
N_SUMS = 11


@numba.njit(nogil=True, cache=True, error_model="numpy")
def light_ratio(p: Array) -> float:
    """Contrast over level: how much of the level's slope the contrast shares when the light alone varies."""
    return p[11] / max(p[8], 0.03 * abs(p[11]) + 1e-9)


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _add_flat(flat: Array, ratio: float, full: bool, even: Array, odd: Array, rhs: Array) -> None:
    """Pixels away from the edge tell of levels and slopes only; `flat` (2, 7) holds their sums outside and inside.

    Per group: weight, its xx, xy, yy moments, weighted residual and its x, y moments.
    """
    for f in range(2):
        w, wxx, wxy, wyy, wr, wrx, wry = flat[f]
        k = 1.0 + ratio * f
        rhs[0] += wr
        rhs[1] += f * wr
        for i, moment in enumerate((wrx, wry)):
            rhs[10 + i] += k * moment
            rhs[12 + i] += f * moment
        if not full:
            continue
        even[0, 0] += w
        even[1, 0] += f * w
        even[1, 1] += f * w
        odd[2, 2] += k * k * wxx
        odd[3, 2] += k * k * wxy
        odd[3, 3] += k * k * wyy
        odd[4, 2] += k * f * wxx
        odd[5, 2] += k * f * wxy
        odd[4, 3] += k * f * wxy
        odd[5, 3] += k * f * wyy
        odd[4, 4] += f * wxx
        odd[5, 4] += f * wxy
        odd[5, 5] += f * wyy


@numba.njit(nogil=True, cache=True, error_model="numpy")
def _reach(p: Array) -> tuple[float, float, float, float]:
    """Where the edge band begins and ends and the window ends, as x' M x, and the window's half width [px]."""
    half_trace = 0.5 * (p[2] + p[4])
    root = math.sqrt(max(half_trace * half_trace - (p[2] * p[4] - p[3] * p[3]), 0.0))
    r_max = 1.0 / math.sqrt(half_trace - root)
    r_min = 1.0 / math.sqrt(half_trace + root)
    blur = math.sqrt(0.5 * (p[5] + p[7]) + math.sqrt(0.25 * (p[5] - p[7]) ** 2 + p[6] * p[6]))
    band = _EDGE_SIGMAS * blur + 0.5
    ring = band + _RING_PX
    return max(1.0 - band / r_min, 0.0) ** 2, (1.0 + band / r_min) ** 2, (1.0 + ring / r_min) ** 2, r_max * (1.0 + ring / r_min)


@numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=FAST)
def _edge(x: float, y: float, mx: float, my: float, q2: float, s11: float, s12: float, s22: float
          ) -> tuple[float, float, float, float, float, float, float]:
    """At an edge pixel: the step (1 inside, 0 outside) and its slope per px, the normal, distance in sigmas, and scales."""
    inverse = 1.0 / (math.sqrt(mx * mx + my * my) + 1e-30)
    nx, ny = mx * inverse, my * inverse
    inverse_s = 1.0 / math.sqrt(s11 * nx * nx + 2.0 * s12 * nx * ny + s22 * ny * ny)
    q = math.sqrt(q2)
    t = (q - 1.0) * q * inverse * inverse_s
    place = (t + _TABLE_END) * _TABLE_PER_UNIT
    cell = min(max(int(place), 0), _TABLE_SIZE - 2)
    part = place - cell
    step = _STEP[cell] + part * (_STEP[cell + 1] - _STEP[cell])
    slope = (_BELL[cell] + part * (_BELL[cell + 1] - _BELL[cell])) * inverse_s
    return step, slope, nx, ny, t, inverse, inverse_s


@numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=FAST, inline="always")
def _add_edge(w: float, r: float, je: Array, jo: Array, full: bool, n_even: int, even: Array, odd: Array, rhs: Array) -> None:
    """One edge pixel's share: residual `r` of weight `w` with its derivatives by the even and the odd unknowns."""
    for i in range(6):
        rhs[8 + i] += w * r * jo[i]
    for i in range(n_even):
        rhs[i] += w * r * je[i]
    if full:
        for i in range(6):
            for j in range(6):
                odd[i, j] += w * jo[i] * jo[j]
        for i in range(n_even):
            for j in range(n_even):
                even[i, j] += w * je[i] * je[j]


@numba.njit(nogil=True, cache=True, error_model="numpy", fastmath=FAST)
def normal_equations(image: NDArray, p: Array, clip: float, full: bool, n_even: int, even: Array, odd: Array, rhs: Array,
                     sums: Array) -> None:
    """Accumulate the Gauss-Newton normal equations of `p` over the disc's window; residuals beyond `clip` are held back.

    `full` false leaves the right-hand sides only; `n_even` 2 holds shape and blur.
    even (8, 8), odd (6, 6), rhs (14,), `sums` (N_SUMS,): out.
    """
    je, jo, flat = np.empty(8), np.empty(6), np.zeros((2, 7))
    if full:
        even[:] = 0.0
        odd[:] = 0.0
    rhs[:] = 0.0
    sums[:] = 0.0
    height, width = image.shape
    cu, cv, m11, m12, m22, s11, s12, s22 = p[0], p[1], p[2], p[3], p[4], p[5], p[6], p[7]
    q_in2, q_edge2, q_out2, reach = _reach(p)
    ratio = light_ratio(p)
    clip2 = clip * clip
    n_wanted = n_seen = 0
    for row in range(math.floor(cv - reach), math.ceil(cv + reach) + 1):
        y = row - cv
        last_col, last_r = -10, 0.0
        for col in range(math.floor(cu - reach), math.ceil(cu + reach) + 1):
            x = col - cu
            mx, my = m11 * x + m12 * y, m12 * x + m22 * y
            q2 = x * mx + y * my
            if q2 > q_out2:
                continue
            near = q2 < q_edge2
            n_wanted += near
            if row < 0 or row >= height or col < 0 or col >= width:
                continue
            n_seen += near
            light = p[9] * x + p[10] * y
            contrast = p[11] + ratio * light + p[12] * x + p[13] * y
            above = float(image[row, col]) - p[8] - light
            if q2 < q_in2 or not near:
                f = 1 if q2 < q_in2 else 0
                r = above - f * contrast
                k = N_IN if f else N_OUT
                sums[k] += 1.0
                sums[k + 1] += min(r * r, clip2)
                if col == last_col + 1:
                    sums[N_PAIRS] += 1.0
                    sums[PAIRS2] += min((r - last_r) ** 2, 2.0 * clip2)
                last_col, last_r = col, r
                w = min(1.0, clip2 / (r * r + 1e-9))  # a neighbour in the ring is no light: it shall not lean the level
                for i, term in enumerate((w, w * x * x, w * x * y, w * y * y, w * r, w * r * x, w * r * y)):
                    flat[f, i] += term
                continue
            step, g, nx, ny, t, inverse, inverse_s = _edge(x, y, mx, my, q2, s11, s12, s22)
            r = above - contrast * step
            w = 1.0 if abs(r) < clip else clip / abs(r)
            sums[EDGE2] += min(r * r, clip2)
            sums[N_EDGE] += 1.0
            sums[N_CLIPPED] += w < 1.0
            g *= contrast
            lit = 1.0 + ratio * step
            jo[0], jo[1], jo[2], jo[3], jo[4], jo[5] = g * nx, g * ny, lit * x, lit * y, step * x, step * y
            je[0], je[1] = 1.0, step
            if n_even > 2:
                gm, gs = -0.5 * g * inverse, 0.5 * g * t * inverse_s
                je[2], je[3], je[4] = gm * x * x, 2.0 * gm * x * y, gm * y * y
                je[5], je[6], je[7] = gs * nx * nx, 2.0 * gs * nx * ny, gs * ny * ny
            _add_edge(w, r, je, jo, full, n_even, even, odd, rhs)
    _add_flat(flat, ratio, full, even, odd, rhs)
    sums[N_WANTED], sums[N_SEEN] = n_wanted, n_seen
