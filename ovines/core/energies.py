"""Energies of a run: what is stored, by body and kind; what was lost, by channel; what the driver or the ground did."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ovines.core import state as S
from ovines.core.system import parameters as P
from ovines.core.system.host import base_motion_at
from ovines.core.system.packed import Packed

# Channels of loss and the drive's work: name, place in the engine's state.
LOSSES = {
    "restitution_loss_j": P.LOST_NORMAL, "wall_friction_loss_j": P.LOST_TANGENT,
    "floor_sliding_loss_j": P.LOST_SLIDING, "floor_spinning_loss_j": P.LOST_SPINNING,
    "drag_loss_j": P.LOST_DRAG, "damper_loss_j": P.LOST_DAMPING,
}  # fmt: skip
STORES = ("nes_kinetic_j", "nes_spin_j", "nes_potential_j", "host_kinetic_j", "host_spin_j", "spring_j")


@dataclass(frozen=True)
class EnergyBalance:
    """Energies of one run (J).

    ``change``: kinetic, potential (gravity and springs) at the end less that at the start, of the NES and of
    a movable Host; ``losses`` by channel (names of :data:`LOSSES`); ``worked`` done by the driver or the ground;
    ``exchanged``: largest energy present plus all that was moved.
    ``residual = change + all losses - worked``; each term is accumulated on its own.
    """

    change: float
    losses: dict[str, float]
    worked: float
    exchanged: float

    @property
    def rubbed(self) -> float:
        """Lost at the wall and on the floor (J)."""
        return sum(value for name, value in self.losses.items() if name not in ("drag_loss_j", "damper_loss_j"))

    @property
    def dragged(self) -> float:
        """Lost to drag and dampers (J)."""
        return self.losses["drag_loss_j"] + self.losses["damper_loss_j"]

    @property
    def residual(self) -> float:
        """What does not add up (J)."""
        return self.change + self.rubbed + self.dragged - self.worked

    @property
    def relative_residual(self) -> float:
        """``residual`` over ``exchanged``; 0 where nothing was exchanged."""
        return self.residual / self.exchanged if self.exchanged > 0.0 else 0.0


def stored(states: np.ndarray, packed: Packed, times_s: np.ndarray) -> dict[str, np.ndarray]:
    """Energies present (J, each (n,)) at engine states (n, 19): :data:`STORES`."""
    p, k = packed.p, packed.k
    y = states.T
    none = np.zeros(len(states))
    energies = dict.fromkeys(STORES, none) | {
        "nes_kinetic_j": 0.5 * p[P.MASS] * (y[S.VX] ** 2 + y[S.VY] ** 2),
        "nes_spin_j": 0.5 * p[P.INERTIA] * y[S.SPIN] ** 2,
        "nes_potential_j": -p[P.MASS] * (p[P.GRAVITY_X] * y[S.X] + p[P.GRAVITY_Y] * y[S.Y]),
    }
    host = y[P.HOST :]
    if p[P.INVERSE_HOST_MASS] > 0.0:
        energies["host_kinetic_j"] = 0.5 * (host[S.VX] ** 2 + host[S.VY] ** 2) / p[P.INVERSE_HOST_MASS]
        energies["host_spin_j"] = 0.5 * host[S.SPIN] ** 2 / p[P.INVERSE_HOST_INERTIA]
    if k[P.HOST_KIND] == P.SPRUNG:
        base = np.zeros((len(times_s), S.N_BASE))
        for row, time in zip(base, times_s, strict=True):
            base_motion_at(time, k, packed.drive, packed.table, row)
        stretch = host[[S.X, S.Y, S.ANGLE]].T - base[:, : S.RATES]
        energies["spring_j"] = 0.5 * np.sum(p[P.STIFFNESS_X : P.STIFFNESS_R + 1] * stretch**2, axis=1)
    return energies


def over_time(states: np.ndarray, packed: Packed, times_s: np.ndarray) -> dict[str, np.ndarray]:
    """Energies at sampled states (n, 19), as the columns of ``energies.parquet`` (J, each (n,)).

    What is stored, what was lost by each channel since the start, the work done since, and what does not add up.
    """
    present = stored(states, packed, times_s)
    lost = {name: states[:, place] for name, place in LOSSES.items()}
    work = states[:, P.WORK]
    start = sum(value[0] for value in stored(packed.y[None], packed, np.zeros(1)).values())
    residual = np.sum([*present.values(), *lost.values()], axis=0) - start - work
    return present | lost | {"work_j": work, "residual_j": residual}


def energy_balance(packed: Packed, y: np.ndarray, end_s: float, impacts: np.ndarray) -> EnergyBalance:
    """Balance of a run that ended in state ``y`` (19,)."""
    both = stored(np.array([packed.y, y]), packed, np.array([0.0, end_s]))
    start, final = np.sum(list(both.values()), axis=0)
    losses = {name: float(y[place]) for name, place in LOSSES.items()}
    # the size that rounding refers to: energies present, and energy turned over in impacts
    turned = 0.5 * packed.p[P.MASS] * float(np.sum(impacts[:, P.NORMAL_BEFORE] ** 2)) if len(impacts) else 0.0
    exchanged = abs(start) + abs(final) + sum(map(abs, losses.values())) + abs(y[P.WORK]) + turned
    return EnergyBalance(float(final - start), losses, float(y[P.WORK]), float(exchanged))
