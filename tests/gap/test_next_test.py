"""The next test for what is left: a law in closed form against another formula, in settings of the rig.

What is promised is held against repeats: recordings simulated in the setting, with noise, fitted as measured ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.flights.equation.parameters import INDEX, LAW, LAW_TERMS
from analysis.gap.cause import EACH_RUN, Cause, Structure
from analysis.gap.diagnose import _actions
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.found_law import LawFound, Other
from analysis.gap.next_test.choice import (
    LEAST_SEPARATION,
    STARTS,
    NextTests,
    duration_of,
    law_tests,
    next_tests,
    rig_with_laws,
)
from analysis.gap.next_test.laws import open_form, why_no_setting
from analysis.gap.next_test.recording import AS_RECORDED, SETTINGS, record, starts
from analysis.gap.next_test.separation import Information, Separation, separation_of
from analysis.gap.page.next_test import recordings_needed, settings_figure
from analysis.gap.selection.flights.fit import fit
from analysis.gap.tests_by_hand import unknown_test
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of

SQUARE = Term("along_velocity", -0.05, (Factor("speed", order=2.0),))
LINEAR = Term("along_velocity", -0.05, (Factor("speed"),))
SLIP = Term("restitution", -0.05, (Factor("slip", "absolute_power"),))
AROUND = Term("restitution", -0.05, (Factor("azimuth", "cosine"),))
LOUD, SOFT = "1.5 times the level", "half the level"


def candidate_of(term: Term) -> Candidate:
    """A formula of one term of any size."""
    return Candidate(term.target, lambda: (replace(term, coefficient=1.0),))


def found(*terms: Term, others: tuple[Term, ...] = (), told_apart: bool = False) -> LawFound:
    """A law of ``terms`` as a search would report it."""
    law, none = WrittenLaw(terms), np.zeros(1)
    near = tuple(
        Other(WrittenLaw((one,)), 0.9, told_apart, candidate_of(one), np.array([one.coefficient])) for one in others
    )
    return LawFound(law, law, {}, 1e-4, none, none, none, near)


@pytest.fixture
def two_beginnings(monkeypatch) -> None:
    """Simulations from two beginnings, where no error bar is asked for: a quarter of the time."""
    monkeypatch.setattr("analysis.gap.next_test.choice.STARTS", 2)


@pytest.fixture(scope="module")
def drag(quiet):
    """Drag that grows with the square of the speed, against one that grows with the speed."""
    law = found(SQUARE, others=(LINEAR,))
    tests = next_tests(quiet, (), (law,))
    assert tests is not None
    return law, tests


@pytest.fixture(scope="module")
def slip(quiet):
    """Restitution that falls with the slip, against one that goes around the wall; of two beginnings."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.gap.next_test.choice.STARTS", 2)
        tests = next_tests(quiet, (), (found(SLIP, others=(AROUND,)),))
    assert tests is not None
    return tests


@pytest.mark.further
def test_a_faster_disk_separates_a_square_from_a_line(drag):
    """At half the level the disk is slower than as recorded, and its drag less than half of what it was; so it is of a
    launch at 0.5 m/s and one at 2 m/s: by more than their errors."""
    _, tests = drag
    by_setting = {one.setting: one for one in tests.settings}
    at_rest = "the Host at rest and the disk launched at {} m/s without spin"
    for fast, slow in ((AS_RECORDED, SOFT), (at_rest.format("2"), at_rest.format("0.5"))):
        fast, slow = by_setting[fast], by_setting[slow]
        assert fast.sd > slow.sd + np.hypot(fast.error, slow.error), tests.settings
    assert [one.sd for one in tests.settings] == sorted((one.sd for one in tests.settings), reverse=True)
    # Of so many beginnings every setting driven has an error bar, and none is as long as the bar itself.
    assert tests.starts == STARTS
    assert all(0 < one.error < one.sd for one in tests.settings if one.sd > LEAST_SEPARATION)


@pytest.mark.further
def test_what_is_promised_is_what_a_repeat_shows(quiet, drag):
    """Recordings in the setting recommended, with noise: how much better their own fit is with the law than with the
    other formula, both with free sizes, against the separation promised."""
    law, tests = drag
    rig = rig_with_laws(quiet, (), (law,))
    setting = next(one for one in SETTINGS if one.words == tests.recommended)
    rng, runs = np.random.default_rng(7), []
    for start in starts(rig.flights, STARTS):
        run = record(rig, start, setting, duration_of(rig)).run(rig)
        noise = rng.standard_normal((len(run.data.time_s), 3))
        xy_m = run.data.xy_m + run.data.xy_sd_m[:, None] * noise[:, :2]
        angle_rad = run.data.angle_rad + run.data.angle_sd_rad * noise[:, 2]
        runs.append(replace(run, data=replace(run.data, xy_m=xy_m, angle_rad=angle_rad)))
    misfit = []
    for term in (SQUARE, LINEAR):
        p = rig.flights.model.parameters.copy()
        p[LAW] = 1.0
        free = ("friction", *(n for n in rig.flights.model.free if n != "friction" and n in INDEX), LAW_TERMS[0])
        model = replace(rig.flights.model, parameters=p, drift_per_run=0.0, free=free)
        holding = [replace(run, data=replace(run.data, law=rows_of([term]))) for run in runs]
        misfit.append(fit(holding, model, noise=rig.flights.noise).misfit)
    measured = np.sqrt((misfit[1] - misfit[0]) / len(runs))
    promised = next(one.sd for one in tests.settings if one.setting == tests.recommended)
    assert 0.5 < measured / promised < 2.0


def test_a_law_of_the_impacts_is_separated_where_it_acts(slip):
    """What grows with the slip from what goes around the wall; a launch without spin from the middle hardly slips."""
    by_setting = {one.setting: one.sd for one in slip.settings}
    assert by_setting[AS_RECORDED] > 1
    assert by_setting["the Host at rest and the disk launched at 2 m/s without spin"] < 0.5 * by_setting[AS_RECORDED]


@pytest.mark.further
def test_a_formula_that_holds_the_law_is_passed_over_for_one_that_can_be_told_apart(quiet, drag, two_beginnings):
    """Twice the same is no question for another setting; alone it stays the answer that no setting tells."""
    _, tests = drag
    both = found(SQUARE, others=(replace(SQUARE, coefficient=-0.04), LINEAR))
    form = open_form([both])
    assert form is not None
    chosen = law_tests(quiet, (), (both,), form)
    assert chosen is not None and chosen.rival == tests.rival
    same = next_tests(quiet, (), (found(SQUARE, others=(replace(SQUARE, coefficient=-0.04),)),))
    assert same is not None and max(one.sd for one in same.settings) < 0.1
    assert same.words().startswith("No setting of the drive tells") and "less than 0.1" in same.words()


def test_a_law_in_step_with_the_drive_has_no_setting_at_rest(quiet, two_beginnings):
    """The simulator refuses it: the others are ranked."""
    beat = Term("fixed_direction", 0.5, (Factor("phase", "cosine"),), x=0.3)
    tests = next_tests(quiet, (), (found(beat, others=(LINEAR,)),))
    assert tests is not None and all("at rest" not in one.setting for one in tests.settings)


def test_without_another_formula_the_words_say_why(quiet):
    assert next_tests(quiet, (), (found(SQUARE),)) is None and next_tests(quiet, (), ()) is None
    left = Structure("flight", "flight", "x", "speed", 3.0, 50.0, 0.1, "m/s^2", 1e-5)
    template = unknown_test("flight", "speed")
    ladder = replace(quiet, structure=(left,))
    for laws, why in (((), "No formula"), ((found(SQUARE),), "No other formula comes near")):
        (action,) = _actions(ladder, None, laws)
        assert action.startswith(template) and why in action
    each = found(replace(SQUARE, factors=(Factor("run"),)), others=(LINEAR,))
    assert open_form([each]) is None and "run to run" in why_no_setting(left, [each], None)
    assert "has a name" in why_no_setting(left, [found(SQUARE, others=(LINEAR,))], "air_drag")
    assert why_no_setting(replace(left, goes_with=EACH_RUN), (), None) == ""
    assert why_no_setting(replace(left, stage="measurement"), (), None) == ""


@pytest.mark.further
def test_what_is_open_comes_first(quiet, two_beginnings, monkeypatch):
    """An effect that another explains as well, then a law, then any effect that has a rival, the first or not."""
    asked = []
    monkeypatch.setattr("analysis.gap.next_test.choice.effect_tests", lambda *a: asked.append((a[2].effect, a[3])))
    shift = Cause("sensor_window_offset", "measurement", {}, 9.0, 90.0, "x", "all")
    drag = Cause("air_drag", "flight", {"rate_per_m": (0.1, 0.01)}, 5.0, 50.0, "x", "flight")
    next_tests(quiet, (shift, drag), ())
    next_tests(quiet, (shift, replace(drag, rivals=("viscous_drag",))), (found(SQUARE, others=(LINEAR,)),))
    assert [one[0] for one in asked] == ["air_drag"] * 2 and asked[1][1] == "viscous_drag"
    tests = next_tests(quiet, (shift, drag), (found(SQUARE, others=(LINEAR,)),))
    assert tests is not None and tests.law == "law-1.toml" and len(asked) == 2


def test_the_entry_has_the_keys_that_page_and_loop_read(slip):
    entry = slip.entry()
    assert set(entry) == {"effect", "rival", "law", "duration_s", "starts", "recommended", "settings"}
    assert entry["law"] == "law-1.toml" and "slip" in entry["effect"] and entry["recommended"] == slip.recommended
    assert all(set(one) == {"setting", "separation_sd", "standard_error"} for one in entry["settings"])
    axes = settings_figure(entry).axes[0]
    assert [one.get_text() for one in axes.get_yticklabels()] == [one.setting for one in slip.settings]
    assert "the formula of law-1.toml from the nearest other formula" in slip.words() and slip.words().endswith(
        (".", ").")
    )


def test_recordings_add_their_squares():
    assert [recordings_needed(sd) for sd in (30.0, 3.0, 1.5, 0.01)] == ["1", "1", "4", "more than 20"]


def test_separation_is_what_no_rival_explains_and_its_error_falls_with_the_beginnings():
    """Of rows with a known part aside: 3 sds a recording; a rival that is the same leaves nothing."""
    rng = np.random.default_rng(1)

    def judged(count, same=False):
        rival = rng.standard_normal((40 * count, 1))
        aside = np.sqrt(9 / 40) * (1 + 0.3 * np.repeat(rng.standard_normal(count), 40))
        aside = aside * rng.choice([-1.0, 1.0], 40 * count)
        moved = rival[:, 0] if same else aside + 5 * rival[:, 0]
        return separation_of(Information.of_rows(moved, rival, np.zeros(1), np.repeat(np.arange(count), 40)), count)

    value, error = judged(100)
    assert value == pytest.approx(3.0, rel=0.15) and 0 < error < 0.3
    assert np.median([judged(10)[1] for _ in range(20)]) > 2 * error
    assert judged(5, same=True)[0] < 1e-4 and np.isnan(judged(1)[1])


def test_a_setting_is_recommended_only_where_it_is_surely_better():
    def tests(best, today):
        ranked = (Separation(LOUD, *best), Separation(AS_RECORDED, *today))
        return NextTests("a", "b", 0.6, 6, ranked, "law-1.toml").recommended

    assert tests((9.0, 1.0), (5.0, 0.5)) == LOUD and tests((6.0, 1.0), (5.0, 0.5)) == AS_RECORDED
