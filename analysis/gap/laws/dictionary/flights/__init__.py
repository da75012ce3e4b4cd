"""Everything that a law of the flights may be."""

from __future__ import annotations

from analysis.gap.laws.dictionary.between_runs import of_flights_between
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.flights.way import way_candidates
from analysis.gap.laws.dictionary.forces import force_candidates, torque_candidates
from analysis.gap.laws.dictionary.friction import friction_candidates
from analysis.gap.laws.dictionary.modulated import modulated
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.dictionary.places import place_candidates
from analysis.gap.laws.dictionary.ring import ring_candidates
from analysis.gap.laws.dictionary.uneven import uneven_candidates


def flight_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate for a force, a torque or a change of the floor's friction."""
    return [
        *modulated(scales),
        *force_candidates(scales),
        *place_candidates(scales),
        *friction_candidates(scales),
        *ring_candidates(scales),
        *uneven_candidates(scales),
        *of_flights_between(scales),
        *torque_candidates(scales),
        *way_candidates(scales),
    ]
