"""`ovines calibrate`: the stage of that name, for one recording or a series."""

import argparse
import contextlib
import time

from ovines.commands.chain import stage_command
from ovines.pipeline.stages import stage

NAME = "calibrate"
HELP = stage(NAME).help
SECONDS_BETWEEN_LOOKS = 1.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every stage, ``--figures``, and ``--watch``."""
    stage_command.add_arguments(parser)
    stage_command.add_figures(parser)
    parser.add_argument(
        "--watch",
        action="store_true",
        help="stay, and say after each new intrinsic picture what is known and which view helps most (Ctrl-C ends it)",
    )


def run(args: argparse.Namespace) -> int:
    """Run the stage where it is stale; its page calibration.html stands beside the results.  With ``--watch``, say what
    is known as pictures arrive, and write nothing.
    """
    if args.watch:
        return _watch(args)
    return stage_command.run(args, NAME)


def _watch(args: argparse.Namespace) -> int:
    from ovines.recording import read_recording
    from vision.validation.watch import watch

    def wait() -> bool:
        time.sleep(SECONDS_BETWEEN_LOOKS)
        return True

    print(f"watching {args.recording}; Ctrl-C ends it, then: ovines calibrate {args.recording}", flush=True)
    with contextlib.suppress(KeyboardInterrupt):
        watch(read_recording(args.recording), lambda line: print(line, flush=True), wait)
    return 0
