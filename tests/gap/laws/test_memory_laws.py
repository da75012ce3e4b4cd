"""Laws that follow the way to the wall, the ring's motion or the contact before, and steps of the wall: the plant's
causes that the dictionary was widened for.  In view, therefore no blind result."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.plant.wall.friction import WORKED_BLOWS
from analysis.blind.series import make_series
from analysis.gap.ladder import run_ladder
from analysis.gap.laws import flight_law as laws_of_flights
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.laws.instead.wall import wall_law_instead
from analysis.gap.selection.flight_steps import first_flights, select_flight_effects
from analysis.gap.selection.impact_steps import select_impact_effects
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.selection.impacts.tangential import tangential_gains
from analysis.gap.selection.inertia import inertia_step, wall_between
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws.formula import as_text
from tests.gap.conftest import brought, laws_and_ladder

EFFECTS = ("floor_friction", "spin_coupling")


def made_series(folder, kind, severity, seed, runs=4):
    """The plant's series, and its truth."""
    made = make_series(kind, severity, np.random.default_rng(seed), runs=runs, noise="white")
    return brought(made, folder / "series"), made.truth["parameters"][kind]


def quantities(law):
    """What the terms of a law act on, and what they follow."""
    return [(term.target, sorted(one.quantity for one in term.factors)) for term in law.law.terms]


def flight_law(series):
    """The law of the flights beside the effects that they ask for."""
    rng = np.random.default_rng(0)
    steps = select_flight_effects(series, EFFECTS, frozenset(), False, rng)
    return find_flight_law(series.runs, steps, series.frame, rng)[0]


@pytest.mark.further
def test_forms_that_flights_do_not_take_are_left_out_of_a_second_search(tmp_path, monkeypatch):
    """Not the first form nor its rivals, whose equation of motion finds no numbers: the next, and all in three."""
    series, _ = made_series(tmp_path, "unknown_polymer_floor", 1.0, 33, runs=2)
    usual, refused, asked = laws_of_flights.fitted_law, [], []

    def takes(runs, base, found):
        refused.append([one.name for one in found.parts])
        return None if len(asked) == 1 else usual(runs, base, found)

    def find(self, *rest):
        free = np.isfinite(self.listed.looked)
        asked.append({one.name for one, is_asked in zip(self.listed.candidates, free, strict=True) if is_asked})
        return looked(self, *rest)

    looked = FlightSearch.find
    monkeypatch.setattr(laws_of_flights, "fitted_law", takes)
    monkeypatch.setattr(FlightSearch, "find", find)
    law = flight_law(series)
    assert law is not None and law.closed > 0.5
    assert len(asked) == 2 and asked[1] < asked[0] and refused[0][0] in asked[0] - asked[1]
    monkeypatch.setattr(laws_of_flights, "fitted_law", lambda *rest: None)
    assert flight_law(series) is None and len(asked) == 4


@pytest.mark.further
def test_air_between_disk_and_wall_is_a_drag_of_the_way_to_it(tmp_path):
    """And no law of the impacts, as that the restitution follows the speed: they are asked between the flights that
    hold the law."""
    series, true = made_series(tmp_path, "unknown_air_cushion", 1.0, 32, runs=2)
    (law,), ladder = laws_and_ladder(series)
    assert quantities(law) == [("outwards", ["gap", "radial_speed"])], as_text(law.law)
    (term,) = law.law.terms
    assert abs(term.coefficient + true["cushion_per_s"]) < 4 * term.sd
    assert ladder.causes == ()
    assert law.closed > 0.9


@pytest.mark.further
def test_a_thread_of_glue_pulls_to_the_contact_before(tmp_path):
    """Up to its length, with its force."""
    series, true = made_series(tmp_path, "unknown_glue_thread", 0.6, 36, runs=1)
    law = flight_law(series)
    assert law is not None
    assert {target for target, _ in quantities(law)} == {"from_last_contact"}, as_text(law.law)
    force = sum(term.coefficient for term in law.law.terms)
    assert force == pytest.approx(-true["thread_m_per_s2"], rel=0.1)
    assert law.closed > 0.9


@pytest.mark.further
def test_a_ring_that_lies_where_the_last_blow_pushed_it(tmp_path):
    """Its radius follows how far the disk has turned around since."""
    series, _ = made_series(tmp_path, "unknown_loose_ring", 1.0, 33, runs=2)
    fits, least_m = first_flights(series, EFFECTS).fits, DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(fit_impacts(fits), fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    assert [one.quantity for one in term.factors] == ["contact_turn"], as_text(law.law)
    assert abs(np.cos(term.factors[0].x)) > 0.98  # outwards where the last blow was
    assert law.closed > 0.8


@pytest.mark.further
def test_a_step_of_the_wall_is_no_ellipse_with_lobes(tmp_path):
    """One formula instead of the names that make up its series."""
    series, true = made_series(tmp_path, "unknown_overlapping_strip", 1.0, 36, runs=2)
    rng = np.random.default_rng(0)
    flights = first_flights(series, EFFECTS)
    steps = select_impact_effects(flights, list(EFFECTS), frozenset(), False, rng)
    names = {cause.effect for cause in steps.causes}
    assert names & {"wall_ellipticity", "wall_lobes"}
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    found = wall_law_instead(steps, flights.fits, series.frame, least_m, rng)
    assert found is not None
    law, fewer = found
    (term,) = law.law.terms
    assert term.factors[0].function == "sawtooth", as_text(law.law)
    assert term.coefficient == pytest.approx(true["joint_m"], abs=max(4 * term.sd, 0.1 * abs(true["joint_m"])))
    assert not {cause.effect for cause in fewer.causes} & {"wall_ellipticity", "wall_lobes"}


@pytest.mark.further
def test_an_ellipse_is_no_law(tmp_path):
    """What a name says as well stays with its name."""
    made = make_series("wall_ellipticity", 1.0, np.random.default_rng(35), runs=2, noise="white")
    series = brought(made, tmp_path / "series")
    rng = np.random.default_rng(0)
    flights = first_flights(series, EFFECTS)
    steps = select_impact_effects(flights, list(EFFECTS), frozenset(), False, rng)
    assert "wall_ellipticity" in {cause.effect for cause in steps.causes}
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    assert wall_law_instead(steps, flights.fits, series.frame, least_m, rng) is None


@pytest.mark.further
def test_blows_that_resist_the_spin_are_no_inertia(tmp_path):
    """The law says what they take; the disk's inertia stays as stated."""
    series, _ = made_series(tmp_path, "unknown_rolling_resistance", 1.0, 37, runs=3)
    rng = np.random.default_rng(0)
    flights = first_flights(series, EFFECTS)
    assert not inertia_step(wall_between(flights), flights, series.runs[0].data.inertia_factor, 1.0).found
    steps = select_impact_effects(flights, list(EFFECTS), frozenset(), False, rng)
    law = find_impact_law(steps.fitted, flights.fits, steps.restitution_terms, series.frame, rng)
    assert law is not None
    # A slow spin is stopped, not turned round: by as much as the blow is hard, bent about nothing.
    term = law.law.terms[0]
    assert (term.target, term.factors[-1].quantity, term.factors[-1].function) == ("spin_added", "spin_left", "tanh")
    assert term.coefficient < 0 and law.closed > 0.95


def impact_fit(series):
    """The impacts between flights of the nominal model, and these flights."""
    fits = first_flights(series, EFFECTS).fits
    return fit_impacts(fits), fits


@pytest.mark.further
def test_a_band_that_shifts_as_it_is_struck(tmp_path):
    """Restitution by the place on the rim against the one struck before."""
    series, true = made_series(tmp_path, "unknown_shifted_band", 1.0, 51, runs=2)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    assert [one.quantity for one in term.factors] == ["rim_turn"], as_text(law.law)
    assert abs(term.coefficient - true["shifted"]) < 4 * term.sd
    assert law.closed > 0.8


@pytest.mark.further
def test_a_liner_that_each_blow_presses(tmp_path):
    """Its radius goes with the blows before, as the air comes back."""
    series, _ = made_series(tmp_path, "unknown_leaking_liner", 1.0, 53, runs=3)
    impacts, fits = impact_fit(series)
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(impacts, fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    assert law.law.terms[0].factors[0].quantity == "recent_blows", as_text(law.law)
    assert law.closed > 0.8


@pytest.mark.further
def test_a_pile_that_the_blow_before_has_combed(tmp_path):
    """Wall friction by whether the slip has the sense of the one before."""
    series, _ = made_series(tmp_path, "unknown_combed_pile", 1.0, 53, runs=6)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    assert (term.target, [one.quantity for one in term.factors]) == ("wall_friction", ["slip", "last_slip"])
    assert term.coefficient < 0


def test_rubber_that_blows_work_soft(tmp_path):
    """The first few impacts of a run alone tell it: a probe asks for them, and what a law explains of a few is not
    gross."""
    series, _ = made_series(tmp_path, "unknown_worked_rubber", 1.0, 5, runs=6)
    impacts, fits = impact_fit(series)
    probe = max(tangential_gains(impacts.data, impacts.law), key=lambda one: one.gain)
    assert (probe.name, probe.residual) == ("the first impacts of a run", "sticking")
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None and quantities(law) == [("tangential_restitution", ["blows"])]
    (term,) = law.law.terms
    assert term.factors[0].scale == pytest.approx(WORKED_BLOWS, rel=0.05) and law.closed > 0.95


@pytest.mark.further
def test_a_blow_that_is_turned_against_the_slip_is_no_wrong_inertia(loaded):
    """Impacts alone say an inertia of 1.2 to 1.4; the flights, which the floor turns, say the stated one.  The law is
    the plant's, a turn by a tangent that bends at 0.4 m/s.  A true inertia is no contradiction."""
    true, series = loaded("unknown_bulging_lining", 1.0, 3, runs=3)
    laws, ladder = laws_and_ladder(series)
    assert ladder.inertia.contradicted and not ladder.inertia.found
    assert "inertia_error" not in {cause.effect for cause in ladder.causes}
    (left,) = [one for one in ladder.structure if one.goes_with == "the tangential impulse"]
    assert (left.stage, left.coordinate) == ("impact", "spin")
    (term,) = [term for law in laws for term in law.rig_law.terms]
    assert term.target == "contact_normal"
    assert [(one.quantity, one.function) for one in term.factors] == [("slip", "tanh")]
    assert term.factors[0].scale == pytest.approx(0.4, rel=0.1)
    assert term.coefficient == pytest.approx(true["piled_rad"], rel=0.1)
    _, true = loaded("inertia_error", 1.0, 3, runs=3)
    step = run_ladder(true, np.random.default_rng(0)).inertia
    assert step.found and not step.contradicted
