"""Scenarios with a sprung Host, and their numbers in the designer's terms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from ovines.core.orbits.period import CHANGED, changed
from ovines.core.refusal import ScenarioError
from ovines.core.system.model import FloorFriction, Scenario, Suspension


def suspension_of(scenario: Scenario) -> tuple[Suspension, float]:
    """Springs and mass of the sprung Host; `ScenarioError` where it is none."""
    suspension, mass = scenario.host.suspension, scenario.host.mass_kg
    if scenario.host.motion != "sprung" or suspension is None or mass is None:
        raise ScenarioError(
            f"a Host that is {scenario.host.motion}", "a sprung Host, whose motion the NES can change",
            "give host.motion = 'sprung' with [host.suspension]",
        )  # fmt: skip
    return suspension, mass


def _clearance(scenario: Scenario, value: float) -> Scenario:
    """The Host's radius; the disk's start keeps its part of the way to the wall."""
    made = replace(scenario, host=replace(scenario.host, radius_m=scenario.nes.radius_m + 0.5 * value))
    shrunk = 0.5 * value / ((scenario.host.radius_m or scenario.nes.radius_m + 0.5 * value) - scenario.nes.radius_m)
    nes, host = scenario.initial_nes, scenario.initial_host
    start = tuple(host[i] + shrunk * (nes[i] - host[i]) for i in range(2))
    return replace(made, initial_nes=(*start, *nes[2:]))


def _mass_ratio(scenario: Scenario, value: float) -> Scenario:
    return replace(scenario, nes=replace(scenario.nes, mass_kg=value * suspension_of(scenario)[1]))


def _floor_friction(scenario: Scenario, value: float) -> Scenario:
    friction = scenario.friction or FloorFriction(0.0)
    return replace(scenario, friction=replace(friction, coefficient=value))


OWN: dict[str, Callable[[Scenario, float], Scenario]] = {
    "clearance_m": _clearance,  # 2 R_H - 2 R_N, as the thesis has it
    "mass_ratio": _mass_ratio,
    "floor_friction": _floor_friction,
}
DESIGNED = (*OWN, "restitution", "wall_friction", "tangential_restitution")


def designed(scenario: Scenario, numbers: dict[str, float]) -> Scenario:
    """The scenario with numbers of :data:`DESIGNED`."""
    for name, value in numbers.items():
        if name not in DESIGNED and name not in CHANGED:
            raise ScenarioError(f"a design over {name!r}", "names out of " + ", ".join(DESIGNED), "correct the name")
        scenario = OWN[name](scenario, value) if name in OWN else changed(scenario, name, value)
    return scenario
