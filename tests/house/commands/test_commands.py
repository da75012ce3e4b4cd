"""Commands as real processes: the end of a good run, and of every wrong input."""

import json
import re

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from ovines.__main__ import main
from ovines.pipeline.one_recording import run_one
from ovines.pipeline.series.recordings import Workers, run_series
from ovines.system_library import missing_library
from ovines.tables import read_table
from tests.conftest import bouncing_motion, refused, write_small_recording
from tests.processes import dies_once


def change_toml(folder, old, new):
    text = (folder / "recording.toml").read_text(encoding="utf-8")
    assert old in text
    (folder / "recording.toml").write_text(text.replace(old, new, 1), encoding="utf-8")


def change_tracks(folder, change):
    frame = change(pd.DataFrame(read_table(folder / "tracks.parquet", "tracks")))
    pq.write_table(pa.Table.from_pandas(frame), folder / "tracks.parquet")


def test_help_and_version_and_command_line(ovines):
    assert "triangulate" in ovines("--help").stdout
    assert re.fullmatch(r"ovines \d+\.\d+\.\d+\n", ovines("--version").stdout)
    for wrong in (
        [],
        ["fly"],
        ["run"],
        ["run", "x", "--jobs", "-1"],
        ["run", "x", "--jobs", "many"],
        ["run", "x", "--fast"],
    ):
        result = ovines(*wrong)
        assert result.returncode == 2 and "Traceback" not in result.stderr


def test_a_stage_as_a_process(small_recording, tmp_path, ovines):
    out = tmp_path / "out"
    result = ovines("triangulate", small_recording.folder, "--out", out, anew=True)
    assert result.returncode == 0 and "run-01: lens, triangulate" in result.stdout
    assert len(read_table(out / "points.parquet", "points")) == 200 * 9
    assert "up to date" in ovines("triangulate", small_recording.folder, "--out", out).stdout
    written = {"lens_terms.parquet", "points.parquet", "source.json", "ovines.log", ".lock"}
    assert {path.name for path in out.iterdir()} == written
    assert json.loads((out / "source.json").read_text())["recording"] == "../series/run-01"


def test_results_lie_inside_the_recording_by_default(small_recording, ovines):
    assert ovines("triangulate", small_recording.folder).returncode == 0
    assert (small_recording.folder / "results" / "points.parquet").is_file()
    assert ovines("triangulate", small_recording.folder / "recording.toml").stdout.startswith("run-01: up to date")


WRONG = {
    "unknown key": (lambda f: change_toml(f, "frame_rate_hz", "frame_rat_hz"), ("line 5", "'frame_rate_hz'?")),
    "broken TOML": (lambda f: change_toml(f, "[time]", "[time"), ("recording.toml",)),
    "no calibration": (lambda f: (f.parent / "calibration.json").unlink(), ("calibration.json",)),
    "broken calibration": (
        lambda f: (f.parent / "calibration.json").write_text('{"format": 1, '),
        ("calibration.json",),
    ),
    "another camera in the tracks": (
        lambda f: change_tracks(f, lambda t: t.assign(camera=t["camera"].replace("VW2", "VW3"))),
        ("VW3",),
    ),
    "missing column": (
        lambda f: change_tracks(f, lambda t: t.drop(columns="u_px")),
        ("no column u_px", "tracks.parquet"),
    ),
    "NaN": (
        lambda f: change_tracks(f, lambda t: t.assign(u_px=t["u_px"].where(t["frame"] != 7))),
        ("u_px is missing",),
    ),
    "one camera": (lambda f: change_tracks(f, lambda t: t[t["camera"] == "VW1"]), ("camera",)),
    "time twice": (lambda f: change_tracks(f, lambda t: t.assign(time_s=0.0)), ("is followed by", "time")),
    "zero bytes": (lambda f: (f / "tracks.parquet").write_bytes(b""), ("cannot be read as Parquet",)),
    "a folder for a table": (
        lambda f: ((f / "tracks.parquet").unlink(), (f / "tracks.parquet").mkdir()),
        ("no frames",),
    ),
    "no rows": (lambda f: change_tracks(f, lambda t: t.iloc[:0]), ("tracks",)),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_refused_and_leaves_nothing_half_written(case, small_recording, tmp_path, ovines):
    spoil, words = WRONG[case]
    spoil(small_recording.folder)
    before = sorted(tmp_path.rglob("*"))
    result = ovines("run", small_recording.folder, "--out", tmp_path / "out")
    refused(result, *words)
    left = {path.name for path in (tmp_path / "out").glob("*")} if (tmp_path / "out").exists() else set()
    assert left <= {".lock", "source.json", "ovines.log", "lens_terms.parquet"}  # the stages before are whole
    assert [path for path in sorted(tmp_path.rglob("*")) if "out" not in path.parts] == [
        path for path in before if "out" not in path.parts
    ]


@pytest.mark.parametrize("case", WRONG)
def test_check_finds_it_too(case, small_recording, tmp_path, capsys):
    if case in ("another camera in the tracks", "one camera"):
        pytest.skip("seen by the stage: `check` does not compare tracks with the calibration")
    WRONG[case][0](small_recording.folder)
    before = sorted(tmp_path.rglob("*"))
    assert main(["check", str(small_recording.folder)]) == 2
    said = capsys.readouterr().out
    assert "wrong:" in said and "expected:" in said
    assert sorted(tmp_path.rglob("*")) == before, "check writes nothing"


def test_check_of_a_good_recording(small_recording, tmp_path, ovines):
    result = ovines("check", small_recording.folder, "--out", tmp_path / "out")
    assert result.returncode == 0, result.stdout + result.stderr
    assert "lens:        would run\n" in result.stdout and "triangulate: would run after lens" in result.stdout
    ovines("triangulate", small_recording.folder, "--out", tmp_path / "out")
    result = ovines("check", small_recording.folder, "--out", tmp_path / "out")
    assert "triangulate: up to date" in result.stdout and "analyse:     would run" in result.stdout


def test_nothing_there(tmp_path, ovines):
    refused(ovines("run", tmp_path / "none"), "is not there")
    refused(ovines("run", tmp_path), "no recording.toml")
    refused(ovines("check", tmp_path / "none"), "is not there")
    refused(ovines("report", tmp_path), "no results")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("jobs", [1, 2])
def test_one_bad_recording_costs_only_itself(jobs, small_series, tmp_path, ovines):
    change_toml(small_series / "run-02", "mass_kg", "masse_kg")
    result = ovines("triangulate", small_series, "--out", tmp_path / "out", "--jobs", jobs)
    assert result.returncode == 2 and "Traceback" not in result.stderr
    assert "run-02: refused" in result.stderr and "masse_kg" in result.stderr and "1 of 3" in result.stderr
    done = {path.parent.name for path in (tmp_path / "out").glob("*/points.parquet")}
    assert done == {"run-01", "run-03"}


def test_a_killed_worker_costs_nothing(tmp_path, monkeypatch):
    """A process that dies takes its siblings' futures along; each recording is then tried in a process of its own."""
    for number in (1, 2):
        write_small_recording(tmp_path / "series" / f"run-{number:02d}", frames=50, seed=number)
    monkeypatch.setattr("ovines.pipeline.series.recordings.run_one", dies_once)
    monkeypatch.setenv("OVINES_TEST_MARK", str(tmp_path / "died"))
    outcomes = run_series(tmp_path / "series", tmp_path / "out", "triangulate", workers=Workers(2, bars=False))
    assert (tmp_path / "died").exists()
    assert [one.status for one in outcomes] == ["done"] * 2


def test_a_mistake_of_ours_is_reported_as_one(small_recording, tmp_path, monkeypatch):
    def broken(work):
        raise ZeroDivisionError("our bug")

    monkeypatch.setattr("ovines.pipeline.functions.triangulate", broken)
    outcome = run_one(small_recording.folder, tmp_path / "out", None, False, False)
    assert outcome.status == "failed" and "ZeroDivisionError: our bug" in outcome.message


def test_names_with_spaces_and_umlauts(tmp_path, ovines):
    folder = write_small_recording(tmp_path / "Prüfstand [2] ä" / "Läufe 3.5 g; <b>", frames=50).folder
    result = ovines("triangulate", folder, "--out", tmp_path / "Ergebnis für ö")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "Ergebnis für ö" / "points.parquet").is_file()


def write_motion_entry(folder, frame, bodies):
    folder.mkdir(parents=True)
    pq.write_table(pa.Table.from_pandas(frame), folder / "motion.parquet")
    (folder / "recording.toml").write_text(f'format = 1\nname = "puck"\n[time]\nframe_rate_hz = 800.0\n{bodies}')


PUCK = (
    "[bodies.host]\npolygon_m = [[-0.05, -0.05], [0.05, -0.05], [0.05, 0.05], [-0.05, 0.05]]\n[bodies.nes]\nradius_m "
    "= 0.01\n"
)


def test_an_entry_at_motion_needs_no_cameras(tmp_path, ovines):
    """A puck on its table: no angle, no sd, no markers; null angles and no column at all."""
    motion = bouncing_motion(150, 800.0).drop(columns="host_angle_rad").assign(nes_angle_rad=None)
    write_motion_entry(tmp_path / "puck", motion, PUCK)
    result = ovines("analyse", tmp_path / "puck", "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert read_table(tmp_path / "out" / "motion.parquet", "motion")["nes_x_m"].to_numpy() == pytest.approx(
        motion["nes_x_m"]
    )
    assert ovines("check", tmp_path / "puck").returncode == 0


def test_an_entry_at_motion_without_bodies_is_refused(tmp_path, ovines):
    write_motion_entry(tmp_path / "puck", bouncing_motion(50, 800.0), "")
    refused(ovines("run", tmp_path / "puck", "--out", tmp_path / "out"), "no [bodies.host]")


@pytest.mark.usefixtures("unpainted")
def test_report_of_a_results_folder(small_recording, tmp_path, capsys):
    """From the results alone; a name of the recording is text in the page, never markup."""
    change_toml(small_recording.folder, 'name = "run-01"', 'name = "<script>alert(1)<x> & ä"')
    out = tmp_path / "out"
    assert main(["analyse", str(small_recording.folder), "--out", str(out)]) == 0
    assert main(["report", str(out)]) == 0, capsys.readouterr().err
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "<script>alert" not in page.split("<!-- ovines")[0] and "&lt;script&gt;alert(1)" in page
    capsys.readouterr()
    assert main(["report", str(out)]) == 0 and "up to date" in capsys.readouterr().out
    (out / "source.json").write_text("{}")
    assert main(["report", str(out)]) == 2
    said = capsys.readouterr().err
    assert "source.json" in said and all(line in said for line in ("found:", "expected:", "do:"))


def test_track_names_are_kept_or_refused(small_recording, tmp_path, ovines):
    refused(
        ovines("track", small_recording.folder, "--names", tmp_path / "none.csv", "--out", tmp_path / "o"),
        "none.csv",
    )
    refused(ovines("track", small_recording.folder, "--out", tmp_path / "o"), "'track' has nothing to do")


def test_a_missing_system_library_is_one_line():
    error = ImportError("libGL.so.1: cannot open shared object file: No such file or directory")
    message = missing_library(error)
    assert "libGL.so.1" in message and "libgl1" in message and "\n" not in message
    assert missing_library(ImportError("No module named 'cv3'")) is None


def test_a_missing_system_library_as_a_process(small_recording, tmp_path, ovines):
    """A cv2 that fails as it does without libGL, put in front of the real one."""
    (tmp_path / "fake").mkdir()
    (tmp_path / "fake" / "cv2.py").write_text(
        "raise ImportError('libGL.so.1: cannot open shared object file: No such file or directory')\n"
    )
    change_toml(small_recording.folder, 'name = "VW1"\n', 'name = "VW1"\nframes = "*.png"\n')
    change_toml(small_recording.folder, 'name = "VW2"\n', 'name = "VW2"\nframes = "*.png"\n')
    (small_recording.folder / "tracks.parquet").unlink()
    (small_recording.folder / "0.png").write_bytes(b"x")
    result = ovines(
        "run", small_recording.folder, "--out", tmp_path / "out", env={"PYTHONPATH": str(tmp_path / "fake")}
    )
    text = result.stdout + result.stderr
    assert result.returncode == 2 and "Traceback" not in text
    assert "libgl1" in text
