"""Compiled code on disk is tied to all sources of the core."""

from ovines.core.compiled import STAMP, compiled, source_stamp
from ovines.core.engine import run


def test_the_stamp_changes_with_any_compiled_file(tmp_path):
    (tmp_path / "engine.py").write_text("from ovines.core.compiled import compiled\n")
    (tmp_path / "dop853.py").write_text("y = 1\n")
    (tmp_path / "named.py").write_text("z = 1\n")
    before = source_stamp(tmp_path)
    (tmp_path / "named.py").write_text("z = 2\n")
    assert source_stamp(tmp_path) == before  # nothing compiled in it
    (tmp_path / "dop853.py").write_text("y = 2\n")
    assert source_stamp(tmp_path) != before


def test_the_engine_is_kept_under_the_stamp():
    assert run._cache._cache_file._source_stamp == STAMP
    assert compiled(lambda x: x + 1)(2) == 3
