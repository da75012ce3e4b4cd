"""Pairs of columns, a cosine and a sine each: their products, and the inverse of these."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def products(rows: Array) -> Array:
    """Of pairs of columns (M, 2, G): squares of both and the product (3, G)."""
    return np.array([np.einsum("mg,mg->g", rows[:, i], rows[:, j]) for i, j in ((0, 0), (1, 1), (0, 1))])


def inverse_and_power(rows: Array) -> tuple[Array, Array]:
    """Of pairs of columns (M, 2, G): the inverse (2, 2, G) of their products, and their power (G,)."""
    cc, ss, cs = (np.sum(rows[:, i] * rows[:, j], 0) for i, j in ((0, 0), (1, 1), (0, 1)))
    return inverse(cc, ss, cs), cc + ss


def inverse(cc: Array, ss: Array, cs: Array) -> Array:
    """Inverse (2, 2, G) of pairs' products."""
    determinant = np.maximum(cc * ss - cs**2, 1e-12 * cc * ss + 1e-300)
    return np.array([[ss, -cs], [-cs, cc]]) / determinant
