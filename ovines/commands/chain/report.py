"""`ovines report DIR`: write the pages of a results folder again."""

import argparse
import json
from pathlib import Path

from ovines.commands.chain import stage_command
from ovines.errors import InputError
from ovines.pipeline.one_recording import run_one
from ovines.pipeline.ownership import SOURCE, read_source
from ovines.pipeline.series.recordings import run_series
from ovines.pipeline.stages import stage

NAME = "report"
HELP = stage(NAME).help


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """A results folder, and ``--figures``."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="results of `ovines run` (or a recording or series "
        "with results/ inside)")  # fmt: skip
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--force", action="store_true", help="write it again even where nothing has changed")
    stage_command.add_figures(parser)


def run(args: argparse.Namespace) -> int:
    """Write report.html of the recording, or of every recording and of the series."""
    folder: Path = args.folder
    own = (folder / SOURCE).is_file() and "series" not in read_source(folder)
    if not (folder / SOURCE).is_file() and (args.out or (folder / "results").is_dir()):
        return stage_command.tell(
            run_series(folder, args.out or folder / "results", NAME, args.force, figures=args.figures, yes=True)
        )
    if own:
        return stage_command.tell([run_one(source_of(folder), folder, NAME, args.force, True, args.figures)])
    inside = sorted(path.parent for path in folder.glob(f"*/{SOURCE}"))
    if not inside:
        raise InputError(
            f"{folder} holds no results of `ovines run`",
            f"a folder with {SOURCE} in it",
            "run `ovines run` first",
        )
    series = {source_of(one).resolve().parent for one in inside}
    if len(series) == 1:
        return stage_command.tell(run_series(series.pop(), folder, NAME, args.force, figures=args.figures, yes=True))
    return stage_command.tell([run_one(source_of(one), one, NAME, args.force, True, args.figures) for one in inside])


def source_of(results: Path) -> Path:
    """The recording's folder that a results folder was made from."""
    try:
        return results / json.loads((results / SOURCE).read_text(encoding="utf-8"))["recording"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(
            f"{results / SOURCE}: {error}", '{"recording": "path"}', "run `ovines run` into this folder again"
        ) from None
