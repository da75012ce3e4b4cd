"""What is surmised of a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import STEADY, by_the_first_camera, by_the_second_camera, keystoned
from analysis.blind.recording.views import draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    SLIDING,
    STILL,
    TIMES,
    energy,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    physics,
    random_states,
    rate_of,
    state_of,
    struck,
)
from tests.gap.blind.plant.rig import HOST as DRIVEN

RUNS = 12
VIEW = draw_views(np.random.default_rng(3))[1]


def test_a_frame_rocks_with_the_drive():
    size = 0.0164 * DRIVE**2 / 78.5
    for turned in (0.0, 1.1, -2.0):
        frame = FREE._replace(frame_m_per_s2=0.4, frame_rad=turned, drive_rad_per_s=DRIVE)
        for time in TIMES[::7]:
            # The Host's way goes with the sine of this phase, its acceleration with minus that.
            push = -0.4 * size * np.sin(DRIVE * time + 2.0 - turned)
            assert rate_of(frame, time, DRIVEN, x=0.01) == pytest.approx((push, 0.0, 0.0), abs=1e-9)
    assert not any(rate_of(FREE._replace(frame_m_per_s2=0.4, drive_rad_per_s=DRIVE), x=0.01))
    drawn = [
        draft_series("unknown_rocking_frame", 1.0, np.random.default_rng(k), 1).plant["frame_rad"] for k in range(9)
    ]
    assert min(np.abs(drawn)) > 0.78 and max(np.abs(drawn)) < 2.36 and min(drawn) < 0.0 < max(drawn)


def test_a_floor_tips_from_stop_to_stop():
    floor = FREE._replace(unclamped_m_per_s2=0.5, unclamped_rad=0.7)
    for time in TIMES[::7]:
        push = 0.5 * np.tanh(host_pose(time, DRIVEN)[2][0] / 20.0)
        out = rate_of(floor, time, DRIVEN, y=0.02)
        assert out == pytest.approx((push * np.cos(0.7), push * np.sin(0.7), 0.0), abs=1e-12)
    assert not any(rate_of(floor, vx=1.0))


def test_a_door_is_opened_in_each_run():
    door = FREE._replace(gust_m_per_s2=0.6, gust_rad=2.5, gust_share=0.4, duration_s=1.2)
    for time, share in ((0.1, 0.0), (0.46, 0.0), (0.48, 0.5), (0.5, 1.0), (1.1, 1.0)):
        push = 0.6 * share
        out = rate_of(door, time, vx=0.7)
        assert out == pytest.approx((push * np.cos(2.5), push * np.sin(2.5), 0.0), abs=1e-3)
    shares = draft_series("unknown_opened_door", 1.0, np.random.default_rng(2), RUNS).run_numbers["gust_share"]
    assert len(set(shares)) == RUNS and shares.min() >= 0.1 and shares.max() <= 0.5
    # What it gives the disk is its push times the way along it.
    nodes = run_plant(door, STILL, np.zeros(6), 0.6, np.random.default_rng(0)).nodes[-1]
    along = nodes[1] * np.cos(2.5) + nodes[2] * np.sin(2.5)
    assert 0.5 * (nodes[3] ** 2 + nodes[4] ** 2) == pytest.approx(0.6 * along, rel=2e-2)


def test_a_film_gums_up_from_run_to_run():
    film = FREE._replace(gummed_per_s=0.5)
    assert rate_of(film, vx=0.8, vy=-0.2, spin=30.0) == pytest.approx((-0.4, 0.1, -15.0))
    position, velocity, _ = host_pose(TIMES[7], DRIVEN)  # it is the speed over the floor
    out = rate_of(film, TIMES[7], DRIVEN, x=position[0], vx=velocity[0] + 0.6)
    assert out[0] == pytest.approx(-0.3)
    drawn = draft_series("unknown_gumming_film", 1.0, np.random.default_rng(2), RUNS)
    rates, mean = drawn.run_numbers["gummed_per_s"], drawn.parameters["unknown_gumming_film"]["gummed_per_s"]
    assert rates.mean() == pytest.approx(mean) and np.diff(rates) == pytest.approx(mean / (RUNS - 1))
    assert rates[-1] == pytest.approx(3.0 * rates[0])


def test_a_washer_creeps_to_one_side_of_itself():
    washer = FREE._replace(leaning_m_per_s2=0.5, leaning_rad=0.4)
    for angle in (0.0, 1.3, 4.0):
        push = 0.5 * np.cos(angle + 0.4), 0.5 * np.sin(angle + 0.4), 0.0
        assert rate_of(washer, angle=angle, spin=20.0, vx=1.0) == pytest.approx(push, abs=1e-12)
    # In whole turns it gives no speed.
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 20.0 * np.pi])
    nodes = run_plant(washer, STILL, start, 0.1 - 2e-3, np.random.default_rng(0)).nodes
    assert np.hypot(nodes[-1, 3], nodes[-1, 4]) < 1e-5 and np.hypot(nodes[:, 3], nodes[:, 4]).max() > 5e-3


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in (
        {"gummed_per_s": 0.7},
        {"unclamped_m_per_s2": 0.6},
        {"frame_m_per_s2": 0.6, "frame_rad": 1.0, "drive_rad_per_s": DRIVE},
    ):
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, SLIDING._replace(**changed), STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] <= 0.0


def test_a_liner_softens_in_a_run():
    liner = BARE._replace(softened=0.3, softened_s=0.4)
    for time in (0.0, 0.1, 0.4, 1.2):
        value = 0.7 * (1.0 - 0.3 * (1.0 - np.exp(-time / 0.4)))
        assert head_on(liner, time=time)[0] == pytest.approx(-value)
    assert head_on(BARE._replace(softened=3.0), time=1.2)[0] == pytest.approx(-0.05)


def test_a_layer_creeps_under_a_slow_slip():
    layer = BARE._replace(creep_m_per_s=2.0)
    for slip in (0.5, -0.9, 5.0):
        held = 0.15 * np.tanh(abs(slip) / 2.0) * 1.7
        assert struck(layer, vy=slip)[3] == pytest.approx(slip - np.sign(slip) * held)
    # The least that is left holds what hardly slips at all.
    assert struck(layer, vy=0.03)[3] == pytest.approx(0.03 - 0.15 * 0.02 * 1.7)


def test_rubber_gives_back_more_on_one_side():
    for turned in (0.0, 1.2, np.pi):
        # Along the wall a sticking disk has a third of its mass to turn: the slip comes back as b says.
        rubber = BARE._replace(wall_friction=5.0, rubber=0.6, rubber_rad=turned)
        value = 0.45 * (1.0 + 0.6 * np.cos(turned))
        assert head_on(rubber, vy=0.2)[1] == pytest.approx(-0.2 * value)
    assert head_on(BARE._replace(wall_friction=5.0, rubber=3.0), vy=0.2)[1] == pytest.approx(-0.19)
    assert head_on(BARE._replace(wall_friction=5.0, rubber=-3.0), vy=0.2)[1] == pytest.approx(0.0, abs=1e-12)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"softened": 0.4},
        {"creep_m_per_s": 1.5},
        {"rubber": 1.5, "rubber_rad": 0.5, "wall_friction": 0.5},
        {"tugged_m": 5e-4},
        {"uneven_m": 2e-4, "uneven_9_rad": 1.0},
    ):
        leaves_no_more_energy(BARE._replace(**changed))
    assert energy(struck(BARE._replace(rubber=9.0), vy=1.0)) < energy(state_of(vx=1.0, vy=1.0))


def test_a_ring_is_tugged_back():
    ring = BARE._replace(tugged_m=4e-4)
    for time in TIMES[::6]:
        position, velocity, _ = host_pose(time, DRIVEN)
        off = -4e-4 * position[0] / 0.01643
        state = state_of(x=position[0] + 0.039, vx=velocity[0])
        gap, nx, ny = wall_gap(time, state, ring, DRIVEN)
        assert gap == pytest.approx(0.001 + off) and (nx, ny) == pytest.approx((1.0, 0.0))
        early, late = (
            wall_gap(time + passed, state + [passed * velocity[0], *[0.0] * (len(state) - 1)], ring, DRIVEN)[0]
            for passed in (-1e-6, 1e-6)
        )
        approach = contact_velocity(time, state, ring, DRIVEN, nx, ny)[0]
        assert approach == pytest.approx((early - late) / 2e-6, rel=1e-2, abs=1e-4)
    assert wall_gap(0.1, state_of(x=0.039), ring, STILL)[0] == pytest.approx(0.001)


def test_a_cast_ring_is_uneven():
    phases = {f"uneven_{order}_rad": 0.7 * order for order in range(8, 13)}
    ring = BARE._replace(uneven_m=2e-4, **phases)
    more = []
    for azimuth in np.arange(60) * np.pi / 30.0:
        c, s = np.cos(azimuth), np.sin(azimuth)
        gap, nx, ny = wall_gap(0.1, state_of(x=0.03999 * c, y=0.03999 * s), ring, STILL)
        waves = [np.cos(order * azimuth - 0.7 * order) for order in range(8, 13)]
        slope = [-order * np.sin(order * azimuth - 0.7 * order) for order in range(8, 13)]
        more.append(2e-4 * np.sqrt(0.4) * np.sum(waves))
        leans = 2e-4 * np.sqrt(0.4) * np.sum(slope) / 0.03999
        assert gap * np.hypot(1.0, leans) == pytest.approx(1e-5 + more[-1])
        assert np.array([nx, ny]) * np.hypot(1.0, leans) == pytest.approx([c + leans * s, s - leans * c])
    assert np.std(more) == pytest.approx(2e-4) and np.mean(more) == pytest.approx(0.0, abs=1e-12)
    p = physics("unknown_cast_ring", 1.0)
    assert len({p.uneven_8_rad, p.uneven_9_rad, p.uneven_10_rad, p.uneven_11_rad, p.uneven_12_rad}) == 5


def test_a_lens_is_longer():
    pixels, time = np.random.default_rng(3).uniform(0.0, 3000.0, (4, 12, 2)), np.linspace(0.0, 1.0, 4)
    seen = by_the_first_camera(pixels.copy(), time, VIEW, STEADY, ViewErrors(focal=3e-3))
    assert seen - VIEW.centre_px == pytest.approx(1.003 * (pixels - VIEW.centre_px))
    signs = {
        np.sign(view_of(draft_series("unknown_longer_lens", 1.0, np.random.default_rng(k), 1)).focal) for k in range(8)
    }
    assert signs == {-1.0, 1.0}


def test_a_sensor_is_tilted():
    away = np.array([[[300.0, 0.0], [0.0, -150.0], [-600.0, 0.0], [180.0, 240.0]]])
    errors = ViewErrors(keystone_px=1.5, keystone_rad=0.0)
    off = keystoned(VIEW.centre_px + away, VIEW, errors) - VIEW.centre_px - away
    assert off == pytest.approx(np.array([[[1.5, 0.0], [0.0, 0.0], [6.0, 0.0], [0.54, 0.72]]]), abs=1e-9)
    turned = ViewErrors(keystone_px=1.5, keystone_rad=0.5 * np.pi)
    off = by_the_second_camera(VIEW.centre_px + away, VIEW, turned) - VIEW.centre_px - away
    assert off == pytest.approx(np.array([[[0.0, 0.0], [0.0, 0.375], [0.0, 0.0], [0.72, 0.96]]]), abs=1e-9)
    assert keystoned(away, VIEW, ViewErrors()) is away


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; waves around the wall need a round one, a
    period of the drive one that was asked for; laws of a blow need blows that are over."""
    needs_a_blow_that_is_over(["unknown_softening_liner", "unknown_creeping_layer", "unknown_uneven_rubber"])
    needs_a_round_wall("unknown_cast_ring")
    for listed, ours in (
        ("viscous_drag", "unknown_gumming_film"),
        ("table_tilt", "unknown_opened_door"),
        ("restitution_drift", "unknown_softening_liner"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_rocking_frame"), "round", "start_up")
    assert not may_stand_together(("table_tilt", "unknown_rocking_frame"), "round", "chirp")
    assert may_stand_together(("table_tilt", "unknown_tugged_ring"), "triangle", "random")
