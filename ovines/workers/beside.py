"""A text made in a copy of this process, on the second processor: the copy has loaded all that this one has."""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from ovines.workers.orphans import die_with


@contextmanager
def made_beside(work: Callable[[], str]) -> Iterator[Callable[[], str | None]]:
    """Begin ``work`` in a copy of this process; what is yielded waits for its text.

    It gives None where the work failed, where there is one processor only, and on systems where a process is not copied
    (Windows) or its libraries do not bear it (macOS): whoever asked does the work itself then.  The copy ends with the
    block.
    """
    if sys.platform != "linux" or (os.cpu_count() or 1) == 1:
        yield lambda: None
        return
    read, write = os.pipe()
    parent = os.getpid()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads: the copy waits for none
        child = os.fork()
    if child == 0:
        _copy(work, parent, read, write)
    os.close(write)
    ended: list[int] = []

    def answer() -> str | None:
        with open(read, "rb", closefd=False) as stream:
            text = stream.read()
        ended.append(os.waitpid(child, 0)[1])
        return text.decode("utf-8") if ended[0] == 0 else None

    try:
        yield answer
    finally:
        os.close(read)
        if not ended:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _copy(work: Callable[[], str], parent: int, read: int, write: int) -> None:
    """The copy's life: nothing of it but the text is seen, and it never comes back."""
    status = 1
    try:
        os.close(read)
        die_with(parent)
        text = work().encode("utf-8")
        with open(write, "wb") as stream:
            stream.write(text)
        status = 0
    finally:
        os._exit(status)
