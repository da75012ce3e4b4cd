"""Run one scenario: ``simulate(scenario)``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import Measurement
from ovines.core.energies import EnergyBalance, energy_balance, over_time
from ovines.core.engine import run
from ovines.core.integration.sampling import N_SAMPLE
from ovines.core.packing import pack
from ovines.core.refusal import require_an_end
from ovines.core.system import parameters as P
from ovines.core.system.host import vertical_motion
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed, Samples

IMPACT_COLUMNS = (
    "time_s", "azimuth_rad", "normal_speed_before_m_per_s", "normal_speed_after_m_per_s",
    "tangential_speed_before_m_per_s", "tangential_speed_after_m_per_s", "spin_before_rad_per_s",
    "spin_after_rad_per_s", "stuck", "wall", "energy_lost_j", "wall_friction_loss_j", "work_j", "normal_rad",
)  # fmt: skip


@dataclass(frozen=True)
class SimulationResult:
    """What one run gives.

    ``time_s`` (n,) and one array (n,) per motion column in ``motion`` (names of ``simulation.parquet``; NaN after
    the end of a run stopped by ``max_impacts``); ``impacts`` structured array (:data:`IMPACT_COLUMNS`);
    ``contacts`` (m, 2) start and end of sustained wall contact (s); ``final_state`` engine state; ``energy`` of the
    whole run; ``energies`` over time: one array (n,) per column of ``energies.parquet`` (J; none unless asked for).
    """

    scenario: Scenario
    time_s: np.ndarray
    motion: dict[str, np.ndarray]
    impacts: np.ndarray
    contacts: np.ndarray
    end_s: float
    final_state: np.ndarray
    energy: EnergyBalance
    energies: dict[str, np.ndarray] = field(default_factory=dict)


def sample_times(scenario: Scenario) -> np.ndarray:
    """Times of the samples, from 0 up to the duration (none at a rate of 0)."""
    if scenario.sample_rate_hz == 0.0:
        return np.zeros(0)
    count = math.floor(scenario.duration_s * scenario.sample_rate_hz * (1.0 + 1e-12)) + 1
    return np.minimum(np.arange(count) / scenario.sample_rate_hz, scenario.duration_s)


def simulate(
    scenario: Scenario, rng: np.random.Generator | None = None, with_energies: bool = False
) -> SimulationResult:
    """Run ``scenario`` with its effects from its start to its end.

    ``rng`` is needed by effects that scatter (``trigger_jitter``, ``motion_blur``) only.  ``with_energies`` also
    follows every energy over time: of the run itself, not of what effects of the measurement make of it.
    :class:`ScenarioError` of a run whose steps come to nothing.
    """
    packed = pack(scenario)
    times = sample_times(scenario)
    y = packed.y.copy()
    samples = np.full((len(times), N_SAMPLE), np.nan)
    impact_rows, contact_rows = min(scenario.max_impacts, 20000), 1024
    while True:
        y[:] = packed.y
        impacts, contacts = np.zeros((impact_rows, P.N_IMPACT)), np.zeros((contact_rows, 2))
        states = np.full((len(times) if with_energies else 0, P.N_STATE), np.nan)
        taken = Samples(times, samples, np.zeros(1, np.int64), states)
        end, n_impacts, n_contacts, _in_contact = run(packed.system, y, taken, impacts, contacts, True)
        if n_impacts <= impact_rows and n_contacts <= contact_rows:
            break
        impact_rows, contact_rows = max(impact_rows, n_impacts), max(contact_rows, n_contacts)
    require_an_end(scenario.name, end, scenario.duration_s, n_impacts >= scenario.max_impacts)
    impacts, contacts = impacts[:n_impacts], contacts[:n_contacts]
    energy = energy_balance(packed, y, end, impacts)
    shown = Measurement(times, samples, impacts, float(packed.p[P.MASS]))
    for name, values in scenario.effects.items():
        observe = EFFECTS[name].observe
        if observe is not None:
            source = rng if rng is not None else np.random.default_rng(0)
            shown = observe(shown, EFFECTS[name].complete(values), source)
    motion = motion_columns(times, shown.samples, packed)
    records = impact_records(impacts)
    energies = {"time_s": times, **over_time(states, packed, times)} if with_energies else {}
    return SimulationResult(scenario, shown.times, motion, records, contacts, float(end), y, energy, energies)


def impact_records(rows: np.ndarray) -> np.recarray:
    """The engine's rows (n, columns) as a structured array; none is fine."""
    return np.rec.fromarrays(list(rows.T), dtype=[(name, float) for name in IMPACT_COLUMNS])


def motion_columns(times: np.ndarray, samples: np.ndarray, packed: Packed) -> dict[str, np.ndarray]:
    """Samples as the columns of ``simulation.parquet``; z of the NES follows the floor it lies on."""
    height = np.zeros((len(times), 2))
    if packed.k[P.HOST_KIND] in (P.DRIVEN, P.SPRUNG):
        for i, time in enumerate(times):
            height[i] = vertical_motion(time, packed.k, packed.drive, packed.table)
    height[np.isnan(samples[:, 0])] = np.nan
    lifted = height if not packed.k[P.ON_GROUND] else 0.0 * height
    columns: dict[str, np.ndarray] = {}
    for start, body, z in ((0, "nes", lifted), (6, "host", height)):
        columns |= {f"{body}_x_m": samples[:, start], f"{body}_y_m": samples[:, start + 1], f"{body}_z_m": z[:, 0]}
        columns[f"{body}_angle_rad"] = samples[:, start + 4]
        columns |= {f"{body}_vx_m_per_s": samples[:, start + 2], f"{body}_vy_m_per_s": samples[:, start + 3]}
        columns |= {f"{body}_vz_m_per_s": z[:, 1], f"{body}_spin_rad_per_s": samples[:, start + 5]}
    return columns
