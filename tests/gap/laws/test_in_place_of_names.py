"""A name that takes nearly the whole of another cause gives way to a formula that runs held out want more; one that is
the cause does not.  The plant's causes, in view: no blind result."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import columns_of
from analysis.flights.fit import SHARED
from analysis.gap.laws import flight_law
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.own_forms import is_own_form
from analysis.gap.laws.flight_rows import flight_regression, regression_of
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.instead import flights
from analysis.gap.laws.instead.flights import flight_law_beyond
from analysis.gap.laws.instead.impacts import _own_part, restitution_law_instead
from analysis.gap.laws.instead.margins import OUTDOES
from analysis.gap.laws.instead.wall import _instead
from analysis.gap.laws.regression.problem import held_out_squares
from analysis.gap.selection.flight_candidates import gain_of
from analysis.gap.selection.flight_causes import term_cause
from analysis.gap.selection.flight_steps import first_flights, select_flight_effects
from analysis.gap.selection.flights.fit import fit, prior_of
from analysis.gap.selection.flights.model import run_places, with_free
from analysis.gap.selection.flights.terms import EFFECT_TERMS
from analysis.gap.selection.flights_beside_law import named_terms_of
from analysis.gap.selection.impact_steps import select_impact_effects
from ovines.core.laws.formula import as_text
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from tests.gap.conftest import laws_and_ladder
from tests.gap.laws.test_memory_laws import EFFECTS, quantities


def named_flights(series):
    """The flights' steps of a series, and the search beside their names."""
    rng = np.random.default_rng(0)
    steps = select_flight_effects(series, EFFECTS, frozenset(), False, rng)
    return steps, FlightSearch.of(series.runs, steps.named, rng)


@pytest.mark.further
def test_a_screw_that_backs_out_is_no_drift(loaded, without_flight_laws):
    """One side of the wall softens from run to run; the mean of it is a drift, which leaves the rest too faint for
    chance to be ruled out."""
    _, series = loaded("unknown_backed_screw", 0.6, 5, runs=4)
    laws, ladder = laws_and_ladder(series)
    (law,) = (law for law in laws if law.law.stage == "impact")
    assert ladder.causes == () and {one.stage for one in ladder.structure} == {"impact"}
    assert ("restitution", ["azimuth", "run"]) in quantities(law), as_text(law.law)
    assert law.closed > 0.8


@pytest.mark.further
@pytest.mark.parametrize(
    "name", ["restitution_drift", "direction_dependent_restitution", "speed_dependent_restitution"]
)
def test_no_formula_says_more_of_the_restitution_than_the_true_name(loaded, name):
    _, series = loaded(name, 1.0, 3, runs=3)
    rng = np.random.default_rng(0)
    flights = first_flights(series, EFFECTS)
    steps = select_impact_effects(flights, list(EFFECTS), frozenset(), False, rng)
    assert name in {cause.effect for cause in steps.causes}
    assert restitution_law_instead(None, steps, flights.fits, series.frame, rng) is None


def test_what_a_formula_says_of_the_spin_says_nothing_against_a_name_of_the_restitution():
    """Of its terms and numbers only those of the restitution count: a drift had lost to a formula by what its other
    part said of the spin."""
    drift, side = Term("restitution", 0.1, (Factor("run"),)), Term("restitution", 0.1, (Factor("azimuth", "cosine"),))
    spin = Term("spin_added", 0.02, (Factor("approach", "exponential", 1.0, 0.5),))
    numbers = dict.fromkeys(("coefficient_1", "coefficient_2", "coefficient_3", "azimuth_rad_3", "approach_scale_2"))
    law = SimpleNamespace(rig_law=WrittenLaw((drift, spin, side)), numbers=numbers)
    assert _own_part(law) == ([drift, side], 3)
    assert _own_part(None) == ([], 0)


@pytest.mark.parametrize(
    ("term", "own"),
    [
        (Term("floor_friction", 0.1, (Factor("run"),)), True),
        (Term("floor_friction", 0.1, (Factor("run", "exponential", 1.0, 3.0),)), False),
        (Term("floor_friction", 0.1, (Factor("phase", "cosine"),)), True),
        (Term("along_velocity", -0.1, (Factor("speed", "power", 2.0),)), True),
        (Term("along_velocity", -0.1, (Factor("speed", "power", 3.0),)), False),
        (Term("restitution", 0.1, (Factor("approach", "exponential", 1.0, 0.5),)), True),
        (Term("restitution", 0.1, (Factor("approach"),)), False),
        (Term("fixed_direction", 0.1, x=0.3), True),
    ],
)
def test_a_name_has_its_function_not_only_its_quantity(term, own):
    """A friction that settles over the runs is no drift that goes on, a straight loss is none that ends at a speed."""
    assert is_own_form(Candidate("asked", lambda: (term,))) is own


@pytest.mark.further
def test_a_bench_that_warms_up_is_no_drift(loaded):
    """It had been a drift by time and run: the exponential was among the forms that are the name's own."""
    truth, series = loaded("unknown_warming_bench", 0.6, 3, runs=6)
    (law,), ladder = laws_and_ladder(series)
    assert ladder.causes == () and quantities(law) == [("floor_friction", ["run"])], as_text(law.law)
    settled, sd, _ = law.numbers["run_scale"]
    assert abs(settled - truth["runs"]) < 3 * sd + 0.15 * truth["runs"]


@pytest.mark.further
def test_what_dries_in_runs_of_unlike_lengths_is_no_drift(loaded):
    """It is a formula of the time, with its size."""
    truth, series = loaded("unknown_damp_face", 1.1, 8, runs=4)
    lengths_s = [float(np.ptp(run.data.time_s)) for run in series.runs]
    assert max(lengths_s) > 1.2 * min(lengths_s)
    (law,), ladder = laws_and_ladder(series)
    assert ladder.causes == () and quantities(law) == [("floor_friction", ["time"])], as_text(law.law)
    dried_s, sd, _ = law.numbers["time_scale_s"]
    assert abs(dried_s - truth["damp_s"]) < 3 * sd + 0.1 * truth["damp_s"]


@pytest.mark.further
def test_a_drift_beside_a_law_counts_from_each_runs_start(loaded):
    """Its column is what the fit's own drift changes; about the runs' middles it had left each run of another length a
    friction of its own, in which the time was no formula (case 021 of the thirty-fifth trial)."""
    _, series = loaded("unknown_damp_face", 1.1, 8, runs=4)
    steps, _ = named_flights(series)
    fitted, step = steps.named, 1e-3
    columns = columns_of([name for name in fitted.columns if name in SHARED])
    assert INDEX["drift"] in columns
    prior = prior_of([SHARED[c] for c in columns], fitted.fits[0].run.contact_radius_m)
    places = run_places([one.run for one in fitted.fits])

    def residual(change):
        p = fitted.model.parameters.copy()
        p[INDEX["drift"]] += change
        model = replace(fitted.model, parameters=p)
        fits = [replace(one, parameters=model.of_run(at)) for one, at in zip(fitted.fits, places, strict=True)]
        return regression_of(fits, fitted.noise, columns, prior).problem.residual

    slope = (residual(-step) - residual(step)) / (2 * step)
    column = flight_regression(fitted).problem.nuisances[:, list(columns).index(INDEX["drift"])]
    # To first order in the drift itself (0.064); about the runs' middles it had been 0.36 off.
    assert np.linalg.norm(column - slope) < 0.1 * np.linalg.norm(slope)


@pytest.mark.further
def test_a_loss_straight_with_the_speed_gives_a_name_no_end(loaded, without_flight_laws):
    """What falls off beyond the measured speeds is a straight line to them, of one number fewer."""
    _, series = loaded("unknown_straight_loss", 0.9, 5, runs=5)
    (law,), ladder = laws_and_ladder(series)
    assert ladder.causes == () and quantities(law) == [("restitution", ["approach"])], as_text(law.law)
    assert law.law.terms[0].factors[0].function == "power"


@pytest.mark.parametrize(("gain", "unknowns", "instead"), [(155.6, 3, False), (158.6, 3, True), (158.6, 4, False)])
def test_a_dent_replaces_two_shapes_of_the_wall_only_where_it_is_as_good(gain, unknowns, instead):
    """An ellipse and lobes that are there had lost to a dent of 0.976 of their gain and one number less."""
    assert _instead(gain, 159.4, unknowns - 4) is instead


@pytest.mark.further
def test_a_name_that_runs_held_out_want_less_gives_way(loaded):
    """A drag that grows with the speed, named where it is the air's, which no name has here."""
    _, series = loaded("air_drag", 1.0, 3, runs=3)
    (viscous,) = (term for term in EFFECT_TERMS if term.name == "viscous_drag")
    steps = select_flight_effects(series, EFFECTS, frozenset({"air_drag"}), False, np.random.default_rng(0))
    named = fit(series.runs, with_free(steps.named.model, viscous.columns))
    cause = term_cause(gain_of(named, viscous, steps.units), named, series, steps.units)
    steps = replace(steps, named=named, causes=(cause,), structure=())
    search = FlightSearch.of(series.runs, named, np.random.default_rng(0))
    assert search.outdone(viscous.columns, is_own_form)[0] > OUTDOES
    law, fewer = flight_law_beyond(search, steps, series.frame, np.random.default_rng(0), 0.0)
    assert named_terms_of(fewer) == [] and law.closed > 0.8, as_text(law.law)


@pytest.mark.further
@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("air_drag", ["air"]),
        ("table_tilt", ["tilt_x", "tilt_y"]),
        ("friction_drift", ["drift", "drift_run"]),
    ],
)
def test_no_formula_says_more_of_flights_than_the_true_name(loaded, name, columns):
    _, series = loaded(name, 1.0, 3, runs=3)
    steps, search = named_flights(series)
    assert [term.name for term in named_terms_of(steps)] == [name]
    assert search.outdone(columns, is_own_form)[0] < 0
    assert flight_law_beyond(search, steps, series.frame, np.random.default_rng(0), 0.0) is None


@pytest.mark.further
def test_a_formula_that_promises_much_less_than_names_and_law_is_not_fitted(loaded, monkeypatch):
    """Air drag named, and a law beside it: no other form says nearly as much, and a fit in the equation of motion takes
    most of a diagnosis' time."""
    _, series = loaded("air_drag", 1.0, 3, runs=3)
    steps, search = named_flights(series)
    taken, own = search.without(["air"], is_own_form).rows.problem, search._columns(["air"])
    left = [float(held_out_squares(taken, columns).sum()) for columns in (own[:, :0], own)]
    assert search.said_by(["air"]) == pytest.approx(left[0] - left[1], rel=1e-6)
    push = Term("fixed_direction", 0.1, (Factor("phase", "cosine"),))
    assert search.said_by(["air"], [push]) > 0.99 * search.said_by(["air"])
    law = SimpleNamespace(rig_law=WrittenLaw((push,)), closed=1.0)
    least, said = flights._least_promised(search, ["air"], law), search.said_by(["air"], [push])
    assert 0.5 * said < least < said
    fitted = []
    monkeypatch.setattr(flight_law, "_best_law", lambda *given: fitted.append(given))
    rng = np.random.default_rng(0)
    assert flights._without(search, steps, named_terms_of(steps), series.frame, rng, law) is None and not fitted
    assert flights._without(search, steps, named_terms_of(steps), series.frame, rng) is None and fitted
