"""The arrays of one run, as the compiled engine takes them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

AXES = {"x": 0, "y": 1, "rotation": 2, "z": 3}
ACCELERATION_OF_GRAVITY = 9.81  # m/s^2, as the thesis


@dataclass(frozen=True)
class Packed:
    """Arrays of one run: floats, ints, harmonics, measured table, polygon edges, initial state."""

    p: np.ndarray
    k: np.ndarray
    drive: np.ndarray
    table: np.ndarray
    polygon: np.ndarray
    y: np.ndarray

    def copy(self) -> Packed:
        """An independent copy (the engine changes ``y``)."""
        return Packed(*(getattr(self, name).copy() for name in ("p", "k", "drive", "table", "polygon", "y")))
