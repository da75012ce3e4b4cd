"""The Host's path as compiled code takes it: quintic pieces of equal length, whatever the drive is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import inlined

Array = NDArray[np.float64]

# A quintic through value, rate and second rate at both ends of h misses a sixth derivative d by d h^6 / 46080, its
# second rate by d h^4 / 1920.
PLACE_MISS, RATE_MISS = 46080.0, 1920.0


class HostTable(NamedTuple):
    """The Host's path for compiled code: ``pieces`` (N, 4, 6) quintics of x, y, z (m) and angle (rad) in the share of
    a step since ``first_s + i step_s``, lowest power first; beyond them it goes on with the velocity it has there.
    ``strongest_m_per_s2`` bounds its acceleration in the plane.
    """

    pieces: Array
    first_s: float
    step_s: float
    strongest_m_per_s2: float


class HostState(NamedTuple):
    """Pose of the Host (m, rad), its rates, and its vertical acceleration (m/s^2) at one instant."""

    x: float
    y: float
    z: float
    angle: float
    vx: float
    vy: float
    vz: float
    spin: float
    lift: float


def quintics(value: Array, rate: Array, second_rate: Array) -> Array:
    """Pieces (N, 4, 6) through values, rates and second rates (N + 1, 4), per step, at their ends."""
    gap = np.diff(value, axis=0)
    v0, v1, a0, a1 = rate[:-1], rate[1:], second_rate[:-1], second_rate[1:]
    pieces = [
        value[:-1],
        v0,
        0.5 * a0,
        10 * gap - 6 * v0 - 4 * v1 - 1.5 * a0 + 0.5 * a1,
        -15 * gap + 8 * v0 + 7 * v1 + 1.5 * a0 - a1,
        6 * gap - 3 * (v0 + v1) - 0.5 * (a0 - a1),
    ]
    return np.ascontiguousarray(np.stack(pieces, -1))


@inlined
def host_at(t: float, path: HostTable) -> HostState:
    """The Host at time t (s)."""
    steps = (t - path.first_s) / path.step_s
    inside = min(max(steps, 0.0), float(len(path.pieces)))
    i = min(int(inside), len(path.pieces) - 1)
    s, beyond = inside - i, steps - inside
    per_s = 1.0 / path.step_s
    piece = path.pieces[i]
    x, vx = _place_and_rate(piece[0], s)
    y, vy = _place_and_rate(piece[1], s)
    z, vz = _place_and_rate(piece[2], s)
    angle, spin = _place_and_rate(piece[3], s)
    lift = 0.0
    if beyond == 0.0:
        lift = _second_rate(piece[2], s) * per_s * per_s
    return HostState(
        x + beyond * vx,
        y + beyond * vy,
        z + beyond * vz,
        angle + beyond * spin,
        vx * per_s,
        vy * per_s,
        vz * per_s,
        spin * per_s,
        lift,
    )


@inlined
def host_acceleration_at(t: float, path: HostTable) -> tuple[float, float]:
    """Acceleration of the Host in the plane at time t (m/s^2); none beyond the path's ends."""
    steps = (t - path.first_s) / path.step_s
    if steps < 0.0 or steps > len(path.pieces):
        return 0.0, 0.0
    i = min(int(steps), len(path.pieces) - 1)
    s, per_s2 = steps - i, 1.0 / path.step_s**2
    return _second_rate(path.pieces[i, 0], s) * per_s2, _second_rate(path.pieces[i, 1], s) * per_s2


@inlined
def _second_rate(c: Array, s: float) -> float:
    """Second derivative of the quintic ``c`` (6,) at s."""
    return 2 * c[2] + s * (6 * c[3] + s * (12 * c[4] + s * 20 * c[5]))


@inlined
def _place_and_rate(c: Array, s: float) -> tuple[float, float]:
    """Value and slope of the quintic ``c`` (6,) at s."""
    place = c[0] + s * (c[1] + s * (c[2] + s * (c[3] + s * (c[4] + s * c[5]))))
    return place, c[1] + s * (2 * c[2] + s * (3 * c[3] + s * (4 * c[4] + s * 5 * c[5])))
