"""NES angle from marker triplets on known rotations."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.motion.rotation import rotation, triplet_angle, triplet_angles, unwrap_over_gaps
from ovines.errors import InputError
from ovines.recording import read_recording

LAYOUT = np.array(
    [
        [0, 0, 0.01],
        [0.0061, 0.0003, 0.01],
        [-0.0008, 0.006, 0.01],
        [-0.0058, -0.0017, 0.01],
        [0.0024, -0.0056, 0.01],
    ]
)


def recording(folder, count=5):
    names = ", ".join(f'"N{i + 1}"' for i in range(count))
    (folder / "recording.toml").write_text(
        f"format = 1\n[time]\nframe_rate_hz = 800.0\n[bodies.nes]\nmarkers = [{names}]\nradius_m = 0.01\n"
    )
    return read_recording(folder)


def scene(angle_rad, layout=LAYOUT, rng=None, sd_m=0.0):
    """Table points of a disk that turns by ``angle_rad`` (F,) and moves along x; and its motion."""
    cos, sin = np.cos(angle_rad)[:, None], np.sin(angle_rad)[:, None]
    x = cos * layout[:, 0] - sin * layout[:, 1] + np.linspace(0, 0.03, len(angle_rad))[:, None]
    y = sin * layout[:, 0] + cos * layout[:, 1]
    if rng is not None:
        x, y = x + rng.normal(0, sd_m, x.shape), y + rng.normal(0, sd_m, y.shape)
    frames, markers = np.indices(x.shape)
    points = pd.DataFrame(
        {
            "frame": frames.ravel(),
            "time_s": frames.ravel() / 800,
            "marker": [f"N{k + 1}" for k in markers.ravel()],
            "x_m": x.ravel(),
            "y_m": y.ravel(),
            "z_m": 0.01,
        }
    )
    motion = pd.DataFrame({"frame": np.arange(len(x)), "time_s": np.arange(len(x)) / 800, "nes_angle_rad": angle_rad})
    return points, motion


def test_eq_115_corrected_is_the_foot_of_the_perpendicular():
    """A = (0, 0), C = (4, 0), B = (1, 3): the foot P is (1, 0), so PB points along +y."""
    assert triplet_angle([0, 0], [1, 3], [4, 0]) == pytest.approx(np.pi / 2, rel=1e-12)
    assert triplet_angle([0, 0], [1, -3], [4, 0]) == pytest.approx(-np.pi / 2, rel=1e-12)  # cos alone loses this sign


def test_every_triplet_follows_the_rotation_both_ways(tmp_path):
    angle = np.concatenate([np.linspace(0, 25, 300), np.linspace(25, -10, 400)])  # several turns and a reversal
    points, motion = scene(angle)
    frames, triplets = triplet_angles(points, recording(tmp_path))
    assert len(triplets) >= 8  # of ten, those that are not flat
    for name, found in triplets.items():
        turned = unwrap_over_gaps(found)
        np.testing.assert_allclose(turned - turned[0], angle - angle[0], atol=1e-9, err_msg=name)
    result = rotation(points, motion, recording(tmp_path))
    np.testing.assert_allclose(result["nes_angle_triplet_rad"], angle, atol=1e-9)
    assert result["nes_angle_triplet_spread_rad"].max() < 1e-9
    assert list(frames) == list(motion["frame"])


def test_noise_shows_in_the_spread_and_not_as_a_bias(tmp_path):
    rng = np.random.default_rng(2)
    angle = np.linspace(0, 8, 2000)
    points, motion = scene(angle, rng=rng, sd_m=3e-5)
    result = rotation(points, motion, recording(tmp_path))
    error = result["nes_angle_triplet_rad"].to_numpy() - angle
    assert abs(error.mean()) < 4 * error.std() / np.sqrt(len(error))
    # a base line of about 9 mm between two ends of 0.03 mm each: 5 mrad per triplet, less for their mean
    assert 0.5e-3 < error.std() < 5e-3
    assert 1e-3 < result["nes_angle_triplet_spread_rad"].median() < 1e-2


def test_missing_markers_leave_the_other_triplets(tmp_path):
    points, motion = scene(np.linspace(0, 3, 50))
    points = points[
        ~((points["frame"] == 10) & points["marker"].isin(["N1", "N2"]))
        & ~((points["frame"] == 20) & (points["marker"] != "N1"))
    ]
    points = points[points["frame"] != 30]
    result = rotation(points, motion, recording(tmp_path)).set_index("frame")
    assert result.loc[10, "nes_angle_triplet_rad"] == pytest.approx(motion["nes_angle_rad"][10], abs=1e-9)
    assert np.isnan(result.loc[10, "nes_angle_triplet_spread_rad"])  # one triplet has no spread
    assert np.isnan(result.loc[20, "nes_angle_triplet_rad"])
    assert np.isnan(result.loc[30, "nes_angle_triplet_rad"])
    assert len(result) == 50


def test_flat_triplets_are_refused(tmp_path):
    line = np.column_stack([np.linspace(-0.005, 0.005, 3), np.zeros(3), np.full(3, 0.01)])
    points, _ = scene(np.linspace(0, 1, 10), line)
    with pytest.raises(InputError, match="line"):
        triplet_angles(points, recording(tmp_path, 3))
    with pytest.raises(InputError, match="2 NES markers"):
        triplet_angles(points, recording(tmp_path, 2))
