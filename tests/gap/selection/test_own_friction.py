"""Friction that is each run's own, in linear flights: what acts beside it is judged beside whatever friction does from
run to run, and the runs' frictions are reported."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from analysis.flights.evidence import Evidence
from analysis.flights.fit import SHARED
from analysis.gap.selection import flight_steps
from analysis.gap.selection.flight_candidates import Units, gain_of
from analysis.gap.selection.flights.fit import DRIFT_RUN, FlightFit
from analysis.gap.selection.flights.model import nominal_model
from analysis.gap.selection.flights.terms import FlightTerm
from analysis.gap.selection.own_friction import holding_friction, own_friction, with_own_friction

RUNS, FRICTION, TILT = 8, 0.3, FlightTerm("table_tilt", ("tilt_x", "tilt_y"), True)
UNITS = Units({"tilt_x": 9.81, "tilt_y": 9.81}, 0.02)
HUMID = 0.1 * np.sin(2 * np.pi * np.arange(RUNS) / RUNS + 0.4)


@dataclass
class Friction:
    friction_share: float


@dataclass
class Held:
    data: Friction


def flights(friction_share, tilt=(0.0, 0.0), seed=0, left=0.0):
    """A fit at the common friction and no tilt of 200 accelerations per run, whose sliding has a chief direction of its
    own in each; ``left``: misfit that nothing of this explains."""
    rng = np.random.default_rng(seed)
    columns = (SHARED.index("friction"), SHARED.index("tilt_x"), SHARED.index("tilt_y"), DRIFT_RUN)
    evidence = []
    for run, share in enumerate(friction_share):
        way = rng.normal(0.0, 1.0, (200, 2)) + 2 * np.array([np.cos(run), np.sin(2 * run)])
        way /= np.linalg.norm(way, axis=1)[:, None]
        none = np.zeros(200)
        table = np.concatenate(
            [np.column_stack([-9.81 * way[:, k], 9.81 * (k == 0) + none, 9.81 * (k == 1) + none]) for k in (0, 1)]
        )
        table = np.column_stack([table, FRICTION * (run - 0.5 * (RUNS - 1)) * table[:, 0]])
        noise = rng.normal(0.0, 0.02, 400)
        value = (table[:, :3] @ [FRICTION * share, *tilt] + noise) / 0.02
        table = table / 0.02
        evidence.append(Evidence(columns, table.T @ table, table.T @ value, 0.0, 400, 20, 0))
    alone = SimpleNamespace(run=SimpleNamespace(contact_radius_m=0.04))
    model, none = nominal_model(["floor_friction"], friction=FRICTION), np.zeros((0, 0))
    misfit = 400.0 * RUNS + left
    return FlightFit(model, (alone,), tuple(evidence), none, ("friction",), misfit, 400 * RUNS, None)


def test_a_tilt_that_friction_hides_is_seen_beside_it():
    """Runs disagree on the tilt by what their frictions differ; beside frictions of their own they do not."""
    base = flights(HUMID, (0.003, -0.002))
    hidden, seen = gain_of(base, TILT, UNITS), gain_of(with_own_friction(base), TILT, UNITS)
    assert hidden.significance < 10 and seen.significance > 3 * hidden.significance
    np.testing.assert_allclose(seen.estimate, (0.003, -0.002), atol=4e-4)
    assert seen.improved == 1.0 and seen.held_out > hidden.held_out


def test_a_drift_of_the_friction_says_nothing_beside_that_of_each_run():
    """It is nothing but friction."""
    own = with_own_friction(flights(HUMID))
    assert "friction" not in own.columns
    assert gain_of(own, FlightTerm("friction_drift", ("drift_run",), True), UNITS).gain == 0.0


def test_the_runs_frictions_are_reported():
    """As shares of the common one, beside a tilt; the runs then hold them."""
    base = flights(HUMID, (0.003, -0.002))
    own = own_friction(base, TILT.columns)
    np.testing.assert_allclose(own.shares - 1, HUMID, atol=0.01)
    assert own.acceleration_m_per_s2 == pytest.approx(FRICTION * 9.81 * np.std(HUMID), rel=0.1)
    assert own.p < 1e-6
    runs = [Held(Friction(2.0))] * RUNS
    assert [run.data.friction_share for run in holding_friction(runs, own, base)] == list(2.0 * own.shares)


def test_frictions_that_are_alike_or_explain_little_are_none():
    """Noise; a few runs; and what a missing force makes of the runs' frictions."""
    assert not any(own_friction(flights(np.zeros(RUNS), seed=seed)) for seed in range(20))
    assert own_friction(flights(HUMID[:3])) is None
    assert own_friction(flights(HUMID)) is not None
    assert own_friction(flights(HUMID, left=1e6)) is None


@pytest.mark.parametrize(("friction", "tilt"), [(HUMID, (0.01, -0.006)), (HUMID, (0.0, 0.0)), (0 * HUMID, (0.01, 0.0))])
def test_a_name_is_taken_beside_frictions_of_the_runs_own(monkeypatch, friction, tilt):
    """Where both are surely there; alone, a law or the ladder's usual way says either."""
    base, held = flights(friction, tilt), []

    def grown(runs, start, named, *_):
        held.extend(runs)
        return flight_steps._Grown(start, [TILT], {}, [], [], [])

    monkeypatch.setattr(flight_steps, "refitted", lambda *_: flights(0 * HUMID, tilt))
    monkeypatch.setattr(flight_steps, "_grown", grown)
    before = flight_steps._Grown(base, [], {}, ["first"], [], [])
    runs = [Held(Friction(1.0))] * RUNS
    found = flight_steps._beside_own_friction(runs, before, [TILT], [], 100.0, UNITS)
    assert (found is not None) == (np.any(friction) and np.any(tilt))
    if found is not None:
        (_, chosen, _, first, *_), structure = found
        assert chosen == [TILT] and first == ["first"] and structure.goes_with == flight_steps.OWN_FRICTION
        np.testing.assert_allclose([run.data.friction_share - 1 for run in held], HUMID, atol=0.02)
