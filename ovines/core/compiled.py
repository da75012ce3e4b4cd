"""How the engine is compiled: once per machine, kept on disk, without Python's lock.

numba keeps compiled code by the time stamp of a function's own file and does not see that a function it calls, in
another file, has changed: an upgrade could go on running old physics.  The stamp is therefore replaced by a hash of
all compiled sources of the core.  Division by zero gives inf or nan as in numpy: checks for an exception would cost a fifth of
the speed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Function = Callable[..., Any]

CONSTANTS = ("parameters.py", "dop853.py", "compiled.py")  # compiled code holds their numbers


def source_stamp(folder: Path = Path(__file__).parent) -> str:
    """Hash of every source file whose functions or constants are compiled."""
    digest = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        content = path.read_bytes()
        if path.name in CONSTANTS or b"ovines.core.compiled" in content:
            digest.update(path.name.encode() + b"\0" + content)
    return digest.hexdigest()


STAMP = source_stamp()


def stamp_above(folder: Path, constants: tuple[str, ...] = ()) -> str:
    """Hash of the core's stamp and of every file in a package's folder that imports its ``compiled``: for packages above the core.

    ``constants``: files that compile nothing themselves and whose content is compiled in, as :data:`CONSTANTS` are in the core.
    """
    digest = hashlib.sha256(STAMP.encode())
    marker = f"{folder.name}.compiled".encode()
    for path in sorted(folder.glob("*.py")):
        content = path.read_bytes()
        if path.name in constants or marker in content:
            digest.update(path.name.encode() + b"\0" + content)
    return digest.hexdigest()


def compiler(stamp: str, fastmath: bool | set[str] = False) -> Callable[[Function], Function]:
    """A decorator that compiles at the first call and keeps the code on disk under ``stamp``; ``fastmath`` as numba has it."""

    def decorate(function: Function) -> Function:
        dispatcher = njit(cache=True, nogil=True, error_model="numpy", fastmath=fastmath)(function)
        index = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
        if index is None or not hasattr(index, "_source_stamp"):  # another numba: better slow than stale
            return njit(nogil=True, error_model="numpy", fastmath=fastmath)(function)
        index._source_stamp = stamp
        return dispatcher

    return decorate


compiled = compiler(STAMP)


# For small functions on the hot path: a call hands eight arrays over and counts references on each, which costs more
# than the work itself (measured: half of the time of a right-hand side).
inlined = njit(nogil=True, error_model="numpy", inline="always")
