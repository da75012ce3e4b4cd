"""Sustained contact: sliding or rolling along the moving wall until the wall force changes sign."""

from __future__ import annotations

import math

from ovines.core.compiled import Floats, Ints, compiled
from ovines.core.contact.collision import onto_wall, strike
from ovines.core.integration.flight import wall_stands
from ovines.core.integration.sampling import take_sample
from ovines.core.integration.stepper import next_size, step
from ovines.core.system import parameters as P
from ovines.core.system.dynamics import NEED, PUSH, SLIP, derivatives
from ovines.core.system.kinematics import contact_velocity, inverse_mass, normal_here, place

GOES_ON, RELEASED, STICKS, SLIPS, HITS = range(5)


@compiled
def stand_on(
    t: float,
    y: Floats,
    mode: int,
    wall: int,
    p: Floats,
    k: Ints,
    drive: Floats,
    table: Floats,
    polygon: Floats,
    work: Floats,
) -> None:
    """Remove what rounding and the step left: distance from the wall, normal speed, and slip when rolling."""
    scratch, at = work[13], work[14]
    if wall >= P.PAIR:
        for turn in range(16):  # a corner of 60 degrees leaves a quarter of the rest per pair
            stand_on(
                t, y, P.SLIDE, wall % P.PAIR if turn % 2 == 0 else wall // P.PAIR, p, k, drive, table, polygon, work
            )
        return
    place(t, y, p, k, drive, table, scratch, at)
    onto_wall(y, at, wall, p, k, polygon)
    place(t, y, p, k, drive, table, scratch, at)
    nx, ny, _gap, _curvature = normal_here(wall, at, p, k, polygon)
    normal, slip = contact_velocity(nx, ny, y[5], at, p)
    k_nn, k_nt, k_tt = inverse_mass(nx, ny, at, p)
    if mode == P.ROLL:
        determinant = k_nn * k_tt - k_nt * k_nt
        strike(
            y, at, nx, ny, (k_nt * slip - k_tt * normal) / determinant, (k_nt * normal - k_nn * slip) / determinant,
            p, k,
        )  # fmt: skip
    else:
        strike(y, at, nx, ny, -normal / k_nn, 0.0, p, k)


@compiled
def happening(
    t: float,
    y: Floats,
    mode: int,
    wall: int,
    side: float,
    p: Floats,
    k: Ints,
    drive: Floats,
    table: Floats,
    polygon: Floats,
    work: Floats,
) -> tuple[int, int]:
    """What ends this mode at state ``y``, if anything, and the wall it concerns."""
    derivatives(t, y, mode, wall, side, p, k, drive, table, polygon, work[13], work[14], work[15])
    scratch = work[13]
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
        if normal_here(other, work[14], p, k, polygon)[2] < -1e-15 * p[P.LENGTH]:
            return HITS, other
    return GOES_ON, wall


@compiled
def start_mode(
    t: float, y: Floats, wall: int, p: Floats, k: Ints, drive: Floats, table: Floats, polygon: Floats, work: Floats
) -> tuple[int, float]:
    """Rolling if the slip is nothing and friction can hold it, else sliding and the side it slides to."""
    scratch = work[13]
    if wall >= P.PAIR:
        derivatives(t, y, P.CORNER, wall, 0.0, p, k, drive, table, polygon, work[13], work[14], work[15])
        slip = scratch[SLIP]
        return P.CORNER, (0.0 if abs(slip) <= 1e-9 * p[P.SPEED] else (1.0 if slip > 0.0 else -1.0))
    derivatives(t, y, P.ROLL, wall, 0.0, p, k, drive, table, polygon, work[13], work[14], work[15])
    slip, need, pushed = scratch[SLIP], scratch[NEED], scratch[PUSH]
    if abs(slip) > 1e-11 * p[P.SPEED]:
        return P.SLIDE, (1.0 if slip > 0.0 else -1.0)
    if abs(need) <= p[P.WALL_FRICTION] * pushed:
        return P.ROLL, 0.0
    return P.SLIDE, (-1.0 if need > 0.0 else 1.0)


@compiled
def follow_wall(
    t: float, y: Floats, wall: int, end: float, p: Floats, k: Ints, drive: Floats, table: Floats,
    polygon: Floats, work: Floats, trial: Floats, sample_times: Floats, samples: Floats, next_sample: int
) -> tuple[float, int, int, int]:  # fmt: skip
    """Move along ``wall`` from ``t`` until it ends: (time, what ended it, wall concerned, next sample)."""
    mode, side = start_mode(t, y, wall, p, k, drive, table, polygon, work)
    stand_on(t, y, mode, wall, p, k, drive, table, polygon, work)
    n = k[P.STATE_SIZE]
    h = 1e-2 * p[P.LENGTH] / (p[P.SPEED] + math.hypot(y[2], y[3]))
    while t < end:
        derivatives(t, y, mode, wall, side, p, k, drive, table, polygon, work[13], work[14], work[0])
        if work[13][PUSH] < 0.0:
            return t, RELEASED, (int(work[13][NEED]) if mode == P.CORNER else wall), next_sample
        h = min(h, p[P.MAX_STEP])
        s = min(h, end - t)
        error = step(t, y, s, mode, wall, side, p, k, drive, table, polygon, work, trial)
        if error > 1.0:
            h = next_size(s, error)
            continue
        event, concerned = happening(t + s, trial, mode, wall, side, p, k, drive, table, polygon, work)
        if event == STICKS and s < 1e-9 * p[P.MAX_STEP]:
            event = GOES_ON
        if event != GOES_ON:
            low, high = 0.0, s
            while high - low > 1e-10 * s:
                middle = 0.5 * (low + high)
                step(t, y, middle, mode, wall, side, p, k, drive, table, polygon, work, trial)
                found, other = happening(t + middle, trial, mode, wall, side, p, k, drive, table, polygon, work)
                if found == GOES_ON:
                    low = middle
                else:
                    high, event, concerned = middle, found, other
            s = high
        while next_sample < sample_times.shape[0] and sample_times[next_sample] < t + s:
            step(t, y, sample_times[next_sample] - t, mode, wall, side, p, k, drive, table, polygon, work, trial)
            stand_on(sample_times[next_sample], trial, P.SLIDE, wall, p, k, drive, table, polygon, work)
            take_sample(sample_times[next_sample], trial, p, k, drive, table, work, samples[next_sample])
            next_sample += 1
        step(t, y, s, mode, wall, side, p, k, drive, table, polygon, work, trial)
        for j in range(n):
            y[j] = trial[j]
        t += s
        if event == STICKS:
            mode, side = turn_over(t, y, wall, side, p, k, drive, table, polygon, work)
        elif event == SLIPS:
            side = -1.0 if work_need(t, y, wall, p, k, drive, table, polygon, work) > 0.0 else 1.0
            mode = P.SLIDE
        stand_on(t, y, mode, wall, p, k, drive, table, polygon, work)
        if event == RELEASED or event == HITS:
            return t, event, concerned, next_sample
        h = next_size(s, error) if event == GOES_ON else 1e-3 * p[P.MAX_STEP]
    return t, GOES_ON, wall, next_sample


@compiled
def work_need(
    t: float, y: Floats, wall: int, p: Floats, k: Ints, drive: Floats, table: Floats, polygon: Floats, work: Floats
) -> float:
    """Tangential force that rolling would need here."""
    derivatives(t, y, P.ROLL, wall, 0.0, p, k, drive, table, polygon, work[13], work[14], work[15])
    return work[13][NEED]


@compiled
def turn_over(
    t: float,
    y: Floats,
    wall: int,
    side: float,
    p: Floats,
    k: Ints,
    drive: Floats,
    table: Floats,
    polygon: Floats,
    work: Floats,
) -> tuple[int, float]:
    """After the slip came to nothing: roll if friction holds, else slide on the way the free slip turns."""
    if wall >= P.PAIR:
        return P.CORNER, 0.0
    need = work_need(t, y, wall, p, k, drive, table, polygon, work)
    if abs(need) <= p[P.WALL_FRICTION] * work[13][PUSH]:
        return P.ROLL, 0.0
    return P.SLIDE, (-1.0 if need > 0.0 else 1.0)


@compiled
def corner_partner(
    t: float, y: Floats, wall: int, p: Floats, k: Ints, drive: Floats, table: Floats, polygon: Floats, work: Floats
) -> int:
    """An edge that the disk, resting on ``wall``, rests on too (-1: none): touching, not moving, pressed by both."""
    place(t, y, p, k, drive, table, work[13], work[14])
    for other in range(P.EDGES, k[P.N_WALLS]):
        if other == wall:
            continue
        nx, ny, gap, _curvature = normal_here(other, work[14], p, k, polygon)
        normal = contact_velocity(nx, ny, y[5], work[14], p)[0]
        if gap > 1e-10 * p[P.LENGTH] or abs(normal) > 1e-5 * p[P.SPEED]:
            continue
        pair = wall + P.PAIR * other
        derivatives(t, y, P.CORNER, pair, 0.0, p, k, drive, table, polygon, work[13], work[14], work[15])
        if work[13][PUSH] > 0.0:
            return other
        place(t, y, p, k, drive, table, work[13], work[14])
    return -1
