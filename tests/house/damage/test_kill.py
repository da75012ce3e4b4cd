"""Killed at any moment, out of room: nothing half written, the next run goes on and ends at the same bytes."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ovines.io.atomic_write import TEMPORARY_SUFFIX
from ovines.pipeline.runner import run_stages
from ovines.recording import read_recording
from ovines.tables import read_provenance
from tests.conftest import refused, write_small_recording
from tests.processes import started

COMMAND = "triangulate"


def result_bytes(out):
    return {path.name: path.read_bytes() for path in out.glob("*.parquet")}


def only_whole_files(out):
    """Whatever stands under its final name is readable; temporary names begin with a dot."""
    for path in out.glob("*"):
        if path.suffix == ".parquet":
            assert read_provenance(path) is not None, f"{path} is half written"
        assert not path.name.endswith(TEMPORARY_SUFFIX) or path.name.startswith(".")


def kill_at_random(folder, out, kills, rng, usual_s):
    """Start the command, kill it after a random part of its usual time, look, start again.

    A first run may have shared the machine with others: what ends sooner than usual says what usual is."""
    hit = 0
    for _ in range(kills):
        began = time.monotonic()
        process = started([COMMAND, str(folder), "--out", str(out), "--force"], [Path(os.devnull)] * 2)
        process.join(float(rng.uniform(0.1, 1.1)) * usual_s)
        if process.is_alive():
            process.kill()
            hit += 1
        else:
            usual_s = min(usual_s, time.monotonic() - began)
        process.join()
        if out.exists():
            only_whole_files(out)
    return hit


@pytest.mark.skipif(sys.platform == "win32", reason="no fork server")
@pytest.mark.parametrize("kills", [6, pytest.param(50, marks=pytest.mark.long)])
def test_killed_at_random_points(kills, tmp_path, ovines):
    """Of a process that has loaded all: each kill comes while it works, not while it starts."""
    folder = write_small_recording(tmp_path / "series" / "run-01").folder
    ovines("--version")  # starts the fork server
    began = time.monotonic()
    result = ovines(COMMAND, folder, "--out", tmp_path / "undisturbed")
    usual_s = time.monotonic() - began
    assert result.returncode == 0, result.stderr
    hit = kill_at_random(folder, tmp_path / "out", kills, np.random.default_rng(kills), usual_s)
    assert hit > 0, "no kill hit the running process"
    assert ovines(COMMAND, folder, "--out", tmp_path / "out").returncode == 0
    assert result_bytes(tmp_path / "out") == result_bytes(tmp_path / "undisturbed")
    assert not list((tmp_path / "out").glob(f".*{TEMPORARY_SUFFIX}"))


def test_killed_between_writing_and_renaming(small_recording, tmp_path, monkeypatch):
    """The worst moment, held on purpose: the temporary file is whole, its name not yet changed."""
    out = tmp_path / "out"
    pid = os.fork()
    if pid == 0:
        monkeypatch.setattr(os, "replace", lambda *_: os.kill(os.getpid(), signal.SIGKILL))
        run_stages(read_recording(small_recording.folder), out, only=COMMAND)
        os._exit(1)
    assert os.WIFSIGNALED(os.waitpid(pid, 0)[1])
    assert not (out / "points.parquet").exists() and list(out.glob(f".*{TEMPORARY_SUFFIX}"))
    done = run_stages(read_recording(small_recording.folder), out, only=COMMAND)
    assert done.stages == {"lens": "run", COMMAND: "run"} and not list(out.glob(f".*{TEMPORARY_SUFFIX}"))


def test_no_room_on_the_disk(small_recording, tmp_path, ovines):
    """A limit on the size of a file stops the write in the middle, as a full disk does."""
    out = tmp_path / "out"
    limit = 20_000

    result = ovines(COMMAND, small_recording.folder, "--out", out, file_limit_bytes=limit)
    refused(result, "room and permission")
    assert not (out / "points.parquet").exists() and not list(out.glob(f".*{TEMPORARY_SUFFIX}"))
    assert ovines(COMMAND, small_recording.folder, "--out", out).returncode == 0
    assert (out / "points.parquet").stat().st_size > limit


def test_a_full_disk(small_recording, tmp_path, ovines):
    """A file system of 48 kB; needs the right to mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=48k", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("may not mount a small file system")
    try:
        result = ovines(COMMAND, small_recording.folder, "--out", disk / "out")
        refused(result, "No space left")
        only_whole_files(disk / "out")
        assert not (disk / "out" / "points.parquet").exists()
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_no_permission(small_recording, tmp_path, ovines):
    if os.geteuid() == 0:
        pytest.skip("root may write anywhere")
    (tmp_path / "closed").mkdir(mode=0o500)
    refused(ovines(COMMAND, small_recording.folder, "--out", tmp_path / "closed" / "out"), "permission")
