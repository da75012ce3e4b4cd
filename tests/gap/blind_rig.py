"""The plant's rig as the tests of its causes need it: a driven and a resting Host, a bare disk, states by name, one
blow."""

from __future__ import annotations

import numpy as np

from analysis.blind.plant.accelerations import derivative, host_pose
from analysis.blind.plant.contact import impact
from analysis.blind.plant.disk_friction import disk_friction_table
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.state import STATES, PlantParameters

DRIVE = 22.0 * np.pi
HOST = np.array([[0.0, 0.0164, DRIVE, 2.0, 0.0, 0.0, 0.0]])  # 8 g along x, as half of a trial's runs
STILL = np.zeros((1, 7))
PLACE = (
    *("x", "y", "vx", "vy", "angle", "spin", "impact_s", "stretch", "way", "hard", "lx", "ly", "azimuth", "count"),
    *("normal", "approach", "tired", "sleeve", "print_x", "print_y", "way_before", "core"),
)
FREE = PlantParameters(floor_friction=0.0, smoothing_m_per_s=1e-6)
SLIDING = FREE._replace(floor_friction=0.3)
BARE = PlantParameters(floor_friction=0.0, restitution=0.7, wall_friction=0.15, tangential_restitution=0.45)
G = 0.3 * 9.81
TIMES = 0.05 + np.arange(60) / 60.0 / 11.0  # in a period of the drive


def state_of(**numbers):
    """A state (STATES,) with these numbers, before any impact."""
    state = np.zeros(STATES)
    state[6] = -1.0
    for name, value in numbers.items():
        state[PLACE.index(name)] = value
    return state


def rate_of(p, time=0.0, host=STILL, **numbers):
    """Acceleration (x, y) and spin's rate."""
    return derivative(time, state_of(**numbers), p, host, disk_friction_table())[[2, 3, 5]]


def struck(p, time=0.1, host=STILL, chance=0.0, **numbers):
    """The state after a blow along x at 1 m/s against the Host, but for what `numbers` say."""
    position, velocity, _ = host_pose(time, host)
    state = state_of(**{"vx": 1.0, **numbers})
    state[0] += position[0] + 0.04
    state[2] += velocity[0]
    return impact(time, state, p, host, np.array([0.0, chance]), 1.0)[0]


def head_on(p, speed=1.0, spin=0.0, time=0.1, host=STILL, **numbers):
    """Normal velocity against the wall, slip and spin after a blow along x."""
    out = struck(p, time, host, vx=speed, spin=spin, **numbers)
    return out[2] - host_pose(time, host)[1][0], out[3] + 0.01 * out[5], out[5]


def random_states(at_wall=False):
    """Sixty states (60, STATES) in the ring at TIMES, or at its wall and on their way into it, 5 to 100 ms after the
    impact before."""
    rng, out = np.random.default_rng(7), np.zeros((60, STATES))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, 60)
    radius = np.full(60, 0.04) if at_wall else 0.036 * np.sqrt(rng.random(60))
    out[:, :2] = radius[:, None] * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    out[:, 2:4] = rng.normal(0.0, 0.86, (60, 2))
    out[:, 4], out[:, 5] = rng.uniform(0.0, 2.0 * np.pi, 60), rng.normal(0.0, 32.0, 60)
    out[:, 6], out[:, 12], out[:, 13] = TIMES - rng.uniform(0.005, 0.1, 60), azimuth, np.arange(1, 61)
    out[:, 14], out[:, 15], out[:, 16] = rng.uniform([0.0, 0.2, 0.0], [2.0 * np.pi, 2.0, 2.5], (60, 3)).T
    out[:, 17], out[:, 18:20] = rng.normal(0.0, 0.15, 60), rng.normal(0.0, 0.015, (60, 2))
    if at_wall:
        inwards = np.minimum(np.sum(out[:, :2] * out[:, 2:4], axis=1) / 0.04**2, 0.0)
        out[:, 2:4] -= 2.0 * inwards[:, None] * out[:, :2]
        out[:, 12] += rng.normal(0.0, 0.5, 60)
    later = np.random.default_rng(8)
    out[:, 20], out[:, 21] = -0.06 * later.random(60), out[:, 5] + later.normal(0.0, 25.0, 60)
    out[:, 0] += [host_pose(time, HOST)[0][0] for time in TIMES]
    out[:, 2] += [host_pose(time, HOST)[1][0] for time in TIMES]
    return out


def energy(state):
    """Kinetic energy per unit mass (J / kg) of a bare disk."""
    return 0.5 * (state[2] ** 2 + state[3] ** 2) + 0.25 * (0.01 * state[5]) ** 2


def first_contacts(p, host=STILL, angle=0.7, duration_s=0.02):
    """Times from the start (k,), approach and slip of the impacts of a disk that starts 10 mm before the wall, along x
    at 1 m/s."""
    start = np.array([0.03, 0.0, 1.0, 0.0, angle, 0.0])
    impacts = run_plant(p, host, start, duration_s, np.random.default_rng(0)).impacts
    return impacts[:, 0] + 2e-3, impacts[:, 1], impacts[:, 2]
