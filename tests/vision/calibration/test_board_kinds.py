"""Every kind of board, rendered: found whole, its points where they are, sds that agree; and cameras by the dozen."""

from __future__ import annotations

import numpy as np
import pytest

from ovines.errors import InputError
from vision.calibrate import calibrate
from vision.calibration.single_camera import unbiased
from vision.calibration.targets.boards import FOLDER, WORLD_FROM_BOARD, Board, find_board
from vision.calibration.targets.detection import View, detect
from vision.rendering.board import render_board
from vision.rendering.images import Look
from vision.rendering.images import View as Window
from vision.rendering.recording import look_at

SIZE = (700, 560)
KINDS = sorted(path.stem for path in FOLDER.glob("*.toml") if path.stem not in ("charuco_7x10_15mm", "charuco_5x7_8mm"))


def camera_at(place_m, roll_rad=0.0, name="A"):
    lens = np.array([-0.1, 0.02, 0.0, 0.0, 0.0])
    return look_at(name, np.asarray(place_m, float), np.zeros(3), 770.0, SIZE, lens, (349.5, 279.5), roll_rad)


def pose_of(camera, board):
    """Of the board lying in the world, its middle at the origin."""
    middle = np.append(board.points_m()[:, :2].mean(0), 0.0)
    rotation = camera.rotation @ WORLD_FROM_BOARD
    return rotation, camera.translation_m - rotation @ middle


def rendered(camera, board, rng, pose=None):
    return render_board(
        Window(camera, (0, 0), SIZE), board, *(pose or pose_of(camera, board)), Look(noise_grey=2.0), rng
    )


def far_m(board):
    """From where the board fills about two thirds of the picture's height."""
    return 2.3 * float(np.ptp(board.points_m()[:, :2], axis=0).max())


@pytest.mark.others_further
@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("name", KINDS)
def test_each_kind_is_found_where_it_is(name, inverted):
    """Corners of two views: no worse than 0.06 px rms, and 0.6 to 1.5 of what their sds say; dots no worse than 0.015
    px: a lens that bends within a large dot moves its centre by up to 0.01 px, of which their sds (0.003 px) know
    nothing.
    """
    board, rng = find_board(name).altered(inverted=inverted), np.random.default_rng(0)
    off, claimed = [], []
    for k in (0, 2):
        camera = camera_at(far_m(board) * np.array([0.25 * (k - 1), -0.2 * k, 1.0]), 0.3 * k)
        image, truth = rendered(camera, board, rng)
        seen = detect(image, board)
        assert len(seen.points) > 0.85 * len(truth)
        uv = seen.uv_px
        if seen.discs is not None:
            uv = unbiased(seen.discs, camera, *pose_of(camera, board))
        error = uv - truth[seen.points]
        if board.ends_alike:  # numbered from either end
            other = uv - truth[::-1][seen.points]
            error = min(error, other, key=lambda one: float(np.abs(one).max()))
        off.append(error.ravel())
        claimed.append(np.repeat(seen.sd_px, 2))
    error, sd = np.concatenate(off), np.concatenate(claimed)
    assert np.sqrt(np.mean(error**2)) < (0.015 if board.of_dots else 0.06)
    assert 0.6 < np.sqrt(np.mean((error / sd) ** 2)) < (4.0 if board.of_dots else 1.5)


def test_part_of_a_grid_of_tags_serves():
    board = find_board("aprilgrid_6x6_29mm")
    camera = camera_at(0.5 * far_m(board) * np.array([0.2, 0.1, 1.0]))
    image, truth = rendered(camera, board, np.random.default_rng(1))
    seen = detect(image, board)
    assert 20 < len(seen.points) < len(truth)
    assert np.abs(seen.uv_px - truth[seen.points]).max() < 0.3


@pytest.mark.parametrize("kind", ["aprilgrid", "tags"])
def test_a_grid_of_the_other_maker_is_not_taken_for_it(kind):
    """Kalibr's frames are twice as wide: each is not read as the other, so no corner gets another's number."""
    one, other = find_board("aprilgrid_6x6_29mm"), find_board("aprilgrid_6x6_29mm").altered(kind="tags")
    shown, asked = (one, other) if kind == "tags" else (other, one)
    image, truth = rendered(camera_at([0, 0, far_m(shown)]), shown, np.random.default_rng(2))
    seen = detect(image, asked)
    assert len(seen.points) < 0.1 * len(truth)


def test_which_boards_look_alike_turned_by_half():
    alike = {name: find_board(name).ends_alike for name in KINDS}
    assert [name for name, same in alike.items() if same] == ["circles_9x7_20mm"]
    assert Board("a", (4, 10), 0.02, kind="asymmetric circles").ends_alike


@pytest.mark.others_further
@pytest.mark.parametrize(
    "name", ["asymmetric_circles_4x11_18mm", "dots_9x7_20mm", "tags_7x5_30mm", "chessboard_10x7_25mm"]
)
def test_turned_by_any_angle_the_numbers_stay(name):
    """The board turned under the camera in steps of 110 degrees: every point keeps its number."""
    board, rng = find_board(name), np.random.default_rng(3)
    for roll in np.radians(np.arange(20, 360, 110)):
        image, truth = rendered(camera_at([0.05, -0.1, 1.15 * far_m(board)], roll), board, rng)
        seen = detect(image, board)
        assert len(seen.points) > 0.85 * len(truth)
        assert np.abs(seen.uv_px - truth[seen.points]).max() < 0.5


def views_of(board, cameras, rng, apart):
    """Views of a tilted board per camera (points with noise of 0.03 px); ``apart``: no two cameras at one time."""
    points = board.points_m()
    middle = np.append(points[:, :2].mean(0), 0.0)
    views, world = {}, {}
    for c, camera in enumerate(cameras):
        own = []
        for k in range(7):
            tilt = np.random.default_rng([7, k + (100 * c if apart else 0)]).normal(0, 0.35, 3)
            angle = float(np.linalg.norm(tilt))
            axis = tilt / angle
            cross = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
            turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
            place = (points - middle) @ (turn @ WORLD_FROM_BOARD).T + [0.02 * (k % 3 - 1), 0.02 * (k % 4 - 1.5), 0.05]
            uv = camera.project(place) + rng.normal(0, 0.03, (len(points), 2))
            name = f"{c}_{k}" if apart else f"{k}"
            own.append(View(name, np.arange(len(points)), uv, np.full(len(points), 0.03)))
        views[camera.name] = own
        place = points @ WORLD_FROM_BOARD.T
        uv = camera.project(place) + rng.normal(0, 0.03, (len(points), 2))
        world[camera.name] = View("world", np.arange(len(points)), uv, np.full(len(points), 0.03))
    return views, world


@pytest.mark.further
@pytest.mark.parametrize("apart", [False, True])
def test_four_cameras_at_different_times(apart):
    """Four cameras, seeing the board at once or never together: poses within 4 sd of the truth by the covariance."""
    board, rng = find_board("tags_7x5_30mm"), np.random.default_rng(4)
    places = [[0.5, 0.1, 0.8], [-0.5, 0.1, 0.8], [0.1, 0.5, 0.8], [0.1, -0.5, 0.8]]
    cameras = [camera_at(place, 0.1 * k, f"C{k}") for k, place in enumerate(places)]
    views, world = views_of(board, cameras, rng, apart)
    found = calibrate(board, views, {camera.name: SIZE for camera in cameras}, world)
    assert found.simultaneous is not apart
    labels = {label: k for k, label in enumerate(found.labels)}
    for camera, true in zip(found.cameras, cameras, strict=True):
        rows = [labels[camera.name, axis] for axis in ("tx", "ty", "tz")]
        sd = np.sqrt(np.diag(found.covariance))[rows]
        assert (np.abs(camera.translation_m - true.translation_m) < 4 * sd).all()
        assert sd.max() < 5e-3


def test_circles_for_several_cameras_are_refused():
    board = find_board("circles_9x7_20mm")
    cameras = [camera_at([0.3, 0, 0.8], name="A"), camera_at([-0.3, 0, 0.8], name="B")]
    views, world = views_of(board, cameras, np.random.default_rng(0), False)
    with pytest.raises(InputError, match="same turned by half"):
        calibrate(board, views, dict.fromkeys("AB", SIZE), world)
    alone = calibrate(board, {"A": views["A"]}, {"A": SIZE}, {"A": world["A"]})
    assert alone.cameras[0].matrix[0, 0] == pytest.approx(770, rel=0.01)
