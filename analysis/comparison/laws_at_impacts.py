"""What the laws that a scenario holds add to the contact law at measured impacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.motion.host_path import HostMotion
from ovines.core import Scenario
from ovines.core.laws import words as W
from ovines.core.laws.kernel import law_of
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.terms import rows_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LawsAtImpacts:
    """Packed ``rows`` of laws, and what they ``known`` at each impact (n, KNOWN_SIZE) before its impulse."""

    rows: Array
    known: Array

    def added(self, spin_left_rad_per_s: Array | None = None) -> dict[str, Array]:
        """By target of the impacts ("restitution", "wall_friction", ...) what the laws add at each, (n,); those of the
        spin are known once it is that which the impulse leaves."""
        known = self.known.copy()
        if spin_left_rad_per_s is not None:
            known[:, W.SPIN_LEFT] = spin_left_rad_per_s
        return {
            name: np.array([law_of(target.code, self.rows, one) for one in known])
            for name, target in TARGETS.items()
            if target.stage == "impact"
        }


def laws_at_impacts(impacts: pd.DataFrame, scenario: Scenario, host_motion: HostMotion) -> LawsAtImpacts:
    """The laws of a scenario at each row of ``impacts``.

    ``scenario`` is one of :func:`analysis.comparison.simulated_rig.nominal_scenario`, whose laws count time from the
    clock's zero.  The disk's angle at an impact stands in no table: a law that follows it sees an angle of 0.
    """
    rows = rows_of([term for law in scenario.laws for term in law.terms])
    known = np.zeros((len(impacts), W.KNOWN_SIZE))
    time_s, azimuth = impacts["time_s"].to_numpy(float), impacts["azimuth_rad"].to_numpy(float)
    known[:, W.HX], known[:, W.HY] = np.cos(azimuth), np.sin(azimuth)
    known[:, W.CONTACT_RADIUS] = 1.0
    known[:, W.APPROACH] = impacts["normal_speed_before_m_per_s"].to_numpy(float)
    known[:, W.SLIP] = impacts["tangential_speed_before_m_per_s"].to_numpy(float)
    known[:, W.SPIN] = impacts["spin_before_rad_per_s"].to_numpy(float)
    known[:, W.TIME], known[:, W.RUN] = time_s, scenario.run_number
    known[:, W.CLOCK] = host_motion.omega_rad_per_s * time_s
    known[:, W.PHASE] = host_motion.omega_rad_per_s * (time_s - host_motion.zero_s) + host_motion.phase_rad
    known[:, W.SINCE] = np.minimum(np.diff(time_s, prepend=-np.inf), W.LONG_AGO_S)
    known[1:, W.LAST_X], known[1:, W.LAST_Y] = np.cos(azimuth[:-1]), np.sin(azimuth[:-1])
    known[1:, W.LAST_APPROACH], known[1:, W.LAST_SLIP] = known[:-1, W.APPROACH], known[:-1, W.SLIP]
    left = impacts[["normal_speed_after_m_per_s", "tangential_speed_after_m_per_s", "spin_after_rad_per_s"]]
    normal_left, slip_left, spin_left = left.to_numpy(float).T
    passed = np.hypot(normal_left, slip_left - scenario.nes.radius_m * spin_left)
    known[1:, W.LAST_LEFT] = passed[:-1]
    known[:, [W.HOST_AX, W.HOST_AY]] = host_motion.at(time_s, 2)[:, :2]
    normal = impacts["normal_rad"].to_numpy(float) if "normal_rad" in impacts else azimuth
    at_cylinder = np.cos(normal - azimuth) < 0.0
    pushed = azimuth + np.where(at_cylinder, np.pi, 0.0)  # a cylinder towards the Host's centre
    for i in range(min(W.MOST_BLOWS, len(known) - 1)):
        known[i + 1 :, W.BLOW_TIMES + i] = known[: -i - 1, W.TIME]
        known[i + 1 :, W.BLOW_SPEEDS + i] = known[: -i - 1, W.APPROACH]
        known[i + 1 :, W.BLOW_SLIPS + i] = known[: -i - 1, W.SLIP]
        known[i + 1 :, W.BLOW_WAYS + i] = known[i + 1 :, W.BLOW_SIDES + i] = pushed[: -i - 1]
    known[:, W.BLOWS], known[:, W.AT_CYLINDER] = np.arange(len(known)), at_cylinder
    rate = host_motion.at(time_s, 1)
    known[:, W.WALL_SPEED] = np.cos(normal) * rate[:, 0] + np.sin(normal) * rate[:, 1]
    known[:, W.NORMAL] = normal
    known[:, W.WALL_ACCELERATION] = np.cos(normal) * known[:, W.HOST_AX] + np.sin(normal) * known[:, W.HOST_AY]
    known[:, W.PASSING] = known[:, W.SLIP] - scenario.nes.radius_m * known[:, W.SPIN]
    return LawsAtImpacts(rows, known)
