"""The wall as the impacts themselves show it: centre, radius and ellipticity from the distances at contact."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _zero() -> Array:
    return np.zeros(2)


@dataclass(frozen=True, eq=False)
class Wall:
    """Contact distance ``contact_radius_m`` (1 + e2 . (cos 2 azimuth, sin 2 azimuth)) about ``centre_m`` (in the Host's
    frame).

    ``disk_m``: geometric centre of the disk against its centre of mass, in the disk's frame (m)."""

    contact_radius_m: float
    centre_m: Array = field(default_factory=_zero)
    disk_m: Array = field(default_factory=_zero)
    ellipse: Array = field(default_factory=_zero)

    def normal_turn(self, azimuth: Array) -> Array:
        """Angle by which the wall's normal differs from the radius: -r'/r for a nearly round wall."""
        return 2 * (self.ellipse[0] * np.sin(2 * azimuth) - self.ellipse[1] * np.cos(2 * azimuth))

    def distance(self, azimuth: Array) -> Array:
        """Contact distance at an azimuth."""
        return self.contact_radius_m * (
            1 + self.ellipse[0] * np.cos(2 * azimuth) + self.ellipse[1] * np.sin(2 * azimuth)
        )


#: columns of :func:`wall_design`
WALL_TERMS = ("radius", "centre_x", "centre_y", "disk_x", "disk_y", "ellipse_c", "ellipse_s")


def wall_design(azimuth: Array, host_angle: Array, body: Array, contact_radius_m: float) -> Array:
    """(K, 7) derivative of the observed contact distance with respect to :data:`WALL_TERMS`.

    A wall centre at c makes the distance seen from the Host's centre larger by c . n; a geometric centre at g in the
    disk makes the distance of the centre of mass smaller by g . n (both n seen in the body concerned).
    """
    seen = azimuth - host_angle
    return np.stack(
        [
            np.ones_like(azimuth),
            np.cos(seen),
            np.sin(seen),
            -np.cos(body),
            -np.sin(body),
            contact_radius_m * np.cos(2 * azimuth),
            contact_radius_m * np.sin(2 * azimuth),
        ],
        -1,
    )


def moved(wall: Wall, step: Array) -> Wall:
    """``wall`` changed by a step in :data:`WALL_TERMS`."""
    return replace(
        wall,
        contact_radius_m=wall.contact_radius_m + step[0],
        centre_m=wall.centre_m + step[1:3],
        disk_m=wall.disk_m + step[3:5],
        ellipse=wall.ellipse + step[5:7],
    )
