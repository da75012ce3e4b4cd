"""A calibration while its pictures are taken: after each new one, what is known by now and which view to take next."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np

from ovines.errors import InputError
from ovines.recording import CameraSettings, Recording
from vision.calibration.advice import coverage
from vision.calibration.images import views_of
from vision.calibration.single_camera import FEWEST_VIEWS, solve_camera
from vision.calibration.targets.boards import find_board
from vision.calibration.targets.detection import MINIMUM_POINTS, View
from vision.pinhole import N_INTRINSICS
from vision.validation.image_map import image_map
from vision.validation.next_view import next_views


class Watch:
    """The intrinsic pictures of a recording, each looked at once, when it is no longer being written.

    Raises `InputError` for a recording without a board.
    """

    def __init__(self, recording: Recording) -> None:
        if recording.board is None:
            raise InputError(
                f"{recording.folder}: no board in [calibration]",
                "board, intrinsic and extrinsic",
                "add them to recording.toml; the pictures may come later",
            )
        self.recording = recording
        self.board = find_board(recording.board, recording.folder)
        self._sizes: dict[Path, int] = {}
        self._views: dict[str, dict[Path, list[View]]] = {camera.name: {} for camera in recording.cameras}

    def look(self) -> list[str]:
        """A line for each camera of which something new was found; pictures that still grow wait for the next look."""
        lines = []
        for camera in self.recording.cameras:
            done = self._views[camera.name]
            new = [
                path
                for path in self.recording.calibration_images(camera.name, "intrinsic")
                if path not in done and self._settled(path)
            ]
            for path in new:
                done[path] = views_of(path, camera, self.board, None)
            if new:
                lines.append(f"{camera.name}: {self._found(new, camera)}; {self._known(camera)}")
        return lines

    def _settled(self, path: Path) -> bool:
        size, before = path.stat().st_size, self._sizes.get(path)
        self._sizes[path] = size
        return size > 0 and size == before

    def _found(self, new: list[Path], camera: CameraSettings) -> str:
        seen = [view for path in new for view in self._views[camera.name][path]]
        if len(seen) > 1:
            return (
                f"{sum(len(view.points) >= MINIMUM_POINTS for view in seen)} of {len(seen)} new pictures show the board"
            )
        return f"{seen[0].name}: {len(seen[0].points)} points" if len(seen[0].points) else f"{seen[0].name}: no board"

    def _known(self, camera: CameraSettings) -> str:
        every = [view for views in self._views[camera.name].values() for view in views]
        size = camera.sensor_size_px[0], camera.sensor_size_px[1]
        single = solve_camera(every, self.board, size)
        if single is None:
            usable = sum(len(view.points) >= MINIMUM_POINTS for view in every)
            return f"{usable} usable views, {FEWEST_VIEWS} are needed to begin with"
        at = image_map(single.adjusted.state.intrinsics[0], size, single.views)
        sd_px = at.sd_px(np.nan_to_num(single.adjusted.covariance[:N_INTRINSICS, :N_INTRINSICS]))
        text = (
            f"{len(single.views)} views over {coverage(single.views, size):.0%} of the image, lens known to "
            f"{np.sqrt(np.mean(sd_px**2)):.2g} px (RMS; worst {sd_px.max():.2g} px)"
        )
        following = next_views(single, self.board, size, at, 1)
        return text + "".join(f"; next: {one.pose}: {one.then_px:.2g} px" for one in following)


def watch(recording: Recording, say: Callable[[str], None], wait: Callable[[], bool]) -> None:
    """Look, say what is new, ``wait``; until ``wait`` is False."""
    pictures = Watch(recording)
    pictures.look()  # what is there already has its size taken, and is looked at in the next round
    while True:
        for line in pictures.look():
            say(line)
        if not wait():
            return
