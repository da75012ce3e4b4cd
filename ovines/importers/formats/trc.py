"""TRC ("track row column"): marker positions as OpenSim and most motion-capture programs write them.

Three lines of header, names of the markers, names of the coordinates, then one line per frame: number, time,
x, y, z of each marker, separated by tabs.  A marker not seen is three empty cells.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.importers.reading.declared import times_on_grid
from ovines.importers.reading.files import read_text

EXPECTED = "a TRC file: PathFileType, header, Frame# Time and markers, then rows separated by tabs"


def read_trc(path: Path) -> tuple[pd.DataFrame, str | None]:
    """Rows ``frame, time_s, marker, x, y, z`` in the file's unit (missing ones left out), and that unit.

    TRC numbers frames from 1, the tables here from 0.  Times that are the header's DataRate within their printed
    digits are put on it (see `ovines.importers.reading.declared.times_on_grid`).
    """
    lines = read_text(path, EXPECTED).splitlines()
    if len(lines) < 6 or not lines[0].lower().startswith("pathfiletype"):
        raise InputError(f"{path} does not begin with PathFileType", EXPECTED, "export it again as TRC")
    header = dict(
        zip(
            (key.lower() for key in re.split(r"\s+", lines[1].strip())),
            re.split(r"\s+", lines[2].strip()),
            strict=False,
        )
    )
    names = [name.strip() for name in _cells(lines[3])[2:] if name.strip()]
    if not names or len(set(names)) < len(names):
        raise InputError(
            f"{path}, line 4: markers {', '.join(names) or 'none'}", "each marker's name once", "correct that line"
        )
    if header.get("nummarkers", str(len(names))) != str(len(names)):
        raise InputError(
            f"{path}: {len(names)} names in line 4, NumMarkers is {header['nummarkers']}",
            "as many names as markers",
            "correct the header",
        )
    frames, times, decimals, values = [], [], 0, []
    for number, line in enumerate(lines[5:], 6):
        if not line.strip():
            continue
        cells = _cells(line)
        if len(cells) > 2 + 3 * len(names) and any(cell.strip() for cell in cells[2 + 3 * len(names) :]):
            raise InputError(
                f"{path}, line {number}: {len(cells)} cells",
                f"{2 + 3 * len(names)} for {len(names)} markers",
                "export it again",
            )
        if "\t" not in line and len(cells) != 2 + 3 * len(names):
            raise InputError(
                f"{path}, line {number}: {len(cells)} numbers separated by spaces",
                f"{2 + 3 * len(names)}, or tabs, which keep the place of a marker not seen",
                "export it with tabs",
            )
        cells = (cells + [""] * (2 + 3 * len(names)))[: 2 + 3 * len(names)]
        row = [_number(cell, path, number) for cell in cells]
        if not np.isfinite(row[:2]).all() or row[0] != round(row[0]):
            raise InputError(
                f"{path}, line {number}: frame {cells[0]!r} at {cells[1]!r}",
                "a whole frame number and a time",
                "correct the line",
            )
        decimals = max(decimals, len(cells[1].strip().partition(".")[2]))
        frames.append(int(row[0]) - 1)
        times.append(row[1])
        values.append(row[2:])
    if not values:
        raise InputError(f"{path} has no rows", EXPECTED, "export it again")
    rate = _positive(header.get("datarate"))
    times_s = times_on_grid(np.array(times), np.array(frames, float), decimals, rate)
    xyz = np.array(values).reshape(-1, len(names), 3).reshape(-1, 3)
    rows = pd.DataFrame(
        {
            "frame": np.repeat(frames, len(names)),
            "time_s": np.repeat(times_s, len(names)),
            "marker": names * len(frames),
            **{axis: xyz[:, i] for i, axis in enumerate("xyz")},
        }
    )
    return rows[np.isfinite(xyz).all(1)].reset_index(drop=True), _unit(header.get("units"))


def _cells(line: str) -> list[str]:
    return line.split("\t") if "\t" in line else line.split()


def _number(cell: str, path: Path, line: int) -> float:
    text = cell.strip()
    if text == "" or text.lower() in ("nan", "na", "null"):
        return float("nan")
    try:
        value = float(text)
        if np.isinf(value):
            raise ValueError("infinite")
        return value
    except ValueError:
        raise InputError(
            f"{path}, line {line}: {text[:40]!r}",
            "a number, or nothing where a marker was not seen",
            "correct that cell",
        ) from None


def _positive(text: str | None) -> float | None:
    try:
        value = float(text or "nan")
    except ValueError:
        return None
    return value if np.isfinite(value) and value > 0 else None


def _unit(text: str | None) -> str | None:
    if text is None:
        return None
    plain = text.lower().strip("()[]")
    return {"meters": "m", "metres": "m", "millimeters": "mm", "millimetres": "mm", "inches": "in"}.get(plain, plain)
