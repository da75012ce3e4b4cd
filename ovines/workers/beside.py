"""Work done in a copy of this process, on the second processor: the copy has loaded all that this one has."""

from __future__ import annotations

import os
import pickle
import signal
import struct
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TypeVar

from ovines.workers.orphans import die_with

NUMBER = struct.Struct("H")  # of a piece of work, as it goes through a pipe
MOST = 4096  # pieces whose numbers a pipe surely takes at once (16 pages of 4 KiB on Linux, 2 bytes each)

Made = TypeVar("Made")

_copies: set[int] = set()  # processes that are copies: they make none of their own


@contextmanager
def made_beside(work: Callable[[], Made]) -> Iterator[Callable[[], Made | None]]:
    """Begin ``work`` in a copy of this process; what is yielded waits for what it makes, which must bear pickling.

    It gives None where the work failed, where there is one processor only, in a copy, and on systems where a process is
    not copied (Windows) or its libraries do not bear it (macOS): whoever asked does the work itself then.  The copy
    ends with the block.
    """
    if sys.platform != "linux" or (os.cpu_count() or 1) == 1 or os.getpid() in _copies:
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

    def answer() -> Made | None:
        with open(read, "rb", closefd=False) as stream:
            made = stream.read()
        ended.append(os.waitpid(child, 0)[1])
        return pickle.loads(made) if ended[0] == 0 else None

    try:
        yield answer
    finally:
        os.close(read)
        if not ended:
            with suppress(ProcessLookupError):
                os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)


def _copy(work: Callable[[], Made], parent: int, read: int, write: int) -> None:
    """The copy's life: nothing of it but what it makes is seen, and it never comes back."""
    status = 1
    try:
        os.close(read)
        _copies.add(os.getpid())
        die_with(parent)
        made = pickle.dumps(work(), pickle.HIGHEST_PROTOCOL)
        with open(write, "wb") as stream:
            stream.write(made)
        status = 0
    finally:
        os._exit(status)


def made_by_two(works: Sequence[Callable[[], Made]]) -> list[Made]:
    """What ``works`` make, which must bear pickling, in their order, some made by this process and some by a copy of
    it: whichever has done with one takes the next.

    What fails in the copy is made here, so that its failure is this process's own; without a copy (`made_beside`) all
    are made here.
    """
    if not 1 < len(works) <= MOST:
        return [work() for work in works]
    waiting, numbers = os.pipe()
    os.write(numbers, b"".join(NUMBER.pack(number) for number in range(len(works))))
    os.close(numbers)

    def next_ones() -> Iterator[int]:
        while taken := os.read(waiting, NUMBER.size):
            yield NUMBER.unpack(taken)[0]

    def by_the_copy() -> dict[int, Made]:
        made: dict[int, Made] = {}
        for number in next_ones():
            with suppress(Exception):
                made[number] = works[number]()
        return made

    try:
        with made_beside(by_the_copy) as of_the_copy:
            made = {number: works[number]() for number in next_ones()}
            made |= of_the_copy() or {}
    finally:
        os.close(waiting)
    return [made[number] if number in made else work() for number, work in enumerate(works)]
