"""Frames at scattered times, found from the Host's residual: of their true size, whatever the drive."""

import numpy as np
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.recording.place import Place
from analysis.blind.series import make_series
from analysis.gap.measurement import speed_noise as measured
from analysis.gap.measurement.speed_noise import speed_noise
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series


@pytest.mark.further
@pytest.mark.parametrize(("drive", "seed"), [("sine", 1), ("chirp", 1), ("two_axes", 1), ("random", 3)])
def test_what_the_hosts_fit_takes_of_the_jitter_is_given_back(drive, seed, tmp_path):
    """A fit of a sweep takes 12 % of it with it, one of a sine 1 %; a random drive may have no line at all."""
    made = make_series("trigger_jitter", 0.6, np.random.default_rng(seed), 4, "white", place=Place(drive=drive))
    write_series(made, tmp_path / "series")
    series = load_series(read_series(tmp_path / "series"), tmp_path / "results")[0]
    assert any(run.data.host.omega_rad_per_s > 0 for run in series.runs) == (drive != "random")
    jitter, blur = speed_noise(series)
    true_s = made.truth["parameters"]["trigger_jitter"]["sd_s"]
    value_s, sd_s = jitter.parameters["sd_s"]
    assert jitter.found and not blur.found
    assert value_s == pytest.approx(true_s, rel=0.07)
    assert abs(value_s - true_s) < 2.5 * sd_s


def test_a_drawn_run_that_shows_nothing_changes_nothing(monkeypatch, tmp_path):
    """A fit that follows every frame leaves no residual to ask."""
    made = make_series("trigger_jitter", 0.6, np.random.default_rng(1), 2, "white")
    write_series(made, tmp_path / "series")
    series = load_series(read_series(tmp_path / "series"), tmp_path / "results")[0]
    given_back = speed_noise(series)[0]
    monkeypatch.setattr(measured, "_drawn", lambda *_: ([], []))
    as_seen = speed_noise(series)[0]
    assert as_seen.found and as_seen.size < given_back.size < 1.1 * as_seen.size
