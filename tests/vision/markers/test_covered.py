"""A marker that another edge gradually covers: its size is known from before, and its picture's shape follows from the
camera.
"""

import numpy as np
import pytest

from ovines.camera import Camera
from vision.identity.layouts import Layout
from vision.markers.row import M11, OK, OUTLIERS, S11, STRUCTURED, U, disc_start, radius_px
from vision.tracking.camera_tracker import CameraTracker
from vision.tracking.duplicate_assignments import unshared
from vision.tracking.measure import _circle_shape
from vision.tracking.state import _remember


def leaning_camera():
    angle, f = 0.4, 6380.0
    rotation = np.array([[1, 0, 0], [0, -np.cos(angle), -np.sin(angle)], [0, np.sin(angle), -np.cos(angle)]])
    return Camera(
        "VW1",
        (4096, 3072),
        np.array([[f, 0, 2048], [0, f, 1536], [0, 0, 1]]),
        np.array([-0.05, 0.1, 2e-4, -1e-4, 0.0]),
        rotation,
        np.array([0, 0, 1.2]),
    )


def tracker_after(clear_frames):
    """A camera's tracker that saw one marker of radius 2 mm, 10 px, in so many frames, and then covered: 9 px."""
    layout = Layout(("ground",), ("G1",), np.zeros((1, 3)), np.array([0, 1]), np.array([1e-3]), np.array([True]), 0.05)
    tracker = CameraTracker(leaning_camera(), (0, 0), layout)
    clear, covered = disc_start(100, 100, 10, 95, -75), disc_start(101, 100, 9, 95, -75)
    clear[OK] = covered[OK] = 1
    covered[OUTLIERS] = STRUCTURED + 0.1
    for fit, radius_m in [(clear, 0.002)] * clear_frames + [(covered, 0.0)]:
        tracker.detections.disc[0], tracker.detections.radius_m[0] = fit, radius_m
        _remember(tracker.state, 0)
    return tracker


def test_a_known_size_is_kept_while_covered():
    tracker = tracker_after(5)
    assert radius_px(tracker.markers.disc[0]) == pytest.approx(10) and tracker.markers.radius_m[0] == pytest.approx(
        0.002
    )
    assert (
        tracker.markers.disc[0, U] == 101 and tracker.markers.disc[0, OUTLIERS] > STRUCTURED
    )  # place and state are those of the covered frame


def test_an_unknown_size_is_what_was_last_seen():
    assert radius_px(tracker_after(1).markers.disc[0]) == pytest.approx(9)


def test_the_shape_of_a_circle_is_that_of_its_projected_rim():
    camera, centre, radius_m = leaning_camera(), np.array([0.03, -0.02, 0.01]), 0.002
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    rim = camera.project(centre + radius_m * np.stack([np.cos(turn), np.sin(turn), 0 * turn], -1))
    middle, jacobian = camera.project_with_jacobian(centre)
    row = np.zeros(20)
    _circle_shape(np.concatenate([middle, jacobian[:, :2].ravel()]), radius_m, row)
    x, y = (rim - rim.mean(0)).T
    m11, m12, m22 = row[M11:S11]
    assert (
        np.abs(m11 * x * x + 2 * m12 * x * y + m22 * y * y - 1).max() < 0.01
    )  # perspective bends it by 0.4 %; a radius 1 % off: 0.02


def test_a_disc_that_two_bodies_match_is_that_of_the_body_seen_better():
    body_of = np.array([0, 0, 0, 1, 1, 1, 1])
    frames = np.repeat([3, 4, 5], 7)
    marker = np.tile(np.arange(7), 3)
    uv = np.tile(np.arange(7)[:, None] * [40.0, 0.0], (3, 1))
    uv[7] = uv[10] + 0.4  # frame 4: the first ground marker sits on the first of the Host
    radius = np.full(len(frames), 7.0)
    keep = unshared(frames, marker, uv, radius, body_of)
    assert np.flatnonzero(~keep).tolist() == [7]
    few = (frames != 4) | np.isin(marker, [0, 3])  # one each: nothing says whose it is
    assert (~unshared(frames[few], marker[few], uv[few], radius[few], body_of)).sum() == 2
