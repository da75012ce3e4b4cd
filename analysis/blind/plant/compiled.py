"""Compiled code of the blind plant, kept on disk under a hash of all its sources (how: :mod:`ovines.core.compiled`, its
only loan from the core).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from ovines.core.compiled import compiler, stamp_above

Floats = npt.NDArray[np.float64]

# Compiled in are the order of the parameters' fields and the places of a state's numbers.
CONSTANTS = ("parameters.py", "state.py")
STAMP = stamp_above(Path(__file__).parent, CONSTANTS)
compiled = compiler(STAMP)
# For laws of a flight and of a blow, each with one caller: a call hands over all parameters, which costs more than most
# laws themselves.  They make no array, and call nothing that does: nothing counts references in them.
inlined = compiler(STAMP, counting=False, inline=True)
