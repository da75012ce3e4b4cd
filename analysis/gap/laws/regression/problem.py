"""A residual with what is fitted along: rows are whitened observations, so that a sum of squares is a fall of
-2 log L."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Blocks stand in for runs where there is only one.
FOLDS_OF_ONE_RUN = 5


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
        return scaled_inverse(information) @ (columns.T @ self.residual)

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


def part_of(problem: Regression, own: NDArray[np.bool_]) -> Regression:
    """Some of the rows of a problem."""
    return Regression(
        problem.residual[own], problem.nuisances[own], problem.prior, problem.block[own], problem.run[own]
    )


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
        step = scaled_inverse(information.sum(0) - information[r] + np.diag(prior)) @ (score.sum(0) - score[r])
        out[r] = np.sum((problem.residual[here] - every[here] @ step) ** 2)
    return out


def scaled_inverse(information: Array) -> Array:
    """Inverse after scaling to a unit diagonal; what has no information keeps none."""
    if not len(information):
        return information
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    scale = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    return np.asarray(
        np.linalg.pinv(information * np.outer(scale, scale), rcond=1e-11, hermitian=True) * np.outer(scale, scale),
        float,
    )


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
        left = self.free(columns)
        covariance = scaled_inverse(left.T @ left)
        score = left.T @ self.residual
        step = covariance @ score
        return float(step @ score), step, covariance

    def information(self, columns: Array) -> Array:
        """What all runs together say of the coefficients of ``columns`` (M, C): (C, C)."""
        left = self.free(columns)
        return np.asarray(left.T @ left, float)

    def free(self, columns: Array) -> Array:
        """``columns`` (M, C), and none of the prior's rows, without what nuisances explain of them."""
        more = len(self.residual) - len(columns)
        columns = np.vstack([columns, np.zeros((more, columns.shape[1]))])
        return np.asarray(columns - self.basis @ (self.basis.T @ columns), float)
