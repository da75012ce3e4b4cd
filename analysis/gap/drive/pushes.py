"""What the disk does to the Host: its momentum's changes, and how a mass on a damped spring answers them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.contact.impacts import intersect, measure
from analysis.flights.cutting.run_data import RunData
from analysis.flights.fit import FlightFits

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Pushes:
    """Changes of velocity (K, 2; m/s) at instants (K,; s, sorted): of the Host, were it as heavy as the disk."""

    time_s: Array
    step: Array


@dataclass(frozen=True, eq=False)
class RunPushes:
    """Of one run: ``whole`` is all that the disk's path tells (impacts, floor, sustained contact), ``normal`` the
    impacts' normal impulses along the wall's normals, and what the disk's path says along these where it stays at the
    wall."""

    whole: Pushes
    normal: Pushes


def pushes_of(fits: Sequence[FlightFits]) -> list[RunPushes]:
    """The pushes of every run, from its fitted flights and where they meet."""
    junctions = intersect(fits)
    if not len(junctions):
        return [_run_pushes(fit, np.zeros(0), np.zeros((0, 2))) for fit in fits]
    impacts = measure(junctions, fits[0].run.wall)
    along = np.column_stack([np.cos(impacts.normal_rad), np.sin(impacts.normal_rad)])
    stopped = impacts.of("normal_before") + impacts.of("normal_after")
    impulse = (stopped / (1 + junctions.gives.share))[:, None] * along
    runs = [junctions.run == number for number in range(len(fits))]
    return [_run_pushes(fit, junctions.time_s[here], impulse[here]) for fit, here in zip(fits, runs, strict=True)]


def _run_pushes(fit: FlightFits, impact_s: Array, impulse: Array) -> RunPushes:
    """Of a run with the ``impulse`` (K, 2; m/s) of its impacts between flights."""
    whole, data = _whole(fit.run), fit.run
    held = np.ones(len(data.time_s), bool)
    for flight in fit.flights:
        held[flight.first : flight.last + 1] = False
    for one, following in pairwise(fit.flights):
        held[one.last : following.first] &= not one.joined
    # An impulse between two frames bends the path at both of them.
    held[1:-1] |= held[:-2] | held[2:]
    frames = np.searchsorted(data.time_s, whole.time_s)
    frames = frames[held[frames]]
    host = data.host.at(data.time_s[frames])
    gaps, normals = data.wall.gaps(data.xy_m[frames] - host[:, :2], host[:, 3], data.radius_m)
    normal = np.take_along_axis(normals, np.argmax(gaps, axis=1)[:, None], axis=1)
    along = np.hstack([np.cos(normal), np.sin(normal)])
    step = whole.step[np.isin(whole.time_s, data.time_s[frames])]
    time_s = np.append(impact_s, data.time_s[frames])
    steps = np.vstack([impulse, np.sum(step * along, 1)[:, None] * along])
    order = np.argsort(time_s, kind="stable")
    return RunPushes(whole, Pushes(time_s[order], steps[order]))


def _whole(data: RunData) -> Pushes:
    """What the disk's measured path says of every force on it, frame by frame: impacts, floor, and contacts that last.

    Its places' noise does no harm: the Host answers with the disk's share of it."""
    seen = np.isfinite(data.xy_m).all(1)
    if np.count_nonzero(seen) < 3:
        return Pushes(np.zeros(0), np.zeros((0, 2)))
    t, place = data.time_s[seen], data.xy_m[seen]
    velocity = np.diff(place, axis=0) / np.diff(t)[:, None]
    return Pushes(t[1:-1], -np.diff(velocity, axis=0))


def answers(pushes: Pushes, time_s: Array, frequency_hz: Array, damping: Array) -> Array:
    """Places (N, 2, G) at sorted times (N,) of G masses, each as heavy as the disk, on springs of their own frequencies
    (undamped; Hz) and damping ratios (below 1): ``step exp(-zeta w t) sin(w_d t) / w_d`` from each push on."""
    omega = 2 * np.pi * np.atleast_1d(np.asarray(frequency_hz, float))
    ratio = np.atleast_1d(np.asarray(damping, float))
    out = np.empty((len(time_s), 2, len(omega)))
    _answer(pushes.time_s, pushes.step, np.ascontiguousarray(time_s), omega * np.sqrt(1 - ratio**2), ratio * omega, out)
    return out


@compiled
def _answer(push_s: Array, step: Array, time_s: Array, swing: Array, decay: Array, out: Array) -> None:
    """Fill ``out`` (N, 2, G) with the answers at ``time_s`` (N,) to ``step`` (K, 2) at ``push_s`` (K,)."""
    for g in range(len(swing)):
        rate = -decay[g] + 1j * swing[g]
        x, y, at, k = 0.0 + 0.0j, 0.0 + 0.0j, time_s[0], 0
        for i in range(len(time_s)):
            while k < len(push_s) and push_s[k] <= time_s[i]:
                turn = np.exp(rate * (push_s[k] - at))
                x, y, at = x * turn + step[k, 0], y * turn + step[k, 1], push_s[k]
                k += 1
            turn = np.exp(rate * (time_s[i] - at))
            x, y, at = x * turn, y * turn, time_s[i]
            out[i, 0, g], out[i, 1, g] = x.imag / swing[g], y.imag / swing[g]
