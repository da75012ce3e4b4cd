"""What the disk remembers of its way over the floor, in compiled code: how far it has slid, in which mean direction
lately, and how far lately.

What fades does so at a rate that a law has of its own.  The engine and the flights' fits keep it for a ladder of rates,
each twice the one before, and a law reads between the rates (a cubic in the logarithm of the rate)."""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, compiled
from ovines.core.laws import words as W

# Shortest of the lengths, over the contact radius, and of the times, over that in which the disk would fall as far as
# half of it, within which ways fade.
LEAST_TRAIL, LEAST_LATELY = 0.05, 0.25
GRAVITY_M_PER_S2 = 9.81
# Places of what fades, from the way slid on.
TRAIL, LATELY = 1, 1 + 2 * W.TRAILS


@compiled
def memory_units(contact_radius_m: float) -> tuple[float, float]:
    """Length (m) and time (s) in which the ladders count for a rig of this contact radius."""
    return contact_radius_m, math.sqrt(contact_radius_m / GRAVITY_M_PER_S2)


@compiled
def slid_on(
    before: Floats, first: int, step: tuple[float, float, float], units: tuple[float, float], after: Floats, at: int
) -> None:
    """What is remembered in ``after`` from ``at`` on once the disk has slid straight on by ``step`` (x and y in m, time
    in s) from what ``before`` holds from ``first`` on (the same array may hold both); ``units``: length (m) and time
    (s) of the ladders."""
    dx, dy, time_s = step
    way = math.hypot(dx, dy)
    after[at] = before[first] + way
    length, fades_s = LEAST_TRAIL * units[0], LEAST_LATELY * units[1]
    for _ in range(W.TRAILS):
        first, at = first + 2, at + 2
        if way > 0.0:
            new = -math.expm1(-way / length)
            after[at - 1] = before[first - 1] + new * (dx / way - before[first - 1])
            after[at] = before[first] + new * (dy / way - before[first])
        else:
            after[at - 1], after[at] = before[first - 1], before[first]
        length *= 2.0
    for _ in range(W.LATELIES):
        first, at = first + 1, at + 1
        if time_s > 0.0:
            new = -math.expm1(-time_s / fades_s)
            after[at] = before[first] + new * (way / time_s * fades_s - before[first])
        else:
            after[at] = before[first] + way
        fades_s *= 2.0


@compiled
def _between(scale: float, least: float, count: int) -> tuple[int, float]:
    """The entry of a ladder with which a cubic through four begins, and how far after it ``scale`` lies, in entries."""
    place = min(max(math.log(scale / least) / math.log(2.0), 0.0), count - 1.0)
    entry = min(max(int(place) - 1, 0), count - 4)
    return entry, place - entry


@compiled
def _cubic(x: float, first: float, second: float, third: float, fourth: float) -> float:
    """The cubic through four values at 0, 1, 2 and 3, at ``x``."""
    return (
        -first * (x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0
        + second * x * (x - 2.0) * (x - 3.0) / 2.0
        - third * x * (x - 1.0) * (x - 3.0) / 2.0
        + fourth * x * (x - 1.0) * (x - 2.0) / 6.0
    )


@compiled
def trail(length_m: float, known: Floats) -> tuple[float, float]:
    """Mean direction of the way just slid as it fades within ``length_m``, along x and y (1: straight on)."""
    if known[W.MEMORY_M] <= 0.0:
        return 0.0, 0.0
    entry, x = _between(length_m, LEAST_TRAIL * known[W.MEMORY_M], W.TRAILS)
    i = W.WAY + TRAIL + 2 * entry
    return (
        _cubic(x, known[i], known[i + 2], known[i + 4], known[i + 6]),
        _cubic(x, known[i + 1], known[i + 3], known[i + 5], known[i + 7]),
    )


@compiled
def way_lately(fades_s: float, known: Floats) -> float:
    """Way just slid (m) as it fades within ``fades_s``."""
    if known[W.MEMORY_S] <= 0.0:
        return 0.0
    entry, x = _between(fades_s, LEAST_LATELY * known[W.MEMORY_S], W.LATELIES)
    i = W.WAY + LATELY + entry
    return _cubic(x, known[i], known[i + 1], known[i + 2], known[i + 3])
