"""One camera through the commands: the whole chain, the diagnosis, known points, and what is refused."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from ovines.__main__ import main
from ovines.camera import read_calibration
from ovines.io.provenance import provenance
from ovines.tables import read_table, write_table

SERIES = Path(__file__).parents[3] / "sample_data" / "series_tilted"


def left_with_one(folder: Path, keep: str = "VW1", frames: int = 480) -> Path:
    """A copy of the sample series with the other camera left out of recordings and tracks, and half of the frames."""
    shutil.copytree(SERIES, folder)
    for path in folder.glob("*/recording.toml"):
        parts = re.split(r"(?=\[\[cameras\]\])|(?=\n\[calibration\])", path.read_text())
        kept = [part for part in parts if not part.startswith("[[cameras]]") or f'name = "{keep}"' in part]
        path.write_text("".join(kept))
        tracks = read_table(path.parent / "tracks.parquet", "tracks")
        own = tracks[(tracks["camera"] == keep) & (tracks["frame"] < tracks["frame"].min() + frames)]
        own = own.reset_index(drop=True)
        write_table(own, "tracks", path.parent / "tracks.parquet", provenance("test", {}, {}))
    return folder


@pytest.mark.further
def test_a_recording_of_one_camera_is_identified(tmp_path, capsys):
    """Parameters within four of their sds of the truth, and notes that say what one view cannot tell."""
    series, out = left_with_one(tmp_path / "series"), tmp_path / "out"
    assert main(["check", str(series / "run-01")]) == 0
    assert main(["run", str(series / "run-01"), "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert "cannot be seen from one view" in said and "keeps its size in the picture" in said
    points, motion = read_table(out / "points.parquet", "points"), read_table(out / "motion.parquet", "motion")
    assert points["z_m"].isna().all() and motion["nes_z_m"].isna().all() and motion["nes_x_m"].notna().any()
    truth = json.loads((SERIES / "truth.json").read_text())["plant"]
    found = read_table(out / "identification.parquet", "identification").set_index("parameter")
    for name in ("restitution", "wall_friction", "tangential_restitution", "floor_friction"):
        assert abs(found["value"][name] - truth[name]) < 4 * found["sd"][name] + 1e-4, name


@pytest.mark.long
def test_a_series_of_one_camera_is_diagnosed(tmp_path):
    series, out = left_with_one(tmp_path / "series", frames=960), tmp_path / "out"
    assert main(["diagnose", str(series), "--out", str(out)]) == 0
    answer = json.loads((out / "diagnosis.json").read_text())
    truth = json.loads((SERIES / "truth.json").read_text())["parameters"]["table_tilt"]
    assert answer["effects"] == ["table_tilt"]
    tilt = answer["parameters"]["table_tilt"]["tilt_rad"]
    assert tilt["value"] == pytest.approx(truth["tilt_rad"], rel=0.02)


def test_the_other_cameras_tracks_missing_is_no_recording_of_one(tmp_path, capsys):
    folder = tmp_path / "series"
    shutil.copytree(SERIES, folder)
    path = folder / "run-01" / "tracks.parquet"
    tracks = read_table(path, "tracks")
    write_table(tracks[tracks["camera"] == "VW1"].reset_index(drop=True), "tracks", path, provenance("test", {}, {}))
    assert main(["triangulate", str(folder / "run-01"), "--out", str(tmp_path / "o")]) == 2
    assert "leave its [[cameras]] out" in "".join(capsys.readouterr())


@pytest.mark.further
def test_four_known_points_serve_as_a_calibration(tmp_path, capsys):
    """The places of the real calibration within four of the sds that the points leave."""
    series = left_with_one(tmp_path / "series")
    run, camera = series / "run-01", read_calibration(SERIES / "calibration.json")[0]
    corners = np.array([[x, y, 0.0] for x in (-0.12, 0.12) for y in (-0.06, 0.06)])
    shown = camera.project(corners) - np.array([0, 1182]) + np.random.default_rng(0).normal(0, 0.3, (4, 2))
    rows = [f"{u:.2f},{v:.2f},{1e3 * x:g},{1e3 * y:g},0.3" for (u, v), (x, y, _) in zip(shown, corners, strict=True)]
    (tmp_path / "points.csv").write_text("\n".join(["u_px,v_px,x_mm,y_mm,sd_px", *rows]) + "\n")
    assert main(["import", str(run), "--plane", f"VW1={tmp_path / 'points.csv'}"]) == 0
    assert "known points" in capsys.readouterr().out
    text = (run / "recording.toml").read_text().replace('"../calibration.json"', '"calibration.json"')
    (run / "recording.toml").write_text(text)
    for recording, out in ((run, "a"), (series / "run-02", "b")):
        assert main(["analyse", str(recording), "--out", str(tmp_path / out)]) == 0
    (run / "recording.toml").write_text(text.replace('"calibration.json"', '"../calibration.json"'))
    assert main(["analyse", str(run), "--out", str(tmp_path / "true")]) == 0
    mine, true = (read_table(tmp_path / one / "points.parquet", "points") for one in ("a", "true"))
    for axis in "xy":
        off = mine[f"{axis}_m"] - true[f"{axis}_m"]
        assert (np.abs(off) < 4 * mine[f"{axis}_calibration_sd_m"]).mean() > 0.99
        assert off.abs().max() < 2e-3


def test_known_points_that_do_not_serve(tmp_path, capsys):
    run = left_with_one(tmp_path / "series") / "run-01"
    (tmp_path / "points.csv").write_text("u_px,v_px,x_mm\n1,2,3\n")
    assert main(["import", str(run), "--plane", f"VW1={tmp_path / 'points.csv'}"]) == 2
    assert "no y" in "".join(capsys.readouterr())
    (tmp_path / "points.csv").write_text("u_px,v_px,x_mm,y_mm\n1,2,3,4\n5,6,7,8\n1,9,3,9\n")
    assert main(["import", str(run), "--plane", f"VW1={tmp_path / 'points.csv'}"]) == 2
    assert "3 known points" in "".join(capsys.readouterr())
    assert main(["import", str(run), "--plane", f"VW9={tmp_path / 'points.csv'}"]) == 2
    assert "--plane VW9" in "".join(capsys.readouterr())
