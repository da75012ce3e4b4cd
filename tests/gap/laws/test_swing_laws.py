"""Laws of what blows set swinging or wear off, of a floor that swings, and of few impacts: the plant's causes that the
dictionary was widened for.  In view, therefore no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.cause import Structure
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws.formula import as_latex, as_text
from tests.gap.laws.test_memory_laws import flight_law, impact_fit, made_series, quantities


def test_a_ring_that_swings_on_its_feet_after_a_blow(tmp_path):
    """Its radius where it is struck next goes with what the blows before have set swinging, at its rate."""
    series, true = made_series(tmp_path, "unknown_nodding_ring", 1.0, 61, runs=3)  # two: by the draw
    impacts, fits = impact_fit(series)
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(impacts, fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    term = law.law.terms[0]
    assert [one.quantity for one in term.factors] == ["swing"], as_text(law.law)
    value, sd, unit = law.numbers["swinging_rad_per_s"]
    assert value == pytest.approx(true["nodding_rad_per_s"], abs=max(4 * sd, 0.01 * value)) and unit == "rad/s"
    assert law.closed > 0.9
    assert f"swing(at {value:.4g} rad/s" in as_text(law.law) and " S" in as_latex(law.law).replace(r"\,", " ")


@pytest.mark.further
def test_screws_that_each_blow_loosens(tmp_path):
    """Restitution by the number of blows that the run has had, not by its time."""
    series, _ = made_series(tmp_path, "unknown_loosening_screws", 1.0, 62, runs=3)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    assert law.law.terms[0].target == "restitution"
    assert [one.quantity for one in law.law.terms[0].factors] == ["blows"], as_text(law.law)
    assert law.closed > 0.8


@pytest.mark.further
def test_a_floor_that_swings_about_a_screw(tmp_path):
    """Friction is turned aside by the place against the screw, times the Host's velocity."""
    series, true = made_series(tmp_path, "unknown_swinging_floor", 0.8, 63, runs=2)
    law = flight_law(series)
    assert law is not None
    turned = ("across_sliding", ["host_velocity_along", "place_along_sliding", "sliding_speed"])
    assert quantities(law)[0] == turned, as_text(law.law)
    screw = np.array([true["swing_x_m"], true["swing_y_m"]])
    place = next(one for one in law.rig_law.terms[0].factors if one.quantity == "place_along_sliding")
    assert np.hypot(*(screw - (place.x, place.y))) < 0.25 * np.hypot(*screw)
    assert law.closed > 0.6


@pytest.mark.further
def test_of_few_impacts_a_probe_says_where_to_look(tmp_path):
    """A thousand formulas explain as much of them by chance; those that follow what the probe does, do not."""
    series, _ = made_series(tmp_path, "unknown_fibrous_lay", 0.4, 64, runs=2)
    impacts, fits = impact_fit(series)
    few = replace(impacts, data=impacts.data.part(np.arange(len(impacts.data)) < 26))
    probe = Structure("impact", "impact", "tangential", "the direction of slip", 5.0, 50.0, 0.1, "1", 1e-9)
    for left, found in (((), False), ((probe,), True)):
        law = find_impact_law(few, fits, (), series.frame, np.random.default_rng(0), 0.01, left)
        assert (law is not None) == found
        if law is not None:
            assert quantities(law) == [("tangential_restitution", ["slip"])], as_text(law.law)
