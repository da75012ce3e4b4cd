"""A series on its way to a diagnosis: recordings, points, motion, fitted runs; measured again when a correction asks
for it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run, prepare
from analysis.flights.stated_terms import holding_laws
from analysis.motion.bodies import bodies_clouds, layouts_from_points, motion_from_points
from analysis.motion.rig_frame import RigFrame, rig_frame
from ovines.camera import Camera
from ovines.camera.changes import PictureChange
from ovines.core.laws.terms import WrittenLaw
from ovines.recording import Recording

Array = NDArray[np.float64]
#: (tracks, cameras, recording, window shift of the second camera (u, v)) -> table points
Triangulate = Callable[[pd.DataFrame, Sequence[Camera], Recording, tuple[float, float]], pd.DataFrame]
#: what a correction makes of table points
Change = Callable[[pd.DataFrame], pd.DataFrame]


@dataclass(frozen=True, eq=False)
class Series:
    """Recordings with whatever tables they brought, in the rig's ``frame``; ``motions`` and ``runs`` follow from them.

    ``tracks`` and ``points`` are None where the series enters later; ``cameras`` (which see the rig's frame, too) None
    without a calibration;
    ``layouts`` the markers' real places, ``triangulate`` how points are made of tracks again, with the second camera's
    window moved by ``window_px`` (u, v) and each of ``changes`` made to them; ``laws``: written ones that the nominal
    model holds, in the world; ``picture_changes`` since the calibration that the cameras' fields have, and how much
    beside these they bend pictures (camera -> RMS, px); ``lens_sds`` by which these fields predict the halves of runs
    that they were not learnt from.
    """

    recordings: tuple[Recording, ...]
    frame: RigFrame
    motions: tuple[pd.DataFrame, ...]
    runs: tuple[Run, ...]
    points: tuple[pd.DataFrame, ...] | None = None
    tracks: tuple[pd.DataFrame, ...] | None = None
    cameras: tuple[Camera, ...] | None = None
    layouts: dict[str, Array] | None = None
    triangulate: Triangulate | None = None
    window_px: tuple[float, float] = (0.0, 0.0)
    changes: tuple[Change, ...] = ()
    laws: tuple[WrittenLaw, ...] = ()
    picture_changes: tuple[PictureChange, ...] = ()
    picture_bends_px: Mapping[str, float] = field(default_factory=dict)
    lens_sds: float = 0.0

    @property
    def names(self) -> list[str]:
        """Names of the runs, in their order."""
        return [run.data.name for run in self.runs]

    @property
    def period_s(self) -> float:
        """From frame to frame (median of the runs)."""
        return float(np.median([run.data.period_s for run in self.runs]))

    @property
    def contact_radius_m(self) -> float:
        """As stated: what lengths of the rig are stated in shares of."""
        return float(self.runs[0].data.contact_radius_m)


def from_motions(
    recordings: Sequence[Recording], motions: Sequence[pd.DataFrame], laws: Sequence[WrittenLaw] = ()
) -> Series:
    """A series that enters at ``motion``, in the world as it came."""
    frame = rig_frame(motions)
    return _of_motions(recordings, [frame.motion(motion, k) for k, motion in enumerate(motions)], frame, laws)


def from_points(
    recordings: Sequence[Recording],
    points: Sequence[pd.DataFrame],
    cameras: Sequence[Camera] | None = None,
    tracks: Sequence[pd.DataFrame] | None = None,
    triangulate: Triangulate | None = None,
    laws: Sequence[WrittenLaw] = (),
) -> Series:
    """A series that enters at ``points`` (or earlier), in the world as it came: marker layouts are learnt from all its
    recordings together.
    """
    layouts = layouts_of(recordings, points)
    motions = [motion_from_points(p, r, layouts) for p, r in zip(points, recordings, strict=True)]
    frame = rig_frame(motions)
    series = _of_motions(recordings, [frame.motion(motion, k) for k, motion in enumerate(motions)], frame, laws)
    return replace(
        series,
        layouts=layouts,
        triangulate=triangulate,
        points=tuple(frame.points(p, k) for k, p in enumerate(points)),
        cameras=None if cameras is None else tuple(frame.camera(camera) for camera in cameras),
        tracks=None if tracks is None else tuple(frame.points(t, k) for k, t in enumerate(tracks)),
    )


def layouts_of(recordings: Sequence[Recording], points: Sequence[pd.DataFrame]) -> dict[str, Array]:
    """The markers' real places (M, 3; m) of both bodies, as these points of some recordings show them."""
    clouds = [bodies_clouds(p, r) for p, r in zip(points, recordings, strict=True)]
    return layouts_from_points({body: [c[body] for c in clouds] for body in ("host", "nes")}, recordings[0])


def _of_motions(
    recordings: Sequence[Recording], motions: Sequence[pd.DataFrame], frame: RigFrame, laws: Sequence[WrittenLaw]
) -> Series:
    """A series from motions that are in the rig's frame already."""
    runs = _named(prepare(motions, recordings, frame), recordings)
    return Series(tuple(recordings), frame, tuple(motions), tuple(holding_laws(runs, laws, frame)), laws=tuple(laws))


def _named(runs: Sequence[Run], recordings: Sequence[Recording]) -> list[Run]:
    """Runs carry their folder's name: what tables and figures call them."""
    return [
        replace(run, data=replace(run.data, name=recording.folder.resolve().name))
        for run, recording in zip(runs, recordings, strict=True)
    ]


def with_points(series: Series, points: Sequence[pd.DataFrame]) -> Series:
    """The same series measured again: new points (in the rig's frame), everything after them anew."""
    layouts = layouts_of(series.recordings, points)
    motions = [motion_from_points(p, r, layouts) for p, r in zip(points, series.recordings, strict=True)]
    fresh = _of_motions(series.recordings, motions, series.frame, series.laws)
    return replace(series, motions=fresh.motions, runs=fresh.runs, points=tuple(points), layouts=layouts)


def with_window_shift(series: Series, shift_px: tuple[float, float]) -> Series:
    """Second camera's window moved by ``shift_px`` (u, v) further, and all points triangulated again."""
    if series.tracks is None or series.cameras is None or series.triangulate is None:
        return series
    (u, v), (du, dv) = series.window_px, shift_px
    return with_tracks(replace(series, window_px=(u + du, v + dv)), series.tracks)


def with_tracks(series: Series, tracks: Sequence[pd.DataFrame]) -> Series:
    """The same series measured again from ``tracks``, with whatever had been corrected in its points; `ValueError`
    where it has no cameras."""
    if series.cameras is None or series.triangulate is None:
        raise ValueError("points are triangulated again from tracks of a calibrated rig only")
    points = []
    for table, recording in zip(tracks, series.recordings, strict=True):
        seen = series.triangulate(table, series.cameras, recording, series.window_px)
        for change in series.changes:
            seen = change(seen)
        points.append(seen)
    return with_points(replace(series, tracks=tuple(tracks)), points)


def _changed(series: Series, change: Change) -> Series:
    """The same series with its points changed, which a later triangulation will not undo."""
    assert series.points is not None
    return with_points(replace(series, changes=(*series.changes, change)), [change(p) for p in series.points])


def scaled(series: Series, factor: float) -> Series:
    """Every length times ``factor``."""
    if series.points is not None:
        columns = ["x_m", "y_m", "z_m", "x_sd_m", "y_sd_m", "z_sd_m"]
        return _changed(series, lambda points: points.assign(**{c: points[c] * factor for c in columns}))
    columns = [c for c in series.motions[0] if c.endswith(("_m", "_m_per_s"))]
    return _of_motions(
        series.recordings,
        [m.assign(**{c: m[c] * factor for c in columns}) for m in series.motions],
        series.frame,
        series.laws,
    )


def retimed(series: Series, factor: float) -> Series:
    """Every time times ``factor``."""
    if series.points is not None:
        return _changed(series, lambda points: points.assign(time_s=points["time_s"] * factor))
    return _of_motions(
        series.recordings, [m.assign(time_s=m["time_s"] * factor) for m in series.motions], series.frame, series.laws
    )


def with_times(series: Series, truly: Callable[[Array, Run], Array]) -> Series:
    """Every run's times (N,) replaced by what ``truly`` makes of them."""

    def retold(tables: Sequence[pd.DataFrame]) -> list[pd.DataFrame]:
        return [
            table.assign(time_s=truly(table["time_s"].to_numpy(float), run))
            for table, run in zip(tables, series.runs, strict=True)
        ]

    if series.points is not None:
        tracks = None if series.tracks is None else tuple(retold(series.tracks))
        return with_points(replace(series, tracks=tracks), retold(series.points))
    return with_motions(series, retold(series.motions))


def levelled(series: Series, slope_x: float, slope_y: float) -> Series:
    """World turned so that a plane z = slope_x x + slope_y y becomes z = 0."""
    if series.points is None:
        return series
    normal = np.array([-slope_x, -slope_y, 1.0])
    normal /= np.linalg.norm(normal)
    axis = np.cross(normal, [0.0, 0.0, 1.0])
    sine, cosine = np.linalg.norm(axis), normal[2]
    k = axis / sine if sine > 0 else axis
    cross = np.array([[0, -k[2], k[1]], [k[2], 0, -k[0]], [-k[1], k[0], 0]])
    turn = np.eye(3) + sine * cross + (1 - cosine) * cross @ cross

    def turned(points: pd.DataFrame) -> pd.DataFrame:
        xyz = points[["x_m", "y_m", "z_m"]].to_numpy(float) @ turn.T
        return points.assign(x_m=xyz[:, 0], y_m=xyz[:, 1], z_m=xyz[:, 2])

    return _changed(series, turned)


def without_jitter(series: Series, sd_s: float, calm: Series) -> Series:
    """Frame times moved to where the Host's known motion puts them, as far as its noise allows; the rest widens the
    sds.

    A frame that is late by d shows the Host v d further on: d is estimated per frame from the Host's residual, drawn to
    zero by its prior sd; where the Host stands still for a moment nothing is learnt and the whole jitter stays in the
    NES' sd.  The residual is that of the ``calm`` Host, which does nothing beside its drive.
    """
    motions = []
    for run, still, motion in zip(series.runs, calm.runs, series.motions, strict=True):
        times = run.data.time_s
        velocity, residual = run.data.host.at(times, 1)[:, :2], still.data.host.residual[:, :2]
        residual = np.where(np.isfinite(residual), residual, 0.0)
        variance = np.maximum(np.nanmedian(run.host_table[:, 4:6], 0), 1e-7) ** 2
        seen = np.isfinite(still.data.host.residual[:, 0])
        information = np.sum(velocity**2 / variance, 1) * seen + 1 / sd_s**2
        late = np.sum(velocity * residual / variance, 1) / information
        left = 1 / np.sqrt(information)
        speed = np.hypot(*(motion[f"nes_v{a}_m_per_s"].fillna(0.0).to_numpy(float) for a in "xy"))
        spin = np.abs(motion["nes_spin_rad_per_s"].fillna(0.0).to_numpy(float))
        moved = motion.assign(time_s=times + late)
        for axis in "xy":
            moved[f"nes_{axis}_sd_m"] = np.hypot(motion[f"nes_{axis}_sd_m"].to_numpy(float), speed * left)
        moved["nes_angle_sd_rad"] = np.hypot(motion["nes_angle_sd_rad"].to_numpy(float), spin * left)
        motions.append(moved)
    fresh = _of_motions(series.recordings, motions, series.frame, series.laws)
    return replace(fresh, points=None, layouts=series.layouts)


def with_motions(series: Series, motions: Sequence[pd.DataFrame]) -> Series:
    """The same series with other ``motions`` (in the rig's frame) of the same points, and the runs that follow."""
    fresh = _of_motions(series.recordings, motions, series.frame, series.laws)
    return replace(series, motions=fresh.motions, runs=fresh.runs)


def with_blur(series: Series, sd_s: float) -> Series:
    """The NES' sds widened by the way (and the turn) of ``sd_s``: what is smeared cannot be made sharp."""
    motions = []
    for motion in series.motions:
        speed = np.hypot(*(motion[f"nes_v{a}_m_per_s"].fillna(0.0).to_numpy(float) for a in "xy"))
        spin = np.abs(motion["nes_spin_rad_per_s"].fillna(0.0).to_numpy(float))
        wider = {f"nes_{a}_sd_m": np.hypot(motion[f"nes_{a}_sd_m"].to_numpy(float), sd_s * speed) for a in "xy"}
        wider["nes_angle_sd_rad"] = np.hypot(motion["nes_angle_sd_rad"].to_numpy(float), sd_s * spin)
        motions.append(motion.assign(**wider))
    return with_motions(series, motions)


def with_host_moved(series: Series, moves: Sequence[Array]) -> Series:
    """The Host's places moved by (N, 2; m) in each run."""
    motions = [
        motion.assign(host_x_m=motion["host_x_m"] + move[:, 0], host_y_m=motion["host_y_m"] + move[:, 1])
        for motion, move in zip(series.motions, moves, strict=True)
    ]
    return with_motions(series, motions)
