"""What a calibration knows of itself: the lens by held-out views, halves, uncertainty, what to photograph next."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.camera import Camera
from ovines.errors import InputError
from vision.calibrate import calibrate
from vision.calibration.single_camera import solve_camera
from vision.calibration.targets.boards import Board
from vision.calibration.targets.detection import View
from vision.pinhole import N_INTRINSICS
from vision.validation.halves import compare_halves, flagged, residual_field
from vision.validation.image_map import image_map
from vision.validation.lens_choice import choose_lens, refuse_fisheye
from vision.validation.next_view import next_views

SIZE = (1280, 960)
BOARD = Board("chessboard", (10, 7), 0.025, kind="chessboard")
NOISE_PX = 0.05
Project = Callable[[np.ndarray], np.ndarray]


def through(distortion: list[float], focal_px: float = 900.0) -> Project:
    camera = Camera(
        "", SIZE, np.array([[focal_px, 0, 639.5], [0, focal_px, 479.5], [0, 0, 1]]), np.array(distortion), np.eye(3),
        np.zeros(3),
    )  # fmt: skip
    return camera.project


def views(rng: np.random.Generator, project: Project, focal_px: float = 900.0, count: int = 16) -> list[View]:
    """Hand-held views of the board by any lens, filling a third of the image."""
    points, (width, height), found = BOARD.points_m(), BOARD.size_m, []
    while len(found) < count:
        about = rng.uniform(0, 2 * np.pi)
        tilt = np.radians(rng.uniform(15, 40)) * np.array([np.cos(about), np.sin(about), 0])
        turn = np.asarray(cv2.Rodrigues(np.array([0, 0, rng.uniform(-3, 3)]))[0] @ cv2.Rodrigues(tilt)[0], float)
        depth = rng.uniform(1.4, 2.5) * max(width, height) * focal_px / SIZE[0]
        middle = depth * np.append(rng.uniform(-0.5, 0.5, 2) * SIZE / focal_px, 1)
        uv = project(points @ turn.T + middle - turn @ [width / 2, height / 2, 0])
        seen = np.isfinite(uv).all(1) & (uv > 5).all(1) & (uv < np.array(SIZE) - 5).all(1)
        if seen.sum() >= 12:
            uv = uv[seen] + rng.normal(0, NOISE_PX, (seen.sum(), 2))
            found.append(View(f"{len(found):02d}", np.flatnonzero(seen), uv, np.full(seen.sum(), NOISE_PX)))
    return found


@pytest.mark.others_further
@pytest.mark.parametrize(
    ("distortion", "lens"),
    [
        ([-0.3, 0.1, 1e-3, -5e-4, 0.0], ("four terms", "five terms")),
        ([0.3, 0.03, 1e-3, -5e-4, 0.01, 0.6, 0.2, 0.02], ("rational",)),
        ([-0.3, 0.1, 1e-3, -5e-4, 0, 0, 0, 0, 3e-3, 0, -3e-3, 0], ("thin prism",)),
    ],
)
def test_the_lens_is_the_one_that_made_the_views_and_no_richer(distortion, lens):
    project = through(distortion)
    seen = views(np.random.default_rng(1), project)
    single, tried = choose_lens(solve_camera(seen, BOARD, SIZE), seen, BOARD, SIZE)
    (taken,) = [one for one in tried if one.chosen]
    assert taken.lens in lens and [one.lens for one in tried][-3:] == ["rational", "thin prism", "spline"]
    others = [one.held_out_px for one in tried if not one.chosen and np.isfinite(one.held_out_px)]
    assert taken.held_out_px < min(others, default=1.0) * 1.01
    assert taken.held_out_px == pytest.approx(np.sqrt(2) * NOISE_PX, rel=0.06)
    assert single.adjusted.state.intrinsics[0, :2] == pytest.approx([900, 900], rel=2e-3)


def test_few_views_choose_nothing():
    seen = views(np.random.default_rng(2), through([0.3, 0.03, 0, 0, 0.01, 0.6, 0.2, 0.02]), count=6)
    _, tried = choose_lens(solve_camera(seen, BOARD, SIZE), seen, BOARD, SIZE)
    assert [one.chosen for one in tried] == [True] and "6 views" in tried[0].reason


def test_a_fisheye_that_few_views_cannot_model_is_refused_with_a_word():
    focal = 640 / np.radians(85)

    def equidistant(points: np.ndarray) -> np.ndarray:
        radius = np.hypot(points[:, 0], points[:, 1])
        scale = focal * np.arctan2(radius, points[:, 2]) / np.maximum(radius, 1e-12)
        return scale[:, None] * points[:, :2] + [639.5, 479.5]

    seen = views(np.random.default_rng(3), equidistant, focal, count=7)
    with pytest.raises(InputError, match="like a fisheye: .* degrees off its axis"):
        refuse_fisheye("A", solve_camera(seen, BOARD, SIZE), BOARD)


def test_frames_of_a_film_that_are_of_no_use_are_counted_and_no_picture_is_asked_for_again():
    seen = views(np.random.default_rng(4), through([-0.1, 0.05, 0, 0, 0.0]))
    none = View("", np.empty(0, np.int64), np.empty((0, 2)), np.empty(0))
    for film, sentence in (
        (True, "A: 30 of 46 frames looked at in its film cannot be used"),
        (False, "A: retake one0"),
    ):
        pattern = "film.mp4 frame_{:05d}" if film else "one{}.png"
        poor = [replace(none, name=pattern.format(k)) for k in range(30)]
        good = [replace(view, name=pattern.format(100 + k)) for k, view in enumerate(seen)]
        said = calibrate(BOARD, {"A": poor + good}, {"A": SIZE}, {"A": seen[0]}).advice
        assert any(line.startswith(sentence) for line in said), said
        assert any("retake" in line for line in said) is not film


def bent(seen: list[View], rms_px: float, length_px: float, rng: np.random.Generator) -> list[View]:
    """The views through a lens with a smooth residual that no model has."""
    waves, phase = rng.normal(0, 1 / length_px, (2, 40, 2)), rng.uniform(0, 2 * np.pi, (2, 40))
    moved = []
    for view in seen:
        shift = [np.cos(view.uv_px @ waves[c].T + phase[c]).sum(1) * np.sqrt(2 / 40) for c in (0, 1)]
        moved.append(replace(view, uv_px=view.uv_px + rms_px / np.sqrt(2) * np.stack(shift, -1)))
    return moved


@pytest.mark.further
def test_a_spline_stands_beside_the_rational_lens_and_views_that_were_left_out_come_back():
    seen = views(np.random.default_rng(1), through([0.3, 0.03, 0, 0, 0.01, 0.6, 0.2, 0.02]))
    seen = bent(seen, 0.15, 160.0, np.random.default_rng(100))
    single, tried = choose_lens(solve_camera(seen[2:], BOARD, SIZE), seen, BOARD, SIZE)
    held_out = {one.lens: one.held_out_px for one in tried}
    assert held_out["spline"] < 0.9 * held_out["rational"] < 0.9 * held_out["five terms"]
    assert [one.lens for one in tried if one.chosen] == ["spline"] and len(single.views) == 16
    camera = single.adjusted.state.lens(0)
    assert camera.spline is not None and len(camera.distortion) == 8
    assert single.adjusted.sigma_px[0] == pytest.approx(NOISE_PX, rel=0.1)


def test_a_model_error_is_flagged_and_noise_is_not():
    """The full count is `benchmarks/calibration/calibration.py flags`."""
    flags = {0.0: 0, 0.05: 0}
    for seed in range(4):
        seen = views(np.random.default_rng(seed), through([-0.1, 0.05, 0, 0, 0.0]))
        for rms_px in flags:
            single = solve_camera(bent(seen, rms_px, 160.0, np.random.default_rng(100 + seed)), BOARD, SIZE)
            at = image_map(single.adjusted.state.intrinsics[0], SIZE, single.views)
            halves, field = compare_halves(single, BOARD, at), residual_field(single, BOARD)
            flags[rms_px] += any(flagged(halves, field))
    assert flags == {0.0: 0, 0.05: 4}


def test_the_next_view_gains_what_was_foreseen():
    """Foreseen sd of the lens against that of a solution with such a view added: within a fifth."""
    project, rng = through([-0.1, 0.05, 0, 0, 0.0]), np.random.default_rng(7)
    seen = views(rng, project, count=9)
    single = solve_camera(seen, BOARD, SIZE)
    at = image_map(single.adjusted.state.intrinsics[0], SIZE, single.views)
    first, *more = next_views(single, BOARD, SIZE, at)
    assert first.then_px < first.now_px and [one.now_px for one in more] == [first.then_px, more[0].then_px]
    own = single.adjusted.covariance[:N_INTRINSICS, :N_INTRINSICS]
    assert first.now_px == pytest.approx(np.sqrt(np.mean(at.sd_px(np.nan_to_num(own)) ** 2)))
    from vision.validation.next_view import _poses

    turn, shift = dict(_poses(single, BOARD, SIZE))[first.pose]
    uv = project(BOARD.points_m() @ turn.T + shift) + rng.normal(0, NOISE_PX, (len(BOARD.points_m()), 2))
    inside = ((uv > 0) & (uv < np.array(SIZE) - 1)).all(1)
    added = View("added", np.flatnonzero(inside), uv[inside], np.full(inside.sum(), NOISE_PX))
    again = solve_camera([*seen, added], BOARD, SIZE)
    covariance = np.nan_to_num(again.adjusted.covariance[:N_INTRINSICS, :N_INTRINSICS])
    scale = single.adjusted.sigma_px[0] / again.adjusted.sigma_px[0]
    assert scale * np.sqrt(np.mean(at.sd_px(covariance) ** 2)) == pytest.approx(first.then_px, rel=0.2)


def rig(board_height_m: float = 0.0):
    """Two cameras of the thesis' rig, calibrated from corners with noise; truth and result."""
    from vision.calibration.targets.boards import WORLD_FROM_BOARD, find_board
    from vision.rendering.recording import board_poses, thesis_setup

    rng = np.random.default_rng(5)
    setup = replace(thesis_setup(rng), board=find_board("charuco_9x13_20mm"))
    points, seen, world = setup.board.points_m(), {}, {}
    every = np.arange(len(points))
    for c, camera in enumerate(setup.cameras):
        still = replace(camera, rotation=np.eye(3), translation_m=np.zeros(3))

        def view(name, uv):
            return View(name, every, uv + rng.normal(0, NOISE_PX, uv.shape), np.full(len(uv), NOISE_PX), 40.0)

        seen[camera.name] = [
            view(f"{camera.name}-{k:02d}", still.project(points @ turn.T + shift))
            for k, (turn, shift) in enumerate(board_poses(setup, c, 10, rng))
        ]
        up = [0, 0, board_height_m]
        world[camera.name] = view("world", camera.project(points @ WORLD_FROM_BOARD.T + up))
    sizes = {camera.name: camera.sensor_size_px for camera in setup.cameras}
    return setup, calibrate(setup.board, seen, sizes, world, board_height_m=board_height_m)


@pytest.mark.further
def test_the_cameras_distance_has_the_sd_of_pairs_drawn_from_the_covariance():
    setup, found = rig()
    name, sd_m = found.tables["calibration_world"][["quantity", "sd"]].iloc[-1]
    assert name == "distance_m of VW1 and VW2"
    covariance = np.nan_to_num(found.covariance)
    rng, n = np.random.default_rng(0), 4000
    drawn = rng.multivariate_normal(np.zeros(len(covariance)), covariance, n, method="svd").reshape(n, 2, -1)
    centres = [
        -np.einsum(
            "nji,nj->ni",
            np.stack([cv2.Rodrigues(one[-6:-3])[0] @ camera.rotation for one in drawn[:, c]]),
            camera.translation_m + drawn[:, c, -3:],
        )
        for c, camera in enumerate(found.cameras)
    ]
    assert np.linalg.norm(centres[0] - centres[1], axis=1).std() == pytest.approx(sd_m, rel=0.06)
    true_m, own_m = (np.linalg.norm(a.centre_m - b.centre_m) for a, b in (setup.cameras, found.cameras))
    assert abs(own_m - true_m) < 4 * sd_m


@pytest.mark.further
def test_a_thick_board_does_not_raise_the_world():
    """The board lies 5 mm above the plane and says so: the cameras are where they are, within their sd."""
    setup, found = rig(0.005)
    for camera, true in zip(found.cameras, setup.cameras, strict=True):
        own = found.parameters[found.parameters["camera"] == camera.name].set_index("parameter")["sd"]
        sd = own[["tx_m", "ty_m", "tz_m"]].to_numpy(float)
        assert (np.abs(camera.translation_m - true.translation_m) < 4 * sd).all() and sd.max() < 1e-3
        assert np.abs(true.rotation[:, 2] * 0.005 / sd).max() > 8  # without it: many sd off


@pytest.mark.further
def test_tables_are_whole_and_the_plane_is_as_uncertain_as_its_points():
    from ovines.tables import checked
    from vision.calibration.uncertainty import covariance_table, with_calibration_sd

    setup, found = rig()
    for name, table in found.tables.items():
        assert len(checked(table, name)) == len(table)
        assert (len(table) > 0) is (name != "calibration_spline")  # of cameras with an ordinary lens
    plane = found.tables["calibration_plane"]
    points = plane[["x_m", "y_m"]].assign(z_m=0.0)
    again = with_calibration_sd(points, found.cameras, covariance_table(found.covariance, found.labels))
    for axis in "xyz":
        assert np.allclose(plane[f"{axis}_sd_m"], again[f"{axis}_calibration_sd_m"], rtol=1e-5, atol=1e-8)
    corners = found.tables["calibration_corners"]
    assert corners.groupby("camera").size().to_dict() == {c.name: 10 * 96 for c in setup.cameras}
    boards = found.tables["calibration_boards"]
    edge = boards[boards["corner"] < 2].pivot(index=["camera", "view"], columns="corner", values=["x_m", "y_m", "z_m"])
    long_m = np.linalg.norm(edge.xs(1, axis=1, level="corner") - edge.xs(0, axis=1, level="corner").to_numpy(), axis=1)
    assert np.allclose(long_m, setup.board.size_m[0], rtol=1e-5, atol=1e-8)
    assert set(found.parameters["parameter"]) >= {"field_p", "halves_p"}
    assert isinstance(found.tables["calibration_next"], pd.DataFrame)


@pytest.mark.further
def test_watching_tells_what_is_known_as_pictures_arrive(tmp_path):
    from shutil import copy

    from ovines.recording import read_recording
    from vision.validation.watch import watch

    rendered = Path(__file__).resolve().parents[3] / "sample_data" / "rendered"
    pictures = sorted((rendered / "calibration" / "VW1" / "intrinsic").glob("*.jpg"))
    run = tmp_path / "run"
    (run / "VW1").mkdir(parents=True)
    (run / "recording.toml").write_text(
        "format = 1\n[time]\nframe_rate_hz = 800.0\n[[cameras]]\nname = 'VW1'\nsensor_size_px = [2048, 1536]\n"
        "[calibration]\nboard = 'charuco_9x13_20mm'\nintrinsic = '{camera}/*.jpg'\nextrinsic = 'world.jpg'\n",
        encoding="utf-8",
    )
    arrive = [pictures[:2], [], pictures[2:4], [], pictures[4:5], []]
    said: list[list[str]] = [[]]

    def wait() -> bool:
        if not arrive:
            return False
        for path in arrive.pop(0):
            copy(path, run / "VW1")
        said.append([])
        return True

    watch(read_recording(run), lambda line: said[-1].append(line), wait)
    assert said[0] == said[1] == said[3] == said[5] == []  # what may still be written is looked at a look later
    (first,), (second,), (third,) = said[2], said[4], said[6]
    assert first == "VW1: 2 of 2 new pictures show the board; 2 usable views, 3 are needed to begin with"
    assert "; 4 views over " in second and "lens known to" in second and "; next: board in the " in second
    assert third.startswith(f"VW1: {pictures[4].name}: ") and "; 5 views over " in third
    known = [float(re.search(r"known to ([\d.]+) px", line)[1]) for line in (second, third)]
    assert known[1] < known[0]
