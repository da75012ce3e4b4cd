"""A path of which nothing is known but that it is smooth: a smoothing spline whose bandwidth the data give.

The spline is quintic, its knots are a frame apart, and its third derivative is penalised: a prior of integrated white
noise (Wahba, J. R. Stat. Soc. B 40, 364 (1978)), whose strength is that of the largest restricted likelihood.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix, diags_array

from ovines.robust import spread

Array = NDArray[np.float64]

DEGREE, PENALISED = 5, 3
# Strengths that are tried (logarithm to base 10, of the penalty in knot steps): from two frames to a second.
STRENGTHS = np.arange(-2.0, 12.1, 1.0)
FINER = (0.5, 0.25)
# Frames further apart than this have independent noise.
FORGOTTEN_FRAMES = 3
# A place this far (robust sds) off the path is a gross error.
GROSS_SD = 5.0
# Fewer places leave a spline nothing to be fitted to.
FEWEST = 12
# Times of which a covariance is asked together: a row for each holds as many numbers as the path has frames.
AT_ONCE = 32


@dataclass(frozen=True, eq=False)
class SmoothPath:
    """A spline of one coordinate: ``spline`` on its domain ``first_s`` to ``last_s`` (beyond, the motion goes on with
    the velocity that it has there); ``factor`` banded Cholesky factor of its coefficients' information; ``sd`` and
    ``correlation`` of the noise about it.
    """

    spline: BSpline
    factor: Array
    sd: float
    correlation: float

    @property
    def first_s(self) -> float:
        """Where the domain begins."""
        return float(self.spline.t[DEGREE])

    @property
    def last_s(self) -> float:
        """Where it ends."""
        return float(self.spline.t[-DEGREE - 1])

    @property
    def knot_s(self) -> float:
        """From knot to knot."""
        return float(self.spline.t[1] - self.spline.t[0])

    def at(self, time_s: Array, derivative: int = 0) -> Array:
        """Value, rate or second rate (N,) at ``time_s`` (N,)."""
        inside = np.clip(time_s, self.first_s, self.last_s)
        value = np.asarray(self.spline(inside, derivative), float)
        if derivative == 0:
            return np.asarray(value + (time_s - inside) * self.spline(inside, 1), float)
        return np.where(inside == time_s, value, 0.0) if derivative == 2 else value

    def covariance(self, time_s: Array) -> Array:
        """Covariance (N, 3, 3) of value, rate and second rate at ``time_s`` (N,)."""
        inside = np.clip(time_s, self.first_s, self.last_s)
        found = np.empty((len(inside), 3, 3))
        for first in range(0, len(inside), AT_ONCE):
            some = slice(first, first + AT_ONCE)
            rows = np.stack([_design(self.spline.t, inside[some], order).toarray() for order in range(3)], 1)
            n, _, p = rows.shape
            solved = cho_solve_banded((self.factor, True), rows.reshape(-1, p).T).T.reshape(n, 3, p)
            found[some] = np.einsum("nap,nbp->nab", rows, solved)
        return found

    def times(self, factor: float) -> SmoothPath:
        """The path of what moves ``factor`` times as far."""
        spline = BSpline(self.spline.t, factor * self.spline.c, DEGREE)
        return replace(self, spline=spline, factor=self.factor / abs(factor))


def smooth_path(time_s: Array, value: Array, correlation: float = 0.0) -> SmoothPath | None:
    """The smooth path behind ``value`` (N,) at ``time_s`` (N,), NaN where unknown; None of too few.

    ``correlation`` of the noise from frame to frame (AR(1))."""
    known = np.isfinite(value) & np.isfinite(time_s)
    if known.sum() < FEWEST:
        return None
    knots = _knots(time_s[known])
    keep = known & _near_neighbours(value)
    path = None
    for _ in range(3):
        if keep.sum() < FEWEST:
            return path
        path = _fit(knots, time_s[keep], value[keep], correlation)
        miss = value - path.at(time_s)
        again = known & (np.abs(miss) < GROSS_SD * max(spread(miss[keep]), path.sd))
        if np.array_equal(again, keep):
            break
        keep = again
    return path


def _near_neighbours(value: Array) -> NDArray[np.bool_]:
    """Which values are no gross errors against the cubic through the two on either side of each."""
    off = np.full(len(value), np.nan)
    off[2:-2] = value[2:-2] - (4 * (value[1:-3] + value[3:-1]) - value[:-4] - value[4:]) / 6
    return ~(np.abs(off) > 2 * GROSS_SD * max(spread(off), 1e-300))


def _knots(time_s: Array) -> Array:
    step = float(np.median(np.diff(time_s)))
    count = max(int(np.ceil((time_s[-1] - time_s[0]) / step)), 1) + 1
    return time_s[0] + step * np.arange(-DEGREE, count + DEGREE + 1)


def _design(knots: Array, time_s: Array, derivative: int = 0) -> csr_matrix:
    """Rows (N, P) of the splines' values or derivatives."""
    # A uniform spline's derivative is a difference of splines of the next lower degree.
    fewer = knots[derivative : len(knots) - derivative]
    rows = csr_matrix(BSpline.design_matrix(time_s, fewer, DEGREE - derivative))
    size = len(knots) - DEGREE - 1
    return csr_matrix(rows @ _differences(size, derivative)) / (knots[1] - knots[0]) ** derivative


@lru_cache(maxsize=64)
def _differences(size: int, order: int) -> csr_matrix:
    matrix = csr_matrix(diags_array([1.0], offsets=[0], shape=(size, size)))
    for k in range(order):
        step = diags_array([-1.0, 1.0], offsets=[0, 1], shape=(size - k - 1, size - k))
        matrix = csr_matrix(step @ matrix)
    return matrix


def _banded(matrix: csr_matrix, width: int) -> Array:
    """Lower band (width + 1, P) of a symmetric matrix."""
    band = np.zeros((width + 1, matrix.shape[0]))
    for k in range(width + 1):
        band[k, : matrix.shape[0] - k] = matrix.diagonal(-k)
    return band


def _fit(knots: Array, time_s: Array, value: Array, correlation: float) -> SmoothPath:
    design = _design(knots, time_s)
    difference = _differences(design.shape[1], PENALISED)
    width = DEGREE + FORGOTTEN_FRAMES
    penalty = _banded(csr_matrix(difference.T @ difference), width)
    whiten = _whitening(np.round(np.diff(time_s) / (knots[1] - knots[0])).astype(int), correlation)
    rows, right = csr_matrix(whiten @ design), whiten @ value
    normal = _banded(csr_matrix(rows.T @ rows), width)

    def tried(strength: float) -> tuple[float, float, float, Array, Array]:
        """-2 log restricted likelihood of a strength, the strength, the noise's variance, factor and coefficients."""
        factor = cholesky_banded(normal + 10.0**strength * penalty, lower=True)
        coefficients = cho_solve_banded((factor, True), rows.T @ right)
        squares = float(np.sum((right - rows @ coefficients) ** 2))
        squares += float(10.0**strength * np.sum((difference @ coefficients) ** 2))
        freedom = len(right) - PENALISED
        variance = max(squares / freedom, 1e-300)
        cost = freedom * np.log(variance) + 2 * float(np.sum(np.log(factor[0])))
        return float(cost - difference.shape[0] * strength * np.log(10.0)), strength, variance, factor, coefficients

    best = min((tried(float(one)) for one in STRENGTHS), key=lambda one: one[0])
    for finer in FINER:
        best = min((best, *(tried(best[1] + side) for side in (-finer, finer))), key=lambda one: one[0])
    _, _, variance, factor, coefficients = best
    sd = float(np.sqrt(variance))
    return SmoothPath(BSpline(knots, coefficients, DEGREE), factor / sd, sd, correlation)


def _whitening(frames: NDArray[np.int64], correlation: float) -> csr_matrix:
    """Matrix that makes AR(1) noise of unit variance at frames so far apart independent."""
    n = len(frames) + 1
    share = np.where(frames <= FORGOTTEN_FRAMES, correlation ** np.maximum(frames, 1), 0.0)
    scale = 1 / np.sqrt(1 - share**2)
    main, below = np.concatenate([[1.0], scale]), -share * scale
    return csr_matrix(diags_array([main, below], offsets=[0, -1], shape=(n, n)))
