"""Many recordings: one after another or in parallel; one that fails does not cost the others."""

from __future__ import annotations

import os
import traceback
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from ovines.errors import InputError
from ovines.lock import locked
from ovines.on_cluster import run_on_cluster
from ovines.one_recording import Outcome, no_room, run_one
from ovines.recording import read_recording, series_folders
from ovines.series_results import write_series_results


def run_series(
    folder: Path,
    out: Path,
    only: str | None = None,
    force: bool = False,
    jobs: int = 1,
    bars: bool = True,
    figures: bool = False,
    cluster: str | None = None,
) -> list[Outcome]:
    """Run the recording or every recording of the series ``folder``; results in ``out`` or its subfolders.

    A recording's results go into ``out`` itself, those of a series into ``out / name of the recording's folder``,
    with the joint identification and a page over all of them in ``out``.  With ``jobs`` > 1 recordings run in as
    many processes, with ``cluster`` on the workers of that Dask scheduler; the results are the same bytes.
    ``figures`` also writes every figure as SVG and PDF.
    """
    folders = series_folders(folder)
    single = is_recording(folder)
    tasks = [(one, out if single else out / one.name) for one in folders]
    if cluster is not None:
        outcomes = run_on_cluster(tasks, only, force, figures, cluster, bars)
    elif jobs == 1 or len(tasks) == 1:
        outcomes = [run_one(one, target, only, force, bars, figures) for one, target in tasks]
    else:
        outcomes = _in_processes(tasks, only, force, jobs, bars, figures)
    if not single and only in (None, "identify", "report"):
        outcomes += _together(folder, out, outcomes, only, force, figures)
    return outcomes


def is_recording(folder: Path) -> bool:
    return folder.is_file() or (folder / "recording.toml").is_file()


def _in_processes(
    tasks: list[tuple[Path, Path]], only: str | None, force: bool, jobs: int, bars: bool, figures: bool
) -> list[Outcome]:
    """Each recording in a process of its own; recordings whose process was killed are run once more, one by one."""
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    outcomes: dict[Path, Outcome] = {}
    workers = os.cpu_count() or 1 if jobs < 1 else jobs
    with ProcessPoolExecutor(max_workers=min(workers, len(tasks))) as pool:
        futures = {one: pool.submit(run_one, one, target, only, force, False, figures) for one, target in tasks}
        for one, future in tqdm(futures.items(), desc="recordings", unit="", disable=None if bars else True):
            try:
                outcomes[one] = future.result()
            except BrokenProcessPool:
                pass  # which recording brought its process down cannot be told: see below
    for one, target in tasks:
        if one not in outcomes:
            outcomes[one] = _alone(one, target, only, force, figures)
    return [outcomes[one] for one, _ in tasks]


def _alone(folder: Path, out: Path, only: str | None, force: bool, figures: bool) -> Outcome:
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with ProcessPoolExecutor(max_workers=1) as pool:
        try:
            return pool.submit(run_one, folder, out, only, force, False, figures).result()
        except BrokenProcessPool:
            return Outcome(
                folder, out, "failed", message=f"the process that worked on {folder} was killed (memory?)"
            )


def _together(
    folder: Path, out: Path, outcomes: list[Outcome], only: str | None, force: bool, figures: bool
) -> list[Outcome]:
    """Joint identification and page of the whole series, from the recordings that came through."""
    done = [read_recording(one.folder) for one in outcomes if one.status == "done"]
    if not done:
        return []
    try:
        with locked(out):
            stages, notes = write_series_results(out, done, folder.resolve().name, only, force, figures)
    except InputError as error:
        return [Outcome(folder, out, "refused", message=str(error), whole_series=True)]
    except OSError as error:
        return [replace(no_room(folder, out, error), whole_series=True)]
    except Exception:  # noqa: BLE001  as above
        return [Outcome(folder, out, "failed", message=traceback.format_exc(), whole_series=True)]
    return [Outcome(folder, out, "done", stages, notes=notes, whole_series=True)]
