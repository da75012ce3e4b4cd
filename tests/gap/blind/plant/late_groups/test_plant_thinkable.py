"""What is thinkable on a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.flight.friction_by_history import rolls
from analysis.blind.plant.host import HOST_M_PER_S2, host_pose
from analysis.blind.plant.state import LEANT_X, LEFT, RIM_DENTS
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import lifted, pitched
from tests.gap.blind.plant.rig import (
    BARE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    G,
    after_blow,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    random_states,
    rate_of,
    state_of,
)

RUNS = 12


def test_three_feet_are_each_held_against_their_own_way():
    disk = SLIDING._replace(feet=1.0)
    assert rate_of(disk, vx=1.0) == pytest.approx((-G, 0.0, 0.0), abs=1e-9)
    # of a disk that only spins: at nine tenths of its radius, with half of its square for the inertia
    assert rate_of(disk, spin=30.0) == pytest.approx((0.0, 0.0, -G * 0.009 / 0.5e-4), abs=1e-6)
    assert rate_of(disk._replace(feet=3.0), spin=30.0) == pytest.approx(rate_of(disk, spin=30.0))
    # one foot at rest: it moves at 0.9 m/s back, the disk at as much forth; the two others 120 degrees from it
    at_rest = rate_of(disk._replace(feet_rad=0.5 * np.pi), vx=0.9, spin=100.0)
    two = np.array([[0.9 * 1.5, 0.9 * np.sqrt(0.75)], [0.9 * 1.5, -0.9 * np.sqrt(0.75)]])
    held = (two / np.hypot(*two.T)[:, None]).sum(axis=0) / 3.0
    assert at_rest[:2] == pytest.approx(-G * held, abs=1e-6)
    flat, half = rate_of(SLIDING, vx=0.5, spin=40.0), rate_of(disk._replace(feet=0.5), vx=0.5, spin=40.0)
    assert half == pytest.approx(0.5 * (flat + rate_of(disk, vx=0.5, spin=40.0)))
    turned = rate_of(disk, vx=0.5, spin=40.0, angle=2.0 * np.pi / 3.0)
    assert turned == pytest.approx(rate_of(disk, vx=0.5, spin=40.0))
    assert rate_of(disk, vx=0.5, spin=40.0, angle=0.5) != pytest.approx(turned, rel=1e-3)


@pytest.mark.further
def test_a_disk_rolls_on_a_grain_in_some_stretches():
    floor = SLIDING._replace(rolling=0.4, rolling_draw=0.3)
    time = np.arange(0.0, 30.0, 0.03) + 0.015  # well within each stretch
    found = np.array([rolls(one, floor) for one in time])
    assert set(found) == {0.0, 1.0} and np.mean(found) == pytest.approx(0.3, abs=0.05)
    for one, share in zip(time[:20], found, strict=False):
        assert rate_of(floor, one, vx=1.0)[0] == pytest.approx(-G * (1.0 - 0.4 * share), rel=1e-6)
    fine = np.array([rolls(one, floor) for one in np.arange(0.0, 1.2, 1e-4)])
    assert np.abs(np.diff(fine)).max() < 0.06  # no step
    draft = draft_series("unknown_rolling_grain", 1.0, np.random.default_rng(2), RUNS)
    assert len(set(draft.run_numbers["rolling_draw"])) == RUNS
    other = np.array([rolls(one, floor._replace(rolling_draw=0.31)) for one in time])
    assert not np.array_equal(other, found)


def test_fibres_keep_the_old_direction_for_a_while():
    floor, table = SLIDING._replace(leant=0.6), disk_friction_table()
    assert rate_of(floor, vx=1.0, leant_x=1.0) == pytest.approx((-G, 0.0, 0.0), abs=1e-6)
    assert rate_of(floor, vx=1.0)[0] == pytest.approx(-0.4 * G, rel=1e-6)
    assert rate_of(floor, vx=1.0, leant_y=-1.0)[:2] == pytest.approx((-0.4 * G, 0.6 * G), rel=1e-6)
    out = derivative(0.1, state_of(vx=0.6, vy=-0.8, leant_x=0.5, leant_y=0.2), floor, STILL, table)
    assert out[LEANT_X : LEANT_X + 2] == pytest.approx([(0.6 - 0.5) / 0.01, (-0.8 - 0.2) / 0.01])
    assert not np.any(derivative(0.1, state_of(vx=1.0), SLIDING, STILL, table)[LEANT_X : LEANT_X + 2])
    # A whole flight from upright fibres on: held by 1 - 0.6 exp(-way / 10 mm) of the friction.
    start, long = np.array([-0.2, 0.0, 1.2, 0.0, 0.0, 0.0]), floor._replace(contact_radius_m=1.0)
    nodes = run_plant(long, STILL, start, 0.2, np.random.default_rng(0)).nodes
    way = nodes[:, 1] - nodes[0, 1]
    lost = G * (way - 0.6 * 0.01 * (1.0 - np.exp(-way / 0.01)))
    assert nodes[:, 3] ** 2 == pytest.approx(1.44 - 2.0 * lost, abs=1e-4)


def test_fibres_give_back_no_more_than_they_have_taken():
    """What leans holds half of its square in energy; with that no flight of a disk that slides and spins gains any."""
    floor, table = SLIDING._replace(leant=1.0), disk_friction_table()
    for state in random_states():
        rate = derivative(0.1, state, floor, STILL, table)
        of_the_disk = state[2:4] @ rate[2:4] + 0.5e-4 * state[5] * rate[5]
        leans = slice(LEANT_X, LEANT_X + 2)
        assert of_the_disk + G * 0.01 * (state[leans] @ rate[leans]) <= 1e-6


def test_a_puddle_stays_back_as_the_host_is_accelerated():
    floor = SLIDING._replace(puddle=0.5)
    for time in (0.0, 0.013, 0.03):
        position, velocity, acceleration = host_pose(time, HOST)
        for off in (0.0, 0.012):
            x = -0.022 * acceleration[0] / HOST_M_PER_S2 + off
            out = rate_of(floor, time, HOST, x=position[0] + x, vx=velocity[0] + 1.0)
            share = 1.0 - 0.5 * np.exp(-0.5 * (off / 0.012) ** 2)
            assert out[0] == pytest.approx(-G * share, rel=1e-6)
    assert rate_of(floor, y=0.012, vx=1.0)[0] == pytest.approx(-G * (1.0 - 0.5 * np.exp(-0.5)), rel=1e-6)


def test_a_blow_that_lets_the_disk_go_fast_leaves_a_film():
    floor = SLIDING._replace(primed=0.4)
    for left in (0.2, 0.9, 2.0):
        share = 1.0 - 0.4 * (left**2 - 0.81) / (left**2 + 0.81)
        assert rate_of(floor, vx=1.0, left=left)[0] == pytest.approx(-G * share, rel=1e-6)
    assert rate_of(floor, vx=1.0)[0] == pytest.approx(-G, rel=1e-6)  # before any blow
    wall = BARE._replace(primed=0.4)
    out = after_blow(0.1, state_of(x=0.04, vx=1.0, vy=0.3), wall, STILL, np.zeros(2))
    assert out[LEFT] == pytest.approx(np.hypot(*out[2:4]))
    assert after_blow(0.1, state_of(x=0.04, vx=1.0), BARE, STILL, np.zeros(2))[LEFT] == 0.0


@pytest.mark.parametrize("changed", [{"feet": 1.0}, {"rolling": 0.9}, {"puddle": 0.9}, {"primed": 0.9}])
def test_no_flight_leaves_more_energy(changed):
    p, table = SLIDING._replace(**changed), disk_friction_table()
    for state in random_states():
        rate = derivative(0.1, state, p, STILL, table)
        assert state[2:4] @ rate[2:4] + 0.5e-4 * state[5] * rate[5] <= 1e-12


def test_a_slip_scuffs_the_rim_for_the_next_blow():
    rim = BARE._replace(scuffed_s_per_m=0.2)
    for slipped in (0.0, 0.7, -1.0):
        assert head_on(rim, count=3, slipped=slipped)[0] == pytest.approx(-0.7 + 0.2 * abs(slipped))
    assert head_on(rim, slipped=1.0)[0] == pytest.approx(-0.7)  # before any blow it is smooth


def test_a_blow_bares_one_side_of_the_rim():
    rim = BARE._replace(bared=0.5, tangential_restitution=0.0)
    for struck in (0.0, 1.0, np.pi):
        plain, now = head_on(BARE, vy=2.0), head_on(rim, vy=2.0, angle=0.4, struck=struck, count=2)
        share = 1.0 + 0.5 * np.cos(-0.4 - struck)
        assert now[1] - 2.0 == pytest.approx(share * (plain[1] - 2.0))
    assert head_on(rim, vy=2.0) == pytest.approx(head_on(BARE, vy=2.0))


def test_oblique_blows_scatter():
    wall = BARE._replace(glances=0.1)
    for chance in (-1.5, 0.0, 0.8):
        assert head_on(wall, chance=chance)[0] == pytest.approx(-0.7)
        for slip in (0.5, -1.0):
            assert head_on(wall, vy=slip, chance=chance)[0] == pytest.approx(-0.7 - 0.1 * chance * abs(slip))
        assert head_on(wall, vy=5.0, chance=chance)[0] == pytest.approx(-0.7 - 0.2 * chance)
    assert head_on(wall, vy=5.0, chance=9.0)[0] == pytest.approx(-0.98)


def test_blows_peen_the_rim_where_they_strike():
    rim = BARE._replace(peened=0.05)
    for sector, angle in ((0, -0.1), (0, -0.7), (7, 0.1), (4, -np.pi - 0.1)):
        blows = {f"rim_dents_{sector}": 3.0}
        assert head_on(rim, angle=angle, **blows)[0] == pytest.approx(-0.85)
        assert head_on(BARE, angle=angle, **blows)[0] == pytest.approx(-0.7)
    for p, speed, count in ((rim, 1.0, 1.0), (rim, 0.5, 0.0), (BARE, 1.0, 0.0)):
        out = after_blow(0.1, state_of(x=0.04, vx=speed, angle=-0.9), p, STILL, np.zeros(2))
        assert out[RIM_DENTS:] == pytest.approx([0.0, count, *[0.0] * 6])


def test_blows_flatten_the_rim_where_they_strike():
    wall, middle = BARE._replace(flattened_m=4e-4), -np.pi / 8.0
    gap, nx, ny = wall_gap(0.1, state_of(x=0.03, angle=middle, rim_dents_0=3.0), wall, STILL)
    assert (gap, nx, ny) == pytest.approx((0.01 + 4e-4 * (1.0 - np.exp(-0.6)), 1.0, 0.0))
    away = state_of(x=0.03, angle=middle - 1.7, rim_dents_0=3.0)  # beyond a quarter of the rim
    assert wall_gap(0.1, away, wall, STILL)[0] == pytest.approx(0.01)
    state = state_of(x=0.03, rim_dents_0=3.0)
    left = 4e-4 * np.exp(-0.6 * np.cos(middle) ** 2)
    far, rise = 0.04 + 4e-4 - left, left * 0.6 * np.sin(-2.0 * middle)
    size = np.hypot(1.0, rise / 0.03)
    gap, nx, ny = wall_gap(0.1, state, wall, STILL)
    assert (gap, nx, ny) == pytest.approx(((far - 0.03) / size, 1.0 / size, -rise / 0.03 / size))
    beside = contact_velocity(0.1, state, wall, STILL, 1.0, 0.0)
    assert beside[2:] == pytest.approx((0.01, -rise))
    assert wall_gap(0.1, state, BARE, STILL)[0] == pytest.approx(0.01)
    out = after_blow(0.1, state_of(x=0.04, vx=1.0, angle=-0.9), wall, STILL, np.zeros(2))
    assert out[RIM_DENTS:] == pytest.approx([0.0, 1.0, *[0.0] * 6])
    assert wall_gap(0.1, out, wall, STILL)[0] > 0.0  # it gives way: no disk is pushed


def test_no_blow_leaves_more_energy():
    for changed in (
        {"scuffed_s_per_m": 0.3},
        {"bared": 1.0},
        {"peened": 0.3},
        {"flattened_m": 3e-4},
        {"primed": 0.5},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_card_comes_off_in_the_course_of_a_run():
    nes, time = np.zeros((5, 4)), np.array([-1e-3, 0.1, 0.2, 0.3, 0.4])
    out = lifted(nes, time, ViewErrors(peeled_m=8e-4))
    assert out[:, 2] == pytest.approx([0.0, 2e-4, 4e-4, 6e-4, 8e-4]) and not np.any(out[:, [0, 1, 3]])
    assert lifted(nes, time, ViewErrors()) is nes


def test_the_hosts_plate_pitches_as_it_is_accelerated():
    time, points = np.array([0.01, 0.02, 0.04]), np.random.default_rng(3).normal(0.0, 0.05, (3, 12, 3))
    host = np.array([host_pose(t, HOST)[0] for t in time])
    out = pitched(points, host, time, HOST, ViewErrors(pitched_rad=0.02))
    for frame, t in enumerate(time):
        pull = host_pose(t, HOST)[2][0] / HOST_M_PER_S2
        rise = 0.02 * pull * (points[frame, 3:7, 0] - host[frame, 0])
        assert out[frame, 3:7, 2] - points[frame, 3:7, 2] == pytest.approx(rise)
    assert np.array_equal(out[..., :2], points[..., :2])
    assert np.array_equal(out[:, [0, 1, 2, *range(7, 12)]], points[:, [0, 1, 2, *range(7, 12)]])
    assert pitched(points, host, time, HOST, ViewErrors()) is points


def test_what_they_stand_beside():
    """Laws of a blow, and what a blow leaves behind, need blows that are over; a rim that is flattened a round wall."""
    needs_a_blow_that_is_over(
        f"unknown_{name}"
        for name in ("scuffed_rim", "bared_rim", "scattering_glances", "peened_rim", "flattened_rim", "primed_film")
    )
    needs_a_round_wall("unknown_flattened_rim")
    assert may_stand_together(("friction_drift", "unknown_rolling_grain"), "square", "chirp")
    assert may_stand_together(("vertical_motion", "unknown_pitching_plate"), "triangle", "random")
    free = FREE._replace(feet=0.5, rolling=0.5, leant=0.5, puddle=0.5, primed=0.5)
    assert rate_of(free, vx=1.0, spin=20.0) == pytest.approx((0.0, 0.0, 0.0))
