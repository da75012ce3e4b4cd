"""What a command would cost, said before it is spent: more than a minute or 4 GB stops unless the user says ``--yes``.

Recordings are what the program is for: of them only a table that would not fit into memory stops.  Where one number of
the input makes the cost (a simulated time, a rate, a number of runs), a minute does.
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

from ovines.errors import InputError

MOST_S, MOST_BYTES = 60.0, 4e9
LOOK_S = 0.1  # how often the waiting thread looks for Ctrl-C and the time

UNITS = (("years", 3.156e7), ("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0), ("s", 1.0))
THREAD = "ovines computes"
Result = TypeVar("Result")


def add_yes(parser: argparse.ArgumentParser) -> None:
    """``--yes``, for commands that may stop at their cost."""
    parser.add_argument(
        "--yes",
        action="store_true",
        help="go on where the command stops because it would take more than a minute or 4 GB",
    )


def refuse_cost(what: str, seconds: float, size_bytes: float, yes: bool, most_s: float = MOST_S) -> None:
    """`InputError` where ``what`` would take more than ``most_s`` or `MOST_BYTES` and nobody said yes; a line where it
    takes a minute.
    """
    if yes or (seconds <= MOST_S and size_bytes <= MOST_BYTES):
        return
    cost = f"{what}: about {in_words(seconds, size_bytes)}"
    if seconds > most_s or size_bytes > MOST_BYTES:
        raise InputError(
            cost,
            f"at most {in_words(most_s, MOST_BYTES)} unless you say so",
            "correct the number that makes it so large, or add --yes",
        )
    if sys.stderr is not None:
        print(cost, file=sys.stderr)


def in_words(seconds: float, size_bytes: float) -> str:
    """Time and memory as a reader says them; what is small is left out."""
    parts = []
    if seconds >= 1.0:
        unit, size = next((unit, size) for unit, size in UNITS if seconds >= 2 * size or size == 1.0)
        parts.append(f"{seconds / size:.2g} {unit}" if seconds < 10 * size else f"{seconds / size:.0f} {unit}")
    if size_bytes >= 0.1e9:
        parts.append(f"{size_bytes / 1e9:.2g} GB" if size_bytes < 1e12 else f"{size_bytes / 1e12:.0f} TB")
    return " and ".join(parts) or "a moment"


@dataclass
class Budget:
    """The time of a command, which all its parts share: ``most_s``, unless the user said ``yes``; ``spent_s`` of it so
    far, without compiling, which only a machine's first run has to do.
    """

    yes: bool
    most_s: float = MOST_S
    spent_s: float = 0.0

    def within(self, work: Callable[[], Result], what: str) -> Result:
        """What ``work()`` gives, in a thread of its own: Ctrl-C ends the wait at once, and so does the budget's end.

        For compiled loops, which see neither a signal nor a clock.  The thread cannot be stopped; it goes with the
        process.
        """
        from ovines.workers.compile_clock import compile_clock  # loads numba, which the work does at once

        done: list[Result] = []
        failed: list[BaseException] = []

        def run() -> None:
            try:
                done.append(work())
            except BaseException as error:
                failed.append(error)

        thread = threading.Thread(target=run, daemon=True, name=THREAD)
        began, before_s = time.monotonic(), self.spent_s
        with compile_clock() as clock:
            thread.start()
            while thread.is_alive():
                thread.join(LOOK_S)
                self.spent_s = before_s + time.monotonic() - began - clock.spent_s()
                if not self.yes and thread.is_alive() and self.spent_s > self.most_s:
                    raise InputError(
                        f"{what} is not done after {in_words(self.most_s, 0)}",
                        "an end within that time unless you say so",
                        "shorten it (duration, rate, frequencies, tolerance), or add --yes to wait for it",
                    )
            self.spent_s = before_s + time.monotonic() - began - clock.spent_s()  # also of what was done at once
        if failed:
            raise failed[0]
        return done[0]


def within_budget(work: Callable[[], Result], what: str, yes: bool, most_s: float = MOST_S) -> Result:
    """What ``work()`` gives, for a command of one part (`Budget.within`)."""
    return Budget(yes, most_s).within(work, what)


def interruptibly(work: Callable[[], Result]) -> Result:
    """What ``work()`` gives, however long it takes; Ctrl-C ends the wait at once."""
    return within_budget(work, "", yes=True)


def given_up() -> bool:
    """Whether work goes on in this process that `within_budget` no longer waits for."""
    return any(thread.name == THREAD for thread in threading.enumerate())
