"""CSV of markers, pixels or positions: one row per marker and frame, or one row per frame with a column per coordinate.

    frame,time_s,marker,x_mm,y_mm,z_mm            long; also u_px,v_px,sd_px, with a column camera or without
    frame,time_s,H1_x,H1_y,H1_z,N1_x,...          wide; "H1.x", "H1 x" and "H1_x_mm" too

The unit may stand at the end of a column's name.  An empty cell is a marker not seen.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.importers.reading.cells import numbers, read_cells

EXPECTED = "a CSV file with a header: frame, then marker,x,y,z or a column per marker and coordinate"
NAMES = {"marker", "point", "label", "name", "bodypart", "target"}
FRAMES = {"frame", "frames", "frame#", "frame_number", "image"}
SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
COORDINATE = re.compile(r"(?P<axis>[xyzuv]|[xyz]_sd|sd)(?:_(?P<unit>m|cm|mm|um|in|px))?", re.IGNORECASE)
WIDE = re.compile(r"(?P<marker>.+?)[\s_.:]" + COORDINATE.pattern, re.IGNORECASE)


def read_csv(path: Path) -> tuple[pd.DataFrame, str | None, int, list[str]]:
    """Long rows ``frame, marker``, then ``time_s``, ``camera`` and coordinates (x, y, z, u, v, x_sd, ..., sd) as far as
    there.

    Also the unit in the columns' names (None where there is none), the digits printed after the times' decimal point,
    and the columns that were not used.  Rows in which a coordinate is missing are left out.
    """
    header, rows, lines = read_cells(path, EXPECTED)
    plain = [name.lower() for name in header]
    frame = next((i for i, name in enumerate(plain) if name in FRAMES), None)
    if frame is None:
        raise InputError(
            f"{path}: no column frame (there are: {', '.join(header)[:200]})", EXPECTED, "add a column frame, from 0"
        )
    time = next((i for i, name in enumerate(plain) if re.fullmatch(r"(time|t)(_(s|ms|us))?", name)), None)
    found = pd.DataFrame({"frame": _whole(numbers(rows, lines, frame, path), lines, path)})
    decimals = 0
    if time is not None:
        scale = SECONDS[plain[time].rpartition("_")[2] if "_" in plain[time] else "s"]
        found["time_s"] = numbers(rows, lines, time, path) * scale
        decimals = max((len(row[time].partition(".")[2]) for row in rows), default=0) - round(np.log10(scale))
    name = next((i for i, one in enumerate(plain) if one in NAMES), None)
    camera = next((i for i, one in enumerate(plain) if one == "camera"), None)
    if camera is not None:
        found["camera"] = [row[camera] for row in rows]
    used = {i for i in (frame, time, name, camera) if i is not None}
    pattern = WIDE if name is None else COORDINATE
    columns = {i: match for i, one in enumerate(header) if i not in used and (match := pattern.fullmatch(one))}
    units = {match["unit"].lower() for match in columns.values() if match["unit"]}
    if len(units - {"px"}) > 1 or ("px" in units and len(units) > 1):
        raise InputError(f"{path}: columns in {' and '.join(sorted(units))}", "one unit", "convert the columns to one")
    read = {i: numbers(rows, lines, i, path) for i in columns}
    if name is not None:
        long = found.assign(
            marker=[row[name] for row in rows], **{columns[i]["axis"].lower(): values for i, values in read.items()}
        )
    else:
        markers = list(dict.fromkeys(match["marker"] for match in columns.values()))
        long = pd.concat(
            [
                found.assign(
                    marker=marker,
                    **{
                        columns[i]["axis"].lower(): values
                        for i, values in read.items()
                        if columns[i]["marker"] == marker
                    },
                )
                for marker in markers
            ]
            or [found]
        )
    coordinates = [axis for axis in ("x", "y", "z", "u", "v") if axis in long.columns]
    if not coordinates:
        raise InputError(
            f"{path}: no coordinates (columns: {', '.join(header)[:200]})", EXPECTED, "name the columns so"
        )
    unused = [one for i, one in enumerate(header) if i not in used and i not in columns]
    long = long[np.isfinite(long[coordinates].to_numpy(float)).all(1)]
    return long.reset_index(drop=True), next(iter(units), None), decimals, unused


def _whole(values: np.ndarray, lines: list[int], path: Path) -> np.ndarray:
    broken = ~np.isfinite(values) | (values != np.round(values)) | (values < 0) | (values > 2**53)
    if broken.any():
        raise InputError(
            f"{path}, line {lines[int(broken.argmax())]}: frame {values[broken][0]}",
            "whole frame numbers from 0",
            "correct that cell",
        )
    return values.astype(np.int64)
