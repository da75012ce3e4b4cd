"""Noise of a smooth motion, and least squares that a few wrong values do not move."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ovines.robust import residual_sd

Array = NDArray[np.float64]

# Scale of Cauchy's weights, in sds of the residuals: an error of so many weighs a half.  Of normal errors 97 % of the
# information stays (95 % at the usual 2.385).
CAUCHY_SD = 3.0
# Eigenvalues below this share of the largest are nil but for rounding.
LEAST_DETERMINED = 1e-15
# Added to a matrix of unit diagonal before it is inverted.
UNIT_RIDGE = 1e-11
# sd of a median over that of the mean, of normal errors.
MEDIAN_SD = 1.2533


def smooth_noise(values: Array) -> float:
    """Sd of the noise of a smooth motion ``values`` (N,) at equal steps: third differences leave noise alone, whose
    variance they take 1 + 9 + 9 + 1 times; NaN of too few.
    """
    return residual_sd(np.diff(values, 3)) / float(np.sqrt(20.0))


def symmetric_inverse(matrix: Array) -> Array:
    """Inverse (P, P) of a symmetric matrix, of what it leaves open nil: numpy's, in a third of its time for a few
    unknowns."""
    sizes, ways = np.linalg.eigh(matrix)
    determined = np.abs(sizes) > LEAST_DETERMINED * np.abs(sizes).max(initial=0.0)
    return np.asarray((ways / np.where(determined, sizes, np.inf)) @ ways.T, float)


def covariance_of(information: Array) -> Array:
    """Inverse of an information matrix, scaled to a unit diagonal first, with a whisper of ridge; a column without
    information has no variance either (its unknown keeps its value)."""
    diagonal = np.diag(information)
    informed = np.isfinite(diagonal) & (diagonal > 0)
    scale = np.where(informed, 1 / np.sqrt(np.where(informed, diagonal, 1.0)), 0.0)
    scaled = np.where(np.outer(informed, informed), information, 0.0) * np.outer(scale, scale)
    return np.linalg.inv(scaled + UNIT_RIDGE * np.eye(len(scale))) * np.outer(scale, scale)


def at_least_noise(standard: Array) -> float:
    """Scatter of standardised residuals (K,), never below 1: errors are no smaller than stated."""
    return max(1.0, residual_sd(standard)) if len(standard) else 1.0


def root_weights(standard: Array, scale: float) -> Array:
    """Square roots (K,) of Cauchy's weights of standardised residuals whose scatter is ``scale``, over ``scale``."""
    return 1 / (scale * np.sqrt(1 + (standard / scale / CAUCHY_SD) ** 2))


@dataclass(frozen=True, eq=False)
class RobustFit:
    """``coefficients`` (P,), their ``covariance`` (P, P) with the residuals' scatter in it, standardised ``residual``
    (K,), and ``weight`` (K,): what each row was multiplied with last."""

    coefficients: Array
    covariance: Array
    residual: Array
    weight: Array


def least_squares(
    design: Array,
    values: Array,
    sd: Array,
    start: Array | None = None,
    rounds: int = 30,
    rests_sd: float = 0.0,
    ridge: float = 0.0,
) -> RobustFit:
    """``values`` (K,) with sds ``sd`` as ``design`` (K, P) times coefficients, reweighted by Cauchy's weights.

    ``start`` coefficients, by default those of plain least squares.  It ends after ``rounds``, or when a step is within
    ``rests_sd`` of the coefficients' sds (0: never); ``ridge`` is added to the normal equations' diagonal.
    """

    def standard(c: Array) -> Array:
        return np.asarray((values - design @ c) / sd, float)

    def weights(z: Array) -> Array:
        return root_weights(z, at_least_noise(z)) / sd

    coefficients = np.zeros(design.shape[1]) if start is None else start
    weight = 1 / sd if start is None else weights(standard(start))
    covariance = np.zeros((design.shape[1], design.shape[1]))
    for _ in range(rounds):
        rows = design * weight[:, None]
        normal = rows.T @ rows + ridge * np.eye(design.shape[1])
        covariance = symmetric_inverse(normal)
        last, coefficients = coefficients, covariance @ (rows.T @ (values * weight))
        weight = weights(standard(coefficients))
        if np.all(np.abs(coefficients - last) < rests_sd * np.sqrt(np.diag(covariance))):
            break
    return RobustFit(coefficients, covariance, standard(coefficients), weight)
