"""What all discs of a picture have in common is their shape, not noise.

A board's dots are drawn alike, so each has the same corners, the same bulge, and the same lens and sensor in front of
it.  That displaces every edge alike, which moves no dot against another: it lies in the board's own place.  A fit of
one disc cannot tell it from noise; many discs of one picture can.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.markers.edge_structure import FIRST, displacements, edge_structure
from vision.markers.fit import FLOOR_PX2, HUBER, LEAST_NOISE
from vision.markers.normal_equations import no_equations, normal_equations
from vision.markers.row import MISFIT, N_EVEN, NOISE, SD, U, V, radius_px
from vision.markers.window import collect

Array = NDArray[np.float64]

FEWEST_DISCS = 12  # from which on three numbers of each frequency are known well enough
_ROUNDS = 3  # of weighing: a disc half covered has a shape of its own


def sd_without_shared_shape(image: NDArray[Any], fits: Array) -> Array:
    """Standard deviations [px] (n,) of the centres of discs that are alike, against each other.

    Parameters
    ----------
    image : (h, w) uint8 or uint16, C-contiguous
    fits : (n, 20) of `vision.markers.fit.fit_discs`

    Each edge's displacements are fitted by ones that all discs share, linear in the place; what is left is noise.
    Of fewer discs than `FEWEST_DISCS` the standard deviations are those of the fits.
    """
    if len(fits) < FEWEST_DISCS:
        return np.array(fits[:, SD])
    radii = radius_px(fits)
    every = [_displacements(image, fit, radius) for fit, radius in zip(fits, radii, strict=True)]
    moved, weight = (np.array([one[k] for one in every])[:, FIRST:] for k in (0, 1))
    seen = (weight > 0).all((1, 2))
    if seen.sum() < FEWEST_DISCS:
        return np.array(fits[:, SD])
    place = (fits[:, [U, V]] - fits[:, [U, V]].mean(0)) / np.maximum(fits[:, [U, V]].std(0), 1.0)
    basis = np.column_stack([np.ones(len(fits)), place])
    shift = np.where(weight > 0, moved / np.where(weight > 0, weight, 1.0), 0.0).reshape(len(fits), -1)
    trust = seen.astype(float)
    for _ in range(_ROUNDS):
        root = np.sqrt(trust)[:, None]
        shared = basis @ np.linalg.lstsq(root * basis, root * shift, rcond=None)[0]
        off = ((shift - shared) ** 2 * weight.reshape(len(fits), -1)).mean(1)
        trust = seen / (1.0 + off / max(float(np.median(off[seen])), 1e-9))
    hat = np.einsum("ij,jk,ik->i", basis, np.linalg.inv(basis.T @ (trust[:, None] * basis)), basis) * trust
    left = moved - shared.reshape(moved.shape) * weight
    left /= np.sqrt(np.maximum(1.0 - hat, 1.0 / len(fits)))[:, None, None]
    out = np.array(fits[:, SD])
    for k in np.flatnonzero(seen):
        noise = max(float(fits[k, NOISE]), LEAST_NOISE)
        before, after = (_moving(own[k], weight[k], every[k][2], radii[k], noise) for own in (moved, left))
        out[k] = np.sqrt(FLOOR_PX2 + max(out[k] ** 2 - FLOOR_PX2, 0.0) * (after / before) ** 2)
    return out


def _displacements(image: NDArray[Any], fit: Array, radius: float) -> tuple[Array, Array, int]:
    """Of `vision.markers.edge_structure.displacements`, at the fit's end."""
    disc = np.array(fit)
    window, equations = collect(image, disc, 0), no_equations()
    clip = HUBER * max(LEAST_NOISE, float(disc[NOISE]), float(disc[MISFIT]))
    normal_equations(window, disc, clip, True, N_EVEN, equations)
    moved, weight, last = displacements(window.work, window.n_edge, float(radius))
    return moved, weight, int(last)


def _moving(moved: Array, weight: Array, last: int, radius: float, noise: float) -> float:
    """Rms of independent pixels that would move the centre as much as these displacements tell [grey levels]."""
    none = np.zeros((FIRST, 2))
    return float(
        edge_structure(np.vstack([none, moved]), np.vstack([none, weight]), last, float(radius), float(noise))[0]
    )
