"""A command as a process of its own that need not load Python and the libraries again.

A server loads them once and forks for each command: two seconds less each time.  The command has its own memory,
working directory, streams and exit status, as started from a shell.  What depends on how Python starts (options,
variables that a library reads when it is loaded) wants `fresh` processes.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing.process import BaseProcess
from pathlib import Path

# What commands load; nothing here starts a thread when it is loaded.
LOADED = (
    "ovines.__main__",
    "ovines.commands.chain.run",
    "ovines.pipeline.functions",
    "ovines.pipeline.series.recordings",
    "ovines.first_run",
    "joblib",
    "vision.calibrate",
    "vision.track",
    "vision.triangulate",
    "analysis.identify",
    "analysis.checks.recording",
    "analysis.report.page",
    "analysis.report.pages.recording_report",
    "scipy.signal",
    "vision.lens.estimate",
)


def fresh(
    command: Sequence[str], timeout_s: float, cwd: Path | None, env: dict[str, str], file_limit_bytes: int | None = None
) -> subprocess.CompletedProcess[str]:
    """`python -m ovines` in a new interpreter; ``file_limit_bytes``: no file may grow larger."""
    # What is imported first under a limit would be kept as a file that breaks off, and no later process could import
    # it.
    kept = {} if file_limit_bytes is None else {"PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(
        [sys.executable, "-m", "ovines", *command],
        capture_output=True,
        text=True,
        timeout=timeout_s,
        cwd=cwd,
        env={**os.environ, **kept, **env},
        check=False,
        preexec_fn=None if file_limit_bytes is None else lambda: _limit(file_limit_bytes),
    )


def started(
    command: Sequence[str], said: Sequence[Path], cwd: Path | None = None, file_limit_bytes: int | None = None
) -> BaseProcess:
    """The same from a process in which all is loaded, on its way; ``said``: files of what it prints and complains."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(LOADED))
    process = context.Process(
        target=_run, args=(list(command), str(cwd or Path.cwd()), dict(os.environ), list(said), file_limit_bytes)
    )
    process.start()
    return process


def forked(
    command: Sequence[str], timeout_s: float, cwd: Path | None, file_limit_bytes: int | None = None
) -> subprocess.CompletedProcess[str]:
    """:func:`started`, and at its end."""
    with tempfile.TemporaryDirectory() as folder:
        said = [Path(folder) / name for name in ("stdout", "stderr")]
        process = started(command, said, cwd, file_limit_bytes)
        process.join(timeout_s)
        if process.is_alive():
            process.kill()
            process.join()
            raise subprocess.TimeoutExpired(list(command), timeout_s)
        out, err = (path.read_text(encoding="utf-8") if path.exists() else "" for path in said)
    assert process.exitcode is not None
    return subprocess.CompletedProcess(list(command), process.exitcode, out, err)


def _run(command: list[str], cwd: str, environment: dict[str, str], said: list[Path], limit: int | None) -> None:
    """In the forked process: what `python -m ovines` would do."""
    for number, path in enumerate(said, start=1):
        file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o600)
        os.dup2(file, number)
        os.close(file)
    sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115  to the process's end
    sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(cwd)
    sys.argv = ["ovines", *command]
    if limit is not None:
        _limit(limit)
        sys.dont_write_bytecode = True  # see `fresh`
    alone()
    sys.exit(importlib.import_module("ovines.__main__").main())


def alone() -> None:
    """No second process compiles beside a run: it would be killed at the end of each, what it was at would be compiled
    anew, and the other test process has the second processor.  Its own tests are in test_first_run.  And nothing waits
    for the disk: what tests write need not outlast a loss of power.
    """
    os.fsync = lambda file: None
    importlib.import_module("ovines.first_run")._FirstRun._start = lambda first_run: None


def dies_once(folder: Path, *arguments: object) -> object:
    """`run_one` that is killed at its first recording `run-02`; here, so that a worker loads no tests for it."""
    from ovines.pipeline.one_recording import run_one

    mark = Path(os.environ["OVINES_TEST_MARK"])
    if folder.name == "run-02" and not mark.exists():
        mark.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return run_one(folder, *arguments)


def _limit(file_bytes: int) -> None:
    import resource  # not on Windows

    resource.setrlimit(resource.RLIMIT_FSIZE, (file_bytes, file_bytes))
