"""Each of the unsuspected causes does what its formula says, by as much as a severity of 1 means, in proportion to it,
and nothing at 0."""

import numpy as np
import pytest

from analysis.blind.causes.named import may_stand_together
from analysis.blind.causes.unsuspected import FOLLOWS, UNSUSPECTED
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import wall_gap
from analysis.blind.plant.wall.shape import split_reach
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import glinted, trailed
from analysis.blind.recording.picture import twist_rad, twisted
from analysis.blind.recording.views import MARKERS, draw_views
from tests.gap.blind_rig import (
    BARE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    TIMES,
    G,
    amount,
    changes_nothing_at_zero,
    command_takes_group,
    first_contacts,
    goes_another_way,
    head_on,
    leaves_no_more_energy,
    means_what_it_says,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    pictured,
    rate_of,
    say_what_they_follow,
    state_of,
    struck,
)

NAMES = [cause.name for cause in UNSUSPECTED]
SEEN = [cause.name for cause in UNSUSPECTED if cause.stage == "measurement"]
R = 0.01


def _acts(name):
    """Which markers in which camera a cause moves."""

    def chosen(camera, marker, view):
        acts = np.ones(len(camera), dtype=bool)
        if name != "unknown_twisted_camera":
            acts &= marker.str.startswith("N")
        if name != "unknown_comet_tails":
            acts &= camera == f"VW{view.get('glint_camera', 0) + 1}"
        return acts

    return chosen


def _does(name, size):
    return pictured(name, size, _acts(name)) if name in SEEN else amount(name, size)


@pytest.mark.parametrize("name", NAMES)
def test_severity_one_is_what_it_means_and_half_of_it_half(name):
    means_what_it_says(name, _does)


@pytest.mark.parametrize("name", NAMES)
def test_severity_zero_changes_nothing(name):
    changes_nothing_at_zero(name)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in SEEN])
def test_a_run_goes_another_way(name):
    goes_another_way(name)


def test_every_one_says_what_it_follows_and_none_comes_twice():
    say_what_they_follow(UNSUSPECTED, FOLLOWS)


def test_the_command_takes_the_group_and_each_by_name(tmp_path, capsys):
    command_takes_group("unsuspected", UNSUSPECTED, tmp_path, capsys)


def test_friction_by_its_formulas():
    """Marks around the centre hold what crosses them; a polished track is smooth where it is; elsewhere all is as ever,
    and at the centre itself marks have no direction."""
    marks = SLIDING._replace(rings=0.3)
    share = 0.3 * 20.0 / 22.0
    assert rate_of(marks, x=0.02, vx=1.0) == pytest.approx((-G * (1.0 + share), 0.0, 0.0), abs=1e-3)
    assert rate_of(marks, x=0.02, vy=1.0) == pytest.approx((0.0, -G * (1.0 - share), 0.0), abs=1e-3)
    assert rate_of(marks, y=-0.02, vy=1.0) == pytest.approx((0.0, -G * (1.0 + share), 0.0), abs=1e-3)
    assert rate_of(marks, vy=1.0) == pytest.approx((0.0, -G, 0.0), abs=1e-3)
    track = SLIDING._replace(track=0.5, track_m=0.02)
    assert rate_of(track, x=0.012, y=-0.016, vx=1.0)[0] == pytest.approx(-0.5 * G)
    assert rate_of(track, x=0.027, vx=1.0)[0] == pytest.approx(-G * (1.0 - 0.5 * np.exp(-0.5)))


def test_forces_and_torques_by_their_formulas():
    bow = FREE._replace(bow_m_per_s2=0.8)
    for way, held in ((0.0, 0.0), (0.02, 1.0 - np.exp(-1.0)), (0.5, 1.0)):
        got = rate_of(bow, vx=-0.6, vy=0.8, way=3.0 + way, way_before=3.0)
        assert got == pytest.approx((0.6 * 0.8 * held, -0.8 * 0.8 * held, 0.0), abs=1e-4)
    vane = FREE._replace(vane_rad_per_s2=30.0, vane_rad=0.4)
    for angle, turned in ((-0.4, 0.0), (np.pi / 2 - 0.4, -1.0), (-np.pi / 2 - 0.4, 1.0)):
        assert rate_of(vane, vx=1.5, angle=angle) == pytest.approx((0.0, 0.0, 30.0 * 2.25 * turned), abs=1e-9)
    core = FREE._replace(core_per_s=2.0)
    assert rate_of(core, spin=50.0, core=20.0) == pytest.approx((0.0, 0.0, -60.0))
    lean = FREE._replace(lean_m_per_s2=0.4, lean_rad=0.7)
    for time in TIMES[::7]:
        side = 0.4 * np.tanh(host_pose(time, HOST)[1][0] / 0.1)
        expected = (side * np.cos(0.7), side * np.sin(0.7), 0.0)
        assert rate_of(lean, time, HOST, vy=0.3) == pytest.approx(expected, abs=1e-9)


def test_a_blow_scatters_the_dust_and_leaves_the_core_behind():
    """In a run, between two blows: what the dust takes begins anew at each; the core begins with the disk's spin."""
    start = np.array([0.0, 0.0, 0.5, 0.0, 0.0, 60.0])
    bow = FREE._replace(bow_m_per_s2=0.8, restitution=0.9, wall_friction=0.0)
    motion = run_plant(bow, STILL, start, 0.25, np.random.default_rng(0))
    late = motion.impacts[0, 0]
    before, after, soon = state_at(motion, late + np.array([-1e-3, 1e-3, 3e-3]))[:, 2]
    at_wall = state_at(motion, np.array([late - 3e-3]))[0, 2]
    assert (at_wall - before) / 2e-3 == pytest.approx(0.8 * (1.0 - np.exp(-2.0)), rel=0.03)
    assert 0.0 < (soon - after) / 2e-3 < 0.06
    core = FREE._replace(core_per_s=2.0, wall_friction=0.3)
    motion = run_plant(core, STILL, start, 0.25, np.random.default_rng(0))
    late, flown_s = motion.impacts[0, 0], 0.9 * np.diff(motion.impacts[:2, 0])[0]
    spins = state_at(motion, late + np.array([-1e-3, 1e-6, flown_s]))[:, 5]
    assert spins[0] == pytest.approx(60.0)  # as fast as its core
    rate = 2.0 + 1.0 / 0.03  # at which what the core lacks of the spin dies out
    lost = 2.0 * (spins[1] - 60.0) * (1.0 - np.exp(-rate * flown_s)) / rate
    assert abs(lost) > 1.0 and spins[2] - spins[1] == pytest.approx(-lost, rel=1e-3)


def test_impacts_by_their_formulas():
    sheet = BARE._replace(sheet=0.1, sheet_rad=0.3)
    for angle, gain in ((-0.3, 0.1), (np.pi - 0.3, 0.1), (np.pi / 2 - 0.3, -0.1), (np.pi / 4 - 0.3, 0.0)):
        assert head_on(sheet, angle=angle)[0] == pytest.approx(-0.7 - gain)
    assert head_on(sheet._replace(restitution=0.95), angle=-0.3)[0] == pytest.approx(-0.98)
    shim = BARE._replace(shim=0.25, shim_rad=-0.5, shim_rad_per_s=3.0)
    for time in (0.1, 0.5 / 3.0, 0.4):
        lost = 0.25 * np.exp(-0.5 * ((0.5 - 3.0 * time) / 0.7) ** 2)
        assert head_on(shim, time=time)[0] == pytest.approx(-0.7 + lost)
    flash = BARE._replace(flash=0.6)
    for speed, spin in ((1.0, 400.0), (0.5, -300.0)):
        left = 1.0 - 0.6 * (1.0 - np.exp(-speed * abs(R * spin) / 0.3))
        slip = R * spin - 3.0 * np.sign(spin) * 0.15 * left * 1.7 * speed
        assert head_on(flash, speed, spin)[1] == pytest.approx(slip)
    oiled = BARE._replace(creeping=0.8)
    assert head_on(oiled, 1.0, 400.0)[1] == pytest.approx(4.0 - 3.0 * 0.15 * 0.2 * 1.7)  # nothing was hit before
    left = 1.0 - 0.8 * (1.0 - np.exp(-0.02 / 0.025))
    again = head_on(oiled, 1.0, 400.0, impact_s=0.08, count=3)
    assert again[1] == pytest.approx(4.0 - 3.0 * 0.15 * left * 1.7)
    ring = BARE._replace(o_ring_s_per_m=0.25, wall_friction=0.0)
    for speed, left in ((1.0, 0.75), (2.0, 0.5), (5.0, 0.0)):
        assert head_on(ring, speed, -80.0)[2] == pytest.approx(-80.0 * left)


@pytest.mark.parametrize("changed", [{"flash": 0.7}, {"creeping": 0.8}, {"o_ring_s_per_m": 0.3}, {"sheet": 0.14}])
def test_no_blow_leaves_more_energy(changed):
    leaves_no_more_energy(BARE._replace(**changed))


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x; a ring that trails has the speed of its own place's change; halves that are askew are smooth but
    at their joint."""
    for turn, more in ((np.pi / 2, 0.0), (-0.4, 2.5e-4 * np.cos(0.4)), (0.4, -2.5e-4 * np.cos(0.4))):
        split = BARE._replace(split_m=5e-4, split_rad=turn)
        assert first_contacts(split)[0][0] == pytest.approx(R + more, abs=2e-7)
    for azimuth in np.linspace(-3.0, 3.0, 31):
        low, high = (split_reach(azimuth + d, split)[0] for d in (-1e-6, 1e-6))
        assert split_reach(azimuth, split)[1] == pytest.approx((high - low) / 2e-6, abs=1e-8)
    trails = BARE._replace(trailing_m=4e-4)
    h = 1e-6
    for time in TIMES[::9]:
        state = state_of(x=0.03)
        gaps = [wall_gap(time + d, state, trails, HOST)[0] - wall_gap(time + d, state, BARE, HOST)[0] for d in (-h, h)]
        velocity, acceleration = host_pose(time, HOST)[1][0], host_pose(time, HOST)[2][0]
        assert np.mean(gaps) == pytest.approx(-4e-4 * velocity / 1.136, abs=1e-10)
        hit = struck(trails, time, HOST)
        own = -4e-4 * acceleration / 1.136
        assert np.diff(gaps)[0] / (2.0 * h) == pytest.approx(own, abs=1e-5)
        assert hit[2] - velocity == pytest.approx(own - 0.7 * (1.0 - own), abs=1e-4)


def test_pictures_by_their_formulas():
    view = draw_views(np.random.default_rng(1))[0]
    pixels = np.zeros((5, len(MARKERS), 2)) + view.centre_px
    pixels[..., 0] += 3.0 * np.arange(5)[:, None]
    late = trailed(pixels, 800.0, ViewErrors(comet_s=1e-4)) - pixels
    assert late[:, :7] == pytest.approx(0.0) and late[:, 7:, 0] == pytest.approx(-0.24)
    points = np.zeros((2, len(MARKERS), 3))
    points[0, 10], points[1, 10] = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]  # N4 from N2
    errors = ViewErrors(glint_px=0.8, glint_rad=0.0, lamp_rad=np.pi / 2, glint_camera=1)
    lit = glinted(pixels[:2], points, 1, errors) - pixels[:2]
    assert lit[0, 7:] == pytest.approx(np.tile([0.0, 0.8], (5, 1))) and lit[1] == pytest.approx(0.0)
    assert np.array_equal(glinted(pixels[:2], points, 0, errors), pixels[:2])
    time = TIMES[:5]
    turn = twist_rad(time, HOST, ViewErrors(twisted_rad=4e-3))
    pull = np.array([host_pose(t, HOST)[2][0] for t in time])
    assert turn == pytest.approx(4e-3 * pull / 78.5, abs=1e-12)
    off = twisted(pixels, turn, view) - pixels
    away = 3.0 * np.arange(5)[:, None]
    assert off[..., 1] == pytest.approx(np.broadcast_to(away * np.sin(turn)[:, None], off.shape[:2]))


def test_what_may_stand_together():
    """Halves of a ring need a round wall, no blow has two laws."""
    needs_a_round_wall("unknown_split_ring")
    assert may_stand_together(("table_tilt", "unknown_trailing_ring"), "square", "sine")
    needs_a_blow_that_is_over(cause.name for cause in UNSUSPECTED if cause.stage == "impact")
