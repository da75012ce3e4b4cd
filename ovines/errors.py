"""The one error a user sees: what was found, what was expected, what to do.

Raised wherever input is wrong; only ``ovines.__main__`` catches it and turns it
into three lines and exit status 2.  "No impact" or "marker hidden" are values
in a table, never errors.
"""

from __future__ import annotations

import errno
from pathlib import Path


class InputError(Exception):
    """Input that cannot be used as it is.

    Parameters
    ----------
    found, expected, do : str
        What stood in the input (with file and line or key), what belongs there,
        and what the user can do about it.
    """

    def __init__(self, found: str, expected: str, do: str) -> None:
        super().__init__(f"found:    {found}\nexpected: {expected}\ndo:       {do}")
        self.found = found
        self.expected = expected
        self.do = do

    def __reduce__(
        self,
    ) -> tuple[
        type[InputError], tuple[str, str, str]
    ]:  # workers hand it through a pickle; the default would lose two fields
        return type(self), (self.found, self.expected, self.do)


ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
PERMISSION = (errno.EACCES, errno.EPERM)
PATHS = (
    errno.ENAMETOOLONG,
    errno.ELOOP,
    errno.ENOTDIR,
    errno.EISDIR,
    errno.EEXIST,
    errno.ENOENT,
    errno.EINVAL,
    errno.ENXIO,
    errno.EBUSY,
)


def refusal_of(error: OSError, place: str | Path = "") -> InputError | None:
    """What a full disk, a missing permission or an impossible path is to the user; None for any other ``OSError``.

    ``place`` stands in where the error does not say which file it was.
    """
    name = str(error.filename or place)
    found = f"{name[:200] + '...' if len(name) > 200 else name}: {error.strerror or error}".removeprefix(": ")
    if error.errno in ROOM:
        return InputError(found, "room and permission to write there",
                          "free some space or name another --out, and run again: finished stages are kept")  # fmt: skip
    if error.errno in PERMISSION:
        return InputError(
            found,
            "room and permission to read and write there",
            "change its permissions or name another --out, and run again: finished stages are kept",
        )
    if error.errno in PATHS:
        return InputError(found, "a path that can be read or written", "check the path, and --out")
    return None
