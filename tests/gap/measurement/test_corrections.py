"""What several errors of the measurement leave of each other once the first is taken out."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.measurement.corrections import correct


def test_what_two_views_show_is_found_beside_a_stronger_jitter(loaded):
    """Frames that are moved in time have no points behind them any more: what these show is taken out before."""
    _, series = loaded("plane_tilt+trigger_jitter", 0.6, 4)
    corrected = correct(series)
    found = corrected.findings
    assert [one.effect for one in found] == ["plane_tilt", "trigger_jitter"] and corrected.series.points is None
    assert found[1].times_least() > found[0].times_least()
    beside, alone = found[0], corrected.tests.findings["plane_tilt"]
    for name, (value, sd) in beside.parameters.items():
        assert value == pytest.approx(alone.parameters[name][0], abs=5 * sd + 0.02 * abs(value))
    assert np.all([sd > 0 for _, sd in beside.parameters.values()])
