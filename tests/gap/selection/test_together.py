"""Two causes of which each is seen beside the other only."""

from __future__ import annotations

import numpy as np

from analysis.blind.series import make_series
from analysis.gap.selection.flight_steps import select_flight_effects
from tests.gap.conftest import brought


def test_friction_that_drifts_hides_no_vertical_motion(tmp_path):
    """What scales with the friction differs from run to run with it: vertical motion alone gains much, but not in every
    run, and the drift is seen beside it only."""
    kind = "vertical_motion+friction_drift"
    series = brought(make_series(kind, 0.7, np.random.default_rng(1), 4, "white"), tmp_path / "series")
    stated = series.recordings[0].model.effects
    steps = select_flight_effects(series, stated, frozenset(), False, np.random.default_rng(0))
    assert {cause.effect for cause in steps.causes} == set(kind.split("+"))
    assert not steps.structure
