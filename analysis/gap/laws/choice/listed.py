"""Candidates with their columns in one problem, and what each gains in runs held out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.numbers_inside import Columns
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.regression.forms import (
    Forms,
    Kin,
    Table,
    forms_of,
    held_out_gains,
    in_doubles,
    kin_of,
    stretches,
)
from analysis.gap.laws.regression.problem import Regression
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
# A simpler candidate is taken where the best one's held-out gain is larger by less than this (fall of -2 log L per
# unknown).
PER_UNKNOWN = 4.0
# A column that fewer blocks than this tell of explains them whatever it is; chance, drawn from what is left of them,
# would not know.
FEWEST_BLOCKS = 4.0


def _as_it_is(problem: Regression) -> Regression:
    return problem


@dataclass(frozen=True, eq=False)
class Listed:
    """Candidates with their columns ``table`` (M, C), the ``groups`` of these, what no nuisance changes of their normal
    equations (``kin``), and the price ``looked`` (G,) of each; ``asked``: what a problem is in the table's rows, where
    these are other ones."""

    candidates: Sequence[Candidate]
    table: Table
    groups: list[list[int]]
    kin: tuple[Kin, ...]
    looked: Array
    asked: Callable[[Regression], Regression] = _as_it_is

    @staticmethod
    def of(
        candidates: Sequence[Candidate],
        columns: Callable[[Sequence[Term]], Table],
        problem: Regression,
        asked: Callable[[Regression], Regression] = _as_it_is,
    ) -> Listed:
        """Those of a ``problem``, with ``columns`` in the rows that this has when it is ``asked``."""
        problem = asked(problem)
        table, groups = columns_of(candidates, columns, problem.block)
        looked = np.array([one.looked for one in candidates])
        return Listed(candidates, table, groups, kin_of(problem, table, groups), looked, asked)

    @property
    def prices(self) -> Array:
        """What each (G,) must explain for its unknowns, and for having been looked for."""
        return self.looked + PER_UNKNOWN * np.array([one.unknowns for one in self.candidates])

    def gains(self, problem: Regression, scale: float) -> Array:
        """The held-out gain (G,) of each over ``scale`` beside the nuisances of ``problem``, its price taken off."""
        return self.gains_in(self.asked(problem), scale)[1]

    def gains_in(self, asked: Regression, scale: float) -> tuple[Forms, Array]:
        """Normal equations beside the nuisances of a problem in the table's rows, and those gains."""
        forms = forms_of(asked, self.table, self.groups, self.kin)
        return forms, held_out_gains(forms, np.ones((1, len(forms.fold))))[0] / scale - self.looked


def columns_of(
    candidates: Sequence[Candidate], columns: Callable[[Sequence[Term]], Table], block: NDArray[np.int64]
) -> tuple[Table, list[list[int]]]:
    """Columns (M, C) of all candidates, scaled to unit length, and the places of each; zero where fewer than
    :data:`FEWEST_BLOCKS` blocks would tell of them: what one flight shows is no law."""
    terms = [term for one in candidates for term in one.terms]
    table = columns(terms)
    # In place, as a dictionary's columns of a long series fill a gigabyte.
    length = _lengths(table, block)
    enough = _blocks_telling(length) >= FEWEST_BLOCKS
    size = np.sqrt(np.sum(length**2, 0))
    table[:, ~enough] = 0.0
    table /= np.where(enough & (size > 0), size, 1.0)
    ends = np.cumsum([len(one.terms) for one in candidates])
    return table, [list(range(end - len(one.terms), end)) for one, end in zip(candidates, ends, strict=True)]


def _lengths(table: Table, block: NDArray[np.int64]) -> Array:
    """The length of each column (M, C) in each block, (B, C)."""
    parts = stretches(np.unique(block, return_inverse=True)[1])
    squares = [np.einsum("mc,mc->c", own, own) for own in in_doubles(table, parts)]
    return np.sqrt(np.array(squares).reshape(len(parts), table.shape[1]))


def _blocks_telling(length: Array) -> Array:
    """Over how many blocks columns of such a ``length`` (B, C) in each are spread: the square of the lengths' sum, over
    the sum of their squares (C,)."""
    return np.asarray(length.sum(0) ** 2 / np.maximum(np.sum(length**2, 0), 1e-300), float)


def with_parts(problem: Regression, columns: Columns, parts: Sequence[Candidate]) -> Regression:
    """The problem with the parts of a law fitted along."""
    terms = [term for part in parts for term in part.terms]
    return problem.with_columns(columns(terms)) if terms else problem
