"""Compiled code of vision.compiled's importers, kept on disk under a hash of all their sources (see
:mod:`ovines.core.compiled`).
"""

from __future__ import annotations

from pathlib import Path

from ovines.core.compiled import compiler, inlined, stamp_above

# Sums may be reordered; not "nnan": comparisons with NaN must stay false.
FAST = {"reassoc", "contract", "arcp", "nsz"}

#: files whose types compiled code takes, though they compile nothing themselves
CONSTANTS = ("tracking/bodies/arrays.py",)

STAMP = stamp_above(Path(__file__).parent, CONSTANTS)
compiled = compiler(STAMP)
compiled_fast = compiler(STAMP, FAST)

__all__ = ["compiled", "compiled_fast", "inlined"]
