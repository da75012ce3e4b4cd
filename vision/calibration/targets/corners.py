"""Where chessboard corners are, by fitting the picture of one: two blurred edges that cross.

All corners of an image are fitted side by side: K corners, each with up to n pixels about it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2
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
TOGETHER = 128  # corners that are fitted side by side: what they need stays small
FEWEST_FOR_MOSAIC = 12  # corners that show together what a colour filter does
_DAMPING, _DAMPING_DOWN, _DAMPING_UP = 1e-3, 0.2, 10  # Levenberg's


class Patches(NamedTuple):
    """The neighbourhoods of K corners: ``at`` (K, 2) column and row of their middles; ``u``, ``v``, ``grey`` (K, n) of
    their pixels, places from the middle, ``counts`` (K, n) 1 or, of what only fills up, 0; ``cell`` (K, n) of each
    pixel in the square of ``side`` pixels about the middle; ``size`` (K,) pixels from the middle to the end.
    """

    at: Array
    u: Array
    v: Array
    grey: Array
    counts: Array
    cell: NDArray[np.int64]
    side: int
    size: NDArray[np.int64]

    def only(self, chosen: NDArray[np.intp]) -> Patches:
        """Those of some of the corners."""
        own = {name: getattr(self, name)[chosen] for name in self._fields if name != "side"}
        return self._replace(**own)


class Fits(NamedTuple):
    """Fitted corners: ``number`` (K,) of each among those asked for, ``uv_px`` (K, 2), ``influence`` (K, 2, n) of each
    pixel on it, ``residual`` (K, n), ``jacobian`` (K, n, 7) and its pseudo-inverse (K, 7, n), ``mosaic`` (K, n, 12) of
    :func:`_mosaic_patterns`, all 0 in pixels that only fill up.
    """

    number: NDArray[np.intp]
    uv_px: Array
    influence: Array
    residual: Array
    jacobian: Array
    inverse: Array
    mosaic: Array
    patches: Patches


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
    reach = np.clip(np.asarray(reach_px, float), *REACH_PX)
    size, middle = np.ceil(reach).astype(int), np.rint(corners_px).astype(int)
    inside = np.all((middle >= size[:, None]) & (middle + size[:, None] < image.shape[::-1]), 1)
    numbers = np.flatnonzero(inside)
    parts = []
    for first in range(0, len(numbers), TOGETHER):
        own = numbers[first : first + TOGETHER]
        directions = None if directions_rad is None else np.asarray(directions_rad, float)[own]
        parts.append(_fit(image, own, corners_px[own], reach[own], directions))
    mosaic = _mosaic(parts)
    for fit in parts:
        pattern = fit.mosaic @ mosaic
        refined[fit.number] = fit.uv_px - (fit.influence @ pattern[..., None])[..., 0]
        residual = fit.residual - _beside(pattern[..., None], fit)[..., 0]
        pixels = fit.patches.counts.sum(1)
        freedom = pixels / np.maximum(1, pixels - PARAMETERS)
        sd[fit.number] = np.sqrt(0.5 * _shared_variance(fit, residual) * freedom)
    return refined, sd


def _patches(image: NDArray[np.uint8], corners: Array, reach: Array) -> Patches:
    """The pixels within ``reach`` (K,) of each corner (K, 2)."""
    middle, size = np.rint(corners).astype(int), np.ceil(reach).astype(int)
    widest = int(size.max())
    side = 2 * widest + 1
    v, u = (part.ravel() for part in np.mgrid[-widest : widest + 1, -widest : widest + 1])
    off = corners - middle
    near = np.hypot(u - off[:, :1], v - off[:, 1:]) <= reach[:, None]
    most = int(near.sum(1).max())
    cell = np.argsort(~near, axis=1, kind="stable")[:, :most]
    counts = np.take_along_axis(near, cell, 1)
    u, v = u[cell], v[cell]
    rows = np.clip(middle[:, 1:] + v, 0, image.shape[0] - 1)
    columns = np.clip(middle[:, :1] + u, 0, image.shape[1] - 1)
    grey = np.where(counts, image[rows, columns].astype(float), 0.0)
    return Patches(middle, u.astype(float), v.astype(float), grey, counts.astype(float), cell, side, size)


def _fit(
    image: NDArray[np.uint8], numbers: NDArray[np.intp], corners: Array, reach: Array, directions: Array | None
) -> Fits:
    """The corners (K, 2) that the picture has there, by Levenberg's steps, each with a damping of its own."""
    patches, fields = _patches(image, corners, reach), 4 if directions is None else 2
    p = _start(patches, corners)
    if directions is not None:
        p[:, [FIRST, SECOND]] = directions
    damping = np.full(len(p), _DAMPING)
    residual, jacobian = _misfit(p, patches, fields)
    cost = np.sum(residual**2, 1)
    going, good = np.arange(len(p)), np.ones(len(p), bool)
    for _ in range(STEPS):
        if not len(going):
            break
        own = jacobian[going]
        normal, right = own.transpose(0, 2, 1) @ own, (own.transpose(0, 2, 1) @ residual[going][..., None])[..., 0]
        diagonal = damping[going, None] * (np.diagonal(normal, axis1=1, axis2=2) + 1e-9)
        step = _solved(normal + diagonal[:, None] * np.eye(PARAMETERS), right)
        solved = np.isfinite(step).all(1)
        good[going[~solved]] = False
        going, step = going[solved], step[solved]
        trial = p[going] + step
        trial[:, BLUR] = np.clip(trial[:, BLUR], LEAST_BLUR_PX, WIDEST_BLUR * reach[going])
        tried_residual, tried_jacobian = _misfit(trial, patches.only(going), fields)
        tried_cost = np.sum(tried_residual**2, 1)
        better = tried_cost < cost[going]
        at = going[better]
        p[at], residual[at], jacobian[at] = trial[better], tried_residual[better], tried_jacobian[better]
        cost[at] = tried_cost[better]
        damping[going] *= np.where(better, _DAMPING_DOWN, _DAMPING_UP)
        going = going[~(better & (np.abs(step[:, [U, V]]).max(1) < SETTLED_PX))]
    found = p[:, [U, V]] + patches.at
    good &= np.hypot(*(found - corners).T) <= LEFT_REACH * reach
    kept = np.flatnonzero(good & (np.abs(p[:, HALF]) >= LEAST_HALF_CONTRAST))
    patches, p, jacobian = patches.only(kept), p[kept], jacobian[kept]
    shape = (len(kept), PARAMETERS, patches.u.shape[1])
    inverse: Array = np.asarray(np.linalg.pinv(jacobian), float) if len(kept) else np.zeros(shape)
    # By how much a grey level in each pixel moves the corner.
    influence = inverse[:, [U, V]]
    mosaic = _mosaic_patterns(p, patches, fields)
    return Fits(numbers[kept], found[kept], influence, residual[kept], jacobian, inverse, mosaic, patches)


def _solved(matrices: Array, right: Array) -> Array:
    """Solutions (K, 7), NaN where a matrix (K, 7, 7) has no inverse."""
    try:
        return np.asarray(np.linalg.solve(matrices, right[..., None])[..., 0])
    except np.linalg.LinAlgError:
        found = np.full(right.shape, np.nan)
        for k, (matrix, own) in enumerate(zip(matrices, right, strict=True)):
            if np.linalg.matrix_rank(matrix) == PARAMETERS:
                found[k] = np.linalg.solve(matrix, own)
        return found


def _misfit(p: Array, patches: Patches, fields: int) -> tuple[Array, Array]:
    """Residual (K, n) and Jacobian (K, n, 7) of the model, 0 in pixels that only fill up."""
    model, jacobian = _model(p, patches.u, patches.v, fields)
    return patches.counts * (patches.grey - model), patches.counts[..., None] * jacobian


def _mosaic_patterns(p: Array, patches: Patches, fields: int) -> Array:
    """What a sensor's colour filters can leave of the corners ``p``, (K, n, 12): their first and second derivatives
    along u and v, of alternating sign from column to column, from row to row and as a chequer.

    Grey of such a camera is interpolated between filtered pixels, each class of pixels with a blur of its own.
    """
    u, v, at = patches.u, patches.v, patches.at
    _, here = _model(p, u, v, fields)
    right, left, below, above = (
        _model(p, u + du, v + dv, fields)[1] for du, dv in ((0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5))
    )
    slopes = -np.stack([here[..., U], here[..., V], (right - left)[..., U], (below - above)[..., V]], -1)
    columns, rows = 1 - 2 * ((u + at[:, :1]) % 2), 1 - 2 * ((v + at[:, 1:]) % 2)
    signs = [patches.counts * sign for sign in (columns, rows, columns * rows)]
    return np.concatenate([sign[..., None] * slopes for sign in signs], -1)


def _mosaic(parts: list[Fits]) -> Array:
    """How much of each pattern (12,) all corners of a picture show alike; zeros where one half of them does not
    foretell the other.
    """
    nothing = np.zeros(12)
    if sum(len(fit.number) for fit in parts) < FEWEST_FOR_MOSAIC:
        return nothing
    each = [(_beside(fit.mosaic, fit), fit.residual) for fit in parts]
    matrices = np.concatenate([f.transpose(0, 2, 1) @ f for f, _ in each])
    rights = np.concatenate([(f.transpose(0, 2, 1) @ r[..., None])[..., 0] for f, r in each])
    (matrix, right), (other, other_right) = ((matrices[k::2].sum(0), rights[k::2].sum(0)) for k in (0, 1))
    for learn, known, hold, held in ((matrix, right, other, other_right), (other, other_right, matrix, right)):
        found = np.linalg.lstsq(learn, known, rcond=None)[0]
        if 2 * found @ held <= found @ hold @ found:  # the squares that it takes off the other half
            return nothing
    return np.asarray(np.linalg.lstsq(matrix + other, right + other_right, rcond=None)[0])


def _beside(patterns: Array, fit: Fits) -> Array:
    """What of ``patterns`` (K, n, k) the corners' own parameters cannot do."""
    return np.asarray(patterns - fit.jacobian @ (fit.inverse @ patterns))


def _shared_variance(fit: Fits, residual: Array) -> Array:
    """Variance of u and v together (K,), from residuals (K, n) that neighbouring pixels share: print, JPEG and a blur
    that is no Gaussian do not average out.

    Products of residuals at each distance up to REACH_SHARE of the patch, times how pixels at that distance move the
    corner together.
    """
    patches, count = fit.patches, len(fit.number)
    # No wrapping into the distances that count.
    side = next_fast_len(patches.side + math.ceil(REACH_SHARE * patches.side), real=True)
    pictures = np.zeros((count, 4, patches.side**2))
    values = np.concatenate([fit.influence, residual[:, None], np.ones_like(residual)[:, None]], 1)
    np.put_along_axis(pictures, patches.cell[:, None], values * patches.counts[:, None], 2)
    spectrum = np.abs(rfft2(pictures.reshape(count, 4, patches.side, patches.side), (side, side))) ** 2
    power = np.stack([spectrum[:, 0] + spectrum[:, 1], spectrum[:, 2], spectrum[:, 3]], 1)
    moves, shared, pairs = np.moveaxis(irfft2(power, (side, side)), 1, 0)
    lag = np.minimum(np.arange(side), side - np.arange(side))
    near = np.hypot(lag[:, None], lag[None]) <= REACH_SHARE * (2 * patches.size + 1)[:, None, None]
    alone = shared[:, 0, 0] / pairs[:, 0, 0]
    together = np.sum(np.where(near, moves * shared / np.maximum(pairs, 1.0), 0.0), (1, 2))
    return np.maximum(together, moves[:, 0, 0] * alone)


def _start(patches: Patches, corners: Array) -> Array:
    """First parameters (K, 7): edge directions from the second angular harmonic, as the four quadrants alternate
    between dark and light.
    """
    own = corners - patches.at
    u, v, counts = patches.u - own[:, :1], patches.v - own[:, 1:], patches.counts
    pixels = counts.sum(1)
    mean, angle, far = patches.grey.sum(1) / pixels, np.arctan2(v, u), counts * (np.hypot(u, v) > _MIDDLE_PX)
    harmonic = np.sum(far * (patches.grey - mean[:, None]) * np.exp(2j * angle), 1)
    middle = 0.5 * np.angle(harmonic)  # of a light quadrant
    ordered = np.sort(np.where(counts > 0, patches.grey, np.inf), 1)
    place = np.array(_EXTREMES) / 100 * (pixels[:, None] - 1)
    below, above = (np.take_along_axis(ordered, end.astype(int), 1) for end in (np.floor(place), np.ceil(place)))
    dark, light = (below + (above - below) * (place % 1)).T
    half = 0.5 * (light - dark)
    return np.column_stack([own, middle + np.pi / 4, middle - np.pi / 4, mean, half, np.ones(len(mean))])


def _model(p: Array, u: Array, v: Array, fields: int) -> tuple[Array, Array]:
    """Grey (K, n) and its derivatives (K, n, 7) of four fields that meet, or of two: a dark corner on paper.  An edge
    of direction t has the distance -sin t du + cos t dv.
    """
    u0, v0, first, second, mean, half, blur = p.T[..., None]
    du, dv = u - u0, v - v0
    scale = 1.0 / (blur * np.sqrt(2.0))
    edges, slopes, distances, alongs = [], [], [], []
    for direction in (first, second):
        s, c = np.sin(direction), np.cos(direction)
        distance = c * dv - s * du
        edges.append(erf(distance * scale))
        slopes.append(2 / np.sqrt(np.pi) * scale * np.exp(-((distance * scale) ** 2)))
        distances.append(distance)
        alongs.append(-c * du - s * dv)  # d distance / d direction
    # the light quadrant lies between the two directions, where the distances have opposite signs
    if fields == 4:
        shape = -edges[0] * edges[1]
        by_first, by_second = -half * slopes[0] * edges[1], -half * edges[0] * slopes[1]
    else:
        shape = 1.0 - 0.5 * (1 + edges[0]) * (1 + edges[1])
        by_first, by_second = -0.5 * half * slopes[0] * (1 + edges[1]), -0.5 * half * (1 + edges[0]) * slopes[1]
    jacobian = np.empty((*shape.shape, PARAMETERS))
    jacobian[..., U] = by_first * np.sin(first) + by_second * np.sin(second)
    jacobian[..., V] = -by_first * np.cos(first) - by_second * np.cos(second)
    jacobian[..., FIRST], jacobian[..., SECOND] = by_first * alongs[0], by_second * alongs[1]
    jacobian[..., MEAN], jacobian[..., HALF] = 1.0, shape
    jacobian[..., BLUR] = -(by_first * distances[0] + by_second * distances[1]) / blur
    return mean + half * shape, jacobian
