"""Energies by channel: they add up at every instant, and each channel is what its law says."""

from dataclasses import replace

import numpy as np
import pytest

from ovines.core import simulate, simulate_ensemble
from ovines.core.energies import LOSSES, STORES
from ovines.core.refusal import ScenarioError
from ovines.core.sweep import sweep
from ovines.core.system.named import named_scenario


@pytest.mark.parametrize("name", ["table-3", "table-4-positive", "table-13", "table-15-case-2", "rig", "triangle"])
def test_they_add_up_at_every_sample_and_grow_only(name):
    result = simulate(named_scenario(name), with_energies=True)
    e = result.energies
    assert np.abs(e["residual_j"]).max() < 1e-9 * result.energy.exchanged
    for channel in LOSSES:
        assert np.diff(e[channel]).min() > -1e-12 * result.energy.exchanged, channel
        assert e[channel][-1] == pytest.approx(result.energy.losses[channel], rel=1e-6, abs=1e-12)
    assert set(e) == {"time_s", *STORES, *LOSSES, "work_j", "residual_j"}


def test_each_impact_loses_what_luding_says():
    """Round wall, heavy Host: m (v_n^2 - v_n'^2)/2 along the normal, the same with m/(1 + 1/q) along the tangent."""
    result = simulate(named_scenario("obstacle"), with_energies=True)
    rows, mass = result.impacts, result.scenario.nes.mass_kg

    def lost(side: str, inertia: float) -> np.ndarray:
        before, after = (rows[f"{side}_speed_{when}_m_per_s"] for when in ("before", "after"))
        return 0.5 * inertia * (before**2 - after**2)

    assert np.allclose(rows["energy_lost_j"] - rows["wall_friction_loss_j"], lost("normal", mass), atol=1e-14)
    assert np.allclose(rows["wall_friction_loss_j"], lost("tangential", mass / 3.0), atol=1e-14)
    assert len(result.contacts) == 0
    assert np.sum(rows["wall_friction_loss_j"]) == pytest.approx(result.energy.losses["wall_friction_loss_j"])


def test_a_sliding_stop_heats_the_floor_alone():
    slide = simulate(named_scenario("coulomb-stop")).energy
    assert slide.losses["floor_sliding_loss_j"] == pytest.approx(0.5 * 10.0, rel=1e-6)
    both = simulate(named_scenario("farkas-stop")).energy
    assert both.losses["floor_sliding_loss_j"] + both.losses["floor_spinning_loss_j"] == pytest.approx(25.5, rel=1e-6)
    assert slide.losses["floor_spinning_loss_j"] == 0.0 and slide.worked == 0.0


def test_copies_carry_the_energies_of_single_runs():
    scenario = replace(named_scenario("rig"), duration_s=0.2)
    x = np.array([0.028, 0.03])
    rng = np.random.default_rng(0)
    copies = simulate_ensemble(scenario, 2, {"nes_x_m": x}, rng, tolerance=scenario.tolerance, with_energies=True)
    single = simulate(scenario).energy
    for name, value in single.losses.items():
        assert copies.energies[name][1] == pytest.approx(value, rel=1e-9, abs=1e-15)
    assert copies.energies["work_j"][1] == pytest.approx(single.worked, rel=1e-9)


def test_a_sweep_has_a_row_for_each_point_whatever_varies():
    scenario = replace(named_scenario("rig"), duration_s=0.1)
    over = {"restitution": [0.5, 0.7], "host_radius_m": [0.05, 0.055, 0.06]}
    rows = sweep(scenario, over, 4, {"nes_x_m": 1e-4}, np.random.default_rng(0))
    assert [(row["restitution"], row["host_radius_m"]) for row in rows] == [
        (a, b) for a in (0.5, 0.7) for b in over["host_radius_m"]
    ]
    alone = simulate(replace(scenario, impact=replace(scenario.impact, restitution=0.7)))
    exact = sweep(scenario, {"restitution": [0.7]}, 1, {}, np.random.default_rng(0))[0]
    assert exact["impacts_per_s_mean"] == pytest.approx(len(alone.impacts) / 0.1)
    with pytest.raises(ScenarioError, match="colour"):
        sweep(scenario, {"colour": [1.0]}, 1, {}, np.random.default_rng(0))
