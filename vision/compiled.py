"""Compiled code of vision.compiled's importers, kept on disk under a hash of all their sources (see
:mod:`ovines.core.compiled`).
"""

from __future__ import annotations

from pathlib import Path

from ovines.core.compiled import compiler, inlined, stamp_above

# Sums may be reordered; not "nnan": comparisons with NaN must stay false.
FAST = {"reassoc", "contract", "arcp", "nsz"}

#: files whose types or numbers compiled code takes, though they compile nothing themselves
CONSTANTS = ("tracking/bodies/arrays.py", "../ovines/robust.py")

STAMP = stamp_above(Path(__file__).parent, CONSTANTS)
compiled = compiler(STAMP)
compiled_fast = compiler(STAMP, FAST)
# For what is called for each ray, makes no array and is given none by what it calls: to count references on a scene's
# arrays took more than half of a picture's time.
uncounted = compiler(STAMP, counting=False)

__all__ = ["compiled", "compiled_fast", "inlined", "uncounted"]
