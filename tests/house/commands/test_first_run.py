"""The first run compiles beside another process, says so, and keeps it out of the forecast."""

import io
import sys
import threading
import time
from pathlib import Path

import pytest
from filelock import FileLock
from tqdm import tqdm

import ovines.first_run
from ovines.__main__ import command, main
from ovines.core.compiled import compiler
from ovines.core.kernel import Kernel
from ovines.first_run import calls, compiling, signature
from ovines.io.run_log import COMPILED_ONCE, bars_disabled
from ovines.pipeline.one_recording import _Bar


def tiny(number: float):
    """A kernel that nothing of is on the disk."""

    @compiler(f"first run {number}")
    def add(x):
        return x + 1.0

    index = Path(add.index)
    for path in index.parent.glob(index.name.removesuffix(".nbi") + ".*"):
        path.unlink()
    return add


def test_it_says_that_it_compiles_and_how_long_that_took(monkeypatch):
    monkeypatch.setattr(ovines.first_run.os, "cpu_count", lambda: 1)  # no second process
    said, kernel = [], tiny(1)
    with compiling([], lambda text, seconds: said.append((text, seconds))):
        assert kernel(1.0) == 2.0
        assert [text for text, _ in said] == ["compiling, once", ""] and said[-1][1] > 0.0
        assert kernel(2.0) == 3.0
    again = compiler("first run 1")(kernel.py_func)
    with compiling([], lambda text, seconds: said.append((text, seconds))):
        assert again(1.0) == 2.0  # from the disk
    assert len(said) == 2


class Terminal(io.StringIO):
    """What takes itself for a terminal."""

    def isatty(self):
        return True


@pytest.mark.others_further
@pytest.mark.parametrize("options", [[], ["--quiet"], ["--verbose"]])
@pytest.mark.parametrize("name", ["identify", "diagnose", "compare", "plan", "simulate", "orbits"])
def test_every_command_says_once_that_it_compiles(name, options, monkeypatch):
    """Whatever the command does, by the kernels that it comes to; the bar that it shows goes on below."""
    kernels = [tiny(6), tiny(7)]

    def work(args):
        with tqdm(total=2, desc=name, disable=bars_disabled()):
            return round(sum(kernel(1.0) for kernel in kernels)) - 4

    monkeypatch.setattr(command(name), "run", work)
    monkeypatch.setattr(command(name), "add_arguments", lambda parser: None)
    monkeypatch.setattr("sys.stderr", Terminal())
    assert main([name, *options]) == 0
    said = sys.stderr.getvalue()
    listed = said.count("compiling, once per machine and version: tests.")
    assert listed == (2 if options == ["--verbose"] else 0)
    assert said.count(COMPILED_ONCE) == (0 if options else 1)
    main([name, *options])
    assert sys.stderr.getvalue().count("compiling") == said.count("compiling")  # nothing more


def test_what_another_process_compiles_is_waited_for(monkeypatch):
    monkeypatch.setattr(ovines.first_run.os, "cpu_count", lambda: 1)
    kernel, said = tiny(2), []
    result: list[float] = []
    with compiling([], lambda text, seconds: said.append(text)):
        worker = threading.Thread(target=lambda: result.append(kernel(1.0)))
        with FileLock(f"{kernel.index}.lock"):
            worker.start()
            until = time.monotonic() + 60.0
            while not said and time.monotonic() < until:
                time.sleep(0.01)
            assert said == ["compiling, once"] and not result
        worker.join(60.0)
    assert result == [2.0] and said[-1] == ""


def test_the_second_process_is_started_for_what_is_listed(monkeypatch):
    started, said = [], []
    monkeypatch.setattr(ovines.first_run.os, "cpu_count", lambda: 2)
    monkeypatch.setattr(ovines.first_run._FirstRun, "_start", lambda self: started.append(self._stages))
    kernel = tiny(3)
    with compiling(["identify"], lambda text, seconds: said.append(text)):
        kernel(1.0)
    assert started == [["identify"]] and said[0] == f"compiling, once: 0 of {len(calls(['identify']))} kernels"


def test_the_second_process_does_not_wait_for_itself(monkeypatch, capsys):
    """It holds a kernel's lock while it compiles; the usual guard would take that once more."""
    kernel = tiny(5)
    monkeypatch.setattr(ovines.first_run, "calls", lambda stages: [(kernel, (1.0,))])
    monkeypatch.setattr(ovines.first_run, "die_with", lambda parent: None)
    monkeypatch.setattr(Kernel, "guard", Kernel.guard)
    worker = threading.Thread(target=ovines.first_run.compile_beside, args=(0, []), daemon=True)
    worker.start()
    worker.join(60.0)
    assert not worker.is_alive()
    assert "add" in capsys.readouterr().out


def test_every_listed_call_has_all_arguments():
    for kernel, arguments in calls(["calibrate", "track", "identify"]):
        code = kernel.py_func.__code__
        assert len(signature(kernel, arguments)) == code.co_argcount, kernel


def test_the_forecast_leaves_compiling_out():
    with _Bar("recording", False) as bar:
        bar.compiles("compiling, once", 0.0)  # no stage yet, no terminal: nothing to show
    with _Bar("recording", True) as bar:
        progress = bar.stage("track")
        bar._bar = shown = tqdm(file=io.StringIO(), disable=False)
        progress(1, 10)
        before = shown.format_dict["elapsed"]
        bar.compiles("compiling, once: 1 of 4 kernels", 0.0)
        assert shown.postfix == "compiling, once: 1 of 4 kernels"
        bar.compiles("", 100.0)
        assert shown.format_dict["elapsed"] < before - 50.0 and shown.postfix == ""
