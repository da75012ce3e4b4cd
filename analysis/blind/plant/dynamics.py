"""The plant's motion: fixed Runge-Kutta steps, contacts found by bisection, sustained contact by
projection."""

from typing import NamedTuple

import numpy as np

from analysis.blind.plant.compiled import Floats, compiled
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.state import (
    CORE,
    COUNT,
    IMPACT_S,
    NORMAL,
    PRINT_X,
    PRINT_Y,
    SPIN,
    STATES,
    STRETCH,
    VX,
    VY,
    WAY,
    WAY_BEFORE,
    X,
    Y,
)
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.plant.wall.lasting_contact import compliant_step, spring_dashpot

STEP_S = 1.0 / 25600.0
START_S = -2e-3  # before the first frame, so that late or early cameras still see motion
HOLD_SPEED_M_PER_S = 3e-3  # an approach slower than this bounces within one step: the contact is sustained
LONGEST_HELD_S = 0.05  # a run is cut this long after a sustained contact began
RELEASE_GAP_M = 1e-6


class Motion(NamedTuple):
    """What one run did. `nodes` (n, 8): time, x, y, vx, vy (centre of mass), angle, spin, held (0 or 1);
    `impacts` (k, 3): time, normal and tangential approach speed; `held` (h, 2): start and end of sustained
    contact; `kicks` (k, 2): change of the disk's velocity in each impact (x, y), `normals` (k,): direction of the
    wall's outward normal in it (rad); `lines` (m, 7): those that the Host followed (`host_pose`), `swings` (s, 2, 7)
    its swings along x and y, each from its own time on."""

    nodes: np.ndarray
    impacts: np.ndarray
    held: np.ndarray
    kicks: np.ndarray
    normals: np.ndarray
    lines: np.ndarray
    swings: np.ndarray


@compiled
def _step(time: float, state: Floats, step: float, p: PlantParameters, host: Floats, table: Floats) -> Floats:
    k1 = derivative(time, state, p, host, table)
    k2 = derivative(time + 0.5 * step, state + 0.5 * step * k1, p, host, table)
    k3 = derivative(time + 0.5 * step, state + 0.5 * step * k2, p, host, table)
    k4 = derivative(time + step, state + step * k3, p, host, table)
    return state + step / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


@compiled
def _touch(time: float, state: Floats, p: PlantParameters, host: Floats, table: Floats) -> tuple[float, Floats]:
    """The first instant within the coming step at which the disk is past the wall: bisection on the step's
    length."""
    low, high = 0.0, STEP_S
    for _ in range(40):
        middle = 0.5 * (low + high)
        if wall_gap(time + middle, _step(time, state, middle, p, host, table), p, host)[0] < 0.0:
            high = middle
        else:
            low = middle
    return time + high, _step(time, state, high, p, host, table)


@compiled
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
def _run(
    duration_s: float, state: Floats, p: PlantParameters, lines: Floats, table: Floats, scatter: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
    nodes = np.empty((int((duration_s - START_S) / STEP_S) + 20000, 8))
    impacts, kicks, normals, held = np.empty((4000, 3)), np.zeros((4000, 2)), np.empty(4000), np.empty((400, 2))
    n, n_impact, n_held, n_swing, n_line = 0, 0, 0, 0, lines.shape[0]
    gives, host = p.recoil_kg > 0.0, _with_swings(lines, p)
    swings = np.zeros((nodes.shape[0] if gives else 0, 2, 7))
    soft = p.contact_time_s > 0.0
    spring = spring_dashpot(p) if soft else (0.0, 0.0, 0.0)
    sustained = 5.0 * p.contact_time_s
    time, touching, since = START_S, False, 0.0
    while time < duration_s and n < nodes.shape[0] - 4 and n_impact < 3990 and n_held < 390:
        nodes[n, 0], nodes[n, 1:7], nodes[n, 7] = time, state[:6], 1.0 if touching else 0.0
        n += 1
        if touching and time - since > LONGEST_HELD_S:
            break
        if touching and soft:
            new = compliant_step(time, state, STEP_S, p, host, table, spring)
        else:
            new = _step(time, state, STEP_S, p, host, table)
        gap = wall_gap(time + STEP_S, new, p, host)[0]
        if touching:
            if gap < 0.0 and not soft:
                new = impact(time + STEP_S, new, p, host, np.zeros(2), 0.0)[0]
            elif gap > (0.0 if soft else RELEASE_GAP_M):
                touching = False
                new[STRETCH] = 0.0
                if time - since > sustained:
                    held[n_held, 0], held[n_held, 1] = since, time
                    n_held += 1
        if touching or gap >= 0.0:
            if gives:
                _push(host[n_line:], time + STEP_S, new[VX] - state[VX], new[VY] - state[VY], p)
                swings[n_swing] = host[n_line:]
                n_swing += 1
            time, state = time + STEP_S, new
            continue
        time, state = _touch(time, state, p, host, table)
        nodes[n, 0], nodes[n, 1:7], nodes[n, 7] = time - 1e-12, state[:6], 0.0
        n += 1
        new, speed, slip = impact(time, state, p, host, scatter[n_impact], 1.0)
        impacts[n_impact, 0], impacts[n_impact, 1], impacts[n_impact, 2] = time, speed, slip
        kicks[n_impact, 0], kicks[n_impact, 1] = new[VX] - state[VX], new[VY] - state[VY]
        normals[n_impact] = new[NORMAL]
        if gives:
            _push(host[n_line:], time, kicks[n_impact, 0], kicks[n_impact, 1], p)
            swings[n_swing] = host[n_line:]
            n_swing += 1
        n_impact += 1
        if not soft:
            state = new
        state[IMPACT_S], state[COUNT], state[WAY_BEFORE] = time, n_impact, state[WAY]
        if soft or speed < HOLD_SPEED_M_PER_S:
            touching, since = True, time
    if touching and time - since > sustained:
        held[n_held, 0], held[n_held, 1] = since, time
        n_held += 1
    nodes[n, 0], nodes[n, 1:7], nodes[n, 7] = time, state[:6], 1.0 if touching else 0.0
    return (
        nodes[: n + 1].copy(),
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
) -> Motion:
    """Move the disk for `duration_s` or until it has been held at the wall for a while.

    `host_harmonics` (n, 4 to 7): axis (0 x, 1 y, 2 rotation, 3 z), amplitude, angular frequency, phase of a sine, and
    the rest of `host_pose`'s rows.
    `initial` (6,): x, y, vx, vy, angle, spin; x and y relative to the Host, vx and vy in the room.
    """
    lines = np.zeros((len(host_harmonics), 7))
    lines[:, : host_harmonics.shape[1]] = host_harmonics
    position = host_pose(START_S, lines)[0]
    state = np.zeros(STATES)
    state[:6] = initial
    state[X] += position[0]
    state[Y] += position[1]
    state[IMPACT_S], state[CORE] = -1.0, initial[SPIN]
    state[PRINT_X], state[PRINT_Y] = initial[X], initial[Y]
    scatter = rng.normal(size=4000)
    chances = np.column_stack([scatter, scatter[::-1]])  # no run has half as many impacts
    return Motion(*_run(float(duration_s), state, parameters, lines, disk_friction_table(), chances))


def state_at(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """States (n, 7) at `time_s`: linear between nodes 39 microseconds apart, each impact having a node
    before and after."""
    time = motion.nodes[:, 0]
    return np.column_stack([np.interp(time_s, time, motion.nodes[:, i]) for i in range(1, 8)])


def host_at(motion: Motion, time_s: np.ndarray) -> np.ndarray:
    """Host (n, 4: x, y, rotation, z) at `time_s` (n,), swings included."""
    out = np.empty((len(time_s), 4))
    begins = motion.swings[:, 0, 4]
    for i, (t, k) in enumerate(zip(time_s, np.searchsorted(begins, time_s, side="right"), strict=True)):
        rows = motion.lines if k == 0 else np.vstack([motion.lines, motion.swings[k - 1]])
        out[i] = host_pose(t, rows)[0]
    return out
