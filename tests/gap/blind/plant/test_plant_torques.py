"""Torques: each cause does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from tests.gap.blind.plant.rig import DRIVE, FREE, HOST, SLIDING, STILL, rate_of


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        ({"ratchet_rad_per_s2": 120.0, "floor_friction": 0.0}, {"spin": 60.0}, (0.0, 0.0, -120.0)),
        ({"ratchet_rad_per_s2": 120.0, "floor_friction": 0.0}, {"spin": -60.0}, (0.0, 0.0, 0.0)),
        ({"ratchet_rad_per_s2": -120.0, "floor_friction": 0.0}, {"spin": -60.0}, (0.0, 0.0, 120.0)),
    ],
)
def test_a_ratchet_brakes_one_sense_of_spin(changed, state, expected):
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_an_alternating_field_turns_with_the_hosts_acceleration(time):
    a = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
    field = FREE._replace(alternating_rad_per_s2=400.0, alternating_rad=0.4)
    expected = (0.0, 0.0, 400.0 * a / 78.5 * np.sin(0.4 - 1.1))
    assert rate_of(field, time, HOST, angle=1.1) == pytest.approx(expected, abs=1e-9)


def test_a_fin_and_a_loose_core():
    vane = FREE._replace(vane_rad_per_s2=30.0, vane_rad=0.4)
    for angle, turned in ((-0.4, 0.0), (np.pi / 2 - 0.4, -1.0), (-np.pi / 2 - 0.4, 1.0)):
        assert rate_of(vane, vx=1.5, angle=angle) == pytest.approx((0.0, 0.0, 30.0 * 2.25 * turned), abs=1e-9)
    core = FREE._replace(core_per_s=2.0)
    assert rate_of(core, spin=50.0, core=20.0) == pytest.approx((0.0, 0.0, -60.0))


def test_a_blow_leaves_the_core_behind():
    """In a run, between two blows; the core begins with the disk's spin."""
    start = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 60.0])
    core = FREE._replace(core_per_s=2.0, wall_friction=0.3)
    motion = run_plant(core, STILL, start, 0.25, np.random.default_rng(0))
    late, flown_s = motion.impacts[0, 0], 0.9 * np.diff(motion.impacts[:2, 0])[0]
    spins = state_at(motion, late + np.array([-1e-3, 1e-6, flown_s]))[:, 5]
    assert spins[0] == pytest.approx(60.0)  # as fast as its core
    rate = 2.0 + 1.0 / 0.03  # at which what the core lacks of the spin dies out
    lost = 2.0 * (spins[1] - 60.0) * (1.0 - np.exp(-rate * flown_s)) / rate
    assert abs(lost) > 1.0 and spins[2] - spins[1] == pytest.approx(-lost, rel=1e-3)


def test_a_spiral_groove_turns_the_disk_as_it_slides():
    spiral = FREE._replace(spiral_rad_per_s2=-30.0)
    for direction in (0.0, 2.0):
        got = rate_of(spiral, vx=1.5 * np.cos(direction), vy=1.5 * np.sin(direction), spin=20.0)
        assert got == pytest.approx((0.0, 0.0, -45.0), abs=1e-9)
    along = host_pose(0.1, HOST)[1][0]
    assert rate_of(spiral, 0.1, HOST, vx=along, vy=0.4)[2] == pytest.approx(-12.0)  # over the floor, not the room


def test_a_wire_counts_the_turns():
    wound = FREE._replace(wound_per_s2=4.0, wound_rad=1.5)
    for angle in (-3.0, 1.5, 1.5 + 4.0 * np.pi):
        assert rate_of(wound, angle=angle, vx=1.0) == pytest.approx((0.0, 0.0, -4.0 * (angle - 1.5)), abs=1e-9)
