"""Each of the untold causes does what its formula says, by as much as a severity of 1 means, in proportion to it, and
nothing at 0."""

from functools import cache

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, may_stand_together, physics_of_run
from analysis.blind.causes.untold import FOLLOWS, UNTOLD
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.recording.clock import shocked_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import carded
from analysis.blind.recording.picture import blocked
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
    changes_nothing_at_zero,
    command_takes_group,
    first_contacts,
    goes_another_way,
    head_on,
    leaves_no_more_energy,
    means_what_it_says,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    on_its_way,
    physics,
    pictured,
    rate_of,
    rms,
    say_what_they_follow,
    state_of,
    struck,
)

NAMES = [cause.name for cause in UNTOLD]
SEEN = [cause.name for cause in UNTOLD if cause.stage == "measurement"]
R, INERTIA = 0.01, 0.5 * 0.01**2  # m, m^2


@cache
def _on_its_way():
    """`on_its_way`, its blows with what is remembered of those before: where the rim was struck, how hard they were."""
    flying, striking = on_its_way()
    out, rim, tired = [], 0.0, 0.0
    for time, state in striking:
        known, p = state.copy(), physics("none", 1.0)
        if known[PLACE.index("count")] == 0.0:
            rim, tired = 0.0, 0.0
        known[PLACE.index("struck")], known[PLACE.index("tired")] = rim, tired
        out.append((time, known))
        after = impact(time, known, p, HOST, np.zeros(2), 1.0)[0]
        rim, tired = after[PLACE.index("struck")], after[PLACE.index("tired")]
    return flying, out


def _done(name, size):
    """Rates in flight, states after blows, gaps and normals at the wall on the way of plain runs."""
    p, table, (flying, striking) = physics(name, size), disk_friction_table(), _on_its_way()
    return (
        np.array([derivative(time, state, p, HOST, table) for time, state in flying]),
        np.array([impact(time, state, p, HOST, np.zeros(2), 1.0)[0] for time, state in striking]),
        np.array([wall_gap(time, state, p, HOST) for time, state in striking]),
    )


def _acts(name):
    """Which markers in which camera a cause moves."""

    def chosen(camera, marker, view):
        return {
            "unknown_shocked_trigger": camera == "VW2",
            "unknown_coded_blocks": camera != "",
            "unknown_rubbery_card": marker.str.startswith("N") & (marker != "N1"),
        }[name]

    return chosen


def _does(name, size):
    """RMS, as a severity of 1 counts it."""
    if name in SEEN:
        return pictured(name, size, _acts(name))
    which = ("flight", "impact", "geometry").index(CAUSES[name].stage)
    off = _done(name, size)[which] - _done("none", size)[which]
    if which == 2:
        return rms(off[:, 0])
    return rms(np.hypot(off[:, 2], off[:, 3])) or R * rms(off[:, 5])


@pytest.mark.parametrize("name", NAMES)
def test_severity_one_is_what_it_means_and_half_of_it_half(name):
    means_what_it_says(name, _does)


@pytest.mark.parametrize("name", NAMES)
def test_severity_zero_changes_nothing(name):
    changes_nothing_at_zero(name, _done)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in SEEN])
def test_a_run_goes_another_way(name):
    goes_another_way(name)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in SEEN])
def test_a_run_has_no_more_blows_than_a_plain_one_could(name):
    """No law makes the disk rattle at the wall: of twelve runs none has many blows of no speed."""
    p = physics(name, 1.2)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        start = np.array([*rng.uniform(-0.02, 0.02, 2), *rng.normal(0.0, 0.86, 2), 0.3, rng.normal(0.0, 32.0)])
        approach = run_plant(p, HOST, start, 1.2, rng).impacts[:, 1]
        assert np.sum(approach <= 0.0) <= 2 and len(approach) < 120


def test_every_one_says_what_it_follows_and_none_comes_twice():
    say_what_they_follow(UNTOLD, FOLLOWS)
    assert len(set(FOLLOWS.values())) == 16


def test_the_command_takes_the_group_and_each_by_name(tmp_path, capsys):
    command_takes_group("untold", UNTOLD, tmp_path, capsys)


def test_friction_by_its_formulas():
    bristled = SLIDING._replace(bristled=0.5)
    for time in TIMES[::7]:
        _, velocity, acceleration = host_pose(time, HOST)
        along = 0.5 * acceleration[0] / 78.5
        for way, more in ((1.0, along), (-1.0, -along)):
            got = rate_of(bristled, time, HOST, vx=velocity[0] + way)[0]
            assert got == pytest.approx(-way * G * (1.0 + more), abs=3e-3)
        assert rate_of(bristled, time, HOST, vx=velocity[0], vy=1.0)[1] == pytest.approx(-G, abs=1e-4)
        plain, spun = (rate_of(q, time, HOST, vx=velocity[0] + 1.0, spin=75.0)[0] for q in (SLIDING, bristled))
        assert spun / plain == pytest.approx(1.0 + along / 1.25, abs=1e-3)  # its rim goes round at 0.75 m/s
    bead = SLIDING._replace(bead=0.6, bead_rad=0.4, bead_rad_per_s=-5.0)
    for time in (0.0, 0.3):
        c, s = np.cos(0.4 - 5.0 * time), np.sin(0.4 - 5.0 * time)
        for far, share in ((0.0, 1.0), (0.01, np.exp(-0.5)), (-0.015, np.exp(-1.125))):
            x, y = (0.02 + far) * c, (0.02 + far) * s
            assert rate_of(bead, time, x=x, y=y, vx=1.0)[0] == pytest.approx(-G * (1.0 - 0.6 * share), abs=1e-6)


def test_torques_by_their_formulas():
    wound = FREE._replace(wound_per_s2=4.0, wound_rad=1.5)
    for angle in (-3.0, 1.5, 1.5 + 4.0 * np.pi):
        assert rate_of(wound, angle=angle, vx=1.0) == pytest.approx((0.0, 0.0, -4.0 * (angle - 1.5)), abs=1e-9)
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


def test_forces_by_their_formulas():
    buckled = FREE._replace(buckled_per_s2=-25.0)
    for time in TIMES[::9]:
        position, _, acceleration = host_pose(time, HOST)
        push = -25.0 * acceleration[0] / 78.5
        got = rate_of(buckled, time, HOST, x=0.02 + position[0], y=-0.01)
        assert got == pytest.approx((0.02 * push, -0.01 * push, 0.0), abs=1e-9)
    eddied = FREE._replace(eddied_per_s=2.0)
    for radius, near in ((0.04, 1.0), (0.032, np.exp(-1.0))):
        got = rate_of(eddied, x=radius, vx=0.7, vy=0.5, spin=20.0)  # its rim there goes at 0.7 m/s along the wall
        assert got == pytest.approx((0.0, -1.4 * near, -1.4 * near * R / INERTIA), abs=1e-9)
        assert rate_of(eddied, y=-radius, vx=0.5, spin=-50.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)  # it rolls
    velocity = host_pose(0.1, HOST)[1][0]
    position = host_pose(0.1, HOST)[0][0]
    got = rate_of(eddied, 0.1, HOST, x=position, y=0.04, vx=velocity + 1.0)
    assert got == pytest.approx((-2.0, 0.0, 2.0 * R / INERTIA))  # against the Host


def _slid(share, slip, speed=1.0):
    """Slip after a blow that is held at the Coulomb limit."""
    return slip - 3.0 * np.sign(slip) * 0.15 * share * 1.7 * speed


def test_restitution_by_its_formulas():
    shifted = BARE._replace(shifted=0.12)
    assert head_on(shifted)[0] == pytest.approx(-0.7)  # nothing was hit before
    for angle, last in ((0.0, 0.0), (0.5, -0.5), (0.5, 2.0), (0.0, np.pi)):
        got = head_on(shifted, angle=angle, struck=last, count=3)[0]
        assert got == pytest.approx(-0.7 - 0.12 * np.cos(-angle - last))
    assert head_on(shifted._replace(restitution=0.95), struck=0.0, count=1)[0] == pytest.approx(-0.98)
    assert struck(shifted, angle=0.7)[PLACE.index("struck")] == pytest.approx(-0.7)
    shot = BARE._replace(shot=0.12)
    for time in TIMES[::9]:
        lost = 0.12 * abs(host_pose(time, HOST)[2][0]) / 78.5
        assert head_on(shot, 1.0, time=time, host=HOST)[0] == pytest.approx(-0.7 + lost)


def test_wall_friction_by_its_formulas():
    for wiped in (0.5, -0.5):
        assert head_on(BARE._replace(wiped=wiped), 1.0, 400.0)[1] == pytest.approx(_slid(1.0 + wiped, 4.0))
    draft = draft_series("unknown_wiped_rim", 1.0, np.random.default_rng(1), 7)
    runs = np.array([physics_of_run(draft, run, DRIVE, 1.2).wiped for run in range(7)])
    assert np.abs(runs) == pytest.approx(np.full(7, draft.parameters["unknown_wiped_rim"]["wiped"]))
    assert np.sum(runs > 0.0) == draft.parameters["unknown_wiped_rim"]["runs_wiped"] == 4
    scaly = BARE._replace(scaly=0.7, scaly_rad=0.4)
    for spin in (400.0, -400.0):
        share = 1.0 + 0.7 * np.tanh(R * spin / 0.3) * np.sin(0.4)
        assert head_on(scaly, 1.0, spin)[1] == pytest.approx(_slid(share, R * spin))
    other = struck(scaly, x=-0.08, vx=-1.0, spin=400.0)  # at the wall's other side the same sense runs back
    share = 1.0 - 0.7 * np.tanh(4.0 / 0.3) * np.sin(0.4)
    assert -other[3] + R * other[5] == pytest.approx(_slid(share, 4.0))


def test_a_corner_leads_the_blow_past_the_disks_middle():
    """A smooth wall: all that the disk gets is the normal impulse, at its lever; the struck point rebounds as any."""
    smooth = BARE._replace(wall_friction=0.0, cornered_m=3e-4, corners=5.0, cornered_rad=0.2)
    for speed, angle, spin in ((1.0, 0.0, 0.0), (0.1, 0.3, 30.0), (2.0, -1.0, -60.0)):
        lever = 3e-4 * np.sin(5.0 * (-angle - 0.2))
        lever *= np.tanh(speed / 0.2)
        state = struck(smooth, angle=angle, vx=speed, spin=spin)
        pushed = state[2] - speed
        assert pushed < 0.0 and state[3] == pytest.approx(0.0, abs=1e-12)
        assert state[5] - spin == pytest.approx(-lever * pushed / INERTIA)
        assert state[2] - lever * state[5] == pytest.approx(-0.7 * (speed - lever * spin))


@pytest.mark.parametrize(
    "changed",
    [
        {"cornered_m": 4e-4, "cornered_rad": 0.3},
        {"shifted": 0.14},
        {"shot": 0.14},
        {"wiped": 0.7},
        {"wiped": -0.7},
        {"scaly": 0.95},
    ],
)
def test_no_blow_leaves_more_energy(changed):
    leaves_no_more_energy(BARE._replace(**changed))


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x, of a disk that has not spun; then at any spin, and after other blows."""
    swollen = BARE._replace(swollen_m=3e-4)
    assert first_contacts(swollen)[0][0] == pytest.approx(R + 3e-4, abs=2e-7)
    assert first_contacts(BARE._replace(leaking_m=3e-4))[0][0] == pytest.approx(R - 3e-4, abs=2e-7)
    for spin, share in ((0.0, -1.0), (40.0, 0.0), (-120.0, 0.8)):
        assert wall_gap(0.1, state_of(x=0.03, spin=spin), swollen, STILL)[0] == pytest.approx(R - 3e-4 * share)
    around = swollen._replace(obstacle_m=0.018)  # a cylinder, too, is met where the band is
    assert wall_gap(0.1, state_of(x=0.02, spin=-120.0), around, STILL)[0] == pytest.approx(0.002 - 3e-4 * 0.8)
    leaking = BARE._replace(leaking_m=3e-4)
    for late in (0.0, 0.12):
        pressed = 3.0 * np.exp(-late / 0.12)
        gap = wall_gap(0.1 + late, state_of(x=0.03, tired=3.0, impact_s=0.1), leaking, STILL)[0]
        assert gap == pytest.approx(R + 3e-4 * (pressed - 3.0) / (pressed + 3.0))


def test_a_band_that_widens_in_a_blow_pushes_the_disk_off_the_wall():
    """Else it would be struck anew at once."""
    swollen = BARE._replace(swollen_m=3e-4, wall_friction=1.0)
    after = struck(swollen, vy=2.0)
    assert abs(after[5]) > 60.0 and wall_gap(0.1, after, swollen, STILL)[0] == pytest.approx(0.0, abs=1e-9)


def test_times_by_their_formula():
    errors = ViewErrors(shocked_s=1e-4)
    kicks = np.array([[1.2, -1.6], [0.0, 1.0]])
    time = np.array([0.0, 0.1, 0.14, 0.2, 0.24])
    expected = 1e-4 * np.array([0.0, 2.0, 2.0 * np.exp(-1.0), 1.0, np.exp(-1.0)])
    assert shocked_s(time, np.array([0.1, 0.2]), kicks, errors) == pytest.approx(expected)
    assert np.all(shocked_s(time, np.zeros(0), np.zeros((0, 2)), errors) == 0.0)


def test_pictures_by_their_formulas():
    pixels = np.array([[[800.0, 802.0], [804.5, 806.0]]])
    off = blocked(pixels, ViewErrors(blocked_px=0.8)) - pixels
    assert off == pytest.approx(-0.8 * np.array([[[0.0, 1.0], [np.sin(np.pi * 1.125), -1.0]]]), abs=1e-9)
    many = np.linspace(800.0, 816.0, 400)[None, :, None] * np.ones(2)
    assert np.all(np.diff(blocked(many, ViewErrors(blocked_px=1.0)), axis=1) > 0.0)  # no marker overtakes another
    nes, time = np.zeros((5, 4)), np.array([0.0, 0.1, 0.105, 0.11, 0.13])
    swung = carded(nes, time, np.array([[0.1, 40.0], [0.11, -20.0]]), ViewErrors(card_s=1e-3, card_hz=50.0))

    def swing(since):
        return -1e-3 * np.exp(-since / 0.03) * np.sin(100.0 * np.pi * since)

    expected = [0.0, 0.0, 40.0 * swing(0.005), 40.0 * swing(0.01), 40.0 * swing(0.03) - 20.0 * swing(0.02)]
    assert swung[:, 3] == pytest.approx(np.array(expected), abs=1e-12)
    assert np.all(swung[:, :3] == 0.0) and np.all(nes == 0.0)


def test_what_may_stand_together():
    """A ring of aluminium or steel is round, no blow has two laws, what is left of a blow needs one that is over."""
    for name in ("unknown_eddy_ring", "unknown_poled_disk"):
        needs_a_round_wall(name)
    assert may_stand_together(("table_tilt", "unknown_leaking_liner"), "square", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_wound_wire"), "round", "sine")
    alone = ["unknown_leaking_liner", "unknown_swollen_band", "unknown_rubbery_card"]
    needs_a_blow_that_is_over([*alone, *(cause.name for cause in UNTOLD if cause.stage == "impact")])
