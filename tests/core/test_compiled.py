"""Compiled code on disk is tied to all sources of the core."""

import ast
import re
from pathlib import Path

import pytest
from numba.core import errors

from analysis.blind.plant.dynamics import _run
from ovines.core.compiled import STAMP, compiled, source_stamp, stamp_above
from ovines.core.engine import run

ROOT = Path(__file__).resolve().parents[2]


def test_the_stamp_changes_with_any_compiled_file(tmp_path):
    (tmp_path / "engine.py").write_text("from ovines.core.compiled import compiled\n")
    (tmp_path / "integration").mkdir()
    (tmp_path / "integration" / "dop853.py").write_text("y = 1\n")
    (tmp_path / "named.py").write_text("z = 1\n")
    before = source_stamp(tmp_path)
    (tmp_path / "named.py").write_text("z = 2\n")
    assert source_stamp(tmp_path) == before  # nothing compiled in it
    (tmp_path / "integration" / "dop853.py").write_text("y = 2\n")
    assert source_stamp(tmp_path) != before  # in a room too


def test_no_message_of_numbas_is_coloured_while_it_compiles():
    """numba asks once, while it is loaded: whatever of ours loads it has answered by then."""
    assert errors.termcolor().errmsg("words") == "words"


def test_a_package_above_has_a_stamp_of_its_own_compiled_files(tmp_path):
    folder = tmp_path / "vision"
    folder.mkdir()
    (folder / "kernel.py").write_text("from vision.compiled import compiled\n")
    (folder / "plain.py").write_text("z = 1\n")
    before = stamp_above(folder)
    (folder / "plain.py").write_text("z = 2\n")
    assert stamp_above(folder) == before
    (folder / "kernel.py").write_text("from vision.compiled import compiled  # changed\n")
    assert stamp_above(folder) != before


def test_a_file_whose_fields_are_compiled_in_belongs_to_the_stamp(tmp_path):
    state = tmp_path / "state.py"
    state.write_text("class P(NamedTuple):\n    a: float\n    b: float\n")
    before, without = stamp_above(tmp_path, ("state.py",)), stamp_above(tmp_path)
    state.write_text("class P(NamedTuple):\n    b: float\n    a: float\n")
    assert stamp_above(tmp_path, ("state.py",)) != before and stamp_above(tmp_path) == without


def test_the_plant_is_kept_under_a_stamp_that_knows_its_parameters():
    folder = ROOT / "analysis" / "blind" / "plant"
    constants = (*(f"parameters/{name}.py" for name in ("__init__", "of_flight", "of_wall")), "state.py")
    assert _run._cache._cache_file._source_stamp == stamp_above(folder, constants) != stamp_above(folder)


def test_the_engine_is_kept_under_the_stamp():
    assert run._cache._cache_file._source_stamp == STAMP
    assert compiled(lambda x: x + 1)(2) == 3


@pytest.mark.parametrize("package", ["ovines", "vision", "analysis"])
def test_nothing_is_compiled_without_the_stamp(package):
    """numba's own cache would go on running a changed callee's old code."""
    bare = [
        path
        for path in (ROOT / package).rglob("*.py")
        if re.search(r"^@(numba\.)?njit", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert bare == []


def _inlined(tree):
    return {
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and "inlined" in map(ast.unparse, node.decorator_list)
    }


@pytest.mark.further
def test_python_calls_nothing_that_is_inlined():
    """What is inlined is not kept on the disk: Python would compile it anew in every process, seconds each time."""
    sources = {
        path: path.read_text(encoding="utf-8")
        for package in ("ovines", "vision", "analysis")
        for path in (ROOT / package).rglob("*.py")
    }
    inlined = {
        ".".join(path.relative_to(ROOT).with_suffix("").parts): _inlined(ast.parse(source))
        for path, source in sources.items()
        if "inlined" in source
    }
    trees = {
        path: ast.parse(source)
        for path, source in sources.items()
        if "inlined" in source
        or not inlined.keys().isdisjoint(re.findall(r"^\s*from (\S+) import", source, re.MULTILINE))
    }
    assert "base_motion" in inlined["ovines.core.system.host"]
    slow = []
    for path, tree in trees.items():
        here = _inlined(tree) | {
            alias.asname or alias.name
            for node in ast.walk(tree)
            if isinstance(node, ast.ImportFrom)
            for alias in node.names
            if alias.name in inlined.get(node.module, ())
        }
        for node in tree.body:
            compiled_itself = isinstance(node, ast.FunctionDef) and (
                node.decorator_list or f"compiled({node.name})" in sources[path]
            )
            slow += [
                f"{path.relative_to(ROOT)}: {call.func.id}"
                for call in ast.walk(node)
                if not compiled_itself
                and isinstance(call, ast.Call)
                and isinstance(call.func, ast.Name)
                and call.func.id in here
            ]
    assert slow == []
