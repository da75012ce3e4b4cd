"""What a flight knows of its run beside its parameters."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.motion.host_table import HostTable
from ovines.core.laws import words as W

Array = NDArray[np.float64]

NO_LAW = np.zeros((0, W.ROW_SIZE))
NO_WAY = np.zeros((0, 1 + W.MEMORY_SIZE))


class FlightRig(NamedTuple):
    """What a flight knows of its run beside the parameters.

    ``host``: the Host's path (:meth:`analysis.motion.host_path.HostMotion.table`); ``inertia_factor`` q of
    I = q m R^2; ``omega_rad_per_s`` and ``phase_rad`` at t = 0 of the drive's main line; ``law``: terms of a written
    law, which counts time from ``start_s`` on and runs from 0 (``number``); ``middle_x_m``, ``middle_y_m``: the disk's
    geometric centre from its centre of mass, in the disk's frame: there the floor's friction acts; ``start_rad``: its
    angle as the run began; ``way``: time (s) of each frame and what the disk remembers then of its way over the floor
    (:mod:`ovines.core.laws.memory`), as far as somebody asks.
    """

    host: HostTable
    omega_rad_per_s: float
    radius_m: float
    inertia_factor: float
    contact_radius_m: float
    phase_rad: float
    law: Array = NO_LAW
    start_s: float = 0.0
    number: float = 0.0
    middle_x_m: float = 0.0
    middle_y_m: float = 0.0
    start_rad: float = 0.0
    way: Array = NO_WAY
