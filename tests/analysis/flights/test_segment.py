"""Kinks of a path, sustained contact, and how they cut a run into flights."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.flights.cutting.kinks import SIGNIFICANCE, find_kinks, reach_frames
from analysis.flights.cutting.pieces import flights_from_segments
from analysis.flights.cutting.segments import segment, without_doubles
from analysis.flights.cutting.sides import on_their_sides
from analysis.flights.cutting.wall_contact import find_contact

RATE = 800.0
SD = 1.5e-5


def path(kinks, frames=120, seed=1):
    """Piecewise flights (floor friction 2 m/s^2) whose velocity jumps at the given times (in frames) by the given
    steps.
    """
    t = np.arange(frames) / RATE
    x, y = 0.8 * t - 1.0 * t**2, -0.3 * t
    for when, dx, dy in kinks:
        late = np.maximum(t - when / RATE, 0)
        x, y = x + dx * late, y + dy * late
    rng = np.random.default_rng(seed)
    return t, x + SD * rng.standard_normal(frames), y + SD * rng.standard_normal(frames), np.full(frames, SD)


def kinks_of(t, x, y, sd):
    return find_kinks(t, x, y, sd, 0, len(t) - 1, SIGNIFICANCE, reach_frames(t))[:, 0].astype(int).tolist()


def test_no_kink_in_a_flight():
    for seed in range(20):
        assert kinks_of(*path([], seed=seed)) == []


def test_each_kink_at_its_gap():
    assert kinks_of(*path([(30.4, -1.5, 0.2), (70.6, 0.9, 0.9)])) == [30, 70]


def test_a_weak_kink_of_0_3_metres_per_second():
    """Twenty times the noise over a frame: what six sd of a hinge over eight frames come to."""
    for seed in range(10):
        found = kinks_of(*path([(50.5, 0.0, 0.3)], seed=seed))
        assert len(found) == 1 and abs(found[0] - 50) <= 1


def test_neighbours_four_frames_apart():
    """Both are found; a third between them may be (two flights too short to be fitted, left to the sequences)."""
    assert {50, 54} <= set(kinks_of(*path([(50.5, -1.5, 0.0), (54.5, 1.2, 0.0)])))


@pytest.mark.parametrize("rate", [100.0, 800.0, 5000.0])
def test_a_force_that_turns_is_no_kink_at_any_frame_rate(rate):
    """Friction of a quarter of gravity that turns within a frame, cameras of a micrometre: what the path bends by is no
    step of the velocity.
    """
    for seed in range(10):
        t = np.arange(60) / rate
        late = np.maximum(t - 30.3 / rate, 0.0)
        x = 0.8 * t - 1.25 * t**2 + 2.5 * late**2 + 1e-6 * np.random.default_rng(seed).standard_normal(60)
        assert kinks_of(t, x, 0.3 * t, np.full(60, 1e-6)) == []


@pytest.mark.parametrize("rate", [100.0, 400.0, 800.0, 5000.0])
def test_an_impact_of_0_3_metres_per_second_is_a_kink_at_any_frame_rate(rate):
    """A step of 0.5 m/s between flights that friction bends differently."""
    for seed in range(10):
        t = np.arange(60) / rate
        late = np.maximum(t - 30.5 / rate, 0.0)
        x = 0.8 * t - 1.25 * t**2 - 0.5 * late + 2.0 * late**2
        found = kinks_of(t, x + 5e-6 * np.random.default_rng(seed).standard_normal(60), 0.3 * t, np.full(60, 5e-6))
        assert len(found) == 1 and abs(found[0] - 30) <= (1 if rate < 2000 else 2)


def test_a_kink_far_from_the_wall_is_no_impact():
    t, x, y, sd = path([(30.4, -1.5, 0.2), (70.6, 0.9, 0.9)])
    place = np.column_stack([x, y])
    at_the_wall = np.tile([0.0595, 0.0], (len(t), 1))
    for early_gap, expected in ((-5e-4, [30, 70]), (-0.04, [70])):
        gap = np.where(np.arange(len(t)) < 50, early_gap, -5e-4)
        assert segment(t, place, sd, at_the_wall, gap, 0.0, 0.06).gaps.tolist() == expected


def test_missing_frames_are_bridged():
    t, x, y, sd = path([(50.5, -1.5, 0.0)])
    x[48:50] = np.nan
    found = kinks_of(t, x, y, sd)
    assert len(found) == 1 and 47 <= found[0] <= 50


def test_contact_needs_four_frames_and_outlasts_a_missing_one():
    distance = np.array([0.03, 0.04, 0.04, 0.04, np.nan, 0.04, 0.03, 0.04, 0.04, 0.03])
    contact = find_contact(distance - 0.04, 1e-4)
    assert contact.tolist() == [[1, 5]]


def test_flights_end_at_kinks_contact_and_holes():
    seen = np.ones(60, bool)
    seen[30:40] = False
    flights = flights_from_segments(seen, [9], np.array([[50, 59]]))
    assert [(f.first, f.last, f.joined) for f in flights] == [(0, 9, True), (10, 29, False), (40, 49, False)]


def test_a_piece_too_short_joins_nothing():
    flights = flights_from_segments(np.ones(30, bool), [9, 11], np.zeros((0, 2), np.int64))
    assert [(f.first, f.last, f.joined) for f in flights] == [(0, 9, False), (12, 29, False)]


def test_a_frame_exposed_across_a_fast_impact_is_set_aside_however_sharp_the_markers():
    """As in the rendered sample: 5 m/s of change of speed, a micrometre of noise, one frame 0.2 mm off both flights."""
    rng = np.random.default_rng(2)
    time = np.arange(30) / 800
    moment, sd = 15.01 / 800, np.where(np.arange(30) < 15, 1e-6, 3e-6)
    late = np.maximum(time - moment, 0.0)
    xy = np.column_stack([-1.97 * time + 5.14 * late, -0.72 * time + 1.2 * late]) + sd[:, None] * rng.standard_normal(
        (30, 2)
    )
    xy[15] += [2e-4, 5e-5]
    found = segment(time, xy, sd, np.tile([0.0495, 0.0], (30, 1)), np.full(30, -5e-4), 0.0, 0.05)
    assert found.smeared.tolist() == [15]
    assert len(found.gaps) == 1
    assert found.gaps[0] in (14, 15)


def hopping(approach_m_per_s: float, frames: int, seed: int):
    """At the wall of a Host of 40 mm that is pushed by 150 m/s^2: hops that lose a fifth of their speed each, then
    contact.

    Returns time, places (N, 2), sds, places from the Host, how far past the wall, from where a frame is near, the
    wall's size, and the hops' ends in frames.
    """
    rate, push, restitution, start = 5000.0, 150.0, 0.8, 0.0025
    t, ends, speed = np.arange(frames) / rate, [start * rate], approach_m_per_s
    out = np.full(frames, 0.04)
    before = t < start
    out[before] += speed * (t[before] - start) + 0.5 * push * (t[before] - start) ** 2 if speed else 0.0
    while speed > 0.02:
        speed *= restitution
        s = t - start
        during = (s > 0) & (s < 2 * speed / push)
        out[during] -= (speed * s - 0.5 * push * s**2)[during]
        start += 2 * speed / push
        ends.append(start * rate)
    noise = 2e-6 * np.random.default_rng(seed).standard_normal((frames, 2))
    relative = np.column_stack([out, np.zeros(frames)]) + noise
    host = np.column_stack([-0.5 * push * t**2, np.zeros(frames)])
    return t, relative + host, np.full(frames, 2e-6), relative, np.hypot(*relative.T) - 0.04, 1.5e-4, 0.04, ends


def test_hops_of_a_tenth_of_a_millimetre_are_flights_where_frames_are_fast():
    """Hops of 0.09 mm at the most, near enough to the wall to count as contact, of 8 and 11 frames."""
    for seed in range(5):
        *observed, ends = hopping(0.2, 120, seed)
        found = segment(*observed)
        for true in ends[:3]:
            assert np.min(np.abs(found.gaps + 0.5 - true)) <= 1.0
        assert len(found.contact) == 1
        assert ends[2] - 1 <= found.contact[0, 0] <= ends[5] and found.contact[0, 1] == 119


def test_rolling_along_the_wall_is_contact_from_its_first_frame():
    for seed in range(5):
        found = segment(*hopping(0.0, 120, seed)[:-1])
        assert found.contact.tolist() == [[0, 119]] and len(found.gaps) == 0


def test_two_kinks_beside_one_impact_become_the_one():
    """A kink that was taken a frame late leaves another before it: so found by the strongest first, under noise."""
    t, x, y, sd = path([(50.41, -0.5, 0.2)])
    double = np.array([[49.0, -0.3, 0.1, 8.0], [51.0, -0.3, 0.1, 9.0]])
    single = without_doubles(t, x, y, sd, double, reach_frames(t))
    assert single[:, 0].tolist() == [50.0]
    assert single[0, 1:3] == pytest.approx([-0.5, 0.2], abs=0.1)
    t, x, y, sd = path([(48.5, -0.5, 0.2), (51.5, 0.6, 0.3)])
    double = np.array([[48.0, -0.5, 0.2, 20.0], [51.0, 0.6, 0.3, 20.0]])
    assert np.array_equal(without_doubles(t, x, y, sd, double, reach_frames(t)), double)


def test_a_rolling_disk_that_smears_is_at_the_wall_all_along():
    """Frames of 0.15 mm of noise where the run's others have 0.02 mm: with the margin of these, one in ten lies off the
    wall, and what is left of the contact is rows of impacts."""
    rate, speed, radius_m, frames = 1000.0, 3.5, 0.04, 80
    t = np.arange(frames) / rate
    angle = speed / radius_m * t
    rolls = np.column_stack([np.cos(angle), np.sin(angle)])
    for seed in range(4):
        sd = np.full(frames, 1.5e-4)
        xy = radius_m * rolls + sd[:, None] * np.random.default_rng(seed).standard_normal((frames, 2))
        gap = np.hypot(*xy.T) - radius_m
        own = segment(t, xy, sd, xy, gap, 1.5e-4 + 3 * sd, radius_m)
        assert len(own.gaps) == 0 and own.contact.tolist() == [[0, frames - 1]]
        assert len(segment(t, xy, sd, xy, gap, 1.5e-4 + 3 * 2e-5, radius_m).contact) != 1


@pytest.mark.parametrize("rate", [240.0, 800.0, 2000.0])
@pytest.mark.parametrize("off", [-1, 0, 1])
def test_a_frame_just_beside_an_impact_counts_to_the_flight_that_it_lies_on(off, rate):
    """Two bent flights that meet a tenth of a frame beside one, cut a frame off."""
    turn = 20 + (0.1 if off < 0 else 0.9)
    t = np.arange(40.0) / rate
    since = t - turn / rate
    noise = 5e-6 * np.random.default_rng(3).standard_normal((2, 40))
    x = 0.02 + np.where(since < 0, 1.5 * since - 2.0 * since**2, -1.1 * since + 1.5 * since**2) + noise[0]
    y = 0.3 * since - 1.0 * since**2 + noise[1]
    gaps = on_their_sides(t, x, y, np.full(40, 5e-6), np.array([20 + off]))
    assert gaps.tolist() == [20]
