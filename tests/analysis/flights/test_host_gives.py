"""How a Host gives as it is hit, by the corners of its path: synthetic paths whose corners are known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from analysis.flights.host_gives import TOO_HEAVY, Gives, at_corners, host_gives
from analysis.motion.host_path import HostMotion
from analysis.motion.smooth_path import smooth_path

PERIOD_S, NOISE_M, NOISE_RAD = 1 / 800, 1e-5, 2e-4


def run_of(gives: Gives, rng: np.random.Generator, swing_hz: float = 3.0):
    """A run of 2 s: a Host that swings and turns by itself and gives at forty impacts, its instants and steps."""
    time_s = PERIOD_S * np.arange(1600)
    moments = np.sort(rng.choice(np.arange(20, 1580, 39), 40, replace=False)) * PERIOD_S + rng.uniform(0, PERIOD_S, 40)
    steps = np.column_stack([rng.normal(0.0, 1.0, (40, 2)), rng.normal(0.0, 0.02, 40)])
    place = np.zeros((len(time_s), 4))
    turn = 2 * np.pi * swing_hz * time_s
    place[:, 0], place[:, 1], place[:, 3] = 0.01 * np.sin(turn), 0.004 * np.cos(0.7 * turn), 0.02 * np.sin(1.3 * turn)
    ramps = np.maximum(time_s[:, None] - moments, 0.0)
    place[:, :2] -= gives.share * ramps @ steps[:, :2]
    place[:, 3] -= gives.turn_per_m2 * ramps @ steps[:, 2]
    sd = np.array([NOISE_M, NOISE_M, NOISE_M, NOISE_RAD])
    seen = place + sd * rng.standard_normal(place.shape)
    smooth = tuple(smooth_path(time_s, column) for column in seen.T)
    path = np.column_stack([one.at(time_s) for one in smooth])
    host = HostMotion(np.zeros((4, 1)), 0.0, 0.0, sd, 0.0, seen - path, smooth=smooth)
    return SimpleNamespace(host=host, time_s=time_s, period_s=PERIOD_S), moments, steps


@pytest.mark.parametrize("gives", [Gives(0.025, 10.0), Gives(0.12, 50.0), Gives(0.025, 0.0), TOO_HEAVY])
def test_corners_tell_how_a_host_gives(gives):
    """Beside swings and turns of its own; a Host that is held from turning, or too heavy, does not give."""
    rng = np.random.default_rng(3)
    runs, moments, steps = zip(*(run_of(gives, rng) for _ in range(2)), strict=True)
    found = host_gives(runs, moments, steps)
    assert found.share == pytest.approx(gives.share, abs=1e-3)
    assert found.turn_per_m2 == pytest.approx(gives.turn_per_m2, rel=0.25)
    assert (found.share > 0, found.turn_per_m2 > 0) == (gives.share > 0, gives.turn_per_m2 > 0)


def test_few_impacts_tell_nothing():
    run, moments, steps = run_of(Gives(0.12, 50.0), np.random.default_rng(3))
    assert host_gives([run], [moments[:6]], [steps[:6]]) == TOO_HEAVY


def test_at_its_corners_a_path_is_what_it_was():
    """Place, rate in the middle of the step, and second rate; a smooth path alone cuts the corner."""
    gives, rng = Gives(0.12, 50.0), np.random.default_rng(3)
    run, moments, steps = run_of(gives, rng)
    pose, rate, _ = at_corners(run, moments, steps, gives)
    turn = 2 * np.pi * 3.0 * moments
    past, gone = np.maximum(moments[:, None] - moments, 0.0), np.heaviside(moments[:, None] - moments, 0.5)
    true = 0.01 * np.sin(turn) - gives.share * past @ steps[:, 0]
    velocity = 0.01 * 6 * np.pi * np.cos(turn) - gives.share * gone @ steps[:, 0]
    cut = run.host.at(moments)[:, 0]
    assert np.std(pose[:, 0] - true) < 0.5 * NOISE_M < 2 * NOISE_M < np.std(cut - true)
    assert np.std(rate[:, 0] - velocity) < 2e-3
    angle = 0.02 * np.sin(1.3 * turn) - gives.turn_per_m2 * past @ steps[:, 2]
    assert np.std(pose[:, 3] - angle) < NOISE_RAD
