"""Effects that ``[model]`` names without a size are fitted by identification: a drift of the friction, an inertia."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from analysis.blind.recording.files import write_series
from analysis.blind.series import make_series
from analysis.contact.law import Circumstances, LawData, fit_restitution
from analysis.contact.restitution import (
    DIRECTION,
    DRIFT,
    RESTITUTION_EFFECTS,
    SPEED,
    Conditions,
    conditions,
    fit_effects,
    held_restitution,
    restitution_design,
)
from analysis.flights.stated_terms import drift_from_the_start
from analysis.identify import identify_series
from ovines.pipeline.series.diagnosis import load_series
from ovines.recording import read_series


def identified(folder, kind: str, seed: int) -> tuple[pd.DataFrame, dict[str, float], list[float], tuple[str, ...]]:
    """Rows with ``[model]`` that names ``kind``, the truth, times of the runs' first frames, and notes."""
    made = make_series(kind, 0.5, np.random.default_rng(seed), runs=2, noise="white")
    write_series(made, folder)
    series, _ = load_series(read_series(folder), folder / "results")
    model = series.recordings[0].model
    model = model.model_copy(update={"effects": (*model.effects, kind)})
    named = [replace(r, settings=r.settings.model_copy(update={"model": model})) for r in series.recordings]
    table, each = identify_series(series.motions, named)
    starts_s = [run.data.start_s for run in series.runs]
    return table.set_index("parameter"), made.truth["parameters"][kind], starts_s, each[0].notes


@pytest.mark.further
@pytest.mark.parametrize("seed", [20, 21])
def test_a_drift_of_the_friction_is_fitted_within_runs_and_over_them(tmp_path, seed):
    """Seed 20 drifts within runs of unequal length, from their starts on; seed 21 from run to run."""
    found, true, starts_s, notes = identified(tmp_path / "s", "friction_drift", seed)
    assert np.ptp(starts_s) > 0.05 and set(true) == {"relative_per_s" if seed == 20 else "relative_per_run"}
    rows = [tuple(found.loc[f"friction_drift_per_{unit}", ["value", "sd"]].astype(float)) for unit in ("s", "run")]
    for name, (value, sd) in drift_from_the_start(*rows, starts_s).items():
        assert abs(value - true.get(name, 0.0)) < 3.5 * sd < 0.1, (name, value, sd, true)
    assert not notes  # nothing is left that acts on the disk


@pytest.mark.further
def test_an_inertia_is_fitted(tmp_path):
    found, true, _, notes = identified(tmp_path / "s", "inertia_error", 3)
    value, sd = found.loc["inertia_ratio", ["value", "sd"]].astype(float)
    assert abs(value - true["ratio"]) < 3.5 * sd < 0.05
    assert not notes


def impacts(rng: np.random.Generator, restitution) -> LawData:
    """Impacts of five runs whose restitution is a function of the conditions, to 0.1 %."""
    n = 300
    at = Conditions(rng.uniform(0.2, 3, n), rng.uniform(-np.pi, np.pi, n), rng.uniform(0, 1, n), rng.integers(0, 5, n))
    before, none = at.before, np.zeros(n)
    after = restitution(at) * before * (1 + 1e-3 * rng.standard_normal(n))
    sd = np.full(n, 1e-3)
    return LawData(
        before, after, none, before + after, none, none, sd, sd, sd,
        Circumstances(none, at.run, at.since_start_s, at.azimuth_rad, none, none, none, np.arange(n)), 0.5,
    )  # fmt: skip


SIZES = {
    SPEED: {"restitution_fast": 0.55, "speed_scale_m_per_s": 1.1},
    DIRECTION: {"amplitude": 0.05, "direction_rad": 2.0},
    DRIFT: {"relative_per_s": 0.0, "relative_per_run": 0.03},
}


@pytest.mark.parametrize("effect", RESTITUTION_EFFECTS)
def test_effects_on_the_restitution_fitted_and_held(effect):
    """The size of each is found within its sd, and with it held the restitution to which a scenario adds it is the
    same, beside another one that is fitted, too."""
    slow = 0.82

    def truth(at: Conditions) -> np.ndarray:
        slope, offset, _ = held_restitution(at, {effect: SIZES[effect]})
        return offset + slope * slow

    data = impacts(np.random.default_rng(5), truth)
    fitted = fit_effects(data, [effect], {})
    assert abs(fitted.value - slow) < 3.5 * fitted.sd < 0.05
    for name, (value, sd) in fitted.sizes[effect].items():
        assert abs(value - SIZES[effect][name]) < 3.5 * sd < 0.2, (name, value, sd)
    held = fit_effects(data, [effect], {effect: SIZES[effect]})
    assert not held.sizes and abs(held.value - slow) < 3.5 * held.sd < 0.01
    beside = fit_effects(data, [effect, DIRECTION if effect != DIRECTION else DRIFT], {effect: SIZES[effect]})
    assert abs(beside.value - slow) < 4 * beside.sd
    ((_, sizes),) = beside.sizes.items()
    for name, (value, sd) in sizes.items():
        assert name == "direction_rad" or abs(value) < 4 * sd, (name, value, sd)


def test_what_drifts_is_the_whole_restitution():
    """A fall with the speed beside a strong drift: added to each other, the fast limit had been off by half of it."""
    both = {SPEED: SIZES[SPEED], DRIFT: {"relative_per_s": 0.17, "relative_per_run": -0.03}}

    def truth(at: Conditions) -> np.ndarray:
        slope, offset, _ = held_restitution(at, both)
        return offset + slope * 0.82

    data = impacts(np.random.default_rng(6), truth)
    fitted = fit_effects(data, [SPEED, DRIFT], {})
    for effect, sizes in fitted.sizes.items():
        for name, (value, sd) in sizes.items():
            assert abs(value - both[effect][name]) < 3.5 * sd < 0.1, (name, value, sd)
    assert abs(fitted.value - 0.82) < 3.5 * fitted.sd
    np.testing.assert_allclose(fitted.at(conditions(data)), truth(conditions(data)), rtol=0, atol=3e-3)
    # Nor is anything left for the design in which gains are judged.
    assert fit_restitution(data, restitution_design(data, [SPEED, DRIFT]))[2] < 2e-3
