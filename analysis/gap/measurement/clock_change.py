"""A second camera that is late by one time in one part of a run and by another in the next: a frame that was dropped, a
clock that drifts.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.gap.cause import SMALLEST_P, Structure, two_sided

Array = NDArray[np.float64]

# Parts of a run, in time, whose delays are held against each other; each of so many frames or more.
PARTS, FEWEST_FRAMES = 4, 20
# A part's delay is beyond chance where it is so many sds off the common one (of some 50 parts none by chance), and
# beyond a lens residual where it is more than this share of what the residual is worth at the bodies' speed (its
# average over the places of a part).
SURE_SD, LENS_SHARE = 6.0, 0.5


def clock_change(
    along: Array, left: Array, part: NDArray[np.int64], inflation: float, lens_s: float, least_s: float
) -> Structure | None:
    """What parts of the runs say of the delay that the common one does not; None where they agree.

    ``along`` (N,) weighted derivatives of epipolar lines and heights with respect to the delay, ``left`` (N,) weighted
    residuals of the common fit, ``part`` (N,) number of the part; ``inflation`` of a mean's variance by the noise's
    correlation, ``lens_s``: the lens residual over the bodies' speed, ``least_s``: the delay that is negligible.
    """
    count = np.bincount(part)
    information = np.bincount(part, along**2)
    known = (count >= FEWEST_FRAMES) & (information > 0)
    if known.sum() < 2:
        return None
    off = np.bincount(part, along * left)[known] / information[known]
    sure = np.abs(off) / np.sqrt(inflation / information[known])
    large = np.abs(off) > max(least_s, LENS_SHARE * lens_s)
    if not np.any(large & (sure > SURE_SD)):
        return None
    most = int(np.argmax(np.where(large, sure, 0.0)))
    size = float(np.abs(off[most]))
    return Structure(
        "measurement",
        "all",
        "x",
        "the time within a run: the second camera's delay changes",
        size / least_s,
        float(sure[most] ** 2),
        size,
        "s",
        max(min(1.0, len(off) * two_sided(float(sure[most]))), SMALLEST_P),
    )
