"""The baselines beside the search of laws, on impacts whose law is known in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.laws.choice.listed import Listed
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.impact_rows import ImpactRegression
from analysis.gap.laws.regression.problem import Profile, Regression
from benchmarks.gap.baselines import blow_features, columns_of_terms, gaussian_process, library, sparse
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term
from ovines.pipeline.blind.law_oracle import held_out

RUNS, BLOWS, SD = 8, 40, 0.01
QUANTITIES = ("approach", "slip", "spin", "time", "since", "blows")


def term(quantity, function="power", order=1.0):
    return Term("restitution", 1.0, (Factor(quantity, function, order),))


def candidates():
    """A power or two of each quantity, and one pair of terms."""
    each = [Candidate(f"{q}^{n}", lambda q=q, n=n: (term(q, order=n),)) for q in QUANTITIES for n in (1.0, 2.0)]
    return [*each, Candidate("a pair", lambda: (term("approach"), term("time")))]


@pytest.fixture(scope="module")
def impacts():
    """Restitution that falls by 0.03 s^2/m^2 with the slip's square; and the law's own row."""
    rng, count = np.random.default_rng(5), RUNS * BLOWS
    known = np.zeros((count, W.KNOWN_SIZE))
    for place, low, high in (
        (W.APPROACH, 0.2, 2.0), (W.SLIP, -2.0, 2.0), (W.SPIN, -60.0, 60.0), (W.TIME, 0.0, 1.2), (W.SINCE, 0.01, 0.2),
        (W.BLOWS, 0.0, 20.0), (W.HX, -0.04, 0.04), (W.HY, -0.04, 0.04),
    ):  # fmt: skip
        known[:, place] = rng.uniform(low, high, count)
    answer = known[:, W.APPROACH] / SD
    law = -0.03 * known[:, W.SLIP] ** 2 * answer
    residual = law + rng.standard_normal(count)
    problem = Regression(residual, answer[:, None], np.zeros(1), np.arange(count), np.arange(count) // BLOWS)
    return ImpactRegression(problem, known, {"restitution": answer}), law[:, None]


@pytest.fixture(scope="module")
def listed(impacts):
    return Listed.of(candidates(), impacts[0].columns, impacts[0].problem)


def share(rows, law, columns, problem=None):
    """What columns close of what the oracle, the ``law``'s own row, closes."""
    before = held_out(rows.problem, law[:, :0])
    return (before - held_out(problem or rows.problem, columns)) / (before - held_out(rows.problem, law))


def test_the_oracle_closes_all_but_the_noise_at_its_own_size(impacts):
    rows, law = impacts
    assert share(rows, law, law) == 1.0
    assert held_out(rows.problem, law[:, :0]) > 3.0
    assert held_out(rows.problem, law) == pytest.approx(1.0, abs=0.25)
    assert Profile.of(rows.problem).gain(law)[1][0] == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("choose", [library, sparse])
def test_a_library_that_holds_the_law_finds_it(impacts, listed, choose):
    rows, law = impacts
    chosen = choose(rows.problem, listed)
    assert term("slip", order=2.0) in chosen
    assert len(chosen) <= 3
    assert share(rows, law, columns_of_terms(rows, chosen)) == pytest.approx(1.0, abs=0.03)


def test_a_library_finds_nothing_in_noise(impacts, listed):
    rows, _ = impacts
    noise = np.random.default_rng(8).standard_normal(len(rows.problem.residual))
    problem = Regression(noise, rows.problem.nuisances, np.zeros(1), rows.problem.block, rows.problem.run)
    assert library(problem, listed) == [] and sparse(problem, listed) == []


def test_a_gaussian_process_predicts_the_law(impacts):
    rows, law = impacts
    predicted = gaussian_process(rows.problem, blow_features(rows, np.random.default_rng(1)))
    assert share(rows, law, predicted.nuisances[:, :0], predicted) > 0.8
