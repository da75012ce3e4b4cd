"""The forms of listed effects, which a formula in their place must not have."""

from __future__ import annotations

from analysis.contact.restitution import DIRECTION, DRIFT, SPEED
from analysis.gap.laws.dictionary.candidate import Candidate

# By so much (fall of -2 log L of runs held out) a formula must say more than names that leave nothing: the best of a
# few that are nearly the true name says 9 more by chance once in a hundred series, 16 more once in some thousands.
OUTDOES = 16.0
# A formula of fewer unknowns replaces names where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.99
#: effect -> what its own law acts on, and the quantities that it follows, in whichever function
OWN_FORMS: dict[str, tuple[tuple[str, frozenset[str]], ...]] = {
    "viscous_drag": (("along_velocity", frozenset({"speed"})),),
    "air_drag": (("along_velocity", frozenset({"speed"})),),
    "table_tilt": (("fixed_direction", frozenset()),),
    "vertical_motion": (("floor_friction", frozenset({"phase"})), ("floor_friction", frozenset({"clock"}))),
    "friction_drift": (("floor_friction", frozenset({"time"})), ("floor_friction", frozenset({"run"}))),
    SPEED: (("restitution", frozenset({"approach"})),),
    DIRECTION: (("restitution", frozenset({"azimuth"})),),
    DRIFT: (("restitution", frozenset({"time"})), ("restitution", frozenset({"run"}))),
}


def is_own_form(candidate: Candidate) -> bool:
    """Whether every term of a candidate is what some listed effect does."""
    own = {form for forms in OWN_FORMS.values() for form in forms}
    return all((term.target, frozenset(factor.quantity for factor in term.factors)) in own for term in candidate.terms)
