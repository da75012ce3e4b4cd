"""Correlation of neighbouring frames' errors, read off residuals from which each flight has taken a line of its own."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.evidence import Evidence
from analysis.flights import decay_between, whiten
from analysis.noise_correlation import expected_lag, noise_correlation


def noise(correlation, shape, rng):
    """AR(1) errors of unit variance along the first axis."""
    errors = rng.standard_normal(shape)
    for i in range(1, shape[0]):
        errors[i] = correlation * errors[i - 1] + np.sqrt(1 - correlation**2) * errors[i]
    return errors


def told(correlation, counts, rng):
    """What flights of ``counts`` frames with such errors leave."""
    product = square = 0.0
    for count in counts:
        line = np.linalg.qr(np.column_stack([np.ones(count), np.arange(count)]))[0]
        errors = noise(correlation, (count, 3), rng)
        left = errors - line @ (line.T @ errors)
        product += float(np.sum(left[1:] * left[:-1]))
        square += float(0.5 * np.sum(left[1:] ** 2 + left[:-1] ** 2))
    return Evidence((), np.zeros((0, 0)), np.zeros(0), 0.0, 3 * sum(counts), len(counts), 0, product, square, tuple(counts))


@pytest.mark.parametrize(("correlation", "within"), [(0.0, 0.03), (0.5, 0.03), (0.8, 0.03), (0.95, 0.04)])
def test_correlation_of_short_flights_is_found(correlation, within):
    # 250 flights of 6 to 60 frames, as twelve runs have.
    rng = np.random.default_rng(5)
    counts = [int(n) for n in rng.integers(6, 61, 250)]
    evidence = told(correlation, counts, rng)
    assert abs(noise_correlation([evidence]) - correlation) < within
    if correlation > 0.9:
        assert evidence.lag_one < correlation - 0.1  # the plain figure is what made floor friction's sd too small


def test_expected_lag_in_closed_form():
    # Three frames about a line leave one number, (1, -2, 1) / sqrt 6 times it: neighbours' products -4/6, mean squares 5/6.
    product, square = expected_lag(3, 0.0)
    assert product / square == pytest.approx(-0.8, rel=1e-12)


def test_no_flights_no_correlation():
    assert noise_correlation([]) == 0.0


def test_whitened_errors_are_independent():
    rng = np.random.default_rng(1)
    index = np.flatnonzero(rng.random(4000) > 0.2)
    errors = noise(0.8, (4000, 3), rng)[index]
    whiten(np.zeros((len(index), 3, 0)), errors, decay_between(index, 0.8))
    assert errors.std() == pytest.approx(1.0, abs=0.03)  # 9,600 of unit variance: sd 0.007
    assert abs(np.mean(errors[1:] * errors[:-1])) < 0.04
