"""`ovines calibrate`: the stage of that name, for one recording or a series."""

import argparse

from ovines.commands import stage_command
from ovines.pipeline.stages import stage

NAME = "calibrate"
HELP = stage(NAME).help


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every stage, and ``--figures``."""
    stage_command.add_arguments(parser)
    stage_command.add_figures(parser)


def run(args: argparse.Namespace) -> int:
    """Run the stage where it is stale; its page calibration.html stands beside the results."""
    return stage_command.run(args, NAME)
