"""What differs from run to run in no order: found where it is, and not where it is not."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.gap.cause import EACH_RUN, Structure
from analysis.gap.laws.choice.search import LEVEL_WHERE_LEFT
from analysis.gap.laws.impact_law import find_impact_law
from analysis.gap.selection.flight_steps import first_flights
from analysis.gap.selection.impact_steps import select_impact_effects
from analysis.gap.selection.impacts.covariates import run_columns
from analysis.gap.tests_by_hand import unknown_test
from tests.gap.conftest import brought
from tests.gap.laws.test_memory_laws import impact_fit, made_series

EFFECTS = ("floor_friction", "spin_coupling")


def left_at_impacts(folder, kind, size, seed, runs, noise="white"):
    """Coordinate and covariate of what is left of the impacts of the blind plant's series."""
    made = make_series(kind, size, np.random.default_rng(seed), runs=runs, noise=noise)
    series = brought(made, folder / "series")
    flights = first_flights(series, EFFECTS)
    steps = select_impact_effects(flights, list(EFFECTS), frozenset(), False, np.random.default_rng(0))
    return {(one.coordinate, one.goes_with) for one in steps.structure}


@pytest.mark.further
def test_a_rim_that_is_wiped_before_some_runs(tmp_path):
    assert ("tangential", EACH_RUN) in left_at_impacts(tmp_path, "unknown_wiped_rim", 0.4, 922, runs=5)
    assert "in no order" in unknown_test("impact", EACH_RUN)


@pytest.mark.further
def test_a_wall_that_is_damp_in_some_runs_where_few_blows_slide(tmp_path):
    """Two or three in a run do, and tell its friction to a hundredth; of the nominal friction's sides most runs had
    none."""
    assert ("tangential", EACH_RUN) in left_at_impacts(tmp_path, "unknown_moist_wall", 0.7, 94, runs=6)


@pytest.mark.further
def test_a_value_of_each_run_asks_for_no_formula(tmp_path):
    """Beside one a hum of the few blows that slide had been written, of a chance that a probe's finding allows."""
    series, _ = made_series(tmp_path, "unknown_moist_wall", 0.7, 91, runs=6)
    impacts, fits = impact_fit(series)
    left = [Structure("impact", "impact", "tangential", EACH_RUN, 5.0, 900.0, 0.3, "1", 0.0)]
    rng = np.random.default_rng(0)
    assert find_impact_law(impacts, fits, (), series.frame, rng, LEVEL_WHERE_LEFT, left) is None


@pytest.mark.further
@pytest.mark.parametrize("kind", ["none", "restitution_drift"])
def test_nothing_is_left_where_runs_are_alike_or_drift(tmp_path, kind):
    assert left_at_impacts(tmp_path, kind, 1.0, 902, runs=3) == set()


def test_columns_of_runs():
    """Short runs have no column, and stay with the last; too few runs have none at all."""
    run = np.repeat([0, 1, 2, 3], [9, 2, 7, 8])
    columns = run_columns(run)
    assert columns.shape == (26, 2)
    np.testing.assert_allclose(columns.mean(0), 0.0, atol=1e-15)
    np.testing.assert_allclose(np.ptp(columns, axis=0), 1.0, rtol=1e-7)
    assert run_columns(np.repeat([0, 1], 20)) is None
