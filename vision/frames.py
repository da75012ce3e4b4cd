"""Frames of a recording, streamed: image files or a video per camera, decoded ahead in threads.

Grey levels: 8 and 16 bit are kept as they are; colour becomes luma (0.299 R + 0.587 G + 0.114 B).  A picture
that cannot be read is a named gap; one of the wrong size is refused.
"""

from __future__ import annotations

import mmap
import os
import re
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from ovines.errors import InputError
from ovines.recording import CameraSettings, Recording
from vision.image_header import BadImage, read_header

VIDEO_SUFFIXES = {".avi", ".mp4", ".mov", ".mkv", ".m4v", ".mpg", ".mpeg", ".webm", ".wmv"}
_AHEAD = 6  # decoded frames kept ready per camera: memory stays flat


@dataclass(frozen=True)
class Source:
    """One camera's frames: `files` by frame number, or one video."""

    camera: CameraSettings
    files: dict[int, Path] = field(default_factory=dict)
    video: Path | None = None

    def numbers(self) -> list[int]:
        """Frame numbers with a picture (a video's: as many as its header promises)."""
        if self.video is None:
            return sorted(self.files)
        capture = cv2.VideoCapture(str(self.video))
        count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT)) if capture.isOpened() else 0
        capture.release()
        return list(range(max(count, 0)))


def open_sources(recording: Recording) -> tuple[list[Source], list[str]]:
    """The cameras' frames, numbered alike, and notes on what is missing.

    The number of a frame is the last number in its file's name, counted from the first file; names without
    ascending numbers are counted.  Cameras whose numbers start differently but are equally many are each
    counted from their own first file (cameras number as they like); else by their common numbers.
    """
    numbered: list[tuple[CameraSettings, dict[int, Path]]] = []
    sources: list[Source] = []
    for camera in recording.cameras:
        files = recording.frame_files(camera.name)
        if not files:
            raise InputError(f"no frames of camera {camera.name!r}: {camera.frames!r} matches nothing in {recording.folder}",
                             "image files (a glob) or one video file", "correct 'frames' in recording.toml")
        if len(files) == 1 and files[0].suffix.lower() in VIDEO_SUFFIXES:
            sources.append(Source(camera, video=files[0]))
        else:
            numbered.append((camera, _by_number(files)))
    firsts = {min(files) for _, files in numbered}
    counts = {len(files) for _, files in numbered}
    common = min(firsts, default=0)
    for camera, files in numbered:
        base = min(files) if len(counts) == 1 else common
        sources.append(Source(camera, {number - base: path for number, path in files.items()}))
    order = [camera.name for camera in recording.cameras]
    sources.sort(key=lambda source: order.index(source.camera.name))
    notes = []
    everything = sorted(set().union(*(source.numbers() for source in sources)))
    for source in sources:
        missing = sorted(set(everything) - set(source.numbers()))
        if missing:
            notes.append(f"{source.camera.name} has {len(source.numbers())} frames of {len(everything)}: "
                         f"none for frame {_listed(missing)}")
    return sources, notes


def _listed(numbers: list[int]) -> str:
    text = ", ".join(str(number) for number in numbers[:8])
    return text + (f" and {len(numbers) - 8} more" if len(numbers) > 8 else "")


def _by_number(files: list[Path]) -> dict[int, Path]:
    digits = [re.findall(r"\d+", path.stem) for path in files]
    numbers = [int(found[-1]) if found else -1 for found in digits]
    if min(numbers) < 0 or np.any(np.diff(numbers) <= 0):
        numbers = list(range(len(files)))
    elif len(files) > 1:  # names that count in steps (time stamps) say nothing about gaps
        step = int(np.median(np.diff(numbers)))
        if step != 1:
            numbers = list(range(len(files)))
    return dict(zip(numbers, files, strict=True))


def read_image(path: Path, size_px: tuple[int, int]) -> np.ndarray:
    """One grey picture (h, w), uint8 or uint16, of `size_px` = (width, height).

    Uncompressed TIFF is mapped, not read: only the pages that are looked at are loaded.  Raises `BadImage`
    for a picture that cannot be read and `InputError` for one of another size.
    """
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise BadImage(str(error.strerror)) from None
    try:
        size = os.fstat(handle).st_size
        if size == 0:
            raise BadImage("empty file")
        data = mmap.mmap(handle, size, access=mmap.ACCESS_COPY)
    except OSError as error:
        raise BadImage(str(error)) from None
    finally:
        os.close(handle)
    header = read_header(data, size)
    if header is not None:
        _check_size(path, (header.width, header.height), size_px)
        if header.raw_offset is not None:
            kind = np.dtype(np.uint8 if header.raw_bits == 8 else np.uint16)
            return np.frombuffer(data, kind, header.width * header.height, header.raw_offset).reshape(
                header.height, header.width)
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION if data[:2] == b"\xff\xd8" else cv2.IMREAD_UNCHANGED
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise BadImage(str(error).splitlines()[0]) from None
    if image is None:
        raise BadImage("cannot be decoded")
    image = _grey(image)
    _check_size(path, image.shape[::-1], size_px)
    return image


def _grey(image: np.ndarray) -> np.ndarray:
    if image.ndim == 3 and image.shape[2] >= 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2GRAY if image.shape[2] == 4 else cv2.COLOR_BGR2GRAY)
    elif image.ndim == 3:
        image = image[:, :, 0]
    if image.dtype not in (np.uint8, np.uint16):
        raise BadImage(f"pixels of type {image.dtype}")
    return np.ascontiguousarray(image)


def _check_size(where: object, found: tuple[int, ...], expected: tuple[int, int]) -> None:
    if tuple(found) != tuple(expected):
        raise InputError(f"{where}: a picture of {found[0]} x {found[1]} px",
                         f"the camera's window_size_px, {expected[0]} x {expected[1]}",
                         "correct window_size_px (and window_offset_px) in recording.toml, or remove that file")


def _video_frames(source: Source, wanted: int) -> Iterator[np.ndarray | None]:
    capture = cv2.VideoCapture(str(source.video))
    try:
        if not capture.isOpened():
            raise InputError(f"{source.video} cannot be opened as a video", "a video that OpenCV reads",
                             "convert it, or give image files")
        for _ in range(wanted):
            good, image = capture.read()
            if not good:
                return
            image = _grey(image)
            _check_size(source.video, image.shape[::-1], source.camera.window_px)
            yield image
    finally:
        capture.release()


def stream(sources: list[Source], notes: list[str], workers: int = 2,
           read: Callable[[Path, tuple[int, int]], np.ndarray] = read_image,
           ) -> Iterator[tuple[int, list[np.ndarray | None]]]:
    """Frame number and one picture per camera (None: missing or unreadable, said in `notes`), in order.

    At most a few frames per camera are held, however long the recording.
    """
    numbers = sorted(set().union(*(source.numbers() for source in sources)))
    videos = [_video_frames(source, len(numbers)) if source.video else None for source in sources]
    ended = [False] * len(sources)
    bad = [0] * len(sources)
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[tuple[int, list[Future | None]]] = deque()
        upcoming = iter(numbers)
        while True:
            while len(waiting) < _AHEAD and (number := next(upcoming, None)) is not None:
                waiting.append((number, [
                    pool.submit(read, source.files[number], source.camera.window_px)
                    if number in source.files else None for source in sources]))
            if not waiting:
                break
            number, futures = waiting.popleft()
            images: list[np.ndarray | None] = []
            for i, (source, future) in enumerate(zip(sources, futures, strict=True)):
                image = None
                if videos[i] is not None and not ended[i]:
                    image = next(videos[i], None)
                    if image is None:
                        ended[i] = True
                        notes.append(f"{source.camera.name}: the video ends before frame {number}")
                elif future is not None:
                    try:
                        image = future.result()
                    except BadImage as error:
                        bad[i] += 1
                        if bad[i] <= 5:
                            notes.append(f"{source.camera.name} frame {number} ({source.files[number].name}): {error}; left out")
                images.append(image)
            yield number, images
    for source, count in zip(sources, bad, strict=True):
        if count > 5:
            notes.append(f"{source.camera.name}: {count} pictures could not be read")
        if source.video is None and count == len(source.files):
            raise InputError(f"none of the {count} pictures of camera {source.camera.name!r} can be read",
                             "PNG, TIFF, BMP or JPEG files", "check the files that 'frames' names")
