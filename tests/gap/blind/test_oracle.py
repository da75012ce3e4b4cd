"""What an oracle closes: the plant's own path against the measured one, wherever the rig stands."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.place import Place
from analysis.blind.scoring.oracle import in_flights, in_world, oracle_share
from analysis.blind.series import make_series

ELSEWHERE = Place(scale=2.5, turned_rad=1.1, rig_at_m=(-0.4, 1.2), start_s=(3.0, 8.0), first_frame=(50, 4000))
NOISE_M, FORCE_M_PER_S2 = 1e-5, 0.3


def predictions_of(series, place, left, rng):
    """A table in which ``left`` of a force of the room is still missing with the effect, and all of it without."""
    rows = []
    for run in range(2):
        states = series.states[f"state{run + 1:02d}"]
        path = in_world(states[:, :2], place)
        rate = place.in_units("_hz", place.frame_rate_hz)
        bounces = series.states[f"imp{run + 1:02d}"][:, 0] * rate
        frame = np.arange(len(path))
        flight = np.searchsorted(bounces, frame)
        since = np.array([k - frame[flight == flight[k]].min() for k in frame]) / rate
        missing = 0.5 * FORCE_M_PER_S2 * since**2
        measured = path + rng.normal(0, NOISE_M, path.shape)
        for axis, name in enumerate(("nes_x_m", "nes_y_m")):
            rows.append(
                pd.DataFrame(
                    {
                        "run": f"run-{run + 1:02d}",
                        "frame": frame + (place.first_frame[run] if place.first_frame else 0),
                        "quantity": name,
                        "measured": measured[:, axis],
                        "recalibrated": path[:, axis] + missing,
                        "with_effect": path[:, axis] + np.sqrt(left) * missing,
                    }
                )
            )
    return pd.concat(rows)


@pytest.mark.others_further
@pytest.mark.parametrize("place", [Place(), ELSEWHERE])
@pytest.mark.parametrize(("left", "share"), [(0.0, 1.0), (0.36, 0.64), (1.0, 0.0)])
def test_the_share_of_an_oracle(place, left, share):
    series = make_series("air_drag", 0.5, np.random.default_rng(2), 2, "white", place=place)
    table = predictions_of(series, place, left, np.random.default_rng(0))
    table.loc[table.index[::97], "measured"] += 1e-3  # outliers are asked of nobody
    assert oracle_share(table, series.states, place) == pytest.approx(share, abs=0.02)


def test_whom_an_oracle_can_be_asked_of():
    truth = {"stages": ["flight", "flight"], "noise": "ar1", "verdict": "effect"}
    assert in_flights(truth)
    assert not in_flights(truth | {"noise": "warp"}) and not in_flights(truth | {"stages": ["flight", "impact"]})
    assert not in_flights(truth | {"verdict": "unknown"}) and not in_flights(truth | {"stages": [], "verdict": "none"})
