"""Whitening of a sequence's errors: drawn with their covariance, they come out independent."""

from __future__ import annotations

import numpy as np

from analysis.bounces.noise import LENS_LENGTH_SHARE, sequence_noise
from analysis.flights.noise import PLAIN, FlightNoise, displacement

RADIUS_M = 0.04


def both(sd):
    """The same sds for places and angles, (N, 2)."""
    return np.column_stack([sd, sd])


def test_errors_that_go_together_come_out_independent():
    """Noise that is correlated, a lens residual, and a force that nobody knows."""
    rng = np.random.default_rng(2)
    index = np.array([0, 1, 2, 4, 5, 9, 10, 11])
    xy = np.cumsum(rng.normal(0, 3e-3, (len(index), 2)), 0)
    sd, rho, lens = rng.uniform(5e-6, 1e-5, len(index)), 0.6, 2e-5
    apart = np.hypot(*(np.subtract.outer(xy[:, k], xy[:, k]) for k in (0, 1)))
    noise = np.outer(sd, sd) * rho ** np.abs(np.subtract.outer(index, index))
    force, spin, memory = 1.5, 0.4, 0.004
    moved = displacement(index / 800, memory)
    places = noise + force**2 * moved + lens**2 * np.exp(-0.5 * (apart / (LENS_LENGTH_SHARE * RADIUS_M)) ** 2)
    draws = np.empty((len(index), 3, 20000))
    for k, covariance in enumerate((places, places, noise + spin**2 * moved)):
        draws[:, k] = np.linalg.cholesky(covariance) @ rng.standard_normal((len(index), 20000)) / sd[:, None]
    model = FlightNoise(rho, 1.0, 1.0, force, spin, memory)
    white = sequence_noise(index, index / 800, xy, both(sd), model, lens, RADIUS_M).whitened(draws)
    for k in range(3):
        assert np.max(np.abs(np.cov(white[:, k]) - np.eye(len(index)))) < 0.05


def test_the_first_frames_do_not_know_the_later_ones():
    rng = np.random.default_rng(3)
    sd = both(np.full(12, 1e-5))
    whole = sequence_noise(
        np.arange(12), np.arange(12) / 800, rng.normal(0, 0.01, (12, 2)), sd, FlightNoise(0.7), 1e-5, RADIUS_M
    )
    values = rng.standard_normal((12, 3, 5))
    np.testing.assert_allclose(whole.whitened(values)[:7], whole.whitened(values[:7]), atol=1e-9)


def test_independent_errors_stay_as_they_are():
    values = np.random.default_rng(4).standard_normal((6, 3))
    noise = sequence_noise(
        np.arange(6), np.arange(6) / 800, np.zeros((6, 2)), both(np.full(6, 1e-5)), PLAIN, 0.0, RADIUS_M
    )
    np.testing.assert_allclose(noise.whitened(values), values, rtol=1e-12)
