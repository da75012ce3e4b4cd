"""What a run is asked about: names of the start, the numbers and the drive as columns of tangents."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ovines.core.ensemble import STATE_PLACES
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity import tangents as T
from ovines.core.system import parameters as P
from ovines.core.system.packed import Packed

# Rows of a tangent of the numbers: what a column changes, per unit of its name.
(
    Q_RESTITUTION, Q_WALL_FRICTION, Q_REVERSAL, Q_FLOOR, Q_AMPLITUDE, Q_FREQUENCY, Q_PHASE, Q_RADIUS, Q_CONTACT,
    Q_OBSTACLE, Q_MASS, Q_INVERSE_MASS, Q_INVERSE_INERTIA,
) = range(13)  # fmt: skip
N_Q = 13

NUMBERS = {
    "restitution": Q_RESTITUTION, "wall_friction": Q_WALL_FRICTION, "tangential_restitution": Q_REVERSAL,
    "floor_friction": Q_FLOOR, "drive_amplitude_factor": Q_AMPLITUDE, "drive_frequency_factor": Q_FREQUENCY,
    "drive_phase_shift_rad": Q_PHASE,
}  # fmt: skip
SIZES = ("nes_radius_m", "nes_mass_kg", "host_radius_m")
NAMES = (*STATE_PLACES, *NUMBERS, *SIZES)


def row_of(name: str) -> int:
    """Row of a state's name among the twelve."""
    place = STATE_PLACES[name]
    return place if place < P.ENERGIES else place - P.HOST + T.HOST_X


def names_for(packed: Packed) -> tuple[str, ...]:
    """Every name that means something for this run."""
    movable = packed.k[P.HOST_KIND] in (P.FREE, P.SPRUNG)
    return tuple(
        name
        for name in NAMES
        if (movable or not name.startswith("host_") or name == "host_radius_m")
        and (len(packed.drive) > 0 or not name.startswith("drive_"))
        and (name != "host_radius_m" or not (movable or packed.k[P.N_WALLS] > P.EDGES))  # its inertia would change
        and (packed.p[P.FLOOR_FRICTION] > 0.0 or name != "floor_friction")  # at 0 a force appears: one-sided
    )


def tangents_of(packed: Packed, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Tangents (12, m) of the start and (13, m) of the numbers, a column per name; refuses what is not there."""
    known = names_for(packed)
    p = packed.p
    state, numbers = np.zeros((T.N_ROWS, len(names))), np.zeros((N_Q, len(names)))
    for j, name in enumerate(names):
        if name not in known or name in names[:j]:
            raise ScenarioError(
                f"a sensitivity to {name!r}", "names, each once, out of " + ", ".join(known), "correct the name"
            )
        if name in STATE_PLACES:
            state[row_of(name), j] = 1.0
        elif name in NUMBERS:
            numbers[NUMBERS[name], j] = 1.0
        elif name == "nes_radius_m":
            numbers[Q_RADIUS, j] = 1.0
            numbers[Q_CONTACT, j], numbers[Q_OBSTACLE, j] = -1.0, 1.0
            numbers[Q_INVERSE_INERTIA, j] = -2.0 / (p[P.RADIUS] * p[P.INERTIA])
        elif name == "nes_mass_kg":
            numbers[Q_MASS, j], numbers[Q_INVERSE_MASS, j] = 1.0, -1.0 / p[P.MASS] ** 2
            numbers[Q_INVERSE_INERTIA, j] = -1.0 / (p[P.MASS] * p[P.INERTIA])
        else:
            numbers[Q_CONTACT, j] = 1.0
    return state, numbers


def refuse_unfollowed(packed: Packed) -> None:
    """`ScenarioError` for what the variational equations leave out."""
    p, k = packed.p, packed.k
    reasons = (
        (k[P.OFF_CENTRE] != 0, "effects.mass_centre_offset"),
        (p[P.CONTACT_DURATION] > 0.0, "effects.finite_contact_time"),
        (p[P.ROCKING] != 0.0, "effects.nes_rocking"),
        (packed.law.shape[0] > 0, "a written law"),
        (p[P.WALL_SHAPE] != 0.0, "a wall that is not round (effects.wall_ellipticity, effects.wall_lobes)"),
    )
    for found, name in reasons:
        if found:
            raise ScenarioError(
                f"sensitivities with {name}",
                "instant impacts of a centred disk on round or flat walls",
                "leave the effect out, or take differences of two runs",
            )
