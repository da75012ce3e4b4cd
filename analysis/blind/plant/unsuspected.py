"""What the causes of `causes.unsuspected` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters
from analysis.blind.plant.unimagined import BEST_REBOUND

HOST_M_PER_S = 1.136  # the Host's full speed at 8 g and 11 Hz: what goes with its speed is stated for that
MIDDLE_M = 0.002  # from the Host's centre, within which marks around it have no direction
TRACK_M = 0.007  # half the width of a polished track, in which the disk's 20 mm meet it
BOW_M = 0.02  # way on which most of the dust that a disk can push has gathered before it
CORE_S = 0.03  # in which a loose core takes up the disk's spin: half of a flight
GUIDE_M_PER_S = 0.1  # speed of the Host from which on its carriage leans the whole way
SHIM_RAD = 0.7  # of the wall's azimuth: a shim as wide as the disk and a half
FLASH_M2_PER_S2 = 0.3  # approach times slip at which most of what may melt has melted
WIPED_S = 0.025  # in which oil creeps back onto a rim that a blow has wiped
LEAST_FRICTION = 0.02  # share of the wall's friction that neither heat nor oil takes
SPLIT_RAD = 0.1  # of the wall's azimuth, over which a split ring's halves go over into each other: 4 mm


@compiled
def concentric_traction(force_x: float, force_y: float, x: float, y: float, p: PlantParameters) -> tuple[float, float]:
    """The floor's traction (x, y) on a floor faced on a lathe; x, y (m) from the Host's centre.

    Its marks are circles: what slides across them, along the radius, is held by 1 + `rings` of the friction, what
    slides along them by 1 - `rings`.
    """
    radius = np.sqrt(x * x + y * y)
    if p.rings == 0.0 or radius < 1e-9:
        return force_x, force_y
    share = p.rings * radius / (radius + MIDDLE_M)
    a, b = x / radius, y / radius
    out, round_ = force_x * a + force_y * b, -force_x * b + force_y * a
    out, round_ = out * (1.0 + share), round_ * (1.0 - share)
    return out * a - round_ * b, out * b + round_ * a


@compiled
def unsuspected_friction(x: float, y: float, p: PlantParameters) -> float:
    """What the floor's friction is multiplied by; x, y (m) from the Host's centre.

    Months of use have polished a track around the centre: there it is less by `track`, falling off to either side
    of the radius `track_m` like a bell of `TRACK_M`.
    """
    if p.track == 0.0:
        return 1.0
    off = (np.sqrt(x * x + y * y) - p.track_m) / TRACK_M
    return max(1.0 - p.track * np.exp(-0.5 * off**2), 0.0)


@compiled
def add_bow(slip: tuple[float, float], state: Floats, p: PlantParameters, out: Floats) -> None:
    """A disk sweeps dust together and pushes it along, until the next blow scatters it: against its `slip` (m/s) over
    the floor acts `bow_m_per_s2` (1 - exp(-s / `BOW_M`)), s the way slid since the last blow."""
    if p.bow_m_per_s2 != 0.0:
        speed = np.sqrt(slip[0] ** 2 + slip[1] ** 2) + p.smoothing_m_per_s
        push = p.bow_m_per_s2 * (1.0 - np.exp(-max(state[8] - state[20], 0.0) / BOW_M)) / speed
        out[2] -= push * slip[0]
        out[3] -= push * slip[1]


@compiled
def add_vane(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A sticker that has come off at one end stands up like a fin, and the air of the room turns the disk so that it
    trails: `vane_rad_per_s2` (v / 1 m/s)^2 sin(the way's direction - the disk's angle - `vane_rad`)."""
    if p.vane_rad_per_s2 != 0.0:
        c, s = np.cos(state[4] + p.vane_rad), np.sin(state[4] + p.vane_rad)
        speed = np.sqrt(state[2] ** 2 + state[3] ** 2)
        out[5] += p.vane_rad_per_s2 * speed * (state[3] * c - state[2] * s)


@compiled
def add_core(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A weight glued into the washer's hole turns in its soft glue: it takes up the spin within `CORE_S`, and holds the
    washer back by `core_per_s` times what it still lacks (rad/s)."""
    if p.core_per_s != 0.0:
        lacks = state[5] - state[21]
        out[5] -= p.core_per_s * lacks
        out[21] = lacks / CORE_S


@compiled
def add_guide(host_velocity: Floats, p: PlantParameters, out: Floats) -> None:
    """The shaker's carriage has play in its guide: it leans to one side on the way there and to the other on the way
    back, and the floor with it, by `lean_m_per_s2` tanh(the Host's speed along x / `GUIDE_M_PER_S`)."""
    if p.lean_m_per_s2 != 0.0:
        lean = p.lean_m_per_s2 * np.tanh(host_velocity[0] / GUIDE_M_PER_S)
        out[2] += lean * np.cos(p.lean_rad)
        out[3] += lean * np.sin(p.lean_rad)


@compiled
def add_unsuspected_forces(
    slip: tuple[float, float], state: Floats, host_velocity: Floats, p: PlantParameters, out: Floats
) -> None:
    """All that comes on top of the floor's friction."""
    add_bow(slip, state, p, out)
    add_vane(state, p, out)
    add_core(state, p, out)
    add_guide(host_velocity, p, out)


@compiled
def unsuspected_rebound(rebound: float, time: float, azimuth: float, angle: float, p: PlantParameters) -> float:
    """Restitution of this impact, which was `rebound`, at `azimuth` of the wall, `angle` the disk's; nothing here
    raises it above `BEST_REBOUND`.

    A washer punched of rolled sheet is harder along the sheet's grain than across: `sheet` cos 2(rim - `sheet_rad`).
    A shim behind the ring wanders round it as the drive shakes it, each run from `shim_rad` on at `shim_rad_per_s`:
    where it just is the blow loses `shim`, falling off like a bell of `SHIM_RAD`.
    """
    gain = p.sheet * np.cos(2.0 * (azimuth - angle - p.sheet_rad))
    if p.shim != 0.0:
        off = azimuth - p.shim_rad - p.shim_rad_per_s * time
        gain -= p.shim * np.exp(-0.5 * (np.arctan2(np.sin(off), np.cos(off)) / SHIM_RAD) ** 2)
    return min(rebound + gain, max(rebound, BEST_REBOUND))


@compiled
def unsuspected_slide(time: float, approach: float, slip: float, state: Floats, p: PlantParameters) -> float:
    """What the wall's friction is multiplied by in this impact.

    A fast slip in a hard blow melts the plastic's surface: of the friction is lost `flash` (1 - exp(-approach |slip| /
    `FLASH_M2_PER_S2`)).  A blow wipes the oil off the rim, and it creeps back: at a blow `since` seconds after the one
    before is lost `creeping` (1 - exp(-since / `WIPED_S`)).
    """
    share = 1.0
    if p.flash != 0.0:
        share = max(1.0 - p.flash * (1.0 - np.exp(-approach * abs(slip) / FLASH_M2_PER_S2)), LEAST_FRICTION)
    if p.creeping != 0.0:
        oiled = (
            1.0 if state[13] < 0.5 else 1.0 - np.exp(-max(time - state[6], 0.0) / WIPED_S)
        )  # none before: oil all over
        share *= max(1.0 - p.creeping * oiled, LEAST_FRICTION)
    return share


@compiled
def flattened(spin: float, approach: float, p: PlantParameters) -> float:
    """Spin after a blow on a disk with a rubber ring around its rim: the harder the blow, the larger the flat on which
    it is held, and it loses `o_ring_s_per_m` times the approach of its spin."""
    return spin * max(1.0 - p.o_ring_s_per_m * approach, 0.0)


@compiled
def split_reach(azimuth: float, p: PlantParameters) -> tuple[float, float]:
    """How much farther the disk's middle gets along `azimuth` in a ring made of two halves that were put together
    askew, and the slope of that (m, m per rad).

    Along their joint, at `split_rad`, one half lies half of `split_m` this way and the other half of it that way.
    """
    if p.split_m == 0.0:
        return 0.0, 0.0
    c, s = np.cos(azimuth - p.split_rad), np.sin(azimuth - p.split_rad)
    half = np.tanh(s / SPLIT_RAD)
    return 0.5 * p.split_m * c * half, 0.5 * p.split_m * (c * c * (1.0 - half**2) / SPLIT_RAD - s * half)


@compiled
def trailing(rate: Floats, p: PlantParameters) -> tuple[float, float]:
    """How far a ring on thick soft tape is off (x, y): it trails behind the Host's velocity, by `trailing_m` at
    `HOST_M_PER_S`.  Of the Host's acceleration, in place of its velocity, it is the ring's own speed."""
    return -p.trailing_m * rate[0] / HOST_M_PER_S, -p.trailing_m * rate[1] / HOST_M_PER_S
