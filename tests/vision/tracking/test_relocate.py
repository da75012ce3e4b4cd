"""A body that an impact threw off its path, relocated near it; several frames at once, against one by one."""

import math

import numpy as np
import pytest

from ovines.camera import read_calibration
from ovines.recording import read_recording
from tests.vision.tracking.test_track import NES, cameras_and_views, film
from vision.identity.layouts import Layout
from vision.markers.row import CONTRAST, LEVEL, disc_start
from vision.track import track
from vision.tracking.camera_tracker import CameraTracker
from vision.tracking.relocate import lost_lock, relocate
from vision.tracking.tracker import Tracker

RADIUS_M = 0.0014


def pictured(
    tracker: CameraTracker, size: tuple[int, int], pose: np.ndarray, rng: np.random.Generator, light: float = 1.0
) -> np.ndarray:
    """Bright discs where the pose puts the markers, on a grey noisy ground; `light`: how bright they have become."""
    image = np.full(size[::-1], 60.0)
    v, u = np.mgrid[: size[1], : size[0]]
    for centre in tracker.camera.project(tracker.body_points(0, pose)) - np.asarray(tracker.offset):
        image += light * 75 * (1 - np.tanh((np.hypot(u - centre[0], v - centre[1]) - 7) / 0.8))
    return np.clip(image + rng.normal(0, 3, image.shape), 0, 255).astype(np.uint8)


@pytest.fixture
def tracker() -> CameraTracker:
    """A camera that last saw a NES of five markers at the origin, moving by a millimetre per frame."""
    _, views = cameras_and_views()
    layout = Layout(
        ("nes",), tuple(f"N{k}" for k in range(5)), NES, np.array([0, 5]), np.array([2e-4]), np.array([True]), 0.05
    )
    tracker = CameraTracker(views[0].camera, views[0].window_offset_px, layout)
    for marker, (u, v) in enumerate(tracker.camera.project(NES) - np.asarray(tracker.offset)):
        tracker.markers.disc[marker] = disc_start(u, v, 7.0, 60, 150)
    tracker.bodies.velocity[0] = 0.001, 0.0, 0.0
    tracker.bodies.last_frame[0] = 9
    tracker.measured.predicted[0] = tracker.bodies.velocity[0]
    return tracker


@pytest.mark.parametrize("seed", range(12))
def test_a_body_thrown_off_its_path_is_found_to_less_than_a_marker_s_radius(tracker, seed):
    rng = np.random.default_rng(seed)
    away = rng.uniform(0.0016, 0.0023)
    angle = rng.uniform(-math.pi, math.pi)
    true = tracker.measured.predicted[0] + [away * math.cos(angle), away * math.sin(angle), rng.uniform(-0.25, 0.25)]
    image = pictured(tracker, (900, 420), true, rng, light=rng.uniform(0.75, 1.2))
    found = tracker.measured.predicted[0].copy()
    assert lost_lock(image, tracker.state, 0)
    assert relocate(image, tracker.state, 0, found)
    off = tracker.camera.project(tracker.body_points(0, found)) - tracker.camera.project(tracker.body_points(0, true))
    assert np.hypot(*off.T).max() < 7.0


def test_a_body_where_it_was_predicted_has_not_lost_lock(tracker):
    rng = np.random.default_rng(0)
    assert not lost_lock(pictured(tracker, (900, 420), tracker.measured.predicted[0], rng), tracker.state, 0)


def test_nothing_is_found_where_nothing_is(tracker):
    """An empty floor, the body far away, and discs of the other polarity."""
    rng = np.random.default_rng(1)
    found = tracker.measured.predicted[0].copy()
    for image in (pictured(tracker, (900, 420), np.array([0.03, 0.0, 0.0]), rng), np.full((420, 900), 60, np.uint8)):
        assert lost_lock(image, tracker.state, 0)
        assert not relocate(image, tracker.state, 0, found)
    tracker.markers.disc[:, LEVEL], tracker.markers.disc[:, CONTRAST] = 210, -150
    assert not relocate(pictured(tracker, (900, 420), np.array([0.0022, 0.001, 0.0]), rng), tracker.state, 0, found)
    assert np.array_equal(found, tracker.measured.predicted[0])


def test_several_frames_at_once_are_the_same_as_one_by_one(tmp_path, monkeypatch):
    """An impact, a marker hidden, a picture missing in one camera: however the frames are grouped, the tracks are equal
    to the last bit.
    """
    film(tmp_path, 24, np.random.default_rng(3), spin=120.0, hide=[("N2", 5, 9, "VW1")])
    (tmp_path / "VW2" / "f_0021.bmp").write_bytes(b"")
    recording, cameras = read_recording(tmp_path), read_calibration(tmp_path / "calibration.json")
    grouped = track(recording, cameras)
    batches = []
    monkeypatch.setattr(Tracker, "_track_independently", lambda self, frames, pictures: batches.append(frames) or 0)
    single = track(recording, cameras)
    assert batches
    assert grouped.notes == single.notes
    assert grouped.tracks.equals(single.tracks)
    assert grouped.walls.equals(single.walls)
