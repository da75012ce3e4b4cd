"""Each of the unforeseen causes does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import may_stand_together
from analysis.blind.plant.flight.floor_friction import friction_of_flight
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import glared
from analysis.blind.recording.picture import shake_px
from analysis.blind.recording.views import draw_views
from tests.gap.blind_rig import (
    BARE,
    DRIVE,
    HOST,
    SLIDING,
    STILL,
    G,
    first_contacts,
    head_on,
    needs_a_blow_that_is_over,
    rate_of,
    state_of,
)


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


def test_a_floor_that_stays_behind_the_ring_pulls_the_disk_its_own_way():
    """The disk at rest in the room over a floor that has 0.4 of the Host's speed, and one that crosses it."""
    host = 0.0164 * DRIVE * np.cos(2.0)
    loose = SLIDING._replace(loose_floor=0.6)
    assert rate_of(loose, 0.0, HOST) == pytest.approx((G * np.sign(host), 0.0, 0.0), abs=1e-6)
    assert rate_of(loose, 0.0, HOST, vx=0.4 * host, vy=1.0) == pytest.approx((0.0, -G, 0.0), abs=1e-6)


def test_grit_draws_each_flights_friction_anew():
    """Mean 1 and the stated deviation over many flights, no flight like the one before, another run's another; and the
    friction is multiplied by it."""
    gritty = SLIDING._replace(grit=0.35, grit_draw=0.3)
    drawn = np.array([friction_of_flight(n, gritty) for n in range(2000)])
    assert drawn.mean() == pytest.approx(1.0, abs=0.03) and drawn.std() == pytest.approx(0.35, abs=0.02)
    assert abs(np.corrcoef(drawn[1:], drawn[:-1])[0, 1]) < 0.07  # three standard errors
    other = np.array([friction_of_flight(n, gritty._replace(grit_draw=0.8)) for n in range(2000)])
    assert abs(np.corrcoef(drawn, other)[0, 1]) < 0.07
    assert rate_of(gritty, vx=1.0, count=5)[0] == pytest.approx(-G * drawn[5], abs=1e-6)


def test_a_grain_under_the_disk_drags_where_it_stands():
    """Sliding along x, the grain at 7 mm, 90 degrees from the slip, bears 0.35 of the weight: its friction turns the
    disk. Spinning only, its friction pushes the disk across its arm."""
    grain = SLIDING._replace(grain=0.35, grain_rad=0.5, inertia_factor=0.5)
    turning = 0.35 * G * 0.007 / 5e-5
    assert rate_of(grain, vx=1.0, angle=np.pi / 2 - 0.5) == pytest.approx((-G, 0.0, turning), abs=1e-3)
    assert rate_of(grain, vx=1.0, angle=-0.5) == pytest.approx((-G, 0.0, 0.0), abs=1e-3)
    spinning = -(0.65 * 2.0 / 3.0 * 0.01 + 0.35 * 0.007) * G / 5e-5
    assert rate_of(grain, spin=50.0, angle=-0.5) == pytest.approx((0.0, -0.35 * G, spinning), abs=1e-3)


def test_impacts_by_their_formulas():
    assert [head_on(BARE._replace(two_edges=0.1), count=n)[0] for n in (0, 1, 2)] == pytest.approx([-0.8, -0.6, -0.8])
    tacky = BARE._replace(cohesion_m_per_s=0.07)
    for speed, spin in ((1.0, 400.0), (0.1, 400.0), (0.1, -400.0)):  # it slides: what is lost is the limit
        lost = 3.0 * (0.15 * 1.7 * speed + 0.07)
        assert head_on(tacky, speed, spin)[1] == pytest.approx(np.sign(spin) * (4.0 - lost))
    assert head_on(tacky, 1.0, 10.0)[1] == pytest.approx(-0.045)  # it sticks as before
    taped = BARE._replace(taped=0.9, taped_rad=0.4)
    assert head_on(taped, 1.0, 10.0, angle=-0.4)[1] == pytest.approx(-0.45 * 0.1 * 0.1, abs=1e-5)
    assert head_on(taped, 1.0, 10.0, angle=np.pi - 0.4)[1] == pytest.approx(-0.045, abs=1e-5)
    rolls = BARE._replace(rolling_arm_m=2e-4, wall_friction=0.0)
    most = 2e-4 * 1.7 / 5e-5
    assert [head_on(rolls, spin=s)[2] for s in (30.0, -30.0, 5.0)] == pytest.approx([30.0 - most, most - 30.0, 0.0])
    assert head_on(rolls, 2.0, 30.0)[2] == pytest.approx(30.0 - 2.0 * most)


def test_an_impact_off_the_centre_of_mass_keeps_both_its_laws():
    """With cohesion and an arm of the normal: the normal rebounds as asked for, the tangential impulse is the limit."""
    p = BARE._replace(cohesion_m_per_s=0.07, mass_y_m=4e-4)
    state = state_of(x=0.04, y=4e-4, vx=1.0, spin=400.0)
    out, approach, _ = impact(0.1, state, p, STILL, np.zeros(2), 1.0)
    pushed = out[2:4] - state[2:4]
    assert out[2] + 4e-4 * out[5] == pytest.approx(-0.7 * approach)  # of the contact, 0.4 mm beside the mass's centre
    assert pushed[1] == pytest.approx(-(0.15 * abs(pushed[0]) + 0.07))


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place."""

    def stopped(p):
        return first_contacts(p, angle=0.0, duration_s=0.2)[0][:2]

    for joint in (0.05, -0.05, 2.0):
        reach = 6e-4 * (-0.5 * np.tanh(joint / 0.08) + joint / (2 * np.pi))
        assert stopped(BARE._replace(joint_m=6e-4, joint_rad=joint))[0] == pytest.approx(0.01 + reach, abs=1e-9)
    # the first blow finds the ring in the middle and pushes it 0.25 mm on; the second, at the other side, meets it so
    first, second = stopped(BARE._replace(loose_ring_m=2.5e-4))
    assert first == pytest.approx(0.01, abs=1e-9)
    assert second == pytest.approx(0.01 + (0.08 - 2.5e-4) / 0.7, abs=1e-9)


def test_a_pushed_ring_never_comes_back_upon_the_disk():
    """Whatever the direction of the blow before, the gap after a blow is not negative."""
    rng = np.random.default_rng(1)
    loose = BARE._replace(loose_ring_m=2.5e-4)
    for azimuth, last in rng.uniform(0.0, 2.0 * np.pi, (20, 2)):
        out = np.array([np.cos(azimuth), np.sin(azimuth)])
        ring = 2.5e-4 * np.array([np.cos(last), np.sin(last)])
        x, y = ring + 0.04 * out
        state = state_of(x=x, y=y, vx=out[0], vy=out[1], count=1, normal=last)
        assert wall_gap(0.0, state, loose, STILL)[0] == pytest.approx(0.0, abs=1e-12)
        after = impact(0.0, state, loose, STILL, np.zeros(2), 1.0)[0]
        assert wall_gap(0.0, after, loose, STILL)[0] > -1e-12
        assert after[14] == pytest.approx(np.arctan2(out[1], out[0]))


def test_a_camera_swings_after_each_impact_and_dies_out():
    errors = ViewErrors(shaken_px=0.4, shaken_hz=30.0)
    time = np.array([0.05, 0.11, 0.12, 0.3])
    off = shake_px(time, np.array([0.1, 0.115]), np.array([[2.0, 5.0], [-1.0, 0.0]]), errors)

    def one(late):
        return np.exp(-late / 0.04) * np.sin(60.0 * np.pi * late)

    expected = [0.0, 0.8 * one(0.01), 0.8 * one(0.02) - 0.4 * one(0.005), 0.8 * one(0.2) - 0.4 * one(0.185)]
    assert off == pytest.approx(expected, abs=1e-12) and abs(off[-1]) < 0.01


def test_a_reflection_draws_markers_towards_it():
    view = draw_views(np.random.default_rng(8))[1]
    errors = ViewErrors(glare_px=2.0, glare_m=(0.01, -0.015), glare_camera=1)
    points = np.array([[[0.01, -0.015, 0.01], [0.018, -0.015, 0.01], [0.06, -0.015, 0.01]]])
    plain = view.pixels(points)
    moved = glared(plain, 1, view, errors) - plain
    back = (plain[0, 0] - plain[0, 1]) / np.hypot(*(plain[0, 0] - plain[0, 1]))
    assert moved[0] == pytest.approx(np.array([[0.0, 0.0], 2.0 * back, [0.0, 0.0]]), abs=1e-4)
    assert np.array_equal(glared(plain, 0, view, errors), plain)


def test_what_remembers_a_blow_does_not_stand_beside_a_contact_that_lasts():
    names = ("unknown_loose_ring", "unknown_glue_thread", "unknown_two_edges")
    needs_a_blow_that_is_over(names)
    assert all(may_stand_together(("table_tilt", name), "round", "sine") for name in names)
