"""A spline over the image beside a lens' distortion terms: as large and as smooth as the views themselves say."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from ovines.lens_field import LensField
from vision.calibration.bundle.adjustment import adjust
from vision.calibration.bundle.descent import information
from vision.calibration.bundle.unknowns import Adjusted, Observation, Setting, SplinePrior, State
from vision.smooth_field import AMPLITUDES_PX, both_axes, likeliest, rooted, smooth_covariance

Array = NDArray[np.float64]

STEPS = 12  # of the nodes along the image's longer side: cubic between them, a wave of a quarter of it is met to 1 %
# Correlation lengths in shares of the longer side, from a node's distance on; and amplitudes, where lenses are
# much worse than what recordings are asked for.
LENGTH_SHARES = (0.09, 0.12, 0.16, 0.21, 0.28, 0.37, 0.5)
ALL_AMPLITUDES_PX = (*AMPLITUDES_PX, 1.1, 1.7, 2.6)
FIRST_GUESS = 4, 3  # of amplitudes and lengths, by number
SPEAKS = 5.0  # log evidence over that of no field from which a fit of one is worth its time
_ROUNDS = 4  # of the points' sd and the prior, each of which rests on the other


def flat_spline(size_px: tuple[int, int]) -> LensField:
    """A spline over the whole image that moves nothing yet."""
    step = (max(size_px) - 1) / STEPS
    u, v = (np.linspace(0, side - 1, max(3, round((side - 1) / step)) + 1) for side in size_px)
    return LensField(u, v, np.zeros((len(u), len(v), 2)))


def adjust_with_spline(
    observations: Sequence[Observation], start: State, setting: Setting, iterations: int = 40
) -> Adjusted | None:
    """The one camera with its spline adjusted, its prior being what these observations make likeliest.

    ``start`` has a spline, flat or found before; ``setting`` keeps the prior.  None where the observations show no
    smooth field beside the lens.
    """
    found: Adjusted | None = None
    state, before = start, None
    for _ in range(_ROUNDS):
        best, evidence, prior = _likeliest_prior(observations, state, setting)
        if evidence < SPEAKS:
            return None
        if best == before:
            break
        before = best
        setting.spline_priors = (prior,)
        found = adjust(observations, state, setting, iterations)
        state = found.state
    return found


def _likeliest_prior(
    observations: Sequence[Observation], state: State, setting: Setting
) -> tuple[tuple[int, int], float, SplinePrior]:
    spline = state.splines[0]
    assert spline is not None  # the caller starts from a state that has one
    nodes = spline.nodes_px
    side = float(np.ptp(nodes, axis=0).max())
    given, right = information(observations, state, setting)

    smooth = cache(lambda length: both_axes(smooth_covariance(nodes, LENGTH_SHARES[length] * side)))
    under = cache(lambda length: rooted(given, right, smooth(length)))
    found = likeliest(
        lambda at: under(at[1]).solved(ALL_AMPLITUDES_PX[at[0]]),
        (len(ALL_AMPLITUDES_PX), len(LENGTH_SHARES)),
        FIRST_GUESS,
    )
    precision = np.linalg.inv(ALL_AMPLITUDES_PX[found.best[0]] ** 2 * smooth(found.best[1]))
    return (
        found.best,
        found.tried[found.best].evidence,
        SplinePrior(np.zeros(spline.size), 0.5 * (precision + precision.T)),
    )
