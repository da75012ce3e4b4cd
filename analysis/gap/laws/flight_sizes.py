"""How large a law of the flights is, by the estimator of ``ovines identify``: its coefficients are shared unknowns of
the flights like any other, beside the lens residual and the unknown force that the flights show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX, LAW_TERMS
from analysis.flights.evidence import columns_of
from analysis.flights.fit import ORIGIN, SHARED
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.flight_rows import FlightRegression, regression_of
from analysis.gap.laws.linear_law import number_columns
from analysis.gap.laws.regression.halves import Halves, halves_of
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import run_places
from analysis.identification.floor.errors import FEWEST_FLIGHTS, FEWEST_RUNS, sandwich_factor
from analysis.identification.floor.fit import FloorFit, fit_floor, fit_floor_again
from analysis.identification.floor.priors import HELD_M, NONLINEAR, WEAK_SD, prior_sd
from analysis.identification.lens_residual import LINEAR_SHARE
from analysis.statistics.student import student_over_normal
from ovines.core.laws.terms import Term, rows_of

Array = NDArray[np.float64]
# Rounds of coefficients by the equation of motion and numbers inside by its residuals; a step of these is kept to so
# many of the search's, and they rest within this share of their sds.
ROUNDS, LONGEST_STEP, RESTS_SD = 4, 2.0, 0.1
LINEAR = tuple(name for name in LENS_TERMS if name not in NONLINEAR)
# A law is rejected whose coefficients a fit has turned about or made so many times larger, or none of whose
# coefficients has an sd below so many times itself.
LARGEST_FACTOR = 10.0


@dataclass(frozen=True, eq=False)
class SizedLaw:
    """``parts`` at their numbers; ``values`` of all coefficients, then of the numbers inside, and their
    ``covariance``; ``beside``: the flights' parameters by name as they are beside the law; ``halves``: its size by
    halves of the runs."""

    parts: tuple[Candidate, ...]
    values: Array
    covariance: Array
    beside: dict[str, float]
    halves: Halves | None


def with_law(runs: Sequence[Run], parts: Sequence[Candidate], coefficients: Array) -> tuple[Run, ...]:
    """The runs that hold a law besides what they hold."""
    terms = [term for part in parts for term in part.terms]
    return holding(runs, [replace(t, coefficient=float(c)) for t, c in zip(terms, coefficients, strict=True)])


def holding(runs: Sequence[Run], terms: Sequence[Term]) -> tuple[Run, ...]:
    """The runs that hold ``terms`` besides what they hold."""
    rows = rows_of(terms)
    return tuple(replace(run, data=replace(run.data, law=np.vstack([run.data.law, rows]))) for run in runs)


def sized_law(runs: Sequence[Run], base: FlightFit, parts: Sequence[Candidate], coefficients: Array) -> SizedLaw | None:
    """The law of ``parts`` beside what ``base`` fits; None where the flights do not take it."""
    held = len(runs[0].data.law)
    names = list(LAW_TERMS[held : held + len(coefficients)])
    model, parts = base.model, tuple(parts)
    others = [n for n in model.free if n in SHARED]
    start = {n: float(model.parameters[i]) for n, i in INDEX.items() if model.parameters[i] != 0.0}
    places = run_places([run.data for run in runs])
    drifting = [
        replace(
            run, data=replace(run.data, friction_share=1 + model.drift_per_run * place.number, later_s=place.later_s)
        )
        for run, place in zip(runs, places, strict=True)
    ]
    floor: FloorFit | None = None
    last = np.inf
    for _ in range(ROUNDS):
        holding_it, at_first = with_law(drifting, parts, coefficients), {**start, **dict.fromkeys(names, 1.0)}
        try:
            if floor is None:
                floor = fit_floor(holding_it, [*others, *names], at_first)
            else:
                floor = fit_floor_again(holding_it, floor, at_first)
        except np.linalg.LinAlgError:
            # Numbers that run away: friction on this side of a line that no flight crosses is friction itself.
            return None
        at = [floor.names.index(n) for n in names]
        if not np.all(np.abs(floor.estimate[at]) < LARGEST_FACTOR):
            return None
        start |= {n: float(v) for n, v in zip(floor.names, floor.estimate, strict=True)}
        coefficients = coefficients * floor.estimate[at]
        own_sd = np.abs(coefficients) * np.sqrt(np.diag(floor.covariance)[at])
        columns, rows = _rows_of(floor)
        law = [columns.index(SHARED.index(n)) for n in names]
        step, covariance = _numbers_step(floor, rows, law, parts, coefficients, own_sd)
        if not (np.all(np.isfinite(step)) and np.all(np.isfinite(covariance))):
            return None  # flights that it throws out of the world: a stop at the wall of a hair's width
        inside = np.sqrt(np.diag(covariance)[len(names) :])
        farthest = float(np.max(np.abs(step) / np.maximum(inside, 1e-300), initial=0.0))
        # Steps that grow come to rest nowhere: of edges in time, or of a form that is not the law.
        if farthest <= RESTS_SD or farthest > last:
            break
        parts, last = _stepped(parts, step), farthest
    if np.all(np.sqrt(np.diag(covariance)[: len(names)]) > LARGEST_FACTOR * np.abs(coefficients)):
        return None
    values = np.concatenate([coefficients, [n for part in parts for n in part.numbers]])
    beside = {n: start[n] for n in others if n in start}
    return SizedLaw(parts, values, covariance, beside, _halves(rows.problem, law))


def _rows_of(floor: FloorFit) -> tuple[list[int], FlightRegression]:
    """The columns that a fit shares, and its flights as rows in them."""
    columns = columns_of([*floor.names, *ORIGIN, *LENS_TERMS])
    sds = prior_sd(floor.lens_sd_m)
    prior = np.array([sds.get(SHARED[c], WEAK_SD) for c in columns]) ** -2.0
    return columns, regression_of(floor.fits, floor.noise, columns, prior)


def _halves(problem: Regression, law: Sequence[int]) -> Halves | None:
    """Size of the law whose terms are the columns ``law`` of the nuisances, by halves of the runs."""
    moved = problem.nuisances[:, law].sum(1)
    others = [i for i in range(problem.nuisances.shape[1]) if i not in law]
    without = Regression(
        problem.residual + moved, problem.nuisances[:, others], problem.prior[others], problem.block, problem.run
    )
    return halves_of(without, moved)


def _numbers_step(
    floor: FloorFit,
    rows: FlightRegression,
    law: Sequence[int],
    parts: Sequence[Candidate],
    coefficients: Array,
    own_sd: Array,
) -> tuple[Array, Array]:
    """Step of the numbers inside, where the coefficients (columns ``law``) rest, and the covariance of both: of flights
    or runs that disagree more than their noise lets them (:func:`analysis.identification.floor.errors.disagreement`).
    """
    columns, prior = columns_of([*floor.names, *ORIGIN, *LENS_TERMS]), rows.problem.prior
    order = [*(i for i in range(len(columns)) if i not in law), *law]
    inside = number_columns(rows, parts, coefficients)
    design = np.hstack([rows.problem.nuisances[:, order], inside])
    design[:, len(columns) - len(law) : len(columns)] /= coefficients
    weight = np.concatenate([prior[order][: -len(law)], np.zeros(len(law) + inside.shape[1])])
    seen = design.T @ design
    information = seen + np.diag(weight)
    size = np.sqrt(np.diag(information))
    if not np.all(size > 0):  # a number of which nothing tells
        return np.full(inside.shape[1], np.nan), np.full((len(law) + inside.shape[1],) * 2, np.nan)
    covariance = np.linalg.pinv(information / np.outer(size, size), hermitian=True) / np.outer(size, size)
    # What is no number inside has come to rest: its score is nil, the prior's pull included.
    score = np.concatenate([np.zeros(len(columns)), inside.T @ rows.problem.residual])
    step = covariance @ score
    grown = _disagreement(design, rows, step, covariance)
    # Linear terms of a lens residual are held at nil: what those that may be there do to the others.
    held = [i for i, c in enumerate(order) if SHARED[columns[c]] in LINEAR]
    amplitude_m = floor.lens_sd_m if floor.lens_sd_m > HELD_M else 0.0
    turned = covariance @ seen[:, held] * LINEAR_SHARE * amplitude_m
    covariance = covariance * np.outer(grown, grown) + turned @ turned.T
    own = np.arange(len(columns) - len(law), len(step))
    own_covariance = covariance[np.ix_(own, own)]
    wider = np.ones(len(own_covariance))
    wider[: len(law)] = np.maximum(1.0, own_sd / np.sqrt(np.diag(own_covariance)[: len(law)]))
    return step[len(columns) :], own_covariance * np.outer(wider, wider)


def _disagreement(design: Array, rows: FlightRegression, step: Array, covariance: Array) -> Array:
    """Factor (C,) >= 1 on the sds by which flights, and runs, disagree more than their noise lets them: the sandwich
    estimator clustered by either, wider by what a scatter of so few leaves open (Student's t)."""
    left = rows.problem.residual - design @ step
    factor = np.ones(len(step))
    for cluster, fewest in ((rows.problem.block, FEWEST_FLIGHTS), (rows.problem.run, FEWEST_RUNS)):
        number = np.unique(cluster, return_inverse=True)[1]
        count = int(number.max(initial=-1)) + 1
        if count >= fewest:
            scores = np.zeros((count, len(step)))
            np.add.at(scores, number, design * left[:, None])
            factor = np.maximum(factor, student_over_normal(count - 1) * sandwich_factor(scores, covariance))
    return factor


def _stepped(parts: Sequence[Candidate], step: Array) -> tuple[Candidate, ...]:
    """The parts with their numbers moved by ``step``, scales by their logarithm, none farther than
    :data:`LONGEST_STEP`."""
    out = []
    for part in parts:
        own, step = step[: len(part.numbers)], step[len(part.numbers) :]
        moved = []
        for number, by, size, positive in zip(part.numbers, own, part.steps, part.positive, strict=True):
            unit = abs(number) * size if positive else size
            times = float(np.clip(by / unit, -LONGEST_STEP, LONGEST_STEP))
            moved.append(number * float(np.exp(times * size)) if positive else number + times * size)
        out.append(part.at(moved))
    return tuple(out)
