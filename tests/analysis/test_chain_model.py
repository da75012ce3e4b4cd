"""A chain of impacts in closed form: straight flights between the walls of a Host at rest."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.chain_model import RECORD, RIG, simulate_chain
from analysis.flight_model import PARAMETERS


def chain(delay_s: float, speed: float = 1.0, restitution: float = 0.5):
    """Impacts of a disk thrown from the middle of a wall of 40 mm contact radius, without friction; (records, settled)."""
    rig = np.array([{"radius": 0.04, "disk_radius": 0.01, "inertia": 0.5, "omega": 60.0, "stop_speed": 0.02, "wall_friction": 0.15,
                     "tangential_restitution": 0.4, "delay": delay_s}.get(name, 0.0) for name in RIG])
    times = np.arange(0.0, 0.5, 1 / 800)
    records, befores, out = np.zeros((20, len(RECORD))), np.zeros((20, 6)), np.zeros((len(times), 6))
    count, _ = simulate_chain(np.array([0, 0, 0, speed, 0, 0.0]), 0.0, False, times, 0.0, np.full(20, restitution), np.zeros(len(PARAMETERS)),
                              np.zeros((4, 7)), rig, out, records, befores)
    return records[:count], out


@pytest.mark.parametrize("delay_s", [0.0, 3e-4])
def test_impacts_come_where_straight_flights_meet(delay_s):
    records, out = chain(delay_s)
    place, moment, speed = 0.0, 0.0, 1.0
    for record in records[:3]:
        # Past the wall by what the disk approaches during the delay, then back across the whole width.
        goal = 0.04 + delay_s * speed
        moment += (goal - place) / speed
        assert record[RECORD.index("time")] == pytest.approx(moment, abs=1e-9)
        assert record[RECORD.index("normal_before")] == pytest.approx(speed, rel=1e-9)
        place, speed = -goal, 0.5 * speed
    assert np.max(np.abs(out[:, 0])) <= 0.04 + delay_s + 1e-9
