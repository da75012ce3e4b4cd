"""Impacts measured elsewhere: a CSV with the columns of the table ``impacts``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd

from ovines.errors import InputError
from ovines.importers.reading.cells import numbers, read_cells
from ovines.tables import TABLES

EXPECTED = "a CSV file with a header: normal_speed_before_m_per_s,normal_speed_after_m_per_s, ..."
NEEDED = ("normal_speed_before_m_per_s", "normal_speed_after_m_per_s")


def read_impacts(path: Path) -> tuple[pd.DataFrame, list[str]]:
    """Table ``given_impacts`` of a CSV, one row per impact, and notes; an empty cell is not known.

    Without a column ``impact`` the rows are numbered as they stand.
    """
    header, rows, lines = read_cells(path, EXPECTED)
    declared = {column.name: column for column in TABLES["given_impacts"].columns}
    missing = [name for name in NEEDED if name not in header]
    if missing:
        raise InputError(
            f"{path}: no column {', '.join(missing)} (there are: {', '.join(header)[:200]})",
            "speeds of the contact point against the wall: " + ", ".join(NEEDED),
            "name the columns so, in m/s; towards the wall before, away from it after, both positive",
        )
    table = pd.DataFrame(index=range(len(rows)))
    for i, name in enumerate(header):
        if name not in declared:
            continue
        if declared[name].type == "str":
            table[name] = pd.Series([row[i] or None for row in rows], dtype=object)
        else:
            table[name] = numbers(rows, lines, i, path)
    if "impact" not in table:
        table.insert(0, "impact", np.arange(len(table)))
    elif not np.array_equal(table["impact"], np.round(table["impact"])):
        raise InputError(f"{path}: numbers of impacts that are not whole", "0, 1, 2, ...", "correct the column impact")
    table["impact"] = table["impact"].astype("int64")
    unused = [name for name in header if name not in declared]
    return table, [f"{path.name}: not used: {', '.join(unused)}"] if unused else []
