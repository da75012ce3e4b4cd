"""Against a plant that shares no code: the practice series' truth, up to the first impact and along the wall."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ovines.core import FloorFriction, Harmonic, Host, ImpactLaw, Nes, Scenario, simulate

TRUTH = Path(__file__).resolve().parents[3].parent / "shared" / "practice_truth"
AXES = ("x", "y", "rotation", "z")
pytestmark = pytest.mark.skipif(not TRUTH.is_dir(), reason="the shared practice truth is not beside the checkout")


def plant(run):
    """Scenario from the truth's first state, all states, impacts, sustained contacts of a run of practice-01."""
    about = json.loads((TRUTH / "practice-01.json").read_text())["plant"]
    data = np.load(TRUTH / "practice-01.npz")
    states = data[f"state{run:02d}"][:, :6]
    drive = tuple(Harmonic(AXES[int(a)], size, w / (2 * math.pi), phase) for a, size, w, phase in data[f"H{run:02d}"])
    scenario = Scenario(
        "plant", Nes(0.01, 0.0246), Host(0.05, motion="driven", drive=drive),
        ImpactLaw(about["eps"], about["mu_c"], about["beta0"]), (len(states) - 1) / 800,
        FloorFriction(about["mu_s"]), tuple(states[0]),
    )  # fmt: skip
    return scenario, states, data[f"imp{run:02d}"], data[f"held{run:02d}"]


@pytest.mark.parametrize("run", [1, 2, 3])
def test_flight_and_first_impact(run):
    scenario, states, impacts, _ = plant(run)
    result = simulate(replace(scenario, duration_s=float(impacts[0, 0]) + 1e-3))
    n = int(impacts[0, 0] * 800)
    distance = np.hypot(result.motion["nes_x_m"][:n] - states[:n, 0], result.motion["nes_y_m"][:n] - states[:n, 1])
    assert np.max(distance) < 2e-9  # measured 8e-10: the plant's own tolerance
    first = result.impacts[0]
    assert first["time_s"] == pytest.approx(impacts[0, 0], abs=1e-7)
    assert first["normal_speed_before_m_per_s"] == pytest.approx(impacts[0, 1], abs=1e-4)
    assert first["tangential_speed_before_m_per_s"] == pytest.approx(impacts[0, 2], abs=1e-4)


@pytest.mark.parametrize("run", [1, 2, 3])
def test_sliding_along_the_moving_wall(run):
    """From a state inside the truth's sustained contact, put back onto the wall (the plant drifts 1e-7 m off it)."""
    scenario, states, _, held = plant(run)
    start = int(held[0, 0] * 800) + 3
    shift, n = start / 800, int(held[0, 1] * 800) - start - 1
    drive = tuple(replace(h, phase_rad=h.phase_rad + 2 * math.pi * h.frequency_hz * shift) for h in scenario.host.drive)
    x, y = (sum(h.amplitude * math.sin(h.phase_rad) for h in drive if h.axis == axis) for axis in "xy")
    state = states[start].copy()
    away = math.hypot(state[0] - x, state[1] - y)
    state[:2] = [x + (state[0] - x) * 0.04 / away * (1 - 1e-15), y + (state[1] - y) * 0.04 / away * (1 - 1e-15)]
    later = replace(scenario, host=replace(scenario.host, drive=drive), initial_nes=tuple(state), duration_s=n / 800)
    result = simulate(later)
    assert len(result.contacts) == 1
    true = states[start : start + n + 1]
    distance = np.hypot(result.motion["nes_x_m"] - true[:, 0], result.motion["nes_y_m"] - true[:, 1])
    assert n > 20
    assert np.max(distance) < 1e-5  # measured 2e-6
