"""Laws that are effects of the library have their names, by their form alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.gap.cause import Cause, Structure
from analysis.gap.ladder import _beyond_held, run_ladder, stated_effects
from analysis.gap.laws.choice.search import measured
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.named_laws import effect_of_restitution
from analysis.gap.selection.flight_steps import select_flight_effects
from analysis.gap.written_laws import write_laws
from ovines.core.effects import EFFECTS
from ovines.core.effects.law_form import FactorForm, LawForm
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.laws.words import KNOWN_SIZE
from tests.gap.conftest import brought, laws_and_ladder


def test_every_effect_that_is_a_law_is_one_that_the_search_can_find():
    """Else the diagnosis would never name it."""
    scales, known = RigScales(0.04, 1.6, 0.04, 1.2, 69.0, 100.0), np.full((9, KNOWN_SIZE), 0.02)
    terms = [term for one in (*flight_candidates(scales), *law_candidates(known)) for term in one.terms]
    as_laws = [effect for effect in EFFECTS.values() if effect.by_law]
    assert as_laws
    for effect in as_laws:
        assert all(any(form.is_form_of(term) for term in terms) for form in effect.forms), effect.name


def test_a_form_tells_its_parameters_and_writes_them():
    """There and back; what follows the same by another function is covered only where that says so."""
    factor = FactorForm("since", "exponential", scale="decay_s", zero="from_s")
    form = LawForm("fixed_direction", (factor,), "push", direction="direction_rad", named=(0.0, 5.0))
    values = {"decay_s": 0.02, "from_s": 0.1, "push": 2.0, "direction_rad": 0.4}
    term = form.term(values)
    assert term == Term("fixed_direction", 2.0, (Factor("since", "exponential", 1.0, 0.02, 0.1),), x=0.4)
    assert form.parameters(term) == values
    assert form.is_named(term) and not form.is_named(replace(term, coefficient=-2.0))
    linear = replace(term, factors=(Factor("since"),))
    assert not form.covers(linear) and replace(form, by_any_function=True).covers(linear)
    assert not replace(form, by_any_function=True).covers(replace(linear, target="swirl"))


def restitution(*factors):
    """One term a factor."""
    return WrittenLaw(tuple(Term("restitution", -0.01, (one,)) for one in factors))


@pytest.mark.parametrize(
    ("law", "effect"),
    [
        (restitution(Factor("run")), "restitution_drift"),
        (restitution(Factor("time"), Factor("run")), "restitution_drift"),
        (restitution(Factor("azimuth", "cosine", x=0.4)), "direction_dependent_restitution"),
        (restitution(Factor("approach", "exponential", 1.0, 0.8)), "speed_dependent_restitution"),
        (restitution(Factor("run"), Factor("approach", "exponential", 1.0, 0.8)), None),
        (restitution(Factor("azimuth", "cosine", 2.0)), None),
        (restitution(Factor("approach")), None),
        (WrittenLaw((Term("wall_friction", 0.1, (Factor("run"),)),)), None),
        (WrittenLaw((Term("restitution", 0.1, (Factor("run"), Factor("approach"))),)), None),
    ],
)
def test_a_law_of_the_restitution_is_an_effect_by_its_form(law, effect):
    """No other target, no product, no other order."""
    assert effect_of_restitution(law) == effect


@pytest.mark.further
def test_a_drift_that_gains_less_than_a_name_must_is_named_by_its_law(tmp_path, without_flight_laws):
    """Six runs that were `unknown`, with the drift's own formula; in view, no blind result."""
    made = make_series("restitution_drift", 0.35, np.random.default_rng(12), runs=6, noise="white")
    series = brought(made, tmp_path / "series")
    ladder = run_ladder(series, np.random.default_rng(0))
    assert ladder.causes == ()  # by its gain alone
    laws, ladder = write_laws(ladder, np.random.default_rng(0))
    assert laws == () and [cause.effect for cause in ladder.causes] == ["restitution_drift"]
    assert ladder.structure == ()
    ((_, truth),) = made.truth["parameters"]["restitution_drift"].items()
    value, sd = ladder.causes[0].parameters["relative_per_run"]
    assert abs(value - truth) < 4 * sd


@pytest.mark.further
def test_a_rocking_beside_a_wrong_inertia_has_its_name(loaded):
    """The inertia, judged by flights that lacked the rocking, left a torque that stood in the law beside it: unknown,
    with the rocking's own formula.  Beside the rocking the disk is asked anew."""
    _, series = loaded("inertia_error+nes_rocking", 0.8, 4, runs=3)
    true = {"ratio": 0.8844, "relative": -0.5053, "decay_s": 0.02333}
    laws, ladder = laws_and_ladder(series)
    assert laws == () and ladder.structure == ()
    named = {cause.effect: cause.parameters for cause in ladder.causes}
    assert set(named) == {"nes_rocking", "inertia_error"}
    for name, (value, sd) in (named["nes_rocking"] | named["inertia_error"]).items():
        assert abs(value - true[name]) < 3 * sd
    assert named["inertia_error"]["ratio"][1] < 0.01
    assert ladder.flights.nominal.fits[0].run.law.shape[0] == 0 < ladder.flights.fitted.fits[0].run.law.shape[0]


@pytest.mark.parametrize(("strengths", "stay"), [((1.8,), ()), ((6.5, 1.8), (6.5,)), ((7.0,), (7.0,))])
def test_what_a_named_law_leaves_of_itself_is_not_left(quiet, strengths, stay):
    """A tenth of it beyond what is negligible: a rocking in contacts that last left 0.03 of itself (in view)."""
    cause = Cause("nes_rocking", "flight", {}, 54.0, 1e4, "x", "free flight")
    left = tuple(Structure("flight", "free flight", "x", "something", s, 100.0, 0.1, "m/s^2", 1e-6) for s in strengths)
    steps = _beyond_held(replace(quiet.flights, structure=left, left_p=1e-6), cause)
    assert tuple(one.strength for one in steps.structure) == stay
    assert steps.left_p == (1e-6 if stay else 1.0)


@pytest.mark.further
def test_a_law_after_blows_is_tried_as_a_rocking_too(loaded):
    """Beside its other parts and by itself; not where it is one, or gains far more than one."""
    _, series = loaded("nes_rocking", 0.9, 4, runs=2)
    steps = select_flight_effects(series, stated_effects(series), frozenset(), False, np.random.default_rng(0))
    search = FlightSearch.of(series.runs, steps.named, np.random.default_rng(0))
    by_name = {one.name: one for one in search.listed.candidates}
    rings, rocks = by_name["friction that rings after an impact"], by_name["friction after an impact"]
    other = by_name["friction with the radius"]

    def found(*parts):
        return measured(search.rows.problem, search.rows.columns, parts, 1e-9, (), search.rows.problem.excess)

    wholes = [[part.name for part in one.parts] for one in search.by_name(found(rings, other))]
    assert wholes == [[rocks.name, other.name], [rocks.name]]
    assert [[part.name for part in one.parts] for one in search.by_name(found(rings))] == [[rocks.name]]
    assert search.by_name(found(rocks, other)) == []
    assert search.by_name(replace(found(rings), gain=1e9)) == []
    none = search.leaving_out([rocks.name])
    assert none.by_name(found(rings)) == []


@pytest.mark.further
def test_what_acts_beside_a_rocking_has_its_formula(loaded):
    """Both stood in one formula of two parts, and the rocking had no name; held alone it leaves the other's."""
    _, series = loaded("nes_rocking+unknown_compass_needle", 0.8, 5, runs=2)
    true = {"relative": -0.540406, "decay_s": 0.0173102}
    (law,), ladder = laws_and_ladder(series)
    (cause,) = ladder.causes
    for name, (value, sd) in cause.parameters.items():
        assert abs(value - true[name]) < 3 * sd < 0.1 * abs(value), name
    (term,) = law.law.terms
    assert (term.target, term.factors[0].quantity) == ("spin", "angle") and law.closed > 0.99
    assert abs(term.coefficient / 241.803 - 1) < 0.01
    assert [one.stage for one in ladder.structure] == ["flight"]
