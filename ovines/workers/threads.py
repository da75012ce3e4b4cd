"""Work on several runs in threads: compiled code gives up Python's lock, so two threads use two processors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from joblib import Parallel, delayed

THREADS = 2


def in_threads(function: Callable[..., Any], calls: Sequence[tuple[Any, ...]]) -> list[Any]:
    """``function`` of each of ``calls`` (its arguments), in their order."""
    if len(calls) < THREADS:
        return [function(*arguments) for arguments in calls]
    return list(Parallel(n_jobs=THREADS, prefer="threads")(delayed(function)(*arguments) for arguments in calls))
