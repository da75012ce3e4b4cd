"""Pictures of calibration.html: frames of films, and windows that see past the plane."""

from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest

from analysis.figures.calibration_maps import _outline_on_plane, plane_uncertainty
from analysis.report import calibration_worth
from tests.conftest import two_cameras


@pytest.fixture
def film(tmp_path):
    """Twelve frames, each of its own grey."""
    path = tmp_path / "cam.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), 10.0, (64, 48))
    for number in range(12):
        writer.write(np.full((48, 64, 3), 20 * number, np.uint8))
    writer.release()
    return path


def test_views_of_films_and_files_are_shown_by_their_names(film, tmp_path, monkeypatch):
    picture = tmp_path / "one.png"
    cv2.imwrite(str(picture), np.full((48, 64), 77, np.uint8))
    (tmp_path / "empty.png").touch()
    paths = [film, picture, tmp_path / "empty.png"]
    names = ["cam.avi frame_00009", "one.png", "cam.avi frame_00003", "empty.png", "cam.avi frame_00040"]
    shown = calibration_worth._view_images(paths, names)
    assert set(shown) == {"cam.avi frame_00009", "one.png", "cam.avi frame_00003"}
    grey = {name: float(image.mean()) for name, image in shown.items()}
    assert grey == pytest.approx({"cam.avi frame_00009": 180, "one.png": 77, "cam.avi frame_00003": 60}, abs=2)
    monkeypatch.setattr(calibration_worth, "LAST_FRAME", 5)
    assert set(calibration_worth._view_images([film], names)) == {"cam.avi frame_00003"}


def test_a_window_that_sees_past_the_plane_ends_at_the_horizon():
    camera = replace(two_cameras()[0], distortion=np.zeros(5))
    window = (0.0, 0.0, 4096.0, 3072.0)
    outline = _outline_on_plane(camera, window)
    assert np.allclose(
        camera.project(np.column_stack([outline, np.zeros(len(outline))]))[0], [-0.5, -0.5], rtol=1e-5, atol=1e-8
    )
    up = cv2.Rodrigues(np.array([-0.9, 0.0, 0.0]))[0] @ camera.rotation  # its upper half sees no plane
    tilted = replace(camera, rotation=up, translation_m=-up @ camera.centre_m)
    seen = _outline_on_plane(tilted, window)
    assert 3 < len(seen) < len(outline)
    back = tilted.project(np.column_stack([seen, np.zeros(len(seen))]))
    on_border = np.minimum(np.abs(back + 0.5), np.abs(back + 0.5 - [4096, 3072])).min(1)
    assert on_border.max() < 1e-6
    grid = np.stack(np.meshgrid(np.linspace(-0.1, 0.1, 5), np.linspace(-0.05, 0.05, 4)), -1).reshape(-1, 2)
    plane = pd.DataFrame(grid, columns=["x_m", "y_m"]).assign(x_sd_m=1e-6, y_sd_m=2e-6, z_sd_m=3e-6)
    figure = plane_uncertainty(plane, [tilted], {tilted.name: window}, None)
    for ax in figure.axes[:3]:
        assert ax.get_xlim()[1] - ax.get_xlim()[0] < 300 and ax.get_ylim()[1] - ax.get_ylim()[0] < 200  # mm


def test_the_cameras_distance_is_reported_with_its_sd():
    cameras = list(two_cameras())  # 0.4 m apart
    world = pd.DataFrame({"quantity": ["height_m", "distance_m of VW1 and VW2"], "sd": [1e-6, 5e-5]})
    assert calibration_worth._distances(world, cameras) == ["VW1 and VW2 stand (400.00 ± 0.05) mm apart."]
    assert calibration_worth._distances(world[:1], cameras) == []
