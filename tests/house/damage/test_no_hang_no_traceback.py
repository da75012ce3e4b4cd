"""What once ended in a traceback, a hang or a crash: refused in three lines, within its budget, and nobody is left
behind.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import cv2
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import ovines.__main__
from ovines.__main__ import main
from ovines.errors import InputError, refusal_of
from ovines.importers.reading.files import read_values
from ovines.io.nesting import DEEPEST
from ovines.io.toml_input import read_toml
from ovines.pipeline.one_recording import Outcome
from ovines.pipeline.series.recordings import Workers, run_series
from ovines.recording import read_recording, series_folders
from ovines.workers.budget import Budget, given_up, in_words, refuse_cost, within_budget
from tests.conftest import bouncing_motion, recording_toml, refused, two_cameras, write_small_recording
from tests.house.damage.test_fuzz import SCENARIO
from tests.house.damage.test_nothing_is_silently_wrong import SMALL, with_frames, write_motion

# --- budgets ---------------------------------------------------------------------------------------------------------


def test_what_costs_too_much_stops_unless_told_to_go_on(capsys):
    refuse_cost("a little", 10.0, 1e9, yes=False)
    assert capsys.readouterr().err == ""
    refuse_cost("a test day", 600.0, 1e9, yes=False, most_s=3600.0)
    assert "a test day: about 10 minutes and 1 GB" in capsys.readouterr().err
    for seconds, size_bytes in ((61.0, 0.0), (0.0, 4.1e9)):
        with pytest.raises(InputError, match="--yes"):
            refuse_cost("much", seconds, size_bytes, yes=False)
        refuse_cost("much", seconds, size_bytes, yes=True)
    assert (
        in_words(3.2e12, 7e14) == "101394 years and 700 TB"
        and in_words(0.1, 0) == "a moment"
        and in_words(60, 0) == "60 s"
    )


COSTLY = {
    "a simulated century": ("duration_s = 1.0", "duration_s = 3e9", "rows"),
    "a rate of 1e12 Hz": ("sample_rate_hz = 800.0", "sample_rate_hz = 1e12", "rows"),
    "a day of samples": ("duration_s = 1.0", "duration_s = 1e5", "rows"),
    "a drive of 1 GHz": ("frequency_hz = 11.0", "frequency_hz = 1e9", "steps"),
    "impacts without end": (
        "duration_s = 1.0",
        "duration_s = 1.0\nmax_impacts = 1000000000000000000000000000000",
        "max_impacts",
    ),
    "a tolerance below rounding": ("duration_s = 1.0", "duration_s = 1.0\ntolerance = 1e-300", "tolerance"),
}


@pytest.mark.parametrize("case", COSTLY)
def test_a_costly_scenario_is_stopped_before_it_begins(case, tmp_path, capsys):
    old, new, word = COSTLY[case]
    (tmp_path / "s.toml").write_text(SCENARIO.replace(old, new))
    began = time.process_time()
    assert main(["simulate", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out")]) == 2
    assert word in capsys.readouterr().err and time.process_time() - began < 20 and not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "options", [("--runs", "-5"), ("--seed", "-1"), ("--spread", "nan"), ("--spread", "1e9"), ("--seed", "9" * 30)]
)
def test_options_of_simulate(options, tmp_path, capsys):
    with pytest.raises(SystemExit) as end:
        main(["simulate", "table-3", "--out", str(tmp_path / "out"), *options])
    assert end.value.code == 2 and options[0] in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_milliard_runs_are_stopped(tmp_path, capsys):
    assert main(["simulate", "table-3", "--runs", "1000000000", "--out", str(tmp_path / "out")]) == 2
    assert "1000000000 runs" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_table_too_large_for_the_memory_is_known_by_its_footer(tmp_path, monkeypatch, capsys):
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    monkeypatch.setattr("ovines.pipeline.series.recordings.BYTES_PER_ROW", 1e8)
    assert main(["triangulate", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert "tracks.parquet: 360 rows: about 36 GB" in capsys.readouterr().err and not (tmp_path / "out").exists()
    assert main(["triangulate", str(folder), "--out", str(tmp_path / "out"), "--yes"]) == 0


def test_work_within_its_budget_gives_its_result_or_its_error():
    assert within_budget(lambda: 7, "x", yes=False) == 7
    with pytest.raises(ZeroDivisionError):
        within_budget(lambda: 1 / 0, "x", yes=False)


def test_the_parts_of_a_command_share_its_budget():
    """A simulation and its copies had a minute each."""
    budget = Budget(yes=False)
    budget.within(lambda: time.sleep(0.2), "one part")
    assert budget.spent_s >= 0.2
    budget.most_s = budget.spent_s + 0.1  # by itself the other part has time enough
    goes_on = threading.Event()
    with pytest.raises(InputError, match="another part is not done after"):
        budget.within(lambda: goes_on.wait(60.0), "another part")
    goes_on.set()  # nothing is left running for the tests that look for it
    while given_up():
        time.sleep(0.01)
    budget.yes = True
    assert budget.within(lambda: "done", "a part that was said yes to") == "done"


def test_copies_beyond_what_the_plain_run_leaves_are_stopped_before_they_begin(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr("ovines.simulations.many.ENSEMBLE_SHARE", 1e9)
    (tmp_path / "s.toml").write_text(SCENARIO)
    assert main(["simulate", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--runs", "3"]) == 2
    assert "and 3 copies: about" in capsys.readouterr().err and not (tmp_path / "out").exists()


def test_a_loop_that_sees_no_clock_is_given_up():
    """Stands for compiled code: it goes on in its thread, and the process knows."""
    end = threading.Event()
    with pytest.raises(InputError, match="not done after"):
        within_budget(end.wait, "the simulation", yes=False, most_s=0.3)
    assert given_up()
    end.set()
    time.sleep(0.2)
    assert not given_up()


def test_compiling_is_no_part_of_the_budget():
    """On a slow machine the first `ovines orbits` was refused after a minute of compiling, with the advice to ask for
    less."""
    from ovines.core.kernel import Kernel

    before = Kernel.guard

    def work() -> int:
        with Kernel.guard.alone(SimpleNamespace(index=None)):  # as a kernel does that has to be compiled
            time.sleep(0.8)
        return 7

    assert within_budget(work, "x", yes=False, most_s=0.3) == 7
    with pytest.raises(InputError, match="not done after"):
        within_budget(lambda: (work(), time.sleep(0.8)), "x", yes=False, most_s=0.3)
    assert Kernel.guard is before


@pytest.fixture
def interruptible():
    """Ctrl-C as in a terminal, also where the tests run in the background of a shell that ignores it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interruptible")
def test_ctrl_c_is_obeyed_at_once():
    end = threading.Event()
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    began = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        within_budget(end.wait, "the simulation", yes=True)
    assert time.monotonic() - began < 1.3
    end.set()


@pytest.mark.usefixtures("interruptible")
def test_an_interrupted_program_ends_with_its_compiled_loop(tmp_path):
    """The whole way: a thread that nobody can stop does not keep the process."""
    script = (
        "import sys, threading, ovines.__main__ as m, ovines.workers.budget as b\n"
        "work = lambda: (print('in', flush=True), threading.Event().wait())\n"
        "m.parse = lambda _: type('A', (), {'quiet': False, 'verbose': False,\n"
        "    'run': staticmethod(lambda args: b.within_budget(work, 'x', True))})()\n"
        "sys.argv = ['ovines']; sys.exit(m.main())\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout.readline() == "in\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=5) == 130 and "interrupted" in process.stderr.read()


# --- workers ---------------------------------------------------------------------------------------------------------


@pytest.mark.further
@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGKILL])
def test_workers_die_with_the_process_that_started_them(how, tmp_path):
    script = (
        "import os, sys, time\nfrom pathlib import Path\nfrom joblib.externals.loky import ProcessPoolExecutor\nfrom "
        "ovines.pipeline.series.recordings import _in_worker, run_one\n"
        "pool = ProcessPoolExecutor(max_workers=2)\n"
        "for one in [pool.submit(_in_worker, os.getpid(), run_one, Path('nowhere'), Path('out'), None, False, False) "
        "for _ in range(4)]: one.result()\n"
        "print(*[process.pid for process in pool._processes.values()], flush=True)\ntime.sleep(60)\n"
    )
    with subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=tmp_path) as parent:
        workers = [int(pid) for pid in parent.stdout.readline().split()]
        assert len(workers) == 2
        parent.send_signal(how)
        parent.wait(timeout=10)
    limit = time.monotonic() + 10
    while any(_lives(pid) for pid in workers) and time.monotonic() < limit:
        time.sleep(0.1)
    assert not any(_lives(pid) for pid in workers)


def _lives(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


# --- nested, damaged and hostile files --------------------------------------------------------------------------------

DEEP = 100_000
NESTED = {
    "flow.yaml": "%YAML:1.0\n---\na: " + "[" * DEEP + "]" * DEEP,
    "map.yml": "%YAML:1.0\n---\na: " + "{a: " * DEEP + "}" * DEEP,
    "block.yml": "%YAML:1.0\n---\n" + "\n".join(" " * i + "a:" for i in range(2000)),
    "dashes.yml": "%YAML:1.0\n---\na:\n  " + "- " * DEEP + "1",
    "tags.xml": '<?xml version="1.0"?>\n<opencv_storage>' + "<a>" * DEEP + "</a>" * DEEP + "</opencv_storage>",
    "a.json": '{"a":' * 2000 + "1" + "}" * 2000,
    "dots.toml": "a" + ".a" * 20_000 + " = 1",
    "header.toml": "[" + "a." * 20_000 + "a]\n",
    "lists.toml": "a = " + "[" * DEEP + "]" * DEEP,
    "inline.toml": "a = {" + "a." * 20_000 + "a = 1}",
}


@pytest.mark.others_further
@pytest.mark.parametrize("name", NESTED)
def test_files_nested_without_end(name, tmp_path):
    """OpenCV's parser would end the process at its stack's end, others take minutes and gigabytes."""
    path = tmp_path / name
    path.write_text(NESTED[name])
    began = time.process_time()
    with pytest.raises(InputError, match="deep"):
        read_values(path)
    if name.endswith(".toml"):
        from ovines.recording_schema import RecordingFile

        with pytest.raises(InputError, match="deep"):
            read_toml(path, RecordingFile)
    assert time.process_time() - began < 10


def test_files_nested_as_usual_are_read(tmp_path):
    (tmp_path / "c.yml").write_text(
        '%YAML:1.0\n---\nnote: "[[[[ it\'s text"\nm: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: d\n   data: [ '
        "1., 2. ]\n"
    )
    assert read_values(tmp_path / "c.yml")["m"].tolist() == [[1.0, 2.0]]
    (tmp_path / "c.json").write_text(json.dumps({"a": [[[[1]]]], "text": "[" * 2 * DEEPEST}))
    assert read_values(tmp_path / "c.json")["a"] == [[[[1]]]]


LENS = {
    "cameraMatrix": [[3000, 0, 20], [0, 3000, 15], [0, 0, 1]],
    "rvec": [0.1, 0.2, 3.0],
    "tvec": [0.1, 0.0, 0.5],
    "imageWidth": 40,
    "imageHeight": 30,
}
SPOILT = {
    "imageWidth": ["abc", float("nan"), float("inf"), [1, 2], {}, -5, 1e300, 10**400, True],
    "newCameraMatrix": ["abc", [1, 2], {"data": 3}, 10**400, float("nan")],
    "rvec": [10**400, "a", {"rows": float("inf"), "cols": 1, "data": [1]}, {"rows": 10**400, "cols": 1, "data": [1]}],
    "cameraMatrix": [None, 10**400, [[1]]],
    "rms": [10**400, "a", float("inf"), -1],
}


@pytest.mark.parametrize(
    ("key", "value"), [(key, value) for key, values in SPOILT.items() for value in values], ids=str
)
def test_a_foreign_camera_with_one_wrong_value(key, value, tmp_path):
    """Read without it, or refused: never another exception."""
    from ovines.importers.formats.opencv_cameras import read_cameras

    path = tmp_path / "a.json"
    path.write_text(json.dumps({**LENS, key: value}))
    try:
        found = read_cameras([f"VW1={path}"], ["VW1"])["VW1"]
    except InputError as error:
        assert error.found and error.expected and error.do
    else:
        assert np.isfinite(found.matrix).all() and (found.size_px is None or min(found.size_px) > 0)


@pytest.mark.parametrize("cell", ["inf", "-inf", "1e999"])
def test_an_infinite_cell_is_refused_with_its_line(cell, tmp_path):
    from ovines.importers.formats.marker_csv import read_csv

    (tmp_path / "a.csv").write_text(f"frame,marker,u,v\n0,N1,1,2\n1,N1,{cell},2\n")
    with pytest.raises(InputError, match="line 3"):
        read_csv(tmp_path / "a.csv")


@pytest.mark.parametrize("content", [b"", b"no video at all\n" * 10, "cut", "claims"])
def test_a_video_that_is_none(content, tmp_path, capsys):
    folder = with_frames(tmp_path / "run")
    path = folder / "VW1.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 30, SMALL.shape[::-1], isColor=False)
    for _ in range(4):
        writer.write(SMALL)
    writer.release()
    whole = path.read_bytes()
    if content == "claims":  # the frame counts of the main header and of the stream's
        at = whole.index(b"avih") + 8 + 16
        content = whole[:at] + (2 * 10**9).to_bytes(4, "little") + whole[at + 4 :]
        at = content.index(b"strh") + 8 + 32
        content = content[:at] + (2 * 10**9).to_bytes(4, "little") + content[at + 4 :]
    path.write_bytes(whole[:100] if content == "cut" else content)
    text = (folder / "recording.toml").read_text().replace("VW1/*.png", "VW1.avi")
    (folder / "recording.toml").write_text(text)
    assert main(["check", str(folder)]) == 2
    printed = capsys.readouterr().out
    assert "cannot be opened as a video" in printed or "claims" in printed


MOTIONS = {
    "a Host that is exact": (lambda m: m.assign(host_x_sd_m=0.0, host_y_sd_m=0.0), "host_x_sd_m is 0 in row 0"),
    "one exact row": (
        lambda m: m.assign(nes_angle_sd_rad=np.where(m["frame"] == 7, 0.0, 1e-4)),
        "nes_angle_sd_rad is 0 in row 7",
    ),
    "a pause of thirty years": (
        lambda m: m.assign(time_s=m["time_s"] + 1e9 * (m["frame"] > 100)),
        "frame 100 is followed by frame 101 after 1e+09 s",
    ),
    "milliseconds without a rate": (lambda m: m.assign(time_s=1e3 * m["time_s"]), "are they in milliseconds?"),
    "no time at all": (lambda m: m.assign(time_s=m["time_s"] * 1e-300), "e-30"),
}


@pytest.mark.parametrize("case", MOTIONS)
def test_a_motion_that_no_fit_can_weigh(case, tmp_path, capsys):
    change, words = MOTIONS[case]
    folder = write_motion(tmp_path / "run", change(bouncing_motion(200, 800.0)))
    path = folder / "recording.toml"
    path.write_text(
        path.read_text().replace("[time]\nframe_rate_hz = 800.0\n", "")
    )  # nothing that the times contradict
    for command in ("check", "run", "diagnose"):
        assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2, command
        said = capsys.readouterr()
        assert words in said.out + said.err and "Traceback" not in said.err


def test_a_string_that_is_no_text(tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=5).folder
    table = pq.read_table(folder / "tracks.parquet")
    wrong = pa.array([b"\xff\xfe"] * len(table), pa.binary()).view(pa.string())
    pq.write_table(table.set_column(table.schema.get_field_index("marker"), "marker", wrong), folder / "tracks.parquet")
    for command in ("check", "run"):
        assert main([command, str(folder), "--out", str(tmp_path / "out")]) == 2
        said = capsys.readouterr()
        assert "tracks.parquet" in said.out + said.err


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("layout_m = [[0.046359", "layout_sd_m = 1e-300\nlayout_m = [[0.046359"),
        ("layout_m = [[0.046359", "layout_sd_m = 1e300\nlayout_m = [[0.046359"),
        ("inertia_factor = 0.5", "inertia_factor = 1e-300"),
        ("[0.0061, 0.0003, 0.01]", "[0.0, 0.0, 0.01]"),
        ("[0.0061, 0.0003, 0.01]", "[0.0061, 0.0003, 1e298]"),
        ("inner_radius_m = 0.05", "inner_radius_m = 1e298"),
        ("inner_radius_m = 0.05", "polygon_m = [[0.0, 0.0], [1e200, 0.0], [0.0, 1e200]]"),
        ("\nradius_m = 0.01", "\nradius_m = 1e-300"),
        ("mass_kg = 0.0246", "mass_kg = 1e300"),
        ("frame_rate_hz = 800.0", "frame_rate_hz = 1e300"),
    ],
)
def test_settings_that_no_rig_has(old, new, tmp_path):
    text = recording_toml()
    assert old in text
    (tmp_path / "recording.toml").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match="line"):
        read_recording(tmp_path)


@pytest.mark.parametrize("key", ["matrix", "distortion", "translation_m"])
def test_a_camera_with_a_number_that_none_has(key, tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=5).folder
    content = json.loads((tmp_path / "calibration.json").read_text())
    row = content["cameras"][0][key]
    (row[0] if key == "matrix" else row)[0] = 1e298
    (tmp_path / "calibration.json").write_text(json.dumps(content))
    assert main(["triangulate", str(folder), "--out", str(tmp_path / "out")]) == 2
    assert f"{key} = " in capsys.readouterr().err


TOO_FAR = {
    "nes.radius_m": ("[nes]\nradius_m = 0.01", "[nes]\nradius_m = 1e298"),
    "nes.mass_kg": ("mass_kg = 0.0246", "mass_kg = 1e300"),
    "nes.inertia_factor": ("inertia_factor = 0.5", "inertia_factor = 5e-10"),
    "host.radius_m": ("[host]\nradius_m = 0.05", "[host]\nradius_m = 1e300"),
    "polygon_m": ("[host]\nradius_m = 0.05", "[host]\npolygon_m = [[0, 0], [1e200, 0], [0, 1e200]]"),
    "gravity_m_per_s2": ("gravity_m_per_s2 = [0.0, 0.0]", "gravity_m_per_s2 = [0.0, -1e300]"),
    "initial_nes": ("-0.01, 0.1, 0.0, 0.0, 0.0]", "-0.01, 1e300, 0.0, 0.0, 0.0]"),
    "amplitude": ("amplitude_m = 0.0164", "amplitude_m = 1e300"),
    "frequency_hz": ("frequency_hz = 11.0", "frequency_hz = 1e300"),
    "friction.coefficient": ("coefficient = 0.2", "coefficient = 1e300"),
    "impact.wall_friction": ("wall_friction = 0.13", "wall_friction = 1e300"),
    "run.duration_s": ("duration_s = 1.0", "duration_s = 1e300"),
}


@pytest.mark.parametrize("name", TOO_FAR)
def test_a_scenario_with_a_number_that_no_rig_has(name, tmp_path, capsys):
    """The square of a radius of 1e298 m was an OverflowError."""
    old, new = TOO_FAR[name]
    assert old in SCENARIO
    (tmp_path / "s.toml").write_text(SCENARIO.replace(old, new, 1))
    assert main(["simulate", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out"), "--yes"]) == 2
    said = capsys.readouterr().err
    assert name in said and "expected:" in said and not (tmp_path / "out").exists()


def test_a_suspension_that_no_rig_has():
    from ovines.core import Host, ScenarioError, Suspension

    with pytest.raises(ScenarioError, match="stiffness"):
        Suspension((1e300, 1.0, 1.0), (0.0, 0.0, 0.0))
    with pytest.raises(ScenarioError, match="mass_kg"):
        Host(0.05, motion="free", mass_kg=1e-300)


@pytest.mark.others_further
@pytest.mark.parametrize("name", ["tcp:/127.0.0.1:9", "http:/a", "a::b"])
def test_a_folder_named_like_an_address_is_a_folder(name, tmp_path, monkeypatch, capsys):
    """What `tcp://127.0.0.1:9` is as a path: pyarrow took it for an address on the net."""
    write_small_recording(tmp_path / "run", frames=20)
    monkeypatch.chdir(tmp_path)
    for _ in range(2):  # written, then read and replaced
        assert main(["triangulate", "run", "--out", name, "--force"]) == 0, capsys.readouterr()
        assert (tmp_path / name / "points.parquet").is_file()
    assert main(["export", name, "--to", "csv", "--out", "made"]) == 0, capsys.readouterr()


@pytest.mark.parametrize(
    "manifest",
    ["[]", "{}", '{"cases": 3}', '{"cases": [1]}', '{"cases": [{"case": "../x"}]}', "{", '{"cases": {"a": 1}}', "null"],
)
@pytest.mark.parametrize("step", ["answer", "withhold", "score"])
def test_a_malformed_manifest(manifest, step, tmp_path, capsys):
    (tmp_path / "manifest.json").write_text(manifest)
    assert main(["blind", step, str(tmp_path)]) == 2
    assert "manifest" in capsys.readouterr().err


# --- surroundings ----------------------------------------------------------------------------------------------------


def test_code_that_cannot_be_kept_is_compiled_all_the_same(monkeypatch, capsys):
    """A read-only installation and a home that cannot be written: numba finds no place for its cache."""
    from numba.core import caching

    from ovines.core import compiled

    monkeypatch.setattr(caching.CacheImpl, "_locator_classes", [])
    compiled._say_once_uncached.cache_clear()
    twice = compiled.compiler("stamp")(lambda x: 2.0 * x)
    assert twice(3.0) == 6.0 and compiled.compiler("stamp")(lambda x: x)(1.0) == 1.0
    assert capsys.readouterr().err.count("NUMBA_CACHE_DIR") == 1


@pytest.mark.further
def test_closed_streams(small_recording, tmp_path):
    """`2>&-` and `>&-`: nobody listens, and that is no reason to fail."""
    for closing in ("2>&-", ">&-", "2>&- >&-"):
        command = (
            f"'{sys.executable}' -m ovines triangulate '{small_recording.folder}' --force --out '{tmp_path / 'out'}' "
            f"{closing}"
        )
        assert subprocess.run(command, shell=True, check=False, capture_output=True).returncode == 0, closing


def test_too_little_memory_is_three_lines(monkeypatch, capsys):
    def all_of_it(args):
        raise MemoryError

    args = argparse.Namespace(run=all_of_it, quiet=False, verbose=False)
    monkeypatch.setattr(ovines.__main__, "parse", lambda _: args)
    assert main(["run"]) == 2 and "not enough memory" in capsys.readouterr().err


@pytest.mark.further
@pytest.mark.parametrize("limit_kb", [700_000, 1_200_000])
def test_a_small_address_space_is_three_lines(limit_kb, small_recording, tmp_path):
    """`ulimit -v`: libraries can no longer be mapped; done or refused, never a traceback."""
    command = (
        f"ulimit -v {limit_kb}; '{sys.executable}' -m ovines triangulate '{small_recording.folder}' --out "
        f"'{tmp_path / 'out'}'"
    )
    result = subprocess.run(["bash", "-c", command], check=False, capture_output=True, text=True)
    assert "Traceback" not in result.stderr and result.returncode in (0, 2), result.stderr
    assert result.returncode == 0 or "not enough memory" in result.stderr


class Lost:
    """A client whose scheduler goes away after the first recording."""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        raise OSError("Timed out trying to connect")

    def scheduler_info(self):
        return {"workers": {"one": {}}}

    def submit(self, work, folder, out, *_, **__):
        from concurrent.futures import Future

        future = Future()
        if folder.name == "run-01":
            future.set_result(Outcome(folder, out, "done"))
        else:
            future.set_exception(OSError("the comm is closed"))
        return future


def test_a_scheduler_that_goes_away(small_series, tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("ovines.pipeline.series.cluster.connect", lambda address: Lost())
    outcomes = run_series(
        small_series, tmp_path / "out", "triangulate", workers=Workers(cluster="tcp://x:1", bars=False)
    )
    assert [one.status for one in outcomes] == ["done", "refused", "refused"]
    assert "scheduler went away" in outcomes[1].message and "finished stages are kept" in outcomes[2].message


def test_paths_of_the_system(tmp_path, ovines):
    folder = write_small_recording(tmp_path / "run", frames=5).folder
    for out in ("/proc/x", "/dev/null/x", "/sys/x"):
        refused(ovines("triangulate", folder, "--out", out), out)


def test_a_folder_that_may_not_be_read_costs_only_itself(small_series, tmp_path, monkeypatch, capsys):
    real = Path.is_file

    def closed(path):
        if path.parent.name == "run-02":
            raise PermissionError(13, "Permission denied", str(path))
        return real(path)

    monkeypatch.setattr(Path, "is_file", closed)
    assert [one.name for one in series_folders(small_series)] == ["run-01", "run-02", "run-03"]
    assert main(["triangulate", str(small_series), "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr()
    assert "run-02: refused" in said.err and "Permission denied" in said.err and "free some space" not in said.err
    assert said.out.count("triangulate ->") == 2


def test_permission_is_not_answered_with_space():
    assert "permission" in refusal_of(PermissionError(13, "Permission denied", "x")).do
    assert "space" in refusal_of(OSError(28, "No space left on device", "x")).do


def test_a_time_that_is_none(tmp_path, capsys):
    with pytest.raises(SystemExit):
        main(["animate", str(tmp_path), "--start", "nan"])
    with pytest.raises(SystemExit):
        main(["run", str(tmp_path), "--jobs", "two"])
    assert "a number from 0 to 1024" in capsys.readouterr().err


def test_an_unreadable_settings_file_is_not_called_badly_encoded(tmp_path, monkeypatch):
    (tmp_path / "recording.toml").write_text(recording_toml())

    def closed(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "read_text", closed)
    with pytest.raises(InputError, match="permissions"):
        read_recording(tmp_path)


@pytest.mark.parametrize(
    "address",
    [
        "nonsense",
        "tls:",
        "inproc:",
        "inproc://x",
        "tcp://10.255.255.1:8786",
        "tcp://127.0.0.1:9",
        "",
        "http://127.0.0.1:80",
    ],
)
def test_an_address_where_no_scheduler_is(address, monkeypatch, capfd):
    pytest.importorskip("distributed")
    monkeypatch.setattr("ovines.pipeline.series.cluster.PATIENCE_S", 0.5)
    from ovines.pipeline.series.cluster import run_on_cluster

    with pytest.raises(InputError, match="a running Dask scheduler"):
        run_on_cluster([], None, False, False, address, False)
    assert "ignored" not in capfd.readouterr().err


def test_a_wall_behind_the_camera_is_refused():
    """inner_radius_m = 50 for 50 mm, where no layout contradicts it."""
    from vision.walls.rims import _Picture

    picture = _Picture(np.zeros((688, 4096), np.uint8), two_cameras()[0], (0, 1192))
    assert len(picture.curve(np.array([0.0, 0.0, 0.0, 0.05])).uv) > 50
    with pytest.raises(InputError, match="inner_radius_m"):
        picture.curve(np.array([0.0, 0.0, 0.0, 50.0]))


def test_the_viewer_is_found_beside_python_and_needs_a_screen(monkeypatch):
    from ovines.commands.results.view import _ready_to_show

    monkeypatch.setenv("PATH", "/nowhere")
    monkeypatch.setenv("DISPLAY", ":0")
    _ready_to_show()
    assert os.environ["PATH"].split(os.pathsep)[0] == str(Path(sys.executable).parent)
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    with pytest.raises(InputError, match="--save FILE.rrd"):
        _ready_to_show()


def test_points_without_a_row_far_off_and_a_table_of_times(tmp_path):
    """Frame numbers may jump as far as a camera may stop."""
    from ovines.tables import checked, widest_span

    def motion(last: int) -> pd.DataFrame:
        frame = bouncing_motion(3, 800.0)
        return frame.assign(frame=[0, 1, last], time_s=[0.0, 1 / 800, last / 800])

    assert len(checked(motion(widest_span(3)), "motion")) == 3
    with pytest.raises(InputError, match="frame 1 is followed by"):
        checked(motion(widest_span(3) + 1), "motion")


def test_names_for_pictures_without_a_disc(tmp_path, capsys):
    folder = with_frames(tmp_path / "run")
    for camera in ("VW1", "VW2"):
        for path in (folder / camera).iterdir():
            cv2.imwrite(str(path), np.full((30, 40), 128, np.uint8))
    rows = [f"{camera},N{n},20,15" for camera in ("VW1", "VW2") for n in range(1, 6)]
    (tmp_path / "names.csv").write_text("camera,marker,u_px,v_px\n" + "\n".join(rows))
    asked = ["track", str(folder), "--names", str(tmp_path / "names.csv"), "--out", str(tmp_path / "out")]
    assert main(asked) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and "found:" in said


def test_a_checkerboard_for_a_film_is_refused_soon(tmp_path, capsys):
    """Every corner of it was a candidate for a disc: 31 s for pictures of 448 x 344."""
    folder = with_frames(tmp_path / "run")
    board = (255 * np.kron(np.indices((8, 10)).sum(0) % 2, np.ones((43, 45))))[:344, :448].astype(np.uint8)
    for path in folder.glob("VW*/*.png"):
        cv2.imwrite(str(path), board)
    path = folder / "recording.toml"
    path.write_text(path.read_text().replace("40, 30", "448, 344"))
    began = time.process_time()
    assert main(["track", str(folder)]) == 2
    assert "no marker was found" in capsys.readouterr().err and time.process_time() - began < 15
