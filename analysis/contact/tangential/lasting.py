"""Along the wall during a contact that lasts: a spring with a Coulomb limit, in place of stick or slide in an instant.

The normal force is a spring's and a damper's over half a period (effect ``finite_contact_time``); the tangential spring
is stretched by the slip and slides at ``mu F``.  Over the friction's impulse, what it gives depends on three numbers
only, however long the contact lasts: the impulse that would stop the slip over the friction's impulse, the restitution,
and the tangential spring's stiffness over the normal one's.  (For an elastic contact: Maw, Barber and Fawcett, Wear 38,
101 (1976).)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq, minimize

from analysis.contact.tangential.search import Impulses
from analysis.statistics.outliers import belongs

Array = NDArray[np.float64]
# Where the law is tabulated: stiffness (steel on steel: 0.82, Mindlin, times the mobility, which is 3 of a plain disk),
# the stopping impulse over the friction's, and midpoint steps in one contact.
STIFFNESS = np.geomspace(0.02, 20.0, 61)
STOPPING = np.concatenate([[0.0], np.geomspace(0.01, 50.0, 90)])
STEPS = 400
# The table is made for restitutions so far apart, and the least of them; no share changes by more than 0.6 of what the
# restitution does.  A damper however strong gives back exp(-2) = 0.135, for the wall never pulls.
RESTITUTION_STEP = 0.005
LEAST_RESTITUTION = 0.2
# A damper's decay in one contact by which even that restitution is passed.
MOST_DECAY = 4.0
# Starts of the fit's stiffness, and where it rests: in the logarithms, and in -2 log L.
STARTS, PLACES_AGREE, VALUES_AGREE = (0.5, 1.2, 2.5), 1e-4, 1e-3


@dataclass(frozen=True)
class LastingContact:
    """The tangential law of contacts that last: ``wall_friction``; ``stiffness`` of the tangential spring times the
    contact point's mobility, over the normal one's; ``restitution`` that it was fitted with; ``misfit``, -2 log L of
    the impulses."""

    wall_friction: float
    stiffness: float
    restitution: float
    misfit: float

    def impulse(self, stopping: Array, normal: Array) -> Array:
        """Tangential impulse per mass (K,), m/s, of contacts that ``stopping`` would end the slip of (K,), m/s, with
        the ``normal`` impulses (K,), m/s."""
        return _impulse(stopping, self.wall_friction * normal, self.stiffness, friction_share(self.restitution))

    @property
    def tangential_restitution(self) -> float:
        """The beta_0 of a scenario whose contacts have this stiffness (:func:`stiffness_of`), from -1 to 1; NaN of a
        stiffer spring than that of 1, which no scenario has."""
        spring, pushing = _half_period(self.restitution)
        turned = float(np.sqrt(self.stiffness * spring)) * pushing
        return -float(np.cos(turned)) if turned <= np.pi else float("nan")


def stiffness_of(tangential_restitution: float, restitution: float) -> float:
    """Stiffness (:class:`LastingContact`) in a scenario with effect ``finite_contact_time``: its tangential spring
    would give back ``tangential_restitution`` of the slip while the damper pushes."""
    spring, pushing = _half_period(restitution)
    stiffness = (np.arccos(-tangential_restitution) / pushing) ** 2 / spring
    return float(np.clip(stiffness, STIFFNESS[0], STIFFNESS[-1]))


def _half_period(restitution: float) -> tuple[float, float]:
    """Of a scenario's contact: its spring over the mass where the half period is one, and the part of it in which the
    damper pushes."""
    decay = -float(np.log(np.clip(restitution, LEAST_RESTITUTION, 1.0)))
    return float(np.pi**2 + decay**2), 1 - 2 * float(np.arctan2(decay, np.pi)) / np.pi


def friction_share(restitution: float) -> RegularGridInterpolator:
    """Share of the friction's impulse that acts, at (log stiffness, stopping impulse over the friction's)."""
    near = round(restitution / RESTITUTION_STEP) * RESTITUTION_STEP
    return _tabulated(float(np.clip(near, LEAST_RESTITUTION, 1.0 - RESTITUTION_STEP)))


def _normal_forces(decay: float) -> tuple[Array, Array, float]:
    """Normal force per mass at the beginning, (STEPS + 1,), and in the middle, (STEPS,), of the steps of a contact of
    one unit of time, met with one unit of speed, and the spring's stiffness; the wall never pulls."""
    spring = float(np.pi**2 + decay**2)
    h, depth, speed = 1.0 / STEPS, 0.0, 1.0
    forces, middles = np.zeros(STEPS + 1), np.zeros(STEPS)
    forces[0] = 2.0 * decay
    for i in range(STEPS):
        half_depth, half_speed = depth + 0.5 * h * speed, speed - 0.5 * h * forces[i]
        middles[i] = max(spring * half_depth + 2.0 * decay * half_speed, 0.0)
        depth, speed = depth + h * half_speed, speed - h * middles[i]
        forces[i + 1] = max(spring * depth + 2.0 * decay * speed, 0.0)
    return forces, middles, spring


@lru_cache(maxsize=8)
def _tabulated(restitution: float) -> RegularGridInterpolator:
    """Slip and stretch are over friction and mobility."""
    # As the wall never pulls, the disk leaves a little faster than exp(-decay).
    decay = brentq(lambda one: _normal_forces(one)[1].sum() / STEPS - 1.0 - restitution, 0.0, MOST_DECAY)
    forces, middles, spring = _normal_forces(decay)
    stiffness = STIFFNESS[:, None] * spring
    slip = np.repeat(STOPPING[None] * (1.0 + restitution), len(STIFFNESS), 0)
    stretch, impulse, h = np.zeros_like(slip), np.zeros_like(slip), 1.0 / STEPS
    for force, middle, after in zip(forces[:-1], middles, forces[1:], strict=True):
        half_slip = slip - 0.5 * h * np.clip(stiffness * stretch, -force, force)
        along = np.clip(stiffness * (stretch + 0.5 * h * slip), -middle, middle)
        stretch = np.clip(stretch + h * half_slip, -after / stiffness, after / stiffness)
        slip -= h * along
        impulse += h * along
    return RegularGridInterpolator((np.log(STIFFNESS), STOPPING), impulse / (1.0 + restitution))


def _impulse(stopping: Array, sliding: Array, stiffness: float, share: RegularGridInterpolator) -> Array:
    ratio = np.minimum(np.abs(stopping) / np.maximum(sliding, np.finfo(float).tiny), STOPPING[-1])
    at = np.column_stack([np.full(len(ratio), np.log(stiffness)), ratio])
    return np.asarray(np.sign(stopping) * sliding * share(at), float)


def fit_lasting(impulses: Impulses, restitution: float, wall_friction: float, scatter: float) -> LastingContact:
    """The likeliest friction and stiffness of the K impacts, from the ``wall_friction`` and the ``scatter`` (over the
    normal impulse) of a contact of an instant."""
    return _likeliest(impulses, restitution, [(wall_friction, stiffness, scatter) for stiffness in STARTS])


def refit_lasting(impulses: Impulses, law: LastingContact, scatter: float) -> LastingContact:
    """:func:`fit_lasting` of most of the impacts that ``law`` was fitted to, from there."""
    return _likeliest(impulses, law.restitution, [(law.wall_friction, law.stiffness, scatter)])


def _likeliest(impulses: Impulses, restitution: float, starts: Sequence[tuple[float, float, float]]) -> LastingContact:
    """From ``starts`` in friction, stiffness and scatter."""
    share, normal = friction_share(restitution), impulses.normal
    stopping = -(impulses.slip + impulses.coupling * normal) / impulses.mobility
    low, high = np.log(STIFFNESS[[0, -1]])

    def misfit(theta: Array) -> float:
        friction, stiffness = float(np.exp(theta[0])), float(np.exp(np.clip(theta[1], low, high)))
        r2 = (impulses.tangential - _impulse(stopping, friction * normal, stiffness, share)) ** 2
        variance = impulses.variance + (np.exp(theta[2]) * normal) ** 2
        return float(-2.0 * np.sum(belongs(r2, variance, impulses.broad, impulses.outliers)[1]))

    rest = {"xatol": PLACES_AGREE, "fatol": VALUES_AGREE}
    tried = [minimize(misfit, np.log(one), method="Nelder-Mead", options=rest) for one in starts]
    best = min(tried, key=lambda one: one.fun)
    friction, stiffness = np.exp(best.x[0]), np.exp(np.clip(best.x[1], low, high))
    return LastingContact(float(friction), float(stiffness), restitution, float(best.fun))
