"""Compiled code of the vision, kept on disk under a hash of all compiled sources.

See :mod:`ovines.core.compiled`: numba by itself would go on running what a changed callee in another file once was.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from ovines.core.compiled import STAMP, compiler

# Sums may be reordered; not "nnan": comparisons with NaN must stay false.
FAST = {"reassoc", "contract", "arcp", "nsz"}


def _stamp(folder: Path = Path(__file__).parent) -> str:
    digest = hashlib.sha256(STAMP.encode())
    for path in sorted(folder.glob("*.py")):
        content = path.read_bytes()
        if b"vision.compiled" in content:
            digest.update(path.name.encode() + b"\0" + content)
    return digest.hexdigest()


compiled = compiler(_stamp())
compiled_fast = compiler(_stamp(), FAST)
