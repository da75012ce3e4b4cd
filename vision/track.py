"""Images to tracks: every marker's sub-pixel centre in every frame of both cameras, under its own name.

The three bodies are followed as rigid bodies in both cameras at once.  A frame costs a window per marker; the whole
picture is searched only for a body that is lost.  See `vision.identity` for naming, `vision.centre` for centres.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
import pandas as pd

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording
from vision.centre import SD, U
from vision.circle_centre import circle_centres
from vision.eye import Eye, Layout, layout_tolerance
from vision.frames import open_sources, stream
from vision.identity import match_in_both, wrapped
from vision.named import adopt_names, check_names
from vision.static_markers import name_ground
from vision.sync import find_dropped_frames, frame_times, renumbered

_TRY_EVERY = 16  # a body long lost is searched for in every 16th frame
_GROUND_FRAMES = 20  # frames to wait for all ground markers to show in both cameras


class Tracks(NamedTuple):
    """`tracks`: the table of FORMATS.md; `notes`: what a reader should know (gaps, bad pictures, lost markers)."""

    tracks: pd.DataFrame
    notes: list[str]


def track(recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None = None,
          progress: Callable[[int, int], None] | None = None) -> Tracks:
    """Track every marker of a recording.

    Parameters
    ----------
    recording : with frames of two cameras
    cameras : calibrated; the recording's cameras by name
    names : where markers are in the first frame (columns camera, marker, u_px, v_px, window pixels), for bodies
        without `layout_m`
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
    strangers = [camera.name for camera in recording.cameras if camera.name not in by_name]
    if strangers or len(recording.cameras) != 2:
        raise InputError(f"cameras {[c.name for c in recording.cameras]} with a calibration of {sorted(by_name)}",
                         "two cameras, both calibrated", "give recording.toml and calibration.json the same names")
    if names is not None:
        names = check_names(names)
    sources, notes = open_sources(recording)
    total = len(set().union(*(source.numbers() for source in sources)))
    tracker = Tracker(recording, [by_name[camera.name] for camera in recording.cameras], names, notes)
    for done, (frame, images) in enumerate(stream(sources, notes), start=1):
        tracker.step(frame, images)
        if progress:
            progress(done, total)
    return tracker.finish(recording)


class Tracker:
    """Both cameras, frame by frame."""

    def __init__(self, recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None, notes: list[str]) -> None:
        self.layout = layout_of(recording, names)
        self.eyes = [Eye(camera, recording.camera(camera.name).window_offset_px, self.layout) for camera in cameras]
        self.notes, self.names = notes, names
        self.host_radius_m = _host_radius(recording)
        self.kept: list[list[np.ndarray]] = [[] for _ in cameras]
        self.tried_ground = 0
        self.first_frame: int | None = None
        self.pool = ThreadPoolExecutor(1)

    def step(self, frame: int, images: list[np.ndarray | None]) -> None:
        """Follow all bodies into one more frame."""
        layout = self.layout
        self.first_frame = frame if self.first_frame is None else self.first_frame
        self._discs: dict[tuple[int, tuple | None], np.ndarray] = {}
        if self.names is not None and frame == self.first_frame:
            self._take_names(frame, images)
            return
        other = self.pool.submit(self._look, 1, frame, images[1])
        self._look(0, frame, images[0])
        other.result()
        for body in range(len(layout.bodies)):
            if layout.known[body]:
                self._resolve(body, frame, images)
        unknown = np.flatnonzero(~layout.known)
        if len(unknown) and all(image is not None for image in images):
            self._name_ground(int(unknown[0]), frame, images)
        self._keep(frame)

    def _take_names(self, frame: int, images: list) -> None:
        if any(image is None for image in images):
            raise InputError("the first frame is missing in one camera", "the first frame of both, where the markers are named",
                             "remove the first frame of the other camera as well, and name the markers in the next")
        discs = [self._discs_in(i, image, None) for i, image in enumerate(images)]
        self.notes.extend(adopt_names(self.names, self.eyes, discs, images, frame))
        for body in np.flatnonzero(self.layout.known):
            if all(eye.last[body] != frame for eye in self.eyes):
                self._resolve(int(body), frame, images)
        self._keep(frame)

    def _look(self, i: int, frame: int, image: np.ndarray | None) -> None:
        eye = self.eyes[i]
        eye.predict(frame)
        eye.use[:] = 0
        eye.n_seen[:] = 0
        if image is not None:
            eye.look(image, (self.layout.known & (eye.last >= 0)).astype(np.int64))

    def _resolve(self, body: int, frame: int, images: list[np.ndarray | None]) -> None:
        eyes = self.eyes
        seeing = [i for i, image in enumerate(images) if image is not None]
        good = [i for i in seeing if eyes[i].good(body, frame)]
        if len(good) == 2 and self._disagree(body):
            good = [min(good, key=lambda i: self._strain(i, body))]
        # One or two markers of many fit anything (look-alikes a quarter turn on): look for the rest first.
        part = self.layout.of(body)
        weak = {i: eyes[i].snapshot(part, body) for i in good
                if eyes[i].n_seen[body] < min(3, part.stop - part.start) and self._due(eyes[i], body, frame)}
        good = [i for i in good if i not in weak]
        bad = [i for i in seeing if i not in good]
        for i in bad:
            eyes[i].use[self.layout.of(body)] = 0
            eyes[i].n_seen[body] = 0
        if bad and good:
            self._search_beside(body, frame, images, good[0], bad[0], good)
        elif bad:
            self._search(body, frame, images, bad, good)
        for i, state in weak.items():
            if i not in good:
                eyes[i].restore(part, body, state)
                if eyes[i].near(body):
                    good.append(i)
                else:
                    eyes[i].use[part] = 0
                    eyes[i].n_seen[body] = 0
        for i in good:
            eyes[i].accept(body, frame)

    def _disagree(self, body: int) -> bool:
        first, second = (eye.found[body] for eye in self.eyes)
        return np.hypot(*(first[:2] - second[:2])) > 0.015 or abs(wrapped(first[2] - second[2])) > 0.35

    def _strain(self, i: int, body: int) -> float:
        """How hard it is to believe what a camera found: misfit, and distance from the prediction."""
        eye = self.eyes[i]
        off = np.hypot(*(eye.found[body, :2] - eye.expected[body, :2])) / 0.003
        return (eye.rms_m[body] / eye.gate_m()[body] + off + abs(wrapped(eye.found[body, 2] - eye.expected[body, 2])) / 0.3
                - eye.n_seen[body])

    def _due(self, eye: Eye, body: int, frame: int) -> bool:
        """Whether a lost body is worth a search now: at once, then from time to time."""
        return min(eye.lost(body, frame), frame - self.first_frame) < 8 or frame % _TRY_EVERY == 0

    def _search_beside(self, body: int, frame: int, images: list, seen_by: int, i: int, good: list[int]) -> None:
        """One camera has the body: look near that pose in the other."""
        eye = self.eyes[i]
        if not self._due(eye, body, frame):
            return
        prior = self.eyes[seen_by].found[body].copy()
        region = eye.box(eye.body_points(body, prior), 60.0)
        discs = self._discs_in(i, images[i], region)
        matches = eye.matches(discs, body, prior, (0.005, 0.1))
        least = 2 if self.eyes[seen_by].n_seen[body] >= 2 else 3
        if matches and matches[0].n_found >= least and eye.adopt(images[i], body, matches[0], discs):
            good.append(i)

    def _search(self, body: int, frame: int, images: list, bad: list[int], good: list[int]) -> None:
        eyes = self.eyes
        if not any(self._due(eyes[i], body, frame) for i in bad):
            return
        discs: dict[int, np.ndarray] = {}
        for wide in (False, True):
            found = []
            for i in bad:
                lost = eyes[i].lost(body, frame)
                near = lost < 4
                if wide or near:
                    region = self._region(eyes[i], body, frame, wide)
                    discs[i] = self._discs_in(i, images[i], region)
                prior = eyes[i].expected[body] if near else None
                found.append(eyes[i].matches(discs.get(i, np.empty((0, 20))), body, prior, (0.006 * (1 + lost), 0.35)))
            both = match_in_both(found, self.layout.of(body).stop - self.layout.of(body).start)
            for i, match in zip(bad, both, strict=True):
                if match is not None and eyes[i].adopt(images[i], body, match, discs[i]):
                    good.append(i)
            if good:
                return

    def _region(self, eye: Eye, body: int, frame: int, wide: bool) -> tuple[int, int, int, int] | None:
        """Where to search: about the prediction, then inside the Host (for the NES), then everywhere."""
        lost = eye.lost(body, frame)
        if not wide:
            return eye.box(eye.body_points(body, eye.expected[body]), 45.0 + 30.0 * lost)
        name = self.layout.bodies[body]
        if name == "nes" and "host" in self.layout.bodies:
            host = self.layout.bodies.index("host")
            if eye.lost(host, frame) <= 1 and self.host_radius_m:
                turn = np.linspace(0, 2 * np.pi, 16)
                circle = eye.found[host, :2] + self.host_radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
                height = self.layout.position_m[self.layout.of(body), 2].mean()
                return eye.box(np.column_stack([circle, np.full(16, height)]), 20.0)
        return None

    def _discs_in(self, i: int, image: np.ndarray, region: tuple[int, int, int, int] | None) -> np.ndarray:
        key = (i, region)
        if key not in self._discs:
            self._discs[key] = self.eyes[i].discs(image, region)
        return self._discs[key]

    def _name_ground(self, body: int, frame: int, images: list) -> None:
        """Ground markers without a layout are what is left over, once the Host is known."""
        self.tried_ground += 1
        if self.tried_ground > _GROUND_FRAMES:
            return
        discs = [self._discs_in(i, image, None) for i, image in enumerate(images)]
        part = self.layout.of(body)
        last_try = self.tried_ground == _GROUND_FRAMES
        placed = name_ground(self.eyes, discs, frame, part.stop - part.start, self.host_radius_m, last_try)
        if placed is None:
            if last_try:
                self.notes.append(f"no {self.layout.bodies[body]} markers found in both cameras in the first "
                                  f"{_GROUND_FRAMES} frames; they have no tracks")
            return
        positions, fits = placed
        if len(positions) < part.stop - part.start:
            self.notes.append(f"only {len(positions)} of {part.stop - part.start} {self.layout.bodies[body]} markers found; "
                              f"{', '.join(self.layout.markers[part][len(positions):])} have no tracks")
        for i, eye in enumerate(self.eyes):
            for k, position in enumerate(positions):
                eye.place_m[part.start + k] = position
                eye.starts[part.start + k] = fits[i][k]
            active = np.zeros(len(self.layout.bodies), np.int64)
            active[body] = 1
            eye.expected[body] = eye.found[body] = 0.0
            eye.look(images[i], active)
            if eye.n_seen[body]:
                eye.accept(body, frame)
        self.layout.known[body] = True

    def _keep(self, frame: int) -> None:
        for eye, kept in zip(self.eyes, self.kept, strict=True):
            marker = np.flatnonzero(eye.use)
            if len(marker):
                kept.append(np.column_stack([np.full(len(marker), frame), marker, eye.place_m[marker, 2],
                                             eye.fits[marker, U:SD + 1]]))

    def finish(self, recording: Recording) -> Tracks:
        """The table, perspective corrected, sorted by camera, frame and marker's place in recording.toml."""
        self.pool.shutdown()
        tables = []
        for eye, kept in zip(self.eyes, self.kept, strict=True):
            rows = np.concatenate(kept) if kept else np.empty((0, 18))
            frames, marker = rows[:, 0].astype(int), rows[:, 1].astype(int)
            fits = rows[:, 3:]
            uv = np.empty((len(rows), 2))
            for chunk in np.array_split(np.arange(len(rows)), len(rows) // 100_000 + 1):
                if len(chunk):
                    uv[chunk] = circle_centres(fits[chunk], eye.camera, rows[chunk, 2], eye.offset)[0]
            tables.append(pd.DataFrame({
                "camera": eye.camera.name, "frame": frames, "time_s": np.nan,
                "marker": np.array(self.layout.markers, object)[marker], "u_px": uv[:, 0], "v_px": uv[:, 1],
                "sd_px": fits[:, SD]}))
            for name in np.array(self.layout.markers)[np.bincount(marker, minlength=len(self.layout.markers)) == 0]:
                self.notes.append(f"{eye.camera.name} never saw marker {name}")
        tracks = pd.concat(tables, ignore_index=True)
        if not len(tracks):
            raise InputError("no marker was found in any frame of either camera",
                             "round markers laid out as layout_m says, in focus, in both windows",
                             "check layout_m, the calibration and window_offset_px, or give --names first_frame.csv")
        dropped = find_dropped_frames(tracks, [eye.camera for eye in self.eyes], recording.window_offset_px)
        self.notes.extend(f"{drop}; its later frames are renumbered" for drop in dropped)
        tracks = renumbered(tracks, dropped)
        frames, place = np.unique(tracks["frame"], return_inverse=True)
        times, notes = frame_times(recording, frames)
        tracks["time_s"] = times[place]
        self.notes.extend(notes)
        return Tracks(tracks, self.notes)


def layout_of(recording: Recording, names: pd.DataFrame | None = None) -> Layout:
    """Markers of all bodies, with the tolerance within which they are looked for."""
    bodies = [(name, body) for name, body in recording.bodies.items() if body.markers]
    if not bodies:
        raise InputError("no markers in [bodies]", "the markers of ground, host and nes", "name them in recording.toml")
    positions, tolerance, known = [], [], []
    for name, body in bodies:
        place = np.array(body.layout_m, float) if body.layout_m else np.zeros((len(body.markers), 3))
        extent = np.ptp(place[:, :2], axis=0).max() if body.layout_m else 0.05
        positions.append(place)
        tolerance.append(layout_tolerance(extent, body.layout_sd_m or 3e-5))
        known.append(body.layout_m is not None)
        named = names is not None and set(body.markers) <= set(names["marker"])
        if body.layout_m is None and name != "ground" and not named:
            raise InputError(f"[bodies.{name}] has no layout_m, and its markers are not named",
                             "layout_m, or where each marker is in the first frame",
                             "add layout_m, or run `ovines track RECORDING --names first_frame.csv` "
                             "(columns camera,marker,u_px,v_px)")
    return Layout(tuple(name for name, _ in bodies), tuple(m for _, body in bodies for m in body.markers),
                  np.concatenate(positions), np.cumsum([0] + [len(p) for p in positions]),
                  np.array(tolerance), np.array(known))


def _host_radius(recording: Recording) -> float | None:
    host = recording.bodies.get("host")
    if host is None:
        return None
    if host.inner_radius_m:
        return host.inner_radius_m
    return float(np.hypot(*np.array(host.polygon_m).T).max())
