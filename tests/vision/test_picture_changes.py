"""What has happened to a camera since its calibration: found by its form, with its size, and nothing where only
the lens is not exact."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from ovines.camera.bends import BENDS, DECENTRING, PERIODS_RAD, RADIAL, SKEW, STRETCH, TURN, ZOOM, bend_px
from ovines.camera.boards import board_bend_px, board_move_m
from ovines.lens_field import lens_fields
from ovines.recording import read_recording
from tests.conftest import two_cameras, write_small_recording
from tests.vision.test_lens_field import CORRELATION, RUNS, filmed, learnt, left_px, tracks_of
from vision.lens.forms import spline_of
from vision.lens.lattice import Lattice

#: of the second camera: what is changed, by how much, along which direction of its picture
CASES = [
    (ZOOM, 4e-3, 0.0),
    (TURN, 1.2e-3, 0.0),
    (STRETCH, 1.5e-3, 0.4),
    (RADIAL, 2e-8, 0.0),
    (DECENTRING, 5e-6, 2.1),
    (SKEW, 3e-3, 0.0),
]


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    folder = tmp_path_factory.mktemp("changes") / "run-01"
    write_small_recording(folder)
    return read_recording(folder), list(two_cameras())


def bent(rig, tracks: list[pd.DataFrame], target: str, value: float, direction: float) -> list[pd.DataFrame]:
    """Tracks of which the second camera's picture has changed: each pixel is seen where its bend puts it."""
    recording, cameras = rig
    camera = cameras[1]
    offset = np.asarray(recording.window_offset_px[camera.name], float)
    out = []
    for one in tracks:
        own = one["camera"] == camera.name
        uv = one.loc[own, ["u_px", "v_px"]].to_numpy(float) + offset
        moved = uv + value * bend_px(target, direction, uv - camera.matrix[:2, 2]) - offset
        table = one.copy()
        table.loc[own, "u_px"], table.loc[own, "v_px"] = moved[:, 0], moved[:, 1]
        out.append(table)
    return out


@pytest.mark.further
@pytest.mark.parametrize(("target", "value", "direction"), CASES, ids=[case[0] for case in CASES])
def test_a_change_is_found_with_its_size_and_the_field_is_whole(rig, target, value, direction):
    """Beside correlated noise; the scale and the tilt that the change makes are in the field, too."""
    found = learnt(rig, bent(rig, filmed(rig, 0.0, correlation=CORRELATION), target, value, direction))
    (one,) = found.changes
    assert (one.camera, one.target) == (rig[1][1].name, target)
    turns = PERIODS_RAD.get(target, 2 * np.pi)
    off = (one.direction_rad - direction + turns / 2) % turns - turns / 2
    assert abs(off) < max(4 * one.direction_sd_rad, 1e-9)
    assert abs(one.value - value) < max(4 * one.sd, 2e-3 * abs(value))
    assert one.size_px > 0.1 and 1 - one.after.sum() / one.before.sum() > 0.97
    assert rig[1][1].name in found.note and one.words in found.note
    terms = found.terms.set_index("term")["value"]
    assert terms[f"{target}:{one.camera}"] == one.value

    def put(k, _, uv):
        middle = rig[1][k].matrix[:2, 2]
        return (k == 1) * value * bend_px(target, direction, uv - middle)

    whole, _, _ = left_px(rig, found, put)
    assert whole < 0.06


def by_boards(rig, size_px, measured):
    """Runs filmed by cameras that were calibrated on boards which put points of the world elsewhere."""
    rng = np.random.default_rng(4)
    offsets = rig[0].window_offset_px
    return [tracks_of(rng, rig[1], offsets, size_px, 0.1, CORRELATION, measured=measured) for _ in range(RUNS)]


def longer(share, direction_rad):
    def measured(world):
        along = np.array([np.cos(direction_rad), np.sin(direction_rad), 0.0])
        return world + share * (world @ along)[..., None] * along

    return measured


def bowed(per_m2, place_m):
    def measured(world):
        off = (world - np.array([*place_m, 0.0])) * np.array([1.0, 1.0, 0.0])
        return world + per_m2 * np.sum(off**2, -1, keepdims=True) * off

    return measured


@pytest.mark.further
@pytest.mark.parametrize(("share", "direction_rad"), [(0.004, 0.5), (-0.004, 2.2)])
@pytest.mark.parametrize("size_px", [0.0, 0.2])
def test_boards_that_are_longer_one_way(rig, share, direction_rad, size_px):
    """The layouts tell a print that is too long from one that is too short across it; a lens makes a scale, too."""
    found = learnt(rig, by_boards(rig, size_px, longer(share, direction_rad)))
    (one,) = found.changes
    assert (one.camera, one.target) == ("", "board_stretch") and "the boards were off" in found.note
    assert one.value == pytest.approx(share, rel=0.3 if size_px else 0.06) and abs(one.value - share) < 4 * one.sd
    off = (one.direction_rad - direction_rad + np.pi / 2) % np.pi - np.pi / 2
    assert abs(off) < 4 * one.direction_sd_rad and one.direction_sd_rad < 0.1
    assert 1 - one.after.sum() / one.before.sum() > 0.9
    assert found.terms.set_index("term").loc["board_stretch_direction_rad", "value"] == one.direction_rad


@pytest.mark.further
@pytest.mark.parametrize("place_m", [(0.0, 0.0), (0.02, -0.01)])
def test_boards_that_were_bowed(rig, place_m):
    found = learnt(rig, by_boards(rig, 0.0, bowed(1.2, place_m)))
    (one,) = found.changes
    assert (one.camera, one.target) == ("", "board_bow")
    assert one.value == pytest.approx(1.2, rel=0.1)
    off_m = np.array(one.place_m) - place_m
    assert (np.abs(off_m) < np.maximum(4 * np.array(one.place_sd_m), 3e-3)).all()
    assert 1 - one.after.sum() / one.before.sum() > 0.9


def test_the_world_s_axes_do_not_matter_to_a_board(rig):
    """Moves turn and shift with the world; the picture of a plane's points is what the camera makes of them."""
    place = np.random.default_rng(5).uniform(-0.05, 0.05, (20, 2))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    np.testing.assert_allclose(
        board_move_m("board_stretch", 0.3 + 0.7, 0.0, place @ turn.T),
        board_move_m("board_stretch", 0.3, 0.0, place) @ turn.T,
        rtol=0, atol=1e-12,
    )  # fmt: skip
    np.testing.assert_allclose(
        board_move_m("board_bow", 0.02, -0.01, place),
        board_move_m("board_bow", 0.0, 0.0, place - [0.02, -0.01]),
        rtol=1e-7,
    )
    with pytest.raises(ValueError, match="no_board"):
        board_move_m("no_board", 0.0, 0.0, place)
    camera = rig[1][0]
    points = np.column_stack([place, np.full(len(place), 0.01)])
    bent = board_bend_px("board_stretch", 0.4, 0.0, camera, 0.01, camera.project(points))
    step = 1e-5
    moved = points + step * np.column_stack([board_move_m("board_stretch", 0.4, 0.0, place), np.zeros(len(place))])
    np.testing.assert_allclose((camera.project(moved) - camera.project(points)) / step, bent, rtol=1e-3, atol=0.05)


@pytest.mark.further
def test_a_change_beside_a_lens_that_is_not_exact(rig):
    found = learnt(rig, bent(rig, filmed(rig, 0.25), RADIAL, 2e-8, 0.0))
    (one,) = found.changes
    assert one.target == RADIAL and one.value == pytest.approx(2e-8, rel=0.25)


@pytest.mark.further
def test_a_large_change_makes_no_marker_loose(rig):
    """It stretches the picture by more than a lens does that nobody has touched, whichever markers show it."""
    found = learnt(rig, bent(rig, filmed(rig, 0.0, correlation=CORRELATION), RADIAL, 1e-7, 0.0))
    assert found.loose == () and [one.target for one in found.changes] == [RADIAL]
    assert found.changes[0].value == pytest.approx(1e-7, rel=0.03)


@pytest.mark.further
def test_a_single_run_is_held_out_by_its_halves_and_one_of_a_frame_says_nothing(rig):
    tracks = bent(rig, filmed(rig, 0.0), RADIAL, 4e-8, 0.0)
    (one,) = learnt(rig, tracks[:1]).changes
    assert one.target == RADIAL and len(one.before) == 2 and one.after.sum() < 0.03 * one.before.sum()
    with_one = learnt(rig, [*tracks, tracks[0][tracks[0]["frame"] == 3]])
    assert [(one.value, len(one.before)) for one in with_one.changes] == [
        (one.value, len(tracks)) for one in learnt(rig, tracks).changes
    ]


@pytest.mark.others_further
@pytest.mark.parametrize(("size", "seed"), [(0.0, 0), (0.2, 1), (0.4, 2)])
def test_no_change_where_nothing_has_happened(rig, size, seed):
    found = learnt(rig, filmed(rig, size, correlation=CORRELATION, seed=seed))
    assert found.changes == ()
    assert not any(":" in term for term in found.terms["term"])


@pytest.mark.further
def test_a_loose_marker_is_no_change(rig):
    found = learnt(rig, filmed(rig, 0.0, loose=0.02))
    assert found.loose == ("H2",) and found.changes == ()


@pytest.mark.further
def test_order_of_cameras_and_runs_does_not_matter(rig):
    tracks = bent(rig, filmed(rig, 0.0), RADIAL, 2e-8, 0.0)
    first = learnt(rig, tracks)
    other = learnt((rig[0], rig[1][::-1]), [one.sample(frac=1.0, random_state=3) for one in tracks[::-1]])
    assert [(one.camera, one.target) for one in first.changes] == [(one.camera, one.target) for one in other.changes]
    assert other.changes[0].value == pytest.approx(first.changes[0].value, rel=1e-6)
    names = {camera.name for camera in rig[1]}
    assert set(lens_fields(first.field, first.terms)) == names


def test_bends_are_what_opencvs_lens_makes_of_them():
    """Derivatives of a picture by its focal length, radial and decentring terms; the camera sees square pixels."""
    camera = replace(two_cameras()[0], distortion=np.zeros(5))
    focal = float(camera.matrix[0, 0])
    camera = replace(camera, matrix=np.array([[focal, 0, 640.0], [0, focal, 512.0], [0, 0, 1]]))
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.05, 0.05, (30, 2)), np.full(30, 0.01)])
    uv = camera.project(points)
    place = uv - camera.matrix[:2, 2]

    def by(number: int, step: float) -> np.ndarray:
        moved = camera.distortion.copy()
        moved[number] = step
        return (replace(camera, distortion=moved).project(points) - uv) / step

    np.testing.assert_allclose(by(0, 1e-6) * focal**2, bend_px(RADIAL, 0.0, place), rtol=1e-4, atol=1e-3)
    for number, direction in ((3, 0.0), (2, np.pi / 2)):  # OpenCV's second decentring term is along u
        np.testing.assert_allclose(
            by(number, 1e-6) * focal, bend_px(DECENTRING, direction, place), rtol=1e-4, atol=1e-3
        )
    step = 1e-6
    larger = replace(camera, matrix=camera.matrix * np.array([[1 + step, 1, 1], [1, 1 + step, 1], [1, 1, 1]]))
    np.testing.assert_allclose((larger.project(points) - uv) / step, bend_px(ZOOM, 0.0, place), rtol=1e-4, atol=1e-3)


def test_directions_turn_bends_along():
    """A turned picture bent along a turned direction is the bent picture, turned."""
    place = np.random.default_rng(2).uniform(-300, 300, (20, 2))
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, -s], [s, c]])
    for target in (ZOOM, TURN, STRETCH, RADIAL, DECENTRING):  # a skew is along u, whatever is turned
        turned = bend_px(target, 0.3 + 0.7, place @ turn.T)
        np.testing.assert_allclose(turned, bend_px(target, 0.3, place) @ turn.T, rtol=1e-12, atol=1e-9)
    with pytest.raises(ValueError, match="no_bend"):
        bend_px("no_bend", 0.0, place)


def test_a_spline_follows_every_bend_exactly():
    """To the last digits: B-splines of the bare values would add 0.6 per mille of zoom to the radial term."""
    lattice = Lattice(150.0, -3, -3, 7, 7)
    inside = np.random.default_rng(3).uniform(-280, 280, (50, 2))
    for target in BENDS:
        held = spline_of(lattice, lambda uv, target=target: bend_px(target, 0.4, uv))
        np.testing.assert_allclose(lattice.basis(inside) @ held, bend_px(target, 0.4, inside), rtol=1e-9, atol=1e-6)
