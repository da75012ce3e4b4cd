"""The missing law of the impacts and the missing shape of the wall, held out by run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.fit import FlightFits
from analysis.gap.laws.evidence import evidence_of
from analysis.gap.laws.found_law import LawFound, in_world, others_of
from analysis.gap.laws.impact_dictionary import law_candidates, wall_candidates
from analysis.gap.laws.impact_rows import ImpactRegression, distance_regression, law_regression
from analysis.gap.laws.numbers import law_at, with_sds
from analysis.gap.laws.regression import Regression, held_out_squares
from analysis.gap.laws.search import Found, find_law
from analysis.gap.selection.impact_candidates import ImpactFit
from analysis.motion.rig_frame import RigFrame

Array = NDArray[np.float64]
FEWEST_IMPACTS = 20


def find_impact_law(
    impacts: ImpactFit,
    fits: Sequence[FlightFits],
    restitution_terms: Sequence[str],
    frame: RigFrame,
    rng: np.random.Generator,
) -> LawFound | None:
    """The formula that restitution, wall friction, tangential restitution or spin follow; None where chance would find
    as much."""
    if len(impacts.data) < FEWEST_IMPACTS:
        return None
    problem = law_regression(impacts, fits, restitution_terms)
    found, p = find_law(problem.problem, problem.columns, law_candidates(problem.known), rng)
    if found is None:
        return None
    # Scatter that the law explains is no noise: weighed again with it, the law is measured once more.
    sharp = law_regression(impacts, fits, restitution_terms, law_at(found.parts, _values(found)))
    return _told(sharp, found, p, frame)


def find_wall_law(
    impacts: ImpactFit, fits: Sequence[FlightFits], frame: RigFrame, least_m: float, rng: np.random.Generator
) -> LawFound | None:
    """The formula that the contact radius follows, where its size (RMS) is above ``least_m``."""
    wall = impacts.wall.wall
    if len(impacts.data) < FEWEST_IMPACTS or not wall.ellipse_terms:
        return None
    problem = distance_regression(impacts, fits)
    found, p = find_law(problem.problem, problem.columns, wall_candidates(), rng)
    if found is None:
        return None
    moved = problem.columns(found.terms) @ found.coefficients / problem.answers["contact_radius"]
    if np.sqrt(np.mean(moved**2)) <= least_m:
        return None
    # What the law moves is no scatter of the distances: weighed again without it.
    sharp = distance_regression(impacts, fits, law_at(found.parts, _values(found)))
    return _told(sharp, found, p, frame)


def _values(found: Found) -> Array:
    return np.concatenate([found.coefficients, [n for part in found.parts for n in part.numbers]])


def _told(problem: ImpactRegression, found: Found, p: float, frame: RigFrame) -> LawFound:
    values = _values(found)
    covariance = np.zeros((len(values), len(values)))
    count = len(found.coefficients)
    covariance[:count, :count] = found.covariance
    covariance[count:, count:] = np.diag(np.concatenate([np.zeros(0), *found.number_sd]) ** 2)
    rig_law = law_at(found.parts, values, covariance)
    columns = problem.columns(found.terms)
    whole = problem.problem
    before, after = held_out_squares(whole, columns[:, :0]), held_out_squares(whole, columns)
    floor = np.bincount(whole.folds, _noise_of(whole, columns))
    after_problem = replace(problem, problem=_explained(whole, columns @ found.coefficients))
    return LawFound(
        in_world(rig_law, frame),
        rig_law,
        with_sds(lambda v: in_world(law_at(found.parts, v), frame), values, covariance),
        p,
        before / len(whole.residual),
        after / len(whole.residual),
        floor / len(whole.residual),
        others_of(found, frame),
        evidence_of(problem, after_problem, rig_law),
    )


def _noise_of(problem: Regression, columns: Array) -> Array:
    """Square (M,) that noise alone leaves in rows that the law acts on, 1; in the others what they show either way."""
    touched = np.any(columns != 0.0, 1)
    left = problem.residual - problem.nuisances @ problem.fitted(problem.nuisances, problem.prior)
    return np.where(touched, 1.0, left**2)


def _explained(problem: Regression, moved: Array) -> Regression:
    return replace(problem, residual=problem.residual - moved)
