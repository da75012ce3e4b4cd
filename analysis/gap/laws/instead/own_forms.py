"""The forms of listed effects, which a formula in their place must not have."""

from __future__ import annotations

from analysis.contact.restitution import DIRECTION, DRIFT, SPEED
from analysis.gap.laws.dictionary.candidate import Candidate
from ovines.core.laws.terms import Term

# By so much (fall of -2 log L of runs held out) a formula must say more than names that leave nothing: the best of a
# few that are nearly the true name says 9 more by chance once in a hundred series, 16 more once in some thousands.
OUTDOES = 16.0
# A formula of fewer unknowns replaces names where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.99
#: the function of a quantity, with its order, by which an effect goes; None: whichever
Function = tuple[str, float] | None
STRAIGHT, SQUARED, EXPONENTIAL = ("power", 1.0), ("power", 2.0), ("exponential", 1.0)
#: effect -> what its own law acts on, the quantities that it follows, and by which function: a drift that comes to rest
#: is no drift that goes on
OWN_FORMS: dict[str, tuple[tuple[str, frozenset[str], Function], ...]] = {
    "viscous_drag": (("along_velocity", frozenset({"speed"}), STRAIGHT),),
    "air_drag": (("along_velocity", frozenset({"speed"}), SQUARED),),
    "table_tilt": (("fixed_direction", frozenset(), None),),
    "vertical_motion": (
        ("floor_friction", frozenset({"phase"}), None),
        ("floor_friction", frozenset({"clock"}), None),
    ),
    "friction_drift": (
        ("floor_friction", frozenset({"time"}), STRAIGHT),
        ("floor_friction", frozenset({"run"}), STRAIGHT),
    ),
    SPEED: (("restitution", frozenset({"approach"}), EXPONENTIAL),),
    DIRECTION: (("restitution", frozenset({"azimuth"}), None),),
    DRIFT: (("restitution", frozenset({"time"}), STRAIGHT), ("restitution", frozenset({"run"}), STRAIGHT)),
}


def is_own_form(candidate: Candidate) -> bool:
    """Whether every term of a candidate is what some listed effect does."""
    return all(is_own_term(term) for term in candidate.terms)


def is_own_term(term: Term) -> bool:
    """Whether a term is what some listed effect does."""
    follows = frozenset(factor.quantity for factor in term.factors)
    functions = {(factor.function, factor.order) for factor in term.factors}
    return any(
        (term.target, follows) == (target, quantities) and (function is None or functions <= {function})
        for forms in OWN_FORMS.values()
        for target, quantities, function in forms
    )
