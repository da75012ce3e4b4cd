"""The forms of listed effects, which a formula in their place must not have."""

from __future__ import annotations

from analysis.gap.laws.dictionary.candidate import Candidate
from ovines.core.effects import EFFECTS
from ovines.core.laws.terms import Term

# By so much (fall of -2 log L of runs held out) a formula must say more than names that leave nothing: the best of a
# few that are nearly the true name says 9 more by chance once in a hundred series, 16 more once in some thousands.
OUTDOES = 16.0
# A formula of fewer unknowns replaces names where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.99


def is_own_form(candidate: Candidate) -> bool:
    """Whether every term of a candidate is what some listed effect does."""
    return all(is_own_term(term) for term in candidate.terms)


def is_own_term(term: Term) -> bool:
    """Whether a term is what some listed effect does, of those that a fit has unknowns for."""
    return any(form.covers(term) for effect in EFFECTS.values() if not effect.by_law for form in effect.forms)
