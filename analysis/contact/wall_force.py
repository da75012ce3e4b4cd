"""A force that grows towards the wall: whether the flights show one, and what it leaves open of the speeds at impacts.

An unknown force is taken to be as strong in one place as in another.  One that grows towards the wall is strongest in
the last frames before an impact and the first ones after, where flights know it least, and it acts alike at all
impacts: its error does not average out.  So its size is fitted (linearised, for several widths, beside what all flights
share), and what it did to the speeds beyond what the frames around an impact showed is a common error of theirs.  Its
true form is not known: it corrects nothing, it widens.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Impacts
from analysis.flights.cutting.pieces import seen_frames
from analysis.flights.equation.model import STATES
from analysis.flights.evidence import RunRows, linearised, solve, usable_flights, weighed
from analysis.flights.fit import SHARED, FlightFits
from analysis.flights.force_path import ForcePath
from analysis.flights.noise import cells, response
from analysis.walls.wall import Wall

Array = NDArray[np.float64]

# Distances within which the force falls off, over the wall's size: from what a few frames show to what bends a whole
# flight.
WIDTHS = np.array([0.03, 0.06, 0.12, 0.25, 0.5])
# Square of its size over its sd from which it is there: the widths are tried, and so are both signs.
THERE = 25.0
# The unknowns of :data:`SHARED` end here; the force of one width after the other follows.
FIRST_WIDTH = len(SHARED)


@dataclass(frozen=True, eq=False)
class WallForce:
    """``acceleration_m_per_s2`` at the wall (towards it positive) with its ``sd_m_per_s2``, falling off within
    ``width_m``; ``before_m_per_s``, ``after_m_per_s`` (K,): how much faster each impact's approach and leaving was with
    it than its flights say."""

    acceleration_m_per_s2: float
    sd_m_per_s2: float
    width_m: float
    before_m_per_s: Array
    after_m_per_s: Array


def wall_force(fits: Sequence[FlightFits], columns: Sequence[int], impacts: Impacts) -> WallForce | None:
    """The force towards the wall that the flights of a series show beside their shared ``columns`` (indices into
    :data:`SHARED`), None where they show none beyond doubt."""
    wall = impacts.wall
    widths_m = WIDTHS * wall.size_m
    extra = range(FIRST_WIDTH, FIRST_WIDTH + len(widths_m))
    evidence = []
    for fit in fits:
        rows = linearised(fit, columns)
        numbers = np.flatnonzero(usable_flights(fit))
        flights = []
        for k, flight in zip(numbers, rows.flights, strict=True):
            moved = np.zeros((len(flight.index), 3, len(widths_m)))
            moved[:, :2] = _moved(fit, int(k), wall, widths_m, None)[0]
            flights.append(replace(flight, rows=np.concatenate([flight.rows, moved], 2)))
        evidence.append(weighed(RunRows((*columns, *extra), tuple(flights), rows.left_out), fit.noise))
    if not any(one.flights for one in evidence):
        return None
    found = []
    for number in extra:
        estimate, covariance, _ = solve(evidence, [*columns, number], np.zeros(len(columns) + 1))
        variance = float(covariance[-1, -1])
        found.append((float(estimate[-1]) ** 2 / variance if variance > 0 else 0.0, float(estimate[-1]), variance**0.5))
    best = int(np.argmax([gain for gain, _, _ in found]))
    gain, size, sd = found[best]
    if gain < THERE:
        return None
    before, after = np.zeros(len(impacts)), np.zeros(len(impacts))
    junctions, width_m = impacts.junctions, widths_m[best : best + 1]
    for i in range(len(impacts)):
        fit, k_before, at_s = fits[int(junctions.run[i])], int(junctions.flight[i]), float(junctions.time_s[i])
        outward = np.array([np.cos(impacts.normal_rad[i]), np.sin(impacts.normal_rad[i])])
        before[i] = size * float(np.dot(outward, _untold(fit, k_before, wall, width_m, at_s)))
        after[i] = -size * float(np.dot(outward, _untold(fit, k_before + 1, wall, width_m, at_s)))
    return WallForce(size, sd, float(widths_m[best]), before, after)


def _moved(fit: FlightFits, k: int, wall: Wall, widths_m: Array, at_s: float | None) -> tuple[Array, Array]:
    """Displacements (N, 2, W) of flight ``k``'s frames, since its first, by forces of unit size at the wall; and the
    velocities (2, W) at ``at_s`` that they gave, zeros where it is None."""
    run = fit.run
    times = run.time_s[seen_frames(run, fit.flights[k])]
    others = None if at_s is None else np.array([at_s])
    edges = cells(times, run.period_s, others)
    middle = 0.5 * (edges[1:] + edges[:-1])
    states, _ = fit.flown(k, middle, derivatives=False)
    host = run.host.at(middle)
    gaps, normals = wall.gaps(states[:, :2] - host[:, :2], host[:, 3], run.radius_m)
    nearest = np.argmax(gaps, axis=1)
    each = np.arange(len(middle)), nearest
    outward = np.stack([np.cos(normals[each]), np.sin(normals[each])], -1)
    size = np.exp(np.minimum(gaps[each], 0.0)[:, None] / widths_m)
    push = outward[:, :, None] * size[:, None, :]
    place, _ = response(times, float(times[0]), edges)
    if others is None:
        return np.tensordot(place, push, 1), np.zeros((2, len(widths_m)))
    _, speed = response(others, float(times[0]), edges)
    return np.tensordot(place, push, 1), np.tensordot(speed, push, 1)[0]


def _untold(fit: FlightFits, k: int, wall: Wall, width_m: Array, at_s: float) -> Array:
    """Velocity (2,) at ``at_s`` by a force of unit size at the wall, less what flight ``k``'s frames, so displaced,
    tell of it."""
    run = fit.run
    index = seen_frames(run, fit.flights[k])
    times = run.time_s[index]
    moved, speed = _moved(fit, k, wall, width_m, at_s)
    displaced = np.zeros((len(index), 3))
    displaced[:, :2] = moved[:, :, 0]
    rows = fit.flown(k, times)[1][:, :3]
    place, angle = fit.noise.whitening(index, times, run.xy_sd_m[index], run.angle_sd_rad[index])
    now = fit.flown(k, np.array([at_s]))[1]
    path = ForcePath(fit.noise, times, (place, angle), displaced, rows)
    known = path.states_at(np.array([at_s]), np.zeros((1, STATES)), now)
    return np.asarray(speed[:, 0] - known[0, 3:5], float)
