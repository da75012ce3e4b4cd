"""A filmed case shows its markers where the plant's cameras put them."""

from dataclasses import replace

import cv2
import numpy as np

from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import Poses, world_points
from analysis.blind.series import outline_series, run_outline
from ovines.blind_film import OUTWARD, film_series
from ovines.recording import read_recording


def test_film_has_dark_discs_where_the_markers_are(tmp_path):
    rng = np.random.default_rng(12)
    outline = outline_series("none", 1.0, rng, runs=1, noise="image", name="case-001")
    series = run_outline(outline, rng)
    poses = [[Poses(p.nes[40:42], p.host[40:42]) for p in series.poses[0]]]
    film_series(replace(series, poses=poses), outline, tmp_path / "case-001")
    recording = read_recording(tmp_path / "case-001" / "run-01")
    host = np.array(recording.bodies["host"].layout_m) - np.array(outline.marks.host_m)
    assert np.abs(np.hypot(*np.array(recording.bodies["host"].layout_m)[:, :2].T) - 0.0555).max() < 1e-4
    assert host.shape == (4, 3)
    marks = replace(outline.marks, host_m=outline.marks.host_m * OUTWARD)
    points = world_points(poses[0][0].nes, poses[0][0].host, marks, ViewErrors())
    for view, camera in zip(outline.views, recording.cameras, strict=True):
        for frame in (0, 1):
            image = cv2.imread(str(recording.folder / camera.name / f"{frame:05d}.png"), cv2.IMREAD_GRAYSCALE)
            assert image.shape == (688, 1216)
            uv = np.rint(view.pixels(points[frame]) - camera.window_offset_px).astype(int)
            assert all(image[v, u] < 60 for u, v in uv)  # markers are 20 grey, everything else 70 and more
