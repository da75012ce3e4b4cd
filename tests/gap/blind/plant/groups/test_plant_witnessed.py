"""What people have found, late, in rigs of their own: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.clock import exposed_s, latest_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import bulged
from analysis.blind.recording.picture import by_the_second_camera, shaking_of
from analysis.blind.recording.views import DISK, draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    TIMES,
    G,
    film,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    of_group,
    rate_of,
    state_of,
    struck,
)

R = 0.01  # m: the disk
PLACES = ((0.0, 0.0), (0.02, 0.01), (0.004, -0.03), (-0.03, 0.02), (0.0395, 0.0))


def _pushed_down(height, x, y):
    """The push (m/s^2) of a hill of that height, in m^2/s^2."""
    step = 1e-6
    along_x = (height(x + step, y) - height(x - step, y)) / (2.0 * step)
    return -along_x, -(height(x, y + step) - height(x, y - step)) / (2.0 * step)


@pytest.mark.parametrize("bow", [14.0, -14.0])
def test_a_sheet_is_bowed_along_one_direction_only(bow):
    bowed, out = FREE._replace(bowed_per_s2=bow, bowed_rad=0.9), np.array([np.cos(0.9), np.sin(0.9)])
    for x, y in PLACES:
        push = _pushed_down(lambda x, y: -0.5 * bow * (np.array([x, y]) @ out) ** 2, x, y)
        assert rate_of(bowed, x=x, y=y, vx=0.3, spin=20.0) == pytest.approx((*push, 0.0), abs=1e-8)
    across = 0.03 * np.array([-out[1], out[0]])
    assert rate_of(bowed, x=across[0], y=across[1]) == pytest.approx(np.zeros(3), abs=1e-12)  # straight there
    assert rate_of(bowed, x=0.03 * out[0], y=0.03 * out[1])[:2] == pytest.approx(0.03 * bow * out)


def test_a_fan_drags_the_disk_towards_its_own_wind():
    """A disk that goes with the wind feels none, one at rest is pushed, and it comes to the wind's own velocity."""
    wind = 2.5 * np.array([np.cos(2.0), np.sin(2.0)])
    fan = FREE._replace(fan_per_m=0.2, fan_rad=2.0)
    for way in (np.zeros(2), wind, -wind, np.array([1.0, 0.4])):
        against = way - wind
        push = -0.2 * np.hypot(*against) * against
        assert rate_of(fan, vx=way[0], vy=way[1], spin=30.0) == pytest.approx((*push, 0.0), abs=1e-12)
        # The Host's own motion is nothing to the air of the room.
        assert rate_of(fan, 0.3, HOST, vx=way[0], vy=way[1]) == pytest.approx((*push, 0.0), abs=1e-12)
    assert rate_of(FREE, vx=1.0) == pytest.approx(np.zeros(3))


def test_a_magnetised_ring_draws_a_disk_to_its_two_poles():
    """The force of an energy, so that no way round wins any."""
    poles = FREE._replace(ring_poles_m_per_s2=1.5, ring_poles_rad=0.6)

    def height(x, y):
        radius, azimuth = np.hypot(x, y), np.arctan2(y, x)
        return -1.5 * 0.04 / 6.0 * (radius / 0.04) ** 6 * np.cos(azimuth - 0.6) ** 2

    for x, y in PLACES:
        assert rate_of(poles, x=x, y=y, vx=0.5) == pytest.approx((*_pushed_down(height, x, y), 0.0), abs=1e-7)
    for azimuth, pull in ((0.6, 1.5), (0.6 + np.pi, 1.5), (0.6 + 0.5 * np.pi, 0.0)):
        out = np.array([np.cos(azimuth), np.sin(azimuth)])
        assert rate_of(poles, x=0.04 * out[0], y=0.04 * out[1])[:2] == pytest.approx(pull * out, abs=1e-12)


def _of_the_series(name, number, runs=5, seed=2):
    """What each run of a series with a cause has of a number of the plant."""
    draft = draft_series(name, 1.0, np.random.default_rng(seed), runs)
    return np.array([getattr(physics_of_run(draft, run, DRIVE, 1.2), number) for run in range(runs)])


def test_a_floor_wears_in_its_middle_from_run_to_run():
    course = _of_the_series("unknown_wearing_middle", "wearing")
    assert course == pytest.approx(course[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 0.45 < abs(course[-1]) < 1.15 * 0.45
    senses = [_of_the_series("unknown_wearing_middle", "wearing", seed=seed)[-1] for seed in range(8)]
    assert min(senses) < 0.0 < max(senses)
    for wears in (-0.4, 0.4):
        for far in (0.0, 0.015, 0.038):
            got = rate_of(SLIDING._replace(wearing=wears), x=-far, vx=1.0)[0]
            assert got == pytest.approx(-G * (1.0 + wears * np.exp(-0.5 * (far / 0.015) ** 2)))
    assert rate_of(SLIDING._replace(wearing=-1.3), vx=1.0)[0] == pytest.approx(0.0)  # no floor pushes


def test_blows_shed_powder_along_the_wall():
    powder = SLIDING._replace(powder=0.8)
    for blows, shed in ((0, 0.0), (10, 1.0 - np.exp(-1.0)), (1000, 1.0)):
        for far, share in ((0.0, 0.0), (0.02, 1.0 / 16.0), (0.04, 1.0)):
            got = rate_of(powder, x=far * np.cos(1.0), y=far * np.sin(1.0), vx=1.0, count=blows)[0]
            assert got == pytest.approx(-G * (1.0 + 0.8 * share * shed))


def test_a_coil_draws_the_disk_down_whichever_way_its_current_flows():
    """Twice in a period of the drive; the mean over it is half of the most."""
    drawn, shares = SLIDING._replace(drawn_down=0.4), []
    for time in TIMES:
        position, velocity, acceleration = host_pose(time, HOST)
        got = rate_of(drawn, time, HOST, x=position[0], y=0.02, vx=velocity[0], vy=1.0)[1]
        shares.append(-got / G - 1.0)
        assert shares[-1] == pytest.approx(0.4 * (acceleration[0] / 78.5) ** 2)
    most = 0.4 * (0.0164 * DRIVE**2 / 78.5) ** 2
    assert np.mean(shares) == pytest.approx(0.5 * most) and max(shares) == pytest.approx(most, rel=0.01)
    assert rate_of(drawn, vy=1.0)[1] == pytest.approx(-G)  # a Host at rest


def test_screws_are_tightened_between_two_runs():
    course = _of_the_series("unknown_retightened_screws", "retightened", 12)
    first = int(np.argmax(course > 0.0))
    assert 4 <= first <= 8 and course == pytest.approx(course[-1] * np.where(np.arange(12) < first, -1.0, 1.0))
    for share in (-0.1, 0.1):
        for speed in (0.2, 1.5):
            got = head_on(BARE._replace(retightened=share), speed)[0]
            assert got == pytest.approx(-0.7 * (1.0 + share) * speed)
    assert head_on(BARE._replace(retightened=0.9))[0] == pytest.approx(-0.98)  # no wall gives back all


def _rebound(p, azimuth, time):
    """Restitution of a blow straight at the wall."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    after = impact(time, state_of(x=0.04 * c, y=0.04 * s, vx=c, vy=s), p, STILL, np.zeros(2), 1.0)[0]
    return -(after[2] * c + after[3] * s)


def test_a_lamp_warms_one_side_of_the_wall_in_each_run():
    lamp = BARE._replace(lamp=0.4, lamp_rad=2.0)
    for azimuth in (2.0, 2.7, 2.0 + np.pi, 5.9):
        side = 0.5 * (1.0 + np.cos(azimuth - 2.0))
        for time, passed in ((-1e-3, 0.0), (0.3, 0.25), (1.2, 1.0), (1.25, 1.0)):
            assert _rebound(lamp, azimuth, time) == pytest.approx(0.7 - 0.4 * side * passed)


def test_a_rim_picks_up_the_oil_of_the_floor():
    """Where it sticks nothing changes; beyond the Coulomb limit it takes what is left of it."""
    oiled = BARE._replace(picked_up=0.8)
    for slid in (0.0, 0.03, 1.0):
        left = 1.0 - 0.8 * (1.0 - np.exp(-slid / 0.03))
        found = {"way": 0.7 + slid, "way_before": 0.7, "count": 2}
        lost = R * 60.0 - head_on(oiled, 0.1, 60.0, **found)[1]
        assert lost == pytest.approx(3.0 * 0.15 * left * 1.7 * 0.1)
        assert head_on(oiled, 1.0, 1.0, **found) == pytest.approx(head_on(BARE, 1.0, 1.0))
    assert head_on(oiled._replace(picked_up=1.5), 0.1, 60.0, way=9.0)[1] == pytest.approx(
        0.6 - 3.0 * 0.15 * 0.02 * 0.17, abs=1e-6
    )


def test_oil_stays_back_as_the_host_is_accelerated():
    """At the wall that comes towards the disk it piles up; a wall that stands still has its mean."""
    oil = BARE._replace(sloshing=0.6)
    for time in TIMES[::7]:
        left = 1.0 + 0.6 * host_pose(time, HOST)[2][0] / 78.5
        lost = R * 90.0 - head_on(oil, 0.1, 90.0, time, HOST)[1]
        assert lost == pytest.approx(3.0 * 0.15 * left * 1.7 * 0.1)
    assert head_on(oil, 0.1, 90.0) == pytest.approx(head_on(BARE, 0.1, 90.0))
    coming = TIMES[np.argmin([host_pose(time, HOST)[2][0] for time in TIMES])]
    dry, wet = (0.9 - head_on(p, 0.1, 90.0, coming, HOST)[1] for p in (BARE, oil))
    assert 0.0 < wet < 0.5 * dry


def test_glue_cures_in_the_course_of_a_series():
    course = _of_the_series("unknown_curing_glue", "cured")
    assert course == pytest.approx(course[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 0.9 < course[-1] < 1.15 * 0.9  # never the other way
    for cured, back in ((-0.6, 0.18), (0.6, 0.72), (-1.4, 0.0), (4.0, 0.95)):  # never more than it can
        assert head_on(BARE._replace(cured=cured), spin=20.0)[1] == pytest.approx(-back * 0.2, abs=1e-12)
    assert head_on(BARE._replace(cured=0.6), 0.1, 90.0) == pytest.approx(head_on(BARE, 0.1, 90.0))  # it slips


def test_no_blow_leaves_more_energy():
    for changed in (
        {"retightened": 0.2},
        {"lamp": 0.5, "lamp_rad": 1.0},
        {"picked_up": 1.2},
        {"sloshing": 1.4},
        {"cured": 1.2},
        {"pressed_m": 4e-4},
        {"play_m": 4e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_blow_leaves_a_thin_ring_oval():
    ring = BARE._replace(pressed_m=3e-4)
    for azimuth in np.arange(0.05, 6.2, 0.37):
        at = {"x": 0.04 * np.cos(azimuth), "y": 0.04 * np.sin(azimuth)}
        gap, nx, ny = wall_gap(0.1, state_of(**at, normal=0.8, count=3), ring, STILL)
        assert gap == pytest.approx(3e-4 * np.cos(2.0 * (azimuth - 0.8)), abs=2e-6)
        slope = (nx * at["y"] - ny * at["x"]) / (nx * at["x"] + ny * at["y"])
        assert slope == pytest.approx(-6e-4 * np.sin(2.0 * (azimuth - 0.8)) / 0.04, abs=2e-4)
        assert wall_gap(0.1, state_of(**at, normal=0.8), ring, STILL)[0] == pytest.approx(0.0, abs=1e-12)
    after = struck(ring, vy=0.4, normal=2.0, count=1)
    assert wall_gap(0.1, after, ring, STILL)[0] >= 0.0  # where it was struck it has given way


def test_two_blows_along_a_line_find_a_thin_ring_longer():
    """A disk that goes to and fro along one line meets the ring 0.3 mm farther out on either side from the second blow
    on."""
    start = np.array([0.03, 0.0, 1.0, 0.0, 0.0, 0.0])
    plain, thin = (
        run_plant(p, STILL, start, 0.45, np.random.default_rng(0)).impacts
        for p in (BARE._replace(restitution=0.9), BARE._replace(restitution=0.9, pressed_m=3e-4))
    )
    assert len(plain) == len(thin) == 5 and thin[0, 0] == pytest.approx(plain[0, 0])
    later = (thin[:, 0] - plain[:, 0])[1:]
    ways = 3e-4 * np.array([1.0, 2.0, 2.0, 2.0])  # each flight's own; the first begins at the round ring
    assert np.diff(np.append(0.0, later)) == pytest.approx(ways / 0.9 ** np.arange(1, 5), rel=1e-3)


def test_a_ring_with_play_lies_at_the_stop_that_the_drive_leaves_it_at():
    seat = BARE._replace(play_m=3e-4)
    for time in TIMES:
        position, velocity, acceleration = host_pose(time, HOST)
        off = -3e-4 * np.tanh(acceleration[0] / 20.0)
        for side in (1.0, -1.0):
            state = state_of(x=position[0] + side * 0.04, vx=velocity[0] + side)
            gap, nx, ny = wall_gap(time, state, seat, HOST)
            assert gap == pytest.approx(side * off, abs=1e-12)
            later = -3e-4 * np.tanh(host_pose(time + 1e-6, HOST)[2][0] / 20.0)
            met = contact_velocity(time, state, seat, HOST, nx, ny)
            assert met[0] == pytest.approx(1.0 - side * (later - off) / 1e-6, abs=1e-4)
        across = wall_gap(time, state_of(x=position[0], y=0.04), seat, HOST)
        assert across[0] == pytest.approx(0.04 - np.hypot(0.04, off), abs=1e-12)
    assert wall_gap(0.1, state_of(x=0.04), seat, STILL)[0] == pytest.approx(0.0, abs=1e-12)
    off = np.array([abs(wall_gap(t, state_of(x=host_pose(t, HOST)[0][0] + 0.04), seat, HOST)[0]) for t in TIMES])
    assert np.mean(off > 0.9 * 3e-4) > 0.7  # it is hardly ever in between


def test_an_exposure_goes_with_the_light_on_the_disk():
    errors, out = ViewErrors(exposure_s=2e-4, exposure_rad=0.7), np.array([np.cos(0.7), np.sin(0.7)])
    place = np.array([0.0 * out, 0.04 * out, -0.02 * out, 0.03 * np.array([-out[1], out[0]]), 0.2 * out, -0.2 * out])
    late = exposed_s(place, errors)
    assert late == pytest.approx(2e-4 * np.array([0.0, 1.0, -0.5, 0.0, 1.5, -1.5]), abs=1e-18)
    assert late.max() <= latest_s(errors, 1.2) and not exposed_s(place, ViewErrors()).any()
    moved, plain = (film(name, 1.0)[0].loc["VW2"] for name in ("unknown_exposure_control", "none"))
    off = (moved - plain).dropna()
    markers = off.index.get_level_values("marker")
    assert off[markers.str.startswith("G")].abs().max().max() < 1e-9  # what stands still is where it was
    assert off[markers == "H1"].std().max() > 0.1


def test_a_tripods_head_sinks_from_run_to_run():
    errors = view_of(draft_series("unknown_sinking_head", 1.0, np.random.default_rng(2), 5))
    assert errors.head_px == pytest.approx(errors.head_px[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    view, pixels = draw_views(np.random.default_rng(1))[1], np.random.default_rng(2).uniform(500.0, 2500.0, (4, 12, 2))
    for run in range(5):
        shaking = shaking_of(np.zeros(4), HOST, np.zeros(0), np.zeros((0, 2)), run, errors)
        off = by_the_second_camera(pixels.copy(), view, errors, shaking) - pixels
        assert off[..., 0] == pytest.approx(np.zeros((4, 12)), abs=1e-9)
        assert off[..., 1] == pytest.approx(np.full((4, 12), errors.head_px[run]))
    senses = [
        view_of(draft_series("unknown_sinking_head", 1.0, np.random.default_rng(seed), 3)).head_px[0]
        for seed in range(8)
    ]
    assert min(senses) < 0.0 < max(senses)


def test_a_lid_that_bulges_shows_the_disk_too_far_out():
    rng = np.random.default_rng(3)
    points, host = rng.uniform(-0.04, 0.04, (3, 12, 3)), rng.uniform(-0.02, 0.02, (3, 4))
    seen = bulged(points, host, ViewErrors(lid_bulge=0.005))
    middle = host[:, None, :2]
    assert seen[:, DISK, :2] - middle == pytest.approx(1.005 * (points[:, DISK, :2] - middle))
    others = np.setdiff1d(np.arange(12), DISK)
    assert np.array_equal(seen[:, others], points[:, others]) and np.array_equal(seen[..., 2], points[..., 2])


def test_what_they_stand_beside():
    """Two are of a round ring, what goes by the last blow needs one that is over; no air drags twice."""
    for name in ("unknown_magnetised_ring", "unknown_pressed_ring"):
        needs_a_round_wall(name)
    impacts = [cause.name for cause in of_group("witnessed") if cause.stage == "impact"]
    needs_a_blow_that_is_over(["unknown_pressed_ring", *impacts])
    assert may_stand_together(("finite_contact_time", "unknown_bowed_sheet"), "square", "chirp")
    assert may_stand_together(("wall_ellipticity", "unknown_seat_play"), "cylinder", "random")
    assert not may_stand_together(("air_drag", "unknown_cooling_fan"), "round", "sine")
    assert not may_stand_together(("restitution_drift", "unknown_retightened_screws"), "round", "sine")
