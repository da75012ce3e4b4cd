"""What runs say of an effect one by one, held out: against least squares that leave a run out."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.gap.by_run import ByRun

RUNS, ROWS = 5, 60


def equations(sizes):
    """Design (R, N, 3) and values (R, N) of unit noise: two effects and a nuisance that each run has of its own;
    ``sizes`` (R, 2)."""
    rng = np.random.default_rng(3)
    design = rng.standard_normal((RUNS, ROWS, 3)) * [1.0, 1e-3, 1e5]
    return design, np.einsum("rnp,rp->rn", design[..., :2], sizes) + rng.standard_normal((RUNS, ROWS))


def by_run(sizes, own):
    design, values = equations(sizes)
    information = np.einsum("rni,rnj->rij", design, design)
    return ByRun.of_forms(information, np.einsum("rni,rn->ri", design, values), own)


def gain_of(one):
    return float(one.score.sum(0) @ np.linalg.solve(one.information.sum(0), one.score.sum(0)))


def test_squares_are_those_of_least_squares_without_the_run():
    sizes = np.tile([0.7, 500.0], (RUNS, 1))
    one = by_run(sizes, [0, 1])
    before, after, floor = one.squares(gain_of(one))
    design, values = equations(sizes)

    def best(run, at):
        """Squared residuals of a run whose effects are ``at``, its nuisance fitted."""
        left = values[run] - design[run][:, :2] @ at
        own = design[run][:, 2:]
        return float(np.sum((left - own @ np.linalg.lstsq(own, left, rcond=None)[0]) ** 2))

    for run in range(RUNS):
        others = [k for k in range(RUNS) if k != run]
        rows = np.zeros((len(others) * ROWS, 2 + RUNS))
        for place, k in enumerate(others):
            here = slice(place * ROWS, (place + 1) * ROWS)
            rows[here, :2], rows[here, 2 + k] = design[k][:, :2], design[k][:, 2] / 1e5
        held_out = np.linalg.lstsq(rows, np.concatenate([values[k] for k in others]), rcond=None)[0][:2]
        alone = np.linalg.lstsq(design[run] * [1, 1, 1e-5], values[run], rcond=None)[0][:2]
        assert before[run] == pytest.approx(best(run, np.zeros(2)) - best(run, alone), rel=1e-6)
        assert after[run] == pytest.approx(best(run, held_out) - best(run, alone), rel=1e-4, abs=1e-6)
    assert floor == pytest.approx(np.full(RUNS, 2.0), rel=1e-6)


def test_what_runs_do_not_share_is_foretold_by_none():
    """A size of either sign, in turn: the other runs' size makes each worse."""
    shared, unlike = np.ones((RUNS, 2)), np.ones((RUNS, 2)) * np.array([1, -1, 1, -1, 1])[:, None]
    for sizes, foretold in ((shared, True), (unlike, False)):
        one = by_run(sizes, [0])
        before, after, floor = (float(each.sum()) for each in one.squares(gain_of(one)))
        assert (after < 3 * floor) == foretold == (after < 0.1 * before)


def test_errors_that_runs_share_count_as_noise():
    """Ten times the noise makes a hundredth of all squares; and what is moved is larger by that."""
    one = by_run(np.ones((RUNS, 2)), [0])
    plain, noisier = one.squares(gain_of(one)), one.squares(0.01 * gain_of(one))
    for a, b in zip(plain, noisier, strict=True):
        assert b == pytest.approx(0.01 * a, rel=1e-9)
    moved = by_run(np.ones((RUNS, 2)), [0]).moved(np.array([-1.0]))
    assert gain_of(moved) < 0.02 * gain_of(one)


def test_one_run_has_no_others_and_one_that_says_nothing_counts_for_nothing():
    one = ByRun.of_estimates(np.array([3.0]), np.array([1.0]))
    before, after, floor = one.squares(9.0)
    assert (before[0], after[0], floor[0]) == pytest.approx((9.0, 1.0, 1.0), rel=1e-6)
    two = ByRun.of_estimates(np.array([3.0, 3.0, 7.0]), np.array([1.0, 1.0, np.inf]))
    before, after, floor = two.squares(18.0)
    assert before == pytest.approx([9.0, 9.0, 0.0], rel=1e-6) and after == pytest.approx(np.zeros(3), abs=1e-6)
    assert floor == pytest.approx([1.0, 1.0, 0.0], rel=1e-6)
