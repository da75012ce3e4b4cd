"""What laws of the measurement know of a frame: its time, what the drive and the Host do then, and where and how fast
the disk goes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.gap.measurement.loose_markers import angle_at, spin_at
from analysis.gap.series import Series
from ovines.core.laws import words as W

Array = NDArray[np.float64]
# A path needs two frames to have a velocity.
FEWEST_SEEN = 2


def known_frames(time_s: Array, data: RunData) -> Array:
    """What laws of the measurement know (N, KNOWN_SIZE) of frames at ``time_s`` of a run; the disk, where it was not
    seen, on a straight way from where it was."""
    rig, known = data.flight_rig, np.zeros((len(time_s), W.KNOWN_SIZE))
    gone_s = time_s - rig.start_s
    known[:, W.TIME], known[:, W.RUN] = gone_s, rig.number
    known[:, W.CLOCK] = rig.omega_rad_per_s * gone_s
    known[:, W.PHASE] = rig.omega_rad_per_s * time_s + rig.phase_rad
    known[:, W.SHARE] = gone_s / (float(data.time_s[-1]) - rig.start_s + data.period_s)
    known[:, [W.HOST_AX, W.HOST_AY]] = data.host.at(time_s, 2)[:, :2]
    known[:, W.SPIN] = np.interp(time_s, data.time_s, spin_at(data))
    known[:, W.ANGLE] = np.interp(time_s, data.time_s, angle_at(data))
    known[:, W.CONTACT_RADIUS] = data.contact_radius_m
    # The Host's place counts from the middle of the run's path, for a law knows no origin of the room.
    floor, host = data.host.at(time_s, 1)[:, :2], data.host.at(time_s)[:, :2]
    place, velocity = _disk(time_s, data)
    known[:, [W.HX, W.HY]] = place - host
    known[:, [W.X, W.Y]] = place - data.host.at(data.time_s)[:, :2].mean(0)
    known[:, [W.VX, W.VY]], known[:, [W.UX, W.UY]] = velocity, velocity - floor
    return known


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
    parts = [known_frames(run.data.time_s, run.data) for run in series.runs]
    begins = np.concatenate([[0], np.cumsum([len(one) for one in parts])])
    return np.vstack(parts), [int(b) for b in begins]
