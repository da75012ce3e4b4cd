"""One run per results folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from ovines.errors import InputError

LOCK = ".lock"


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Keep other processes out of ``out``; the system lets go of the lock when a process dies, however it dies."""
    try:
        out.mkdir(parents=True, exist_ok=True)
        with FileLock(out / LOCK, timeout=0):
            yield
    except Timeout:
        raise InputError(
            f"another ovines is writing into {out}",
            "one run per results folder",
            "wait for it, or name another --out",
        ) from None
    except (FileExistsError, NotADirectoryError):
        raise InputError(f"--out {out} is a file", "a folder", "name another --out") from None
