"""Units for display: a table's lengths, times and angles in the unit that a reader asked for; names follow.

Speeds, accelerations and spins stay in SI units: of those there is no other in use here.
"""

from __future__ import annotations

import math
from collections.abc import Collection

import pandas as pd

from ovines.errors import InputError
from ovines.tables.column import UNITS as SUFFIXES

# unit asked for -> (unit of the tables, factor)
DISPLAY = {
    "m": ("m", 1.0),
    "mm": ("m", 1e3),
    "um": ("m", 1e6),
    "s": ("s", 1.0),
    "ms": ("s", 1e3),
    "rad": ("rad", 1.0),
    "deg": ("rad", 180.0 / math.pi),
}
SI: dict[str, str] = {}
# Tables with a row per quantity: the unit is the end of its name there, and these columns hold its values.
NAMED_BY = {"parameter": ("value", "sd", "low", "high"), "quantity": ()}


def chosen_units(text: str) -> dict[str, str]:
    """``"mm,ms,deg"`` as unit of the tables -> unit asked for; `InputError` for an unknown one or two of a kind."""
    chosen: dict[str, str] = {}
    for unit in filter(None, (part.strip() for part in text.split(","))):
        if unit not in DISPLAY:
            raise InputError(f"--units {text}: {unit!r}", "of " + ", ".join(DISPLAY), "e.g. --units mm,ms,deg")
        stored = DISPLAY[unit][0]
        if stored in chosen:
            raise InputError(f"--units {text}: {chosen[stored]} and {unit}", "one unit of each kind", "leave one out")
        chosen[stored] = unit
    return chosen


def displayed(frame: pd.DataFrame, units: dict[str, str]) -> pd.DataFrame:
    """``frame`` (SI, every name ends in its unit) with columns in ``units``, renamed so that the name stays true."""
    if not units:
        return frame
    shown = {name: _shown(name, units) for name in map(str, frame.columns)}
    result = pd.DataFrame(
        {new: frame[old] * factor if factor != 1 else frame[old] for old, (new, factor) in shown.items()}
    )
    for names, values in NAMED_BY.items():
        if names in result:
            result = _rows(result, names, [column for column in values or result.columns if column in result], units)
    return result


def _rows(frame: pd.DataFrame, names: str, values: Collection[str], units: dict[str, str]) -> pd.DataFrame:
    shown = [_shown(str(name), units) for name in frame[names]]
    factors = [factor for _, factor in shown]
    scaled = {column: frame[column] * factors for column in values if pd.api.types.is_float_dtype(frame[column])}
    if names == "quantity":
        scaled.pop("time_s", None)
    return frame.assign(**scaled, **{names: [name for name, _ in shown]})


def _shown(name: str, units: dict[str, str]) -> tuple[str, float]:
    """The name in the units asked for, and the factor of its values."""
    suffix = next((suffix for suffix in SUFFIXES if name.endswith(suffix)), "")
    unit = units.get(SUFFIXES.get(suffix, ""))
    if unit is None or name.removesuffix(suffix).endswith("_per"):  # of a slope in s/m
        return name, 1.0
    return f"{name.removesuffix(suffix)}_{unit}", DISPLAY[unit][1]
