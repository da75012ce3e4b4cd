"""The numbers of a law by name, with what their uncertainty is after merging and turning: by differences."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.candidate import Candidate, with_coefficients
from ovines.core.laws.terms import Factor, Term, WrittenLaw
from ovines.core.laws.words import QUANTITIES, TARGETS, TRAINS

Array = NDArray[np.float64]
UNITS = {"m": "_m", "m/s": "_m_per_s", "rad": "_rad", "rad/s": "_rad_per_s", "s": "_s", "1": ""}
SCALED = ("exponential", "gaussian", "below", *TRAINS)
# Step of a difference, over a number's sd.
STEP_SD = 0.1


def named_numbers(law: WrittenLaw) -> dict[str, tuple[float, str]]:
    """Name -> (value, unit) of every number of a law: coefficients first, then what stands inside."""
    out: dict[str, tuple[float, str]] = {}
    many = len(law.terms) > 1
    for i, term in enumerate(law.terms):
        tail = f"_{i + 1}" if many else ""
        out[f"coefficient{tail}"] = (term.coefficient, term.unit)
    for i, term in enumerate(law.terms):
        tail = f"_{i + 1}" if many else ""
        own: dict[str, tuple[float, str]] = {}
        _of_target(term, own)
        for factor in term.factors:
            _of_factor(factor, term, own)
        out |= {name + tail: value for name, value in own.items()}
    return out


def _of_target(term: Term, out: dict[str, tuple[float, str]]) -> None:
    kind = TARGETS[term.target].own
    if kind == "angle":
        out["direction_rad"] = (term.x, "rad")
    elif kind == "axis":
        out["axis_rad"] = (term.x, "rad")
    elif kind:
        out["place_x_m"], out["place_y_m"] = (term.x, "m"), (term.y, "m")


def _of_factor(one: Factor, term: Term, out: dict[str, tuple[float, str]]) -> None:
    entry = QUANTITIES[one.quantity]
    if entry.own in ("room", "host") and (one.x, one.y) != (term.x, term.y):
        out["place_x_m"], out["place_y_m"] = (one.x, "m"), (one.y, "m")
    elif entry.own == "line":
        out["offset_m"] = (one.x, "m")
        if one.y != term.x:
            out["line_rad"] = (one.y, "rad")
    elif one.quantity == "velocity_along":
        if one.x != term.x:
            out["line_rad"] = (one.x, "rad")
    elif one.x != 0.0:
        out[f"{one.quantity}_zero{UNITS[entry.unit]}"] = (one.x, entry.unit)
    if one.function in SCALED or one.scale != 1.0:
        word = "period" if one.function in TRAINS else "scale"
        out[f"{one.quantity}_{word}{UNITS[entry.unit]}"] = (one.scale, entry.unit)
    if one.function in TRAINS:
        out[f"{one.quantity}_width{UNITS[entry.unit]}"] = (one.order, entry.unit)


def law_at(parts: tuple[Candidate, ...], values: Array, covariance: Array | None = None) -> WrittenLaw:
    """The law of ``parts`` at ``values``: coefficients of all terms, then the numbers inside each part."""
    count = sum(len(part.terms) for part in parts)
    numbers, moved = values[count:], []
    for part in parts:
        own, numbers = numbers[: len(part.numbers)], numbers[len(part.numbers) :]
        moved.append(part.at(own.tolist()))
    terms = [term for part in moved for term in part.terms]
    own_covariance = np.zeros((count, count)) if covariance is None else covariance[:count, :count]
    return WrittenLaw(with_coefficients(terms, values[:count], own_covariance))


def with_sds(
    build: Callable[[Array], WrittenLaw], values: Array, covariance: Array
) -> dict[str, tuple[float, float, str]]:
    """Name -> (value, sd, unit) of the law that ``build`` makes of ``values`` (V,) with ``covariance`` (V, V)."""
    middle = named_numbers(build(values))
    jacobian = np.zeros((len(middle), len(values)))
    for j, sd in enumerate(np.sqrt(np.maximum(np.diag(covariance), 0.0))):
        if not sd > 0:
            continue
        step = np.zeros(len(values))
        step[j] = STEP_SD * sd
        ahead, behind = (named_numbers(build(values + sign * step)) for sign in (1.0, -1.0))
        for i, name in enumerate(middle):
            if name in ahead and name in behind:
                difference = ahead[name][0] - behind[name][0]
                if name.endswith("_rad"):  # an angle's ends meet
                    difference = float(np.angle(np.exp(1j * difference)))
                jacobian[i, j] = difference / (2 * STEP_SD * sd)
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, covariance, jacobian), 0.0))
    return {name: (value, float(sd), unit) for (name, (value, unit)), sd in zip(middle.items(), spread, strict=True)}
