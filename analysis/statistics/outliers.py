"""A likelihood of which a few values are none: a share of them scatters far more widely."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def belongs(r2: Array, variance: Array, broad: Array, share: float) -> tuple[Array, Array]:
    """Probability that each value follows the law, and the logarithm of its density (K,), constants left out."""
    follow = np.log1p(-share) - 0.5 * (r2 / variance + np.log(variance))
    if share == 0.0:
        return np.ones(len(r2)), follow
    outlier = np.log(share) - 0.5 * (r2 / (variance + broad) + np.log(variance + broad))
    density = np.logaddexp(follow, outlier)
    return np.exp(follow - density), density
