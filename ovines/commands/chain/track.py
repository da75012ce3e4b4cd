"""`ovines track`: the stage of that name; ``--names`` says which marker is which where there is no layout."""

import argparse
from pathlib import Path

from ovines.commands.chain import stage_command
from ovines.commands.options import results_folder
from ovines.errors import InputError
from ovines.io.atomic_write import write_text_whole
from ovines.io.lock import locked
from ovines.pipeline.ownership import refuse_folder, refuse_other_source, refuse_to_replace
from ovines.pipeline.series.recordings import is_recording
from ovines.pipeline.stages import stage
from ovines.recording import read_recording

NAME = "track"
HELP = stage(NAME).help


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every stage, and ``--names``."""
    stage_command.add_arguments(parser)
    parser.add_argument("--names", type=Path, metavar="FILE", help="camera,marker,u_px,v_px of the first frame, for a "
        "recording without layout_m; kept in the results")  # fmt: skip


def run(args: argparse.Namespace) -> int:
    """Run the stage where it is stale; the names stay beside the results, so that later runs find them."""
    if args.names is not None:
        if not is_recording(args.recording):
            raise InputError("--names for a series", "one recording", "name the markers recording by recording")
        try:
            text = args.names.read_text(encoding="utf-8-sig")
        except (OSError, ValueError) as error:
            raise InputError(f"--names {args.names}: {error}", "a CSV file", "check the path") from None
        out = results_folder(args.recording, args.out)
        refuse_folder(out)
        recording = read_recording(args.recording)
        refuse_other_source(out, recording.folder, recording)
        refuse_to_replace(out / "names.csv", "--names: copy to", text, args.force)
        with locked(out):
            write_text_whole(text, out / "names.csv")
    return stage_command.run(args, NAME)
