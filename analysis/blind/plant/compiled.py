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
CONSTANTS = ("parameters/__init__.py", "parameters/of_flight.py", "parameters/of_wall.py", "state.py")
STAMP = stamp_above(Path(__file__).parent, CONSTANTS)
# As the core's: what makes no array counts no references; what Python asks for arrays makes them around it.
compiled = compiler(STAMP, counting=False)
making_arrays = compiler(STAMP)
# For laws of a flight and of a blow, each with one caller: a call hands over all parameters, which costs more than most
# laws themselves.
inlined = compiler(STAMP, counting=False, inline=True)


@inlined
def copy_into(target: Floats, source: Floats) -> None:
    """Copy a row of numbers: an assignment to a slice would make an array."""
    for i in range(target.shape[0]):
        target[i] = source[i]
