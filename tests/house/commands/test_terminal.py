"""What the terminal, the log and the pages say of a run: verdict, what was read, how long, when and by what."""

import re
import shutil
import subprocess

import pytest

import ovines.io.provenance
from analysis.report.page import Page, pages_beside, source_of
from ovines.__main__ import main
from ovines.io.run_log import HEAD, LOG, bars_disabled, on_terminal
from ovines.pipeline.series.written_diagnosis import details
from tests.conftest import write_small_recording
from tests.house.commands.test_commands import change_toml

STAMP = re.compile(r"^\d{4}-\d\d-\d\d \d\d:\d\d:\d\d  ")


@pytest.fixture
def recording(tmp_path):
    return write_small_recording(tmp_path / "day" / "run-1", frames=30).folder


def triangulated(recording, out, *options):
    return main(["triangulate", str(recording), "--out", str(out), *options])


def test_the_log_says_what_was_read_decided_and_how_long(recording, tmp_path):
    out = tmp_path / "results"
    assert triangulated(recording, out) == 0
    first = (out / LOG).read_text()
    assert first.startswith(HEAD) and all(STAMP.match(line) for line in first.splitlines()[1:])
    assert f"{recording}: run-1, enters at tracks, by ovines" in first
    assert "triangulate: runs, because there is no points.parquet" in first
    assert f"reads {recording / 'tracks.parquet'} (" in first and re.search(r"points.parquet after \d+\.\d s", first)
    assert triangulated(recording, out) == 0
    change_toml(recording, "frame_rate_hz = 800.0", "frame_rate_hz = 801.0")
    assert triangulated(recording, out) == 0
    change_toml(recording, "window_offset_px = [0, 900]", "window_offset_px = [0, 901]")
    assert triangulated(recording, out) == 0
    text = (out / LOG).read_text()
    assert text.startswith(first) and text.count("triangulate: up to date") == 2
    assert "runs, because its settings changed" in text


def test_the_log_says_how_a_run_failed(recording, tmp_path, monkeypatch):
    def broken(context):
        raise ValueError("a mistake of ours")

    monkeypatch.setattr("ovines.pipeline.functions.triangulate", broken)
    assert triangulated(recording, tmp_path / "results") == 1
    assert re.search(r"ended after \d+\.\d s: a mistake of ours", (tmp_path / "results" / LOG).read_text())


def test_a_log_of_the_user_is_kept(recording, tmp_path, capsys):
    mine = tmp_path / "results" / LOG
    mine.parent.mkdir()
    mine.write_text("sheep counted: 3\n")
    assert triangulated(recording, mine.parent) == 2
    assert mine.read_text() == "sheep counted: 3\n" and LOG in capsys.readouterr().err


def test_quiet_and_verbose(recording, tmp_path, capsys):
    assert triangulated(recording, tmp_path / "results", "--quiet") == 0
    said = capsys.readouterr()
    assert said.out == "" and said.err == ""
    assert triangulated(recording, tmp_path / "nowhere.parquet" / ".." / "results", "-v", "--force") == 0
    said = capsys.readouterr()
    assert "run-1: triangulate" in said.out and "runs, because of --force" in said.err
    assert triangulated(recording, tmp_path / "results") == 0
    assert capsys.readouterr().err == ""  # the next command in this process says no more than it should
    change_toml(recording, "mass_kg", "masse_kg")
    assert main(["check", str(recording), "--quiet"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and "masse_kg" in said.err
    (recording / "recording.toml").unlink()
    assert triangulated(recording, tmp_path / "results", "--quiet") == 2
    assert "found:" in capsys.readouterr().err
    with on_terminal(quiet=True, verbose=False):
        assert bars_disabled() is True
    assert bars_disabled() is None and bars_disabled(False) is True


def test_pages_say_when_from_what_and_by_which_commit(monkeypatch, tmp_path):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    monkeypatch.setattr(ovines.io.provenance, "commit", lambda: "abc123-changed")
    page = Page("t", "k", source="../day/<run>", links=[("Calibration", "calibration.html")])
    page.add_section("s", "s").add_table(
        ("test", "n"), [("run 1", "2"), ("run 2", "3")], links=("run%201/report.html", "")
    )
    text = page.render()
    assert "Made 2023-11-14 from ../day/&lt;run&gt; by ovines 0.1.0, commit abc123-changed." in text
    assert '<a href="calibration.html">Calibration</a>' in text
    assert '<td class="words"><a href="run%201/report.html">run 1</a></td>' in text and "run 2</a>" not in text
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert re.search(r"Made 20\d\d-\d\d-\d\d from", page.render())


def test_the_commit_is_that_of_our_checkout_only(tmp_path, monkeypatch):
    if shutil.which("git") is None:
        pytest.skip("no git")
    commit = ovines.io.provenance.commit
    commit.cache_clear()
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    (tmp_path / "site-packages").mkdir()
    monkeypatch.setattr(ovines.io.provenance, "ROOT", tmp_path / "site-packages")
    assert commit() is None  # installed somewhere below another checkout
    commit.cache_clear()
    monkeypatch.setattr(ovines.io.provenance, "ROOT", tmp_path)
    identity = ["-c", "user.name=a", "-c", "user.email=a@b"]
    subprocess.run(["git", "-C", tmp_path, *identity, "commit", "-q", "--allow-empty", "-m", "x"], check=True)
    head = subprocess.run(["git", "-C", tmp_path, "rev-parse", "HEAD"], check=True, capture_output=True, text=True)
    assert commit() and head.stdout.startswith(commit())
    commit.cache_clear()


def test_pages_lead_to_each_other(tmp_path):
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "gap.html").touch()
    assert pages_beside(tmp_path / "results", ("gap.html", "report.html")) == [
        ("Why simulator and experiment differ", "gap.html")
    ]
    assert source_of(tmp_path / "day" / "run-1", tmp_path / "results") == "../day/run-1"


def test_the_diagnosis_says_its_parameters_and_what_to_do():
    one = {
        "tilt_rad": {"value": 0.018721, "low": 0.01861, "high": 0.01882},
        "open": {"value": 1.0, "low": None, "high": None},
    }
    assert details({"parameters": {"table_tilt": one}, "next_test": "Level the table."}) == [
        "table_tilt tilt_rad = 0.01872 (90 %: 0.01861 to 0.01882)",
        "table_tilt open = 1.000 (90 %: –)",
        "Do: Level the table.",
    ]


@pytest.mark.parametrize("shell", ["bash", "zsh", "tcsh"])
def test_completion_knows_commands_and_options(shell, capsys):
    with pytest.raises(SystemExit) as end:
        main(["--completion", shell])
    script = capsys.readouterr().out
    assert end.value.code == 0
    assert "triangulate" in script and "cluster" in script


def test_bash_completes(capsys):
    if shutil.which("bash") is None:
        pytest.skip("no bash")
    with pytest.raises(SystemExit):
        main(["--completion", "bash"])
    script = capsys.readouterr().out
    function = re.search(r"complete .*-F (\w+) ovines", script)[1]
    asked = f"COMP_WORDS=(ovines tri); COMP_CWORD=1; {function} ovines tri ovines; echo ${{COMPREPLY[@]}}"
    answer = subprocess.run(["bash"], input=f"{script}\n{asked}\n", capture_output=True, text=True, check=True)
    assert answer.stdout.split() == ["triangulate"]
