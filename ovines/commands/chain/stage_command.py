"""What the stage commands have in common: arguments, running, telling the end."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

from ovines.commands.options import jobs, results_folder
from ovines.pipeline.one_recording import Outcome
from ovines.pipeline.series.recordings import Workers, run_series
from ovines.workers.budget import add_yes


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``RECORDING_OR_SERIES --out DIR --force --jobs N``."""
    parser.add_argument("recording", type=Path, metavar="RECORDING_OR_SERIES", help="folder with recording.toml, or a "
        "folder of such folders")  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder for the results (default: results/ inside the "
        "recording)")  # fmt: skip
    parser.add_argument("--force", action="store_true", help="run again even where nothing has changed")
    parser.add_argument("--jobs", type=jobs, default=1, metavar="N", help="recordings at a time; 0: one per "
        "processor (default: 1)")  # fmt: skip
    parser.add_argument("--cluster", metavar="ADDRESS", help="run the recordings on this Dask scheduler (its workers "
        "see the same folders)")  # fmt: skip
    add_yes(parser)


def add_figures(parser: argparse.ArgumentParser) -> None:
    """``--figures``, for the commands that write pages."""
    parser.add_argument("--figures", action="store_true", help="also write every figure of the pages as SVG and PDF")


def run(args: argparse.Namespace, only: str | None = None) -> int:
    """Run the whole chain, or the stage ``only``; say what was done; the exit status."""
    out = results_folder(args.recording, args.out)
    outcomes = run_series(
        args.recording,
        out,
        only,
        args.force,
        figures=getattr(args, "figures", False),
        yes=args.yes,
        workers=Workers(args.jobs, args.cluster),
    )
    return tell(outcomes)


def tell(outcomes: Sequence[Outcome]) -> int:
    """Each recording in a line with its notes, the answer at the end, the reasons of those that did not come through;
    0, 2 (input) or 1 (our bug).

    A series' recordings say their verdict in a word: the whole answer is that of the series."""
    several = any(one.whole_series for one in outcomes)
    for one in outcomes:
        if one.status == "done":
            ran = [name for name, what in one.stages.items() if what == "run"]
            print(f"{one.folder.resolve().name}: {', '.join(ran) or 'up to date'} -> {one.out}")
            for note in one.notes:
                print(f"  note: {note}")
            for line in one.verdict[:1] if several and not one.whole_series else one.verdict:
                print(f"  {line}")
            if one.page is not None and (one.whole_series or not several):
                print(f"  page: {one.page}")
    unfinished = [one for one in outcomes if one.status != "done"]
    for one in unfinished:
        if len(outcomes) > 1:
            print(f"\n{one.folder.resolve().name}: {one.status}", file=sys.stderr)
        print(one.message.rstrip(), file=sys.stderr)
    recordings = [one for one in outcomes if not one.whole_series]
    if unfinished and len(outcomes) > 1:
        lost = sum(one.status != "done" for one in recordings)
        print(f"\n{lost} of {len(recordings)} recordings did not come through", file=sys.stderr)
    if any(one.status == "failed" for one in outcomes):
        return 1
    return 2 if unfinished else 0
