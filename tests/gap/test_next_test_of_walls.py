"""The next test for a law of the wall's shape, or the disk's, against another formula.

What is promised is held against repeats: recordings simulated in the setting, with noise, and recordings that the plant
makes in it, both fitted as measured ones."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.blind.recording.files import write_run, write_series
from analysis.blind.series import further_run, outline_series, run_outline
from analysis.flights.equation.parameters import LAW
from analysis.flights.fit import FlightFits, fit_flights
from analysis.gap.cause import NONE_TESTED, Structure
from analysis.gap.diagnose import _actions
from analysis.gap.laws.belief import followed_by
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_rows import distance_regression, usual_distance_scatter
from analysis.gap.next_test.choice import LEAST_SEPARATION, STARTS, duration_of, next_tests, rig_with_laws
from analysis.gap.next_test.laws import law_information, open_form, why_no_setting
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS, acts, record, starts
from analysis.gap.next_test.separation import separation_of
from analysis.gap.page.laws import read_by
from analysis.gap.page.next_test import next_section
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.flights.model import run_places
from analysis.gap.selection.impacts.fit import Shape, fit_impacts
from analysis.report.page import Page
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.refusal import ScenarioError
from ovines.pipeline.blind.closed_loop import WISHES
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.test_next_test import SOFT, found

FOLLOWED = ("host_acceleration_along", "host_velocity_along")
AT_REST = "the Host at rest and the disk launched at 2 m/s with 100 rad/s"


def radius(size_m: float, *factors: Factor) -> Term:
    """A term of the contact radius."""
    return Term("contact_radius", size_m, factors)


DENT = radius(-4e-5, Factor("azimuth", "gaussian", 1.0, 0.3, 0.28))
OVAL = radius(4e-5, Factor("azimuth", "cosine", 2.0, x=0.28))
SQUEEZED = radius(-3e-6, Factor("host_acceleration_outwards"))


def separation(ladder, law: LawFound, setting: str = AS_RECORDED, beginnings: int = 2) -> float:
    """By how much one setting alone tells a law from its other formula, in standard deviations: an eighth of the time
    of all."""
    form, rig = open_form([law]), rig_with_laws(ladder, (), (law,))
    assert form is not None
    asked = next(one for one in SETTINGS if one.words == setting)
    recorded = [record(rig, start, asked, duration_of(rig)) for start in starts(rig.flights, beginnings)]
    (information,) = law_information(rig, recorded, form)
    return separation_of(information, beginnings)[0]


def better_by(fits: list[FlightFits], law: LawFound, other: Term, scatter_m: float) -> float:
    """By how much contact distances are nearer to a law than to another formula, both of any size: the difference of
    the sums of squares."""
    rows = distance_regression(fit_impacts(fits), fits, law.rig_law, scatter_m)
    misfit = []
    for terms in (law.rig_law.terms, (other,)):
        columns = np.column_stack([rows.problem.nuisances, rows.columns(terms)])
        left = rows.problem.residual - columns @ np.linalg.lstsq(columns, rows.problem.residual, rcond=None)[0]
        misfit.append(float(np.sum(left**2)))
    return misfit[1] - misfit[0]


@pytest.fixture(scope="module")
def dented(quiet):
    """A dent against an oval: the law, and its settings."""
    law = found(DENT, others=(OVAL,))
    tests = next_tests(quiet, (), (law,))
    assert tests is not None
    return law, tests, {one.setting: one for one in tests.settings}


@pytest.mark.further
@pytest.mark.parametrize("setting", [AS_RECORDED, SOFT, AT_REST])
def test_what_is_promised_of_a_wall_is_what_a_repeat_shows(quiet, dented, setting):
    """The dent is in the simulated wall, and the recordings have noise."""
    law, tests, by_setting = dented
    rig = rig_with_laws(quiet, (), (law,))
    rng, fits = np.random.default_rng(7), []
    p = rig.flights.model.parameters.copy()
    p[LAW] = 0.0
    for start in starts(rig.flights, tests.starts):
        asked = next(one for one in SETTINGS if one.words == setting)
        run = record(rig, start, asked, duration_of(rig)).run(rig)
        noise = rng.standard_normal((len(run.data.time_s), 3))
        xy_m = run.data.xy_m + run.data.xy_sd_m[:, None] * noise[:, :2]
        angle_rad = run.data.angle_rad + run.data.angle_sd_rad * noise[:, 2]
        data = replace(run.data, xy_m=xy_m, angle_rad=angle_rad)
        model = replace(rig.flights.model, parameters=p, drift_per_run=0.0)
        fits.append(fit_flights(data, run.flights, model.of_run(run_places([data])[0]), model.shared()))
    assert quiet.impacts.fitted is not None
    better = better_by(fits, law, OVAL, usual_distance_scatter(quiet.impacts.fitted))
    assert 0.7 < np.sqrt(better / len(fits)) / by_setting[setting].sd < 1.4


def test_the_setting_that_meets_the_wall_most_says_most_of_its_shape(dented):
    """At half the level the disk meets the wall less often than as recorded; a slow launch hardly reaches it."""
    _, tests, by_setting = dented
    slow = by_setting["the Host at rest and the disk launched at 0.5 m/s without spin"]
    assert by_setting[AS_RECORDED].sd > by_setting[SOFT].sd > slow.sd
    assert slow.sd < 0.1 and by_setting[AS_RECORDED].error < by_setting[AS_RECORDED].sd
    assert tests.law == "law-1.toml" and tests.words().startswith("More recordings as these serve")


@pytest.mark.further
@pytest.mark.parametrize("setting", [AS_RECORDED, SOFT])
def test_what_is_promised_of_a_disk_that_is_not_round_is_what_the_plant_shows(quiet, tmp_path, monkeypatch, setting):
    """The simulator has no such disk: its law moves the contacts that were simulated without it.  The plant has it, and
    makes further runs in the setting."""
    runs, rng = 4, np.random.default_rng(13)
    outline = outline_series("unknown_oval_disk", 0.1, rng, 1, "white")
    size_m = outline.draft.plant["oval"] * quiet.series.contact_radius_m
    around = Factor("body_angle", "cosine", 2.0, x=outline.draft.plant["oval_rad"])
    other = radius(1.0, replace(around, order=3.0))
    law = found(radius(size_m, around), others=(other,))
    write_series(run_outline(outline, rng), tmp_path / "series")
    for number in range(runs):
        write_run(tmp_path / "series", 2 + number, *further_run(outline, WISHES[setting], rng))
    monkeypatch.setattr("ovines.pipeline.series.diagnosis.learn_together", lambda *_: None)  # white noise, no lens
    series, _ = load_series(read_series(tmp_path / "series"), tmp_path / "results")
    further = series.runs[1:]
    fits = first_flights(replace(series, runs=further), ("floor_friction", "spin_coupling")).fits
    assert quiet.impacts.fitted is not None
    better = better_by(list(fits), law, other, usual_distance_scatter(quiet.impacts.fitted))
    lasted_s = sum(run.data.time_s[-1] - run.data.time_s[0] for run in further)
    rig = rig_with_laws(quiet, (), (law,))
    assert not acts(law.rig_law) and rig.acting == ()
    shown = np.sqrt(better * duration_of(rig) / lasted_s)
    assert 0.5 < shown / separation(quiet, law, setting, STARTS) < 2.0


def test_a_wall_that_the_nominal_model_holds_is_simulated(quiet):
    """A law in `[model]` is in the wall of every setting: in its dent the disk is met nearer by."""
    law = WrittenLaw((replace(DENT, coefficient=-5e-4),))
    rig = rig_with_laws(replace(quiet, series=replace(quiet.series, laws=(law,))), (), ())
    (held,) = rig.acting
    assert held == quiet.series.frame.law(law)
    recorded = record(rig, starts(rig.flights, 1)[0], SETTINGS[0], duration_of(rig))
    motion = recorded.result.motion
    away = np.column_stack([motion[f"nes_{q}_m"] - motion[f"host_{q}_m"] for q in "xy"])
    off_rad = np.angle(np.exp(1j * (np.arctan2(away[:, 1], away[:, 0]) - held.terms[0].factors[0].x)))
    reach_m = rig.wall.outline.radius_m - np.hypot(*away.T)
    in_dent = np.abs(off_rad) < 0.1
    assert np.count_nonzero(in_dent) > 5 and reach_m[in_dent].min() > 4e-4 > reach_m.min()


def test_a_ring_that_the_host_squeezes_needs_a_host_that_moves(quiet):
    """At rest its law does nothing; at half the level less than as recorded."""
    law = found(SQUEEZED, others=(radius(1e-4, Factor("approach")),))
    recorded, soft, at_rest = (separation(quiet, law, one) for one in (AS_RECORDED, SOFT, AT_REST))
    assert recorded > soft > LEAST_SEPARATION and at_rest == 0.0


def test_a_wall_in_step_with_the_drive_has_no_setting_at_rest(quiet):
    law = found(radius(1e-4, Factor("phase", "cosine")), others=(DENT,))
    assert separation(quiet, law) > LEAST_SEPARATION
    with pytest.raises(ScenarioError, match="in step with the drive"):
        separation(quiet, law, AT_REST)


def test_a_wall_that_is_elsewhere_or_larger_is_no_question(quiet):
    """Radius and centre are unknown in any case: no setting tells a law that only says these from another."""
    assert separation(quiet, found(radius(1e-4, Factor("azimuth", "cosine", x=0.3)), others=(DENT,))) < 0.1


def test_how_long_contacts_last_is_unknown_where_they_do(quiet):
    """Distances that grow with the speed are told from others unless contacts last: these do the same, in any size."""
    growing = found(radius(2e-5, Factor("approach")), others=(OVAL,))
    lasting = replace(quiet, impacts=replace(quiet.impacts, shape=Shape(finite=True)))
    assert separation(quiet, growing) > 5.0 and separation(lasting, growing) < 0.1
    # A law of how long they last says that itself.
    hertz = radius(1e-4, Factor("approach", "power", 0.8))
    assert separation(lasting, found(hertz, others=(OVAL,))) > 5.0


def test_numbers_inside_the_other_formula_are_free(quiet):
    """A dent at a place that is open imitates one beside it more than one whose place is known."""
    beside = replace(DENT, factors=(replace(DENT.factors[0], x=0.38),))
    placed = found(DENT, others=(beside,))

    def at(place: float) -> tuple[Term, ...]:
        return (radius(1.0, replace(DENT.factors[0], x=place)),)

    movable = Candidate("a dent", at, (0.38,), (0.15,), (False,))
    free = replace(placed, others=(replace(placed.others[0], candidate=movable),))
    assert separation(quiet, free) < 0.6 * separation(quiet, placed)


def test_the_test_by_hand_names_what_the_law_follows(quiet, dented):
    """Beside a law that was judged, not what a probe had seen of it; and where a probe has seen nothing, turning
    things."""
    law, tests, _ = dented
    left = Structure("geometry", "impact", "radius", f"{NONE_TESTED} (scatter)", 3.0, 50.0, 1e-4, "m", 1e-5)
    ladder = replace(quiet, structure=(left,))
    (action,) = _actions(ladder, tests, (law,))
    assert action.startswith(tests.words()) and f"goes with {followed_by(law)}" in action and NONE_TESTED not in action
    (action,) = _actions(ladder, None, ())
    assert "goes with nothing that was tested" in action and "Change that" not in action


def test_formulas_of_cameras_and_markers_are_separated_on_the_bench():
    """A marker that goes with the Host's acceleration or its velocity."""
    bent, other = (Term("host_marker", 1e-5, (Factor(name, x=0.2),), 2.0, 0.3) for name in FOLLOWED)
    left = Structure("measurement", "all", "x", "marker H3, which moves", 3.0, 50.0, 1e-4, "m", 1e-5)
    law = found(bent, others=(other,))
    assert open_form([law]) is None
    assert why_no_setting(left, [law], None).endswith("on the bench.")
    assert why_no_setting(left, [found(bent)], None) == ""


def test_the_page_says_of_which_formula_the_simulated_rig_knew_nothing(dented):
    """Two formulas in a table; a bar without an error is explained, and so is a law that no command holds."""
    law, tests, _ = dented
    oval = found(radius(4e-5, Factor("body_angle", "cosine", 2.0)), others=(DENT,))
    entry, shown = tests.entry(), {}
    entry["settings"][1]["standard_error"] = None
    for one in (law, oval):
        page = Page("gap", "a page")
        next_section(page, SimpleNamespace(summary={"next_tests": entry}, laws=(one,)))
        (section,) = page.sections
        shown[one] = " ".join(block.text for block in section.blocks)
        assert section.blocks[1].rows == (("law-1.toml", entry["effect"]), ("the other", entry["rival"]))
        assert "Without a ±" in shown[one]
    assert "so this formula was not in it" in shown[oval] and "was not in it" not in shown[law]
    assert "no command" in read_by(oval, "law-1.toml") and "ovines simulate" in read_by(law, "law-1.toml")
