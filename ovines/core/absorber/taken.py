"""Energy that the NES takes from a sprung Host: pumped, dissipated by channel, and the decay against a bare Host."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ovines.core import state as S
from ovines.core.absorber.sprung import suspension_of
from ovines.core.energies import LOSSES, stored
from ovines.core.packing import pack
from ovines.core.simulate import simulate
from ovines.core.system import parameters as P
from ovines.core.system.host import host_after, host_starts
from ovines.core.system.kinematics import N_SCRATCH
from ovines.core.system.model import Scenario

INSIDE = tuple(name for name in LOSSES if name != "damper_loss_j")  # what the NES dissipates
KEPT = ("nes_kinetic_j", "nes_spin_j", "nes_potential_j")


@dataclass(frozen=True)
class EnergyTaken:
    """Energies over ``time_s`` (n,), J: the ``host_j`` (moving, turning, springs) and what a ``bare_j`` one would have;
    ``pumped_j`` from Host to NES since the start, of which ``nes_j`` is in the NES more than at the start and
    ``dissipated_j`` (by channel) is gone; ``damper_j`` lost in the Host's own dampers, ``work_j`` done by the ground.
    """

    time_s: np.ndarray
    host_j: np.ndarray
    bare_j: np.ndarray
    pumped_j: np.ndarray
    nes_j: np.ndarray
    dissipated_j: dict[str, np.ndarray]
    damper_j: np.ndarray
    work_j: np.ndarray

    def decay_s(self, share: float = 0.1) -> tuple[float, float]:
        """When the energy of Host, and of a bare one, is last above ``share`` of its first value (inf: at the end)."""
        return _last_above(self.time_s, self.host_j, share), _last_above(self.time_s, self.bare_j, share)


def energy_taken(scenario: Scenario) -> EnergyTaken:
    """Where the energy of a sprung Host goes in one run.

    Examples
    --------
    >>> from ovines.core.absorber.taken import energy_taken
    >>> from ovines.core.orbits.period import changed
    >>> from ovines.notebook import read_scenario
    >>> found = energy_taken(changed(read_scenario("sprung-host"), "drive_amplitude_factor", 0.0))
    >>> with_nes, bare = found.decay_s(0.1)
    >>> bool(with_nes < bare)
    True
    """
    suspension_of(scenario)
    result = simulate(scenario, with_energies=True)
    e = result.energies
    nes = np.sum([e[name] for name in KEPT], axis=0)
    gone = {name: e[name] for name in INSIDE}
    host = e["host_kinetic_j"] + e["host_spin_j"] + e["spring_j"]
    bare = bare_energy_j(scenario, result.time_s)
    more = nes - nes[0]
    return EnergyTaken(
        result.time_s,
        host,
        bare,
        more + np.sum(list(gone.values()), axis=0),
        more,
        gone,
        e["damper_loss_j"],
        e["work_j"],
    )


def bare_energy_j(scenario: Scenario, times_s: np.ndarray) -> np.ndarray:
    """Energy (n,) of the same Host from the same start with nothing inside."""
    packed = pack(replace(scenario, friction=None))
    states = np.zeros((len(times_s), P.N_STATE))
    out = np.zeros(N_SCRATCH)
    host_starts(0.0, packed.y, packed.system, out)
    for row, time in zip(states, times_s, strict=True):
        host_after(0.0, float(time), packed.y, packed.system, out)
        row[P.HOST : P.HOST + 6] = out[S.BASE_IN_STATE]
    energies = stored(states, packed, times_s)
    return energies["host_kinetic_j"] + energies["host_spin_j"] + energies["spring_j"]


def _last_above(time_s: np.ndarray, energy: np.ndarray, share: float) -> float:
    above = np.flatnonzero(energy > share * energy[0])
    if not len(above):
        return 0.0
    return float(time_s[above[-1]]) if above[-1] < len(time_s) - 1 else np.inf
