"""What a foreign file leaves open and the user declares: unit, axes, what exact zeros mean."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError

Array = NDArray[np.float64]
METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
AS_THEY_ARE = "x,y,z"
# OpenCV's board and camera frames look away from the cameras; the world here looks towards them.
BOARD_AXES = "x,-y,-z"


def metres(unit: str | None, from_file: str | None, what: str) -> float:
    """Metres per unit: the file's own where it says one, else the declared one; `InputError` when neither or both
    differ.
    """
    if from_file is not None and from_file not in METRES:
        raise InputError(
            f"{what}: unit {from_file!r}", f"one of {', '.join(METRES)}", "write the file in one of these units"
        )
    if unit is not None and from_file is not None and METRES[unit] != METRES[from_file]:
        raise InputError(
            f"{what} is in {from_file}, --unit says {unit}", "one unit", "leave --unit out, or correct the file"
        )
    known = from_file or unit
    if known is None:
        raise InputError(
            f"{what} does not say its unit of length",
            f"--unit with one of {', '.join(METRES)}",
            "add it: a file of millimetres read as metres would give a ring of 50 m",
        )
    return METRES[known]


def turn(axes: str) -> Array:
    """World from file, (3, 3): ``x,-z,y`` means world x = file x, world y = -file z, world z = file y."""
    rows, parts = np.zeros((3, 3)), [part.strip().lower() for part in axes.split(",")]
    for row, part in enumerate(parts[:3]):
        if re.fullmatch(r"[+-]?[xyz]", part):
            rows[row, "xyz".index(part[-1])] = -1.0 if part[0] == "-" else 1.0
    if len(parts) != 3 or (np.abs(rows).sum(0) != 1).any() or (np.abs(rows).sum(1) != 1).any():
        raise InputError(
            f"--axes {axes}",
            "the file's axes in the order of the world's x, y, z, e.g. x,-z,y",
            "name each of x, y, z once",
        )
    if np.linalg.det(rows) < 0:
        raise InputError(
            f"--axes {axes} mirrors the world",
            "a right-handed frame (z up, towards the cameras)",
            "change the sign of one axis, or exchange two",
        )
    return rows


def without_zeros(frame: pd.DataFrame, columns: list[str], zeros: str | None, what: str) -> pd.DataFrame:
    """Rows whose coordinates are all exactly 0 dropped or kept as ``zeros`` ("missing" or "points") says; asked for if
    not said.
    """
    exact = (frame[columns] == 0).all(axis=1).to_numpy()
    if not exact.any() or zeros == "points":
        return frame
    if zeros is None:
        first = frame[exact].iloc[0]
        raise InputError(
            f"{what}: {int(exact.sum())} positions are exactly 0, first {first['marker']} in frame {first['frame']}",
            "empty cells where a marker was not seen",
            "say --zeros missing if 0 stands for not seen, --zeros points if it is a place",
        )
    return frame[~exact]


def times_on_grid(times_s: Array, frames: Array, decimals: int, rate_hz: float | None) -> Array:
    """Printed times, without the rounding of print where they are a rate's grid.

    800 frames per second printed to a millisecond jitter by half of one, which would be read as velocity. Times that
    agree with ``frames / rate_hz`` (plus a constant) to within their last printed digit are put on it; others stay.
    """
    if rate_hz is None or not np.isfinite(times_s).all() or not len(times_s):
        return times_s
    grid, half = frames / rate_hz, 0.5 * 10.0**-decimals * (1 + 1e-6) + 1e-12
    off = times_s - grid
    if np.ptp(off) > 2 * half:
        return times_s
    shift = 0.0 if np.abs(off).max() <= half else 0.5 * (float(off.max()) + float(off.min()))
    return np.asarray(grid + shift)
