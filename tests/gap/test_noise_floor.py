"""The floor under what flights are predicted by: noise that free curves swallow is given back, however it goes
together from frame to frame.  Flights that miss by more are left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.flights.cutting.pieces import Flight
from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.cutting.segments import Segments
from analysis.gap.prediction.over_floor import MOST_SHARE, over_floor, with_flights_over_floor
from analysis.gap.prediction.predict import free_paths, measured_paths
from analysis.gap.selection.impacts.floor import _left_over
from analysis.motion.host_path import HostMotion

SD, FRAMES = 2e-5, 24_000
STILL = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))


@pytest.mark.others_further
@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_the_floor_is_the_noise_itself(correlation):
    """A thousand pieces of a bent path: their mean square to 6 %, six sds of as many pieces' under the strongest."""
    rng = np.random.default_rng(1)
    white = rng.standard_normal((FRAMES, 2))
    noise = white.copy()
    for i in range(1, FRAMES):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * white[i]
    t = np.arange(FRAMES) / 800
    xy = np.column_stack([0.01 * np.sin(20 * t), 0.02 * np.cos(11 * t)]) + SD * noise
    sd, none = np.full(FRAMES, SD), np.zeros(0, np.int64)
    data = RunData("run", t, xy, np.zeros(FRAMES), sd, np.full(FRAMES, 1e-3), STILL, 0.04, 0.01, 0.5)
    flights = tuple(Flight(i, i + 39, False) for i in range(0, FRAMES, 40))
    segments = Segments(none, np.zeros((0, 2)), np.zeros((0, 2), np.int64), none)
    run = Run(data, segments, flights, np.zeros((FRAMES, 8)), np.arange(FRAMES))
    off = (measured_paths(run) - free_paths(run, correlation))[:, :2]
    assert np.nanmean(off**2) == pytest.approx(SD**2, rel=0.06)


def test_blows_of_another_kind_do_not_move_the_floor_of_the_others():
    """One in twenty is into a corner, a hundred sds off along the wall: the rest scatters as it did."""
    rng = np.random.default_rng(2)
    columns, sd = rng.standard_normal((400, 12)), np.full(400, 2e-4)
    values = columns @ rng.standard_normal(12) + sd * rng.standard_normal(400)
    kind = np.arange(400) % 20 == 0
    whole, spoilt = _left_over(values, columns, sd), _left_over(values + 100 * sd * kind, columns, sd)
    assert np.mean(whole**2) == pytest.approx(sd[0] ** 2, rel=0.15)
    assert np.mean(spoilt[~kind] ** 2) == pytest.approx(np.mean(whole[~kind] ** 2), rel=0.1)
    assert np.isnan(_left_over(values[:20], columns[:20], sd[:20])).all()


def glared(ladder, height_m):
    """The ladder of runs in which the disk is seen beside its place, in the middle of the ring."""

    def seen(run):
        xy_m = run.data.xy_m - run.data.host.at(run.data.time_s)[:, :2]
        pull = height_m * np.exp(-0.5 * np.sum((xy_m / 4e-3) ** 2, 1))
        return replace(run, data=replace(run.data, xy_m=run.data.xy_m + pull[:, None] * np.array([1.0, 0.0])))

    runs = tuple(seen(run) for run in ladder.series.runs)
    return replace(ladder, series=replace(ladder.series, runs=runs, tracks=()))


def test_flights_that_miss_by_more_than_their_noise_are_left(quiet):
    """Whatever they go with; none where they do not, where something is left already, or where one camera may hide a
    lens."""
    clean, off = (glared(quiet, height_m) for height_m in (0.0, 4e-4))
    assert with_flights_over_floor(clean) is clean and over_floor(clean)[0] < 0.05
    share, p = over_floor(off)
    assert share > MOST_SHARE and p < 1e-5
    (left,) = with_flights_over_floor(off).structure
    assert (left.stage, left.size, left.p) == ("flight", share, p)
    single = replace(off, series=replace(off.series, tracks=None))
    assert with_flights_over_floor(single) is single
    found = replace(off, structure=(left,))
    assert with_flights_over_floor(found) is found


def test_one_flight_that_misses_says_nothing_of_the_model(quiet):
    """It hides an impact."""
    run = quiet.series.runs[0]
    flight = max(run.flights, key=lambda one: one.last - one.first)
    xy_m = run.data.xy_m.copy()
    middle = (flight.first + flight.last) // 2
    xy_m[middle : flight.last + 1] += 2e-5 * np.arange(flight.last + 1 - middle)[:, None]
    runs = (replace(run, data=replace(run.data, xy_m=xy_m)), *quiet.series.runs[1:])
    ladder = replace(quiet, series=replace(quiet.series, runs=runs, tracks=()))
    assert 0 < over_floor(ladder)[0] < 0.05 and with_flights_over_floor(ladder) is ladder
