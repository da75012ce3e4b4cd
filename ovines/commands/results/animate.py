"""`ovines animate`: a short GIF or MP4 of the motion, for talks."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import pandas as pd

from ovines.commands.options import results_folder
from ovines.errors import InputError
from ovines.pipeline.ownership import refuse_strange_results, refuse_to_replace
from ovines.recording import Recording, read_recording
from ovines.tables import read_table

NAME = "animate"
HELP = "A short film (GIF or MP4) of the motion, slowed down, measured and simulated together."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Recording, results folder, the stretch and how much slower, the file."""
    parser.add_argument("recording", type=Path, metavar="RECORDING", help="folder with recording.toml")
    parser.add_argument(
        "--results",
        type=Path,
        metavar="DIR",
        help="results of `ovines run` (default: results/ inside the recording)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="film.gif or film.mp4 (default: motion.gif in the results)"
    )
    parser.add_argument(
        "--start",
        type=_time,
        default=float("-inf"),
        metavar="S",
        help="from this time of the recording (default: its start)",
    )
    parser.add_argument("--end", type=_time, default=float("inf"), metavar="S", help="to this time (default: its end)")
    parser.add_argument(
        "--slower", type=_slower, default=20.0, metavar="N", help="N times slower than it was (default: 20)"
    )
    parser.add_argument(
        "--simulation",
        type=Path,
        metavar="FILE",
        help="a simulation.parquet to show beside it (default: each flight simulated from the impact before it)",
    )
    parser.add_argument("--measured", action="store_true", help="show what was measured only")


def run(args: argparse.Namespace) -> int:
    """Write the film and say where it is."""
    from analysis.view.film import Film, animate

    recording = read_recording(args.recording)
    results = args.results or results_folder(args.recording, None)
    refuse_strange_results(results, recording)
    motion = next(
        (path for path in (results / "motion.parquet", recording.folder / "motion.parquet") if path.is_file()),
        None,
    )
    if motion is None:
        raise InputError(
            f"{results}: no motion.parquet",
            "the results of `ovines run`",
            f"run `ovines run {args.recording}` first",
        )
    out = args.out or results / "motion.gif"
    refuse_to_replace(out, "--out")
    simulation = _simulation(args, recording, results)
    pictures = animate(
        read_table(motion, "motion"), recording, out, Film(args.start, args.end, args.slower), simulation
    )
    print(f"{pictures} pictures, {out.stat().st_size / 1e6:.1f} MB -> {out}")
    return 0


def _simulation(args: argparse.Namespace, recording: Recording, results: Path) -> pd.DataFrame | None:
    """The table asked for, else what the results allow; None with ``--measured``."""
    from analysis.report.results import read_results
    from analysis.view.simulated_motion import simulated_beside

    if args.measured:
        return None
    if args.simulation is not None:
        return read_table(args.simulation, "simulation")
    return simulated_beside(read_results(results, recording))[0]


def _time(text: str) -> float:
    value = float(text)
    if math.isnan(value):
        raise argparse.ArgumentTypeError("a time in seconds")
    return value


def _slower(text: str) -> float:
    value = float(text)
    if not 0.01 <= value <= 1e5:
        raise argparse.ArgumentTypeError("a number from 0.01 to 100000")
    return value
