"""The event loop of :mod:`ovines.core.engine` once more, with tangents carried along; no samples, no energies."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled, copy_into, making_arrays
from ovines.core.contact.along_wall import (
    GOES_ON,
    HITS,
    RELEASED,
    SLIPS,
    STICKS,
    corner_partner,
    stand_on,
    start_mode,
    turn_over,
    until_event,
    work_need,
)
from ovines.core.contact.collision import resolve
from ovines.core.engine import can_rest
from ovines.core.integration.disk_step import flight_slopes, flight_step, smooth_span
from ovines.core.integration.flight import first_crossing, glide, glide_to_contact, land, relative
from ovines.core.integration.stepper import next_size, step
from ovines.core.sensitivity import tangents as T
from ovines.core.sensitivity.columns import Q_AMPLITUDE, Q_FREQUENCY, Q_PHASE
from ovines.core.sensitivity.host_slopes import host_tangents, response_slopes
from ovines.core.sensitivity.strike import flow, hold_tangents, leave_event, slip_ends_tangents, strike_tangents
from ovines.core.sensitivity.tangent_step import N_QUICK, Tangents, step_tangents
from ovines.core.sensitivity.tangents import Columns, empty_room
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import PUSH, derivatives
from ovines.core.system.host import ROTATION, decay, rows_of
from ovines.core.system.packed import Contact, System

FOLLOWED, GRAZED, CORNERED, FULL = range(4)  # how a run with tangents ends


class Found(NamedTuple):
    """What is kept: instants (n,), states there (n, 19) and tangents (n, 12, m); logarithms of what renormalising took
    off (n, m; no rows: tangents stay as they are), and the rows that are kept then (12,); impacts (k, 3: time, wall,
    normal speed) and their delays (k, m).
    """

    times: Floats
    states: Floats
    tangents: Floats
    logs: Floats
    kept: Floats
    impacts: Floats
    delays: Floats


class Meeting(NamedTuple):
    """A meeting with a wall: the state before it (19,), the impact's record, the tangents of its instant (m,)."""

    before: Floats
    record: Floats
    delay: Floats


@compiled
def glide_tangents(t: float, s: float, system: System, tangents: Tangents) -> None:
    """Closed-form flight: :func:`ovines.core.integration.flight.glide`, in place."""
    p, k = system.p, system.k
    x, q, room = tangents.columns.s, tangents.columns.q, tangents.columns.room
    kind = k[P.HOST_KIND]
    before, after = room.response, room.response_after
    if kind == P.SPRUNG:
        response_slopes(t, p, system.drive, before)
        response_slopes(t + s, p, system.drive, after)
    for j in range(q.shape[1]):
        x[S.X, j] += s * x[S.VX, j]
        x[S.Y, j] += s * x[S.VY, j]
        x[S.ANGLE, j] += s * x[S.SPIN, j]
        if kind == P.FREE:
            x[T.HOST_X, j] += s * x[T.HOST_VX, j]
            x[T.HOST_Y, j] += s * x[T.HOST_VY, j]
            x[T.HOST_ANGLE, j] += s * x[T.HOST_SPIN, j]
    if kind == P.DRIVEN:
        host_tangents(t + s, system, tangents.columns)
    if kind != P.SPRUNG:
        return
    for axis in range(3):
        place, rate = rows_of(axis)
        at, rate = T.HOST_X + place, T.HOST_X + rate
        inverse = p[P.INVERSE_HOST_INERTIA] if axis == ROTATION else p[P.INVERSE_HOST_MASS]
        stiffness, damping = p[P.STIFFNESS_X + axis] * inverse, p[P.DAMPING_X + axis] * inverse
        sine, cosine = decay(stiffness, damping, s)
        for j in range(q.shape[1]):
            a, f, phase = q[Q_AMPLITUDE, j], q[Q_FREQUENCY, j], q[Q_PHASE, j]
            q0 = x[at, j] - before[axis, 0] * a - before[axis, 1] * f - before[axis, 2] * phase
            v0 = (
                x[rate, j]
                - before[S.RATES + axis, 0] * a
                - before[S.RATES + axis, 1] * f
                - before[S.RATES + axis, 2] * phase
            )
            q1 = after[axis, 0] * a + after[axis, 1] * f + after[axis, 2] * phase
            v1 = after[S.RATES + axis, 0] * a + after[S.RATES + axis, 1] * f + after[S.RATES + axis, 2] * phase
            x[at, j] = q1 + q0 * (cosine + 0.5 * damping * sine) + v0 * sine
            x[rate, j] = v1 - stiffness * q0 * sine + v0 * (cosine - 0.5 * damping * sine)


@making_arrays
def fly_tangents(
    t: float, y: Floats, end: float, grace: float, system: System, work: Floats, trial: Floats, tangents: Tangents
) -> tuple[float, int]:
    """:func:`ovines.core.engine.fly_integrated` with tangents."""
    p, k = system.p, system.k
    a, b, cx, cy = np.empty(6), np.empty(6), np.empty(6), np.empty(6)
    flying = Contact(P.FLIGHT, -1, 0.0)
    h = min(0.05 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY])), p[P.MAX_STEP])
    last = np.zeros(P.N_STATE)
    flight_slopes(t, y, system, work, work[0])
    relative(t, y, system, work, work[0], a)
    while t < end:
        if k[P.ON_GROUND] and can_rest(y, system):
            y[S.VX], y[S.VY] = 0.0, 0.0
            tangents.columns.s[S.VX : S.VY + 1, :] = 0.0
            if p[P.COUPLING] > 0.0:
                y[S.SPIN] = 0.0
                tangents.columns.s[S.SPIN, :] = 0.0
            return t, -2
        s = asked = smooth_span(t, y, min(h, end - t), system, work[0])
        error = flight_step(t, y, s, 0.0, system, work, trial)
        if error > 1.0:
            h = next_size(s, error)
            continue
        flight_slopes(t + s, trial, system, work, work[P.SPARE])
        relative(t + s, trial, system, work, work[P.SPARE], b)
        guess, wall = first_crossing(a, b, s, min(grace, s), system, cx, cy)
        if wall >= 0:
            s, contact = land(t, y, guess, s, wall, system, work, trial)
            if not contact:
                wall = -1
            flight_step(t, y, s, 0.0, system, work, trial)  # its slopes are those of this step
        copy_into(last, work[P.SPARE])
        step_tangents(t, y, s, flying, system, work, tangents)
        for j in range(k[P.STATE_SIZE]):
            y[j] = trial[j]
        t = t + s if s < end - t else end
        if wall >= 0:
            return t, wall
        if s == asked:  # the slopes at the step's end are those of this state
            work[0, :] = last
            a[:] = b
        else:
            flight_slopes(t, y, system, work, work[0])
            relative(t, y, system, work, work[0], a)
        grace = max(grace - s, 0.0)
        h = min(next_size(s, error), p[P.MAX_STEP])
    return t, -1


@making_arrays
def hug_tangents(
    t: float, y: Floats, wall: int, end: float, system: System, work: Floats, trial: Floats, tangents: Tangents
) -> tuple[float, int, int, Contact]:
    """:func:`ovines.core.contact.along_wall.follow_wall` with tangents: also the mode in which it ends."""
    p, k = system.p, system.k
    columns = tangents.columns
    s = columns.s
    delay, after = np.zeros(columns.q.shape[1]), np.zeros(T.N_ROWS)
    mode, side = start_mode(t, y, wall, system, work)
    stand_on(t, y, mode, wall, system, work)
    hold_tangents(t, y, mode, wall, system, work, columns)
    h = 1e-2 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY]))
    while t < end:
        contact = Contact(mode, wall, side)
        derivatives(t, y, contact, system, work[P.SCRATCH], work[P.PLACE], work[0])
        if work[P.SCRATCH][PUSH] < 0.0:
            return t, RELEASED, wall, contact
        h = min(h, p[P.MAX_STEP])
        size = min(h, end - t)
        error = step(t, y, size, contact, system, work, trial)
        if error > 1.0:
            h = next_size(size, error)
            continue
        size, event, concerned = until_event(t, y, size, contact, system, work, trial)
        if event != GOES_ON:
            step(t, y, size, contact, system, work, trial)
        step_tangents(t, y, size, contact, system, work, tangents)
        for j in range(k[P.STATE_SIZE]):
            y[j] = trial[j]
        t += size
        if k[P.HOST_KIND] == P.DRIVEN:
            host_tangents(t, system, columns)
        if event == STICKS:
            slip_ends_tangents(t, y, contact, system, work, columns, delay)
            mode, side = turn_over(t, y, wall, side, system, work)
            leave_event(t, y, Contact(mode, wall, side), system, work, s, delay, after)
        elif event == SLIPS:
            side = -1.0 if work_need(t, y, wall, system, work) > 0.0 else 1.0
            mode = P.SLIDE
        stand_on(t, y, mode, wall, system, work)
        hold_tangents(t, y, mode, wall, system, work, columns)
        if event == RELEASED or event == HITS:
            return t, event, concerned, Contact(mode, wall, side)
        h = next_size(size, error) if event == GOES_ON else 1e-3 * p[P.MAX_STEP]
    return t, GOES_ON, wall, Contact(mode, wall, side)


@compiled
def renormalise(s: Floats, m: int, kept: Floats, logs: Floats) -> None:
    """Gram-Schmidt on the columns, in place; ``logs`` (m,) gets the logarithms of their lengths (-inf: no length).

    Rows that are not ``kept`` (12,) are set to zero: rounding there would grow where the rest decays.
    """
    for i in range(s.shape[0]):
        if kept[i] == 0.0:
            s[i, :] = 0.0
    for j in range(m):
        for b in range(j):
            inner = 0.0
            for i in range(s.shape[0]):
                inner += s[i, b] * s[i, j]
            for i in range(s.shape[0]):
                s[i, j] -= inner * s[i, b]
        square = 0.0
        for i in range(s.shape[0]):
            square += s[i, j] * s[i, j]
        length = math.sqrt(square)
        logs[j] = math.log(length) if length > 0.0 else -math.inf
        if length > 0.0:
            for i in range(s.shape[0]):
                s[i, j] /= length


@compiled
def meet_wall(
    t: float, y: Floats, wall: int, contact: Contact, system: System, work: Floats, columns: Columns, meeting: Meeting
) -> tuple[int, Contact, bool]:
    """Resolve a contact with its tangents, in place: how it went, the mode after it, whether it was an impact."""
    k, s, after, delay = system.k, columns.s, columns.room.flow, meeting.delay
    m = columns.q.shape[1]
    if k[P.HOST_KIND] == P.DRIVEN:
        host_tangents(t, system, columns)
    flow(t, y, contact, system, work, after)
    for i in range(T.N_ROWS):
        s[i, m] = after[i]
    copy_into(meeting.before, y)
    mode, _duration, counted = resolve(t, y, wall, system, work, meeting.record)
    delay[:] = 0.0
    if counted:
        if not strike_tangents(t, meeting.before, wall, system, work, columns, delay):
            return GRAZED, contact, False
    elif mode == P.FLIGHT:
        return GRAZED, contact, False
    side = 0.0
    if mode == P.SLIDE:
        if k[P.N_WALLS] > P.EDGES + 1 and corner_partner(t, y, wall, system, work) >= 0:
            return CORNERED, contact, counted
        mode, side = start_mode(t, y, wall, system, work)
    then = Contact(mode, wall if mode != P.FLIGHT else -1, side)
    if counted:
        leave_event(t, y, then, system, work, s, delay, after)
    if mode != P.FLIGHT:
        hold_tangents(t, y, mode, wall, system, work, columns)
    return FOLLOWED, then, counted


@making_arrays
def follow(system: System, y: Floats, s: Floats, q: Floats, begin: float, found: Found) -> tuple[int, float, int]:
    """Run with tangents ``s`` (12, m + 1) from ``begin`` to the last of ``found.times``; ``y`` and ``s`` in place.

    Returns how it ended (FOLLOWED, or why it cannot go on), the time, and the number of impacts.
    """
    p, k, m = system.p, system.k, q.shape[1]
    columns = Columns(s, q, empty_room(m))
    work, trial = np.zeros((P.N_WORK, P.N_STATE)), np.zeros(P.N_STATE)
    meeting = Meeting(np.zeros(P.N_STATE), np.zeros(P.N_IMPACT), np.zeros(m))
    tangents = Tangents(
        columns, np.zeros((12, T.N_ROWS, m)), np.zeros((T.N_ROWS, m)), np.zeros((N_QUICK, 24)),
        np.zeros((3, P.N_STATE)), np.full(1, np.inf),
    )  # fmt: skip
    t, grace, n_impacts = begin, 0.0, 0
    p[P.LAST_IMPACT] = -math.inf
    at_rest, driven = False, k[P.HOST_KIND] == P.DRIVEN
    contact = Contact(P.FLIGHT, -1, 0.0)
    for stop in range(found.times.shape[0]):
        end = found.times[stop]
        while t < end:
            wall, struck = -1, False
            if contact.mode == P.FLIGHT:
                started = t
                if k[P.CLOSED_FORM] or at_rest:
                    duration, wall = glide_to_contact(t, y, end, grace, system, work)
                    glide_tangents(t, duration, system, tangents)
                    glide(t, duration, y, system, work[P.SCRATCH], trial)
                    for j in range(k[P.STATE_SIZE]):
                        y[j] = trial[j]
                    t = end if wall < 0 else t + duration
                else:
                    t, wall = fly_tangents(t, y, end, grace, system, work, trial, tangents)
                at_rest = at_rest or wall == -2
                grace = max(grace - (t - started), 0.0) if wall < 0 else 0.0
                struck = wall >= 0
            else:
                t, event, wall, contact = hug_tangents(t, y, contact.wall, end, system, work, trial, tangents)
                if event == HITS:
                    struck = True
                elif event == RELEASED:
                    contact = Contact(P.FLIGHT, -1, 0.0)
                    grace = 1e-4 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY]))
            if not struck:
                continue
            how, contact, counted = meet_wall(t, y, wall, contact, system, work, columns, meeting)
            if counted:
                if n_impacts < found.impacts.shape[0]:
                    found.impacts[n_impacts, 0], found.impacts[n_impacts, 1] = t, wall
                    found.impacts[n_impacts, 2] = meeting.record[P.NORMAL_BEFORE]
                    found.delays[n_impacts, :] = meeting.delay
                n_impacts += 1
            if how != FOLLOWED or n_impacts > k[P.MAX_IMPACTS]:
                return (how if how != FOLLOWED else FULL), t, n_impacts
        if driven:
            host_tangents(t, system, columns)
        found.states[stop, :] = y
        if found.logs.shape[0] > 0:
            renormalise(s[:, :m], m, found.kept, found.logs[stop])
        for i in range(T.N_ROWS):
            for j in range(m):
                found.tangents[stop, i, j] = s[i, j]
    return FOLLOWED, t, n_impacts
