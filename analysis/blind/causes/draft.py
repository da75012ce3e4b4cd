"""A series before it runs."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

FULL_MODEL = ("floor_friction", "spin_coupling")


@dataclass
class Draft:
    """One series before it runs; causes edit it.

    ``run_friction`` and ``run_restitution`` multiply the floor's friction and the restitution run by run,
    ``run_numbers`` are numbers of the plant that each run has of its own.  ``sway``: a slow line of the Host
    (amplitude, frequency in Hz, direction), ``ringing`` (modal mass, frequency in Hz, damping ratio) of what carries
    its markers; ``parameters`` holds what each cause set, by the cause's name.
    """

    plant: dict[str, float] = field(default_factory=dict)
    view: dict[str, Any] = field(default_factory=dict)
    model_effects: tuple[str, ...] = FULL_MODEL
    vertical_amplitude_m: float = 0.0
    run_friction: np.ndarray | None = None
    run_restitution: np.ndarray | None = None
    run_numbers: dict[str, np.ndarray] = field(default_factory=dict)
    sway: tuple[float, float, float] | None = None
    ringing: tuple[float, float, float] | None = None
    parameters: dict[str, dict[str, float]] = field(default_factory=dict)
