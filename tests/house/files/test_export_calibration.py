"""Calibrations out and in again: every format reads back equal, and refuses what it cannot hold."""

from __future__ import annotations

import ast
import shlex
from dataclasses import replace

import cv2
import numpy as np
import pytest

from ovines.__main__ import main
from ovines.camera import Camera, read_calibration, write_calibration
from ovines.errors import InputError
from ovines.exporters.calibrations import FORMATS, export
from ovines.importers.formats.opencv_cameras import read_cameras

RIG = """format = 1
[time]
frame_rate_hz = 800.0
[[cameras]]
name = "left eye"
sensor_size_px = [4096, 3072]
window_offset_px = [0, 1192]
window_size_px = [4096, 688]
[[cameras]]
name = "VW2"
sensor_size_px = [4096, 3072]
[bodies.host]
markers = ["H1"]
inner_radius_m = 0.05
[bodies.nes]
markers = ["N1"]
radius_m = 0.01
"""


def cameras(terms: int = 5) -> list[Camera]:
    """Two cameras above the plane whose every number needs all its digits."""
    rng = np.random.default_rng(terms)
    found = []
    for name, side in (("left eye", -0.4), ("VW2", 0.5)):
        turn = np.asarray(cv2.Rodrigues(np.array([np.pi - 0.2, side / 3, 0.1 * side]))[0], float)
        distortion = np.zeros(max(5, terms))
        distortion[:terms] = rng.normal(0, 0.1, terms)
        matrix = np.array([[6380.0 + rng.normal(), 0, 2040 + rng.normal()], [0, 6381 / 3 * 3.01, 1535.3], [0, 0, 1]])
        translation = np.array([0.1 * rng.normal(), 0.1 * rng.normal(), 1.2 + 0.1 * rng.normal()])
        found.append(Camera(name, (4096, 3072), matrix, distortion, turn, translation, 0.12345678901234))
    return found


@pytest.mark.parametrize(
    ("to", "terms"),
    [("opencv", 5), ("opencv", 12), ("kalibr", 4), ("mrcal", 5), ("mrcal", 8), ("caliscope", 5), ("anipose", 5)],
)
def test_every_format_reads_back_equal_by_the_line_that_the_command_prints(tmp_path, capsys, to, terms):
    true = cameras(terms)
    run = tmp_path / "run"
    run.mkdir()
    (run / "recording.toml").write_text(RIG, encoding="utf-8")
    write_calibration(true, tmp_path / "calibration.json")
    assert main(["export", str(tmp_path / "calibration.json"), "--to", to, "--out", str(tmp_path / "out")]) == 0
    line = capsys.readouterr().out.splitlines()[-1].removeprefix("read back: ovines ")
    assert main(shlex.split(line.replace("RECORDING", shlex.quote(str(run))))) == 0
    back = read_calibration(run / "calibration.json")
    for one, original in zip(back, true, strict=True):
        assert (one.name, one.sensor_size_px) == (original.name, original.sensor_size_px)
        assert (one.matrix == original.matrix).all() and one.distortion.tolist() == original.distortion.tolist()
        assert np.allclose(one.rotation, original.rotation, rtol=0, atol=1e-14)
        assert np.allclose(one.translation_m, original.translation_m, rtol=1e-14)
        assert (one.rms_px == original.rms_px) or to not in ("opencv", "caliscope")


@pytest.mark.parametrize(
    ("to", "terms", "lost", "instead"),
    [
        ("kalibr", 5, "k3", "opencv or mrcal or caliscope or anipose"),
        ("caliscope", 8, "k6", "opencv or mrcal"),
        ("anipose", 12, "s4", "opencv or mrcal"),
    ],
)
def test_what_a_format_cannot_hold_is_refused_by_name(to, terms, lost, instead):
    with pytest.raises(InputError, match=f"{lost} = .* would be lost") as refused:
        export(cameras(terms), to)
    assert refused.value.do.endswith(instead)


@pytest.mark.parametrize("to", FORMATS)
def test_a_skew_is_refused(to):
    skewed = cameras(4)[0]
    skewed = replace(skewed, matrix=skewed.matrix + np.array([[0, 0.5, 0], [0, 0, 0], [0, 0, 0]]))
    with pytest.raises(InputError, match="skew of 0.5 px"):
        export([skewed], to)


def test_files_that_are_there_stay(tmp_path, capsys):
    write_calibration(cameras(), tmp_path / "calibration.json")
    assert main(["export", str(tmp_path), "--to", "anipose"]) == 0
    assert main(["export", str(tmp_path), "--to", "anipose"]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["export", str(tmp_path), "--to", "anipose", "--force"]) == 0


def test_the_opencv_file_is_one_that_opencv_itself_reads(tmp_path):
    true = cameras(12)[1]
    path = tmp_path / "c.yaml"
    path.write_text(export([true], "opencv")["VW2.yaml"], encoding="utf-8")
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    assert (storage.getNode("camera_matrix").mat() == true.matrix).all()
    assert storage.getNode("distortion_coefficients").mat().shape == (12, 1)
    assert storage.getNode("camera_name").string() == "VW2"


def test_the_mrcal_file_is_the_literal_that_mrcal_reads():
    true = cameras(8)[0]
    model = ast.literal_eval(export([true], "mrcal")["left eye.cameramodel"])
    assert model["lensmodel"] == "LENSMODEL_OPENCV8" and len(model["intrinsics"]) == 12
    assert model["imagersize"] == [4096, 3072]
    point = np.array([0.02, -0.01, 0.005])
    turn, shift = np.array(model["extrinsics"][:3]), np.array(model["extrinsics"][3:])
    fx, fy, cx, cy, *lens = model["intrinsics"]
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])
    assert cv2.projectPoints(point, turn, shift, matrix, np.array(lens))[0].ravel() == pytest.approx(
        true.project(point), abs=1e-9
    )


CHAIN = """cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]
  distortion_model: radtan
  intrinsics: [458.654, 457.296, 367.215, 248.375]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1:
  - [0.9999974, 0.0023, 0.0, -0.1101]
  - [-0.0022999, 0.9999579, 0.0088998, 0.0004]
  - [0.0000205, -0.0088998, 0.9999604, -0.0008]
  - [0.0, 0.0, 0.0, 1.0]
  cam_overlaps: [0]
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 1.8e-05]
  distortion_model: radtan
  intrinsics: [457.587, 456.134, 379.999, 255.238]
  resolution: [752, 480]
  rostopic: /cam1/image_raw
"""


def test_a_chain_as_kalibr_writes_it(tmp_path):
    chain, world = tmp_path / "camchain.yaml", tmp_path / "world.yaml"
    chain.write_text(CHAIN, encoding="utf-8")
    world.write_text("rvec: [3.0, 0.1, 0.0]\ntvec: [0.01, 0.02, 0.9]\n", encoding="utf-8")
    with pytest.raises(InputError, match="no pose of the sliding plane"):
        read_cameras([str(chain)], ["A", "B"])
    found = read_cameras([str(chain)], ["A", "B"], world)  # no topic is a camera's name: taken in order
    assert found["A"].matrix[0].tolist() == [458.654, 0, 367.215] and found["B"].size_px == (752, 480)
    assert found["A"].distortion.tolist() == [-0.28, 0.07, 0.0002, 1.8e-05, 0.0]
    apart = found["B"].translation - found["B"].rotation @ found["A"].rotation.T @ found["A"].translation
    assert apart == pytest.approx([-0.1101, 0.0004, -0.0008])
    chain.write_text(CHAIN.replace("radtan", "equidistant"), encoding="utf-8")
    with pytest.raises(InputError, match="pinhole with equidistant"):
        read_cameras([str(chain)], ["A", "B"], world)


@pytest.mark.parametrize(
    ("change", "part"),
    [
        (("LENSMODEL_OPENCV8", "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3"), "lens LENSMODEL_SPLINED"),
        (("LENSMODEL_OPENCV8", "LENSMODEL_OPENCV5"), "intrinsics"),
        (("'extrinsics'", "'elsewhere'"), "extrinsics = None"),
        (("{", "[{"), "was never closed|invalid syntax|does not match"),
        (("{", "__import__('os').getcwd() or {"), "malformed node"),
    ],
)
def test_a_camera_model_that_is_none_of_opencvs_is_refused(tmp_path, change, part):
    path = tmp_path / "c.cameramodel"
    path.write_text(export(cameras(8)[:1], "mrcal")["left eye.cameramodel"].replace(*change, 1), encoding="utf-8")
    with pytest.raises(InputError, match=part):
        read_cameras([f"A={path}"], ["A"])
