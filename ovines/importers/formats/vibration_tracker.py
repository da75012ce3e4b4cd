"""VibrationTracker's results: pixels per frame and point, or positions as displacement from the first frame.

Its files (github.com/YunhyeokHan/VibrationTracker, modules target_tracking, displacement_calculation and
pose_estimation) carry neither names, nor times, nor units: points are numbered as they were clicked, frames as the
images were listed.  A point whose correlation failed, and every frame after the user stopped, stands at exactly (0, 0).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.importers.reading.files import read_json

Array = NDArray[np.float64]
TRACKS, DISPLACEMENT = "TrackResults", "resultDisplacement"


def read_tracks(path: Path) -> Array:
    """``TrackResults.json``: pixels (frames, points, 2), NaN where the program wrote (0, 0) for a point it lost."""
    expected = f'VibrationTracker\'s TrackResults.json: {{"{TRACKS}": [frame][point][u, v]}}'
    uv = _numbers(read_json(path, expected).get(TRACKS), (None, None, 2), f"{path}: {TRACKS}", expected)
    uv[(uv == 0).all(-1)] = np.nan
    return uv


def read_points(path: Path) -> Array:
    """``displacementResults.json`` of two cameras: positions (frames, points, 3) in the unit of the calibration's
    square.
    """
    expected = f'VibrationTracker\'s displacementResults.json of two cameras: "{DISPLACEMENT}" and "Point3D"'
    content = read_json(path, expected)
    if "Point2D" in content and "Point3D" not in content:
        raise InputError(
            f"{path} holds displacements of one camera (Point2D)",
            "positions in space from two cameras",
            "import the two cameras' TrackResults.json with --tracks instead",
        )
    moved = _numbers(content.get(DISPLACEMENT), (None, None, 3), f"{path}: {DISPLACEMENT}", expected)
    start = _numbers(content.get("Point3D"), (moved.shape[1], 3), f"{path}: Point3D", expected)
    return moved + start


def _numbers(value: Any, shape: tuple[int | None, ...], where: str, expected: str) -> Array:
    try:
        numbers = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        numbers = np.empty(0)
    fits = numbers.ndim == len(shape) and all(
        want in (None, have) for want, have in zip(shape, numbers.shape, strict=True)
    )
    if not fits or numbers.size == 0:
        raise InputError(
            f"{where} is {'not there' if value is None else f'of shape {numbers.shape}'}",
            expected,
            "name the right file",
        )
    return np.where(np.isfinite(numbers), numbers, np.nan)
