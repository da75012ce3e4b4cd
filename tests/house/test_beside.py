"""A text that a copy of the process makes beside it."""

from __future__ import annotations

import os
import sys
import time

import pytest

import ovines.workers.beside
from ovines.workers.beside import made_beside

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="processes are copied on Linux only")


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr(ovines.workers.beside.os, "cpu_count", lambda: 2)


def test_the_text_comes_from_another_process_whole():
    """Longer than what a pipe holds, and with what the process had loaded and made."""
    here = ["ä" * 1_000_000]
    with made_beside(lambda: f"{os.getpid()} {here[0]}") as made:
        text = made()
    number, _, rest = text.partition(" ")
    assert int(number) != os.getpid() and rest == here[0]


def test_work_that_fails_gives_nothing_and_nothing_of_it_is_seen(capfd):
    with made_beside(lambda: str(1 // 0)) as made:
        assert made() is None
    assert capfd.readouterr() == ("", "")


def test_the_copy_ends_with_the_block(tmp_path):
    def work() -> str:
        (tmp_path / "pid").write_text(str(os.getpid()))
        time.sleep(60)
        return ""

    with pytest.raises(KeyError), made_beside(work):
        while not ((tmp_path / "pid").exists() and (tmp_path / "pid").read_text()):
            time.sleep(0.01)
        raise KeyError
    with pytest.raises(ProcessLookupError):
        os.kill(int((tmp_path / "pid").read_text()), 0)


def test_with_one_processor_nothing_is_begun(monkeypatch):
    monkeypatch.setattr(ovines.workers.beside.os, "cpu_count", lambda: 1)
    monkeypatch.setattr(ovines.workers.beside.os, "fork", None)
    with made_beside(lambda: "text") as made:
        assert made() is None
