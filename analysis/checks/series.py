"""Checks of a series: those of its runs added up, and whether the runs agree on each parameter."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis.checks.recording import summed
from analysis.checks.row import COLUMNS, DIAGNOSE, PRINCIPAL, row
from analysis.identify import FORCE_SAID
from analysis.statistics.trend import Trend, weighted_trend

# Four parameters are looked at; 0.01 each keeps a false alarm over all of them below 4 %.
AGREEMENT_P = 0.01
#: how a note says that a joint parameter is wider than a run's own
LESS_SURE = "is less sure than from"


def series_checks(
    names: Sequence[str],
    checks: Sequence[pd.DataFrame | None],
    identifications: Sequence[pd.DataFrame | None],
    notes: Sequence[str] = (),
) -> pd.DataFrame:
    """Table ``checks`` of the runs called ``names``; a run that was not identified (None) is not in it.  ``notes`` of
    the joint identification.
    """
    checked = [(name, table) for name, table in zip(names, checks, strict=True) if table is not None and len(table)]
    if not checked:
        return pd.DataFrame(columns=list(COLUMNS))
    added = summed([table for _, table in checked], [name for name, _ in checked])
    return pd.concat([added, agreement(trends(identifications)), one_law(notes)], ignore_index=True)


def one_law(notes: Sequence[str]) -> pd.DataFrame:
    """A row on whether one law of flight does for all runs together, as the joint identification noted."""
    said = [note for note in notes if note.startswith(FORCE_SAID) or LESS_SURE in note]
    words = " ".join(note.split(":")[0] + "." for note in said) or "One law of flight does for all runs."
    one = row(
        "one law for all runs",
        float(len(said)),
        0.0,
        not said,
        words,
        "floor_friction",
        f"{DIAGNOSE}; a law that is missing pulls each run its own way.",
    )
    return pd.DataFrame([one], columns=list(COLUMNS))


def trends(identifications: Sequence[pd.DataFrame | None]) -> dict[str, Trend]:
    """Mean, trend and scatter over the runs of each principal parameter that two or more determine."""
    found = {}
    for name in PRINCIPAL:
        values = np.array([_value(table, name) for table in identifications]).reshape(-1, 2)
        found[name] = weighted_trend(np.arange(1, len(values) + 1), *values.T)
    return {name: trend for name, trend in found.items() if trend is not None}


def _value(table: pd.DataFrame | None, name: str) -> tuple[float, float]:
    one = None if table is None else table[table["parameter"] == name]
    if one is None or not len(one):
        return np.nan, np.nan
    return float(one["value"].astype(float).iloc[0]), float(one["sd"].astype(float).iloc[0])


def agreement(over_runs: Mapping[str, Trend]) -> pd.DataFrame:
    """Rows on whether the runs scatter about one value no more than their sds let them."""
    rows = []
    for name, trend in over_runs.items():
        words = (
            f"{trend.n} runs scatter about one {name.replace('_', ' ')} as chance lets them with p = "
            f"{trend.p_scatter:.2g}."
        )
        rows.append(
            row(
                f"agreement of the runs on {name.replace('_', ' ')}",
                trend.p_scatter,
                AGREEMENT_P,
                bool(trend.p_scatter > AGREEMENT_P),
                words,
                name,
                f"{DIAGNOSE}; a law that is missing pulls each run its own way.",
            )
        )
    return pd.DataFrame(rows, columns=list(COLUMNS))
