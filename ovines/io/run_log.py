"""What was read, decided, and how long it took: ``ovines.log`` beside the results, and standard error with --verbose.

The log is the one file of a results folder that knows a clock and absolute paths; nothing is made from it.
"""

from __future__ import annotations

import logging
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOG = "ovines.log"
HEAD = "ovines log: what was read and decided, and how long it took\n"
LOGGER = logging.getLogger("ovines")
LOGGER.setLevel(logging.INFO)
LOGGER.propagate = False
LOGGER.addHandler(logging.NullHandler())  # else Python prints warnings where no one listens

# `ovines.core.kernel` says here, by the logger's name, what it compiles; the log beside the results has every kernel.
COMPILING = LOGGER.getChild("compiling")
COMPILED_ONCE = "compiling, once per machine and version: up to some minutes"
_shown = {"quiet": False}


class _Patient(logging.FileHandler):
    """A log that cannot be written (a full disk) is no reason to stop."""

    def handleError(self, record: logging.LogRecord) -> None:  # noqa: N802  logging's name
        pass


@contextmanager
def logged(out: Path) -> Iterator[None]:
    """Append what the block logs to ``ovines.log`` in ``out`` (call it under the folder's lock), and how it ended."""
    path = out / LOG
    if not path.exists() or path.stat().st_size == 0:
        path.write_text(HEAD, encoding="utf-8")
    handler = _Patient(path, encoding="utf-8", errors="backslashreplace")
    handler.setFormatter(logging.Formatter("%(asctime)s  %(message)s", "%Y-%m-%d %H:%M:%S"))
    LOGGER.addHandler(handler)
    began = time.monotonic()
    try:
        yield
        LOGGER.info("done after %.1f s", time.monotonic() - began)
    except BaseException as error:
        said = " | ".join(str(error).splitlines()) or type(error).__name__
        LOGGER.info("ended after %.1f s: %s", time.monotonic() - began, said)
        raise
    finally:
        LOGGER.removeHandler(handler)
        handler.close()


class _Compiling(logging.Handler):
    """Says once, on a terminal, that code is compiled, whichever command came to it; above the bars that it shows."""

    said = False

    def emit(self, record: logging.LogRecord) -> None:
        """Say it at the first kernel."""
        if not self.said and sys.stderr is not None and sys.stderr.isatty():
            from tqdm import tqdm  # most commands compile nothing

            tqdm.write(COMPILED_ONCE, file=sys.stderr)
        self.said = True


@contextmanager
def on_terminal(quiet: bool, verbose: bool) -> Iterator[None]:
    """Show the log on standard error (``verbose``), or no progress bars (``quiet``), while the block runs; and, unless
    ``quiet``, that code is compiled."""
    handler = logging.StreamHandler(sys.stderr) if verbose else logging.NullHandler()
    compiling = logging.NullHandler() if quiet or verbose else _Compiling()
    LOGGER.addHandler(handler)
    COMPILING.addHandler(compiling)
    _shown["quiet"] = quiet
    try:
        yield
    finally:
        LOGGER.removeHandler(handler)
        COMPILING.removeHandler(compiling)
        _shown["quiet"] = False


def bars_disabled(shown: bool = True) -> bool | None:
    """tqdm's ``disable``: None shows a bar on a terminal only."""
    return None if shown and not _shown["quiet"] else True
