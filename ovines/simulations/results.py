"""A simulation as tables: the columns of the measured ones, so that both are read alike."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ovines.core import EnsembleResult, Scenario, SimulationResult
from ovines.core.system.named import NAMED
from ovines.errors import InputError
from ovines.io.provenance import sha256_of
from ovines.scenario import checked_scenario, read_scenario
from ovines.tables import write_table

WRITES = ("simulation", "simulated_impacts", "contact", "energies")
ENSEMBLE = "ensemble"
IMPACT_TEXT = ("stick", "slide")
CHANNELS = {
    "restitution_loss_j": "restitution",
    "wall_friction_loss_j": "wall friction",
    "floor_sliding_loss_j": "sliding on the floor",
    "floor_spinning_loss_j": "spinning on the floor",
    "drag_loss_j": "drag",
    "damper_loss_j": "dampers",
}
LEAST_SHARE, LEAST_LOSS_J = 5e-4, 1e-9  # of what is lost, and of a loss: less is not worth a word


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
    """``simulation``, ``simulated_impacts``, ``contact`` and ``energies.parquet`` into ``out``.

    ``result`` of ``simulate(..., with_energies=True)``.
    """
    contacts = pd.DataFrame(result.contacts, columns=["start_s", "end_s"])
    tables = (motion_table(result), impact_table(result), contacts, pd.DataFrame(result.energies))
    for name, table in zip(WRITES, tables, strict=True):
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
    frame["restitution_loss_j"] = impacts["energy_lost_j"] - impacts["wall_friction_loss_j"]
    frame["wall_friction_loss_j"], frame["work_j"] = impacts["wall_friction_loss_j"], impacts["work_j"]
    frame["regime"] = [IMPACT_TEXT[0] if value else IMPACT_TEXT[1] for value in stuck]
    return frame


def ensemble_table(found: EnsembleResult) -> pd.DataFrame:
    """A row per scattered copy; ``found`` of ``simulate_ensemble(..., with_energies=True)`` with a scattered start."""
    state = [
        f"{body}_{name}"
        for body in ("nes", "host")
        for name in ("x_m", "y_m", "vx_m_per_s", "vy_m_per_s", "angle_rad", "spin_rad_per_s")
    ]
    columns = {
        "run": np.arange(len(found.end_s)),
        "start_x_m": found.drawn["nes_x_m"],
        "start_y_m": found.drawn["nes_y_m"],
        "impacts": found.n_impacts,
        "contacts": found.n_contacts,
        "contact_s": found.contact_s,
        "end_s": found.end_s,
    }
    return pd.DataFrame(columns | dict(zip(state, found.final_state.T, strict=True)) | found.energies)


def ensemble_summary(found: EnsembleResult) -> str:
    """What the copies gave, in two lines; ``found`` with energies."""
    low, middle, high = np.percentile(found.n_impacts, [5, 50, 95])
    losses = {name: float(np.mean(found.energies[name])) for name in CHANNELS}
    return (
        f"{len(found.n_impacts)} copies: {float(np.mean(found.n_impacts)):.4g} impacts on average, {middle:.0f} in the "
        f"median ({low:.0f}..{high:.0f}, 5-95 %), {float(np.mean(found.contact_s)):.3g} s in sustained contact\n"
        f"{where_energy_goes(losses, float(np.mean(found.energies['work_j'])))}"
    )


def where_energy_goes(losses_j: Mapping[str, float], worked_j: float) -> str:
    """Shares of the energy lost, largest first, and the work done, in one line."""
    total = sum(losses_j.values())
    parts = [
        f"{CHANNELS[name]} {100 * value / total:.3g} %"
        for name, value in sorted(losses_j.items(), key=lambda one: -one[1])
        if value > LEAST_SHARE * total
    ]
    lost = f"lost {total:.3g} J: {', '.join(parts)}" if total > LEAST_LOSS_J else "nothing lost"
    return f"{lost}; work done {worked_j:.3g} J"


def summary(result: SimulationResult, out: Path) -> str:
    """What a run gave, in one paragraph."""
    where = where_energy_goes(result.energy.losses, result.energy.worked)
    seconds = float(np.sum(result.contacts[:, 1] - result.contacts[:, 0]))
    return (
        f"{result.scenario.name}: {result.end_s:.6g} s, {len(result.impacts)} impacts, {len(result.contacts)} "
        f"sustained "
        f"contacts ({seconds:.4g} s), energy adds up to {abs(result.energy.relative_residual):.1e}\n"
        f"{where}\n{out}"
    )
