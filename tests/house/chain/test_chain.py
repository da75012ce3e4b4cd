"""A stage runs when, and only when, what it depends on has changed; nothing half written, nothing stale."""

import json
import shutil
import subprocess
import sys

import pandas as pd
import pytest
from filelock import FileLock

import ovines.pipeline.stages
from ovines.camera import read_calibration
from ovines.errors import InputError
from ovines.io.lock import LOCK
from ovines.pipeline.code import ROOT, code_of
from ovines.pipeline.runner import run_stages, write_output
from ovines.pipeline.stages import STAGES, inputs_of, location, stage, stages_of, stored_state
from ovines.recording import read_recording
from ovines.tables import TABLES, read_provenance, read_table, write_table
from tests.conftest import two_cameras, write_small_recording


def triangulate(folder, out, **options):
    return run_stages(read_recording(folder), out, only="triangulate", **options).stages["triangulate"]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with a recording, and results that are up to date for triangulate."""
    place = tmp_path_factory.mktemp("made")
    folder, out = write_small_recording(place / "series" / "run-01").folder, place / "out"
    assert triangulate(folder, out) == "run"
    assert triangulate(folder, out) == "up to date"
    return place


@pytest.fixture
def done(made, tmp_path):
    """A recording, and a results folder that is up to date for triangulate: a test's own copy of both."""
    shutil.copytree(made, tmp_path, dirs_exist_ok=True)
    return tmp_path / "series" / "run-01", tmp_path / "out"


def test_points_are_where_the_markers_were(small_recording, tmp_path):
    triangulate(small_recording.folder, tmp_path / "out")
    points = read_table(tmp_path / "out" / "points.parquet", "points")
    centre = points[points["marker"] == "N1"].merge(small_recording.motion, on="frame")
    error = centre["x_m"] - centre["nes_x_m"]
    # 0.02 px at 3000 px focal length and about 0.53 m is 3.5 um and the mean of two views is better
    assert len(centre) == 200 and error.abs().max() < 5 * 3.5e-6
    assert abs(error.mean()) < 4 * error.std() / len(error) ** 0.5


def test_provenance_says_where_it_comes_from(done):
    folder, out = done
    state = read_provenance(out / "points.parquet")
    assert state["command"] == "triangulate" and state["version"]
    assert set(state["inputs"]) == {"tracks.parquet", "calibration.json", "lens_terms.parquet"}
    assert set(state["parameters"]) == {"cameras"}
    assert str(folder) not in json.dumps(state), "an absolute path would make the same recording give other bytes"


def test_same_content_is_up_to_date(done):
    folder, out = done
    content = (folder / "tracks.parquet").read_bytes()
    (folder / "tracks.parquet").unlink()
    (folder / "tracks.parquet").write_bytes(content)
    assert triangulate(folder, out) == "up to date"


def test_a_copy_elsewhere_is_up_to_date(done, tmp_path):
    folder, out = done
    shutil.copytree(folder.parent, tmp_path / "elsewhere")
    before = (out / "points.parquet").read_bytes()
    assert triangulate(tmp_path / "elsewhere" / folder.name, out) == "up to date"
    assert triangulate(tmp_path / "elsewhere" / folder.name, out, force=True) == "run"
    assert (out / "points.parquet").read_bytes() == before


def _one_track_less(folder, out):
    tracks = read_table(folder / "tracks.parquet", "tracks")
    write_table(tracks.iloc[:-1], "tracks", folder / "tracks.parquet", {})


def _another_window(folder, out):
    text = (folder / "recording.toml").read_text()
    (folder / "recording.toml").write_text(text.replace("[0, 1192]", "[0, 1193]"))


def _another_calibration(folder, out):
    cameras = read_calibration(folder.parent / "calibration.json")
    content = json.loads((folder.parent / "calibration.json").read_text())
    content["cameras"][0]["matrix"][0][2] += 0.5
    (folder.parent / "calibration.json").write_text(json.dumps(content))
    assert len(cameras) == 2


def _output_gone(folder, out):
    (out / "points.parquet").unlink()


def _output_empty(folder, out):
    (out / "points.parquet").write_bytes(b"")


@pytest.mark.parametrize(
    "change",
    [
        _one_track_less,
        _another_window,
        _another_calibration,
        _output_gone,
        _output_empty,
    ],
)
def test_what_changed_runs_again(change, done):
    folder, out = done
    change(folder, out)
    assert triangulate(folder, out) == "run"
    assert triangulate(folder, out) == "up to date"


def test_what_the_stage_does_not_read_leaves_it_up_to_date(done):
    folder, out = done
    text = (folder / "recording.toml").read_text()
    (folder / "recording.toml").write_text(text + "\n[model]\neffects = []\n")
    assert triangulate(folder, out) == "up to date"


def test_changed_code_runs_again(done, monkeypatch):
    folder, out = done
    monkeypatch.setattr(ovines.pipeline.stages, "code_digest", lambda stage: "other code")
    assert triangulate(folder, out) == "run"


def test_a_figure_or_a_page_makes_no_parameter_stale():
    code = {one.name: {path.relative_to(ROOT).as_posix() for path in code_of(one.name)} for one in STAGES}
    for name in ("calibrate", "track", "triangulate", "analyse", "identify"):
        assert not [
            path
            for path in code[name]
            if path.startswith(("analysis/report", "analysis/figures", "analysis/gap", "ovines/commands"))
        ]
    assert not [path for path in code["identify"] if path.startswith(("vision/tracking", "vision/markers"))]
    assert {"analysis/report/style.css", "analysis/figures/style.py"} <= code["report"]
    assert {"vision/tracking/state.py", "ovines/camera/model.py", "ovines/tables/declared.py"} <= code["track"]


def test_whatever_a_stage_loads_is_its_code():
    """In a process of its own: when all that `identify` imports is loaded, every file of ours that is loaded is the
    stage's code.
    """
    script = """
import sys
from pathlib import Path
from ovines.pipeline.code import ROOT, code_of
import ovines.pipeline.functions, analysis.identify, analysis.checks.recording
ours = [m.__file__ for n, m in list(sys.modules.items()) if n.split(".")[0] in ("vision", "analysis", "ovines")]
loaded = {Path(file).resolve() for file in ours if file}
print(sorted(str(p.relative_to(ROOT)) for p in loaded - set(code_of("identify"))))
"""
    done = subprocess.run([sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_force(done):
    folder, out = done
    assert triangulate(folder, out, force=True) == "run"


def empty_table(name):
    return pd.DataFrame({column.name: [] for column in TABLES[name].columns})


def test_a_stage_that_runs_removes_what_was_made_from_its_old_output(done):
    folder, out = done
    later = [name for one in STAGES[STAGES.index(stage("triangulate")) + 1 :] for name in one.writes]
    for name in later:
        write_output("a page" if name.endswith(".html") else empty_table(name.removesuffix(".parquet")), out / name, {})
    (out / "calibration.json").write_text("earlier")
    _one_track_less(folder, out)
    triangulate(folder, out)
    assert not [name for name in later if (out / name).exists()]
    assert (out / "calibration.json").exists()


def test_a_refused_stage_leaves_nothing_stale(done):
    folder, out = done
    tracks = read_table(folder / "tracks.parquet", "tracks")
    write_table(tracks[tracks["camera"] == "VW1"], "tracks", folder / "tracks.parquet", {})
    with pytest.raises(InputError):
        triangulate(folder, out)
    assert not (out / "points.parquet").exists()


def test_one_run_per_results_folder(done):
    folder, out = done
    with FileLock(out / LOCK), pytest.raises(InputError, match="another ovines is writing"):
        triangulate(folder, out)
    assert triangulate(folder, out) == "up to date"


def test_the_recording_s_own_folder_is_no_place_for_results(small_recording):
    before = sorted(path.name for path in small_recording.folder.iterdir())
    with pytest.raises(InputError, match="own folder"):
        triangulate(small_recording.folder, small_recording.folder)
    assert sorted(path.name for path in small_recording.folder.iterdir()) == before


def test_a_file_is_no_folder(small_recording, tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="is a file"):
        triangulate(small_recording.folder, tmp_path / "file")


def test_stages_by_entry(small_recording):
    folder = small_recording.folder
    assert [one.name for one in stages_of(read_recording(folder))] == [
        "lens",
        "triangulate",
        "analyse",
        "identify",
        "report",
    ]
    (folder / "points.parquet").touch()
    recording = read_recording(folder)
    assert [one.name for one in stages_of(recording)] == ["analyse", "identify", "report"]
    assert location("points.parquet or motion.parquet", recording, folder / "o") == [folder / "points.parquet"]
    with pytest.raises(InputError, match="'triangulate' has nothing to do"):
        triangulate(folder, folder / "o")
    text = (folder / "recording.toml").read_text()
    images = 'board = "b"\nintrinsic = "{camera}/*.png"\nextrinsic = "{camera}.png"'
    (folder / "recording.toml").write_text(text.replace('file = "../calibration.json"', images))
    (folder / "points.parquet").unlink()
    assert [one.name for one in stages_of(read_recording(folder))][:2] == ["calibrate", "lens"]


def test_images_of_one_camera_that_are_missing_are_named(small_recording, tmp_path):
    folder = small_recording.folder
    text = (folder / "recording.toml").read_text()
    images = 'board = "charuco_5x7_8mm"\nintrinsic = "{camera}_*.png"\nextrinsic = "x_{camera}.png"'
    (folder / "recording.toml").write_text(text.replace('file = "../calibration.json"', images))
    for name in ("VW1_1.png", "VW2_1.png", "x_VW1.png"):
        (folder / name).touch()
    with pytest.raises(InputError, match=r"no extrinsic images .*x_VW2\.png is not there"):
        inputs_of(stage("calibrate"), read_recording(folder), tmp_path)
    (folder / "x_VW2.png").touch()
    found = inputs_of(stage("calibrate"), read_recording(folder), tmp_path)
    assert {name: [path.name for path in paths] for name, paths in found.items()} == {
        "board": ["charuco_5x7_8mm.toml"],
        "intrinsic images": ["VW1_1.png", "VW2_1.png"],
        "extrinsic images": ["x_VW1.png", "x_VW2.png"],
    }


def test_every_stage_reads_what_an_earlier_one_writes_or_the_recording_brings():
    brought = {
        "board",
        "intrinsic images",
        "extrinsic images",
        "frames",
        "first frames",
        "names.csv",
        "trigger.csv",
        "accelerometers' record",
        "points.parquet or motion.parquet",
        "motion.parquet or impacts.parquet",
        "lens of the series",
    }
    made: set[str] = set()
    for one in STAGES:
        assert set(one.reads) | set(one.may_read) <= brought | made, one.name
        assert not made & set(one.writes), "two stages write the same file"
        made |= set(one.writes)


@pytest.mark.parametrize("name", ["calibration.json", "report.html", "identification.parquet"])
def test_the_state_stands_in_every_kind_of_output(name, tmp_path):
    state = {"key": "abc", "parameters": {"name": "Prüfstand ---> <b>--", "x_m": -0.5}, "outputs": [name]}
    content = {
        "calibration.json": two_cameras(),
        "report.html": "<html><!-- a comment --></html>",
        "identification.parquet": pd.DataFrame(
            {
                "parameter": ["restitution"],
                "value": [0.7],
                "sd": [0.1],
                "low": [0.6],
                "high": [0.8],
                "n_impacts": [3],
            }
        ),
    }[name]
    write_output(content, tmp_path / name, state)
    assert stored_state(tmp_path / name) == state
    if name == "report.html":
        assert (tmp_path / name).read_text(encoding="utf-8").count("-->") == 2, "the state may not end its comment"
    if name == "calibration.json":
        assert [camera.name for camera in read_calibration(tmp_path / name)] == ["VW1", "VW2"]
