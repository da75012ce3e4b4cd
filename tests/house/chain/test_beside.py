"""Texts that a copy of the process makes beside it, and those that two share."""

from __future__ import annotations

import os
import sys
import time

import pytest

import ovines.workers.beside
from ovines.workers.beside import made_beside, made_by_two

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


def test_two_processes_share_works_and_the_texts_keep_their_order():
    def work(number: int) -> str:
        time.sleep(0.05)  # the other one is at its first meanwhile
        return f"{number} {os.getpid()}"

    texts = made_by_two([lambda number=number: work(number) for number in range(8)])
    assert [int(text.split()[0]) for text in texts] == list(range(8))
    assert len({text.split()[1] for text in texts}) == 2


def test_what_fails_in_the_copy_fails_here_with_its_own_error():
    here = os.getpid()

    def fails_in_the_copy(number: int) -> str:
        time.sleep(0.05)
        if os.getpid() != here:
            raise ValueError
        return str(number)

    assert made_by_two([lambda n=n: fails_in_the_copy(n) for n in range(6)]) == list("012345")
    with pytest.raises(ZeroDivisionError):
        made_by_two([lambda: "text", lambda: str(1 // 0), lambda: "text"])


def test_a_copy_makes_no_copies():
    def pids() -> str:
        def pid() -> str:
            time.sleep(0.02)
            return str(os.getpid())

        return " ".join(made_by_two([pid] * 4))

    with made_beside(pids) as made:
        text = made()
    assert text is not None and len(set(text.split())) == 1


def test_with_one_processor_all_is_made_here(monkeypatch):
    monkeypatch.setattr(ovines.workers.beside.os, "cpu_count", lambda: 1)
    monkeypatch.setattr(ovines.workers.beside.os, "fork", None)
    assert made_by_two([lambda: "a", lambda: "b"]) == ["a", "b"]
