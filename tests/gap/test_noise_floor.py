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
from analysis.motion.host_path import HostMotion

SD, FRAMES = 2e-5, 24_000
STILL = HostMotion(np.zeros((4, 1)), 0.0, 0.0, np.zeros(4), 0.0, np.zeros((0, 4)))


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
