"""The floor's friction and load: each cause does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.flight.friction_by_history import friction_of_flight
from analysis.blind.plant.host import host_pose
from analysis.blind.series import outline_series, run_outline
from tests.gap.blind.plant.rig import DRIVE, HOST, SLIDING, STILL, TIMES, G, rate_of

R, INERTIA = 0.01, 0.5 * 0.01**2  # m, m^2


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        ({"canted_rad": 0.12}, {"vx": 1.0}, (-2.943 * np.cos(0.12), -2.943 * np.sin(0.12), 0.0)),
        ({"warped": 0.3, "warped_rad": 0.5}, {"vx": 1.0, "angle": -0.5}, (-2.943 * 1.3, 0.0, 0.0)),
        ({"warped": 0.3, "warped_rad": 0.5}, {"vy": 1.0, "angle": -0.5}, (0.0, -2.943 * 0.7, 0.0)),
    ],
)
def test_what_turns_the_friction_by_its_formulas(changed, state, expected):
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-4)


def test_a_disk_that_slides_as_fast_as_its_rim_curls_most():
    """Rim speed over speed r: 2 r / (1 + r^2) of the stated share of mu g, across the slip."""
    for spin in (30.0, 100.0, 300.0):
        across = rate_of(SLIDING._replace(curling=0.2), vx=1.0, spin=spin)[1]
        ratio = 0.01 * spin
        assert across == pytest.approx(-0.2 * 2.943 * 2 * ratio / (1 + ratio**2), abs=1e-6)


def test_friction_that_lags_comes_in_exponentially():
    """From rest of the bristles: v = v0 - mu g (t - lag (1 - exp(-t / lag)))."""
    lag, late = 0.004, 0.012
    start = np.array([-0.03, 0.0, 0.9, 0.0, 0.0, 0.0])
    motion = run_plant(SLIDING._replace(lag_s=lag), STILL, start, 0.02, np.random.default_rng(0))
    speed = state_at(motion, np.array([late - 2e-3]))[0, 2]
    assert speed == pytest.approx(0.9 - 2.943 * (late - lag * (1 - np.exp(-late / lag))), abs=2e-6)


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        # all weight on the rim: the same friction as it slides, half as much torque again as it spins, by 0.8 of it 0.4
        ({"burr": 0.8}, {"vx": 1.0}, (-G, 0.0, 0.0)),
        ({"burr": 1.0}, {"spin": 50.0}, (0.0, 0.0, -G * 0.01 / 5e-5)),
        ({"burr": 0.8}, {"spin": -50.0}, (0.0, 0.0, 1.4 * G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # brushed marks along each other, across, and in between
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vx": 1.0, "angle": 0.3}, (-1.4 * G, 0.0, 0.0)),
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vy": 1.0, "angle": 0.3 + np.pi / 2}, (0.0, -0.6 * G, 0.0)),
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vy": 1.0, "angle": 0.3 - np.pi / 4}, (0.0, -G, 0.0)),
        # tossed up by a blow at 1.5 m/s 15 ms ago for 18.3 ms, then landing for as long, then as ever
        *(
            ({"toss": 0.06}, {"vx": 1.0, "impact_s": -s, "approach": 1.5}, (-load * G, 0.0, 0.0))
            for s, load in ((0.015, 0.0), (0.02, 2.0), (0.036, 2.0), (0.0375, 1.0))
        ),
        ({"toss": 0.06}, {"vx": 1.0, "impact_s": -0.015, "approach": 0.5}, (-G, 0.0, 0.0)),
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
def test_how_the_disk_stands_and_what_it_slides_on(changed, state, expected):
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-3)


def test_a_burr_has_the_friction_of_a_circle():
    """The mean over a thousand points of a rim that slides and spins, against the plant's few."""
    burr = SLIDING._replace(burr=1.0)
    azimuth = 2.0 * np.pi * (np.arange(1000) + 0.5) / 1000
    rim = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    for spin in (10.0, 60.0, 250.0):
        slip = [0.8, 0.3] + 0.01 * spin * np.column_stack([-rim[:, 1], rim[:, 0]])
        slip /= np.hypot(*slip.T)[:, None]
        force, torque = slip.mean(axis=0), np.mean(rim[:, 0] * slip[:, 1] - rim[:, 1] * slip[:, 0])
        got = rate_of(burr, vx=0.8, vy=0.3, spin=spin)
        assert got[:2] == pytest.approx(-G * force, abs=0.01 * G)
        assert got[2] == pytest.approx(-G * torque * 0.01 / 5e-5, abs=0.01 * G * 0.01 / 5e-5)


def test_a_grain_under_the_disk_drags_where_it_stands():
    """Sliding along x, the grain at 7 mm, 90 degrees from the slip, bears 0.35 of the weight: its friction turns the
    disk. Spinning only, its friction pushes the disk across its arm."""
    grain = SLIDING._replace(grain=0.35, grain_rad=0.5, inertia_factor=0.5)
    turning = 0.35 * G * 0.007 / 5e-5
    assert rate_of(grain, vx=1.0, angle=np.pi / 2 - 0.5) == pytest.approx((-G, 0.0, turning), abs=1e-3)
    assert rate_of(grain, vx=1.0, angle=-0.5) == pytest.approx((-G, 0.0, 0.0), abs=1e-3)
    spinning = -(0.65 * 2.0 / 3.0 * 0.01 + 0.35 * 0.007) * G / 5e-5
    assert rate_of(grain, spin=50.0, angle=-0.5) == pytest.approx((0.0, -0.35 * G, spinning), abs=1e-3)


def test_marks_and_a_track_around_the_centre():
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


def test_bristles_and_a_bead_of_oil():
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


def test_oil_a_bevelled_edge_and_a_guide_that_rumbles():
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


@pytest.mark.further
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


def test_a_floor_that_stays_behind_the_ring_pulls_the_disk_its_own_way():
    """The disk at rest in the room over a floor that has 0.4 of the Host's speed, and one that crosses it."""
    host = 0.0164 * DRIVE * np.cos(2.0)
    loose = SLIDING._replace(loose_floor=0.6)
    assert rate_of(loose, 0.0, HOST) == pytest.approx((G * np.sign(host), 0.0, 0.0), abs=1e-6)
    assert rate_of(loose, 0.0, HOST, vx=0.4 * host, vy=1.0) == pytest.approx((0.0, -G, 0.0), abs=1e-6)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_a_pitching_floor_presses_in_proportion_to_place_times_acceleration(time):
    phase = DRIVE * time + 2.0
    x, v, a = 0.0164 * np.sin(phase), 0.0164 * DRIVE * np.cos(phase), -0.0164 * DRIVE**2 * np.sin(phase)
    share = 1.0 + 0.6 * 0.02 * a / (0.04 * 78.5)
    got = rate_of(SLIDING._replace(pitching=0.6), time, HOST, x=x + 0.02, y=0.01, vx=v, vy=1.0)
    assert got == pytest.approx((0.0, -share * G, 0.0), abs=1e-6)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_the_load_on_an_arc_is_the_second_rate_of_half_its_curvature_times_x_squared(time):
    phase = DRIVE * time + 2.0
    x, v = 0.0164 * np.sin(phase), 0.0164 * DRIVE * np.cos(phase)
    h = 1e-4
    heights = 0.5 * 2.8 * (0.0164 * np.sin(DRIVE * (time + h * np.array([-1.0, 0.0, 1.0])) + 2.0)) ** 2
    load = 9.81 + np.diff(heights, 2)[0] / h**2
    got = rate_of(SLIDING._replace(arc_per_m=2.8), time, HOST, x=x, vx=v, vy=1.0)
    assert got == pytest.approx((0.0, -0.3 * load, 0.0), abs=1e-3)


def test_an_arc_is_seen_from_the_side():
    """The Host's height, and the disk's upon it, is half of the curvature times its x squared."""
    outline = outline_series("unknown_leaf_springs", 1.0, np.random.default_rng(4), 1, "white")
    (poses,) = run_outline(outline, np.random.default_rng(5), 8.0).poses
    arc = outline.draft.plant["arc_per_m"]
    for seen in poses:
        assert seen.host[:, 3] == pytest.approx(0.5 * arc * seen.host[:, 0] ** 2, abs=1e-12)
        assert np.array_equal(seen.nes[:, 2], seen.host[:, 3])
    assert 2e-4 < np.abs(poses[0].host[:, 3]).max() < 6e-4


def test_a_tossed_disk_loses_no_friction_but_has_it_later():
    """From a blow at 0.9 m/s on, 30 ms later it is as fast as any other, and 3.2 mm farther on."""
    start = np.array([0.031, 0.0, 0.9, 0.0, 0.0, 0.0])
    paths = []
    for toss in (0.0, 0.06):
        p = SLIDING._replace(restitution=0.8, toss=toss, wall_friction=0.0)
        motion = run_plant(p, STILL, start, 0.06, np.random.default_rng(0))
        late, approach, _ = motion.impacts[0]
        paths.append(state_at(motion, np.array([late + 0.03]))[0])
    up_s = 2.0 * 0.06 * approach / 9.81
    assert paths[1][2] == pytest.approx(paths[0][2], abs=2e-3)  # a step of the integrator's at either edge
    assert paths[0][0] - paths[1][0] == pytest.approx(G * up_s**2, abs=2e-5)


def test_friction_by_speed_place_and_scratches():
    stribeck = SLIDING._replace(stribeck=0.6)
    for speed in (0.05, 0.75, 1.5):
        share = 1.0 + 0.6 * np.exp(-speed / 0.75)
        assert rate_of(stribeck, vy=-speed)[1] == pytest.approx(G * share, abs=1e-6)
    velocity = host_pose(0.1, HOST)[1][0]
    got = rate_of(stribeck, 0.1, HOST, vx=velocity + 0.75)[0]
    assert got == pytest.approx(-G * (1.0 + 0.6 * np.exp(-1.0)), abs=1e-6)  # over the Host's floor, not the room's
    for worn in (0.4, -0.4):
        for x, y, far in ((0.0, 0.0, 0.0), (0.015, 0.0, 1.0), (0.0, -0.03, 2.0)):
            got = rate_of(SLIDING._replace(worn=worn), x=x, y=y, vx=1.0)[0]
            assert got == pytest.approx(-G * (1.0 + worn * np.exp(-0.5 * far**2)), abs=1e-6)
    scratched = SLIDING._replace(scratched=0.3, scratched_rad=1.9)
    for way in (0.0, 1.9, 1.9 - np.pi, 1.9 + np.pi / 2, 4.0):
        got = rate_of(scratched, vx=np.cos(way), vy=np.sin(way))
        size = G * (1.0 + 0.3 * np.cos(2.0 * (way - 1.9)))
        assert got == pytest.approx((-size * np.cos(way), -size * np.sin(way), 0.0), abs=1e-5)
    spun = [rate_of(q, spin=50.0)[2] for q in (SLIDING, scratched)]
    assert spun[0] == pytest.approx(spun[1])  # where it only spins there is no direction


def test_friction_comes_back_after_a_blow():
    lifted = SLIDING._replace(lifted=0.6, lifted_s=0.05)
    for since in (0.0, 0.05, 0.2):
        got = rate_of(lifted, 0.3 + since, impact_s=0.3, vx=1.0)[0]
        assert got == pytest.approx(-G * (1.0 - 0.6 * np.exp(-since / 0.05)), abs=1e-6)
    assert rate_of(lifted, 0.3, vx=1.0)[0] == pytest.approx(-G, abs=1e-6)  # nothing was hit yet
    draft = draft_series("unknown_lifted_disk", 1.0, np.random.default_rng(1), 2)
    assert 0.03 <= draft.plant["lifted_s"] <= 0.05


def test_a_ring_brakes_the_spin_and_leaves_the_slide():
    foot = SLIDING._replace(ring_foot=0.3)
    spun = rate_of(foot, spin=50.0)
    assert spun == pytest.approx((0.0, 0.0, -1.3 * 2.0 / 3.0 * G * R / INERTIA), rel=1e-4)
    for numbers in ({"vx": 1.0}, {"vx": 0.5, "spin": -60.0}, {"vy": 0.1, "spin": 90.0}):
        plain, with_it = rate_of(SLIDING, **numbers), rate_of(foot, **numbers)
        assert with_it == pytest.approx(plain * [1.0, 1.0, 1.3], abs=1e-12)
