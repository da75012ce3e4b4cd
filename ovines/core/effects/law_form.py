"""An effect as a written law: terms in the words of laws, whose numbers are the effect's parameters."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from ovines.core.laws.terms import Factor, Term


@dataclass(frozen=True)
class FactorForm:
    """A function of a quantity (:class:`ovines.core.laws.terms.Factor`); ``scale`` and ``zero``: the effect's
    parameters that are its scale and what it counts from."""

    quantity: str
    function: str = "power"
    order: float = 1.0
    scale: str = ""
    zero: str = ""

    def at(self, values: Mapping[str, float]) -> Factor:
        """The factor of an effect of these sizes."""
        scale, zero = values[self.scale] if self.scale else 1.0, values[self.zero] if self.zero else 0.0
        return Factor(self.quantity, self.function, self.order, scale, zero)


@dataclass(frozen=True)
class LawForm:
    """A term of a law that an effect acts as: what it acts on, and by which ``factors``.

    ``coefficient``: the parameter that the term's coefficient is, ``direction`` the one that the target's own angle is;
    without a coefficient the effect has numbers of its own in every fit, and its form only says what is no other law.
    ``named``: coefficients within which a law of this form bears the effect's name; ``by_any_function``: what follows
    the same quantities by other functions is no other law, either."""

    target: str
    factors: tuple[FactorForm, ...] = ()
    coefficient: str = ""
    direction: str = ""
    named: tuple[float, float] = field(default=(-math.inf, math.inf))
    by_any_function: bool = False

    def term(self, values: Mapping[str, float]) -> Term:
        """The term of an effect of these sizes."""
        direction = values[self.direction] if self.direction else 0.0
        return Term(self.target, values[self.coefficient], tuple(one.at(values) for one in self.factors), x=direction)

    def parameters(self, term: Term) -> dict[str, float]:
        """Parameters of the effect that a term of this form is."""
        factors = {(one.quantity, one.function, one.order): one for one in term.factors}
        values = {self.coefficient: term.coefficient, self.direction: term.x}
        for one in self.factors:
            its = factors[one.quantity, one.function, one.order]
            values |= {one.scale: its.scale, one.zero: its.x}
        return {name: value for name, value in values.items() if name}

    def is_form_of(self, term: Term) -> bool:
        """Whether a term has this form, whatever its numbers."""
        own = sorted((one.quantity, one.function, one.order) for one in self.factors)
        its = sorted((one.quantity, one.function, one.order) for one in term.factors)
        return term.target == self.target and own == its

    @property
    def stands_still(self) -> bool:
        """Whether it follows the azimuth alone, as a shape of the wall does."""
        return bool(self.factors) and all(one.quantity == "azimuth" for one in self.factors)

    def is_named(self, term: Term) -> bool:
        """Whether a law's term is the effect."""
        return self.is_form_of(term) and self.named[0] <= term.coefficient < self.named[1]

    def covers(self, term: Term) -> bool:
        """Whether a term is what the effect does: it follows the same, if need be by another function."""
        if not self.by_any_function:
            return self.is_form_of(term)
        follows = {one.quantity for one in self.factors}
        return term.target == self.target and {one.quantity for one in term.factors} == follows
