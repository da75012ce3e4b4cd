"""Searches for a body that a camera has lost: beside another camera's pose, else wherever it may be."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np

from vision.identity.layouts import Layout
from vision.identity.matching import Match, match_in_all, place
from vision.markers.row import N_FIT
from vision.tracking.bodies.gates import NAMED, SEARCH_RADIUS
from vision.tracking.camera_tracker import CameraTracker

# A body long lost is searched for in one frame of so many: a search of the whole picture costs as much as tracking
# through them.
_TRY_EVERY = 16
_TRY_EACH = 8  # frames after a loss, or from the first on, in each of which it is searched for
_NEAR_LOST = 4  # frames lost up to which it is searched for near its prediction first
_RING_POINTS = 16  # of the Host's wall, that bound the search for the NES
_RING_LOST = 1  # frames the Host may be lost and still bound it
TURN_SD_RAD = 0.35  # of a body's turn off its prediction, per frame since it was seen
_ANY_TURN_RAD = 6.3  # sd of one that is not known: a preference between equals
_BESIDE_RAD = 0.1  # sd of the turn between the two cameras' poses of a body
_BESIDE_SDS = 2.0  # sds of a body's place about the other camera's pose that are searched


class Search:
    """Searches by all cameras; discs once found in a frame are kept for the others."""

    def __init__(
        self, layout: Layout, cameras: Sequence[CameraTracker], host_radius_m: float | None, pool: ThreadPoolExecutor
    ) -> None:
        """`host_radius_m` of the wall that the NES cannot leave, where there is one."""
        self.layout, self.cameras, self.host_radius_m, self.pool = layout, cameras, host_radius_m, pool
        self.first_frame = -1
        self._discs: dict[tuple[int, tuple[int, int, int, int] | None, int | None], np.ndarray] = {}

    def begin(self, frame: int) -> None:
        """A new frame: nothing is found in it yet."""
        self.first_frame = frame if self.first_frame < 0 else self.first_frame
        self._discs.clear()

    def is_due(self, camera: CameraTracker, body: int, frame: int) -> bool:
        """Whether a lost body is worth a search now: at once, then from time to time."""
        return min(camera.status(body).frames_lost, frame - self.first_frame) < _TRY_EACH or frame % _TRY_EVERY == 0

    def beside(self, body: int, frame: int, images: list[Any], seen_by: int, i: int, kept: list[int]) -> None:
        """One camera has the body: measure at that pose in the other, then search near it."""
        camera = self.cameras[i]
        if not self.is_due(camera, body, frame):
            return
        prior = self.cameras[seen_by].measured.pose[body].copy()
        part = self.layout.of(body)
        if camera.measure_at(images[i], body, prior, max(2, part.stop - part.start)):
            kept.append(i)
            return
        sd_m = self._sd_m(camera)
        discs = self.discs_in(i, images[i], camera.box(camera.body_points(body, prior), body, _BESIDE_SDS * sd_m))
        matches = camera.matches(discs, body, prior, (sd_m, _BESIDE_RAD))
        least = 2 if self.cameras[seen_by].measured.n_markers[body] >= 2 else NAMED
        if matches and matches[0].n_found >= least and camera.adopt(images[i], body, matches[0], discs):
            kept.append(i)

    def anywhere(self, body: int, frame: int, images: list[Any], missing: list[int], kept: list[int]) -> None:
        """Search for a body where it may have gone: for discs like its markers, near and in the ring,
        then for any.
        """
        cameras = self.cameras
        if not any(self.is_due(cameras[i], body, frame) for i in missing):
            return
        near = {i: cameras[i].status(body).frames_lost < _NEAR_LOST for i in missing}
        n_markers = self.layout.of(body).stop - self.layout.of(body).start
        discs: dict[int, np.ndarray] = {}
        for as_before, wide in ((True, False), (True, True), (False, False), (False, True)):
            regions = {i: self._region(cameras[i], body, wide) for i in missing if near[i] or wide}
            if as_before and (not all(near.values()) or None in regions.values()):
                continue
            jobs = {
                i: self.pool.submit(self.discs_in, i, images[i], region, body if as_before else None)
                for i, region in regions.items()
            }
            discs.update({i: job.result() for i, job in jobs.items()})
            found = [
                self._matches(cameras[i], body, discs.get(i, np.empty((0, N_FIT))), near[i], wide) for i in missing
            ]
            if as_before:  # a hurried search may name a body only if it sees the whole of it
                found = [[match for match in own if match.n_found == n_markers] for own in found]
                if not all(found):
                    continue
            both = match_in_all(found, n_markers, max(map(self._sd_m, cameras)))
            for i, match in zip(missing, both, strict=True):
                if match is not None and cameras[i].adopt(images[i], body, match, discs[i]):
                    kept.append(i)
            if kept:
                return

    def _sd_m(self, camera: CameraTracker) -> float:
        """How far a body may be from where it is predicted, as a standard deviation."""
        return max(SEARCH_RADIUS * self.layout.rig_m, camera.fastest_step_m())

    def _matches(self, camera: CameraTracker, body: int, discs: np.ndarray, near: bool, wide: bool) -> list[Match]:
        """Ways to match a body to discs: about its prediction; in a wide search the ring is what bounds its place."""
        if not near:  # the ground's two markers fit either way round: as its layout lies in the world, where both fit
            return (
                camera.matches(discs, body, np.zeros(3), (np.inf, _ANY_TURN_RAD))
                if self.layout.bodies[body] == "ground"
                else camera.matches(discs, body)
            )
        away = 1 + camera.status(body).frames_lost
        return camera.matches(
            discs,
            body,
            camera.measured.predicted[body],
            (np.inf if wide else self._sd_m(camera) * away, TURN_SD_RAD * away),
        )

    def _region(self, camera: CameraTracker, body: int, wide: bool) -> tuple[int, int, int, int] | None:
        """Where to search: about the prediction, then everywhere; of the NES inside the Host only."""
        about = None
        if not wide:
            points_m = camera.body_points(body, camera.measured.predicted[body])
            about = camera.box(points_m, body, camera.status(body).search_radius_m)
        ring = self._ring(camera, body)
        if about is None or ring is None:
            return about or ring
        return max(about[0], ring[0]), max(about[1], ring[1]), min(about[2], ring[2]), min(about[3], ring[3])

    def _ring(self, camera: CameraTracker, body: int) -> tuple[int, int, int, int] | None:
        """Window rectangle about the Host's wall, which the NES cannot leave; None for another body, or while the Host
        is lost.
        """
        if self.layout.bodies[body] != "nes" or "host" not in self.layout.bodies or not self.host_radius_m:
            return None
        host = self.layout.bodies.index("host")
        if camera.status(host).frames_lost > _RING_LOST:
            return None
        turn = np.linspace(0, 2 * np.pi, _RING_POINTS)
        circle = self.host_radius_m * np.column_stack([np.cos(turn), np.sin(turn)])
        height = self.layout.position_m[self.layout.of(body), 2].mean()
        points_m = np.column_stack([place(camera.measured.pose[host], circle), np.full(_RING_POINTS, height)])
        return camera.box(points_m, body)

    def discs_in(
        self, i: int, image: np.ndarray, region: tuple[int, int, int, int] | None, like: int | None = None
    ) -> np.ndarray:
        """Discs that camera `i` sees in a region (None: anywhere), `like` the markers of a body or all."""
        key = (i, region, like)
        if key not in self._discs:
            self._discs[key] = self.cameras[i].find_discs(image, region, like)
        return self._discs[key]
