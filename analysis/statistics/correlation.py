"""Correlation of a residual from frame to frame, and what it makes of the error of a slow mean."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ovines.robust import residual_sd

Array = NDArray[np.float64]
# A residual this far (robust sds) from zero is a gross error.
CLIP_SD = 4.0
# Neighbouring frames of all noise that are more alike than this tell of motion.
MOST_CORRELATED = 0.95


def frame_correlation(residual: Array, clip_sd: float = CLIP_SD) -> float:
    """Correlation from frame to frame of ``residual`` (N,) or (N, C), NaN where unknown, which is all noise, slow or
    not: products of neighbours over squares, gross errors clipped at ``clip_sd``; 0 to :data:`MOST_CORRELATED`.

    With an infinite ``clip_sd`` nothing is clipped: where what it widens has been found with gross errors in it.

    >>> bool(frame_correlation(np.array([1.0, 0.8, 0.9, -0.7, -1.0, -0.6])) > 0.3)
    True
    """
    known = residual[np.isfinite(residual).reshape(len(residual), -1).all(1)]
    if not len(known):
        return 0.0
    known = known.reshape(len(known), -1)
    if np.isfinite(clip_sd):
        limit = clip_sd * np.array([residual_sd(column) for column in known.T])
        known = np.clip(known, -limit, limit)
    power = float(np.sum(known**2))
    return float(np.clip(np.sum(known[1:] * known[:-1]) / power, 0.0, MOST_CORRELATED)) if power > 0 else 0.0


def slow_mean(residual: Array, clip_sd: float = CLIP_SD) -> float:
    """By what factor the sd of a mean, or of anything slow, is larger than that of as many independent values (AR(1)).

    >>> slow_mean(np.array([1.0, -1.0, 1.0, -1.0]))
    1.0
    """
    together = frame_correlation(residual, clip_sd)
    return float(np.sqrt((1 + together) / (1 - together)))
