"""What candidates explain of a residual, each run predicted by the others, and what chance would explain.

Rows of a block (a flight, an impact) share whatever noise did to them: chance is drawn by multiplying each block's
residual by a number of its own (the wild bootstrap, Wu 1986), which keeps correlations within a block whatever they
are.  Multiplied is what the best candidate leaves (ter Braak 1992), not what it explains: a strong law would otherwise
pass for strong noise.  But the best of hundreds also explains noise, as much as the best of noise alone does; that much
of it is given back.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.gap.laws.regression.problem import Regression, scaled_inverse

Array = NDArray[np.float64]
# Columns in single or double precision.
Table = NDArray[np.floating[Any]]
# A column of which so little is left beside the others is none: rounding's.
LEAST_LEFT = 1e-9
# What the best of noise alone explains in all but one problem in twenty, of so many drawn, is given back to the noise.
FIRST_DRAWS, GIVEN_BACK = 49, 0.95
# Added to unit diagonals, so that columns that are the same have an inverse.
LEAST_RIDGE = 1e-11


@dataclass(frozen=True, eq=False)
class Kin:
    """Groups of one size: their places ``number`` (G,) among all, their columns ``at`` (G, S), and the columns'
    products ``information`` (R, G, S, S) in each fold."""

    number: NDArray[np.int64]
    at: NDArray[np.int64]
    information: Array


@dataclass(frozen=True, eq=False)
class Forms:
    """Normal equations of nuisances (P) and groups of columns (C): ``nuisance`` (R, P, P) and ``cross`` (R, P, C) of
    each fold, ``kin`` of each size, ``scores`` (B, P + C) of each block, ``fold`` (B,) of each block; ``prior`` (P,).

    Columns of different groups never stand together, so nothing of size C by C is needed."""

    nuisance: Array
    cross: Array
    kin: tuple[Kin, ...]
    scores: Array
    fold: NDArray[np.int64]
    prior: Array

    @cached_property
    def held_out(self) -> tuple[_HeldOut, ...]:
        """Of each fold what no residual changes: chance asks for it again with drawn ones."""
        nuisance, cross = self.nuisance.sum(0) + np.diag(self.prior), self.cross.sum(0)
        return tuple(self._without(r, nuisance, cross) for r in range(len(self.nuisance)))

    def _without(self, r: int, nuisance: Array, cross: Array) -> _HeldOut:
        inverse = scaled_inverse(nuisance - self.nuisance[r])
        rest_cross = cross - self.cross[r]
        turn = inverse @ rest_cross
        own_cross = self.cross[r] - self.nuisance[r] @ turn
        kin = []
        for one in self.kin:
            whole = one.information.sum(0) - one.information[r]
            left = whole - _between(rest_cross, turn, one.at)
            own = one.information[r] - _between(turn, self.cross[r], one.at) - _between(own_cross, turn, one.at)
            determined = np.all(_diagonals(left) > LEAST_LEFT * _diagonals(whole), 1)
            kin.append(_Left(determined, _inverses(left), own))
        return _HeldOut(inverse, turn, own_cross, tuple(kin))


class _Left(NamedTuple):
    """Of groups of one size in one fold: which of them (G,) the others leave anything of, the inverses (G, S, S) of
    that, and the fold's own products (G, S, S)."""

    determined: NDArray[np.bool_]
    inverses: Array
    own: Array


class _HeldOut(NamedTuple):
    """One fold predicted by the others: ``inverse`` (P, P) of their nuisances' normal equations, ``turn`` (P, C) what
    nuisances take of each column, ``cross`` (P, C) of the fold's own once these follow the others' solution; what is
    left of each of the ``kin``."""

    inverse: Array
    turn: Array
    cross: Array
    kin: tuple[_Left, ...]


def forms_of(
    problem: Regression, columns: Table, groups: Sequence[Sequence[int]], kin: tuple[Kin, ...] | None = None
) -> Forms:
    """Normal equations of a problem with ``groups`` of further ``columns`` (M, C); ``kin``: those of the groups, which
    no nuisance changes, where they are known."""
    folds = problem.folds
    first, nuisances = np.unique(problem.block, return_index=True)[1], problem.nuisances
    parts = stretches(folds)
    nuisance = np.array([nuisances[rows].T @ nuisances[rows] for rows in parts])
    cross = np.array([nuisances[rows].T @ own for rows, own in zip(parts, in_doubles(columns, parts), strict=True)])
    kin = kin_of(problem, columns, groups) if kin is None else kin
    scores = _scores(problem, columns, problem.residual)
    return Forms(nuisance, cross, kin, scores, folds[first], problem.prior)


def kin_of(problem: Regression, columns: Table, groups: Sequence[Sequence[int]]) -> tuple[Kin, ...]:
    """Groups of ``columns`` (M, C) by their size, and their products in each fold of a problem."""
    size = np.array([len(group) for group in groups])
    numbers = [np.flatnonzero(size == s) for s in np.unique(size)]
    ats = [np.array([groups[int(g)] for g in number], np.int64).reshape(len(number), -1) for number in numbers]
    products: list[list[Array]] = [[] for _ in numbers]
    for own in in_doubles(columns, stretches(problem.folds)):
        squares = np.einsum("mc,mc->c", own, own)
        for of_size, at in zip(products, ats, strict=True):
            of_size.append(_products(own, squares, at))
    return tuple(Kin(number, at, np.array(all_)) for number, at, all_ in zip(numbers, ats, products, strict=True))


def in_doubles(columns: Table, parts: Sequence[NDArray[np.int64] | slice]) -> Iterator[Array]:
    """Each of the ``parts`` of a table (M, C) in double precision, until the next: a dictionary's is kept in single, as
    it is the largest thing that a diagnosis holds."""
    if columns.dtype == float:
        yield from (np.asarray(columns[rows], float) for rows in parts)
        return
    rows_of = np.arange(len(columns))
    room = np.empty((max(len(rows_of[rows]) for rows in parts), columns.shape[1]))
    for rows in parts:
        own = room[: len(rows_of[rows])]
        own[:] = columns[rows]
        yield own


def stretches(number: NDArray[np.int64]) -> list[NDArray[np.int64] | slice]:
    """Rows of each number from 0 on, as a stretch where they are one: that needs no copy of them."""
    parts: list[NDArray[np.int64] | slice] = []
    for r in range(number.max(initial=-1) + 1):
        rows = np.flatnonzero(number == r)
        first, last = (int(rows[0]), int(rows[-1])) if len(rows) else (0, -1)
        parts.append(slice(first, last + 1) if last + 1 - first == len(rows) else rows)
    return parts


def _products(columns: Array, squares: Array, at: NDArray[np.int64]) -> Array:
    """Products (G, S, S) of the columns of each group (G, S), whose ``squares`` (C,) are known."""
    size = at.shape[1]
    out = np.empty((len(at), size, size))
    for a in range(size):
        out[:, a, a] = squares[at[:, a]]
        for b in range(a + 1, size):
            out[:, a, b] = np.einsum("mg,mg->g", columns[:, at[:, a]], columns[:, at[:, b]])
            out[:, b, a] = out[:, a, b]
    return out


def gains_by_chance(
    problem: Regression,
    columns: Table,
    groups: Sequence[Sequence[int]],
    best: Sequence[int],
    drawn: tuple[int, np.random.Generator],
    forms: Forms | None = None,
    prices: Array | None = None,
) -> tuple[Array, Array]:
    """Held-out gain (G,) of each group of ``columns``, and the largest gain (D,) in each of ``drawn`` problems (how
    many, and what draws) that hold noise alone: what the groups ``best`` leave (none: the one that gains most), and of
    what they explain as much as chance's best do, each block times a normal number.  ``forms``: those of the problem,
    where they are known; ``prices`` (G,): what each group must gain before it counts.

    Turned signs alone are too few where a dozen flights tell most: of 150 problems of noise (a series of 80 flights,
    some 840 candidates) 3 % had p below 1 in 4000 and 9 % below 1 in 100; so none and 0.7 %."""
    forms = forms_of(problem, columns, groups) if forms is None else forms
    gains = held_out_gains(forms, np.ones((1, len(forms.fold))))[0]
    price = np.zeros(len(gains)) if prices is None else prices
    best = best or [int(np.argmax(gains - price))]
    taken = problem.with_columns(np.asarray(columns[:, sorted({i for one in best for i in groups[one]})], float))
    left = problem.residual - taken.nuisances @ taken.fitted(taken.nuisances, taken.prior)
    explained = problem.residual - problem.nuisances @ problem.fitted(problem.nuisances, problem.prior) - left
    draws, rng = drawn

    def largest(noise: Array, count: int) -> Array:
        drawn = rng.standard_normal((count, len(forms.fold)))
        return np.asarray((held_out_gains(forms, drawn, _scores(problem, columns, noise)) - price).max(1), float)

    usual = float(np.quantile(largest(left, FIRST_DRAWS), GIVEN_BACK) + price[best[0]])
    by_chance = len(best) * max(usual, 0.0)
    given_back = min(1.0, np.sqrt(by_chance / max(float(explained @ explained), 1e-300)))
    return gains, largest(left + given_back * explained, draws)


def _scores(problem: Regression, columns: Table, residual: Array) -> Array:
    """Scores (B, P + C) of each block."""
    parts = stretches(np.unique(problem.block, return_inverse=True)[1])
    by_columns = np.array([residual[rows] @ own for rows, own in zip(parts, in_doubles(columns, parts), strict=True)])
    held = np.array([residual[rows] @ problem.nuisances[rows] for rows in parts])
    return np.hstack([one.reshape(len(parts), -1) for one in (held, by_columns)])


def held_out_gains(forms: Forms, signs: Array, scores: Array | None = None) -> Array:
    """Fall of the sum of squares (D, G) of each fold, predicted by the others, when a group of columns is fitted beside
    the nuisances; ``signs`` (D, B) of the blocks' residuals; ``scores``: other blocks' than those of the forms."""
    gains = np.zeros((len(signs), sum(len(one.number) for one in forms.kin)))
    for fold, pushed, own_score in _by_fold(forms, signs, scores):
        _add_foretold(forms, fold, pushed, own_score, gains)
    return gains


def gains_of_choice(forms: Forms, prices: Array) -> Array:
    """Fall of the sum of squares (R,) of each fold, predicted by the group of columns that the others alone choose: of
    the largest fall there less its price (G,).  Of noise it is as often a rise: the fold had no part in the choice."""
    out = []
    for fold, pushed, own_score in _by_fold(forms, np.ones((1, len(forms.fold)))):
        foretold, explained = np.zeros((1, len(prices))), np.zeros(len(prices))
        _add_foretold(forms, fold, pushed, own_score, foretold)
        for one, left in zip(forms.kin, fold.kin, strict=True):
            score = pushed[0, one.at]
            gain = np.einsum("ga,gab,gb->g", score, left.inverses, score)
            explained[one.number] = np.where(left.determined, gain, 0.0)
        out.append(float(foretold[0, int(np.argmax(explained - prices))]))
    return np.array(out)


def _by_fold(forms: Forms, signs: Array, scores: Array | None = None) -> Iterator[tuple[_HeldOut, Array, Array]]:
    """Each fold, the scores (D, C) of the columns in the others beside the nuisances, and those in its own once the
    nuisances follow the others' solution."""
    scores = forms.scores if scores is None else scores
    folds = len(forms.nuisance)
    by_fold = np.stack([signs[:, forms.fold == r] @ scores[forms.fold == r] for r in range(folds)])
    held = forms.nuisance.shape[1]
    score = by_fold.sum(0)
    for here, fold in zip(by_fold, forms.held_out, strict=True):
        rest_score = score - here
        pushed = rest_score[:, held:] - rest_score[:, :held] @ fold.turn
        nuisances = rest_score[:, :held] @ fold.inverse
        yield fold, pushed, here[:, held:] - here[:, :held] @ fold.turn - nuisances @ fold.cross


def _add_foretold(forms: Forms, fold: _HeldOut, pushed: Array, own_score: Array, gains: Array) -> None:
    """Add to ``gains`` (D, G) the fall of a fold's own sum of squares that the others foretell."""
    for one, left in zip(forms.kin, fold.kin, strict=True):
        _add_gains(one.number, one.at, left, pushed, own_score, np.empty(one.at.shape[1]), gains)


@compiled
def _add_gains(
    number: NDArray[np.int64],
    at: NDArray[np.int64],
    left: _Left,
    pushed: Array,
    own_score: Array,
    step: Array,
    gains: Array,
) -> None:
    """Of groups of one size; ``step`` (S,) holds the coefficients of one."""
    size, determined, inverses, own = at.shape[1], left.determined, left.inverses, left.own
    for d in range(pushed.shape[0]):
        for g in range(at.shape[0]):
            if not determined[g]:
                continue
            for b in range(size):
                step[b] = 0.0
                for a in range(size):
                    step[b] += pushed[d, at[g, a]] * inverses[g, a, b]
            gain = 0.0
            for a in range(size):
                rest = 2.0 * own_score[d, at[g, a]]
                for b in range(size):
                    rest -= own[g, a, b] * step[b]
                gain += step[a] * rest
            gains[d, number[g]] += gain


def _between(first: Array, second: Array, at: NDArray[np.int64]) -> Array:
    """Products (G, S, S) of columns of two matrices (P, C), group by group."""
    return np.einsum("pga,pgb->gab", first[:, at], second[:, at], optimize=True)


def _diagonals(matrices: Array) -> Array:
    return np.diagonal(matrices, axis1=1, axis2=2)


def _inverses(matrices: Array) -> Array:
    """:func:`scaled_inverse` of each of (G, S, S)."""
    size = np.sqrt(np.maximum(_diagonals(matrices), 0.0))
    scale = np.where(size > 0, 1 / np.where(size > 0, size, 1.0), 0.0)
    outer = scale[:, :, None] * scale[:, None, :]
    some = LEAST_RIDGE * np.eye(matrices.shape[1])
    return np.asarray(np.linalg.inv(matrices * outer + some) * outer, float)
