"""Folders, names and disks that are not as one expects: links in circles, HTML in names, thousands of runs, no room."""

from __future__ import annotations

import os
import resource
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest

from ovines.__main__ import main
from ovines.errors import InputError
from ovines.recording import read_recording, series_folders
from ovines.tables import read_provenance
from tests.conftest import bouncing_motion, recording_toml, refused, write_small_recording
from tests.house.damage.test_degenerate import write_motion

EVIL = '<script>alert(1)</script><img src=x onerror="alert(2)">'
NAMES = ["run a b", "Läufe 3.5 g ö", "<script>alert(1)<x>", "-rf", "run\nline", "😀", "q'&amp;;", "[1-9]*?"]


class Tags(HTMLParser):
    """Every tag and attribute that a browser would see."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += [name for name, _ in attrs]


def no_markup_of_a_name(page: Path) -> None:
    seen = Tags()
    seen.feed(page.read_text(encoding="utf-8"))
    assert "script" not in seen.tags and not [name for name in seen.attributes if name.startswith("on")], page
    assert "alert(2)" in page.read_text(encoding="utf-8"), f"{page}: the name is not even there: the test shows nothing"


def test_links_in_circles(tmp_path, capsys):
    series = tmp_path / "series"
    good = write_small_recording(series / "good", frames=20).folder
    (series / "loop").symlink_to(series)
    (series / "dangling").symlink_to("nowhere")
    (good / "self").symlink_to(good)
    (series / "itself").symlink_to("itself")
    (series / "ring").mkdir()
    (series / "ring" / "recording.toml").symlink_to("recording.toml")
    (series / "empty").mkdir()
    assert [one.name for one in series_folders(series)] == ["good"]
    assert main(["triangulate", str(series), "--out", str(tmp_path / "out")]) == 0
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"good"}
    for command in ("run", "check", "diagnose"):
        assert main([command, str(series / "itself"), "--out", str(tmp_path / "o")]) == 2
    said = capsys.readouterr().err
    assert "Traceback" not in said and said.count("found:") == 3


def test_empty_folders(tmp_path, capsys):
    (tmp_path / "empty").mkdir()
    for command in ("run", "check", "diagnose", "compare", "report", "identify"):
        assert main([command, str(tmp_path / "empty")]) == 2, command
        assert "found:" in capsys.readouterr().err
    assert not list((tmp_path / "empty").iterdir())
    (tmp_path / "empty" / "recording.toml").touch()
    assert main(["run", str(tmp_path / "empty"), "--out", str(tmp_path / "out")]) == 2
    assert "no key 'format'" in capsys.readouterr().err


def test_names_of_every_kind(tmp_path, capsys):
    """Folders' names; each gives the table of the same recording under another name."""
    first = write_small_recording(tmp_path / "series" / "plain", frames=20).folder
    for name in NAMES:
        shutil.copytree(first, tmp_path / "series" / name)
    assert main(["triangulate", str(tmp_path / "series"), "--out", str(tmp_path / "out")]) == 0, capsys.readouterr().err
    tables = [tmp_path / "out" / name / "points.parquet" for name in ("plain", *NAMES)]
    assert len({path.read_bytes() for path in tables}) == 1
    assert {path.name for path in tmp_path.iterdir()} == {"series", "out"}


def test_a_path_that_is_no_utf8(tmp_path, ovines):
    folder = os.fsdecode(os.fsencode(tmp_path) + b"/run-\xff\xe4")
    try:
        shutil.copytree(write_small_recording(tmp_path / "run", frames=20).folder, folder)
    except OSError:
        pytest.skip("the file system takes no such name")
    refused(ovines("run", folder), "no UTF-8", "rename")
    assert not os.path.exists(folder + "/results")


@pytest.mark.usefixtures("unpainted")
def test_html_in_names_is_text_in_every_page(tmp_path, capsys):
    """Title of the recording and marker names are a user's; the pages show them and nothing more."""
    for name in ("a", "b"):
        folder = tmp_path / "series" / name
        write_motion(folder, bouncing_motion(200, 800.0))
        title = EVIL.replace("/", "\\u2215").replace('"', '\\"')  # a name holds no slash
        body = "[model]\nrestitution = 0.7\nwall_friction = 0.1\ntangential_restitution = 0.4\n"
        text = (folder / "recording.toml").read_text().replace("format = 1\n", f'format = 1\nname = "{title}"\n', 1)
        (folder / "recording.toml").write_text(text + body, encoding="utf-8")
    evil_series = tmp_path / EVIL.replace("/", "∕")
    (tmp_path / "series").rename(evil_series)
    out = tmp_path / "out"
    assert main(["run", str(evil_series), "--out", str(out)]) == 0, capsys.readouterr().err
    assert main(["compare", str(evil_series), "--out", str(out), "--runs", "2"]) == 0, capsys.readouterr().err
    assert main(["diagnose", str(evil_series), "--out", str(tmp_path / "gap")]) == 0, capsys.readouterr().err
    pages = sorted(tmp_path.glob("out/**/*.html")) + [tmp_path / "gap" / "gap.html"]
    assert {page.name for page in pages} == {"report.html", "compare.html", "gap.html"} and len(pages) == 6
    for page in pages:
        no_markup_of_a_name(page)


@pytest.mark.parametrize("name", ["../outside", "/etc/x", "a/b", "..", "a\\\\..\\\\b", "\\u0000"])
def test_no_name_leads_out_of_the_results_folder(name, tmp_path, ovines):
    """Names of recordings, cameras and markers end up in file names: none may be a path."""
    for key in ('name = "run"', 'name = "VW1"', '"N1"'):
        folder = tmp_path / "run"
        write_small_recording(folder, frames=20)
        text = recording_toml("run")
        assert key in text
        (folder / "recording.toml").write_text(
            text.replace(key, key.replace(key.split('"')[1], name)), encoding="utf-8"
        )
        with pytest.raises(InputError):
            read_recording(folder)


def test_results_through_a_link_stay_where_they_belong(tmp_path):
    """A link under the name of a result is replaced by the result; what it pointed at stays as it was."""
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "points.parquet").symlink_to(tmp_path / "precious")
    assert main(["triangulate", str(folder), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "precious").read_text() == "mine"
    assert not (tmp_path / "out" / "points.parquet").is_symlink()


@pytest.mark.others_further
@pytest.mark.parametrize("count", [12, pytest.param(3000, marks=pytest.mark.long)])
def test_many_recordings(count, tmp_path, capsys):
    """A series of many tiny runs, every tenth of them broken: each has its line, the rest its table."""
    folder = tmp_path / "series" / "r0000"
    write_small_recording(folder, frames=3)
    for number in range(1, count):
        copy = folder.with_name(f"r{number:04d}")
        copy.mkdir()
        os.link(folder / "tracks.parquet", copy / "tracks.parquet")
        text = recording_toml(copy.name)
        (copy / "recording.toml").write_text(text.replace("mass_kg", "masse_kg") if number % 10 == 0 else text)
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    status = main(["triangulate", str(tmp_path / "series"), "--out", str(tmp_path / "out")])
    assert status == 2 and (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb) / 1024 < 300
    said = capsys.readouterr()
    broken = (count - 1) // 10
    assert f"{broken} of {count} recordings did not come through" in said.err
    assert said.err.count("masse_kg") >= broken and said.out.count("triangulate ->") == count - broken
    assert len(list((tmp_path / "out").glob("*/points.parquet"))) == count - broken


def test_a_path_that_cannot_be(tmp_path, capsys):
    folder = write_small_recording(tmp_path / "run", frames=20).folder
    (tmp_path / "file").write_text("mine")
    long = tmp_path / ("x" * 300)
    for arguments in (
        ["run", folder, "--out", long],
        ["run", long],
        ["check", long],
        ["diagnose", long],
        ["report", long],
        ["simulate", long],
        ["run", folder, "--out", tmp_path / "file" / "x"],
        ["new", tmp_path / "file" / "x"],
        ["simulate", "rig", "--out", tmp_path / "file"],
        ["diagnose", folder, "--out", tmp_path / "file"],
        ["compare", folder, "--out", tmp_path / "file"],
        ["animate", folder, "--results", long],
    ):
        assert main([str(one) for one in arguments]) == 2, arguments
        said = capsys.readouterr()
        assert "found:" in said.err + said.out and "Traceback" not in said.err
    assert (tmp_path / "file").read_text() == "mine"


def whole(folder: Path) -> None:
    """Every table under its final name can be read, and no temporary file is left."""
    for path in folder.rglob("*"):
        assert ".unfinished" not in path.name, path
        if path.suffix == ".parquet":
            assert read_provenance(path) is not None, path


COMMANDS: dict[str, Callable[[Path, Path], list]] = {
    "new": lambda run, out: [out / "n"],
    "board": lambda run, out: ["charuco_5x7_8mm", "--out", out],
    "diagnose": lambda run, out: [run, "--out", out],
    "animate": lambda run, out: [run, "--out", out / "x.gif", "--slower", "3"],
    "run": lambda run, out: [run, "--out", out],
}


@pytest.mark.parametrize("command", COMMANDS)
def test_no_room_in_any_command(command, tmp_path, ovines):
    """A limit on the size of a file, as a full disk: three lines, nothing half written, and room again ends well."""
    run = tmp_path / "run"
    write_motion(run, bouncing_motion(200, 800.0))
    out = tmp_path / "out"
    limit = 300 if command != "run" else 20_000

    result = ovines(command, *COMMANDS[command](run, out), file_limit_bytes=limit)
    refused(result, "room and permission")
    whole(out)
