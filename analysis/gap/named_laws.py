"""Laws that are effects of the library: told by their names, held like any other effect."""

from __future__ import annotations

import numpy as np

from analysis.contact.restitution import DIRECTION, DRIFT, SPEED
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder, with_held_law
from analysis.gap.laws.found_law import LawFound
from ovines.core.laws.terms import WrittenLaw

#: effects that are found by the search of laws
NAMED_BY_LAW = ("nes_rocking",)
# A friction law counts as the disk's rocking where it takes no more than the friction that there is.
MOST_OF_FRICTION = -1.0


def named_effect(law: LawFound) -> tuple[str, dict[str, tuple[float, float]]] | None:
    """The effect of the library that a law of the flights is, with its parameters and their sds; None where it is none.

    Friction that is less by a share which dies out exponentially after each impact is ``nes_rocking``."""
    if not _is_rocking(law.rig_law):
        return None
    (relative, relative_sd, _), (decay_s, decay_sd_s, _) = (
        law.numbers[name] for name in ("coefficient", "since_scale_s")
    )
    return NAMED_BY_LAW[0], {"relative": (relative, relative_sd), "decay_s": (decay_s, decay_sd_s)}


def _is_rocking(law: WrittenLaw) -> bool:
    if len(law.terms) != 1 or law.terms[0].target != "floor_friction" or len(law.terms[0].factors) != 1:
        return False
    factor = law.terms[0].factors[0]
    return (
        factor.quantity == "since"
        and factor.function == "exponential"
        and MOST_OF_FRICTION <= law.terms[0].coefficient < 0.0
    )


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


def holds_named(law: LawFound) -> bool:
    """Whether one of several terms of a law is an effect of the library."""
    return len(law.rig_law.terms) > 1 and any(_is_rocking(WrittenLaw((term,))) for term in law.rig_law.terms)


def with_named_law(
    ladder: Ladder, law: LawFound, rng: np.random.Generator, withheld: frozenset[str] = frozenset()
) -> Ladder | None:
    """The ladder in whose flights a named law acts, and in which all that they tell is asked beside it; None where the
    law has no name."""
    named = named_effect(law)
    if named is None or law.fitted is None:
        return None
    effect, parameters = named
    told = max((s for s in ladder.structure if s.stage == "flight"), key=lambda s: s.strength)
    cause = Cause(effect, "flight", parameters, told.strength, told.gain, told.coordinate, told.phase)
    return with_held_law(ladder, law.fitted[0], cause, rng, withheld)
