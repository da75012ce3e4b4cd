"""The three rigid bodies tracked through all cameras at once, usually two, frame by frame.

A frame costs a window per marker; the whole picture is searched only for a body that is lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pandas as pd

from ovines.camera import Camera
from ovines.errors import InputError
from ovines.recording import Recording
from vision.identity.layouts import host_radius, layout_of
from vision.tracking.bodies.gates import SEARCH_RADIUS, disagree
from vision.tracking.camera_tracker import CameraTracker, Measured
from vision.tracking.ground_markers import name_ground
from vision.tracking.manual_names import adopt_names
from vision.tracking.measure import INDEPENDENT_FRAMES
from vision.tracking.search import TURN_SD_RAD, Search
from vision.tracking.state import N_RECORD

_CHUNK = 4096  # rows recorded in one piece
_STRAIN_OFF = 2.0  # what lying SEARCH_RADIUS off the prediction weighs against a misfit of the whole gate
_GROUND_FRAMES = 20  # frames in each of which all ground markers are looked for
_GROUND_TRIES = 35  # in how many frames after them at most, evenly spread
_GROUND_SWINGS = 2.0  # for so long: of a Host that covers one of them
# Frequency at which it is taken to swing where no [excitation] says, and frames waited for then at least.
_SLOWEST_HZ, _GROUND_PATIENCE = 10.0, 160
_GROUND_SHARE, _LEAST_EVERY = 4, 4  # one frame in so many of the recording at most, and between two tries


def _ground_patience(recording: Recording, frames: int) -> int:
    """In how many frames all ground markers are waited for: while the Host swings twice, a quarter of the recording at
    most.
    """
    rate_hz, given = recording.frame_rate_hz or 0.0, recording.excitation
    wait = (
        _GROUND_SWINGS * rate_hz / given.frequency_hz
        if given is not None
        else max(_GROUND_PATIENCE, _GROUND_SWINGS * rate_hz / _SLOWEST_HZ)
    )
    return max(min(frames // _GROUND_SHARE, int(wait)), 1)


class Tracker:
    """All cameras, frame by frame."""

    def __init__(
        self, recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None, notes: list[str], frames: int
    ) -> None:
        """`frames`: how many are to come; a quarter of them may pass until all ground markers have shown at once."""
        self.layout = layout_of(recording, names, cameras)
        self.cameras = [
            CameraTracker(camera, recording.camera(camera.name).window_offset_px, self.layout) for camera in cameras
        ]
        self.notes, self.names = notes, names
        self.host_radius_m = host_radius(recording)
        room = max(_CHUNK, INDEPENDENT_FRAMES * len(self.layout.markers))
        self._chunks = [[np.empty((room, N_RECORD))] for _ in cameras]
        self._filled = [[0] for _ in cameras]
        self.body_of = np.repeat(np.arange(len(self.layout.bodies)), np.diff(self.layout.first))
        self.tried_ground, self.ground_until = 0, _ground_patience(recording, frames)
        self.ground_every = max(_LEAST_EVERY, -(-(self.ground_until - _GROUND_FRAMES) // _GROUND_TRIES))
        self.pool = ThreadPoolExecutor(max(2, len(self.cameras)))
        self.search = Search(self.layout, self.cameras, self.host_radius_m, self.pool)

    def track(self, frames: list[int], pictures: list[list[np.ndarray | None]]) -> None:
        """Track all bodies into more frames: several at once while all cameras are locked on them, else one by one."""
        at = 0
        while at < len(frames):
            batch = slice(at, at + INDEPENDENT_FRAMES)
            at += self._track_independently(frames[batch], pictures[batch])
            if at < len(frames):
                self.step(frames[at], pictures[at])
                at += 1

    def _track_independently(self, frames: list[int], pictures: list[list[Any]]) -> int:
        """Each camera on its own through frames in which it needs no other; how many frames all did, and agreed in."""
        searching_ground = not self.layout.known.all() and self.tried_ground <= self.ground_until
        kinds = [[image is not None and image.dtype for image in pair] for pair in pictures]
        whole = next((k for k, kind in enumerate(kinds) if not all(kind) or kind != kinds[0]), len(kinds))
        if self.search.first_frame < 0 or searching_ground or not whole:
            return 0
        known = self.layout.known.astype(np.int64)
        jobs = [
            self.pool.submit(
                camera.track_independently,
                [pair[i] for pair in pictures[:whole]],
                frames[:whole],
                known,
                *self._room(i, whole),
            )
            for i, camera in enumerate(self.cameras)
        ]
        ran = [job.result() for job in jobs]
        done = len(ran[0][0])
        for poses, _ in ran[1:]:
            done = min(done, self._frames_in_agreement(ran[0][0], poses))
        for i, (poses, n_rows) in enumerate(ran):
            if len(poses) > done:
                self.cameras[i].go_back(done)
            self._filled[i][-1] = int(n_rows[done])
        return done

    def _frames_in_agreement(self, one: np.ndarray, other: np.ndarray) -> int:
        """In how many frames from the first on two cameras' poses (f, b, 3) of the known bodies are one."""
        together = min(len(one), len(other))
        within_m = np.array([self.cameras[0].status(b).agreement_m for b in range(len(self.layout.bodies))])
        apart = (disagree(one[:together], other[:together], within_m) & self.layout.known).any(1)
        return int(apart.argmax()) if apart.any() else together

    def _accept_locked(self, known: np.ndarray) -> np.ndarray:
        """Accept every known body that all cameras are locked on; which (b,) those are.  What is left needs a
        search.
        """
        locked = np.zeros(len(known), bool)
        for body in map(int, np.flatnonzero(known)):
            seen = [camera.status(body) for camera in self.cameras]
            poses = [camera.measured.pose[body] for camera in self.cameras]
            locked[body] = all(one.locked for one in seen) and not any(
                disagree(poses[0], pose, seen[0].agreement_m) for pose in poses[1:]
            )
            if locked[body]:
                for camera in self.cameras:
                    camera.accept(body)
        return locked

    def step(self, frame: int, images: list[np.ndarray | None]) -> None:
        """Track all bodies into one more frame."""
        layout = self.layout
        self.search.begin(frame)
        if self.names is not None and frame == self.search.first_frame:
            self._take_names(frame, images)
            return
        known = layout.known.astype(np.int64)
        others = [
            self.pool.submit(camera.predict_and_measure, image, known, frame)
            for camera, image in zip(self.cameras[1:], images[1:], strict=True)
        ]
        self.cameras[0].predict_and_measure(images[0], known, frame)
        for other in others:
            other.result()
        locked = self._accept_locked(known)
        for body in map(int, np.flatnonzero(self.layout.known & ~locked)):
            self._resolve(body, frame, images)
        unknown = np.flatnonzero(~layout.known)
        if len(unknown) and all(image is not None for image in images):
            self._name_ground(int(unknown[0]), frame, images)
        self._record(frame)

    def _take_names(self, frame: int, images: list[Any]) -> None:
        if any(image is None for image in images):
            raise InputError(
                "the first frame is missing in one camera",
                "the first frame of all, where the markers are named",
                "remove the first frame of the other cameras as well, and name the markers in the next",
            )
        discs = [self.search.discs_in(i, image, None) for i, image in enumerate(images)]
        for camera in self.cameras:
            camera.frame = frame
        self.notes.extend(adopt_names(self.names, self.cameras, discs, images))
        for body in np.flatnonzero(self.layout.known):
            if all(camera.bodies.last_frame[body] != frame for camera in self.cameras):
                self._resolve(int(body), frame, images)
        if not self.layout.known.all():
            self._name_ground(int(np.flatnonzero(~self.layout.known)[0]), frame, images)
        self._record(frame)

    def _resolve(self, body: int, frame: int, images: list[np.ndarray | None]) -> None:
        """Decide about a body that some camera is not locked on: accept it, or search for it."""
        cameras = self.cameras
        seeing = [i for i, image in enumerate(images) if image is not None]
        kept = [i for i in seeing if cameras[i].status(body).within_gate]
        if len(kept) > 1:
            poses, within_m = [camera.measured.pose[body] for camera in cameras], cameras[0].status(body).agreement_m
            agreeing = [[j for j in kept if not disagree(poses[i], poses[j], within_m)] for i in kept]
            if any(len(own) < len(kept) for own in agreeing):  # the most that agree; of equals the least strained
                kept = min(agreeing, key=lambda own: (-len(own), sum(self._strain(i, body) for i in own)))
        weak: dict[int, Measured] = {  # few markers may be any: look for the rest first
            i: cameras[i].snapshot(body)
            for i in kept
            if not cameras[i].status(body).identified and self.search.is_due(cameras[i], body, frame)
        }
        kept = [i for i in kept if i not in weak]
        missing = [i for i in seeing if i not in kept]
        for i in missing:
            cameras[i].discard(body)
        if missing and kept:
            for i in missing:
                self.search.beside(body, frame, images, kept[0], i, kept)
        elif missing:
            self.search.anywhere(body, frame, images, missing, kept)
        for i, measured in weak.items():
            if i not in kept:
                cameras[i].restore(body, measured)
                if cameras[i].status(body).near_prediction:
                    kept.append(i)
                else:
                    cameras[i].discard(body)
        for i in kept:
            cameras[i].accept(body)

    def _strain(self, i: int, body: int) -> float:
        """How hard it is to believe what a camera measured: misfit, and distance from the prediction."""
        camera = self.cameras[i]
        now = camera.status(body)
        return (
            camera.measured.rms_m[body] / now.gate_m
            + _STRAIN_OFF * now.off_m / (SEARCH_RADIUS * self.layout.rig_m)
            + now.turned_rad / TURN_SD_RAD
            - camera.measured.n_markers[body]
        )

    def _name_ground(self, body: int, frame: int, images: list[Any]) -> None:
        """Ground markers without a layout are what is left over, once the Host is known."""
        if len(self.cameras) < 2:
            if not self.tried_ground:
                self.notes.append(
                    f"one camera does not tell how high the {self.layout.bodies[body]} markers are: without layout_m "
                    f"they have no tracks"
                )
            self.tried_ground = self.ground_until + 1
            return
        self.tried_ground += 1
        last_try = self.tried_ground == self.ground_until
        between = self.tried_ground > _GROUND_FRAMES and self.tried_ground % self.ground_every
        if self.tried_ground > self.ground_until or (between and not last_try):
            return
        discs = [self.search.discs_in(i, image, None) for i, image in enumerate(images)]
        part = self.layout.of(body)
        placed = name_ground(self.cameras, discs, frame, part.stop - part.start, self.host_radius_m, last_try)
        if placed is None:
            if last_try:
                self.notes.append(
                    f"no {self.layout.bodies[body]} markers found in both cameras in the first "
                    f"{self.ground_until} frames; they have no tracks"
                )
            return
        positions, fits = placed
        if len(positions) < part.stop - part.start:
            self.notes.append(
                f"only {len(positions)} of {part.stop - part.start} {self.layout.bodies[body]} markers found; "
                f"{', '.join(self.layout.markers[part][len(positions) :])} have no tracks, and the others may bear "
                f"their neighbours' "
                f"names: give [bodies.{self.layout.bodies[body]}] layout_m, or --names"
            )
        middle = np.append(positions[:, :2].mean(0), 0.0)
        for i, camera in enumerate(self.cameras):
            for k, position in enumerate(positions):
                camera.markers.place_m[part.start + k] = position - middle
                camera.markers.disc[part.start + k] = fits[i][k]
            camera.measured.predicted[body] = middle
            if camera.measure_at(images[i], body, middle, 1):
                camera.accept(body)
        self.layout.known[body] = True

    def _room(self, i: int, frames: int) -> tuple[np.ndarray, int]:
        """Rows of camera `i` with room for so many frames more, and how many of them are filled."""
        chunks, filled = self._chunks[i], self._filled[i]
        if len(chunks[-1]) - filled[-1] < frames * len(self.layout.markers):
            chunks.append(np.empty_like(chunks[0]))
            filled.append(0)
        return chunks[-1], filled[-1]

    def _record(self, frame: int) -> None:
        for i, camera in enumerate(self.cameras):
            rows, filled = self._room(i, 1)
            self._filled[i][-1] = camera.record(rows, filled)

    def recorded(self, i: int) -> np.ndarray:
        """Every marker that camera `i` saw, (rows, N_RECORD) in the order of frames."""
        return np.concatenate([chunk[:n] for chunk, n in zip(self._chunks[i], self._filled[i], strict=True)])

    def centres_m(self, frame: int) -> dict[str, np.ndarray]:
        """Centre (x, y) of each body that both cameras saw in this frame, the mean of what they say."""
        return {
            name: np.mean([camera.measured.pose[b, :2] for camera in self.cameras], axis=0)
            for b, name in enumerate(self.layout.bodies)
            if all(camera.bodies.last_frame[b] == frame for camera in self.cameras)
        }
