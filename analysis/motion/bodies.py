"""Points to the motion of Host and NES: pose of each body per frame, with standard deviations and velocities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.motion.pose import MarkerCloud, Pose, fit_pose, refine_layout, unwrap_angle
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import PLACEMENT_SD_M

Array = NDArray[np.float64]

#: q of I = q m R^2 of a full disk of even density, where recording.toml gives none
INERTIA_OF_A_DISK = 0.5
# Uncertainty of a marker's place after the recording itself has shown it.
REFINED_SD_M = 1e-6
# Frames on each side of a local parabola that gives the velocities.
VELOCITY_REACH = 3
# Uncertainty of a layout that one frame has shown: far above a point's error, which the refinement averages away.
ONE_FRAME_SD_M = 1e-3
# Sd of a point that comes without one: what cameras usually reach.
UNKNOWN_SD_M = 1e-5


def cloud_of(points: pd.DataFrame, markers: Sequence[str], frames: NDArray[np.int64], times: Array) -> MarkerCloud:
    """The points of some markers as arrays (frames, markers, 3), NaN where unseen."""
    position = np.full((len(frames), len(markers), 3), np.nan)
    sd = np.full_like(position, np.nan)
    number, names = pd.factorize(points["marker"])
    column = np.array([list(markers).index(name) if name in markers else -1 for name in names], int)[number]
    own = column >= 0
    place = np.searchsorted(frames, points["frame"].to_numpy()[own]), column[own]
    position[place] = points[["x_m", "y_m", "z_m"]].to_numpy(float)[own]
    sd[place] = points[["x_sd_m", "y_sd_m", "z_sd_m"]].to_numpy(float)[own]
    return MarkerCloud(frames, times, position, np.where(np.isfinite(position) & ~np.isfinite(sd), UNKNOWN_SD_M, sd))


def frames_and_times(points: pd.DataFrame, recording: Recording) -> tuple[NDArray[np.int64], Array]:
    """Every frame from the first to the last with a point, and its time; unseen frames' times are interpolated."""
    if points.empty:
        raise InputError(
            f"{recording.folder}: no points of any marker",
            "points of the Host's and the NES' markers",
            "check tracks: was each marker seen by both cameras?",
        )
    first = points.groupby("frame", sort=True)["time_s"].first()
    frames = np.arange(first.index.min(), first.index.max() + 1, dtype=np.int64)
    times = np.interp(frames, first.index.to_numpy(float), first.to_numpy(float))
    return frames, times


def layouts_from_points(clouds: Mapping[str, Sequence[MarkerCloud]], recording: Recording) -> dict[str, Array]:
    """Real marker places (M, 3) of "host" and "nes" in their own frame, learnt from one or more recordings of a rig.

    With ``layout_m`` the design is the start and its frame is kept; without it the first frame that shows all markers
    gives the layout, its origin being the centre marker (NES) or the centre of the circle through the markers.
    """
    layouts = {}
    for name, parts in clouds.items():
        body = recording.bodies[name]
        whole = MarkerCloud(
            *(np.concatenate([getattr(c, f) for c in parts]) for f in ("frame", "time_s", "position_m", "sd_m"))
        )
        if body.layout_m is not None:
            design = np.asarray(body.layout_m, float)
            layouts[name], _ = refine_layout(whole, design, body.layout_sd_m or PLACEMENT_SD_M)
        else:
            design = _layout_of_first(whole, body.markers, getattr(body, "centre_marker", None), name)
            layouts[name], _ = refine_layout(whole, design, ONE_FRAME_SD_M)
    return layouts


def _layout_of_first(cloud: MarkerCloud, markers: Sequence[str], centre: str | None, body: str) -> Array:
    seen = np.isfinite(cloud.position_m[..., 0])
    complete = seen.all(1)
    if not complete.any():
        raise InputError(
            f"{body}: no frame shows all of its markers {', '.join(markers)} in both cameras",
            "one such frame, or layout_m",
            f"give [bodies.{body}] layout_m, or leave out markers never seen",
        )
    place = cloud.position_m[np.flatnonzero(complete)[0]]
    if centre is not None and centre in markers:
        origin = place[list(markers).index(centre), :2]
    elif len(markers) >= 3:
        a = np.column_stack([2 * place[:, :2], np.ones(len(place))])
        origin = np.linalg.lstsq(a, np.sum(place[:, :2] ** 2, 1), rcond=None)[0][:2]
    else:
        origin = place[:, :2].mean(0)
    return np.column_stack([place[:, :2] - origin, place[:, 2]])


def bodies_clouds(points: pd.DataFrame, recording: Recording) -> dict[str, MarkerCloud]:
    """The marker clouds of the Host and the NES; refused when a body has fewer than two markers."""
    frames, times = frames_and_times(points, recording)
    clouds = {}
    for name in ("host", "nes"):
        body = recording.bodies.get(name)
        if body is None or len(body.markers) < 2:
            raise InputError(
                f"{recording.folder}: [bodies.{name}] has {len(body.markers) if body else 0} marker(s)",
                "two or more markers",
                f"list the markers of the {name} in recording.toml",
            )
        clouds[name] = cloud_of(points, body.markers, frames, times)
    return clouds


def poses(points: pd.DataFrame, recording: Recording, layouts: Mapping[str, Array] | None = None) -> dict[str, Pose]:
    """Pose of Host and NES per frame (see :func:`motion_from_points`)."""
    clouds = bodies_clouds(points, recording)
    layouts = layouts or layouts_from_points({name: [cloud] for name, cloud in clouds.items()}, recording)
    return {name: fit_pose(cloud, np.asarray(layouts[name]), REFINED_SD_M) for name, cloud in clouds.items()}


def motion_from_points(
    points: pd.DataFrame, recording: Recording, layouts: Mapping[str, Array] | None = None
) -> pd.DataFrame:
    """Table ``motion`` from table ``points``: rigid-body poses of NES and Host.

    The marker layouts are those of ``recording``, refined by the points themselves; ``layouts`` (from
    :func:`layouts_from_points`) hands in those of a whole series.  A body with fewer than two markers in a frame has
    nulls there.  Velocities are slopes of local parabolas over 7 frames (null at gaps); they are for looking, the
    identification fits positions.

    Examples
    --------
    How well is the disk's place known, and how many of its markers were seen at least?

    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> cameras = read_calibration(recording.calibration_file)
    >>> points = triangulate(read_table(recording.folder / "tracks.parquet", "tracks"), cameras, recording)
    >>> from analysis.motion.bodies import motion_from_points
    >>> motion = motion_from_points(points, recording)
    >>> f"{1e6 * motion['nes_x_sd_m'].median():.0f} µm", int(motion["nes_markers"].min())
    ('11 µm', 3)
    """
    frames, times = frames_and_times(points, recording)
    found = poses(points, recording, layouts)
    table = pd.DataFrame({"frame": frames, "time_s": times})
    for name in ("nes", "host"):
        pose = found[name]
        angle = unwrap_angle(times, pose.angle_rad)
        columns = {
            "x_m": pose.xy_m[:, 0],
            "y_m": pose.xy_m[:, 1],
            "z_m": pose.z_m,
            "angle_rad": angle,
            **{f"{axis}_sd_m": np.hypot(pose.xy_sd_m, _common_sd(points, recording, name, axis)) for axis in "xy"},
            "z_sd_m": pose.z_sd_m,
            "angle_sd_rad": pose.angle_sd_rad,
        }
        for key, values in columns.items():
            table[f"{name}_{key}"] = values
        for axis in "xyz":
            table[f"{name}_v{axis}_m_per_s"] = _slopes(times, columns[f"{axis}_m"])
        table[f"{name}_spin_rad_per_s"] = _slopes(times, angle)
        table[f"{name}_markers"] = pd.array(pose.markers, dtype="Int64")
    return table


def _common_sd(points: pd.DataFrame, recording: Recording, body: str, axis: str) -> float:
    """What all markers of a body are off by together (m), which more of them do not average out."""
    column = f"{axis}_common_sd_m"
    if column not in points:
        return 0.0
    own = points.loc[points["marker"].isin(recording.bodies[body].markers), column]
    return float(own.median()) if own.notna().any() else 0.0


def _slopes(times: Array, values: Array) -> Array:
    """Slope at the middle of a parabola through 2 reach + 1 frames; NaN where one of them is missing."""
    n, reach = len(times), VELOCITY_REACH
    slopes = np.full(n, np.nan)
    if n < 2 * reach + 1:
        return slopes
    t = np.lib.stride_tricks.sliding_window_view(times, 2 * reach + 1)
    v = np.lib.stride_tricks.sliding_window_view(values, 2 * reach + 1)
    t = t - t[:, reach : reach + 1]
    scale = t[:, -1:] - t[:, :1]
    s = t / scale
    design = np.stack([np.ones_like(s), s, s * s], -1)
    normal = design.transpose(0, 2, 1) @ design
    right = design.transpose(0, 2, 1) @ v[..., None]
    slopes[reach : n - reach] = np.linalg.solve(normal, right)[:, 1, 0] / scale[:, 0]
    return slopes
