"""What two views lack of meeting, against the full triangulation."""

import warnings

import numpy as np
import pandas as pd
import pytest

from ovines.camera import epipolar_residual_px, triangulate_points
from vision.render_recording import thesis_setup
from vision.sync import find_dropped_frames


@pytest.mark.parametrize("error_px", [0.1, 1.0])
def test_epipolar_residual_is_that_of_the_triangulation(error_px):
    rng = np.random.default_rng(3)
    cameras = thesis_setup(rng).cameras
    points = np.column_stack([rng.uniform(-0.05, 0.05, (300, 2)), rng.uniform(0.0, 0.02, 300)])
    uv = [camera.project(points) + error_px * rng.standard_normal((300, 2)) for camera in cameras]
    full = triangulate_points(cameras, uv, [np.full(300, error_px)] * 2).epipolar_px
    quick = epipolar_residual_px(cameras, *(camera.normalise(own) for camera, own in zip(cameras, uv, strict=True)))
    assert np.abs(np.abs(quick) - np.abs(full)).max() < 0.01 * error_px
    assert abs(np.corrcoef(quick, full)[0, 1]) > 0.999  # one sign for all


def test_points_that_meet_leave_nothing():
    cameras = thesis_setup(np.random.default_rng(4)).cameras
    points = np.array([[0.01, -0.02, 0.004], [0.0, 0.0, 0.0]])
    assert np.abs(epipolar_residual_px(cameras, *(c.normalise(c.project(points)) for c in cameras))).max() < 1e-8


@pytest.mark.parametrize("shared", [True, False])
def test_views_that_say_nothing_of_each_other_tell_of_no_drop(shared):
    """Markers seen by one camera only, or frames too few to be shifted: no evidence, and no warning."""
    cameras = thesis_setup(np.random.default_rng(5)).cameras
    rows = [{"camera": camera.name, "frame": frame, "marker": "G1" if shared else f"G{k}", "u_px": 500.0 + frame, "v_px": 300.0}
            for k, camera in enumerate(cameras) for frame in range(3 if shared else 40)]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert find_dropped_frames(pd.DataFrame(rows), cameras, {camera.name: (0, 0) for camera in cameras}) == []
