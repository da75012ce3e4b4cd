"""What one who knows such benches would expect: each cause does what its formula says (how much it does:
test_blind_groups.py)."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, physics_of_run
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.parameters import PlantParameters
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.plant.wall.motion import swing
from analysis.blind.plant.wall.shape import rim_reach
from analysis.blind.recording.clock import frame_times
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import shaking_of
from analysis.blind.series import outline_series, run_outline
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    PLACE,
    SLIDING,
    STILL,
    TIMES,
    G,
    first_contacts,
    head_on,
    rate_of,
    state_of,
    struck,
)

R, INERTIA = 0.01, 0.5 * 0.01**2  # m, m^2


def test_a_stray_field_brakes_more_towards_the_shaker():
    for size, x, rate in ((0.2, 0.0, 0.2), (0.2, 0.04, 0.2 * np.e), (-0.2, 0.04, 0.2 / np.e)):
        got = rate_of(FREE._replace(stray_field_per_s=size), 0.1, HOST, x=x, vx=0.5, vy=-1.0, spin=40.0)
        assert got == pytest.approx((-0.5 * rate, rate, 0.0), abs=1e-9)  # in the room, whatever the Host does


def test_an_oil_film_is_sheared():
    oiled = FREE._replace(oil_film_per_s=0.3)
    velocity = host_pose(0.1, HOST)[1][0]
    got = rate_of(oiled, 0.1, HOST, vx=velocity + 1.0, vy=0.5, spin=40.0)
    assert got == pytest.approx((-0.3, -0.15, -12.0), abs=1e-9)
    beside = rate_of(oiled._replace(mass_y_m=4e-4), vx=1.0)
    assert beside == pytest.approx((-0.3, 0.0, -0.3 * 4e-4 / INERTIA), abs=1e-9)


def test_a_floor_on_one_screw_swings_with_the_host():
    """It is at rest at its screw, and goes round with what the Host's velocity says; a disk that goes with it is left
    alone."""
    plate = SLIDING._replace(swing_rad_per_m=10.0, swing_x_m=0.005, swing_y_m=-0.04)
    for time in TIMES[::9]:
        position, velocity, _ = host_pose(time, HOST)
        turns = 10.0 * velocity[0]
        at = {"x": position[0] + 0.02, "y": 0.01, "spin": turns}
        goes = np.array([velocity[0] - turns * 0.05, turns * 0.015])
        assert rate_of(plate, time, HOST, vx=goes[0], vy=goes[1], **at) == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        assert rate_of(plate, time, HOST, vx=goes[0] + 1.0, vy=goes[1], **at)[0] == pytest.approx(-G, abs=1e-6)
    assert rate_of(plate, x=0.02, vx=1.0)[0] == pytest.approx(-G)  # a Host at rest


def test_screws_leave_less_of_the_floor():
    plate = SLIDING._replace(screws=0.6, screws_rad=0.3)
    for turn, far, lost in ((0.3, 0.022, 1.0), (0.3 - np.pi / 2, 0.022, 1.0), (0.3 + np.pi, 0.03, np.exp(-0.5))):
        got = rate_of(plate, x=far * np.cos(turn), y=far * np.sin(turn), vx=1.0)[0]
        assert got == pytest.approx(-G * (1.0 - 0.6 * lost), abs=0.02 * G)  # and what the next screws leave
    assert rate_of(plate._replace(screws=0.9), vx=1.0)[0] < -0.9 * G


def test_dust_on_one_side_holds_and_turns():
    """As a sum over the disk's own places says, of a disk that only slides."""
    dust = SLIDING._replace(drifted=0.5, drifted_rad=0.4)
    lee = np.array([np.cos(0.4), np.sin(0.4)])
    radius, azimuth = np.meshgrid(R * np.sqrt((np.arange(200) + 0.5) / 200), 2.0 * np.pi * (np.arange(200) + 0.5) / 200)
    places = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth)])
    for at, way in (((0.02, -0.01), 0.4), ((-0.025, 0.0), 2.2), ((0.0, 0.0), 4.0)):
        slip = np.array([np.cos(way), np.sin(way)])
        held = G * (1.0 + 0.5 / 0.04 * np.tensordot(lee, places + np.reshape(at, (2, 1, 1)), 1))
        torque = np.mean(-held * (places[0] * slip[1] - places[1] * slip[0]))
        got = rate_of(dust, x=at[0], y=at[1], vx=slip[0], vy=slip[1])
        assert got[:2] == pytest.approx(-slip * held.mean(), abs=1e-3)
        assert got[2] == pytest.approx(torque / INERTIA, abs=0.05)


def test_a_disk_gathers_charge_and_loses_it():
    clings = SLIDING._replace(clinging=0.6)
    assert rate_of(clings, vx=1.0, charge=0.5)[0] == pytest.approx(-G * 1.3)
    slow = clings._replace(floor_friction=1e-6)
    motion = run_plant(slow, STILL, np.array([-0.03, 0.0, 0.5, 0.0, 0.0, 0.0]), 0.1, np.random.default_rng(0))
    time = np.arange(0.0, 0.09, 0.01)
    speed = state_at(motion, time - 2e-3)[:, 2]
    rate = 0.5 / 0.08 + 1.0 / 0.08  # at which it comes to its balance
    held = 1.0 / 3.0 * (time - (1.0 - np.exp(-rate * time)) / rate)  # the integral of what it holds
    assert 0.5 - speed == pytest.approx(9.81e-6 * (time + 0.6 * held), rel=1e-3, abs=1e-12)


def test_feet_sink_from_run_to_run():
    draft = draft_series("unknown_sinking_feet", 1.0, np.random.default_rng(1), 5)
    runs = [physics_of_run(draft, run, DRIVE, 1.2) for run in range(5)]
    tilt = np.array([(p.feet_x_m_per_s2, p.feet_y_m_per_s2) for p in runs])
    assert np.diff(tilt, axis=0) == pytest.approx(np.tile(0.5 * tilt[-1], (4, 1))) and np.allclose(
        tilt[2], 0.0, rtol=1e-5, atol=1e-8
    )
    assert 0.85 * 0.3 < np.hypot(*tilt[0]) < 1.15 * 0.3
    assert rate_of(FREE._replace(feet_x_m_per_s2=0.2, feet_y_m_per_s2=-0.1)) == pytest.approx((0.2, -0.1, 0.0))


def test_friction_of_a_ground_rim_and_of_worn_ends():
    def slid(p, **numbers):
        """Share of the wall's friction in a blow that is held at the Coulomb limit."""
        return (4.0 - head_on(p, 1.0, 400.0, **numbers)[1]) / (3.0 * 0.15 * 1.7)

    ground = BARE._replace(ground=0.8, ground_rad=0.3)
    for off, near in ((0.0, 1.0), (1.1, np.exp(-0.5)), (-2.2, np.exp(-2.0))):
        assert slid(ground, angle=-0.3 - off) == pytest.approx(1.0 - 0.8 * near)
    worn = BARE._replace(worn_ends=0.7)
    assert slid(worn) == pytest.approx(0.3)
    for turn, share in ((np.pi, 0.3), (np.pi / 2, 1.7), (np.pi / 4, 1.0)):
        c, s = np.cos(turn), np.sin(turn)
        state = state_of(x=0.04 * c, y=0.04 * s, vx=c, vy=s, spin=400.0)
        out = impact(0.1, state, worn, STILL, np.zeros(2), 1.0)[0]
        assert (400.0 - out[5]) * INERTIA / R == pytest.approx(0.15 * share * 1.7)


def test_fibres_give_back_by_the_sense_of_the_slip():
    lay = BARE._replace(lay=0.8, wall_friction=0.9)
    for spin in (3.0, 30.0, -30.0):
        back = 0.45 * (1.0 + 0.8 * np.tanh(0.01 * spin / 0.1))
        assert head_on(lay, 1.0, spin)[1] == pytest.approx(-back * 0.01 * spin)
    assert head_on(lay._replace(lay=2.0), 1.0, 60.0)[1] == pytest.approx(-0.95 * 0.6)
    assert head_on(lay._replace(lay=-2.0), 1.0, 60.0)[1] == pytest.approx(0.0, abs=1e-9)


def test_screws_come_loose_and_a_pad_is_pressed_flat():
    loose = BARE._replace(loosened=0.3)
    for count in (0, 6, 40):
        left = 0.7 * (1.0 - 0.3 * (1.0 - np.exp(-count / 12.0)))
        assert head_on(loose, count=count)[0] == pytest.approx(-left)
    pad = BARE._replace(pad=0.5, pad_rad=0.45)
    for speed in (0.2, 1.0, 3.0):
        lost = 0.5 * np.exp(-speed) * np.exp(-0.125)
        assert head_on(pad, speed)[0] == pytest.approx(-speed * (0.7 - lost))
    assert head_on(pad._replace(pad_rad=np.pi))[0] == pytest.approx(-0.7, abs=1e-3)


@pytest.mark.further
def test_a_ring_on_rubber_feet_swings_like_a_spring():
    """From a blow on: the closed swing obeys its own equation, and its speed is the rate of its place."""
    p, since = PlantParameters(nodding=0.02, nodding_rad_per_s=170.0), {"impact_s": 0.1}
    state = state_of(nod_x=0.004, nod_y=-0.01, nod_vx=1.2, nod_vy=0.3, **since)
    assert swing(0.1, state, p) == pytest.approx((0.004, -0.01, 1.2, 0.3))
    h = 1e-6
    for time in (0.11, 0.14):
        low, here, high = (np.array(swing(time + d, state, p)) for d in (-h, 0.0, h))
        rate = (high - low) / (2.0 * h)
        assert rate[:2] == pytest.approx(here[2:], rel=1e-5)
        stiff, damping = 170.0**2 + 20.0**2, 2.0 * 20.0
        assert rate[2:] == pytest.approx(-stiff * here[:2] - damping * here[2:], rel=1e-5)


def test_a_swinging_ring_takes_what_the_disk_loses_and_meets_the_next_blow():
    nods = BARE._replace(nodding=0.02, wall_friction=0.0)
    out = struck(nods)
    assert out[PLACE.index("nod_vx")] == pytest.approx(1.7) and out[PLACE.index("nod_x")] == 0.0
    late = 0.1 + 0.5 * np.pi / 160.0  # a quarter of its swing on
    out[6] = 0.1
    far = 1.7 / 160.0 * np.exp(-(late - 0.1) / 0.05)
    assert wall_gap(late, out, nods, STILL)[0] == pytest.approx(0.02 * far, rel=1e-6)
    moved = state_of(vx=1.0, impact_s=0.1, count=1, nod_vx=-5.0)
    moved[0] = 0.04
    again = impact(0.1, moved, nods, STILL, np.zeros(2), 1.0)[0]  # it comes towards the disk at 0.1 m/s
    assert again[2] == pytest.approx(-0.1 - 0.7 * 1.1)
    assert again[PLACE.index("nod_vx")] == pytest.approx(-5.0 + 1.7 * 1.1)


@pytest.mark.further
def test_a_ring_goes_on_swinging_where_it_touches_without_a_blow():
    """No jump of the wall: what touches it as it goes away is put back onto it and no more."""
    nods = BARE._replace(nodding=0.02)
    state = state_of(x=0.0405, vx=0.01, impact_s=0.1, count=1, nod_x=0.01, nod_vx=3.0)
    before = swing(0.102, state, nods)
    after, approach, _ = impact(0.102, state, nods, STILL, np.zeros(2), 1.0)
    assert approach == 0.0 and np.array_equal(after[1:6], state[1:6])
    after[6] = 0.102  # as a run says
    assert swing(0.102, after, nods) == pytest.approx(before)


@pytest.mark.further
def test_tape_around_the_rim_has_one_step():
    """Head-on along x: the disk's middle gets to the returned place; the slope is its rate; at its step the contact's
    lever drives the disk off."""
    tape = BARE._replace(lap_m=7e-4, lap_rad=0.2)
    for off in (0.5, -2.0, 3.0):
        more = 0.5 * np.tanh(off / 0.6) - off / (2.0 * np.pi)
        assert first_contacts(tape, angle=-0.2 - off)[0][0] == pytest.approx(R + 7e-4 * more, abs=2e-7)
    for azimuth in np.linspace(-3.0, 3.0, 25):
        low, high = (rim_reach(azimuth + d, 0.1, tape)[0] for d in (-1e-6, 1e-6))
        assert rim_reach(azimuth, 0.1, tape)[1] == pytest.approx((high - low) / 2e-6, abs=1e-8)
    rise = 7e-4 * (0.5 / 0.6 - 0.5 / np.pi)
    driven = [
        impact(0.0, state_of(x=0.04, angle=-0.2, spin=spin), tape, STILL, np.zeros(2), 1.0)[1] for spin in (30.0, -30.0)
    ]
    assert max(driven) == pytest.approx(30.0 * rise, rel=0.01) and min(driven) == 0.0
    inner = state_of(x=0.018, vx=-1.0, spin=30.0)
    hit = [impact(0.0, inner, p._replace(obstacle_m=0.018), STILL, np.zeros(2), 1.0)[0] for p in (BARE, tape)]
    assert np.array_equal(*hit)  # a cylinder meets it below the tape


def test_lamps_flicker_and_the_ground_stands():
    errors = ViewErrors(flicker_s=1e-4, flicker_hz=100.0, flicker_rad=0.5)
    times, even = (frame_times(40, 800.0, e, np.random.default_rng(1)) for e in (errors, ViewErrors()))
    assert times - even == pytest.approx(1e-4 * np.sin(200.0 * np.pi * np.arange(40) / 800.0 + 0.5), abs=1e-12)
    sizes = {
        draft_series("unknown_flickering_lamps", 1.0, np.random.default_rng(i), 1).view["flicker_hz"] for i in range(9)
    }
    assert sizes == {100.0, 120.0}


def test_a_bumped_camera_hangs_askew_from_one_run_on():
    errors = ViewErrors(bumped_rad=3e-3, bumped_from=2)
    blows = np.zeros(0), np.zeros((0, 2))
    turns = [shaking_of(TIMES, HOST, *blows, run, errors).twist_rad for run in range(4)]
    assert turns[0] is None and turns[1] is None
    assert turns[2] == pytest.approx(3e-3) and turns[3] == pytest.approx(3e-3)
    both = shaking_of(TIMES, HOST, *blows, 2, ViewErrors(bumped_rad=3e-3, twisted_rad=4e-3)).twist_rad
    alone = shaking_of(TIMES, HOST, *blows, 2, ViewErrors(twisted_rad=4e-3)).twist_rad
    assert both - alone == pytest.approx(3e-3)
    first = {
        draft_series("unknown_bumped_camera", 1.0, np.random.default_rng(i), 4).view["bumped_from"] for i in range(30)
    }
    assert first == {1, 2, 3}
    assert draft_series("unknown_bumped_camera", 1.0, np.random.default_rng(1), 1).view["bumped_from"] == 0


def test_a_bump_is_seen_in_one_camera_from_its_run_on():
    plain = outline_series("none", 1.0, np.random.default_rng(4), 3, "white")
    view = {"bumped_rad": 3e-3, "bumped_from": 1}
    bumped = replace(plain, draft=replace(plain.draft, view=view))
    seen, usual = (run_outline(one, np.random.default_rng(5), 8.0).recordings for one in (bumped, plain))
    assert seen[0][1].equals(usual[0][1])
    for (_, moved), (_, stood) in zip(seen[1:], usual[1:], strict=True):
        both = moved.merge(stood, on=["camera", "frame", "marker"], suffixes=("", "_usual"))
        off = np.hypot(both.u_px - both.u_px_usual, both.v_px - both.v_px_usual)
        assert off[both.camera == "VW2"].max() == 0.0 and off[both.camera == "VW1"].mean() > 0.2
