"""Torques that leave the disk's way alone: of the air, of a field, of a wire, of its own face and core."""

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.flight.instant import Instant
from analysis.blind.plant.host import HOST_M_PER_S2
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import ANGLE, CORE, SPIN, VX, VY

RATCHET_EDGE_RAD_PER_S = 5.0  # spin within which a one-sided brake comes in: no step for the integrator
HUB_RAD_PER_S = 3.0  # and one that brakes either way
CORE_S = 0.03  # in which a loose core takes up the disk's spin: half of a flight


@inlined
def add_torques(at: Instant, p: PlantParameters, out: Floats) -> None:
    """All of them."""
    _add_air(at.state, p, out)
    _add_field(at, p, out)
    _add_face(at, p, out)
    _add_core(at.state, p, out)


@inlined
def _add_air(state: Floats, p: PlantParameters, out: Floats) -> None:
    """Drag of the spin; a draught that turns the disk like a windmill.

    Stickers that stand up stir the air of the room: `stirred` times the spin's square is lost.
    A sticker that has come off at one end stands up like a fin, and the air of the room turns the disk so that it
    trails: `vane_rad_per_s2` (v / 1 m/s)^2 sin(the way's direction - the disk's angle - `vane_rad`).
    """
    out[SPIN] -= p.spin_drag_per_s * state[SPIN]
    out[SPIN] -= p.windmill_per_s * (state[SPIN] - p.windmill_rad_per_s)
    out[SPIN] -= p.stirred * abs(state[SPIN]) * state[SPIN]
    if p.vane_rad_per_s2 != 0.0:
        c, s = np.cos(state[ANGLE] + p.vane_rad), np.sin(state[ANGLE] + p.vane_rad)
        speed = np.sqrt(state[VX] ** 2 + state[VY] ** 2)
        out[SPIN] += p.vane_rad_per_s2 * speed * (state[VY] * c - state[VX] * s)


@inlined
def _add_field(at: Instant, p: PlantParameters, out: Floats) -> None:
    """The disk turns like a compass needle, to one angle or to the nearer of two; in the shaker's alternating field, as
    of the Host's acceleration, to and fro; and a wire from the ceiling turns it back by `wound_per_s2` (angle -
    `wound_rad`), every turn counted."""
    angle = at.state[ANGLE]
    out[SPIN] -= p.needle_rad_per_s2 * np.sin(angle - p.needle_rad)
    out[SPIN] -= p.bistable_rad_per_s2 * np.sin(2.0 * (angle - p.bistable_rad))
    if p.alternating_rad_per_s2 != 0.0:
        current = at.host_acceleration[0] / HOST_M_PER_S2
        out[SPIN] += p.alternating_rad_per_s2 * current * np.sin(p.alternating_rad - angle)
    if p.wound_per_s2 != 0.0:
        out[SPIN] -= p.wound_per_s2 * (angle - p.wound_rad)


@inlined
def _add_face(at: Instant, p: PlantParameters, out: Floats) -> None:
    """A burr that catches in one sense of spin only.

    A face turned on a lathe has a spiral groove, which turns the disk like a screw as it slides: `spiral_rad_per_s2`
    (slip / 1 m/s), whatever the slip's direction.
    A burr around the washer's hole rubs like a pivot, by the same torque however fast: the spin over the floor is
    braked by `hub_rad_per_s2` tanh(spin / `HUB_RAD_PER_S`).
    """
    if p.ratchet_rad_per_s2 != 0.0:
        brake = abs(p.ratchet_rad_per_s2)
        sense = 1.0 if p.ratchet_rad_per_s2 > 0.0 else -1.0
        out[SPIN] -= sense * brake * max(np.tanh(sense * at.state[SPIN] / RATCHET_EDGE_RAD_PER_S), 0.0)
    if p.hub_rad_per_s2 != 0.0:
        out[SPIN] -= p.hub_rad_per_s2 * np.tanh(at.turning / HUB_RAD_PER_S)
    out[SPIN] += p.spiral_rad_per_s2 * np.sqrt(at.slip_x**2 + at.slip_y**2)


@inlined
def _add_core(state: Floats, p: PlantParameters, out: Floats) -> None:
    """A weight glued into the washer's hole turns in its soft glue: it takes up the spin within `CORE_S`, and holds the
    washer back by `core_per_s` times what it still lacks (rad/s)."""
    if p.core_per_s != 0.0:
        lacks = state[SPIN] - state[CORE]
        out[SPIN] -= p.core_per_s * lacks
        out[CORE] = lacks / CORE_S
