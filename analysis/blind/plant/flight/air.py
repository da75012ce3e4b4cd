"""Forces of the air: drag in the room and in the Host, of a sail, lift of the spin, streams, a cushion at the wall,
jets."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, SPIN, VX, VY

JET_M = 0.018  # between two holes of an air table: somewhat less than the disk is wide
GUST_S = 5e-3  # within which a draught sets in: no step for the integrator
SWITCHED = 0.05  # of a sine, within which a blower runs up or down: no step for the integrator
AIR_GAP_M = 1e-3  # between a rounded rim and the wall that they touch, as wide as a gap of air that drags as much
CUSHION_M = 0.008  # from the wall, within which the air between it and the disk falls off


@inlined
def drag_rate(vx: float, vy: float, p: PlantParameters) -> float:
    """Drag in the room over the velocity (1 / s): with it, and with its square."""
    return p.viscous_per_s + p.air_per_m * np.sqrt(vx**2 + vy**2)


@inlined
def add_air(at: Instant, p: PlantParameters, out: Floats) -> None:
    """All that comes beside the plain drag."""
    _add_room(at.time, at.state, p, out)
    _add_sail(at.state, p, out)
    _add_stream(at, p, out)
    _add_host(at, p, out)
    _add_updraught(at, p, out)
    _add_cushion(at, p, out)
    _add_jets(at, p, out)


@inlined
def _add_room(time: float, state: Floats, p: PlantParameters, out: Floats) -> None:
    """Air of the room: across the way of a spinning disk, with the third power of the speed, along a rail.

    Of air that flows past the disk in layers, too slowly for eddies, the drag goes with the power 3/2 of the speed:
    `laminar_m_per_s2` (v / 1 m/s)^(3/2).

    A disk that spins stirs the air around it and drags the more of it along: `churned` |w| v, w its spin.

    A fan, of an amplifier or a lamp, blows it past the rig at `fan_m_per_s` towards `fan_rad`: the drag is `fan_per_m`
    |u| u, u the disk's velocity against that.
    A blower that switches itself on and off, on with the recording, pushes the disk by `blower_m_per_s2` towards
    `blower_rad` while sin(`blower_rad_per_s` t) is above 0, t the `time` in the run.
    Somebody opens a door in each run: from the share `gust_share` of it on a draught pushes the disk by `gust_m_per_s2`
    towards `gust_rad`.
    """
    vx, vy = state[VX], state[VY]
    out[VX] -= p.magnus * state[SPIN] * vy
    out[VY] += p.magnus * state[SPIN] * vx
    if p.cubic_s_per_m2 != 0.0:
        slowed = p.cubic_s_per_m2 * (vx**2 + vy**2)
        out[VX] -= slowed * vx
        out[VY] -= slowed * vy
    if p.laminar_m_per_s2 != 0.0:
        slowed = p.laminar_m_per_s2 * np.sqrt(np.sqrt(vx**2 + vy**2))
        out[VX] -= slowed * vx
        out[VY] -= slowed * vy
    if p.churned != 0.0:
        slowed = p.churned * abs(state[SPIN])
        out[VX] -= slowed * vx
        out[VY] -= slowed * vy
    if p.fan_per_m != 0.0:
        ux, uy = vx - p.fan_m_per_s * np.cos(p.fan_rad), vy - p.fan_m_per_s * np.sin(p.fan_rad)
        rate = p.fan_per_m * np.sqrt(ux * ux + uy * uy)
        out[VX] -= rate * ux
        out[VY] -= rate * uy
    if p.blower_m_per_s2 != 0.0:
        swing = np.sin(p.blower_rad_per_s * time)
        push = p.blower_m_per_s2 * 0.5 * (1.0 + np.tanh(swing / SWITCHED))
        out[VX] += push * np.cos(p.blower_rad)
        out[VY] += push * np.sin(p.blower_rad)
    if p.gust_m_per_s2 != 0.0:
        push = p.gust_m_per_s2 * 0.5 * (1.0 + np.tanh((time - p.gust_share * p.duration_s) / GUST_S))
        out[VX] += push * np.cos(p.gust_rad)
        out[VY] += push * np.sin(p.gust_rad)
    if p.rail_per_s != 0.0:
        a, b = np.cos(p.rail_rad), np.sin(p.rail_rad)
        along = p.rail_per_s * (a * vx + b * vy)
        out[VX] -= along * a
        out[VY] -= along * b


@inlined
def _add_sail(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A sticker folded up across the disk's middle is a sail.

    The air of the room presses on it only by the speed u across it, along its own normal, which lies `sail_rad` from
    the disk's angle: by `sail_per_m` u |u|.
    """
    if p.sail_per_m != 0.0:
        a, b = np.cos(state[ANGLE] + p.sail_rad), np.sin(state[ANGLE] + p.sail_rad)
        across = a * state[VX] + b * state[VY]
        push = p.sail_per_m * abs(across) * across
        out[VX] -= push * a
        out[VY] -= push * b


@inlined
def _add_stream(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A stream along a line across the ring."""
    if p.stream_per_s != 0.0:
        a, b = np.cos(p.stream_rad), np.sin(p.stream_rad)
        across = (b * at.x - a * at.y) / p.stream_width_m
        carried = p.stream_per_s * np.exp(-0.5 * across**2)
        out[VX] += carried * (p.stream_m_per_s * a - at.state[VX])
        out[VY] += carried * (p.stream_m_per_s * b - at.state[VY])


@inlined
def _add_host(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Air that goes with the Host below a lid, and air that the Host pumps through a gap below its wall."""
    if p.enclosed_per_m != 0.0:
        rate = p.enclosed_per_m * np.sqrt(at.rate_x**2 + at.rate_y**2)
        out[VX] -= rate * at.rate_x
        out[VY] -= rate * at.rate_y
    if p.bellows_m_per_s2 != 0.0:
        velocity = at.host_velocity
        blown = p.bellows_m_per_s2 * np.sqrt(velocity[0] ** 2 + velocity[1] ** 2) / HOST_M_PER_S**2
        out[VX] += blown * velocity[0]
        out[VY] += blown * velocity[1]


@inlined
def _add_updraught(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Lamps that are switched on for each run warm the floor, and air rises over it that flows outwards below, ever
    more: `updraught_per_s2` (x, y) times the share of the run that has passed."""
    if p.updraught_per_s2 != 0.0:
        push = p.updraught_per_s2 * min(max(at.time, 0.0) / p.duration_s, 1.0)
        out[VX] += push * at.x
        out[VY] += push * at.y


@inlined
def _add_cushion(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Air that a thick washer presses out between its rim and the wall, and draws in again.

    A film of air between two faces drags the more the thinner it is: by `air_gap_m_per_s` / (d + `AIR_GAP_M`) times the
    disk's speed towards the wall or away from it, d the way to it.
    """
    if p.air_gap_m_per_s != 0.0:
        radius = np.sqrt(at.x * at.x + at.y * at.y) + 1e-12
        rate = p.air_gap_m_per_s / (max(p.contact_radius_m - radius, 0.0) + AIR_GAP_M)
        radial = rate * (at.rate_x * at.x + at.rate_y * at.y) / radius
        out[VX] -= radial * at.x / radius
        out[VY] -= radial * at.y / radius
    if p.cushion_per_s != 0.0:
        radius = np.sqrt(at.x * at.x + at.y * at.y) + 1e-12
        rate = p.cushion_per_s * np.exp((radius - p.contact_radius_m) / CUSHION_M)
        radial = rate * (at.rate_x * at.x + at.rate_y * at.y) / radius
        out[VX] -= radial * at.x / radius
        out[VY] -= radial * at.y / radius


@inlined
def _add_jets(at: Instant, p: PlantParameters, out: Floats) -> None:
    """Jets from a square grid of holes in the floor, `JET_M` apart, push the disk from each to the next: along x by
    `jets_m_per_s2` sin(2 pi x / `JET_M` + `jets_x_rad`), and so along y."""
    if p.jets_m_per_s2 != 0.0:
        out[VX] += p.jets_m_per_s2 * np.sin(2.0 * np.pi * at.x / JET_M + p.jets_x_rad)
        out[VY] += p.jets_m_per_s2 * np.sin(2.0 * np.pi * at.y / JET_M + p.jets_y_rad)
