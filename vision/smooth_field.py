"""A smooth field as a Gaussian process: what is believed of one beforehand, and what data make of its size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

Array = NDArray[np.float64]

AMPLITUDES_PX = (0.01, 0.02, 0.04, 0.07, 0.1, 0.14, 0.2, 0.3, 0.45, 0.7)  # sd of a field: what data choose from
ROUGH_SHARE = 0.01  # of the amplitude, free from place to place: no lens is as smooth as the kernel


def smooth_covariance(places_px: Array, length_px: float) -> Array:
    """Covariance (n, n) of a coordinate of a field at places (n, 2), of amplitude 1 px and this correlation length."""
    apart = np.linalg.norm(places_px[:, None] - places_px[None], axis=-1) / length_px
    return np.asarray(np.exp(-0.5 * apart**2) + ROUGH_SHARE**2 * np.eye(len(places_px)), float)


def solve_with_prior(information: Array, right: Array, prior: Array) -> tuple[float, Array]:
    """Log evidence over that of no field at all, and the posterior covariance (P, P).

    ``information`` (P, P) and ``right`` (P,): the data's normal equations; ``prior`` (P, P) the covariance beforehand.
    """
    root = np.linalg.cholesky(prior)
    system = np.eye(len(prior)) + root.T @ information @ root
    factor = np.linalg.cholesky(system)
    half = solve_triangular(factor, root.T, lower=True)
    covariance = half.T @ half
    along = half @ right
    return float(0.5 * along @ along - np.log(np.diag(factor)).sum()), covariance


@dataclass(frozen=True, eq=False)
class Likely:
    """The likeliest amplitude and length by their numbers, ``best``; log evidence and posterior covariance of all
    that were ``tried``, by numbers alike.
    """

    best: tuple[int, int]
    tried: dict[tuple[int, int], tuple[float, Array]]


def likeliest(
    information: Array,
    right: Array,
    prior: Callable[[tuple[int, int]], Array],
    counts: tuple[int, int],
    start: tuple[int, int],
) -> Likely:
    """Uphill from ``start`` to the likeliest amplitude and length, of ``counts`` of each.

    ``prior``: covariance (P, P) of an amplitude and length, by their numbers.
    """
    tried: dict[tuple[int, int], tuple[float, Array]] = {}

    def look(at: tuple[int, int]) -> float:
        if not (0 <= at[0] < counts[0] and 0 <= at[1] < counts[1]):
            return -np.inf
        if at not in tried:
            tried[at] = solve_with_prior(information, right, prior(at))
        return tried[at][0]

    best = start  # uphill from there, to the likeliest amplitude and length and all beside it
    while True:
        around = [(best[0] + i, best[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
        higher = max(around, key=look)
        if higher == best:
            return Likely(best, tried)
        best = higher


def both_axes(block: Array) -> Array:
    """Of a field's two coordinates, each by itself: (2 n, 2 n) of (n, n)."""
    return np.asarray(np.kron(np.eye(2), block), float)


def of_all(blocks: Sequence[Array]) -> Array:
    """One matrix of blocks on its diagonal, each twice: for u and for v."""
    sizes = [2 * len(block) for block in blocks]
    out = np.zeros((sum(sizes), sum(sizes)))
    at = 0
    for block, size in zip(blocks, sizes, strict=True):
        out[at : at + size, at : at + size] = both_axes(block)
        at += size
    return out
