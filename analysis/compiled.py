"""Compiled code of analysis.compiled's importers, kept on disk under a hash of all their sources (see
:mod:`ovines.core.compiled`).
"""

from __future__ import annotations

from pathlib import Path

from ovines.core.compiled import compiler, stamp_above

#: files whose numbers or types compiled code holds, though they compile nothing themselves
CONSTANTS = ("flights/equation/parameters.py", "flights/cutting/flight_rig.py", "flights/noise.py", "contact/law.py")

STAMP = stamp_above(Path(__file__).parent, CONSTANTS)
# As the core's: what makes no array counts no references, which took more than half of a flight's time.
compiled = compiler(STAMP, counting=False)
making_arrays = compiler(STAMP)
# For parts of a kernel that stand alone to be read: machine code of their callers holds them, never a call.
inlined = compiler(STAMP, counting=False, inline=True)
