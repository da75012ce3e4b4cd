"""Calibration on projected boards with known noise: truth within its sd, outliers dropped, mistakes named."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from ovines.camera import Camera, triangulate_points
from ovines.errors import InputError
from ovines.tables import checked
from vision.calibrate import calibrate
from vision.calibration.advice import length_advice
from vision.calibration.targets.boards import WORLD_FROM_BOARD, find_board
from vision.calibration.targets.detection import View
from vision.pinhole import INTRINSICS, pinhole
from vision.rendering.recording import board_poses, thesis_setup

NOISE_PX = 0.02
SIZES = {"VW1": (4096, 3072), "VW2": (4096, 3072)}


def rig_views(rng, views=7, noise_px=NOISE_PX, together=False, board="charuco_5x7_8mm"):
    """The thesis' rig: true cameras, and noisy corners of its board in hand-held views and in the world position."""
    setup = replace(thesis_setup(rng), board=find_board(board))
    points = setup.board.points_m()
    seen, extrinsic = {}, {}
    shared = board_poses(setup, 0, views, rng)
    for c, camera in enumerate(setup.cameras):

        def view(name, points_world, camera=camera):
            uv = camera.project(points_world) + rng.normal(0, noise_px, (len(points), 2))
            return View(name, np.arange(len(points)), uv, np.full(len(points), noise_px), 31.0)

        def in_world(turn, shift, eye):
            return (points @ turn.T + shift - eye.translation_m) @ eye.rotation

        poses = shared if together else board_poses(setup, c, views, rng)
        eye = setup.cameras[0] if together else camera
        seen[camera.name] = [view(f"{k:02d}.png", in_world(*pose, eye)) for k, pose in enumerate(poses)]
        extrinsic[camera.name] = view("extrinsic.png", points @ WORLD_FROM_BOARD.T)
    return setup, seen, extrinsic


def errors_in_sd(result, setup):
    """Normalised errors of the free intrinsics and the translations of both cameras."""
    found = []
    for camera, true in zip(result.cameras, setup.cameras, strict=True):
        own = result.parameters[result.parameters["camera"] == camera.name].set_index("parameter")
        truth = dict(zip(INTRINSICS, [*np.diag(true.matrix)[:2], *true.matrix[:2, 2], *true.distortion], strict=False))
        truth |= dict(zip(("tx_m", "ty_m", "tz_m"), true.translation_m, strict=True))
        found += [(own.value[key] - value) / own.sd[key] for key, value in truth.items() if np.isfinite(own.sd[key])]
    return np.array(found)


def test_lens_derivatives_are_those_of_the_function():
    rng = np.random.default_rng(1)
    lens = np.array([900.0, 905, 640, 360, -0.3, 0.1, 1e-3, -2e-3, 0.05, 0.2, -0.1, 0.03, 1e-3, -3e-3, 2e-3, 4e-3])
    points = rng.normal(0, 0.2, (5, 3)) + [0, 0, 1]
    _, by_lens, by_point = pinhole(points, lens)
    for k in range(16):
        step = 1e-6 * max(1.0, abs(lens[k]))
        ahead, behind = (pinhole(points, lens + sign * step * np.eye(16)[k])[0] for sign in (1, -1))
        assert by_lens[..., k] == pytest.approx((ahead - behind) / (2 * step), rel=1e-5, abs=1e-6)
    for k in range(3):
        ahead, behind = (pinhole(points + sign * 1e-6 * np.eye(3)[k], lens)[0] for sign in (1, -1))
        assert by_point[..., k] == pytest.approx((ahead - behind) / 2e-6, rel=1e-5, abs=1e-4)
    matrix = np.array([[lens[0], 0, lens[2]], [0, lens[1], lens[3]], [0, 0, 1]])
    theirs = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, lens[4:])[0].reshape(-1, 2)
    assert pinhole(points, lens)[0] == pytest.approx(theirs, abs=1e-9)


@pytest.mark.parametrize("terms", [5, 8, 12])
def test_a_cameras_pixels_are_opencvs_with_derivatives_and_without(terms):
    lens = np.array([-0.3, 0.1, 1e-3, -2e-3, 0.05, 0.2, -0.1, 0.03, 1e-3, -3e-3, 2e-3, 4e-3])[:terms]
    matrix = np.array([[900.0, 0, 640], [0, 905, 360], [0, 0, 1]])
    rotation, shift_m = cv2.Rodrigues(np.array([0.3, -0.2, 0.1]))[0], np.array([0.01, 0.02, 0.9])
    camera = Camera("C", (1280, 720), matrix, lens, rotation, shift_m)
    points = np.random.default_rng(1).normal(0, 0.1, (4, 5, 3))
    pixels, derivative = camera.project_with_jacobian(points)
    assert np.array_equal(camera.project(points), pixels)
    theirs = cv2.projectPoints(points.reshape(-1, 3), cv2.Rodrigues(rotation)[0], shift_m, matrix, lens)[0]
    assert pixels.reshape(-1, 2) == pytest.approx(theirs.reshape(-1, 2), abs=1e-9)
    for k, step_m in enumerate(1e-6 * np.eye(3)):
        difference = (camera.project(points + step_m) - camera.project(points - step_m)) / 2e-6
        assert derivative[..., k] == pytest.approx(difference, rel=1e-5, abs=1e-3)


@pytest.mark.others_further
@pytest.mark.parametrize("rigs", [2, 4])
def test_rig_is_recovered_and_the_sd_are_honest(rigs):
    """Rigs of the thesis' size: sd of all parameters, and 3-D points over +-65 mm."""
    normalised, points_rms = [], []
    for seed in range(rigs):
        setup, seen, extrinsic = rig_views(np.random.default_rng(seed), views=14)
        result = calibrate(setup.board, seen, SIZES, extrinsic)
        normalised.append(errors_in_sd(result, setup))
        grid = np.stack(np.meshgrid(*2 * [np.linspace(-0.065, 0.065, 5)], [0.0, 0.012]), -1).reshape(-1, 3) + [
            0.02,
            -0.028,
            0,
        ]
        again = triangulate_points(
            result.cameras, [c.project(grid) for c in setup.cameras], [np.full(len(grid), 0.01)] * 2
        )
        points_rms.append(np.sqrt(np.mean((again.points_m - grid) ** 2, 0)))
        assert not result.simultaneous
    spread = np.sqrt(np.mean(np.concatenate(normalised) ** 2))
    # errors of one rig are strongly correlated, so four rigs are few; OpenCV's own sd of cx, cy would give 100 here
    assert 0.6 < spread < 1.5
    # 0.02 px in 24 corners, one view of a 40 x 56 mm board: its tilt is known to about 3e-4 rad, lever 65 mm
    assert np.median(points_rms, 0)[:2].max() < 20e-6 and np.median(points_rms, 0)[2] < 50e-6


def test_simultaneous_views_are_noticed_and_help():
    setup, seen, extrinsic = rig_views(np.random.default_rng(3), together=True)
    tied = calibrate(setup.board, seen, SIZES, extrinsic)
    apart = calibrate(setup.board, seen, SIZES, extrinsic, simultaneous=False)
    assert tied.simultaneous and not apart.simultaneous
    k = tied.labels.index(("VW2", "tx"))
    assert tied.covariance[k, k] < apart.covariance[k, k]


def test_tables_are_the_declared_ones():
    setup, seen, extrinsic = rig_views(np.random.default_rng(4), views=6)
    result = calibrate(setup.board, seen, SIZES, extrinsic)
    checked(result.views, "calibration_views")
    checked(result.parameters, "calibration_parameters")
    assert any("6" in line and "views" in line for line in result.advice) or any(
        "usable intrinsic views" in line for line in result.advice
    )


def advice_on(change, seed=11):
    """What is said after eight projected views of the larger board, the poses (turn, shift) of all of them changed."""
    rng = np.random.default_rng(seed)
    setup = replace(thesis_setup(rng), board=find_board("charuco_9x13_20mm"))
    points = setup.board.points_m()
    seen, extrinsic = {}, {}
    for c, camera in enumerate(setup.cameras):

        def view(name, in_camera, camera=camera, marker_px=31.0):
            uv = camera.project((in_camera - camera.translation_m) @ camera.rotation) + rng.normal(
                0, NOISE_PX, (len(points), 2)
            )
            inside = ((uv > 0) & (uv < SIZES["VW1"])).all(1)
            return View(name, np.flatnonzero(inside), uv[inside], np.full(inside.sum(), NOISE_PX), marker_px)

        posed = [change(k, turn, shift) for k, (turn, shift) in enumerate(board_poses(setup, c, 8, rng))]
        size_px = 3.0 if change is small else 31.0
        seen[camera.name] = [
            view(f"{k:02d}.png", points @ turn.T + shift, marker_px=size_px) for k, (turn, shift) in enumerate(posed)
        ]
        extrinsic[camera.name] = view(
            "extrinsic.png", points @ (camera.rotation @ WORLD_FROM_BOARD).T + camera.translation_m
        )
    return " ".join(calibrate(setup.board, seen, SIZES, extrinsic).advice)


def as_it_is(k, turn, shift):
    return turn, shift


def small(k, turn, shift):
    return turn, shift


def facing(k, turn, shift):
    """Nearly square on, all at one distance."""
    angles = 0.05 * np.array([np.sin(k), np.cos(k), 8 * np.sin(2.0 * k)])
    return cv2.Rodrigues(angles)[0], shift * [1, 1, 0] + [0, 0, 1.3]


def in_the_middle(k, turn, shift):
    return turn, shift * [0.0, 0.0, 2.5] - turn @ [0.09, 0.13, 0.0]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (as_it_is, ["8 usable intrinsic views; take at least 10"]),
        (small, ["markers below 20 px in 8 views", "come nearer"]),
        (facing, ["tilt some views by 30 to 45", "take some nearer and some farther"]),
        (in_the_middle, ["of the sensor; move it to the corners"]),
    ],
)
def test_advice_names_what_is_weak(change, said):
    advice = advice_on(change)
    for part in said:
        assert part in advice
    if change is as_it_is:
        assert "tilt some" not in advice and "below 20 px" not in advice and "nearer" not in advice


def test_moved_view_and_empty_view_are_dropped_with_reasons():
    setup, seen, extrinsic = rig_views(np.random.default_rng(5))
    bad = seen["VW1"][4]
    shaken = bad.uv_px + np.random.default_rng(0).normal(0, 1.0, bad.uv_px.shape)
    seen["VW1"][4] = View(bad.name, bad.points, shaken, bad.sd_px, bad.marker_px)
    seen["VW1"][5] = View("05.png", np.empty(0, int), np.empty((0, 2)), np.empty(0))
    seen["VW1"][6] = seen["VW1"][6].only(np.arange(24) < 4)
    result = calibrate(setup.board, seen, SIZES, extrinsic)
    reasons = result.views[~result.views["used"]].set_index(["camera", "view"])["reason"]
    assert list(reasons.index) == [("VW1", "04.png"), ("VW1", "05.png"), ("VW1", "06.png")]
    assert "reprojection" in reasons["VW1", "04.png"] and reasons["VW1", "05.png"] == "board not found"
    assert reasons["VW1", "06.png"] == "only 4 points"


def test_single_wild_corner_does_no_harm():
    setup, seen, extrinsic = rig_views(np.random.default_rng(6))
    clean = calibrate(setup.board, seen, SIZES, extrinsic)
    seen["VW1"][2].uv_px[7] += [3.0, -2.0]
    again = calibrate(setup.board, seen, SIZES, extrinsic)
    focal_sd = clean.parameters.set_index(["camera", "parameter"]).sd["VW1", "fx"]
    assert abs(again.cameras[0].matrix[0, 0] - clean.cameras[0].matrix[0, 0]) < focal_sd


def test_swapped_extrinsic_views_are_named():
    # a small board fits any lens at another distance: only one that fills the image tells lenses apart
    setup, seen, extrinsic = rig_views(np.random.default_rng(7), board="charuco_9x13_20mm")
    stretched = {}
    for name, factor in (("VW1", 1.0), ("VW2", 0.8)):  # lenses must differ for a swap to show
        stretched[name] = [
            View(v.name, v.points, (v.uv_px - 2048) * factor + 2048, v.sd_px, v.marker_px)
            for v in [*seen[name], extrinsic[name]]
        ]
    views = {name: each[:-1] for name, each in stretched.items()}
    world = {name: each[-1] for name, each in stretched.items()}
    calibrate(setup.board, views, SIZES, world)
    crossed = {
        name: View("swapped.png", v.points, v.uv_px, v.sd_px, v.marker_px)
        for name, v in (("VW1", world["VW2"]), ("VW2", world["VW1"]))
    }
    with pytest.raises(InputError, match="swap"):
        calibrate(setup.board, views, SIZES, crossed)


def test_too_few_views_and_no_world_view_are_refused():
    setup, seen, extrinsic = rig_views(np.random.default_rng(8))
    with pytest.raises(InputError, match="three usable views"):
        calibrate(setup.board, {"VW1": seen["VW1"][:1], "VW2": seen["VW2"]}, SIZES, extrinsic)
    lost = {**extrinsic, "VW2": extrinsic["VW2"].only(np.zeros(24, bool))}
    with pytest.raises(InputError, match="world position"):
        calibrate(setup.board, seen, SIZES, lost)


def test_a_known_length_shows_a_wrong_square_size():
    board = find_board("charuco_5x7_8mm")
    assert length_advice(0.870, 0.872, board, "baseline") == []
    assert "square_size_m = 0.0075" in length_advice(0.8, 0.75, board, "baseline")[0]
    setup, seen, extrinsic = rig_views(np.random.default_rng(9))
    baseline = float(np.linalg.norm(setup.cameras[0].centre_m - setup.cameras[1].centre_m))
    wrong = setup.board.altered(square_size_m=0.010, marker_size_m=0.0075)
    said = calibrate(wrong, seen, SIZES, extrinsic, known_baseline_m=baseline).advice
    assert any("square_size_m = 0.00" in line and "measure the print" in line for line in said)
