"""Impacts and flights off the law: an outlier is left out; many, or flights one after the other, are structure."""

from __future__ import annotations

from itertools import combinations, pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.contact.law import OUTLIER_SHARE, Circumstances, LawData, fit_restitution
from analysis.gap.ladder import run_ladder
from analysis.gap.selection.impacts.fit import _with_structure
from analysis.gap.selection.unfitted_flights import (
    BY_CHANCE,
    LEAST_IN_TURN,
    bent_flights,
    in_turn,
    unexplained_misfit,
    unfitted,
)
from analysis.gap.tests_by_hand import unknown_test


def impacts(rng: np.random.Generator, lower: int, count: int = 200) -> LawData:
    """``count`` impacts of restitution 0.72 +- 0.01, seen with 2 mm/s; the first ``lower`` of them with 0.3 less."""
    before = rng.uniform(0.3, 2.0, count)
    restitution = 0.72 + 0.01 * rng.standard_normal(count) - 0.3 * (np.arange(count) < lower)
    after = restitution * before + 2e-3 * rng.standard_normal(count)
    none, sd = np.zeros(count), np.full(count, 2e-3)
    azimuth = np.sort(rng.uniform(0, 2 * np.pi, count))  # the lower ones lie together: a soft spot
    return LawData(
        before=before,
        after=after,
        slip=none,
        normal_impulse=before + after,
        tangential_impulse=none,
        angular=none,
        normal_sd=sd,
        tangential_sd=sd,
        angular_sd=sd,
        at=Circumstances(
            spin=none,
            run=none.astype(int),
            time_s=np.arange(count) / 100,
            azimuth_rad=azimuth,
            host_angle_rad=none,
            drive_rad=none,
            drive_start_rad=none,
            index=np.arange(count),
        ),
        inertia_factor=0.5,
    )


def test_one_gross_outlier_stays_out_and_moves_nothing():
    data = _with_structure(impacts(np.random.default_rng(1), 1))
    assert data.outliers == OUTLIER_SHARE
    (restitution,), covariance, _, _ = fit_restitution(data)
    assert abs(restitution - 0.72) < 4 * np.sqrt(covariance[0, 0])


def test_a_soft_spot_is_no_outlier():
    data = _with_structure(impacts(np.random.default_rng(2), 14))
    assert data.outliers == 0.0
    (restitution,), _, scatter, _ = fit_restitution(data)
    assert scatter > 0.05 and abs(restitution - (0.72 - 0.3 * 14 / 200)) < 0.012


def test_a_handful_of_impacts_keeps_what_it_was_given():
    few = impacts(np.random.default_rng(3), 3, count=12)
    assert _with_structure(few) is few


def marked(count: int, *places: int) -> np.ndarray:
    """A run's flights, those at these places marked."""
    return np.isin(np.arange(count), places)


def test_how_often_marks_follow_on_each_other_by_chance_is_counted_exactly():
    """Against every way in which two and three of six and seven flights can be marked."""
    runs = marked(6, 1, 2), marked(7, 0, 1, 5)
    following = [
        sum(bool(a and b) for run in (marked(6, *first), marked(7, *second)) for a, b in pairwise(run))
        for first in combinations(range(6), 2)
        for second in combinations(range(7), 3)
    ]
    share, p = in_turn(runs)
    assert share == pytest.approx(4 / 13)
    assert p == pytest.approx(np.mean(np.array(following) >= 2))
    assert in_turn([marked(6), marked(7)]) == (0.0, 1.0)
    assert in_turn([marked(6, 0, 2, 5)])[0] == 0.0 and in_turn([]) == (0.0, 1.0)


def flown(ratios: list[float], freedom: int = 150) -> SimpleNamespace:
    """Fits of flights that miss by these shares of their noise's variance."""
    flights = [SimpleNamespace(first=100 * k, last=100 * k + 50) for k in range(len(ratios))]
    return SimpleNamespace(
        flights=flights,
        freedom=np.full(len(ratios), freedom),
        misfit=freedom * np.array(ratios),
        rests=lambda k: False,
    )


@pytest.mark.parametrize(("places", "left"), [((4, 5, 6), True), ((2, 8, 14), False)])
def test_what_happens_once_in_a_run_bends_flights_one_after_the_other(places, left):
    """Single ones hide an impact or follow a wrong track."""
    rng = np.random.default_rng(5)
    ratios = rng.normal(1.0, np.sqrt(2 / 150), (3, 20))
    ratios[:2, list(places)] = 2.5
    fits = [flown(list(row)) for row in ratios]
    assert [list(np.flatnonzero(one)) for one in bent_flights(fits)] == [list(places), list(places), []]
    share, p = in_turn(bent_flights(fits))
    assert (share > LEAST_IN_TURN and p < BY_CHANCE) is left
    flight = SimpleNamespace(fits=fits, misfit=1.0, count=1)
    found = unexplained_misfit(flight, (), (), False)
    assert [one.goes_with for one in found] == ["none of the covariates tested (flights one after the other)"][
        : int(left)
    ]
    assert all("Look into the recordings" in unknown_test("flight", one.goes_with) for one in found)
    assert "goes with nothing" in unknown_test("flight", unfitted("misfit of the flights", 2.0, 1.5, "", 0.0).goes_with)
    assert unexplained_misfit(flight, (), (SimpleNamespace(effect="camera_clock_offset"),), False) == []


def test_flights_that_scatter_more_than_their_noise_are_not_bent_for_that():
    """Under a lens residual all do."""
    ratios = list(np.random.default_rng(6).gamma(4.0, 0.5, 60))
    assert not any(one.any() for one in bent_flights([flown(ratios)]))
    assert not bent_flights([flown([1.0] * 10 + [50.0])])[0].any()  # too few to say what is usual


@pytest.mark.further
def test_a_knock_against_the_floor_is_left(loaded):
    """At its own time in half of the runs; in view, no blind result. Six runs with three knocks say too little."""
    _, series = loaded("unknown_slam", 1.1, 9, "white", 12)
    ladder = run_ladder(series, np.random.default_rng(0))
    assert ladder.causes == () and [one.stage for one in ladder.structure] == ["flight"]
