"""What is presumed of a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import (
    by_the_first_camera,
    by_the_second_camera,
    fitted,
    nudged_off_px,
    shaking_of,
)
from analysis.blind.recording.views import draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    SLIDING,
    STILL,
    TIMES,
    G,
    energy,
    first_contacts,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    random_states,
    rate_of,
    state_of,
    struck,
)
from tests.gap.blind.plant.rig import HOST as DRIVEN

RUNS = 12
VIEW = draw_views(np.random.default_rng(3))[1]


def test_a_floor_is_bent_up_at_one_end():
    floor = FREE._replace(flap_per_s2=50.0, flap_m=0.008, flap_rad=0.6)
    c, s = np.cos(0.6), np.sin(0.6)
    for along, across, push in ((0.03, 0.01, -1.1), (0.009, -0.02, -0.05), (0.007, 0.0, 0.0), (-0.03, 0.01, 0.0)):
        rates = rate_of(floor, x=along * c - across * s, y=along * s + across * c)
        assert rates == pytest.approx((push * c, push * s, 0.0), abs=1e-12)
    start = np.array([0.02 * c, 0.02 * s, 0.4 * c, 0.4 * s, 0.0, 0.0])
    nodes = run_plant(floor, STILL, start, 0.02, np.random.default_rng(0)).nodes
    place, speed = nodes[:, 1] * c + nodes[:, 2] * s, nodes[:, 3] ** 2 + nodes[:, 4] ** 2
    assert 0.5 * speed + 25.0 * (place - 0.008) ** 2 == pytest.approx(0.08 + 25.0 * 0.012**2, rel=1e-6)


def test_a_floor_is_wiped_in_its_middle():
    for share in (0.5, -0.4):
        floor = SLIDING._replace(unswept=share)
        for x, y in ((0.0, 0.0), (0.012, 0.016), (0.0, -0.04)):
            held = -G * (1.0 + share * (x**2 + y**2) / 0.04**2)
            assert rate_of(floor, x=x, y=y, vx=0.8)[0] == pytest.approx(held, rel=1e-5)


def test_grease_stiffens_with_the_slip():
    floor = SLIDING._replace(stiffened_s_per_m=0.3)
    for speed in (0.1, 0.7, 2.0):
        assert rate_of(floor, vy=speed)[1] == pytest.approx(-G * (1.0 + 0.3 * (speed - 0.7)), rel=1e-5)
    # It is the speed over the floor, not that in the room.
    time = TIMES[7]
    position, velocity, _ = host_pose(time, DRIVEN)
    along = rate_of(floor, time, DRIVEN, x=position[0], vx=velocity[0] + 1.7)[0]
    assert along == pytest.approx(-G * 1.3, rel=1e-3)


def test_a_guide_shakes_the_load_twice_in_a_period():
    size = 0.0164 * DRIVE**2 / 78.5
    for turned in (0.0, 0.9, 4.0):
        guide = SLIDING._replace(galloping=0.25, galloping_rad=turned, drive_rad_per_s=DRIVE)
        for time in TIMES[::7]:
            position, velocity, _ = host_pose(time, DRIVEN)
            held = rate_of(guide, time, DRIVEN, x=position[0], vx=velocity[0], vy=0.9)[1]
            # The Host's acceleration goes with -sin, its velocity with cos.
            phase = DRIVE * time + 2.0
            wave = -np.cos(2.0 * phase) * np.cos(turned) - np.sin(2.0 * phase) * np.sin(turned)
            assert held == pytest.approx(-G * (1.0 + 0.25 * size**2 * wave), rel=1e-4)
    assert rate_of(SLIDING._replace(galloping=0.25, drive_rad_per_s=DRIVE), vy=0.9)[1] == pytest.approx(-G, rel=1e-5)


def test_a_thin_floor_bends_in_its_middle():
    floor = SLIDING._replace(thin_floor_m_per_s2=4.0)
    for time in TIMES[::7]:
        position, velocity, acceleration = host_pose(time, DRIVEN)
        for x, y in ((0.0, 0.0), (0.012, -0.016), (0.0, 0.04)):
            held = rate_of(floor, time, DRIVEN, x=position[0] + x, y=y, vx=velocity[0], vy=0.9)[1]
            load = 9.81 - 4.0 * (1.0 - (x**2 + y**2) / 0.04**2) * acceleration[0] / 78.5
            assert held == pytest.approx(-0.3 * load, rel=1e-5)
    thrown = SLIDING._replace(thin_floor_m_per_s2=400.0)  # what floats is not drawn down
    for time in TIMES[::7]:
        position, velocity, acceleration = host_pose(time, DRIVEN)
        held = rate_of(thrown, time, DRIVEN, x=position[0], vx=velocity[0], vy=0.9)[1]
        assert held == 0.0 if acceleration[0] > 5.0 else held < 0.0


def test_air_drags_between_two_faces():
    air = FREE._replace(air_gap_m_per_s=0.004)
    for radius, rate in ((0.03, 0.004 / 0.011), (0.039, 2.0), (0.04, 4.0), (0.0405, 4.0)):
        for azimuth in (0.0, 2.1):
            c, s = np.cos(azimuth), np.sin(azimuth)
            out = rate_of(air, x=radius * c, y=radius * s, vx=0.5 * c - 0.8 * s, vy=0.5 * s + 0.8 * c)
            assert out == pytest.approx((-0.5 * rate * c, -0.5 * rate * s, 0.0), abs=1e-9)
    time = TIMES[7]  # it is the speed against the Host
    position, velocity, _ = host_pose(time, DRIVEN)
    assert rate_of(air, time, DRIVEN, x=position[0] + 0.039, vx=velocity[0] + 0.5)[0] == pytest.approx(-1.0)
    # What it takes of the speed is what the law's integral over the way says.
    speed = first_contacts(air._replace(restitution=0.7))[1][0]
    assert speed == pytest.approx(1.0 - 0.004 * np.log(11.0), rel=1e-4)


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in (
        {"unswept": 0.6},
        {"unswept": -1.4},
        {"stiffened_s_per_m": 0.5},
        {"stiffened_s_per_m": 3.0},
        {"thin_floor_m_per_s2": 6.0},
        {"galloping": 0.4, "galloping_rad": 1.0},
        {"air_gap_m_per_s": 0.01},
    ):
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, SLIDING._replace(**changed), STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] <= 0.0


def test_a_ring_is_backed_along_one_half():
    for turned, value in ((0.0, 0.78), (1.5, 0.78), (1.6, 0.62), (np.pi, 0.62), (5.0, 0.78)):
        ring = BARE._replace(half_backed=0.08, half_backed_rad=turned)
        assert head_on(ring)[0] == pytest.approx(-value)
    assert head_on(BARE._replace(half_backed=0.5))[0] == pytest.approx(-0.98)


def test_a_hard_blow_smears_the_wall():
    wall = BARE._replace(smeared_s_per_m=0.4)
    for speed, share in ((0.5, 0.8), (1.5, 0.4), (3.0, 0.02)):
        out = struck(wall, vx=speed, vy=5.0)
        assert out[3] == pytest.approx(5.0 - 0.15 * share * 1.7 * speed)
        assert out[2] == pytest.approx(-0.7 * speed)


def test_a_rim_that_spins_slips_more():
    rim = BARE._replace(spun_s=0.01)
    for spin, share in ((0.0, 1.0), (30.0, 0.7), (-30.0, 0.7), (150.0, 0.02)):
        assert struck(rim, vy=5.0, spin=spin)[3] == pytest.approx(5.0 - 0.15 * share * 1.7)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"half_backed": 0.3, "half_backed_rad": 0.5},
        {"smeared_s_per_m": 0.8},
        {"spun_s": 0.02},
        {"air_gap_m_per_s": 0.01},
        {"dragging_m": 4e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))
    assert energy(struck(BARE._replace(half_backed=0.9))) < energy(state_of(vx=1.0))


def test_a_thin_ring_quivers_after_a_blow():
    ring = BARE._replace(quiver_m=8e-4, quiver_rad_per_s=200.0)
    last = {"impact_s": 0.1, "normal": 0.5, "approach": 0.9}
    most = 8e-4 * 0.9 / 1.7
    for since, azimuth in ((0.0, 0.5), (0.0, 0.5 + 0.5 * np.pi), (0.012, 0.5), (0.03, 0.5 + 0.5 * np.pi)):
        c, s = np.cos(azimuth), np.sin(azimuth)
        size = most * np.exp(-since / 0.12) * np.cos(200.0 * since) * np.cos(2.0 * (azimuth - 0.5))
        gap, nx, ny = wall_gap(0.1 + since, state_of(x=0.038 * c, y=0.038 * s, **last), ring, STILL)
        assert gap == pytest.approx(0.002 + size) and (nx, ny) == pytest.approx((c, s))
    assert wall_gap(0.1, state_of(x=0.038), ring, STILL)[0] == pytest.approx(0.002)  # before any blow it is round
    # The normal is that of the wall, and its speed is the rate of its place.
    state = state_of(x=0.0396 * np.cos(1.1), y=0.0396 * np.sin(1.1), **last)
    for time in (0.104, 0.12, 0.15):
        _, nx, ny = wall_gap(time, state, ring, STILL)
        sides = []
        for way in (-1e-6, 1e-6):
            moved = state.copy()
            moved[:2] += way * np.array([-ny, nx])
            sides.append(wall_gap(time, moved, ring, STILL)[0])
        assert abs(sides[1] - sides[0]) / 2e-6 < 2e-3
        early, late = (wall_gap(time + passed, state, ring, STILL)[0] for passed in (-1e-6, 1e-6))
        approach = contact_velocity(time, state, ring, STILL, nx, ny)[0]
        assert approach == pytest.approx((early - late) / 2e-6, rel=3e-2)  # seen from the contact, not the middle
    # A blow leaves the ring as it springs it itself: a light one nearer than a hard one before, and the disk with it.
    full = 2.0 * np.pi / 200.0
    out = struck(ring, time=0.1 + full, x=4e-4, vx=0.3, impact_s=0.1, normal=0.0, approach=1.9)
    assert out[0] == pytest.approx(0.04 + 8e-4 * 3.0 / 11.0, rel=2e-4) and out[2] == pytest.approx(-0.21, abs=1e-2)


def test_a_ring_is_dragged_back():
    ring = BARE._replace(dragging_m=3e-4)
    for time in TIMES[::6]:
        position, velocity, _ = host_pose(time, DRIVEN)
        off = -3e-4 * np.tanh(velocity[0] / 0.2)
        state = state_of(x=position[0] + 0.039, vx=velocity[0])
        gap, nx, ny = wall_gap(time, state, ring, DRIVEN)
        assert gap == pytest.approx(0.001 + off) and (nx, ny) == pytest.approx((1.0, 0.0))
        early, late = (
            wall_gap(time + passed, state + [passed * velocity[0], *[0.0] * (len(state) - 1)], ring, DRIVEN)[0]
            for passed in (-1e-6, 1e-6)
        )
        approach = contact_velocity(time, state, ring, DRIVEN, nx, ny)[0]
        assert approach == pytest.approx((early - late) / 2e-6, rel=1e-2, abs=1e-3)
    # Across the drive it lies where it was.
    position, velocity, _ = host_pose(TIMES[3], DRIVEN)
    assert wall_gap(TIMES[3], state_of(x=position[0], y=0.039), ring, DRIVEN)[0] == pytest.approx(0.001, abs=2e-6)


def test_a_camera_is_rolled():
    pixels = np.random.default_rng(3).uniform(0.0, 3000.0, (4, 12, 2))
    rolled = by_the_second_camera(pixels.copy(), VIEW, ViewErrors(rolled_rad=4e-3)) - VIEW.centre_px
    away, (c, s) = pixels - VIEW.centre_px, (np.cos(4e-3), np.sin(4e-3))
    assert rolled[..., 0] == pytest.approx(c * away[..., 0] - s * away[..., 1])
    assert rolled[..., 1] == pytest.approx(s * away[..., 0] + c * away[..., 1])
    signs = {
        np.sign(view_of(draft_series("unknown_rolled_camera", 1.0, np.random.default_rng(k), 1)).rolled_rad)
        for k in range(8)
    }
    assert signs == {-1.0, 1.0}


def test_a_camera_is_nudged_in_each_run():
    view = draft_series("unknown_nudged_camera", 1.0, np.random.default_rng(2), RUNS).view
    errors = ViewErrors(**view)
    assert len(set(errors.nudged_share)) == RUNS
    assert min(errors.nudged_share) >= 0.3 and max(errors.nudged_share) <= 0.7
    along = np.array([np.cos(errors.nudged_rad), np.sin(errors.nudged_rad)])
    pixels, time = np.random.default_rng(3).uniform(0.0, 500.0, (200, 12, 2)), np.linspace(0.0, 1.2, 200)
    for run in (0, 7):
        off = nudged_off_px(200, run, errors)
        first = int(np.ceil(200 * errors.nudged_share[run]))
        assert not off[:first].any() and off[first:] == pytest.approx(
            errors.nudged_px * along[None].repeat(200 - first, 0)
        )
        shaking = shaking_of(time, STILL, np.empty(0), np.empty((0, 2)), run, errors)
        seen = by_the_first_camera(pixels.copy(), time, VIEW, shaking, errors)
        assert seen - pixels == pytest.approx(np.broadcast_to(off[:, None], pixels.shape), abs=1e-9)
    plain = shaking_of(time, STILL, np.empty(0), np.empty((0, 2)), 0, replace(errors, nudged_px=0.0))
    assert plain.nudged_px is None


def test_a_lens_lacks_its_fifth_order():
    away = np.array([[[300.0, 0.0], [0.0, -150.0], [-600.0, 0.0], [180.0, 240.0]]])
    off = fitted(VIEW.centre_px + away, VIEW, ViewErrors(fifth_px=1.5)) - VIEW.centre_px - away
    assert off == pytest.approx(np.array([[[1.5, 0.0], [0.0, -1.5 / 32.0], [-48.0, 0.0], [0.9, 1.2]]]), abs=1e-9)
    assert fitted(away, VIEW, ViewErrors()) is away


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; a place of the wall needs a round one, a
    period of the drive one that was asked for; what counts blows needs blows that are over."""
    needs_a_blow_that_is_over(
        ["unknown_quivering_ring", "unknown_half_backed_ring", "unknown_smeared_wall", "unknown_spun_rim"]
    )
    for name in ("unknown_quivering_ring", "unknown_squeezed_air"):
        needs_a_round_wall(name)
    for listed, ours in (
        ("viscous_drag", "unknown_stiffening_grease"),
        ("vertical_motion", "unknown_thin_floor"),
        ("direction_dependent_restitution", "unknown_half_backed_ring"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_galloping_guide"), "round", "start_up")
    assert not may_stand_together(("table_tilt", "unknown_galloping_guide"), "round", "chirp")
    assert may_stand_together(("table_tilt", "unknown_dragging_ring"), "triangle", "random")
