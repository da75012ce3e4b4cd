"""A simulation as tables: the columns of the measured ones, so that both are read alike."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.core import Scenario, SimulationResult
from ovines.core.system.named import NAMED
from ovines.errors import InputError
from ovines.io.provenance import sha256_of
from ovines.scenario import checked_scenario, read_scenario
from ovines.tables import write_table

WRITES = ("simulation", "simulated_impacts", "contact")
IMPACT_TEXT = ("stick", "slide")


def find(name: str, out: Path | None) -> tuple[Scenario, dict[str, str], Path]:
    """The scenario of a file or a name, the hash of its source, and the output folder."""
    if name in NAMED and not Path(name).is_file():
        scenario = checked_scenario(NAMED[name].make, name)
        digest = hashlib.sha256(repr(scenario).encode()).hexdigest()
        return scenario, {name: digest}, out or Path("results") / name
    path = Path(name)
    if path.suffix != ".toml" and not path.is_file():
        raise InputError(f"{name!r} is neither a file nor a known name", "a scenario.toml or a name of --list",
                         "see ovines simulate --list")  # fmt: skip
    scenario = read_scenario(path)
    return scenario, {path.name: sha256_of(path)}, out or path.parent / "results"


def write_result(result: SimulationResult, out: Path, record: dict[str, Any]) -> None:
    """``simulation.parquet``, ``simulated_impacts.parquet``, ``contact.parquet`` into ``out``."""
    contacts = pd.DataFrame(result.contacts, columns=["start_s", "end_s"])
    for name, table in zip(WRITES, (motion_table(result), impact_table(result), contacts), strict=True):
        write_table(table, name, out / f"{name}.parquet", record)


def motion_table(result: SimulationResult) -> pd.DataFrame:
    """Samples in the columns of ``motion.parquet``; rows after a stopped run's end have times only."""
    frame = pd.DataFrame({"frame": np.arange(len(result.time_s)), "time_s": result.time_s})
    return pd.concat([frame, pd.DataFrame(result.motion)], axis=1)


def impact_table(result: SimulationResult) -> pd.DataFrame:
    """Exact impacts in the columns of ``impacts.parquet``: what an impact does not inform is missing."""
    impacts = result.impacts
    n = len(impacts)
    stuck = impacts["stuck"] > 0.5
    slip = impacts["tangential_speed_before_m_per_s"]
    turned = np.full(n, np.nan)
    ok = stuck & (np.abs(slip) > 0.0)
    turned[ok] = -impacts["tangential_speed_after_m_per_s"][ok] / slip[ok]
    same = [
        "time_s", "azimuth_rad", "normal_speed_before_m_per_s", "normal_speed_after_m_per_s",
        "tangential_speed_before_m_per_s", "tangential_speed_after_m_per_s", "spin_before_rad_per_s",
        "spin_after_rad_per_s",
    ]  # fmt: skip
    frame = pd.DataFrame({name: np.asarray(impacts[name], dtype=float) for name in same})
    # speeds are positive towards the wall inside the engine; the table has the size of the rebound
    frame["normal_speed_after_m_per_s"] = -frame["normal_speed_after_m_per_s"]
    frame.insert(0, "impact", np.arange(n))
    frame["time_sd_s"] = 0.0
    frame["restitution"] = frame["normal_speed_after_m_per_s"] / frame["normal_speed_before_m_per_s"]
    frame["restitution_sd"] = 0.0
    frame["tangential_restitution"] = turned
    frame["wall_friction"] = np.where(stuck, np.nan, result.scenario.impact.wall_friction)
    frame["regime"] = [IMPACT_TEXT[0] if value else IMPACT_TEXT[1] for value in stuck]
    return frame


def summary(result: SimulationResult, out: Path) -> str:
    """What a run gave, in one paragraph."""
    seconds = float(np.sum(result.contacts[:, 1] - result.contacts[:, 0]))
    return (
        f"{result.scenario.name}: {result.end_s:.6g} s, {len(result.impacts)} impacts, {len(result.contacts)} "
        f"sustained "
        f"contacts ({seconds:.4g} s), energy adds up to {abs(result.energy.relative_residual):.1e}\n{out}"
    )
