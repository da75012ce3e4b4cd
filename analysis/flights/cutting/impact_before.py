"""The impact with which a flight began: when it was, and where the disk touched the wall."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import RunData

Array = NDArray[np.float64]

# Frames on either side of an impact that say where it was; fewer than these make no line.
CONTACT_FRAMES, LINE = 4, 2
# An impact that never was: long ago (s).
LONG_AGO_S = -1e6


def impact_before(run: RunData, flights: Sequence[Flight], k: int) -> float:
    """When the impact was with which flight ``k`` began and the flight before ended; long ago without one.

    Midway between their frames: the first frame comes half a frame late, which made what dies out after an impact
    smaller.  Pieces of a long flight began with the first of them.
    """
    k = first_piece(flights, k)
    if k == 0 or not flights[k - 1].joined:
        return LONG_AGO_S
    return 0.5 * float(run.time_s[flights[k - 1].last] + run.time_s[flights[k].first])


def first_piece(flights: Sequence[Flight], k: int) -> int:
    """The piece with which the flight began that flight ``k`` is a piece of."""
    while k > 0 and flights[k - 1].goes_on:
        k -= 1
    return k


def contact_before(run: RunData, flights: Sequence[Flight], k: int) -> tuple[float, float, float]:
    """Where the disk touched the wall before flight ``k``, from the Host's centre (m, m), and its normal speed before
    that (m/s); zeros without such a contact.

    From the few frames on either side of it, as they were seen: what a law asks for, not what a fit is made of.  The
    normal is the direction in which the velocity jumped."""
    k = first_piece(flights, k)
    if k == 0 or not flights[k - 1].joined:
        return 0.0, 0.0, 0.0
    before, after = flights[k - 1], flights[k]
    asked = before.first, before.last, after.first, after.last
    if asked not in run.contacts:
        run.contacts[asked] = _contact_between(run, before, after, impact_before(run, flights, k))
    return run.contacts[asked]


def _contact_between(run: RunData, before: Flight, after: Flight, time_s: float) -> tuple[float, float, float]:
    host, rate = run.host.at(np.array([time_s]))[0, :2], run.host.at(np.array([time_s]), 1)[0, :2]
    sides = [seen_frames(run, before)[-CONTACT_FRAMES:], seen_frames(run, after)[:CONTACT_FRAMES]]
    lines = [_line(run.time_s[at] - time_s, run.xy_m[at]) for at in sides if len(at)]
    if not lines:
        return 0.0, 0.0, 0.0
    place = np.mean([line[0] for line in lines], 0) - host
    jump = lines[-1][1] - lines[0][1]
    size = float(np.hypot(*jump))
    approach = float(-(lines[0][1] - rate) @ jump / size) if size > 0 else 0.0
    return float(place[0]), float(place[1]), max(approach, 0.0)


def _line(time_s: Array, xy_m: Array) -> tuple[Array, Array]:
    """Place (2,) at time 0 and velocity (2,) of the straight line through places (N, 2); at rest with one frame."""
    if len(time_s) < LINE:
        return xy_m.mean(0), np.zeros(2)
    slope, place = np.polyfit(time_s, xy_m, 1)
    return place, slope
