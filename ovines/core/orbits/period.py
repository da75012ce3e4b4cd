"""The period of a scenario's drive, and scenarios with one number changed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ovines.core.ensemble import NUMBER_PLACES, STATE_PLACES
from ovines.core.refusal import ScenarioError
from ovines.core.sensitivity.columns import row_of
from ovines.core.sweep import OWN
from ovines.core.system.model import Harmonic, Scenario

SAME = 1e-9  # two frequencies closer than this, relatively, are one
DRIVES: dict[str, Callable[[Harmonic, float], Harmonic]] = {
    "drive_amplitude_factor": lambda sine, value: replace(sine, amplitude=sine.amplitude * value),
    "drive_frequency_factor": lambda sine, value: replace(sine, frequency_hz=sine.frequency_hz * value),
    "drive_phase_shift_rad": lambda sine, value: replace(
        sine, phase_rad=sine.phase_rad + (value if sine.frequency_hz > 0.0 else 0.0)
    ),
}
CHANGED = (*OWN, *STATE_PLACES, *NUMBER_PLACES, *DRIVES)


def harmonics(scenario: Scenario) -> tuple[Harmonic, ...]:
    """Sines of the driven Host, or of the ground under a sprung one."""
    if scenario.host.motion == "driven":
        return scenario.host.drive
    return scenario.host.suspension.ground if scenario.host.suspension is not None else ()


def drive_period_s(scenario: Scenario) -> float:
    """The shortest time after which every sine of the drive comes back; `ScenarioError` where there is none."""
    rates = np.array([sine.frequency_hz for sine in harmonics(scenario) if sine.frequency_hz > 0.0])
    if not len(rates) or scenario.host.table is not None:
        raise ScenarioError("a scenario without a periodic drive", "sines of the Host or the ground", "give the period")
    for cycles in range(1, 1001):
        turns = rates / rates.min() * cycles
        if np.max(np.abs(turns - np.round(turns))) < SAME * cycles:
            return float(cycles / rates.min())
    raise ScenarioError(
        f"frequencies {', '.join(f'{rate:g}' for rate in rates)} Hz", "ratios of whole numbers", "give the period"
    )


def changed(scenario: Scenario, name: str, value: float) -> Scenario:
    """The scenario with the number called ``name`` (:data:`CHANGED`) at ``value``; factors and shifts of the drive
    count from the scenario's own.
    """
    if name in OWN:
        return OWN[name](scenario, value)
    if name in STATE_PLACES:
        row = row_of(name)
        field = "initial_nes" if row < 6 else "initial_host"
        state = list(getattr(scenario, field))
        state[row % 6] = value
        return replace(scenario, **{field: tuple(state)})  # type: ignore[arg-type]
    if name == "floor_friction":
        if scenario.friction is None:
            raise ScenarioError("floor_friction without [friction]", "a scenario with it", "add [friction]")
        return replace(scenario, friction=replace(scenario.friction, coefficient=value))
    if name in NUMBER_PLACES:
        return replace(scenario, impact=replace(scenario.impact, **{name: value}))
    if name not in DRIVES:
        raise ScenarioError(f"a change of {name!r}", "one of " + ", ".join(CHANGED), "correct the name")
    sines = tuple(DRIVES[name](sine, value) for sine in harmonics(scenario))
    if scenario.host.motion == "driven":
        return replace(scenario, host=replace(scenario.host, drive=sines))
    suspension = scenario.host.suspension
    if suspension is None:
        raise ScenarioError(f"{name} without a drive", "a driven Host, or a sprung one", "leave it out")
    return replace(scenario, host=replace(scenario.host, suspension=replace(suspension, ground=sines)))
