"""Sensitivities, sections, branches of orbits and basins as tables."""

from __future__ import annotations

import numpy as np
import pandas as pd

from ovines.core.orbits.lyapunov import Lyapunov
from ovines.core.orbits.periodic import Branch
from ovines.core.orbits.section import Basins
from ovines.core.sensitivity.run import STATES, Sensitivities


def sensitivity_table(found: Sensitivities) -> pd.DataFrame:
    """``sensitivities.parquet``: a row per instant or impact, state and name."""
    n, m, k = len(found.time_s), len(found.names), len(found.impact_time_s)
    states = pd.DataFrame(
        {
            "time_s": np.repeat(found.time_s, len(STATES) * m),
            "of": np.tile(np.repeat(STATES, m), n),
            "by": np.tile(found.names, n * len(STATES)),
            "derivative": found.by.ravel(),
        }
    )
    impacts = pd.DataFrame(
        {
            "time_s": np.repeat(found.impact_time_s, m),
            "of": "impact_time_s",
            "by": np.tile(found.names, k),
            "derivative": found.impact_time_by.ravel(),
        }
    )
    return pd.concat([states, impacts], ignore_index=True)


def lyapunov_table(found: Lyapunov) -> pd.DataFrame:
    """``lyapunov.parquet``: a row per exponent, the largest first."""
    return pd.DataFrame(
        {
            "exponent": np.arange(len(found.exponents_per_s)),
            "value_per_s": found.exponents_per_s,
            "sd_per_s": found.sd_per_s,
            "impacts_per_s": found.impacts_per_s,
        }
    )


def section_table(states: np.ndarray, over: str | None = None, values: np.ndarray | None = None) -> pd.DataFrame:
    """``section.parquet``: a row per state of a section (runs, periods, 12), with the number that a run has."""
    runs, periods = states.shape[:2]
    table = pd.DataFrame({"run": np.repeat(np.arange(runs), periods), "period": np.tile(np.arange(periods), runs)})
    table["parameter"] = pd.Series([over] * len(table), dtype=object)
    table["value"] = np.nan if values is None else np.repeat(values, periods)
    return table.join(pd.DataFrame(states.reshape(-1, 12), columns=list(STATES)))


def branch_table(branch: Branch) -> pd.DataFrame:
    """``orbits.parquet``: a row per orbit along the curve."""
    rows = []
    for number, orbit in enumerate(branch.orbits):
        speeds = orbit.impact_speed_m_per_s
        rows.append(
            {
                "orbit": number, "parameter": branch.over, "value": orbit.value, "period_s": orbit.period_s,
                "stable": orbit.stable, "multiplier": float(np.max(np.abs(orbit.multipliers))),
                "multiplier_angle_rad": float(np.abs(np.angle(orbit.multipliers[0]))),
                "impacts": len(speeds), "fastest_impact_m_per_s": float(np.max(speeds)) if len(speeds) else np.nan,
            }
            | dict(zip(STATES, orbit.state, strict=True))
        )  # fmt: skip
    return pd.DataFrame(rows)


def basin_table(found: Basins) -> pd.DataFrame:
    """``basins.parquet``: a row per start of the map; the attractor is null outside the walls."""
    x, y = np.meshgrid(found.x[1], found.y[1])
    labels = found.labels.ravel()
    inside = labels >= 0
    kinds = found.attractors
    table = pd.DataFrame({"parameter": found.x[0], "value": x.ravel(), "other_parameter": found.y[0]})
    table["other_value"] = y.ravel()
    table["attractor"] = pd.array(np.where(inside, labels, 0), dtype="Int64")
    table.loc[~inside, "attractor"] = pd.NA
    for name in ("period", "impacts"):
        values = np.array([getattr(one, name) for one in kinds], dtype=float)
        table[f"attractor_{name}"] = np.where(inside, values[np.maximum(labels, 0)], np.nan)
    return table
