"""recording.toml -> `Recording`; a series is a folder of them."""

from __future__ import annotations

import csv
import glob
import math
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ovines.errors import InputError
from ovines.io.toml_input import read_toml
from ovines.recording_schema import Body, CameraSettings, Excitation, Nominal, RecordingFile

__all__ = [
    "ENTRY_TABLES",
    "Body",
    "CameraSettings",
    "Recording",
    "read_recording",
    "read_series",
    "series_folders",
]

FILE = "recording.toml"
ENTRY_TABLES = ("motion", "points", "tracks")  # the furthest along the chain wins


@dataclass(frozen=True, eq=False)
class Recording:
    """One recording as its ``recording.toml`` describes it.

    folder : where recording.toml lies; every relative path in it starts there
    settings : the file's sections as read, for hashing and for `ovines check`
    """

    folder: Path
    settings: RecordingFile

    @property
    def name(self) -> str:
        """As recording.toml gives it, or its folder's."""
        return self.settings.name or self.folder.resolve().name

    @property
    def frame_rate_hz(self) -> float | None:
        """Nominal frame rate; None where the file gives none (a table with times needs none)."""
        return self.settings.time.frame_rate_hz

    @property
    def cameras(self) -> tuple[CameraSettings, ...]:
        """The cameras in the order of recording.toml."""
        return self.settings.cameras

    def camera(self, name: str) -> CameraSettings:
        """The camera of that name; `InputError` where there is none."""
        for camera in self.cameras:
            if camera.name == name:
                return camera
        names = ", ".join(camera.name for camera in self.cameras) or "none"
        raise InputError(
            f"camera {name!r}", f"one of the recording's cameras: {names}", f"correct {self.folder / FILE}"
        )

    @property
    def window_offset_px(self) -> Mapping[str, tuple[int, int]]:
        """Per camera name, the top-left corner of its window on the sensor."""
        return MappingProxyType({camera.name: camera.window_offset_px for camera in self.cameras})

    @property
    def bodies(self) -> Mapping[str, Body]:
        """The bodies given, of "ground", "host", "nes"."""
        given = {name: getattr(self.settings.bodies, name) for name in ("ground", "host", "nes")}
        return MappingProxyType({name: body for name, body in given.items() if body is not None})

    @property
    def markers(self) -> tuple[str, ...]:
        """All markers, body by body."""
        return tuple(marker for body in self.bodies.values() for marker in body.markers)

    @property
    def excitation(self) -> Excitation | None:
        """The drive as recording.toml gives it; None without ``[excitation]``."""
        return self.settings.excitation

    @property
    def model(self) -> Nominal | None:
        """The nominal simulator; None without ``[model]``."""
        return self.settings.model

    @property
    def calibration_file(self) -> Path | None:
        """The solved calibration, when the recording brings one."""
        calibration = self.settings.calibration
        return self.path(calibration.file) if calibration and calibration.file else None

    @property
    def board(self) -> str | None:
        """Board of the calibration images: a name of calibration_boards/ or a path from the recording's folder."""
        return self.settings.calibration.board if self.settings.calibration else None

    def calibration_images(self, camera: str, which: str) -> list[Path]:
        """Files of ``which`` ("intrinsic" or "extrinsic") for ``camera``, in natural order; [] when none match."""
        pattern = getattr(self.settings.calibration, which, None)
        return self.matching(pattern.replace("{camera}", camera)) if pattern else []

    def frame_files(self, camera: str) -> list[Path]:
        """Image files (or the one video file) of ``camera``, in natural order; [] when there are none."""
        pattern = self.camera(camera).frames
        return self.matching(pattern.replace("{camera}", camera)) if pattern else []

    def path(self, text: str) -> Path:
        """A path of recording.toml, relative to its folder."""
        return self.folder / text

    def matching(self, pattern: str) -> list[Path]:
        """Files that a glob of recording.toml names, in natural order (frame_2 before frame_10)."""
        exact = self.path(pattern)
        if exact.is_file():  # a name that holds [ or * is a name first
            return [exact]
        absolute = Path(pattern).is_absolute()
        found = glob.glob(pattern if absolute else str(Path(glob.escape(str(self.folder)), pattern)))
        return [Path(name) for name in sorted(filter(os.path.isfile, found), key=_natural)]

    def entry(self) -> str:
        """Where the recording enters the chain: "motion", "points", "tracks", "frames", "impacts" alone, or "boards":
        nothing but board images, to calibrate from.
        """
        for name in ENTRY_TABLES:
            if (self.folder / f"{name}.parquet").is_file():
                return name
        if any(camera.frames for camera in self.cameras):
            return "frames"
        if (self.folder / "impacts.parquet").is_file():
            return "impacts"
        if self.board is not None and self.cameras:
            return "boards"
        raise InputError(
            f"{self.folder}: no frames in [[cameras]] and no table",
            "frames of each camera, or tracks.parquet, points.parquet, motion.parquet or impacts.parquet beside "
            "recording.toml",
            "add 'frames' to each [[cameras]], or put the table there",
        )

    @cached_property
    def _trigger(self) -> tuple[NDArray[Any], NDArray[Any]] | None:
        trigger = self.settings.time.trigger
        return read_trigger(self.path(trigger)) if trigger else None

    def times_s(self, frames: ArrayLike) -> NDArray[Any]:
        """Times of frame numbers (N,): the trigger's, where there is one, else frame / frame_rate_hz."""
        frames = np.asarray(frames)
        if self._trigger is None:
            if self.frame_rate_hz is None:
                raise InputError(
                    f"{self.folder / FILE}: no frame_rate_hz and no trigger in [time]",
                    "one of the two",
                    "add it",
                )
            return frames / self.frame_rate_hz
        numbers, times_s = self._trigger
        place = np.minimum(np.searchsorted(numbers, frames), len(numbers) - 1)
        absent = numbers[place] != frames
        if absent.any():
            raise InputError(
                f"{self.path(self.settings.time.trigger or '')}: no time for frame {frames[absent][0]}"
                f" and {int(absent.sum()) - 1} more",
                "one row per frame",
                "complete the file, or leave 'trigger' out",
            )
        return times_s[place]


def read_recording(folder: str | Path) -> Recording:
    """Read ``folder``/recording.toml (or that file itself); `InputError` for whatever is wrong in it.

    Examples
    --------
    >>> from ovines.notebook import read_recording
    >>> recording = read_recording("sample_data/rendered")
    >>> recording.entry(), recording.frame_rate_hz, recording.bodies["nes"].radius_m
    ('frames', 800.0, 0.01)
    """
    folder = Path(folder)
    if folder.is_file():
        folder = folder.parent
    if not folder.is_dir():
        raise InputError(f"{folder} is not there", "the folder of a recording", "check the path")
    try:
        str(folder.resolve()).encode()
    except UnicodeEncodeError:  # names go into tables and pages, which are UTF-8
        raise InputError(
            f"a path with bytes that are no UTF-8: {str(folder)!r}", "a path in UTF-8", "rename that folder"
        ) from None
    return Recording(folder, read_toml(folder / FILE, RecordingFile))


def series_folders(folder: str | Path) -> list[Path]:
    """Folders of the recordings of a series, sorted by name; a recording itself is a series of one.

    One level deep and no deeper, so that a link which points back up cannot lead round in circles.
    """
    folder = Path(folder)
    if folder.is_file() and folder.name == FILE:
        folder = folder.parent
    if (folder / FILE).is_file():
        return [folder]
    if not folder.is_dir():
        raise InputError(f"{folder} is not there", "the folder of a recording or of a series", "check the path")
    found = sorted(entry for entry in folder.iterdir() if _may_be_recording(entry))
    if not found:
        raise InputError(
            f"{folder}: no {FILE}, neither there nor one folder below",
            "a recording (a folder with recording.toml) or a folder of recordings",
            "check the path, or write recording.toml",
        )
    return found


def _may_be_recording(entry: Path) -> bool:
    """Whether a folder holds recording.toml; one that cannot be looked into counts, so that its own line says so."""
    try:
        return (entry / FILE).is_file()
    except PermissionError:
        return True
    except OSError:
        return False


def read_series(folder: str | Path) -> list[Recording]:
    """Every recording of a series, sorted by folder name; the first one that is wrong raises `InputError`.

    Examples
    --------
    >>> from ovines.notebook import read_series
    >>> [recording.name for recording in read_series("sample_data/series_tilted")][:2]
    ['sample run 1', 'sample run 2']
    """
    return [read_recording(one) for one in series_folders(folder)]


def read_trigger(path: Path) -> tuple[NDArray[Any], NDArray[Any]]:
    """Frame numbers and times of a ``trigger.csv`` with the header ``frame,time_s``, both strictly increasing."""
    do = "correct that row; the header is 'frame,time_s'"
    frames: list[int] = []
    times_s: list[float] = []
    try:
        with open(path, newline="", encoding="utf-8-sig") as handle:
            rows = csv.DictReader(handle, skipinitialspace=True)
            if [name.strip() for name in rows.fieldnames or ()][:2] != ["frame", "time_s"]:
                raise InputError(f"{path}: header {rows.fieldnames}", "frame,time_s", "write that header")
            for row in rows:
                try:
                    frame, time_s = int(row["frame"]), float(row["time_s"])
                except (TypeError, ValueError):
                    raise InputError(
                        f"{path}, line {rows.line_num}: {row['frame']!r}, {row['time_s']!r}",
                        "a frame and a time",
                        do,
                    ) from None
                later = not frames or (frame > frames[-1] and time_s > times_s[-1])
                if not (later and 0 <= frame < 2**62 and math.isfinite(time_s)):
                    raise InputError(
                        f"{path}, line {rows.line_num}: frame {str(frame)[:30]} at {time_s} s after "
                        + (f"frame {frames[-1]} at {times_s[-1]} s" if frames else "the header"),
                        "frames from 0 and finite times, both increasing from row to row",
                        do,
                    )
                frames.append(frame)
                times_s.append(time_s)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: {str(error)[:200]}", "a CSV file with frame,time_s", "check the path") from None
    if not frames:
        raise InputError(f"{path}: no rows", "one row per frame", do)
    return np.array(frames), np.array(times_s)


def _natural(path: str) -> list[tuple[int, int | str]]:
    return [(0, int(part)) if part.isdecimal() else (1, part) for part in re.split(r"(\d+)", path)]
