"""Frames of a recording, streamed: image files or a video per camera, decoded ahead in threads.

Grey levels: 8 and 16 bit are kept as they are (a film of 10 or 12 bit is decoded to 8, with a note); colour becomes
luma (0.299 R + 0.587 G + 0.114 B).  A picture that cannot be read is a named gap; one of the wrong size is refused.
"""

from __future__ import annotations

import mmap
import os
import re
import threading
from collections import deque
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from ovines.errors import InputError
from ovines.recording import CameraSettings, Recording
from vision.frames.image_header import ImageError, read_header
from vision.video import VIDEO_SUFFIXES, bits_per_channel, keep_deep_grey, open_video, rotation_deg

_LISTED, _NAMED_BAD = 8, 5  # frames named in a note on missing ones, and pictures that cannot be read
_CHUNK = 8  # frames that a reading thread takes at once; handing over costs as much as mapping a raw picture


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
        capture = open_video(self.video)
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
            raise InputError(
                f"no frames of camera {camera.name!r}: {camera.frames!r} matches nothing in {recording.folder}",
                "image files (a glob) or one video file",
                "correct 'frames' in recording.toml",
            )
        if len(files) == 1 and files[0].suffix.lower() in VIDEO_SUFFIXES:
            sources.append(Source(camera, video=files[0]))
        else:
            numbered.append((camera, _by_number(files)))
    firsts = {min(files) for _, files in numbered}
    counts = {len(files) for _, files in numbered}
    common = min(firsts, default=0)
    for camera, by_number in numbered:
        base = min(by_number) if len(counts) == 1 else common
        sources.append(Source(camera, {number - base: path for number, path in by_number.items()}))
    order = [camera.name for camera in recording.cameras]
    sources.sort(key=lambda source: order.index(source.camera.name))
    notes = []
    everything = sorted(set().union(*(source.numbers() for source in sources)))
    for source in sources:
        notes += _reduced(source)
        missing = sorted(set(everything) - set(source.numbers()))
        if missing:
            notes.append(
                f"{source.camera.name} has {len(source.numbers())} frames of {len(everything)}: "
                f"none for frame {_listed(missing)}"
            )
    return sources, notes


def _reduced(source: Source) -> list[str]:
    """A note where a film has more grey levels than are read."""
    if source.video is None:
        return []
    capture = open_video(source.video)
    kept = keep_deep_grey(capture)
    capture.release()
    bits = bits_per_channel(source.video)
    if bits == 8 or kept:
        return []
    return [
        f"{source.camera.name}: a film of {bits} bits per channel, read with 8: markers as good as in a film of 8; "
        "TIFF or PNG files keep all"
    ]


def _listed(numbers: list[int]) -> str:
    text = ", ".join(str(number) for number in numbers[:_LISTED])
    return text + (f" and {len(numbers) - _LISTED} more" if len(numbers) > _LISTED else "")


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

    Uncompressed TIFF is mapped, not read: only the pages that are looked at are loaded.  Raises `ImageError`
    for a picture that cannot be read and `InputError` for one of another size.
    """
    try:
        handle = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise ImageError(str(error.strerror)) from None
    try:
        size = os.fstat(handle).st_size
        if size == 0:
            raise ImageError("empty file")
        data = mmap.mmap(handle, size, access=mmap.ACCESS_COPY)
    except OSError as error:
        raise ImageError(str(error)) from None
    finally:
        os.close(handle)
    header = read_header(data, size)
    if header is not None:
        _check_size(path, (header.width, header.height), size_px)
        if header.raw_offset is not None:
            kind = np.dtype(np.uint8 if header.raw_bits == 8 else np.uint16)
            return np.frombuffer(data, kind, header.width * header.height, header.raw_offset).reshape(
                header.height, header.width
            )
    flags = cv2.IMREAD_GRAYSCALE | cv2.IMREAD_IGNORE_ORIENTATION if data[:2] == b"\xff\xd8" else cv2.IMREAD_UNCHANGED
    try:
        image = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except cv2.error as error:
        raise ImageError(str(error).splitlines()[0]) from None
    if image is None:
        raise ImageError("cannot be decoded")
    image = _grey(image)
    _check_size(path, image.shape[::-1], size_px)
    return image


def _grey(image: np.ndarray) -> np.ndarray:
    if image.ndim == 3 and image.shape[2] >= 3:
        image = cv2.cvtColor(image, cv2.COLOR_BGRA2GRAY if image.shape[2] == 4 else cv2.COLOR_BGR2GRAY)
    elif image.ndim == 3:
        image = image[:, :, 0]
    if image.dtype not in (np.uint8, np.uint16):
        raise ImageError(f"pixels of type {image.dtype}")
    return np.ascontiguousarray(image)


def _check_size(where: object, found: tuple[int, ...], expected: tuple[int, int]) -> None:
    if tuple(found) != tuple(expected):
        raise InputError(
            f"{where}: a picture of {found[0]} x {found[1]} px",
            f"the camera's window_size_px, {expected[0]} x {expected[1]}",
            "correct window_size_px (and window_offset_px) in recording.toml, or remove that file",
        )


def _video_frames(source: Source) -> Iterator[np.ndarray]:
    assert source.video is not None
    capture = open_video(source.video)
    try:
        if not capture.isOpened():
            raise InputError(
                f"{source.video} cannot be opened as a video",
                "a video that OpenCV reads",
                "convert it, or give image files",
            )
        keep_deep_grey(capture)
        while True:
            good, image = capture.read()
            if not good:
                return
            image = _grey(image)
            if image.shape == tuple(source.camera.window_px) != image.shape[::-1] and rotation_deg(source.video) % 180:
                raise _turned(source.video, image.shape)
            _check_size(source.video, image.shape[::-1], source.camera.window_px)
            yield image
    finally:
        capture.release()


def _turned(path: Path, shape: tuple[int, ...]) -> InputError:
    return InputError(
        f"{path}: pictures of {shape[1]} x {shape[0]} px that the file asks players to turn by {rotation_deg(path)} "
        f"degrees",
        "the sensor's own picture, which is not turned",
        f"set sensor_size_px = [{shape[1]}, {shape[0]}] and calibrate with pictures that are not turned either",
    )


def stream(sources: list[Source], notes: list[str], workers: int = 2) -> Iterator[tuple[int, list[np.ndarray | None]]]:
    """Frame number and one picture per camera (None: missing or unreadable, said in `notes`), in order."""
    for frames, pictures in stream_chunks(sources, notes, workers):
        yield from zip(frames, pictures, strict=True)


def stream_chunks(
    sources: list[Source], notes: list[str], workers: int = 2
) -> Iterator[tuple[list[int], list[list[np.ndarray | None]]]]:
    """As `stream`, a few frames at a time; their list is emptied when the next are taken.

    At most 4 `_CHUNK` frames per camera are held, however long the recording: in hand, twice ahead, being given back.
    """
    numbers = sorted(set().union(*(source.numbers() for source in sources)))
    readers = [_Reader(source, notes) for source in sources]
    chunks = enumerate([numbers[i : i + _CHUNK] for i in range(0, len(numbers), _CHUNK)])
    with ThreadPoolExecutor(workers) as pool:
        waiting: deque[tuple[list[int], list[Future[Any]]]] = deque()
        while True:
            while len(waiting) < 2 and (following := next(chunks, None)) is not None:
                turn, chunk = following
                waiting.append((chunk, [pool.submit(reader.read, chunk, turn) for reader in readers]))
            if not waiting:
                break
            chunk, futures = waiting.popleft()
            pictures = [list(pair) for pair in zip(*(future.result() for future in futures), strict=True)]
            futures.clear()
            yield chunk, pictures
            pool.submit(pictures.clear)  # giving a raw picture's memory back takes as long as reading a part of it
    for reader in readers:
        reader.finish()


class _Reader:
    """Pictures of one camera, and what was wrong with them."""

    def __init__(self, source: Source, notes: list[str]) -> None:
        self.source, self.notes = source, notes
        self.bad = 0
        self.video = _video_frames(source) if source.video else None
        self.done, self.next = threading.Condition(), 0

    def read(self, numbers: list[int], turn: int) -> list[np.ndarray | None]:
        """The pictures of some frames, the ``turn``-th of the calls: a video is read in their order, whichever of the
        threads comes first.
        """
        if self.video is None:
            return [self._file(number) for number in numbers]
        with self.done:
            self.done.wait_for(lambda: self.next == turn)
            try:
                return [self._next(number) for number in numbers]
            finally:
                self.next += 1
                self.done.notify_all()

    def _next(self, number: int) -> np.ndarray | None:
        image = next(self.video, None) if self.video else None
        if image is None and self.bad == 0:
            self.bad = 1
            self.notes.append(f"{self.source.camera.name}: the video ends before frame {number}")
        return image

    def _file(self, number: int) -> np.ndarray | None:
        path = self.source.files.get(number)
        if path is None:
            return None
        try:
            return read_image(path, self.source.camera.window_px)
        except ImageError as error:
            self.bad += 1
            if self.bad <= _NAMED_BAD:
                self.notes.append(f"{self.source.camera.name} frame {number} ({path.name}): {error}; left out")
            return None

    def finish(self) -> None:
        name = self.source.camera.name
        if self.video is None and self.bad == len(self.source.files):
            raise InputError(
                f"none of the {self.bad} pictures of camera {name!r} can be read",
                "PNG, TIFF, BMP or JPEG files",
                "check the files that 'frames' names",
            )
        if self.video is None and self.bad > _NAMED_BAD:
            self.notes.append(f"{name}: {self.bad} pictures could not be read")
