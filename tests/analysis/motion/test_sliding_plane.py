"""The sliding plane by the bodies that move in it."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.motion.sliding_plane import sliding_plane
from ovines.recording import read_recording

RIG = """format = 1
[time]
frame_rate_hz = 800.0
[[cameras]]
name = "A"
sensor_size_px = [640, 480]
[bodies.host]
markers = ["H1", "H2", "H3"]
layout_m = [[0.05, 0.0, 0.012], [-0.03, 0.04, 0.012], [-0.02, -0.05, 0.012]]
layout_sd_m = 2e-5
inner_radius_m = 0.05
[bodies.nes]
markers = ["N1", "N2"]
layout_m = [[0.0, 0.0, 0.01], [0.006, 0.0, 0.01]]
layout_sd_m = 2e-5
radius_m = 0.01
"""


def points(rng: np.random.Generator, frames: int, plane: tuple[float, float, float], recording) -> pd.DataFrame:
    """Host shaken along x and, out of plane, along z; the NES going round inside; markers off by their sd."""
    rows = []
    for body in recording.bodies.values():
        for marker, place in zip(body.markers, body.layout_m or (), strict=True):
            off = rng.normal(0, 2e-5)
            t = np.arange(frames) / 800
            host = marker.startswith("H")
            angle = 0 * t if host else 9 * t
            x = place[0] * np.cos(angle) - place[1] * np.sin(angle) + 0.015 * np.sin(70 * t)
            y = place[0] * np.sin(angle) + place[1] * np.cos(angle)
            if not host:
                x, y = x + 0.03 * np.cos(23 * t), y + 0.03 * np.sin(31 * t)
            lifted = 5e-4 * np.sin(70 * t)
            z = place[2] + off + plane[0] + plane[1] * x + plane[2] * y + lifted + rng.normal(0, 1e-5, frames)
            rows.append(pd.DataFrame({"frame": np.arange(frames), "marker": marker, "x_m": x, "y_m": y, "z_m": z}))
    return pd.concat(rows, ignore_index=True)


@pytest.fixture
def recording(tmp_path):
    (tmp_path / "recording.toml").write_text(RIG, encoding="utf-8")
    return read_recording(tmp_path)


def test_height_and_slopes_come_back_within_their_sd(recording):
    true, normalised = (-0.003, 4e-3, -2e-3), []
    for seed in range(30):
        found = sliding_plane(points(np.random.default_rng(seed), 800, true, recording), recording)
        assert found is not None and found.bodies == ("host", "nes")
        error = np.array([found.height_m, found.slope_x, found.slope_y]) - true
        normalised.append(error / found.sd)
        assert found.sd[0] < 1e-4 and max(found.sd[1:]) < 3e-3
    spread = np.sqrt(np.mean(np.square(normalised), axis=0))
    assert (spread > 0.2).all() and (spread < 1.4).all()  # 30 draws: an sd of 1 scatters by 13 %


def test_nothing_is_said_of_few_frames_or_without_layouts(recording, tmp_path):
    few = points(np.random.default_rng(0), 30, (0, 0, 0), recording)
    assert sliding_plane(few, recording) is None
    assert sliding_plane(few[few["marker"] == "nobody"], recording) is None
