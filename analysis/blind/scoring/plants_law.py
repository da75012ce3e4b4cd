"""What an unlisted cause does by the plant's own law, where the disk really was: along flights, and to blows.

The plant is asked twice at the same state, with the cause and without it.  The difference holds its sizes, its places
and whatever disk, floor and wall remember; nothing of it is fitted.  What chance draws of a cause is in it, too: no
formula can know that.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.blind.cause import Draft
from analysis.blind.causes.named import physics_of_run, without_cause
from analysis.blind.plant.dynamics import Motion, host_lines_at, remembered_at
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import SPIN, VX, VY
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.recording.place import Place

Array = NDArray[np.float64]
BEFORE_S = 1e-12  # an impact's node before it: the disk as it comes
# Rounds in which the restitution of a blow as hard settles; a share of it that a number of the plant must move.
SETTLED, LEAST = 3, 0.05


class BlowChanges(NamedTuple):
    """What a cause changes of the K blows of a run, in the rig's units: ``time_s`` (K,) from the run's first frame;
    ``restitution``; of the impulse per mass along the wall, counterclockwise, what the contact point's speed shows
    (``along_m_per_s``) and what the spin does beyond it (``turned_m_per_s``), beside a blow as hard as this one; how
    much farther the wall lets the disk (``reach_m``)."""

    time_s: Array
    restitution: Array
    along_m_per_s: Array
    turned_m_per_s: Array
    reach_m: Array


def physics_without(draft: Draft, cause: str, run: int, runs: int, motion: Motion) -> PlantParameters:
    """The numbers of a run as they were without ``cause``; `ValueError` where that cannot be known."""
    physics = motion.physics
    return physics_of_run(without_cause(draft, cause, runs), run, physics.drive_rad_per_s, physics.duration_s)


def pushes(motion: Motion, without: PlantParameters, time_s: Array, place: Place) -> Array:
    """Accelerations and turn (N, 3: m/s^2 along the world's x and y, rad/s^2) that the cause adds at ``time_s`` (N,) of
    the rig's clock, from the run's first frame.

    ``motion`` must be remembered.  Beyond its ends the push is none."""
    at = time_s / place.slower
    table, states = disk_friction_table(), remembered_at(motion, at)
    more = np.zeros((len(at), 3))
    inside = (at >= motion.nodes[0, 0]) & (at <= motion.nodes[-1, 0])
    lines = host_lines_at(motion, at)
    for i in np.flatnonzero(inside):
        rates = [derivative(at[i], states[i], p, lines[i], table) for p in (motion.physics, without)]
        more[i] = (rates[0] - rates[1])[[VX, VY, SPIN]]
    c, s = np.cos(place.turned_rad), np.sin(place.turned_rad)
    return more @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0 / place.scale]])


def blow_changes(motion: Motion, without: PlantParameters, place: Place) -> BlowChanges:
    """What the cause changes of each blow that leads away from the wall; ``motion`` must be remembered."""
    instant = motion.impacts[:, 0]
    states, lines = remembered_at(motion, instant - BEFORE_S), host_lines_at(motion, instant - BEFORE_S)
    rows = [
        _changed(_Met(*one), motion.physics, without)
        for one in zip(instant, states, lines, motion.chances, strict=True)
    ]
    restitution, along, turned, reach = np.reshape(rows, (-1, 4)).T
    slow = place.slower
    return BlowChanges(instant * slow, restitution, along * slow, turned * slow, reach * place.scale)


class _Met(NamedTuple):
    """A disk's state as it meets the wall, the Host's lines then and the blow's chances."""

    time: float
    state: Array
    lines: Array
    chances: Array

    def after(self, p: PlantParameters) -> tuple[Array, float]:
        """The velocity and the spin (3,) that the blow leaves, and its approach."""
        new, approach, _ = impact(self.time, self.state, p, self.lines, self.chances, 1.0)
        return new[[VX, VY, SPIN]], approach

    def gap(self, p: PlantParameters) -> tuple[float, float, float]:
        """How far the wall is, and its outward normal."""
        return wall_gap(self.time, self.state, p, self.lines)


def _changed(met: _Met, p: PlantParameters, without: PlantParameters) -> Array:
    """Changes (4,) of one blow: of the restitution, along the wall, of the spin beyond that, of the wall's reach."""
    (after, approach), (plain, _) = met.after(p), met.after(without)
    if not approach > 0.0:
        return np.full(4, np.nan)
    gap, nx, ny = met.gap(without)
    normal, tangent = np.array([nx, ny, 0.0]), np.array([-ny, nx, 0.0])
    restitution = float(-normal @ (after - plain)) / approach
    # Friction goes with the normal impulse, which is measured: what a harder blow rubs more is no change of it.
    level, step = plain, restitution
    for _ in range(SETTLED if restitution != 0.0 else 0):
        level, _ = met.after(without._replace(restitution=without.restitution + step))
        reached = float(-normal @ (level - plain)) / approach
        step *= restitution / reached if abs(reached) > LEAST * abs(restitution) else 1.0
    q, more = p.inertia_factor, after - level
    spun = p.disk_radius_m * float(more[2])
    along = (float(tangent @ more) + spun) * q / (1.0 + q)
    return np.array([restitution, along, q * spun - along, met.gap(p)[0] - gap])
