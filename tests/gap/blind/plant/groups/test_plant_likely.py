"""What an experienced experimenter would call likely: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import on_the_board
from analysis.blind.recording.picture import by_the_first_camera, by_the_second_camera, shaking_of
from analysis.blind.recording.views import draw_views
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
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    random_states,
    rate_of,
    short_runs,
    state_of,
    struck,
)

RUNS = 9


def _numbers(name, *fields, seed=2, runs=RUNS):
    """Of every run (runs, fields), and what the truth says."""
    draft = draft_series(name, 1.0, np.random.default_rng(seed), runs)
    of_runs = [physics_of_run(draft, run, DRIVE, 1.2) for run in range(runs)]
    return np.array([[getattr(p, field) for field in fields] for p in of_runs]), draft.parameters[name]


def _view(name, seed=2, runs=RUNS):
    return view_of(draft_series(name, 1.0, np.random.default_rng(seed), runs))


def _both_senses(name, value):
    """Some series have it one way and some the other."""
    found = [value(_view(name, seed, 3)) for seed in range(8)]
    assert min(found) < 0.0 < max(found)


def test_a_table_is_levelled_anew_between_two_runs():
    leans, truth = _numbers("unknown_relevelled_table", "levelled_x_m_per_s2", "levelled_y_m_per_s2")
    first = int(truth["from_run"]) - 1
    assert 0.3 * RUNS < first < 0.7 * RUNS
    at_last = np.array([truth["levelled_x_m_per_s2"], truth["levelled_y_m_per_s2"]])
    assert leans[first:] == pytest.approx(np.tile(at_last, (RUNS - first, 1)))
    assert leans[:first] == pytest.approx(np.tile(-at_last, (first, 1)))
    table = FREE._replace(levelled_x_m_per_s2=0.2, levelled_y_m_per_s2=-0.1)
    assert rate_of(table, x=0.02, vx=1.0, spin=20.0) == pytest.approx((0.2, -0.1, 0.0))


def test_a_cone_slopes_by_as_much_everywhere():
    for size in (0.4, -0.4):
        cone = FREE._replace(cone_m_per_s2=size)
        for radius, azimuth in ((0.01, 0.3), (0.025, 2.0), (0.039, 4.4)):
            out = np.array([np.cos(azimuth), np.sin(azimuth)])
            for time in TIMES[::20]:
                position, velocity, _ = host_pose(time, HOST)
                at = {"x": position[0] + radius * out[0], "y": radius * out[1], "vx": velocity[0], "spin": 9.0}
                push = size * radius / np.hypot(radius, 0.002)
                assert rate_of(cone, time, HOST, **at) == pytest.approx((*(push * out), 0.0), abs=1e-9)
    assert rate_of(cone) == pytest.approx(np.zeros(3))
    # What the disk wins on its way out it loses on its way in: the slope has a height.
    motion = run_plant(cone, STILL, np.array([-0.03, 0.004, 0.8, 0.1, 0.0, 0.0]), 0.06, np.random.default_rng(0))
    x, y, vx, vy = motion.nodes[:, 1:5].T
    whole = 0.5 * (vx**2 + vy**2) + 0.4 * np.sqrt(x**2 + y**2 + 0.002**2)
    assert len(motion.impacts) == 0 and np.ptp(vx) > 1e-3 and whole == pytest.approx(np.full(len(x), whole[0]))


def test_air_is_humid_once_in_the_course_of_a_series():
    shares, truth = _numbers("unknown_humid_day", "humid")
    expected = truth["humid"] * np.sin(2.0 * np.pi * np.arange(RUNS) / RUNS + truth["phase_rad"])
    assert shares[:, 0] == pytest.approx(expected) and shares.mean() == pytest.approx(0.0, abs=1e-12)
    for share in (0.25, -0.2):
        assert rate_of(SLIDING._replace(humid=share), vx=0.8)[0] == pytest.approx(-G * (1.0 + share), rel=1e-5)


def test_blows_glaze_the_floor_or_strew_grit_on_it():
    glazed, strewn = SLIDING._replace(glazed=0.04), SLIDING._replace(strewn=0.03)
    for blows in (0, 1, 10, 60):
        assert rate_of(glazed, vx=0.8, blows=blows)[0] == pytest.approx(-G * np.exp(-0.04 * blows), rel=1e-5)
        assert rate_of(strewn, vx=0.8, blows=blows)[0] == pytest.approx(-G * (1.0 + 0.03 * blows), rel=1e-5)
    # A mere touch is no blow.
    for speed, count in ((1.0, 4), (0.2, 3)):
        assert struck(BARE, vx=speed, blows=3)[PLACE.index("blows")] == count


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in ({"humid": -0.4}, {"glazed": 0.06}, {"strewn": 0.05}):
        p = SLIDING._replace(**changed)
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, p, STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] < 0.0


def test_a_wall_loses_evenly_with_the_speed():
    wall = BARE._replace(straight_s_per_m=0.1)
    for speed in (0.2, 0.8, 1.5, 3.0):
        assert head_on(wall, speed)[0] == pytest.approx(-speed * (0.7 - 0.1 * (speed - 1.5)))
    assert head_on(wall._replace(straight_s_per_m=0.5), 0.1)[0] == pytest.approx(-0.098)  # none gives back all


def test_a_washer_yields_beyond_a_speed():
    washer = BARE._replace(yielded=0.25)
    for speed in (0.2, 1.0, 1.29):
        assert head_on(washer, speed)[0] == pytest.approx(-0.7 * speed)
    for speed in (1.31, 2.0, 4.0):
        assert head_on(washer, speed)[0] == pytest.approx(-0.7 * speed * (1.3 / speed) ** 0.25)


def test_a_ring_warms_up_in_the_first_runs():
    shares, truth = _numbers("unknown_warmed_up_ring", "warmed_up")
    course = truth["warmed_up"] * np.exp(-np.arange(RUNS) / 3.0)
    assert shares[:, 0] == pytest.approx(course - course.mean())
    senses = [_numbers("unknown_warmed_up_ring", "warmed_up", seed=seed, runs=3)[0][0, 0] for seed in range(8)]
    assert min(senses) < 0.0 < max(senses)
    for share in (0.1, -0.2):
        assert head_on(BARE._replace(warmed_up=share), 1.2)[0] == pytest.approx(-1.2 * 0.7 * (1.0 + share))
    assert head_on(BARE._replace(warmed_up=0.9), 1.0)[0] == pytest.approx(-0.98)


def test_no_blow_leaves_more_energy():
    for changed in ({"straight_s_per_m": 0.12}, {"yielded": 0.35}, {"warmed_up": 0.3}, {"receding_m": 2e-5}):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_ring_lies_elsewhere_in_each_run():
    places, truth = _numbers("unknown_rebolted_ring", "rebolted_x_m", "rebolted_y_m")
    assert np.hypot(*places.T) == pytest.approx(np.full(RUNS, truth["rebolted_m"]))
    assert places.mean(axis=0) == pytest.approx((0.0, 0.0), abs=1e-12)
    turns = np.diff(np.unwrap(np.arctan2(*places.T[::-1])))
    assert np.ptp(turns) > 0.5  # in no order
    ring = BARE._replace(rebolted_x_m=2e-4, rebolted_y_m=-1e-4)
    for azimuth in (0.0, 1.1, 4.0):
        c, s = np.cos(azimuth), np.sin(azimuth)
        gap, nx, ny = wall_gap(0.1, state_of(x=0.039 * c, y=0.039 * s), ring, STILL)
        assert gap == pytest.approx(0.04 - np.hypot(0.039 * c - 2e-4, 0.039 * s + 1e-4))
        assert (nx, ny) == pytest.approx((c, s), abs=1e-2)


def test_each_blow_takes_as_much_off_the_wall():
    ring = BARE._replace(receding_m=2e-5)
    for blows in (0, 1, 25):
        gap, nx, ny = wall_gap(0.1, state_of(x=0.0, y=0.039, blows=blows), ring, STILL)
        assert gap == pytest.approx(0.001 + 2e-5 * (blows - 8)) and (nx, ny) == pytest.approx((0.0, 1.0))
    post = ring._replace(obstacle_m=0.018)
    assert wall_gap(0.1, state_of(x=0.02, blows=9), post, STILL)[0] == pytest.approx(0.002)  # a cylinder loses nothing
    assert first_contacts(ring)[0] == pytest.approx([0.01 - 8 * 2e-5], abs=1e-6)
    # Not even of a disk that is pressed onto it: that only touches.
    pressed = ring._replace(tilt_x_m_per_s2=40.0, restitution=0.3)
    motion = run_plant(pressed, STILL, np.array([0.03, 0.0, 1.0, 0.0, 0.0, 0.0]), 0.1, np.random.default_rng(0))
    hard = np.sum(motion.impacts[:, 1] > 0.3)
    assert motion.nodes[-1, 1] == pytest.approx(0.04 + 2e-5 * (hard - 8), abs=2e-6)


def test_a_clock_drifts_from_run_to_run():
    errors = _view("unknown_drifting_oscillator")
    most = errors.oscillator[-1]
    assert errors.oscillator == pytest.approx(most * np.linspace(-1.0, 1.0, RUNS)) and 1.6e-3 < abs(most) < 2.4e-3
    _both_senses("unknown_drifting_oscillator", lambda view: view.oscillator[-1])
    # A quarter more frames in the same time: every fifth is what every fourth of an even clock is.
    outline = outline_series("none", 1.0, np.random.default_rng(4), 2, "white")
    with short_runs():
        plain = run_outline(outline, np.random.default_rng(5), 8.0).states
        outline.draft.view["oscillator"] = (0.25, 0.0)
        fast = run_outline(outline, np.random.default_rng(5), 8.0).states
    frames = len(fast["state01"])
    assert np.array_equal(fast["H01"], plain["H01"])
    every = np.arange(0, min(frames, len(plain["state01"]) * 5 // 4 - 5) // 5)
    assert fast["state01"][5 * every] == pytest.approx(plain["state01"][4 * every], abs=1e-9)


def test_a_board_is_stretched_along_one_direction():
    points = np.random.default_rng(3).uniform(-0.05, 0.05, (3, 12, 3))
    seen = on_the_board(points, ViewErrors(board_stretch=0.004, board_rad=0.7))
    along, across = np.array([np.cos(0.7), np.sin(0.7)]), np.array([-np.sin(0.7), np.cos(0.7)])
    assert seen[..., :2] @ along == pytest.approx(1.004 * points[..., :2] @ along)
    assert seen[..., :2] @ across == pytest.approx(points[..., :2] @ across)
    assert np.array_equal(seen[..., 2], points[..., 2])
    assert on_the_board(points, ViewErrors()) is points
    _both_senses("unknown_stretched_board", lambda view: view.board_stretch)


def test_a_board_is_bowed():
    points = np.random.default_rng(3).uniform(-0.05, 0.05, (3, 12, 3))
    seen = on_the_board(points, ViewErrors(board_bow=-0.003))
    square = np.sum(points[..., :2] ** 2, axis=-1, keepdims=True) / 0.05**2
    assert seen[..., :2] == pytest.approx(points[..., :2] * (1.0 - 0.003 * square))
    assert np.array_equal(seen[..., 2], points[..., 2])
    _both_senses("unknown_bowed_board", lambda view: view.board_bow)


def _off(index, run, errors):
    """How far one camera's picture lies off in a run (frames, markers, 2)."""
    view = draw_views(np.random.default_rng(1))[index]
    pixels, time_s = np.random.default_rng(2).uniform(500.0, 2500.0, (4, 12, 2)), np.zeros(4)
    shaking = shaking_of(time_s, HOST, np.zeros(0), np.zeros((0, 2)), run, errors)
    if index == 0:
        return by_the_first_camera(pixels.copy(), time_s, view, shaking, errors) - pixels
    return by_the_second_camera(pixels.copy(), view, errors, shaking) - pixels


def test_a_camera_is_jogged_once():
    errors = _view("unknown_jogged_camera")
    assert 1 <= errors.jogged_from < RUNS
    to = errors.jogged_px * np.array([np.cos(errors.jogged_rad), np.sin(errors.jogged_rad)])
    for run in range(RUNS):
        expected = np.tile(to if run >= errors.jogged_from else 0.0 * to, (4, 12, 1))
        assert _off(1, run, errors) == pytest.approx(expected, abs=1e-9)
        assert not _off(0, run, errors).any()


def test_a_camera_warms_up_again():
    errors = _view("unknown_warming_camera")
    to = errors.warm_px * np.array([np.cos(errors.warm_rad), np.sin(errors.warm_rad)])
    for run in range(RUNS):
        assert _off(0, run, errors) == pytest.approx(np.tile(to * np.exp(-run / 3.0), (4, 12, 1)), abs=1e-9)
        assert not _off(1, run, errors).any()


def test_a_picture_leans():
    view, errors = draw_views(np.random.default_rng(1))[1], ViewErrors(skewed=0.006)
    pixels = np.random.default_rng(2).uniform(500.0, 2500.0, (4, 12, 2))
    off = _off(1, 0, errors)
    assert off[..., 0] == pytest.approx(0.006 * (pixels[..., 1] - view.centre_px[1]))
    assert not off[..., 1].any() and not _off(0, 0, errors).any()
    _both_senses("unknown_skewed_picture", lambda view: view.skewed)


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; a clock is known by a drive that was
    asked for; a wall that recedes with each blow needs blows that are over."""
    needs_a_blow_that_is_over(["unknown_receding_wall", "unknown_straight_loss", "unknown_warmed_up_ring"])
    for listed, ours in (
        ("friction_drift", "unknown_humid_day"),
        ("friction_drift", "unknown_glazed_floor"),
        ("friction_drift", "unknown_strewn_grit"),
        ("speed_dependent_restitution", "unknown_straight_loss"),
        ("speed_dependent_restitution", "unknown_yield_speed"),
        ("restitution_drift", "unknown_warmed_up_ring"),
        ("frame_rate_error", "unknown_drifting_oscillator"),
        ("length_scale_error", "unknown_stretched_board"),
        ("length_scale_error", "unknown_bowed_board"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("wall_centre_offset", "unknown_rebolted_ring"), "triangle", "random")
    assert may_stand_together(("table_tilt", "unknown_receding_wall"), "square", "chirp")
    assert not may_stand_together(("table_tilt", "unknown_drifting_oscillator"), "round", "random")
