"""What laws of the measurement know of a frame: its time, what the drive and the Host do then, where and how fast the
disk goes, and the blow before."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.impact_before import (
    blows_before,
    contact_before,
    first_piece,
    impact_before,
    number_of_blows,
)
from analysis.flights.cutting.pieces import Flight
from analysis.flights.cutting.run_data import NO_CONTACT, RunData
from analysis.gap.measurement.loose_markers import angle_at, spin_at
from analysis.gap.series import Series
from ovines.core.laws import words as W

Array = NDArray[np.float64]
#: a path needs two frames to have a velocity
FEWEST_SEEN = 2


def known_frames(time_s: Array, data: RunData, flights: Sequence[Flight]) -> Array:
    """What laws of the measurement know (N, KNOWN_SIZE) of frames at ``time_s`` of a run cut into ``flights``; the
    disk, where it was not seen, on a straight way from where it was."""
    rig, known = data.flight_rig, np.zeros((len(time_s), W.KNOWN_SIZE))
    gone_s = time_s - rig.start_s
    known[:, W.TIME], known[:, W.RUN] = gone_s, rig.number
    known[:, W.CLOCK] = rig.omega_rad_per_s * gone_s
    known[:, W.PHASE] = rig.omega_rad_per_s * time_s + rig.phase_rad
    known[:, W.SHARE] = gone_s / (float(data.time_s[-1]) - rig.start_s + data.period_s)
    known[:, [W.HOST_AX, W.HOST_AY]] = data.host.at(time_s, 2)[:, :2]
    known[:, W.SPIN] = np.interp(time_s, data.time_s, spin_at(data))
    known[:, W.ANGLE] = np.interp(time_s, data.time_s, angle_at(data))
    known[:, W.CONTACT_RADIUS], known[:, W.START_ANGLE] = data.contact_radius_m, data.start_rad
    # The Host's place counts from the middle of the run's path, for a law knows no origin of the room.
    floor, host = data.host.at(time_s, 1)[:, :2], data.host.at(time_s)[:, :2]
    place, velocity = _disk(time_s, data)
    known[:, [W.HX, W.HY]] = place - host
    known[:, [W.X, W.Y]] = place - data.host.at(data.time_s)[:, :2].mean(0)
    known[:, [W.VX, W.VY]], known[:, [W.UX, W.UY]] = velocity, velocity - floor
    _remember_blows(known, time_s, data, flights)
    return known


def _remember_blows(known: Array, time_s: Array, data: RunData, flights: Sequence[Flight]) -> None:
    """Write the blow before each frame; none from a flight on that no impact began."""
    begins = [k for k in range(len(flights)) if first_piece(flights, k) == k]
    met = [k > 0 and flights[k - 1].joined for k in begins]
    from_s = [
        impact_before(data, flights, k) if struck else float(data.time_s[flights[k].first])
        for k, struck in zip(begins, met, strict=True)
    ]
    at = np.searchsorted(np.array(from_s), time_s, side="right") - 1
    known[:, W.SINCE] = W.LONG_AGO_S
    last = [W.LAST_X, W.LAST_Y, W.LAST_APPROACH, W.LAST_ANGLE, W.LAST_SLIP, W.LAST_LEFT]
    for i, k in enumerate(begins):
        own = at == i
        known[own, W.BLOWS] = number_of_blows(flights, k)
        contact = contact_before(data, flights, k)
        if contact == NO_CONTACT:
            continue
        known[own, W.SINCE] = time_s[own] - from_s[i]
        known[np.ix_(own, last)], known[own, W.LAST_SPUN] = contact[: len(last)], contact.spun_rad_per_s
        blows = blows_before(data, flights, k)
        known[own, W.BLOW_TIMES : W.BLOW_SPEEDS] = blows[0] - data.start_s
        known[own, W.BLOW_SPEEDS : W.BLOW_WAYS] = blows[1]
        known[own, W.BLOW_WAYS : W.BLOW_SIDES], known[own, W.BLOW_SIDES : W.BLOWS] = blows[2], blows[3]
        known[own, W.BLOW_SLIPS : W.START_ANGLE] = blows[4]


def _disk(time_s: Array, data: RunData) -> tuple[Array, Array]:
    """Place (N, 2; m) and velocity (N, 2; m/s) of the disk in the room; at the Host's where it was never seen."""
    seen = np.flatnonzero(np.isfinite(data.xy_m).all(1))
    if len(seen) < FEWEST_SEEN:
        return data.host.at(time_s)[:, :2], data.host.at(time_s, 1)[:, :2]
    at, place = data.time_s[seen], data.xy_m[seen]
    rate = np.gradient(place, at, axis=0)
    place, rate = (np.column_stack([np.interp(time_s, at, c) for c in one.T]) for one in (place, rate))
    return place, rate


def every_frame(series: Series) -> tuple[Array, list[int]]:
    """What laws know of all frames of the motions, run after run, and where each run begins."""
    parts = [known_frames(run.data.time_s, run.data, run.flights) for run in series.runs]
    begins = np.concatenate([[0], np.cumsum([len(one) for one in parts])])
    return np.vstack(parts), [int(b) for b in begins]
