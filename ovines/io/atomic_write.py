"""A file is there whole or not at all: write beside it, flush to the disk, rename."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TEMPORARY_SUFFIX = ".unfinished"


@contextmanager
def written_whole(path: str | Path) -> Iterator[Path]:
    """Give a temporary path in the folder of ``path``; rename it to ``path`` when the block ends well.

    The temporary name lies in the same folder because a rename is atomic only within one file system.  When
    the block raises (a full disk included) the temporary file is removed and an older ``path`` stays as it
    was.  After a SIGKILL the temporary file may stay; its name carries the process number and ends in
    ``.unfinished``, and `remove_unfinished` clears it away.
    """
    path = Path(path).absolute()  # libraries take a relative one like "tcp:/a" or "a::b" for an address on the net
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}{TEMPORARY_SUFFIX}")
    try:
        yield temporary
        with open(temporary, "rb") as handle:  # the data must be on the disk before the name is
            os.fsync(handle.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def write_text_whole(text: str, path: str | Path) -> None:
    """Write UTF-8 ``text`` to ``path``, whole or not at all."""
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def remove_unfinished(folder: Path) -> None:
    """Remove what a killed process left half written in ``folder`` (call it only under the folder's lock).

    Our own temporary names only, with a process number before the ending: any other file is somebody else's.
    """
    for path in folder.glob(f".*{TEMPORARY_SUFFIX}"):
        if re.fullmatch(rf"\..+\.\d+{re.escape(TEMPORARY_SUFFIX)}", path.name):
            path.unlink(missing_ok=True)
