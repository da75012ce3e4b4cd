"""Flights that the law leaves more of than their noise, where no probe says what: a misfit of all, many that no fit
heeds, or some one after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import comb

import numpy as np
from numpy.typing import NDArray
from scipy.special import bdtrc

from analysis.flights.evidence import OUTLYING_FLIGHT
from analysis.flights.fit import FlightFits
from analysis.gap.cause import NONE_TESTED, SMALLEST_P, Cause, Structure
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.null_distribution import chance_of_misfit
from ovines.robust import residual_sd

# A lens residual of 0.05 mm over sharp markers (5 um) leaves a misfit of 2.4 (practice-05); where the cameras show
# none, noise and placement left 1.13 at most in 30 series.
USUAL_MISFIT_UNDER_LENS, USUAL_MISFIT = 4.0, 1.5
# Flights that are left out of the fit for their misfit: so many of them hide an impact (1 % in six series of the blind
# plant), more than so many with chance like this are a law that is missing (one in six where the floor is grooved).
LONG_FRAMES, USUAL_OUTLYING, MOST_OUTLYING, BY_CHANCE = 12, 0.02, 0.1, 0.01 / 4
# Flights misfitted by so many sds more than the usual one, this share of all at the least, that follow on each other: a
# hidden impact bends one, what happens once in a run (somebody knocks against the table) several.
BENT_SD, LEAST_IN_TURN, FEWEST_FLIGHTS = 5.0, 0.01, 20
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
        return [unfitted("misfit of the flights", excess, usual, "times the noise's variance", p)]
    # A few flights that nothing fits hide an impact or follow a wrong track, and are left out; many are a law missing.
    outlying, flights = outlying_flights(flight.fits)
    share = outlying / max(flights, 1)
    p = float(max(bdtrc(outlying - 1, flights, USUAL_OUTLYING), SMALLEST_P))
    if share > MOST_OUTLYING and p < BY_CHANCE:
        return [unfitted("flights that the law does not fit", share, MOST_OUTLYING, "of the flights", p)]
    share, p = in_turn(bent_flights(flight.fits))
    if share > LEAST_IN_TURN and p < BY_CHANCE:
        return [unfitted("flights one after the other", share, LEAST_IN_TURN, "of the flights", p)]
    return []


def unfitted(what: str, size: float, usual: float, unit: str, p: float) -> Structure:
    """What is left of flights that goes with nothing: ``what`` of them, its ``size`` and what is ``usual``."""
    words = f"{NONE_TESTED} ({what})"
    return Structure("flight", "free flight", "x", words, size / usual, 0.0, size, unit, p)


def bent_flights(fits: Sequence[FlightFits]) -> list[NDArray[np.bool_]]:
    """Which of each run's flights that count are misfitted by more than :data:`BENT_SD` than the usual one: of the
    noise, or of the scatter of the flights where that is larger; none of too few flights."""
    counted = [[(fit.misfit[k] / fit.freedom[k], fit.freedom[k]) for k in _counted(fit)] for fit in fits]
    every = np.array([one for run in counted for one in run]).reshape(-1, 2)
    if len(every) < FEWEST_FLIGHTS:
        return [np.zeros(len(run), bool) for run in counted]
    ratio, freedom = every.T
    usual = float(np.median(ratio))
    off = (ratio / usual - 1) * np.sqrt(freedom / 2)
    bent = off > BENT_SD * max(residual_sd(off - np.median(off)), 1.0)
    return np.split(bent, np.cumsum([len(run) for run in counted])[:-1])


def in_turn(runs: Sequence[NDArray[np.bool_]]) -> tuple[float, float]:
    """Of the flights of ``runs`` that are marked, those that follow on another one as a share of all flights, and how
    often marks that fall anywhere in their runs follow on each other so often (a count of blocks, exactly: Wald and
    Wolfowitz 1940)."""
    flights = sum(len(run) for run in runs)
    in_blocks = sum(int(np.count_nonzero(run & _beside(run))) for run in runs)
    following = sum(sum(bool(a and b) for a, b in pairwise(run)) for run in runs)
    chances = np.ones(1)
    for run in runs:
        chances = np.convolve(chances, _following_by_chance(len(run), int(np.count_nonzero(run))))
    return in_blocks / max(flights, 1), float(max(chances[following:].sum(), SMALLEST_P))


def _beside(marked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which have a marked one before or after them."""
    padded = np.pad(marked, 1)
    return np.asarray(padded[:-2] | padded[2:], bool)


def _following_by_chance(count: int, marked: int) -> NDArray[np.float64]:
    """How often 0, 1, ... of so many ``marked`` among a ``count`` follow on another one, wherever they fall."""
    if not marked:
        return np.ones(1)
    blocks = range(marked, 0, -1)
    ways = [comb(marked - 1, b - 1) * comb(count - marked + 1, b) for b in blocks]
    return np.array(ways, float) / comb(count, marked)


def _counted(fit: FlightFits) -> list[int]:
    """Flights of :data:`LONG_FRAMES` frames and more that move."""
    return [
        k
        for k, flight in enumerate(fit.flights)
        if flight.last - flight.first + 1 >= LONG_FRAMES and fit.freedom[k] > 0 and not fit.rests(k)
    ]


def outlying_flights(fits: Sequence[FlightFits]) -> tuple[int, int]:
    """How many of the flights that count are misfitted by so much more than the usual one that no fit heeds them, and
    how many there are."""
    ratios = [fit.misfit[k] / fit.freedom[k] for fit in fits for k in _counted(fit)]
    if not ratios:
        return 0, 0
    limit = OUTLYING_FLIGHT * max(float(np.median(ratios)), 1.0)
    return int(np.count_nonzero(np.array(ratios) > limit)), len(ratios)
