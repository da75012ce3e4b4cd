"""A law that acts linearly on the rows it was found in, as it is reported: impacts, distances, frames."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.found import Found
from analysis.gap.laws.dictionary.candidate import Candidate, law_at, with_sds
from analysis.gap.laws.evidence import evidence_of
from analysis.gap.laws.found_law import LawFound, in_world, others_of
from analysis.gap.laws.regression.halves import halves_of, scatter_of_runs
from analysis.gap.laws.regression.problem import Regression, held_out_squares
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
# Step of a number's difference, in the search's.
STEP = 0.05


class Rows(Protocol):
    """A regression that makes columns of any law's terms."""

    @property
    def problem(self) -> Regression:
        """Residual and nuisances."""

    @property
    def known(self) -> Array:
        """What laws know, (N, KNOWN_SIZE)."""

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds."""

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times weights of what is known."""


def values_of(found: Found) -> Array:
    """Coefficients of all terms, then the numbers inside each part."""
    return np.concatenate([found.coefficients, [n for part in found.parts for n in part.numbers]])


def number_columns(rows: Rows, parts: Sequence[Candidate], coefficients: Array) -> Array:
    """What a unit of each number inside adds to the rows (M, I)."""
    columns, at = [np.zeros((len(rows.problem.residual), 0))], 0
    for part in parts:
        own = coefficients[at : at + len(part.terms)]
        at += len(part.terms)
        for i, (number, by, positive) in enumerate(zip(part.numbers, part.steps, part.positive, strict=True)):
            unit = STEP * (abs(number) * by if positive else by)
            moved = [list(part.numbers) for _ in range(2)]
            moved[0][i] += unit
            moved[1][i] -= unit
            ahead, behind = (rows.columns(part.at(m).terms) @ own for m in moved)
            columns.append(((ahead - behind) / (2 * unit))[:, None])
    return np.hstack(columns)


def reported_law(rows: Rows, found: Found, p: float, frame: RigFrame) -> LawFound:
    """The law of ``found`` as it is reported, held out run by run on ``rows`` whose noise is 1."""
    values = values_of(found)
    covariance = np.zeros((len(values), len(values)))
    count = len(found.coefficients)
    covariance[:count, :count] = found.covariance
    covariance[count:, count:] = np.diag(np.concatenate([np.zeros(0), *found.number_sd]) ** 2)
    columns, whole = rows.columns(found.terms), rows.problem
    moved = columns @ found.coefficients
    covariance *= scatter_of_runs(whole, moved) ** 2
    rig_law = law_at(found.parts, values, covariance)
    before, after = held_out_squares(whole, columns[:, :0]), held_out_squares(whole, columns)
    noise = np.bincount(whole.folds, _noise_of(whole, columns)).astype(float)
    floor = noise * min(1.0, float(after.sum() / noise.sum()))  # noise taken too large: never above the best model
    explained: Any = replace(rows, problem=replace(whole, residual=whole.residual - moved))  # type: ignore[type-var]
    return LawFound(
        in_world(rig_law, frame),
        rig_law,
        with_sds(lambda v: in_world(law_at(found.parts, v), frame), values, covariance),
        p,
        before / len(whole.residual),
        after / len(whole.residual),
        floor / len(whole.residual),
        others_of(found, frame),
        evidence_of(rows, explained, rig_law),
        halves=halves_of(whole, moved),
    )


def _noise_of(problem: Regression, columns: Array) -> Array:
    """Square (M,) that noise alone leaves in rows that the law acts on, 1; in the others what they show either way."""
    touched = np.any(columns != 0.0, 1)
    left = problem.residual - problem.nuisances @ problem.fitted(problem.nuisances, problem.prior)
    return np.where(touched, 1.0, left**2)
