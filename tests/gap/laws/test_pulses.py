"""Pushes in pulses: period, width and instant found by truth."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.laws.choice.search import find_law
from analysis.gap.laws.pulses import STRETCHES, TimeProfile, pulse_candidates, time_profile
from analysis.gap.laws.regression.problem import Regression
from ovines.core.laws import words as W
from ovines.core.laws.kernel import pushes
from ovines.core.laws.terms import Factor, Term, rows_of

RUNS, FLIGHTS, FRAMES, RUN_S = 6, 24, 20, 1.2


class Flights:
    """Flights whose accelerations are seen, each frame in noise, behind a constant force that is known of nobody: the
    regression of laws without integration."""

    def __init__(self, rng, law, noise):
        per = FLIGHTS * FRAMES
        time_s = np.tile(np.linspace(0.0, RUN_S, per, endpoint=False), RUNS)
        self.known = np.zeros((RUNS * per, W.KNOWN_SIZE))
        self.known[:, W.TIME] = time_s
        block = np.repeat(np.arange(RUNS * FLIGHTS), 2 * FRAMES)
        given = self.columns(law).sum(1) if law else np.zeros(2 * len(time_s))
        residual = given + noise * rng.standard_normal(len(given))
        nuisances = np.column_stack([np.tile([1.0, 0.0], len(time_s)), np.tile([0.0, 1.0], len(time_s))])
        self.problem = Regression(residual / noise, nuisances / noise, np.zeros(2), block, block // FLIGHTS)
        self.noise = noise

    def columns(self, terms):
        out = np.empty((len(self.known), 3, len(terms)))
        pushes(rows_of(terms), self.known, out)
        return out[:, :2].reshape(-1, len(terms)) / getattr(self, "noise", 1.0)

    def cut_columns(self, term, cut):
        weight = cut(self.known)
        return self.columns([term]) * np.repeat(weight, 2, axis=0)


def pulsing(width, period, first, shape="pulses"):
    return (Term("fixed_direction", 2.0, (Factor("time", shape, width, period, first),), x=0.6),)


@pytest.mark.further
@pytest.mark.parametrize(
    ("shape", "width", "period", "first"),
    [("pulses", 0.012, 0.31, 0.07), ("pulses", 0.04, 2.0, 0.55), ("gates", 0.09, 0.29, 0.05)],
)
def test_a_train_of_pulses_and_a_single_burst_are_found(shape, width, period, first):
    flights = Flights(np.random.default_rng(1), pulsing(width, period, first, shape), 0.5)
    rng = np.random.default_rng(2)
    found, p = find_law(flights.problem, flights.columns, pulse_candidates(flights, RUN_S, rng), rng)
    assert found is not None and p < 1e-3
    (part,) = found.parts
    own_width, own_period, own_first = part.numbers
    assert part.terms[0].factors[0].function == shape
    assert own_width == pytest.approx(width, rel=0.15)
    if period < RUN_S:
        assert own_period == pytest.approx(period, rel=0.01)
    late = (own_first - first + 0.5 * own_period) % own_period - 0.5 * own_period
    assert late == pytest.approx(0.0, abs=0.3 * width)
    assert np.hypot(*found.coefficients) == pytest.approx(2.0, rel=0.1)


@pytest.mark.further
def test_noise_alone_pulses_no_more_often_than_it_says():
    """Series without a force: looking for period and instant is paid for.  Of eight these two pulsed without the
    price, the second also for a third of it."""
    for seed in (1, 7):
        flights = Flights(np.random.default_rng(seed), (), 0.5)
        rng = np.random.default_rng(seed)
        assert find_law(flights.problem, flights.columns, pulse_candidates(flights, RUN_S, rng), rng)[0] is None


def test_the_profile_is_the_fit_of_all_stretches_together():
    """Its quadratic form is that of a least-squares fit of the train's two columns."""
    flights = Flights(np.random.default_rng(4), pulsing(0.03, 0.4, 0.1), 0.5)
    profile = time_profile(flights, RUN_S, np.random.default_rng(0))
    assert isinstance(profile, TimeProfile) and profile.scores.shape[1:] == (2, STRETCHES)
    train = np.exp(-0.5 * ((profile.middle_s - 0.1 + 0.2) % 0.4 / 0.03 - 0.2 / 0.03) ** 2)
    edges = np.linspace(0.0, RUN_S * (1 + 1e-9), STRETCHES + 1)
    number = np.searchsorted(edges, flights.known[:, W.TIME], side="right") - 1
    columns = np.zeros((len(flights.problem.residual), 2))
    columns[::2, 0] = columns[1::2, 1] = train[number] / flights.noise
    whole = np.column_stack([flights.problem.nuisances, columns])

    def squares(design):
        left = flights.problem.residual - design @ np.linalg.lstsq(design, flights.problem.residual)[0]
        return left @ left

    expected = squares(flights.problem.nuisances) - squares(whole)
    assert profile.gains(train[None])[0, 0] == pytest.approx(expected, rel=1e-6)
