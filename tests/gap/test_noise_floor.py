"""The floor under what flights are predicted by: noise that free curves swallow is given back, however it goes
together from frame to frame."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.flights.cutting.pieces import Flight
from analysis.flights.cutting.run_data import RunData
from analysis.flights.cutting.runs import Run
from analysis.flights.cutting.segments import Segments
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
