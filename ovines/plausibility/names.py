"""names.csv: which marker is where in the first frame, for bodies without a layout."""

from __future__ import annotations

import csv
import math
from pathlib import Path

import pandas as pd

from ovines.errors import InputError
from ovines.recording import Recording

HEADER = ["camera", "marker", "u_px", "v_px"]


def read_names(path: Path, recording: Recording) -> pd.DataFrame:
    """Rows camera, marker, u_px, v_px (window pixels), each camera and marker known and each pair once."""
    known = {"camera": {camera.name for camera in recording.cameras}, "marker": set(recording.markers)}
    rows: dict[tuple[str, str], tuple[float, float]] = {}
    try:
        with open(path, newline="", encoding="utf-8-sig") as handle:
            reader = csv.DictReader(handle, skipinitialspace=True)
            if reader.fieldnames is None or not set(HEADER) <= set(reader.fieldnames):
                raise InputError(f"{path}: header {reader.fieldnames}", ",".join(HEADER), "write that header")
            for row in reader:
                where = f"{path}, line {reader.line_num}"
                for column, names in known.items():
                    if row[column] not in names:
                        raise InputError(
                            f"{where}: {column} {row[column]!r}",
                            f"one of {', '.join(sorted(names))}",
                            "correct the name",
                        )
                if (row["camera"], row["marker"]) in rows:
                    raise InputError(f"{where}: {row['marker']} of {row['camera']} again", "each once", "remove one")
                rows[row["camera"], row["marker"]] = (_pixel(row["u_px"], where), _pixel(row["v_px"], where))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: {error}", "a CSV file with " + ",".join(HEADER), "check the path") from None
    if not rows:
        raise InputError(f"{path}: no rows", "one row per camera and marker", "add them")
    return pd.DataFrame([(*names, *pixels) for names, pixels in rows.items()], columns=HEADER)


def _pixel(text: str | None, where: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{where}: {text!r} for a pixel", "a finite number", "correct it")
    return value
