"""Parse the command line, hand over to the command, turn what is wrong into three lines and an exit status."""

from __future__ import annotations

import argparse
import gc
import importlib
import io
import os
import pkgutil
import sys
from contextlib import nullcontext, redirect_stdout
from functools import cache
from pathlib import Path
from types import ModuleType

# One thread for the linear algebra: results are then the same bytes with any --jobs, and small matrices are
# faster.  Set before numpy is loaded; whoever wants more threads sets the variable.
for variable in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(variable, "1")

import ovines
import ovines.commands
from ovines.errors import InputError, refusal_of
from ovines.io.run_log import on_terminal
from ovines.system_library import missing_library
from ovines.workers.budget import given_up

# New objects after which Python looks for circles of forgotten ones: 700 by itself, which took a twentieth of a run
# (figures are made of many small objects); the memory of a run grows by less than a tenth.
LOOKED_FOR_CIRCLES = 20_000
ORDER = (
    "new",
    "run",
    "check",
    "calibrate",
    "track",
    "lens",
    "triangulate",
    "analyse",
    "identify",
    "report",
    "simulate",
    "diagnose",
    "compare",
    "export",
)


@cache
def command_modules() -> dict[str, str]:
    """Name of every command -> its module: every file in a room of ovines.commands, except that which serves others."""
    rooms = [one.name for one in pkgutil.iter_modules(ovines.commands.__path__, "ovines.commands.") if one.ispkg]
    files = [
        one.name
        for room in rooms
        for one in pkgutil.iter_modules(importlib.import_module(room).__path__, f"{room}.")
        if not one.name.endswith(".stage_command")
    ]
    # import_.py: Python keeps the word to itself
    return {module.rpartition(".")[2].removesuffix("_"): module for module in files}


def command_names() -> list[str]:
    """Every command, those of a usual day first."""
    return sorted(command_modules(), key=lambda name: (ORDER.index(name) if name in ORDER else len(ORDER), name))


def command(name: str) -> ModuleType:
    """The module of a command, loaded when it is asked for."""
    return importlib.import_module(command_modules()[name])


def build(asked: list[str]) -> argparse.ArgumentParser:
    """The parser of the commands ``asked``; only those are loaded."""
    parser = argparse.ArgumentParser(prog="ovines", description=ovines.__doc__)
    parser.add_argument("--version", action="version", version=f"ovines {ovines.__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in asked:
        module = command(name)
        added = commands.add_parser(name, help=module.HELP.replace("%", "%%"), description=module.HELP)
        module.add_arguments(added)
        add_how_much(added)
        added.set_defaults(run=module.run)
    return parser


def add_how_much(parser: argparse.ArgumentParser) -> None:
    """``--quiet`` and ``--verbose``, of every command."""
    said = parser.add_mutually_exclusive_group()
    said.add_argument("-q", "--quiet", action="store_true", help="print errors only, no progress bars")
    said.add_argument(
        "-v", "--verbose", action="store_true", help="also print what is read and decided, and how long it takes"
    )


def parse(arguments: list[str]) -> argparse.Namespace:
    """Only the command asked for is loaded, none for the version; all of them for the help."""
    if arguments == ["--version"]:
        return build([]).parse_args(arguments)
    asked = [name for name in command_names() if arguments[:1] == [name]]
    parser = build(asked or command_names())
    if not asked:
        add_completion(parser)
    return parser.parse_args(arguments)


def add_completion(parser: argparse.ArgumentParser) -> None:
    """``--completion SHELL``, which prints a script; arguments that are paths are completed with files."""
    import shtab

    shtab.add_argument_to(parser, "--completion", help="print a script by which a shell completes with the Tab key")
    parsers = [parser]
    while parsers:
        for action in parsers.pop()._actions:  # argparse has no public way to ask
            if isinstance(action, argparse._SubParsersAction):
                parsers += action.choices.values()
            elif action.type is Path:
                action.complete = shtab.FILE  # type: ignore[attr-defined]


def main(arguments: list[str] | None = None) -> int:
    """0 done, 2 the input or the command line is wrong, 1 a mistake of ours (with its traceback)."""
    for name in ("stdout", "stderr"):  # closed by who started the program: nobody listens, and writing must not fail
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115  open to the process's end
    gc.set_threshold(LOOKED_FOR_CIRCLES)
    status = _guarded(arguments)
    if arguments is None and given_up():  # a compiled loop that nobody waits for any more would keep the process
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(status)
    return status


def _guarded(arguments: list[str] | None) -> int:
    if isinstance(sys.stdout, io.TextIOWrapper):  # a name that the terminal cannot show is no reason to stop
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        args = parse(sys.argv[1:] if arguments is None else arguments)
        with (
            on_terminal(args.quiet, args.verbose),
            open(os.devnull, "w", encoding="utf-8") as nowhere,
            redirect_stdout(nowhere) if args.quiet else nullcontext(),
        ):
            return args.run(args)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    except (ImportError, MemoryError) as error:
        message = missing_library(error)
        if message is None:
            raise
        print(message, file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted; finished stages are kept", file=sys.stderr)
        return 130
    except BrokenPipeError:  # `ovines check ... | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    except OSError as error:
        said = refusal_of(error) or missing_library(error)
        if said is None:
            raise
        print(said, file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
