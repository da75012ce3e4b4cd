"""Videos as cameras and phones write them: unturned pictures, and the times at which frames are to be shown."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
VIDEO_SUFFIXES = {".avi", ".mp4", ".mov", ".mkv", ".m4v", ".mpg", ".mpeg", ".webm", ".wmv"}
TICK_S = 1.01e-3  # a container's clock may count milliseconds
UNEVEN = 0.1  # of a frame's interval, by which a frame may be off an even clock
_GREY_16 = b"Y1\x00\x10"  # FFmpeg's tag
FEWEST = 3  # frames whose times say whether they are even


class Presented(NamedTuple):
    """When a video's frames are shown: ``times_s`` (n,) from its first, ``even`` if a constant rate explains them,
    ``rate_hz`` that rate (of uneven ones: of the usual interval)."""

    times_s: Array
    even: bool
    rate_hz: float


def open_video(path: Path) -> cv2.VideoCapture:
    """A video whose frames come as the sensor read them: a rotation flag, which only asks players to turn them, is not
    obeyed (nor is that of a photo), so that board and recording are pictures of one sensor.
    """
    capture = cv2.VideoCapture(str(path.absolute()))  # a folder named "http:" is no address
    capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    return capture


def rotation_deg(path: Path) -> int:
    """By how much the file asks players to turn the picture."""
    capture = open_video(path)
    turn = int(capture.get(cv2.CAP_PROP_ORIENTATION_META)) if capture.isOpened() else 0
    capture.release()
    return turn % 360


def bits_per_channel(path: Path) -> int:
    """Bits of each colour or grey of a film's pixels, as its pixel format tells them; 8 where it tells none.

    FFmpeg's tags of deep formats are "Y", a digit, the layout and the depth, the other way round where bytes are.
    """
    capture = open_video(path)
    tag = _pixel_format(capture)
    capture.release()
    if tag == b"P010":
        return 10
    first, digit, _, depth = tag if tag[:1] == b"Y" else tag[::-1]
    deep = first == ord("Y") and chr(digit).isdigit() and 8 < depth <= 16
    return depth if deep else 8


def keep_deep_grey(capture: cv2.VideoCapture) -> bool:
    """Let OpenCV's reader give grey of 16 bit as it is; of other deep formats it gives 8 bit whatever is asked."""
    return _pixel_format(capture) == _GREY_16 and bool(capture.set(cv2.CAP_PROP_CONVERT_RGB, 0))


def _pixel_format(capture: cv2.VideoCapture) -> bytes:
    return (int(capture.get(cv2.CAP_PROP_CODEC_PIXEL_FORMAT)) & 0xFFFFFFFF).to_bytes(4, "little")


def presented(path: Path) -> Presented | None:
    """Presentation times of a video; None where its container has none."""
    state = path.stat()
    return _presented(str(path), state.st_size, state.st_mtime_ns)


@lru_cache(maxsize=16)
def _presented(path: str, _size: int, _modified: int) -> Presented | None:
    capture = open_video(Path(path))
    times = []
    while capture.grab():
        times.append(capture.get(cv2.CAP_PROP_POS_MSEC) * 1e-3)
    capture.release()
    times_s = np.array(times)
    if len(times_s) < FEWEST or not (np.diff(times_s) > 0).all():
        return None
    times_s = times_s - times_s[0]
    usual_s = float(np.median(np.diff(times_s)))
    number = np.arange(len(times_s))
    slope, start = np.polyfit(number, times_s, 1)
    even = bool(np.abs(times_s - start - slope * number).max() <= max(UNEVEN * usual_s, TICK_S))
    return Presented(times_s, even, 1.0 / (slope if even else usual_s))
