"""The forms of listed effects: which a formula in their place must not have, and which a law is tried in first."""

from __future__ import annotations

from analysis.gap.laws.dictionary.candidate import Candidate
from ovines.core.effects import EFFECTS
from ovines.core.laws.terms import Term


def is_own_form(candidate: Candidate) -> bool:
    """Whether every term of a candidate is what some listed effect does."""
    return all(is_own_term(term) for term in candidate.terms)


def is_own_term(term: Term) -> bool:
    """Whether a term is what some listed effect does, of those that a fit has unknowns for."""
    return any(form.covers(term) for effect in EFFECTS.values() if not effect.by_law for form in effect.forms)


def is_effect_by_law(candidate: Candidate) -> bool:
    """Whether a candidate is a listed effect that is found by its law."""
    return any(
        len(effect.forms) == len(candidate.terms)
        and all(form.is_form_of(term) for form, term in zip(effect.forms, candidate.terms, strict=True))
        for effect in EFFECTS.values()
        if effect.by_law
    )
