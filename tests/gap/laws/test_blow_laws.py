"""Laws of the impacts and the wall that remember turns and blows, or swing at a rate that no list holds; a camera that
steadies its picture.  Causes from physics and three of the plant's, in view: no blind result."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.contact.held_laws import along_normals, known_at_impacts
from analysis.contact.law import fit_restitution
from analysis.gap.cause import Structure
from analysis.gap.laws import impact_law, impact_rates
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.memory import SWUNG
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.frames.law import find_frame_laws
from analysis.gap.laws.impact_law import find_impact_law, find_wall_law
from analysis.gap.laws.impact_rows import EVEN_SD, distance_regression, law_regression, weighed_evenly
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.prediction.one_impact_ahead import through_impacts
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.thresholds import DISTANCE_NEGLIGIBLE
from ovines.core.laws import words as W
from ovines.core.laws.formula import as_text
from ovines.core.laws.kernel import sizes
from ovines.core.laws.terms import Factor, Term, rows_of
from ovines.robust import MEDIAN_TO_SD
from tests.gap.laws.test_memory_laws import EFFECTS, impact_fit, made_series, quantities
from tests.gap.laws.test_uneven_laws import ENOUGH, Asked

LATE = Factor("approach", "absolute_power", -1.0)
#: causes as somebody might have them, of one coefficient
IMPACTS = {
    "a wall that catches what is slow": Term("restitution", 1.0, (Factor("approach", "beyond", 1.0, 0.54),)),
    "a thread that is wound on": Term("restitution", 1.0, (Factor("turned", "tanh", 1.0, 20.0, 6.0),)),
    "a rim that the floor polishes": Term("wall_friction", 1.0, (Factor("turned_since", "tanh", 1.0, 1.5),)),
    "a disk on a film of air": Term("restitution", 1.0, (Factor("last_left", "rational", 2.0, 0.8),)),
    "a ring that leans from its blows": Term("restitution", 1.0, (Factor("swing_rate", y=0.06),)),
    "a ring that blows leave oval": Term("restitution", 1.0, (Factor("ovalling_rate", y=0.08),)),
    "a wall that rubbing warms": Term("wall_friction", 1.0, (Factor("recent_rubbing", y=0.2),)),
    "a wall that blows warm": Term("restitution", 1.0, (Factor("recent_blows", y=0.6),)),
    "a lining that keeps its shear": Term(
        "tangential_restitution", 1.0, (Factor("slip", "sign"), Factor("twist_rate", y=0.09))
    ),
    "a jaw that presses as the ring is turned": Term(
        "restitution", 1.0, (Factor("slip", "sign"), Factor("host_acceleration_around"))
    ),
    "two sides that give way twice a cycle": Term(
        "restitution", 1.0, (Factor("azimuth", "cosine", x=0.7), Factor("phase", "cosine", 2.0, x=0.4))
    ),
    "teeth that lean": Term("contact_normal", 1.0),
    "a lining that bulges before the disk": Term("contact_normal", 1.0, (Factor("slip", "tanh", 1.0, 0.4),)),
}  # fmt: skip
WALLS = {
    "tape that is wound on": Term("contact_radius", 1.0, (Factor("turned", "tanh", 1.0, 20.0, 6.0),)),
    "a disk that planes": Term("contact_radius", 1.0, (Factor("last_left", "rational", 2.0, 0.8),)),
    "a ring that leans from its blows": Term("contact_radius", 1.0, (Factor("swing_rate", y=0.06),)),
    "a ring that blows warm": Term("contact_radius", 1.0, (Factor("recent_blows", y=0.6),)),
    "a liner that a blow shears": Term(
        "contact_radius", 1.0, (Factor("last_slip", "sign"), Factor("since", "exponential", 1.0, 0.1))
    ),
}
RATES = {
    "a ring that blows make oval": Term("restitution", 1.0, (LATE, Factor("ovalling_rate", x=310.0, y=0.09))),
    "a ring that blows turn": Term("spin_added", 1.0, (Factor("twist", x=120.0, y=0.08),)),
    "a hum": Term("restitution", 1.0, (LATE, Factor("time", "cosine", 1.0, 1 / 1430.0, 0.001))),
    "a hum along a line": Term(
        "restitution", 1.0, (LATE, Factor("azimuth", "cosine", x=0.6), Factor("time", "cosine", 1.0, 1 / 870.0, 0.001))
    ),
    "a helix of two turns": Term("restitution", 1.0, (Factor("turned", "cosine", 1.0, 2.0, 0.3),)),
    "fine teeth": Term("restitution", 1.0, (Factor("azimuth", "cosine", 23.0, x=0.1),)),
    "a tool that chattered": Term("contact_normal", 1.0, (Factor("azimuth", "cosine", 23.0, x=0.1),)),
    "a gear": Term("spin_added", 1.0, (Factor("approach"), Factor("body_angle", "cosine", 12.0, x=0.1))),
}


@pytest.fixture(scope="module")
def recorded(loaded):
    """Impacts and fits of six runs in which nothing acts, and their rows for the law and for the wall."""
    _, series = loaded("none", 1.0, 12, runs=6)
    fits = first_flights(series, EFFECTS).fits
    impacts = fit_impacts(fits)
    return impacts, fits, law_regression(impacts, fits, ()), distance_regression(impacts, fits), series.frame


@pytest.mark.further
@pytest.mark.parametrize(("stage", "causes"), [("impacts", IMPACTS), ("walls", WALLS)])
def test_what_turns_and_blows_leave_is_in_the_dictionary(recorded, stage, causes):
    """One candidate alone closes nine tenths of each on runs that have not seen it."""
    _, _, laws, walls, _ = recorded
    rows, candidates = {
        "impacts": (laws, law_candidates(laws.known)), "walls": (walls, wall_candidates(walls.known))
    }[stage]  # fmt: skip
    asked = Asked.of(rows, candidates)
    closed = {name: asked.closed((term, None)) for name, term in causes.items()}
    assert {name: one for name, one in closed.items() if one[0] < ENOUGH} == {}


@pytest.mark.parametrize(
    ("target", "column", "least"), [("restitution", W.TIME, 0.02), ("wall_friction", W.SLIP, 0.02)]
)
def test_what_goes_with_a_logarithm_is_in_the_dictionary(recorded, target, column, least):
    """Creep in time, and contacts that have less time to grow: with its scale searched one form leaves a fiftieth (RMS)
    of log(x + least), what settles at one scale three times as much."""
    known = recorded[2].known
    follows = np.log(np.abs(known[:, column]) + least)
    left = {}
    for one in law_candidates(known):
        if len(one.terms) == 1 and one.terms[0].target == target and len(one.numbers) == 1:
            best = np.inf
            for step in np.linspace(-3.0, 3.0, 25):
                value = np.empty((len(known), 1))
                sizes(rows_of(one.at([one.numbers[0] * np.exp(step)]).terms), known, value)
                table = np.column_stack([np.ones(len(known)), value])
                off = follows - table @ np.linalg.lstsq(table, follows, rcond=None)[0]
                best = min(best, float(np.std(off) / np.std(follows)))
            left[one.name] = min(left.get(one.name, np.inf), best)
    slowly = [share for name, share in left.items() if "ever more slowly" in name]
    assert slowly and min(slowly) < 0.02
    assert min(share for name, share in left.items() if "ever more slowly" not in name) > 2 * min(slowly)


def test_rates_that_no_list_holds_are_found(recorded):
    """Of a residual that the cause alone makes, one of the best of all rates closes nine tenths, and pays for having
    been looked for."""
    rows = recorded[2]
    for name, term in RATES.items():
        left = rows.columns([term])[:, 0]
        left = replace(rows, problem=replace(rows.problem, residual=100.0 * left / np.linalg.norm(left)))
        found = impact_rates.rate_candidates(left, 1 / 800.0, 1e-5, np.random.default_rng(0))
        assert Asked.of(rows, found).closed((term, None))[0] > ENOUGH, name
        assert min(one.looked for one in found if one.terms[0].target == term.target) > 0.0


def test_what_swings_is_the_same_in_the_search_as_in_a_law(recorded):
    known, rates, fades = recorded[2].known, np.array([60.0, 333.0]), (0.02, 0.1)
    values = impact_rates.swung_values(known, rates, fades)
    for name in SWUNG:
        terms = [Term("restitution", 1.0, (Factor(name, x=rate, y=s),)) for s in fades for rate in rates]
        of_law = np.empty((len(known), len(terms)))
        sizes(rows_of(terms), known, of_law)
        np.testing.assert_allclose(values[name], of_law, rtol=0, atol=1e-5)


def humming(impacts, rows):
    """The impacts at a wall that hums all around."""
    hum = 0.1 * np.cos(870.0 * rows.known[:, W.TIME] - 0.8)
    return replace(impacts, data=replace(impacts.data, after=impacts.data.after + hum))


def test_a_wall_that_hums_is_found_at_its_rate(recorded):
    impacts, fits, rows, _, frame = recorded
    law = find_impact_law(humming(impacts, rows), fits, (), frame, np.random.default_rng(0), 0.01)
    assert law is not None
    assert quantities(law) == [("restitution", ["approach", "time"])], as_text(law.law)
    assert 1 / law.law.terms[0].factors[-1].scale == pytest.approx(870.0, rel=2e-3)


@pytest.mark.parametrize("probed", [False, True])
def test_where_a_probe_has_found_something_no_impact_counts_for_many(recorded, monkeypatch, probed):
    """What moves the wall by itself changes the restitution of slow blows so much that a few hold half of what there is
    to explain: where nothing else is found, all is asked again with these weighed down."""
    impacts, fits, rows, _, frame = recorded
    asked = []
    monkeypatch.setattr(impact_law, "find_law", lambda problem, *rest: asked.append(problem) or (None, 1.0))
    probe = Structure("impact", "impact", "normal", "none of the covariates tested", 5.0, 50.0, 0.1, "1", 1e-9)
    left = (probe,) if probed else ()
    assert find_impact_law(humming(impacts, rows), fits, (), frame, np.random.default_rng(0), 0.01, left) is None
    usual = [one.residual[np.abs(one.residual) > 0] for one in asked]
    assert [np.abs(one).max() < 2.0 * np.median(np.abs(one)) * MEDIAN_TO_SD for one in usual] == [False, True][
        : len(usual)
    ]
    assert len(asked) == 1 + probed


def test_rows_that_leave_much_are_weighed_down_with_what_explains_them(recorded):
    """No more than one and a half usual ones are left of each; a law's size is the same in both."""
    rows = recorded[2]
    term = Term("restitution", 1.0, (Factor("approach", "absolute_power", -3.0),))
    problem = rows.problem
    bent = replace(rows, problem=replace(problem, residual=problem.residual + 0.01 * rows.columns([term])[:, 0]))
    even = weighed_evenly(bent)
    left = np.abs(bent.problem.residual - problem.nuisances @ bent.problem.fitted(problem.nuisances, problem.prior))
    usual = MEDIAN_TO_SD * np.median(left[left > 0])
    weight = np.minimum(1.0, EVEN_SD * usual / np.maximum(left, 1e-300))
    assert 0.0 < np.mean(weight < 1.0) < 0.5
    np.testing.assert_allclose(even.problem.residual, weight * bent.problem.residual, rtol=1e-7)
    np.testing.assert_allclose(even.columns([term])[:, 0], weight * bent.columns([term])[:, 0], rtol=1e-7)
    none = replace(rows, problem=Regression(np.zeros(len(left)), problem.nuisances, *_rest(problem)))
    assert weighed_evenly(none) is none


def _rest(problem):
    return problem.prior, problem.block, problem.run


@pytest.mark.further
def test_tape_that_the_disk_winds_up_is_a_radius_by_its_turns(tmp_path):
    series, _ = made_series(tmp_path, "unknown_wound_tape", 0.8, 84, runs=5)  # of three, spin says as much
    impacts, fits = impact_fit(series)
    least_m = DISTANCE_NEGLIGIBLE * series.contact_radius_m
    law = find_wall_law(impacts, fits, series.frame, least_m, np.random.default_rng(0))
    assert law is not None
    assert quantities(law) == [("contact_radius", ["turned"])], as_text(law.law)
    assert law.closed > 0.9


@pytest.mark.further
def test_a_camera_that_steadies_its_picture_follows_the_disk(tmp_path):
    """All of its picture goes the other way, along u and along v."""
    series, _ = made_series(tmp_path, "unknown_steadied_picture", 0.9, 82, runs=2)
    laws, _ = find_frame_laws(series, np.random.default_rng(0))
    found = {one for law in laws for one in ((t, q) for t, names in quantities(law) for q in names)}
    assert found == {("picture_u", "nes_place_along"), ("picture_v", "nes_place_along")}
    assert all(law.closed > 0.9 for law in laws)


@pytest.mark.further
def test_what_a_law_makes_of_friction_says_which_impacts_stick(tmp_path):
    """A layer that creeps under a slow slip holds so little that most impacts slide, which the usual friction of the
    wall takes for stuck: what these return, which grows with the blow then, was a second law beside the right one."""
    series, true = made_series(tmp_path, "unknown_creeping_layer", 0.9, 81, runs=4)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    assert (term.target, [one.quantity for one in term.factors]) == ("wall_friction", ["slip"]), as_text(law.law)
    assert law.closed > 0.95
    known = np.zeros((50, W.KNOWN_SIZE))
    known[:, W.SLIP] = np.linspace(0.1, 1.5, 50)
    friction = np.empty((50, 1))
    sizes(rows_of(law.rig_law.terms), known, friction)
    form = np.column_stack([np.ones(50), np.tanh(known[:, W.SLIP] / true["creep_m_per_s"])])
    off = friction[:, 0] - form @ np.linalg.lstsq(form, friction[:, 0], rcond=None)[0]
    assert np.std(off) < 0.1 * np.std(friction)


@pytest.mark.further
def test_friction_of_each_run_is_reported_to_a_hundredth(tmp_path):
    """Impacts that slide in a run of little friction would stick on the usual wall, and the other way round: taken so,
    halves of the runs gave sizes of 1.09 and 0.86, each to a few hundredths, and the law was not believed."""
    series, _ = made_series(tmp_path, "unknown_fouled_wall", 1.1, 82, runs=4)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None and law.halves is not None
    (term,) = law.law.terms
    assert (term.target, [one.quantity for one in term.factors]) == ("wall_friction", ["run"]), as_text(law.law)
    assert law.halves.agree and law.halves.sizes == pytest.approx((1.0, 1.0), abs=0.03)


#: of the plant: what turns a blow, the number that says how far (rad), and what the law follows
TURNED = {
    "unknown_sawtooth_wall": ("saw_rad", []),
    "unknown_bulging_lining": ("piled_rad", [("slip", "tanh")]),
    "unknown_chatter_marks": ("marks_rad", [("azimuth", "cosine")]),
}


@pytest.mark.others_further
@pytest.mark.parametrize("cause", TURNED)
def test_a_blow_that_is_turned_from_the_walls_normal_is_one_number(tmp_path, cause):
    """Not a spin that is added, another return along the wall and a restitution that goes with the speed beside it."""
    number, follows = TURNED[cause]
    series, true = made_series(tmp_path, cause, 1.0, 12, runs=4)
    impacts, fits = impact_fit(series)
    law = find_impact_law(impacts, fits, (), series.frame, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    assert term.target == "contact_normal", as_text(law.law)
    assert [(one.quantity, one.function) for one in term.factors] == follows
    assert abs(abs(term.coefficient) - abs(true[number])) < 2 * term.sd < 0.5 * abs(true[number])
    assert law.closed > 0.9


def test_impacts_along_the_normals_that_blows_are_turned_to_follow_the_plain_law(tmp_path):
    """Of a wall whose teeth lean: its restitution hardly scatters any more, and rows of the spin have nothing left."""
    series, true = made_series(tmp_path, "unknown_sawtooth_wall", 1.0, 12, runs=3)
    impacts, fits = impact_fit(series)
    passing = known_at_impacts(impacts.data, impacts.junctions, fits)[:, W.PASSING]
    plain = along_normals(impacts.data, passing, np.full(len(passing), true["saw_rad"]))
    scatter = [fit_restitution(one)[2] for one in (impacts.data, plain)]
    off = [float(np.sqrt(np.mean((one.angular / one.angular_sd) ** 2))) for one in (impacts.data, plain)]
    assert scatter[1] < 0.5 * scatter[0]
    assert off[1] < 0.5 * off[0] and off[1] < 1.5


def test_rows_answer_a_turn_as_impacts_seen_along_turned_normals_do(recorded):
    """By differences, beside what the nominal law is free in: normal, tangential and angular rows."""
    impacts, fits, rows, _, _ = recorded
    small, passing = 1e-6, rows.known[:, W.PASSING]
    moved = replace(impacts, data=along_normals(impacts.data, passing, np.full(len(passing), small)))
    scatter = fit_restitution(impacts.data)[2]
    before, after = (law_regression(one, fits, (), scatter=scatter).problem for one in (impacts, moved))
    by_difference = (before.residual - after.residual) / small
    answered = rows.columns([Term("contact_normal", 1.0)])[:, 0]
    free = before.nuisances
    for part in np.split(np.arange(len(answered)), 3):
        beside = np.column_stack([free[part], answered[part]])
        beside = beside[:, np.any(beside != 0.0, 0)]
        found = np.linalg.lstsq(beside, by_difference[part], rcond=None)[0]
        left = by_difference[part] - beside @ found
        assert found[-1] == pytest.approx(1.0, abs=0.03)
        assert np.sqrt(np.mean(left**2)) < 0.05 * np.sqrt(np.mean(by_difference[part] ** 2))


def test_a_held_law_of_the_restitution_is_not_counted_twice_one_impact_ahead(loaded):
    """What is learnt of the other runs is learnt without it: a constant that is held beside changes no prediction."""
    _, series = loaded("none", 1.0, 12, runs=6)
    fits = first_flights(series, EFFECTS).fits
    impacts = fit_impacts(fits)
    held = [rows_of(terms) for terms in ([], [Term("restitution", 0.05)])]
    paths = [through_impacts(series.runs, fits, impacts, (), finite=False, held=one) for one in held]
    seen = [np.isfinite(path).all(1) for path in paths[0]]
    assert sum(map(np.count_nonzero, seen)) > 500
    off = [np.abs(one - other)[use] for one, other, use in zip(*paths, seen, strict=True)]
    assert max(map(np.max, off)) < 1e-7
