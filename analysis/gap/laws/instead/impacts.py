"""One formula in the place of what is named of the restitution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import known_at_impacts
from analysis.contact.restitution import RESTITUTION_EFFECTS
from analysis.flights.fit import FlightFits
from analysis.gap.cause import Structure
from analysis.gap.laws.choice.listed import PER_UNKNOWN
from analysis.gap.laws.choice.search import LEVEL_BELIEVED, LEVEL_WHERE_LEFT
from analysis.gap.laws.choice.shortlist import AS_GOOD, LEAST_SHARE
from analysis.gap.laws.dictionary.own_forms import is_own_form, is_own_term
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_law import find_impact_law, needless_beside
from analysis.gap.laws.impact_rows import law_regression, of_target, usual_scatter
from analysis.gap.laws.instead.margins import OUTDOES
from analysis.gap.laws.regression.problem import held_out_squares
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
#: unknowns of an effect of the restitution
UNKNOWNS = 2


@dataclass(frozen=True, eq=False)
class RestitutionInstead:
    """A ``law`` in the place of effects of the restitution, the ``steps`` with those that are needed beside it, and by
    how much ``more`` than they it explains of runs held out (fall of -2 log L less the price of its unknowns); in their
    place it must explain ``least``."""

    law: LawFound
    steps: ImpactSteps
    more: float
    least: float

    @property
    def replaces(self) -> bool:
        """Whether it stands in their place."""
        return self.more >= self.least


def restitution_law_instead(
    law: LawFound | None,
    steps: ImpactSteps,
    fits: Sequence[FlightFits],
    frame: RigFrame,
    rng: np.random.Generator,
    left: Sequence[Structure] = (),
) -> RestitutionInstead | None:
    """The best formula of the restitution without its named effects: in their place it must say as much of impacts held
    out as a ``law`` and these beside it, by no more unknowns, or clearly more than these alone where there is no law.
    None where there is none that is no effect's own."""
    impacts, named = steps.fitted, [c.effect for c in steps.causes if c.effect in RESTITUTION_EFFECTS]
    if impacts is None or (law is not None and not _of_restitution(law)):
        return None
    level = LEVEL_BELIEVED if law is None else LEVEL_WHERE_LEFT
    kept: list[str] = []
    while len(kept) < len(named):
        fewer = without_effects(steps, [name for name in named if name not in kept])
        alone = find_impact_law(impacts, fits, fewer.restitution_terms, frame, rng, level, left, is_own_form)
        if alone is None or not _of_restitution(alone) or not _more_than_own(alone, impacts, fits):
            return None
        needless = needless_beside(alone, steps, fits)
        needed = [name for name in named if name not in needless and name not in kept]
        if not needed:
            break
        kept += needed
    else:
        return None
    cost, cost_alone = _costs(impacts, fits, ((law, steps), (alone, fewer)))
    simpler = _own_part(alone)[1] < UNKNOWNS * (len(steps.restitution_terms) - len(fewer.restitution_terms))
    least = 0.0 if law is not None else AS_GOOD if simpler else OUTDOES
    return RestitutionInstead(alone, fewer, cost - cost_alone, least)


def without_effects(steps: ImpactSteps, names: Sequence[str]) -> ImpactSteps:
    """``steps`` without some of the effects of the restitution that they name."""
    return replace(
        steps,
        restitution_terms=tuple(name for name in steps.restitution_terms if name not in names),
        causes=tuple(c for c in steps.causes if c.effect not in names),
    )


def _of_restitution(law: LawFound) -> bool:
    return any(term.target == "restitution" for term in law.rig_law.terms)


def _more_than_own(law: LawFound, impacts: ImpactFit, fits: Sequence[FlightFits]) -> bool:
    """Whether runs held out want more of a law than those of its terms that are what a listed effect does: with the run
    and, by a hundredth of that, around the wall, is a drift in other words."""
    terms = law.rig_law.terms
    own = [term for term in terms if is_own_term(term)]
    if not own:
        return True
    rows = law_regression(impacts, fits, (), law.rig_law)
    none, less, whole = (
        float(held_out_squares(rows.problem, rows.columns(some)).sum()) for some in ([], own, list(terms))
    )
    return less - whole > max(AS_GOOD, LEAST_SHARE * (none - whole))


def _costs(
    impacts: ImpactFit, fits: Sequence[FlightFits], models: Sequence[tuple[LawFound | None, ImpactSteps]]
) -> list[float]:
    """-2 log L of runs held out by each model of the restitution - a law beside names, or names alone - and the price
    of its unknowns, at the scatter that the best of them leaves.  What a law says of friction or spin says nothing for
    or against names of the restitution."""
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    scatter = min(
        usual_scatter(
            impacts.data,
            steps.restitution_terms,
            None if law is None else of_target("restitution", law.rig_law, known),
        )
        for law, steps in models
    )
    out = []
    for law, steps in models:
        rows = law_regression(impacts, fits, steps.restitution_terms, scatter=scatter)
        own, unknowns = _own_part(law)
        squares = held_out_squares(rows.problem, rows.columns(own))
        unknowns += UNKNOWNS * sum(c.effect in RESTITUTION_EFFECTS for c in steps.causes)
        out.append(float(squares.sum()) + PER_UNKNOWN * unknowns)
    return out


def _own_part(law: LawFound | None) -> tuple[list[Term], int]:
    """A law's terms of the restitution, and how many numbers they have: those of several terms end in their place."""
    if law is None:
        return [], 0
    terms = law.rig_law.terms
    own = [i for i, term in enumerate(terms) if term.target == "restitution"]
    if len(terms) == 1:
        return list(terms), len(law.numbers)
    places = {str(i + 1) for i in own}
    return [terms[i] for i in own], sum(name.rpartition("_")[2] in places for name in law.numbers)
