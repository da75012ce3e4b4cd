"""Do the intervals of an answer hold the true sizes, and do its limits of detection?"""

import math
from typing import Any


def parameter_checks(truth: dict[str, Any], answer: dict[str, Any]) -> list[dict[str, Any]]:
    """One entry per parameter that both truth and answer name, for the causes found.

    `inside` tells whether low <= true <= high. Angles are compared on the circle of their cause's symmetry.
    """
    out = []
    for cause in truth["effects"]:
        stated = (answer.get("parameters") or {}).get(cause) or {}
        # Two views tell the one window from the other's opposite only; answers speak of the second view's pixels.
        second = cause == "sensor_window_offset" and (truth.get("measurement") or {}).get("window_camera") == 1
        for name, size in truth["parameters"][cause].items():
            true = -size if second else size
            interval = stated.get(name)
            if interval is None or interval.get("low") is None or interval.get("high") is None:
                continue
            turn = _period(cause, truth["parameters"][cause]) if name == "direction_rad" else None
            value = true if turn is None else true + turn * round((interval["value"] - true) / turn)
            out.append(
                {
                    "cause": cause,
                    "parameter": name,
                    "true": true,
                    "value": interval["value"],
                    "low": interval["low"],
                    "high": interval["high"],
                    "inside": interval["low"] <= value <= interval["high"],
                }
            )
    return out


def _period(cause: str, sizes: dict[str, float]) -> float:
    """The angle after which a direction means the same: a line to and fro has two, lobes as many as they are."""
    order = 2.0 if cause in ("wall_ellipticity", "host_sway") else sizes.get("order", 1.0)
    return 2 * math.pi / order


def _departure(name: str, value: float) -> float:
    """How far a parameter is from doing nothing: ratios from one, everything else from zero."""
    return abs(value - 1.0) if name in ("scale", "ratio") and value > 0.5 else abs(value)


def missed_above_limit(truth: dict[str, Any], answer: dict[str, Any]) -> bool | None:
    """Whether the cause was as large as the answer "none" says it would have seen; None where it says
    nothing.

    Offsets with an x and a y count by their length, whichever of the two the answer names.
    """
    cause = truth["effects"][0]
    limit = (answer.get("detectable") or {}).get(cause)
    if answer["verdict"] != "none" or not limit or limit.get("size") is None:
        return None
    true, name = truth["parameters"][cause], limit["parameter"]
    if name in ("x_m", "y_m", "x_rad", "y_rad", "u_px", "v_px", "offset_m"):
        return math.hypot(*true.values()) >= limit["size"]
    if name not in true:
        return None
    return _departure(name, true[name]) >= _departure(name, limit["size"])
