"""Impacts and the contact law where the law of flight is not ours: the goals of `benchmarks/other_laws.py` in small."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.identify import identify_series
from ovines.recording import read_series
from ovines.tables import read_table
from tests.plants import LAWS, Spec, make_series, write_series
from tests.plants.scoring import NAMES, impact_scores, parameter_scores

LAWS_TRIED = ("coulomb", "stribeck", "spin_decay", "sticky_patch", "gusts", "eccentric_mass", "wall_pull", "air_drag")
FARTHEST_SDS = 4.0  # of 32 errors the largest is below this in all but 0.2 % of draws


@pytest.mark.parametrize("law", LAWS_TRIED)
def test_no_impact_is_missed_or_invented_and_no_number_falsely_sure(law, tmp_path):
    rng = np.random.default_rng([11, sorted(LAWS).index(law), 2])
    made = make_series(Spec(law, noise="white", most_frames=700, frames_per_flight=20.0), rng, 1)
    series = read_series(write_series(made, tmp_path / "series"))
    joint, identified = identify_series([read_table(one.folder / "motion.parquet", "motion") for one in series], series)
    scores = impact_scores(identified[0].impacts, made[0])
    assert scores["impacts"] >= 5
    assert (scores["missed"], scores["false"]) == (0, 0)
    assert np.sqrt(np.mean(np.square(scores["errors"]))) < 0.1  # frames
    told = parameter_scores(joint, made)
    far = {short: told[f"{short}_z"] for short in NAMES.values() if abs(told.get(f"{short}_z", 0.0)) > FARTHEST_SDS}
    assert not far
