"""Each of the unexpected causes does what its formula says, by as much as a severity of 1 means, in proportion to it,
and nothing at 0."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run
from analysis.blind.causes.unexpected import FOLLOWS, UNEXPECTED
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import wall_gap
from analysis.blind.recording.clock import pulsed_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import shaded
from analysis.blind.recording.markers import flung
from analysis.blind.recording.views import MARKERS, draw_views
from tests.gap.blind_rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    PLACE,
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
    physics,
    pictured,
    rate_of,
    say_what_they_follow,
    state_of,
    struck,
)

NAMES = [cause.name for cause in UNEXPECTED]
SEEN = [cause.name for cause in UNEXPECTED if cause.stage == "measurement"]
R = 0.01


def _acts(name):
    """Which markers in which camera a cause moves."""

    def chosen(camera, marker, view):
        if name == "unknown_sync_pulses":
            return camera == "VW2"
        if name == "unknown_flung_sticker":
            return marker == f"N{view['flung_marker'] + 1}"
        return marker.str.startswith("N")

    return chosen


def _does(name, size):
    if name in SEEN:
        return pictured(name, size, _acts(name))
    if name != "unknown_smeared_drop":
        return amount(name, size)
    p = physics(name, 1.0)
    return amount(name, size, (p.drop_x_m, p.drop_y_m))


@pytest.mark.parametrize("name", NAMES)
def test_severity_one_is_what_it_means_and_half_of_it_half(name):
    # A surface that goes round turns slow slips at once, and is held at the Coulomb limit later.
    means_what_it_says(name, _does, rel=0.25 if name == "unknown_swinging_ring" else 0.12)


@pytest.mark.parametrize("name", NAMES)
def test_severity_zero_changes_nothing(name):
    changes_nothing_at_zero(name)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in SEEN])
def test_a_run_goes_another_way(name):
    goes_another_way(name)


def test_every_one_says_what_it_follows_and_none_comes_twice():
    say_what_they_follow(UNEXPECTED, FOLLOWS)


def test_the_command_takes_the_group_and_each_by_name(tmp_path, capsys):
    command_takes_group("unexpected", UNEXPECTED, tmp_path, capsys)


def test_friction_by_its_formulas():
    wet = SLIDING._replace(drop=0.6)
    assert rate_of(wet, vx=1.0, oiled=0.5)[0] == pytest.approx(-G * 0.7)
    bevel = SLIDING._replace(bevel=0.4, bevel_rad=0.3)
    for angle, more in ((-0.3, 0.4), (np.pi - 0.3, -0.4), (np.pi / 2 - 0.3, 0.0)):
        assert rate_of(bevel, vx=1.0, angle=angle)[0] == pytest.approx(-G * (1.0 + more), abs=1e-4)
    plain, spun = (rate_of(q, vx=1.0, angle=-0.3, spin=75.0)[0] for q in (SLIDING, bevel))
    assert spun / plain == pytest.approx(1.0 + 0.4 / 1.25, abs=1e-5)  # its rim goes round at 0.75 m/s
    rumble = SLIDING._replace(rumble=0.4)
    for time in TIMES[::7]:
        speed = host_pose(time, HOST)[1][0]
        held = G * (1.0 - 0.4 * speed**2 / 1.136**2)
        assert rate_of(rumble, time, HOST, vx=speed, vy=0.5)[1] == pytest.approx(-held, abs=1e-4)


def test_a_drop_wets_the_disk_and_the_way_wipes_it():
    """In a run over a drop half-way to the wall, with a grip that is none: what it carries shows where it slides."""
    wet = SLIDING._replace(drop=0.5, drop_x_m=0.01, floor_friction=0.1)
    start = np.array([-0.01, 0.0, 1.0, 0.0, 0.0, 0.0])
    motion = run_plant(wet, STILL, start, 0.04, np.random.default_rng(0))
    time = np.arange(-1.9e-3, 0.0385, 1e-4)
    path, oiled = state_at(motion, time), 0.0
    expected = []
    for x, speed in zip(path[:, 0], path[:, 2], strict=True):
        expected.append(-0.1 * 9.81 * (1.0 - 0.5 * oiled))
        oiled += 1e-4 * (np.exp(-0.5 * ((x - 0.01) / 0.01) ** 2) * (1.0 - oiled) / 0.01 - speed * oiled / 0.06)
    got = np.gradient(path[:, 2], time)
    assert got[5:-5] == pytest.approx(np.array(expected)[5:-5], abs=0.01)
    assert got.max() > -0.1 * 9.81 * 0.75 and got[3] == pytest.approx(-0.1 * 9.81, rel=0.08)


def test_forces_and_torques_by_their_formulas():
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
    spiral = FREE._replace(spiral_rad_per_s2=-30.0)
    for direction in (0.0, 2.0):
        got = rate_of(spiral, vx=1.5 * np.cos(direction), vy=1.5 * np.sin(direction), spin=20.0)
        assert got == pytest.approx((0.0, 0.0, -45.0), abs=1e-9)
    along = host_pose(0.1, HOST)[1][0]
    assert rate_of(spiral, 0.1, HOST, vx=along, vy=0.4)[2] == pytest.approx(-12.0)  # over the floor, not the room


def test_a_blow_discharges_the_disk():
    charged = FREE._replace(charged_per_s2=26.0, restitution=0.9, wall_friction=0.0)
    motion = run_plant(charged, STILL, np.array([0.0, 0.0, 0.5, 0.0, 0.0, 0.0]), 0.25, np.random.default_rng(0))
    late = motion.impacts[0, 0]
    before, at_wall, after, soon = state_at(motion, late + np.array([-3e-3, -1e-3, 1e-3, 3e-3]))[:, 2]
    assert (at_wall - before) / 2e-3 == pytest.approx(26.0 * 0.039 * (1.0 - np.exp(-1.3)), rel=0.03)
    assert 0.0 < (soon - after) / 2e-3 < 0.05


def test_impacts_by_their_formulas():
    def slid(share, slip, speed=1.0):
        return slip - 3.0 * np.sign(slip) * 0.15 * share * 1.7 * speed

    combed = BARE._replace(combed=0.7)
    for spin, last in ((400.0, 0.5), (400.0, -0.5), (-300.0, 0.2)):
        share = 1.0 - 0.7 * np.tanh(R * spin / 0.3) * np.tanh(last / 0.3)
        assert head_on(combed, 1.0, spin, slipped=last)[1] == pytest.approx(slid(share, R * spin))
    assert struck(combed, spin=-120.0)[PLACE.index("slipped")] == pytest.approx(-1.2)
    glued = BARE._replace(glued=0.7, glued_rad=0.4)
    for angle, more in ((-0.4, 0.7), (np.pi - 0.4, -0.7), (np.pi / 2 - 0.4, 0.0)):
        assert head_on(glued, 1.0, 400.0, angle=angle)[1] == pytest.approx(slid(1.0 + more, 4.0))
    shingled = BARE._replace(shingled=0.1)
    for spin in (-60.0, 0.0, 30.0):
        assert head_on(shingled, 1.0, spin)[0] == pytest.approx(-0.7 + 0.1 * np.tanh(R * spin / 0.4))
    assert head_on(shingled._replace(restitution=0.95), 1.0, -60.0)[0] == pytest.approx(-0.98)
    rattling = BARE._replace(rattling=0.12)
    assert head_on(rattling)[0] == pytest.approx(-0.7)  # nothing was hit before
    for last in (0.0, 2.0, np.pi):
        assert head_on(rattling, normal=last, count=3)[0] == pytest.approx(-0.7 - 0.12 * np.cos(last))
    swinging = BARE._replace(swinging_m_per_s=0.3, swinging_rad=0.6, wall_friction=5.0)
    for time in TIMES[::9]:
        surface = 0.3 * host_pose(time, HOST)[1][0] * np.cos(0.6) / 1.136
        slip = head_on(swinging, 1.0, 10.0, time, HOST)[1]
        assert slip - surface == pytest.approx(-0.45 * (0.1 - surface))


@pytest.mark.parametrize("changed", [{"combed": 0.8}, {"glued": 0.9}, {"shingled": 0.14}, {"rattling": 0.14}])
def test_no_blow_leaves_more_energy(changed):
    leaves_no_more_energy(BARE._replace(**changed))


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x; a ring that rolls round in its seat has the speed of its own place's change; a liner is packed
    from run to run, by as much to either side of the mean."""
    packed = BARE._replace(packed_m=2e-4)
    assert first_contacts(packed)[0][0] == pytest.approx(R + 2e-4, abs=2e-7)
    draft = draft_series("unknown_packing_felt", 1.0, np.random.default_rng(1), 5)
    runs = [physics_of_run(draft, run, DRIVE, 1.2).packed_m for run in range(5)]
    assert np.diff(runs) == pytest.approx(np.full(4, 0.5 * runs[-1])) and sum(runs) == pytest.approx(0.0)
    orbits = BARE._replace(orbit_m=3e-4, orbit_rad=0.5, orbit_rad_per_s=60.0)  # faster than any, for its own speed
    h = 1e-6
    for time in (0.1, 0.123, 0.31):
        at = 0.5 + 60.0 * time
        state = state_of(x=0.03)
        gaps = [wall_gap(time + d, state, orbits, STILL)[0] for d in (-h, h)]
        assert np.mean(gaps) == pytest.approx(0.01 + 3e-4 * np.cos(at), abs=3e-6)  # and a little of the wall's curve
        own = -3e-4 * 60.0 * np.sin(at)
        assert np.diff(gaps)[0] / (2.0 * h) == pytest.approx(own, abs=3e-4)
        hit = struck(orbits, time)
        assert hit[2] == pytest.approx(own - 0.7 * (1.0 - own), abs=1e-3)


def test_times_and_places_by_their_formulas():
    errors = ViewErrors(sync_s=6e-4, sync_every_s=0.3, sync_late_s=0.1)
    late = pulsed_s(np.array([0.1, 0.25, 0.3999, 0.4, 0.05]), errors)
    assert late == pytest.approx(6e-4 * np.array([-0.5, 0.0, 0.5, -0.5, 1.0 / 3.0]), abs=1e-6)
    points = np.zeros((5, len(MARKERS), 3))
    points[:, 9, :2] = [0.0, 0.006]  # N3, from a middle one at the origin
    time = np.arange(5) / 800.0
    for spin, share in ((40.0, 0.5), (-80.0, 0.8), (0.0, 0.0)):
        off = flung(points, spin * time, time, ViewErrors(flung_m=3e-4, flung_marker=2)) - points
        assert off[:, 9] == pytest.approx(np.tile([0.0, 3e-4 * share, 0.0], (5, 1)))
        assert np.all(np.delete(off, 9, axis=1) == 0.0)


def test_pictures_by_their_formulas():
    """A lamp along x: the markers of a disk near the wall there move back along x, those elsewhere and of the Host do
    not."""
    view = draw_views(np.random.default_rng(1))[0]
    points = np.zeros((4, len(MARKERS), 3))
    points[:, 3:7, :2] = 0.05 * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])
    points[:, 7:, 0] = np.array([-0.03, 0.012, 0.022, 0.04])[:, None]
    pixels = view.pixels(points)
    off = shaded(pixels, points, view, ViewErrors(shade_px=1.4)) - pixels
    assert np.all(off[:, :7] == 0.0)
    across = np.subtract(*view.pixels(np.array([[0.0, 0.0, 0.01], [0.01, 0.0, 0.01]])))
    across /= np.hypot(*across)
    for frame, deep in enumerate((0.0, 0.0, 0.5, 1.0)):
        assert off[frame, 7:] == pytest.approx(np.tile(1.4 * deep * across, (5, 1)), abs=5e-3)


def test_what_may_stand_together():
    """A liner and a ring that turns need a round wall, no blow has two laws, a wobble needs a blow that is over."""
    for name in ("unknown_packing_felt", "unknown_swinging_ring"):
        needs_a_round_wall(name)
    assert may_stand_together(("table_tilt", "unknown_orbiting_ring"), "square", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_charged_disk"), "round", "sine")
    alone = ["unknown_coin_wobble", *(cause.name for cause in UNEXPECTED if cause.stage == "impact")]
    needs_a_blow_that_is_over(alone)
