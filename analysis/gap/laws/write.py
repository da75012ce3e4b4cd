"""The laws of a diagnosis: one for each stage in which something is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from analysis.gap.ladder import Ladder
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE


def write_laws(ladder: Ladder, rng: np.random.Generator) -> tuple[tuple[LawFound, ...], Ladder]:
    """Laws for what is left in flights, impacts and the wall's shape, in this order, none where nothing is left or
    chance would find as much; and the ladder without the named effects that had imitated a part of a law.

    A law comes on top of what the named effects explain, and is asked of the same runs."""
    left = {one.stage for one in ladder.structure}
    runs, frame, impacts = ladder.series.runs, ladder.series.frame, ladder.impacts.fitted
    fits = ladder.flights.fitted.fits
    laws: list[LawFound | None] = []
    if "flight" in left:
        law, steps = find_flight_law(runs, ladder.flights, frame, rng)
        laws.append(law)
        gone = {c.effect for c in ladder.flights.causes} - {c.effect for c in steps.causes}
        causes = tuple(c for c in ladder.causes if c.effect not in gone)
        ladder = replace(ladder, flights=steps, causes=causes)
    if impacts is not None and "impact" in left:
        laws.append(find_impact_law(impacts, fits, ladder.impacts.restitution_terms, frame, rng))
    if impacts is not None and "geometry" in left:
        laws.append(find_wall_law(impacts, fits, frame, DISTANCE_NEGLIGIBLE * ladder.series.contact_radius_m, rng))
    return tuple(one for one in laws if one is not None), ladder
