"""The sub-pixel centre of a round marker, to the limit that the noise sets.

A window of the picture is fitted with an ellipse whose edge is a Gaussian step, on a background and a contrast that
may both slope (a lamp from one side brightens a white marker more on one side, and a plain threshold would shift its
centre).  The blur is a symmetric 2 x 2 matrix: motion during the exposure smears along one direction.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.edge_structure import displacements, edge_structure
from vision.markers.normal_equations import (
    CLIPPED,
    EDGE2,
    IN2,
    N_EDGE,
    N_FOREIGN,
    N_HELD_BACK,
    N_IN,
    N_OUT,
    N_PAIRS,
    N_SEEN,
    N_WANTED,
    OUT2,
    PAIRS2,
    SLOPE2,
    SLOPE2_EDGE2,
    Equations,
    no_equations,
    normal_equations,
)
from vision.markers.row import (
    CONTRAST,
    CONTRAST_U,
    CONTRAST_V,
    COVERAGE,
    D_CONTRAST,
    D_LEVEL,
    D_LEVEL_U,
    D_LEVEL_V,
    D_S11,
    FIRST_ODD,
    MISFIT,
    N_EVEN,
    N_EVEN_HELD,
    N_ODD,
    N_ODD_SHARED,
    N_UNKNOWNS,
    NOISE,
    OK,
    OUTLIERS,
    S11,
    S22,
    SD,
    STRUCTURED,
    U,
    V,
    determinant,
)
from vision.markers.solve import apply_step, believable, factor, shape_change, solve, solve_odd
from vision.markers.window import NARROWEST, Window, collect, recentre

Array = NDArray[np.float64]

# Residuals: noise and clipping [grey levels, or in parts of the noise]
HUBER = 3.0  # times the noise, from which a residual's weight falls: Huber's, wide enough for whole-number greys
LEAST_NOISE = 0.3  # grey levels: whole numbers alone make 0.29
_ROUNDING2 = 1.0 / 144.0  # what rounding adds to the squared noise, spread over about 12 pixels that share it
FLOOR_PX2 = 4e-7  # squared sd that the model leaves, however little noise there is: 0.0006 px
_PIXEL_FREE = 1e-3  # keeps a plateau without pixels from dividing by zero
_EDGE_TELLS = (
    2.0  # times the plateau's noise that the edge's counts up to: beyond, it is the model that has not settled
)
_UNSURE_PX = 0.05  # off which a prediction may be: the edge's slope times it is no outlier in the first step
_PEAK_SLOPE = 0.4  # of a Gaussian step, per contrast and sigma: 1 / sqrt(2 pi)

# The contrast's own slope costs a disc of 4 px three quarters of its precision: it is set free where nothing else
# explains the picture (0.03 % of chi^2, 2 dof), and where it is only likely (1 %) the sd says what it might have done.
_SLOPE_CHI2, _LIKELY_CHI2 = 16.0, 9.2
_SLOPE_NOISE2 = 0.1  # squared grey levels added to the noise in that test: whole numbers

# Another edge, or another shape
_STRUCTURE = 1.3  # residual over pixel noise from which the residual is no longer noise
# slow over fast displacements of the edge, from which such a residual comes from another edge; JPEG and sharpening
# leave 1
_RED = 2.5
# Displacement of the edge from an ellipse over the radius: half discs have 0.043 and more, rough print 0.03.
_ROUNDEST_OTHER = 0.038
# Times that grain counts as noise at most: paper that strong (8 greys) holds blobs of 4 times its rms and no more.
_COARSEST = 2.0
_LEAST_CONTRAST = 4.0  # in parts of noise or grain: so do those blobs
_FOREIGN_SHARE = 0.025  # share of the flat pixels around a disc that are something else: chance leaves 0.3 %
# Rms of the flat pixels over contrast from which something else leans them, unless it is their own noise: paper has
# 0.03.
_LEANING = 0.05

# A narrower window instead
_DEARER = 1.3  # how much less precise a fit may be that leaves something else out
# Misfit over contrast that it may have: a square without its corners leaves 0.12, and too few flat pixels to see it.
_CLEAN = 0.08
_SURE_PX = 0.1  # sd from which on it is none
_SAME_CONTRAST = 0.4  # share of the start's contrast that it must have

# Degrees of freedom
_FIT_FREEDOM = 9.0  # unknowns that the edge pixels decide: position 2, shape 3, blur 3, contrast about 1
_FLAT_FREEDOM = 6.0  # that the flat pixels decide: level and its slopes 3, contrast and its slopes 3
_LEAST_FREEDOM = 0.3  # share of a small disc's edge pixels that is left at least
_LEAST_SQUARES = 0.1  # share of the edge's squares that the last step leaves at least
_FEWEST_FLAT, _FEWEST_PAIRS = 20, 30  # pixels from which on their own noise is known
_FEWEST_EDGE, _LEAST_SEEN = 12, 0.8  # edge pixels, and share of the window in the picture, that a fit needs

# When the steps end, and when the matrices are made anew (steps in px, and in parts of shape, blur and contrast)
# Part of a centre's error that a step leaves, at least; of a held shape's 0.005 to 0.01 are measured up to 0.15 px off.
_LEAST_RATIO, _LEAST_RATIO_HELD = 0.12, 0.02
_MOST_RATIO = 0.95
_SETTLED_SHAPE, _SETTLED_BLUR, _SETTLED_LEVELS = 0.02, 0.2, 0.05
_FAR_PX, _FAR_RATIO, _FAR_SHAPE, _FAR_BLUR, _FAR_LEVELS = 0.4, 0.4, 0.05, 0.2, 0.1
# A weak pull keeps the blur's shape defined where a small disc hides it: relative, absolute; and a ridge on all.
_BLUR_PULL, _BLUR_PULL_ABSOLUTE, _RIDGE = 1e-4, 1e-9, 1e-6
_UNBOUNDED = 1e9


class FitSettings(NamedTuple):
    """How far a fit goes: `fit_discs` says what its parameters mean; ``n_even``: N_EVEN, or N_EVEN_HELD."""

    max_iterations: int
    tolerance_px: float
    n_even: int
    most_blur_px2: float


@compiled
def _prepare(even: Array, odd: Array, n_even: int) -> bool:
    """Factor both matrices; False where they do not decide the unknowns."""
    for i in range(n_even):
        even[i, i] *= 1.0 + _RIDGE
    for i in range(D_S11, n_even):
        even[i, i] += _BLUR_PULL * even[i, i] + _BLUR_PULL_ABSOLUTE
    return factor(even, n_even) and factor(odd, N_ODD)


@compiled
def _clip(sums: Array, first: bool) -> tuple[float, float]:
    """Residual from which a pixel is held back, and the flat pixels' noise.

    The noise of the edge counts only once the model has settled.
    """
    plateau = math.sqrt((sums[IN2] + sums[OUT2] + _PIXEL_FREE) / (sums[N_IN] + sums[N_OUT] + _PIXEL_FREE))
    edge = math.sqrt(sums[EDGE2] / sums[N_EDGE])
    noise = plateau if not first and edge < _EDGE_TELLS * plateau else max(edge, plateau)
    return HUBER * max(LEAST_NOISE, noise), plateau


@compiled
def _first_clip(p: Array) -> float:
    """Residual from which a pixel is held back in the first step: by the noise when last measured, and the edge's slope
    times _UNSURE_PX.
    """
    slope = _PEAK_SLOPE * abs(p[CONTRAST]) / math.sqrt(min(p[S11], p[S22]))
    return HUBER * max(LEAST_NOISE, p[NOISE], p[MISFIT]) + _UNSURE_PX * slope


@compiled
def _judge(p: Array, window: Window, odd: Array, sums: Array, n_odd: int, gain: float, likely_shift: float) -> None:
    """What the fit is worth: sd of the centre, noise, misfit, coverage, outliers."""
    inverse_trace = 0.0
    unit = np.empty(N_ODD)
    for k in range(2):
        unit[:] = 0.0
        unit[k] = 1.0
        solve(odd, unit, 0, n_odd)
        inverse_trace += unit[k]
    # The sums are those before the last step, which took `gain` off them.
    squares = max(sums[EDGE2] - gain, _LEAST_SQUARES * sums[EDGE2])
    edge = math.sqrt(squares / max(sums[N_EDGE] - _FIT_FREEDOM, _LEAST_FREEDOM * sums[N_EDGE]))
    n_plateau = sums[N_IN] + sums[N_OUT]
    flat2 = (sums[IN2] + sums[OUT2]) / max(n_plateau - _FLAT_FREEDOM, 1.0)
    plateau = math.sqrt(flat2) if n_plateau > _FEWEST_FLAT else edge
    noise = math.sqrt((sums[N_EDGE] * edge**2 + n_plateau * plateau**2) / (sums[N_EDGE] + n_plateau))
    # Photons make bright pixels noisier than dark ones: what counts is the noise where the edge is steep.
    noise = max(noise, edge * math.sqrt(sums[SLOPE2_EDGE2] * sums[N_EDGE] / max(sums[SLOPE2] * sums[EDGE2], 1e-12)))
    # Neighbouring pixels differ by noise only; what the model misses (a shadow's edge, glare, paper, a halo of
    # sharpening) they share.
    white = math.sqrt(0.5 * sums[PAIRS2] / max(sums[N_PAIRS], 1.0)) if sums[N_PAIRS] > _FEWEST_PAIRS else noise
    radius = determinant(p) ** -0.25
    moved, weight, last = displacements(window.work, window.n_edge, radius)
    moving, red, shape = edge_structure(moved, weight, last, radius, max(noise, LEAST_NOISE))
    structured = max(edge, plateau) > _STRUCTURE * max(white, LEAST_NOISE) and red > _RED
    p[SD] = math.sqrt(0.5 * inverse_trace * (moving**2 + _ROUNDING2) + FLOOR_PX2 + 0.5 * likely_shift**2)
    p[NOISE] = plateau
    p[MISFIT] = edge
    p[COVERAGE] = sums[N_SEEN] / sums[N_WANTED]
    p[OUTLIERS] = sums[N_HELD_BACK] / sums[N_EDGE] + (STRUCTURED if structured else 0.0)
    # Grain of the surroundings averages out less than noise of single pixels does, and makes round blobs of its own.
    grain = plateau * min(max(plateau / max(white, LEAST_NOISE), 1.0), _COARSEST)
    p[OK] = 1.0 if abs(p[CONTRAST]) > _LEAST_CONTRAST * max(noise, grain) and shape < _ROUNDEST_OTHER else 0.0


@compiled
def _fit_one(image: NDArray[Any], p: Array, settings: FitSettings, narrow: int, equations: Equations) -> None:
    """Gauss-Newton from `p` (length 20, changed in place); the matrices are kept while the steps are small."""
    even, odd, rhs, sums = equations
    n_even = settings.n_even
    start_u, start_v = p[U], p[V]
    r0 = max(determinant(p), 1e-12) ** -0.25
    gain, likely_shift, before = 0.0, 0.0, _UNBOUNDED
    # As the frame before left it: its noise says at once which pixels to hold back, and one step may be enough.
    measured_before = n_even == N_EVEN_HELD and p[MISFIT] > 0.0
    clip = _first_clip(p) if measured_before else _UNBOUNDED
    least_ratio = _LEAST_RATIO_HELD if n_even == N_EVEN_HELD else _LEAST_RATIO
    full = True
    p[OK] = 0.0
    n_odd = N_ODD if p[CONTRAST_U] != 0.0 or p[CONTRAST_V] != 0.0 else N_ODD_SHARED
    earliest = -1 if measured_before else 0  # iteration after which the fit may end
    gradient = np.empty(N_UNKNOWNS)
    window = collect(image, p, narrow)
    at_u, at_v = p[U], p[V]
    for iteration in range(settings.max_iterations):
        if full and iteration > 0:
            window = collect(image, p, narrow)
        else:
            recentre(window, p[U] - at_u, p[V] - at_v)
        at_u, at_v = p[U], p[V]
        normal_equations(window, p, clip, full, n_even, equations)
        if sums[N_SEEN] < _LEAST_SEEN * sums[N_WANTED] or sums[N_EDGE] < _FEWEST_EDGE:
            return
        clip, plateau = _clip(sums, iteration == 0)
        if full and not _prepare(even, odd, n_even):
            return
        gradient[:] = rhs
        solve(even, rhs, D_LEVEL, n_even)
        slope_test, slope_shift = solve_odd(odd, rhs, n_odd)
        gain = 0.0
        for i in range(N_UNKNOWNS):
            if i < n_even or i >= FIRST_ODD:
                gain += gradient[i] * rhs[i]
        length = apply_step(p, rhs, r0)
        if not believable(p, r0, start_u, start_v) or max(p[S11], p[S22]) > settings.most_blur_px2:
            return
        change, blur_change = shape_change(p, rhs)
        # Steps shrink about geometrically: stop when all those to come together would not matter.
        ratio = min(max(length / before, least_ratio), _MOST_RATIO)
        left = length * ratio / (1.0 - ratio)
        levels = abs(rhs[D_LEVEL]) + abs(rhs[D_CONTRAST]) + r0 * (abs(rhs[D_LEVEL_U]) + abs(rhs[D_LEVEL_V]))
        levels /= abs(p[CONTRAST])
        # Nearer than this the old matrices serve.
        full = length > _FAR_PX or ratio > _FAR_RATIO
        full = full or change > _FAR_SHAPE or blur_change > _FAR_BLUR or levels > _FAR_LEVELS
        before = length
        settled = change < _SETTLED_SHAPE and blur_change < _SETTLED_BLUR and levels < _SETTLED_LEVELS
        if iteration > earliest and left < settings.tolerance_px and settled:
            slope_test /= plateau * plateau + _SLOPE_NOISE2
            if n_odd == N_ODD or slope_test < _SLOPE_CHI2:
                likely_shift = slope_shift if slope_test > _LIKELY_CHI2 else 0.0
                break
            n_odd = N_ODD
            full = True
            earliest = iteration + 1
    _judge(p, window, odd, sums, n_odd, gain, likely_shift)


@compiled
def _foreign_around(p: Array, sums: Array) -> bool:
    """Whether the disc's surroundings hold something else: pixels of it, or so much that they lean the level towards
    themselves.
    """
    if sums[N_FOREIGN] > _FOREIGN_SHARE * sums[N_OUT]:
        return True
    return p[NOISE] > _LEANING * abs(p[CONTRAST]) and p[NOISE] ** 2 * sums[N_PAIRS] > 0.5 * _STRUCTURE**2 * sums[PAIRS2]


@compiled
def _fit_narrowing(image: NDArray[Any], p: Array, settings: FitSettings, equations: Equations) -> None:
    """As `_fit_one`; where the surroundings hold something else (a hole, a neighbour, a marker's own paper), with less
    of them.
    """
    start, sums = p.copy(), equations.sums
    _fit_one(image, p, settings, 0, equations)
    for narrow in range(1, NARROWEST + 1):
        foreign = _foreign_around(p, sums)
        # Clipped greys look structured and are not: less of them would only be less.
        if p[OK] > 0.0 and (p[OUTLIERS] < STRUCTURED or sums[CLIPPED] > 0.0) and not foreign:
            break
        fit = start.copy()
        _fit_one(image, fit, settings, narrow, equations)
        clean = (
            fit[OK] > 0.0
            and fit[OUTLIERS] < STRUCTURED
            and fit[MISFIT] < _CLEAN * abs(fit[CONTRAST])
            and fit[SD] < _SURE_PX
            and abs(fit[CONTRAST]) > _SAME_CONTRAST * abs(start[CONTRAST])
        )
        if foreign and clean and p[OK] > 0.0:
            # What leans the surroundings pulls the centre unseen: by as much as the two differ, beyond what noise lets
            # them.
            apart = 0.5 * ((fit[U] - p[U]) ** 2 + (fit[V] - p[V]) ** 2)
            p[SD] = math.sqrt(p[SD] ** 2 + max(apart - fit[SD] ** 2, 0.0))
        if clean and (p[OK] == 0.0 or fit[SD] < (_DEARER if foreign else 1.0) * p[SD]):
            p[:] = fit


@compiled
def fit_discs(
    image: NDArray[Any],
    starts: Array,
    max_iterations: int = 12,
    tolerance_px: float = 0.001,
    hold_shape: bool = False,
    most_blur_px2: float = _UNBOUNDED,
) -> Array:
    """Fit every disc of `starts` in one picture.

    Parameters
    ----------
    image : (h, w) uint8 or uint16, C-contiguous
    starts : (n, 20) rows as `vision.markers.row.disc_start` makes them, or the rows of the frame before
    max_iterations, tolerance_px : stop when the centre's step falls below the tolerance
    hold_shape : take shape and blur from the start and fit position and levels only: half the time, and as
        precise, because shape and blur keep their sign under reflection and position does not
    most_blur_px2 : squared blur from which a fit is given up, as one gone astray

    Returns
    -------
    (n, 20), columns of `vision.markers.row`: CONTRAST_U, CONTRAST_V are the contrast's slope beyond what the light's
    own slope makes; a fit that fails has OK 0.
    """
    out = starts.copy()
    equations = no_equations()
    # As plain numbers: of an argument left out the compiler knows more, and would compile everything below once more.
    n_even = N_EVEN_HELD if hold_shape else N_EVEN
    settings = FitSettings(int(max_iterations), float(tolerance_px), n_even, float(most_blur_px2))
    for i in range(len(out)):
        _fit_narrowing(image, out[i], settings, equations)
    return out
