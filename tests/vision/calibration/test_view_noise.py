"""Images of a board are not equally sharp: each has its own noise, and the covariance knows it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vision.calibration.bundle.adjustment import adjust
from vision.calibration.single_camera import make_setting, observations_of, solve_camera
from vision.calibration.targets.boards import find_board
from vision.calibration.targets.detection import View
from vision.pinhole import intrinsics_of
from vision.rendering.recording import board_poses, half_setup

VIEWS, DULL, QUIET_PX, DULL_PX = 8, 3, 0.02, 0.05  # the last ones are dull


def views_of(seed):
    """True corners of hand-held boards, with noise; the camera."""
    rng = np.random.default_rng(seed)
    setup = replace(half_setup(rng), board=find_board("charuco_9x13_20mm"))
    camera, points = setup.cameras[0], setup.board.points_m()
    still = replace(camera, rotation=np.eye(3), translation_m=np.zeros(3))
    found = []
    for k, (turn, shift) in enumerate(board_poses(setup, 0, VIEWS, rng)):
        uv = still.project(points @ turn.T + shift)
        seen = ((uv > 3) & (uv < np.array(camera.sensor_size_px) - 4)).all(1)
        sd = DULL_PX if k >= VIEWS - DULL else QUIET_PX
        noisy = uv[seen] + rng.normal(0, sd, (seen.sum(), 2))
        found.append(View(f"{k}", np.flatnonzero(seen), noisy, np.full(seen.sum(), sd), 40.0))
    return found, setup.board, camera


def test_each_image_gets_its_own_noise():
    views, board, camera = views_of(1)
    single = solve_camera(views, board, camera.sensor_size_px)
    observations = observations_of(single.views, board)
    adjusted = adjust(observations, single.adjusted.state, make_setting([camera.sensor_size_px], single.adjusted.state))
    sd = np.array([observation.share for observation in observations]) * adjusted.sigma_px[0]
    true = np.where(np.arange(VIEWS) >= VIEWS - DULL, DULL_PX, QUIET_PX)
    # A hundred corners tell an sd to 5 %, less what the poses take; dull ones are drawn towards the others.
    assert sd == pytest.approx(true, rel=0.25)


@pytest.mark.further
def test_the_lens_is_as_wrong_as_its_covariance_says():
    """Over twenty cameras, images of unlike noise: errors over sds of focal lengths and principal point."""
    z = []
    for seed in range(20):
        views, board, camera = views_of(100 + seed)
        single = solve_camera(views, board, camera.sensor_size_px)
        off = intrinsics_of(single.adjusted.state.lens(0))[:4] - intrinsics_of(camera)[:4]
        z.append(off / np.sqrt(np.diag(single.adjusted.covariance)[:4]))
    assert np.sqrt(np.mean(np.square(z))) == pytest.approx(1.0, abs=0.2)  # four numbers, twenty times: 0.11 at one sd
