"""What a written law may know of the disk, from the engine's state."""

from __future__ import annotations

import math

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, making_arrays
from ovines.core.laws import words as W
from ovines.core.laws.memory import slid_on
from ovines.core.system import parameters as P


@making_arrays
def known_of(t: float, y: Floats, at: Floats, scratch: Floats, p: Floats, k: Ints) -> Floats:
    """The vector of :mod:`ovines.core.laws.words` at state ``y`` with its place ``at`` (``scratch`` as `place` left
    it); friction and the speeds before an impact are left to the caller.  Only a driven Host's acceleration is known.
    """
    known = np.zeros(W.KNOWN_SIZE)
    known[W.VX], known[W.VY] = at[S.VX], at[S.VY]
    known[W.UX], known[W.UY] = at[S.VX], at[S.VY]
    if not k[P.ON_GROUND]:
        known[W.UX] -= at[S.HOST_VX] - at[S.HOST_SPIN] * (at[S.Y] - at[S.HOST_Y])
        known[W.UY] -= at[S.HOST_VY] + at[S.HOST_SPIN] * (at[S.X] - at[S.HOST_X])
    known[W.X], known[W.Y] = at[S.X], at[S.Y]
    known[W.HX], known[W.HY] = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    known[W.CONTACT_RADIUS], known[W.ANGLE], known[W.SPIN] = p[P.CONTACT_RADIUS], y[S.ANGLE], y[S.SPIN]
    known[W.TIME], known[W.RUN] = t, p[P.RUN_NUMBER]
    known[W.CLOCK] = p[P.DRIVE_RATE] * t
    known[W.PHASE] = known[W.CLOCK] + p[P.DRIVE_PHASE]
    known[W.SINCE] = min(t - p[P.LAST_IMPACT], W.LONG_AGO_S)
    known[W.LAST_X], known[W.LAST_Y], known[W.LAST_APPROACH] = p[P.LAST_X], p[P.LAST_Y], p[P.LAST_APPROACH]
    known[W.LAST_ANGLE], known[W.LAST_SLIP] = p[P.LAST_ANGLE], p[P.LAST_SLIP]
    for i in range(W.MOST_BLOWS):
        known[W.BLOW_TIMES + i], known[W.BLOW_SPEEDS + i] = p[P.BLOW_TIMES + i], p[P.BLOW_SPEEDS + i]
        known[W.BLOW_WAYS + i], known[W.BLOW_SIDES + i] = p[P.BLOW_WAYS + i], p[P.BLOW_SIDES + i]
        known[W.BLOW_SLIPS + i] = p[P.BLOW_SLIPS + i]
    known[W.BLOWS], known[W.START_ANGLE], known[W.LAST_LEFT] = p[P.BLOWS], p[P.START_ANGLE], p[P.LAST_LEFT]
    known[W.DISK_RADIUS] = p[P.RADIUS]
    if p[P.MEMORY_M] > 0.0:
        slid_on(p, P.WAY, way_from(t, at, p), (p[P.MEMORY_M], p[P.MEMORY_S]), known, W.WAY)
        known[W.WAY_BEFORE] = p[P.WAY_BEFORE]
        known[W.BEFORE_X], known[W.BEFORE_Y] = p[P.BEFORE_X], p[P.BEFORE_Y]
        known[W.MEMORY_M], known[W.MEMORY_S] = p[P.MEMORY_M], p[P.MEMORY_S]
    if k[P.HOST_KIND] == P.DRIVEN:
        known[W.HOST_AX], known[W.HOST_AY] = scratch[S.BASE_AX], scratch[S.BASE_AY]
    return known


@compiled
def way_from(t: float, at: Floats, p: Floats) -> tuple[float, float, float]:
    """Straight way (m) over the floor, and time (s), from where the way was remembered last to the place ``at``; a
    floor that turns takes what lies on it along."""
    x, y = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y]
    turned = at[S.HOST_ANGLE] - p[P.WAY_HOST]
    dx, dy = x - p[P.WAY_X], y - p[P.WAY_Y]
    return (
        dx + 0.5 * turned * (y + p[P.WAY_Y]),
        dy - 0.5 * turned * (x + p[P.WAY_X]),
        max(t - p[P.WAY_TIME], 0.0),
    )


@compiled
def _stand_at(t: float, at: Floats, p: Floats) -> None:
    p[P.WAY_TIME], p[P.WAY_X], p[P.WAY_Y], p[P.WAY_HOST] = (
        t,
        at[S.X] - at[S.HOST_X],
        at[S.Y] - at[S.HOST_Y],
        at[S.HOST_ANGLE],
    )


@compiled
def begin_way(t: float, at: Floats, p: Floats) -> None:
    """A run begins in place ``at``: nothing has been slid."""
    for i in range(W.MEMORY_SIZE):
        p[P.WAY + i] = 0.0
    p[P.WAY_BEFORE] = 0.0
    _stand_at(t, at, p)


@compiled
def remember_way(t: float, at: Floats, p: Floats) -> None:
    """Keep what the disk has slid up to the place ``at``, for what asks about its way."""
    slid_on(p, P.WAY, way_from(t, at, p), (p[P.MEMORY_M], p[P.MEMORY_S]), p, P.WAY)
    _stand_at(t, at, p)


@compiled
def forget_contacts(angle: float, p: Floats) -> None:
    """A run begins at an ``angle`` of the disk: no impact was before."""
    p[P.LAST_IMPACT], p[P.LAST_X], p[P.LAST_Y], p[P.BLOWS] = -math.inf, 0.0, 0.0, 0.0
    p[P.START_ANGLE], p[P.BEFORE_X], p[P.BEFORE_Y] = angle, 0.0, 0.0
    for i in range(W.MOST_BLOWS):
        p[P.BLOW_SPEEDS + i] = 0.0


@compiled
def remember_contact(t: float, at: Floats, y: Floats, speeds: tuple[float, float], inwards: bool, p: Floats) -> None:
    """Keep an impact in place ``at``, met at normal and tangential ``speeds`` (m/s), that left the disk in state ``y``,
    for what asks about contacts before; ``inwards``: it pushed the Host towards its centre, as one at a cylinder does.

    Numbers that a run writes into its parameters; all others stay."""
    p[P.LAST_IMPACT], p[P.LAST_APPROACH], p[P.LAST_SLIP] = t, speeds[0], speeds[1]
    p[P.BEFORE_X], p[P.BEFORE_Y], p[P.WAY_BEFORE] = p[P.LAST_X], p[P.LAST_Y], p[P.WAY]
    p[P.LAST_X], p[P.LAST_Y], p[P.LAST_ANGLE] = at[S.X] - at[S.HOST_X], at[S.Y] - at[S.HOST_Y], y[S.ANGLE]
    p[P.LAST_LEFT] = math.hypot(y[S.VX] - at[S.HOST_VX], y[S.VY] - at[S.HOST_VY])
    for i in range(W.MOST_BLOWS - 1, 0, -1):
        p[P.BLOW_TIMES + i], p[P.BLOW_SPEEDS + i] = p[P.BLOW_TIMES + i - 1], p[P.BLOW_SPEEDS + i - 1]
        p[P.BLOW_WAYS + i], p[P.BLOW_SIDES + i] = p[P.BLOW_WAYS + i - 1], p[P.BLOW_SIDES + i - 1]
        p[P.BLOW_SLIPS + i] = p[P.BLOW_SLIPS + i - 1]
    p[P.BLOW_TIMES], p[P.BLOW_SPEEDS], p[P.BLOW_SLIPS] = t, speeds[0], speeds[1]
    p[P.BLOW_WAYS] = math.atan2(p[P.LAST_Y], p[P.LAST_X]) + (math.pi if inwards else 0.0)
    p[P.BLOW_SIDES] = p[P.BLOW_WAYS] - y[S.ANGLE]
    p[P.BLOWS] += 1.0


@making_arrays
def contact_known(
    t: float,
    y: Floats,
    at: Floats,
    scratch: Floats,
    contact: tuple[float, float, float, float, float],
    p: Floats,
    k: Ints,
) -> Floats:
    """The same before an impact; ``contact``: azimuth of the contact, normal and tangential speed, speed of the wall
    along its outward normal, and of the disk's centre along the wall."""
    known = known_of(t, y, at, scratch, p, k)
    known[W.HX], known[W.HY] = math.cos(contact[0]), math.sin(contact[0])
    known[W.APPROACH], known[W.SLIP] = contact[1], contact[2]
    known[W.WALL_SPEED], known[W.PASSING] = contact[3], contact[4]
    return known
