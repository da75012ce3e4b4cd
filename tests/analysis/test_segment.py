"""Kinks of a path, sustained contact, and how they cut a run into flights."""

from __future__ import annotations

import numpy as np

from analysis.flights import flights_from_segments
from analysis.segment import REACH_FRAMES, SIGNIFICANCE, find_contact, find_kinks, segment

RATE = 800.0
SD = 1.5e-5


def path(kinks, frames=120, seed=1):
    """Piecewise flights (floor friction 2 m/s^2) whose velocity jumps at the given times (in frames) by the given steps."""
    t = np.arange(frames) / RATE
    x, y = 0.8 * t - 1.0 * t**2, -0.3 * t
    for when, dx, dy in kinks:
        late = np.maximum(t - when / RATE, 0)
        x, y = x + dx * late, y + dy * late
    rng = np.random.default_rng(seed)
    return t, x + SD * rng.standard_normal(frames), y + SD * rng.standard_normal(frames), np.full(frames, SD)


def kinks_of(t, x, y, sd):
    return find_kinks(t, x, y, sd, 0, len(t) - 1, SIGNIFICANCE, REACH_FRAMES)[:, 0].astype(int).tolist()


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
    """Both are found; a third between them may be (two flights too short to be fitted, left to the chains)."""
    assert {50, 54} <= set(kinks_of(*path([(50.5, -1.5, 0.0), (54.5, 1.2, 0.0)])))


def test_missing_frames_are_bridged():
    t, x, y, sd = path([(50.5, -1.5, 0.0)])
    x[48:50] = np.nan
    found = kinks_of(t, x, y, sd)
    assert len(found) == 1 and 47 <= found[0] <= 50


def test_contact_needs_four_frames_and_outlasts_a_missing_one():
    distance = np.array([0.03, 0.04, 0.04, 0.04, np.nan, 0.04, 0.03, 0.04, 0.04, 0.03])
    contact = find_contact(distance, np.full(10, 0.0399))
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
    xy = np.column_stack([-1.97 * time + 5.14 * late, -0.72 * time + 1.2 * late]) + sd[:, None] * rng.standard_normal((30, 2))
    xy[15] += [2e-4, 5e-5]
    found = segment(time, xy, sd, np.zeros(30), np.full(30, 0.04))
    assert found.smeared.tolist() == [15]
    assert len(found.gaps) == 1
    assert found.gaps[0] in (14, 15)
