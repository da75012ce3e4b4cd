"""Cases in processes of their own, as they get ready; and a trial's files that may be damaged."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from joblib import Parallel, delayed

from ovines.errors import InputError
from ovines.workers.orphans import die_with

Result = TypeVar("Result")
Say = Callable[[str], None]  # takes a line of progress


def of_each(
    work: Callable[..., Result], cases: Iterable[tuple[Any, ...]], jobs: int, ordered: bool = False
) -> Iterator[Result]:
    """``work(*case)`` of every case as it gets ready, or ``ordered`` as given; ``jobs`` at a time, in processes that
    end with this one."""
    # A worker that keeps what it has loaded is taken for one that leaks, and another goes on: no case is lost.
    warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
    results: Iterator[Result] = Parallel(n_jobs=jobs, return_as="generator" if ordered else "generator_unordered")(
        delayed(_below)(os.getpid(), work, case) for case in cases
    )
    return results


def _below(parent: int, work: Callable[..., Result], case: tuple[Any, ...]) -> Result:
    die_with(parent)
    return work(*case)


@contextmanager
def well_formed(folder: Path) -> Iterator[None]:
    """Turn what a damaged manifest, truth or answer does to its reader into an `InputError`."""
    try:
        yield
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, RecursionError, FileNotFoundError) as error:
        said = f"{type(error).__name__}: {error}".split("\n")[0][:200]
        raise InputError(
            f"{folder}: a manifest, truth or answer that cannot be used ({said})",
            "the files as `ovines blind` wrote them",
            "make the trial again",
        ) from None
