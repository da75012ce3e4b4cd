"""The disk's path by itself: a CSV of any program, its columns named by whoever brings it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError
from ovines.importers.reading.cells import numbers, read_cells
from ovines.importers.reading.declared import METRES, metres, times_on_grid
from ovines.recording import Recording

Array = NDArray[np.float64]
EXPECTED = "a CSV file with a header and a row per frame"
# Names of --columns, and the columns of table motion that they stand for.
LENGTHS = {"x": "nes_x_m", "y": "nes_y_m", "z": "nes_z_m"}
LENGTHS |= {f"host_{axis}": f"host_{axis}_m" for axis in "xyz"}
LENGTHS |= {f"{axis}_sd": f"nes_{axis}_sd_m" for axis in "xyz"}
ANGLES = {"angle": "nes_angle_rad", "host_angle": "host_angle_rad", "angle_sd": "nes_angle_sd_rad"}
NAMES = (*LENGTHS, *ANGLES, "t", "frame")
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
RADIANS = {"rad": 1.0, "deg": np.pi / 180.0}


def read_motion(
    path: Path, columns: str | None, unit: str | None, recording: Recording
) -> tuple[pd.DataFrame, list[str]]:
    """Table ``motion`` of a CSV, and notes.

    ``columns``: ``x=...,y=...,t=...`` as ``--columns`` takes it; without it the names themselves.  A column that ends
    in its unit (``x_mm``, ``time_ms``, ``angle_deg``) says it; lengths of none are in ``unit``, times in s, angles in
    rad.
    Without times the frame rate of recording.toml counts; without frames the rows do.
    """
    header, rows, lines = read_cells(path, EXPECTED)
    where = _columns(columns, header, path)
    table, notes = pd.DataFrame(index=range(len(rows))), []
    for name, at in where.items():
        values, ending = numbers(rows, lines, at, path), header[at].rpartition("_")[2].lower()
        if name in LENGTHS:
            table[LENGTHS[name]] = values * metres(unit, ending if ending in METRES else None, f"{path}: {header[at]}")
        elif name in ANGLES:
            table[ANGLES[name]] = values * RADIANS.get(ending, 1.0)
    frames = numbers(rows, lines, where["frame"], path) if "frame" in where else np.arange(len(rows), dtype=float)
    if not np.array_equal(frames, np.round(frames)):
        raise InputError(f"{path}: frames that are not whole numbers", "0, 1, 2, ...", "correct --columns frame=...")
    table.insert(0, "frame", frames.astype(np.int64))
    if "t" in where:
        scale = SECONDS.get(header[where["t"]].rpartition("_")[2].lower(), 1.0)
        decimals = max(len(row[where["t"]].partition(".")[2]) for row in rows) - round(np.log10(scale))
        times_s = scale * numbers(rows, lines, where["t"], path)
        table.insert(1, "time_s", times_on_grid(times_s, table["frame"].to_numpy(), decimals, recording.frame_rate_hz))
    else:
        table.insert(1, "time_s", recording.times_s(table["frame"].to_numpy()))
    for name in ("nes_angle_rad", "host_angle_rad"):
        if name in table:
            table[name] = _unwrapped(table[name].to_numpy(float))
    for body in ("nes", "host"):
        for axis in "xyz":
            if f"{body}_{axis}_m" not in table:
                table[f"{body}_{axis}_m"] = np.nan
    if "angle" not in where:
        notes.append("no angle: of the contact law only the restitution can be identified")
    if "host_x" not in where:
        notes.append("no place of the Host: it is taken to stand still at the origin, from which x and y count")
    return table, notes


def _columns(columns: str | None, header: list[str], path: Path) -> dict[str, int]:
    """Column of the file by name of --columns."""
    said = f"columns: {', '.join(header)[:200]}"
    if columns is None:
        wanted = {name: name for name in NAMES if name in header}
    else:
        wanted = {}
        for part in columns.split(","):
            name, equals, column = (one.strip() for one in part.partition("="))
            if not equals or name not in NAMES:
                raise InputError(
                    f"--columns {part.strip()!r}", f"NAME=COLUMN with one of {', '.join(NAMES)}", "correct it"
                )
            if name in wanted:
                raise InputError(f"--columns names {name} twice", "each once", "correct it")
            wanted[name] = column
    missing = [column for column in wanted.values() if column not in header]
    if missing:
        raise InputError(f"{path}: no column {', '.join(missing)}", said, "correct --columns")
    lacking = [name for name in ("x", "y") if name not in wanted]
    if lacking:
        raise InputError(
            f"{path}: no {' and no '.join(lacking)} ({said})",
            "where x and y of the disk stand",
            "say it: --columns x=COLUMN,y=COLUMN,t=COLUMN,angle=COLUMN",
        )
    return {name: header.index(column) for name, column in wanted.items()}


def _unwrapped(angle_rad: Array) -> Array:
    """Angles without the jumps of a full turn; unseen ones stay so."""
    out, seen = angle_rad.copy(), np.isfinite(angle_rad)
    out[seen] = np.unwrap(angle_rad[seen])
    return out
