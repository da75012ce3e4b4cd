"""Forces of magnets, of charge and of threads, and of a washer that drives itself."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, AZIMUTH, BLOWS, COUNT, IMPACT_S, SPIN, VX, VY, WAY, WAY_BEFORE, X, Y

CORE_M = 0.002  # from the Host's centre, within which a charged disk is drawn to no side
IMAGE_M = 0.005  # from the wall, at which a charge of the disk's edge is drawn to it a quarter as much
CHARGE_M = 0.03  # way on which most of the charge that a disk can hold has gathered
FIELD_M = 0.04  # way along x on which the shaker's stray field falls off
MAGNET_M = 0.15  # along x, from the middle of the room to the shaker's magnet
HYSTERESIS_M_PER_S = 0.02  # speed below which a hysteresis brake comes in: no step for the integrator
EDDY_M = 0.008  # from the wall, within which a magnetised rim's eddies in it fall off
THREAD_M, THREAD_S = 0.015, 0.03  # a thread of glue breaks at this length, and lets go by itself after this time
THREAD_EDGE_M = 5e-4  # length within which it becomes taut: no step for the integrator


@inlined
def add_fields(at: Instant, p: PlantParameters, out: Floats) -> None:
    """All of them, with the torques of a magnetised disk."""
    _add_pulls(at, p, out)
    _add_charge(at, p, out)
    _add_poles(at, p, out)
    _add_eddies(at, p, out)
    _add_leaning(at.state, p, out)
    _add_hysteresis(at.state, p, out)
    _add_threads(at, p, out)


@inlined
def _add_pulls(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Of a steel disk: to a magnet in the room, to the wall, round the Host's centre, to the shaker's coil, which draws
    with the square of its current as of the Host's acceleration.

    The shaker's magnet, at one side of the room, draws it with the inverse fourth power of the distance; the floor was
    levelled with the disk at rest in the middle, which leaves `magnet_m_per_s2` ((`MAGNET_M` / distance)^4 - 1).
    A magnet that stands in the room draws it along one line, evenly more along that: by `lab_pull_per_s2` (s -
    `lab_pull_m`), s its place in the room along `lab_pull_rad`.
    A steel ring that a magnetic chuck has held has two poles: `_add_ring_poles`.
    """
    if p.pull_m_per_s2 != 0.0:
        away_x, away_y = p.pull_x_m - at.state[X], p.pull_y_m - at.state[Y]
        near = p.pull_m_per_s2 / p.pull_width_m * np.exp(0.5 - 0.5 * (away_x**2 + away_y**2) / p.pull_width_m**2)
        out[VX] += near * away_x
        out[VY] += near * away_y
    if p.wall_pull_m_per_s2 != 0.0:
        radius = np.sqrt(at.x * at.x + at.y * at.y) + 1e-12
        pull = p.wall_pull_m_per_s2 * np.exp((radius - p.contact_radius_m) / p.wall_pull_m)
        out[VX] += pull * at.x / radius
        out[VY] += pull * at.y / radius
    out[VX] -= p.swirl_per_s2 * at.y
    out[VY] += p.swirl_per_s2 * at.x
    if p.coil_m_per_s2 != 0.0:
        acceleration = at.host_acceleration
        pull = p.coil_m_per_s2 * (acceleration[0] ** 2 + acceleration[1] ** 2) / HOST_M_PER_S2**2
        out[VX] += pull * np.cos(p.coil_rad)
        out[VY] += pull * np.sin(p.coil_rad)
    if p.ring_poles_m_per_s2 != 0.0:
        _add_ring_poles(at, p, out)
    if p.lab_pull_per_s2 != 0.0:
        a, b = np.cos(p.lab_pull_rad), np.sin(p.lab_pull_rad)
        pull = p.lab_pull_per_s2 * (a * at.state[X] + b * at.state[Y] - p.lab_pull_m)
        out[VX] += pull * a
        out[VY] += pull * b
    if p.magnet_m_per_s2 != 0.0:
        side = 1.0 if p.magnet_m_per_s2 > 0.0 else -1.0
        near = MAGNET_M / (MAGNET_M - side * at.state[X])
        out[VX] += p.magnet_m_per_s2 * (near**4 - 1.0)


@inlined
def _add_ring_poles(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A ring that is magnetised across draws a disk of steel to its poles at `ring_poles_rad` and opposite.

    Its energy per unit mass is -`ring_poles_m_per_s2` `contact_radius_m` / 6 (r / `contact_radius_m`)^6 cos^2(azimuth -
    `ring_poles_rad`); the force is that one's.
    """
    a, b = np.cos(p.ring_poles_rad), np.sin(p.ring_poles_rad)
    along = (a * at.x + b * at.y) / p.contact_radius_m
    square = (at.x * at.x + at.y * at.y) / p.contact_radius_m**2
    by_place = p.ring_poles_m_per_s2 * 2.0 / 3.0 * square * along**2 / p.contact_radius_m
    by_line = p.ring_poles_m_per_s2 / 3.0 * square**2 * along
    out[VX] += by_place * at.x + by_line * a
    out[VY] += by_place * at.y + by_line * b


@inlined
def _add_charge(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Sliding charges a disk, and the metal ring draws it outwards; a blow discharges it: `charged_per_s2` (x, y)
    (1 - exp(-s / `CHARGE_M`)), s the way slid since the last blow.

    A disk whose charge stays the same is drawn to its image in a metal ring: by `image_m_per_s2` (`IMAGE_M` / (d +
    `IMAGE_M`))^2, d its way to the wall.
    A disk that each of n blows charges is drawn to the wall: by `struck_charge_m_per_s2` n (R / d)^2, R its radius and
    d the way from its middle to the wall.
    """
    if p.charged_per_s2 != 0.0:
        slid = max(at.state[WAY] - at.state[WAY_BEFORE], 0.0)
        pull = p.charged_per_s2 * (1.0 - np.exp(-slid / CHARGE_M))
        out[VX] += pull * at.x
        out[VY] += pull * at.y
    if p.image_m_per_s2 != 0.0:
        square = at.x * at.x + at.y * at.y
        far = max(p.contact_radius_m - np.sqrt(square), 0.0) / IMAGE_M
        pull = p.image_m_per_s2 / (1.0 + far) ** 2 / np.sqrt(square + CORE_M**2)
        out[VX] += pull * at.x
        out[VY] += pull * at.y
    if p.struck_charge_m_per_s2 != 0.0:
        square = at.x * at.x + at.y * at.y
        away = max(p.contact_radius_m + p.disk_radius_m - np.sqrt(square), p.disk_radius_m) / p.disk_radius_m
        pull = p.struck_charge_m_per_s2 * at.state[BLOWS] / away**2 / np.sqrt(square + CORE_M**2)
        out[VX] += pull * at.x
        out[VY] += pull * at.y


@inlined
def _add_poles(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A magnetised disk between two opposed poles, and in a steel ring.

    Between the poles the field is B (x, -y): a dipole m is pushed by B (mx, -my), the same everywhere, and turned by
    B (-mx y - my x).
    In a ring a pole that looks to the wall is drawn there, and a disk that lies across is pushed off.  Its energy per
    unit mass is -`poled_m_per_s2` r^2 / (2 `contact_radius_m`) cos 2(azimuth - angle - `poled_rad`); the force and the
    torque are that one's.
    """
    x, y, inertia = at.x, at.y, p.inertia_factor * p.disk_radius_m**2
    if p.poles_m_per_s2 != 0.0:
        along, across = np.cos(at.state[ANGLE] + p.poles_rad), np.sin(at.state[ANGLE] + p.poles_rad)
        out[VX] += p.poles_m_per_s2 * along
        out[VY] -= p.poles_m_per_s2 * across
        out[SPIN] -= p.poles_m_per_s2 * (along * y + across * x) / inertia
    if p.poled_m_per_s2 != 0.0:
        size, turned = p.poled_m_per_s2 / p.contact_radius_m, 2.0 * (at.state[ANGLE] + p.poled_rad)
        c, s = np.cos(turned), np.sin(turned)
        out[VX] += size * (x * c + y * s)
        out[VY] += size * (x * s - y * c)
        out[SPIN] += size * (2.0 * x * y * c - (x * x - y * y) * s) / inertia


@inlined
def _add_eddies(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A magnet under the Host's floor brakes what moves over it; and a ring of aluminium the rim of a magnetised disk.

    So does the stray field of the shaker's magnet, which stands at one side of the room: `stray_field_per_s` exp(x /
    `FIELD_M`) times the disk's velocity, x its place in the room towards the shaker; a field that is even over the disk
    leaves its spin alone.

    In the ring acts `eddied_per_s` exp(-(the disk's way to the wall) / `EDDY_M`) times the rim's own speed along the
    wall next to it, against it.
    """
    if p.eddy_per_s != 0.0:
        far = ((at.x - p.eddy_x_m) ** 2 + (at.y - p.eddy_y_m) ** 2) / p.eddy_width_m**2
        rate = p.eddy_per_s * np.exp(-0.5 * far)
        out[VX] -= rate * at.rate_x
        out[VY] -= rate * at.rate_y
    if p.stray_field_per_s != 0.0:
        side = 1.0 if p.stray_field_per_s > 0.0 else -1.0
        rate = abs(p.stray_field_per_s) * np.exp(side * at.state[X] / FIELD_M)
        out[VX] -= rate * at.state[VX]
        out[VY] -= rate * at.state[VY]
    radius = np.sqrt(at.x * at.x + at.y * at.y)
    if p.eddied_per_s != 0.0 and radius > 1e-9:
        nx, ny = at.x / radius, at.y / radius
        speed = -at.rate_x * ny + at.rate_y * nx + p.disk_radius_m * at.spin
        push = p.eddied_per_s * np.exp((radius - p.contact_radius_m) / EDDY_M) * speed
        out[VX] += push * ny
        out[VY] -= push * nx
        out[SPIN] -= push / (p.inertia_factor * p.disk_radius_m)


@inlined
def _add_leaning(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A washer that does not stand level creeps on a floor that shakes, always to the same side of itself: it is driven
    by `leaning_m_per_s2` towards `leaning_rad` of the disk, whose energy the shaker gives."""
    if p.leaning_m_per_s2 != 0.0:
        out[VX] += p.leaning_m_per_s2 * np.cos(state[ANGLE] + p.leaning_rad)
        out[VY] += p.leaning_m_per_s2 * np.sin(state[ANGLE] + p.leaning_rad)


@inlined
def _add_hysteresis(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A disk of hard steel that moves through the shaker's uneven field is magnetised to and fro, and loses the same
    energy on every metre of its way through the room: it is held back by `hysteresis_m_per_s2` at every speed well
    above `HYSTERESIS_M_PER_S`."""
    if p.hysteresis_m_per_s2 != 0.0:
        speed = np.sqrt(state[VX] ** 2 + state[VY] ** 2 + HYSTERESIS_M_PER_S**2)
        out[VX] -= p.hysteresis_m_per_s2 * state[VX] / speed
        out[VY] -= p.hysteresis_m_per_s2 * state[VY] / speed


@inlined
def _add_threads(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A thread from a point of the Host, slack at first; and a thread of glue from where the wall was hit the last
    time."""
    if p.tether_per_s2 != 0.0:
        away_x, away_y = p.tether_x_m - at.x, p.tether_y_m - at.y
        length = np.sqrt(away_x**2 + away_y**2) + 1e-12
        taut = p.tether_per_s2 * max(length - p.tether_slack_m, 0.0) / length
        out[VX] += taut * away_x
        out[VY] += taut * away_y
    late = at.time - at.state[IMPACT_S]
    if p.thread_m_per_s2 != 0.0 and at.state[COUNT] > 0.5 and 0.0 <= late < THREAD_S:
        back_x = p.contact_radius_m * np.cos(at.state[AZIMUTH]) - at.x
        back_y = p.contact_radius_m * np.sin(at.state[AZIMUTH]) - at.y
        length = np.sqrt(back_x**2 + back_y**2) + 1e-12
        if length < THREAD_M:
            pull = p.thread_m_per_s2 * np.tanh(length / THREAD_EDGE_M) / length
            out[VX] += pull * back_x
            out[VY] += pull * back_y
