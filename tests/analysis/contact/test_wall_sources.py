"""The wall by markers, edges and impacts: known places come out, correlated frames widen, what is absent is named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from analysis.contact.wall_sources import WallSource, _mean, wall_sources
from analysis.figures.geometry import wall_comparison
from analysis.report.geometry import in_words
from ovines.recording import read_recording

TOML = """format = 1
name = "t"
[time]
frame_rate_hz = 800.0
[bodies.host]
markers = ["H1", "H2", "H3", "H4"]
inner_radius_m = 0.05
{layout}
[bodies.nes]
markers = ["N1", "N2"]
radius_m = 0.01
mass_kg = 0.0246
inertia_factor = 0.5
"""
LAYOUT = "layout_m = [[0.055, 0.0, 0.0], [0.0, 0.055, 0.0], [-0.055, 0.0, 0.0], [0.0, -0.055, 0.0]]\nlayout_sd_m = 3e-5"
FRAMES = np.arange(200)
TURN, OFF = 0.4, np.array([3e-4, -2e-4])


@pytest.fixture
def rig(tmp_path: Path):
    """Host turned by 0.4 rad and moving; markers' circle 1 % larger than its layout, the wall 0.3, -0.2 mm off in the
    Host's frame.
    """
    rng = np.random.default_rng(1)
    (tmp_path / "recording.toml").write_text(TOML.format(layout=LAYOUT))
    host = np.column_stack([0.02 * np.sin(0.1 * FRAMES), 0.001 * np.cos(0.1 * FRAMES)])
    turned = np.array([[np.cos(TURN), -np.sin(TURN)], [np.sin(TURN), np.cos(TURN)]]) @ OFF
    motion = pd.DataFrame({"frame": FRAMES, "host_x_m": host[:, 0], "host_y_m": host[:, 1], "host_angle_rad": TURN})
    seen = host + turned + rng.normal(0, 5e-6, host.shape)
    circles = pd.DataFrame(
        {
            "frame": FRAMES,
            "fit_x_m": seen[:, 0],
            "fit_y_m": seen[:, 1],
            "fit_radius_m": 0.05555 + rng.normal(0, 5e-6, len(FRAMES)),
        }
    )
    rows = [
        {
            "frame": f,
            "body": body,
            "x_m": host[f, 0] + turned[0],
            "y_m": host[f, 1] + turned[1],
            "radius_m": radius + rng.normal(0, 2e-6),
            "x_sd_m": 1e-6,
            "y_sd_m": 1e-6,
            "radius_sd_m": 2e-6,
        }
        for f in FRAMES[::20]
        for body, radius in (("host", 0.0502), ("nes", 0.00998))
    ]
    found = pd.DataFrame(
        [
            ("contact_radius_m", 0.0403, 1e-5, 7),
            ("wall_centre_x_m", 2.9e-4, 2e-5, 7),
            ("wall_centre_y_m", -2.1e-4, 3e-5, 7),
        ],
        columns=["parameter", "value", "sd", "n_impacts"],
    )
    return read_recording(tmp_path), motion, circles, pd.DataFrame(rows), found


def test_each_source_gives_its_radius_and_centre(rig):
    design, markers, edges, impacts = wall_sources(*rig, pixel_m=2e-4)
    assert design.contact_radius_m == pytest.approx(0.04, rel=1e-12)
    assert markers.contact_radius_m == pytest.approx(0.05 * 1.01 - 0.01, abs=2e-6)
    assert edges.contact_radius_m == pytest.approx(0.0502 - 0.00998, abs=4e-6)
    assert (impacts.contact_radius_m, impacts.contact_radius_sd_m, impacts.count) == (0.0403, 1e-5, 7)
    assert impacts.centre_m == (2.9e-4, -2.1e-4) and impacts.centre_sd_m == (2e-5, 3e-5)
    for source in (markers, edges):
        assert np.allclose(source.centre_m, OFF, atol=3e-6)
    # Placement of four markers: 30 um / sqrt(4), edges: a bias of 0.04 pixels of 0.2 mm each.
    assert markers.contact_radius_sd_m == pytest.approx(1.5e-5, rel=0.05)
    assert edges.contact_radius_sd_m == pytest.approx(np.sqrt(2) * 8e-6, rel=0.05)
    assert not any(source.missing for source in (design, markers, edges, impacts))


def test_absent_sources_are_named(rig):
    recording = rig[0]
    design, markers, edges, impacts = wall_sources(recording, None, None, None, None)
    assert not design.missing and markers.missing and edges.missing and impacts.missing
    assert "nothing to compare" in in_words([design, markers, edges, impacts])
    assert wall_comparison([markers, edges, impacts]) is None


def test_without_layout_the_markers_tell_no_wall(rig, tmp_path):
    (tmp_path / "recording.toml").write_text(TOML.format(layout=""))
    markers = wall_sources(read_recording(tmp_path), *rig[1:])[1]
    assert np.isnan(markers.contact_radius_m) and "layout_m" in markers.missing and "55.55" in markers.measured


def test_disagreement_is_said_with_its_size(rig):
    words = in_words(wall_sources(*rig, pixel_m=2e-4))
    assert "Host markers give a contact radius 0.28 mm larger than image edges" in words
    near = [WallSource("recording.toml", ""), WallSource("a", "", 0.04, 1e-5), WallSource("b", "", 0.040015, 1e-5)]
    assert "agree" in in_words(near)


def test_neighbours_that_agree_in_their_errors_count_less():
    rng = np.random.default_rng(2)
    white = rng.normal(0, 1, 2000)
    walk = np.empty(2000)
    walk[0] = white[0]
    for i in range(1, 2000):
        walk[i] = 0.8 * walk[i - 1] + 0.6 * white[i]
    _, plain, _ = _mean(white)
    _, wide, _ = _mean(walk)
    assert plain == pytest.approx(1.2533 / np.sqrt(2000), rel=0.1)
    assert wide / plain == pytest.approx(3.0, rel=0.2)
