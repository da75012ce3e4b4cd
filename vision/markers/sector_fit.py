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

from ovines.robust import MEDIAN_TO_SD, TUKEY_SD
from vision.compiled import compiled, compiled_fast
from vision.markers.normal_equations import at_edge
from vision.markers.row import (
    BY_SECTORS,
    CONTRAST,
    CONTRAST_U,
    CONTRAST_V,
    COVERAGE,
    LEVEL,
    LEVEL_U,
    LEVEL_V,
    M11,
    M12,
    M22,
    MISFIT,
    NOISE,
    OK,
    OUTLIERS,
    S11,
    S22,
    SD,
    U,
    V,
    determinant,
)
from vision.markers.solve import factor, solve
from vision.markers.window import DISTANCE, GREY, N_EDGE_ROWS, N_WORK, PER_SIGMA, SCRATCH, SLOPE, STEP, X, Y, span, take

Array = NDArray[np.float64]
Singles = NDArray[np.float32]

_MOST, _FEWEST, _ARC_PX = 24, 10, 3.0  # sectors, and their length along the edge
_BAND_SIGMAS, _FLAT_PX = 2.5, 2.0  # of the blurred edge, and of each side's plain level beyond it
_WIDEST = 4.0  # times the band of a round disc that a flat one's may have: of a shape gone astray not the whole picture
_LEAST_SHARE = 0.6  # share of the sectors that must agree
_LEAST_WEIGHT = 0.3  # of a sector that counts as agreeing
_MOST_NOISE = 4.0  # times the median sector's: another edge runs through
_HALF_COVERED = 2.0
_BEST_SECTORS = 20.0  # percentile of the sectors' rms that stands for the best of them
# Share of the edge in the picture: a sector that the picture's border cuts is off by up to a pixel, and does not know
# it.
_LEAST_IN_PICTURE = 0.98
_ARCTAN = tuple(np.float32(c) for c in (0.9998660, -0.3302995, 0.1801410, -0.0851330, 0.0208351))
_FEWEST_PIXELS = 8  # of a sector, for its three unknowns
_ROUNDING2 = 1.0 / 12.0  # squared noise of whole grey levels
_ROUNDS, _REWEIGHTINGS = 8, 6
_SETTLED_PX, _SETTLED_RADIUS_PX = 0.003, 0.02  # steps that end the fit
# Parts of the radius: the step of the centre, of the radius, and the way from the start, beyond which it went astray.
_MOST_STEP, _MOST_GROWTH, _MOST_WAY = 0.6, 0.4, 1.5
_LEAST_CONTRAST = 4.0  # in parts of the noise
_SURE_PX = 0.15  # sd of the centre from which on it is no disc
# Sums per sector over its pixels.  Of a pixel's share outside the edge, inside it, and bell (slope of the step) their
# products, and those with its grey; squared greys; pixels.
OUT_OUT, OUT_IN, IN_IN, OUT_BELL, IN_BELL, BELL_BELL, OUT_GREY, IN_GREY, BELL_GREY, GREY_GREY, PIXELS = range(11)
_N_SUMS = 11
# Of each sector: how far the edge lies outside the ellipse [px], its sd for unit noise, rms and both levels [grey
# levels].
OFFSET, OFFSET_SD, RMS, OUTSIDE, WITHIN = range(5)
_N_FOUND = 5
# Steps of the ellipse: centre, radius, and the two differences that make it oval [px].
D_CENTRE_U, D_CENTRE_V, D_RADIUS, D_OVAL_STRAIGHT, D_OVAL_SLANTED = range(5)
_N_STEP, _N_STEP_HELD = 5, 2


@compiled
def _band_pixels(image: NDArray[Any], p: Array, band: float) -> tuple[Singles, int, int]:
    """Pixels (3, enough) within about `band` px of the edge that lie in the picture; how many, and how many there would
    be.
    """
    half_trace = 0.5 * (p[M11] + p[M22])
    root = math.sqrt(max(half_trace * half_trace - determinant(p), 0.0))
    r_max, r_min = 1.0 / math.sqrt(half_trace - root), 1.0 / math.sqrt(half_trace + root)
    outer = 1.0 + min(band / r_min, _WIDEST * band / r_max)
    q_in2, q_out2 = max(1.0 - band / r_min, 0.0) ** 2, outer**2
    half_width = r_max * outer
    side = 2 * int(half_width) + 5
    pixels = np.empty((N_EDGE_ROWS, side * side), np.float32)
    n = wanted = 0
    for row in range(math.floor(p[V] - half_width), math.ceil(p[V] + half_width) + 1):
        first, last = span(p, q_out2, row - p[V])
        in_first, in_last = span(p, q_in2, row - p[V])
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
    band = _BAND_SIGMAS * math.sqrt(max(p[S11], p[S22])) + _FLAT_PX
    pixels, n, wanted = _band_pixels(image, p, band)
    rows = np.empty((N_WORK, n + 1), np.float32)
    at_edge(p.astype(np.float32), pixels, n, rows)
    _sectors(pixels, n, n_sectors, rows[SCRATCH])
    for k in range(n):
        if abs(rows[DISTANCE, k]) > band * rows[PER_SIGMA, k]:
            continue
        value, inside, bell = float(pixels[GREY, k]), float(rows[STEP, k]), float(rows[SLOPE, k])
        outside = 1.0 - inside
        s = sums[int(rows[SCRATCH, k])]
        s[OUT_OUT] += outside * outside
        s[OUT_IN] += outside * inside
        s[IN_IN] += inside * inside
        s[OUT_BELL] += outside * bell
        s[IN_BELL] += inside * bell
        s[BELL_BELL] += bell * bell
        s[OUT_GREY] += outside * value
        s[IN_GREY] += inside * value
        s[BELL_GREY] += bell * value
        s[GREY_GREY] += value * value
        s[PIXELS] += 1.0
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
        a[0, 0], a[1, 0], a[1, 1] = s[OUT_OUT], s[OUT_IN], s[IN_IN]
        a[2, 0], a[2, 1], a[2, 2] = s[OUT_BELL], s[IN_BELL], s[BELL_BELL]
        b[0], b[1], b[2] = s[OUT_GREY], s[IN_GREY], s[BELL_GREY]
        if s[PIXELS] < _FEWEST_PIXELS or not factor(a, 3):
            continue
        solve(a, b, 0, 3)
        contrast = b[1] - b[0]
        if contrast * sign <= 0.0:
            continue
        unit[0] = unit[1] = 0.0
        unit[2] = 1.0
        solve(a, unit, 0, 3)
        squares = max(s[GREY_GREY] - b[0] * s[OUT_GREY] - b[1] * s[IN_GREY] - b[2] * s[BELL_GREY], 0.0)
        rms = math.sqrt(squares / max(s[PIXELS] - 3.0, 1.0) + _ROUNDING2)
        found[k, OFFSET], found[k, OFFSET_SD] = b[2] / contrast, math.sqrt(unit[2]) / abs(contrast)
        found[k, RMS], found[k, OUTSIDE], found[k, WITHIN] = rms, b[0], b[1]
    return float(np.nanmedian(found[:n_sectors, RMS]))


@compiled
def _move(p: Array, found: Array, noise: float, n_free: int, weight: Array, step: Array, matrix: Array) -> float:
    """Tukey's robust least squares of the sectors' offsets, for a `step` of the first `n_free` of D_CENTRE_U...; mean
    squared residual in sds, <0: none.
    """
    n_sectors = len(found)
    turn = 2 * math.pi / n_sectors
    rows = np.empty((n_sectors, _N_STEP))
    for k in range(n_sectors):
        angle = (k + 0.5) * turn - math.pi
        x, y = math.cos(angle), math.sin(angle)
        mx, my = p[M11] * x + p[M12] * y, p[M12] * x + p[M22] * y
        norm = math.hypot(mx, my)
        rows[k, D_CENTRE_U], rows[k, D_CENTRE_V], rows[k, D_RADIUS] = mx / norm, my / norm, 1.0
        rows[k, D_OVAL_STRAIGHT], rows[k, D_OVAL_SLANTED] = x * x - y * y, 2.0 * x * y
    step[:] = 0.0
    step[D_RADIUS] = np.nanmedian(found[:, OFFSET]) if n_free > _N_STEP_HELD else 0.0
    residual = np.empty(n_sectors)
    for _ in range(_REWEIGHTINGS):
        for k in range(n_sectors):
            sd = found[k, OFFSET_SD] * max(noise, found[k, RMS])
            left = found[k, OFFSET]
            for i in range(n_free):
                left -= rows[k, i] * step[i]
            residual[k] = left / sd
        scale = max(1.0, MEDIAN_TO_SD * float(np.nanmedian(np.abs(residual))))
        matrix[:] = 0.0
        right = np.zeros(_N_STEP)
        total = squares = 0.0
        for k in range(n_sectors):
            u = residual[k] / (TUKEY_SD * scale)
            agrees = np.isfinite(u) and abs(u) < 1.0 and found[k, RMS] < _MOST_NOISE * noise
            weight[k] = (1.0 - u * u) ** 2 if agrees else 0.0
            if not agrees:
                continue
            w = weight[k] / (found[k, OFFSET_SD] * max(noise, found[k, RMS])) ** 2
            total += weight[k]
            squares += weight[k] * residual[k] ** 2
            for i in range(n_free):
                right[i] += w * rows[k, i] * found[k, OFFSET]
                for j in range(i + 1):
                    matrix[i, j] += w * rows[k, i] * rows[k, j]
        if total < _LEAST_SHARE * n_sectors or not factor(matrix, n_free):
            return -1.0
        solve(matrix, right, 0, n_free)
        step[:n_free] = right[:n_free]
    return squares / max(total - n_free, 1.0)


@compiled
def fit_by_sectors(image: NDArray[Any], start: Array, hold_shape: bool) -> Array:
    """Fit one disc from a row of `vision.markers.row.disc_start` or of an earlier fit; a row of the same columns, OK 0
    where it fails.

    Blur is taken from the start; `hold_shape` takes the shape from there too.  LEVEL and CONTRAST are medians.
    """
    p = start.copy()
    p[LEVEL_U] = p[LEVEL_V] = p[CONTRAST_U] = p[CONTRAST_V] = p[OK] = 0.0
    r = max(determinant(p), 1e-12) ** -0.25
    n = min(max(int(2 * math.pi * r / _ARC_PX), _FEWEST), _MOST)
    n_free = _N_STEP_HELD if hold_shape else _N_STEP
    sums, found, weight = np.empty((n, _N_SUMS)), np.full((n, _N_FOUND), np.nan), np.zeros(n)
    step, matrix = np.zeros(_N_STEP), np.zeros((_N_STEP, _N_STEP))
    for _ in range(_ROUNDS):
        p[COVERAGE] = _gather(image, p, n, sums)
        noise = _offsets(sums, n, p[CONTRAST], found)
        # Where half of the sectors fit far worse than the best do, the disc itself is half covered.
        if (
            not np.isfinite(noise)
            or p[COVERAGE] < _LEAST_IN_PICTURE
            or noise > _HALF_COVERED * np.nanpercentile(found[:, RMS], _BEST_SECTORS)
        ):
            return p
        chi2 = _move(p, found, noise, n_free, weight, step, matrix)
        length = math.hypot(step[D_CENTRE_U], step[D_CENTRE_V])
        if chi2 < 0.0 or length > _MOST_STEP * r or abs(step[D_RADIUS]) > _MOST_GROWTH * r:
            return p
        p[U] += step[D_CENTRE_U]
        p[V] += step[D_CENTRE_V]
        grow = -2.0 / r**3
        p[M11] += grow * (step[D_RADIUS] + step[D_OVAL_STRAIGHT])
        p[M12] += grow * step[D_OVAL_SLANTED]
        p[M22] += grow * (step[D_RADIUS] - step[D_OVAL_STRAIGHT])
        if determinant(p) <= 0.0 or math.hypot(p[U] - start[U], p[V] - start[V]) > _MOST_WAY * r:
            return p
        if length < _SETTLED_PX and abs(step[D_RADIUS]) < _SETTLED_RADIUS_PX:
            break
    trace = 0.0
    for i in range(2):
        unit = np.zeros(_N_STEP)
        unit[i] = 1.0
        solve(matrix, unit, 0, n_free)
        trace += unit[i]
    used = weight > _LEAST_WEIGHT
    p[LEVEL] = np.median(found[:, OUTSIDE][used])
    p[CONTRAST] = np.median(found[:, WITHIN][used]) - p[LEVEL]
    p[SD] = math.sqrt(0.5 * trace * max(chi2, 1.0))
    p[NOISE] = p[MISFIT] = noise
    p[OUTLIERS] = BY_SECTORS + 1.0 - np.mean(used)
    agreed = np.mean(used) > _LEAST_SHARE and p[SD] < _SURE_PX
    p[OK] = 1.0 if abs(p[CONTRAST]) > _LEAST_CONTRAST * noise and agreed else 0.0
    return p
