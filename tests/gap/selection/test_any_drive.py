"""The diagnosis of clean series whose drive is no sine: nothing is found, and nothing is called unknown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.gap.diagnose import diagnose
from analysis.gap.drive.causes import would_show
from analysis.gap.drive.lines import Line
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.plants import Spec, make_series, write_series


@pytest.mark.further
@pytest.mark.parametrize("drive", ["two lines", "chirp"])
def test_a_drive_that_is_no_sine_is_no_cause(drive, tmp_path):
    spec = Spec(drive=drive, noise="white", reach_m=0.04, frames_per_flight=25.0, noise_share=2e-4)
    folder = write_series(make_series(spec, np.random.default_rng([19, 7]), 2), tmp_path / "series")
    summary = diagnose(load_series(read_series(folder), tmp_path / "out")[0], np.random.default_rng(0)).summary
    assert (summary["verdict"], summary["effects"]) == ("none", [])
    # A slow line is a sway beside lines only; a sweep has slow ones of its own.
    assert ("host_sway" in summary["detectable"]) == ("host_sway" in summary["probabilities"]) == (drive == "two lines")


def test_runs_whose_drive_holds_a_slow_line_say_nothing_of_a_sway():
    """Short runs of two lines, whose drive is fitted by what is as slow as the sway: four of twelve had counted against
    it.  A run that would show it and does not counts."""
    amplitude = np.zeros((12, 2), complex)
    amplitude[:7] = 4e-5
    sd = np.array([1e-7] * 8 + [2.3, 1.6e5, 4.9e4, 3e-3])
    line = Line(3.8, 1e-3, amplitude, sd, 1e6, np.where(amplitude[:, 0] != 0, 1e5, 0.0))
    assert would_show(line).tolist() == [True] * 8 + [False] * 4
    assert not would_show(replace(line, amplitude=0 * amplitude)).any()
