"""What remembers the way over the floor, goes in waves along it, or turns with how the disk slides and spins."""

from __future__ import annotations

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.flights.aside import aside_candidates
from analysis.gap.laws.dictionary.flights.memory import memory_candidates
from analysis.gap.laws.dictionary.flights.waves import wave_candidates
from analysis.gap.laws.dictionary.parts import RigScales


def way_candidates(scales: RigScales) -> list[Candidate]:
    """Every candidate of the way."""
    return [*memory_candidates(scales), *wave_candidates(scales), *aside_candidates(scales)]
