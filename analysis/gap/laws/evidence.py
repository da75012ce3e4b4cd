"""What a law answers to, bin by bin: the residual as a function of the quantity that the law follows, before and after.

No form is assumed: the law's direction (or number) is fitted freely in every bin of the quantity, so that a formula can
be held against points with error bars, and what it leaves against zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.regression.problem import Profile, Regression
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.targets import TARGETS
from ovines.core.laws.terms import Factor, Term, WrittenLaw, rows_of
from ovines.core.laws.words import QUANTITIES

Array = NDArray[np.float64]
BINS = 14
# Functions that fade, shown to so many of their scales: beyond, a figure shows nothing but its axis.
FADING, FADED = ("exponential", "decay", "gaussian"), 8.0
# What all bins share is shown only where it is not this much less known than how they differ: a constant may be an
# effect of the library, or an unknown of each flight.
OPEN = 2.0
# Nor where nuisances take all of it but one part in so many.
MOST_TAKEN = 1e4
Cut = Callable[[Array], Array]


class HasRows(Protocol):
    """A regression that can make columns of a term cut into bins of what it knows."""

    @property
    def problem(self) -> Regression:
        """Residual and nuisances."""

    @property
    def known(self) -> Array:
        """What laws know, (N, KNOWN_SIZE)."""

    def cut_columns(self, term: Term, cut: Cut) -> Array:
        """Columns (M, B) of a term times the weights that ``cut`` gives each state known, (N, B)."""


@dataclass(frozen=True, eq=False)
class Evidence:
    """``covariate`` (B,) means of the bins of the quantity ``name`` in ``unit``; the residual along ``target`` without
    the law (``before``) and with it (``after``), with sds (B,), and the ``law`` itself there, in ``target_unit``."""

    name: str
    unit: str
    target: str
    target_unit: str
    covariate: Array
    before: Array
    before_sd: Array
    after: Array
    after_sd: Array
    law: Array


def evidence_of(before: HasRows, after: HasRows, law: WrittenLaw) -> Evidence | None:
    """The strongest term of ``law`` against the quantity that it follows; None for a constant."""
    term = max(law.terms, key=lambda one: _usual(one, before.known))
    if not term.factors:
        return None
    factor = term.factors[0]
    values = quantity_of(factor, before.known)
    fine = np.abs(values) < 0.5 * W.LONG_AGO_S
    if factor.function in FADING:
        fine &= np.abs(values) < FADED * factor.scale
    if np.count_nonzero(fine) < 2 * BINS:
        return None
    edges = np.unique(np.quantile(values[fine], np.linspace(0, 1, BINS + 1)))
    if len(edges) < 3:
        return None

    def cut(known: Array) -> Array:
        q = quantity_of(factor, known)
        at = np.clip(np.searchsorted(edges, q, side="right") - 1, 0, len(edges) - 2)
        inside = (q >= edges[0]) & (q <= edges[-1])
        out = np.zeros((len(q), len(edges) - 1))
        out[np.arange(len(q))[inside], at[inside]] = 1.0
        return out

    weight = cut(before.known)
    count = np.maximum(weight.sum(0), 1.0)
    bare = replace(term, coefficient=1.0, factors=_others(term, factor))
    given = np.empty((len(before.known), 1))
    # What is left of the term once the factors that do not follow the quantity are taken out.
    sizes(rows_of([replace(term, factors=_own(term, factor))]), before.known, given)
    expected = weight.T @ given[:, 0] / count
    share = weight.sum(0) / weight.sum()
    laws = (expected, np.zeros_like(expected))
    sides = [_profile(one, bare, cut, share, law) for one, law in zip((before, after), laws, strict=True)]
    return Evidence(
        factor.quantity, QUANTITIES[factor.quantity].unit, term.target, bare.unit,
        weight.T @ np.where(fine, values, 0.0) / count, *sides[0], *sides[1], expected,
    )  # fmt: skip


def _own(term: Term, factor: Factor) -> tuple[Factor, ...]:
    return tuple(one for one in term.factors if one.quantity == factor.quantity)


def _others(term: Term, factor: Factor) -> tuple[Factor, ...]:
    return tuple(one for one in term.factors if one.quantity != factor.quantity)


def _profile(one: HasRows, term: Term, cut: Cut, share: Array, law: Array) -> tuple[Array, Array]:
    """What a term is in each bin, and its sd.  What the rows do not tell - a constant, a clock that runs evenly too
    fast - is as the ``law`` has it (B,), of a mean weighted by the ``share`` of each bin."""
    problem, columns = one.problem, one.cut_columns(term, cut)
    profile, whole, mean = Profile.of(problem), columns.sum(1), float(share @ law)
    _, step, covariance = profile.gain(columns)
    step = step + law - covariance @ (profile.information(columns) @ law)
    about = np.eye(len(share)) - share
    apart = about @ covariance @ about.T
    _, _, of_all = profile.gain(whole[:, None])
    hardly_known = share @ covariance @ share > OPEN**2 * float(np.median(np.diag(apart)))
    # What all bins share is a nuisance itself, as the radius is of a wall.
    if hardly_known or not 0.0 < of_all[0, 0] * float(whole @ whole) < MOST_TAKEN:
        step, covariance = about @ step + mean, apart
    return step, np.sqrt(np.maximum(np.diag(covariance), 0.0) * problem.excess)


def quantity_of(factor: Factor, known: Array) -> Array:
    """Values (N,) of a factor's quantity; an angle between minus and plus half a turn."""
    plain = Factor(factor.quantity, x=factor.x, y=factor.y)
    target = next(iter(TARGETS))
    out = np.empty((len(known), 1))
    sizes(rows_of([Term(target, 1.0, (plain,))]), known, out)
    values = out[:, 0]
    return np.asarray(np.angle(np.exp(1j * values)) if QUANTITIES[factor.quantity].circular else values, float)


def _usual(term: Term, known: Array) -> float:
    out = np.empty((len(known), 1))
    sizes(rows_of([term]), known, out)
    return float(np.sqrt(np.mean(np.minimum(out**2, 1e30))))
