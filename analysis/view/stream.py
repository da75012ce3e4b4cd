"""A recording's results written into rerun: pictures with what was found on them, the scene in space, time curves.

rerun (optional extra `view`) has its own viewer with scrubbing, zooming and hiding; here is only what it shows.  Its
pixels start at the picture's corner, ours at the middle of the first pixel: `HALF` lies between them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
import rerun as rr
from numpy.typing import NDArray

from analysis.figures.style import DEG, GREEN, GREY, HOST_COLOUR, MM, NES_COLOUR, ORANGE
from analysis.view.doubtful_frames import Doubtful
from analysis.view.outlines import body_lines, design_markers, placed, poses, seen_by, wall_gap_m
from ovines.camera import Camera
from ovines.recording import Recording

Array = NDArray[np.float64]
Picture = tuple[int, Mapping[str, bytes]]
HALF = 0.5
DOUBTFUL = "doubtful"  # a timeline: 1 is the worst
COLOURS = {"nes": NES_COLOUR, "host": HOST_COLOUR, "ground": GREEN, "simulated": ORANGE}
NAME_COLOURS = {
    "nes": "#8ecbff",
    "host": "#ffb48a",
    "ground": "#7fe3c0",
}  # lighter: a name stands in its dot's colour on a grey box
WIDTHS = {"simulated": 1.5}  # of a curve; a measured one shows on both sides of the simulated that covers it
CURVES = {"x (mm)": ("x_m", MM), "y (mm)": ("y_m", MM), "angle (°)": ("angle_rad", DEG)}
WHITE = "#ffffff"  # the viewer is dark
LINE_M, POINT_M = 2.5e-4, 1.2e-3


@dataclass(frozen=True, eq=False)
class Shown:
    """What there is to show; a table that is None is left out.

    ``cameras`` may be empty (a recording that enters at its motion); ``simulation`` is a table of that name;
    ``notes`` is text to read beside it, ``doubtful`` what to look at first, worst first.
    """

    recording: Recording
    motion: pd.DataFrame | None = None
    simulation: pd.DataFrame | None = None
    cameras: Sequence[Camera] = ()
    tracks: pd.DataFrame | None = None
    points: pd.DataFrame | None = None
    impacts: pd.DataFrame | None = None
    notes: Sequence[str] = field(default_factory=tuple)
    doubtful: Sequence[Doubtful] = field(default_factory=tuple)

    def body_of(self) -> Mapping[str, str]:
        """Name of the body of each marker."""
        return {marker: name for name, body in self.recording.bodies.items() for marker in body.markers}

    @property
    def last_frame(self) -> int:
        """Of any table."""
        tables = [one for one in (self.motion, self.points, self.tracks) if one is not None and len(one)]
        return max((int(one["frame"].max()) for one in tables), default=0)

    def motions(self) -> Iterator[tuple[str, str, pd.DataFrame]]:
        """(name to show, body, table) of everything that moves."""
        if self.motion is not None:
            yield from (("host", "host", self.motion), ("nes", "nes", self.motion))
        if self.simulation is not None:
            yield "simulated", "nes", self.simulation


def write(stream: rr.RecordingStream, shown: Shown, pictures: Iterable[Picture] = ()) -> int:
    """Send everything to ``stream`` and return the number of frames with a picture.

    ``pictures`` gives a frame number and one JPEG per camera that has that frame; they are taken one at a time, so
    that a long recording needs no room in memory.
    """
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for camera in shown.cameras:
        _camera(stream, shown, camera)
    _points(stream, shown)
    _bodies(stream, shown)
    _curves(stream, shown)
    _impacts(stream, shown)
    if shown.notes:
        stream.log("notes", rr.TextDocument("\n\n".join(shown.notes), media_type="text/markdown"), static=True)
    _doubtful(stream, shown)
    clock, count = _clock(shown), 0
    rank = {one.frame: number for number, one in enumerate(shown.doubtful, 1)}
    for frame, by_camera in pictures:
        stream.set_time("frame", sequence=frame)
        stream.set_time("time", duration=clock(frame))
        if frame in rank:
            stream.set_time(DOUBTFUL, sequence=rank[frame])
        else:
            stream.disable_timeline(DOUBTFUL)
        for name, jpeg in by_camera.items():
            stream.log(camera_path(name) + "/image", rr.EncodedImage(contents=jpeg, media_type="image/jpeg"))
        count += bool(by_camera)
    return count


def camera_path(name: str) -> str:
    """Where a camera's entities lie; its name escaped."""
    return rr.new_entity_path(["world", "cameras", name]).lstrip("/")


def _clock(shown: Shown) -> Callable[[int], float]:
    """Time of a frame: a table's, between its rows interpolated, else the recording's own."""
    table = next((one for one in (shown.motion, shown.points, shown.tracks) if one is not None and len(one)), None)
    if table is None:
        return lambda frame: float(shown.recording.times_s([frame])[0])
    once = table.drop_duplicates("frame").sort_values("frame")
    frames, times_s = once["frame"].to_numpy(float), once["time_s"].to_numpy(float)
    return lambda frame: float(np.interp(frame, frames, times_s))


def _camera(stream: rr.RecordingStream, shown: Shown, camera: Camera) -> None:
    """The camera's place, its tracks by name, and the bodies as the poses say it should see them."""
    settings, path = shown.recording.camera(camera.name), camera_path(camera.name)
    offset, size = settings.window_offset_px, settings.window_px
    matrix = camera.matrix.copy()
    matrix[:2, 2] += HALF - np.asarray(offset)
    distance_m = float(np.linalg.norm(camera.centre_m))
    stream.log(
        path,
        rr.Transform3D(translation=camera.centre_m, mat3x3=camera.rotation.T),
        rr.Pinhole(
            image_from_camera=matrix,
            resolution=size,
            camera_xyz=rr.ViewCoordinates.RDF,
            image_plane_distance=0.15 * distance_m,
        ),
        static=True,
    )
    if shown.tracks is not None:
        own, bodies = shown.tracks[shown.tracks["camera"] == camera.name], shown.body_of()
        for body, rows in own.groupby(own["marker"].map(bodies)):
            places = rows[["u_px", "v_px"]].to_numpy(float) + HALF
            _send_points(stream, f"{path}/tracks/{body}", rows, places, str(body), 2.0, shown.last_frame)
    for name, body, table in shown.motions():
        frames, pose = table["frame"].to_numpy(), poses(table, body)
        lines = [
            seen_by(camera, offset, placed(pose, line)) + HALF for line in body_lines(shown.recording).get(body, [])
        ]
        _send_lines(stream, f"{path}/bodies/{name}", frames, table["time_s"].to_numpy(float), lines, name, 0.6)
        if name in (designed := design_markers(shown.recording)):
            where = seen_by(camera, offset, placed(pose, designed[name])) + HALF
            rows, places = _rows_of(table, where)
            _send_points(stream, f"{path}/layout/{name}", rows, places, name, 0.8, shown.last_frame)


def _points(stream: rr.RecordingStream, shown: Shown) -> None:
    """Triangulated markers in space, by body."""
    if shown.points is None:
        return
    for body, rows in shown.points.groupby(shown.points["marker"].map(shown.body_of())):
        places = rows[["x_m", "y_m", "z_m"]].fillna({"z_m": 0.0}).to_numpy(float)  # one camera knows no z
        _send_points(stream, f"world/points/{body}", rows, places, str(body), POINT_M, shown.last_frame)


def _bodies(stream: rr.RecordingStream, shown: Shown) -> None:
    """NES, wall and simulated NES in space, and the whole path of the NES."""
    for name, body, table in shown.motions():
        pose = poses(table, body)
        lines = [placed(pose, line) for line in body_lines(shown.recording).get(body, [])]
        _send_lines(
            stream,
            f"world/bodies/{name}",
            table["frame"].to_numpy(),
            table["time_s"].to_numpy(float),
            lines,
            name,
            LINE_M,
        )
    if shown.motion is not None:
        path = poses(shown.motion, "nes")[:, :3]
        seen = np.asarray(np.isfinite(path).all(1))
        parts = np.split(np.arange(len(path)), np.flatnonzero(np.diff(seen)) + 1)
        strips = [path[part] for part in parts if len(part) > 1 and seen[part[0]]]
        stream.log("world/path", rr.LineStrips3D(strips, colors=_rgb(GREY), radii=LINE_M / 2), static=True)


def _curves(stream: rr.RecordingStream, shown: Shown) -> None:
    """x, y, angle and the room to the wall over time, measured and simulated."""
    for name, body, table in shown.motions():
        times = [
            rr.TimeColumn("frame", sequence=table["frame"].to_numpy()),
            rr.TimeColumn("time", duration=table["time_s"].to_numpy(float)),
        ]
        curves = {title: scale * table[f"{body}_{ending}"].to_numpy(float) for title, (ending, scale) in CURVES.items()}
        if body == "nes" and (gap := wall_gap_m(table, shown.recording)) is not None:
            curves["room to the wall (mm)"] = MM * gap
        for title, values in curves.items():
            path = "/" + curve_path(title) + "/" + name
            stream.log(
                path, rr.SeriesLines(colors=_rgb(COLOURS[name]), names=name, widths=WIDTHS.get(name, 4.0)), static=True
            )
            stream.send_columns(path, times, rr.Scalars.columns(scalars=values))


def curve_path(title: str) -> str:
    """Entity of a curve: its title without the unit."""
    return "curves/" + title.split(" (", maxsplit=1)[0].replace(" ", "_")


def _impacts(stream: rr.RecordingStream, shown: Shown) -> None:
    """Each impact as a line of text at its instant, and as a mark at zero room to the wall."""
    if shown.impacts is None or shown.motion is None:
        return
    clock = shown.motion["time_s"].to_numpy(float)
    path = "/" + curve_path("room to the wall (mm)") + "/impacts"
    stream.log(path, rr.SeriesPoints(colors=_rgb(WHITE), names="impacts", markers="cross", marker_sizes=5), static=True)
    for one in shown.impacts.itertuples():
        stream.set_time(
            "frame", sequence=int(shown.motion["frame"].iloc[min(np.searchsorted(clock, one.time_s), len(clock) - 1)])
        )
        stream.set_time("time", duration=float(one.time_s))
        speeds = f"{one.normal_speed_before_m_per_s:.3f} -> {one.normal_speed_after_m_per_s:.3f} m/s"
        restitution = f"restitution {one.restitution:.4f}" if np.isfinite(one.restitution) else "no restitution"
        stream.log("impacts", rr.TextLog(f"impact {one.impact}: normal speed {speeds}, {restitution}"))
        stream.log(path, rr.Scalars(0.0))


def _doubtful(stream: rr.RecordingStream, shown: Shown) -> None:
    """What to look at as lines of text, and its markers once more on a timeline that has these frames alone: there one
    key goes from one to the next.
    """
    for number, one in enumerate(shown.doubtful, 1):
        stream.set_time("frame", sequence=one.frame)
        stream.set_time("time", duration=one.time_s)
        stream.set_time(DOUBTFUL, sequence=number)
        level = "WARN" if one.kind in ("swap", "slip") else "INFO"
        stream.log("doubtful", rr.TextLog(f"{number}: {one.text} ({one.kind}, frame {one.frame})", level=level))
        if shown.tracks is None:
            continue
        bodies, here = shown.body_of(), shown.tracks[shown.tracks["frame"] == one.frame]
        for camera in shown.cameras:
            own = here[here["camera"] == camera.name]
            for body in {*bodies.values()}:
                rows = own[own["marker"].map(bodies) == body]
                places = rows[["u_px", "v_px"]].to_numpy(float) + HALF
                path = f"{camera_path(camera.name)}/tracks/{body}"
                stream.log(path, rr.Points2D.from_fields(positions=places, labels=rows["marker"].tolist()))
    stream.disable_timeline(DOUBTFUL)


def _rows_of(table: pd.DataFrame, places: Array) -> tuple[pd.DataFrame, Array]:
    """Frame and time once per point of (frames, n, 2)."""
    rows = table[["frame", "time_s"]].iloc[np.repeat(np.arange(len(table)), places.shape[1])]
    return rows, places.reshape(-1, places.shape[-1])


def _send_points(
    stream: rr.RecordingStream, path: str, rows: pd.DataFrame, places: Array, body: str, radius: float, last: int
) -> None:
    """Points with the names of their markers, those of one frame together; frames without any are empty."""
    seen = np.isfinite(places).all(1)
    rows, places = rows[seen], places[seen]
    order = np.argsort(rows["frame"].to_numpy(), kind="stable")
    rows, places = rows.iloc[order], places[order]
    if not len(rows):
        return
    frames, first, counts = np.unique(rows["frame"].to_numpy(), return_index=True, return_counts=True)
    times = rows["time_s"].to_numpy(float)[first]
    kind = rr.Points2D if places.shape[1] == 2 else rr.Points3D
    named = {"labels": rows["marker"].tolist()} if "marker" in rows else {}
    shown_frames, shown_times, sizes = _with_gaps(frames, times, counts, last)
    stream.send_columns(
        path, _times(shown_frames, shown_times), kind.columns(positions=places, **named).partition(sizes)
    )
    stream.log(
        path,
        kind.from_fields(
            colors=_rgb((NAME_COLOURS if named else COLOURS)[body]),
            radii=radius,
            show_labels=bool(named) and kind is rr.Points2D,
        ),
        static=True,
    )


def _send_lines(
    stream: rr.RecordingStream,
    path: str,
    frames: NDArray[np.int64],
    times: Array,
    lines: Sequence[Array],
    name: str,
    radius: float,
) -> None:
    """Lines, each (frames, n, 2 or 3), as strips per frame; those of a frame in which the body was not seen are left
    out.
    """
    if not lines:
        return
    kind = rr.LineStrips2D if lines[0].shape[-1] == 2 else rr.LineStrips3D
    strips, counts = [], []
    for k in range(len(frames)):
        whole = [line[k] for line in lines if np.isfinite(line[k]).all()]
        strips += whole
        counts.append(len(whole))
    if strips:
        stream.send_columns(path, _times(frames, times), kind.columns(strips=strips).partition(counts))
        stream.log(path, kind.from_fields(colors=_rgb(COLOURS[name]), radii=radius), static=True)


def _with_gaps(
    frames: NDArray[np.int64], times: Array, counts: NDArray[np.intp], last: int
) -> tuple[NDArray[np.int64], Array, NDArray[np.intp]]:
    """An empty batch in the first frame of each gap, one before the recording's ``last`` frame included: what was
    shown last would otherwise stay.
    """
    where = np.flatnonzero(np.diff(np.append(frames, last + 1)) > 1) + 1
    step = np.median(np.diff(times) / np.diff(frames)) if len(times) > 1 else 0.0
    return (
        np.insert(frames, where, frames[where - 1] + 1),
        np.insert(times, where, times[where - 1] + step),
        np.insert(counts, where, 0),
    )


def _times(frames: NDArray[np.int64], times: Array) -> list[rr.TimeColumn]:
    return [rr.TimeColumn("frame", sequence=frames), rr.TimeColumn("time", duration=times)]


def _rgb(colour: str) -> list[int]:
    return [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
