"""The plant's motion: fixed Runge-Kutta steps, contacts found by bisection, sustained contact by
projection."""

from typing import NamedTuple

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled, copy_into, making_arrays
from analysis.blind.plant.flight.accelerations import rate_into
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    ANGLE,
    ANGLE_BEFORE,
    CORE,
    COUNT,
    IMPACT_S,
    NORMAL,
    PRINT_X,
    PRINT_Y,
    SPIN,
    STATES,
    STEP_S,
    STRETCH,
    VX,
    VY,
    WAY,
    WAY_BEFORE,
    X,
    Y,
)
from analysis.blind.plant.wall.contact import strike, wall_gap
from analysis.blind.plant.wall.lasting_contact import compliant_step, lasts_s, spring_dashpot

START_S = -2e-3  # before the first frame, so that late or early cameras still see motion
HOLD_SPEED_M_PER_S = 3e-3  # an approach slower than this bounces within one step: the contact is sustained
LONGEST_HELD_S = 0.05  # a run is cut this long after a sustained contact began
RELEASE_GAP_M = 1e-6


class Motion(NamedTuple):
    """What one run did. `nodes` (n, 8): time, x, y, vx, vy (centre of mass), angle, spin, held (0 or 1);
    `impacts` (k, 3): time, normal and tangential approach speed; `held` (h, 2): start and end of sustained
    contact; `kicks` (k, 2): change of the disk's velocity in each impact (x, y), `normals` (k,): direction of the
    wall's outward normal in it (rad); `lines` (m, 7): those that the Host followed (`host_pose`), `swings` (s, 2, 7)
    its swings along x and y, each from its own time on; `physics`: the numbers of the run; `chances` (k, 2) of each
    impact.  Of a run that is remembered `nodes` have the rest of the state, too, (n, 2 + STATES)."""

    nodes: np.ndarray
    impacts: np.ndarray
    held: np.ndarray
    kicks: np.ndarray
    normals: np.ndarray
    lines: np.ndarray
    swings: np.ndarray
    physics: PlantParameters
    chances: np.ndarray


class Noted(NamedTuple):
    """Arrays that a run fills, as `Motion` has them; longer than a run needs."""

    nodes: Floats
    impacts: Floats
    held: Floats
    kicks: Floats
    normals: Floats
    swings: Floats


@compiled
def _step(
    time: float, state: Floats, step: float, p: PlantParameters, host: Floats, table: Floats, rates: Floats, new: Floats
) -> None:
    """The state a step later, into `new`; `rates` (5, STATES): room for the four stages' rates and where they are
    asked."""
    at, stage_s = rates[4], time
    copy_into(at, state)
    for stage in range(4):
        rate_into(stage_s, at, p, host, table, rates[stage])
        if stage < 3:
            part = step if stage == 2 else 0.5 * step
            stage_s = time + part
            for i in range(STATES):
                at[i] = state[i] + part * rates[stage, i]
    for i in range(STATES):
        new[i] = state[i] + step / 6.0 * (rates[0, i] + 2.0 * rates[1, i] + 2.0 * rates[2, i] + rates[3, i])


@compiled
def _touch(
    time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats, rates: Floats, new: Floats
) -> float:
    """The first instant within the coming step at which the disk is past the wall: bisection on the step's length; its
    state into `new`."""
    low, high = 0.0, STEP_S
    for _ in range(40):
        middle = 0.5 * (low + high)
        _step(time, state, middle, p, host, table, rates, new)
        if wall_gap(time + middle, new, p, host)[0] < 0.0:
            high = middle
        else:
            low = middle
    _step(time, state, high, p, host, table, rates, new)
    return time + high


@making_arrays
def _with_swings(lines: Floats, p: PlantParameters) -> Floats:
    """The Host's lines, and two more (x, y) of one that gives: swings of no size yet."""
    if p.recoil_kg == 0.0:
        return lines.copy()
    host = np.zeros((lines.shape[0] + 2, 7))
    host[: lines.shape[0]] = lines
    for axis in range(2):
        row = host[lines.shape[0] + axis]
        row[0], row[4] = axis, START_S
        row[2] = p.recoil_rad_per_s * np.sqrt(1.0 - p.recoil_damping**2)
        row[5] = p.recoil_damping * p.recoil_rad_per_s
    return host


@compiled
def _push(rows: Floats, time: float, change_x: float, change_y: float, p: PlantParameters) -> None:
    """Swings of the Host (2, 7) after the disk's velocity has changed at `time`: the Host takes the opposite momentum,
    as a mass on a damped spring."""
    for axis in range(2):
        omega, decay, late = rows[axis, 2], rows[axis, 5], time - rows[axis, 4]
        size = rows[axis, 1] * np.exp(-decay * late)
        c, s = size * np.cos(omega * late + rows[axis, 3]), size * np.sin(omega * late + rows[axis, 3])
        c -= (change_x if axis == 0 else change_y) * p.mass_kg / (p.recoil_kg * omega)
        rows[axis, 1], rows[axis, 3], rows[axis, 4] = np.sqrt(c * c + s * s), np.arctan2(s, c), time


@compiled
def _note(node: Floats, time: float, state: Floats, held: float) -> None:
    node[0], node[7] = time, held
    for i in range(6):
        node[1 + i] = state[i]
    for i in range(6, node.shape[0] - 2):
        node[2 + i] = state[i]


@compiled
def _swung(swings: Floats, rows: Floats) -> None:
    """Keep the Host's swings (2, 7) as they are from now on."""
    for axis in range(2):
        copy_into(swings[axis], rows[axis])


@compiled
def _move(
    duration_s: float,
    p: PlantParameters,
    host: Floats,
    n_line: int,
    table: Floats,
    scatter: Floats,
    scratch: Floats,
    into: Noted,
) -> tuple[int, int, int, int]:
    """Fill what `Motion` has; counts of nodes, impacts, contacts that lasted and swings.  `scratch` (8, STATES): the
    state to begin with, and room."""
    nodes, impacts, held, kicks = into.nodes, into.impacts, into.held, into.kicks
    normals, swings = into.normals, into.swings
    state, new, rates, no_chance = scratch[0], scratch[1], scratch[2:7], scratch[7]
    n, n_impact, n_held, n_swing = 0, 0, 0, 0
    gives = p.recoil_kg > 0.0
    soft = lasts_s(p) > 0.0
    spring = spring_dashpot(p) if soft else (0.0, 0.0, 0.0)
    sustained = 5.0 * lasts_s(p)
    time, touching, since = START_S, False, 0.0
    while time < duration_s and n < nodes.shape[0] - 4 and n_impact < 3990 and n_held < 390:
        _note(nodes[n], time, state, 1.0 if touching else 0.0)
        n += 1
        if touching and time - since > LONGEST_HELD_S:
            break
        if touching and soft:
            compliant_step(time, state, p, host, table, spring, rates, new)
        else:
            _step(time, state, STEP_S, p, host, table, rates, new)
        gap = wall_gap(time + STEP_S, new, p, host)[0]
        if touching:
            if gap < 0.0 and not soft:
                copy_into(rates[0], new)
                strike(time + STEP_S, rates[0], p, host, no_chance, 0.0, new)
            elif gap > (0.0 if soft else RELEASE_GAP_M):
                touching = False
                new[STRETCH] = 0.0
                if time - since > sustained:
                    held[n_held, 0], held[n_held, 1] = since, time
                    n_held += 1
        if touching or gap >= 0.0:
            if gives:
                _push(host[n_line:], time + STEP_S, new[VX] - state[VX], new[VY] - state[VY], p)
                _swung(swings[n_swing], host[n_line:])
                n_swing += 1
            time += STEP_S
            copy_into(state, new)
            continue
        time = _touch(time, state, p, host, table, rates, new)
        copy_into(state, new)
        _note(nodes[n], time - 1e-12, state, 0.0)
        n += 1
        speed, slip = strike(time, state, p, host, scatter[n_impact], 1.0, new)
        impacts[n_impact, 0], impacts[n_impact, 1], impacts[n_impact, 2] = time, speed, slip
        kicks[n_impact, 0], kicks[n_impact, 1] = new[VX] - state[VX], new[VY] - state[VY]
        normals[n_impact] = new[NORMAL]
        if gives:
            _push(host[n_line:], time, kicks[n_impact, 0], kicks[n_impact, 1], p)
            _swung(swings[n_swing], host[n_line:])
            n_swing += 1
        n_impact += 1
        if not soft:
            copy_into(state, new)
        state[IMPACT_S], state[COUNT], state[WAY_BEFORE] = time, n_impact, state[WAY]
        state[ANGLE_BEFORE] = state[ANGLE]
        if soft or speed < HOLD_SPEED_M_PER_S:
            touching, since = True, time
    if touching and time - since > sustained:
        held[n_held, 0], held[n_held, 1] = since, time
        n_held += 1
    _note(nodes[n], time, state, 1.0 if touching else 0.0)
    return n + 1, n_impact, n_held, n_swing


@making_arrays
def _run(
    duration_s: float, state: Floats, p: PlantParameters, lines: Floats, table: Floats, scatter: Floats, noted: int
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
    nodes = np.empty((int((duration_s - START_S) / STEP_S) + 20000, noted))
    impacts, kicks, normals, held = np.empty((4000, 3)), np.zeros((4000, 2)), np.empty(4000), np.empty((400, 2))
    swings = np.zeros((nodes.shape[0] if p.recoil_kg > 0.0 else 0, 2, 7))
    host, scratch = _with_swings(lines, p), np.zeros((8, STATES))
    scratch[0] = state
    into = Noted(nodes, impacts, held, kicks, normals, swings)
    n, n_impact, n_held, n_swing = _move(duration_s, p, host, lines.shape[0], table, scatter, scratch, into)
    return (
        nodes[:n].copy(),
        impacts[:n_impact].copy(),
        held[:n_held].copy(),
        kicks[:n_impact].copy(),
        normals[:n_impact].copy(),
        lines,
        swings[:n_swing].copy(),
    )


def run_plant(
    parameters: PlantParameters,
    host_harmonics: np.ndarray,
    initial: np.ndarray,
    duration_s: float,
    rng: np.random.Generator,
    remembered: bool = False,
) -> Motion:
    """Move the disk for `duration_s` or until it has been held at the wall for a while.

    `host_harmonics` (n, 4 to 7): axis (0 x, 1 y, 2 rotation, 3 z), amplitude, angular frequency, phase of a sine, and
    the rest of `host_pose`'s rows.
    `initial` (6,): x, y, vx, vy, angle, spin; x and y relative to the Host, vx and vy in the room.  `remembered`: the
    whole state is noted, with what disk, floor and wall remember.
    """
    lines = np.zeros((len(host_harmonics), 7))
    lines[:, : host_harmonics.shape[1]] = host_harmonics
    position = host_pose(START_S, lines)[0]
    state = np.zeros(STATES)
    state[:6] = initial
    state[X] += position[0]
    state[Y] += position[1]
    state[IMPACT_S], state[CORE] = -1.0, initial[SPIN]
    state[ANGLE_BEFORE] = initial[ANGLE]
    state[PRINT_X], state[PRINT_Y] = initial[X], initial[Y]
    scatter = rng.normal(size=4000)
    chances = np.column_stack([scatter, scatter[::-1]])  # no run has half as many impacts
    noted = 2 + STATES if remembered else 8
    nodes, impacts, held, kicks, normals, lines, swings = _run(
        float(duration_s), state, parameters, lines, disk_friction_table(), chances, noted
    )
    return Motion(nodes, impacts, held, kicks, normals, lines, swings, parameters, chances[: len(impacts)])


def state_at(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """States (n, 7) at `time_s`: linear between nodes 39 microseconds apart, each impact having a node
    before and after."""
    time = motion.nodes[:, 0]
    return np.column_stack([np.interp(time_s, time, motion.nodes[:, i]) for i in range(1, 8)])


def remembered_at(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """Whole states (n, STATES) of a run that is remembered, as `state_at` has its first six numbers; at an impact's own
    time less 1e-12 s as the disk comes to it."""
    time, at = motion.nodes[:, 0], [*range(1, 7), *range(8, motion.nodes.shape[1])]
    return np.column_stack([np.interp(time_s, time, motion.nodes[:, i]) for i in at])


def host_at(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """Host (n, 4: x, y, rotation, z) at `time_s` (n,), swings included."""
    rows = host_lines_at(motion, time_s)
    return np.array([host_pose(t, own)[0] for t, own in zip(time_s, rows, strict=True)]).reshape(-1, 4)


def host_lines_at(motion: Motion, time_s: np.ndarray) -> list[np.ndarray]:
    """The Host's lines at each of `time_s` (n,), with the swings that it has then."""
    swung = np.searchsorted(motion.swings[:, 0, 4], time_s, side="right")
    return [motion.lines if k == 0 else np.vstack([motion.lines, motion.swings[k - 1]]) for k in swung]
