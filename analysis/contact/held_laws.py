"""Written laws that the nominal model holds, taken out of the impacts: what is left follows the plain contact law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.impacts import Junctions
from analysis.contact.law import LawData, fit_law, predicted_tangential
from analysis.flights.cutting.impact_before import blows_before, contact_before, impact_before, number_of_blows
from analysis.flights.fit import FlightFits
from ovines.core.laws import words as W
from ovines.core.laws.kernel import law_of
from ovines.core.laws.targets import TARGETS

Array = NDArray[np.float64]
# A contact law is fitted to so many impacts; rounds in which it and what a held law adds to it settle.
FEWEST, SETTLED = 4, 4
#: what laws of the impacts act on, by the codes of compiled code
OF_IMPACTS = {name: target.code for name, target in TARGETS.items() if target.stage == "impact"}


def without_laws(data: LawData, junctions: Junctions, fits: Sequence[FlightFits], rows: Array | None = None) -> LawData:
    """``data`` as it would be without the laws that the runs hold, or those of packed ``rows`` (T, ROW_SIZE): each
    number of the contact law less what a law adds to it there."""
    rows = fits[0].run.law if rows is None else rows
    if len(data) < FEWEST or not np.isin(rows[:, W.TARGET], list(OF_IMPACTS.values())).any():
        return data
    known = known_at_impacts(data, junctions, fits)
    each = [added_by(rows, one) for one in known]
    added = {name: np.array([one[name] for one in each]) for name in OF_IMPACTS}
    data = along_normals(data, known[:, W.PASSING], added["contact_normal"])
    q = data.inertia_factor
    radius_m = junctions.radius_m
    turned = (
        added["spin_kept"] * (radius_m * data.at.spin + data.tangential_impulse / q) + added["spin_added"] * radius_m
    )
    turned *= q / (1 + q)
    data = replace(
        data,
        after=data.after - added["restitution"] * data.before,
        tangential_impulse=data.tangential_impulse - turned,
        angular=data.angular - q * turned,
    )
    return without_along(data, added["wall_friction"], added["tangential_restitution"])


def along_normals(data: LawData, passing_m_per_s: Array, turn_rad: Array) -> LawData:
    """``data`` as seen along normals that blows are turned to, by ``turn_rad`` (K,) counterclockwise from the wall's;
    ``passing_m_per_s`` (K,): speed of the disk's centre along the wall before."""
    turn_rad = met_turn(turn_rad, data.before, passing_m_per_s)
    if not turn_rad.any():
        return data
    c, s = np.cos(turn_rad), np.sin(turn_rad)
    # What the spin has changed by is measured, so that the rest of the contact point's change is the centre's.
    passed = passing_m_per_s + data.tangential_impulse - data.angular / data.inertia_factor
    own, along = c * data.before + s * passing_m_per_s, c * passing_m_per_s - s * data.before
    left, left_along = s * passed - c * data.after, c * passed + s * data.after
    pushed = (left_along - passed - along + passing_m_per_s) / data.mobility
    return replace(
        data,
        before=own,
        after=-left,
        slip=data.slip + along - passing_m_per_s,
        normal_impulse=data.by_laws + (own - left) / (1 + data.host_share),
        tangential_impulse=data.tangential_impulse + pushed,
        angular=data.angular - pushed,
    )


def met_turn(turn_rad: Array, approach_m_per_s: Array, passing_m_per_s: Array) -> Array:
    """``turn_rad`` (K,) of blows, none where a disk of these speeds towards the wall and along it (K,) does not come
    into the turned one: the simulator's rule."""
    comes = np.cos(turn_rad) * approach_m_per_s + np.sin(turn_rad) * passing_m_per_s > 0.0
    return np.where(comes, turn_rad, 0.0)


def without_along(data: LawData, wall_friction: Array, tangential_restitution: Array) -> LawData:
    """``data`` as it would be if nothing were added to wall friction and to the tangential restitution (K,) of each
    impact: what that changes of the impulse, impacts that slide by it and would stick otherwise among them."""
    if not (wall_friction.any() or tangential_restitution.any()):
        return data
    plain = data
    for _ in range(SETTLED):
        law = fit_law(plain)
        # Where none slides, or none sticks, what nobody has seen is out of reach.
        friction, beta = np.nan_to_num([law.wall_friction, law.tangential_restitution], nan=np.inf)
        more = predicted_tangential(data, np.maximum(friction + wall_friction, 0.0), beta + tangential_restitution)
        more = more - predicted_tangential(data, friction, beta)
        plain = replace(data, tangential_impulse=data.tangential_impulse - np.nan_to_num(more))
    return plain


def added_by(rows: Array, known: Array | None) -> dict[str, float]:
    """What laws of packed ``rows`` (T, ROW_SIZE) add to each number of the contact law where they know ``known``
    (KNOWN_SIZE,); nothing at an impact of which that is not known."""
    return {name: 0.0 if known is None else float(law_of(code, rows, known)) for name, code in OF_IMPACTS.items()}


def known_at_impacts(data: LawData, junctions: Junctions, fits: Sequence[FlightFits]) -> Array:
    """What laws know before each impact of ``data`` (K, KNOWN_SIZE)."""
    at = data.at.index
    time_s = junctions.time_s[at]
    state, host, rate = junctions.state[at], junctions.host[at], junctions.host_rate[at]
    known = np.zeros((len(data), W.KNOWN_SIZE))
    known[:, W.VX], known[:, W.VY] = state[:, 3], state[:, 4]
    known[:, W.UX], known[:, W.UY] = state[:, 3] - rate[:, 0], state[:, 4] - rate[:, 1]
    known[:, W.X], known[:, W.Y] = state[:, 0], state[:, 1]
    known[:, W.HX], known[:, W.HY] = state[:, 0] - host[:, 0], state[:, 1] - host[:, 1]
    known[:, W.CONTACT_RADIUS] = np.hypot(known[:, W.HX], known[:, W.HY])
    known[:, W.ANGLE], known[:, W.SPIN] = state[:, 2], data.at.spin
    starts = np.array([fit.run.start_s for fit in fits])
    known[:, W.TIME] = time_s - starts[data.at.run]
    known[:, W.RUN], known[:, W.PHASE] = data.at.run, data.at.drive_rad
    known[:, W.CLOCK] = [
        fits[r].run.host.omega_rad_per_s * t for r, t in zip(data.at.run, known[:, W.TIME], strict=True)
    ]
    flights = [(fits[r].run, fits[r].flights, int(k)) for r, k in zip(data.at.run, junctions.flight[at], strict=True)]
    before = [impact_before(*one) for one in flights]
    last = [W.LAST_X, W.LAST_Y, W.LAST_APPROACH, W.LAST_ANGLE, W.LAST_SLIP, W.LAST_LEFT]
    known[:, last] = np.reshape([contact_before(*one)[: len(last)] for one in flights], (-1, len(last)))
    blows = np.reshape([blows_before(*one) for one in flights], (-1, 5, W.MOST_BLOWS))
    known[:, W.BLOW_TIMES : W.BLOW_SPEEDS] = blows[:, 0] - starts[data.at.run, None]
    known[:, W.BLOW_SPEEDS : W.BLOW_WAYS] = blows[:, 1]
    known[:, W.BLOW_WAYS : W.BLOW_SIDES], known[:, W.BLOW_SIDES : W.BLOWS] = blows[:, 2], blows[:, 3]
    known[:, W.BLOW_SLIPS : W.START_ANGLE] = blows[:, 4]
    known[:, W.START_ANGLE] = np.array([fit.run.start_rad for fit in fits])[data.at.run]
    known[:, W.BLOWS] = [number_of_blows(own, k) for _, own, k in flights]
    for r, fit in enumerate(fits):
        own = data.at.run == r
        known[np.ix_(own, [W.HOST_AX, W.HOST_AY])] = fit.run.host.at(time_s[own], 2)[:, :2]
    since = np.minimum(time_s - np.array(before), since_before(data))
    known[:, W.SINCE] = np.minimum(since, W.LONG_AGO_S)
    known[:, W.APPROACH], known[:, W.SLIP] = data.before, data.slip
    known[:, W.SPIN_LEFT] = data.at.spin + data.tangential_impulse / (data.inertia_factor * junctions.radius_m)
    normal = _normals(data, state[:, 9:11] - state[:, 3:5])
    along = state[:, 3:5] - rate[:, :2]
    known[:, W.WALL_SPEED] = np.sum(rate[:, :2] * normal, 1)
    known[:, W.NORMAL] = np.arctan2(normal[:, 1], normal[:, 0])
    known[:, W.WALL_ACCELERATION] = np.sum(known[:, [W.HOST_AX, W.HOST_AY]] * normal, 1)
    # The wall's outward normal points away from the Host's centre, a cylinder's towards it.
    known[:, W.AT_CYLINDER] = np.sum(known[:, [W.HX, W.HY]] * normal, 1) < 0.0
    known[:, W.PASSING] = along[:, 1] * normal[:, 0] - along[:, 0] * normal[:, 1]
    return known


def known_after(known: Array, data: LawData, junctions: Junctions, fits: Sequence[FlightFits], later_s: float) -> Array:
    """What is ``known`` (K, KNOWN_SIZE) at impacts as it will be ``later_s`` after each, of the Host's motion and of
    what goes with time alone: the disk is left as it is."""
    later, time_s, state = known.copy(), junctions.time_s[data.at.index], junctions.state[data.at.index]
    later[:, W.TIME] += later_s
    later[:, W.SINCE] = np.minimum(known[:, W.SINCE] + later_s, W.LONG_AGO_S)
    faster = np.zeros((len(data), 2))
    for r, fit in enumerate(fits):
        own, host = data.at.run == r, fit.run.host
        faster[own] = host.at(time_s[own] + later_s, 1)[:, :2] - host.at(time_s[own], 1)[:, :2]
        later[np.ix_(own, [W.HOST_AX, W.HOST_AY])] = host.at(time_s[own] + later_s, 2)[:, :2]
        later[np.ix_(own, [W.PHASE, W.CLOCK])] += host.omega_rad_per_s * later_s
    later[:, [W.UX, W.UY]] -= faster
    normal = _normals(data, state[:, 9:11] - state[:, 3:5])
    later[:, W.WALL_SPEED] += np.sum(faster * normal, 1)
    later[:, W.WALL_ACCELERATION] = np.sum(later[:, [W.HOST_AX, W.HOST_AY]] * normal, 1)
    return later


def _normals(data: LawData, jump: Array) -> Array:
    """Outward normals (K, 2) of the wall, by the impulses along and across it that made each ``jump`` (K, 2) of the
    velocity."""
    turn = np.arctan2(jump[:, 1], jump[:, 0]) - np.arctan2(data.tangential_impulse, -data.normal_impulse)
    return np.column_stack([np.cos(turn), np.sin(turn)])


def since_before(data: LawData) -> Array:
    """Time (s) since the impact before in the same run, as far as it was used; long for a run's first."""
    order = np.lexsort((data.at.time_s, data.at.run))
    since = np.full(len(data), np.inf)
    same = data.at.run[order][1:] == data.at.run[order][:-1]
    since[order[1:][same]] = np.diff(data.at.time_s[order])[same]
    return since
