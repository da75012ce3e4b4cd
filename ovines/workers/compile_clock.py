"""What compiling takes of a command's time: once per machine and version, and no part of what the user asked for."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from ovines.core.kernel import Guard, Kernel


class CompileClock(Guard):
    """Counts the time in which kernels are loaded, compiled or waited for; asks the guard before it all the same."""

    def __init__(self, before: Guard) -> None:
        self._before, self._done_s = before, 0.0
        self._since_s: float | None = None

    @contextmanager
    def alone(self, kernel: Kernel) -> Iterator[None]:
        """Entered while the kernel is loaded or compiled."""
        self._since_s = time.monotonic()
        try:
            with self._before.alone(kernel):
                yield
        finally:
            self._done_s, self._since_s = self.spent_s(), None

    def begins(self, kernel: Kernel) -> None:
        """The kernel is not on the disk."""
        self._before.begins(kernel)

    def spent_s(self) -> float:
        """Seconds so far, of what is compiled now too."""
        since_s = self._since_s
        return self._done_s + (0.0 if since_s is None else time.monotonic() - since_s)


@contextmanager
def compile_clock() -> Iterator[CompileClock]:
    """The clock, as every kernel's guard within."""
    before = Kernel.guard
    clock = CompileClock(before)
    Kernel.guard = clock
    try:
        yield clock
    finally:
        Kernel.guard = before
