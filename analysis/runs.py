"""A recording's motion as the flight fits need it, segmented: Host as harmonics, NES with honest weights, flights, contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights import Flight, RunData, flights_from_segments, shortened
from analysis.host_motion import fit_host_motion
from analysis.segment import Segments, segment
from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]

# Nearer than this to the wall for four frames in a row is sustained contact (or chatter below 0.1 m/s: v^2 / 2a = 0.1 mm).
CONTACT_MARGIN_M = 1.5e-4
# Of the runs' farthest distances: not the largest, which may be a wrong track's.
HIGH_QUANTILE = 0.8
# What the flight model, the exposure and the lens leave over however sharp the markers are (m); at the rim for the angle.
FINEST_SD_M = 1e-6
# Where the motion gives no angle, the flight fit sees one of no weight.
NO_ANGLE_SD_RAD = 1e6


@dataclass(frozen=True, eq=False)
class Run:
    """One recording ready to be fitted: ``data``, its ``flights``, the ``segments`` they come from, NES distance from the Host."""

    data: RunData
    segments: Segments
    flights: tuple[Flight, ...]
    distance_m: Array
    host_table: Array
    frame: NDArray[np.int64]


def contact_radius(recording: Recording) -> float:
    """Design contact radius R_H - R_N (m); refused when recording.toml lacks either."""
    host, nes = recording.bodies.get("host"), recording.bodies.get("nes")
    inner = getattr(host, "inner_radius_m", None)
    radius = getattr(nes, "radius_m", None)
    if getattr(host, "polygon_m", None) is not None:
        raise InputError(f"{recording.folder}: flat walls (polygon_m) in [bodies.host]", "a round wall (inner_radius_m): impacts are identified on it",
                         "use the earlier stages (motion, thesis_impacts) and ovines simulate for this rig")
    if inner is None or radius is None:
        raise InputError(f"{recording.folder}: no round wall (inner_radius_m) or no disk (radius_m) in [bodies]",
                         "[bodies.host] inner_radius_m and [bodies.nes] radius_m", "add them to recording.toml")
    return float(inner - radius)


def run_data(motion: pd.DataFrame, recording: Recording, name: str | None = None) -> tuple[RunData, Array]:
    """``RunData`` of a motion table, and the Host's table (N, 8): x, y, z, angle and their sd."""
    times = motion["time_s"].to_numpy(float)
    host, host_sd = (_columns(motion, "host", suffix) for suffix in ("", "_sd"))
    host_sd = np.where(np.isfinite(host_sd), host_sd, _noise(host)[None, :])
    excitation = recording.excitation
    harmonics = fit_host_motion(times, host, host_sd, excitation.frequency_hz if excitation else None)
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
    contact_m = contact_radius(recording)
    radius_m = float(getattr(body, "radius_m", np.nan))
    inertia = getattr(body, "inertia_factor", None) or 0.5
    data = RunData(name or recording.name, times, xy, angle, sd, np.maximum(angle_sd, FINEST_SD_M / radius_m), harmonics, contact_m,
                   radius_m, float(inertia))
    return data, np.column_stack([host, host_sd])


def _columns(motion: pd.DataFrame, body: str, suffix: str) -> Array:
    columns = [motion[f"{body}_{q}{suffix}_{u}"].to_numpy(float) if f"{body}_{q}{suffix}_{u}" in motion else np.full(len(motion), np.nan)
               for q, u in (("x", "m"), ("y", "m"), ("z", "m"), ("angle", "rad"))]
    return np.column_stack(columns)


def _noise(values: Array) -> Array:
    """Noise per column from third differences (a smooth motion leaves nothing there); a micrometre at least."""
    sd = np.full(values.shape[1], 1e-5)
    third = np.abs(np.diff(values, 3, axis=0))
    for column in range(values.shape[1]):
        known = third[np.isfinite(third[:, column]), column]
        if known.size:
            sd[column] = max(float(np.median(known)) / 0.6745 / np.sqrt(20.0), 1e-6)
    return sd


def cut(data: RunData, host_table: Array, frame: NDArray[np.int64], wall_m: Array | float) -> Run:
    """Segment a run, ``wall_m`` (scalar or per frame) being the contact distance."""
    relative = data.xy_m - data.host.at(data.time_s)[:, :2]
    distance = np.hypot(relative[:, 0], relative[:, 1])
    noise = float(np.median(data.xy_sd_m)) if len(data.xy_sd_m) else 0.0
    limit = np.broadcast_to(np.asarray(wall_m, float) - CONTACT_MARGIN_M - 3 * noise, distance.shape)
    segments = segment(data.time_s, data.xy_m, data.xy_sd_m, distance, limit)
    if len(segments.smeared):
        xy = data.xy_m.copy()
        xy[segments.smeared] = np.nan
        data = replace(data, xy_m=xy)
    seen = np.isfinite(data.xy_m[:, 0])
    flights = shortened(flights_from_segments(seen, segments.gaps.tolist(), segments.contact), data.time_s, seen)
    return Run(data, segments, tuple(flights), distance, host_table, frame)


def wall_distance(datas: Sequence[RunData]) -> float:
    """First guess of the contact distance from the data: what the NES reaches in sustained contact and at impacts.

    The farthest of each run but for single wrong frames (median of three neighbours), and of the runs a high quantile: a disk that comes to
    rest, or hits the wall but once and fast, never shows it.  The design radius where runs never come near it."""
    reached = []
    for data in datas:
        relative = data.xy_m - data.host.at(data.time_s)[:, :2]
        distance = np.hypot(relative[:, 0], relative[:, 1])
        distance = distance[np.isfinite(distance)]
        if len(distance) > 2:
            reached.append(float(np.max(np.median(np.lib.stride_tricks.sliding_window_view(distance, 3), axis=1))))
    design = datas[0].contact_radius_m
    guess = float(np.quantile(reached, HIGH_QUANTILE)) if reached else design
    return guess if abs(guess - design) < 0.05 * design else design


def prepare(motions: Sequence[pd.DataFrame], recordings: Sequence[Recording]) -> list[Run]:
    """The runs of a series (tables ``motion``), Host fitted and flights cut."""
    pairs = [run_data(motion, recording) for motion, recording in zip(motions, recordings, strict=True)]
    wall = wall_distance([data for data, _ in pairs])
    return [cut(data, host, motion["frame"].to_numpy(np.int64), wall) for (data, host), motion in zip(pairs, motions, strict=True)]
