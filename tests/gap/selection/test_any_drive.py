"""The diagnosis of clean series whose drive is no sine: nothing is found, and nothing is called unknown."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.diagnose import diagnose
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series
from tests.plants import Spec, make_series, write_series


@pytest.mark.parametrize("drive", ["two lines", "chirp"])
def test_a_drive_that_is_no_sine_is_no_cause(drive, tmp_path):
    spec = Spec(drive=drive, noise="white", reach_m=0.04, frames_per_flight=25.0, noise_share=2e-4)
    folder = write_series(make_series(spec, np.random.default_rng([19, 7]), 2), tmp_path / "series")
    told = diagnose(load_series(read_series(folder), tmp_path / "out")[0], np.random.default_rng(0)).summary
    assert (told["verdict"], told["effects"]) == ("none", [])
    # A slow line is a sway beside lines only; a sweep has slow ones of its own.
    assert ("host_sway" in told["detectable"]) == ("host_sway" in told["probabilities"]) == (drive == "two lines")
