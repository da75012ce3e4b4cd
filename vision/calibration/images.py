"""Board images of a recording: read, found, in full-sensor pixels."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.recording import CameraSettings, Recording
from vision.calibration.targets.board_diagnosis import alternatives, refuse_mirrored
from vision.calibration.targets.boards import Board, find_board
from vision.calibration.targets.chessboard import refuse_other_size
from vision.calibration.targets.detection import MINIMUM_POINTS, View, detect
from vision.markers.row import U, V
from vision.video import open_video

TRIED = 4  # images of each camera in which another print of the board is looked for
COUNTED = 6  # images in which the squares of a chessboard are counted: some may show a part of it
VIDEO_VIEWS, VIDEO_TRIED = 40, 6  # frames of a film that are views, and in which another print is looked for
FRAME = "frame_"  # and its number: a view of a film
ALIKE = 0.9  # share of the longest film's frames that the shortest has where both began together
VIDEOS = {".mp4", ".avi", ".mov", ".mkv", ".m4v"}
Image = NDArray[np.uint8]
Array = NDArray[np.float64]


def read_views(
    recording: Recording,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Board, dict[str, list[View]], dict[str, View], list[str]]:
    """Board (as it fits), intrinsic views and the extrinsic view per camera, and notes on what differs from its
    TOML.
    """
    if recording.board is None:
        raise InputError(
            f"{recording.folder}: no board in [calibration]",
            "board, intrinsic and extrinsic, or a solved calibration's file",
            "add them to recording.toml",
        )
    board = find_board(recording.board, recording.folder)
    files = {
        (camera.name, which): _files(recording, camera.name, which)
        for camera in recording.cameras
        for which in ("intrinsic", "extrinsic")
    }
    jobs = [
        (camera, which, path)
        for camera in recording.cameras
        for which in ("intrinsic", "extrinsic")
        for path in files[camera.name, which]
    ]
    board, notes = _board_that_fits(board, [(path, camera) for camera, which, path in jobs if which == "intrinsic"])
    views: dict[str, list[View]] = {camera.name: [] for camera in recording.cameras}
    world: dict[str, list[View]] = {camera.name: [] for camera in recording.cameras}
    frames = {
        which: _common_frames([path for _, one, path in jobs if one == which], which)
        for which in ("intrinsic", "extrinsic")
    }
    with ThreadPoolExecutor(2) as pool:  # OpenCV lets go of the interpreter while it looks for markers
        found = pool.map(lambda job: views_of(job[2], job[0], board, frames[job[1]]), jobs)
        for done, ((camera, which, path), seen) in enumerate(zip(jobs, found, strict=True), 1):
            for view in seen:
                view = replace(
                    view,
                    instant=instant_of(view.name, path, getattr(recording.settings.calibration, which), camera.name),
                )
                (views if which == "intrinsic" else world)[camera.name].append(view)
            if progress:
                progress(done, len(jobs))
    extrinsic = one_instant(world)
    for camera in recording.cameras:
        if camera.name not in extrinsic or not len(extrinsic[camera.name].points):
            raise InputError(
                f"{camera.name}: board {board.name} not found in its extrinsic view "
                f"{', '.join(p.name for p in files[camera.name, 'extrinsic'])}",
                "the whole board, in the world position",
                "take that view again, or name another image",
            )
    return board, views, extrinsic, notes


def one_instant(world: Mapping[str, Sequence[View]]) -> dict[str, View]:
    """Of each camera's extrinsic views one, all of one instant where the cameras share any; else each camera's fullest.

    Of a film each camera's fullest frame alone would be another frame, and a board held by hand has moved between them.
    """
    common = set.intersection(
        *({view.when for view in own if len(view.points) >= MINIMUM_POINTS} for own in world.values())
    )
    chosen = {name: {view.when: view for view in own} for name, own in world.items()}
    if common:
        counts = {when: sorted(len(own[when].points) for own in chosen.values()) for when in common}
        best = max(sorted(common), key=lambda when: counts[when])
        return {name: own[best] for name, own in chosen.items()}
    filmed = [
        name
        for name, own in world.items()
        if any(FRAME in view.name and len(view.points) >= MINIMUM_POINTS for view in own)
    ]
    if len(filmed) > 1:
        raise InputError(
            f"{' and '.join(filmed)}: no frame of their extrinsic films in which all of them see the board",
            "the board in the world position, seen by all cameras in one frame",
            "name one image per camera, or another film",
        )
    return {name: max(own, key=lambda view: len(view.points)) for name, own in world.items() if own}


def instant_of(name: str, path: Path, pattern: str, camera: str) -> str:
    """A view's name without its camera's, which stands where the pattern of recording.toml has {camera}: alike in all
    cameras.
    """
    parts = [re.escape(part).replace(r"\*", ".*").replace(r"\?", ".") for part in Path(pattern).name.split("{camera}")]
    found = re.fullmatch(re.escape(camera).join(f"({part})" for part in parts), path.name) if len(parts) > 1 else None
    return name.replace(path.name, "".join(found.groups())) if found else name


def _files(recording: Recording, camera: str, which: str) -> list[Path]:
    paths = recording.calibration_images(camera, which)
    if not paths:
        pattern = getattr(recording.settings.calibration, which)
        raise InputError(
            f"{camera}: no file {pattern.replace('{camera}', camera)}",
            f"{which} images of the board",
            f"correct [calibration] {which} in {recording.folder / 'recording.toml'}",
        )
    return paths


def _board_that_fits(board: Board, images: list[tuple[Path, CameraSettings]]) -> tuple[Board, list[str]]:
    """The board itself if some image shows it, else the print that does; refused by name where nothing helps."""
    seen: dict[str, list[Image]] = {}
    for name in dict.fromkeys(camera.name for _, camera in images):
        own = [(path, camera) for path, camera in images if camera.name == name]
        seen[name] = [
            image
            for path, camera in own[:: max(1, len(own) // TRIED)][:TRIED]
            for _, image in _read(path, camera, few=True)
        ]
    every = [image for one in seen.values() for image in one]
    if not every:
        raise InputError(
            "none of the board images can be read", "PNG, TIFF, BMP or JPEG images, or a video", "check the files"
        )
    if board.kind == "chessboard":
        refuse_other_size(every[:: max(1, len(every) // COUNTED)][:COUNTED], board)
    blind = [name for name, own in seen.items() if own and not any(len(detect(image, board).points) for image in own)]
    if len(blind) == len([own for own in seen.values() if own]):
        changed, note = alternatives(every, board)
        return changed, [note]
    for name in blind:
        refuse_mirrored(seen[name], board, name)
    return board, []


def views_of(path: Path, camera: CameraSettings, board: Board, of: int | None) -> list[View]:
    """The board in an image, or in frames of a film (of its first ``of``), in full-sensor pixels; a view without points
    for what cannot be read.
    """
    views = []
    try:
        for name, image in _read(path, camera, of=of):
            view = detect(image, board, name)
            if image.shape[::-1] != tuple(camera.sensor_size_px):  # a window, then
                view = replace(
                    view,
                    uv_px=view.uv_px + camera.window_offset_px,
                    discs=_shifted(view.discs, camera.window_offset_px),
                )
            views.append(view)
    except OSError:
        views.append(View(path.name, np.empty(0, np.int64), np.empty((0, 2)), np.empty(0)))
    return views


def _shifted(discs: Array | None, offset_px: tuple[int, int]) -> Array | None:
    if discs is None:
        return None
    moved = discs.copy()
    moved[:, [U, V]] += offset_px
    return moved


def _read(path: Path, camera: CameraSettings, few: bool = False, of: int | None = None) -> Iterable[tuple[str, Image]]:
    if path.suffix.lower() in VIDEOS:
        count = VIDEO_TRIED if few else VIDEO_VIEWS
        numbers = None if of is None else np.linspace(0, of - 1, min(of, count)).astype(int).tolist()
        for name, image in video_frames(path, count, numbers):
            _check_size(image, path, camera)
            yield f"{path.name} {name}", image
        return
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION
    decoded = cv2.imdecode(np.fromfile(path, np.uint8), flags) if path.stat().st_size else None
    if decoded is None:
        if not few:
            raise OSError(f"{path} cannot be decoded")
        return
    image = np.asarray(decoded, np.uint8)
    _check_size(image, path, camera)
    yield path.name, image


def _check_size(image: Image, path: Path, camera: CameraSettings) -> None:
    size, sensor, window = image.shape[::-1], tuple(camera.sensor_size_px), camera.window_size_px
    if size != sensor and (window is None or size != tuple(window)):
        raise InputError(
            f"{path}: {size[0]} x {size[1]} px",
            f"the sensor's {sensor[0]} x {sensor[1]} px"
            + (f" or the window's {window[0]} x {window[1]} px" if window else ""),
            f"check sensor_size_px of {camera.name}, or use images as the camera took them",
        )


def _frames(path: Path) -> int:
    return int(open_video(path).get(cv2.CAP_PROP_FRAME_COUNT))


def _common_frames(paths: Sequence[Path], which: str) -> int | None:
    """Frames of each film that are looked at, as many of all: the same numbers are then the same instants.  None: all
    of each.
    """
    counts = [_frames(path) for path in paths if path.suffix.lower() in VIDEOS]
    least = min(counts, default=0)
    return least if least > 0 and (which == "extrinsic" or least > ALIKE * max(counts)) else None


def video_frames(
    path: Path, count: int | None = None, numbers: Iterable[int] | None = None
) -> Iterable[tuple[str, Image]]:
    """Grey frames of a video: ``count`` at equal steps, or those with the given numbers; named "frame_N"."""
    video = open_video(path)
    total = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
    if not video.isOpened() or total < 1:
        raise InputError(f"{path} cannot be read as a video", "a video file", "check the file")
    wanted = (
        set(numbers)
        if numbers is not None
        else set(np.linspace(0, total - 1, min(total, count or total)).astype(int).tolist())
    )
    for number in range(max(wanted) + 1):
        if not video.grab():
            break
        if number in wanted:
            good, frame = video.retrieve()
            if good:
                yield f"{FRAME}{number:05d}", np.asarray(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), np.uint8)
    video.release()
