"""The three rigid bodies followed through both cameras at once, frame by frame.

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
from vision.identity.matching import Match, match_in_both, place
from vision.tracking.camera_tracker import AHEAD, Eye
from vision.tracking.ground_markers import name_ground
from vision.tracking.manual_names import adopt_names
from vision.tracking.measure import accept_steady, apart, together
from vision.tracking.state import KEPT, STRAY, off_prediction, record

# a body long lost is searched for in every 16th frame: a search of the whole picture costs as much as following so many
_TRY_EVERY = 16
_CHUNK = 4096  # rows kept in one piece
_GROUND_FRAMES = 20  # frames in each of which all ground markers are looked for
_GROUND_TRIES = 35  # in how many frames after them at most, evenly spread
_GROUND_SWINGS = 2.0  # for so long: of a Host that covers one of them
_SLOWEST_HZ, _GROUND_PATIENCE = (
    10.0,
    160,
)  # at which it is taken to swing where no [excitation] says, and frames waited for then at least
_TURN_SD_RAD = 0.35  # of a body's turn off its prediction, per frame since it was seen
_ANY_TURN_RAD = 6.3  # sd of one that is not known: a preference between equals
_BESIDE_RAD = 0.1  # sd of the turn between the two cameras' poses of a body


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
    return max(min(frames // 4, int(wait)), 1)


class Tracker:
    """Both cameras, frame by frame."""

    def __init__(
        self, recording: Recording, cameras: Sequence[Camera], names: pd.DataFrame | None, notes: list[str], frames: int
    ) -> None:
        """`frames`: how many are to come; a quarter of them may pass until all ground markers have shown at once."""
        self.layout = layout_of(recording, names, cameras)
        self.eyes = [Eye(camera, recording.camera(camera.name).window_offset_px, self.layout) for camera in cameras]
        self.notes, self.names = notes, names
        self.host_radius_m = host_radius(recording)
        room = max(_CHUNK, AHEAD * len(self.layout.markers))
        self._chunks = [[np.empty((room, KEPT))] for _ in cameras]
        self._filled = [[0] for _ in cameras]
        self.body_of = np.repeat(np.arange(len(self.layout.bodies)), np.diff(self.layout.first))
        self.tried_ground, self.ground_until = 0, _ground_patience(recording, frames)
        self.ground_every = max(4, -(-(self.ground_until - _GROUND_FRAMES) // _GROUND_TRIES))
        self._discs: dict[tuple[int, tuple[int, int, int, int] | None, int | None], np.ndarray] = {}
        self.settled, self.first_frame = np.zeros(len(self.layout.bodies), np.int64), -1
        self.pool = ThreadPoolExecutor(2)

    def follow(self, frames: list[int], pictures: list[list[np.ndarray | None]]) -> None:
        """Follow all bodies into more frames: several at once while both cameras are sure of them, else with care."""
        at = 0
        while at < len(frames):
            at += self._run_ahead(frames[at : at + AHEAD], pictures[at : at + AHEAD])
            if at < len(frames):
                self.step(frames[at], pictures[at])
                at += 1

    def _run_ahead(self, frames: list[int], pictures: list[list[Any]]) -> int:
        """Each camera on its own through frames in which it needs no other; how many frames both did, and agreed in."""
        looking = not self.layout.known.all() and self.tried_ground <= self.ground_until
        kinds = [[image is not None and image.dtype for image in pair] for pair in pictures]
        whole = next((k for k, kind in enumerate(kinds) if not all(kind) or kind != kinds[0]), len(kinds))
        if self.first_frame < 0 or looking or not whole:
            return 0
        known = self.layout.known.astype(np.int64)
        jobs = [
            self.pool.submit(
                eye.run_ahead, [pair[i] for pair in pictures[:whole]], frames[:whole], known, *self._room(i, whole)
            )
            for i, eye in enumerate(self.eyes)
        ]
        ran = [job.result() for job in jobs]
        done = together(ran[0][0], ran[1][0], known, self.eyes[0].sight)
        for i, (poses, n_rows) in enumerate(ran):
            if len(poses) > done:
                self.eyes[i].go_back(done)
            self._filled[i][-1] = int(n_rows[done])
        return done

    def step(self, frame: int, images: list[np.ndarray | None]) -> None:
        """Follow all bodies into one more frame."""
        layout = self.layout
        self.first_frame = frame if self.first_frame < 0 else self.first_frame
        self._discs.clear()
        if self.names is not None and frame == self.first_frame:
            self._take_names(frame, images)
            return
        known, eyes = layout.known.astype(np.int64), self.eyes
        other = self.pool.submit(eyes[1].look_ahead, images[1], known, frame)
        eyes[0].look_ahead(images[0], known, frame)
        other.result()
        accept_steady(eyes[0].sight, eyes[1].sight, known, frame, self.settled)
        for body in map(int, np.flatnonzero(known > self.settled)):
            self._resolve(body, frame, images)
        unknown = np.flatnonzero(~layout.known)
        if len(unknown) and all(image is not None for image in images):
            self._name_ground(int(unknown[0]), frame, images)
        self._keep(frame)

    def _take_names(self, frame: int, images: list[Any]) -> None:
        if any(image is None for image in images):
            raise InputError(
                "the first frame is missing in one camera",
                "the first frame of both, where the markers are named",
                "remove the first frame of the other camera as well, and name the markers in the next",
            )
        discs = [self._discs_in(i, image, None) for i, image in enumerate(images)]
        for eye in self.eyes:
            eye.frame = frame
        self.notes.extend(adopt_names(self.names, self.eyes, discs, images))
        for body in np.flatnonzero(self.layout.known):
            if all(eye.last[body] != frame for eye in self.eyes):
                self._resolve(int(body), frame, images)
        if not self.layout.known.all():
            self._name_ground(int(np.flatnonzero(~self.layout.known)[0]), frame, images)
        self._keep(frame)

    def _resolve(self, body: int, frame: int, images: list[np.ndarray | None]) -> None:
        eyes = self.eyes
        seeing = [i for i, image in enumerate(images) if image is not None]
        good = [i for i in seeing if eyes[i].good(body)]
        if len(good) == 2 and apart(eyes[0].found[body], eyes[1].found[body], eyes[0].apart_m(body)):
            good = [min(good, key=lambda i: self._strain(i, body))]
        part = self.layout.of(body)  # few markers may be any: look for the rest first
        weak = {
            i: eyes[i].snapshot(part, body) for i in good if not eyes[i].sure(body) and self._due(eyes[i], body, frame)
        }
        good = [i for i in good if i not in weak]
        bad = [i for i in seeing if i not in good]
        for i in bad:
            eyes[i].forget(body)
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
                    eyes[i].forget(body)
        for i in good:
            eyes[i].accept(body)

    def _strain(self, i: int, body: int) -> float:
        """How hard it is to believe what a camera found: misfit, and distance from the prediction."""
        eye = self.eyes[i]
        off, turned = off_prediction(eye.sight, body)
        return (
            eye.rms_m[body] / eye.gate_m(body)
            + 2.0 * off / (STRAY * self.layout.rig_m)
            + turned / _TURN_SD_RAD
            - eye.n_seen[body]
        )

    def _due(self, eye: Eye, body: int, frame: int) -> bool:
        """Whether a lost body is worth a search now: at once, then from time to time."""
        return min(eye.lost(body), frame - self.first_frame) < 8 or frame % _TRY_EVERY == 0

    def _search_beside(self, body: int, frame: int, images: list[Any], seen_by: int, i: int, good: list[int]) -> None:
        """One camera has the body: look at that pose in the other, then near it."""
        eye = self.eyes[i]
        if not self._due(eye, body, frame):
            return
        prior = self.eyes[seen_by].found[body].copy()
        part = self.layout.of(body)
        if eye.look_at(images[i], body, prior, max(2, part.stop - part.start)):
            good.append(i)
            return
        sd_m = self._sd_m(eye)
        discs = self._discs_in(i, images[i], eye.box(eye.body_points(body, prior), body, 2.0 * sd_m))
        matches = eye.matches(discs, body, prior, (sd_m, _BESIDE_RAD))
        least = 2 if self.eyes[seen_by].n_seen[body] >= 2 else 3
        if matches and matches[0].n_found >= least and eye.adopt(images[i], body, matches[0], discs):
            good.append(i)

    def _search(self, body: int, frame: int, images: list[Any], bad: list[int], good: list[int]) -> None:
        """Look for a body where it may have jumped to: for discs that look as its markers did, near and in the ring,
        then for any.
        """
        eyes = self.eyes
        if not any(self._due(eyes[i], body, frame) for i in bad):
            return
        near = {i: eyes[i].lost(body) < 4 for i in bad}
        n_markers = self.layout.of(body).stop - self.layout.of(body).start
        discs: dict[int, np.ndarray] = {}
        for as_before, wide in ((True, False), (True, True), (False, False), (False, True)):
            regions = {i: self._region(eyes[i], body, wide) for i in bad if near[i] or wide}
            if as_before and (not all(near.values()) or None in regions.values()):
                continue
            jobs = {
                i: self.pool.submit(self._discs_in, i, images[i], region, body if as_before else None)
                for i, region in regions.items()
            }
            discs.update({i: job.result() for i, job in jobs.items()})
            found = [self._matches(eyes[i], body, discs.get(i, np.empty((0, 20))), near[i], wide) for i in bad]
            if as_before:  # a hurried look may name a body only if it sees the whole of it
                found = [[match for match in own if match.n_found == n_markers] for own in found]
                if not all(found):
                    continue
            both = match_in_both(found, n_markers, max(map(self._sd_m, eyes)))
            for i, match in zip(bad, both, strict=True):
                if match is not None and eyes[i].adopt(images[i], body, match, discs[i]):
                    good.append(i)
            if good:
                return

    def _sd_m(self, eye: Eye) -> float:
        """How far a body may be from where it is expected, as a standard deviation."""
        return max(STRAY * self.layout.rig_m, eye.fastest_m())

    def _matches(self, eye: Eye, body: int, discs: np.ndarray, near: bool, wide: bool) -> list[Match]:
        """Ways to see a body in discs: about its prediction; in a wide search the ring is what bounds its place."""
        if not near:  # the ground's two markers fit either way round: as its layout lies in the world, where both fit
            return (
                eye.matches(discs, body, np.zeros(3), (np.inf, _ANY_TURN_RAD))
                if self.layout.bodies[body] == "ground"
                else eye.matches(discs, body)
            )
        away = 1 + eye.lost(body)
        return eye.matches(
            discs, body, eye.expected[body], (np.inf if wide else self._sd_m(eye) * away, _TURN_SD_RAD * away)
        )

    def _region(self, eye: Eye, body: int, wide: bool) -> tuple[int, int, int, int] | None:
        """Where to search: about the prediction, then everywhere; of the NES inside the Host only."""
        about = None if wide else eye.box(eye.body_points(body, eye.expected[body]), body, eye.stray_m(body))
        ring = self._ring(eye, body)
        if about is None or ring is None:
            return about or ring
        return max(about[0], ring[0]), max(about[1], ring[1]), min(about[2], ring[2]), min(about[3], ring[3])

    def _ring(self, eye: Eye, body: int) -> tuple[int, int, int, int] | None:
        """Window rectangle about the Host's wall, which the NES cannot leave; None for another body, or while the Host
        is lost.
        """
        if self.layout.bodies[body] != "nes" or "host" not in self.layout.bodies or not self.host_radius_m:
            return None
        host = self.layout.bodies.index("host")
        if eye.lost(host) > 1:
            return None
        turn = np.linspace(0, 2 * np.pi, 16)
        circle = self.host_radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
        height = self.layout.position_m[self.layout.of(body), 2].mean()
        return eye.box(np.column_stack([place(eye.found[host], circle), np.full(16, height)]), body)

    def _discs_in(
        self, i: int, image: np.ndarray, region: tuple[int, int, int, int] | None, like: int | None = None
    ) -> np.ndarray:
        key = (i, region, like)
        if key not in self._discs:
            self._discs[key] = self.eyes[i].discs(image, region, like)
        return self._discs[key]

    def _name_ground(self, body: int, frame: int, images: list[Any]) -> None:
        """Ground markers without a layout are what is left over, once the Host is known."""
        self.tried_ground += 1
        last_try = self.tried_ground == self.ground_until
        between = self.tried_ground > _GROUND_FRAMES and self.tried_ground % self.ground_every
        if self.tried_ground > self.ground_until or (between and not last_try):
            return
        discs = [self._discs_in(i, image, None) for i, image in enumerate(images)]
        part = self.layout.of(body)
        placed = name_ground(self.eyes, discs, frame, part.stop - part.start, self.host_radius_m, last_try)
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
        for i, eye in enumerate(self.eyes):
            for k, position in enumerate(positions):
                eye.place_m[part.start + k] = position - middle
                eye.starts[part.start + k] = fits[i][k]
            eye.expected[body] = middle
            if eye.look_at(images[i], body, middle, 1):
                eye.accept(body)
        self.layout.known[body] = True

    def _room(self, i: int, frames: int) -> tuple[np.ndarray, int]:
        """Rows of camera `i` with room for so many frames more, and how many of them are filled."""
        chunks, filled = self._chunks[i], self._filled[i]
        if len(chunks[-1]) - filled[-1] < frames * len(self.layout.markers):
            chunks.append(np.empty_like(chunks[0]))
            filled.append(0)
        return chunks[-1], filled[-1]

    def _keep(self, frame: int) -> None:
        for i, eye in enumerate(self.eyes):
            rows, filled = self._room(i, 1)
            self._filled[i][-1] = record(eye.sight, frame, rows, filled)

    def kept(self, i: int) -> np.ndarray:
        """Every marker that camera `i` saw, (rows, KEPT) in the order of frames."""
        return np.concatenate([chunk[:n] for chunk, n in zip(self._chunks[i], self._filled[i], strict=True)])

    def centres_m(self, frame: int) -> dict[str, np.ndarray]:
        """Centre (x, y) of each body that both cameras saw in this frame, the mean of what they say."""
        return {
            name: np.mean([eye.found[b, :2] for eye in self.eyes], axis=0)
            for b, name in enumerate(self.layout.bodies)
            if all(eye.last[b] == frame for eye in self.eyes)
        }
