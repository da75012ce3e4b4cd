"""The centre of a marker whose surroundings are not of one brightness: glued across the edge of the wall, in a shadow's
edge.

The edge is divided into sectors.  Each finds, with levels of its own on both sides, how far the edge lies from where
the ellipse has it; the ellipse is then moved by a robust fit to those offsets.  A sector through which another edge
runs does not agree, or fits badly, and drops out.  Own levels cost precision (about a third), so this is the second
choice after `vision.markers.fit.fit_discs`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, compiled_fast
from vision.markers.normal_equations import at_edge
from vision.markers.solve import factor, solve
from vision.markers.window import GREY, N_WORK, PER_SIGMA, SCRATCH, SLOPE, STEP, T, X, Y, span, take

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

_MOST, _FEWEST, _ARC_PX = 24, 10, 3.0  # sectors, and their length along the edge
_FLAT_PX = 2.0  # of each side's plain level beyond the blurred edge
_TUKEY = 4.685
_LEAST_SHARE = 0.6  # of the sectors that must agree
_HALF_COVERED = 2.0
_LEAST_IN_PICTURE = (
    0.98  # of the edge: a sector that the picture's border cuts is off by up to a pixel, and does not know it
)
BY_SECTORS = 2.0  # added to a fit's share of outliers: how this fit was made
_ARCTAN = tuple(np.float32(c) for c in (0.9998660, -0.3302995, 0.1801410, -0.0851330, 0.0208351))
_N_SUMS = 11  # per sector: the six of the 3 x 3 normal matrix, the three right-hand sides, squares, pixels


@compiled
def _band_pixels(image: NDArray[Any], p: Array, band: float) -> tuple[Singles, int, int]:
    """Pixels (3, enough) within about `band` px of the edge that lie in the picture; how many, and how many there would
    be.
    """
    half_trace = 0.5 * (p[2] + p[4])
    root = math.sqrt(max(half_trace * half_trace - (p[2] * p[4] - p[3] * p[3]), 0.0))
    r_max, r_min = 1.0 / math.sqrt(half_trace - root), 1.0 / math.sqrt(half_trace + root)
    outer = 1.0 + min(band / r_min, 4.0 * band / r_max)  # of a shape gone astray not the whole picture
    q_in2, q_out2 = max(1.0 - band / r_min, 0.0) ** 2, outer**2
    half_width = r_max * outer
    side = 2 * int(half_width) + 5
    pixels = np.empty((3, side * side), np.float32)
    n = wanted = 0
    for row in range(math.floor(p[1] - half_width), math.ceil(p[1] + half_width) + 1):
        first, last = span(p, q_out2, row - p[1])
        in_first, in_last = span(p, q_in2, row - p[1])
        if in_first > in_last:  # no middle in this row
            in_first, in_last = last + 1, last
        wanted += max(last - first + 1, 0) - (in_last - in_first + 1)
        if 0 <= row < image.shape[0]:
            n = take(image, row, first, in_first - 1, p, pixels, n)
            n = take(image, row, in_last + 1, last, p, pixels, n)
    return pixels, n, wanted


@compiled_fast
def _sectors(pixels: Singles, n: int, n_sectors: int, sector: Singles) -> None:
    """In which of so many sectors, from -pi on, each pixel lies, as (n,) numbers; angles to 1e-5 (Abramowitz and Stegun
    4.4.49).
    """
    little, one, half, turn = (
        np.float32(1e-30),
        np.float32(1.0),
        np.float32(0.5 * n_sectors),
        np.float32(n_sectors / (2.0 * math.pi)),
    )
    right, straight = np.float32(0.5 * math.pi), np.float32(math.pi)
    a1, a2, a3, a4, a5 = _ARCTAN
    for k in range(n):
        x, y = pixels[X, k], pixels[Y, k]
        ax, ay = abs(x), abs(y)
        slope = min(ax, ay) / (max(ax, ay) + little)
        s2 = slope * slope
        angle = slope * (a1 + s2 * (a2 + s2 * (a3 + s2 * (a4 + s2 * a5))))
        angle = right - angle if ay > ax else angle
        angle = straight - angle if x < 0 else angle
        angle = -angle if y < 0 else angle
        sector[k] = min(max(angle * turn + half, one - one), half + half - one)


@compiled
def _gather(image: NDArray[Any], p: Array, n_sectors: int, sums: Array) -> float:
    """Normal equations of (level outside, level inside, contrast times offset) per sector; share of the edge in the
    picture.
    """
    sums[:] = 0.0
    band = 2.5 * math.sqrt(max(p[5], p[7])) + _FLAT_PX
    pixels, n, wanted = _band_pixels(image, p, band)
    rows = np.empty((N_WORK, n + 1), np.float32)
    at_edge(p.astype(np.float32), pixels, n, rows)
    _sectors(pixels, n, n_sectors, rows[SCRATCH])
    for k in range(n):
        if abs(rows[T, k]) > band * rows[PER_SIGMA, k]:
            continue
        value, inside, bell = float(pixels[GREY, k]), float(rows[STEP, k]), float(rows[SLOPE, k])
        outside = 1.0 - inside
        s = sums[int(rows[SCRATCH, k])]
        s[0] += outside * outside
        s[1] += outside * inside
        s[2] += inside * inside
        s[3] += outside * bell
        s[4] += inside * bell
        s[5] += bell * bell
        s[6] += outside * value
        s[7] += inside * value
        s[8] += bell * value
        s[9] += value * value
        s[10] += 1.0
    return n / max(wanted, 1)


@compiled
def _offsets(sums: Array, n_sectors: int, sign: float, found: Array) -> float:
    """Per sector: offset of the edge [px], its sd for unit noise, rms, both levels; NaN where there is no edge.  Median
    rms.
    """
    a, b, unit = np.empty((3, 3)), np.empty(3), np.empty(3)
    for k in range(n_sectors):
        s = sums[k]
        found[k] = np.nan
        a[0, 0], a[1, 0], a[1, 1], a[2, 0], a[2, 1], a[2, 2] = s[0], s[1], s[2], s[3], s[4], s[5]
        b[:] = s[6:9]
        if s[10] < 8 or not factor(a, 3):
            continue
        solve(a, b, 0, 3)
        contrast = b[1] - b[0]
        if contrast * sign <= 0.0:
            continue
        unit[0] = unit[1] = 0.0
        unit[2] = 1.0
        solve(a, unit, 0, 3)
        squares = max(s[9] - b[0] * s[6] - b[1] * s[7] - b[2] * s[8], 0.0)
        rms = math.sqrt(squares / max(s[10] - 3.0, 1.0) + 1.0 / 12.0)
        found[k, 0], found[k, 1], found[k, 2] = b[2] / contrast, math.sqrt(unit[2]) / abs(contrast), rms
        found[k, 3], found[k, 4] = b[0], b[1]
    return float(np.nanmedian(found[:n_sectors, 2]))


@compiled
def _move(
    p: Array, n_sectors: int, found: Array, noise: float, n_free: int, weight: Array, step: Array, matrix: Array
) -> float:
    """Robust least squares of the offsets: shift (2), size and flattening (3); mean squared residual in sds, <0:
    none.
    """
    turn = 2 * math.pi / n_sectors
    rows = np.empty((n_sectors, 5))
    for k in range(n_sectors):
        angle = (k + 0.5) * turn - math.pi
        x, y = math.cos(angle), math.sin(angle)
        mx, my = p[2] * x + p[3] * y, p[3] * x + p[4] * y
        norm = math.hypot(mx, my)
        rows[k, 0], rows[k, 1], rows[k, 2], rows[k, 3], rows[k, 4] = (
            mx / norm,
            my / norm,
            1.0,
            x * x - y * y,
            2.0 * x * y,
        )
    step[:] = 0.0
    step[2] = np.nanmedian(found[:n_sectors, 0]) if n_free > 2 else 0.0
    residual = np.empty(n_sectors)
    for _ in range(6):
        for k in range(n_sectors):
            sd = found[k, 1] * max(noise, found[k, 2])
            left = found[k, 0]
            for i in range(n_free):
                left -= rows[k, i] * step[i]
            residual[k] = left / sd
        scale = max(1.0, 1.4826 * float(np.nanmedian(np.abs(residual))))
        matrix[:] = 0.0
        right = np.zeros(5)
        total = squares = 0.0
        for k in range(n_sectors):
            u = residual[k] / (_TUKEY * scale)
            good = np.isfinite(u) and abs(u) < 1.0 and found[k, 2] < 4.0 * noise
            weight[k] = (1.0 - u * u) ** 2 if good else 0.0
            if not good:
                continue
            w = weight[k] / (found[k, 1] * max(noise, found[k, 2])) ** 2
            total += weight[k]
            squares += weight[k] * residual[k] ** 2
            for i in range(n_free):
                right[i] += w * rows[k, i] * found[k, 0]
                for j in range(i + 1):
                    matrix[i, j] += w * rows[k, i] * rows[k, j]
        if total < _LEAST_SHARE * n_sectors or not factor(matrix, n_free):
            return -1.0
        solve(matrix, right, 0, n_free)
        step[:n_free] = right[:n_free]
    return squares / max(total - n_free, 1.0)


@compiled
def fit_by_sectors(image: NDArray[Any], start: Array, hold_shape: bool) -> Array:
    """Fit one disc from a row of `centre.disc_start` or of an earlier fit; a row of the same columns, OK 0 where it
    fails.

    Blur is taken from the start; `hold_shape` takes the shape from there too.  LEVEL and CONTRAST are medians.
    """
    p = start.copy()
    p[9] = p[10] = p[12] = p[13] = p[19] = 0.0
    r = max(p[2] * p[4] - p[3] * p[3], 1e-12) ** -0.25
    n = min(max(int(2 * math.pi * r / _ARC_PX), _FEWEST), _MOST)
    n_free = 2 if hold_shape else 5
    sums, found, weight = np.empty((n, _N_SUMS)), np.full((n, 5), np.nan), np.zeros(n)
    step, matrix = np.zeros(5), np.zeros((5, 5))
    for _ in range(8):
        p[17] = _gather(image, p, n, sums)
        noise = _offsets(sums, n, p[11], found)
        # Where half of the sectors fit far worse than the best do, the disc itself is half covered.
        if (
            not np.isfinite(noise)
            or p[17] < _LEAST_IN_PICTURE
            or noise > _HALF_COVERED * np.nanpercentile(found[:, 2], 20.0)
        ):
            return p
        chi2 = _move(p, n, found, noise, n_free, weight, step, matrix)
        length = math.hypot(step[0], step[1])
        if chi2 < 0.0 or length > 0.6 * r or abs(step[2]) > 0.4 * r:
            return p
        p[0] += step[0]
        p[1] += step[1]
        grow = -2.0 / r**3
        p[2] += grow * (step[2] + step[3])
        p[3] += grow * step[4]
        p[4] += grow * (step[2] - step[3])
        if p[2] * p[4] - p[3] * p[3] <= 0.0 or math.hypot(p[0] - start[0], p[1] - start[1]) > 1.5 * r:
            return p
        if length < 0.003 and abs(step[2]) < 0.02:
            break
    trace = 0.0
    for i in range(2):
        unit = np.zeros(5)
        unit[i] = 1.0
        solve(matrix, unit, 0, n_free)
        trace += unit[i]
    used = weight > 0.3
    p[8] = np.median(found[:, 3][used])
    p[11] = np.median(found[:, 4][used]) - p[8]
    p[14] = math.sqrt(0.5 * trace * max(chi2, 1.0))
    p[15] = p[16] = noise
    p[18] = BY_SECTORS + 1.0 - np.mean(used)
    p[19] = 1.0 if abs(p[11]) > 4.0 * noise and np.mean(used) > _LEAST_SHARE and p[14] < 0.15 else 0.0
    return p
