"""Ensembles: independent of how they are spread out, equal to single runs, alive after a worker's death."""

from dataclasses import replace

import numpy as np
import pytest

from ovines.core import ScenarioError, Workers, simulate, simulate_ensemble
from ovines.core.system.named import named_scenario

SHORT = replace(named_scenario("table-15-case-2"), duration_s=0.1)
SPREAD = {"nes_x_m": 1e-4, "restitution": (0.7, 0.9), "drive_phase_shift_rad": 0.1}


def test_rows_do_not_depend_on_jobs_or_chunks():
    one = simulate_ensemble(SHORT, 60, SPREAD, np.random.default_rng(4), workers=Workers(jobs=1, chunk=60))
    two = simulate_ensemble(SHORT, 60, SPREAD, np.random.default_rng(4), workers=Workers(jobs=2, chunk=7))
    assert np.array_equal(one.final_state, two.final_state)
    assert np.array_equal(one.drawn["restitution"], two.drawn["restitution"])


def test_a_row_is_the_single_run():
    x = np.array([0.05, 0.052, 0.054])
    ensemble = simulate_ensemble(
        SHORT,
        3,
        {"nes_x_m": x},
        np.random.default_rng(0),
        sample_times_s=np.array([0.03, 0.1]),
        tolerance=SHORT.tolerance,
    )
    for row in range(3):
        start = (x[row], *SHORT.initial_nes[1:])
        single = simulate(replace(SHORT, initial_nes=start))
        assert ensemble.n_impacts[row] == len(single.impacts)
        assert ensemble.final_state[row, 0] == pytest.approx(single.motion["nes_x_m"][-1], abs=1e-9)
        assert ensemble.samples[row, 0, 0] == pytest.approx(single.motion["nes_x_m"][24], abs=1e-9)


def test_draws_have_the_asked_spread_and_stay_inside():
    wide = simulate_ensemble(replace(SHORT, duration_s=1e-4), 2000, {"nes_x_m": 5e-3}, np.random.default_rng(1))
    x = wide.drawn["nes_x_m"]
    assert np.max(np.hypot(x, SHORT.initial_nes[1])) <= 0.08 + 1e-12
    assert np.std(x) < 5e-3  # those outside were drawn again
    narrow = simulate_ensemble(replace(SHORT, duration_s=1e-4), 2000, {"nes_x_m": 1e-4}, np.random.default_rng(1))
    assert np.std(narrow.drawn["nes_x_m"]) == pytest.approx(1e-4, rel=0.08)


def test_progress_counts_every_run():
    seen = []
    simulate_ensemble(SHORT, 25, {}, np.random.default_rng(0), workers=Workers(chunk=10, progress=seen.append))
    assert sum(seen) == 25


def test_unknown_names_are_refused():
    with pytest.raises(ScenarioError, match="nes_q"):
        simulate_ensemble(SHORT, 2, {"nes_q": 1.0}, np.random.default_rng(0))


@pytest.mark.further
def test_a_contact_at_the_very_start_of_a_step_goes_on():
    """Run 16 of these 200 met its 10th impact there, and was lost; all slide along the wall before they end."""
    many = simulate_ensemble(named_scenario("rig"), 200, {"nes_x_m": 1e-5, "nes_y_m": 1e-5}, np.random.default_rng(0))
    assert np.isfinite(many.final_state).all() and set(many.n_impacts) == {50} and set(many.n_contacts) == {1}


def test_a_real_cluster_that_loses_a_worker_gives_the_same():
    """A local scheduler with two worker processes; one is killed while it works."""
    distributed = pytest.importorskip("distributed")
    scenario = replace(SHORT, duration_s=1.0)
    alone = simulate_ensemble(scenario, 400, SPREAD, np.random.default_rng(9), workers=Workers(chunk=20))
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        victim = next(iter(cluster.workers.values()))
        killed = []

        def kill_once(_done):
            if not killed:
                killed.append(victim.pid)
                victim.process.process._process.kill()

        workers = Workers(client=client, chunk=20, progress=kill_once)
        spread = simulate_ensemble(scenario, 400, SPREAD, np.random.default_rng(9), workers=workers)
    assert killed
    assert np.array_equal(alone.final_state, spread.final_state)
