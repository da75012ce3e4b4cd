"""`ovines run`: everything the files allow, up to the report."""

import argparse

from ovines.commands.chain import stage_command

NAME = "run"
HELP = "everything the files allow, from where the recording enters up to the report"
run = stage_command.run


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Arguments of every stage, and ``--figures``."""
    stage_command.add_arguments(parser)
    stage_command.add_figures(parser)
