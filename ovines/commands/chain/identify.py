"""`ovines identify`: the stage of that name, for one recording or a series."""

import argparse

from ovines.commands.chain import stage_command
from ovines.pipeline.stages import stage

NAME = "identify"
HELP = stage(NAME).help
add_arguments = stage_command.add_arguments


def run(args: argparse.Namespace) -> int:
    """Run the stage where it is stale."""
    return stage_command.run(args, NAME)
