"""Products that no list holds: a form that was found, times one quantity more.

A dictionary of all products of two and three quantities would hold chance's as well; what a form already explains is a
better guide to what multiplies it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.modulated import WEARS, Modulator, all_with_scale, fixed, settling, with_scale
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.uneven import evenly
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term
from ovines.core.laws.words import MOST_FACTORS

Array = NDArray[np.float64]
# Terms of a product at the most; range beside the wall over the contact radius and time over the usual flight of what
# fades.
MOST_TERMS, RANGE, TIME = 4, 0.12, 0.25
# Of impacts: times over the longest run, and over the usual time between impacts, in which something fades.
FADES, REMEMBERED = (0.1, 0.3, 0.6), (0.3, 1.0)
# Times over the longest run in which what a form is at first comes to what it is at last.
SETTLING = (0.1, 0.3)


def of_flights(scales: RigScales) -> list[Modulator]:
    """What a form of the flights may be multiplied by: quantities as they are, and all that makes a carrier of the
    dictionary more or less by a scale of its own."""
    return [
        _one("the radius", Factor("radius")),
        _one("the gap", Factor("gap", "exponential", 1.0, RANGE * scales.radius_m)),
        _one("the speed", Factor("speed")),
        _one("the sliding speed", Factor("sliding_speed")),
        _one("the spin", Factor("spin", "absolute_power")),
        _one("the sense of spin", Factor("spin", "sign")),
        _one("time", Factor("time")),
        _one("the run", Factor("run")),
        _one("the time since an impact", Factor("since", "exponential", 1.0, TIME * scales.flight_s)),
        _one("the Host's speed", Factor("host_speed")),
        _one("the size of the Host's acceleration", Factor("host_acceleration")),
        _one("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
        _one("the speed outwards", Factor("radial_speed")),
        _one("the speed around", Factor("circling_speed")),
        fixed("times the place in the Host", *((way,) for way in ways("along_host"))),
        *(_along(quantity) for quantity in ("sliding_along", "host_acceleration_along", "host_velocity_along")),
        *(_wave(quantity) for quantity in ("phase", "azimuth", "angle", "body_angle", "sliding_direction")),
        *all_with_scale(scales),
        fixed("changing with the run", (), (Factor("run"),)),
        fixed("changing with the time", (), (Factor("time"),)),
        settling("settling in the run", ("time", "exponential", 1.0), [share * scales.run_s for share in SETTLING]),
        settling("settling with the blows", ("blows", "exponential", 1.0), WEARS),
        *(evenly(quantity, order) for quantity in ("azimuth", "body_angle") for order in (1.0, 2.0)),
    ]


def of_impacts(known: Array) -> list[Modulator]:
    """What a form of the impacts' laws, or of the wall, may be multiplied by; ``known`` (K, KNOWN_SIZE) of the
    impacts."""
    since, run_s = known[:, W.SINCE], float(np.ptp(known[:, W.TIME])) if len(known) else 0.0
    usual_s = float(np.median(since[since < 0.5 * W.LONG_AGO_S])) if np.any(since < 0.5 * W.LONG_AGO_S) else 0.0
    return [
        _one("the approach speed", Factor("approach")),
        _one("the inverse approach speed", Factor("approach", "absolute_power", -1.0)),
        _one("the slip", Factor("slip", "absolute_power")),
        _one("the sense of slip", Factor("slip", "sign")),
        _one("the spin", Factor("spin", "absolute_power")),
        _one("the sense of spin", Factor("spin", "sign")),
        _one("the centre's speed along the wall", Factor("passing", "absolute_power")),
        _one("the wall's own speed", Factor("wall_speed")),
        _one("the wall's own acceleration", Factor("wall_acceleration")),
        _one("the approach speed of the contact before", Factor("last_approach")),
        _one("time", Factor("time")),
        _one("the run", Factor("run")),
        _one("the wall alone", Factor("at_cylinder", "below", 1.0, 0.5)),
        _one("the cylinder alone", Factor("at_cylinder")),
        *(_along(quantity) for quantity in ("host_acceleration_along", "host_velocity_along")),
        *(_wave(quantity) for quantity in ("azimuth", "body_angle", "phase")),
        with_scale("that settles in the run", ("time", "exponential", 1.0), [share * run_s for share in FADES]),
        with_scale("after an impact", ("since", "exponential", 1.0), [share * usual_s for share in REMEMBERED]),
        fixed("changing with the run", (), (Factor("run"),)),
        fixed("changing with the time", (), (Factor("time"),)),
        *(evenly(quantity) for quantity in ("azimuth", "body_angle")),
    ]


def products(candidate: Candidate, multipliers: Sequence[Modulator]) -> list[Candidate]:
    """The candidate times each of the multipliers, from all its starts, where that is still a short formula of another
    form."""
    return [product for one in multipliers for product in _times(candidate, one)]


def _times(candidate: Candidate, one: Modulator) -> Iterator[Candidate]:
    if not one.starts:
        return
    own, columns = {factor.quantity for term in candidate.terms for factor in term.factors}, one.make(*one.starts[0][0])
    most = max(len(term.factors) for term in candidate.terms) + max(len(factors) for factors in columns)
    followed = own & {factor.quantity for factors in columns for factor in factors}
    if most > MOST_FACTORS or len(candidate.terms) * len(columns) > MOST_TERMS or followed:
        return
    make = partial(_multiplied, candidate, one)
    positive = (*candidate.positive, *(False,) * (len(candidate.numbers) - len(candidate.positive)), *one.positive)
    for numbers, steps in one.starts:
        yield replace(
            candidate,
            name=f"{candidate.name}, {one.name}",
            make=make,
            numbers=(*candidate.numbers, *numbers),
            steps=(*candidate.steps, *steps),
            positive=positive,
        )


def _multiplied(candidate: Candidate, one: Modulator, *numbers: float) -> tuple[Term, ...]:
    count = len(candidate.numbers)
    terms, products = candidate.make(*numbers[:count]), one.make(*numbers[count:])
    return tuple(replace(term, factors=(*term.factors, *factors)) for factors in products for term in terms)


def _one(name: str, factor: Factor) -> Modulator:
    return fixed(f"times {name}", (factor,))


def _along(quantity: str) -> Modulator:
    return fixed(f"times {quantity.replace('_', ' ')}", *((way,) for way in ways(quantity)))


def _wave(quantity: str) -> Modulator:
    return fixed(f"times the {quantity.replace('_', ' ')}", *((wave,) for wave in waves(quantity)))
