"""One formula in the place of named shapes of the wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.flights.fit import FlightFits
from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.choice.listed import PER_UNKNOWN
from analysis.gap.laws.choice.search import LEVEL, MOST_PARTS, find_law
from analysis.gap.laws.choice.shortlist import AS_GOOD
from analysis.gap.laws.dictionary.candidate import law_at, waves
from analysis.gap.laws.dictionary.impacts.walls import HERTZ, LASTING, wall_candidates
from analysis.gap.laws.dictionary.products import of_impacts
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_law import FEWEST_IMPACTS, reported_wall_law
from analysis.gap.laws.impact_rows import ImpactRegression, distance_regression
from analysis.gap.laws.instead.margins import AS_WELL
from analysis.gap.laws.linear_law import values_of
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.fit import ImpactFit, Shape, fit_impacts
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import Factor, Term

#: named shapes of the wall that one formula may replace
SHAPES = ELLIPSE, LOBES, FINITE = "wall_ellipticity", "wall_lobes", "finite_contact_time"


def wall_law_instead(
    steps: ImpactSteps, fits: Sequence[FlightFits], frame: RigFrame, least_m: float, rng: np.random.Generator
) -> tuple[LawFound, ImpactSteps] | None:
    """One formula that explains the contact distances clearly better than the named shapes of the wall do, or as well
    by fewer unknowns, and the steps without these; None where there is none.

    A step in the wall is a series of lobes: by an ellipse and one of them little is left of it.  An ellipse and lobes
    that are really there have no reason to stand to each other as the waves of one step do.  A ring with play in its
    seat makes distances that grow with the speed of approach, as a contact that lasts does; round bodies' contacts last
    a little less where they are fast."""
    names = {c.effect for c in steps.causes} & set(SHAPES)
    if steps.fitted is None or not names or len(steps.fitted.data) < FEWEST_IMPACTS:
        return None
    shape = Shape(
        steps.shape.ellipse and ELLIPSE not in names,
        steps.shape.finite and FINITE not in names,
        0 if LOBES in names else steps.shape.order,
    )
    base = fit_impacts(fits, shape)
    problem = distance_regression(base, fits)
    orders = [2] * (ELLIPSE in names) + [steps.shape.order] * (LOBES in names)
    factors = [wave for order in orders for wave in waves("azimuth", float(order))]
    factors += [Factor("approach")] * (FINITE in names)
    shapes = [Term("contact_radius", 1.0, (factor,)) for factor in factors]
    candidates = wall_candidates(problem.known)
    for most in (1, MOST_PARTS):  # one step, before what its waves may be put together from
        found, p = find_law(problem.problem, problem.columns, candidates, rng, LEVEL, of_impacts(problem.known), most)
        if (
            found is not None
            and _says_more(found, base, fits, shapes)
            and not _holds(found, shapes)
            and not asked_beside(problem, found, shapes)
        ):
            break
    else:
        return None
    law = reported_wall_law(problem, found, p, base, fits, frame, least_m)
    if law is None:
        return None
    if is_lasting(law):  # it says how long contacts last, not that they do not
        shape = replace(shape, finite=True)
        base = fit_impacts(fits, shape)
    kept = tuple(c for c in steps.causes if c.effect not in names)
    return law, replace(steps, fitted=base, shape=shape, causes=kept)


def is_lasting(law: LawFound) -> bool:
    """Whether a law of the wall's shape is that of how long contacts last."""
    return any({(one.quantity, one.order) for one in term.factors} == {("approach", HERTZ)} for term in law.law.terms)


def _says_more(found: Found, base: ImpactFit, fits: Sequence[FlightFits], shapes: Sequence[Term]) -> bool:
    """Whether a formula stands in the place of the named ``shapes``, by the fall of -2 log L of runs held out at the
    scatter that it leaves: that of both together would hide by how little they differ.  What it has beside how long
    contacts last the name may have, too."""
    replacing = [part for part in found.parts if part.name == LASTING] or list(found.parts)
    beside = [term for part in found.parts if part not in replacing for term in part.terms]
    sharp = distance_regression(base, fits, law_at(found.parts, values_of(found)))
    left = sharp.problem.with_columns(sharp.columns(found.terms)).excess
    formula, named = (_gain(sharp, terms) / left for terms in (found.terms, [*shapes, *beside]))
    return _instead(formula, named, sum(part.unknowns for part in replacing) - len(shapes))


def _instead(formula: float, named: float, more: int) -> bool:
    """Whether a formula of so many ``more`` unknowns, which gains ``formula``, says clearly more than named shapes that
    gain ``named``, or as much by fewer."""
    return formula - named > AS_GOOD + PER_UNKNOWN * max(more, 0) or (more < 0 and formula > AS_WELL * named)


def _gain(rows: ImpactRegression, terms: Sequence[Term]) -> float:
    """Fall of the sum of squares of runs held out."""
    forms = forms_of(rows.problem, rows.columns(terms), [list(range(len(terms)))])
    return float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0])


def _holds(found: Found, shapes: Sequence[Term]) -> bool:
    """Whether a part of a formula is a named shape itself: the others stand beside it, not in its place."""
    named = {term.factors for term in shapes}
    return any({term.factors for term in part.terms} <= named for part in found.parts)


def asked_beside(problem: ImpactRegression, found: Found, shapes: Sequence[Term]) -> bool:
    """Whether runs held out still ask for the named shapes beside a formula."""
    held = replace(problem, problem=problem.problem.with_columns(problem.columns(found.terms)))
    return _gain(held, shapes) / held.problem.excess > AS_GOOD
