"""What is known of the flights' shared unknowns before the flights say more: of the markers' origin and of the lens
residual's terms, whose size is not known either."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.fit import ORIGIN, SHARED
from analysis.flights.unknown_force import Prior

Array = NDArray[np.float64]

# Lens residual per polynomial term before the flights tell its size (rig units: 0.03 mm of a 40 mm rig), markers'
# origin within 1 mm.
LENS_SD_M = 3e-5
# Prior sd of what is not there, and the sizes that are tried: more than 0.15 % of the contact radius no calibration
# leaves.
HELD_M = 1e-9
LENS_SDS_M = (HELD_M, *np.geomspace(5e-7, 6e-5, 8).tolist())
ORIGIN_SD_M = 1e-3
# Parameters that no flight informs keep this sd, and are then reported as not determined.
WEAK_SD = 1e2
#: columns of the markers' origin and of the lens residual's terms, in the order of the shared offsets
OFFSETS = tuple(SHARED.index(name) for name in (*ORIGIN, *LENS_TERMS))
# Terms linear in the place are held: they look like an error of length and attitude, and the Host does not share them.
NONLINEAR = tuple(name for name in LENS_TERMS if int(name[-2]) + int(name[-1]) > 1)


def prior_sd(lens_sd_m: float) -> dict[str, float]:
    """Prior sds of the origin and of the lens residual's terms, the linear ones held."""
    return {
        **dict.fromkeys(LENS_TERMS, HELD_M),
        **dict.fromkeys(NONLINEAR, lens_sd_m),
        **dict.fromkeys(ORIGIN, ORIGIN_SD_M),
    }


def prior_of(columns: Sequence[int], shared: Array, lens_sd_m: float) -> tuple[Array, Array]:
    """Prior's 1/variance of the columns, and how it pulls offsets to zero from where they stand (``shared``)."""
    sds = prior_sd(lens_sd_m)
    prior = np.array([sds.get(SHARED[c], WEAK_SD) for c in columns]) ** -2.0
    pull, place = np.zeros(len(columns)), {c: k for k, c in enumerate(columns)}
    for column, stands in zip(OFFSETS, shared, strict=True):
        if column in place:
            k = place[column]
            pull[k] = -prior[k] * stands
    return prior, pull


def lens_priors(columns: Sequence[int], chosen: Sequence[int], shared: Array) -> list[Prior]:
    """:func:`prior_in` with each size that the lens residual's terms may have."""
    return [prior_in(columns, chosen, shared, lens_sd) for lens_sd in LENS_SDS_M]


def prior_in(columns: Sequence[int], chosen: Sequence[int], shared: Array, lens_sd_m: float) -> Prior:
    """The prior of the ``chosen`` of the evidence's ``columns``, the lens residual's terms integrated out."""
    weight, pull = prior_of(chosen, shared, lens_sd_m)
    place = {c: k for k, c in enumerate(columns)}
    return Prior(
        tuple(place[c] for c in chosen),
        weight,
        pull,
        float(np.sum(pull**2 / weight)),
        np.array([c in OFFSETS[len(ORIGIN) :] for c in chosen], bool),
    )
