"""What the causes of `causes.plausible` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters
from analysis.blind.plant.unimagined import BEST_REBOUND

WORN_M = 0.015  # from the Host's centre to where its floor is worn three fifths as much
BEAD_RAD = 0.25  # of the wall, from a bead's top to where it stands in three fifths as far


@compiled
def plausible_friction(
    time: float, at: tuple[float, float], slip: tuple[float, float], since_s: float, p: PlantParameters
) -> float:
    """What the floor's friction is multiplied by; `at` (m, from the Host's centre) and `slip` (m/s) over the floor,
    `since_s` the time of the last blow (negative: none yet).

    Stribeck: what creeps is held more than what runs, 1 + `stribeck` exp(-speed / `stribeck_m_per_s`).
    A floor worn in its middle: 1 + `worn` exp(-r^2 / (2 `WORN_M`^2)), r from the Host's centre.
    A floor scratched along one direction: 1 + `scratched` cos 2(the slip's direction - `scratched_rad`), with its mean
    where the disk rests.
    A blow lifts the disk off the floor, onto which it settles: 1 - `lifted` exp(-the time since then / `lifted_s`).
    """
    share = 1.0
    if p.stribeck != 0.0:
        share *= 1.0 + p.stribeck * np.exp(-np.sqrt(slip[0] ** 2 + slip[1] ** 2) / p.stribeck_m_per_s)
    if p.worn != 0.0:
        share *= max(1.0 + p.worn * np.exp(-0.5 * (at[0] ** 2 + at[1] ** 2) / WORN_M**2), 0.0)
    if p.scratched != 0.0:
        c, s = np.cos(2.0 * p.scratched_rad), np.sin(2.0 * p.scratched_rad)
        squared = slip[0] ** 2 + slip[1] ** 2 + p.smoothing_m_per_s**2
        twice = (c * (slip[0] ** 2 - slip[1] ** 2) + s * 2.0 * slip[0] * slip[1]) / squared
        share *= max(1.0 + p.scratched * twice, 0.0)
    if p.lifted != 0.0 and time >= since_s >= 0.0:
        share *= max(1.0 - p.lifted * np.exp(-(time - since_s) / p.lifted_s), 0.0)
    return share


@compiled
def ring_torque(p: PlantParameters) -> float:
    """What the floor's torque is multiplied by: a washer that rests on a ring, near its rim, is braked harder as it
    spins, by 1 + `ring_foot`; a pure ring's would be 1.5 at slow sliding."""
    return 1.0 + p.ring_foot


@compiled
def add_dish(x: float, y: float, p: PlantParameters, out: Floats) -> None:
    """A floor plate that sags between its screws, like a dish of curvature `dished_per_m`: the disk slides down to its
    middle, by the load times that times its place (x, y from the Host's centre)."""
    if p.dished_per_m != 0.0:
        out[2] -= p.load_m_per_s2 * p.dished_per_m * x
        out[3] -= p.load_m_per_s2 * p.dished_per_m * y


@compiled
def plausible_rebound(rebound: float, approach: float, slip: float, normal_rad: float, p: PlantParameters) -> float:
    """Restitution of this impact, which was `rebound`; nothing here raises it above `BEST_REBOUND`.

    A shaker's armature gives way along its axis, x, and stands firm across it: times 1 - `armature` times the squared
    cosine of the blow's direction.
    The wall's plastic warms from run to run, and softens: times 1 - `warmed`, the run's own.
    An oblique blow returns less, or more: times 1 - `oblique` slip^2 / (slip^2 + approach^2).
    """
    value = rebound * (1.0 - p.armature * np.cos(normal_rad) ** 2) * (1.0 - p.warmed)
    value *= 1.0 - p.oblique * slip**2 / (slip**2 + approach**2 + 1e-300)
    return min(value, max(rebound, BEST_REBOUND))


@compiled
def plausible_slide(slip: float, p: PlantParameters) -> float:
    """What the wall's friction is multiplied by in this impact: the faster it slips, the less, 1 / (1 +
    `rubbed_s_per_m` |slip|)."""
    return 1.0 / (1.0 + p.rubbed_s_per_m * abs(slip))


@compiled
def plausible_reach(azimuth: float, p: PlantParameters) -> tuple[float, float]:
    """How much farther the disk's middle gets along `azimuth` (m), and the slope of that (m per rad).

    A ring turned in a chuck of three jaws springs into three lobes: `chucked_m` cos 3(azimuth - `chucked_rad`).
    A bead of glue at the ring's seam stands in: -`seam_bead_m` exp(-(azimuth - `seam_bead_rad`)^2 / (2 `BEAD_RAD`^2)).
    """
    more, steeper = 0.0, 0.0
    if p.chucked_m != 0.0:
        lobe = 3.0 * (azimuth - p.chucked_rad)
        more += p.chucked_m * np.cos(lobe)
        steeper -= 3.0 * p.chucked_m * np.sin(lobe)
    if p.seam_bead_m != 0.0:
        away = np.arctan2(np.sin(azimuth - p.seam_bead_rad), np.cos(azimuth - p.seam_bead_rad)) / BEAD_RAD
        bead = p.seam_bead_m * np.exp(-0.5 * away**2)
        more -= bead
        steeper += bead * away / BEAD_RAD
    return more, steeper
