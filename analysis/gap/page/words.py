"""Names, units and formats in which the gap's page speaks of effects and their parameters."""

from __future__ import annotations

import re
from math import isfinite

from analysis.gap.tests_by_hand import words_of
from analysis.report.numbers import MISSING, interval, with_unit

STAGES = {
    "measurement": "in the measurement",
    "flight": "in free flight",
    "impact": "at the impacts",
    "geometry": "in the geometry of the contact",
    "drive": "in the drive",
}
#: ending of a parameter's name -> (factor to the shown unit, unit); longest first
_UNITS = (
    ("per_run", 100.0, "% per run"),
    ("direction_rad", 57.29578, "°"),
    ("rad", 1e3, "mrad"),
    ("px", 1.0, "px"),
    ("_hz", 1.0, "Hz"),
    ("_kg", 1.0, "kg"),
    ("_m", 1e3, "mm"),
    ("_s", 1e6, "µs"),
)
# A unit put together at a name's end: swirl_per_s2, slope_s_per_m, velocity_m_per_s.
_COMPOSED = re.compile(r"_(?:(m|s|rad|kg)_)?per_(m|s)(2|3|)$")
_POWERS = {"": "", "2": "²", "3": "³"}
_NAMES = {
    "restitution_fast": "restitution of fast impacts",
    "relative_per_s": "change over a run",
    "relative_per_run": "change from run to run",
    "sd_s": "scatter over the speed",
}
#: parameters that are ratios to 1
RATIOS = ("ratio", "scale")


def plain(effect: str) -> str:
    """Name for people; one that nobody has words for stays itself with its underscores gone."""
    words = words_of(effect)
    return words.title if words is not None else effect.replace("_", " ")


def meaning(effect: str) -> str:
    """What an effect is, in a phrase; empty for one that nobody has words for."""
    words = words_of(effect)
    return words.phrase if words is not None else ""


def unit_of(parameter: str) -> tuple[float, str]:
    """Factor and unit in which a parameter is shown, from its name's ending."""
    if parameter == "relative_per_s":
        return 100.0, "% per s"
    composed = _COMPOSED.search(parameter)
    if composed is not None:
        above, below, power = composed.groups()
        return 1.0, f"{above or '1'}/{below}{_POWERS[power]}"
    return next(((factor, unit) for ending, factor, unit in _UNITS if parameter.endswith(ending)), (1.0, ""))


def shown(parameter: str, value: float | None, digits: int = 3) -> str:
    """``tilt_rad, 0.01755`` -> ``17.6 mrad``; ratios to five decimals, because their fourth decides."""
    if value is None or not isfinite(value):
        return MISSING
    if parameter in RATIOS:
        return f"{value:.5f}"
    factor, unit = unit_of(parameter)
    return with_unit(factor * value, unit, digits)


def shown_interval(parameter: str, low: float, high: float) -> str:
    """An interval in the unit in which the parameter is shown."""
    if parameter in RATIOS:
        return f"{low:.5f} to {high:.5f}"
    factor, unit = unit_of(parameter)
    return interval(factor * low, factor * high, unit)


def parameter_words(parameter: str) -> str:
    """``speed_scale_m_per_s`` -> ``speed scale``."""
    if parameter in _NAMES:
        return _NAMES[parameter]
    parameter = _COMPOSED.sub("", parameter)
    for ending in ("_rad", "_px", "_hz", "_kg", "_m", "_s"):
        if parameter.endswith(ending) and len(parameter) > len(ending):
            return parameter[: -len(ending)].replace("_", " ")
    return parameter.replace("_", " ")


def bare(text: str) -> str:
    """A title as it stands within a sentence."""
    return text[0].lower() + text[1:] if text[:2].istitle() else text
