"""The renderer against brute force: many hard-edged rays per pixel, convolved afterwards."""

from functools import cache

import numpy as np
import pytest

from ovines.camera import Camera
from tests.vision.markers.real_discs import pixels
from vision.calibration.targets.boards import find_board
from vision.rendering import kernel
from vision.rendering.board import render_board
from vision.rendering.images import Band, Greys, Look, Markers, Pose, Rig, View, _scene, render_frame
from vision.rendering.scene import BODIES

TILT = np.radians(25)
ROTATION = np.array([[np.cos(TILT), 0, np.sin(TILT)], [0, -1, 0], [np.sin(TILT), 0, -np.cos(TILT)]])
CAMERA = Camera(
    "A",
    (400, 300),
    np.array([[2500.0, 0, 199.5], [0, 2500, 149.5], [0, 0, 1]]),
    np.array([-0.1, 0.2, 1e-3, -5e-4, 0]),
    ROTATION,
    np.array([0.001, 0.002, 0.8]),
)


@cache
def away_m(centre, fine, half):
    """The middle pixel of (2 half + 1)^2 about a place, and how far off it fine^2 rays per pixel end in its plane."""
    uv = np.rint(CAMERA.project(centre)).astype(int)
    offsets = (np.arange((2 * half + 1) * fine) + 0.5) / fine - half - 0.5
    grid = np.stack(np.meshgrid(uv[0] + offsets, uv[1] + offsets), -1)
    rays = CAMERA.rays(grid)
    along = (centre[2] - CAMERA.centre_m[2]) / rays[..., 2]
    at = CAMERA.centre_m[:2] + along[..., None] * rays[..., :2]
    return uv, np.hypot(at[..., 0] - centre[0], at[..., 1] - centre[1])


def brute_force_disc(centre, radius_m, blur_px, fine=24, half=20):
    """Dark disc on light, (2 half + 1)^2 pixels about its centre, by fine^2 rays per pixel and a numerical blur."""
    uv, away = away_m(tuple(centre), fine, half)
    seen = pixels(2 * half + 1, fine, blur_px, 4)
    return uv, seen @ np.where(away < radius_m, 20.0, 200.0) @ seen.T


def unrounded(view, rig, look, scale=40):
    """A frame at 1/scale grey: the mean of uint8 frames with the light stepped below one grey level."""
    frames = [
        render_frame(view, rig, [{}], Look(look.blur_px, 0.0, 1.0 + k / scale / 200))[0] / (1.0 + k / scale / 200)
        for k in range(scale)
    ]
    return np.mean(frames, 0)


# Allowed: what was left at 32 x 32 rays, of a contrast of 180: 1.6, 2.3 (radius 4 px, where the next order of
# blur over radius shows), 0.9, 0.7; a little more here with 24 x 24.
@pytest.mark.parametrize(
    ("radius_m", "blur_px", "grey"), [(0.0013, 0.6, 2.0), (0.0013, 0.85, 2.7), (0.003, 0.8, 1.3), (0.003, 0.4, 1.3)]
)
def test_disc_equals_brute_force(radius_m, blur_px, grey):
    centre = np.array([0.0013, -0.0021, 0.01])
    rig = Rig(
        {"ground": Markers(("G",), centre[None], radius_m, 20.0)},
        host_inner_radius_m=None,
        nes_radius_m=None,
        greys=Greys(background=200.0),
    )
    uv, expected = brute_force_disc(centre, radius_m, blur_px)
    image = unrounded(View(CAMERA), rig, Look(blur_px))[uv[1] - 20 : uv[1] + 21, uv[0] - 20 : uv[0] + 21]
    assert np.abs(image - expected).max() < grey
    v, u = np.mgrid[-20:21, -20:21]
    dark, true_dark = 200 - image, 200 - expected
    for axis in (u, v):
        assert np.sum(axis * dark) / dark.sum() == pytest.approx(np.sum(axis * true_dark) / true_dark.sum(), abs=0.005)


def test_window_is_a_crop_of_the_sensor():
    rig = Rig(
        {"nes": Markers(("N",), np.array([[0.002, 0.001, 0.01]]))}, host_inner_radius_m=0.03, host_outer_radius_m=0.035
    )
    whole, truth = render_frame(View(CAMERA), rig, [{}], Look(0.8, 0.0))
    part, shifted = render_frame(View(CAMERA, (100, 60), (200, 150)), rig, [{}], Look(0.8, 0.0))
    assert np.abs(whole[60:210, 100:300].astype(int) - part).max() <= 1
    assert truth.u_px[0] - shifted.u_px[0] == 100 and truth.v_px[0] - shifted.v_px[0] == 60


@pytest.mark.parametrize("blur_px", [0.4, 0.8])
def test_tiles_leave_no_trace(blur_px):
    """Drawn from another pixel on, others are the middles of tiles, from which follows what has an edge there."""
    rig = Rig(
        {"nes": Markers(("N",), np.array([[0.002, 0.001, 0.01]]))}, host_inner_radius_m=0.03, host_outer_radius_m=0.035
    )
    view, optics = View(CAMERA), kernel.Optics(1 / 2500, 1 / 2500, blur_px, 2)
    scene, (xn, yn) = _scene(view, rig, dict.fromkeys(BODIES, Pose()), blur_px), view.normalised((0, 399), (0, 299))
    whole = kernel.shade(scene, optics, kernel.Patch(xn, yn, 0, 0))
    for row, column in ((1, 2), (2, 3), (3, 1)):
        rays = (np.ascontiguousarray(each[row:, column:]) for each in (xn, yn))
        part = kernel.shade(scene, optics, kernel.Patch(*rays, column, row))
        assert np.abs(whole[row:, column:] - part).max() < 2e-4


def test_motion_blur_is_the_mean_and_same_seed_same_image():
    rig = Rig({"nes": Markers(("N",), np.array([[0.0, 0.0, 0.01]]))}, host_inner_radius_m=None)
    poses = [{"nes": Pose(x)} for x in (-0.0004, 0.0, 0.0004)]
    still = [render_frame(View(CAMERA), rig, [pose], Look(0.8, 0.0))[0].astype(float) for pose in poses]
    moving, truth = render_frame(View(CAMERA), rig, poses, Look(0.8, 0.0))
    assert np.abs(np.mean(still, 0) - moving).max() <= 1.0
    assert truth[["u_px", "v_px"]].to_numpy()[0] == pytest.approx(CAMERA.project([0.0, 0.0, 0.01]))
    noisy = [render_frame(View(CAMERA), rig, poses, Look(), np.random.default_rng(7))[0] for _ in range(2)]
    assert (noisy[0] == noisy[1]).all()


def test_wall_hides_what_lies_behind_it():
    rig = Rig(
        {"nes": Markers(("N",), np.array([[0.0, 0.0, 0.004]]), 0.001)},
        host_inner_radius_m=0.03,
        host_outer_radius_m=0.035,
        wall_height_m=0.02,
        nes_radius_m=0.004,
        nes_height_m=0.004,
    )
    shares = [
        render_frame(View(CAMERA), rig, [{"nes": Pose(x)}], Look(0.8, 0.0))[1].visible[0]
        for x in (0.0, 0.0235, 0.026, -0.026)
    ]
    camera_x_m = CAMERA.centre_m[0]
    near = 0.026 if camera_x_m > 0 else -0.026
    by_x = dict(zip((0.0, 0.0235, 0.026, -0.026), shares, strict=True))
    assert by_x[0.0] == 1.0 and by_x[-near] == 1.0 and by_x[near] < 0.5


def test_shadow_band_darkens_only_its_band():
    rig = Rig({}, host_inner_radius_m=None, nes_radius_m=None, greys=Greys(background=200.0))
    image, _ = render_frame(View(CAMERA), rig, [{}], Look(0.8, 0.0, bands=(Band(200, 40, 0.5, softness_px=2),)))
    assert image[:, 200].mean() == pytest.approx(100, abs=2) and image[:, 50].mean() == 200


def test_board_corners_lie_where_the_truth_says():
    camera = Camera(
        "A",
        (600, 700),
        np.array([[6000.0, 0, 299.5], [0, 6000, 349.5], [0, 0, 1]]),
        np.zeros(5),
        np.eye(3),
        np.zeros(3),
    )
    board = find_board("charuco_5x7_8mm")
    c, s = np.cos(0.3), np.sin(0.3)
    image, truth = render_board(
        View(camera),
        board,
        np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        np.array([-0.02, -0.03, 1.1]),
        Look(0.8, 1.0),
        np.random.default_rng(3),
    )
    from vision.calibration.targets.detection import detect

    seen = detect(image, board)
    error = seen.uv_px - truth[seen.points]
    assert len(seen.points) == 24
    assert np.abs(error.mean(0)).max() < 3 * 0.01 / np.sqrt(24)  # no bias within its standard error
    assert error.std() < 0.01  # 0.004 px measured; cornerSubPix on these: 0.022
    assert np.median(seen.sd_px) == pytest.approx(error.std(), rel=0.5)
