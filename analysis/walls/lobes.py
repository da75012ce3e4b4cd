"""A nearly round wall with lobes: contact radius R_c (1 + c cos n psi + s sin n psi), psi the azimuth in the Host."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.walls.outlines import Ring
from analysis.walls.surfaces import RING
from analysis.walls.wall import Wall

Array = NDArray[np.float64]
#: free terms of the lobes, over the contact radius
LOBE_TERMS = ("lobe_c", "lobe_s")
#: orders that are tried: two is an ellipse, and a dozen lobes are as near to each other as impacts are
ORDERS = tuple(range(3, 13))
# An order is tried where the impacts show each of its lobes so many times.
FEWEST_PER_LOBE = 4


def _zero() -> Array:
    return np.zeros(2)


@dataclass(frozen=True, eq=False)
class LobedWall(Wall):
    """:class:`analysis.walls.wall.Wall` whose ring has ``order`` lobes of the coefficients ``lobes`` (2,), fixed in the
    Host."""

    order: int = 0
    lobes: Array = field(default_factory=_zero)

    @classmethod
    def of(cls, wall: Wall, order: int) -> LobedWall:
        """``wall`` with lobes that are nil so far."""
        return cls(wall.outline, wall.cylinder, wall.disk_m, order)

    def values(self) -> dict[str, float]:
        """Free terms, those of the lobes last."""
        return super().values() | dict(zip(LOBE_TERMS, map(float, self.lobes), strict=True))

    @property
    def nominal_terms(self) -> tuple[str, ...]:
        """The free terms of a wall that is what it is meant to be."""
        return tuple(name for name in super().nominal_terms if name not in LOBE_TERMS)

    def moved(self, step: dict[str, float]) -> LobedWall:
        """With its terms changed."""
        wall = super().moved(step)
        lobes = self.lobes + np.array([step.get(name, 0.0) for name in LOBE_TERMS])
        return LobedWall(wall.outline, wall.cylinder, wall.disk_m, self.order, lobes)

    def over(self, length: float) -> LobedWall:
        """In units of ``length``."""
        wall = super().over(length)
        return LobedWall(wall.outline, wall.cylinder, wall.disk_m, self.order, self.lobes)

    def seen(self, which: NDArray[np.int64], places_m: Array, host_angle_rad: Array, radius_m: float) -> Array:
        """As the round wall is seen, with the lobes' part of gap and normal."""
        out = super().seen(which, places_m, host_angle_rad, radius_m)
        if not isinstance(self.outline, Ring):
            return out
        columns = lobe_columns(out[:, 2] - host_angle_rad, self.order)
        ring = self.surfaces[which][:, 0] == RING
        out[:, 0] -= np.where(ring, self.outline.radius_m * (columns @ self.lobes), 0.0)
        # The normal of a nearly round wall differs from its radius by -r'/r.
        turned = self.order * (columns[:, 1] * self.lobes[0] - columns[:, 0] * self.lobes[1])
        out[:, 1] += np.where(ring, turned, 0.0)
        return out


def lobe_columns(azimuth_rad: Array, order: int) -> Array:
    """cos and sin (K, 2) of ``order`` times azimuths (K,)."""
    return np.column_stack([np.cos(order * azimuth_rad), np.sin(order * azimuth_rad)])


def best_order(azimuth_rad: Array, design: Array, residual: Array, without: int = 0) -> int:
    """The order of lobes (K azimuths in the Host) that takes most of a ``residual`` (K,) beside the columns ``design``
    (K, P); 0 of too few impacts."""
    orders = [n for n in ORDERS if n != without and len(azimuth_rad) >= FEWEST_PER_LOBE * n]
    if not orders:
        return 0
    left = []
    for order in orders:
        columns = np.column_stack([design, lobe_columns(azimuth_rad, order)])
        left.append(float(np.sum((residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0]) ** 2)))
    return orders[int(np.argmin(left))]
