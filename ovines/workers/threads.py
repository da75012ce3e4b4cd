"""Work on several runs in threads: compiled code gives up Python's lock, so two threads use two processors."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

THREADS = 2


def in_threads(function: Callable[..., Any], calls: Sequence[tuple[Any, ...]]) -> list[Any]:
    """``function`` of each of ``calls`` (its arguments), in their order; the first failure is raised."""
    if len(calls) < THREADS:
        return [function(*arguments) for arguments in calls]
    out: list[Any] = [None] * len(calls)
    failed: list[BaseException] = []
    waiting = iter(enumerate(calls))
    one_at_a_time = threading.Lock()

    def work() -> None:
        while not failed:
            with one_at_a_time:
                number, arguments = next(waiting, (-1, ()))
            if number < 0:
                return
            try:
                out[number] = function(*arguments)
            except BaseException as error:
                failed.append(error)

    # The waiting thread works too.  A pool would cost more than most calls, and hold up the program's end.
    helpers = [threading.Thread(target=work, daemon=True) for _ in range(THREADS - 1)]
    for helper in helpers:
        helper.start()
    work()
    for helper in helpers:
        helper.join()
    if failed:
        raise failed[0]
    return out
