"""A film of three cameras through the chain's commands, rendered: calibrated, tracked and triangulated together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.camera import read_calibration
from ovines.tables import read_table
from vision.rendering.images import Look, Pose
from vision.rendering.recording import Files, half_setup, look_at, render_recording
from vision.triangulate import triangulate

FRAMES, MIDDLE = 8, np.array([0.02, -0.028, 0.0])
SENSOR_PX = (1280, 1024)  # the middle of each sensor: as sharp, and the boards' pictures are drawn in less than half


def with_a_third(setup):
    """The rig, each camera the middle of its sensor, and a camera across the other two, its window about the rig's
    middle.
    """
    first = setup.cameras[0]
    centre = MIDDLE + 1.2 * np.array([0.03, np.sin(0.4), np.cos(0.4)])
    third = look_at("VW3", centre, MIDDLE, 3190.0, first.sensor_size_px, first.distortion, (1030.0, 760.0), 0.02)
    u, v = third.project(MIDDLE)
    width, height = setup.window_size_px
    window = (int(u - width / 2), int(v - height / 2))
    cut_px = (np.array(first.sensor_size_px) - SENSOR_PX) // 2
    return replace(
        setup,
        cameras=tuple(middle_of(camera, cut_px) for camera in (*setup.cameras, third)),
        window_offset_px=tuple(tuple(map(int, at - cut_px)) for at in (*setup.window_offset_px, window)),
        window_size_px=(width, height),
        look=Look(noise_grey=2.0),
    )


def middle_of(camera, cut_px):
    """The camera without the outermost ``cut_px`` columns and rows of either side."""
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= cut_px
    return replace(camera, matrix=matrix, sensor_size_px=SENSOR_PX)


def motion(time_s):
    x = 0.02 + 0.01 * np.sin(2 * np.pi * 11 * time_s)
    nes = Pose(x + 0.012 * np.cos(40 * time_s), -0.028 + 0.012 * np.sin(33 * time_s + 1), 0.0, 60.0 * time_s)
    return {"host": Pose(x, -0.028), "nes": nes}


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    folder = tmp_path_factory.mktemp("three")
    rng = np.random.default_rng(5)
    setup = with_a_third(half_setup(rng))
    truth = render_recording(folder / "film", setup, motion, FRAMES, rng, Files(views=5, board_suffix=".jpg"))
    out = folder / "out"
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("analysis.report.page.data_uri", lambda figure, image: "")  # as `unpainted`
        for stage in ("calibrate", "track", "triangulate"):
            assert main([stage, str(folder / "film"), "--out", str(out)]) == 0
    return setup, truth, out


def true_points(truth):
    return truth.drop_duplicates(["frame", "marker"]).set_index(["frame", "marker"])[["x_m", "y_m", "z_m"]]


@pytest.mark.further
def test_all_three_are_calibrated_and_tracked(film):
    setup, truth, out = film
    cameras = {camera.name: camera for camera in read_calibration(out / "calibration.json")}
    assert sorted(cameras) == ["VW1", "VW2", "VW3"]
    for true in setup.cameras:
        assert np.linalg.norm(cameras[true.name].centre_m - true.centre_m) < 1e-3
    tracks = read_table(out / "tracks.parquet", "tracks")
    both = truth.merge(tracks, on=["camera", "frame", "marker"], suffixes=("_true", ""))
    # The border of the third window cuts G2.
    assert both.groupby("camera").size().min() > 0.9 * truth[truth["visible"]].groupby("camera").size().min()
    off = np.hypot(both["u_px"] - both["u_px_true"], both["v_px"] - both["v_px_true"])
    assert off.max() < 0.1


def test_points_of_three_are_better_than_of_any_two_and_their_sd_says_so(film):
    setup, truth, out = film
    tracks = read_table(out / "tracks.parquet", "tracks")
    offsets = dict(zip([camera.name for camera in setup.cameras], setup.window_offset_px, strict=True))
    true, rms, claimed = true_points(truth), {}, {}
    for left_out in ("VW1", "VW2", "VW3", None):
        points = triangulate(tracks[tracks["camera"] != left_out], setup.cameras, offsets).set_index(
            ["frame", "marker"]
        )
        off = (points[["x_m", "y_m", "z_m"]] - true.loc[points.index]).to_numpy()
        sd = points[["x_sd_m", "y_sd_m", "z_sd_m"]].to_numpy()
        rms[left_out], claimed[left_out] = np.sqrt((off**2).mean()), np.sqrt((sd**2).mean())
        assert 0.7 < rms[left_out] / claimed[left_out] < 1.3
    assert rms[None] < min(rms[name] for name in ("VW1", "VW2", "VW3"))
    assert claimed[None] < min(claimed[name] for name in ("VW1", "VW2", "VW3"))


def test_the_chains_points_lie_where_the_markers_were(film):
    """Against the truth but for what the calibration moves all points by alike."""
    _, truth, out = film
    points = read_table(out / "points.parquet", "points").set_index(["frame", "marker"])
    off = (points[["x_m", "y_m", "z_m"]] - true_points(truth).loc[points.index]).to_numpy()
    assert len(points) == len(true_points(truth))
    assert np.abs(off.mean(0)).max() < 3e-5
    assert np.sqrt(((off - off.mean(0)) ** 2).mean()) < 1.5e-5


def test_a_marker_that_one_of_three_does_not_see_is_still_a_point(film):
    setup, truth, out = film
    tracks = read_table(out / "tracks.parquet", "tracks")
    offsets = dict(zip([camera.name for camera in setup.cameras], setup.window_offset_px, strict=True))
    hidden = (tracks["camera"] == "VW2") & (tracks["marker"] == "N2")
    points = triangulate(tracks[~hidden], setup.cameras, offsets)
    assert len(points) == len(triangulate(tracks, setup.cameras, offsets))
    one = points[points["marker"] == "N2"].set_index(["frame", "marker"])
    off = one[["x_m", "y_m", "z_m"]] - true_points(truth).loc[one.index]
    assert np.abs(off.to_numpy()).max() < 5e-5
