"""Whose a file of a results folder is: only what ovines wrote, and nobody changed since, is replaced or removed.

A table carries its provenance and a hash of its values, `calibration.json` and a report the same as text, other pages
and figures the name of the program that made them.  ``source.json`` says whose results a folder holds.  Whatever else
stands under a name that is about to be written is the user's, and refused by name.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.io.hashing import hash_inputs
from ovines.io.provenance import sha256_of
from ovines.pipeline.stages import STAGES, location, read_stored
from ovines.recording import FILE, Recording
from ovines.tables import is_as_written

Whose = Literal["ours", "changed", "foreign"]
SOURCE = "source.json"  # in a results folder: where its recording or series lies, for `ovines report DIR`
FIGURES = "figures"
GENERATOR = b'<meta name="generator" content="ovines">'  # analysis/report/page.html.j2
FIGURE_MARKS = {".svg": b"<dc:title>ovines", ".pdf": b"/Creator (ovines)"}  # analysis/figures/style.py
STAGE_FILES = tuple(name for one in STAGES for name in one.writes)
# Films, pictures and viewer files say so too: analysis/view/film.py, analysis/figures/part_one.py; the viewer's own
# header names the application.
MARKS = {**FIGURE_MARKS, ".gif": b"ovines film", ".mp4": b"freeovines", ".png": b"Software\0ovines", ".rrd": b"ovines",
         ".log": b"ovines log", ".toml": b"# law written by ovines"}  # fmt: skip
HEAD_BYTES = 65536  # a page's and an SVG file's own description stands in its first lines


def whose(path: Path) -> Whose:
    """Who wrote the file ``path``; an empty file holds nothing of anybody's and counts as ours."""
    try:
        if path.is_symlink() or path.stat().st_size == 0:
            return "ours"  # a link is replaced, what it points at stays
        if path.suffix == ".parquet":
            return {None: "foreign", True: "ours", False: "changed"}[is_as_written(path)]  # type: ignore[return-value]
        if path.suffix in MARKS:
            return "ours" if _holds(path, MARKS[path.suffix]) else "foreign"
        stored = read_stored(path)
        if stored is not None:
            return "ours" if stored.as_written else "changed"
        with open(path, "rb") as handle:
            return "ours" if path.suffix == ".html" and GENERATOR in handle.read(HEAD_BYTES) else "foreign"
    except OSError:
        return "foreign"


def refuse_theirs(out: Path, names: Iterable[str], figures: bool = False) -> None:
    """`InputError` for the first of the files ``names`` of ``out`` that is not ours to replace; with ``figures`` also
    for any figure.
    """
    drawn = sorted(path for ending in FIGURE_MARKS for path in (out / FIGURES).glob(f"*{ending}")) if figures else []
    for path in (*(out / name for name in names), *drawn):
        if not (path.is_symlink() or path.exists()):
            continue
        who = "foreign" if path.is_dir() else whose(path)
        if who == "changed":
            raise _changed(path)
        if who == "foreign":
            raise InputError(
                f"{path} is there, and ovines did not write it",
                "a folder for results, in which only results are replaced",
                "move that file away, or name another --out",
            )


def _holds(path: Path, mark: bytes) -> bool:
    """Whether ``mark`` stands at either end of a file, where programs write who they are; a figure is read whole."""
    with open(path, "rb") as handle:
        if path.suffix in FIGURE_MARKS:
            return mark in handle.read()
        head = handle.read(HEAD_BYTES)
        handle.seek(max(0, path.stat().st_size - HEAD_BYTES))
        return mark in head or mark in handle.read()


def refuse_to_replace(path: Path, option: str, text: str | None = None, force: bool = False) -> None:
    """`InputError` where the file ``path``, named by ``option``, is there and not ours; one that holds ``text`` already
    may stay.
    """
    if force or not (path.is_symlink() or path.exists()):
        return
    if path.is_dir():
        raise InputError(f"{option} {path} is a folder", "a file's name", f"name a file in {option}")
    if text is None and whose(path) == "ours":
        return
    if text is not None and path.read_bytes() in (b"", text.encode()):
        return
    raise InputError(
        f"{option} {path} is there already", "a new file, or one that ovines wrote", f"name another in {option}, or "
        f"move that file away",
    )  # fmt: skip


def refuse_changed(out: Path, names: Iterable[str]) -> None:
    """`InputError` for the first of the results ``names`` in ``out`` that was changed by hand: what is made from it
    would not say so.
    """
    for name in names:
        if (out / name).is_file() and whose(out / name) == "changed":
            raise _changed(out / name)


def _changed(path: Path) -> InputError:
    return InputError(
        f"{path} was changed after ovines had written it",
        "results as they were written",
        f"remove it to have it made again; or put it beside a {FILE} of its own to go on from it",
    )


def refuse_folder(out: Path) -> None:
    """`InputError` where ``out`` is a recording itself: its tables are measurements, not results."""
    if (out / FILE).exists():
        raise InputError(
            f"--out {out} is a recording's own folder (it holds {FILE})",
            "a folder for results",
            "leave --out away, or name another",
        )


def ours_to_remove(path: Path) -> bool:
    """Whether a file is one that ovines wrote and nobody changed since."""
    return path.is_file() and whose(path) == "ours"


def refuse_strange_results(results: Path, recording: Recording) -> None:
    """`InputError` where ``results`` are another recording's, or were changed by hand: for commands that read them."""
    refuse_other_source(results, recording.folder, recording)
    refuse_changed(results, STAGE_FILES)


def refuse_other_source(out: Path, owner: Path, recording: Recording | None = None) -> None:
    """`InputError` where ``source.json`` in ``out`` names another recording or series than ``owner``.

    A copy of a recording is the same recording: where the place differs, ``recording``'s content decides.
    """
    path = out / SOURCE
    if not path.exists():
        return
    source = read_source(out)
    named = source.get("recording", source.get("series"))
    if not isinstance(named, str):
        raise InputError(
            f"{path} does not say whose results these are",
            '{"recording": "path"}',
            "move that file away, or name another --out",
        )
    if (out / named).resolve() == owner.resolve():
        return
    if recording is None or "content" not in source or source["content"] != content_of(recording):
        raise InputError(
            f"{out} holds the results of {os.path.normpath(out / named)}",
            f"a folder for the results of {owner} alone",
            "name another folder, or remove that one",
        )


def read_source(out: Path) -> dict[str, Any]:
    """What ``source.json`` says; {} where it says nothing that can be read."""
    try:
        content = json.loads((out / SOURCE).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return content if isinstance(content, dict) else {}


def content_of(recording: Recording) -> str:
    """Hash of recording.toml and of the files by which the recording enters the chain."""
    entry = recording.entry()
    artifact = (
        "frames"
        if entry == "frames"
        else "points.parquet or motion.parquet"
        if entry == "motion"
        else f"{entry}.parquet"
    )
    files = [path for path in location(artifact, recording, recording.folder) if path.is_file()]
    entered = hash_inputs({entry: files}, recording.folder)[entry] if files else ""
    return hashlib.sha256(f"{sha256_of(recording.folder / FILE)}:{entered}".encode()).hexdigest()


def write_source(
    out: Path, owner: Path, kind: Literal["recording", "series"], recording: Recording | None = None
) -> None:
    """``source.json``: the way from the results to what they were made from, and the content of ``recording`` where it
    is given.
    """
    source: dict[str, str] = {kind: os.path.relpath(owner.resolve(), out.resolve())}
    if recording is not None:
        source["content"] = content_of(recording)
    text = json.dumps(source) + "\n"
    path = out / SOURCE
    if not path.is_file() or path.read_text(encoding="utf-8") != text:
        write_text_whole(text, path)
