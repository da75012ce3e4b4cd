"""What is left and what is not: causes that a few probes do not know, and drives that pass for something."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.flights.equation.parameters import INDEX
from analysis.gap import written_laws
from analysis.gap.cause import Structure
from analysis.gap.drive.steps import drive_steps
from analysis.gap.ladder import run_ladder
from analysis.gap.laws.belief import believed
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.regression.halves import Halves
from analysis.gap.prediction.probabilities import ABSENT, probability_of_left
from analysis.gap.selection import flight_candidates
from analysis.gap.selection.flight_candidates import Gain, Units
from analysis.gap.selection.flight_steps import first_flights, select_flight_effects
from analysis.gap.selection.flights.terms import FlightTerm
from analysis.gap.selection.unfitted_flights import outlying_flights, unexplained_misfit
from analysis.gap.written_laws import write_laws
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from tests.gap.conftest import brought


def series_of(folder, kind, size, seed, runs, noise, drive="sine"):
    """A series of the blind plant as the diagnosis reads it, and its truth."""
    made = make_series(kind, size, np.random.default_rng(seed), runs, noise, place=Place(drive=drive))
    return made, brought(made, folder / "series")


@pytest.mark.further
def test_a_rise_and_fall_under_a_random_drive_is_neither_a_late_camera_nor_a_force(tmp_path):
    made, series = series_of(tmp_path, "vertical_motion+sensor_window_offset", 0.6, 3, 3, "ar1", "random")
    ladder = run_ladder(series, np.random.default_rng(0))
    assert {cause.effect for cause in ladder.causes} == {"vertical_motion", "sensor_window_offset"}
    assert not ladder.structure and ladder.measurement.clock_change is None
    amplitude = next(cause for cause in ladder.causes if cause.effect == "vertical_motion").parameters["amplitude_m"]
    true = made.truth["parameters"]["vertical_motion"]["amplitude_m"]
    assert abs(amplitude[0] - true) < 3 * max(amplitude[1], 2e-3 * true)


@pytest.mark.parametrize(("named", "over", "accepted"), [(True, 1.01, True), (False, 1.01, False), (False, 1.2, True)])
def test_what_has_no_name_is_left_only_where_it_is_surely_more_than_negligible(named, over, accepted):
    """Recoil under a sine and sway beside jitter had left 1.008 and 1.002 of what is negligible in phase with the
    drive."""
    term = FlightTerm("force with the drive's phase", ("force_cos_x",), named)
    gain = Gain(term, 500.0, 400.0, np.ones(1), np.full(1, 0.05), 20.0, 1.0, over * 0.02)
    assert flight_candidates.accepted(gain, 50.0, Units({}, 0.02)) is accepted


@pytest.mark.further
def test_a_load_of_the_floor_that_nobody_stated_is_reached(tmp_path):
    """It goes from 0 to 1 by steps that are shortened: three of them left a tenth, and a force that followed the rise
    and fall."""
    _, series = series_of(tmp_path, "vertical_motion", 1.1, 3, 2, "white", "start_up")
    steps = select_flight_effects(
        series, ("floor_friction", "spin_coupling"), frozenset(), False, np.random.default_rng(0)
    )
    assert [cause.effect for cause in steps.causes] == ["vertical_motion"] and not steps.structure
    assert steps.fitted.model.parameters[INDEX["load"]] == pytest.approx(1.0, abs=0.02)


@pytest.mark.further
def test_slow_lines_of_a_few_runs_are_those_of_their_drive(tmp_path):
    """Of a random drive some runs look like lines, and leave others beside them."""
    _, series = series_of(tmp_path, "none", 1.0, 7, 2, "white", "random")
    fits = first_flights(series, ("floor_friction", "spin_coupling")).fits
    assert not drive_steps(series, fits, frozenset(), False)[0].causes


def fits_of(misfits, rests=()):
    """A run of flights of 40 frames with these misfits per degree of freedom, as far as they are asked for."""
    flights = [SimpleNamespace(first=40 * k, last=40 * k + 39) for k in range(len(misfits))]
    freedom = np.full(len(misfits), 114)
    return SimpleNamespace(flights=flights, misfit=misfits * freedom, freedom=freedom, rests=lambda k: k in rests)


@pytest.mark.parametrize(("wrong", "rests", "left"), [(1, (), False), (9, (), True), (9, range(9), False)])
def test_many_flights_that_no_law_fits_are_left(wrong, rests, left):
    """One of fifty hides an impact; nine of fifty, left out of every fit, are a law that is missing; a disk at rest
    shows none."""
    misfits = np.random.default_rng(1).uniform(0.8, 1.2, 50)
    misfits[:wrong] = 15.0
    runs = (fits_of(misfits, rests),)
    assert outlying_flights(runs) == (0 if rests else wrong, 50 - len(rests))
    fit = SimpleNamespace(fits=runs, misfit=1.0, count=1)
    found = unexplained_misfit(fit, (), (), False)
    assert [one.stage for one in found] == (["flight"] if left else [])
    assert not unexplained_misfit(fit, found, (), False)


@pytest.fixture(scope="module")
def nick(tmp_path_factory):
    """A series whose disk has a nick in its rim, and its ladder."""
    made, series = series_of(tmp_path_factory.mktemp("nick"), "unknown_nicked_disk", 0.4, 21, 4, "white")
    return made, run_ladder(series, np.random.default_rng(0))


ALIKE = Halves((1.0, 1.0), (0.1, 0.1))
DRAG = WrittenLaw((Term("along_sliding", -0.4, (Factor("sliding_speed"),)),))


@pytest.mark.further
@pytest.mark.parametrize(
    ("times_negligible", "closed", "halves", "left", "counts"),
    [
        (3.0, 0.9, ALIKE, (), True),
        (0.9, 0.9, ALIKE, (), False),
        (3.0, 0.4, ALIKE, (), False),
        (3.0, 0.9, Halves((1.2, 0.8), (0.05, 0.05)), (), False),
        (3.0, 0.9, Halves((1.0, 0.5), (0.1, 0.43)), (), False),  # one half alone
        (3.0, 0.9, None, (), False),
        (3.0, 0.9, ALIKE, ("drive",), False),
        (0.9, 0.4, None, ("flight",), True),
    ],
)
def test_a_law_of_flights_that_no_probe_asks_for_counts_where_it_is_surely_there(
    nick, monkeypatch, times_negligible, closed, halves, left, counts
):
    """More than negligible, most of what is left, alike in both halves, the measurement and the Host without a doubt;
    where a probe has found something, what closes a tenth is reported."""
    _, ladder = nick
    units = ladder.flights.units
    structure = Structure("flight", "free flight", "x", "the speed", 2.0, 30.0, 0.01, "m/s^2", 1e-4)
    ladder = replace(ladder, structure=tuple(replace(structure, stage=stage) for stage in left))
    law = SimpleNamespace(
        law=DRAG, rig_law=DRAG, closed=closed, size=times_negligible * units.negligible_m_per_s2, p=1e-6,
        halves=halves, before=np.ones(8), after=np.zeros(8), fitted=None, shrinkage=lambda rng: (closed, 0.5, 1.0),
    )  # fmt: skip

    def found(runs, steps, frame, rng, least_m_per_s2, search):
        return (law, steps) if law.size >= least_m_per_s2 else (None, steps)

    monkeypatch.setattr(written_laws.FlightSearch, "of", lambda runs, fitted, rng: None)
    monkeypatch.setattr(written_laws, "find_flight_law", found)
    one, after = written_laws._flight_law(ladder, set(left), np.random.default_rng(0), frozenset())
    assert (one is law) == counts
    assert [s.stage for s in after.structure] == [*left, *(["flight"] if counts and not left else [])]
    if counts and not left:
        assert after.structure[0].goes_with == "the speed against the floor"


def test_a_law_that_no_probe_asks_for_closes_in_whichever_runs_are_drawn():
    """One run of six makes it: drawn without that it closes nothing (practice-14 hides such a glancing impact)."""
    fine = {"size": 3.0, "halves": ALIKE, "floor": np.full(6, 0.1)}

    def is_believed(before, after):
        none = {name: None for name in ("law", "rig_law", "numbers", "p", "others")}
        law = LawFound(**none, before=np.array(before), after=np.array(after), **fine)
        assert law.closed > 0.9
        return believed(law, 3.0, 1.0) is law

    assert is_believed(np.full(6, 1.0), np.full(6, 0.12))
    assert not is_believed([5.0, 0.1, 0.1, 0.1, 0.1, 0.1], [0.1, 0.101, 0.1, 0.1, 0.1, 0.1])


@pytest.mark.further
def test_a_law_of_impacts_that_no_probe_asks_for_is_found_and_left(nick):
    """A nick in the disk's rim takes 0.07 of the restitution where it meets the wall."""
    made, ladder = nick
    assert "impact" not in {one.stage for one in ladder.structure}
    laws, ladder = write_laws(ladder, np.random.default_rng(1), frozenset())
    left = next(one for one in ladder.structure if one.stage == "impact")
    assert (left.coordinate, left.goes_with) == ("normal", "the direction of the contact seen from the disk")
    assert left.strength > 1.0 and left.p < 0.01 / 4
    assert len(laws) == 1 and laws[0].closed > 0.8
    # The same impacts without the nick: nothing.
    impacts = ladder.impacts.fitted
    assert impacts is not None
    rng = np.random.default_rng(5)
    data = impacts.data
    fresh = 0.7 * data.before + np.hypot(data.normal_sd, 0.02 * data.before) * rng.standard_normal(len(data))
    plain = replace(ladder.impacts, fitted=replace(impacts, data=replace(data, after=fresh)))
    plain = replace(ladder, impacts=plain, structure=())
    _, left, _ = written_laws._contact_laws(plain, plain.flights.fitted.fits, np.random.default_rng(1), frozenset())
    assert "impact" not in {one.stage for one in left}
    assert made.truth["effect"] == "unknown_nicked_disk"


def test_what_a_series_would_not_show_may_be_left():
    assert probability_of_left(1e-9, 1.0) > 0.99
    # Of a series that shows nothing of what may be left only the prior is known, whatever chance says.
    assert probability_of_left(1.0, 0.0) == pytest.approx(1 - ABSENT)
    probabilities = [probability_of_left(1.0, share) for share in np.linspace(0.0, 1.0, 6)]
    assert probabilities == sorted(probabilities, reverse=True)
