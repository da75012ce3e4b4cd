"""A candidate for a law: terms of unit coefficients that belong together, and the numbers inside them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ovines.core.laws.terms import Factor, Term, wrapped
from ovines.core.laws.words import QUANTITIES, TARGETS

Array = NDArray[np.float64]
Make = Callable[..., tuple[Term, ...]]


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

    @property
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
    if own in ("angle", "axis") and first.factors == second.factors and first.x != second.x:
        times = 2.0 if own == "axis" else 1.0
        if abs(wrapped(second.x - first.x - 0.5 * math.pi / times, math.pi)) > 1e-9:
            return None
        angle = wrapped(first.x + math.atan2(b, a) / times, 2 * math.pi / times)
        return replace(first, coefficient=size, sd=sd, x=angle)
    if (first.x, first.y) != (second.x, second.y) or len(first.factors) != len(second.factors):
        return None
    differ = [i for i, (f, g) in enumerate(zip(first.factors, second.factors, strict=True)) if f != g]
    if len(differ) != 1:
        return None
    f, g = first.factors[differ[0]], second.factors[differ[0]]
    if (f.function, g.function) != ("cosine", "sine") or replace(g, function="cosine") != f:
        return None
    # a cos(n q / s) + b sin(n q / s) = size cos(n (q - x) / s)
    shift = math.atan2(b, a) * f.scale / f.order
    merged = replace(f, x=f.x + shift)
    if QUANTITIES[f.quantity].circular:
        merged = replace(merged, x=wrapped(merged.x, 2 * math.pi / f.order))
    factors = tuple(merged if i == differ[0] else one for i, one in enumerate(first.factors))
    return replace(first, coefficient=size, sd=sd, factors=factors)


def waves(quantity: str, order: float = 1.0, scale: float = 1.0) -> tuple[Factor, Factor]:
    """Cosine and sine of a quantity."""
    return Factor(quantity, "cosine", order, scale), Factor(quantity, "sine", order, scale)
