"""Sustained contact: sliding or rolling along the moving wall until the wall force changes sign."""

from __future__ import annotations

import math

from ovines.core import state as S
from ovines.core.compiled import Floats, compiled
from ovines.core.contact.collision import onto_wall
from ovines.core.integration.flight import wall_stands
from ovines.core.integration.sampling import due, keep_sample
from ovines.core.integration.stepper import STEPS_WATCHED, next_size, stands_still, step
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import NEED, PUSH, SLIP, derivatives, push
from ovines.core.system.kinematics import contact_velocity, inverse_mass, normal_here, place
from ovines.core.system.known import remember_way
from ovines.core.system.packed import Contact, Samples, System

GOES_ON, RELEASED, STICKS, SLIPS, HITS, STALLED = range(6)


@compiled
def stand_on(
    t: float,
    y: Floats,
    mode: int,
    wall: int,
    system: System,
    work: Floats,
) -> None:
    """Remove what rounding and the step left: distance from the wall, normal speed, and slip when rolling."""
    p, k, polygon = system.p, system.k, system.polygon
    scratch, at = work[P.SCRATCH], work[P.PLACE]
    if wall >= P.PAIR:
        for turn in range(16):  # a corner of 60 degrees leaves a quarter of the rest per pair
            stand_on(t, y, P.SLIDE, wall % P.PAIR if turn % 2 == 0 else wall // P.PAIR, system, work)
        return
    place(t, y, system, scratch, at)
    onto_wall(y, at, wall, p, k, polygon)
    place(t, y, system, scratch, at)
    face = normal_here(wall, at, p, k, polygon)
    normal, slip = contact_velocity(face, y[S.SPIN], at, p)
    k_nn, k_nt, k_tt = inverse_mass(face, at, p)
    if mode == P.ROLL:
        determinant = k_nn * k_tt - k_nt * k_nt
        impulse_n = (k_nt * slip - k_tt * normal) / determinant
        impulse_t = (k_nt * normal - k_nn * slip) / determinant
        push(at, face, impulse_n, impulse_t, p, k, y)
    else:
        push(at, face, -normal / k_nn, 0.0, p, k, y)


@compiled
def happening(t: float, y: Floats, contact: Contact, system: System, work: Floats) -> tuple[int, int]:
    """What ends this mode at state ``y``, if anything, and the wall it concerns."""
    p, k, polygon = system.p, system.k, system.polygon
    mode, wall, side = contact.mode, contact.wall, contact.side
    derivatives(t, y, contact, system, work[P.SCRATCH], work[P.PLACE], work[P.SPARE])
    scratch = work[P.SCRATCH]
    if scratch[PUSH] < 0.0:
        return RELEASED, (int(scratch[NEED]) if mode == P.CORNER else wall)
    if mode == P.CORNER:
        return (STICKS if scratch[SLIP] * side < 0.0 else GOES_ON), wall
    friction = p[P.WALL_FRICTION]
    if mode == P.SLIDE and friction > 0.0 and scratch[SLIP] * side <= 0.0:
        return STICKS, wall
    if mode == P.ROLL and abs(scratch[NEED]) > friction * scratch[PUSH]:
        return SLIPS, wall
    for other in range(k[P.N_WALLS]):
        if other == wall or not wall_stands(other, p, k):
            continue
        if normal_here(other, work[P.PLACE], p, k, polygon).gap < -1e-15 * p[P.LENGTH]:
            return HITS, other
    return GOES_ON, wall


@compiled
def start_mode(t: float, y: Floats, wall: int, system: System, work: Floats) -> tuple[int, float]:
    """Rolling if the slip is nothing and friction can hold it, else sliding and the side it slides to."""
    p = system.p
    scratch = work[P.SCRATCH]
    if wall >= P.PAIR:
        derivatives(t, y, Contact(P.CORNER, wall, 0.0), system, work[P.SCRATCH], work[P.PLACE], work[P.SPARE])
        slip = scratch[SLIP]
        return P.CORNER, (0.0 if abs(slip) <= 1e-9 * p[P.SPEED] else (1.0 if slip > 0.0 else -1.0))
    derivatives(t, y, Contact(P.ROLL, wall, 0.0), system, work[P.SCRATCH], work[P.PLACE], work[P.SPARE])
    slip, need, pushed = scratch[SLIP], scratch[NEED], scratch[PUSH]
    if abs(slip) > 1e-11 * p[P.SPEED]:
        return P.SLIDE, (1.0 if slip > 0.0 else -1.0)
    if abs(need) <= p[P.WALL_FRICTION] * pushed:
        return P.ROLL, 0.0
    return P.SLIDE, (-1.0 if need > 0.0 else 1.0)


@compiled
def until_event(
    t: float, y: Floats, size: float, contact: Contact, system: System, work: Floats, trial: Floats
) -> tuple[float, int, int]:
    """How much of a step, whose end is in ``trial``, is free of events, what ends it (GOES_ON: nothing), and the wall
    concerned: by bisection, so that ``trial`` is any state of the step afterwards."""
    event, concerned = happening(t + size, trial, contact, system, work)
    if event == STICKS and size < 1e-9 * system.p[P.MAX_STEP]:
        event = GOES_ON
    if event == GOES_ON:
        return size, event, concerned
    low, high = 0.0, size
    while high - low > 1e-10 * size:
        middle = 0.5 * (low + high)
        step(t, y, middle, contact, system, work, trial)
        found, other = happening(t + middle, trial, contact, system, work)
        if found == GOES_ON:
            low = middle
        else:
            high, event, concerned = middle, found, other
    return high, event, concerned


@compiled
def follow_wall(
    t: float, y: Floats, wall: int, end: float, system: System, work: Floats, trial: Floats, samples: Samples
) -> tuple[float, int, int]:
    """Move along ``wall`` from ``t`` until it ends: (time, what ended it, wall concerned)."""
    p, k = system.p, system.k
    mode, side = start_mode(t, y, wall, system, work)
    stand_on(t, y, mode, wall, system, work)
    n = k[P.STATE_SIZE]
    h = 1e-2 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[S.VX], y[S.VY]))
    watched, steps = t, 0
    while t < end:
        steps += 1
        if steps == STEPS_WATCHED:
            if stands_still(t - watched, y, p):
                return t, STALLED, wall
            watched, steps = t, 0
        contact = Contact(mode, wall, side)
        derivatives(t, y, contact, system, work[P.SCRATCH], work[P.PLACE], work[0])
        if work[P.SCRATCH][PUSH] < 0.0:
            return t, RELEASED, (int(work[P.SCRATCH][NEED]) if mode == P.CORNER else wall)
        h = min(h, p[P.MAX_STEP])
        s = min(h, end - t)
        error = step(t, y, s, contact, system, work, trial)
        if error > 1.0:
            h = next_size(s, error)
            continue
        s, event, concerned = until_event(t, y, s, contact, system, work, trial)
        while due(samples, t + s):
            at = samples.times[samples.written[0]]
            step(t, y, at - t, contact, system, work, trial)
            stand_on(at, trial, P.SLIDE, wall, system, work)
            keep_sample(trial, system, work, samples)
        step(t, y, s, contact, system, work, trial)
        for j in range(n):
            y[j] = trial[j]
        t += s
        if p[P.MEMORY_M] > 0.0:
            place(t, y, system, work[P.SCRATCH], work[P.PLACE])
            remember_way(t, work[P.PLACE], p)
        if event == STICKS:
            mode, side = turn_over(t, y, wall, side, system, work)
        elif event == SLIPS:
            side = -1.0 if work_need(t, y, wall, system, work) > 0.0 else 1.0
            mode = P.SLIDE
        stand_on(t, y, mode, wall, system, work)
        if event == RELEASED or event == HITS:
            return t, event, concerned
        h = next_size(s, error) if event == GOES_ON else 1e-3 * p[P.MAX_STEP]
    return t, GOES_ON, wall


@compiled
def work_need(t: float, y: Floats, wall: int, system: System, work: Floats) -> float:
    """Tangential force that rolling would need here."""
    derivatives(t, y, Contact(P.ROLL, wall, 0.0), system, work[P.SCRATCH], work[P.PLACE], work[P.SPARE])
    return work[P.SCRATCH][NEED]


@compiled
def turn_over(
    t: float,
    y: Floats,
    wall: int,
    side: float,
    system: System,
    work: Floats,
) -> tuple[int, float]:
    """After the slip came to nothing: roll if friction holds, else slide on the way the free slip turns."""
    p = system.p
    if wall >= P.PAIR:
        return P.CORNER, 0.0
    need = work_need(t, y, wall, system, work)
    if abs(need) <= p[P.WALL_FRICTION] * work[P.SCRATCH][PUSH]:
        return P.ROLL, 0.0
    return P.SLIDE, (-1.0 if need > 0.0 else 1.0)


@compiled
def corner_partner(t: float, y: Floats, wall: int, system: System, work: Floats) -> int:
    """An edge that the disk, resting on ``wall``, rests on too (-1: none): touching, not moving, pressed by both."""
    p, k, polygon = system.p, system.k, system.polygon
    place(t, y, system, work[P.SCRATCH], work[P.PLACE])
    for other in range(P.EDGES, k[P.N_WALLS]):
        if other == wall:
            continue
        face = normal_here(other, work[P.PLACE], p, k, polygon)
        normal = contact_velocity(face, y[S.SPIN], work[P.PLACE], p)[0]
        if face.gap > 1e-10 * p[P.LENGTH] or abs(normal) > 1e-5 * p[P.SPEED]:
            continue
        pair = wall + P.PAIR * other
        derivatives(t, y, Contact(P.CORNER, pair, 0.0), system, work[P.SCRATCH], work[P.PLACE], work[P.SPARE])
        if work[P.SCRATCH][PUSH] > 0.0:
            return other
        place(t, y, system, work[P.SCRATCH], work[P.PLACE])
    return -1
