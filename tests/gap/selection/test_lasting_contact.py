"""Contacts that last, by a plant that shares no code with the diagnosis: what they do along the wall, and frames in
which the disk is in it."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.estimates import LAW, estimated, value_of
from analysis.gap.ladder import run_ladder
from analysis.gap.page.figures.impacts import law_figure
from analysis.gap.prediction.held_out_errors import held_out_errors
from analysis.gap.prediction.how_far import how_far
from analysis.gap.prediction.predict import predicted_impacts, stated_tangential
from ovines.recording_schema import Nominal
from tests.gap.conftest import brought


@pytest.fixture(scope="module")
def ladder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lasting")
    made = make_series("finite_contact_time", 1.1, np.random.default_rng(4), 2, "white", place=Place(drive="random"))
    series = brought(made, folder / "series")
    return run_ladder(series, np.random.default_rng(0)), made


@pytest.mark.further
def test_nothing_is_left_beside_it(ladder):
    ladder, made = ladder
    assert [cause.effect for cause in ladder.causes] == ["finite_contact_time"] and not ladder.structure
    value, sd = ladder.causes[0].parameters["duration_s"]
    true = made.truth["parameters"]["finite_contact_time"]["duration_s"]
    assert abs(value - true) < 2.5 * sd


def in_wall(run):
    """Which frames of a run are none of a flight's, for the disk is in the wall."""
    return np.isfinite(run.in_wall_m[:, 0])


def test_frames_in_the_wall_are_no_flight(ladder):
    """Those between meeting and leaving the wall, by the plant's clock, and none that is farther than 0.1 ms beside."""
    ladder, made = ladder
    duration_s = made.truth["parameters"]["finite_contact_time"]["duration_s"]
    for number, (before, after) in enumerate(zip(ladder.measured.runs, ladder.series.runs, strict=True)):
        hidden, clock_s = in_wall(after), before.data.time_s - before.data.time_s[0]
        assert not np.isfinite(after.data.xy_m[hidden]).any() and np.isfinite(before.data.xy_m[hidden]).all()
        impacts = made.states[f"imp{number + 1:02d}"]
        since_s = clock_s[:, None] - impacts[impacts[:, 1] > 0.2, 0]
        inside, near = (((since_s > -s) & (since_s < duration_s + s)).any(1) for s in (0.0, 1e-4))
        # Impacts of a chatter, which no two flights show, are followed by themselves.
        assert near[hidden].all() and 0.5 * np.count_nonzero(inside) < np.count_nonzero(hidden)


@pytest.fixture(scope="module")
def last_fit(ladder):
    return estimated(ladder[0], [])[0].with_effect


@pytest.mark.further
def test_the_last_fit_leaves_out_the_same_frames(ladder, last_fit):
    """One at the edge of a contact apart, for its duration is fitted once more."""
    for own, last in zip(ladder[0].series.runs, last_fit.rig.runs, strict=True):
        assert np.count_nonzero(in_wall(own) != in_wall(last)) <= 1 < np.count_nonzero(in_wall(own))


def test_the_last_fit_has_the_same_law_along_the_wall(ladder, last_fit):
    """And says that no scenario's spring is as stiff."""
    ladder, made = ladder
    identified, own = last_fit.table.set_index("parameter")["value"], ladder.impacts.fitted.lasting
    assert identified["wall_friction"] == pytest.approx(own.wall_friction, abs=2e-4)
    assert identified["wall_friction"] == pytest.approx(made.truth["plant"]["wall_friction"], abs=2e-4)
    assert identified["contact_stiffness_ratio"] == pytest.approx(own.stiffness / 3, rel=0.01)
    assert identified["contact_stiffness_ratio"] == pytest.approx(made.truth["plant"]["contact_shear_share"], rel=0.03)
    assert any("contact_stiffness_ratio" in note for note in last_fit.notes)


def test_a_model_that_states_it_is_taken_at_its_word(ladder, last_fit):
    """The model as given has the spring that its tangential restitution stands for, as a scenario has."""
    ladder, data = ladder[0], ladder[0].impacts.fitted.data
    law = {name: value_of(last_fit.table, name)[0] for name in LAW}
    lasting, instant = (
        data.tangential_impulse - stated_tangential(Nominal(effects=effects, **law))(data)
        for effects in (("finite_contact_time",), ())
    )
    assert np.sum(lasting**2) < 0.75 * np.sum(instant**2)


def test_a_run_s_impacts_are_predicted_by_the_law_of_the_others(ladder):
    """Along the wall, of contacts that last and of an instant: what one run's impulses are changes no prediction of its
    own, and those of the others."""
    fit = ladder[0].impacts.fitted
    data, own = fit.data, fit.data.at.run == 0
    more = replace(data, tangential_impulse=np.where(own, 1.5, 1.0) * data.tangential_impulse)
    for one in (fit, replace(fit, lasting=None)):
        both = [
            part.data.tangential_impulse - predicted_impacts(part, ())[0][:, 1]
            for part in (one, replace(one, data=more))
        ]
        np.testing.assert_allclose(both[1][own], both[0][own], rtol=0, atol=1e-12)
        assert np.abs(both[1] - both[0])[~own].max() > 1e-3


@pytest.mark.further
def test_the_gap_closes_along_the_wall_too(ladder):
    ladder, _ = ladder
    errors = held_out_errors(ladder, ladder.causes)[0]
    far = how_far(ladder, errors, ladder.causes)
    closed = far.recalibrated["impact"].sum() - far.with_effects["impact"].sum()
    assert closed > 0.9 * (far.recalibrated["impact"].sum() - far.floor["impact"].sum())
    instant = ladder.impacts.fitted.law
    assert ladder.impacts.fitted.lasting.misfit < instant.tangential_misfit - 50


def test_the_page_draws_the_law_that_the_impacts_follow(ladder):
    """The corner between stick and slide is round; the instant law's is not, and lies up to a tenth beside."""
    ladder, _ = ladder
    data = ladder.impacts.fitted.data
    _, instant, lasting = law_figure(ladder).axes[1].lines
    share, ratio = np.abs(data.slip) / data.normal_impulse, np.abs(data.tangential_impulse) / data.normal_impulse
    inside = share < lasting.get_xdata()[-1]
    off = [np.interp(share, *one.get_data()) - ratio for one in (instant, lasting)]
    beside, on_it = (float(np.sqrt(np.mean(one[inside] ** 2))) for one in off)
    assert on_it < 0.5 * beside


@pytest.mark.further
def test_an_inertia_beside_it_keeps_its_name(loaded):
    """Frames in the wall are left out of flights that have the inertia already: asked of these, it had been gone."""
    truth, series = loaded("finite_contact_time+inertia_error", 1.0, 3, runs=3)
    sizes = {cause.effect: cause.parameters for cause in run_ladder(series, np.random.default_rng(0)).causes}
    assert set(sizes) == {"finite_contact_time", "inertia_error"}
    ratio, sd = sizes["inertia_error"]["ratio"]
    assert abs(ratio - truth["inertia_error"]["ratio"]) < 3 * sd < 0.1
