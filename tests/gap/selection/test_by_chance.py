"""What chance gains, and the next test: both against the ladder's own fits of the plant's series."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from analysis.blind.series import make_series
from analysis.gap.ladder import run_ladder
from analysis.gap.next_test.choice import LEAST_SEPARATION, next_tests
from analysis.gap.next_test.effects import TERMS, rival_of
from analysis.gap.next_test.recording import AS_RECORDED
from analysis.gap.prediction.held_out_errors import STEPS, held_out_errors
from analysis.gap.prediction.power import flights_seen, share_seen
from analysis.gap.prediction.predict import Errors
from analysis.gap.selection.flight_candidates import gain_of
from analysis.gap.selection.flights.fit import _indices, solve_named
from analysis.gap.selection.impacts.restitution import restitution_gains
from analysis.gap.selection.null_distribution import (
    by_chance,
    flight_null_distribution,
    impact_null_distribution,
    root_of,
    threshold,
)
from analysis.gap.thresholds import GAIN
from tests.gap.conftest import brought


@pytest.fixture(scope="module")
def dragged(tmp_path_factory):
    """The ladder of four runs with air drag at its small size."""
    folder = Path(tmp_path_factory.mktemp("dragged")) / "series"
    series = brought(make_series("air_drag", 0.35, np.random.default_rng(31), runs=3, noise="white"), folder)
    return run_ladder(series, np.random.default_rng(0))


@pytest.mark.further
def test_no_floor_is_above_the_best_model(dragged):
    """Free cubics spend more unknowns than the model, and miss more where it is right."""
    errors, _ = held_out_errors(dragged, dragged.causes)
    rms = {step: errors[step].rms() for step in STEPS if errors[step] is not None}
    floor = rms.pop("noise_floor")
    for quantity, value in floor.items():
        assert value <= min(one[quantity] for one in rms.values()) * (1 + 1e-12)
    twice = replace(errors["noise_floor"], flight=4 * errors["noise_floor"].flight)
    best = min(one["flight_m"] for one in rms.values())
    others = [errors[step] for step in rms]
    assert twice.never_above(others).rms()["flight_m"] == pytest.approx(min(best, 2 * floor["flight_m"]), rel=1e-9)


@pytest.mark.parametrize("above", ["flight", "impact", "spin"])
def test_a_floor_is_lowered_where_it_is_above_a_model_and_nowhere_else(above):
    """To the error of the best model, in the one quantity; a model of which nothing was predicted lowers none."""
    ones = np.array([1.0, 1.0])
    floor = Errors(ones, ones, ones, ones, ones)
    worse = replace(floor, flight=9 * ones, impact=9 * ones, spin=9 * ones)
    none = Errors(*np.zeros((5, 2)))
    with np.errstate(all="raise"):
        lowered = floor.never_above([worse, replace(worse, **{above: np.array([0.1, 0.4])}), none])
    for quantity in ("flight", "impact", "spin"):
        assert getattr(lowered, quantity) == pytest.approx(0.25 * ones if quantity == above else ones)
    assert none.never_above([worse]).rms() == none.rms()


def test_gains_by_chance_are_the_ladders_own_gains_of_drawn_scores(dragged):
    base, terms = dragged.flights.fitted, [TERMS["table_tilt"], TERMS["viscous_drag"]]
    null_distribution = flight_null_distribution(base, terms, np.random.default_rng(5), draws=1)
    names = [*base.columns, "tilt_x", "tilt_y", "viscous"]
    at, excess, rng = _indices(names), max(base.misfit / base.count, 1.0), np.random.default_rng(5)
    drawn = []
    for e in base.evidence:
        information, _ = e.take(at)
        score = np.zeros(len(e.columns))
        score[[e.columns.index(c) for c in at]] = (
            root_of(excess * information) @ rng.standard_normal((len(names), 1))
        )[:, 0]
        drawn.append(replace(e, score=score))
    # Columns that the fit holds stand where it has moved them; the null starts there.
    expected = max(gain_of(replace(base, evidence=tuple(drawn)), t, dragged.flights.units).held_out for t in terms)
    assert null_distribution[0] == pytest.approx(expected, rel=1e-6, abs=1e-6)


def test_impacts_without_effect_gain_as_much_as_the_bootstrap_says(dragged):
    assert dragged.impacts.fitted is not None
    data, rng = dragged.impacts.fitted.data, np.random.default_rng(6)
    null_distribution = impact_null_distribution(data, (), np.random.default_rng(7))
    drawn = []
    for _ in range(12):
        after = 0.7 * data.before + np.hypot(data.normal_sd, 0.02 * data.before) * rng.standard_normal(len(data))
        drawn.append(max(g.gain for g in restitution_gains(replace(data, after=after), ())))
    # Medians of twelve and of 400: the former's standard error is about 1.
    assert np.median(drawn) == pytest.approx(np.median(null_distribution), abs=3.5)
    assert np.quantile(null_distribution, 0.99) < 25


def test_chance_is_counted_where_it_was_drawn_and_follows_gumbels_tail_beyond():
    drawn = np.random.default_rng(3).gumbel(5.0, 2.0, 4000)
    assert by_chance(drawn, 5.0) == pytest.approx(1 - np.exp(-1), abs=0.03)
    # Mean and spread of 4000 draws place a tail ten scales out to half of itself.
    assert by_chance(drawn, 25.0) == pytest.approx(-np.expm1(-np.exp(-10)), rel=0.5)
    assert by_chance(np.zeros(0), 3.0) == 1.0


def test_a_series_of_a_tenth_of_the_noise_shows_more_of_what_nobody_listed(dragged):
    """Shares of drawn causes, of the whole series and of its evidence a thousand times weaker."""
    seen = share_seen(dragged, np.random.default_rng(2))
    assert set(seen) == {"flight", "impact"} and min(seen.values()) > 0.8
    weak = tuple(
        replace(e, information=1e-3 * e.information, score=1e-3 * e.score) for e in dragged.flights.fitted.evidence
    )
    faint = replace(dragged.flights, fitted=replace(dragged.flights.fitted, evidence=weak))
    assert flights_seen(faint, np.random.default_rng(2)) < seen["flight"] - 0.2


def test_threshold_is_the_larger_of_the_two(dragged):
    assert threshold(np.arange(1000.0), 50.0) == pytest.approx(996.5, abs=1)
    assert threshold(np.arange(10.0), 50.0) == 50.0
    assert threshold(np.zeros(0), 50.0) == 50.0
    assert dragged.flights.null_distribution.shape == (400,)
    assert next(g for g in dragged.flights.gains if g.term.name == "air_drag").held_out > threshold(
        dragged.flights.null_distribution, GAIN / 2
    )


def test_next_test_ranks_settings_and_agrees_with_the_series_itself(dragged):
    causes = dragged.causes
    assert rival_of(dragged, causes[0], causes) == "viscous_drag"
    tests = next_tests(dragged, causes)
    assert tests is not None and tests.effect == "air_drag"
    separation = {one.setting: one.sd for one in tests.settings}
    assert list(separation.values()) == sorted(separation.values(), reverse=True)
    assert all(0 < one.error < one.sd for one in tests.settings if one.sd > LEAST_SEPARATION)
    names = [*dragged.flights.fitted.columns, "viscous"]
    _, covariance, _ = solve_named(
        dragged.flights.fitted.evidence, names, dragged.flights.fitted.fits[0].run.contact_radius_m
    )
    at = names.index("air")
    size = dragged.causes[0].parameters["rate_per_m"][0]
    seconds = sum(f.run.time_s[-1] - f.run.time_s[0] for f in dragged.flights.fitted.fits)
    per_recording = size / np.sqrt(covariance[at, at]) * np.sqrt(tests.duration_s / seconds)
    # Three simulated recordings from the same starts are other recordings: impacts lead elsewhere, and long flights
    # decide.
    assert 0.25 < separation[AS_RECORDED] / per_recording < 4
    assert "viscous drag" in tests.words() and tests.words().endswith((".", ")."))


def test_no_setting_tells_where_nothing_was_named(dragged):
    assert next_tests(dragged, ()) is None
