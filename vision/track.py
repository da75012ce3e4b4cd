"""Images to tracks: every marker's sub-pixel centre in every frame of all cameras, under its own name.

The three bodies are tracked as rigid bodies in all cameras at once (`vision.tracking.tracker`).  See
`vision.identity.matching` for naming,
`vision.markers.fit` for centres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.plausibility.calibration import refuse_camera_count
from ovines.recording import Recording
from vision.frames.dropped import DroppedFrames, find_dropped_frames, renumbered, true_numbers
from vision.frames.dropped_by_both import as_dropped, find_common_gaps
from vision.frames.rolling_shutter import without_rolling_shutter
from vision.frames.sources import Source, open_sources, stream_chunks
from vision.frames.times import frame_times
from vision.identity.default_names import names_by_geometry
from vision.identity.layouts import symmetry_notes
from vision.markers.perspective import circle_centres, on_plane
from vision.markers.row import radius_px
from vision.tracking.camera_tracker import CameraTracker
from vision.tracking.disc_sizes import LARGEST_PX, SMALLEST_PX, size_notes
from vision.tracking.duplicate_assignments import unshared
from vision.tracking.exposure import arc_shift, spins
from vision.tracking.jumps import jump_notes
from vision.tracking.manual_names import check_names
from vision.tracking.state import BODY_ANGLE, BODY_X, DISC, DISC_SD, FRAME, HEIGHT, MARKER
from vision.tracking.tracker import Tracker
from vision.walls.table import expected_rims, instants, rims_at, wall_notes, wall_table

_ROWS_AT_ONCE = 100_000  # whose perspective is corrected at once: each takes some hundred bytes
_LEAST_TURN_RAD = 1e-4  # during the exposure; less draws a marker 20 mm from the turning point in by less than 1e-11 m


class Tracks(NamedTuple):
    """`tracks`: the table (docs/chain.md); `notes`: what a reader should know (gaps, bad pictures, lost markers);
    `walls`: inner wall of the Host and rim of the NES from the pictures (table ``walls``)."""

    tracks: pd.DataFrame
    notes: list[str]
    walls: pd.DataFrame


def track(
    recording: Recording,
    cameras: Sequence[Camera],
    names: pd.DataFrame | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Tracks:
    """Track every marker of a recording.

    Parameters
    ----------
    recording : with frames of two cameras, of more, or of one where all moving bodies have their `layout_m`
    cameras : calibrated; the recording's cameras by name
    names : where markers are in the first frame (columns camera, marker, u_px, v_px, window pixels), for bodies
        without `layout_m`; None: as the geometry suggests, see `vision.identity.default_names`
    progress : called with (frames done, frames in all)

    Returns
    -------
    `Tracks`.  Pixels of the window, perspective bias of the circle's centre removed; a marker that was not
    seen has no row.

    Notes
    -----
    Ground markers without a layout are named clockwise as the cameras see them (from above), beginning left (-x).
    """
    by_name = {camera.name: camera for camera in cameras}
    refuse_camera_count(recording)
    strangers = [camera.name for camera in recording.cameras if camera.name not in by_name]
    if strangers:
        raise InputError(
            f"no camera {', '.join(strangers)} in a calibration of {', '.join(sorted(by_name))}",
            "every camera of the recording",
            "give recording.toml and calibration.json the same names",
        )
    if names is not None:
        names = check_names(names)
    sources, notes = open_sources(recording)
    calibrated = [by_name[camera.name] for camera in recording.cameras]
    if names is None:
        names, naming = names_by_geometry(recording, calibrated, sources)
        notes += naming
    own_notes = list(notes)
    tracker, rows = _track(recording, calibrated, sources, names, own_notes, progress)
    tracks = _table(tracker, recording)
    dropped = _dropped(tracks, tracker, recording)
    drop_notes = [f"{drop}; its later frames are renumbered" for drop in dropped]
    # Names are those of the first frame's pictures: they serve again unless that frame itself is given another number.
    named_alike = names is None or all(drop.from_frame > 0 for drop in dropped)
    track_again = dropped and named_alike and all(source.video is None for source in sources)
    if track_again:  # with equal numbers for equal instants no body seems to be in two places, and the walls are seen
        sources = [_moved(source, dropped) for source in sources]
        own_notes = list(notes)
        tracker, rows = _track(recording, calibrated, sources, names, own_notes, progress)
        tracks = _table(tracker, recording)
    elif dropped:
        until = min(drop.from_frame for drop in dropped)
        tracks, rows = _timed(renumbered(tracks, dropped), recording), [row for row in rows if row["frame"] < until]
    known = {name: tracker.layout.position_m[tracker.layout.of(b)] for b, name in enumerate(tracker.layout.bodies)
             if tracker.layout.known[b]}  # fmt: skip
    tracks, rolling = without_rolling_shutter(tracks, recording, by_name, known)
    own_notes += rolling
    rims = expected_rims(recording, tracker.layout)
    placed = {name for name, body in recording.bodies.items() if body.layout_m}
    walls = wall_table(rows, *_instants(tracks))
    time_notes = frame_times(recording, np.unique(tracks["frame"]))[1]
    return Tracks(tracks, own_notes + drop_notes + time_notes + wall_notes(walls, rims, placed), walls)


def _track(
    recording: Recording,
    cameras: Sequence[Camera],
    sources: list[Source],
    names: pd.DataFrame | None,
    notes: list[str],
    progress: Callable[[int, int], None] | None,
) -> tuple[Tracker, list[dict[str, Any]]]:
    """All bodies through all frames, and the walls' rows at some instants; `notes` are added to."""
    numbers = sorted(set().union(*(source.numbers() for source in sources)))
    tracker = Tracker(recording, cameras, names, notes, len(numbers))
    notes.extend(symmetry_notes(tracker.layout, names))
    rows: list[dict[str, Any]] = []
    chosen = instants(numbers)
    done = 0
    for frames, pictures in stream_chunks(sources, notes):
        ends = [k + 1 for k, frame in enumerate(frames) if frame in chosen] + [len(frames)]
        for first, end in pairwise([0, *ends]):
            tracker.track(frames[first:end], pictures[first:end])
            frame, images = frames[end - 1], [image for image in pictures[end - 1] if image is not None]
            if frame in chosen and first < end and len(images) == len(tracker.cameras) > 1:
                calibrated = [one.camera for one in tracker.cameras]
                offsets, rims = [one.offset for one in tracker.cameras], expected_rims(recording, tracker.layout)
                rows += rims_at(frame, images, calibrated, offsets, rims, tracker.centres_m(frame), rows)
        done += len(frames)
        if progress:
            progress(done, len(numbers))
    tracker.pool.shutdown()
    return tracker, rows


def _dropped(tracks: pd.DataFrame, tracker: Tracker, recording: Recording) -> list[DroppedFrames]:
    """Frames dropped by one camera, and by both at once, all in the cameras' own numbers."""
    cameras, layout, offsets = [one.camera for one in tracker.cameras], tracker.layout, recording.window_offset_px
    if len(cameras) != 2:  # one shows nothing missing; of more, which one dropped is not searched for
        return []
    heights = dict(zip(layout.markers, layout.position_m[:, 2], strict=True))
    dropped = find_dropped_frames(tracks, cameras, offsets, heights)
    if "host" not in layout.bodies or not layout.known[layout.bodies.index("host")]:
        return dropped
    gaps = find_common_gaps(
        _timed(renumbered(tracks, dropped), recording),
        cameras,
        offsets,
        heights,
        layout.markers[layout.of(layout.bodies.index("host"))],
    )
    return dropped + as_dropped(gaps, dropped, tracks)


def _moved(source: Source, dropped: Sequence[DroppedFrames]) -> Source:
    """The camera's pictures under the numbers of the instants that they show."""
    own = sorted(source.files)
    return replace(
        source,
        files=dict(
            zip(
                true_numbers(np.array(own), dropped, source.camera.name).tolist(),
                (source.files[number] for number in own),
                strict=True,
            )
        ),
    )


def _timed(tracks: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """With the times of its frame numbers."""
    frames, place = np.unique(tracks["frame"], return_inverse=True)
    tracks["time_s"] = frame_times(recording, frames)[0][place]
    return tracks


def _table(tracker: Tracker, recording: Recording) -> pd.DataFrame:
    """The table, perspective and arc corrected, sorted by camera, frame and marker's place in recording.toml."""
    notes, markers = tracker.notes, np.array(tracker.layout.markers, object)
    tables = []
    for i, one in enumerate(tracker.cameras):
        rows, camera = tracker.recorded(i), one.camera
        frames, marker, discs = rows[:, FRAME].astype(int), rows[:, MARKER].astype(int), rows[:, DISC:DISC_SD]
        uv = np.empty((len(rows), 2))
        for chunk in np.array_split(np.arange(len(rows)), len(rows) // _ROWS_AT_ONCE + 1):
            if len(chunk):
                uv[chunk] = circle_centres(discs[chunk], camera, rows[chunk, HEIGHT], one.offset)[0]
        exposure_s = recording.camera(camera.name).exposure_s
        if exposure_s and len(rows):
            uv += _arc_px(tracker, one, rows, uv, frame_times(recording, frames)[0], exposure_s)
        tables.append(
            pd.DataFrame(
                {
                    "camera": camera.name,
                    "frame": frames,
                    "time_s": np.nan,
                    "marker": markers[marker],
                    "u_px": uv[:, 0],
                    "v_px": uv[:, 1],
                    "sd_px": rows[:, DISC_SD],
                }
            )
        )
        own = unshared(frames, marker, uv, radius_px(discs), tracker.body_of)
        tables[-1] = tables[-1][own]
        notes.extend(size_notes(camera.name, tracker.layout, marker, radius_px(discs)))
        notes.extend(jump_notes(camera.name, tracker.layout, frames[own], marker[own], uv[own]))
        for name in markers[np.bincount(marker[own], minlength=len(markers)) == 0]:
            notes.append(f"{camera.name} never saw marker {name}")
    tracks = pd.concat(tables, ignore_index=True)
    if not len(tracks):
        raise InputError(
            "no marker was found in any frame of any camera",
            f"round markers of {SMALLEST_PX:g} to {LARGEST_PX:.0f} px radius laid out as layout_m says, in focus, in "
            f"the windows",
            "check layout_m, the calibration and window_offset_px, or give --names names.csv",
        )
    return _timed(tracks, recording)


def _arc_px(
    tracker: Tracker, one: CameraTracker, rows: np.ndarray, uv: np.ndarray, times_s: np.ndarray, exposure_s: float
) -> np.ndarray:
    """What turning during the exposure took off the markers' pixels (n, 2); see `vision.tracking.exposure`."""
    marker = rows[:, MARKER].astype(int)
    spin = np.zeros(len(rows))
    for body in range(len(tracker.layout.bodies)):
        own = tracker.body_of[marker] == body
        frames, first, back = np.unique(rows[own, FRAME].astype(int), return_index=True, return_inverse=True)
        spin[own] = spins(frames, rows[own, BODY_ANGLE][first], times_s[own][first])[back]
    turning = np.abs(spin) * exposure_s > _LEAST_TURN_RAD
    ground = on_plane(one.camera, uv[turning] + one.offset, rows[turning, HEIGHT])
    shift = arc_shift(ground[:, :2] - rows[turning, BODY_X:BODY_ANGLE], spin[turning], exposure_s)
    off = np.zeros((len(rows), 2))
    off[turning] = np.einsum("nij,nj->ni", one.camera.project_with_jacobian(ground)[1][..., :2], shift)
    return off


def _instants(tracks: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    """Frame numbers and times of the first camera's own frames."""
    first = tracks.drop_duplicates("frame")
    return first["frame"].to_numpy(), first["time_s"].to_numpy(float)
