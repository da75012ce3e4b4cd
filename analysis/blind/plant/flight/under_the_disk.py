"""Forces of what lies under the disk, and of how it stands there: a mat, dust, a wobble, films of oil and air, feet
that hunt."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    APPROACH,
    COUNT,
    IMPACT_S,
    NORMAL,
    PRINT_X,
    PRINT_Y,
    SPIN,
    VX,
    VY,
    WAY,
    WAY_BEFORE,
)

MAT_S = 0.04  # in which a soft floor forgets where the disk stood: most of a flight
BOW_M = 0.02  # way on which most of the dust that a disk can push has gathered before it
WOBBLE_S = 0.04  # in which a wobble dies out: most of a flight
HUNT_M = 0.045  # way on which a disk hunts once to and fro: most of a flight
THIN_S = 0.04  # in which a film of air has thinned after a blow by two thirds: most of a flight


@inlined
def add_mat(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A mat keeps the disk's print for `MAT_S`, and the disk would fall back into it."""
    if p.mat_per_s2 != 0.0:
        behind_x, behind_y = at.x - at.state[PRINT_X], at.y - at.state[PRINT_Y]
        out[VX] -= p.mat_per_s2 * behind_x
        out[VY] -= p.mat_per_s2 * behind_y
        out[PRINT_X], out[PRINT_Y] = behind_x / MAT_S, behind_y / MAT_S


@inlined
def add_dust(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A disk sweeps dust together and pushes it along, until the next blow scatters it: against its slip over the floor
    acts `bow_m_per_s2` (1 - exp(-s / `BOW_M`)), s the way slid since the last blow."""
    if p.bow_m_per_s2 != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2) + p.smoothing_m_per_s
        slid = max(at.state[WAY] - at.state[WAY_BEFORE], 0.0)
        push = p.bow_m_per_s2 * (1.0 - np.exp(-slid / BOW_M)) / speed
        out[VX] -= push * at.slip_x
        out[VY] -= push * at.slip_y


@inlined
def add_wobble(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A blow makes a washer wobble like a coin: where it stands goes round, and it is pushed towards there.

    A time t after a blow with the approach v it is pushed by `wobble_per_s` v exp(-t / `WOBBLE_S`), at first along the
    blow's normal, then turned from it by `wobble_rad_per_s` t.
    """
    late = at.time - at.state[IMPACT_S]
    if p.wobble_per_s != 0.0 and at.state[COUNT] > 0.5 and late >= 0.0:
        push = p.wobble_per_s * at.state[APPROACH] * np.exp(-late / WOBBLE_S)
        turned = at.state[NORMAL] + p.wobble_rad_per_s * late
        out[VX] += push * np.cos(turned)
        out[VY] += push * np.sin(turned)


@inlined
def add_films(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A thin film of oil between disk and floor is sheared: it holds back by `oil_film_per_s` times the slip, and turns
    back in proportion to the spin over the floor, as a film of the same thickness everywhere does.

    A film that warms as it is sheared, or is rubbed off, does so ever less in a run and is laid anew before the next:
    by `fading_film_per_s` exp(-t / `fading_film_s`), t the time in the run.
    One that gums up with dust does so more from run to run: by `gummed_per_s`, the run's own.
    Grease that has crept from the wall lies the thicker the nearer to it: by `crept_film_per_s` (r /
    `contact_radius_m`)^4, r the way from the Host's centre.
    So does a film of air, which a blow fills as it lifts the disk and whose air is then pressed out: by
    `thin_film_per_s` (1 - exp(-the time since the last blow / `THIN_S`)); before any blow by all of it.
    """
    if p.oil_film_per_s != 0.0:
        _shear(p.oil_film_per_s, at, p, out)
    if p.fading_film_per_s != 0.0:
        _shear(p.fading_film_per_s * np.exp(-max(at.time, 0.0) / p.fading_film_s), at, p, out)
    if p.gummed_per_s != 0.0:
        _shear(p.gummed_per_s, at, p, out)
    if p.crept_film_per_s != 0.0:
        near = (at.x * at.x + at.y * at.y) / p.contact_radius_m**2
        _shear(p.crept_film_per_s * near**2, at, p, out)
    if p.thin_film_per_s != 0.0:
        late = max(at.time - at.state[IMPACT_S], 0.0)
        left = np.exp(-late / THIN_S) if at.state[COUNT] > 0.5 else 0.0
        _shear(p.thin_film_per_s * (1.0 - left), at, p, out)


@inlined
def _shear(rate_per_s: float, at: Instant, p: PlantParameters, out: Floats) -> None:
    """The drag of a film on the slip and on the spin over the floor."""
    push_x, push_y = -rate_per_s * at.slip_x, -rate_per_s * at.slip_y
    out[VX] += push_x
    out[VY] += push_y
    turn = at.arm_x * push_y - at.arm_y * push_x - 0.5 * rate_per_s * p.disk_radius_m**2 * at.turning
    out[SPIN] += turn / (p.inertia_factor * p.disk_radius_m**2)


@inlined
def add_hunting(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A washer on feet hunts like a wheelset on rails, by the way and not by the time: it is pushed to the left of its
    slip over the floor by `hunting_m_per_s2` sin(2 pi s / `HUNT_M`), s the way slid since the last blow."""
    if p.hunting_m_per_s2 != 0.0:
        speed = np.sqrt(at.slip_x**2 + at.slip_y**2) + p.smoothing_m_per_s
        slid = max(at.state[WAY] - at.state[WAY_BEFORE], 0.0)
        push = p.hunting_m_per_s2 * np.sin(2.0 * np.pi * slid / HUNT_M) / speed
        out[VX] -= push * at.slip_y
        out[VY] += push * at.slip_x
