"""A bounce sequence, simulated through: what chattering against the wall must look like if the laws found hold.

Flight model, wall and contact law are those of the identification; the start state, a shift of the wall at this place,
and the restitution of each impact are arguments, so that they can be fitted to the frames.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.bounces.contact import (
    NORMAL_AFTER,
    RECORD,
    SPIN_AFTER,
    TANGENTIAL_AFTER,
    TIME,
    BounceRig,
    ContactView,
    LastingContact,
    contact_view,
    squeeze,
    stay,
    strike,
    touch,
)
from analysis.compiled import compiled, making_arrays
from analysis.flights.equation.model import (
    ANGLE,
    LONGEST_STEP_S,
    SPIN,
    STATES,
    Workspace,
    X,
    Y,
    advance,
    strongest_acceleration,
    workspace,
)

Array = NDArray[np.float64]
# Steps of a disk that stays at the wall, whose friction acts all along.
SETTLED_STEP_S = 2e-4
# Steps of a contact that lasts, in 1/frequency: half a period in twelve (its restitution to 5e-4, of a strongly damped
# one to 5e-3).
CONTACT_STEP = np.pi / 12
# A contact that goes on for this many half periods has caught the disk.
CAUGHT_HALF_PERIODS = 3.0
# A hop's acceleration is read off so short a step after the wall; its first step is no shorter than the other.
PROBE_STEP_S, SHORTEST_STEP_S = 1e-5, 2e-6
# An arrival is found to this gap (a millionth of the cameras' noise) or to this time, within so many steps.
ARRIVED_M, ARRIVED_S, ARRIVAL_STEPS = 1e-12, 1e-13, 60
# Newton's steps on the cubic through a step's ends, from the far end: each squares the error.
CUBIC_STEPS = 6
# Instants closer than this are one.
SAME_TIME_S = 1e-12
RECORD_SIZE = len(RECORD)


class BouncePath(NamedTuple):
    """What a simulation fills: ``states`` (N, 6) at the times asked for, ``records`` (K, 9) of
    :data:`analysis.bounces.contact.RECORD`, and the states just before each impact, ``befores`` (K, 6)."""

    states: Array
    records: Array
    befores: Array


class BounceFrames(NamedTuple):
    """The frames that a bounce sequence explains: it starts at ``start_s``; ``times`` (N,) s, ``observed`` (N, 3: x, y,
    angle) with ``sd`` (N, 2: of places, of angles), ``origin`` (2,) of the markers seen from the centre of mass (m)."""

    start_s: float
    times: Array
    observed: Array
    sd: Array
    origin: Array


class BounceWork(NamedTuple):
    """Arrays to work in: the flight's, and two states (6,)."""

    flight: Workspace
    moved: Array
    probe: Array


@compiled
def _step(y: Array, t: float, h: float, rig: BounceRig, work: BounceWork, out: Array) -> None:
    strongest = strongest_acceleration(rig.parameters, rig.flight)
    advance(y, t, h, rig.parameters, rig.flight, strongest, work.flight, out)


@compiled
def _longest_step(y: Array, t: float, view: ContactView, rig: BounceRig, shift_m: float, work: BounceWork) -> float:
    """Longest step of a disk that leaves the wall at t as in ``view``.  The hop lasts 2 v / a, a step covers a quarter
    of it at most.
    """
    leaving = -view.normal_speed
    _step(y, t, PROBE_STEP_S, rig, work, work.probe)
    later = contact_view(work.probe, t + PROBE_STEP_S, rig, shift_m)
    back = (later.normal_speed - view.normal_speed) / PROBE_STEP_S
    return min(LONGEST_STEP_S, max(0.5 * leaving / back, SHORTEST_STEP_S)) if back > 0 else LONGEST_STEP_S


@compiled
def _left_wall(y: Array, t: float, rig: BounceRig, shift_m: float) -> ContactView:
    """The contact point of a disk that leaves the wall at t: without a gap, whatever rounding made of it."""
    view = contact_view(y, t, rig, shift_m)
    return ContactView(0.0, view.normal_speed, view.tangential_speed, view.azimuth, view.normal, view.surface)


@compiled
def _press(
    y: Array,
    t: float,
    h: float,
    caught: bool,
    contact: LastingContact,
    shift_m: float,
    rig: BounceRig,
    work: BounceWork,
) -> LastingContact:
    """``y`` a step h later within a contact that lasts: half a free step, the wall's impulse, half a free step
    (Strang).
    """
    _step(y, t, 0.5 * h, rig, work, work.moved)
    view = contact_view(work.moved, t + 0.5 * h, rig, shift_m)
    contact = squeeze(work.moved, view, rig, h, caught, contact)
    _step(work.moved, t + 0.5 * h, 0.5 * h, rig, work, y)
    return contact


@compiled
def _crossing(h: float, now: ContactView, later: ContactView) -> float:
    """About when in a step of h the gap is zero for the last time, by the cubic through gaps and speeds at its ends;
    h where it says nothing.
    """
    s = 1.0
    for _ in range(CUBIC_STEPS):
        one, two, three = s - 1.0, s * s, s * s * s
        gap = (
            (2 * three - 3 * two + 1) * now.gap
            + s * one * one * h * now.normal_speed
            + (3 * two - 2 * three) * later.gap
            + two * one * h * later.normal_speed
        )
        slope = (
            6 * s * one * (now.gap - later.gap)
            + one * (3 * s - 1) * h * now.normal_speed
            + s * (3 * s - 2) * h * later.normal_speed
        )
        if slope <= 0:
            return h
        s -= gap / slope
    return s * h


@compiled
def _arrival(
    y: Array,
    t: float,
    h: float,
    now: ContactView,
    later: ContactView,
    shift_m: float,
    rig: BounceRig,
    work: BounceWork,
) -> tuple[float, ContactView]:
    """Time after t, within h, at which the disk reaches the wall, and the contact point there; ``work.probe`` is the
    state there.  ``now`` and ``later`` are the contact points at t and t + h.
    """
    low, high = 0.0, h
    middle = _crossing(h, now, later)
    for _ in range(ARRIVAL_STEPS):
        if not low < middle < high:
            middle = 0.5 * (low + high)
        _step(y, t, middle, rig, work, work.probe)
        later = contact_view(work.probe, t + middle, rig, shift_m)
        if abs(later.gap) < ARRIVED_M or high - low < ARRIVED_S:
            break
        if later.gap > 0 and later.normal_speed > 0:
            high = middle
        else:
            low = middle
        # Newton's step where the disk comes nearer, else half of what is left.
        middle = middle - later.gap / later.normal_speed if later.normal_speed > 0 else low
    return middle, later


@making_arrays
def simulate_bounces(
    start: Array,
    t0: float,
    at_impact: bool,
    times: Array,
    shift_m: float,
    deviation: Array,
    rig: BounceRig,
    path: BouncePath,
) -> tuple[int, float]:
    """Fill ``path`` at the sorted ``times`` >= t0, with the impacts up to the last of them.

    ``deviation`` (K,) of the impacts' restitution from the law's, in order; after K impacts, or when one comes in
    slower than rig's stop speed, the disk slides or rolls along the wall; a contact that lasts (rig's wall frequency)
    keeps a disk that is too slow to leave.  ``at_impact``: the start is the state just before the first impact.
    ``shift_m``: the wall stands out by so much.  Returns the number of impacts and the time at which the disk settled
    (inf when it never did).
    """
    work = BounceWork(workspace(), np.empty(STATES), np.empty(STATES))
    moved = work.moved
    y, t, impacts, settled = start.copy(), t0, 0, np.inf
    frequency = rig.wall_frequency_per_s
    lasts, pressed, contact, longest = frequency > 0, False, LastingContact(0.0, 0.0, 0.0), LONGEST_STEP_S
    view = contact_view(y, t, rig, shift_m)
    arrived = at_impact
    for i in range(len(times)):
        while arrived or t < times[i] - SAME_TIME_S:
            if arrived:
                arrived = False
                slow = view.normal_speed < rig.stop_speed_m_per_s and not lasts and not (at_impact and impacts == 0)
                if impacts >= len(deviation) or slow:
                    settled = t
                    continue
                path.befores[impacts] = y
                if lasts:
                    contact = touch(y, view, rig, deviation[impacts], path.records[impacts], t)
                    pressed = True
                else:
                    strike(y, view, rig, deviation[impacts], path.records[impacts], t)
                    view = _left_wall(y, t, rig, shift_m)
                    longest = _longest_step(y, t, view, rig, shift_m, work)
                impacts += 1
                continue
            if pressed:
                h = min(CONTACT_STEP / frequency, times[i] - t)
                contact = _press(y, t, h, settled < np.inf, contact, shift_m, rig, work)
                t += h
                view = contact_view(y, t, rig, shift_m)
                if view.gap <= 0 and view.normal_speed < 0:
                    pressed, settled = False, np.inf
                    record = path.records[impacts - 1]
                    record[NORMAL_AFTER], record[TANGENTIAL_AFTER] = -view.normal_speed, view.tangential_speed
                    record[SPIN_AFTER] = y[SPIN]
                    view = _left_wall(y, t, rig, shift_m)
                    longest = _longest_step(y, t, view, rig, shift_m, work)
                elif settled == np.inf and t - contact.since > CAUGHT_HALF_PERIODS * np.pi / frequency:
                    settled = contact.since
                continue
            h = min(longest if settled == np.inf else SETTLED_STEP_S, times[i] - t)
            _step(y, t, h, rig, work, moved)
            later = contact_view(moved, t + h, rig, shift_m)
            if settled < np.inf:
                stay(moved, view, later, rig, h)
                y[:] = moved
                t += h
                view = contact_view(y, t, rig, shift_m)
            elif later.gap > 0 and later.normal_speed > 0 and (view.gap <= 0 or view.normal_speed <= 0):
                passed, view = _arrival(y, t, h, view, later, shift_m, rig, work)
                t += passed
                y[:] = work.probe
                arrived = True
            else:
                if view.normal_speed <= 0 < later.normal_speed and h < LONGEST_STEP_S:
                    longest = LONGEST_STEP_S
                y[:] = moved
                t += h
                view = later
        path.states[i] = y
    return impacts, settled


#: places among the unknowns of a bounce sequence: the start state (6), the shift of the wall, the common shift of the
#: restitution, then the restitutions of its impacts
SHIFT, COMMON_RESTITUTION, COMMON_FRICTION, COMMON_TANGENTIAL, COMMON = range(STATES, STATES + 5)


@making_arrays
def _with_law(rig: BounceRig, theta: Array) -> BounceRig:
    """``rig`` with the wall friction and tangential restitution of ``theta``."""
    return BounceRig(
        rig.flight,
        rig.parameters,
        rig.surfaces,
        rig.disk_x_m,
        rig.disk_y_m,
        max(rig.wall_friction + theta[COMMON_FRICTION], 0.0),
        rig.tangential_restitution + theta[COMMON_TANGENTIAL],
        rig.stop_speed_m_per_s,
        rig.wall_frequency_per_s,
        rig.restitution,
        rig.restitution_rise,
        rig.restitution_speed_m_per_s,
    )


@compiled
def _residual(states: Array, first: int, frames: BounceFrames, r: Array) -> None:
    """Rows ``first`` and on of the standardised residuals ``r`` (N, 3) against ``states``."""
    for i in range(len(states)):
        c, s = np.cos(states[i, ANGLE]), np.sin(states[i, ANGLE])
        o = first + i
        r[o, 0] = (frames.observed[o, 0] - states[i, X] - c * frames.origin[0] + s * frames.origin[1]) / frames.sd[o, 0]
        r[o, 1] = (frames.observed[o, 1] - states[i, Y] - s * frames.origin[0] - c * frames.origin[1]) / frames.sd[o, 0]
        r[o, 2] = (frames.observed[o, 2] - states[i, ANGLE]) / frames.sd[o, 1]


@making_arrays
def bounce_residual(
    theta: Array, steps: Array, frames: BounceFrames, rig: BounceRig, jacobian: Array, records: Array, r: Array
) -> tuple[int, float]:
    """Standardised residuals ``r`` (N, 3) of a bounce sequence, their ``jacobian`` (N, 3, P) in theta (P,) where it has
    rows, ``records`` (K, 9).

    theta: :data:`COMMON` unknowns (state, shift of the wall, what restitution, wall friction and tangential restitution
    are off), then deviations of the impacts' restitutions from the law; later impacts have the common one alone.
    Returns the number of impacts and the time at which the disk settled.
    """
    times, t0 = frames.times, frames.start_s
    n, m = len(times), len(records)
    out, befores = np.empty((n, STATES)), np.empty((m, STATES))
    other, unused = np.empty((m, RECORD_SIZE)), np.empty((m, STATES))
    deviation = np.empty(m)

    for i in range(m):
        deviation[i] = theta[COMMON_RESTITUTION] + (theta[COMMON + i] if COMMON + i < len(theta) else 0.0)
    law = _with_law(rig, theta)
    impacts, settled = simulate_bounces(
        theta[:STATES], t0, False, times, theta[SHIFT], deviation, law, BouncePath(out, records, befores)
    )
    _residual(out, 0, frames, r)
    if len(jacobian) == 0:
        return impacts, settled
    moved, shifted = np.empty((n, 3)), theta.copy()
    for j in range(len(theta)):
        h, varied = steps[j], law
        if j < COMMON:
            shifted[j] += h
            changed = deviation + (h if j == COMMON_RESTITUTION else 0.0)
            begin, start, begin_s, shift_m = 0, shifted[:STATES], t0, shifted[SHIFT]
            varied = _with_law(rig, shifted)
        else:
            # Before its impact a restitution changes nothing: from there on only.
            number = j - COMMON
            jacobian[:, :, j] = 0.0
            if number >= impacts:
                continue
            begin_s, shift_m, start = records[number, TIME], theta[SHIFT], befores[number]
            begin = int(np.searchsorted(times, begin_s))
            if begin >= n:
                continue
            changed = deviation[number:].copy()
            changed[0] += h
        path = BouncePath(out[begin:], other, unused)
        simulate_bounces(start, begin_s, j >= COMMON, times[begin:], shift_m, changed, varied, path)
        shifted[j] = theta[j]
        _residual(path.states, begin, frames, moved)
        for i in range(begin, n):
            for q in range(3):
                jacobian[i, q, j] = (moved[i, q] - r[i, q]) / h
    return impacts, settled
