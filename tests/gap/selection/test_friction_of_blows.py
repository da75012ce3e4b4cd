"""Friction of the wall that each impact has of its own, or that holds by more than it slips with: found from the
impacts that have surely slid, whatever the fit of the whole law made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.checks.fit import check_fit
from analysis.contact.law import Circumstances, LawData, fit_law, predicted_tangential, stick_impulse
from analysis.contact.sliding import friction_of_blows
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impact_steps import ImpactSteps, unexplained_scatter
from analysis.gap.selection.impacts.fit import fit_impacts
from analysis.gap.tests_by_hand import unknown_test
from analysis.identify import identify_series
from tests.gap.conftest import brought

FRICTION, REVERSAL, COUNT = 0.16, 0.5, 160


def impacts(seed: int, share: np.ndarray, held: float = 1.0) -> LawData:
    """Impacts of a disk; friction is ``share`` (COUNT,) times the usual, and they stick up to ``held`` times that."""
    rng = np.random.default_rng(seed)
    before = rng.uniform(0.2, 2.0, COUNT)
    none, sd = np.zeros(COUNT), np.full(COUNT, 3e-4)
    data = LawData(
        before=before, after=0.7 * before, slip=before * rng.uniform(-2.0, 2.0, COUNT), normal_impulse=1.7 * before,
        tangential_impulse=none, angular=none, normal_sd=sd, tangential_sd=sd, angular_sd=sd,
        at=Circumstances(none, np.arange(COUNT) % 4, none, none, none, none, none, np.arange(COUNT)),
        inertia_factor=0.5,
    )  # fmt: skip
    slides = predicted_tangential(data, FRICTION * share, REVERSAL)
    wanted = stick_impulse(data, REVERSAL)
    stick = np.abs(wanted) <= held * FRICTION * share * data.normal_impulse
    return replace(data, tangential_impulse=np.where(stick, wanted, slides) + sd * rng.standard_normal(COUNT))


def test_plain_friction_scatters_by_nothing_and_holds_by_no_more():
    data = impacts(1, np.ones(COUNT))
    found = friction_of_blows(data, fit_law(data))
    assert found is not None and found.slid > 40
    assert (found.scatter < 0.01, found.beyond, found.held) == (True, 0, 1.0)


@pytest.mark.parametrize("held", [1.5, 2.5])
def test_a_wall_that_holds_by_more_than_it_slips_with(held):
    """By how much, to what the impacts near it leave; the fit of the whole law has a friction between the two."""
    data = impacts(2, np.ones(COUNT), held)
    law = fit_law(data)
    found = friction_of_blows(data, law)
    assert found is not None and found.beyond >= 3
    assert 0.85 * held < found.held < 1.01 * held and found.scatter < 0.01


def test_friction_of_each_blows_own():
    scatter = 0.3
    share = np.exp(scatter * np.random.default_rng(5).standard_normal(COUNT))
    data = impacts(3, share)
    found = friction_of_blows(data, fit_law(data))
    assert found is not None and 0.7 * scatter < found.scatter < 1.3 * scatter


def test_of_few_that_slid_nothing_is_said():
    data = impacts(1, np.full(COUNT, 8.0))
    assert friction_of_blows(data, fit_law(data)) is None


@pytest.mark.further
@pytest.mark.parametrize(
    ("kind", "size", "words", "advice"),
    [
        ("unknown_static_friction", 0.5, "the wall holds by more", "spring balance"),
        ("unknown_contaminated_wall", 0.5, "scatter of the wall", "Clean wall and rim"),
    ],
)
def test_it_is_left_at_the_impacts(tmp_path, kind, size, words, advice):
    """ "none" before, beside a friction between the two, or beside one of the few that agreed."""
    made = make_series(kind, size, np.random.default_rng(3), runs=4, noise="white")
    series = brought(made, tmp_path / "series")
    fitted = fit_impacts(first_flights(series, ("floor_friction", "spin_coupling")).fits)
    (left,) = unexplained_scatter(ImpactSteps(nominal=fitted, fitted=fitted), ())
    assert (left.stage, left.coordinate) == ("impact", "tangential") and words in left.goes_with
    assert left.strength > 1.0 and left.p < 1e-3 and left.is_no_formula
    assert advice in unknown_test(left.stage, left.goes_with)


@pytest.mark.further
@pytest.mark.parametrize(("kind", "state"), [("unknown_static_friction", "fails"), ("none", "holds")])
def test_identify_says_not_to_use_a_friction_that_lies_between_the_two(tmp_path, kind, state):
    """It had 0.424 +- 0.004 and "Good" of impacts that slid with 0.168."""
    made = make_series(kind, 0.8, np.random.default_rng(3), runs=4, noise="white")
    series = brought(made, tmp_path / "series")
    rig = identify_series(series.motions, series.recordings)[1][0].rig
    rows = [one for one in check_fit(rig, 0, series.recordings[0], 0.0) if one is not None]
    (row,) = (one for one in rows if one.check.startswith("wall friction against"))
    assert row.state == state and "impacts slid with a friction of" in row.found
    assert row.parameters == ("wall_friction" if state == "fails" else "")
