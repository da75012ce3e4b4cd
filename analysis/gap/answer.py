"""The answer as JSON's own values, as a `[model]` section, and in a line for the terminal."""

from __future__ import annotations

import json
import math
from typing import Any

from ovines.recording import Recording


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


def model_section(summary: dict[str, Any], recording: Recording) -> str:
    """The improved nominal model as the ``[model]`` section of recording.toml: known effects and the ones found,
    parameters refitted.
    """
    known = list(recording.model.effects) if recording.model else ["floor_friction", "spin_coupling"]
    added = [name for name in summary["effects"] if name not in known]
    if "floor_friction" in added and "spin_coupling" not in known:
        added.append("spin_coupling")
    lines = [
        "[model]",
        "# " + summary["verdict"] + (": " + ", ".join(summary["effects"]) if summary["effects"] else ""),
        f"effects = {json.dumps(known + added)}",
    ]
    for name in ("restitution", "wall_friction", "tangential_restitution", "floor_friction"):
        value = summary["nominal"].get(name, {}).get("with_effect")
        if value is not None:
            lines.append(f"{name} = {value:.6g}")
    for effect, parameters in summary["parameters"].items():
        for parameter, interval in parameters.items():
            lines.append(
                f"# {effect}.{parameter} = {interval['value']:.6g}  (90 %: {interval['low']:.6g} .. "
                f"{interval['high']:.6g})"
            )
    return "\n".join(lines) + "\n"


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
