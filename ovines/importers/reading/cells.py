"""The cells of a CSV file, whatever its delimiter and decimal sign."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np

from ovines.errors import InputError
from ovines.importers.reading.files import read_text

MISSING = {"", "nan", "na", "n/a", "null", "none", "-"}


def read_cells(path: Path, expected: str) -> tuple[list[str], list[list[str]], list[int]]:
    """Header, rows of stripped cells, and the line each row stands in; `InputError` says what was ``expected``."""
    text = "\n".join("" if line.startswith("#") else line for line in read_text(path, expected).splitlines())
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
        raise InputError(f"{path}, line {reader.line_num}: {error}", expected, "correct the line") from None
    if header and header[0].lower() == "scorer":
        raise InputError(
            f"{path}: a header of several lines (scorer, bodyparts, coords)",
            expected,
            "write it with one line of names, e.g. H1_u,H1_v",
        )
    if not rows:
        raise InputError(f"{path} has no rows", expected, "check the file")
    return header, rows, lines


def numbers(rows: list[list[str]], lines: list[int], column: int, path: Path) -> np.ndarray:
    """One column (n,) of the cells; NaN where nothing stands."""
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
