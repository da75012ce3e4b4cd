"""The missing law of the impacts and the missing shape of the wall, held out by run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.contact.held_laws import known_at_impacts
from analysis.contact.restitution import RESTITUTION_EFFECTS, restitution_design
from analysis.flights.fit import FlightFits
from analysis.gap.cause import Structure
from analysis.gap.laws.dictionary.candidate import Candidate, law_at, waves
from analysis.gap.laws.dictionary.impacts import law_candidates
from analysis.gap.laws.dictionary.products import of_impacts
from analysis.gap.laws.dictionary.walls import wall_candidates
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_rows import ImpactRegression, distance_regression, law_regression, of_target
from analysis.gap.laws.linear_law import told_law, values_of
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.laws.search import AS_GOOD, LEVEL, MOST_PARTS, PER_UNKNOWN, Found, find_law
from analysis.gap.selection.impact_laws import law_accepted
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.covariates import FOLLOWED
from analysis.gap.selection.impacts.fit import ImpactFit, fit_impacts
from analysis.gap.selection.impacts.gain import NEGLIGIBLE
from analysis.gap.selection.impacts.restitution import kept_gain
from analysis.gap.selection.null_distribution import threshold
from analysis.gap.thresholds import IMPACT_GAIN
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import Term

FEWEST_IMPACTS = 20
#: what acts on each coordinate of an impact
ACTS_ON = {
    "normal": ("restitution",),
    "tangential": ("wall_friction", "tangential_restitution"),
    "spin": ("spin_kept", "spin_added"),
}
#: named shapes of the wall that one formula may replace
SHAPES = ("wall_ellipticity", "wall_lobes")
# A formula of fewer unknowns replaces them where it explains this share of what they do: a ring of two halves 0.995.
AS_WELL = 0.95


def find_impact_law(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    restitution_terms: Sequence[str],
    frame: RigFrame,
    rng: np.random.Generator,
    level: float = LEVEL,
    left: Sequence[Structure] = (),
) -> LawFound | None:
    """The formula that restitution, wall friction, tangential restitution or spin follow; None where chance would find
    as much as often as ``level``.

    Where that would be so of the whole dictionary, what probes have ``left`` of the impacts says where to look: of few
    impacts a thousand formulas explain as much by chance as the right one, the dozen that follow what the probe does,
    not."""
    if len(impacts.data) < FEWEST_IMPACTS:
        return None
    problem = law_regression(impacts, fits, restitution_terms)
    candidates = law_candidates(problem.known)
    found, p = find_law(problem.problem, problem.columns, candidates, rng, level, of_impacts(problem.known))
    for one in left if found is None else ():
        near = [candidate for candidate in candidates if _as_probed(candidate, one)]
        if near:
            found, p = find_law(problem.problem, problem.columns, near, rng, level, of_impacts(problem.known), 1)
        if found is not None:
            break
    if found is None:
        return None
    # Scatter that the law explains is no noise: weighed again with it, the law is measured once more.
    sharp = law_regression(impacts, fits, restitution_terms, law_at(found.parts, values_of(found)))
    return told_law(sharp, found, p, frame)


def _as_probed(candidate: Candidate, left: Structure) -> bool:
    """Whether a candidate acts where a probe has found something, and follows what that goes with."""
    quantity, targets = FOLLOWED.get(left.goes_with), ACTS_ON.get(left.coordinate, ())
    return all(
        term.target in targets and quantity in [factor.quantity for factor in term.factors] for term in candidate.terms
    )


def find_wall_law(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    frame: RigFrame,
    least_m: float,
    rng: np.random.Generator,
    level: float = LEVEL,
) -> LawFound | None:
    """The formula that the contact radius follows, where its size (RMS) is above ``least_m``; None where chance would
    find as much as often as ``level``."""
    if len(impacts.data) < FEWEST_IMPACTS:
        return None
    problem = distance_regression(impacts, fits)
    found, p = find_law(
        problem.problem, problem.columns, wall_candidates(problem.known), rng, level, of_impacts(problem.known)
    )
    return None if found is None else _told_wall_law(problem, found, p, impacts, fits, frame, least_m)


def _told_wall_law(
    problem: ImpactRegression,
    found: Found,
    p: float,
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    frame: RigFrame,
    least_m: float,
) -> LawFound | None:
    moved = problem.columns(found.terms) @ found.coefficients / problem.answers["contact_radius"]
    size_m = float(np.sqrt(np.mean(moved**2)))
    if size_m <= least_m:
        return None
    # What the law moves is no scatter of the distances: weighed again without it.
    sharp = distance_regression(impacts, fits, law_at(found.parts, values_of(found)))
    return replace(told_law(sharp, found, p, frame), size=size_m)


def wall_law_instead(
    steps: ImpactSteps, fits: Sequence[FlightFits], frame: RigFrame, least_m: float, rng: np.random.Generator
) -> tuple[LawFound, ImpactSteps] | None:
    """One formula that explains the contact distances clearly better than the named shapes of the wall do, or as well
    by fewer unknowns, and the steps without these; None where there is none.

    A step in the wall is a series of lobes: by an ellipse and one of them little is left of it.  An ellipse and lobes
    that are really there have no reason to stand to each other as the waves of one step do."""
    names = {c.effect for c in steps.causes} & set(SHAPES)
    if steps.fitted is None or not names or len(steps.fitted.data) < FEWEST_IMPACTS:
        return None
    shape = replace(
        steps.shape,
        ellipse=steps.shape.ellipse and SHAPES[0] not in names,
        order=0 if SHAPES[1] in names else steps.shape.order,
    )
    base = fit_impacts(fits, shape)
    problem = distance_regression(base, fits)
    orders = [2] * (SHAPES[0] in names) + [steps.shape.order] * (SHAPES[1] in names)
    shapes = [Term("contact_radius", 1.0, (wave,)) for order in orders for wave in waves("azimuth", float(order))]
    forms = forms_of(problem.problem, problem.columns(shapes), [list(range(len(shapes)))])
    named = float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0]) / problem.problem.excess
    candidates = wall_candidates(problem.known)
    for most in (1, MOST_PARTS):  # one step, before what its waves may be put together from
        found, p = find_law(problem.problem, problem.columns, candidates, rng, LEVEL, of_impacts(problem.known), most)
        if found is not None and _instead(found, named, len(shapes)) and not _holds(found, shapes):
            break
    else:
        return None
    law = _told_wall_law(problem, found, p, base, fits, frame, least_m)
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


def needless_beside(law: LawFound, steps: ImpactSteps, fits: Sequence[FlightFits]) -> tuple[str, ...]:
    """The named effects of the restitution that are no longer accepted beside a law: they had imitated a part of it."""
    impacts, own = steps.fitted, [c.effect for c in steps.causes if c.effect in RESTITUTION_EFFECTS]
    if impacts is None or not own:
        return ()
    data = impacts.data
    values = of_target("restitution", law.rig_law, known_at_impacts(data, impacts.junctions, fits))
    if values is None:
        return ()
    least = threshold(steps.null_distribution, IMPACT_GAIN)
    kept = [kept_gain(data, steps.restitution_terms, name, values[:, None]) for name in own]
    return tuple(gain.name for gain in kept if not law_accepted(gain, least, data))


def impact_law_sizes(
    law: LawFound, impacts: ImpactFit, fits: Sequence[FlightFits], restitution_terms: Sequence[str] = ()
) -> dict[str, tuple[float, float]]:
    """Target -> how much a law changes it from impact to impact (RMS about the mean, of the restitution about what its
    named effects may take), and what of that is negligible."""
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    nominal = impacts.law
    least = {
        "restitution": NEGLIGIBLE["restitution"],
        "wall_friction": NEGLIGIBLE["sliding"] * nominal.wall_friction,
        "tangential_restitution": NEGLIGIBLE["sticking"] * (1 + nominal.tangential_restitution),
        "spin_kept": NEGLIGIBLE["sticking"],
        "spin_added": NEGLIGIBLE["sticking"] * max(float(np.std(impacts.data.spin)), 1e-300),
    }
    sizes = {}
    for target, size in least.items():
        values = of_target(target, law.rig_law, known)
        if values is not None:
            if target == "restitution":
                named = restitution_design(impacts.data, restitution_terms)
                values = values - named @ np.linalg.lstsq(named, values, rcond=None)[0]
            sizes[target] = float(np.std(values)), size
    return sizes
