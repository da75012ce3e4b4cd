"""Run one scenario: ``simulate(scenario)``."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ovines.core.effects import EFFECTS
from ovines.core.effects.effect import Seen
from ovines.core.engine import run
from ovines.core.integration.sampling import N_SAMPLE
from ovines.core.packing import pack
from ovines.core.system import parameters as P
from ovines.core.system.host import vertical_motion
from ovines.core.system.model import Scenario
from ovines.core.system.packed import Packed, Samples

IMPACT_COLUMNS = (
    "time_s", "azimuth_rad", "normal_speed_before_m_per_s", "normal_speed_after_m_per_s",
    "tangential_speed_before_m_per_s", "tangential_speed_after_m_per_s", "spin_before_rad_per_s",
    "spin_after_rad_per_s", "stuck", "wall", "energy_lost_j",
)  # fmt: skip


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of one run (J).

    ``change``: kinetic, potential (gravity and springs) at the end less that at the start, of the NES and of
    a movable Host; ``rubbed`` lost in impacts and friction; ``dragged`` lost in drag and dampers; ``worked`` done by
    the driver or the ground; ``exchanged``: largest energy present plus all that was moved.
    ``residual = change + rubbed + dragged - worked``; each term is accumulated on its own.
    """

    change: float
    rubbed: float
    dragged: float
    worked: float
    exchanged: float

    @property
    def residual(self) -> float:
        """What does not add up (J)."""
        return self.change + self.rubbed + self.dragged - self.worked

    @property
    def relative_residual(self) -> float:
        """``residual`` over ``exchanged``; 0 where nothing was exchanged."""
        return self.residual / self.exchanged if self.exchanged > 0.0 else 0.0


@dataclass(frozen=True)
class SimulationResult:
    """What one run gives.

    ``time_s`` (n,) and one array (n,) per motion column in ``motion`` (names of ``simulation.parquet``; NaN after
    the end of a run stopped by ``max_impacts``); ``impacts`` structured array (:data:`IMPACT_COLUMNS`);
    ``contacts`` (m, 2) start and end of sustained wall contact (s); ``final_state`` engine state.
    """

    scenario: Scenario
    time_s: np.ndarray
    motion: dict[str, np.ndarray]
    impacts: np.ndarray
    contacts: np.ndarray
    end_s: float
    final_state: np.ndarray
    energy: EnergyBalance


def sample_times(scenario: Scenario) -> np.ndarray:
    """Times of the samples, from 0 up to the duration (none at a rate of 0)."""
    if scenario.sample_rate_hz == 0.0:
        return np.zeros(0)
    count = math.floor(scenario.duration_s * scenario.sample_rate_hz * (1.0 + 1e-12)) + 1
    return np.minimum(np.arange(count) / scenario.sample_rate_hz, scenario.duration_s)


def mechanical_energy(y: np.ndarray, packed: Packed, time_s: float) -> float:
    """Kinetic and potential energy of the NES and a movable Host at engine state ``y`` (J)."""
    from ovines.core.system.host import base_motion

    p, k = packed.p, packed.k
    energy = 0.5 * p[P.MASS] * (y[2] ** 2 + y[3] ** 2) + 0.5 * p[P.INERTIA] * y[5] ** 2
    energy -= p[P.MASS] * (p[P.GRAVITY_X] * y[0] + p[P.GRAVITY_Y] * y[1])
    if p[P.INVERSE_HOST_MASS] > 0.0:
        host = y[P.HOST :]
        energy += 0.5 * (host[2] ** 2 + host[3] ** 2) / p[P.INVERSE_HOST_MASS]
        energy += 0.5 * host[5] ** 2 / p[P.INVERSE_HOST_INERTIA]
    if k[P.HOST_KIND] == P.SPRUNG:
        base = np.zeros(9)
        base_motion(time_s, k, packed.drive, packed.table, base)
        stretch = np.array([host[0] - base[0], host[1] - base[1], host[4] - base[2]])
        energy += 0.5 * float(np.sum(p[P.STIFFNESS_X : P.STIFFNESS_R + 1] * stretch**2))
    return float(energy)


def simulate(scenario: Scenario, rng: np.random.Generator | None = None) -> SimulationResult:
    """Run ``scenario`` with its effects from its start to its end.

    ``rng`` is needed by effects that scatter (``trigger_jitter``, ``motion_blur``) only.
    """
    packed = pack(scenario)
    times = sample_times(scenario)
    y = packed.y.copy()
    samples = np.full((len(times), N_SAMPLE), np.nan)
    impact_rows, contact_rows = min(scenario.max_impacts, 20000), 1024
    while True:
        y[:] = packed.y
        impacts, contacts = np.zeros((impact_rows, P.N_IMPACT)), np.zeros((contact_rows, 2))
        taken = Samples(times, samples, np.zeros(1, np.int64))
        end, n_impacts, n_contacts, _in_contact = run(packed.system, y, taken, impacts, contacts, True)
        if n_impacts <= impact_rows and n_contacts <= contact_rows:
            break
        impact_rows, contact_rows = max(impact_rows, n_impacts), max(contact_rows, n_contacts)
    impacts, contacts = impacts[:n_impacts], contacts[:n_contacts]
    energy = energy_balance(packed, y, end, impacts)
    shown = Seen(times, samples, impacts, float(packed.p[P.MASS]))
    for name, values in scenario.effects.items():
        observe = EFFECTS[name].observe
        if observe is not None:
            source = rng if rng is not None else np.random.default_rng(0)
            shown = observe(shown, EFFECTS[name].complete(values), source)
    motion = motion_columns(times, shown.samples, packed)
    return SimulationResult(scenario, shown.times, motion, impact_records(impacts), contacts, float(end), y, energy)


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


def energy_balance(packed: Packed, y: np.ndarray, end: float, impacts: np.ndarray) -> EnergyBalance:
    """Balance of a run that ended in state ``y``."""
    start, final = mechanical_energy(packed.y, packed, 0.0), mechanical_energy(y, packed, end)
    rubbed, worked, dragged = y[P.LOST_FRICTION], y[P.WORK], y[P.LOST_DRAG]
    # the size that rounding refers to: energies present, and energy turned over in impacts
    turned = 0.5 * packed.p[P.MASS] * float(np.sum(impacts[:, P.NORMAL_BEFORE] ** 2)) if len(impacts) else 0.0
    exchanged = abs(start) + abs(final) + abs(rubbed) + abs(worked) + abs(dragged) + turned
    return EnergyBalance(final - start, float(rubbed), float(dragged), float(worked), exchanged)
