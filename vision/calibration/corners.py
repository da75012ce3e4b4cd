"""Where a chessboard corner is, by fitting the picture of one: two blurred edges that cross."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf

Array = NDArray[np.float64]
STEPS, SETTLED_PX = 12, 1e-4  # steps at most, and the one that ends them
REACH_SHARE = 0.25  # of the patch's side: farther pixels are too few to show what they share
# Unknowns: place, the two edges' directions, mean grey, half contrast, blur.
U, V, FIRST, SECOND, MEAN, HALF, BLUR = range(7)
PARAMETERS = 7
REACH_PX = (3.0, 12.0)  # radius of a corner's neighbourhood: enough pixels, and no more than edges stay straight for
LEAST_BLUR_PX, WIDEST_BLUR = 0.3, 0.5  # sd: a pixel's own area, and in parts of the neighbourhood's radius
LEFT_REACH, LEAST_HALF_CONTRAST = 0.5, 5.0  # parts of that radius, and greys, at which a corner is given up
_MIDDLE_PX = 1.0  # about the corner, of pixels whose direction says nothing
_EXTREMES = (5, 95)  # percentiles that stand for dark and light
FEWEST_FOR_MOSAIC = 12  # corners that show together what a colour filter does
_DAMPING, _DAMPING_DOWN, _DAMPING_UP = 1e-3, 0.2, 10  # Levenberg's


class Corner(NamedTuple):
    """A fitted corner: ``uv_px`` (2,), ``influence`` (2, n) of each pixel on it, ``residual`` (n,), ``jacobian``
    (n, 7), ``mosaic`` (n, 12) of :func:`_mosaic_patterns`, ``inside`` (rows, columns): where the pixels lie.
    """

    uv_px: Array
    influence: Array
    residual: Array
    jacobian: Array
    mosaic: Array
    inside: NDArray[np.bool_]


def refine_corners(
    image: NDArray[np.uint8], corners_px: Array, reach_px: Array, directions_rad: Array | None = None
) -> tuple[Array, Array]:
    """Fit ``a + b erf(d1 / (s sqrt 2)) erf(d2 / (s sqrt 2))`` about each corner, d1 and d2 the distances to its edges.

    Parameters
    ----------
    image : (rows, columns) uint8
    corners_px : (N, 2) first guesses, good to about a pixel
    reach_px : (N,) radius of the neighbourhood that holds nothing but the corner
    directions_rad : (N, 2) of the two edges of a dark corner on light paper, both with the dark to their right (u to
        the right, v down); None: four fields meet, as on a chessboard.  A dark corner is ``a + b (1 - (1 + erf)(1 +
        erf) / 2)``

    Returns
    -------
    corners_px (N, 2), sd_px (N,) from the fit's own residuals.  A corner that leaves its neighbourhood or whose
    contrast vanishes keeps its first guess and gets sd NaN.
    """
    corners_px = np.asarray(corners_px, float)
    refined, sd = corners_px.copy(), np.full(len(corners_px), np.nan)
    fits: dict[int, Corner] = {}
    for k, (corner, reach) in enumerate(zip(corners_px, reach_px, strict=True)):
        own = None if directions_rad is None else directions_rad[k]
        fitted = _fit(image, corner, float(np.clip(reach, *REACH_PX)), own)
        if fitted is not None:
            fits[k] = fitted
    mosaic = _mosaic(list(fits.values()))
    for k, fit in fits.items():
        pattern = fit.mosaic @ mosaic
        refined[k] = fit.uv_px - fit.influence @ pattern
        residual = fit.residual - _beside(pattern, fit.jacobian)
        freedom = len(residual) / max(1, len(residual) - PARAMETERS)
        sd[k] = np.sqrt(0.5 * _shared_variance(fit.influence, residual, fit.inside) * freedom)
    return refined, sd


def _fit(image: NDArray[np.uint8], corner: Array, reach: float, directions: Array | None) -> Corner | None:
    size = int(np.ceil(reach))
    column, row = np.rint(corner).astype(int)
    if column - size < 0 or row - size < 0 or column + size >= image.shape[1] or row + size >= image.shape[0]:
        return None
    patch = image[row - size : row + size + 1, column - size : column + size + 1].astype(float)
    v, u = np.mgrid[-size : size + 1, -size : size + 1]
    inside = np.hypot(u - corner[0] + column, v - corner[1] + row) <= reach
    u, v, grey = u[inside].astype(float), v[inside].astype(float), patch[inside]
    p = _start(u - corner[0] + column, v - corner[1] + row, grey)
    p[[U, V]] = corner - (column, row)
    fields = 4 if directions is None else 2
    if directions is not None:
        p[[FIRST, SECOND]] = directions
    damping, (model, jacobian) = _DAMPING, _model(p, u, v, fields)
    cost = float(np.sum((grey - model) ** 2))
    for _ in range(STEPS):
        normal = jacobian.T @ jacobian
        try:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + 1e-9), jacobian.T @ (grey - model))
        except np.linalg.LinAlgError:
            return None
        trial = p + step
        trial[BLUR] = np.clip(trial[BLUR], LEAST_BLUR_PX, WIDEST_BLUR * reach)
        tried = _model(trial, u, v, fields)
        new_cost = float(np.sum((grey - tried[0]) ** 2))
        if new_cost < cost:
            small = np.abs(step[[U, V]]).max() < SETTLED_PX
            p, (model, jacobian), cost, damping = trial, tried, new_cost, _DAMPING_DOWN * damping
            if small:
                break
        else:
            damping *= _DAMPING_UP
    found = p[[U, V]] + (column, row)
    if np.hypot(*(found - corner)) > LEFT_REACH * reach or abs(p[HALF]) < LEAST_HALF_CONTRAST:
        return None
    # By how much a grey level in each pixel moves the corner.
    influence = np.linalg.pinv(jacobian.T @ jacobian)[[U, V]] @ jacobian.T
    return Corner(found, influence, grey - model, jacobian, _mosaic_patterns(p, u, v, fields, (column, row)), inside)


def _mosaic_patterns(p: Array, u: Array, v: Array, fields: int, at: tuple[int, int]) -> Array:
    """What a sensor's colour filters can leave of the corner ``p``, (n, 12): its first and second derivatives along u
    and v, of alternating sign from column to column, from row to row and as a chequer.

    Grey of such a camera is interpolated between filtered pixels, each class of pixels with a blur of its own.
    """
    _, here = _model(p, u, v, fields)
    right, left, below, above = (
        _model(p, u + du, v + dv, fields)[1] for du, dv in ((0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))
    )
    slopes = -np.stack([here[:, U], here[:, V], right[:, U] - left[:, U], below[:, V] - above[:, V]], -1)
    columns, rows = 1 - 2 * ((u + at[0]) % 2), 1 - 2 * ((v + at[1]) % 2)
    return np.concatenate([sign[:, None] * slopes for sign in (columns, rows, columns * rows)], -1)


def _mosaic(fits: Sequence[Corner]) -> Array:
    """How much of each pattern (12,) all corners of a picture show alike; zeros where one half of them does not
    foretell the other.
    """
    nothing = np.zeros(12)
    if len(fits) < FEWEST_FOR_MOSAIC:
        return nothing
    halves = []
    for part in (0, 1):
        parts = [(_beside(fit.mosaic, fit.jacobian), fit.residual) for fit in fits[part::2]]
        halves.append((sum(f.T @ f for f, _ in parts), sum(f.T @ r for f, r in parts)))
    (matrix, right), (other, other_right) = halves
    for learn, known, hold, held in ((matrix, right, other, other_right), (other, other_right, matrix, right)):
        found = np.linalg.lstsq(learn, known, rcond=None)[0]
        if 2 * found @ held <= found @ hold @ found:  # the squares that it takes off the other half
            return nothing
    return np.asarray(np.linalg.lstsq(matrix + other, right + other_right, rcond=None)[0])


def _beside(patterns: Array, jacobian: Array) -> Array:
    """What of ``patterns`` (n,) or (n, k) the corner's own parameters cannot do."""
    return np.asarray(patterns - jacobian @ np.linalg.lstsq(jacobian, patterns, rcond=None)[0])


def _shared_variance(influence: Array, residual: Array, inside: NDArray[np.bool_]) -> float:
    """Variance of u and v together, from residuals that neighbouring pixels share: print, JPEG and a blur that is no
    Gaussian do not average out.

    influence : (2, n) how a pixel moves the corner;  residual : (n,);  inside : (rows, columns), where the pixels lie.
    Products of residuals at each distance up to REACH_SHARE of the patch, times how pixels at that distance move the
    corner together.
    """
    side = 2 * inside.shape[0]  # no wrapping
    pictures = np.zeros((4, *inside.shape))
    for k, values in enumerate((*influence, residual, np.ones_like(residual))):
        pictures[k][inside] = values
    spectrum = np.abs(np.fft.rfft2(pictures, (side, side))) ** 2
    moves_u, moves_v, shared, pairs = np.fft.irfft2(spectrum, (side, side))
    lag = np.minimum(np.arange(side), side - np.arange(side))
    near = np.hypot(lag[:, None], lag[None]) <= REACH_SHARE * inside.shape[0]
    alone = shared[0, 0] / pairs[0, 0]
    together = float(np.sum((moves_u + moves_v)[near] * shared[near] / np.maximum(pairs[near], 1.0)))
    return max(together, float(moves_u[0, 0] + moves_v[0, 0]) * alone)


def _start(u: Array, v: Array, grey: Array) -> Array:
    """Edge directions from the second angular harmonic: the four quadrants alternate between dark and light."""
    mean, angle, far = grey.mean(), np.arctan2(v, u), np.hypot(u, v) > _MIDDLE_PX
    harmonic = np.sum((grey - mean)[far] * np.exp(2j * angle[far]))
    middle = 0.5 * np.angle(harmonic)  # of a light quadrant
    dark, light = np.percentile(grey, _EXTREMES)
    half = 0.5 * (light - dark)
    return np.array([0.0, 0.0, middle + np.pi / 4, middle - np.pi / 4, mean, half, 1.0])


def _model(p: Array, u: Array, v: Array, fields: int) -> tuple[Array, Array]:
    """Grey and its derivatives (n, 7) of four fields that meet, or of two: a dark corner on paper.  An edge of
    direction t has the distance -sin t du + cos t dv.
    """
    u0, v0, first, second, mean, half, blur = p
    du, dv = u - u0, v - v0
    scale = 1.0 / (blur * np.sqrt(2.0))
    edges, slopes, distances, alongs = [], [], [], []
    for direction in (first, second):
        distance = -np.sin(direction) * du + np.cos(direction) * dv
        edges.append(erf(distance * scale))
        slopes.append(2 / np.sqrt(np.pi) * scale * np.exp(-((distance * scale) ** 2)))
        distances.append(distance)
        alongs.append(-np.cos(direction) * du - np.sin(direction) * dv)  # d distance / d direction
    # the light quadrant lies between the two directions, where the distances have opposite signs
    if fields == 4:
        shape = -edges[0] * edges[1]
        by_first, by_second = -half * slopes[0] * edges[1], -half * edges[0] * slopes[1]
    else:
        shape = 1.0 - 0.5 * (1 + edges[0]) * (1 + edges[1])
        by_first, by_second = -0.5 * half * slopes[0] * (1 + edges[1]), -0.5 * half * (1 + edges[0]) * slopes[1]
    value = mean + half * shape
    jacobian = np.stack(
        [
            by_first * np.sin(first) + by_second * np.sin(second),
            -by_first * np.cos(first) - by_second * np.cos(second),
            by_first * alongs[0],
            by_second * alongs[1],
            np.ones_like(u),
            shape,
            -(by_first * distances[0] + by_second * distances[1]) / blur,
        ],
        -1,
    )
    return value, jacobian
