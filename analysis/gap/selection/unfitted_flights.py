"""Flights that the law leaves more of than their noise, where no probe says what: a misfit of all, or many that no fit
heeds.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import bdtrc

from analysis.flights.evidence import OUTLYING_FLIGHT
from analysis.flights.fit import FlightFits
from analysis.gap.cause import SMALLEST_P, Cause, Structure
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.null_distribution import chance_of_misfit

# A lens residual of 0.05 mm over sharp markers (5 um) leaves a misfit of 2.4 (practice-05); where the cameras show
# none, noise and placement left 1.13 at most in 30 series.
USUAL_MISFIT_UNDER_LENS, USUAL_MISFIT = 4.0, 1.5
# Flights that are left out of the fit for their misfit: so many of them hide an impact (1 % in six series of the blind
# plant), more than so many with chance like this are a law that is missing (one in six where the floor is grooved).
LONG_FRAMES, USUAL_OUTLYING, MOST_OUTLYING, BY_CHANCE = 12, 0.02, 0.1, 0.01 / 4
FELT_IN_FLIGHT = ("camera_clock_offset", "mass_centre_offset", "trigger_jitter", "motion_blur")


def unexplained_misfit(
    flight: FlightFit, found: Sequence[Structure], causes: Sequence[Cause], lens_residual_found: bool
) -> list[Structure]:
    """Misfit of the flights beyond the noise, where no probe explains it; nothing beside a late clock or an eccentric
    mass, which the flights feel and their law does not hold.
    """
    if any(c.effect in FELT_IN_FLIGHT for c in causes) or any(s.stage in ("flight", "measurement") for s in found):
        return []
    usual = USUAL_MISFIT_UNDER_LENS if lens_residual_found else USUAL_MISFIT
    excess = flight.misfit / max(flight.count, 1)
    if excess > usual:
        p = chance_of_misfit(flight.misfit, flight.count)
        return [_unfitted("misfit of the flights", excess, usual, "times the noise's variance", p)]
    # A few flights that nothing fits hide an impact or follow a wrong track, and are left out; many are a law missing.
    outlying, flights = outlying_flights(flight.fits)
    share = outlying / max(flights, 1)
    p = float(max(bdtrc(outlying - 1, flights, USUAL_OUTLYING), SMALLEST_P))
    if share > MOST_OUTLYING and p < BY_CHANCE:
        return [_unfitted("flights that the law does not fit", share, MOST_OUTLYING, "of the flights", p)]
    return []


def _unfitted(what: str, size: float, usual: float, unit: str, p: float) -> Structure:
    words = f"none of the probes tested ({what})"
    return Structure("flight", "free flight", "x", words, size / usual, 0.0, size, unit, p)


def outlying_flights(fits: Sequence[FlightFits]) -> tuple[int, int]:
    """How many of the flights of :data:`LONG_FRAMES` frames and more that move are misfitted by so much more than the
    usual one that no fit heeds them, and how many there are."""
    ratios = [
        fit.misfit[k] / fit.freedom[k]
        for fit in fits
        for k, flight in enumerate(fit.flights)
        if flight.last - flight.first + 1 >= LONG_FRAMES and fit.freedom[k] > 0 and not fit.rests(k)
    ]
    if not ratios:
        return 0, 0
    limit = OUTLYING_FLIGHT * max(float(np.median(ratios)), 1.0)
    return int(np.count_nonzero(np.array(ratios) > limit)), len(ratios)
