"""A smooth field as a Gaussian process: what is believed of one beforehand, and what data make of its size."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.linalg.blas import dtrmm

Array = NDArray[np.float64]

AMPLITUDES_PX = (0.01, 0.02, 0.04, 0.07, 0.1, 0.14, 0.2, 0.3, 0.45, 0.7)  # sd of a field: what data choose from
ROUGH_SHARE = 0.01  # of the amplitude, free from place to place: no lens is as smooth as the kernel


def smooth_covariance(places_px: Array, length_px: float) -> Array:
    """Covariance (n, n) of a coordinate of a field at places (n, 2), of amplitude 1 px and this correlation length."""
    apart = np.linalg.norm(places_px[:, None] - places_px[None], axis=-1) / length_px
    return np.asarray(np.exp(-0.5 * apart**2) + ROUGH_SHARE**2 * np.eye(len(places_px)), float)


@dataclass(frozen=True, eq=False)
class Solved:
    """Data under a prior: log ``evidence`` over that of no field at all; ``root`` (P, P) the prior's lower factor, and
    ``factor`` (P, P) that of the information in its units.
    """

    evidence: float
    root: Array
    factor: Array

    def covariance(self) -> Array:
        """The covariance of what is left unknown, (P, P): it takes as long as the evidence does, and few ask for it."""
        half = solve_triangular(self.factor, self.root.T, lower=True, check_finite=False)
        return np.asarray(half.T @ half)

    def mean(self, right: Array) -> Array:
        """The likeliest field (P,) of the data whose ``right`` side that is."""
        along = solve_triangular(self.factor, self.root.T @ right, lower=True, check_finite=False)
        return np.asarray(self.root @ solve_triangular(self.factor, along, lower=True, trans=1, check_finite=False))


@dataclass(frozen=True, eq=False)
class Rooted:
    """Data in the units of a prior whose lower factor ``root`` (P, P) is: their information ``within`` (P, P) and right
    side ``pulled`` (P,).  That prior times any amplitude's square is solved from there.
    """

    root: Array
    within: Array
    pulled: Array

    def solved(self, amplitude: float = 1.0) -> Solved:
        """Under the prior times the square of ``amplitude``."""
        system = amplitude**2 * self.within
        system[np.diag_indices(len(system))] += 1.0
        factor = np.linalg.cholesky(system)
        along = solve_triangular(factor, amplitude * self.pulled, lower=True, check_finite=False)
        evidence = 0.5 * along @ along - np.log(np.diag(factor)).sum()
        return Solved(float(evidence), amplitude * self.root, np.asarray(factor, float))


def rooted(information: Array, right: Array, prior: Array) -> Rooted:
    """``information`` (P, P) and ``right`` (P,): the data's normal equations; ``prior`` (P, P) the covariance
    beforehand.
    """
    root = np.asarray(np.linalg.cholesky(prior), float)
    # BLAS reads columns first: of the transposed root it takes the lower half for an upper one.
    within = dtrmm(1.0, root.T, dtrmm(1.0, root.T, information, lower=0), side=1, lower=0, trans_a=1)
    return Rooted(root, within, root.T @ right)


@dataclass(frozen=True, eq=False)
class Likely:
    """The likeliest amplitude and length by their numbers, ``best``; all that were ``tried``, by numbers alike."""

    best: tuple[int, int]
    tried: dict[tuple[int, int], Solved]


def likeliest(solve: Callable[[tuple[int, int]], Solved], counts: tuple[int, int], start: tuple[int, int]) -> Likely:
    """Uphill from ``start`` to the likeliest amplitude and length, of ``counts`` of each.

    ``solve``: the data under the prior of an amplitude and length, by their numbers.
    """
    tried: dict[tuple[int, int], Solved] = {}

    def look(at: tuple[int, int]) -> float:
        if not (0 <= at[0] < counts[0] and 0 <= at[1] < counts[1]):
            return -np.inf
        if at not in tried:
            tried[at] = solve(at)
        return tried[at].evidence

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
