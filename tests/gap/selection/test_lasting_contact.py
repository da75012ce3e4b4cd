"""Contacts that last, by a plant that shares no code with the diagnosis: what they do along the wall, and frames in
which the disk is in it."""

import numpy as np
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.ladder import run_ladder
from analysis.gap.page.figures.impacts import law_figure
from analysis.gap.prediction.held_out_errors import held_out_errors
from analysis.gap.prediction.how_far import how_far
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series


@pytest.fixture(scope="module")
def ladder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lasting")
    made = make_series("finite_contact_time", 1.1, np.random.default_rng(4), 4, "white", place=Place(drive="random"))
    write_series(made, folder / "series")
    series = load_series(read_series(folder / "series"), folder / "results")[0]
    return run_ladder(series, np.random.default_rng(0)), made


def test_nothing_is_left_beside_it(ladder):
    ladder, made = ladder
    assert [cause.effect for cause in ladder.causes] == ["finite_contact_time"] and not ladder.structure
    value, sd = ladder.causes[0].parameters["duration_s"]
    true = made.truth["parameters"]["finite_contact_time"]["duration_s"]
    assert abs(value - true) < 2.5 * sd


def test_frames_in_the_wall_are_no_flight(ladder):
    """A frame between meeting and leaving the wall, by the plant's clock, is in no flight."""
    ladder, _ = ladder
    impacts = ladder.impacts.fitted
    for number, (before, after) in enumerate(zip(ladder.measured.runs, ladder.series.runs, strict=True)):
        hidden = impacts.in_the_wall(number, before.data.time_s)
        assert 0.005 < hidden.mean() < 0.2
        assert not np.isfinite(after.data.xy_m[hidden]).any()


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
