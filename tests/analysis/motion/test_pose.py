"""Poses from markers: exact without noise, robust to one wrong marker, the layout learnt from the recording."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.motion.pose import MarkerCloud, fit_pose, refine_layout, unwrap_angle

LAYOUT = np.array(
    [[0, 0, 0.01], [0.0061, 0.0003, 0.01], [-0.0008, 0.006, 0.01], [-0.0058, -0.0017, 0.01], [0.0024, -0.0056, 0.01]]
)


def cloud(layout, angle, place, sd=1e-5, rng=None):
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x = place[:, :1] + c * layout[:, 0] - s * layout[:, 1]
    y = place[:, 1:] + s * layout[:, 0] + c * layout[:, 1]
    position = np.stack([x, y, np.broadcast_to(layout[:, 2], x.shape)], -1)
    if rng is not None:
        position = position + sd * rng.standard_normal(position.shape)
    n = len(angle)
    return MarkerCloud(np.arange(n), np.arange(n) / 800, position, np.full_like(position, sd))


def motion(n=200):
    t = np.arange(n) / 800
    return 3.0 * np.sin(9 * t), np.column_stack([0.03 * np.cos(20 * t), 0.02 * np.sin(17 * t)])


def test_exact_without_noise():
    angle, place = motion()
    pose = fit_pose(cloud(LAYOUT, angle, place), LAYOUT, 0.0)
    np.testing.assert_allclose(pose.xy_m, place, atol=1e-12)
    np.testing.assert_allclose(np.exp(1j * pose.angle_rad), np.exp(1j * angle), atol=1e-9)


def test_errors_are_as_large_as_the_sd_says():
    angle, place = motion(2000)
    pose = fit_pose(cloud(LAYOUT, angle, place, 1e-5, np.random.default_rng(1)), LAYOUT, 0.0)
    z = (pose.xy_m - place) / pose.xy_sd_m[:, None]
    turn = np.angle(np.exp(1j * (pose.angle_rad - angle))) / pose.angle_sd_rad
    assert 0.9 < np.std(z) < 1.15 and 0.9 < np.std(turn) < 1.15


def test_one_wrong_marker_does_not_move_the_pose():
    angle, place = motion(50)
    seen = cloud(LAYOUT, angle, place, 1e-5, np.random.default_rng(2))
    seen.position_m[20, 1, 0] += 5e-3
    pose = fit_pose(seen, LAYOUT, 1e-6)
    assert np.hypot(*(pose.xy_m[20] - place[20])) < 5e-5


@pytest.mark.parametrize("marker", range(5))
def test_a_marker_off_by_twenty_sd_is_left_out(marker):
    """Large enough to drag the pose by 4 sd, small enough to hide among five markers of which all then look wrong."""
    angle, place = motion(300)
    seen = cloud(LAYOUT, angle, place, 1e-5, np.random.default_rng(4))
    seen.position_m[:, marker, 0] -= 2.1e-4
    pose = fit_pose(seen, LAYOUT, 1e-6)
    assert np.mean(pose.markers == 4) > 0.95
    error = (pose.xy_m - place) / pose.xy_sd_m[:, None]
    assert np.all(np.abs(error.mean(0)) < 0.3) and np.std(error) < 1.2


def test_two_markers_suffice_and_one_does_not():
    angle, place = motion(3)
    seen = cloud(LAYOUT, angle, place)
    seen.position_m[1, 2:] = np.nan
    seen.position_m[2, 1:] = np.nan
    pose = fit_pose(seen, LAYOUT, 0.0)
    assert np.allclose(pose.xy_m[1], place[1], atol=1e-9) and pose.xy_sd_m[1] > pose.xy_sd_m[0]
    assert np.isnan(pose.xy_m[2]).all() and pose.markers[2] == 0


def test_layout_is_learnt_and_keeps_the_designers_frame():
    rng = np.random.default_rng(3)
    real = LAYOUT.copy()
    real[3, :2] += [4e-5, -3e-5]
    angle, place = motion(600)
    learnt, sd = refine_layout(cloud(real, angle, place, 1e-5, rng), LAYOUT, 5e-5)
    between = np.linalg.norm(learnt[3, :2] - learnt[1, :2]) - np.linalg.norm(real[3, :2] - real[1, :2])
    assert abs(between) < 3e-6
    assert np.all(sd < 5e-5)


def test_turns_are_carried_over_a_gap():
    t = np.arange(0, 0.3, 1 / 800)
    true = 60.0 * t
    seen = np.angle(np.exp(1j * true))
    seen[100:170] = np.nan
    angle = unwrap_angle(t, seen)
    known = np.isfinite(seen)
    np.testing.assert_allclose(angle[known], true[known], atol=1e-9)
    assert np.isnan(angle[100:170]).all()
