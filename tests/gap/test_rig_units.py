"""Sizes that count are given in the rig's own units, and what is given a probability follows what the runs agree on."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.diagnose import diagnose, verdict_of
from analysis.gap.ladder import run_ladder
from analysis.gap.prediction.detectable import detectable_sizes
from analysis.gap.prediction.probabilities import against, probabilities, probability_of
from analysis.gap.selection.centres import centre_negligible_m
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.gap.conftest import brought

pytestmark = pytest.mark.usefixtures("without_next_test")


@pytest.mark.further
def test_a_small_rigs_wall_off_its_centre_is_named(tmp_path):
    """A third of the usual rig: 0.1 mm, below which the usual rig's is placement, is three times as much here."""
    small = make_series("wall_centre_offset", 0.6, np.random.default_rng(3), 2, "white", place=Place(scale=0.3))
    series = brought(small, tmp_path / "series")
    assert centre_negligible_m(series) == pytest.approx(2.5e-3 * series.contact_radius_m)
    summary = diagnose(series, np.random.default_rng(0)).summary
    assert summary["effects"] == ["wall_centre_offset"]
    true = small.truth["parameters"]["wall_centre_offset"]
    assert np.hypot(true["x_m"], true["y_m"]) < 1e-4
    for name, value in true.items():
        assert summary["parameters"]["wall_centre_offset"][name]["value"] == pytest.approx(value, abs=1.5e-5)


@pytest.mark.further
def test_an_inertia_is_judged_by_flights_that_hold_the_drag(shared, tmp_path):
    """Practice 25: flights without their air drag make its impulses turn the disk by 4 % too little."""
    runs = read_series(shared / "practice" / "practice-25")[:4]
    ladder = run_ladder(load_series(runs, tmp_path / "results")[0], np.random.default_rng(0))
    assert (verdict_of(ladder), [cause.effect for cause in ladder.causes]) == ("effect", ["air_drag"])
    probable = probabilities(ladder, ladder.causes, detectable_sizes(ladder), seen=1.0)
    assert probable["inertia_error"] < 0.05 and probable["viscous_drag"] < 0.05


def test_what_runs_held_out_speak_against_becomes_less_likely():
    probability = probability_of(2.0, 0.5, 1.0)
    assert probability > 0.5
    assert against(probability, 3.0) == pytest.approx(probability)
    after = against(probability, -4.0)
    assert after / (1 - after) == pytest.approx(probability / (1 - probability) * np.exp(-2.0))
    assert against(probability, -10.0) == pytest.approx(against(probability, -1000.0))


@pytest.mark.parametrize("share", [0.0, 0.045, 0.5, 3.0, 1e4])
@pytest.mark.parametrize("sd", [1e-3, 0.2])
def test_every_size_has_a_probability(share, sd):
    """A radius 4.5 % of what is negligible, known forty times better than that, had none (NaN): no size that is
    expected beforehand came near it."""
    probability = probability_of(share, sd * max(share, 1e-3), 1.0)
    assert 0.0 <= probability <= 1.0
    assert (probability > 0.99) == (share > 1.0)
