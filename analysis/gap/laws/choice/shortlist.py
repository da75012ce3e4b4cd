"""The forms that come first in a problem: the numbers inside each searched, products tried, the nearest others beside
them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.found import Rival
from analysis.gap.laws.choice.listed import PER_UNKNOWN, columns_of
from analysis.gap.laws.choice.numbers_inside import Columns, searched
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import Modulator
from analysis.gap.laws.dictionary.products import products
from analysis.gap.laws.regression.forms import forms_of, held_out_gains
from analysis.gap.laws.regression.problem import Profile, Regression
from ovines.core.laws.terms import Term
from ovines.robust import huber_weight, residual_sd
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]
# A further part must explain this share of what the law explains, and so must each number of a form after its first.
LEAST_SHARE = 0.02
# Forms are told apart by what the best of them leaves, not by all that there is to explain; no less than this share of
# that, as no form is the true one to every digit.  What is so many robust sds off it counts as gross.
LEAST_LEFT, GROSS_SD = 0.1, 5.0
# Forms whose numbers are searched before one is chosen, those with this share of the best one's gain.
SHORTLIST, NEAR = 4, 0.7
# Forms that are multiplied by one quantity more: the first of the shortlist.
MULTIPLIED = 2
# Others named beside a law: the two nearest, and whether they explain as much but for so much of -2 log L.
NEIGHBOURS, AS_GOOD = 2, 9.0


def simplest(candidates: Sequence[Candidate], gains: Array) -> int:
    """The best candidate, each of its unknowns having to earn its place."""
    return int(np.argmax(gains - PER_UNKNOWN * np.array([one.unknowns for one in candidates])))


def left_by(problem: Regression, columns: Columns, best: Candidate, scale: float) -> tuple[float, Regression, Columns]:
    """``scale``, the variance of the rows, as the ``best`` candidate leaves it where it acts; the problem and its
    columns with what is gross beside that weighed down: a few rows that are off explain whatever is asked."""
    table = columns(best.terms)
    acts = np.any(table != 0.0, 1)
    beside = problem.with_columns(table)
    before, after = (one.residual - one.nuisances @ one.fitted(one.nuisances, one.prior) for one in (problem, beside))
    weight = np.ones(len(after))
    usual = residual_sd(after[acts]) if acts.any() else 0.0
    weight[acts] = huber_weight(after[acts], GROSS_SD * usual) if usual > 0 else 1.0
    left, whole = (float(np.sum((weight * one)[acts] ** 2)) for one in (after, before))
    near = replace(problem, residual=weight * problem.residual, nuisances=weight[:, None] * problem.nuisances)

    def weighed(terms: Sequence[Term]) -> Array:
        return np.asarray(weight[:, None] * columns(terms), float)

    return scale * min(max(left / max(whole, 1e-300), LEAST_LEFT), 1.0), near, weighed


def shortlist_of(
    problem: Regression, columns: Columns, candidates: Sequence[Candidate], gains: Array, scale: float
) -> list[tuple[Candidate, float]]:
    """The :data:`SHORTLIST` of forms, the numbers inside each searched, with their gains on held-out runs, best first:
    a form that starts far from its numbers is not yet behind.

    Each further number must earn its price, and a share of what is explained: near enough, it bends any form."""
    price = PER_UNKNOWN * np.array([one.unknowns for one in candidates])
    first: dict[str, int] = {}
    for i in np.argsort(price - gains):
        first.setdefault(candidates[i].name, int(i))
        if len(first) == SHORTLIST:
            break
    chosen = list(first.values())
    least = NEAR * (gains[chosen[0]] - price[chosen[0]])
    close = [i for i in chosen if i == chosen[0] or gains[i] - price[i] >= max(least, 0.0)]
    profile = Profile.of(problem)
    trials = in_threads(searched, [(profile, columns, candidates[i]) for i in close])
    gained = [(one, gain_of(problem, columns, one) / scale - one.looked) for one in trials]
    return sorted(gained, key=lambda one: -worth(*one))


def with_products(
    problem: Regression,
    columns: Columns,
    shortlist: list[tuple[Candidate, float]],
    multipliers: Sequence[Modulator],
    scale: float,
) -> list[tuple[Candidate, float]]:
    """The ``shortlist`` behind the best product of its first forms, where that is clearly better: it pays for every
    product that was looked at."""
    tried = [one for base, _ in shortlist[:MULTIPLIED] for one in products(base, multipliers)]
    if not tried:
        return shortlist
    price = 2.0 * float(np.log(len(tried)))
    tried = [replace(one, looked=one.looked + price) for one in tried]
    table, groups = columns_of(tried, columns, problem.block)
    forms = forms_of(problem, table, groups)
    gains = held_out_gains(forms, np.ones((1, len(forms.fold))))[0] / scale
    best = tried[simplest(tried, gains - np.array([one.looked for one in tried]))]
    best = searched(Profile.of(problem), columns, best)
    gain = gain_of(problem, columns, best) / scale - best.looked
    # Neither holds the other: by chance the best product of a true form gains its price, and a few more in some series.
    return [(best, gain), *shortlist] if worth(best, gain) > worth(*shortlist[0]) + AS_GOOD else shortlist


def rivals_of(
    problem: Regression,
    columns: Columns,
    candidates: Sequence[Candidate],
    gains: Array,
    shortlist: Sequence[tuple[Candidate, float]],
    scale: float,
) -> tuple[Rival, ...]:
    """The nearest other forms, their numbers searched, too: those of the ``shortlist`` behind its first, then the next
    of all."""
    (_, ours), *others = shortlist
    near = [(one, gain) for one, gain in others if gain > 0]
    names, profile = [one.name for one, _ in shortlist], Profile.of(problem)
    for i in np.argsort(-gains):
        if len(near) >= NEIGHBOURS or gains[i] <= 0:
            break
        if candidates[i].name not in names:
            names.append(candidates[i].name)
            other = searched(profile, columns, candidates[i])
            near.append((other, gain_of(problem, columns, other) / scale - other.looked))
    out = []
    for other, gain in sorted(near, key=lambda one: -one[1])[:NEIGHBOURS]:
        _, step, covariance = profile.gain(columns(other.terms))
        out.append(Rival(other, step, covariance * scale, gain / ours if ours > 0 else 0.0, ours - gain > AS_GOOD))
    return tuple(out)


def worth(candidate: Candidate, gain: float) -> float:
    """The ``gain`` of a candidate, its unknowns paid."""
    return paid(gain, candidate.unknowns)


def paid(gain: float, unknowns: int) -> float:
    """A ``gain`` once ``unknowns`` are paid, each after the first by a share of it, too."""
    return gain * (1 - LEAST_SHARE * (unknowns - 1)) - PER_UNKNOWN * unknowns


def gain_of(problem: Regression, columns: Columns, one: Candidate) -> float:
    """Fall of the sum of squares of runs held out that a candidate makes, its numbers as they are."""
    table, groups = columns_of([one], columns, problem.block)
    forms = forms_of(problem, table, groups)
    return float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0])
