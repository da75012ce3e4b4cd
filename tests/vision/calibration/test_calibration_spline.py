"""A spline over the image as one of the lenses that a calibration tries: chosen where views show it, and used then."""

from __future__ import annotations

import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ovines.camera import Camera, read_calibration, triangulate_points, write_calibration
from ovines.errors import InputError
from ovines.exporters.calibrations import FORMATS, export
from ovines.lens_field import LensField
from ovines.tables import checked
from vision.calibrate import calibrate
from vision.calibration.bundle.unknowns import N_CAMERA, n_parameters, spline_places
from vision.calibration.single_camera import Single, board_pose, solve_camera, spline_prior
from vision.calibration.targets.boards import WORLD_FROM_BOARD, Board
from vision.calibration.targets.detection import View
from vision.calibration.uncertainty import covariance_of, covariance_table, shifts
from vision.rendering.board import render_board
from vision.rendering.images import Look
from vision.rendering.images import View as Shown
from vision.validation.lens_choice import Tried, choose_lens

SIZE = (1280, 960)
BOARD = Board("chessboard", (10, 7), 0.025, kind="chessboard")
NOISE_PX, FIELD_PX = 0.05, 0.25
TURNS = {"left": 0.15, "right": -0.2}  # of the cameras, about y


def waves(seed: int, rms_px: float = FIELD_PX):
    """A smooth field (n, 2) -> (n, 2) of structures of an eighth of the image: cosines, no splines."""
    rng = np.random.default_rng(seed)
    number, phase = rng.normal(0, 1 / (SIZE[0] / 8), (2, 40, 2)), rng.uniform(0, 2 * np.pi, (2, 40))

    def field(uv_px: np.ndarray) -> np.ndarray:
        shift = [np.cos(uv_px @ number[c].T + phase[c]).sum(1) * np.sqrt(2 / 40) for c in (0, 1)]
        return rms_px / np.sqrt(2) * np.stack(shift, -1)

    return field


def lens(focal_px: float = 900.0, spline: LensField | None = None) -> Camera:
    matrix = np.array([[focal_px, 0, 639.5], [0, focal_px, 479.5], [0, 0, 1]])
    return Camera("A", SIZE, matrix, np.array([-0.1, 0.05, 0, 0, 0.0]), np.eye(3), np.zeros(3), spline=spline)


def held(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """A pose of the board that fills a third of the image or more."""
    about = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(rng.uniform(15, 40)) * np.array([np.cos(about), np.sin(about), 0])
    turn = np.asarray(cv2.Rodrigues(np.array([0, 0, rng.uniform(-3, 3)]))[0] @ cv2.Rodrigues(tilt)[0], float)
    depth = rng.uniform(1.2, 2.2) * max(BOARD.size_m) * 900 / SIZE[0]
    middle = depth * np.append(rng.uniform(-0.5, 0.5, 2) * SIZE / 900, 1)
    return turn, middle - turn @ np.array([*np.array(BOARD.size_m) / 2, 0])


def seen(points_camera: np.ndarray, name: str, field, rng: np.random.Generator, noise_px: float = NOISE_PX) -> View:
    uv = lens().project(points_camera)
    uv = uv if field is None else uv + field(uv)
    inside = (uv > 5).all(1) & (uv < np.array(SIZE) - 5).all(1)
    uv = uv[inside] + rng.normal(0, noise_px, (inside.sum(), 2))
    return View(name, np.flatnonzero(inside), uv, np.full(inside.sum(), NOISE_PX))


def views(count: int, seed: int, field=None, noise_px: float = NOISE_PX) -> list[View]:
    rng, found = np.random.default_rng(seed), []
    while len(found) < count:
        turn, shift = held(rng)
        view = seen(BOARD.points_m() @ turn.T + shift, f"{len(found):02d}", field, rng, noise_px)
        if len(view.points) >= 12:
            found.append(view)
    return found


def chosen(own: list[View]) -> tuple[Single, list[Tried]]:
    return choose_lens(solve_camera(own, BOARD, SIZE), own, BOARD, SIZE)


def left_px(camera: Camera, field) -> float:
    """RMS over points of exact views of which the lens' pose alone is fitted: what of the lens is wrong."""
    left = []
    for view in views(30, 99, field, noise_px=0.0):
        points = BOARD.points_m()[view.points]
        turn, shift = board_pose(points, view.uv_px, camera)
        left.append(view.uv_px - camera.project(points @ turn.T + shift))
    return float(np.sqrt(2 * np.mean(np.concatenate(left) ** 2)))


@pytest.fixture(scope="module")
def bent():
    """A camera with a field that no terms describe, calibrated from 16 views."""
    field = waves(0)
    return field, *chosen(views(16, 1, field))


@pytest.mark.further
def test_a_field_that_no_terms_can_follow_is_taken_up_by_the_spline(bent):
    field, single, tried = bent
    (taken,) = [one for one in tried if one.chosen]
    others = [one.held_out_px for one in tried if one is not taken and np.isfinite(one.held_out_px)]
    assert taken.lens == "spline" and taken.held_out_px < 0.7 * min(others)
    assert single.adjusted.sigma_px[0] == pytest.approx(NOISE_PX, rel=0.1)
    with_terms_alone = solve_camera(views(16, 1, field), BOARD, SIZE)
    assert left_px(single.adjusted.state.lens(0), field) < 0.35 * left_px(
        with_terms_alone.adjusted.state.lens(0), field
    )


def test_the_splines_sd_covers_what_it_misses(bent):
    """Differences between two places of the image, which no pose or focal length takes up as a whole."""
    field, single, _ = bent
    state, uv = single.adjusted.state, np.stack(np.meshgrid(np.linspace(100, 1180, 12), np.linspace(80, 880, 9)), -1)
    uv = uv.reshape(-1, 2)
    from vision.validation.image_map import image_map

    at = image_map(state.intrinsics[0], SIZE, single.views, state.splines[0])
    found = state.lens(0)
    rays = found.normalise(at.uv_px)
    truth = lens().project(np.column_stack([rays, np.ones(len(rays))]))
    off = at.uv_px - truth - field(truth)
    zero, (x, y) = 0 * rays[:, 0], rays.T
    turned = 900 * np.stack([np.stack([x * y, -(1 + x * x), y], -1), np.stack([1 + y * y, -x * y, -x], -1)], 1)
    assert turned.shape == (len(rays), 2, 3) and not zero.any()
    own = at.visited
    turn = np.linalg.lstsq(turned[own].reshape(-1, 3), off[own].ravel(), rcond=None)[0]
    off = (off - turned @ turn)[own]
    sd = at.sd_px(np.nan_to_num(single.adjusted.lens_covariance(0)))[own]
    assert 0.75 < np.mean(np.abs(off) < 1.645 * sd[:, None]) <= 1.0


@pytest.mark.others_further
@pytest.mark.parametrize(("count", "field"), [(16, None), (7, waves(0)), (9, None)])
def test_an_ordinary_lens_and_few_views_have_none(count, field):
    single, tried = chosen(views(count, 2, field))
    assert single.adjusted.state.splines == (None,) and not any(one.chosen for one in tried if one.lens == "spline")


def test_a_spline_found_stands_as_prior_with_its_own_covariance(bent):
    single = bent[1]
    found, before = spline_prior(single, found=True), spline_prior(single, found=False)
    state = single.adjusted.state
    own = spline_places(state.splines, 0)
    covariance = single.adjusted.covariance[np.ix_(own, own)]
    assert np.allclose(found.mean_px, state.splines[0].values_px, rtol=1e-5, atol=1e-8) and not before.mean_px.any()
    assert np.allclose(found.precision @ covariance, np.eye(len(own)), atol=1e-6)
    assert (np.diag(covariance) < np.diag(np.linalg.inv(before.precision)) * 1.001).all()  # views only narrow it


def test_what_is_seen_and_where_it_lies_are_each_others_inverse(bent):
    camera = bent[1].adjusted.state.lens(0)
    uv = np.random.default_rng(0).uniform(0, 1, (200, 2)) * (np.array(SIZE) - 1)
    there = camera.project(2.0 * np.column_stack([camera.normalise(uv), np.ones(len(uv))]))
    assert np.abs(there - uv).max() < 1e-5
    spline = camera.spline
    assert np.allclose(spline.slopes(uv) @ spline.values_px, spline.at(uv), atol=1e-12)
    assert np.allclose(spline.with_values(spline.values_px).shift_px, spline.shift_px, rtol=1e-5, atol=1e-8)


@pytest.fixture(scope="module")
def pair():
    """Two cameras with fields of their own, calibrated with a world."""
    rng = np.random.default_rng(4)
    fields = {"left": waves(10), "right": waves(11)}
    own = {name: views(10, 20 + k, fields[name]) for k, name in enumerate(fields)}
    world, poses = {}, {}
    for name, about in TURNS.items():
        turn = np.asarray(cv2.Rodrigues(np.array([0.0, about, 0.0]))[0], float) @ np.diag([1.0, 1.0, 1.0])
        shift = np.array([0, 0, 0.33]) - turn @ np.array([*np.array(BOARD.size_m) / 2, 0])
        world[name] = seen(BOARD.points_m() @ turn.T + shift, "world", fields[name], rng)
        poses[name] = turn @ WORLD_FROM_BOARD, shift
    board = BOARD
    return fields, poses, calibrate(board, own, dict.fromkeys(own, SIZE), world)


@pytest.mark.further
def test_points_seen_through_both_splines_lie_where_they_are(pair):
    fields, poses, found = pair
    points = np.random.default_rng(5).uniform([0.0, -0.15, 0.0], [0.22, 0.0, 0.02], (60, 3))
    pixels = []
    for name, (turn, shift) in poses.items():
        uv = lens().project(points @ turn.T + shift)
        pixels.append(uv + fields[name](uv))
    sd = [np.full(len(points), NOISE_PX)] * 2
    bare = [replace(camera, spline=None) for camera in found.cameras]
    assert all(camera.spline is not None for camera in found.cameras)

    def shape_m(cameras) -> float:  # after the best rigid motion: the world's own place is as sure as its one view
        got = triangulate_points(cameras, pixels, sd).points_m
        a, b = got - got.mean(0), points - points.mean(0)
        u, _, vt = np.linalg.svd(a.T @ b)
        turn = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
        return float(np.sqrt(np.mean(np.sum((a @ turn - b) ** 2, 1))))

    assert shape_m(found.cameras) < 0.5 * shape_m(bare)
    again = triangulate_points(found.cameras, [camera.project(points) for camera in found.cameras], sd)
    assert np.allclose(again.points_m, points, atol=1e-9)


@pytest.mark.further
def test_the_table_of_nodes_is_the_spline_with_its_sd(pair):
    found = pair[2]
    table = checked(found.tables["calibration_spline"], "calibration_spline")
    for c, camera in enumerate(found.cameras):
        own = table[table["camera"] == camera.name]
        assert np.allclose(camera.spline.at(own[["u_px", "v_px"]]), own[["du_px", "dv_px"]], atol=1e-9)
        variance = np.diag(found.covariance)[spline_places([one.spline for one in found.cameras], c)]
        assert np.allclose(own[["du_sd_px", "dv_sd_px"]].to_numpy().T.ravel() ** 2, variance, rtol=1e-5, atol=1e-8)
    advice = [line for line in found.advice if "a spline of" in line]
    assert [line.split(":")[0] for line in advice] == ["left", "right"]


@pytest.mark.further
def test_its_covariance_moves_points_as_differences_do(pair):
    _, _, found = pair
    cameras, splines = found.cameras, [camera.spline for camera in found.cameras]
    assert found.covariance.shape == (n_parameters(splines),) * 2 and len(found.labels) > N_CAMERA * 2
    back = covariance_of(covariance_table(found.covariance, found.labels), cameras)
    assert np.allclose(back, np.nan_to_num(found.covariance), rtol=1e-6, atol=1e-12)
    points = np.array([[0.05, -0.05, 0.0], [0.15, -0.1, 0.01]])
    by_all, pixels = shifts(points, cameras), [camera.project(points) for camera in cameras]
    for c in range(2):
        places = spline_places(splines, c)
        for k in (5, len(places) // 4, len(places) - 60):
            step = np.zeros(len(places))
            step[k] = 0.01
            moved = [*cameras]
            moved[c] = replace(moved[c], spline=splines[c].with_values(splines[c].values_px + step))
            change = triangulate_points(moved, pixels, [np.ones(2)] * 2).points_m - points
            assert np.allclose(change / 0.01, by_all[..., places[k]], rtol=0.02, atol=2e-7)
    assert (np.sqrt(np.diag(back))[spline_places(splines, 0)] > 0).all()


def test_calibration_json_keeps_it_and_reads_files_without_as_before(bent, tmp_path):
    found = replace(bent[1].adjusted.state.lens(0), sensor_size_px=SIZE)
    twice = found.spline.with_values(2 * found.spline.values_px)
    cameras = [replace(found, name="left"), replace(found, name="right", spline=twice)]
    write_calibration(cameras, tmp_path / "with.json")
    for one, back in zip(cameras, read_calibration(tmp_path / "with.json"), strict=True):
        assert (back.spline.u_px == one.spline.u_px).all() and (back.spline.v_px == one.spline.v_px).all()
        assert (back.spline.shift_px == one.spline.shift_px).all()
    plain = [replace(camera, spline=None) for camera in cameras]
    write_calibration(plain, tmp_path / "without.json")
    assert "spline" not in (tmp_path / "without.json").read_text()
    assert [one.spline for one in read_calibration(tmp_path / "without.json")] == [None, None]


@pytest.mark.parametrize(
    "change",
    [
        {"u_px": [0, 1, 2]},
        {"u_px": [0, 2, 1, 3]},
        {"shift_px": [[[0, 0]] * 4] * 3},
        {"v_px": ["a", 1, 2, 3]},
        {"shift_px": [[[0, float("nan")]] * 4] * 4},
    ],
)
def test_a_broken_spline_is_refused(change, tmp_path):
    nodes = np.arange(4.0)
    write_calibration([lens(spline=LensField(nodes, nodes, np.zeros((4, 4, 2))))], tmp_path / "calibration.json")
    content = json.loads((tmp_path / "calibration.json").read_text())
    assert read_calibration(tmp_path / "calibration.json")[0].spline is not None
    content["cameras"][0]["spline"].update(change)
    (tmp_path / "calibration.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="spline = "):
        read_calibration(tmp_path / "calibration.json")


@pytest.mark.parametrize("program", list(FORMATS))
def test_programs_that_know_no_spline_are_not_given_one(program):
    nodes = np.arange(4.0)
    camera = replace(lens(), distortion=np.zeros(5))
    assert export([camera], program)
    with pytest.raises(InputError, match="a spline beside the distortion terms, up to 0.5 px") as refused:
        export([replace(camera, spline=LensField(nodes, nodes, np.full((4, 4, 2), 0.5)))], program)
    assert "calibration.json" in str(refused.value)


def test_pictures_are_rendered_through_it():
    nodes = np.linspace(0, 1279, 8)
    camera = lens(spline=LensField(nodes, nodes, np.full((8, 8, 2), [3.0, -2.0])))
    turn, shift = np.eye(3), np.array([-0.12, -0.08, 0.4])
    image, corners = render_board(Shown(camera), BOARD, turn, shift, Look(), np.random.default_rng(0))
    plain, there = render_board(Shown(lens()), BOARD, turn, shift, Look(), np.random.default_rng(0))
    assert np.allclose(corners - there, [3, -2], rtol=1e-5, atol=1e-8)
    assert np.abs(image[:-2, 3:].astype(float) - plain[2:, :-3]).mean() < 3.0
