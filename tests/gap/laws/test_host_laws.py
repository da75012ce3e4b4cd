"""Laws that follow the Host's acceleration, the direction of sliding or a wall that rings, and forms that no list holds
until a found one is multiplied: the plant's causes that the dictionary was widened for.  In view, therefore no blind
result."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.dictionary.candidate import law_at, waves
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.dictionary.modulated import fixed, with_scale
from analysis.gap.laws.dictionary.parts import RigScales, plain
from analysis.gap.laws.dictionary.products import of_flights, of_impacts, products
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.selection.flight_steps import first_flights, select_flight_effects
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_text
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Factor, Term, rows_of
from tests.gap.laws.test_memory_laws import EFFECTS, made_series, quantities


@pytest.mark.further
def test_a_floor_that_pitches_presses_by_place_and_acceleration(tmp_path):
    """Of every series' causes the one with a product of three: friction, place, the Host's acceleration."""
    series, true = made_series(tmp_path, "unknown_pitching_floor", 1.0, 42, runs=2)
    rng = np.random.default_rng(0)
    steps = select_flight_effects(series, EFFECTS, frozenset(), False, rng)
    law, _ = find_flight_law(series.runs, steps, series.frame, rng)
    assert law is not None
    assert quantities(law) == [("floor_friction", ["host_acceleration_outwards", "radius"])], as_text(law.law)
    (term,) = law.law.terms
    stated = true["pitching"] / (series.contact_radius_m * 78.5)  # of 8 g at the contact radius
    assert abs(term.coefficient - stated) < max(4 * term.sd, 0.1 * abs(stated))
    assert law.closed > 0.9


def test_a_wall_that_rings_from_the_blow_before(tmp_path):
    """A wave of the time since, which dies out."""
    series, true = made_series(tmp_path, "unknown_ringing_wall", 1.0, 42, runs=2)
    flights = first_flights(series, EFFECTS)
    law = find_impact_law(fit_impacts(flights.fits), flights.fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    term = law.law.terms[0]
    assert (term.target, [one.quantity for one in term.factors]) == ("restitution", ["since", "since"])
    assert 1 / term.factors[1].scale == pytest.approx(true["ringing_rad_per_s"], rel=0.05)
    assert law.closed > 0.6


def test_a_ring_clamped_at_one_side_is_squashed_as_the_host_starts(tmp_path):
    """Twice around the wall, times the Host's acceleration."""
    series, _ = made_series(tmp_path, "unknown_squashed_ring", 1.0, 43, runs=2)
    fits, least_m = first_flights(series, EFFECTS).fits, DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(fit_impacts(fits), fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    along, around = law.law.terms[0].factors
    assert (along.quantity, around.quantity, around.order) == ("host_acceleration_along", "azimuth", 2.0), as_text(
        law.law
    )
    assert law.closed > 0.8


# One block a row, ten runs of forty blocks.
ROWS, RUNS = 400, 10


def rows_that_follow(values, rng):
    """A regression of ``values`` (M,) in noise of unit sd, a constant its nuisance."""
    return Regression(
        values + rng.normal(size=ROWS), np.ones((ROWS, 1)), np.zeros(1), np.arange(ROWS), np.arange(ROWS) % RUNS
    )


def test_a_product_that_no_list_holds_is_found_by_its_first_factor():
    """The price of looking keeps a plain form plain."""
    rng = np.random.default_rng(5)
    known = np.zeros((ROWS, W.KNOWN_SIZE))
    known[:, W.APPROACH], known[:, W.TIME] = rng.uniform(0.1, 1.0, ROWS), rng.uniform(0.0, 1.0, ROWS)
    known[:, [W.HX, W.HY]] = rng.normal(size=(ROWS, 2))

    def columns(terms):
        out = np.empty((ROWS, len(terms)))
        sizes(rows_of(terms), known, out)
        return out

    listed = [plain("approach", Term("restitution", 1.0, (Factor("approach"),)))]
    approach, time_s = known[:, W.APPROACH], known[:, W.TIME]
    for values, quantities_found in (
        (3.0 * approach, {"approach"}),
        (6.0 * approach * time_s, {"approach", "time"}),
    ):
        found, _ = find_law(
            rows_that_follow(values, rng), columns, listed, np.random.default_rng(0), multipliers=of_impacts(known)
        )
        assert {factor.quantity for term in found.terms for factor in term.factors} == quantities_found
        assert found.coefficients[0] == pytest.approx(3.0 if len(quantities_found) == 1 else 6.0, rel=0.2)


def test_products_are_short_and_follow_something_else():
    """Not the same quantity twice, no more factors and terms than a formula may have."""
    base = plain("friction", Term("floor_friction", 1.0, (Factor("radius"), Factor("speed"))))
    known = np.random.default_rng(1).uniform(0.1, 1.0, (50, W.KNOWN_SIZE))
    made = products(base, of_impacts(known))
    assert all(max(len(term.factors) for term in one.terms) == 3 for one in made)
    assert not any("passing" in one.name and len(one.terms) > 4 for one in made)
    assert products(base, [fixed("times the speed", (Factor("speed"),))]) == []
    full = plain("full", Term("floor_friction", 1.0, (Factor("radius"), Factor("speed"), Factor("time"))))
    assert products(full, of_impacts(known)) == []


def test_a_pair_along_two_directions_is_one_term_along_one():
    """a u_0 + b u_90 is one speed along the direction between."""
    pair = plain("way", *(Term("floor_friction", 1.0, (Factor("sliding_along", x=x),)) for x in (0.0, np.pi / 2)))
    (term,) = law_at((pair,), np.array([0.3, 0.4])).terms
    assert term.coefficient == pytest.approx(0.5) and term.factors[0].x == pytest.approx(np.arctan2(4, 3))


def test_multipliers_are_in_rig_units():
    """What fades does so within a share of the rig's own length and time."""
    small = of_flights(RigScales(0.04, 1.3, 0.06, 1.1, 70.0, 53.0))
    large = of_flights(RigScales(0.4, 13.0, 0.6, 11.0, 7.0, 5.3))
    lengths = ("gap", "since", "time", "speed", "sliding_speed", "last_left", "radius", "from_contact")
    for one, other in zip(small, large, strict=True):
        for (numbers, _), (larger, _) in zip(one.starts, other.starts, strict=True):
            pairs = zip(one.make(*numbers), other.make(*larger), strict=True)
            for a, b in ((a, b) for factors, others in pairs for a, b in zip(factors, others, strict=True)):
                times = 1.0 if a.scale == 1.0 else {**dict.fromkeys(lengths, 10.0), "spin": 0.1}.get(a.quantity, 1.0)
                assert b.scale == pytest.approx(times * a.scale)


def test_a_form_may_be_multiplied_by_what_fades():
    """A product has the numbers of the form and of what multiplies it: a place whose friction comes back in the run."""
    place = next(one for one in flight_candidates(RigScales(0.04, 1.0, 0.06, 1.0, 70.0, 50.0)) if "patch" in one.name)
    (fading, *_) = products(place, [with_scale("that settles in the run", ("time", "exponential", 1.0), [0.3])])
    assert fading.numbers == (*place.numbers, 0.3) and len(fading.steps) == len(fading.positive) == 4
    (term,) = fading.at((0.01, 0.02, 0.016, 0.5)).terms
    (alone,) = place.at((0.01, 0.02, 0.016)).terms
    assert term.factors == (*alone.factors, Factor("time", "exponential", 1.0, 0.5))


def test_a_rim_that_the_spin_lets_bulge_has_its_law():
    """Its middle is off by 0.3 mm at high spins, beside what an offset of the mass centre takes."""
    rng = np.random.default_rng(3)
    known = np.zeros((240, W.KNOWN_SIZE))
    known[:, W.SPIN] = rng.uniform(-150.0, 150.0, 240)
    known[:, W.APPROACH], known[:, W.SLIP] = rng.uniform(0.1, 1.0, 240), rng.normal(0.0, 0.5, 240)
    known[:, W.TIME], known[:, W.SINCE] = rng.uniform(0.0, 1.0, 240), rng.uniform(0.01, 0.1, 240)
    known[:, W.ANGLE], azimuth = rng.uniform(-np.pi, np.pi, (2, 240))
    known[:, W.X], known[:, W.Y] = 0.03 * np.cos(azimuth), 0.03 * np.sin(azimuth)
    known[:, W.HX], known[:, W.HY] = known[:, W.X], known[:, W.Y]

    def columns(terms):
        out = np.empty((240, len(terms)))
        sizes(rows_of(terms), known, out)
        return out / 2e-5

    body = columns([Term("contact_radius", 1.0, (wave,)) for wave in waves("body_angle")])
    grows = known[:, W.SPIN] ** 2 / (known[:, W.SPIN] ** 2 + 40.0**2)
    nuisances = np.column_stack([np.ones(240), body])
    residual = 3e-4 * grows * body[:, 0] + rng.normal(0.0, 1.0, 240)
    run = np.repeat(np.arange(6), 40)
    problem = Regression(residual, nuisances, np.zeros(3), np.arange(240) // 4, run)
    found, p = find_law(
        problem, columns, wall_candidates(known), np.random.default_rng(0), multipliers=of_impacts(known)
    )
    assert p < 1e-3
    followed = {factor.quantity for term in found.terms for factor in term.factors}
    assert followed == {"body_angle", "spin"} and len(found.parts) == 1
    assert found.parts[0].numbers == pytest.approx((40.0,), rel=0.2)


def test_no_form_of_the_wall_stands_twice():
    """A second one would be reported as a rival that the data cannot tell from the first."""
    known = np.random.default_rng(0).uniform(0.1, 1.0, (60, W.KNOWN_SIZE))
    forms = [frozenset(frozenset(term.factors) for term in one.terms) for one in wall_candidates(known)]
    assert len(forms) == len(set(forms))
