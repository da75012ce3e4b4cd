"""The answer as JSON's own values, as a `[model]` section, and in a line for the terminal."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from analysis.comparison.simulated_rig import simulated_wall
from analysis.flights.equation.parameters import INDEX
from analysis.flights.stated_terms import DRIFT_OF_RUN, share_at_start
from analysis.gap.estimates import LAW, Estimates, value_of
from analysis.gap.ladder import Ladder
from analysis.walls.drawn import identified_wall
from analysis.walls.outlines import TURN
from ovines.core.effects import EFFECTS
from ovines.recording_schema import Nominal

# Lengths are written to a tenth of a micrometre: no wall is known better.
LENGTH_DIGITS = 7


def plain(value: Any) -> Any:
    """JSON's own values: numpy numbers as Python's, and null where a number could not be determined (JSON knows no
    NaN).
    """
    if isinstance(value, dict):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def model_section(
    summary: dict[str, Any],
    model: Nominal | None,
    values: dict[str, float],
    lengths: Mapping[str, Any] | None = None,
) -> str:
    """The improved nominal model as the ``[model]`` section of recording.toml: known effects and the ones found, with
    their sizes, and the parameters' ``values`` beside them (:func:`model_values`); ``lengths`` of the wall, where the
    stated ones are wrong, before it (:func:`wall_lengths`).
    """
    known = list(model.effects) if model else ["floor_friction", "spin_coupling"]
    # A wall elsewhere than stated is no effect of a simulator: it takes the lengths that it is given.
    added = [name for name in summary["effects"] if name not in known and name in EFFECTS]
    if "floor_friction" in added and "spin_coupling" not in known:
        added.append("spin_coupling")
    lines = [
        "[model]",
        "# " + summary["verdict"] + (": " + ", ".join(summary["effects"]) if summary["effects"] else ""),
        f"effects = {json.dumps(known + added)}",
        *(f"{name} = {_within(name, value):.6g}" for name, value in values.items()),
    ]
    sizes = {name: dict(one) for name, one in (model.effect_parameters if model else {}).items()}
    sizes |= {
        effect: {name: one["value"] for name, one in parameters.items()}
        for effect, parameters in summary["parameters"].items()
        if effect in EFFECTS
    }
    for effect, given in sizes.items():
        inside = EFFECTS[effect].nearest(given)
        if any(p.default is None and p.name not in inside for p in EFFECTS[effect].parameters):
            continue  # a recoil of a disk whose mass is not known
        lines += ["", f"[model.effect_parameters.{effect}]", *(f"{n} = {v:.6g}" for n, v in inside.items())]
    if lengths:
        length_lines = [f"{name} = {json.dumps(value)}" for name, value in lengths.items()]
        lines = [
            "# in place of the same keys of [bodies.host] in recording.toml",
            "[bodies.host]",
            *length_lines,
            "",
            *lines,
        ]
    return "\n".join(lines) + "\n"


def wall_lengths(ladder: Ladder, estimates: Estimates) -> dict[str, Any]:
    """The wall's lengths as identified (m), by the keys of ``[bodies.host]``; none where the stated ones hold.

    Of flat sides their distances from their common centre: where it lies, and how the sides are turned together, are
    effects and placement of their own."""
    if not any(cause.effect == "stated_radius" for cause in ladder.causes):
        return {}
    recording = ladder.measured.recordings[0]
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    assert host is not None and nes is not None, "no wall without a Host and a disk"
    wall = identified_wall(estimates.with_effect.table, recording)
    wall = wall.moved({TURN: -wall.values().get(TURN, 0.0)})
    wall = wall.shifted(-wall.centre_m)
    drawn = simulated_wall(wall, nes.radius_m)
    lengths = {
        "inner_radius_m": drawn["radius_m"],
        "polygon_m": drawn["polygon_m"],
        "obstacle_radius_m": drawn["obstacle_radius_m"],
    }
    return {name: np.round(value, LENGTH_DIGITS).tolist() for name, value in lengths.items() if value is not None}


def _within(name: str, value: float) -> float:
    """A nominal parameter as ``[model]`` takes it: an estimate may lie beyond what can be (a restitution of the slowest
    impacts, where none was slow), and is written at the bound."""
    low = -1.0 if name == "tangential_restitution" else 0.0
    return min(max(value, low), 1.0 if "restitution" in name else math.inf)


def model_values(ladder: Ladder, estimates: Estimates) -> dict[str, float]:
    """Parameters with the effects as a scenario takes them: the restitution of the slowest impacts where it falls with
    the speed, the floor friction at the start of the first run where it drifts."""
    table, values = estimates.with_effect.table, dict[str, float | None]()
    if ladder.impacts.fitted is not None:
        values |= {name: value_of(table, name)[0] for name in LAW}
    friction = value_of(table, "floor_friction")[0]
    if friction is not None:
        fitted = ladder.flights.fitted.model
        held = {"drift": float(fitted.parameters[INDEX["drift"]]), DRIFT_OF_RUN: fitted.drift_per_run}
        rows = {"drift": "friction_drift_per_s", DRIFT_OF_RUN: "friction_drift_per_run"}
        estimated = {term: value_of(table, row)[0] for term, row in rows.items()}
        drift = {term: held[term] if value is None else value for term, value in estimated.items()}
        values["floor_friction"] = friction * share_at_start(drift, [run.data.start_s for run in ladder.series.runs])
    return {name: value for name, value in values.items() if value is not None and math.isfinite(value)}


def answer_in_words(summary: dict[str, Any]) -> str:
    """The answer in a few lines for the terminal."""
    if summary["verdict"] == "none":
        return (
            "none: the nominal model explains these data; the smallest sizes that would have been seen stand in "
            "diagnosis.json"
        )
    gap, said = summary["gap"], []
    if summary["effects"]:
        said.append(
            f"effect: {', '.join(summary['effects'])}; gap shrinks by {100 * gap['shrinkage']:.0f} % "
            f"({100 * gap['shrinkage_low']:.0f}..{100 * gap['shrinkage_high']:.0f} %)"
        )
    said += [
        f"unknown: something is left in the {left['stage']} ({left['coordinate']}); it goes with {left['goes_with']}"
        for left in summary["left"]
    ]
    return "\n".join(said)
