"""Many recordings: one after another or in parallel; one that fails does not cost the others."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tqdm import tqdm

from ovines.errors import InputError
from ovines.io.lock import locked
from ovines.io.provenance import program
from ovines.io.run_log import LOG, LOGGER, bars_disabled, logged
from ovines.pipeline.one_recording import Outcome, no_room, run_one
from ovines.pipeline.ownership import refuse_folder, refuse_other_source, refuse_theirs, write_source
from ovines.pipeline.series.cluster import run_on_cluster
from ovines.pipeline.series.lens import FEWEST_RUNS, write_series_lens
from ovines.pipeline.series.results import JOINT, PAGE, write_series_results
from ovines.pipeline.stages import stage
from ovines.recording import ENTRY_TABLES, read_recording, series_folders
from ovines.tables import table_rows
from ovines.workers.budget import refuse_cost
from ovines.workers.orphans import die_with


@dataclass(frozen=True)
class Workers:
    """Who does the work: ``jobs`` processes (0: as many as there are cores), or the workers of the Dask scheduler at
    ``cluster``; ``bars`` show how far they are.
    """

    jobs: int = 1
    cluster: str | None = None
    bars: bool = True


def run_series(
    folder: Path,
    out: Path,
    only: str | None = None,
    force: bool = False,
    figures: bool = False,
    yes: bool = False,
    workers: Workers = Workers(),
) -> list[Outcome]:
    """Run the recording or every recording of the series ``folder``; results in ``out`` or its subfolders.

    A recording's results go into ``out`` itself, those of a series into ``out / name of the recording's folder``,
    with the joint identification and a page over all of them in ``out``; whoever the ``workers``, the results are the
    same bytes.  ``figures`` also writes every figure as SVG and PDF.
    """
    folders = series_folders(folder)
    single = is_recording(folder)
    tasks = [(one, out if single else out / one.name) for one in folders]
    if not single:
        refuse_folder(out)
        refuse_other_source(out, folder)
        refuse_theirs(out, [JOINT, PAGE, LOG, *stage("lens").writes], figures)  # before hours of work, not after
    for one in folders:
        refuse_large(one, yes)

    def run_all(some: list[tuple[Path, Path]], last: str | None, again: bool) -> list[Outcome]:
        if workers.cluster is not None:
            return run_on_cluster(some, last, again, figures, workers.cluster, workers.bars)
        if workers.jobs == 1 or len(some) == 1:
            return [run_one(one, target, last, again, workers.bars, figures, not single) for one, target in some]
        return _in_processes(some, last, again, workers.jobs, workers.bars, figures)

    if single or only not in (None, *WITH_LENS):
        outcomes = run_all(tasks, only, force)
    else:
        outcomes = _after_lens(folder, out, tasks, only, force, run_all)
    if not single and only in (None, "identify", "report"):
        outcomes += _together(folder, out, outcomes, only, force, figures)
    return outcomes


# Stages that a lens field comes before: it is learnt from the tracks of all runs.
WITH_LENS = ("lens", "triangulate", "analyse", "identify")


def _after_lens(
    folder: Path,
    out: Path,
    tasks: list[tuple[Path, Path]],
    only: str | None,
    force: bool,
    run_all: Callable[[list[tuple[Path, Path]], str | None, bool], list[Outcome]],
) -> list[Outcome]:
    """All recordings, those that are filmed tracked first, so that one lens field is learnt from the whole series."""
    kinds = {one: _entry(one) for one, _ in tasks}
    filmed = [task for task in tasks if kinds[task[0]] == "frames"]
    tracked = {one.folder: one for one in run_all(filmed, "track", False)} if filmed else {}
    failed = {one for one, outcome in tracked.items() if outcome.status != "done"}
    with_tracks = [one for one, _ in tasks if kinds[one] in ("frames", "tracks") and one not in failed]
    notes: list[str] = []
    if len(with_tracks) >= FEWEST_RUNS:
        with suppress(InputError, OSError):  # which are said where the recordings are run
            for _, target in tasks:
                refuse_folder(target)
            with locked(out), logged(out):
                write_source(out, folder, "series")
                _, notes = write_series_lens(out, [read_recording(one) for one in with_tracks], force)
    rest = [task for task in tasks if task[0] not in failed]
    outcomes = {one.folder: one for one in run_all(rest, only, force)} if rest else {}
    for one, outcome in outcomes.items():
        before = tracked.get(one)
        if before is not None:
            stages = outcome.stages | {name: "run" for name, what in before.stages.items() if what == "run"}
            outcomes[one] = replace(outcome, stages=stages, notes=before.notes + outcome.notes)
    done = [outcomes.get(one) or tracked[one] for one, _ in tasks]
    return [replace(done[0], notes=notes + done[0].notes), *done[1:]] if notes and done else done


def _entry(folder: Path) -> str | None:
    try:
        return read_recording(folder).entry()
    except (InputError, OSError):
        return None  # said where it is run


BYTES_PER_ROW = 600.0  # measured: 1.4 GB for a tracks.parquet of 2.4 million rows


def refuse_large(folder: Path, yes: bool) -> None:
    """`InputError` where a recording's own tables need more memory than the budget; by their footers, before they are
    read.
    """
    for name in ENTRY_TABLES:
        try:
            rows = table_rows(folder / f"{name}.parquet")
        except (OSError, ValueError):
            continue  # not there, or no table: whoever reads it says so
        refuse_cost(f"{folder / name}.parquet: {rows} rows", 0.0, rows * BYTES_PER_ROW, yes)


def is_recording(folder: Path) -> bool:
    """Whether a path is a recording (a folder with recording.toml, or that file), not a series of them."""
    return folder.is_file() or (folder / "recording.toml").is_file()


def _in_processes(
    tasks: list[tuple[Path, Path]], only: str | None, force: bool, jobs: int, bars: bool, figures: bool
) -> list[Outcome]:
    """Each recording in a process of its own; recordings whose process was killed are run once more, one by one."""
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    outcomes: dict[Path, Outcome] = {}
    parent = os.getpid()
    workers = os.cpu_count() or 1 if jobs < 1 else jobs
    with ProcessPoolExecutor(max_workers=min(workers, len(tasks))) as pool:
        futures = {
            one: pool.submit(_in_worker, parent, run_one, one, target, only, force, False, figures, True)
            for one, target in tasks
        }
        for one, future in tqdm(futures.items(), desc="recordings", unit="", disable=bars_disabled(bars)):
            with suppress(BrokenProcessPool):  # which recording brought its process down is not known: see below
                outcomes[one] = future.result()
    for one, target in tasks:
        if one not in outcomes:
            outcomes[one] = _alone(one, target, only, force, figures)
    return [outcomes[one] for one, _ in tasks]


def _in_worker(parent: int, work: Callable[..., Outcome], *arguments: Any) -> Outcome:
    die_with(parent)
    return work(*arguments)


def _alone(folder: Path, out: Path, only: str | None, force: bool, figures: bool) -> Outcome:
    from joblib.externals.loky import ProcessPoolExecutor
    from joblib.externals.loky.process_executor import BrokenProcessPool

    with ProcessPoolExecutor(max_workers=1) as pool:
        try:
            return pool.submit(
                _in_worker, os.getpid(), run_one, folder, out, only, force, False, figures, True
            ).result()
        except BrokenProcessPool:
            return Outcome(folder, out, "failed", message=f"the process that worked on {folder} was killed (memory?)")


def _together(
    folder: Path, out: Path, outcomes: list[Outcome], only: str | None, force: bool, figures: bool
) -> list[Outcome]:
    """Joint identification and page of the whole series, from the recordings that came through."""
    done = [read_recording(one.folder) for one in outcomes if one.status == "done"]
    if not done:
        return []
    try:
        with locked(out), logged(out):
            write_source(out, folder, "series")
            LOGGER.info("%s: series of %d recordings, by %s", folder.resolve(), len(done), program())
            stages, notes = write_series_results(out, done, folder.resolve().name, only, force, figures)
            for line in (*(f"{name}: {what}" for name, what in stages.items()), *(f"note: {note}" for note in notes)):
                LOGGER.info("%s", line)
    except InputError as error:
        return [Outcome(folder, out, "refused", message=str(error), whole_series=True)]
    except OSError as error:
        return [replace(no_room(folder, out, error), whole_series=True)]
    except Exception:
        return [Outcome(folder, out, "failed", message=traceback.format_exc(), whole_series=True)]
    verdict = _verdict(out, [one.folder.name for one in done]) if only in (None, "identify") else []
    page = out / PAGE if "report" in stages else None
    return [Outcome(folder, out, "done", stages, notes=notes, verdict=verdict, page=page, whole_series=True)]


def _verdict(out: Path, names: list[str]) -> list[str]:
    from analysis.report.terminal import series_in_words

    return series_in_words(out, names)
