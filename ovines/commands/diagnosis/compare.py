"""`ovines compare`: measured against simulated, one flight and one impact ahead, and whole-run statistics; or two
results of one recording.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ovines.commands.options import results_folder, whole_number
from ovines.errors import InputError
from ovines.io.provenance import provenance, sha256_of
from ovines.pipeline.ownership import refuse_folder, refuse_strange_results, refuse_theirs
from ovines.pipeline.series.recordings import is_recording
from ovines.recording import Recording, read_recording, series_folders
from ovines.tables import read_table, write_table
from ovines.workers.budget import interruptibly

if TYPE_CHECKING:
    from analysis.compare import Comparison

NAME = "compare"
WRITES, PAGE = ("flights_ahead", "impacts_ahead", "run_statistics"), "compare.html"
HELP = (
    "Measured against simulated: one flight and one impact ahead, and whole runs as distributions; or two results of "
    "one recording: what was done differently, and what that changed."
)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recording or series, results folder, number of simulated runs, seed, figures."""
    parser.add_argument(
        "recording",
        type=Path,
        metavar="RECORDING_OR_SERIES",
        help="folder with recording.toml, or a folder of such folders; with a second one: a results folder",
    )
    parser.add_argument(
        "other", type=Path, nargs="?", metavar="RESULTS", help="another results folder of the same recording"
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help="results of `ovines run` (default: results/ inside the recording)",
    )
    parser.add_argument(
        "--runs", type=_count, default=40, metavar="N", help="simulated copies of the whole run (default: 40)"
    )
    parser.add_argument("--seed", type=whole_number, default=0, help="seed of their scattered starts (default: 0)")
    parser.add_argument("--figures", action="store_true", help="save each figure as SVG and PDF too")


def run(args: argparse.Namespace) -> int:
    """Write compare.html and its tables for each recording; one line each."""
    from analysis.report.pages.compare_report import impact_errors

    if args.other is not None:
        return tell_two(args.recording, args.other)
    out = results_folder(args.recording, args.out)
    single = is_recording(args.recording)
    folders = series_folders(args.recording)
    refused = 0
    for folder in folders:
        try:
            comparison, page = compare_one(read_recording(folder), out if single else out / folder.name, args)
        except InputError as error:
            if single:
                raise
            refused += 1  # the others do not wait for it
            print(f"\n{folder.name}: refused\n{error}", file=sys.stderr)
            continue
        flight = f"{1e3 * comparison.flights['rms_m'].median():.3g} mm" if len(comparison.flights) else "no flight"
        normal = impact_errors(comparison)[0][2]
        print(
            f"{folder.resolve().name}: one flight {flight} (median RMS), one impact {normal:.3g} m/s (RMS, "
            f"normal) -> {page}"
        )
    if refused:
        print(f"\n{refused} of {len(folders)} recordings could not be compared", file=sys.stderr)
    return 2 if refused else 0


def tell_two(first: Path, second: Path) -> int:
    """What differs between two results folders, in lines."""
    from analysis.report.numbers import length, value_with_sd, with_unit
    from analysis.report.parameters import quantity
    from ovines.two_results import (
        SAME_SD,
        counts,
        done_differently,
        parameters_side_by_side,
        paths_apart,
        refuse_no_results,
        refuse_two_recordings,
    )

    for folder in (first, second):
        refuse_no_results(folder)
    refuse_two_recordings(first, second)
    print(f"1: {first}\n2: {second}")
    print(
        "done differently:"
        if (lines := done_differently(first, second))
        else "done alike: same settings, code and files"
    )
    for line in lines:
        print(f"  {line}")
    apart = paths_apart(first, second)
    if apart:
        nes, host = (length(apart[body]) for body in ("nes", "host"))
        print(f"motion, {apart['frames']:.0f} frames of both: NES {nes}, Host {host} apart (RMS)")
    for name, rows in counts(first, second).items():
        print(f"{name}: {rows[0]} -> {rows[1]}")
    table = parameters_side_by_side(first, second)
    for _, row in table.iterrows():
        what = quantity(row["parameter"])
        one, two = (
            value_with_sd(what.scale * row[f"value_{k}"], what.scale * row[f"sd_{k}"], what.unit) for k in (1, 2)
        )
        moved = (
            ""
            if not np.isfinite(row["sds"])
            else "  (same)"
            if abs(row["sds"]) < SAME_SD
            else f"  ({with_unit(row['sds'], digits=2)} sd)"
        )
        print(f"{what.title}: {one} -> {two}{moved}")
    return 0


def compare_one(recording: Recording, folder: Path, args: argparse.Namespace) -> tuple[Comparison, Path]:
    """Compare one recording's results in ``folder`` and write ``flights_ahead``, ``impacts_ahead``,
    ``run_statistics`` and the page.
    """
    from analysis.compare import compare
    from analysis.report.pages.compare_report import write_comparison

    refuse_strange_results(folder, recording)
    refuse_folder(folder)
    refuse_theirs(folder, [PAGE, *(f"{name}.parquet" for name in WRITES)], args.figures)
    paths = {name: folder / f"{name}.parquet" for name in ("motion", "impacts", "identification", "flights")}
    missing = [name for name in ("motion", "impacts", "identification") if not paths[name].is_file()]
    if missing:
        raise InputError(
            f"{folder}: no {missing[0]}.parquet",
            "the results of `ovines run`",
            f"run `ovines run {recording.folder} --out {folder}` first",
        )
    tables = {name: read_table(path, name) for name, path in paths.items() if path.is_file()}
    contacts = []
    if "flights" in tables:
        held = tables["flights"][tables["flights"]["kind"] == "contact"]
        contacts = list(zip(held["start_s"], held["end_s"], strict=True))
    comparison = interruptibly(
        lambda: compare(
            tables["motion"],
            tables["impacts"],
            tables["identification"],
            recording,
            np.random.default_rng(args.seed),
            args.runs,
            contacts,
        )
    )
    record = provenance(
        NAME,
        {"runs": args.runs, "seed": args.seed},
        {path.name: sha256_of(path) for path in paths.values() if path.is_file()},
    )
    for name, table in zip(WRITES, (comparison.flights, comparison.impacts, comparison.statistics), strict=True):
        write_table(table, name, folder / f"{name}.parquet", record)
    return comparison, write_comparison(comparison, folder, recording.folder, args.figures)


def _count(text: str) -> int:
    count = int(text)
    if not 0 <= count <= 10000:
        raise argparse.ArgumentTypeError("a number from 0 to 10000")
    return count
