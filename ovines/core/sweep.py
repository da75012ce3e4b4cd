"""A scenario over ranges of one or two of its numbers: an ensemble at each point, and what it says."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from ovines.core.energies import LOSSES
from ovines.core.ensemble import ALL_CORES, SPREADABLE, EnsembleResult, Spread, Workers, simulate_ensemble
from ovines.core.refusal import require
from ovines.core.system.model import Scenario

# Numbers that are a scenario's own, not a run's: an ensemble for each value.
OWN: dict[str, Callable[[Scenario, float], Scenario]] = {
    "nes_radius_m": lambda scenario, value: replace(scenario, nes=replace(scenario.nes, radius_m=value)),
    "nes_mass_kg": lambda scenario, value: replace(scenario, nes=replace(scenario.nes, mass_kg=value)),
    "host_radius_m": lambda scenario, value: replace(scenario, host=replace(scenario.host, radius_m=value)),
    "obstacle_radius_m": lambda scenario, value: replace(
        scenario, host=replace(scenario.host, obstacle_radius_m=value)
    ),
}
SWEPT = (*OWN, *SPREADABLE)
OUTCOMES = ("impacts_per_s", "contact_share", "speed_m_per_s", "spin_rad_per_s")


def sweep(
    scenario: Scenario,
    over: Mapping[str, Sequence[float]],
    runs: int,
    spread: Mapping[str, Spread],
    rng: np.random.Generator,
    workers: Workers = ALL_CORES,
) -> list[dict[str, float]]:
    """``runs`` scattered copies of ``scenario`` at every combination of the values in ``over`` (names of
    :data:`SWEPT`): a row per point, the first name running slowest.

    A row has the point, mean, sd, median, 5 % and 95 % of each of :data:`OUTCOMES` over the runs, and the mean power
    (W) of every channel of loss and of the driver.  ``spread`` and ``workers`` as in
    :func:`ovines.core.ensemble.simulate_ensemble`.
    """
    for name, values in over.items():
        require(name in SWEPT, f"a sweep of {name!r}", "one of " + ", ".join(SWEPT), "correct the name")
        require(len(values) > 0, f"no values of {name}", "one or more", "give the range and how many")
    points = [dict(zip(over, values, strict=True)) for values in product(*over.values())]
    rows = []
    for own in sorted({tuple((k, v) for k, v in point.items() if k in OWN) for point in points}):
        changed = scenario
        for name, value in own:
            changed = OWN[name](changed, value)
        here = [point for point in points if all(point[name] == value for name, value in own)]
        swept = {name: np.repeat([point[name] for point in here], runs) for name in over if name not in OWN}
        found = simulate_ensemble(
            changed, runs * len(here), {**spread, **swept}, rng, with_energies=True, workers=workers
        )
        rows += [point | summary(found, slice(k * runs, (k + 1) * runs)) for k, point in enumerate(here)]
    return sorted(rows, key=lambda row: [row[name] for name in over])


def summary(found: EnsembleResult, runs: slice) -> dict[str, float]:
    """What some runs of an ensemble gave, in numbers."""
    end, state = found.end_s[runs], found.final_state[runs]
    values = {
        "impacts_per_s": found.n_impacts[runs] / end,
        "contact_share": found.contact_s[runs] / end,
        "speed_m_per_s": np.hypot(state[:, 2] - state[:, 8], state[:, 3] - state[:, 9]),
        "spin_rad_per_s": np.abs(state[:, 5] - state[:, 11]),
    }
    row: dict[str, float] = {}
    for name in OUTCOMES:
        low, middle, high = np.percentile(values[name], [5, 50, 95])
        row |= {f"{name}_mean": float(np.mean(values[name])), f"{name}_sd": float(np.std(values[name]))}
        row |= {f"{name}_median": float(middle), f"{name}_low": float(low), f"{name}_high": float(high)}
    for name in (*LOSSES, "work_j"):
        row[f"{name.removesuffix('_j')}_w"] = float(np.mean(found.energies[name][runs] / end))
    return row
