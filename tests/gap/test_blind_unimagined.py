"""Each of the unimagined causes does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.causes.unimagined import UNIMAGINED
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import impact
from analysis.blind.recording.clock import grounded_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import through_lid
from analysis.blind.recording.views import draw_views
from tests.gap.blind_rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    G,
    first_contacts,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    rate_of,
    state_of,
)


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        # a nap along x: against it, with it, across it, and from all sides under a disk that only spins
        ({"nap": 0.35, "nap_rad": 0.0}, {"vx": 1.0}, (-1.35 * G, 0.0, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"vx": -1.0}, (0.65 * G, 0.0, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"vy": 1.0}, (0.0, -G, 0.0)),
        ({"nap": 0.35, "nap_rad": 0.0}, {"spin": 50.0}, (0.0, 0.0, -G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # a floor that turns at 7 rad/s carries what rests, and leaves alone what goes with it
        ({"floor_turn_rad_per_s": 7.0}, {"x": 0.02, "spin": 7.0}, (0.0, G, 0.0)),
        ({"floor_turn_rad_per_s": 7.0}, {"y": 0.02, "vx": -0.14, "spin": 7.0}, (0.0, 0.0, 0.0)),
        # a dished disk: the same friction as it slides, half the torque as it spins
        ({"dome": 0.5}, {"vx": 1.0}, (-G, 0.0, 0.0)),
        ({"dome": 0.5}, {"spin": 50.0}, (0.0, 0.0, -0.5 * G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # chatter in its band of speeds, half as much at 1.18 of its width, none far from it
        ({"chatter": 0.6, "chatter_m_per_s": 0.7}, {"vx": 0.7}, (-0.4 * G, 0.0, 0.0)),
        ({"chatter": 0.6}, {"vy": -0.7 - 0.2 * np.sqrt(2 * np.log(2))}, (0.0, 0.7 * G, 0.0)),
        ({"chatter": 0.6}, {"vx": 2.0}, (-G, 0.0, 0.0)),
    ],
)
def test_friction_by_its_formulas(changed, state, expected):
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-3)


def test_poles_push_and_turn_by_one_energy():
    """Force and torque are what one energy, -B m (x cos a - y sin a), falls by along x, y and the angle."""
    poles = FREE._replace(poles_m_per_s2=0.4, poles_rad=0.3)

    def energy(x, y, angle):
        return -0.4 * (x * np.cos(angle + 0.3) - y * np.sin(angle + 0.3))

    at, h = np.array([0.012, -0.021, 1.1]), 1e-6
    falls = [-(energy(*(at + h * e)) - energy(*(at - h * e))) / (2 * h) for e in np.eye(3)]
    expected = (falls[0], falls[1], falls[2] / 5e-5)
    assert rate_of(poles, x=at[0], y=at[1], angle=at[2]) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_what_goes_with_the_host(time):
    """A pitching floor presses in proportion to place times acceleration; bellows blow with the velocity's square."""
    phase = DRIVE * time + 2.0
    x, v, a = 0.0164 * np.sin(phase), 0.0164 * DRIVE * np.cos(phase), -0.0164 * DRIVE**2 * np.sin(phase)
    share = 1.0 + 0.6 * 0.02 * a / (0.04 * 78.5)
    got = rate_of(SLIDING._replace(pitching=0.6), time, HOST, x=x + 0.02, y=0.01, vx=v, vy=1.0)
    assert got == pytest.approx((0.0, -share * G, 0.0), abs=1e-6)
    blown = 0.7 * v * abs(v) / 1.136**2
    assert rate_of(FREE._replace(bellows_m_per_s2=0.7), time, HOST) == pytest.approx((blown, 0.0, 0.0), abs=1e-12)


def test_impacts_by_their_formulas():
    rings = BARE._replace(ringing=0.2, ringing_rad_per_s=250.0)
    for since in (0.004, 0.02, 0.05):
        gain = 0.2 * np.exp(-since / 0.06) * np.sin(250.0 * since)
        assert head_on(rings, impact_s=0.1 - since, count=1)[0] == pytest.approx(-0.7 - gain)
    assert head_on(rings)[0] == pytest.approx(-0.7)  # nothing was hit before
    assert head_on(rings._replace(ringing=0.5), impact_s=0.095, count=1)[0] == pytest.approx(-0.98)  # the most there is
    for speed in (0.3, 1.0, 2.0):  # it slides: what is lost is the limit
        lost = 3.0 * 0.15 * (1.0 + 0.9 * (1.0 - np.exp(-speed / 0.8))) * 1.7 * speed
        assert head_on(BARE._replace(squeezed=0.9), speed, 800.0)[1] == pytest.approx(8.0 - lost)
    for spin in (3.0, -30.0):  # it sticks
        back = 0.45 / (1.0 + 1.5 * 0.01 * abs(spin) / 0.3)
        assert head_on(BARE._replace(skin=1.5), 1.0, spin)[1] == pytest.approx(-back * 0.01 * spin)
    for time in (0.0, 0.02, 0.03):
        host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
        seated = head_on(BARE._replace(seated=0.13), host=HOST, time=time)[0]
        assert seated == pytest.approx(-0.7 - 0.13 * host / 78.5)


def test_leaning_teeth_turn_the_blow_and_give_no_energy():
    """Head-on without wall friction: the impulse is along the teeth's normal, 0.045 rad beside the wall's; with it,
    no blow leaves more energy than it finds; what is held meets the wall itself."""
    saw = BARE._replace(saw_rad=0.045)
    out = impact(0.1, state_of(x=0.04, vx=1.0), saw._replace(wall_friction=0.0), STILL, np.zeros(2), 1.0)[0]
    pushed = -1.7 * np.cos(0.045) * np.array([np.cos(0.045), np.sin(0.045)])
    assert out[2:4] == pytest.approx([1.0 + pushed[0], pushed[1]]) and out[5] == 0.0
    leaves_no_more_energy(saw)
    state = state_of(x=0.04, vx=0.3, vy=1.0)
    held = [impact(0.1, state, p, STILL, np.zeros(2), 0.0)[0] for p in (saw, BARE)]
    assert np.array_equal(*held)


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place, at the told time."""
    (late,), (approach,), _ = first_contacts(BARE._replace(slipping_m=3.5e-4, slipping_rad=0.4))
    way = 3.5e-4 * (2.0 * (late - 2e-3) / 1.2 - 1.0)
    x = way * np.cos(0.4) + np.sqrt(0.04**2 - (way * np.sin(0.4)) ** 2)
    assert late == pytest.approx(x - 0.03, abs=1e-9)
    assert approach == pytest.approx(
        1.0 - 7e-4 / 1.2 * np.cos(0.4), abs=1e-5
    )  # the wall's own speed; normal 3 mrad off
    (late, *_), _, _ = first_contacts(BARE._replace(squash_m=3.5e-4, squash_rad=0.5), HOST)
    swing = DRIVE * (late - 2e-3) + 2.0
    host = 0.0164 * (np.sin(swing) - np.sin(2.0 - DRIVE * 2e-3))
    start = -0.0164 * DRIVE**2 * np.sin(swing) * np.cos(0.5) / 78.5
    assert late == pytest.approx(0.01 + host + 3.5e-4 * start * np.cos(-1.0), abs=1e-9)


def test_a_squashed_rings_speed_is_part_of_the_blow_but_a_cylinder_stands():
    squashed = BARE._replace(squash_m=3.5e-4, squash_rad=0.5)
    jerk = -0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0) * np.cos(0.5)
    moves = 3.5e-4 / 78.5 * jerk * np.cos(-1.0)
    position, velocity, _ = host_pose(0.05, HOST)
    for far, along, expected in ((0.045, 1.0, moves), (0.018, -1.0, 0.0)):
        state = state_of(x=position[0] + far, vx=velocity[0] + along)
        pair = (impact(0.05, state, p._replace(obstacle_m=0.018), HOST, np.zeros(2), 1.0)[1] for p in (BARE, squashed))
        assert np.subtract(*pair) == pytest.approx(expected, abs=1e-4)  # the wall's slope: 0.01 rad


def test_a_pane_displaces_what_lies_beyond_its_edge():
    view = draw_views(np.random.default_rng(8))[1]
    errors = ViewErrors(lid_px=1.2, lid_m=(0.01, -0.005), lid_rad=np.pi / 2, lid_camera=1)
    points = np.array([[[0.03, -0.004, 0.01], [-0.03, -0.006, 0.01]]])
    plain = view.pixels(points)
    moved = through_lid(plain, 1, view, errors) - plain
    up = view.pixels(np.array([[0.01, 0.005, 0.01], [0.01, -0.005, 0.01]]))
    across = (up[0] - up[1]) / np.hypot(*(up[0] - up[1]))
    assert moved[0] == pytest.approx(np.array([1.2 * across, [0.0, 0.0]]), abs=1e-9)
    assert np.array_equal(through_lid(plain, 0, view, errors), plain)


def test_a_grounded_trigger_is_late_with_the_hosts_acceleration():
    time = np.array([0.0, 0.01, 0.033])
    host = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0)
    assert grounded_s(time, HOST, ViewErrors(grounded_s=4e-4)) == pytest.approx(4e-4 * host / 78.5, abs=1e-12)
    assert np.all(grounded_s(time, HOST, ViewErrors()) == 0.0)


def test_only_a_round_wall_is_squashed_and_no_blow_has_two_laws():
    needs_a_round_wall("unknown_squashed_ring")
    needs_a_blow_that_is_over(cause.name for cause in UNIMAGINED if cause.stage == "impact")
