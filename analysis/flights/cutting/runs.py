"""A recording's motion as the flight fits need it, segmented: Host as harmonics, NES with honest weights, flights,
contact.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from analysis.flights.cutting.first_wall import CONTACT_MARGIN_M, from_host, reached_wall
from analysis.flights.cutting.pieces import Flight, flights_from_segments, shortened
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.cutting.segments import Segments, segment
from analysis.motion.bodies import INERTIA_OF_A_DISK
from analysis.motion.host_fit import fit_host_motion
from analysis.motion.rig_frame import RigFrame
from analysis.statistics.robust import smooth_noise
from analysis.walls.drawn import stated_wall
from analysis.walls.wall import Wall
from ovines.recording import Recording

Array = NDArray[np.float64]

# Added to CONTACT_MARGIN_M: so many sds of the cameras' noise.
CONTACT_MARGIN_SD = 3.0
# A fast disk smears: where most of so many frames are worse than the run's usual one, theirs counts.
SMEARED_FRAMES = 9
# What the flight model, the exposure and the lens leave over however sharp the markers are (m); at the rim for the
# angle.
FINEST_SD_M = 1e-6
# Noise of a motion without sds that has too few frames to show any: what cameras usually reach (m).
UNKNOWN_SD_M = 1e-5


@dataclass(frozen=True, eq=False)
class Run:
    """One recording ready to be fitted: ``data``, its ``flights``, the ``segments`` they come from.

    ``in_wall_m`` (N, 2): where the NES was seen in the wall, in frames that ``data`` lacks; NaN elsewhere."""

    data: RunData
    segments: Segments
    flights: tuple[Flight, ...]
    host_table: Array
    frame: NDArray[np.int64]
    in_wall_m: Array | None = None


def run_data(
    motion: pd.DataFrame, recording: Recording, frame: RigFrame, name: str | None = None
) -> tuple[RunData, Array]:
    """``RunData`` of a motion table in the rig's ``frame``, and the Host's table (N, 8): x, y, z, angle and their
    sd.
    """
    times = motion["time_s"].to_numpy(float)
    host, host_sd = (_columns(motion, "host", suffix) for suffix in ("", "_sd"))
    host_sd = np.where(np.isfinite(host_sd), host_sd, _noise(host)[None, :])
    excitation = recording.excitation
    asked_hz = excitation.frequency_hz / frame.factor("frequency_hz") if excitation else None
    harmonics = fit_host_motion(times, host, host_sd, asked_hz)
    nes, nes_sd = (_columns(motion, "nes", suffix) for suffix in ("", "_sd"))
    nes_sd = np.where(np.isfinite(nes_sd), nes_sd, _noise(nes)[None, :])
    angle, angle_sd = nes[:, 3], nes_sd[:, 3]
    if not np.isfinite(angle).any():
        angle, angle_sd = np.zeros(len(times)), np.full(len(times), NO_ANGLE_SD_RAD)
    seen = np.isfinite(nes[:, 0]) & np.isfinite(nes[:, 1])
    angle_sd = np.where(np.isfinite(angle) & np.isfinite(angle_sd), angle_sd, NO_ANGLE_SD_RAD)
    angle = np.where(np.isfinite(angle), angle, 0.0)
    xy = np.where(seen[:, None], nes[:, :2], np.nan)
    sd = np.maximum(np.sqrt(0.5 * (nes_sd[:, 0] ** 2 + nes_sd[:, 1] ** 2)), FINEST_SD_M)
    body = recording.bodies["nes"]
    wall = stated_wall(recording).over(frame.length)
    radius_m = float(getattr(body, "radius_m", np.nan)) / frame.length
    inertia = getattr(body, "inertia_factor", None) or INERTIA_OF_A_DISK
    data = RunData(
        name or recording.name,
        times,
        xy,
        angle,
        sd,
        np.maximum(angle_sd, FINEST_SD_M / radius_m),
        harmonics,
        wall.size_m,
        radius_m,
        float(inertia),
        wall,
    )
    return data, np.column_stack([host, host_sd])


def _columns(motion: pd.DataFrame, body: str, suffix: str) -> Array:
    columns = [
        motion[f"{body}_{q}{suffix}_{u}"].to_numpy(float)
        if f"{body}_{q}{suffix}_{u}" in motion
        else np.full(len(motion), np.nan)
        for q, u in (("x", "m"), ("y", "m"), ("z", "m"), ("angle", "rad"))
    ]
    return np.column_stack(columns)


def _noise(values: Array) -> Array:
    """Noise per column from third differences (a smooth motion leaves nothing there); a micrometre at least."""
    found = np.array([smooth_noise(column) for column in values.T])
    return np.where(np.isnan(found), UNKNOWN_SD_M, np.maximum(found, FINEST_SD_M))


def cut(
    data: RunData,
    host_table: Array,
    frame: NDArray[np.int64],
    wall: Wall,
    origin_m: Array | None = None,
) -> Run:
    """Segment a run inside ``wall``, in the rig's own units (what is a contact or a step must not depend on its size).

    ``origin_m`` (2,): where the markers' origin lies from the mass centre, whose path has no bends of the disk's
    turning.
    """
    relative, host_angle = from_host(data)
    path = data.xy_m if origin_m is None else data.xy_m - turned(origin_m, data.angle_rad)
    length, time = data.own_units
    sd = data.xy_sd_m / length
    noise = float(np.median(sd)) if len(sd) else 0.0
    segments = segment(
        data.time_s / time,
        path / length,
        sd,
        relative / length,
        wall.gap(relative, host_angle) / length,
        CONTACT_MARGIN_M + CONTACT_MARGIN_SD * np.maximum(median_filter(sd, SMEARED_FRAMES), noise),
        wall.size_m / length,
    )
    segments = replace(segments, steps_m_per_s=segments.steps_m_per_s * (length / time))
    if len(segments.smeared):
        xy = data.xy_m.copy()
        xy[segments.smeared] = np.nan
        data = replace(data, xy_m=xy)
    seen = np.isfinite(data.xy_m[:, 0])
    whole = flights_from_segments(seen, segments.gaps.tolist(), segments.contact)
    flights = shortened(whole, data.time_s / time, seen)
    return Run(data, segments, tuple(flights), host_table, frame)


def outside_the_wall(run: Run, met_s: Array, early_s: float, late_s: float) -> Run:
    """``run`` without the frames in which the NES is in the wall, where contacts last: they are no flight.  It is from
    ``early_s`` before to ``late_s`` after the times ``met_s`` (K,) at which flights meet; in none where both are 0."""
    met_s, time_s = np.sort(met_s), run.data.time_s
    hidden = np.zeros(len(time_s), bool)
    if len(met_s) and early_s > 0:
        after = np.searchsorted(met_s, time_s)
        since_s = time_s - met_s[np.maximum(after - 1, 0)]
        until_s = met_s[np.minimum(after, len(met_s) - 1)] - time_s
        hidden = ((after > 0) & (since_s < late_s)) | ((after < len(met_s)) & (until_s < early_s))
    return _without_frames(run, hidden)


def _without_frames(run: Run, hidden: NDArray[np.bool_]) -> Run:
    """The run with the flights of all frames but the ``hidden`` ones (N,), whichever were hidden before."""
    places = with_frames_in_wall(run, run.data).xy_m
    in_wall = np.where(hidden[:, None], places, np.nan)
    before = np.full_like(in_wall, np.nan) if run.in_wall_m is None else run.in_wall_m
    if np.array_equal(in_wall, before, equal_nan=True):
        return run
    data = replace(run.data, xy_m=np.where(hidden[:, None], np.nan, places))
    seen = np.isfinite(data.xy_m[:, 0])
    whole = flights_from_segments(seen, run.segments.gaps.tolist(), run.segments.contact)
    flights = tuple(shortened(whole, data.time_s / data.own_units[1], seen))
    return replace(run, data=data, flights=flights, in_wall_m=in_wall)


def with_frames_in_wall(run: Run, data: RunData) -> RunData:
    """``data`` of ``run`` with the frames in which the NES was in the wall."""
    if run.in_wall_m is None:
        return data
    return replace(data, xy_m=np.where(np.isfinite(run.in_wall_m), run.in_wall_m, data.xy_m))


def turned(place_m: Array, angle_rad: Array) -> Array:
    """A place (2,) of the disk's frame in the room's directions at angles (N,): (N, 2)."""
    c, s = np.cos(angle_rad), np.sin(angle_rad)
    return np.column_stack([c * place_m[0] - s * place_m[1], s * place_m[0] + c * place_m[1]])


def cut_again(runs: Sequence[Run], origin_m: Array) -> list[Run]:
    """The runs segmented on the path of the mass centre, now that it is known."""
    wall = reached_wall([run.data for run in runs])
    return [cut(with_frames_in_wall(run, run.data), run.host_table, run.frame, wall, origin_m) for run in runs]


def prepare(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording], frame: RigFrame) -> list[Run]:
    """The runs of a series (tables ``motion``, in the rig's ``frame`` already), Host fitted and flights cut."""
    pairs = [run_data(motion, recording, frame) for motion, recording in zip(motions, recordings, strict=True)]
    wall = reached_wall([data for data, _ in pairs])
    return [
        cut(replace(data, number=i), host, motion["frame"].to_numpy(np.int64), wall)
        for i, ((data, host), motion) in enumerate(zip(pairs, motions, strict=True))
    ]
