"""Impacts and parameters where the drive is no sine: two lines, two axes, sweeps, random, start-up, a Host that steps
back at impacts.  The plants share no code with the flight model."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.identify import identify_series
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import Spec, make_series, write_series
from tests.plants.recording import DRIVES
from tests.plants.scoring import impact_scores, parameter_scores

# A tenth of a per cent of the Host's mass, swinging back at 9 Hz.
RECOIL = {"recoil_share": 1e-3, "recoil_rad_per_s": 60.0, "recoil_decay_per_s": 20.0}
SPECS = {name: Spec(drive=name, noise="white", reach_m=0.04, frames_per_flight=25.0, noise_share=2e-4)
         for name in DRIVES if name != "harmonic"} | {
    "recoil": Spec(noise="white", reach_m=0.04, frames_per_flight=25.0, noise_share=2e-4, physics=RECOIL),
}  # fmt: skip
RUNS = {"small line": 2, "recoil": 2}  # what they add is small: one run of it proves little
FARTHEST_SDS = 2.5


@pytest.mark.others_further
@pytest.mark.parametrize("name", SPECS)
def test_any_drive_is_ordinary(name, tmp_path):
    made = make_series(SPECS[name], np.random.default_rng([19, list(SPECS).index(name)]), RUNS.get(name, 1))
    series = read_series(write_series(made, tmp_path / "series"))
    joint, identified = identify_series([read_table(one.folder / "motion.parquet", "motion") for one in series], series)
    for one, run in zip(identified, made, strict=True):
        scores = impact_scores(one.impacts, run)
        assert scores["impacts"] >= 5
        assert (scores["missed"], scores["false"]) == (0, 0)
        assert np.sqrt(np.mean(np.square(scores["errors"]))) < 0.1  # frames
    estimates = parameter_scores(joint, made)
    assert abs(estimates["eps_z"]) < FARTHEST_SDS and abs(estimates["mu_s_z"]) < FARTHEST_SDS
    assert estimates["mu_s_sd"] < 0.05 * estimates["mu_s_true"]
