"""How the engine is compiled: once per machine, kept on disk, without Python's lock.

numba keeps compiled code by the time stamp of a function's own file and does not see that a function it calls, in
another file, has changed: an upgrade could go on running old physics.  The stamp is therefore replaced by a hash of all
compiled sources of the core.  Division by zero gives inf or nan as in numpy: checks for an exception would cost a fifth
of the speed.
"""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import config, njit

from ovines.core.kernel import SUPPORTED, Kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Function = Callable[..., Any]

# Compiled code holds their numbers.
CONSTANTS = ("state.py", "system/parameters.py", "laws/words.py", "integration/dop853.py", "compiled.py", "kernel.py")


def source_stamp(
    folder: Path = Path(__file__).parent, marker: str = "ovines.core.compiled", constants: tuple[str, ...] = CONSTANTS
) -> str:
    """Hash of every source file in ``folder`` and its rooms that names ``marker``, and of ``constants``: paths from the
    folder.
    """
    digest = hashlib.sha256()
    named = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.py")}
    held = {name: content for name, content in named.items() if marker.encode() in content}
    held |= {name: (folder / name).read_bytes() for name in constants if (folder / name).is_file()}
    for name, content in sorted(held.items()):
        digest.update(name.encode() + b"\0" + content)
    return digest.hexdigest()


STAMP = source_stamp()


def stamp_above(folder: Path, constants: tuple[str, ...] = ()) -> str:
    """The same for a package above the core, whose files name its own ``compiled`` and may call the core's."""
    return hashlib.sha256((STAMP + source_stamp(folder, f"{folder.name}.compiled", constants)).encode()).hexdigest()


def compiler(
    stamp: str, fastmath: bool | set[str] = False, counting: bool = True, inline: bool = False
) -> Callable[[Function], Function]:
    """A decorator that compiles at the first call and keeps the code on disk under ``stamp``; ``fastmath`` as numba has
    it; ``inline``: machine code of its callers holds it, never a call.

    ``counting``: whether references on arrays are counted.  A function that makes no array and returns none needs no
    counts, as its caller holds what it is given; with them half of a run's time went into nothing else.
    """

    def decorate(function: Function) -> Function:
        uncached = njit(nogil=True, error_model="numpy", fastmath=fastmath)
        if not SUPPORTED or config.DISABLE_JIT:  # another numba: better slow than wrong
            return uncached(function)
        options = {"nopython": True, "nogil": True, "error_model": "numpy", "fastmath": fastmath, "boundscheck": None}
        options["_nrt"] = counting
        options["forceinline"] = inline
        kernel = Kernel(function, targetoptions=options)
        try:
            kernel.enable_caching()
        except RuntimeError:  # no folder to keep code in: neither beside the sources nor in the user's own cache
            _say_once_uncached()
            return kernel
        index = getattr(getattr(kernel, "_cache", None), "_cache_file", None)
        if index is None or not hasattr(index, "_source_stamp"):  # another numba: better slow than stale
            return uncached(function)
        index._source_stamp = stamp
        return kernel

    return decorate


@cache
def _say_once_uncached() -> None:
    if sys.stderr is not None:
        print(
            "note: compiled code cannot be kept (no folder for it can be written), so that every run compiles again: "
            "minutes. Set NUMBA_CACHE_DIR to a folder of yours.",
            file=sys.stderr,
        )


# `compiled` refuses to compile what makes an array or assigns one to a slice; a function that is given a new one by
# another (`known_of`) has to be `making_arrays` too, as nothing else would free it.
compiled = compiler(STAMP, counting=False)
making_arrays = compiler(STAMP)


# For small functions on the hot path: a call hands eight arrays over, which costs more than the work itself.  LLVM puts
# them into their callers; numba would type and lower them anew in each (`inline="always"`), which takes twice as long.
inlined = compiler(STAMP, counting=False, inline=True)


@inlined
def copy_into(target: Floats, source: Floats) -> None:
    """Copy a row of numbers, without the array that an assignment to a slice makes."""
    for i in range(target.shape[0]):
        target[i] = source[i]
