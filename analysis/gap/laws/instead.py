"""One formula in the place of several names.

Parts of a cause that nobody has listed may have the form of listed effects: the drag of a fan's wind has a constant
part, which is a tilt's, and one that goes with the speed, which is a viscous drag's.  Names are tried first, and a law
is then sought beside them, of a cause that is whole without them.  So where a law stands beside names, the formula is
sought once more with the names out of the model, among those that are no name's own form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import known_at_impacts
from analysis.contact.restitution import DIRECTION, DRIFT, RESTITUTION_EFFECTS, SPEED
from analysis.flights.cutting.runs import Run
from analysis.flights.fit import FlightFits
from analysis.gap.cause import Structure
from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.choice.listed import PER_UNKNOWN
from analysis.gap.laws.choice.search import AS_GOOD, LEVEL, LEVEL_WHERE_LEFT, MOST_PARTS, find_law
from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.products import of_impacts
from analysis.gap.laws.dictionary.walls import wall_candidates
from analysis.gap.laws.flight_law import find_flight_law
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_law import FEWEST_IMPACTS, find_impact_law, needless_beside, told_wall_law
from analysis.gap.laws.impact_rows import (
    ImpactRegression,
    distance_regression,
    law_regression,
    of_target,
    usual_scatter,
)
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.laws.regression.problem import held_out_squares
from analysis.gap.selection.flight_steps import FlightSteps, beside_law, named_terms_of, still_accepted, without_names
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.fit import ImpactFit, Shape, fit_impacts
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
#: named shapes of the wall that one formula may replace
SHAPES = ELLIPSE, LOBES, FINITE = "wall_ellipticity", "wall_lobes", "finite_contact_time"
# A formula of fewer unknowns replaces names where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.95
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
#: unknowns of an effect of the restitution
UNKNOWNS = 2


def is_own_form(candidate: Candidate) -> bool:
    """Whether every term of a candidate is what some listed effect does."""
    own = {form for forms in OWN_FORMS.values() for form in forms}
    return all((term.target, frozenset(factor.quantity for factor in term.factors)) in own for term in candidate.terms)


def flight_law_instead(
    runs: Sequence[Run], steps: FlightSteps, law: LawFound, frame: RigFrame, rng: np.random.Generator
) -> tuple[LawFound, FlightSteps] | None:
    """A formula that says as much of flights held out as a ``law`` and the names beside it (``steps``), by no more
    unknowns, and the steps with those names that are needed beside it; None where there is none."""
    named = named_terms_of(steps)
    kept: list[str] = []
    while len(kept) < len(named):
        gone = [term for term in named if term.name not in kept]
        fewer = without_names(runs, steps, [term.name for term in gone])
        alone, fewer = find_flight_law(runs, fewer, frame, rng, leave_out=is_own_form)
        if alone is None or alone.fitted is None:
            return None
        needed = [term.name for term in gone if still_accepted(alone.fitted[1], steps, term)]
        if not needed:
            break
        kept += needed
    else:
        return None
    remaining = named_terms_of(fewer)
    more = len(alone.numbers) - len(law.numbers)
    more -= sum(len(term.columns) for term in named) - sum(len(term.columns) for term in remaining)
    left = float(np.sum(law.before - law.floor))
    if more > 0 or float(np.sum(alone.after - law.after)) > (1 - AS_WELL) * left:
        return None
    return alone, beside_law(fewer, alone.fitted[1], [term for term in gone if term not in remaining])


def restitution_law_instead(
    law: LawFound,
    steps: ImpactSteps,
    fits: Sequence[FlightFits],
    frame: RigFrame,
    rng: np.random.Generator,
    left: Sequence[Structure] = (),
) -> tuple[LawFound, ImpactSteps] | None:
    """The same for a ``law`` of the impacts and the effects of the restitution beside it."""
    impacts, named = steps.fitted, [c.effect for c in steps.causes if c.effect in RESTITUTION_EFFECTS]
    if impacts is None or not any(term.target == "restitution" for term in law.rig_law.terms):
        return None
    kept: list[str] = []
    while len(kept) < len(named):
        fewer = without_effects(steps, [name for name in named if name not in kept])
        alone = find_impact_law(
            impacts, fits, fewer.restitution_terms, frame, rng, LEVEL_WHERE_LEFT, left, leave_out=is_own_form
        )
        if alone is None:
            return None
        needless = needless_beside(alone, steps, fits)
        needed = [name for name in named if name not in needless and name not in kept]
        if not needed:
            break
        kept += needed
    else:
        return None
    cost, cost_alone = _costs(impacts, fits, ((law, steps), (alone, fewer)))
    return (alone, fewer) if cost_alone <= cost else None


def without_effects(steps: ImpactSteps, names: Sequence[str]) -> ImpactSteps:
    """``steps`` without some of the effects of the restitution that they name."""
    return replace(
        steps,
        restitution_terms=tuple(name for name in steps.restitution_terms if name not in names),
        causes=tuple(c for c in steps.causes if c.effect not in names),
    )


def _costs(
    impacts: ImpactFit, fits: Sequence[FlightFits], models: Sequence[tuple[LawFound, ImpactSteps]]
) -> list[float]:
    """-2 log L of runs held out by each model of the restitution - a law beside names - and the price of its unknowns,
    at the scatter that the best of them leaves."""
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    scatter = min(
        usual_scatter(impacts.data, steps.restitution_terms, of_target("restitution", law.rig_law, known))
        for law, steps in models
    )
    out = []
    for law, steps in models:
        rows = law_regression(impacts, fits, steps.restitution_terms, scatter=scatter)
        squares = held_out_squares(rows.problem, rows.columns(law.rig_law.terms))
        unknowns = len(law.numbers) + UNKNOWNS * sum(c.effect in RESTITUTION_EFFECTS for c in steps.causes)
        out.append(float(squares.sum()) + PER_UNKNOWN * unknowns)
    return out


def wall_law_instead(
    steps: ImpactSteps, fits: Sequence[FlightFits], frame: RigFrame, least_m: float, rng: np.random.Generator
) -> tuple[LawFound, ImpactSteps] | None:
    """One formula that explains the contact distances clearly better than the named shapes of the wall do, or as well
    by fewer unknowns, and the steps without these; None where there is none.

    A step in the wall is a series of lobes: by an ellipse and one of them little is left of it.  An ellipse and lobes
    that are really there have no reason to stand to each other as the waves of one step do.  A ring with play in its
    seat makes distances that grow with the speed of approach, as a contact that lasts does."""
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
    forms = forms_of(problem.problem, problem.columns(shapes), [list(range(len(shapes)))])
    named = float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0]) / problem.problem.excess
    candidates = wall_candidates(problem.known)
    for most in (1, MOST_PARTS):  # one step, before what its waves may be put together from
        found, p = find_law(problem.problem, problem.columns, candidates, rng, LEVEL, of_impacts(problem.known), most)
        if (
            found is not None
            and _instead(found, named, len(shapes))
            and not _holds(found, shapes)
            and not asked_beside(problem, found, shapes)
        ):
            break
    else:
        return None
    law = told_wall_law(problem, found, p, base, fits, frame, least_m)
    if law is None:
        return None
    kept = tuple(c for c in steps.causes if c.effect not in names)
    return law, replace(steps, fitted=base, shape=shape, causes=kept)


def _instead(found: Found, named: float, unknowns: int) -> bool:
    """Whether a formula says clearly more than shapes of so many ``unknowns`` that gain ``named``, or as much by
    fewer."""
    more = sum(part.unknowns for part in found.parts) - unknowns
    return found.gain - named > AS_GOOD + PER_UNKNOWN * max(more, 0) or (more < 0 and found.gain > AS_WELL * named)


def _holds(found: Found, shapes: Sequence[Term]) -> bool:
    """Whether a part of a formula is a named shape itself: the others stand beside it, not in its place."""
    named = {term.factors for term in shapes}
    return any({term.factors for term in part.terms} <= named for part in found.parts)


def asked_beside(problem: ImpactRegression, found: Found, shapes: Sequence[Term]) -> bool:
    """Whether runs held out still ask for the named shapes beside a formula."""
    held = problem.problem.with_columns(problem.columns(found.terms))
    forms = forms_of(held, problem.columns(shapes), [list(range(len(shapes)))])
    gain = float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0]) / held.excess
    return gain > AS_GOOD
