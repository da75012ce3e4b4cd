"""Many recordings: one after another or in parallel; one that fails does not cost the others."""

from __future__ import annotations

import errno
import os
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

from tqdm import tqdm

from ovines.errors import InputError
from ovines.recording import read_recording, series_folders
from ovines.running import Progress, locked, run_stages
from ovines.system_library import missing_library

Status = Literal["done", "refused", "failed"]


@dataclass(frozen=True)
class Outcome:
    """How one recording ended: ``refused`` for wrong input, ``failed`` for a mistake of the program."""

    folder: Path
    out: Path
    status: Status
    stages: dict[str, str] = field(default_factory=dict)
    message: str = ""
    notes: list[str] = field(default_factory=list)


def run_series(
    folder: Path, out: Path, only: str | None = None, force: bool = False, jobs: int = 1, bars: bool = True
) -> list[Outcome]:
    """Run the recording or every recording of the series ``folder``; results in ``out`` or its subfolders.

    A recording's results go into ``out`` itself, those of a series into ``out / name of the recording's folder``,
    with a page over all of them in ``out``.  With ``jobs`` > 1 recordings run in as many processes; the results
    are the same bytes.
    """
    folders = series_folders(folder)
    single = is_recording(folder)
    tasks = [(one, out if single else out / one.name) for one in folders]
    if jobs == 1 or len(tasks) == 1:
        outcomes = [run_one(one, target, only, force, bars) for one, target in tasks]
    else:
        outcomes = _in_processes(tasks, only, force, jobs, bars)
    if not single and only in (None, "report"):
        outcomes += _series_report(folder, out, outcomes)
    return outcomes


def is_recording(folder: Path) -> bool:
    return folder.is_file() or (folder / "recording.toml").is_file()


def run_one(folder: Path, out: Path, only: str | None, force: bool, bars: bool) -> Outcome:
    """Run one recording and say how it ended; no exception leaves here."""
    try:
        with _bar(folder.name, bars) as progress:
            done = run_stages(read_recording(folder), out, only, force, progress)
        return Outcome(folder, out, "done", done.stages, notes=done.notes)
    except InputError as error:
        return Outcome(folder, out, "refused", message=str(error))
    except OSError as error:
        return _no_room(folder, out, error)
    except Exception as error:  # noqa: BLE001  our bug: kept with its traceback, for this recording alone
        line = missing_library(error) if isinstance(error, ImportError) else None
        return Outcome(folder, out, "refused" if line else "failed", message=line or traceback.format_exc())


ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EACCES, errno.EPERM, errno.EROFS, errno.EIO)


def _no_room(folder: Path, out: Path, error: OSError) -> Outcome:
    """A full disk or a missing permission is nothing of ours, and said in three lines; another OSError is."""
    if error.errno not in ROOM:
        return Outcome(folder, out, "failed", message="".join(traceback.format_exception(error)))
    said = InputError(
        f"{error.filename or out}: {error.strerror or error}",
        "room and permission to write there",
        "free some space or name another --out, and run again: finished stages are kept",
    )
    return Outcome(folder, out, "refused", message=str(said))


def _in_processes(
    tasks: list[tuple[Path, Path]], only: str | None, force: bool, jobs: int, bars: bool
) -> list[Outcome]:
    """Each recording in a process of its own; recordings whose process was killed are run once more, one by one."""
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    outcomes: dict[Path, Outcome] = {}
    workers = os.cpu_count() or 1 if jobs < 1 else jobs
    with ProcessPoolExecutor(max_workers=min(workers, len(tasks))) as pool:
        futures = {one: pool.submit(run_one, one, target, only, force, False) for one, target in tasks}
        for one, future in tqdm(futures.items(), desc="recordings", unit="", disable=None if bars else True):
            try:
                outcomes[one] = future.result()
            except BrokenProcessPool:
                pass  # which recording brought its process down cannot be told: see below
    for one, target in tasks:
        if one not in outcomes:
            outcomes[one] = _alone(one, target, only, force)
    return [outcomes[one] for one, _ in tasks]


def _alone(folder: Path, out: Path, only: str | None, force: bool) -> Outcome:
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with ProcessPoolExecutor(max_workers=1) as pool:
        try:
            return pool.submit(run_one, folder, out, only, force, False).result()
        except BrokenProcessPool:
            return Outcome(
                folder, out, "failed", message=f"the process that worked on {folder} was killed (memory?)"
            )


def _series_report(folder: Path, out: Path, outcomes: list[Outcome]) -> list[Outcome]:
    """The page over the whole series, from the recordings that came through."""
    from analysis.report.series_report import write_series_report

    done = [read_recording(one.folder) for one in outcomes if one.status == "done"]
    if not done:
        return []
    try:
        with locked(out):
            write_series_report(out, done, folder.resolve().name)
    except InputError as error:
        return [Outcome(folder, out, "refused", message=str(error))]
    except OSError as error:
        return [_no_room(folder, out, error)]
    except Exception:  # noqa: BLE001  as above
        return [Outcome(folder, out, "failed", message=traceback.format_exc())]
    return []


class _bar:
    """A progress bar per stage on standard error, where that is a terminal: hands out `Progress` callbacks."""

    def __init__(self, title: str, shown: bool) -> None:
        self._title, self._shown, self._bar = title, shown, None

    def __enter__(self) -> Callable[[str], Progress]:
        return self._stage

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def _stage(self, name: str) -> Progress:
        self.__exit__()
        bar = self._bar = tqdm(desc=f"{self._title}: {name}", disable=None if self._shown else True)

        def progress(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        return progress
