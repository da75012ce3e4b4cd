"""The Host's circle on points with known truth."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from analysis.motion.host_circle import circle_through, fit_circles, host_circle
from ovines.errors import InputError
from ovines.recording import read_recording

RECORDING = """format = 1
[time]
frame_rate_hz = 800.0
[bodies.host]
markers = [{markers}]
inner_radius_m = 0.05
"""


def recording(folder, count=4):
    (folder / "recording.toml").write_text(RECORDING.format(markers=", ".join(f'"H{i}"' for i in range(1, count + 1))))
    return read_recording(folder)


def circle_points(centre_m, radius_m, tilt_rad, angles_rad, rng=None, sd_m=0.0):
    """Points (F, K, 3) on a circle tilted about x."""
    local = np.stack([radius_m * np.cos(angles_rad), radius_m * np.sin(angles_rad), np.zeros_like(angles_rad)], -1)
    cos, sin = np.cos(tilt_rad), np.sin(tilt_rad)
    position = local @ np.array([[1, 0, 0], [0, cos, sin], [0, -sin, cos]]) + np.asarray(centre_m)[:, None, :]
    return position if rng is None else position + rng.normal(0, sd_m, position.shape)


def table(position_m):
    frames, markers = position_m.shape[:2]
    rows = pd.DataFrame(
        [(f, f / 800, f"H{k + 1}", *position_m[f, k]) for f in range(frames) for k in range(markers)],
        columns=["frame", "time_s", "marker", "x_m", "y_m", "z_m"],
    )
    return rows[np.isfinite(rows["x_m"])].reset_index(drop=True)


ANGLES = np.array([0.4, 2.0, 3.6, 5.4])


def test_exact_circle_in_space(tmp_path):
    centre = np.array([[0.01, -0.02, 0.013], [0.0, 0.0, 0.0], [-0.4, 0.3, 1.0]])
    result = host_circle(table(circle_points(centre, 0.045, 0.3, ANGLES)), recording(tmp_path))
    for name in ("circle1", "circle2", "circle3", "circle4", "mean", "fit"):
        np.testing.assert_allclose(result[[f"{name}_x_m", f"{name}_y_m", f"{name}_z_m"]], centre, atol=1e-13)
        np.testing.assert_allclose(result[f"{name}_radius_m"], 0.045, atol=1e-13)
    np.testing.assert_allclose(result["fit_residual_m"], 0, atol=1e-13)
    assert list(result["frame"]) == [0, 1, 2]


def test_against_the_formula_worked_by_hand():
    """Right triangle 3-4-5: the centre is the middle of the hypotenuse."""
    centre, radius = circle_through(np.array([0.0, 0, 1]), np.array([3.0, 0, 1]), np.array([0.0, 4, 1]))
    np.testing.assert_allclose(centre, [1.5, 2, 1], atol=1e-15)
    assert radius == pytest.approx(2.5, abs=1e-15)


def test_unseen_markers_are_missing_values_never_zeros(tmp_path):
    position = circle_points(np.zeros((4, 3)), 0.05, 0.0, ANGLES)
    position[1, 3] = np.nan  # three left: one circle, and the fit is that circle
    position[2, 2:] = np.nan  # two left: none
    position[3, :3] = np.nan
    result = host_circle(table(position), recording(tmp_path))
    assert result["circle1_radius_m"].notna().tolist() == [True, True, False, False]
    assert result["circle4_radius_m"].notna().tolist() == [True, False, False, False]
    assert result["mean_radius_m"].notna().tolist() == [True, False, False, False]
    assert result["fit_radius_m"].notna().tolist() == [True, True, False, False]
    assert result["fit_residual_m"].notna().tolist() == [True, False, False, False]
    assert result.loc[1, "fit_radius_m"] == pytest.approx(0.05, abs=1e-12)


def test_markers_on_a_line_give_no_circle():
    line = np.array([[[0.0, 0, 0], [1, 1, 0], [2, 2, 0], [5, 5, 0]]])
    assert np.isnan(circle_through(line[:, 0], line[:, 1], line[:, 2])[1]).all()
    assert np.isnan(fit_circles(line)[1]).all()


def test_more_and_fewer_markers_than_four(tmp_path):
    six = circle_points(np.zeros((1, 3)), 0.05, 0.1, np.linspace(0.2, 5.5, 6))
    result = host_circle(table(six), recording(tmp_path, 6))
    assert result.loc[0, "fit_radius_m"] == pytest.approx(0.05, abs=1e-12)
    three = host_circle(table(six[:, :3]), recording(tmp_path, 3))
    assert three["circle1_radius_m"].notna().all()
    assert three[["circle2_radius_m", "mean_radius_m"]].isna().all(axis=None)
    with pytest.raises(InputError):
        host_circle(table(six[:, :2]), recording(tmp_path, 2))


def test_least_squares_beats_the_mean_of_three_marker_circles():
    """5,000 noisy frames: both unbiased within three standard errors, and the fit scatters no more than the
    mean.
    """
    rng = np.random.default_rng(1)
    noisy = circle_points(np.zeros((5000, 3)), 0.05, 0.0, np.array([0.1, 0.9, 2.5, 4.0]), rng, 3e-5)
    from itertools import combinations

    mean = np.mean([circle_through(*(noisy[:, i] for i in triple))[0] for triple in combinations(range(4), 3)], axis=0)
    fit, _, residual = fit_circles(noisy)
    for estimate in (mean, fit):
        error = estimate[:, :2].mean(0) / (estimate[:, :2].std(0) / np.sqrt(len(noisy)))
        assert np.abs(error).max() < 4
    assert (fit[:, :2].std(0) <= 1.02 * mean[:, :2].std(0)).all()
    assert fit[:, :2].std() < mean[:, :2].std()
    assert residual.mean() < 3e-5  # three of four degrees of freedom are fitted away


@given(st.floats(-1, 1), st.floats(-1, 1), st.floats(0.01, 1), st.floats(-1.2, 1.2), st.integers(0, 2**31))
def test_any_circle_is_recovered(x, y, radius, tilt, seed):
    angles = np.sort(np.random.default_rng(seed).uniform(0, 2 * np.pi, 3))
    gaps = np.diff(np.append(angles, angles[0] + 2 * np.pi))
    if gaps.min() < 0.1:
        return  # three markers close together say little about a circle
    position = circle_points(np.array([[x, y, 0.2]]), radius, tilt, angles)
    centre, found = circle_through(position[:, 0], position[:, 1], position[:, 2])
    np.testing.assert_allclose(centre[0], [x, y, 0.2], atol=1e-9)
    assert found[0] == pytest.approx(radius, rel=1e-8)
