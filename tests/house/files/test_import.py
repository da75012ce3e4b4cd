"""Other programs' files: each format read to the last digit, what they leave open asked for, wrong ones refused by
name.
"""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.camera import Camera, read_calibration
from ovines.errors import InputError
from ovines.importers.convert import cameras_in_world, points_table, tracks_table
from ovines.importers.formats import marker_csv, trc, vibration_tracker
from ovines.importers.formats.opencv_cameras import read_cameras
from ovines.importers.reading.declared import metres, times_on_grid, turn
from ovines.importers.reading.files import read_values
from ovines.recording import read_recording

ROOT = Path(__file__).resolve().parents[3]
REAL = ROOT.parent / "shared" / "real"
RIG = """format = 1
[time]
frame_rate_hz = 800.0
[[cameras]]
name = "A"
sensor_size_px = [640, 480]
window_offset_px = [0, 100]
window_size_px = [640, 200]
[[cameras]]
name = "B"
sensor_size_px = [640, 480]
window_offset_px = [0, 100]
window_size_px = [640, 200]
[bodies.host]
markers = ["H1", "H2"]
inner_radius_m = 0.05
[bodies.nes]
markers = ["N1"]
radius_m = 0.01
"""


@pytest.fixture
def recording(tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "recording.toml").write_text(RIG, encoding="utf-8")
    return read_recording(tmp_path / "run")


def written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


def looking_down(name: str, side: float) -> Camera:
    """A camera 0.4 m above the plane, ``side`` metres off, looking at the origin."""
    centre = np.array([side, 0.02, 0.4])
    z = -centre / np.linalg.norm(centre)
    x = np.cross([0, 1, 0], z)
    x /= np.linalg.norm(x)
    rotation = np.stack([x, np.cross(z, x), z])
    return Camera(
        name,
        (640, 480),
        np.array([[900.0, 0, 320], [0, 905, 235], [0, 0, 1]]),
        np.array([-0.2, 0.05, 1e-3, -5e-4, 0.0]),
        rotation,
        -rotation @ centre,
    )


CAMERAS = [looking_down("A", -0.1), looking_down("B", 0.12)]
BOARD = np.diag([1.0, -1, -1])  # OpenCV's board frame of the same plane


# --- VibrationTracker


def test_lost_points_of_vibration_tracker_are_missing_rows(tmp_path, recording):
    uv = np.array([[[10.5, 20.25], [30, 40], [50, 60]], [[11, 21], [0, 0], [float("nan"), 61]]])
    path = written(tmp_path / "TrackResults.json", json.dumps({"TrackResults": uv.tolist()}))
    table, _ = tracks_table({"A": path}, recording, ["N1", "H2", "H1"])
    assert list(zip(table["frame"], table["marker"], table["u_px"], table["v_px"], strict=True)) == [
        (0, "N1", 10.5, 20.25),
        (0, "H2", 30, 40),
        (0, "H1", 50, 60),
        (1, "N1", 11, 21),
    ]
    assert table["time_s"].tolist() == [0, 0, 0, 1 / 800] and table["sd_px"].isna().all()


def test_displacements_are_positions_in_the_board_frame(tmp_path, recording):
    moved, start = np.array([[[0, 0, 0], [0, 0, 0]], [[1.0, 2, 3], [0, 0, 0.5]]]), np.array([[10.0, 20, 30], [1, 2, 3]])
    path = written(
        tmp_path / "displacementResults.json",
        json.dumps({"resultDisplacement": moved.tolist(), "Point3D": start.tolist()}),
    )
    assert vibration_tracker.read_points(path)[1, 0] == pytest.approx([11, 22, 33])
    table, notes = points_table(path, recording, ["H1", "-"], "mm")
    assert table[["x_m", "y_m", "z_m"]].to_numpy() == pytest.approx(
        np.array([[0.010, -0.020, -0.030], [0.011, -0.022, -0.033]])
    )
    assert table["x_sd_m"].isna().all() and any("x,-y,-z" in note for note in notes)


def test_one_camera_of_vibration_tracker_gives_no_positions(tmp_path):
    path = written(tmp_path / "d.json", json.dumps({"resultDisplacement": [[[0, 0]]], "Point2D": [[1, 2]]}))
    with pytest.raises(InputError, match="one camera"):
        vibration_tracker.read_points(path)


def vibration_tracker_calibration(folder: Path, camera: Camera, size: tuple[int, int]) -> str:
    """calibrationResults.json and poseEstimationResults.json as the program writes them, in millimetres of its
    board.
    """
    new, _ = cv2.getOptimalNewCameraMatrix(camera.matrix, camera.distortion, size, 1, size)
    rotation = camera.rotation @ BOARD
    lens, pose = folder / f"{camera.name}_calibrationResults.json", folder / f"{camera.name}_poseEstimationResults.json"
    lens.write_text(
        json.dumps({"cameraMatrix": camera.matrix.tolist(), "distortionCoefficients": [camera.distortion.tolist()]})
    )
    pose.write_text(
        json.dumps(
            {
                "rvec": cv2.Rodrigues(rotation)[0].tolist(),
                "tvec": (1e3 * camera.translation_m).reshape(3, 1).tolist(),
                "newCameraMatrix": new.tolist(),
                "homographyMatrix": np.eye(3).tolist(),
            }
        )
    )
    return f"{camera.name}={lens},{pose}"


def same(found: Camera, true: Camera) -> None:
    assert found.matrix == pytest.approx(true.matrix) and found.distortion == pytest.approx(true.distortion)
    assert found.rotation == pytest.approx(true.rotation, abs=1e-9) and found.translation_m == pytest.approx(
        true.translation_m, abs=1e-12
    )


def test_calibration_of_vibration_tracker_in_metres_and_turned_up(tmp_path, recording):
    found = read_cameras(
        [vibration_tracker_calibration(tmp_path, camera, (640, 480)) for camera in CAMERAS], ["A", "B"]
    )
    cameras, notes = cameras_in_world(found, recording, "mm", calibrated_on="sensor")
    for one, true in zip(cameras, CAMERAS, strict=True):
        same(one, true)
    assert any("0.4 m above" in note for note in notes)


def test_window_calibration_moves_the_principal_point(tmp_path, recording):
    found = read_cameras([vibration_tracker_calibration(tmp_path, CAMERAS[0], (640, 200))], ["A", "B"])
    with pytest.raises(InputError, match="calibrated-on"):
        cameras_in_world(found, recording, "mm")
    moved = cameras_in_world(found, recording, "mm", calibrated_on="window")[0][0]
    assert moved.matrix[:2, 2] - CAMERAS[0].matrix[:2, 2] == pytest.approx([0, 100])


def test_undistorted_pixels_come_back_to_the_image(tmp_path, recording):
    """OpenCV's own map from the undistorted image to the camera's, in its single precision."""
    found = read_cameras([vibration_tracker_calibration(tmp_path, CAMERAS[0], (640, 480))], ["A", "B"])
    to_u, to_v = cv2.initUndistortRectifyMap(
        CAMERAS[0].matrix, CAMERAS[0].distortion, None, found["A"].undistorted_matrix, (640, 480), cv2.CV_32FC1
    )
    flat = np.random.default_rng(0).integers([5, 5], [630, 470], (40, 1, 2))
    uv = np.stack([one[flat[:, 0, 1], flat[:, 0, 0]] for one in (to_u, to_v)], -1)
    assert np.abs(uv - flat[:, 0]).max() > 5
    path = written(tmp_path / "TrackResults.json", json.dumps({"TrackResults": flat.tolist()}))
    table, _ = tracks_table({"A": path}, recording, ["N1"], lenses=found)
    assert table[["u_px", "v_px"]].to_numpy() == pytest.approx(uv, abs=2e-4)


# --- CSV and TRC


def test_long_and_wide_csv_say_the_same(tmp_path, recording):
    long = written(
        tmp_path / "long.csv",
        "# by "
        "hand\nframe,time_s,marker,x_mm,y_mm,z_mm\n0,0,H1,1,2,3\n0,0,N1,4,5,6\n1,0.00125,H1,1.5,,3\n1,0.00125,N1,7,8,9\n",
    )
    wide = written(
        tmp_path / "wide.csv", "frame;time_s;H1_x;H1_y;H1_z;N1.X;N1.Y;N1.Z\n0;0;1;2;3;4;5;6\n1;0,00125;1,5;;3;7;8;9\n"
    )
    one, two = points_table(long, recording)[0], points_table(wide, recording, unit="mm")[0]
    order = ["frame", "marker"]
    pd.testing.assert_frame_equal(one.sort_values(order, ignore_index=True), two.sort_values(order, ignore_index=True))
    assert len(one) == 3 and one.loc[one["marker"] == "N1", "z_m"].tolist() == pytest.approx([0.006, 0.009])


def test_csv_tracks_with_their_sd(tmp_path, recording):
    path = written(
        tmp_path / "t.csv", "frame,camera,marker,u_px,v_px,sd_px\n3,A,H1,1.5,2.5,0.05\n3,B,H1,9,9,0.05\n4,A,N1,7,8,\n"
    )
    table, _ = tracks_table({"A": path}, recording)
    assert table["marker"].tolist() == ["H1", "N1"] and table["time_s"].tolist() == [3 / 800, 4 / 800]
    assert table["sd_px"].iloc[0] == 0.05 and np.isnan(table["sd_px"].iloc[1])


def trc_text(rows: str, units: str = "mm", rate: str = "800.00") -> str:
    return (
        "PathFileType\t4\t(X/Y/Z)\tx.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n"
        f"{rate}\t{rate}\t2\t2\t{units}\t{rate}\t1\t2\nFrame#\tTime\tH1\t\t\tN1\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n{rows}"
    )


def test_trc_with_a_hidden_marker_and_y_up(tmp_path, recording):
    path = written(tmp_path / "p.trc", trc_text("1\t0.000\t1\t2\t3\t4\t5\t6\n2\t0.001\t\t\t\t7\t8\t9\n"))
    table, _ = points_table(path, recording, axes="x,-z,y")
    assert table["frame"].tolist() == [0, 0, 1] and table["marker"].tolist() == ["H1", "N1", "N1"]
    assert table[["x_m", "y_m", "z_m"]].to_numpy() == pytest.approx(
        1e-3 * np.array([[1, -3, 2], [4, -6, 5], [7, -9, 8]])
    )
    assert table["time_s"].tolist() == [0, 0, 1 / 800]  # 0.001 was the rounded 0.00125: DataRate knows


@pytest.mark.parametrize(("units", "unit", "part"), [("mm", "m", "--unit says m"), ("furlong", None, "furlong")])
def test_trc_knows_its_unit(tmp_path, recording, units, unit, part):
    path = written(tmp_path / "p.trc", trc_text("1\t0\t1\t2\t3\t4\t5\t6\n", units))
    with pytest.raises(InputError, match=part):
        points_table(path, recording, unit=unit)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("hello", "PathFileType"),
        (trc_text("1\t0\t1\t2\t3\t4\t5\tsix\n"), "six"),
        (trc_text("1 0 1 2 3 4 5\n"), "separated by spaces"),
        (trc_text(""), "no rows"),
        (trc_text("1\t0\t1\t2\t3\t4\t5\t6\t7\n"), "cells"),
        (trc_text("1\t0\t1\t2\t3\t4\t5\t6\n").replace("\t2\tmm", "\t3\tmm"), "NumMarkers"),
    ],
)
def test_wrong_trc_is_refused(tmp_path, text, part):
    with pytest.raises(InputError, match=part):
        trc.read_trc(written(tmp_path / "p.trc", text))


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("", "no rows"),
        ("frame,x\n", "no rows"),
        ("time_s,marker,x,y\n0,H1,1,2\n", "no column frame"),
        ("frame,marker,x,y\n0,H1,one,2\n", "line 2"),
        ("frame,marker,x,y\n0.5,H1,1,2\n", "frame 0.5"),
        ("frame,marker,x,y\n0,H1,1\n", "3 cells"),
        ("frame,marker,x_mm,y_m\n0,H1,1,1\n", "mm"),
        ("scorer,a,a\nbodyparts,H1,H1\n", "several lines"),
        ("frame,marker\n0,H1\n", "no coordinates"),
    ],
)
def test_wrong_csv_is_refused(tmp_path, text, part):
    with pytest.raises(InputError, match=part):
        marker_csv.read_csv(written(tmp_path / "p.csv", text))


def test_exact_zeros_are_asked_about(tmp_path, recording):
    path = written(tmp_path / "p.csv", "frame,marker,x_m,y_m,z_m\n0,H1,0,0,0\n0,N1,1,1,1\n")
    with pytest.raises(InputError, match="--zeros"):
        points_table(path, recording)
    assert (
        len(points_table(path, recording, zeros="missing")[0]) == 1
        and len(points_table(path, recording, zeros="points")[0]) == 2
    )


def test_names_units_and_axes_are_asked_for(tmp_path, recording):
    path = written(tmp_path / "TrackResults.json", json.dumps({"TrackResults": [[[1, 2], [3, 4]]]}))
    for markers, part in ((None, "without names"), (["H1"], "1 names")):
        with pytest.raises(InputError, match=part):
            tracks_table({"A": path}, recording, markers)
    with pytest.raises(InputError, match="names of recording.toml"):
        tracks_table({"A": path}, recording, ["P", "Q"])
    with pytest.raises(InputError, match="50 m"):
        metres(None, None, "points")
    for axes, part in (("x,y", "once"), ("x,x,z", "once"), ("y,x,z", "mirrors")):
        with pytest.raises(InputError, match=part):
            turn(axes)


def test_doubtful_axes_are_reported(tmp_path, recording):
    rows = "".join(f"{k},N1,{np.cos(k):.6f},0.01,{np.sin(k):.6f}\n" for k in range(30))
    path = written(tmp_path / "p.csv", "frame,marker,x_m,y_m,z_m\n" + rows)
    assert any("are the axes right" in note for note in points_table(path, recording)[1])
    assert not any("are the axes right" in note for note in points_table(path, recording, axes="x,-z,y")[1])


def test_printed_times_go_back_to_their_rate_only_when_they_are_one():
    frames = np.arange(50.0)
    printed = np.round(frames / 800, 3)
    assert times_on_grid(printed, frames, 3, 800.0) == pytest.approx(frames / 800, abs=1e-15)
    jittered = frames / 800 + 1e-4 * np.sin(frames)
    assert (times_on_grid(jittered, frames, 6, 800.0) == jittered).all()
    assert times_on_grid(printed + 7, frames, 3, 800.0) - 7 == pytest.approx(frames / 800, abs=5e-4)


# --- cameras of OpenCV, caliscope, Anipose


def opencv_file(path: Path, **values) -> Path:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for name, value in values.items():
        storage.write(name, value)
    storage.release()
    return path


@pytest.mark.parametrize("ending", ["yml", "xml", "json"])
def test_opencv_files_of_one_camera_each(tmp_path, recording, ending):
    specs = []
    for camera in CAMERAS:
        turn_vector = cv2.Rodrigues(camera.rotation @ BOARD)[0]
        path = opencv_file(
            tmp_path / f"{camera.name}.{ending}",
            image_width=640,
            image_height=480,
            camera_matrix=camera.matrix,
            distortion_coefficients=camera.distortion.reshape(5, 1),
            rvec=turn_vector,
            tvec=100 * camera.translation_m,
        )
        specs.append(f"{camera.name}={path}")
    cameras, _ = cameras_in_world(read_cameras(specs, ["A", "B"]), recording, "cm")
    for one, true in zip(cameras, CAMERAS, strict=True):
        same(one, true)


def test_stereo_files_need_the_plane(tmp_path, recording):
    first, second = CAMERAS
    between = second.rotation @ first.rotation.T
    lenses = opencv_file(
        tmp_path / "intrinsics.yml", M1=first.matrix, D1=first.distortion, M2=second.matrix, D2=second.distortion
    )
    poses = opencv_file(
        tmp_path / "extrinsics.yml", R=between, T=1e3 * (second.translation_m - between @ first.translation_m)
    )
    world = opencv_file(tmp_path / "world.yml", rvec=cv2.Rodrigues(first.rotation)[0], tvec=1e3 * first.translation_m)
    with pytest.raises(InputError, match="--world"):
        read_cameras([f"{lenses},{poses}"], ["A", "B"])
    cameras, _ = cameras_in_world(
        read_cameras([f"{lenses},{poses}"], ["A", "B"], world), recording, "mm", calibrated_on="sensor"
    )
    for one, true in zip(cameras, CAMERAS, strict=True):
        same(one, true)


def test_toml_of_anipose_and_of_caliscope(tmp_path, recording):
    def table(camera, section, rotation):
        return (
            f'[{section}]\nname = "{camera.name}"\nsize = [640, 480]\nmatrix = {camera.matrix.tolist()}\ndistortions '
            f"= {camera.distortion.tolist()}\n"
            f"rotation = {rotation.tolist()}\ntranslation = {camera.translation_m.tolist()}\n"
        )

    anipose = written(
        tmp_path / "calibration.toml",
        "".join(table(c, f"cam_{i}", cv2.Rodrigues(c.rotation)[0].ravel()) for i, c in enumerate(CAMERAS))
        + "[metadata]\nerror = 0.4\n",
    )
    caliscope = written(
        tmp_path / "camera_array.toml", "".join(table(c, f"cameras.{i}", c.rotation) for i, c in enumerate(CAMERAS))
    )
    for specs in (
        [str(anipose)],
        [str(caliscope)],
        [f"A={caliscope}#cameras.0", f"B={anipose}#cam_1"],
        [f"A={anipose}#A", f"B={anipose}#B"],
    ):
        for one, true in zip(
            cameras_in_world(read_cameras(specs, ["A", "B"]), recording, "m")[0], CAMERAS, strict=True
        ):
            same(one, true)
    with pytest.raises(InputError, match="say which is which"):
        read_cameras([str(anipose)], ["VW1", "VW2"])


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"distortionCoefficients": [0.1] * 14}, "distortion terms"),
        ({"distortionCoefficients": [0.1] * 6}, "6 distortion terms"),
        ({"cameraMatrix": [[1, 0], [0, 1]]}, "cameramatrix"),
        ({"rvec": None}, "pose"),
        ({"fisheye": True}, "fisheye"),
        ({"rotation": np.diag([1.0, 1, -1]).tolist(), "rvec": None}, "mirrors"),
        ({"image_width": 99, "image_height": 99}, "99 x 99"),
    ],
)
def test_cameras_that_are_none_are_refused(tmp_path, recording, change, part):
    content = {
        "cameraMatrix": CAMERAS[0].matrix.tolist(),
        "distortionCoefficients": [0.1],
        "rvec": [0.1, 0, 0],
        "tvec": [0, 0, 1],
    } | change
    path = written(tmp_path / "c.json", json.dumps(content))
    with pytest.raises(InputError, match=part):
        cameras_in_world(read_cameras([f"A={path}"], ["A", "B"]), recording, "m", calibrated_on="sensor")


@pytest.mark.parametrize(
    "text", ["", "\x00\x01", "%YAML:1.0\n---\na: [", "{", "<?xml version='1.0'?><a>", "[1, 2]", "a = "]
)
@pytest.mark.parametrize("ending", ["yml", "json", "toml", "xml"])
def test_broken_parameter_files_are_refused(tmp_path, text, ending):
    with pytest.raises(InputError):
        read_cameras([f"A={written(tmp_path / f'c.{ending}', text)}"], ["A", "B"])


def test_plain_yaml_as_ros_writes_it(tmp_path):
    text = (
        "image_width: 640\nimage_height: 480\ncamera_name: left\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [900, "
        "0, 320, 0, 905.5, 235, 0, 0, 1]\n"
    )
    assert read_values(written(tmp_path / "ros.yaml", text))["camera_matrix"].tolist() == [
        [900, 0, 320],
        [0, 905.5, 235],
        [0, 0, 1],
    ]


@pytest.mark.skipif(not REAL.is_dir(), reason="no real files beside the checkout")
def test_real_files_of_other_programs():
    found = read_cameras(
        [
            f"A={REAL / 'charuco_two_webcams' / 'camera_array.toml'}#cameras.0",
            f"B={REAL / 'charuco_two_webcams' / 'camera_array.toml'}#cameras.1",
        ],
        ["A", "B"],
    )
    centres = [-one.rotation.T @ one.translation for one in found.values()]
    assert np.linalg.norm(centres[0] - centres[1]) == pytest.approx(1.132, abs=1e-3) and found["A"].size_px == (
        1280,
        720,
    )
    lens = read_values(REAL / "stereo_chessboard" / "left_intrinsics.yml")
    assert lens["camera_matrix"][0, 0] == pytest.approx(535.9157, abs=1e-3) and lens["image_width"] == 640
    assert read_values(REAL / "stereo_chessboard" / "intrinsics.yml")["M2"][0, 2] == pytest.approx(334.5575, abs=1e-3)


def test_calibration_file_reads_back(tmp_path, recording):
    from ovines.camera import write_calibration

    found = read_cameras(
        [vibration_tracker_calibration(tmp_path, camera, (640, 480)) for camera in CAMERAS], ["A", "B"]
    )
    write_calibration(
        cameras_in_world(found, recording, "mm", calibrated_on="sensor")[0], tmp_path / "calibration.json"
    )
    for one, true in zip(read_calibration(tmp_path / "calibration.json"), CAMERAS, strict=True):
        same(one, true)
