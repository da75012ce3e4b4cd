"""Imported data run down the chain: the sample's first run, written as other programs write it, gives the same
parameters.
"""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import cv2
import numpy as np
import pandas as pd
import pytest

from ovines.__main__ import main
from ovines.camera import Camera, read_calibration
from ovines.pipeline.runner import run_stages
from ovines.recording import read_recording
from ovines.tables import read_table

SAMPLE = Path(__file__).resolve().parents[3] / "sample_data" / "series_tilted"
BOARD = np.diag([1.0, -1, -1])  # OpenCV's board frame: z into the plane
MARKERS = ["G1", "G2", "G3", "H1", "H2", "H3", "H4", "N1", "N2", "N3", "N4", "N5"]


@pytest.fixture(scope="module")
def reference(tmp_path_factory) -> Path:
    """The sample's first run down to the identification, from its own tracks."""
    out = tmp_path_factory.mktemp("reference")
    run_stages(read_recording(SAMPLE / "run-01"), out, "identify")
    return out


def empty_recording(folder: Path) -> Path:
    """The sample's recording.toml alone, naming a calibration that is not there yet."""
    folder.mkdir(parents=True)
    text = (SAMPLE / "run-01" / "recording.toml").read_text(encoding="utf-8")
    (folder / "recording.toml").write_text(text.replace("../calibration.json", "calibration.json"), encoding="utf-8")
    return folder


def as_vibration_tracker(tracks: pd.DataFrame, camera: Camera, folder: Path, flat: bool) -> None:
    """The three files of one camera; lost points at (0, 0), lengths in mm; ``flat``: pixels of the undistorted
    images.
    """
    folder.mkdir()
    own = tracks[tracks["camera"] == camera.name]
    offset = np.array(read_recording(SAMPLE / "run-01").window_offset_px[camera.name])
    matrix = camera.matrix.copy()
    matrix[:2, 2] -= offset  # the program knows nothing of windows: it calibrates and tracks the images it is given
    new, _ = cv2.getOptimalNewCameraMatrix(matrix, camera.distortion, (4096, 688), 1, (4096, 688))
    uv = own[["u_px", "v_px"]].to_numpy(float)
    if flat:
        uv = np.c_[camera.normalise(uv + offset), np.ones(len(uv))] @ new[:2].T
    grid = np.zeros((own["frame"].max() + 1, len(MARKERS), 2))
    grid[own["frame"], own["marker"].map(MARKERS.index)] = uv
    pose = {
        "rvec": cv2.Rodrigues(camera.rotation @ BOARD)[0].tolist(),
        "tvec": (1e3 * camera.translation_m[:, None]).tolist(),
        "newCameraMatrix": new.tolist(),
        "homographyMatrix": np.eye(3).tolist(),
    }
    for name, content in (
        ("TrackResults", {"TrackResults": grid.tolist()}),
        ("poseEstimationResults", pose),
        (
            "calibrationResults",
            {"cameraMatrix": matrix.tolist(), "distortionCoefficients": [camera.distortion.tolist()]},
        ),
    ):
        (folder / f"{name}.json").write_text(json.dumps(content), encoding="utf-8")


def identified(folder: Path) -> pd.DataFrame:
    return read_table(folder / "identification.parquet", "identification").set_index("parameter")


@pytest.mark.parametrize("images", ["raw", "undistorted"])
def test_vibration_tracker_to_the_identification(tmp_path, reference, images):
    tracks = read_table(SAMPLE / "run-01" / "tracks.parquet", "tracks")
    cameras = read_calibration(SAMPLE / "calibration.json")
    for camera in cameras:
        as_vibration_tracker(tracks, camera, tmp_path / camera.name, images == "undistorted")
    run = empty_recording(tmp_path / "run")
    assert (
        main(
            [
                "import",
                str(run),
                "--unit",
                "mm",
                "--images",
                images,
                "--calibrated-on",
                "window",
                "--markers",
                ",".join(MARKERS),
                "--tracks",
                *(f"{c.name}={tmp_path / c.name / 'TrackResults.json'}" for c in cameras),
                "--calibration",
                *(
                    f"{c.name}={tmp_path / c.name / 'calibrationResults.json'},"
                    f"{tmp_path / c.name / 'poseEstimationResults.json'}"
                    for c in cameras
                ),
            ]
        )
        == 0
    )
    again = read_table(run / "tracks.parquet", "tracks")
    assert len(again) == len(tracks) and np.isnan(again["sd_px"]).all()
    assert again[["u_px", "v_px"]].to_numpy() == pytest.approx(tracks[["u_px", "v_px"]].to_numpy(), abs=1e-6)
    for found, true in zip(read_calibration(run / "calibration.json"), cameras, strict=True):
        assert found.rotation == pytest.approx(true.rotation, abs=1e-9) and found.translation_m == pytest.approx(
            true.translation_m
        )
    run_stages(read_recording(run), tmp_path / "out", "identify")
    found, true = identified(tmp_path / "out"), identified(reference)
    known = true.index[np.isfinite(true["value"].astype(float)) & np.isfinite(true["sd"].astype(float))]
    assert len(known) >= 3
    for name in known:
        assert abs(found.value[name] - true.value[name]) < 0.25 * true.sd[name], (
            name
        )  # sd of pixels were not handed over


def test_trc_to_the_identification(tmp_path, reference):
    """Points as a motion-capture program exports them: y up, millimetres to five digits, times to a millisecond."""
    points = read_table(reference / "points.parquet", "points")
    wide = points.pivot(index="frame", columns="marker", values=["x_m", "z_m", "y_m"]) * 1e3
    lines = [
        "PathFileType\t4\t(X/Y/Z)\trun.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits",
        f"800\t800\t{len(wide)}\t{len(MARKERS)}\tmm",
        "Frame#\tTime\t" + "".join(f"{name}\t\t\t" for name in MARKERS),
        "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, 13)),
        "",
    ]
    for frame, row in wide.iterrows():
        cells = [
            "" if np.isnan(v) else f"{v:.5f}"
            for name in MARKERS
            for v in (row["x_m", name], row["z_m", name], -row["y_m", name])
        ]
        lines.append(f"{frame + 1}\t{frame / 800:.3f}\t" + "\t".join(cells))
    (tmp_path / "run.trc").write_text("\n".join(lines), encoding="utf-8")
    run = empty_recording(tmp_path / "run")
    assert main(["import", str(run), "--points", str(tmp_path / "run.trc"), "--axes", "x,-z,y"]) == 0
    again = read_table(run / "points.parquet", "points")
    assert again[["x_m", "y_m", "z_m"]].to_numpy() == pytest.approx(points[["x_m", "y_m", "z_m"]].to_numpy(), abs=6e-9)
    assert again["time_s"].to_numpy() == pytest.approx(points["time_s"].to_numpy(), abs=1e-9)
    run_stages(read_recording(run), tmp_path / "out", "identify")
    # every point weighs the same now, x as much as the z that the cameras see worse: another, wider estimate; held to
    # the truth
    truth = json.loads((SAMPLE / "truth.json").read_text(encoding="utf-8"))["plant"]
    found, own = identified(tmp_path / "out"), identified(reference)
    for name in ("restitution", "wall_friction", "tangential_restitution", "floor_friction"):
        assert abs(found.value[name] - truth[name]) < 3 * found.sd[name] < 30 * own.sd[name], name


def test_command_refuses_and_says_what_to_do(tmp_path, capsys):
    run = empty_recording(tmp_path / "run")
    points = tmp_path / "p.csv"
    points.write_text("frame,marker,x_mm,y_mm,z_mm\n0,H1,1,2,3\n", encoding="utf-8")
    track = tmp_path / "TrackResults.json"
    track.write_text(json.dumps({"TrackResults": [[[1, 2]]]}), encoding="utf-8")
    for arguments, part in [
        ([], "nothing to import"),
        (["--tracks", f"X={track}"], "CAMERA=FILE"),
        (["--tracks", f"VW1={track}"], "undistorted"),
        (["--tracks", f"VW1={track}", "--images", "undistorted"], "without the lens"),
        (["--points", str(tmp_path / "none.csv")], "is not there"),
        (["--points", str(track)], "displacementResults"),
    ]:
        assert main(["import", str(run), *arguments]) == 2
        said = capsys.readouterr().err
        assert part in said and re.findall("^(found|expected|do):", said, re.MULTILINE) == ["found", "expected", "do"]
        assert [path.name for path in run.iterdir()] == ["recording.toml"]
    assert main(["import", str(run), "--points", str(points)]) == 0
    assert "1 markers" in capsys.readouterr().out
    assert main(["import", str(run), "--points", str(points)]) == 2 and "is there already" in capsys.readouterr().err
    assert main(["import", str(run), "--points", str(points), "--force"]) == 0


def test_import_says_what_stands_in_its_way(tmp_path, capsys):
    run = empty_recording(tmp_path / "run")
    shutil.copy(SAMPLE / "run-01" / "tracks.parquet", run / "motion.parquet")
    (tmp_path / "p.csv").write_text("frame,marker,x_mm,y_mm,z_mm\n0,H1,1,2,3\n", encoding="utf-8")
    assert main(["import", str(run), "--points", str(tmp_path / "p.csv")]) == 0
    assert "enters the chain at motion.parquet" in capsys.readouterr().out
