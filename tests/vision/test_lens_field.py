"""The lens field learnt from recordings: truth recovered, nothing learnt from nothing, and what must not matter."""

from dataclasses import replace

import cv2
import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.views import GROUND_M, HOST_M, MARKERS, NES_M
from ovines.camera import with_fields
from ovines.lens_field import LensField, lens_fields
from ovines.recording import read_recording
from tests.conftest import two_cameras, write_small_recording
from vision.lens.estimate import learn_lens_field
from vision.lens.lattice import Lattice
from vision.lens.open_terms import OPEN_TERMS, term_pixels
from vision.lens.prior import calibration_part
from vision.triangulate import triangulate

FRAMES, RUNS, RATE_HZ = 400, 3, 800.0
LENGTH_PX = 170.0  # of sin(u / LENGTH): half a wave of 530 px
CORRELATION = 0.6


def residual(camera: int, uv: np.ndarray, size: float) -> np.ndarray:
    """A smooth residual (n, 2) of amplitude ``size`` px, its own in each camera."""
    phase = np.array([[0.4, 2.0, 1.1, 0.2], [2.7, 0.9, 3.6, 4.4]])[camera]
    u, v = uv[:, 0] / LENGTH_PX, uv[:, 1] / LENGTH_PX
    return size * np.column_stack(
        [np.sin(u + phase[0]) * np.sin(v + phase[1]), np.sin(u + phase[2]) * np.cos(v + phase[3])]
    )


def turned(layout: np.ndarray, angle: np.ndarray, place: np.ndarray) -> np.ndarray:
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = layout[:, 0], layout[:, 1]
    z = np.broadcast_to(layout[:, 2], (len(angle), len(layout)))
    return np.stack([place[:, :1] + c * x - s * y, place[:, 1:] + s * x + c * y, z], -1)


def tracks_of(
    rng: np.random.Generator,
    cameras,
    offsets,
    size: float,
    sd_px: float,
    correlation: float,
    loose: float = 0.0,
    measured=lambda world: world,
) -> pd.DataFrame:
    """Tracks of a run: the Host shaken along x, the NES wandering and spinning inside it; the Host's second marker goes
    ``loose`` times its way further, as one that bends with the acceleration does.  ``measured``: where a calibration
    puts points of the world."""
    t = np.arange(FRAMES) / RATE_HZ
    host = np.column_stack([0.016 * np.sin(2 * np.pi * 11 * t + rng.uniform(0, 6)), 0 * t])
    a, b, c, d = rng.uniform(0, 2 * np.pi, 4)
    nes = 0.024 * np.column_stack(
        [np.sin(19 * t + a) + 0.4 * np.sin(47 * t + b), np.sin(23 * t + c) + 0.4 * np.cos(41 * t + d)]
    )
    still = np.broadcast_to(GROUND_M, (FRAMES, 3, 3))
    world = np.concatenate([still, turned(HOST_M, 0 * t, host), turned(NES_M, 30 * t + a, nes)], 1)
    world[:, MARKERS.index("H2"), :2] += loose * host
    world = measured(world)
    parts = []
    for k, camera in enumerate(cameras):
        uv = camera.project(world)
        uv = uv + residual(k, uv.reshape(-1, 2), size).reshape(uv.shape)
        noise = rng.normal(0, sd_px, uv.shape)
        for i in range(1, FRAMES):
            noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * noise[i]
        uv = uv + noise - np.asarray(offsets[camera.name])
        frame, marker = np.indices(uv.shape[:2]).reshape(2, -1)
        parts.append(
            pd.DataFrame(
                {
                    "camera": camera.name,
                    "frame": frame,
                    "time_s": t[frame],
                    "marker": np.array(MARKERS, object)[marker],
                    "u_px": uv.reshape(-1, 2)[:, 0],
                    "v_px": uv.reshape(-1, 2)[:, 1],
                    "sd_px": sd_px,
                }
            )
        )
    return pd.concat(parts, ignore_index=True)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lens") / "run-01"
    write_small_recording(folder)
    return read_recording(folder), list(two_cameras())


def filmed(rig, size, sd_px=0.1, correlation=0.0, seed=0, loose=0.0):
    recording, cameras = rig
    rng = np.random.default_rng(seed)
    return [tracks_of(rng, cameras, recording.window_offset_px, size, sd_px, correlation, loose) for _ in range(RUNS)]


def learnt(rig, tracks):
    return learn_lens_field(tracks, [rig[0]] * len(tracks), rig[1])


def left_px(rig, found, put):
    """Truth less field where Host and NES went: (RMS, RMS without open terms, open terms of the difference).

    ``put``: true field of camera k at points (n, 3) and their pixels.
    """
    cameras = rig[1]
    fields = lens_fields(found.field, found.terms)
    t = np.linspace(0, 2 * np.pi, 9)[:-1]
    ring = [np.column_stack([r * np.cos(t), r * np.sin(t), 0 * t + 0.01]) for r in (0.01, 0.02, 0.03, 0.04)]
    points = np.concatenate(ring)
    uv = [camera.project(points) for camera in cameras]
    apart = np.concatenate([put(k, points, uv[k]) - fields[c.name].at(uv[k]) for k, c in enumerate(cameras)], 1)
    moves = term_pixels(points, sorted(cameras, key=lambda c: c.name)).reshape(-1, len(OPEN_TERMS))
    open_terms = np.linalg.lstsq(moves, apart.reshape(-1), rcond=None)[0]
    closed = apart.reshape(-1) - moves @ open_terms
    rms = float(np.sqrt(np.mean(apart**2))), float(np.sqrt(np.mean(closed**2)))
    return *rms, dict(zip(OPEN_TERMS, open_terms, strict=True))


@pytest.mark.others_further
@pytest.mark.parametrize("correlation", [0.0, CORRELATION])
def test_the_field_is_found_and_open_terms_are_within_their_sds(rig, correlation):
    found = learnt(rig, filmed(rig, 0.25, correlation=correlation))
    assert found.field is not None and found.loose == ()
    _, closed, open_terms = left_px(rig, found, lambda k, _, uv: residual(k, uv, 0.25))
    assert closed < 0.03
    sd = found.terms.set_index("term")["sd"]
    assert max(abs(open_terms[name]) / sd[name] for name in ("scale", "plane_along", "plane_across")) < 3.5


@pytest.mark.further
def test_correlated_noise_is_seen_and_makes_the_field_less_sure(rig):
    white, red = (learnt(rig, filmed(rig, 0.25, correlation=one)).terms.set_index("term") for one in (0.0, CORRELATION))
    noise = "noise_over_sd"
    assert white.loc[noise, "value"] == pytest.approx(1.0, abs=0.12)
    expected = np.sqrt((1 + CORRELATION) / (1 - CORRELATION))  # 2: of a mean over slow motion
    assert 0.75 * expected < red.loc[noise, "value"] < 1.2 * expected


@pytest.mark.further
@pytest.mark.parametrize(("loose", "size"), [(0.02, 0.0), (0.006, 0.0), (0.02, 0.25), (0.006, 0.25)])
def test_a_marker_that_moves_on_its_body_is_no_lens(rig, loose, size):
    """It is reported, whatever the others need: nothing, or the field that is there."""
    found = learnt(rig, filmed(rig, size, loose=loose))
    assert found.loose == ("H2",) and "H2, which moves on its body" in found.note
    assert (found.field is not None) == (size > 0)
    if size:
        assert left_px(rig, found, lambda k, _, uv: residual(k, uv, size))[1] < 0.03


def test_a_loose_marker_of_three_leaves_nothing_to_learn_from(rig):
    tracks = [one[one["marker"] != "H4"] for one in filmed(rig, 0.25, loose=0.03)]
    found = learnt(rig, tracks)
    assert found.field is None and len(found.loose) == 1 and "too few other markers" in found.note


@pytest.mark.others_further
@pytest.mark.parametrize("correlation", [0.0, CORRELATION])
def test_nothing_is_learnt_where_the_lens_leaves_nothing(rig, correlation):
    found = learnt(rig, filmed(rig, 0.0, correlation=correlation, seed=3))
    terms = found.terms.set_index("term")["value"]
    assert found.field is None and terms["used"] == 0 and terms["held_out_sds"] < 5


def covariance_rows(matrix: np.ndarray, labels: list[tuple[str, str]]) -> pd.DataFrame:
    """Table ``calibration_covariance`` of a full matrix."""
    columns = ["camera", "parameter", "other_camera", "other_parameter", "covariance"]
    pairs = [(i, j) for i in range(len(labels)) for j in range(i, len(labels))]
    return pd.DataFrame([(*labels[i], *labels[j], matrix[i, j]) for i, j in pairs], columns=columns)


def changed(camera, parameter: str, by: float):
    """The camera with one parameter of its calibration off."""
    if parameter in ("fx", "cy"):
        at = {"fx": (0, 0), "cy": (1, 2)}[parameter]
        matrix = camera.matrix.copy()
        matrix[at] += by
        return replace(camera, matrix=matrix)
    if parameter in ("k1", "p1"):
        return replace(camera, distortion=camera.distortion + by * np.eye(5)[{"k1": 0, "p1": 2}[parameter]])
    if parameter.startswith("spline"):
        own = camera.spline.labels.index(parameter)
        return replace(
            camera, spline=camera.spline.with_values(camera.spline.values_px + by * np.eye(camera.spline.size)[own])
        )
    if parameter == "ry":
        return replace(camera, rotation=cv2.Rodrigues(np.array([0, by, 0]))[0] @ camera.rotation)
    return replace(camera, translation_m=camera.translation_m + by * np.eye(3)["xyz".index(parameter[1])])


def with_splines(cameras):
    """Each with a smooth spline of 0.3 px over its sensor."""
    found = []
    for k, camera in enumerate(cameras):
        u, v = (np.linspace(0, side - 1, n) for side, n in zip(camera.sensor_size_px, (13, 10), strict=True))
        grid = np.stack(np.meshgrid(u, v, indexing="ij"), -1)
        shift = 0.3 * np.stack([np.sin(grid[..., 0] / 180 + k), np.cos(grid[..., 1] / 160 + 2 * k)], -1)
        found.append(replace(camera, spline=LensField(u, v, shift)))
    return found


@pytest.mark.parametrize("splines", [False, True])
def test_the_calibrations_part_of_the_prior_is_what_its_parameters_do_to_pictures_of_the_plane(rig, splines):
    """By differences of pictures: J C J', with a covariance that ties the cameras."""
    cameras, height_m = with_splines(rig[1]) if splines else rig[1], 0.01
    steps = {"fx": 2.0, "cy": 1.0, "k1": 0.02, "p1": 1e-3, "ry": 1e-3, "tx": 1e-3, "tz": 1e-3}
    if splines:
        steps |= {"spline_u_4_3": 0.1, "spline_v_5_4": 0.2}
    labels = [(camera.name, parameter) for camera in cameras for parameter in steps]
    step = np.array([steps[parameter] for _, parameter in labels])
    mixed = np.random.default_rng(5).normal(size=(len(step), len(step))) * step
    covariance = mixed.T @ mixed
    lattices = [Lattice(150.0, 10, 7, 6, 5), Lattice(150.0, 11, 5, 6, 5)]
    columns = []
    for name, parameter in labels:
        own = []
        for camera, lattice in zip(cameras, lattices, strict=True):
            ray = camera.rays(lattice.sites_px)
            points = camera.centre_m + (height_m - camera.centre_m[2]) / ray[:, 2:] * ray
            small = 1e-3 * steps[parameter] * (camera.name == name)
            ahead, back = (changed(camera, parameter, by).project(points) for by in (small, -small))
            own.append(((ahead - back) / (2e-3 * steps[parameter])).T.ravel())  # u of all sites, then v
        columns.append(np.concatenate(own))
    pictures = np.stack(columns, -1)
    expected = pictures @ covariance @ pictures.T
    found = calibration_part(lattices, cameras, covariance_rows(covariance, labels), height_m)
    # slopes of a spline, a thousandth, are no part of the derivatives by the others
    assert np.allclose(found, expected, atol=(3e-3 if splines else 1e-6) * np.abs(expected).max())
    assert not calibration_part(lattices, cameras, None, height_m).any()


@pytest.mark.further
@pytest.mark.parametrize(("parameter", "sd"), [("k1", 0.05), ("p1", 1e-3)])
def test_a_lens_that_the_calibration_knows_badly_is_found_by_its_covariance(rig, parameter, sd, monkeypatch):
    """Two of its sds off, in one camera: the covariance says which field to look for, open terms included; without one
    its form does."""
    recording, cameras = rig
    true = [changed(cameras[0], parameter, 2 * sd), cameras[1]]
    rng = np.random.default_rng(0)
    tracks = [tracks_of(rng, true, recording.window_offset_px, 0.0, 0.1, 0.0) for _ in range(RUNS)]
    known = covariance_rows(np.array([[sd**2]]), [(cameras[0].name, parameter)])
    left, closed = [], []
    for covariance in (None, known):
        found = learn_lens_field(tracks, [recording] * RUNS, cameras, covariance)
        rms, without_open, _ = left_px(rig, found, lambda k, points, uv: true[k].project(points) - uv)
        left.append(rms)
        closed.append(without_open)
    assert left[0] < 0.01 and max(closed) < 0.01
    monkeypatch.setattr("vision.lens.changes.SURE", np.inf)  # a smooth field alone
    found = learn_lens_field(tracks, [recording] * RUNS, cameras)
    smooth = left_px(rig, found, lambda k, points, uv: true[k].project(points) - uv)
    assert left[1] < 0.25 * smooth[0] and closed[1] < 0.7 * smooth[1]


def test_few_frames_one_body_or_one_camera_change_nothing(rig):
    recording, cameras = rig
    tracks = filmed(rig, 0.25)[0]
    few = tracks[tracks["frame"] < 100]
    one_body = tracks[~tracks["marker"].str.startswith("N")]
    one_camera = tracks[tracks["camera"] == cameras[0].name]
    for poor in (few, one_body, one_camera, tracks.iloc[:0]):
        found = learn_lens_field([poor], [recording], cameras)
        assert found.field is None and found.terms.set_index("term").loc["used", "value"] == 0
    assert learn_lens_field([], [], cameras).field is None


@pytest.mark.further
def test_order_of_cameras_runs_and_rows_does_not_matter(rig):
    recording, cameras = rig
    tracks = filmed(rig, 0.25)
    first = learnt(rig, tracks).field
    mixed = [one.sample(frac=1.0, random_state=4) for one in tracks[::-1]]
    second = learn_lens_field(mixed, [recording] * RUNS, cameras[::-1]).field
    for column in ("u_px", "v_px", "du_px", "dv_px", "du_sd_px"):
        assert np.allclose(first[column], second[column], atol=1e-6)


@pytest.mark.further
def test_the_worlds_origin_and_turn_do_not_matter(rig):
    recording, cameras = rig
    tracks = filmed(rig, 0.25)
    first = learnt(rig, tracks)
    c, s = np.cos(0.7), np.sin(0.7)
    turn, shift = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]), np.array([0.4, -0.9, 0.0])
    moved = []
    for camera in cameras:
        rotation = camera.rotation @ turn.T
        moved.append(replace(camera, rotation=rotation, translation_m=camera.translation_m - rotation @ shift))
    second = learn_lens_field(tracks, [recording] * RUNS, moved)
    assert np.allclose(first.field[["du_px", "dv_px"]], second.field[["du_px", "dv_px"]], atol=1e-3)
    before, after = (one.terms.set_index("term")["value"] for one in (first, second))
    for name in ("plane_along", "plane_across", "shift_along_m", "scale"):
        assert after[name] == pytest.approx(before[name], abs=1e-5)


@pytest.mark.further
def test_a_tilted_plane_is_left_to_the_diagnosis(rig):
    """A field that is learnt beside a tilt holds nothing of it."""
    recording, cameras = rig
    tilt = 0.004
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    tracks = filmed(rig, 0.25)
    other = [replace(camera, rotation=camera.rotation @ turn) for camera in cameras]
    level, tilted = (
        learn_lens_field(tracks, [recording] * RUNS, some).terms.set_index("term") for some in (cameras, other)
    )
    for name in ("plane_along", "plane_across"):
        assert abs(tilted.loc[name, "value"] - level.loc[name, "value"]) < 0.5 * level.loc[name, "sd"]


@pytest.mark.further
def test_points_of_a_recording_are_corrected_by_its_field(rig):
    recording, cameras = rig
    tracks = filmed(rig, 0.25)
    found = learnt(rig, tracks)
    plain = triangulate(tracks[0], cameras, recording.window_offset_px)
    learnt_points = triangulate(
        tracks[0], with_fields(cameras, lens_fields(found.field, found.terms)), recording.window_offset_px
    )
    assert learnt_points["epipolar_px"].std() < 0.9 * plain["epipolar_px"].std()


def test_a_camera_with_a_field_projects_where_it_looks(rig):
    camera = rig[1][0]
    rng = np.random.default_rng(1)
    nodes = np.arange(0.0, 4200.0, 300.0)
    field = LensField(nodes, nodes, rng.normal(0, 0.2, (len(nodes), len(nodes), 2)))
    (with_one,) = with_fields([camera], {camera.name: field})
    points = rng.uniform(-0.05, 0.05, (50, 3)) * [1, 1, 0.2]
    uv = with_one.project(points)
    assert np.allclose(uv - field.at(uv), camera.project(points), atol=1e-5)
    assert np.allclose(with_one.rays(uv), camera.rays(camera.project(points)), atol=1e-8)
    assert np.isnan(field.at([np.nan, 3.0])).sum() == 0


@pytest.mark.further
def test_what_a_calibrations_spline_says_is_not_learnt_again(rig):
    recording, plain = rig
    bent = with_splines(plain)
    rng = np.random.default_rng(3)
    tracks = [tracks_of(rng, bent, recording.window_offset_px, 0.0, 0.1, 0.0) for _ in range(RUNS)]
    assert learn_lens_field(tracks, [recording] * RUNS, plain).field is not None
    assert learn_lens_field(tracks, [recording] * RUNS, bent).field is None
    quiet = tracks_of(rng, bent, recording.window_offset_px, 0.0, 0.001, 0.0)
    by_bent, by_plain = (triangulate(quiet, own, recording.window_offset_px) for own in (bent, plain))
    assert by_bent["epipolar_px"].std() < 0.0015 and by_plain["epipolar_px"].std() > 0.02


def test_a_field_adds_to_a_spline(rig):
    camera = with_splines(rig[1])[0]
    nodes = np.arange(0.0, 4200.0, 300.0)
    field = LensField(nodes, nodes, np.random.default_rng(1).normal(0, 0.2, (len(nodes), len(nodes), 2)))
    (both,) = with_fields([camera], {camera.name: field})
    points = np.random.default_rng(2).uniform(-0.05, 0.05, (50, 3)) * [1, 1, 0.2]
    uv = both.project(points)
    assert np.allclose(uv, camera.project(points) + field.at(uv), atol=1e-5)
    assert np.allclose(both.rays(uv), rig[1][0].rays(rig[1][0].project(points)), atol=1e-8)
