"""A recording's pictures as JPEGs, to look at: every n-th frame, 16-bit grey levels stretched to 8."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.recording import Recording
from vision.frames.sources import Source, open_sources, stream

Image = NDArray[np.uint8] | NDArray[np.uint16]
# As vision.frames.dropped.DroppedFrames says it.
_DROPPED = re.compile(r"^(.+) dropped (\d+) frames? before its frame (\d+):")
_THINNED, _GREYS = 4, (0.1, 99.9)  # every fourth row and column; percentiles that become black and white


@dataclass(frozen=True)
class Selection:
    """Frames ``first`` to ``last`` of which every ``every``-th is shown, with JPEG quality ``quality`` (1 to 100)."""

    first: int = 0
    last: int = 2**62
    every: int = 1
    quality: int = 85

    def holds(self, frame: int) -> bool:
        """Whether the frame is shown."""
        return self.first <= frame <= self.last and (frame - self.first) % self.every == 0


def number_of_frames(recording: Recording) -> int:
    """Frames for which some camera has a picture."""
    sources, _ = open_sources(recording)
    return len(set().union(*(source.numbers() for source in sources)))


def jpegs(
    recording: Recording, selection: Selection, notes: Sequence[str] = ()
) -> Iterator[tuple[int, dict[str, bytes]]]:
    """(frame, JPEG per camera that has it), in order.

    ``notes`` are those of the tracking: where they say that a camera dropped frames, its later pictures get the
    numbers that the tables give them.
    """
    sources, problems = open_sources(recording)
    moved = {source.camera.name: _moved(notes, source.camera.name) for source in sources}
    wanted = [_numbered(source, moved[source.camera.name], selection) for source in sources]
    levels: dict[str, tuple[float, float]] = {}
    late: dict[int, dict[str, bytes]] = {}
    for number, images in stream(wanted, problems):
        for source, image in zip(wanted, images, strict=True):
            name = source.camera.name
            frame = number if source.video is None else number + _shift(moved[name], number)
            if image is not None and selection.holds(frame):
                late.setdefault(frame, {})[name] = _jpeg(
                    image, levels.setdefault(name, _range(image)), selection.quality
                )
        for frame in sorted(one for one in late if one <= number):
            yield frame, late.pop(frame)
    for frame in sorted(late):  # of a video whose frames were renumbered
        yield frame, late[frame]


def _moved(notes: Sequence[str], camera: str) -> Mapping[int, int]:
    """From which of its own frames on a camera's numbers are how many too low."""
    found = (_DROPPED.match(note) for note in notes)
    return {int(one[3]): int(one[2]) for one in found if one is not None and one[1] == camera}


def _shift(moved: Mapping[int, int], own: int) -> int:
    return sum(n for start, n in moved.items() if own >= start)


def _numbered(source: Source, moved: Mapping[int, int], selection: Selection) -> Source:
    """Files under the frames of the tables, those not wanted left out; a video is read through."""
    if source.video is not None:
        return source
    files = {own + _shift(moved, own): path for own, path in source.files.items()}
    return replace(source, files={frame: path for frame, path in files.items() if selection.holds(frame)})


def _range(image: Image) -> tuple[float, float]:
    """Grey levels that become black and white: all of 8 bit, of 16 bit what the first picture uses."""
    if image.dtype == np.uint8:
        return 0.0, 255.0
    low, high = np.percentile(image[::_THINNED, ::_THINNED], _GREYS)
    return float(low), max(float(high), float(low) + 1.0)


def _jpeg(image: Image, levels: tuple[float, float], quality: int) -> bytes:
    if image.dtype != np.uint8:
        low, high = levels
        image = np.clip((image.astype(np.float32) - low) * (255.0 / (high - low)), 0, 255).astype(np.uint8)
    done, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise ValueError(f"a picture of {image.shape} does not become a JPEG")
    return data.tobytes()
