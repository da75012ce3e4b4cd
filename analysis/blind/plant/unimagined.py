"""What the causes of `causes.unimagined` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters

HOST_M_PER_S2 = 78.5  # 8 g of the Host: what goes with its acceleration is stated for that
HOST_M_PER_S = 1.136  # and what goes with its speed for this: 8 g at 11 Hz
CHATTER_M_PER_S = 0.2  # width of the band of sliding speeds in which a disk chatters
BEST_REBOUND = 0.98  # restitution: no wall gives back all
RINGING_S = 0.06  # in which a wall's ringing dies out: about the time from blow to blow
SQUEEZED_M_PER_S = 0.8  # approach from which on most of the grease is squeezed out
SKIN_M_PER_S = 0.3  # slip at which the return is divided by 1 + `skin`


@compiled
def unimagined_friction(
    at: tuple[float, float], slip: tuple[float, float], spin: float, acceleration: Floats, p: PlantParameters
) -> float:
    """What the floor's friction is multiplied by; `at` (m, from the Host's centre), `slip` (m/s) and `spin` (rad/s)
    over the floor, `acceleration` the Host's."""
    share = 1.0
    if p.nap != 0.0:  # a disk that spins fast meets the nap from all sides
        rim = p.disk_radius_m * spin
        speed = np.sqrt(slip[0] ** 2 + slip[1] ** 2 + rim**2) + p.smoothing_m_per_s
        share *= 1.0 + p.nap * (slip[0] * np.cos(p.nap_rad) + slip[1] * np.sin(p.nap_rad)) / speed
    if p.chatter != 0.0:
        off = (np.sqrt(slip[0] ** 2 + slip[1] ** 2) - p.chatter_m_per_s) / CHATTER_M_PER_S
        share *= 1.0 - p.chatter * np.exp(-0.5 * off**2)
    if p.pitching != 0.0:
        lever = (at[0] * acceleration[0] + at[1] * acceleration[1]) / (p.contact_radius_m * HOST_M_PER_S2)
        share *= max(1.0 + p.pitching * lever, 0.0)
    return share


@compiled
def add_unimagined_forces(x: float, y: float, angle: float, velocity: Floats, p: PlantParameters, out: Floats) -> None:
    """Forces and torques that come on top; x, y from the Host's centre, `angle` the disk's, `velocity` the Host's.

    Between two opposed poles the field is B (x, -y): a dipole m is pushed by B (mx, -my), the same everywhere, and
    turned by B (-mx y - my x).
    """
    if p.poles_m_per_s2 != 0.0:
        along, across = np.cos(angle + p.poles_rad), np.sin(angle + p.poles_rad)
        out[2] += p.poles_m_per_s2 * along
        out[3] -= p.poles_m_per_s2 * across
        out[5] -= p.poles_m_per_s2 * (along * y + across * x) / (p.inertia_factor * p.disk_radius_m**2)
    if p.bellows_m_per_s2 != 0.0:
        blown = p.bellows_m_per_s2 * np.sqrt(velocity[0] ** 2 + velocity[1] ** 2) / HOST_M_PER_S**2
        out[2] += blown * velocity[0]
        out[3] += blown * velocity[1]


@compiled
def unimagined_rebound(
    rebound: float, time: float, state: Floats, normal: tuple[float, float], acceleration: Floats, p: PlantParameters
) -> float:
    """Restitution of this impact, which was `rebound`, at a wall that has the Host's `acceleration` and that rings from
    the impact before, if there was one; nothing raises it above `BEST_REBOUND`."""
    if p.seated == 0.0 and p.ringing == 0.0:
        return rebound
    gain = p.seated * (acceleration[0] * normal[0] + acceleration[1] * normal[1]) / HOST_M_PER_S2
    if state[13] > 0.5:
        since = time - state[6]
        gain += p.ringing * np.exp(-since / RINGING_S) * np.sin(p.ringing_rad_per_s * since)
    return min(rebound + gain, max(rebound, BEST_REBOUND))


@compiled
def unimagined_grip(approach: float, slip: float, p: PlantParameters) -> tuple[float, float]:
    """Factors of the tangential restitution and of the wall's friction in this impact."""
    return (
        1.0 / (1.0 + p.skin * abs(slip) / SKIN_M_PER_S),
        1.0 + p.squeezed * (1.0 - np.exp(-approach / SQUEEZED_M_PER_S)),
    )


@compiled
def squashed(azimuth: float, acceleration: Floats, p: PlantParameters) -> tuple[float, float]:
    """How much farther the disk's middle gets along `azimuth` in a ring that the Host's `acceleration` squashes, and
    the slope of that (m, m per rad); of the Host's jerk the first is the wall's own speed."""
    start = acceleration[0] * np.cos(p.squash_rad) + acceleration[1] * np.sin(p.squash_rad)
    size, turned = p.squash_m * start / HOST_M_PER_S2, 2.0 * (azimuth - p.squash_rad)
    return size * np.cos(turned), -2.0 * size * np.sin(turned)


@compiled
def slipped(time: float, p: PlantParameters) -> tuple[float, float]:
    """How far the wall has slipped from its place in the Host (x, y): from one side of it to the other in a run."""
    way = p.slipping_m * (2.0 * time / p.duration_s - 1.0)
    return way * np.cos(p.slipping_rad), way * np.sin(p.slipping_rad)


@compiled
def slipping(p: PlantParameters) -> tuple[float, float]:
    """How fast it does so (x, y)."""
    speed = 2.0 * p.slipping_m / p.duration_s
    return speed * np.cos(p.slipping_rad), speed * np.sin(p.slipping_rad)
