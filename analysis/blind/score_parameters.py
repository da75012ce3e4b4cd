"""Do the intervals of an answer hold the true sizes?"""

import math


def parameter_checks(truth: dict, answer: dict) -> list[dict]:
    """One entry per parameter that both truth and answer name, for the causes found.

    `inside` tells whether low <= true <= high. Angles are compared on the circle of their cause's symmetry.
    """
    out = []
    for cause in truth["effects"]:
        stated = (answer.get("parameters") or {}).get(cause) or {}
        for name, true in truth["parameters"][cause].items():
            interval = stated.get(name)
            if interval is None or interval.get("low") is None or interval.get("high") is None:
                continue
            turn = (
                (math.pi if cause == "wall_ellipticity" else 2 * math.pi) if name == "direction_rad" else None
            )
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
