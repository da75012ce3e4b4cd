"""The impact with which a flight began: when it was, and where the disk touched the wall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, NO_CONTACT, Contact, RunData
from ovines.core.laws.words import MOST_BLOWS

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


def contact_before(run: RunData, flights: Sequence[Flight], k: int) -> Contact:
    """The contact with which flight ``k`` began; zeros without such a contact.

    From the few frames on either side of it, as they were seen: what a law asks for, not what a fit is made of.  The
    normal is the direction in which the velocity jumped."""
    k = first_piece(flights, k)
    if k == 0 or not flights[k - 1].joined:
        return NO_CONTACT
    before, after = flights[k - 1], flights[k]
    asked = before.first, before.last, after.first, after.last
    if asked not in run.contacts:
        run.contacts[asked] = _contact_between(run, before, after, impact_before(run, flights, k))
    return run.contacts[asked]


def contact_before_last(run: RunData, flights: Sequence[Flight], k: int) -> Contact:
    """The contact with which the flight before flight ``k`` began, which that with which ``k`` began ended; zeros
    without both."""
    k = first_piece(flights, k)
    return contact_before(run, flights, k - 1) if k > 0 and flights[k - 1].joined else NO_CONTACT


def way_before(run: RunData, flights: Sequence[Flight], k: int) -> float:
    """Way slid (m) in the run at the impact with which flight ``k`` began; 0 for its first flight, -1 where another
    began without one."""
    k = first_piece(flights, k)
    if k == 0:
        return 0.0
    return float(np.interp(impact_before(run, flights, k), *run.way[:, :2].T)) if flights[k - 1].joined else -1.0


def blows_before(run: RunData, flights: Sequence[Flight], k: int) -> Array:
    """Times (s), normal speeds (m/s), directions (rad) in the room and seen from the disk, and tangential speeds (m/s)
    of the impacts before flight ``k`` (5, MOST_BLOWS), the latest first, of those with a flight on either side; zeros
    further back."""
    out, k = np.zeros((5, MOST_BLOWS)), first_piece(flights, k)
    for i in range(MOST_BLOWS):
        while k > 0 and not flights[k - 1].joined:
            k = first_piece(flights, k - 1)
        if k == 0:
            break
        contact = contact_before(run, flights, k)
        side_rad = contact.push_rad - contact.angle_rad
        speeds = contact.approach_m_per_s, contact.slip_m_per_s
        out[:, i] = impact_before(run, flights, k), speeds[0], contact.push_rad, side_rad, speeds[1]
        k = first_piece(flights, k - 1)
    return out


def number_of_blows(flights: Sequence[Flight], k: int) -> int:
    """How many impacts the run had before flight ``k``, of those with a flight on either side."""
    return sum(one.joined and not one.goes_on for one in flights[: first_piece(flights, k)])


def _contact_between(run: RunData, before: Flight, after: Flight, time_s: float) -> Contact:
    host, rate = run.host.at(np.array([time_s]))[0, :2], run.host.at(np.array([time_s]), 1)[0, :2]
    sides = [seen_frames(run, before)[-CONTACT_FRAMES:], seen_frames(run, after)[:CONTACT_FRAMES]]
    lines = [_line(run.time_s[at] - time_s, run.xy_m[at]) for at in sides if len(at)]
    if not lines:
        return NO_CONTACT
    place = np.mean([line[0] for line in lines], 0) - host
    velocity, jump = lines[0][1] - rate, lines[-1][1] - lines[0][1]
    size = float(np.hypot(*jump))
    normal = -jump / size if size > 0 else np.zeros(2)
    angle, spin, spun = _turning(run, sides, time_s)
    slip = float(velocity[1] * normal[0] - velocity[0] * normal[1]) + run.radius_m * spin
    # The wall is pushed outwards, a cylinder in the middle towards the Host's centre: friction turns the jump, not the
    # place.
    push_rad = math.atan2(place[1], place[0]) + (0.0 if place @ normal >= 0.0 else math.pi)
    approach, left = max(float(velocity @ normal), 0.0), float(np.hypot(*(lines[-1][1] - rate)))
    return Contact(float(place[0]), float(place[1]), approach, angle, slip, left, push_rad, spun)


def _turning(run: RunData, sides: Sequence[NDArray[np.int64]], time_s: float) -> tuple[float, float, float]:
    """The disk's angle (rad) at a contact between frames of two ``sides``, its spin before and what it gains (rad/s);
    zeros where no angle was seen."""
    seen = [at[run.angle_sd_rad[at] < NO_ANGLE_SD_RAD] for at in sides]
    lines = [_line(run.time_s[at] - time_s, run.angle_rad[at]) for at in seen if len(at)]
    if not lines:
        return 0.0, 0.0, 0.0
    before = float(lines[0][1]) if len(seen[0]) else 0.0
    spun = float(lines[-1][1] - lines[0][1])
    return float(np.mean([line[0] for line in lines])), before, spun


def _line(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Value at time 0 and slope of the straight line through ``values`` (N,) or (N, 2); at rest with one frame."""
    if len(time_s) < LINE:
        return values.mean(0), np.zeros(values.shape[1:])
    slope, value = np.polyfit(time_s, values, 1)
    return value, slope
