"""The sub-pixel centre of a round marker, to the limit that the noise sets.

A window of the picture is fitted with an ellipse whose edge is a Gaussian step, on a background and a contrast that
may both slope (a lamp from one side brightens a white marker more on one side, and a plain threshold would shift its
centre).  The blur is a symmetric 2 x 2 matrix: motion during the exposure smears along one direction.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.edge_structure import edge_structure
from vision.markers.normal_equations import (
    CUT,
    EDGE2,
    IN2,
    N_CLIPPED,
    N_EDGE,
    N_IN,
    N_OUT,
    N_PAIRS,
    N_SEEN,
    N_STRANGE,
    N_SUMS,
    N_WANTED,
    OUT2,
    PAIRS2,
    SLOPE2,
    SLOPE2_EDGE2,
    normal_equations,
)
from vision.markers.solve import apply_step, believable, factor, solve, solve_odd
from vision.markers.window import NARROWEST, Window, collect, recentre

Array = NDArray[np.float64]

# Columns of a fit: what `fit_discs` takes (the first 14) and gives.
U, V, M11, M12, M22, S11, S12, S22, LEVEL, LEVEL_U, LEVEL_V, CONTRAST, CONTRAST_U, CONTRAST_V = range(14)
SD, NOISE, MISFIT, COVERAGE, OUTLIERS, OK = range(14, 20)
N_FIT = 20

_HUBER = 3.0
# The contrast's own slope costs a disc of 4 px three quarters of its precision: it is set free where nothing else
# explains the picture (0.03 % of chi^2, 2 dof), and where it is only likely (1 %) the sd says what it might have done.
_SLOPE_CHI2, _LIKELY_CHI2 = 16.0, 9.2
STRUCTURED = 1.0  # added to OUTLIERS of such a fit
_STRUCTURE = 1.3  # residual over pixel noise from which the residual is no longer noise
# slow over fast displacements of the edge, from which such a residual comes from another edge; JPEG and sharpening
# leave 1
_RED = 2.5
_ROUNDEST_OTHER = (
    0.038  # displacement of the edge from an ellipse over the radius: half discs have 0.043 and more, rough print 0.03
)
# times that grain counts as noise at most: paper that strong (8 greys) holds blobs of 4 times its rms and no more
_COARSEST = 2.0
_LEAST_NOISE = 0.3  # grey levels: whole numbers alone make 0.29
# Part of a centre's error that a step leaves, at least; of a held shape's 0.005 to 0.01 are measured up to 0.15 px off.
_LEAST_RATIO, _LEAST_RATIO_HELD = 0.12, 0.02
_STRANGE_SHARE = 0.025  # of the flat pixels around a disc, which are something else: chance leaves 0.3 %
# rms of the flat pixels over contrast from which something else leans them, unless it is their own noise: paper has
# 0.03
_LEANING = 0.05
_DEARER = 1.3  # how much less precise a fit may be that leaves it out
# misfit over contrast that it may have: a square without its corners leaves 0.12, and too few flat pixels to see it
_CLEAN = 0.08
_SURE_PX = 0.1  # sd from which on it is none
_FIT_FREEDOM = 9.0  # unknowns that the edge pixels decide: position 2, shape 3, blur 3, contrast about 1


@compiled
def _prepare(even: Array, odd: Array, n_even: int) -> bool:
    """Factor both matrices; False where they do not decide the unknowns."""
    for i in range(n_even):
        even[i, i] *= 1.0 + 1e-6
    for i in range(5, n_even):  # a weak pull keeps the blur's shape defined where a small disc hides it
        even[i, i] += 1e-4 * even[i, i] + 1e-9
    return factor(even, n_even) and factor(odd, 6)


@compiled
def _clip(sums: Array, first: bool) -> tuple[float, float]:
    """Residual from which a pixel is held back, and the flat pixels' noise.

    The noise of the edge counts only once the model has settled.
    """
    plateau = math.sqrt((sums[IN2] + sums[OUT2] + 1e-3) / (sums[N_IN] + sums[N_OUT] + 1e-3))
    edge = math.sqrt(sums[EDGE2] / sums[N_EDGE])
    return _HUBER * max(0.3, plateau if not first and edge < 2.0 * plateau else max(edge, plateau)), plateau


@compiled
def _first_clip(p: Array) -> float:
    """Residual from which a pixel is held back in the first step: by the noise when last seen, and the edge's slope
    times 0.05 px.
    """
    slope = 0.4 * abs(p[CONTRAST]) / math.sqrt(min(p[S11], p[S22]))
    return _HUBER * max(0.3, p[NOISE], p[MISFIT]) + 0.05 * slope


@compiled
def _judge(p: Array, window: Window, odd: Array, sums: Array, n_odd: int, gain: float, likely_shift: float) -> None:
    """What the fit is worth: sd of the centre, noise, misfit, coverage, outliers."""
    inverse_trace = 0.0
    unit = np.empty(6)
    for k in range(2):
        unit[:] = 0.0
        unit[k] = 1.0
        solve(odd, unit, 0, n_odd)
        inverse_trace += unit[k]
    # The sums are those before the last step, which took `gain` off them.
    squares = max(sums[EDGE2] - gain, 0.1 * sums[EDGE2])
    edge = math.sqrt(squares / max(sums[N_EDGE] - _FIT_FREEDOM, 0.3 * sums[N_EDGE]))
    n_plateau = sums[N_IN] + sums[N_OUT]
    plateau = math.sqrt((sums[IN2] + sums[OUT2]) / max(n_plateau - 6.0, 1.0)) if n_plateau > 20 else edge
    noise = math.sqrt((sums[N_EDGE] * edge**2 + n_plateau * plateau**2) / (sums[N_EDGE] + n_plateau))
    # Photons make bright pixels noisier than dark ones: what counts is the noise where the edge is steep.
    noise = max(noise, edge * math.sqrt(sums[SLOPE2_EDGE2] * sums[N_EDGE] / max(sums[SLOPE2] * sums[EDGE2], 1e-12)))
    # Neighbouring pixels differ by noise only; what the model misses (a shadow's edge, glare, paper, a halo of
    # sharpening) they share.
    white = math.sqrt(0.5 * sums[PAIRS2] / max(sums[N_PAIRS], 1.0)) if sums[N_PAIRS] > 30 else noise
    radius = (p[M11] * p[M22] - p[M12] * p[M12]) ** -0.25
    moving, red, shape = edge_structure(window.work, window.n_edge, radius, max(noise, _LEAST_NOISE))
    structured = max(edge, plateau) > _STRUCTURE * max(white, 0.3) and red > _RED
    p[SD] = math.sqrt(0.5 * inverse_trace * (moving**2 + 1.0 / 144.0) + 4e-7 + 0.5 * likely_shift**2)
    p[NOISE] = plateau
    p[MISFIT] = edge
    p[COVERAGE] = sums[N_SEEN] / sums[N_WANTED]
    p[OUTLIERS] = sums[N_CLIPPED] / sums[N_EDGE] + (STRUCTURED if structured else 0.0)
    # Grain of the surroundings averages out less than noise of single pixels does, and makes round blobs of its own.
    grain = plateau * min(max(plateau / max(white, 0.3), 1.0), _COARSEST)
    p[OK] = 1.0 if abs(p[CONTRAST]) > 4.0 * max(noise, grain) and shape < _ROUNDEST_OTHER else 0.0


@compiled
def _fit_one(
    image: NDArray[Any],
    p: Array,
    max_iterations: int,
    tolerance_px: float,
    n_even: int,
    most_blur_px2: float,
    narrow: int,
    even: Array,
    odd: Array,
    rhs: Array,
    sums: Array,
) -> None:
    """Gauss-Newton from `p` (length 20, changed in place); the matrices are kept while the steps are small."""
    start_u, start_v = p[U], p[V]
    r0 = max(p[M11] * p[M22] - p[M12] * p[M12], 1e-12) ** -0.25
    gain, likely_shift, before = 0.0, 0.0, 1e9
    # As the frame before left it: its noise says at once which pixels to hold back, and one step may be enough.
    seen_before = n_even == 2 and p[MISFIT] > 0.0
    clip = _first_clip(p) if seen_before else 1e9
    least_ratio = _LEAST_RATIO_HELD if n_even == 2 else _LEAST_RATIO
    full = True
    p[OK] = 0.0
    n_odd = 6 if p[CONTRAST_U] != 0.0 or p[CONTRAST_V] != 0.0 else 4
    settled = -1 if seen_before else 0
    gradient = np.empty(14)
    window = collect(image, p, narrow)
    at_u, at_v = p[U], p[V]
    for iteration in range(max_iterations):
        if full and iteration > 0:
            window = collect(image, p, narrow)
        else:
            recentre(window, p[U] - at_u, p[V] - at_v)
        at_u, at_v = p[U], p[V]
        normal_equations(window, p, clip, full, n_even, even, odd, rhs, sums)
        if sums[N_SEEN] < 0.8 * sums[N_WANTED] or sums[N_EDGE] < 12:
            return
        clip, plateau = _clip(sums, iteration == 0)
        if full and not _prepare(even, odd, n_even):
            return
        gradient[:] = rhs
        solve(even, rhs, 0, n_even)
        slope_test, slope_shift = solve_odd(odd, rhs, n_odd)
        gain = 0.0
        for i in range(14):
            if i < n_even or i >= 8:
                gain += gradient[i] * rhs[i]
        length = apply_step(p, rhs, r0)
        if not believable(p, r0, start_u, start_v) or max(p[S11], p[S22]) > most_blur_px2:
            return
        change = max(abs(rhs[2]), abs(rhs[3]), abs(rhs[4])) / max(p[M11], p[M22])
        blur_change = max(abs(rhs[5]), abs(rhs[6]), abs(rhs[7])) / max(p[S11], p[S22])
        # Steps shrink about geometrically: stop when all those to come together would not matter.
        ratio = min(max(length / before, least_ratio), 0.95)
        left = length * ratio / (1.0 - ratio)
        levels = (abs(rhs[0]) + abs(rhs[1]) + r0 * (abs(rhs[10]) + abs(rhs[11]))) / abs(p[CONTRAST])
        # Nearer than this the old matrices serve.
        full = length > 0.4 or ratio > 0.4 or change > 0.05 or blur_change > 0.2 or levels > 0.1
        before = length
        if iteration > settled and left < tolerance_px and change < 0.02 and blur_change < 0.2 and levels < 0.05:
            slope_test /= plateau * plateau + 0.1
            if n_odd == 6 or slope_test < _SLOPE_CHI2:
                likely_shift = slope_shift if slope_test > _LIKELY_CHI2 else 0.0
                break
            n_odd = 6
            full = True
            settled = iteration + 1
    _judge(p, window, odd, sums, n_odd, gain, likely_shift)


@compiled
def _strange(p: Array, sums: Array) -> bool:
    """Whether the disc's surroundings hold something else: pixels of it, or so much that they lean the level towards
    themselves.
    """
    if sums[N_STRANGE] > _STRANGE_SHARE * sums[N_OUT]:
        return True
    return p[NOISE] > _LEANING * abs(p[CONTRAST]) and p[NOISE] ** 2 * sums[N_PAIRS] > 0.5 * _STRUCTURE**2 * sums[PAIRS2]


@compiled
def _fit_narrowing(
    image: NDArray[Any],
    p: Array,
    max_iterations: int,
    tolerance_px: float,
    n_even: int,
    most_blur_px2: float,
    even: Array,
    odd: Array,
    rhs: Array,
    sums: Array,
) -> None:
    """As `_fit_one`; where the surroundings hold something else (a hole, a neighbour, a marker's own paper), with less
    of them.
    """
    start = p.copy()
    _fit_one(image, p, max_iterations, tolerance_px, n_even, most_blur_px2, 0, even, odd, rhs, sums)
    for narrow in range(1, NARROWEST + 1):
        strange = _strange(p, sums)
        # Greys that are cut off look structured and are not: less of them would only be less.
        if p[OK] > 0.0 and (p[OUTLIERS] < STRUCTURED or sums[CUT] > 0.0) and not strange:
            break
        fit = start.copy()
        _fit_one(image, fit, max_iterations, tolerance_px, n_even, most_blur_px2, narrow, even, odd, rhs, sums)
        clean = (
            fit[OK] > 0.0
            and fit[OUTLIERS] < STRUCTURED
            and fit[MISFIT] < _CLEAN * abs(fit[CONTRAST])
            and fit[SD] < _SURE_PX
            and abs(fit[CONTRAST]) > 0.4 * abs(start[CONTRAST])
        )
        if strange and clean and p[OK] > 0.0:
            # What leans the surroundings pulls the centre unseen: by as much as the two differ, beyond what noise lets
            # them.
            apart = 0.5 * ((fit[U] - p[U]) ** 2 + (fit[V] - p[V]) ** 2)
            p[SD] = math.sqrt(p[SD] ** 2 + max(apart - fit[SD] ** 2, 0.0))
        if clean and (p[OK] == 0.0 or fit[SD] < (_DEARER if strange else 1.0) * p[SD]):
            p[:] = fit


@compiled
def fit_discs(
    image: NDArray[Any],
    starts: Array,
    max_iterations: int = 12,
    tolerance_px: float = 0.001,
    hold_shape: bool = False,
    most_blur_px2: float = 1e9,
) -> Array:
    """Fit every disc of `starts` in one picture.

    Parameters
    ----------
    image : (h, w) uint8 or uint16, C-contiguous
    starts : (n, 20) rows as `disc_start` makes them, or the rows of the frame before
    max_iterations, tolerance_px : stop when the centre's step falls below the tolerance
    hold_shape : take shape and blur from the start and fit position and levels only: half the time, and as
        precise, because shape and blur keep their sign under reflection and position does not
    most_blur_px2 : squared blur from which a fit is given up, as one gone astray

    Returns
    -------
    (n, 20): centre U, V [px]; M11..M22: x' M x = 1 on the edge [1/px^2]; S11..S22: squared blur [px^2];
    levels and slopes (CONTRAST_U, CONTRAST_V: the contrast's slope beyond what the light's own slope makes); SD of the
    centre per axis [px]; NOISE of plateau and MISFIT (rms at the edge) [grey levels]; COVERAGE (share of the window
    inside the picture), OUTLIERS (share of edge pixels clipped, plus STRUCTURED
    where the residual is more than noise), OK (1: converged on something disc-like).
    """
    out = starts.copy()
    even, odd, rhs = np.zeros((8, 8)), np.zeros((6, 6)), np.zeros(14)
    sums = np.zeros(N_SUMS)
    # As plain numbers: of an argument left out the compiler knows more, and would compile everything below once more.
    iterations, tolerance, most_blur = int(max_iterations), float(tolerance_px), float(most_blur_px2)
    for i in range(len(out)):
        _fit_narrowing(image, out[i], iterations, tolerance, 2 if hold_shape else 8, most_blur, even, odd, rhs, sums)
    return out


def disc_start(
    u_px: float, v_px: float, radius_px: float, level: float, contrast: float, blur_px: float = 0.9
) -> Array:
    """A starting row for `fit_discs`: a circle of one brightness on one background."""
    row = np.zeros(N_FIT)
    row[[U, V, M11, M22, S11, S22]] = u_px, v_px, radius_px**-2, radius_px**-2, blur_px**2, blur_px**2
    row[LEVEL], row[CONTRAST] = level, contrast
    return row


def radius_px(fits: Array) -> Array:
    """Geometric mean radius [px] of fitted ellipses, shape (n, 20) -> (n,)."""
    return (fits[..., M11] * fits[..., M22] - fits[..., M12] ** 2) ** -0.25
