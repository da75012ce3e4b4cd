"""What candidates explain of a residual, each run predicted by the others, and what chance would explain.

Rows are whitened observations, so that a sum of squares is a fall of -2 log L.  Rows of a block (a flight, an impact)
share whatever noise did to them: chance is drawn by turning the sign of each block's residual, which keeps sizes and
correlations within a block whatever they are.  Turned is what the best candidate leaves (ter Braak 1992), not what it
explains: a strong law would otherwise pass for strong noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Blocks stand in for runs where there is only one.
FOLDS_OF_ONE_RUN = 5
# A column of which so little is left beside the others is none: rounding's.
LEAST_LEFT = 1e-9
NORMAL_90 = 1.645


@dataclass(frozen=True, eq=False)
class Regression:
    """``residual`` (M,) whitened; ``nuisances`` (M, P) fitted along with prior weights ``prior`` (P,), 1/variance;
    ``block`` (M,) and ``run`` (M,) numbers of each row's flight or impact, and run."""

    residual: Array
    nuisances: Array
    prior: Array
    block: NDArray[np.int64]
    run: NDArray[np.int64]

    @property
    def folds(self) -> NDArray[np.int64]:
        """The part (M,) with which a row is held out."""
        if len(np.unique(self.run)) > 1:
            return np.unique(self.run, return_inverse=True)[1]
        return self.block % FOLDS_OF_ONE_RUN

    @property
    def excess(self) -> float:
        """Variance of what the nuisances leave over that of the noise, at least 1."""
        left = self.residual - self.nuisances @ self.fitted(self.nuisances, self.prior)
        return max(1.0, float(left @ left) / max(len(left) - self.nuisances.shape[1], 1))

    def fitted(self, columns: Array, prior: Array) -> Array:
        """Least squares coefficients of ``columns`` (M, C) with prior weights (C,)."""
        information = columns.T @ columns + np.diag(prior)
        return _inverse(information) @ (columns.T @ self.residual)

    def with_columns(self, columns: Array) -> Regression:
        """``columns`` (M, C) among what is fitted along."""
        free = np.zeros(columns.shape[1])
        return Regression(
            self.residual,
            np.column_stack([self.nuisances, columns]),
            np.concatenate([self.prior, free]),
            self.block,
            self.run,
        )


@dataclass(frozen=True, eq=False)
class Forms:
    """Normal equations of nuisances (P) and columns: ``information`` (R, C, C) of each fold, ``scores`` (B, C) of each
    block, ``fold`` (B,) of each block; ``prior`` (C,)."""

    information: Array
    scores: Array
    fold: NDArray[np.int64]
    prior: Array
    held: int


def forms_of(problem: Regression, columns: Array) -> Forms:
    """Normal equations of a problem with further ``columns`` (M, C)."""
    every = np.column_stack([problem.nuisances, columns])
    blocks, block = np.unique(problem.block, return_inverse=True)
    folds = problem.folds
    fold_of = np.zeros(len(blocks), np.int64)
    fold_of[block] = folds
    information = np.array([every[folds == r].T @ every[folds == r] for r in range(folds.max() + 1)])
    prior = np.concatenate([problem.prior, np.zeros(columns.shape[1])])
    return Forms(information, _scores(problem, columns, problem.residual), fold_of, prior, problem.nuisances.shape[1])


def gains_by_chance(
    problem: Regression,
    columns: Array,
    groups: Sequence[Sequence[int]],
    best: int,
    drawn: tuple[int, np.random.Generator],
) -> tuple[Array, Array]:
    """Held-out gain (G,) of each group of ``columns``, and the largest gain (D,) in each of ``drawn`` problems (how
    many, and what draws) that hold noise alone: what the group ``best`` leaves (-1: the one that gains most), each
    block's sign drawn."""
    forms = forms_of(problem, columns)
    gains = held_out_gains(forms, groups, np.ones((1, len(forms.fold))))[0]
    if best < 0:
        best = int(np.argmax(gains))
    taken = problem.with_columns(columns[:, list(groups[best])])
    left = problem.residual - taken.nuisances @ taken.fitted(taken.nuisances, taken.prior)
    # What was fitted has taken a part of the noise of as many blocks.
    count = len(forms.fold)
    left = left * np.sqrt(count / max(count - len(groups[best]), 1))
    noise = replace(forms, scores=_scores(problem, columns, left))
    draws, rng = drawn
    signs = rng.choice([-1.0, 1.0], (draws, count))
    return gains, held_out_gains(noise, groups, signs).max(1)


def _scores(problem: Regression, columns: Array, residual: Array) -> Array:
    """Scores (B, C) of each block."""
    every = np.column_stack([problem.nuisances, columns])
    blocks, block = np.unique(problem.block, return_inverse=True)
    scores = np.zeros((len(blocks), every.shape[1]))
    np.add.at(scores, block, every * residual[:, None])
    return scores


def held_out_gains(forms: Forms, groups: Sequence[Sequence[int]], signs: Array) -> Array:
    """Fall of the sum of squares (D, G) of each fold, predicted by the others, when a group of columns (places among
    those of :func:`forms_of`) is fitted beside the nuisances; ``signs`` (D, B) of the blocks' residuals."""
    by_fold = np.stack(
        [signs[:, forms.fold == r] @ forms.scores[forms.fold == r] for r in range(len(forms.information))]
    )
    total, score = forms.information.sum(0) + np.diag(forms.prior), by_fold.sum(0)
    gains = np.zeros((len(signs), len(groups)))
    held, alike = forms.held, _alike(groups)
    for own, here in zip(forms.information, by_fold, strict=True):
        rest, rest_score = total - own, score - here
        inverse = _inverse(rest[:held, :held])
        turn = inverse @ rest[:held, held:]  # (P, C): what nuisances take of each column
        left = rest[held:, held:] - rest[:held, held:].T @ turn
        pushed = rest_score[:, held:] - rest_score[:, :held] @ turn
        # Own fold's forms once the nuisances follow the others' solution.
        nuisance = rest_score[:, :held] @ inverse
        own_left = own[held:, held:] - turn.T @ own[:held, held:] - own[held:, :held] @ turn
        own_left += turn.T @ own[:held, :held] @ turn
        own_score = here[:, held:] - here[:, :held] @ turn
        own_score -= nuisance @ (own[:held, held:] - own[:held, :held] @ turn)
        full = np.diag(rest)[held:]
        for which, places in alike:
            told = np.all(np.diag(left)[places] > LEAST_LEFT * full[places], 1)
            at, g = places[told], which[told]
            inverses = _inverses(left[at[:, :, None], at[:, None, :]])
            step = np.einsum("dga,gab->dgb", pushed[:, at], inverses)
            lost = np.einsum("dga,gab,dgb->dg", step, own_left[at[:, :, None], at[:, None, :]], step)
            gains[:, g] += 2 * np.sum(step * own_score[:, at], 2) - lost
    return gains


def _alike(groups: Sequence[Sequence[int]]) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Groups of as many columns each: their numbers (G,) and places (G, K)."""
    lengths = np.array([len(group) for group in groups], np.int64)
    found = []
    for length in np.unique(lengths):
        which = np.flatnonzero(lengths == length)
        found.append((which, np.array([groups[int(g)] for g in which], np.int64).reshape(len(which), -1)))
    return found


def held_out_squares(problem: Regression, columns: Array) -> Array:
    """Sums of squares (R,) of each fold's residuals when nuisances and ``columns`` (M, C) follow the other folds."""
    every = np.column_stack([problem.nuisances, columns])
    prior = np.concatenate([problem.prior, np.zeros(columns.shape[1])])
    folds = problem.folds
    information = np.array([every[folds == r].T @ every[folds == r] for r in range(folds.max() + 1)])
    score = np.array([every[folds == r].T @ problem.residual[folds == r] for r in range(folds.max() + 1)])
    out = np.zeros(len(information))
    for r in range(len(out)):
        here = folds == r
        step = _inverse(information.sum(0) - information[r] + np.diag(prior)) @ (score.sum(0) - score[r])
        out[r] = np.sum((problem.residual[here] - every[here] @ step) ** 2)
    return out


def _inverse(information: Array) -> Array:
    """Inverse after scaling to a unit diagonal; what has no information keeps none."""
    return _inverses(information) if len(information) else information


def _inverses(information: Array) -> Array:
    """The same of each of several (..., K, K), K > 0."""
    size = np.sqrt(np.maximum(np.diagonal(information, axis1=-2, axis2=-1), 0.0))
    scale = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    both = scale[..., :, None] * scale[..., None, :]
    return np.asarray(np.linalg.pinv(information * both, rcond=1e-11, hermitian=True) * both, float)


@dataclass(frozen=True, eq=False)
class Profile:
    """A problem with its nuisances projected out: what single candidates explain of all runs together."""

    basis: Array
    residual: Array

    @staticmethod
    def of(problem: Regression) -> Profile:
        """Prior weights as further rows, so that projection is least squares."""
        rows = np.vstack([problem.nuisances, np.diag(np.sqrt(problem.prior))])
        size = np.sqrt(np.sum(rows**2, 0))
        u, s, _ = np.linalg.svd(rows[:, size > 0] / size[size > 0], full_matrices=False)
        basis = u[:, s > 1e-9 * max(s.max(initial=0.0), 1e-300)]
        residual = np.concatenate([problem.residual, np.zeros(len(problem.prior))])
        return Profile(basis, residual - basis @ (basis.T @ residual))

    def gain(self, columns: Array) -> tuple[float, Array, Array]:
        """Fall of the sum of squares, coefficients (C,) and their covariance (C, C) of ``columns`` (M, C)."""
        more = len(self.residual) - len(columns)
        columns = np.vstack([columns, np.zeros((more, columns.shape[1]))])
        left = columns - self.basis @ (self.basis.T @ columns)
        covariance = _inverse(left.T @ left)
        score = left.T @ self.residual
        step = covariance @ score
        return float(step @ score), step, covariance


@dataclass(frozen=True)
class Halves:
    """A law's size, 1 being the one told, fitted to every second run alone (the first, third, ...) and to the others,
    with sds."""

    sizes: tuple[float, float]
    sds: tuple[float, float]

    @property
    def agree(self) -> bool:
        """Whether the two 90 % intervals overlap."""
        return abs(self.sizes[0] - self.sizes[1]) <= NORMAL_90 * (self.sds[0] + self.sds[1])

    def entry(self) -> dict[str, Any]:
        """As diagnosis.json has it."""
        pairs = zip(self.sizes, self.sds, strict=True)
        sizes = [{"value": v, "low": v - NORMAL_90 * sd, "high": v + NORMAL_90 * sd} for v, sd in pairs]
        return {"agree": self.agree, "sizes": sizes}


def second_half(problem: Regression) -> NDArray[np.bool_]:
    """Which rows (M,) are of every second run, from the second on."""
    return np.asarray(np.unique(problem.run, return_inverse=True)[1] % 2 == 1, bool)


def halves_of(problem: Regression, moved: Array) -> Halves | None:
    """Sizes of what a law does to the rows (M,) by halves of the runs, every nuisance fitted anew to each; None of one
    run, or where a half tells nothing."""
    second = second_half(problem)
    if not np.any(second):
        return None
    scatter = scatter_of_runs(problem, moved)
    fits = [_size(part_of(problem, own), moved[own]) for own in (~second, second)]
    if not all(sd > 0 for _, sd in fits):
        return None
    (first, first_sd), (other, other_sd) = fits
    return Halves((first, other), (scatter * first_sd, scatter * other_sd))


def scatter_of_runs(problem: Regression, moved: Array) -> float:
    """By how much the sizes that single runs ask for scatter about those of their halves, over their own sds; 1 at the
    least, and where no half has two runs."""
    second = second_half(problem)
    squares, free = 0.0, 0
    for half in (~second, second):
        each = [
            _size(part_of(problem, problem.run == run), moved[problem.run == run])
            for run in np.unique(problem.run[half])
        ]
        size, sd = np.array([one for one in each if one[1] > 0]).reshape(-1, 2).T
        if len(size) > 1:
            mean = float(np.sum(size / sd**2) / np.sum(1 / sd**2))
            squares, free = squares + float(np.sum(((size - mean) / sd) ** 2)), free + len(size) - 1
    return max(1.0, float(np.sqrt(squares / free))) if free else 1.0


def _size(problem: Regression, moved: Array) -> tuple[float, float]:
    """Size and sd of what a law does to the rows, every nuisance fitted along; an sd of 0 where they tell nothing."""
    _, size, covariance = Profile.of(problem).gain(moved[:, None])
    if not covariance[0, 0] > 0:
        return 0.0, 0.0
    excess = replace(problem, residual=problem.residual - size[0] * moved).excess
    return float(size[0]), float(np.sqrt(covariance[0, 0] * excess))


def part_of(problem: Regression, own: NDArray[np.bool_]) -> Regression:
    """Some of the rows of a problem."""
    return Regression(
        problem.residual[own], problem.nuisances[own], problem.prior, problem.block[own], problem.run[own]
    )
