"""Products that no list holds: a form that was found, times one quantity more.

A dictionary of all products of two and three quantities would hold chance's as well; what a form already explains is a
better guide to what multiplies it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from analysis.gap.laws.dictionary.candidate import Candidate, waves, ways
from analysis.gap.laws.dictionary.parts import RigScales
from ovines.core.laws.terms import Factor, Term
from ovines.core.laws.words import MOST_FACTORS

# Terms of a product at the most; range beside the wall over the contact radius and time over the usual flight of what
# fades.
MOST_TERMS, RANGE, TIME = 4, 0.12, 0.25


@dataclass(frozen=True)
class Multiplier:
    """Factors that a form may be multiplied by, each giving terms of its own; ``name`` of what they follow."""

    name: str
    factors: tuple[Factor, ...]


def of_flights(scales: RigScales) -> list[Multiplier]:
    """What a form of the flights may be multiplied by."""
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
        Multiplier("the place in the Host", ways("along_host")),
        *(_along(quantity) for quantity in ("sliding_along", "host_acceleration_along", "host_velocity_along")),
        *(_wave(quantity) for quantity in ("phase", "azimuth", "angle", "body_angle", "sliding_direction")),
    ]


def of_impacts() -> list[Multiplier]:
    """What a form of the impacts' laws, or of the wall, may be multiplied by."""
    return [
        _one("the approach speed", Factor("approach")),
        _one("the slip", Factor("slip", "absolute_power")),
        _one("the sense of slip", Factor("slip", "sign")),
        _one("the spin", Factor("spin", "absolute_power")),
        _one("the sense of spin", Factor("spin", "sign")),
        _one("the centre's speed along the wall", Factor("passing", "absolute_power")),
        _one("the wall's own speed", Factor("wall_speed")),
        _one("the Host's acceleration outwards", Factor("host_acceleration_outwards")),
        _one("the approach speed of the contact before", Factor("last_approach")),
        _one("time", Factor("time")),
        _one("the run", Factor("run")),
        _one("the wall alone", Factor("at_cylinder", "below", 1.0, 0.5)),
        _one("the cylinder alone", Factor("at_cylinder")),
        *(_along(quantity) for quantity in ("host_acceleration_along", "host_velocity_along")),
        *(_wave(quantity) for quantity in ("azimuth", "body_angle", "phase")),
    ]


def products(candidate: Candidate, multipliers: Sequence[Multiplier]) -> list[Candidate]:
    """The candidate times each of the multipliers, where that is still a short formula of another form."""
    followed = {factor.quantity for term in candidate.terms for factor in term.factors}
    most = max(len(term.factors) for term in candidate.terms)
    return [
        _times(candidate, one)
        for one in multipliers
        if most < MOST_FACTORS
        and len(candidate.terms) * len(one.factors) <= MOST_TERMS
        and not followed & {factor.quantity for factor in one.factors}
    ]


def _times(candidate: Candidate, one: Multiplier) -> Candidate:
    def make(*numbers: float) -> tuple[Term, ...]:
        terms = candidate.make(*numbers)
        return tuple(replace(term, factors=(*term.factors, factor)) for factor in one.factors for term in terms)

    return replace(candidate, name=f"{candidate.name}, times {one.name}", make=make)


def _one(name: str, factor: Factor) -> Multiplier:
    return Multiplier(name, (factor,))


def _along(quantity: str) -> Multiplier:
    return Multiplier(quantity.replace("_", " "), ways(quantity))


def _wave(quantity: str) -> Multiplier:
    return Multiplier(f"the {quantity.replace('_', ' ')}", waves(quantity))
