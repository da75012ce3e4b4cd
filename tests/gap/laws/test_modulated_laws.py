"""The grid of carriers and of what makes them more or less: complete, without twins, and what the plant's causes that
it was made for come out as.  In view, therefore no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.laws.choice.listed import Listed, columns_of
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.modulated import changing, modulated, settling
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.flight_rows import AT_ONCE, MANY_TERMS, flight_regression
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.selection.flight_steps import first_flights
from ovines.core.laws.formula import as_text
from ovines.core.laws.kernel import pushes, shared_pushes, shared_terms, shared_values
from ovines.core.laws.terms import Factor, rows_of
from ovines.core.laws.words import KNOWN_SIZE
from tests.gap.laws.test_memory_laws import EFFECTS, flight_law, made_series, quantities

SCALES = RigScales(0.04, 1.7, 0.06, 0.8, 69.0, 100.0, 4)
CARRIED = {
    "floor_friction": (), "fixed_direction": (), "along_velocity": ("speed",), "along_sliding": ("sliding_speed",),
    "outwards": (), "swirl": (), "across_velocity": ("speed",), "spin": (), "floor_torque": (),
}  # fmt: skip
# what a flight may remember of the blow that it began with
OF_BLOW = ("last_approach", "last_slip", "last_left", "last_azimuth", "turned_since", "from_contact")


def test_every_carrier_meets_every_usual_quantity():
    """What changes with place, motion, time or the blows before, changes whichever of the forces it may."""
    met = {(term.target, *sorted(f.quantity for f in term.factors)) for one in modulated(SCALES) for term in one.terms}
    for target, own in CARRIED.items():
        for quantity in ("radius", "gap", "time", "run", "since", "blows", "phase", "azimuth", "host_speed", *OF_BLOW):
            assert (target, *sorted((*own, quantity))) in met, (target, quantity)


def test_no_formula_of_the_flights_stands_in_the_dictionary_twice():
    """Two of one form would be each other's rivals, and no data could tell them apart."""
    seen = {}
    for one in flight_candidates(SCALES):
        assert seen.setdefault(frozenset(one.terms), one.name) == one.name
    assert len(seen) > 2000


def test_terms_asked_together_push_as_each_by_itself():
    """Every term of the dictionary, with its coefficient, in drawn states."""
    rng = np.random.default_rng(3)
    terms = [replace(term, coefficient=float(rng.normal())) for one in flight_candidates(SCALES) for term in one.terms]
    known, rows = rng.uniform(0.01, 1.0, (3, KNOWN_SIZE)), rows_of(terms)
    each, together = np.empty((3, 3, len(rows))), np.empty((3, 3, len(rows)))
    pushes(rows, known, each)
    shared = shared_terms(rows)
    assert len(shared.factors) < 0.5 * len(rows) and len(shared.directions) < 0.1 * len(rows)
    pushed, value = np.empty((3, len(shared.directions), 3)), np.empty((3, len(shared.factors)))
    shared_values(shared, known, pushed, value)
    for first in range(0, len(rows), 1000):
        some = np.empty((3, 3, min(1000, len(rows) - first)))
        shared_pushes(shared, first, pushed, value, some)
        together[:, :, first : first + 1000] = some
    np.testing.assert_allclose(together, each, rtol=1e-12, atol=1e-12)


def test_columns_of_a_dictionary_are_those_of_each_term_by_itself(loaded):
    """Asked together, in pieces, each answers as alone: accelerations, the steps' displacements, the frames; in unit
    length, and nil where fewer than four flights tell of one."""
    _, series = loaded("none", 1.0, 4, runs=2)
    flights = flight_regression(first_flights(series, EFFECTS))
    some = [one for one in flight_candidates(SCALES) if len(one.terms) == 1][::5]
    assert len(some) > AT_ONCE > MANY_TERMS
    alone = np.column_stack([flights.columns(one.terms) for one in some])
    together = flights.columns([one.terms[0] for one in some])
    assert np.all(np.abs(together - alone) <= 1e-11 * np.linalg.norm(alone, axis=0))  # the rounding of sums
    # Blocks in any order, the last of them with less than the fewest.
    block = flights.problem.block.copy()
    order = np.random.default_rng(0).permutation(len(block))
    alone[:, 0] = np.where(block < 3, alone[:, 0], 0.0)
    table, groups = columns_of(some, lambda terms: alone[order].copy(), block[order])
    assert groups == [[i] for i in range(len(some))] and not np.any(table[:, 0])
    filled = np.any(table != 0.0, 0)
    assert np.count_nonzero(filled) > 0.5 * len(some)
    expected = alone[order][:, filled] / np.linalg.norm(alone[:, filled], axis=0)
    np.testing.assert_allclose(table[:, filled], expected, rtol=1e-9, atol=1e-15)


@pytest.mark.further
def test_smooth_functions_tell_as_much_of_a_dictionary_as_all_the_frames_do(loaded):
    """In half of the rows: columns keep all but a hundredth of their square (what rings fastest; most 1e-6), and what
    each gains in runs held out, beside a part of a law fitted along, too, is the same to a hundredth where it is
    anything, and the best one stays the best."""
    _, series = loaded("viscous_drag", 1.0, 4, runs=2)
    flights = flight_regression(first_flights(series, EFFECTS))
    every = flight_candidates(SCALES)
    one_term = [one for one in every if len(one.terms) == 1]
    asked = [*one_term[::5], *(one for one in every if "ring" in one.name)]
    terms = [term for one in asked for term in one.terms]
    before, after = (np.sum(table.astype(float) ** 2, 0) for table in (flights.columns(terms), flights.sums(terms)))
    acts = before > 0.0
    lost = 1.0 - after[acts] / before[acts]
    assert lost.max() < 0.01 and np.median(lost) < 1e-6 and lost.min() > -1e-6
    problem = flights.problem
    for held in (problem, problem.with_columns(flights.columns(one_term[0].terms))):
        full = Listed.of(asked, flights.columns, held)
        brief = Listed.of(asked, flights.sums, held, flights.summed)
        assert len(brief.table) < 0.6 * len(full.table)
        assert np.array_equal(np.any(full.table != 0.0, 0), np.any(brief.table != 0.0, 0))
        gains = full.gains(held, 1.0), brief.gains(held, 1.0)
        some = gains[0] > 0.1 * gains[0].max()
        assert gains[0].argmax() == gains[1].argmax() and np.count_nonzero(some) > 20
        np.testing.assert_allclose(gains[1][some], gains[0][some], rtol=0.01)


@pytest.mark.parametrize("scale", [0.1, 10.0])
def test_the_grid_is_in_rig_units(scale):
    """A rig of another size has the same candidates, its lengths and times as much longer."""
    there = RigScales(0.04 * scale, 1.7 * scale, 0.06, 0.8, 69.0, 100.0, 4)
    here, there = modulated(SCALES), modulated(there)
    assert [one.name for one in here] == [one.name for one in there]
    waves = [(a.numbers, b.numbers) for a, b in zip(here, there, strict=True) if "waves over the floor" in a.name]
    assert len(waves) > 100
    for a, b in waves:
        np.testing.assert_allclose(b, (a[0], a[1] * scale), rtol=1e-12)


@pytest.mark.further
def test_jets_of_a_floor_are_waves_along_its_rows_of_holes(tmp_path):
    """Along both directions of a row, with its length."""
    series, true = made_series(tmp_path, "unknown_air_jets", 0.9, 41, runs=3)
    law = flight_law(series)
    assert law is not None
    assert quantities(law) == [("fixed_direction", ["along_host"])] * 2, as_text(law.law)
    for term in law.law.terms:
        (wave,) = term.factors
        assert 2 * np.pi * wave.scale == pytest.approx(0.018, rel=0.03)
        assert abs(np.cos(term.x) * np.sin(term.x)) < 0.1  # along the rows of holes
        assert abs(term.coefficient) == pytest.approx(true["jets_m_per_s2"], rel=0.03)


@pytest.mark.further
def test_friction_that_comes_and_goes_has_a_rate_of_its_own(tmp_path):
    """Neither the drive's nor a multiple of it."""
    series, true = made_series(tmp_path, "unknown_pulsing_air", 0.9, 42, runs=2)
    law = flight_law(series)
    assert law is not None
    assert quantities(law) == [("floor_friction", ["time"])], as_text(law.law)
    (term,) = law.law.terms
    assert 1 / term.factors[0].scale == pytest.approx(true["pulsing_rad_per_s"], rel=0.05)
    assert abs(term.coefficient) == pytest.approx(true["pulsing"], rel=0.2)


@pytest.mark.further
def test_a_floor_that_wears_in_its_middle_is_more_there_at_first_and_less_at_last(tmp_path):
    """Of all the dictionary that form predicts the runs held out best, its two coefficients of opposite signs."""
    series, _ = made_series(tmp_path, "unknown_wearing_middle", 0.9, 43, runs=6)
    flights = flight_regression(first_flights(series, EFFECTS))
    scales = RigScales.of(flights.known, float(series.runs[0].data.host.omega_rad_per_s))
    known = [one for one in flight_candidates(scales) if one.terms[0].target == "floor_friction"]
    table, groups = columns_of(known, flights.columns, flights.problem.block)
    forms = forms_of(flights.problem, table, groups)
    gains = held_out_gains(forms, np.ones((1, len(forms.fold))))[0]
    best = known[int(np.argmax(gains))]
    assert best.name == "friction in the middle, changing with the run"
    shapes = [[(one.quantity, one.function) for one in term.factors] for term in best.terms]
    assert shapes == [[("radius", "gaussian")], [("radius", "gaussian"), ("run", "power")]]
    beside = flights.problem.with_columns(flights.columns(best.terms))
    first, further = beside.fitted(beside.nuisances, beside.prior)[-2:]
    assert first * further < 0


def test_what_settles_is_told_apart_from_what_it_was_at_first():
    one = settling("settling", ("blows", "exponential", 1.0), [4.0])
    assert one.make(4.0) == ((), (Factor("blows", "exponential", 1.0, 4.0),))
    two = changing("changing", ("radius", "gaussian", 1.0), [0.01], "run")
    (still,), (same, run) = two.make(0.01)
    assert still == same == Factor("radius", "gaussian", 1.0, 0.01) and run == Factor("run")
    assert one.positive == two.positive == (True,) and [n for n, _ in two.starts] == [(0.01,)]


@pytest.mark.further
def test_a_line_of_glue_takes_the_same_of_every_crossing(tmp_path):
    """Held back as hard at any speed, within a few millimetres of a line, against the way across it."""
    series, true = made_series(tmp_path, "unknown_glue_line", 0.9, 81, runs=4)
    law = flight_law(series)
    assert quantities(law) == [("fixed_direction", ["along_host", "sliding_along"])], as_text(law.law)
    held, sd, _ = law.numbers["coefficient"]
    assert abs(held) == pytest.approx(true["crossed_m_per_s2"], abs=3 * sd + 0.15 * true["crossed_m_per_s2"])


@pytest.mark.further
@pytest.mark.parametrize(
    ("kind", "severity", "seed", "quantity"),
    [
        ("unknown_primed_film", 0.6, 91, "last_left"),
        ("unknown_dirty_side", 0.9, 92, "last_azimuth"),
        ("unknown_spun_out_dust", 0.9, 93, "turned_since"),
    ],
)
def test_friction_remembers_the_blow_before(tmp_path, kind, severity, seed, quantity):
    """How fast it has let the disk go, where it was, how far the disk has turned since."""
    series, _ = made_series(tmp_path, kind, severity, seed, runs=4)
    law = flight_law(series)
    assert law is not None
    assert {target for target, _ in quantities(law)} == {"floor_friction"}, as_text(law.law)
    assert {name for _, names in quantities(law) for name in names} - {"last_left"} == {quantity} - {"last_left"}
    assert law.closed > 0.9
