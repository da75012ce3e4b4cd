"""How far neighbouring frames' errors go together, from what the flights leave: corrected for what each flight's own state has swallowed.

A flight's place and speed follow noise that stays the same for as long as the flight lasts: residuals of ten frames whose errors are
correlated by 0.95 show 0.3.  What lag-one products must be expected of flights of these lengths is known for every correlation.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from analysis.evidence import Evidence

Array = NDArray[np.float64]

# Beyond it noise is a drift, which no flight tells from motion.
MOST = 0.98
GRID = np.concatenate([np.linspace(0.0, 0.8, 17), np.linspace(0.825, MOST, 8)])
# Lengths of flights are rounded to these.
LENGTHS = np.array([3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20, 24, 28, 34, 40, 48, 57, 68, 81, 96, 115, 140])


@lru_cache(maxsize=4096)
def expected_lag(count: int, correlation: float) -> tuple[float, float]:
    """Expected sums (neighbours' products, neighbours' mean squares) of the residuals of ``count`` frames about a line of their own.

    Unit AR(1) errors of that ``correlation``, the line by plain least squares."""
    errors = correlation ** np.abs(np.subtract.outer(np.arange(count), np.arange(count))) if correlation else np.eye(count)
    line = np.linalg.qr(np.column_stack([np.ones(count), np.arange(count)]))[0]
    keep = np.eye(count) - line @ line.T
    left = keep @ errors @ keep
    size = np.diag(left)
    return float(np.sum(np.diag(left, 1))), float(0.5 * np.sum(size[1:] + size[:-1]))


def noise_correlation(evidence: Sequence[Evidence]) -> float:
    """Correlation of neighbouring frames' errors (0 to :data:`MOST`) from all flights, which were fitted by plain least squares."""
    product, square = sum(e.lag_product for e in evidence), sum(e.lag_square for e in evidence)
    lengths = Counter(int(LENGTHS[np.argmin(np.abs(LENGTHS - n))]) for e in evidence for n in e.lengths if n > 2)
    if not square > 0 or not lengths:
        return 0.0
    expected = []
    for rho in GRID:
        sums = np.array([np.array(expected_lag(n, float(rho))) * many for n, many in lengths.items()]).sum(0)
        expected.append(sums[0] / sums[1])
    # Rising with the correlation but for rounding at its end.
    return float(np.interp(product / square, np.maximum.accumulate(expected), GRID))
