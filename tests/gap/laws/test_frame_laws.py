"""Laws of cameras and clocks: form, size, and a series that is whole again without them.

Causes of the plant, whose code shares nothing with the search; kinds in view: no blind result."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.quiver import Quiver

from analysis.blind.recording.files import write_series
from analysis.blind.recording.markers import BOARD_M
from analysis.blind.recording.picture import BUTTON_S, REFOCUS_PX
from analysis.blind.recording.place import HOME
from analysis.blind.series import make_series
from analysis.gap.cause import two_sided
from analysis.gap.diagnose import verdict_of
from analysis.gap.ladder import run_ladder
from analysis.gap.laws.frames import asked as of_measurement
from analysis.gap.laws.frames import law as clock_law
from analysis.gap.laws.frames.changed_pictures import changed_picture_laws
from analysis.gap.laws.frames.corrected import changing, given, without_lasting_bends
from analysis.gap.laws.frames.evidence.clock import clock_rows
from analysis.gap.laws.frames.evidence.known import known_frames
from analysis.gap.laws.frames.law import find_clock_law, find_frame_laws
from analysis.gap.laws.regression.halves import Halves, halves_of
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.changed_pictures import MOST_LENS_PX, bent_picture, changed_pictures
from analysis.gap.measurement.fixed_markers import ground_motion
from analysis.gap.measurement.tests import measurement_tests
from analysis.gap.page.figures.changed_picture import boards_figure
from analysis.gap.page.laws import by_halves
from analysis.gap.tests_by_hand import unknown_test
from analysis.identify import NOT_HELD, identify
from ovines.camera.bends import bend_px
from ovines.core.laws.formula import as_latex, as_text
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.refusal import ScenarioError
from ovines.errors import InputError
from ovines.law_file import law_text
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import laws_and_ladder


def written(folder, kind, size=0.8, seed=2, laws=(), runs=2, drive="sine"):
    made = make_series(kind, size, np.random.default_rng(seed), runs, "white", place=replace(HOME, drive=drive))
    if not folder.exists():
        write_series(made, folder)
    return made, load_series(read_series(folder), folder / "results", laws)[0]


@pytest.mark.further
def test_a_zoom_that_swings_is_written_and_read_back(tmp_path):
    """Right camera, amplitude within three sd, frequency; held by the next diagnosis the ground stands still."""
    made, series = written(tmp_path / "s", "unknown_swinging_zoom")
    assert ground_motion(series)
    (law,), _ = find_frame_laws(series, np.random.default_rng(0))
    (term,) = law.law.terms
    true = made.truth["parameters"]["unknown_swinging_zoom"]
    assert (term.target, term.x, term.factors[0].quantity) == ("picture_zoom", 0.0, "time")
    assert abs(term.coefficient - true["zoom"]) < 3 * term.sd
    assert 1 / (2 * np.pi * term.factors[0].scale) == pytest.approx(true["frequency_hz"], rel=2e-3)
    assert law.closed > 0.9 and law.halves.agree
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law.law, "zoom"))
    assert not ground_motion(written(tmp_path / "s", "unknown_swinging_zoom", laws=[path])[1])
    # Identification has no tracks to take it out of, and says so.
    recording = series.recordings[0]
    model = recording.model.model_copy(update={"laws": (str(path),)})
    stated = replace(recording, settings=recording.settings.model_copy(update={"model": model}))
    assert NOT_HELD in identify(series.motions[0], stated).notes


@pytest.mark.further
def test_a_camera_that_was_touched_as_a_run_began_rings_out(tmp_path):
    """One wave that fades, not three of neighbouring rates: frequency and time, and the ground stands still without
    it."""
    made, series = written(tmp_path / "s", "unknown_pressed_button")
    (law,), corrected = find_frame_laws(series, np.random.default_rng(0))
    true = made.truth["parameters"]["unknown_pressed_button"]
    assert law.closed > 0.9 and law.halves.agree
    assert [term.target for term in law.law.terms] == ["picture_v", "picture_u"], as_text(law.law)
    for term in law.law.terms:
        wave, fades = term.factors
        assert (wave.quantity, fades.quantity, fades.function) == ("time", "time", "exponential")
        assert 1 / (2 * np.pi * wave.scale) == pytest.approx(true["frequency_hz"], rel=5e-3)
        assert fades.scale == pytest.approx(BUTTON_S, rel=0.1)
    size_px = np.linalg.norm([term.coefficient for term in law.law.terms])
    assert size_px == pytest.approx(true["button_px"], rel=0.02)
    assert ground_motion(series) and not ground_motion(corrected)


@pytest.mark.further
@pytest.mark.parametrize("drive", ["sine", "two_lines"])
def test_a_frame_that_all_cameras_skip_is_a_step_of_the_clock(tmp_path, drive):
    """A period, at the share of the run; in true times the Host keeps its drive."""
    made, series = written(tmp_path / "s", "unknown_skipped_frame", drive=drive)
    law, after = find_clock_law(series, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    (factor,) = term.factors
    at = made.truth["parameters"]["unknown_skipped_frame"]["at_share_of_run"]
    assert (term.target, factor.quantity, factor.function) == ("clock_delay", "share", "below")
    assert -term.coefficient == pytest.approx(series.period_s, rel=0.03)
    assert factor.scale == pytest.approx(at, abs=0.01)
    before, left = (np.mean(clock_rows(one).problem.residual ** 2) for one in (series, after))
    assert left < 1.3 < 0.1 * before
    # Its figure: in each bin of the share the step, and nothing beside the law (the bin of the step holds both).
    shown = law.evidence
    early = shown.covariate < at
    whole = np.isin(shown.law, (shown.law.min(), shown.law.max()))
    assert np.allclose(
        shown.before[whole], np.where(early, term.coefficient, 0)[whole], rtol=0, atol=0.1 * series.period_s
    )
    assert np.allclose(shown.after, 0, rtol=0, atol=0.1 * series.period_s)


@pytest.mark.others_further
@pytest.mark.parametrize("drive", ["sine", "chirp"])
def test_a_trigger_whose_every_other_frame_is_late_alternates(tmp_path, drive):
    """Seen at the highest frequency that frames can tell; a drive that sweeps has no lines beside which it is seen,
    but a path that is smoother."""
    made, series = written(tmp_path / "s", "unknown_alternating_clock", runs=3, drive=drive)
    law, _ = find_clock_law(series, np.random.default_rng(0))
    assert law is not None
    (term,) = law.law.terms
    (factor,) = term.factors
    assert (term.target, factor.quantity, factor.function) == ("clock_delay", "time", "cosine")
    assert np.pi * factor.scale == pytest.approx(series.period_s, rel=1e-3)
    true = made.truth["parameters"]["unknown_alternating_clock"]["alternate_s"]
    assert abs(2 * abs(term.coefficient) - true) < 3 * 2 * term.sd
    assert law.closed > 0.9


def test_no_clock_puts_frames_out_of_their_order(monkeypatch):
    """Every other frame late by more than a period, or times off by whole frames: no camera films so, whatever fits the
    Host's path; nothing is measured by such times."""
    law = SimpleNamespace(law=None)
    monkeypatch.setattr(clock_law, "clock_rows", lambda series, by_lines=True: None)
    monkeypatch.setattr(clock_law, "_law_of", lambda rows, series, rng: [law])
    measured = []
    monkeypatch.setattr(clock_law, "without_frame_laws", lambda series, laws: measured.append(laws))

    def corrected(times):
        monkeypatch.setattr(clock_law, "true_times", lambda series, law: [np.array(times)])
        return find_clock_law(as_it_came, np.random.default_rng(0))

    run = SimpleNamespace(data=SimpleNamespace(time_s=np.arange(4.0), host=SimpleNamespace(smooth=(None,) * 4)))
    as_it_came = SimpleNamespace(period_s=1.0, runs=[run])
    assert corrected([0.0, 1.2, 2.0, 3.2])[0] is law
    assert corrected([0.0, 1.6, 2.0, 3.6]) == (None, as_it_came)
    assert corrected([0.0, 2.2, 2.0, 4.2]) == (None, as_it_came)
    assert corrected([0.0, 1.8, 3.6, 5.4]) == (None, as_it_came)
    assert len(measured) == 1


@pytest.mark.further
def test_an_uneven_clock_is_unknown_and_no_drift_of_friction(tmp_path):
    """Both cameras agree with each other: before, friction_drift was named."""
    series = written(tmp_path / "s", "unknown_uneven_clock", seed=[32, 0])[1]
    (law,), ladder = laws_and_ladder(series)
    assert (verdict_of(ladder), ladder.structure[0].stage, ladder.causes) == ("unknown", "measurement", ())
    assert law.law.stage == "measurement"
    assert "time stamps" in unknown_test("measurement", ladder.structure[0].goes_with)


@pytest.mark.further
def test_a_dropped_frame_of_one_camera_is_a_step_of_its_delay(loaded):
    _, series = loaded("unknown_lost_frame", 0.8, 2, runs=2)
    laws, _ = find_frame_laws(series, np.random.default_rng(0))
    term = laws[0].law.terms[0]
    assert (term.target, term.x, term.factors[0].function) == ("camera_delay", 1.0, "below")
    assert -term.coefficient == pytest.approx(series.period_s, rel=0.03)


@pytest.mark.parametrize("noise", ["ar1", "warp"])
def test_cameras_without_fault_have_no_law(loaded, noise):
    _, series = loaded("none", 1.0, 8, noise, 2)
    assert find_frame_laws(series, np.random.default_rng(0))[0] == ()


def test_a_law_of_frames_follows_what_is_known_of_them():
    """No speed of the disk in a camera's law, no share of a run in a force, no camera one and a half."""
    with pytest.raises(ScenarioError, match="speed in a law of the measurement"):
        WrittenLaw((Term("picture_u", 1.0, (Factor("speed"),)),))
    with pytest.raises(ScenarioError, match="share in a law of the flight"):
        WrittenLaw((Term("outwards", 1.0, (Factor("share"),)),))
    with pytest.raises(ScenarioError, match=r"camera 1\.5"):
        Term("picture_u", 1.0, x=1.5)


def halves(second):
    """A law of size 1 in the first, third, ... of eight runs and of size ``second`` in the others."""
    rng = np.random.default_rng(1)
    run = np.repeat(np.arange(8), 50)
    moved = rng.standard_normal(400)
    residual = moved * np.where(run % 2 == 1, second, 1.0) + rng.standard_normal(400)
    return halves_of(Regression(residual, np.ones((400, 1)), np.zeros(1), run, run), moved)


def test_halves_that_disagree_say_so():
    assert halves(1.0).agree and not halves(0.3).agree
    # However narrow noise makes the intervals: nothing is known better than to a hundredth.
    assert Halves((1.002, 0.998), (0.001, 0.001)).agree and not Halves((1.03, 0.97), (0.001, 0.001)).agree
    assert "Do not use this law" in by_halves(halves(0.3))
    assert "agree." in by_halves(Halves((1.0, 1.0), (0.1, 0.1)))
    assert halves(0.3).entry()["sizes"][1]["value"] == pytest.approx(0.3, abs=0.25)


def slid(size):
    """Halves of a law of ``size`` that acts in the seven blows which slid, five of them in one run of eight."""
    rng = np.random.default_rng(2)
    run = np.repeat(np.arange(8), 20)
    slides = np.zeros(160)
    slides[[80, 84, 88, 92, 96, 121, 141]] = 1.0
    moved = slides * np.array([0.3, 0.9, 0.4, 0.8, 0.6, 0.5, 0.7])[np.cumsum(slides).astype(int) - 1] * 100.0
    residual = size * moved + rng.standard_normal(160)
    nuisances = np.column_stack([slides, 1.0 - slides])
    return halves_of(Regression(residual, nuisances, np.zeros(2), np.arange(160), run), moved)


def test_few_blows_in_few_runs_are_halved_themselves():
    """Of the runs one half holds a single blow that slid, and the wall's friction is free in it: it tells nothing."""
    found = slid(1.0)
    assert found.agree and found.both_show_it
    assert found.sizes == pytest.approx((1.0, 1.0), abs=0.1)
    assert not slid(0.0).both_show_it


def test_one_run_tells_nothing_of_what_goes_with_the_run():
    """The constant takes it but for the last digits, and a size of 1e11 came of these; halves of the impacts do."""
    rng = np.random.default_rng(3)
    run = np.repeat(np.arange(3), 40)
    moved = 8.0 / 3.0 * run
    problem = Regression(moved + rng.standard_normal(120), np.ones((120, 1)), np.zeros(1), np.arange(120), run)
    assert halves_of(problem, moved).sizes == pytest.approx((1.0, 1.0), abs=0.3)


@dataclass(frozen=True)
class Asked:
    """Of a ladder what the search for laws of the measurement asks: what it tells and how its flights fit."""

    flights: SimpleNamespace
    structure: tuple[SimpleNamespace, ...]
    measured: str
    measurement: SimpleNamespace
    drive: None = None
    causes: tuple[SimpleNamespace, ...] = ()


def asked(misfit, stage="measurement", measured="as it came"):
    fits = [SimpleNamespace(misfit=np.full(3, 9 * misfit), freedom=np.array([9, 9, 0]))]
    left = SimpleNamespace(stage=stage, strength=1.0, weight=1.0, is_taken_out=False)
    return Asked(
        SimpleNamespace(nominal=SimpleNamespace(fits=fits)), (left,), measured, SimpleNamespace(clock_change=None)
    )


def a_law():
    sure = {"halves": Halves((1.0, 1.0), (0.1, 0.1)), "shrinkage": lambda rng: (1.0, 0.9, 1.1)}
    return SimpleNamespace(closed=1.0, law=SimpleNamespace(terms=()), **sure)


@pytest.fixture
def searches(monkeypatch):
    """Function that sets what the searches of laws of the measurement find: those of frames and of the clock a law and
    a series, that of the disk's picture laws with theirs; nothing where nothing is said.  Misfits: of the flights of
    the series that they leave."""

    def found(misfits, frames=None, picture=(), clock=None):
        monkeypatch.setattr(of_measurement, "find_way_law", lambda series, rng: None)
        monkeypatch.setattr(of_measurement, "find_blow_law", lambda series, rng: None)
        monkeypatch.setattr(of_measurement, "changed_picture_laws", lambda series: ())
        monkeypatch.setattr(of_measurement, "drifting_clock_law", lambda series, drive: None)
        monkeypatch.setattr(of_measurement, "delay_follows", lambda series: False)
        monkeypatch.setattr(of_measurement, "find_frame_laws", lambda series, rng: frames or ((), series))
        monkeypatch.setattr(of_measurement, "find_marker_laws", lambda series, rng: ((), series))
        monkeypatch.setattr(of_measurement, "find_disk_picture_laws", lambda series, rng: list(picture))
        monkeypatch.setattr(of_measurement, "find_clock_law", lambda series, rng: clock or (None, series))
        monkeypatch.setattr(of_measurement, "typical_misfit", lambda series: misfits.get(series, 1.17))
        monkeypatch.setattr(of_measurement, "_tilt_law", lambda now, rng, withheld: now)
        monkeypatch.setattr(of_measurement, "_card_law", lambda now, rng, withheld: now)
        monkeypatch.setattr(
            of_measurement, "run_ladder", lambda series, rng, withheld: asked(misfits[series], measured=series)
        )

    return found


@pytest.mark.parametrize("stage", ["measurement", "flight"])
def test_a_law_of_frames_that_the_flights_do_not_believe_is_none(searches, stage):
    """A drive that sweeps passes for a clock (a chirp of the second trial did): the disk's flights then fit worse."""
    law, before = a_law(), asked(1.17, stage)
    searches({"corrected": 2.04, "in other times": 2.04}, ((law,), "corrected"), clock=(law, "in other times"))
    assert of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset()) == ((), before)


@pytest.mark.parametrize(
    ("misfit", "size_m", "halves", "taken_out"),
    [
        (1.10, 2e-5, (1.0, 0.9), True),
        (1.165, 2e-5, (1.0, 0.9), False),  # flights fit by less than 1 % better
        (1.10, 1e-5, (1.0, 0.9), False),  # what moves by less counts as still
        (1.10, 2e-5, (1.0, 0.3), False),  # the halves of the runs tell otherwise
    ],
)
def test_a_tracker_stays_behind_where_flights_fit_better_without_it(
    searches, monkeypatch, misfit, size_m, halves, taken_out
):
    """It is taken out before anything else is asked, and reported beside what is left then."""
    law = SimpleNamespace(size=size_m, halves=Halves(halves, (0.1, 0.1)), law=SimpleNamespace(terms=()))
    before = asked(1.17, "flight", SimpleNamespace(contact_radius_m=0.04))
    searches({"caught up": misfit})
    monkeypatch.setattr(of_measurement, "find_way_law", lambda series, rng: law)
    monkeypatch.setattr(of_measurement, "without_frame_laws", lambda series, laws: "caught up")
    behind = SimpleNamespace(stage="measurement", strength=9, weight=9)
    monkeypatch.setattr(of_measurement, "_way_structure", lambda law, ladder: behind)
    found, after = of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset())
    assert found == ((law,) if taken_out else ())
    if taken_out:
        assert after.structure[0] is behind and after.measured is before.measured


LASTS, NAMED, LEFT = "finite_contact_time", "table_tilt", "flight"


@pytest.mark.parametrize(
    ("before", "after", "misfits", "size_m", "halves", "taken_out"),
    [
        (((), (LEFT,)), ((), ()), (1.17, 1.17), 2e-5, (1.0, 0.9), True),
        (((NAMED,), (LEFT,)), ((NAMED,), (LEFT,)), (1.17, 1.10), 2e-5, (1.0, 0.9), True),
        (((NAMED,), (LEFT,)), ((NAMED,), (LEFT,)), (1.17, 1.165), 2e-5, (1.0, 0.9), False),  # fit by less than 1 %
        (((), (LEFT,)), ((), ()), (1.17, 1.17), 1e-5, (1.0, 0.9), False),  # what moves by less counts as still
        (((), (LEFT,)), ((), ()), (1.17, 1.17), 2e-5, (1.0, 0.1), False),  # a half does not show it
        (((LASTS,), ()), ((), ()), (1.17, 1.17), 2e-5, (1.0, 0.9), False),  # a contact that lasts explains all
        (((LASTS,), (LEFT,)), ((), ()), (1.17, 1.17), 2e-5, (1.0, 0.9), True),
        (((LASTS,), ()), ((LASTS,), (LEFT,)), (1.17, 1.10), 2e-5, (1.0, 0.9), False),
        (((), (LEFT,)), ((), ()), (1.17, 1.19), 2e-5, (1.0, 0.9), False),  # flights fit worse without it
    ],
)
def test_places_hold_something_of_others_where_less_is_left_without_it(
    searches, monkeypatch, before, after, misfits, size_m, halves, taken_out
):
    """Or as much, and flights fit better; a contact that lasts cuts corners, too."""

    def ladder(named, left, misfit, measured):
        one = asked(misfit, LEFT, measured)
        structure = tuple(SimpleNamespace(stage=stage, is_taken_out=False) for stage in left)
        return replace(one, causes=tuple(SimpleNamespace(effect=name) for name in named), structure=structure)

    law = SimpleNamespace(
        size=size_m,
        halves=Halves(halves, (0.1, 0.1)),
        law=SimpleNamespace(terms=(Term("marker_neighbour", 0.1, x=-1e-3),)),
        p=0.01,
        before=np.ones(1),
        after=np.zeros(1),
    )
    first = ladder(*before, misfits[0], SimpleNamespace(contact_radius_m=0.04))
    again = ladder(*after, misfits[1], "sharp")
    searches({})
    monkeypatch.setattr(of_measurement, "find_blow_law", lambda series, rng: law)
    monkeypatch.setattr(of_measurement, "without_frame_laws", lambda series, laws: "sharp")
    monkeypatch.setattr(of_measurement, "run_ladder", lambda series, rng, withheld: again)
    monkeypatch.setattr(of_measurement, "typical_misfit", lambda series: misfits[series == "sharp"])
    now = of_measurement._Now((), first.measured, first, first)
    found = of_measurement._blow_law(now, np.random.default_rng(0), frozenset())
    assert (found.laws, found.ladder) == (((law,), again) if taken_out else ((), first))


def test_the_card_is_asked_of_the_series_without_what_other_laws_say(searches, monkeypatch):
    """And what was reported of the measurement stays reported beside it."""
    law, card, before, asked_of = a_law(), a_law(), asked(1.17), []
    moves = SimpleNamespace(stage="measurement", strength=9, weight=9)
    searches({"corrected": 1.1}, ((law,), "corrected"))

    def of_card(now, rng, withheld):
        asked_of.append(now.series)
        return now.with_laws([card], asked(1.05, "flight", "without the card, too"), [moves])

    monkeypatch.setattr(of_measurement, "_card_law", of_card)
    found, after = of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset())
    assert found == (law, card) and asked_of == ["corrected"]
    assert [one.stage for one in after.structure] == ["measurement", "measurement", "flight"]
    assert after.measured == before.measured


def test_a_clock_that_drifts_from_run_to_run_is_reported_beside_what_else_is(searches, monkeypatch):
    """It is taken out before anything else is asked."""
    drift, drifts, before = (
        a_law(),
        SimpleNamespace(stage="measurement", strength=5.0, weight=5.0, is_taken_out=False),
        asked(1.17, "flight"),
    )
    searches({"in other times": 1.17})
    monkeypatch.setattr(of_measurement, "drifting_clock_law", lambda series, drive: (drift, drifts))
    monkeypatch.setattr(of_measurement, "without_frame_laws", lambda series, laws: "in other times")
    found, after = of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset())
    assert found == (drift,) and after.structure[0] is drifts and after.measured == before.measured


def test_a_delay_that_a_pictures_law_takes_away_is_not_reported():
    """Points that a picture moves in some runs seem moved by a late camera; where one is late still, it is kept."""
    delay, shift = SimpleNamespace(stage="measurement"), SimpleNamespace(stage="measurement")
    before, after = (SimpleNamespace(measurement=SimpleNamespace(clock_change=one)) for one in (delay, None))
    laws = {
        target: SimpleNamespace(law=WrittenLaw((Term(target, 1.0, (Factor("run"),), 1.0),)))
        for target in ("picture_u", "camera_delay")
    }
    left = of_measurement._without_spurious_delay([delay, shift], (laws["picture_u"],), before, after)
    assert left == [shift]
    assert of_measurement._without_spurious_delay([delay, shift], tuple(laws.values()), before, after) == [delay, shift]
    assert of_measurement._without_spurious_delay([delay, shift], (laws["picture_u"],), before, before) == [
        delay,
        shift,
    ]


@pytest.mark.parametrize(("first", "second", "kept"), [(1.5, 1.19, None), (1.3, 1.175, 1), (1.1, 1.16, 0)])
def test_a_picture_of_the_disk_is_the_cameras_whose_law_the_flights_believe(searches, first, second, kept):
    """Two views say only how they miss each other, so that each camera has its law: the one is right without which the
    flights fit best, and none where they fit worse without either than with both."""
    laws, before = (a_law(), a_law()), asked(1.17)
    searches({"first": first, "second": second}, picture=[(laws[0], "first"), (laws[1], "second")])
    found, after = of_measurement.measurement_laws(before, np.random.default_rng(0), frozenset())
    assert found == (() if kept is None else (laws[kept],))
    assert of_measurement._misfit(after) == pytest.approx(1.17 if kept is None else (first, second)[kept])
    assert after.measured == before.measured and after.structure == before.structure


@pytest.mark.further
def test_a_camera_with_a_clock_of_its_own_has_a_law(tmp_path):
    """A delay that grows through the run.  Values between its frames fit the flights worse whatever their times; the
    law is held against a camera that is always late.  A form that bends in the Host's path as nothing does says nothing
    of which camera it is: it had said the first."""
    made = make_series("unknown_free_running_camera", 0.8, np.random.default_rng(54), runs=3, noise="ar1")
    write_series(made, tmp_path / "series")
    series, _ = load_series(read_series(tmp_path / "series"), tmp_path / "results")
    ladder = run_ladder(series, np.random.default_rng(0))
    (law,), _ = of_measurement.measurement_laws(ladder, np.random.default_rng(0), frozenset())
    assert {term.target for term in law.law.terms} == {"camera_delay"}
    assert law.closed > 0.8
    time_s = series.runs[0].data.time_s
    late_s = given(law.law.terms, known_frames(time_s, series.runs[0].data, series.runs[0].flights))
    rate = np.polyfit(time_s, late_s, 1)[0]
    assert rate == pytest.approx(made.truth["parameters"]["unknown_free_running_camera"]["free_running"], rel=0.25)


@pytest.mark.further
@pytest.mark.parametrize(
    ("kind", "target"),
    [("unknown_refocused_lens", "picture_radial"), ("unknown_knocked_lens", "picture_decentring")],
)
def test_a_lens_that_has_changed_is_left_and_has_its_law(tmp_path, loaded, kind, target):
    """It had been a wrong length scale, a tilted plane, a window: none of them is found beside it.  Held by the next
    diagnosis nothing of it is left."""
    true, series = loaded(kind, 0.8, 2, runs=2)
    (structure,) = changed_pictures(series)
    assert (structure.stage, structure.unit) == ("measurement", "px") and structure.p < 1e-4
    (law,) = changed_picture_laws(series)
    (term,) = law.law.terms
    px = true["refocused_px"] / REFOCUS_PX**3 if "refocused_px" in true else true["knocked_px"] / REFOCUS_PX**2
    assert (term.target, term.x) == (target, 0.0)
    assert term.coefficient == pytest.approx(px, rel=0.02)
    assert law.closed > 0.95 and set(law.numbers) >= {"coefficient"}
    tests = measurement_tests(series)
    assert not [name for name, one in tests.findings.items() if one.found]
    laws, ladder = laws_and_ladder(series)
    assert (
        verdict_of(ladder) == "unknown" and ladder.causes == () and target in [one.law.terms[0].target for one in laws]
    )
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law.law, "lens"))
    _, again = loaded(kind, 0.8, 2, runs=2, laws=(path,))
    assert changed_pictures(again) == []
    assert not [name for name, one in measurement_tests(again).findings.items() if one.found]


@pytest.mark.further
@pytest.mark.parametrize("kind", ["unknown_stretched_board", "unknown_bowed_board", "unknown_skewed_picture"])
def test_boards_that_were_not_true_and_a_skew_have_their_law(tmp_path, loaded, kind):
    """They had been a wrong length scale and a tilted plane.  Held by the next diagnosis nothing of them is left."""
    true, series = loaded(kind, 0.8, 5, runs=2)
    (structure,) = changed_pictures(series)
    assert (structure.stage, structure.unit) == ("measurement", "px") and structure.p < 1e-4
    assert "boards" in structure.goes_with or "skewed" in structure.goes_with
    (law,) = changed_picture_laws(series)
    (term,) = law.law.terms
    expected = {
        "unknown_stretched_board": ("board_stretch", true.get("board_stretch")),
        "unknown_bowed_board": ("board_bow", true.get("board_bow", 0.0) / BOARD_M**2),
        "unknown_skewed_picture": ("picture_skew", true.get("skewed")),
    }[kind]
    assert term.target == expected[0] and term.coefficient == pytest.approx(expected[1], rel=0.1)
    assert law.closed > 0.95
    assert not [name for name, one in measurement_tests(series).findings.items() if one.found]
    path = tmp_path / "law-1.toml"
    path.write_text(law_text(law.law, "boards"))
    _, again = loaded(kind, 0.8, 5, runs=2, laws=(path,))
    assert changed_pictures(again) == []
    assert not [name for name, one in measurement_tests(again).findings.items() if one.found]


@pytest.mark.further
def test_a_picture_that_is_bent_more_than_a_calibration_leaves_is_left(loaded):
    """Markers that bloom bend it in no form; a lens residual that is tolerated is none."""
    _, series = loaded("unknown_blooming_markers", 1.0, 3, runs=3)
    assert changed_pictures(series) == []
    (structure,) = bent_picture(series)
    assert structure.is_taken_out and structure.stage == "measurement" and structure.size > MOST_LENS_PX
    assert structure.p == two_sided(series.lens_sds) < 1e-4
    assert "do not trust a tilt" in unknown_test(structure.stage, structure.goes_with)
    _, plain = loaded("none", 1.0, 8, "warp", 2)
    assert 0.1 < max(plain.picture_bends_px.values()) < MOST_LENS_PX and bent_picture(plain) == []


def test_what_does_not_hold_in_other_runs_is_no_change_of_a_camera(loaded):
    """Markers that bloom towards others look like a stretch, likelier by e^9 and more, and another one in each run."""
    _, series = loaded("unknown_blooming_markers", 1.0, 3, runs=3)
    assert series.picture_changes == ()


def test_a_lasting_bend_is_taken_out_of_tracks_as_it_was_put_in(loaded):
    """To a ten-thousandth of a pixel; a camera that is not there is refused."""
    _, series = loaded("none", 1.0, 8, "ar1", 2)
    recording, cameras = series.recordings[0], series.cameras
    law = WrittenLaw((Term("picture_decentring", 6e-6, (), 1.0, 0.7),))
    tracks = series.tracks[0]
    own = tracks["camera"] == cameras[1].name
    offset = np.asarray(recording.window_offset_px[cameras[1].name], float)
    uv = tracks.loc[own, ["u_px", "v_px"]].to_numpy(float) + offset
    bent = tracks.copy()
    moved = bend_px("picture_decentring", 0.7, uv - cameras[1].matrix[:2, 2])
    bent.loc[own, ["u_px", "v_px"]] = uv + 6e-6 * moved - offset
    back = without_lasting_bends(bent, cameras, recording, [law])
    np.testing.assert_allclose(back[["u_px", "v_px"]], tracks[["u_px", "v_px"]], rtol=0, atol=1e-4)
    assert np.max(np.abs(bent["u_px"] - tracks["u_px"])) > 0.1
    assert changing([law]) == []
    with pytest.raises(InputError, match="camera 3"):
        without_lasting_bends(tracks, cameras, recording, [WrittenLaw((replace(law.terms[0], x=2.0),))])


def test_a_law_of_boards_reads_and_turns_with_the_world():
    """In words and as a formula; in a turned and shifted world it is written for that one."""
    longer_one_way = WrittenLaw((Term("board_stretch", 0.0049, (), 0.3),))
    assert as_text(longer_one_way) == "place by the boards += 0.0049 * place_along(0.3 rad)"
    assert r"(\vec e_{\varphi}\cdot\vec x)" in as_latex(longer_one_way)
    (term,) = longer_one_way.moved(0.5, (1.0, 2.0)).terms
    assert term.x == pytest.approx(0.8)
    (term,) = WrittenLaw((Term("board_bow", 2.0, (), 0.1, 0.0),)).moved(np.pi / 2, (1.0, 2.0)).terms
    assert (term.x, term.y) == pytest.approx((1.0, 2.1))


def test_the_figure_of_a_law_of_boards_has_arrows_of_its_moves():
    """Those of a stretch lie along it, whatever is far away."""
    figure = boards_figure(Term("board_stretch", 0.005, (), 0.0), np.array([2.0, -0.3]), 0.03)
    (arrows,) = [one for one in figure.axes[0].collections if isinstance(one, Quiver)]
    assert np.abs(arrows.V).max() < 1e-9 and arrows.U.max() == pytest.approx(-arrows.U.min())
    assert "up to 0.24 mm" in figure.axes[0].get_xlabel()
