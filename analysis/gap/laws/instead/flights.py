"""One formula in the place of what flights name."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from analysis.gap.laws.belief import believed
from analysis.gap.laws.choice.shortlist import LEAST_SHARE
from analysis.gap.laws.dictionary.own_forms import is_own_form
from analysis.gap.laws.flight_law import find_flight_law, squared_errors
from analysis.gap.laws.flight_search import FlightSearch
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.instead.margins import AS_WELL, OUTDOES
from analysis.gap.selection.flight_steps import FlightSteps
from analysis.gap.selection.flights.terms import EFFECT_TERMS, FlightTerm
from analysis.gap.selection.flights_beside_law import beside_law, named_terms_of, still_accepted, without_names
from analysis.motion.rig_frame import RigFrame

# A formula whose linear form falls short by this share of what a law has to close, and by more than a formula pays for
# having been looked for (fall of -2 log L), does not come within 0.01 of it.
CLEARLY_LESS, PAID = 0.3, 30.0


def flight_law_instead(
    search: FlightSearch, steps: FlightSteps, law: LawFound, frame: RigFrame, rng: np.random.Generator
) -> tuple[LawFound, FlightSteps] | None:
    """A formula that says as much of flights held out as a ``law`` and the names beside it (``steps``), by no more
    unknowns, and the steps with those names that are needed beside it; None where there is none."""
    named = named_terms_of(steps)
    found = _without(search, steps, named, frame, rng, law)
    if found is None:
        return None
    alone, fewer = found
    remaining = named_terms_of(fewer)
    more = len(alone.numbers) - len(law.numbers)
    more -= sum(len(term.columns) for term in named) - sum(len(term.columns) for term in remaining)
    left = float(np.sum(law.before - law.floor))
    return found if more <= 0 and float(np.sum(alone.after - law.after)) <= (1 - AS_WELL) * left else None


def flight_law_beyond(
    search: FlightSearch, steps: FlightSteps, frame: RigFrame, rng: np.random.Generator, least_m_per_s2: float
) -> tuple[LawFound, FlightSteps] | None:
    """A formula in the place of names that leave nothing for a law beside them to follow, and the steps with the names
    that are needed beside it; None where these say as much.

    A name that takes nearly the whole of another cause leaves too little for chance to be ruled out.  Asked is which of
    the two runs held out want: by the linearised flights first, of each name and of all, then by the equation of
    motion."""
    named = named_terms_of(steps)
    every = [[term] for term in named] + ([named] if len(named) > 1 else [])
    outdone = [(_margin(search, _columns(gone)), gone) for gone in every]
    margin, gone = max(outdone, key=lambda one: one[0], default=(0.0, []))
    found = _without(search, steps, gone, frame, rng) if margin > 0 else None
    if found is None or believed(found[0], found[0].size, least_m_per_s2) is None:
        return None
    beside_names = float(np.sum(squared_errors(search.runs, steps.named)))
    return found if float(np.sum(found[0].after)) < beside_names else None


def _without(
    search: FlightSearch,
    steps: FlightSteps,
    gone: Sequence[FlightTerm],
    frame: RigFrame,
    rng: np.random.Generator,
    law: LawFound | None = None,
) -> tuple[LawFound, FlightSteps] | None:
    """The law of flights without the names that are ``gone``, among forms that are no name's own, and the steps with
    those of them that are needed beside it; None where there is no law, all of them are needed, or its linear form
    promises clearly less than these names and a ``law`` beside them do."""
    kept: list[str] = []
    while len(kept) < len(gone):
        out = [term for term in gone if term.name not in kept]
        fewer = without_names(search.runs, steps, [term.name for term in out])
        # The search's fit may hold names that a law beside them has made needless.
        held = [term for term in EFFECT_TERMS if set(term.columns) <= set(search.fit.columns)]
        taken = search.without(_columns([t for t in held if t not in named_terms_of(fewer)]), is_own_form)
        least = 0.0 if law is None else _least_promised(search, _columns(out), law)
        alone, fewer = find_flight_law(search.runs, fewer, frame, rng, search=taken, least_gain=least)
        if alone is None or alone.fitted is None:
            return None
        needed = [term.name for term in out if still_accepted(alone.fitted[1], steps, term)]
        if not needed:
            remaining = named_terms_of(fewer)
            return alone, beside_law(fewer, alone.fitted[1], [term for term in out if term not in remaining])
        kept += needed
    return None


def _least_promised(search: FlightSearch, names: Sequence[str], law: LawFound) -> float:
    """What one formula must promise to be worth its fit in the equation of motion: all that columns ``names`` and a
    ``law`` say, but for a share of what the law closes and leaves."""
    together, alone = search.said_by(names, law.rig_law.terms), search.said_by(names)
    left = (together - alone) / max(law.closed, CLEARLY_LESS)
    return together - CLEARLY_LESS * left - PAID * search.rows.problem.excess


def _margin(search: FlightSearch, names: Sequence[str]) -> float:
    """By how much a formula says more of runs held out than names do, less what it must say more: of strong effects a
    share, too, for no model is true to every digit."""
    more, named = search.outdone(names, is_own_form)
    return more - max(OUTDOES, LEAST_SHARE * named)


def _columns(terms: Sequence[FlightTerm]) -> list[str]:
    return [column for term in terms for column in term.columns]
