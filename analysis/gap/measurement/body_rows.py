"""What two views say of one body in one run, frame by frame: how far its epipolar lines miss each other, how high it
stands, and what a late camera or a shifted window makes of either.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.series import Series, with_motions
from analysis.motion.bodies import VELOCITY_REACH
from ovines.camera import Camera, triangulate_points
from ovines.robust import spread

Array = NDArray[np.float64]
# Fewer frames say nothing of a body.
FEWEST_FRAMES = 20
# From this share of a frame on a delay mixes pictures from both sides of an impact in more than one of ten.
MIXED = 0.1


@dataclass(frozen=True, eq=False)
class BodyRows:
    """Frames (N,) in which two views saw a body: what its epipolar ``line_px`` and its ``height_m`` are off with their
    sds, its place, velocities (N, 2) in one view's picture (px/s), what a pixel of its window (u, v) makes of line and
    height (N, 2), phase of the drive, and ``share`` of the run at which each was taken, 0 to 1.

    ``rising``: the velocity with which a late camera changes heights, for a drive of other than its harmonics that
    against the Host: its own rise and fall is then taken out of all heights, and what a delay makes of it."""

    line_px: Array
    height_m: Array
    x_m: Array
    y_m: Array
    moving: Array
    rising: Array
    line_per_px: Array
    height_per_px: Array
    line_sd_px: Array
    height_sd_m: Array
    phase_rad: Array
    share: Array

    def late(self) -> tuple[Array, Array]:
        """What a second of delay makes of lines (px) and heights (m), (N,) each."""
        return np.sum(self.line_per_px * self.moving, 1), np.sum(self.height_per_px * self.rising, 1)


def body_rows(
    series: Series, points: pd.DataFrame, motion: pd.DataFrame, run: Run, body: str, view: int = 1
) -> BodyRows | None:
    """Lines and heights of one body in one run, and what they owe to one ``view``, by its number; None where too few
    frames saw it."""
    recording = series.recordings[0]
    markers = recording.bodies[body].markers
    if series.layouts is None or series.cameras is None:
        return None
    layout = series.layouts[body]
    frames = motion["frame"].to_numpy()
    part = points[points["marker"].isin(list(markers))]
    mean = part.groupby("frame")["epipolar_px"].median().reindex(frames).to_numpy(float)
    count = part.groupby("frame")["epipolar_px"].count().reindex(frames).to_numpy(float)
    sd_px = spread(part["epipolar_px"])
    x, y, z = (motion[f"{body}_{a}_m"].to_numpy(float) for a in "xyz")
    z_sd = motion[f"{body}_z_sd_m"].to_numpy(float)
    if body == "host":
        velocity = run.data.host.at(run.data.time_s, 1)[:, :3] * np.array([1, 1, 0])
    else:
        velocity = np.column_stack([motion[f"nes_v{a}_m_per_s"].to_numpy(float) for a in "xy"] + [np.zeros(len(x))])
        # The local parabola smears a velocity step over its reach: frames beside a kink say nothing of velocity.
        near = np.zeros(len(x), bool)
        for gap in run.segments.gaps:
            near[max(0, gap - VELOCITY_REACH) : gap + VELOCITY_REACH + 2] = True
        velocity[near] = np.nan
    host = run.data.host
    if not host.harmonic:
        z, z_sd = _against_host(z, z_sd, motion, run, body)
    use = np.isfinite(mean) & np.isfinite(x) & np.isfinite(z) & np.isfinite(velocity[:, 0])
    if use.sum() < FEWEST_FRAMES:
        return None
    at = np.flatnonzero(use)
    place = np.column_stack([x[at], y[at], np.full(len(at), float(np.mean(layout[:, 2])))])
    per_line, per_point, jacobian = _derivatives(series.cameras, place, view)
    times, against = run.data.time_s[at], np.zeros((len(at), 3))
    if not host.harmonic:
        against = host.at(times, 1)[:, :3] * np.array([1, 1, 0])
    return BodyRows(
        mean[at],
        z[at],
        x[at],
        y[at],
        np.einsum("nij,nj->ni", jacobian, velocity[at]),
        np.einsum("nij,nj->ni", jacobian, velocity[at] - against),
        per_line,
        per_point[:, :, 2],
        np.maximum(sd_px, 1e-3) * 1.25 / np.sqrt(count[at]),
        z_sd[at],
        host.omega_rad_per_s * times,
        at / len(frames),
    )


def with_places_on_time(series: Series, delay_s: float) -> Series:
    """``series`` whose bodies stand where they would if the second camera were not late by ``delay_s``, but for half of
    that, by which both bodies are late alike.  What it makes of heights goes with the velocity, and would pass for a
    vertical motion of the Host; beyond that half it moves places with the velocity, the more the farther from the
    middle between the cameras, and would pass for a wall of another shape.  The frames on either side of an impact,
    of which one may have a picture from the other side, are left out where that is not rare.  Points stay as they
    are."""
    if series.cameras is None or series.layouts is None:
        return series
    motions = []
    for motion, run in zip(series.motions, series.runs, strict=True):
        changed: dict[str, Array] = {}
        for body in ("host", "nes"):
            places = motion[[f"{body}_{a}_m" for a in "xyz"]].to_numpy(float)
            at = np.flatnonzero(np.isfinite(places).all(1))
            velocity = np.zeros((len(at), 3))
            if body == "host":
                velocity[:, :2] = run.data.host.at(run.data.time_s[at], 1)[:, :2]
            else:
                velocity[:, :2] = _within_flights(run, at, places[at, :2])
            place = np.column_stack([places[at, :2], np.full(len(at), float(np.mean(series.layouts[body][:, 2])))])
            _, per_point, jacobian = _derivatives(series.cameras, place, 1)
            late_m = np.einsum("nia,nij,nj->na", per_point, jacobian, velocity) - 0.5 * velocity
            places[at] -= delay_s * late_m
            changed |= {f"{body}_{a}_m": places[:, i] for i, a in enumerate("xyz")}
        moved = motion.assign(**changed)
        if abs(delay_s) > MIXED * series.period_s:
            beside = np.concatenate([run.segments.gaps, run.segments.gaps + 1])
            moved.loc[moved.index[beside], [name for name in moved if name.startswith("nes_")]] = np.nan
        motions.append(moved)
    return with_motions(series, motions)


def _within_flights(run: Run, at: NDArray[np.int64], xy_m: Array) -> Array:
    """Velocities (N, 2) at frames ``at`` from places ``xy_m`` (N, 2), never across an impact; 0 where a flight has one
    frame."""
    out = np.zeros(xy_m.shape)
    flight = np.searchsorted(np.sort(run.segments.gaps), at, side="left")
    for one in np.unique(flight):
        here = np.flatnonzero(flight == one)
        if len(here) > 1:
            out[here] = np.gradient(xy_m[here], run.data.time_s[at[here]], axis=0)
    return out


def _against_host(z: Array, z_sd: Array, motion: pd.DataFrame, run: Run, body: str) -> tuple[Array, Array]:
    """Heights (N,) of a body without the Host's own rise and fall, and their sds: of the disk frame by frame, as the
    Host was seen, for a path that follows it misses what starts or stops; of the Host itself by its path."""
    host = run.data.host
    level = float(host.harmonics[2, 0])
    if body == "host":
        return z - (host.at(run.data.time_s)[:, 2] - level), z_sd
    seen, seen_sd = (motion[f"host_z{what}_m"].to_numpy(float) for what in ("", "_sd"))
    return z - (seen - level), np.hypot(z_sd, seen_sd)


def _derivatives(cameras: tuple[Camera, ...], place: Array, view: int) -> tuple[Array, Array, Array]:
    """d(epipolar)/d(u, v of a view) (N, 2), d(point)/d(the same) (N, 2, 3), and d(its pixel)/d(place) (N, 2, 3)."""
    uv = [camera.project(place) for camera in cameras]
    one = np.ones(len(place))
    base = triangulate_points(cameras, uv, [one, one])
    step = 0.5
    epipolar, point = np.empty((len(place), 2)), np.empty((len(place), 2, 3))
    for axis in range(2):
        moved = [each.copy() for each in uv]
        moved[view][:, axis] += step
        shifted = triangulate_points(cameras, moved, [one, one])
        epipolar[:, axis] = (shifted.epipolar_px - base.epipolar_px) / step
        point[:, axis] = (shifted.points_m - base.points_m) / step
    return epipolar, point, cameras[view].project_with_jacobian(place)[1]
