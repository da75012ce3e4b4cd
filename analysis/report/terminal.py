"""The answer in a few lines for a terminal: the verdict, the principal parameters with their intervals."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pandas as pd

from analysis.checks.recording import in_words, verdict
from analysis.checks.series import series_checks
from analysis.report.numbers import interval
from analysis.report.parameters import PRINCIPAL, quantity, state, statement
from analysis.report.results import identification_notes
from ovines.tables import read_table


def recording_in_words(out: Path) -> list[str]:
    """The answer of the recording whose results lie in ``out``; nothing where nothing was identified."""
    checks, identification = _table(out, "checks"), _table(out, "identification")
    if checks is None:  # impacts by themselves: there is no motion to check
        return [] if identification is None else parameters_in_words(identification)
    return _answer(checks, identification)


def series_in_words(out: Path, names: Collection[str]) -> list[str]:
    """The answer of the series in ``out``, whose recordings' results lie in its folders ``names``: their checks added
    up, the joint parameters.
    """
    checks = series_checks(
        list(names),
        [_table(out / name, "checks") for name in names],
        [_table(out / name, "identification") for name in names],
        identification_notes(out / "identification.parquet"),
    )
    return _answer(checks, _table(out, "identification")) if len(checks) else []


def _table(folder: Path, name: str) -> pd.DataFrame | None:
    path = folder / f"{name}.parquet"
    return read_table(path, name) if path.is_file() else None


def _answer(checks: pd.DataFrame, identification: pd.DataFrame | None) -> list[str]:
    not_used = verdict(checks)[1]
    return [*in_words(checks), *([] if identification is None else parameters_in_words(identification, not_used))]


def parameters_in_words(identification: pd.DataFrame, not_used: Collection[str] = ()) -> list[str]:
    """A line for each principal parameter of the table ``identification``, and whether it is among those
    ``not_used``.
    """
    rows = {row["parameter"]: row for _, row in identification.iterrows()}
    lines = []
    for name in PRINCIPAL:
        if name not in rows:
            continue
        row, scale, unit = rows[name], quantity(name).scale, quantity(name).unit
        ends = f" (90 %: {interval(scale * row['low'], scale * row['high'], unit)})" if state(row) == "value" else ""
        lines.append(statement(row) + ends + (", not to be used" if name in not_used else ""))
    return lines
