"""The two impulses of a blow, per unit mass: from what restitution and friction ask for, through the compliance of all
that gives in it."""

from typing import NamedTuple

import numpy as np

from analysis.blind.plant.compiled import Floats, inlined
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.wall.blow import Blow
from analysis.blind.plant.wall.friction import tangential_restitution, wall_friction
from analysis.blind.plant.wall.restitution import restitution

WET_DRAG = 0.1  # impulse along an oiled wall over the slip: a third would stop it


class Compliance(NamedTuple):
    """What an impulse changes of a contact's velocity, per unit mass: normal, tangential, between them."""

    nn: float
    tt: float
    nt: float


@inlined
def impulses(blow: Blow, state: Floats, bounce: float, p: PlantParameters) -> tuple[float, float]:
    """Along the normal and along the tangent (m/s); `bounce` 0: no rebound, stick at best.

    A wall with a film of oil drags with the slip, whatever the blow presses: for the share `wet_wall` the impulse along
    the tangent is -`WET_DRAG` slip in place of Coulomb's.
    A soft wall that holds on to the rim is sheared with it, which takes of the rebound: a blow that would stick with
    the wall's own restitution has 1 - `gripped` of that.
    Friction of rest is more than of sliding: what needs no more than 1 + `static` of the wall's friction sticks.
    """
    w = _compliance(blow, bounce, p)
    change_n = -(1.0 + restitution(blow, state, p) * bounce) * blow.approach
    change_t = -(1.0 + tangential_restitution(blow, state, p) * bounce) * (blow.slip - p.teeth_m_per_s * bounce)
    mu, glue = wall_friction(blow, state, p), p.cohesion_m_per_s * bounce
    if p.gripped != 0.0 and bounce > 0.0 and _sticks(change_n, change_t, mu, glue, w):
        change_n = -blow.approach - max(1.0 - p.gripped, 0.0) * (-change_n - blow.approach)
    push_n, push_t = _cut(change_n, change_t, blow.slip, mu, p.static * bounce, glue, w)
    if bounce > 0.0 and p.wet_wall != 0.0:
        wet = min(p.wet_wall, 1.0)
        push_t = (1.0 - wet) * push_t - wet * WET_DRAG * blow.slip
        push_n = (change_n - w.nt * push_t) / w.nn
    if bounce == 0.0 or p.band_m_per_s == 0.0 or abs(push_t) <= p.band_m_per_s:
        return push_n, push_t
    # A band around the disk's rim slips on it: beyond its limit it hands on no more.
    most = p.band_m_per_s if push_t > 0.0 else -p.band_m_per_s
    return (change_n - w.nt * most) / w.nn, most


@inlined
def _compliance(blow: Blow, bounce: float, p: PlantParameters) -> Compliance:
    """Of the disk, of a mount of the wall that gives along one line, of a ring that
    turns about one screw, of a sleeve that turns."""
    inertia = p.inertia_factor * p.disk_radius_m**2
    w_nn, w_tt = 1.0 + blow.lever_n**2 / inertia, 1.0 + blow.lever_t**2 / inertia
    w_nt = blow.lever_n * blow.lever_t / inertia
    if p.mount != 0.0:
        c, s = np.cos(p.mount_rad), np.sin(p.mount_rad)
        along_n, along_t = c * blow.nx + s * blow.ny, -c * blow.ny + s * blow.nx
        more_n, more_t, more_nt = p.mount * along_n**2, p.mount * along_t**2, p.mount * along_n * along_t
        w_nn, w_tt, w_nt = w_nn + more_n * bounce, w_tt + more_t * bounce, w_nt + more_nt * bounce
    if p.pivoted != 0.0 and blow.outer:
        more_n, more_t, more_nt = _pivoted(blow, p)
        w_nn, w_tt, w_nt = w_nn + more_n * bounce, w_tt + more_t * bounce, w_nt + more_nt * bounce
    return Compliance(w_nn, w_tt + (p.sleeve * bounce if blow.outer else 0.0), w_nt)


@inlined
def _pivoted(blow: Blow, p: PlantParameters) -> tuple[float, float, float]:
    """What a ring that is held by one screw at `pivoted_rad` of its wall adds to the compliance of a contact: normal,
    tangential, between them.

    It turns about the screw: with its mass M and its radius R its moment of inertia about a point of itself is 2 M R^2,
    and the levers are those of the contact from the screw; `pivoted` is the disk's mass over M.  It has come to rest
    before the next blow.
    """
    from_x, from_y = np.cos(blow.azimuth) - np.cos(p.pivoted_rad), np.sin(blow.azimuth) - np.sin(p.pivoted_rad)
    lever_n, lever_t = from_x * blow.ny - from_y * blow.nx, from_x * blow.nx + from_y * blow.ny
    half = 0.5 * p.pivoted
    return half * lever_n**2, half * lever_t**2, half * lever_n * lever_t


@inlined
def _sticks(change_n: float, change_t: float, mu: float, glue: float, w: Compliance) -> bool:
    """Whether the impulse along the tangent of a contact of compliance w that changes its velocity as asked for stays
    within mu times the normal one and `glue`."""
    push_n, push_t = w.tt * change_n - w.nt * change_t, w.nn * change_t - w.nt * change_n
    return bool(abs(push_t) <= mu * abs(push_n) + glue * (w.nn * w.tt - w.nt**2))


@inlined
def _cut(
    change_n: float,
    change_t: float,
    slip: float,
    mu: float,
    static: float,
    glue: float,
    w: Compliance,
) -> tuple[float, float]:
    """Normal and tangential impulse per unit mass of a contact of compliance w that change its velocity as asked for;
    the tangential one is cut at mu times the normal one and `glue`, where it is more than that and the share `static`
    of the former."""
    determinant = w.nn * w.tt - w.nt**2
    push_n = (w.tt * change_n - w.nt * change_t) / determinant
    push_t = (w.nn * change_t - w.nt * change_n) / determinant
    if abs(push_t) > (1.0 + static) * mu * abs(push_n) + glue:
        sign = -1.0 if slip > 0.0 else 1.0
        push_n = (change_n - sign * glue * w.nt) / (w.nn - sign * mu * w.nt)  # push_n < 0: |push_n| = -push_n
        push_t = sign * (mu * abs(push_n) + glue)
    return push_n, push_t
