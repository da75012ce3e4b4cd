"""What is imaginable on a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.state import AFLOAT, ANGLE_BEFORE, TRODDEN, TRODDEN_SIDE, WALK_X, WALK_Y
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import shaking_of
from analysis.blind.recording.tracker import bridged, ghosted, missed, wandered_off_px
from analysis.blind.recording.views import DISK
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


def test_a_floor_that_shivers_holds_slow_slips_less():
    floor = SLIDING._replace(shiver_m_per_s=0.5)
    for slip in (0.1, -0.3, 0.45):  # of twelve instants some have the floor faster than the disk
        held = 2.0 / np.pi * np.arcsin(slip / 0.5)
        assert rate_of(floor, vx=slip)[0] == pytest.approx(-G * held, abs=G / 11.0)
    assert rate_of(floor, vx=0.6) == pytest.approx((-G, 0.0, 0.0), abs=1e-9)
    phase = np.linspace(0.0, 2.0 * np.pi, 1001)[:-1]
    for across in (0.2, 1.0, -3.0):
        held = np.mean(across / np.hypot(across, 0.5 * np.sin(phase)))
        assert rate_of(floor, vy=across) == pytest.approx((0.0, -G * held, 0.0), abs=2e-3 * G)


def test_a_disk_floats_from_a_fast_slip_on_until_a_slow_one():
    disk, table = SLIDING._replace(afloat=0.4), disk_friction_table()
    for floats in (0.0, 0.5, 1.0):
        assert rate_of(disk, vx=1.0, afloat=floats)[0] == pytest.approx(-G * (1.0 - 0.4 * floats), rel=1e-6)
    for speed, floats, goes_to in ((1.5, 0.0, 1.0), (0.6, 1.0, 0.0), (1.0, 0.2, 0.0), (1.0, 0.8, 1.0)):
        rate = derivative(0.1, state_of(vx=speed, afloat=floats), disk, STILL, table)[AFLOAT]
        assert rate == pytest.approx((goes_to - floats) / 2e-3)
    # A whole flight: from 1.6 m/s on it floats down to 0.7 m/s, which takes 0.9 m/s of 0.6 of the friction.
    start, long = np.array([-0.2, 0.0, 1.6, 0.0, 0.0, 0.0]), disk._replace(contact_radius_m=1.0)
    nodes = run_plant(long, STILL, start, 0.6, np.random.default_rng(0)).nodes
    slow = nodes[np.argmax(nodes[:, 3] < 0.7), 0]
    assert slow + 2e-3 == pytest.approx(0.9 / (0.6 * G), rel=0.01)


def test_a_disk_polishes_the_floor_where_it_goes():
    floor, table = SLIDING._replace(trodden=0.6), disk_friction_table()
    for way in (0.0, 0.1, 0.5):
        share = 1.0 - 0.6 * (1.0 - np.exp(-way / 0.15))
        assert rate_of(floor, vx=1.0, x=0.02, trodden_5=way)[0] == pytest.approx(-G * share, rel=1e-6)
        assert rate_of(floor, vx=1.0, y=-0.02, trodden_1=way)[0] == pytest.approx(-G * share, rel=1e-6)
        assert rate_of(floor, vx=1.0, y=0.03, trodden_7=way)[0] == pytest.approx(-G * share, rel=1e-6)
        between = 1.0 - 0.3 * (1.0 - np.exp(-way / 0.15))
        assert rate_of(floor, vx=1.0, x=0.01, trodden_5=way)[0] == pytest.approx(-G * between, rel=1e-6)
    places = slice(TRODDEN, TRODDEN + TRODDEN_SIDE**2)
    rate = derivative(0.1, state_of(x=0.015, y=-0.005, vx=0.6, vy=0.8), floor, STILL, table)[places]
    assert rate == pytest.approx(np.outer([0.25, 0.75, 0.0], [0.0, 0.25, 0.75]).ravel())
    assert not np.any(derivative(0.1, state_of(vx=1.0), SLIDING, STILL, table)[places])


def test_a_blow_kicks_the_floor():
    floor = SLIDING._replace(kicked=0.5, kicked_rad_per_s=100.0)
    for late in (0.0, 0.02, 0.05):
        moves = 0.5 * 1.2 * np.exp(-late / 0.04) * np.cos(100.0 * late) * np.array([np.cos(0.4), np.sin(0.4)])
        slip = np.array([0.3, -0.5]) - moves
        blow = {"count": 1, "impact_s": 0.1 - late, "approach": 1.2, "normal": 0.4}
        out = rate_of(floor, 0.1, vx=0.3, vy=-0.5, **blow)[:2]
        assert out == pytest.approx(-G * slip / np.hypot(*slip), rel=1e-5)
    assert rate_of(floor, 0.1, vx=1.0, approach=1.2, impact_s=0.05)[0] == pytest.approx(-G, rel=1e-6)  # no blow before


def test_a_disk_throws_the_dust_out_as_it_turns():
    dust = SLIDING._replace(spun_out=0.5)
    for turned in (0.0, 2.0, -7.0):
        share = 1.0 + 0.5 * (1.0 - np.exp(-abs(turned) / 3.0))
        out = rate_of(dust, vx=1.0, angle=9.0 + turned, angle_before=9.0)
        assert out[0] == pytest.approx(-G * share, rel=1e-6)
    # A blow sets it back: of two runs alike but for that the second starts at another angle none differs.
    one, other = (
        run_plant(dust, STILL, np.array([0.01, 0.0, 0.9, 0.2, angle, 60.0]), 0.2, np.random.default_rng(0)).nodes
        for angle in (0.0, 5.0)
    )
    assert one[:, 1:5] == pytest.approx(other[:, 1:5], abs=1e-9)
    assert state_of(angle_before=1.0)[ANGLE_BEFORE] == 1.0


@pytest.mark.parametrize("changed", [{"shiver_m_per_s": 0.8}, {"afloat": 0.8}, {"trodden": 0.9}, {"spun_out": 0.9}])
def test_no_flight_leaves_more_energy(changed):
    p, table = SLIDING._replace(**changed), disk_friction_table()
    for state in random_states():
        rate = derivative(0.1, state, p, STILL, table)
        assert state[2:4] @ rate[2:4] + 0.5e-4 * state[5] * rate[5] <= 1e-12


def test_what_sticks_gives_back_less():
    wall = BARE._replace(gripped=0.3)
    for slip in (0.0, 0.4, -0.5):  # what is held needs 1.45 slip / 3, and there is 0.255 of it
        assert head_on(wall, vy=slip)[0] == pytest.approx(-0.49)
    for slip in (0.6, -2.0):
        assert head_on(wall, vy=slip)[0] == pytest.approx(-0.7)
        assert head_on(wall, vy=slip) == pytest.approx(head_on(BARE, vy=slip))
    assert head_on(BARE._replace(gripped=2.0))[0] == pytest.approx(0.0, abs=1e-12)


def test_a_fast_disk_climbs_a_coved_wall():
    wall = BARE._replace(coved_m=4e-4)
    for speed in (-2.0, 0.0, 1.0, 3.0):
        fourth = max(speed, 0.0) ** 4
        gap = wall_gap(0.1, state_of(x=0.03, vx=speed), wall, STILL)[0]
        assert gap == pytest.approx(0.01 + 4e-4 * (fourth - 1.0) / (fourth + 1.0))
    # against the Host, not in the room; and a blow leaves it where a disk that goes inwards may be
    position, velocity, _ = host_pose(0.1, HOST)
    state = state_of(x=position[0] + 0.03, vx=velocity[0] + 2.0)
    assert wall_gap(0.1, state, wall, HOST)[0] == pytest.approx(0.01 + 4e-4 * 15.0 / 17.0)
    left = impact(0.1, state_of(x=0.0402, vx=2.0), wall, STILL, np.zeros(2), 1.0)[0]
    assert left[2] == pytest.approx(-1.4) and left[0] == pytest.approx(0.04 - 4e-4)
    assert wall_gap(0.1, left, wall, STILL)[0] == pytest.approx(0.0, abs=1e-12)
    cylinder = wall._replace(obstacle_m=0.018)
    assert wall_gap(0.1, state_of(x=0.02, vx=-1.0), cylinder, STILL)[0] == pytest.approx(0.002)


def test_blows_make_a_ring_walk():
    wall = BARE._replace(walked_m=1e-4)
    gap = wall_gap(0.1, state_of(x=0.03, walk_x=3.0, walk_y=-1.0), wall, STILL)[0]
    assert gap == pytest.approx(0.0103, abs=1e-6)
    state, turned = state_of(x=0.04, vx=1.0, walk_x=2.0), np.array([np.cos(0.3), np.sin(0.3)])
    once = after_blow(0.1, state, wall, STILL, np.zeros(2))
    assert once[[WALK_X, WALK_Y]] == pytest.approx([3.0, 0.0])
    aside = state_of(x=0.04 * turned[0], y=0.04 * turned[1], vx=1.0)
    assert after_blow(0.1, aside, wall, STILL, np.zeros(2))[[WALK_X, WALK_Y]] == pytest.approx(turned)
    assert not np.any(after_blow(0.1, state_of(x=0.04, vx=0.2), wall, STILL, np.zeros(2))[[WALK_X, WALK_Y]])
    assert not np.any(after_blow(0.1, state_of(x=0.04, vx=1.0), BARE, STILL, np.zeros(2))[[WALK_X, WALK_Y]])
    moving = contact_velocity(0.1, state, wall, STILL, 1.0, 0.0)
    assert moving == contact_velocity(0.1, state, BARE, STILL, 1.0, 0.0)  # between two blows it is at rest


def test_no_blow_leaves_more_energy():
    for changed in ({"gripped": 0.9}, {"coved_m": 5e-4}, {"walked_m": 4e-4}):
        leaves_no_more_energy(BARE._replace(**changed))


def test_templates_wander_off():
    errors = view_of(draft_series("unknown_wandering_templates", 1.0, np.random.default_rng(2), RUNS))
    assert len(set(errors.wander_draw)) == RUNS
    off = np.array([wandered_off_px(400, draw, errors) for draw in errors.wander_draw])
    assert off.shape == (RUNS, 2, 400, 12, 2) and not np.any(off[:, :, 0])
    assert off[:, :, -1].std() == pytest.approx(errors.wander_px, rel=0.1)
    assert off[:, :, 100].std() == pytest.approx(0.5 * errors.wander_px, rel=0.15)
    none = np.zeros((0, 2))
    assert shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, errors).wander_draw == errors.wander_draw[4]
    assert shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, ViewErrors()).wander_draw is None


def test_what_is_fast_lies_partly_outside_the_window():
    errors, still = ViewErrors(missed=0.2), np.zeros((5, 12, 2))
    for step, behind in ((3.0, 0.0), (4.0, 0.0), (9.0, 1.0)):
        way = np.arange(5.0)[:, None, None] * step * np.array([0.6, -0.8])
        out = missed(still + way, errors) - way
        assert out[0] == pytest.approx(0.0) and out[1:] == pytest.approx(still[1:] - behind * np.array([0.6, -0.8]))
    assert missed(still, ViewErrors()) is still


def test_a_ghost_of_the_last_whole_frame_draws_markers_back():
    errors = ViewErrors(ghosted=0.1)
    way = 2.0 * np.arange(40.0)[:, None, None] * np.ones((1, 12, 2))
    out = ghosted(way, errors)
    assert (way - out)[:, 3, 0] == pytest.approx(0.2 * (np.arange(40) % 16))
    assert ghosted(way, ViewErrors()) is way


def test_gaps_are_bridged_by_a_line():
    errors = view_of(draft_series("unknown_bridged_gaps", 1.0, np.random.default_rng(2), RUNS))
    assert len(set(errors.bridged_draw)) == RUNS and 0.017 <= errors.bridged <= 0.023
    square = np.arange(303.0)[:, None, None] ** 2 * np.ones((1, 12, 2))
    out = bridged(square, 0, 7, ViewErrors(bridged=1.0))
    assert (out - square)[:9, DISK[1], 0] == pytest.approx([0.0, 3.0, 4.0, 3.0, 3.0, 4.0, 3.0, 3.0, 4.0])
    assert np.array_equal(out[:, : DISK[0]], square[:, : DISK[0]])
    straight = 3.0 * np.arange(303.0)[:, None, None] * np.ones((1, 12, 2))
    assert bridged(straight, 0, 7, ViewErrors(bridged=0.5)) == pytest.approx(straight)
    some = [bridged(square, index, 7, ViewErrors(bridged=0.3))[:, DISK] != square[:, DISK] for index in (0, 1)]
    assert np.mean(some) == pytest.approx(0.3, abs=0.05) and not np.array_equal(*some)
    none = np.zeros((0, 2))
    assert shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, errors).bridged_draw == errors.bridged_draw[4]
    assert shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, ViewErrors()).bridged_draw is None


def test_what_they_stand_beside():
    """What is near of kin to a listed one does not stand beside that; laws of a blow need blows that are over; a wall
    that is hollowed out is round."""
    needs_a_blow_that_is_over(f"unknown_{name}" for name in ("gripping_wall", "coved_wall", "walking_ring"))
    needs_a_blow_that_is_over(["unknown_kicked_floor"])
    needs_a_round_wall("unknown_coved_wall")
    assert not may_stand_together(("friction_drift", "unknown_trodden_floor"), "round", "sine")
    assert may_stand_together(("viscous_drag", "unknown_shivering_floor"), "square", "chirp")
    assert may_stand_together(("motion_blur", "unknown_ghosted_film"), "triangle", "random")
    assert rate_of(FREE._replace(afloat=0.5, trodden=0.5, spun_out=0.5), vx=1.0) == pytest.approx((0.0, 0.0, 0.0))
