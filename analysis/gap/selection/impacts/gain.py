"""What one term explains of one residual of the impacts, and what is too little to count."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.contact.law import LawData

Array = NDArray[np.float64]

#: what a term must explain to be more than negligible: of a law of the contact in its own units, of the angular one (a
#: velocity) as a share of the median approach.  In 102 drawn series with nothing unlisted, under three noises, what was
#: surely found in contacts without a duration was at most 0.35 of this (0.0007 of restitution); where they last, a
#: law of instants leaves up to 0.011 of the restitution.
NEGLIGIBLE = {"restitution": 0.004, "sliding": 0.015, "sticking": 0.015, "angular": 5e-3}
WHILE_LASTING = 3.0


def negligible_size(residual: str, data: LawData, lasts: bool) -> float:
    """What a term of ``residual`` must explain of these impacts, which ``lasts`` or are instants, to be more than
    negligible."""
    unit = float(np.median(data.before)) if residual == "angular" else 1.0
    return negligible_share(residual, lasts) * unit


def mattering(lasts: bool) -> float:
    """How much strengths of impacts, which ``lasts`` or are instants, count beside those of flights and measurement:
    instants show a third of what matters."""
    return 1.0 if lasts else 1.0 / WHILE_LASTING


def negligible_share(residual: str, lasts: bool) -> float:
    """The same of restitution and friction, which have no unit."""
    return NEGLIGIBLE[residual] * (WHILE_LASTING if lasts and residual != "angular" else 1.0)


@dataclass(frozen=True, eq=False)
class ImpactGain:
    """What one term explains: fall of -2 log L, the rms of what it adds (units of the residual), coefficients and
    sd; ``columns`` (K, .) of a term of the restitution.
    """

    name: str
    residual: str
    gain: float
    size: float
    estimate: Array
    sd: Array
    named: bool
    significance: float = 0.0
    columns: Array | None = None
    order: int = 0
