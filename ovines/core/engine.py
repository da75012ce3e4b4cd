"""The event loop: next contact, move to it, resolve it (the whole simulator in one compiled function)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ovines.core import state as S
from ovines.core.compiled import Floats, Ints, compiled, copy_into, inlined, making_arrays
from ovines.core.contact.along_wall import GOES_ON, HITS, STALLED, corner_partner, follow_wall
from ovines.core.contact.collision import resolve
from ovines.core.integration.disk_step import flight_slopes, flight_step, smooth_span
from ovines.core.integration.extended import SHARP, sharpen, strike_extended
from ovines.core.integration.flight import first_crossing, glide, glide_to_contact, land, relative, rest_speed
from ovines.core.integration.sampling import due, keep_sample, sample_glide
from ovines.core.integration.stepper import STEPS_WATCHED, next_size, stands_still
from ovines.core.integration.suspension import suspension_work
from ovines.core.system import parameters as P
from ovines.core.system.impact import effective_restitution
from ovines.core.system.kinematics import place
from ovines.core.system.known import begin_way, forget_contacts, remember_contact, remember_way
from ovines.core.system.packed import Samples, System

#: what a flight meets beside walls: the run's end, rest, or steps without an end
NOTHING, AT_REST, NO_END = -1, -2, -3


class Words(NamedTuple):
    """State (19,), the low words that a pair of doubles adds to it, and room for a state beyond it."""

    y: Floats
    low: Floats
    trial: Floats


@compiled
def fly_closed(
    t: float, words: Words, end: float, grace: float, system: System, work: Floats, samples: Samples, with_energy: bool
) -> tuple[float, int]:
    """Closed-form flight to the next contact, in place: (time, wall or -1).

    The low words are used and kept where the run is extended (:mod:`ovines.core.integration.extended`).
    """
    k = system.k
    y, low, trial = words.y, words.low, words.trial
    s, wall = glide_to_contact(t, y, end, grace, system, work)
    counted = sample_glide(t, y, t + s, system, work, trial, samples)
    if with_energy and k[P.HOST_KIND] == P.SPRUNG:
        suspension_work(t, counted, s, y, system, work)
    reached = end if wall < 0 else t + s
    if k[P.EXTENDED] and wall == P.ROUND:
        exact, agreed = sharpen(t, s, y, low, system, trial, work[P.TRIAL])
        if agreed:
            copy_into(y, trial)
            copy_into(low, work[P.TRIAL])
            return exact, wall
    low[:] = 0.0
    glide(t, s, y, system, work[P.SCRATCH], trial)
    for j in range(k[P.STATE_SIZE]):
        y[j] = trial[j]
    return reached, wall


@inlined
def short_while(y: Floats, p: Floats) -> float:
    """A time (s) in which the disk goes a ten-thousandth of the length at most: so long a wall is not asked for again
    that it has been let go of, or goes along."""
    return 1e-4 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY]))


@making_arrays
def fly_integrated(
    t: float, y: Floats, end: float, grace: float, system: System, work: Floats, trial: Floats, samples: Samples
) -> tuple[float, int]:
    """Integrated flight to the next contact, in place: (time, wall, or what it meets in its place)."""
    p, k = system.p, system.k
    a, b, cx, cy, between = np.empty(6), np.empty(6), np.empty(6), np.empty(6), np.empty(P.N_STATE)
    fast = p[P.SPEED] + math.hypot(y[S.VX], y[S.VY])
    h = min(0.05 * p[P.LENGTH] / fast, p[P.MAX_STEP])
    n = k[P.STATE_SIZE]
    flight_slopes(t, y, system, work, work[0])
    relative(t, y, system, work, work[0], a)
    watched, steps = t, 0
    while t < end:
        steps += 1
        if steps == STEPS_WATCHED:
            if stands_still(t - watched, y, p):
                return t, NO_END
            watched, steps = t, 0
        if k[P.ON_GROUND] and can_rest(y, system):
            y[S.VX], y[S.VY] = 0.0, 0.0
            if p[P.COUPLING] > 0.0:
                y[S.SPIN] = 0.0
            return t, AT_REST
        s = asked = smooth_span(t, y, min(h, end - t), system, work[0])
        error = flight_step(t, y, s, 0.0, system, work, trial)
        if error > 1.0:
            h = next_size(s, error)
            continue
        flight_slopes(t + s, trial, system, work, work[P.SPARE])
        relative(t + s, trial, system, work, work[P.SPARE], b)
        guess, wall = first_crossing(a, b, s, min(grace, s), system, cx, cy)
        least = 0.0
        if wall >= 0:
            s, contact = land(t, y, guess, s, wall, system, work, trial)
            if not contact:
                # It goes along the wall: asked again a little later, or its steps would shrink to nothing.
                wall, least = -1, short_while(y, p)
                grace = max(grace, s + least)
        known = s
        while due(samples, t + s):
            part = samples.times[samples.written[0]] - t
            flight_step(t, y, part, known, system, work, between)
            keep_sample(between, system, work, samples)
            known = part
        for j in range(n):
            y[j] = trial[j]
        t = t + s if s < end - t else end
        if p[P.MEMORY_M] > 0.0:
            place(t, y, system, work[P.SCRATCH], work[P.PLACE])
            remember_way(t, work[P.PLACE], p)
        if wall >= 0:
            return t, wall
        if s == asked:  # the slopes at the step's end are those of this state
            work[0, :n] = work[P.SPARE, :n]
            a[:] = b
        else:
            flight_slopes(t, y, system, work, work[0])
            relative(t, y, system, work, work[0], a)
        grace = max(grace - s, 0.0)
        h = min(max(next_size(s, error), least), p[P.MAX_STEP])
    return t, NOTHING


@compiled
def can_rest(y: Floats, system: System) -> bool:
    """Whether the disk stands on the fixed ground for good: nothing drives it and it moves 1e-9 of v_d or less."""
    p, k = system.p, system.k
    if system.law.shape[0] > 0:
        return False
    if p[P.GRAVITY_X] != 0.0 or p[P.GRAVITY_Y] != 0.0 or p[P.FLOOR_FRICTION] <= 0.0 or k[P.OFF_CENTRE]:
        return False
    return rest_speed(y, p) <= 1e-9 * p[P.REGULARISATION]


@inlined
def carry_extended(y: Floats, before: Floats, low: Floats, record: Floats, flies_on: bool, p: Floats, k: Ints) -> None:
    """Strike once more in extended precision where the flight before was kept in it (``low``), else forget its low
    parts.
    """
    if low[SHARP] > 0.0 and flies_on:
        restitution = effective_restitution(record[P.NORMAL_BEFORE], record[P.AZIMUTH], record[P.TIME], p)
        strike_extended(before, low, restitution, p, k)
        for i in range(P.N_STATE):
            if i < P.ENERGIES or i >= P.HOST:
                y[i] = before[i]
    else:
        low[:] = 0.0


@making_arrays
def run(
    system: System, y: Floats, samples: Samples, impacts: Floats, contacts: Floats, with_energy: bool
) -> tuple[float, int, int, float]:
    """Run a packed scenario; ``y`` ends as the final state.

    Returns (end time, impacts, contacts, seconds in sustained contact); an end before the duration, of fewer impacts
    than it may have, is that of a run whose steps come to nothing (:func:`stands_still`).  Arrays that are too short
    are filled as far as they go; the counts say how far they should have gone.
    """
    p, k = system.p, system.k
    work, record, before = np.zeros((P.N_WORK, P.N_STATE)), np.zeros(P.N_IMPACT), np.zeros(P.N_STATE)
    trial, low = np.zeros(P.N_STATE), np.zeros(P.N_STATE)
    end = p[P.DURATION]
    t, grace = 0.0, 0.0
    forget_contacts(y[S.ANGLE], p)
    place(0.0, y, system, work[P.SCRATCH], work[P.PLACE])
    begin_way(0.0, work[P.PLACE], p)
    if p[P.BEGINS_WITH] >= 0.0:
        remember_contact(0.0, work[P.PLACE], y, (p[P.BEGINS_WITH], 0.0), False, p)
    n_impacts, n_contacts, in_contact = 0, 0, 0.0
    mode, wall = P.FLIGHT, -1
    at_rest = False
    watched, events = 0.0, 0
    while t < end:
        events += 1
        if events == STEPS_WATCHED:
            if stands_still(t - watched, y, p):
                break
            watched, events = t, 0
        if mode == P.FLIGHT:
            if k[P.CLOSED_FORM] or at_rest:
                t, wall = fly_closed(t, Words(y, low, trial), end, grace, system, work, samples, with_energy)
            else:
                t, wall = fly_integrated(t, y, end, grace, system, work, trial, samples)
            at_rest = wall == AT_REST
            grace = 0.0
            if wall == NO_END:
                break
            if wall < 0:
                continue
        else:
            start, held = t, wall
            t, event, wall = follow_wall(t, y, wall, end, system, work, trial, samples)
            if n_contacts < contacts.shape[0]:
                contacts[n_contacts, 0], contacts[n_contacts, 1] = start, t
            n_contacts += 1
            in_contact += t - start
            if event == GOES_ON or event == STALLED:
                break
            if event != HITS and held >= P.PAIR:  # out of a corner, along the wall that still presses
                mode = P.SLIDE
                continue
            if event != HITS:
                mode = P.FLIGHT
                grace = short_while(y, p)
                continue
        copy_into(before, y)
        mode, duration, counted = resolve(t, y, wall, system, work, record)
        t += duration
        carry_extended(y, before, low, record, counted and mode == P.FLIGHT, p, k)
        if counted:
            speeds = record[P.NORMAL_BEFORE], record[P.TANGENTIAL_BEFORE]
            remember_contact(t, work[P.PLACE], y, speeds, wall == P.OBSTACLE, p)
            if n_impacts < impacts.shape[0]:
                copy_into(impacts[n_impacts], record)
            n_impacts += 1
            if n_impacts >= k[P.MAX_IMPACTS]:
                break
        if mode == P.SLIDE and k[P.N_WALLS] > P.EDGES + 1:
            other = corner_partner(t, y, wall, system, work)
            if other >= 0:
                wall += P.PAIR * other
        elif mode == P.FLIGHT and not counted:
            grace = short_while(y, p)
    while due(samples, math.nextafter(t, math.inf)):
        keep_sample(y, system, work, samples)
    return t, n_impacts, n_contacts, in_contact
