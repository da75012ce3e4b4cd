"""Command lines by grammar: every command with its own options, values that fit and values that cannot.

The quick version runs with the other tests; ``pytest -m long tests/house/damage/test_fuzz_commands.py -s`` tries 2,000
and prints the figures of docs/validation/reliability.md.
"""

from __future__ import annotations

import argparse
import contextlib
import io
import os
import shutil
import signal
import time
from collections import Counter
from pathlib import Path

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from ovines.__main__ import build, command_names, main
from tests.conftest import write_small_recording

QUICK, LONG = 40, 2000
SLOWEST_S = 60.0  # of processor time: the budget that no command exceeds without --yes
PLACES = (
    *("run", "day", "results", "empty", "missing", "run/recording.toml", "run/tracks.parquet", "note.txt", "/proc/x"),
    *("", "x" * 300, "ä\n", "run/..", "-", "table-3", "VW1=note.txt", "motion.gif", "results/points.parquet"),
)
NUMBERS = ("0", "1", "2", "-1", "nan", "inf", "-inf", "1e400", "9" * 30, "0x10", "1_0", "³", "", "x", "0.5", "1e-300")
WORDS = (
    "motion",
    "restitution",
    "mm,deg",
    "tcp://127.0.0.1:9",
    "nonsense",
    "x,-z,y",
    "N1,N2",
    "charuco_5x7_8mm",
    "a/b",
    "",
)
# --yes asks for what costs too much, --completion and --help print what the parser holds
LEFT_OUT = ("--yes", "--help", "--completion")


def parsers(parser: argparse.ArgumentParser) -> list[tuple[tuple[str, ...], argparse.ArgumentParser]]:
    """Every command and step (``blind make``) with its parser."""
    found = []
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for name, inner in action.choices.items():
                deeper = parsers(inner)
                found += [((name, *words), one) for words, one in deeper] or [((name,), inner)]
    return found


COMMANDS = parsers(build(command_names()))


def values_of(action: argparse.Action) -> st.SearchStrategy[list[str]]:
    """Values for one argument: mostly of its own kind."""
    if action.nargs == 0:
        return st.just([])
    kinds = [st.sampled_from(tuple(map(str, action.choices)))] if action.choices else []
    kinds += [st.sampled_from(PLACES if action.type is Path or not action.option_strings else WORDS + NUMBERS)]
    count = action.nargs if isinstance(action.nargs, int) else 1
    several = st.integers(0, 3) if action.nargs in ("*", "+", "?") else st.just(count)
    return several.flatmap(lambda n: st.lists(st.one_of(*kinds), min_size=n, max_size=n))


@st.composite
def command_lines(draw: st.DrawFn) -> list[str]:
    words, parser = draw(st.sampled_from(COMMANDS))
    line = list(words)
    for action in parser._actions:
        if set(action.option_strings) & set(LEFT_OUT):
            continue
        if not action.option_strings:
            line += draw(values_of(action))
        elif action.dest in ("cases", "runs") and words[0] == "blind":  # twelve runs of eighty are usual
            line += [action.option_strings[0], draw(st.sampled_from(("1", *NUMBERS)))]
        elif action.required or draw(st.integers(0, 3)) == 0:
            line += [draw(st.sampled_from(action.option_strings)), *draw(values_of(action))]
    return line


def _hangs(*_: object) -> None:
    raise RuntimeError("no end")


def attack(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int) -> Counter[str]:
    """Try ``count`` command lines on a recording of three frames; how each ended, and the slowest [ms]."""
    place = tmp_path / "inside"
    write_small_recording(place / "run", frames=3)
    shutil.copytree(place / "run", place / "day" / "run-1")
    (place / "empty").mkdir()
    (place / "note.txt").write_text("note")
    monkeypatch.chdir(place)
    monkeypatch.setattr("ovines.pipeline.series.cluster.PATIENCE_S", 0.1)
    assert main(["triangulate", "run", "--out", "results"]) == 0
    ended: Counter[str] = Counter()
    before = signal.signal(signal.SIGALRM, _hangs)

    @settings(
        max_examples=count, deadline=None, database=None, derandomize=True, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(command_lines())
    def try_one(line: list[str]) -> None:
        said, began = io.StringIO(), time.process_time()
        signal.alarm(120)
        try:
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(said):
                status = main(line)
        except SystemExit as end:
            status = end.code
        finally:
            signal.alarm(0)
            os.chdir(place)
        assert status in (0, 2), (line, said.getvalue())
        assert status == 0 or "found:" in said.getvalue() or "error:" in said.getvalue(), (line, said.getvalue())
        assert "Traceback" not in said.getvalue(), (line, said.getvalue())
        ended["done" if status == 0 else "refused"] += 1
        ended["slowest_ms"] = max(ended["slowest_ms"], round(1e3 * (time.process_time() - began)))

    try:
        try_one()
    finally:
        signal.signal(signal.SIGALRM, before)
    assert ended["slowest_ms"] < 1e3 * SLOWEST_S
    assert [path.name for path in tmp_path.iterdir()] == ["inside"], "something was written outside"
    return ended


def test_some_command_lines(tmp_path, monkeypatch):
    ended = attack(tmp_path, monkeypatch, QUICK)
    assert ended["refused"] and ended["done"] + ended["refused"] >= QUICK


@pytest.mark.long
def test_many_command_lines(tmp_path, monkeypatch):
    ended = attack(tmp_path, monkeypatch, LONG)
    print(f"\n| command lines | {ended['done'] + ended['refused']} | {ended['done']} | {ended['refused']} | "
          f"{ended['slowest_ms']} ms |")  # fmt: skip
    assert ended["done"] and ended["refused"]
