"""A candidate for a law: terms of unit coefficients that belong together, and the numbers inside them; the numbers of
the law that it becomes, by name, with what their uncertainty is after merging and turning (by differences)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from ovines.core.laws.targets import MARKERS, TARGETS
from ovines.core.laws.terms import Factor, Term, WrittenLaw, wrapped
from ovines.core.laws.words import ALONG, LINES, QUANTITIES, TRAINS

Array = NDArray[np.float64]
Make = Callable[..., tuple[Term, ...]]
UNITS = {
    "m": "_m",
    "m/s": "_m_per_s",
    "rad": "_rad",
    "rad/s": "_rad_per_s",
    "s": "_s",
    "s^2/m": "_s2_per_m",
    "m/s^2": "_m_per_s2",
    "m^2/s": "_m2_per_s",
    "m^2/s^2": "_m2_per_s2",
    "1": "",
}
SCALED = (
    *("exponential", "gaussian", "below", *TRAINS, "above", "tanh", "decay"),
    *("rational", "within", "rising", "beyond"),
)
# Step of a difference, over a number's sd; and at the most over the number itself: a width stays one.
STEP_SD, STEP_SHARE = 0.1, 0.25
# A number that changes nothing within this share of its step is idle.
IDLE = 0.1
QUARTER = 0.5 * math.pi


@dataclass(frozen=True)
class Candidate:
    """``make(*numbers)`` gives the terms, each with the coefficient 1; ``steps`` by which a search moves the numbers
    (none: nothing inside to search); ``positive``: which of them are scales, moved by their logarithm; ``looked``: fall
    of -2 log L that looking for its numbers in the same data has taken in advance.

    Candidates of one ``name`` differ in their numbers alone."""

    name: str
    make: Make
    numbers: tuple[float, ...] = ()
    steps: tuple[float, ...] = ()
    positive: tuple[bool, ...] = ()
    looked: float = 0.0

    @cached_property
    def terms(self) -> tuple[Term, ...]:
        """Terms at its numbers."""
        return self.make(*self.numbers)

    @property
    def unknowns(self) -> int:
        """Coefficients and numbers inside: what chance may use."""
        return len(self.terms) + len(self.numbers)

    def at(self, numbers: Sequence[float]) -> Candidate:
        """The same with other numbers."""
        return replace(self, numbers=tuple(float(n) for n in numbers))

    def settled(self) -> Candidate:
        """The same without the numbers that change nothing where they are: a length beyond which waves do not fade."""
        one = self
        for i in reversed(range(len(self.numbers))):
            number, step = one.numbers[i], IDLE * one.steps[i]
            sides = [number * math.exp(s) if one.positive[i] else number + s for s in (-step, step)]
            if all(one.at([*one.numbers[:i], side, *one.numbers[i + 1 :]]).terms == one.terms for side in sides):
                one = replace(
                    one,
                    make=partial(_with_number, one.make, i, number),
                    numbers=(*one.numbers[:i], *one.numbers[i + 1 :]),
                    steps=(*one.steps[:i], *one.steps[i + 1 :]),
                    positive=(*one.positive[:i], *one.positive[i + 1 :]),
                )
        return one


def _with_number(make: Make, place: int, number: float, *others: float) -> tuple[Term, ...]:
    """Terms at ``others``, with a ``number`` in its ``place`` among them."""
    return make(*others[:place], number, *others[place:])


def with_coefficients(terms: Sequence[Term], values: Array, covariance: Array) -> tuple[Term, ...]:
    """Terms with their coefficients (T,) and sds; pairs along two directions, or a cosine beside its sine, are merged
    into one term with an angle."""
    items = [
        (replace(term, coefficient=float(v), sd=float(np.sqrt(max(covariance[i, i], 0.0)))), i)
        for i, (term, v) in enumerate(zip(terms, values, strict=True))
    ]
    out: list[Term] = []
    while items:
        first, i = items.pop(0)
        for place, (second, j) in enumerate(items):
            one = _merged(first, second, covariance[np.ix_([i, j], [i, j])])
            if one is not None:
                out.append(one)
                items.pop(place)
                break
        else:
            out.append(first)
    return tuple(out)


def _merged(first: Term, second: Term, covariance: Array) -> Term | None:
    a, b = first.coefficient, second.coefficient
    size = math.hypot(a, b)
    if size == 0.0 or first.target != second.target:
        return None
    along = np.array([a, b]) / size
    sd = math.sqrt(max(float(along @ covariance @ along), 0.0))
    own = TARGETS[first.target].own
    if own in ("angle", "axis", "body") and first.factors == second.factors and first.x != second.x:
        times = 2.0 if own == "axis" else 1.0
        if abs(wrapped(second.x - first.x - 0.5 * math.pi / times, math.pi)) > 1e-9:
            return None
        angle = wrapped(first.x + math.atan2(b, a) / times, 2 * math.pi / times)
        return replace(first, coefficient=size, sd=sd, x=angle)
    if own in MARKERS and first.factors == second.factors and first.x == second.x and first.y != second.y:
        return _along_line(first, a, b, sd) if abs(wrapped(second.y - first.y - QUARTER, math.pi)) < 1e-9 else None
    if (first.x, first.y) != (second.x, second.y) or len(first.factors) != len(second.factors):
        return None
    differ = [i for i, (f, g) in enumerate(zip(first.factors, second.factors, strict=True)) if f != g]
    if len(differ) != 1:
        return None
    merged_factor = _merged_factor(first.factors[differ[0]], second.factors[differ[0]], a, b)
    if merged_factor is None:
        return None
    factors = tuple(merged_factor if i == differ[0] else one for i, one in enumerate(first.factors))
    return replace(first, coefficient=size, sd=sd, factors=factors)


def _along_line(first: Term, a: float, b: float, sd: float) -> Term:
    """``a`` of a marker's term and ``b`` of that across it: one along the line of both, in the direction within an
    eighth of a turn of its factor's or ahead of it by less than three, so that what stays back is negative."""
    angle = first.y + math.atan2(b, a)
    line = first.factors[0].x if first.factors[0].quantity in ALONG else 0.0
    near = line + 0.5 * QUARTER + wrapped(angle - line - 0.5 * QUARTER, math.pi)
    size = math.hypot(a, b) * (1.0 if abs(wrapped(angle - near, 2 * math.pi)) < QUARTER else -1.0)
    return replace(first, coefficient=size, sd=sd, y=wrapped(near, 2 * math.pi))


def _merged_factor(f: Factor, g: Factor, a: float, b: float) -> Factor | None:
    """What ``a`` f + ``b`` g is, but for its size."""
    if f.quantity in ALONG and replace(g, x=f.x) == f and (f.function, f.order) == ("power", 1.0):
        # a q(x) + b q(x + pi / 2) = size q(x + arctan(b / a))
        quarter = abs(wrapped(g.x - f.x - QUARTER, 2 * math.pi)) < 1e-9
        return replace(f, x=wrapped(f.x + math.atan2(b, a), 2 * math.pi)) if quarter else None
    if QUANTITIES[f.quantity].own in LINES and replace(g, y=f.y) == f and replace(f, y=0.0) == Factor(f.quantity):
        quarter = abs(wrapped(g.y - f.y - QUARTER, 2 * math.pi)) < 1e-9
        return replace(f, y=wrapped(f.y + math.atan2(b, a), 2 * math.pi)) if quarter else None
    if (f.function, g.function) != ("cosine", "sine") or replace(g, function="cosine") != f:
        return None
    # a cos(n q / s) + b sin(n q / s) = size cos(n (q - x) / s)
    merged = replace(f, x=f.x + math.atan2(b, a) * f.scale / f.order)
    if QUANTITIES[f.quantity].circular:
        merged = replace(merged, x=wrapped(merged.x, 2 * math.pi / f.order))
    return merged


def waves(quantity: str, order: float = 1.0, scale: float = 1.0) -> tuple[Factor, Factor]:
    """Cosine and sine of a quantity."""
    return Factor(quantity, "cosine", order, scale), Factor(quantity, "sine", order, scale)


def ways(quantity: str) -> tuple[Factor, Factor]:
    """A velocity, an acceleration or a place along two directions."""
    across = Factor(quantity, y=QUARTER) if QUANTITIES[quantity].own in LINES else Factor(quantity, x=QUARTER)
    return Factor(quantity), across


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
    if kind in ("angle", "marker"):
        out["direction_rad"] = (_angle_of(term), "rad")
    elif kind in ("body", "body_marker"):
        out["body_direction_rad"] = (_angle_of(term), "rad")
    elif kind in ("camera_axis", "camera_angle"):
        out["picture_direction_rad"] = (term.y, "rad")
    elif kind == "axis":
        out["axis_rad"] = (term.x, "rad")
    elif kind in ("room", "host"):
        out["place_x_m"], out["place_y_m"] = (term.x, "m"), (term.y, "m")
    elif kind == "wind":
        out |= _wind(term)


def _wind(one: Term | Factor) -> dict[str, tuple[float, str]]:
    """Speed of the air, and the direction in which it blows."""
    return {"wind_m_per_s": (math.hypot(one.x, one.y), "m/s"), "wind_rad": (math.atan2(one.y, one.x), "rad")}


def _angle_of(term: Term) -> float:
    """A term's own angle (rad)."""
    return term.y if TARGETS[term.target].own in MARKERS else term.x


def _of_factor(one: Factor, term: Term, out: dict[str, tuple[float, str]]) -> None:
    """Numbers of a factor: of its quantity, then of its function."""
    _of_quantity(one, term, out)
    unit = QUANTITIES[one.quantity].unit
    if one.function in SCALED or one.scale != 1.0:
        word = "period" if one.function in TRAINS else "scale"
        out[f"{one.quantity}_{word}{UNITS[unit]}"] = (one.scale, unit)
    if one.function in TRAINS:
        out[f"{one.quantity}_width{UNITS[unit]}"] = (one.order, unit)


def _of_quantity(one: Factor, term: Term, out: dict[str, tuple[float, str]]) -> None:
    """Numbers that a factor's quantity has of its own - a place, a direction, a range, what it counts from - but for
    those that its term has as well."""
    entry = QUANTITIES[one.quantity]
    if entry.own in ("room", "host"):
        if (one.x, one.y) != (term.x, term.y):
            out["place_x_m"], out["place_y_m"] = (one.x, "m"), (one.y, "m")
    elif entry.own == "wind":
        if (one.x, one.y) != (term.x, term.y):
            out |= _wind(one)
    elif entry.own in LINES:
        if one.x != 0.0:
            out["offset_m"] = (one.x, "m")
        if one.y != term.x:
            out["line_rad"] = (one.y, "rad")
    elif one.quantity in ALONG:
        if one.x != _angle_of(term):
            out["line_rad"] = (one.x, "rad")
    elif entry.own == "turning":
        out["azimuth_zero_rad"], out["turning_rad_per_s"] = (one.x, "rad"), (one.y, "rad/s")
    elif entry.own == "swinging":
        out["fading_s"] = (one.y, "s")
        if one.x:
            out["swinging_rad_per_s"] = (one.x, "rad/s")
    elif entry.own == "fading":
        out["fading_s"] = (one.y, "s")
    elif entry.own == "trailing":
        out["fading_m"] = (one.y, "m")
    elif entry.own == "spreading":
        out["width_rad"] = (one.y, "rad")
        if one.x:
            out["fading_s"] = (one.x, "s")
    elif one.x != 0.0:
        out[f"{one.quantity}_zero{UNITS[entry.unit]}"] = (one.x, entry.unit)


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
        step[j] = min(STEP_SD * sd, STEP_SHARE * abs(values[j])) if values[j] else STEP_SD * sd
        ahead, behind = (named_numbers(build(values + sign * step)) for sign in (1.0, -1.0))
        for i, name in enumerate(middle):
            if name in ahead and name in behind:
                difference = ahead[name][0] - behind[name][0]
                if name.endswith("_rad"):  # an angle's ends meet
                    difference = float(np.angle(np.exp(1j * difference)))
                jacobian[i, j] = difference / (2 * step[j])
    spread = np.sqrt(np.maximum(np.einsum("ij,jk,ik->i", jacobian, covariance, jacobian), 0.0))
    return {name: (value, float(sd), unit) for (name, (value, unit)), sd in zip(middle.items(), spread, strict=True)}
