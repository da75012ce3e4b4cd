"""`ovines run`: everything the files allow, up to the report."""

from ovines.commands import stage_command

NAME = "run"
HELP = "everything the files allow, from where the recording enters up to the report"
add_arguments = stage_command.add_arguments
run = stage_command.run
