"""What the causes of `causes.untold` do to the plant's equations."""

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.state import PlantParameters
from analysis.blind.plant.unimagined import BEST_REBOUND

HOST_M_PER_S2 = 78.5  # 8 g of the Host: what goes with its acceleration is stated for that
EDDY_M = 0.008  # from the wall, within which a magnetised rim's eddies in it fall off
BEAD_AT_M = 0.02  # from the Host's centre to a bead of oil that goes round it
BEAD_M = 0.01  # from a bead's middle to where it wets half as well: it is as wide as the disk
SCALE_M_PER_S = 0.3  # slip from which on a blow lifts scales or lays them over
CORNER_M_PER_S = 0.2  # approach from which on a rim strikes with one corner: a slower one leans on two
LEAK_M2_PER_S2 = 3.0  # squared approaches that press half of its air out of a liner
SWOLLEN_RAD_PER_S = 40.0  # spin at which a band is as wide as on the mean
LEAST_FRICTION = 0.02  # share of the wall's friction that is always left


@compiled
def untold_friction(
    time: float,
    at: tuple[float, float],
    slip: tuple[float, float],
    spin: float,
    acceleration: Floats,
    p: PlantParameters,
) -> float:
    """What the floor's friction is multiplied by; `at` (m, from the Host's centre), `slip` (m/s) and `spin` (rad/s)
    over the floor, `acceleration` the Host's.

    A floor of bristles: their tips stay back as the Host is accelerated, and what slides against them is held: 1 +
    `bristled` (the acceleration along the slip / `HOST_M_PER_S2`), less as the rim goes round faster than the disk
    slides.
    A bead of oil is shaken round the floor, `BEAD_AT_M` from its middle and at `bead_rad` + `bead_rad_per_s` times the
    time in the run: over it the disk loses `bead` of its friction, falling off like a bell of `BEAD_M`.
    """
    share = 1.0
    if p.bristled != 0.0:
        rim = p.disk_radius_m * spin
        speed = np.sqrt(slip[0] ** 2 + slip[1] ** 2 + rim**2) + p.smoothing_m_per_s
        along = (slip[0] * acceleration[0] + slip[1] * acceleration[1]) / speed
        share *= max(1.0 + p.bristled * along / HOST_M_PER_S2, 0.0)
    if p.bead != 0.0:
        azimuth = p.bead_rad + p.bead_rad_per_s * time
        far = (at[0] - BEAD_AT_M * np.cos(azimuth)) ** 2 + (at[1] - BEAD_AT_M * np.sin(azimuth)) ** 2
        share *= max(1.0 - p.bead * np.exp(-0.5 * far / BEAD_M**2), 0.0)
    return share


@compiled
def add_eddies(x: float, y: float, slip: tuple[float, float], spin: float, p: PlantParameters, out: Floats) -> None:
    """A magnetised disk near a ring of aluminium: its rim is braked by the eddies that it draws along in the wall
    next to it.

    There acts `eddied_per_s` exp(-(its way to the wall) / `EDDY_M`) times the rim's own speed along the wall, against
    it; `slip` (m/s) and `spin` (rad/s) against the Host.
    """
    radius = np.sqrt(x * x + y * y)
    if p.eddied_per_s != 0.0 and radius > 1e-9:
        nx, ny = x / radius, y / radius
        speed = -slip[0] * ny + slip[1] * nx + p.disk_radius_m * spin
        push = p.eddied_per_s * np.exp((radius - p.contact_radius_m) / EDDY_M) * speed
        out[2] += push * ny
        out[3] -= push * nx
        out[5] -= push / (p.inertia_factor * p.disk_radius_m)


@compiled
def add_poles(x: float, y: float, angle: float, p: PlantParameters, out: Floats) -> None:
    """A magnetised disk in a steel ring: a pole that looks to the wall is drawn there, and a disk that lies across is
    pushed off.

    Its energy per unit mass is -`poled_m_per_s2` r^2 / (2 `contact_radius_m`) cos 2(azimuth - angle - `poled_rad`); the
    force and the torque are that one's.
    """
    if p.poled_m_per_s2 != 0.0:
        size, turned = p.poled_m_per_s2 / p.contact_radius_m, 2.0 * (angle + p.poled_rad)
        c, s = np.cos(turned), np.sin(turned)
        out[2] += size * (x * c + y * s)
        out[3] += size * (x * s - y * c)
        out[5] += size * (2.0 * x * y * c - (x * x - y * y) * s) / (p.inertia_factor * p.disk_radius_m**2)


@compiled
def add_untold_forces(
    x: float,
    y: float,
    slip: tuple[float, float],
    state: Floats,
    spin: float,
    acceleration: Floats,
    p: PlantParameters,
    out: Floats,
) -> None:
    """All that comes on top of the floor's friction; x, y (m) from the Host's centre, `slip` (m/s) and `spin` (rad/s)
    against the Host, `acceleration` the Host's.

    A wire from the ceiling to the disk's middle is wound up as it turns, and turns it back: by `wound_per_s2` (angle -
    `wound_rad`), every turn counted.
    A thin floor sheet, held at one end, buckles up as the Host is accelerated along x and sags as it is accelerated
    back: the disk slides down to all sides, or to the middle, by `buckled_per_s2` (x, y) (acceleration /
    `HOST_M_PER_S2`).
    """
    if p.wound_per_s2 != 0.0:
        out[5] -= p.wound_per_s2 * (state[4] - p.wound_rad)
    if p.buckled_per_s2 != 0.0:
        push = p.buckled_per_s2 * acceleration[0] / HOST_M_PER_S2
        out[2] += push * x
        out[3] += push * y
    add_eddies(x, y, slip, spin, p, out)
    add_poles(x, y, state[4], p, out)


@compiled
def untold_rebound(rebound: float, rim_rad: float, acceleration: Floats, state: Floats, p: PlantParameters) -> float:
    """Restitution of this impact, which was `rebound`; `rim_rad`: the struck place, in the disk; nothing here raises it
    above `BEST_REBOUND`.

    A loose rubber band around the rim is pushed to the other side of it by each blow: where it was struck the last time
    it is bare and hard, opposite the band lies double: `shifted` cos(`rim_rad` - the last one).
    A hollow ring is filled with lead shot, which rattles as the Host is accelerated, whichever way, and takes up the
    blow: `shot` (the size of the Host's acceleration / `HOST_M_PER_S2`) is lost.
    """
    gain = 0.0
    if p.shifted != 0.0 and state[13] > 0.5:  # there was an impact before
        gain += p.shifted * np.cos(rim_rad - state[24])
    if p.shot != 0.0:
        gain -= p.shot * np.sqrt(acceleration[0] ** 2 + acceleration[1] ** 2) / HOST_M_PER_S2
    return min(rebound + gain, max(rebound, BEST_REBOUND))


@compiled
def untold_slide(slip: float, normal_rad: float, p: PlantParameters) -> float:
    """What the wall's friction is multiplied by in this impact; `slip` counterclockwise.

    The rim is wiped with alcohol before some of the runs, and touched by hand before the others: 1 + `wiped`, the run's
    own.
    A wall ground from one side to the other has scales that all lie towards there, clockwise along one half of it and
    counterclockwise along the other: 1 + `scaly` tanh(slip / `SCALE_M_PER_S`) sin(`scaly_rad` - `normal_rad`).
    """
    share = 1.0
    if p.wiped != 0.0:
        share *= max(1.0 + p.wiped, LEAST_FRICTION)
    if p.scaly != 0.0:
        towards = np.tanh(slip / SCALE_M_PER_S) * np.sin(p.scaly_rad - normal_rad)
        share *= max(1.0 + p.scaly * towards, LEAST_FRICTION)
    return share


@compiled
def corner_lever(approach: float, rim_rad: float, p: PlantParameters) -> float:
    """How far beside the normal through the disk's middle (m, counterclockwise) the wall touches a rim that was filed
    to so many blunt corners: `cornered_m` sin(`corners` (`rim_rad` - `cornered_rad`)) tanh(`approach` /
    `CORNER_M_PER_S`), `rim_rad` the normal's direction in the disk."""
    return p.cornered_m * np.tanh(approach / CORNER_M_PER_S) * np.sin(p.corners * (rim_rad - p.cornered_rad))


@compiled
def leaked(pressed: float, p: PlantParameters) -> float:
    """How much farther the disk's middle gets (m) in a ring with a liner full of air, which blows press out through a
    narrow hole and a pump brings back: `leaking_m` (w - `LEAK_M2_PER_S2`) / (w + `LEAK_M2_PER_S2`), w = `pressed` the
    sum of the squared approaches of the blows before, each as it is left (`tiredness`)."""
    return p.leaking_m * (pressed - LEAK_M2_PER_S2) / (pressed + LEAK_M2_PER_S2)


@compiled
def swollen(spin: float, p: PlantParameters) -> float:
    """How much wider the disk's radius is (m) with a slack rubber band around it, which the spin draws wide:
    `swollen_m` (w^2 - `SWOLLEN_RAD_PER_S`^2) / (w^2 + `SWOLLEN_RAD_PER_S`^2)."""
    if p.swollen_m == 0.0:
        return 0.0
    return p.swollen_m * (spin**2 - SWOLLEN_RAD_PER_S**2) / (spin**2 + SWOLLEN_RAD_PER_S**2)
