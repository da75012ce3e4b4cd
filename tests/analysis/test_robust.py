"""Robust scatter and least squares against normal errors with gross ones among them."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.statistics.robust import at_least_noise, least_squares, root_weights, smooth_noise, symmetric_inverse
from ovines.robust import TUKEY_SD, huber_loss, huber_weight, residual_sd, spread, tukey_weight

COUNT = 20_000


@pytest.fixture(scope="module")
def errors():
    return np.random.default_rng(5).standard_normal(COUNT)


def test_scatter_of_normal_errors(errors):
    # sd of a median deviation: 1.17 / sqrt(n); four of them.
    limit = 4 * 1.17 / np.sqrt(COUNT)
    assert spread(7.0 + 3.0 * errors) == pytest.approx(3.0, rel=limit)
    assert residual_sd(3.0 * errors) == pytest.approx(3.0, rel=limit)
    # Neighbouring third differences share frames: a few times fewer independent ones.
    assert smooth_noise(np.sin(np.arange(COUNT) / 300) + 1e-3 * errors) == pytest.approx(1e-3, rel=3 * limit)


def test_gross_errors_and_missing_values_hardly_move_the_scatter(errors):
    spoilt = errors.copy()
    spoilt[:200] = 1e6
    spoilt[200:400] = np.nan
    # One in a hundred is gross: the median moves to the 0.505 quantile of the sizes, by 1.2 %.
    assert residual_sd(spoilt) == pytest.approx(1.0, abs=0.04)
    assert spread(spoilt) == pytest.approx(1.0, abs=0.04)


def test_nothing_has_no_scatter():
    assert np.isnan(spread([])) and np.isnan(residual_sd([np.nan])) and at_least_noise(np.zeros(0)) == 1.0


def test_scatter_is_never_below_the_noise(errors):
    assert at_least_noise(0.1 * errors) == 1.0
    assert at_least_noise(2.0 * errors) == residual_sd(2.0 * errors)


def test_an_error_of_three_sds_weighs_half():
    weights = root_weights(np.array([0.0, 3.0, 6.0]), 1.0) ** 2
    assert weights == pytest.approx([1.0, 0.5, 0.2], rel=1e-12)
    assert root_weights(np.array([0.0, 6.0]), 2.0) ** 2 == pytest.approx([0.25, 0.125], rel=1e-12)


def test_a_line_through_gross_errors():
    """Coefficients scatter as the covariance says, with one value in ten wrong by twenty sds."""
    rng, z = np.random.default_rng(8), []
    for _ in range(200):
        x = rng.uniform(-1, 1, 60)
        sd = rng.uniform(0.5, 2.0, 60)
        noise = rng.standard_normal(60)
        noise[:6] += 20 * rng.choice([-1, 1], 6)
        fit = least_squares(np.column_stack([np.ones(60), x]), 2.0 - 3.0 * x + sd * noise, sd)
        off = fit.coefficients - [2.0, -3.0]
        z.append(off @ np.linalg.solve(fit.covariance, off))
    # chi-square of two: mean 2, sd of the mean of 200 is 0.14; the wrong values widen the scatter found by a tenth.
    assert 1.2 < np.mean(z) < 2.8


def test_without_gross_errors_it_is_least_squares():
    rng = np.random.default_rng(3)
    x, sd = rng.uniform(-1, 1, 40), np.full(40, 2.0)
    design = np.column_stack([np.ones(40), x])
    fit = least_squares(design, 1.0 + x, sd)
    assert fit.coefficients == pytest.approx([1.0, 1.0], abs=1e-12)
    assert fit.covariance == pytest.approx(4.0 * np.linalg.inv(design.T @ design), rel=1e-9)
    values = 1.0 + x + rng.standard_normal(40)
    plain = np.linalg.lstsq(design, values, rcond=None)[0]
    assert least_squares(design, values, sd, rounds=1).coefficients == pytest.approx(plain, rel=1e-9)


def test_a_symmetric_inverse_leaves_out_what_is_not_determined():
    """Full, short of one direction, and nil."""
    rows = np.random.default_rng(1).normal(size=(30, 4))
    short = np.column_stack([rows, rows[:, 0] - rows[:, 1]])
    for matrix in (rows.T @ rows, short.T @ short, np.zeros((3, 3))):
        expected = np.linalg.pinv(matrix, hermitian=True)
        np.testing.assert_allclose(symmetric_inverse(matrix), expected, rtol=1e-9, atol=1e-12)


def test_weights_of_huber_and_tukey():
    """Huber's weight is the slope of his loss over the residual; Tukey's drops out at one, and both are 1 at zero."""
    residual = np.array([-7.0, -2.0, 0.0, 0.5, 3.0, 40.0])
    step = 1e-6
    slope = (huber_loss(residual + step, 2.5) - huber_loss(residual - step, 2.5)) / (2 * step)
    assert slope == pytest.approx(2 * residual * huber_weight(residual, 2.5), rel=1e-6, abs=1e-9)
    assert tukey_weight(np.array([0.0, 0.6, -0.6, 1.0, 3.0])).tolist() == pytest.approx(
        [1.0, 0.64**2, 0.64**2, 0.0, 0.0], abs=1e-15
    )
    assert np.isnan(tukey_weight(np.array([np.nan]))).all()


def test_the_biweight_keeps_its_efficiency(errors):
    """95 % on Gaussian errors at 4.685 sd: of the mean of so many, by the variance of its influence."""
    share = errors / TUKEY_SD
    influence = errors * tukey_weight(share)
    slope = np.mean(np.where(np.abs(share) < 1, (1 - share**2) * (1 - 5 * share**2), 0.0))
    assert slope**2 / np.mean(influence**2) == pytest.approx(0.95, abs=4 / np.sqrt(COUNT))
