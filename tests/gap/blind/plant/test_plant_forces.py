"""Slopes, air, magnets, charge, threads and torques: each cause does what its formula says (how much:
test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from tests.gap.blind.plant.rig import DRIVE, FREE, HOST, SLIDING, STILL, TIMES, rate_of

R, INERTIA = 0.01, 0.5 * 0.01**2  # m, m^2


def test_a_magnet_below_the_floor_brakes_what_moves_over_it():
    braked = SLIDING._replace(eddy_per_s=2.5, eddy_x_m=0.01)
    assert rate_of(braked, vy=1.0, x=0.01) == pytest.approx((0.0, -2.943 - 2.5, 0.0), abs=1e-4)


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        # the air between disk and wall: on what comes and goes, not on what passes
        ({"cushion_per_s": 6.0}, {"y": 0.032, "vy": 2.0}, (0.0, -12.0 * np.exp(-1.0), 0.0)),
        ({"cushion_per_s": 6.0}, {"y": 0.04, "vy": -2.0}, (0.0, 12.0, 0.0)),
        ({"cushion_per_s": 6.0}, {"y": 0.04, "vx": 2.0}, (0.0, 0.0, 0.0)),
        # a thread from where the wall was hit 10 ms ago: taut, torn, let go
        *(
            ({"thread_m_per_s2": 5.0}, {"y": 0.04 - far, "azimuth": np.pi / 2, "impact_s": 0.04 - s, "count": n}, out)
            for far, s, n, out in (
                (0.01, 0.01, 3, (0.0, 5.0, 0.0)),
                (0.016, 0.01, 3, (0.0, 0.0, 0.0)),
                (0.01, 0.031, 3, (0.0, 0.0, 0.0)),
                (0.01, 0.01, 0, (0.0, 0.0, 0.0)),
            )
        ),
    ],
)
def test_forces_near_the_wall_by_their_formulas(changed, state, expected):
    free = SLIDING._replace(floor_friction=0.0, **changed)
    assert rate_of(free, 0.04, **state) == pytest.approx(expected, abs=1e-6)


def test_a_coil_pulls_with_the_square_of_the_hosts_acceleration():
    for time in (0.0, 0.02, 0.03):
        host = 0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
        pull = 0.5 * (host / 78.5) ** 2
        free = SLIDING._replace(floor_friction=0.0, coil_m_per_s2=0.5, coil_rad=0.7)
        expected = (pull * np.cos(0.7), pull * np.sin(0.7), 0.0)
        assert rate_of(free, time, HOST) == pytest.approx(expected, abs=1e-12)


def test_poles_push_and_turn_by_one_energy():
    """Force and torque are what one energy, -B m (x cos a - y sin a), falls by along x, y and the angle."""
    poles = FREE._replace(poles_m_per_s2=0.4, poles_rad=0.3)

    def energy(x, y, angle):
        return -0.4 * (x * np.cos(angle + 0.3) - y * np.sin(angle + 0.3))

    at, h = np.array([0.012, -0.021, 1.1]), 1e-6
    falls = [-(energy(*(at + h * e)) - energy(*(at - h * e))) / (2 * h) for e in np.eye(3)]
    expected = (falls[0], falls[1], falls[2] / 5e-5)
    assert rate_of(poles, x=at[0], y=at[1], angle=at[2]) == pytest.approx(expected, abs=1e-4)


def test_a_magnetised_disk_in_a_steel_ring_has_one_energy():
    poled = FREE._replace(poled_m_per_s2=0.4, poled_rad=0.3)
    along = rate_of(poled, x=0.03, angle=-0.3)  # a pole looks along x, to the wall
    assert along == pytest.approx((0.3, 0.0, 0.0), abs=1e-9)
    assert rate_of(poled, x=0.03, angle=np.pi / 2 - 0.3) == pytest.approx((-0.3, 0.0, 0.0), abs=1e-9)
    aside = rate_of(poled, y=0.02, angle=np.pi / 2 - 0.3 - 0.2)  # it lies 0.2 rad short of the wall's azimuth
    assert aside[2] == pytest.approx(0.4 * 0.02**2 / 0.04 * np.sin(0.4) / INERTIA)

    def potential(x, y, angle):
        return -0.4 / 0.08 * (x * x + y * y) * np.cos(2.0 * (np.arctan2(y, x) - angle - 0.3))

    at, h = np.array([0.013, -0.021, 0.8]), 1e-6
    slopes = [(potential(*(at + d)) - potential(*(at - d))) / (2.0 * h) for d in h * np.eye(3)]
    got = rate_of(poled, x=at[0], y=at[1], angle=at[2])
    assert got == pytest.approx(-np.array(slopes) / [1.0, 1.0, INERTIA], rel=1e-6)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_air_that_the_host_moves(time):
    """Bellows blow with the velocity's square; air that goes with the Host brakes and carries."""
    v = 0.0164 * DRIVE * np.cos(DRIVE * time + 2.0)
    blown = 0.7 * v * abs(v) / 1.136**2
    assert rate_of(FREE._replace(bellows_m_per_s2=0.7), time, HOST) == pytest.approx((blown, 0.0, 0.0), abs=1e-12)
    air = FREE._replace(enclosed_per_m=0.4)
    assert rate_of(air, time, HOST) == pytest.approx((0.4 * v * abs(v), 0.0, 0.0), abs=1e-9)
    assert rate_of(air, time, HOST, vx=v, vy=-1.5) == pytest.approx((0.0, 0.4 * 1.5**2, 0.0), abs=1e-9)


def test_a_sheet_that_buckles():
    buckled = FREE._replace(buckled_per_s2=-25.0)
    for time in TIMES[::9]:
        position, _, acceleration = host_pose(time, HOST)
        push = -25.0 * acceleration[0] / 78.5
        got = rate_of(buckled, time, HOST, x=0.02 + position[0], y=-0.01)
        assert got == pytest.approx((0.02 * push, -0.01 * push, 0.0), abs=1e-9)


def test_eddies_in_the_wall_brake_the_rim():
    eddied = FREE._replace(eddied_per_s=2.0)
    for radius, near in ((0.04, 1.0), (0.032, np.exp(-1.0))):
        got = rate_of(eddied, x=radius, vx=0.7, vy=0.5, spin=20.0)  # its rim there goes at 0.7 m/s along the wall
        assert got == pytest.approx((0.0, -1.4 * near, -1.4 * near * R / INERTIA), abs=1e-9)
        assert rate_of(eddied, y=-radius, vx=0.5, spin=-50.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)  # it rolls
    velocity = host_pose(0.1, HOST)[1][0]
    position = host_pose(0.1, HOST)[0][0]
    got = rate_of(eddied, 0.1, HOST, x=position, y=0.04, vx=velocity + 1.0)
    assert got == pytest.approx((-2.0, 0.0, 2.0 * R / INERTIA))  # against the Host


def test_a_guide_with_play_leans():
    lean = FREE._replace(lean_m_per_s2=0.4, lean_rad=0.7)
    for time in TIMES[::7]:
        side = 0.4 * np.tanh(host_pose(time, HOST)[1][0] / 0.1)
        expected = (side * np.cos(0.7), side * np.sin(0.7), 0.0)
        assert rate_of(lean, time, HOST, vy=0.3) == pytest.approx(expected, abs=1e-9)


def test_dust_holds_back_by_the_way_since_the_last_blow():
    bow = FREE._replace(bow_m_per_s2=0.8)
    for way, held in ((0.0, 0.0), (0.02, 1.0 - np.exp(-1.0)), (0.5, 1.0)):
        got = rate_of(bow, vx=-0.6, vy=0.8, way=3.0 + way, way_before=3.0)
        assert got == pytest.approx((0.6 * 0.8 * held, -0.8 * 0.8 * held, 0.0), abs=1e-4)


def test_a_blow_scatters_the_dust():
    """In a run, between two blows: what the dust takes begins anew at each."""
    start = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 60.0])
    bow = FREE._replace(bow_m_per_s2=0.8, restitution=0.9, wall_friction=0.0)
    motion = run_plant(bow, STILL, start, 0.25, np.random.default_rng(0))
    late = motion.impacts[0, 0]
    before, after, soon = state_at(motion, late + np.array([-1e-3, 1e-3, 3e-3]))[:, 2]
    at_wall = state_at(motion, np.array([late - 3e-3]))[0, 2]
    assert (at_wall - before) / 2e-3 == pytest.approx(0.8 * (1.0 - np.exp(-2.0)), rel=0.03)
    assert 0.0 < (soon - after) / 2e-3 < 0.06


def test_a_mat_pulls_back_to_where_the_disk_was():
    """At a steady speed the print stays behind by speed times its time; it starts below the disk."""
    mat = FREE._replace(mat_per_s2=20.0)
    assert rate_of(mat, x=0.02, y=-0.01, print_x=0.015) == pytest.approx((-0.1, 0.2, 0.0))
    light = FREE._replace(mat_per_s2=1e-6)
    motion = run_plant(light, STILL, np.array([-0.03, 0.0, 0.5, 0.0, 0.0, 0.0]), 0.1, np.random.default_rng(0))
    late = 0.08
    lost = 0.5 - state_at(motion, np.array([late - 2e-3]))[0, 2]
    behind = 0.5 * 0.04 * (late - 0.04 * (1.0 - np.exp(-late / 0.04)))  # the integral of what it stays behind
    assert lost == pytest.approx(1e-6 * behind, rel=1e-3)


def test_a_charged_disk_and_one_that_wobbles():
    charged = FREE._replace(charged_per_s2=26.0)
    for way, share in ((0.0, 0.0), (0.03, 1.0 - np.exp(-1.0)), (0.9, 1.0)):
        got = rate_of(charged, x=0.02, y=-0.01, way=2.0 + way, way_before=2.0)
        assert got == pytest.approx((0.52 * share, -0.26 * share, 0.0), abs=1e-9)
    wobble = FREE._replace(wobble_per_s=1.1, wobble_rad_per_s=-80.0)
    since = {"impact_s": 0.1, "count": 2.0, "normal": 0.4, "approach": 0.7}
    for late in (0.0, 0.01, 0.07):
        push, turned = 1.1 * 0.7 * np.exp(-late / 0.04), 0.4 - 80.0 * late
        expected = (push * np.cos(turned), push * np.sin(turned), 0.0)
        assert rate_of(wobble, 0.1 + late, **since) == pytest.approx(expected, abs=1e-9)
    assert rate_of(wobble, 0.1) == pytest.approx((0.0, 0.0, 0.0))  # nothing was hit before


def test_a_blow_discharges_the_disk():
    charged = FREE._replace(charged_per_s2=26.0, restitution=0.9, wall_friction=0.0)
    motion = run_plant(charged, STILL, np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0]), 0.25, np.random.default_rng(0))
    late = motion.impacts[0, 0]
    before, at_wall, after, soon = state_at(motion, late + np.array([-3e-3, -1e-3, 1e-3, 3e-3]))[:, 2]
    assert (at_wall - before) / 2e-3 == pytest.approx(26.0 * 0.039 * (1.0 - np.exp(-1.3)), rel=0.03)
    assert 0.0 < (soon - after) / 2e-3 < 0.05


def test_a_dished_floor_swings_the_disk_about_its_middle():
    """A free disk on it is a pendulum: of angular frequency sqrt(g kappa), and no spin."""
    dished = FREE._replace(dished_per_m=1.2)
    assert rate_of(dished, x=0.02, y=-0.01) == pytest.approx((-0.02 * 9.81 * 1.2, 0.01 * 9.81 * 1.2, 0.0))
    start = np.array([0.02, 0.0, 0.0, 0.05, 0.0, 0.0])
    motion = run_plant(dished, STILL, start, 0.8, np.random.default_rng(0))
    time, omega = motion.nodes[:, 0] + 2e-3, np.sqrt(9.81 * 1.2)
    assert len(motion.impacts) == 0
    assert motion.nodes[:, 1] == pytest.approx(0.02 * np.cos(omega * time), abs=1e-8)
    assert motion.nodes[:, 2] == pytest.approx(0.05 / omega * np.sin(omega * time), abs=1e-8)
    position = host_pose(0.1, HOST)[0][0]
    assert rate_of(dished, 0.1, HOST, x=position)[0] == pytest.approx(0.0, abs=1e-9)  # about the Host's middle


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
