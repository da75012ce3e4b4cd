"""What recordings say of smooth fields: their noise, their information, what to believe of the fields, and whether
these predict what they were not learnt from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, reduce
from operator import add

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, eigh

from vision.lens.lattice import Lattice
from vision.lens.prior import FIRST_GUESS, LENGTHS_PX, smooth_prior
from vision.lens.residuals import NormalEquations
from vision.smooth_field import AMPLITUDES_PX, Solved, likeliest, rooted

Array = NDArray[np.float64]

# Fields that the noise is looked for in: any that are smooth and larger than what may be there.
_NOISE_AMPLITUDE_PX, _NOISE_LENGTH_PX, _NOISE_WAYS = 0.5, 200.0, 80
_SEEN = 1e-6  # smallest eigenvalue of their normal equations over the largest that still counts
_LEAST_WEIGHT = 1e-3  # of an amplitude and length, over the likeliest
_LEAST_NOISE = 1e-6  # of an exact film: weights stay finite


@dataclass(frozen=True, eq=False)
class Posterior:
    """The splines of all fields: ``mean`` (P,) and ``covariance`` (P, P) [px], averaged over amplitudes and lengths by
    how well each explains the data; ``amplitude_px``, ``length_px`` the likeliest; ``expected`` (P, P) its prior.
    """

    mean: Array
    covariance: Array
    amplitude_px: float
    length_px: float
    expected: Array


def noise_variance(parts: Sequence[NormalEquations], lattices: Sequence[Lattice]) -> float:
    """Variance of whitened residuals as the parts' disagreement shows it: that of a frame, times what its correlation
    from frame to frame makes of a mean.

    What one joint solution leaves in a part is fitted by smooth fields once more: noise alone gives each of their
    numbers the variance that is looked for.
    """
    whole = reduce(add, parts)
    smooth = smooth_prior(lattices, _NOISE_LENGTH_PX)
    prior = block_diag(np.linalg.inv(_NOISE_AMPLITUDE_PX**2 * smooth), np.diag(whole.prior))
    joint = np.linalg.solve(whole.matrix + prior, whole.right)
    n_ways = min(_NOISE_WAYS, whole.n_field)
    ways = np.zeros((len(joint), n_ways))
    ways[: whole.n_field] = eigh(smooth, subset_by_index=(whole.n_field - n_ways, whole.n_field - 1))[1]
    gains, ranks = zip(*(_explained(one, joint, ways) for one in parts), strict=True)
    return max(sum(gains) / max(sum(ranks) - n_ways, 1), _LEAST_NOISE)


def _explained(part: NormalEquations, joint: Array, ways: Array) -> tuple[float, int]:
    """What a fit of ``ways`` (P, W) takes off the squares that ``joint`` (P,) leaves, and by how many numbers."""
    values, vectors = np.linalg.eigh(ways.T @ part.matrix @ ways)
    seen = values > _SEEN * values[-1]
    along = vectors[:, seen].T @ (ways.T @ (part.right - part.matrix @ joint))
    return float(np.sum(along**2 / values[seen])), int(seen.sum())


def fields_only(part: NormalEquations, noise: float) -> tuple[Array, Array]:
    """Information (P, P) and right side (P,) of the fields alone, all else integrated out, in units of the noise."""
    n_field = part.n_field
    others = slice(n_field, None)
    matrix, right = part.matrix / noise, part.right / noise
    solved = np.linalg.solve(
        matrix[others, others] + np.diag(part.prior),
        np.column_stack([matrix[others, :n_field], right[others]]),
    )
    information = matrix[:n_field, :n_field] - matrix[:n_field, others] @ solved[:, :-1]
    return 0.5 * (information + information.T), right[:n_field] - matrix[:n_field, others] @ solved[:, -1]


def posterior_of(data: tuple[Array, Array], lattices: Sequence[Lattice], calibration: Array) -> Posterior:
    """What to believe of the fields after ``data`` (information (P, P) and right side (P,)), over all amplitudes and
    lengths, beside what the ``calibration`` (P, P) leaves open."""
    information, right = data
    smooth = cache(lambda length: smooth_prior(lattices, length))

    def prior_of(at: tuple[int, int]) -> Array:
        return np.asarray(AMPLITUDES_PX[at[0]] ** 2 * smooth(LENGTHS_PX[at[1]]) + calibration)

    by_length = cache(lambda number: rooted(information, right, smooth(LENGTHS_PX[number])))

    def solve(at: tuple[int, int]) -> Solved:
        if calibration.any():
            return rooted(information, right, prior_of(at)).solved()
        return by_length(at[1]).solved(AMPLITUDES_PX[at[0]])

    found = likeliest(solve, (len(AMPLITUDES_PX), len(LENGTHS_PX)), FIRST_GUESS)
    best, tried = found.best, found.tried
    weights = {at: np.exp(solved.evidence - tried[best].evidence) for at, solved in tried.items()}
    likely = [(w / sum(weights.values()), tried[at].covariance()) for at, w in weights.items() if w > _LEAST_WEIGHT]
    means = [covariance @ right for _, covariance in likely]
    mean = np.sum([w * m for (w, _), m in zip(likely, means, strict=True)], 0)
    spread = [w * (c + np.outer(m - mean, m - mean)) for (w, c), m in zip(likely, means, strict=True)]
    amplitude, length = AMPLITUDES_PX[best[0]], LENGTHS_PX[best[1]]
    return Posterior(mean, np.sum(spread, 0), amplitude, length, prior_of(best))


def held_out(blocks: Sequence[tuple[Array, Array]], prior: Array) -> tuple[float, float]:
    """By how many sds fields learnt from each half of the runs explain the other half, and what they take off its
    squares.
    """
    along = square = 0.0
    for (information, right), other in ((blocks[0], blocks[1]), (blocks[1], blocks[0])):
        learnt = rooted(*other, prior).solved().mean(other[1])
        along += float(right @ learnt)
        square += float(learnt @ information @ learnt)
    return along / float(np.sqrt(max(square, 1e-12))), 2 * along - square
