"""The arrays of one run, as the compiled engine takes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ovines.core.compiled import Floats, Ints

AXES = {"x": 0, "y": 1, "rotation": 2, "z": 3}
ACCELERATION_OF_GRAVITY = 9.81  # m/s^2, as the thesis


class System(NamedTuple):
    """What a run does not change: numbers and settings (places in `parameters`), harmonics of the drive (m, 4), pieces
    of a measured motion (n, 17), the polygon's edges (e, 3), terms of written laws (t,
    :data:`ovines.core.laws.words.ROW_SIZE`).
    """

    p: Floats
    k: Ints
    drive: Floats
    table: Floats
    polygon: Floats
    law: Floats


class Samples(NamedTuple):
    """Instants to sample (n,), their rows (n, 12), how many are written (1,), and the engine's states there with
    their energies (n, 19; no rows: not wanted).
    """

    times: Floats
    rows: Floats
    written: Ints
    states: Floats


class Contact(NamedTuple):
    """How the disk moves: the mode, the wall that it follows, the side to which it slides (sign of the slip)."""

    mode: int
    wall: int
    side: float


class Face(NamedTuple):
    """A wall as the disk meets it: unit normal towards it, gap (m), curvature of the centre's path along it (1/m)."""

    x: float
    y: float
    gap: float
    curvature: float


@dataclass(frozen=True)
class Packed:
    """Arrays of one run: floats, ints, harmonics, measured table, polygon edges, initial state, terms of laws."""

    p: np.ndarray
    k: np.ndarray
    drive: np.ndarray
    table: np.ndarray
    polygon: np.ndarray
    y: np.ndarray
    law: np.ndarray

    @property
    def system(self) -> System:
        """What the engine does not change."""
        return System(self.p, self.k, self.drive, self.table, self.polygon, self.law)

    def copy(self) -> Packed:
        """An independent copy (the engine changes ``y``)."""
        return Packed(*(getattr(self, name).copy() for name in ("p", "k", "drive", "table", "polygon", "y", "law")))
