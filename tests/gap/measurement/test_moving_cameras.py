"""A camera that moves or zooms slowly: still markers show it where single frames hide it in their noise."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.gap.measurement.fixed_markers import _slow, ground_motion
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series

PLACES_M = np.array([[-0.100, 0.035], [0.110, 0.030], [0.100, -0.040]])
MARKERS = ("G1", "G2", "G3")
FRAMES, NOISE_M, STILL_M = 400, 3e-5, 1.2e-5


class Still:
    """A series of which ground markers alone are asked."""

    tracks = None
    cameras = None


def seen(rng, moved=lambda place, share: 0.0 * place, correlation=0.0):
    """Points of a run whose still markers move by ``moved`` (m) at a share of the run."""
    rows = []
    for name, place in zip(MARKERS, PLACES_M, strict=True):
        noise = NOISE_M * rng.standard_normal((FRAMES, 2))
        for k in range(1, FRAMES):
            noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
        for k in range(FRAMES):
            x, y = place + moved(place, k / FRAMES) + noise[k]
            rows.append((k, name, x, y))
    return pd.DataFrame(rows, columns=["frame", "marker", "x_m", "y_m"])


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("moved", "what"),
    [
        (lambda place, share: 6e-4 * share * place, "change their distances"),
        (lambda place, share: 6e-4 * share * np.array([-place[1], place[0]]), "turn"),
        (lambda place, share: np.array([5e-5, 0.0]) * share, "move together"),
    ],
)
def test_slow_motion_below_the_noise_of_a_frame_is_found(moved, what):
    """Four runs, each with the same drift, of which a frame shows less than its noise."""
    rng = np.random.default_rng(1)
    (found,) = _slow([seen(rng, moved) for _ in range(4)], MARKERS, Still, STILL_M)
    assert what in found.goes_with and "time within a run" in found.goes_with
    assert found.p < 1e-6 and found.strength == pytest.approx(found.size / STILL_M)


def test_one_run_apart_from_the_others():
    rng = np.random.default_rng(2)
    runs = [seen(rng), seen(rng), seen(rng, lambda place, share: np.array([0.0, 4e-5])), seen(rng)]
    (found,) = _slow(runs, MARKERS, Still, STILL_M)
    assert found.goes_with.startswith("the run") and found.size == pytest.approx(4e-5, rel=0.2)


@pytest.mark.further
@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_markers_that_stand_still_say_nothing(correlation):
    rng = np.random.default_rng(3)
    for _ in range(10):
        assert not _slow([seen(rng, correlation=correlation) for _ in range(3)], MARKERS, Still, 1e-6)


@pytest.mark.further
def test_a_zooming_camera_is_named_by_the_ground(tmp_path):
    """Of the plant: 0.07 % within a run."""
    zoomed = make_series("unknown_zooming_camera", 0.6, np.random.default_rng(8), 2, "white")
    write_series(zoomed, tmp_path / "zoomed")
    series, _ = load_series(read_series(tmp_path / "zoomed"), tmp_path / "results")
    (found,) = ground_motion(series)
    assert found.stage == "measurement" and found.goes_with.endswith("change their distances in the picture of VW2")


@pytest.mark.further
def test_a_zoom_that_swings_is_found_from_the_ground(tmp_path):
    """Of the plant: 0.05 % to and fro; before, single frames were asked for a shift only, and it was called a sway."""
    swinging = make_series("unknown_swinging_zoom", 0.6, np.random.default_rng(3), 2, "warp")
    write_series(swinging, tmp_path / "swinging")
    series, _ = load_series(read_series(tmp_path / "swinging"), tmp_path / "results")
    (found,) = ground_motion(series)
    assert found.stage == "measurement" and found.goes_with.endswith("change their distances from frame to frame")


@pytest.mark.further
@pytest.mark.parametrize("noise", ["ar1", "warp"])
def test_still_ground_neither_grows_nor_turns(noise, tmp_path):
    still = make_series("motion_blur", 1.0, np.random.default_rng(3), 2, noise)
    write_series(still, tmp_path / "still")
    series, _ = load_series(read_series(tmp_path / "still"), tmp_path / "results")
    assert not ground_motion(series)
