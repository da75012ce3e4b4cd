"""The missing shape of the wall, or of the disk: how far its law closes the gap."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.laws.impact_law import find_wall_law
from analysis.gap.laws.search import LEVEL, LEVEL_WHERE_LEFT
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws.formula import as_text

EFFECTS = ("floor_friction", "spin_coupling")


@pytest.mark.parametrize("level", [LEVEL_WHERE_LEFT, LEVEL])
def test_an_oval_disk_is_written_and_closes_what_it_opened(loaded, level):
    """Its contact radius goes twice around the body; the scatter that it makes of the distances is no noise of them.
    Asked for as a diagnosis asks where a probe has found something (that the distances scatter), and where none has."""
    _, series = loaded("unknown_oval_disk", 1.0, 13)
    fits = first_flights(series, EFFECTS).fits
    rng = np.random.default_rng(0)
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(fit_impacts(fits), fits, series.frame, least_m, rng, level)
    assert law is not None
    (term,) = law.law.terms
    assert (term.target, term.factors[0].quantity, term.factors[0].order) == ("contact_radius", "body_angle", 2.0), (
        as_text(law.law)
    )
    shrinkage, low, high = law.shrinkage(rng)
    assert shrinkage == pytest.approx(1.0, abs=0.1)
    assert low > 0.8 and high < 1.2
