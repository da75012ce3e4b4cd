"""Which foreign point is which marker: by the user's list in the file's order, or by the file's own names."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.recording import Recording

Array = NDArray[np.float64]
LEFT_OUT = "-"


def numbered(
    values: Array, axes: tuple[str, ...], markers: Sequence[str] | None, recording: Recording, path: Path
) -> pd.DataFrame:
    """Rows of an array (frames, points, axes) whose points carry no names; NaN is no row."""
    frames, points = values.shape[:2]
    if markers is None:
        known = ", ".join(recording.markers) or "none yet"
        raise InputError(
            f"{path}: {points} points without names",
            f"--markers with {points} names, in the order in which they were clicked",
            f"recording.toml has {known}; write - for a point to leave out",
        )
    if len(markers) != points:
        raise InputError(
            f"--markers has {len(markers)} names, {path} has {points} points",
            "a name for each, - for one to leave out",
            "correct --markers",
        )
    rows = pd.DataFrame(
        {
            "frame": np.repeat(np.arange(frames), points),
            "marker": list(markers) * frames,
            **{axis: values[..., i].ravel() for i, axis in enumerate(axes)},
        }
    )
    good = np.isfinite(rows[list(axes)].to_numpy(float)).all(1) & (rows["marker"] != LEFT_OUT).to_numpy()
    return rows[good].reset_index(drop=True)


def renamed(rows: pd.DataFrame, markers: Sequence[str] | None, path: Path) -> pd.DataFrame:
    """The file's own names replaced by ``markers`` in order of appearance, where they are given."""
    own = list(dict.fromkeys(rows["marker"]))
    if markers is None:
        return rows.copy()
    if len(markers) != len(own):
        raise InputError(
            f"--markers has {len(markers)} names, {path} has {len(own)}: {', '.join(own)}",
            "a name for each, - for one to leave out",
            "correct --markers",
        )
    rows = rows.assign(marker=rows["marker"].map(dict(zip(own, markers, strict=True))))
    return rows[rows["marker"] != LEFT_OUT].copy()


def of_known_markers(rows: pd.DataFrame, recording: Recording, notes: list[str]) -> pd.DataFrame:
    """Rows of the markers that recording.toml knows; the others are noted, none at all is refused."""
    if not recording.markers:
        return rows
    own = list(dict.fromkeys(rows["marker"]))
    strangers = [name for name in own if name not in recording.markers]
    if len(strangers) == len(own):
        raise InputError(
            f"markers {', '.join(own)}",
            f"names of recording.toml: {', '.join(recording.markers)}",
            "give them by --markers in the file's order, or correct recording.toml",
        )
    if strangers:
        notes.append(f"left out: {', '.join(strangers)}, of which recording.toml knows nothing")
    absent = [name for name in recording.markers if name not in own]
    if absent:
        notes.append(f"not in the file: {', '.join(absent)}")
    return rows[rows["marker"].isin(recording.markers)].reset_index(drop=True)
