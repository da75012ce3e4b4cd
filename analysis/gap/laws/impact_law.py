"""The missing law of the impacts and the missing shape of the wall, held out by run."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.contact.held_laws import known_after, known_at_impacts
from analysis.contact.restitution import RESTITUTION_EFFECTS, restitution_design
from analysis.flights.fit import FlightFits
from analysis.gap.cause import Structure
from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.choice.listed import PER_UNKNOWN
from analysis.gap.laws.choice.search import LEVEL, LEVEL_BELIEVED, find_law
from analysis.gap.laws.choice.shortlist import AS_GOOD
from analysis.gap.laws.dictionary.candidate import Candidate, law_at
from analysis.gap.laws.dictionary.impacts.law import law_candidates
from analysis.gap.laws.dictionary.impacts.walls import wall_candidates
from analysis.gap.laws.dictionary.products import of_impacts
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.impact_rates import rate_candidates
from analysis.gap.laws.impact_rows import (
    ImpactRegression,
    along_blows,
    distance_regression,
    law_regression,
    of_target,
    weighed_evenly,
)
from analysis.gap.laws.linear_law import reported_law, values_of
from analysis.gap.selection.impact_laws import law_accepted
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.covariates import FOLLOWED
from analysis.gap.selection.impacts.fit import ImpactFit, with_leaning_wall
from analysis.gap.selection.impacts.gain import negligible_share
from analysis.gap.selection.impacts.restitution import kept_gain
from analysis.gap.selection.null_distribution import threshold
from analysis.gap.thresholds import IMPACT_GAIN
from analysis.motion.rig_frame import RigFrame
from analysis.walls.outlines import LEAN_STEP_RAD, MOST_LEAN_RAD
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, WrittenLaw

Array = NDArray[np.float64]
FEWEST_IMPACTS = 20
# Impacts that had counted as gross, from which on a law that explains them is chosen once more.
FEWEST_REGAINED = 5
# A law is chosen so often more at the most, each time with the sides that the last one gives the impacts.
CHOSEN_AGAIN = 3
# Quantities that change by themselves while the disk stays where it is, or not at all; the step (s) of their rates.
MOVES_WITH = re.compile(
    "host_|wall_speed|wall_acceleration|time$|phase$|clock$|since|run$|blows$|recent_|blows_here|last_|swing|ovalling|breathing|twist|"
    "azimuth$|turning_azimuth$|at_cylinder$"
)
TIME_STEP_S = 1e-5
#: what acts on each coordinate of an impact
ACTS_ON = {
    "normal": ("restitution",),
    "tangential": ("wall_friction", "tangential_restitution"),
    # A blow that is turned moves the disk along the wall without a torque: it is the spin that lacks.
    "spin": ("spin_kept", "spin_added", "contact_normal"),
}


def find_impact_law(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    restitution_terms: Sequence[str],
    frame: RigFrame,
    rng: np.random.Generator,
    level: float = LEVEL,
    left: Sequence[Structure] = (),
    leave_out: Callable[[Candidate], bool] | None = None,
) -> LawFound | None:
    """The formula that restitution, wall friction, tangential restitution or spin follow; None where chance would find
    as much as often as ``level``.

    Where that would be so of the whole dictionary, what probes have ``left`` of the impacts says where to look: of few
    impacts a thousand formulas explain as much by chance as the right one, the dozen that follow what the probe does,
    not.  And where that says nothing either, everything is asked once more of impacts of which none counts for many: a
    wall that moves by itself changes the restitution of a slow blow so much that a tenth of the blows holds half of all
    there is to explain, and chance explains those.  ``leave_out``: candidates that are not asked."""
    if len(impacts.data) < FEWEST_IMPACTS:
        return None
    if left and all(one.is_no_formula for one in left):
        left, level = (), min(level, LEVEL_BELIEVED)
    problem = law_regression(impacts, fits, restitution_terms)

    def asked(rows: ImpactRegression) -> list[Candidate]:
        every = [*law_candidates(rows.known), *of_rates(rows, impacts, fits, rng)]
        return [one for one in every if leave_out is None or not leave_out(one)]

    candidates = asked(problem)
    found, p = find_law(problem.problem, problem.columns, candidates, rng, level, of_impacts(problem.known))
    for one in left if found is None else ():
        near = [candidate for candidate in candidates if _as_probed(candidate, one)]
        if near:
            found, p = find_law(problem.problem, problem.columns, near, rng, level, of_impacts(problem.known), 1)
        if found is not None:
            break
    if found is None and left:
        even = weighed_evenly(problem)
        found, p = find_law(even.problem, even.columns, asked(even), rng, level, of_impacts(even.known))
    if found is None:
        return None
    # Scatter that the law explains is no noise: weighed again with it, the law is measured once more; and chosen once
    # more where impacts that had counted as gross are what it explains.
    sharp = law_regression(impacts, fits, restitution_terms, law_at(found.parts, values_of(found)))
    if _regained(problem, sharp, found) >= FEWEST_REGAINED:
        again, chance = find_law(sharp.problem, sharp.columns, asked(sharp), rng, level, of_impacts(sharp.known))
        if again is not None:
            found, p = again, chance
            sharp = law_regression(impacts, fits, restitution_terms, law_at(found.parts, values_of(found)))
    found, p, sharp = _with_its_sides(
        (found, p, sharp),
        lambda law: law_regression(impacts, fits, restitution_terms, law, sides_of_law=True),
        lambda rows, among: find_law(
            rows.problem, rows.columns, among or asked(rows), rng, level, () if among else of_impacts(rows.known)
        ),
    )
    return reported_law(sharp, found, p, frame)


def _with_its_sides(
    chosen: tuple[Found, float, ImpactRegression],
    beside: Callable[[WrittenLaw], ImpactRegression],
    choose: Callable[[ImpactRegression, Sequence[Candidate]], tuple[Found | None, float]],
) -> tuple[Found, float, ImpactRegression]:
    """The law that was ``chosen``, how often chance finds as much, and its rows; or one that says more of the impulses,
    chosen with the sides that it gives them itself.

    An impact that would slide on the nominal wall may stick on its own; one that is taken for stuck and has slid, where
    friction is less, looks like another return, and what is said of it would be a law of its own: sides are asked of
    the part that is friction's alone, too.  ``beside`` a law: the rows with its sides, of which to ``choose``, among
    some candidates or all; one of the same form is kept unless another says clearly more."""
    last = chosen[2]
    for _ in range(CHOSEN_AGAIN):
        best, cost = None, _cost(chosen[2], chosen[0])
        for law in _telling_sides(chosen[0]):
            sides = beside(law)
            changed = _changed_sides(last, sides)
            # Measured once more where any has changed sides; another form where as many as are chosen for again.
            tried: list[tuple[Sequence[Candidate], float]] = [(chosen[0].parts, 0.0)] if changed else []
            tried += [((), AS_GOOD)] if changed >= FEWEST_REGAINED else []
            for among, least in tried:
                again, chance = choose(sides, among)
                if again is None:
                    continue
                after = beside(law_at(again.parts, values_of(again)))
                if _cost(after, again) < cost - least:
                    best, cost = ((again, chance, after), sides), _cost(after, again)
        if best is None:
            break
        chosen, last = best
    return chosen


def _telling_sides(found: Found) -> list[WrittenLaw]:
    """A law, and its part that is wall friction's where it is not all that it says of the impulse along the wall."""
    law = law_at(found.parts, values_of(found))
    friction = tuple(term for term in law.terms if term.target == "wall_friction")
    others = any(term.target == "tangential_restitution" for term in law.terms)
    return [law, replace(law, terms=friction)] if friction and others else [law]


def _changed_sides(rows: ImpactRegression, others: ImpactRegression) -> int:
    """How many impacts stick in one of them and slide in the other."""
    slides = [one.answers["wall_friction"] != 0.0 for one in (rows, others)]
    return int(np.count_nonzero(slides[0] != slides[1]))


def _cost(rows: ImpactRegression, found: Found) -> float:
    """What a law leaves of the impulses along the wall, and the price of its unknowns."""
    unknowns = sum(part.unknowns for part in found.parts)
    return rows.misfit_along(law_at(found.parts, values_of(found))) + PER_UNKNOWN * unknowns


def _regained(problem: ImpactRegression, sharp: ImpactRegression, found: Found) -> int:
    """How many rows count for more than twice as much beside the law that was ``found``, against what they usually
    do."""
    counts = list[int]()
    for target in {term.target for term in found.terms}:
        before, after = (np.abs(rows.answers[target]) for rows in (problem, sharp))
        more = after[before > 0] / before[before > 0]
        counts.append(int(np.count_nonzero(more > 2 * np.median(more))) if len(more) else 0)
    return max(counts)


def of_rates(
    problem: ImpactRegression, impacts: ImpactFit, fits: Sequence[FlightFits], rng: np.random.Generator
) -> list[Candidate]:
    """What swings at rates of its own; its signs are drawn aside, so that they bend no other chance."""
    time_sd_s = float(np.sqrt(np.median(impacts.junctions.covariance[impacts.data.at.index, -1, -1])))
    return rate_candidates(problem, fits[0].run.period_s, time_sd_s, rng.spawn(1)[0])


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
    candidates = [*wall_candidates(problem.known), *of_rates(problem, impacts, fits, rng)]
    found, p = find_law(problem.problem, problem.columns, candidates, rng, level, of_impacts(problem.known))
    return None if found is None else reported_wall_law(problem, found, p, impacts, fits, frame, least_m)


def reported_wall_law(
    problem: ImpactRegression,
    found: Found,
    p: float,
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    frame: RigFrame,
    least_m: float,
) -> LawFound | None:
    """The law of the wall's shape that was found, None where it is no larger than ``least_m``."""
    moved = problem.columns(found.terms) @ found.coefficients / problem.answers["contact_radius"]
    size_m = float(np.sqrt(np.mean(moved**2)))
    if size_m <= least_m:
        return None
    # What the law moves is no scatter of the distances: weighed again without it.
    sharp = distance_regression(impacts, fits, law_at(found.parts, values_of(found)))
    return replace(reported_law(sharp, found, p, frame), size=size_m)


def leaning_wall(law: LawFound, impacts: ImpactFit, fits: Sequence[FlightFits]) -> ImpactFit:
    """The same impacts at the wall that a ``law`` of its shape tells, whose normal leans by -r'/r, as of any wall that
    is nearly round, and which moves as the law says in time."""
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    at = impacts.data.at.index
    on_cylinder = impacts.wall.wall.on_cylinder(impacts.wall.impacts.surface[at])
    reaches = []
    for turn in (-LEAN_STEP_RAD, 0.0, LEAN_STEP_RAD):
        moved, c, s = known.copy(), np.cos(turn), np.sin(turn)
        x, y = known[:, W.HX], known[:, W.HY]
        moved[:, W.HX], moved[:, W.HY] = c * x - s * y, s * x + c * y
        values = of_target("contact_radius", law.rig_law, moved, on_cylinder)
        assert values is not None, "a law of the wall's shape"
        reaches.append(values)
    rise = (reaches[2] - reaches[0]) / (2 * LEAN_STEP_RAD)
    reach_m, lean_rad = np.zeros(len(impacts.junctions)), np.zeros(len(impacts.junctions))
    reach_m[at] = reaches[1]
    lean_rad[at] = np.where(on_cylinder, 0.0, -rise / known[:, W.CONTACT_RADIUS])
    lean_rad = np.clip(lean_rad, -MOST_LEAN_RAD, MOST_LEAN_RAD)
    out_m_per_s = np.zeros(len(impacts.junctions))
    out_m_per_s[at] = _outwards(law.rig_law, impacts, known, fits, on_cylinder)
    return with_leaning_wall(impacts, fits, reach_m, lean_rad, out_m_per_s)


def _outwards(
    law: WrittenLaw, impacts: ImpactFit, known: Array, fits: Sequence[FlightFits], on_cylinder: NDArray[np.bool_]
) -> Array:
    """How fast (K,; m/s) a law of its shape moves the wall outwards at each impact, by those of its terms that follow
    the Host's motion, the time, or what earlier blows have done: what follows the blow itself is no motion."""
    terms = tuple(term for term in law.terms if term.factors and all(_moves_on(factor) for factor in term.factors))
    if not terms:
        return np.zeros(len(known))
    moving = WrittenLaw(terms)
    sides = [known_after(known, impacts.data, impacts.junctions, fits, step) for step in (-TIME_STEP_S, TIME_STEP_S)]
    before, after = (of_target("contact_radius", moving, one, on_cylinder) for one in sides)
    assert before is not None and after is not None, "a law of the wall's shape"
    return (after - before) / (2 * TIME_STEP_S)


def _moves_on(factor: Factor) -> bool:
    """Whether a wall that follows a factor goes on moving by itself, evenly: not by leaps."""
    return factor.function != "sign" and MOVES_WITH.match(factor.quantity) is not None


def needless_beside(law: LawFound, steps: ImpactSteps, fits: Sequence[FlightFits]) -> tuple[str, ...]:
    """The named effects of the restitution that are no longer accepted beside a law: they had imitated a part of it."""
    impacts, own = steps.fitted, [c.effect for c in steps.causes if c.effect in RESTITUTION_EFFECTS]
    if impacts is None or not own:
        return ()
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    values, data = of_target("restitution", law.rig_law, known), along_blows(impacts.data, law.rig_law, known)
    if values is None and data is impacts.data:
        return ()
    least, beside = threshold(steps.null_distribution, IMPACT_GAIN), None if values is None else values[:, None]
    kept = [kept_gain(data, steps.restitution_terms, name, beside) for name in own]
    return tuple(gain.name for gain in kept if not law_accepted(gain, least, data, must_say_more=True))


def impact_law_sizes(
    law: LawFound, impacts: ImpactFit, fits: Sequence[FlightFits], restitution_terms: Sequence[str] = ()
) -> dict[str, tuple[float, float]]:
    """Target -> how much a law changes it from impact to impact (RMS about the mean, of the restitution about what its
    named effects may take), and what of that is negligible."""
    known = known_at_impacts(impacts.data, impacts.junctions, fits)
    nominal, lasts = impacts.law, impacts.lasts
    sliding, sticking = negligible_share("sliding", lasts), negligible_share("sticking", lasts)
    least = {
        "restitution": negligible_share("restitution", lasts),
        "wall_friction": sliding * nominal.wall_friction,
        "tangential_restitution": sticking * (1 + nominal.tangential_restitution),
        "contact_normal": sliding * nominal.wall_friction,
        "spin_kept": sticking,
        "spin_added": sticking * max(float(np.std(impacts.data.at.spin)), 1e-300),
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
