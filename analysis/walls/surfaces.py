"""Surfaces as the disk's geometric centre sees them, compiled: gap, outward normal, azimuth of the contact.

A surface is a row of numbers, its kind first; all of them are fixed in the Host.  Whoever asks where a wall is, asks
here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled

Array = NDArray[np.float64]

#: kinds of surfaces, and what follows in their rows:
#: contact radius, centre (x, y in the Host), ellipse (cos, sin of twice the azimuth in the room, over the radius)
RING = 0.0
#: direction of the outward normal (Host's frame), contact distance of the disk's centre from the Host's along it
SIDE = 1.0
#: contact radius (the cylinder's and the disk's together), centre (x, y in the Host)
CYLINDER = 2.0
#: places in a row: of any kind; of what is round; of a side
KIND = 0
RADIUS, CENTRE_X, CENTRE_Y, OVAL_COS, OVAL_SIN = range(1, 6)
NORMAL, DISTANCE = 1, 2
ROW = 6


class Surface(NamedTuple):
    """A surface seen from the disk: ``gap`` of the disk's edge beyond it (m, > 0: past it), direction of its outward
    ``normal`` and ``azimuth`` of the contact from the Host's centre (rad, in the room)."""

    gap: float
    normal: float
    azimuth: float


@compiled
def surface_seen(row: Array, x: float, y: float, host_angle: float, radius_m: float) -> Surface:
    """The surface ``row`` (6,) for a disk of ``radius_m`` at x, y from the Host's centre (room's directions)."""
    if row[KIND] == SIDE:
        normal = row[NORMAL] + host_angle
        nx, ny = np.cos(normal), np.sin(normal)
        return Surface(x * nx + y * ny - row[DISTANCE], normal, np.arctan2(y + radius_m * ny, x + radius_m * nx))
    c, s = np.cos(host_angle), np.sin(host_angle)
    rx = x - (c * row[CENTRE_X] - s * row[CENTRE_Y])
    ry = y - (s * row[CENTRE_X] + c * row[CENTRE_Y])
    distance, azimuth = np.sqrt(rx * rx + ry * ry), np.arctan2(ry, rx)
    if row[KIND] == CYLINDER:
        return Surface(row[RADIUS] - distance, azimuth + np.pi, azimuth)
    cos2, sin2 = np.cos(2 * azimuth), np.sin(2 * azimuth)
    # A nearly round wall's normal differs from its radius by -r'/r.
    turn = 2 * (row[OVAL_COS] * sin2 - row[OVAL_SIN] * cos2)
    return Surface(distance - row[RADIUS] * (1 + row[OVAL_COS] * cos2 + row[OVAL_SIN] * sin2), azimuth + turn, azimuth)


@compiled
def nearest_surface(rows: Array, x: float, y: float, host_angle: float, radius_m: float) -> int:
    """Number of the surface of ``rows`` (S, 6) that the disk is farthest into, or next to."""
    best, found = -np.inf, 0
    for k in range(len(rows)):
        gap = surface_seen(rows[k], x, y, host_angle, radius_m).gap
        if gap > best:
            best, found = gap, k
    return found


@compiled
def surfaces_seen(
    rows: Array, which: NDArray[np.int64], places: Array, host_angle: Array, radius_m: float, out: Array
) -> None:
    """Fill ``out`` (N, 3: gap, normal, azimuth) with the surfaces ``which`` (N,) for disks at ``places`` (N, 2)."""
    for i in range(len(places)):
        seen = surface_seen(rows[which[i]], places[i, 0], places[i, 1], host_angle[i], radius_m)
        out[i, 0], out[i, 1], out[i, 2] = seen.gap, seen.normal, seen.azimuth
