"""`ovines diagnose`: where simulator and experiment differ, which effect causes it, how far it shrinks."""

from __future__ import annotations

import argparse
from pathlib import Path

from ovines.commands.options import results_folder, whole_number
from ovines.pipeline.series.written_diagnosis import Asked, write_diagnosis
from ovines.workers.budget import add_yes

NAME = "diagnose"
HELP = "the sim-to-real gap of a series: where it lies, which effect causes it, how far it shrinks"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """``SERIES --out DIR --write-model FILE --law FILE --seed N``."""
    parser.add_argument("series", type=Path, metavar="SERIES", help="folder of recordings (or one recording)")
    parser.add_argument(
        "--out", type=Path, metavar="DIR", help="folder for the results (default: results/ inside the series)"
    )
    parser.add_argument(
        "--write-model",
        type=Path,
        metavar="FILE",
        help="write the nominal model with the effect added, as a [model] section (and [bodies.host], of another wall)",
    )
    parser.add_argument(
        "--law",
        action="append",
        default=[],
        type=Path,
        metavar="FILE",
        help="a written law that the nominal model holds beside [model]; may be given several times",
    )
    parser.add_argument(
        "--withhold",
        action="append",
        default=[],
        metavar="EFFECT",
        help="take an effect out of the library for a trial: the answer must become unknown",
    )
    parser.add_argument(
        "--seed",
        type=whole_number,
        default=0,
        metavar="N",
        help="of the bootstrap of the shrinkage's interval (default: 0)",
    )
    add_yes(parser)


def run(args: argparse.Namespace) -> int:
    """Diagnose, write diagnosis.json, predictions.parquet and gap.html, say the verdict."""
    out = results_folder(args.series, args.out)
    asked = Asked(args.series, out, args.law, args.withhold, args.seed, args.write_model, args.yes)
    print("\n  ".join(write_diagnosis(asked)))
    return 0
