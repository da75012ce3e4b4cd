"""Laws that are effects of the library: told by their names, held like any other effect."""

from __future__ import annotations

import numpy as np

from analysis.contact.restitution import DIRECTION, DRIFT, SPEED
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder, with_held_law
from analysis.gap.laws.flight_sizes import holding
from analysis.gap.laws.found_law import LawFound
from ovines.core.laws.terms import Term, WrittenLaw

#: effects that are found by the search of laws
NAMED_BY_LAW = ("nes_rocking",)
# A friction law counts as the disk's rocking where it takes no more than the friction that there is.
MOST_OF_FRICTION = -1.0


def named_effect(law: LawFound) -> tuple[str, dict[str, tuple[float, float]], Term] | None:
    """The effect of the library that a law of the flights is, or holds among its terms, with its parameters, their sds,
    and the term; None where it is none.

    Friction that is less by a share which dies out exponentially after each impact is ``nes_rocking``."""
    terms = law.rig_law.terms
    at = [i for i, term in enumerate(terms) if _is_rocking(term)]
    if len(at) != 1:
        return None
    tail = f"_{at[0] + 1}" if len(terms) > 1 else ""
    (relative, relative_sd, _), (decay_s, decay_sd_s, _) = (
        law.numbers[name + tail] for name in ("coefficient", "since_scale_s")
    )
    told = {"relative": (relative, relative_sd), "decay_s": (decay_s, decay_sd_s)}
    return NAMED_BY_LAW[0], told, terms[at[0]]


def _is_rocking(term: Term) -> bool:
    if term.target != "floor_friction" or len(term.factors) != 1:
        return False
    form = term.factors[0].quantity, term.factors[0].function
    return form == ("since", "exponential") and MOST_OF_FRICTION <= term.coefficient < 0.0


def effect_of_restitution(law: WrittenLaw) -> str | None:
    """The effect of the restitution that a law of the impacts is, by its form: a drift with time or run, a cosine once
    around the wall, a fall with the approach speed that dies out; None where it is none."""
    forms = set()
    for term in law.terms:
        if term.target != "restitution" or len(term.factors) != 1:
            return None
        one = term.factors[0]
        forms.add((one.quantity, one.function, one.order))
    if forms <= {("time", "power", 1.0), ("run", "power", 1.0)}:
        return DRIFT
    return {("azimuth", "cosine", 1.0): DIRECTION, ("approach", "exponential", 1.0): SPEED}.get(
        forms.pop() if len(forms) == 1 else ("", "", 0.0)
    )


def with_named_law(
    ladder: Ladder, law: LawFound, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> Ladder | None:
    """The ladder in whose flights the named part of a law acts, and in which all that they tell is asked beside it, the
    law's other parts, too; None where no part has a name."""
    named = named_effect(law)
    if named is None:
        return None
    effect, parameters, term = named
    told = max((s for s in ladder.structure if s.stage == "flight"), key=lambda s: s.strength)
    cause = Cause(effect, "flight", parameters, told.strength, told.gain, told.coordinate, told.phase)
    return with_held_law(ladder, holding(ladder.series.runs, [term]), cause, rng, withheld)
