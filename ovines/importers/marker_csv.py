"""CSV of markers, pixels or positions: one row per marker and frame, or one row per frame with a column per coordinate.

    frame,time_s,marker,x_mm,y_mm,z_mm            long; also u_px,v_px,sd_px, with a column camera or without
    frame,time_s,H1_x,H1_y,H1_z,N1_x,...          wide; "H1.x", "H1 x" and "H1_x_mm" too

The unit may stand at the end of a column's name.  An empty cell is a marker not seen.
"""

from __future__ import annotations

import csv
import io
import re
from pathlib import Path

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.importers.files import read_text

EXPECTED = "a CSV file with a header: frame, then marker,x,y,z or a column per marker and coordinate"
MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}
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
    header, rows, lines = _table(path)
    plain = [name.lower() for name in header]
    frame = next((i for i, name in enumerate(plain) if name in FRAMES), None)
    if frame is None:
        raise InputError(
            f"{path}: no column frame (there are: {', '.join(header)[:200]})", EXPECTED, "add a column frame, from 0"
        )
    time = next((i for i, name in enumerate(plain) if re.fullmatch(r"(time|t)(_(s|ms|us))?", name)), None)
    found = pd.DataFrame({"frame": _whole(_numbers(rows, lines, frame, path), lines, path)})
    decimals = 0
    if time is not None:
        scale = SECONDS[plain[time].rpartition("_")[2] if "_" in plain[time] else "s"]
        found["time_s"] = _numbers(rows, lines, time, path) * scale
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
    read = {i: _numbers(rows, lines, i, path) for i in columns}
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


def _table(path: Path) -> tuple[list[str], list[list[str]], list[int]]:
    """Header, rows of stripped cells, and the line each row stands in."""
    text = "\n".join("" if line.startswith("#") else line for line in read_text(path, EXPECTED).splitlines())
    first = next((line for line in text.splitlines() if line.strip()), "")
    delimiter = max(",;\t", key=first.count)
    reader = csv.reader(io.StringIO(text), delimiter=delimiter)
    header: list[str] = []
    rows, lines = [], []
    try:
        for cells in reader:
            cells = [cell.strip() for cell in cells]
            if not any(cells):
                continue
            if not header:
                header = cells
                continue
            if len(cells) != len(header):
                raise InputError(
                    f"{path}, line {reader.line_num}: {len(cells)} cells",
                    f"{len(header)}, as in the header",
                    "correct the line",
                )
            rows.append([cell.replace(",", ".") for cell in cells] if delimiter == ";" else cells)
            lines.append(reader.line_num)
    except csv.Error as error:
        raise InputError(f"{path}, line {reader.line_num}: {error}", EXPECTED, "correct the line") from None
    if header and header[0].lower() == "scorer":
        raise InputError(
            f"{path}: a header of several lines (scorer, bodyparts, coords)",
            EXPECTED,
            "write it with one line of names, e.g. H1_u,H1_v",
        )
    if not rows:
        raise InputError(f"{path} has no rows", EXPECTED, "check the file")
    return header, rows, lines


def _numbers(rows: list[list[str]], lines: list[int], column: int, path: Path) -> np.ndarray:
    values = np.full(len(rows), np.nan)
    for i, row in enumerate(rows):
        if row[column].lower() not in MISSING:
            try:
                values[i] = float(row[column])
            except ValueError:
                raise InputError(
                    f"{path}, line {lines[i]}: {row[column][:40]!r}",
                    "a number, or nothing where a marker was not seen",
                    "correct that cell",
                ) from None
            if not np.isfinite(values[i]):
                raise InputError(
                    f"{path}, line {lines[i]}: {row[column][:40]!r}",
                    "a finite number, or nothing where a marker was not seen",
                    "correct that cell, or leave it empty",
                )
    return values


def _whole(values: np.ndarray, lines: list[int], path: Path) -> np.ndarray:
    broken = ~np.isfinite(values) | (values != np.round(values)) | (values < 0) | (values > 2**53)
    if broken.any():
        raise InputError(
            f"{path}, line {lines[int(broken.argmax())]}: frame {values[broken][0]}",
            "whole frame numbers from 0",
            "correct that cell",
        )
    return values.astype(np.int64)
