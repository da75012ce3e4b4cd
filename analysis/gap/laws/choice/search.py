"""The choice of a formula: forward by held-out runs, numbers inside searched, what another may replace replaced, and a
chance that counts every candidate that was tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.found import Found, Rival
from analysis.gap.laws.choice.listed import PER_UNKNOWN, Listed, with_parts
from analysis.gap.laws.choice.numbers_inside import Columns, Numbers, searched
from analysis.gap.laws.choice.shortlist import (
    AS_GOOD,
    LEAST_SHARE,
    gain_of,
    left_by,
    paid,
    rivals_of,
    shortlist_of,
    simplest,
    with_products,
)
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import Modulator
from analysis.gap.laws.regression.forms import (
    Forms,
    forms_of,
    gains_by_chance,
    gains_of_choice,
    held_out_gains,
)
from analysis.gap.laws.regression.problem import Profile, Regression
from analysis.gap.selection.null_distribution import by_chance
from ovines.core.laws.terms import most_terms

Array = NDArray[np.float64]
# Problems of noise.  One series in a thousand over four stages, also for further parts of a law; one in a hundred
# where a law is reported only if it is believed, too: large, closing half, and in both halves of the runs.  Where a
# probe has already found that something is left, a law only says what it follows: one such stage in a hundred gets one
# by chance, and there one in a hundred by the runs is enough for a further part, too.  Parts of a law at the most.
DRAWS, LEVEL, LEVEL_BELIEVED, LEVEL_WHERE_LEFT, MOST_PARTS = 199, 0.001 / 4, 0.01 / 4, 0.01, 6
# What the best candidate leaves is searched for further parts, this many at the most, before it counts as noise; each
# must gain this share of what the best does, and so much: more than chance's best does in most problems.
MORE_PARTS, LEAST_MORE, LEAST_MORE_GAIN = 3, 0.05, 25.0


def find_law(
    problem: Regression,
    columns: Columns,
    candidates: Sequence[Candidate] | Listed,
    rng: np.random.Generator,
    level: float = LEVEL,
    multipliers: Sequence[Modulator] = (),
    most_parts: int = MOST_PARTS,
) -> tuple[Found | None, float]:
    """The formula that held-out runs ask for, None where chance finds as much as often as ``level`` (of the first part;
    of further ones :data:`LEVEL`, or :data:`LEVEL_WHERE_LEFT` by the runs); and how often chance does.  A part may be a
    candidate times one of ``multipliers`` where that earns what looking for it takes.  ``candidates``: with their
    columns in the problem, where these are known.

    A product may pose as a cause of several parts, and then hides them: where one was taken, the law is also built
    without products, and the one that says more is kept (a felted floor: 0.57 of what its own law closes, then
    0.999)."""
    listed = candidates if isinstance(candidates, Listed) else Listed.of(candidates, columns, problem)
    first = _wanted(problem, columns, listed, (), rng, level)
    if first.p > level:
        return None, first.p
    found = _built(problem, columns, listed, first, (rng, level), multipliers, most_parts)
    names = {one.name for one in listed.candidates}
    if found is not None and any(part.name not in names for part in found.parts):
        plain = _built(problem, columns, listed, first, (rng, level), (), most_parts)
        if plain is not None and _worth_of(plain) + AS_GOOD >= _worth_of(found):
            found = plain
    return found, first.p


@dataclass(frozen=True, eq=False)
class _Wanted:
    """The ``best`` candidate beside the parts that a problem ``held`` has, the ``gains`` (G,) of all, and how often
    chance finds as much (``p``)."""

    held: Regression
    best: int
    gains: Array
    p: float


def _wanted(
    problem: Regression,
    columns: Columns,
    listed: Listed,
    parts: Sequence[Candidate],
    rng: np.random.Generator,
    level: float,
) -> _Wanted:
    """What runs held out want most beside ``parts``; the law's first part is asked for at ``level``."""
    least_p = LEVEL if parts else level
    scale, candidates = problem.excess, listed.candidates
    held = with_parts(problem, columns, parts)
    asked = listed.asked(held)
    forms, gains = listed.gains_in(asked, scale)
    best = simplest(candidates, gains)
    # What chance's best gains is what is left of its gain, too, once its unknowns and the looking are paid.
    prices = scale * listed.prices
    worth = float(gains[best] - PER_UNKNOWN * candidates[best].unknowns)
    null = gains_by_chance(asked, listed.table, listed.groups, [best], (DRAWS, rng), forms, prices)[1] / scale
    p = by_chance(null, worth)
    if p > least_p and level == LEVEL_WHERE_LEFT:
        by_runs = _by_runs(forms, prices)
        more = _with_more(held, columns, listed, best, gains) if by_runs > LEVEL_WHERE_LEFT else []
        if more:
            chosen = [best, *more]
            null = gains_by_chance(asked, listed.table, listed.groups, chosen, (DRAWS, rng), forms, prices)[1] / scale
            p = min(p, by_chance(null, worth))
        p = min(p, by_runs * least_p / LEVEL_WHERE_LEFT)  # once in a hundred by the runs is enough for every part
    return _Wanted(held, best, gains, p)


def _built(
    problem: Regression,
    columns: Columns,
    listed: Listed,
    first: _Wanted,
    chance: tuple[np.random.Generator, float],
    multipliers: Sequence[Modulator],
    most_parts: int,
) -> Found | None:
    """The law, part by part, the ``first`` as wanted; ``chance``: what draws, and the level at which that was asked."""
    rng, level = chance
    scale, candidates, wanted = problem.excess, listed.candidates, first
    parts: list[Candidate] = []
    rivals: tuple[Rival, ...] = ()
    gained = 0.0
    while wanted.gains[wanted.best] >= LEAST_SHARE * gained:
        held, gains = wanted.held, wanted.gains
        beside, near, weighed = left_by(held, columns, candidates[wanted.best], scale)
        free = np.isfinite(listed.looked)
        nearer = np.full(len(gains), -np.inf)
        nearer[free] = (gains[free] + listed.looked[free]) * scale / beside - listed.looked[free]
        shortlist = shortlist_of(near, weighed, candidates, nearer, beside)
        shortlist = with_products(near, weighed, shortlist, multipliers, beside)
        part, own = shortlist[0]
        terms = [term for one in (*parts, part) for term in one.terms]
        if own <= 0 or len(terms) > most_terms(terms):
            break
        if not parts:
            gained = float(gains[wanted.best])
            rivals = rivals_of(near, weighed, candidates, nearer, shortlist, beside)
        parts = _replaced(problem, columns, [*parts, part], listed)
        if len(parts) == most_parts:
            break
        wanted = _wanted(problem, columns, listed, parts, rng, level)
        if wanted.p > LEVEL:
            break
    return measured(problem, columns, parts, first.p, rivals, scale) if parts else None


def _by_runs(forms: Forms, prices: Array) -> float:
    """How often chance lets the runs agree as well that something of the dictionary is there: each run is predicted by
    what the others alone choose, and the signed ranks of what that gains are held against equal chances of a gain and
    a loss.

    Where a probe has found something, and a candidate is a part of it only, what it leaves is no noise: signs drawn for
    that find as much as the part does (contacts that rest, in seven runs: 0.06 by signs, 1 in 128 by runs).  It
    takes seven runs to say 1 in 100 so."""
    from scipy.stats import wilcoxon  # takes long to load, and most series have no law

    gains = gains_of_choice(forms, prices)
    return float(wilcoxon(gains, alternative="greater", method="exact").pvalue) if np.any(gains) else 1.0


def _with_more(held: Regression, columns: Columns, listed: Listed, best: int, gains: Array) -> list[int]:
    """What else runs held out ask for beside the ``best`` candidate, one after the other.

    A cause of several parts, or one that the best is near to only, leaves a pattern: of few runs, signs drawn for that
    find as much as the best does (0.22 where it gained 1209 in six runs)."""
    chosen = [best]
    while len(chosen) <= MORE_PARTS:
        beside = with_parts(held, columns, [listed.candidates[i] for i in chosen])
        again = listed.gains(beside, held.excess)
        again[chosen] = -np.inf
        first = simplest(listed.candidates, again)
        if again[first] < max(LEAST_MORE * float(gains[best]), LEAST_MORE_GAIN):
            break
        chosen.append(first)
    return chosen[1:]


def _worth_of(found: Found) -> float:
    """The gain of a whole law, its unknowns and the looking paid."""
    gain = found.gain - sum(part.looked for part in found.parts)
    return paid(gain, sum(part.unknowns for part in found.parts))


def _replaced(
    problem: Regression,
    columns: Columns,
    parts: list[Candidate],
    listed: Listed,
) -> list[Candidate]:
    """Earlier parts chosen once more beside the later ones: what a single part imitated may be another beside two."""
    if len(parts) < 2:
        return parts
    for i in range(len(parts) - 1):
        others = [one for j, one in enumerate(parts) if j != i]
        held = with_parts(problem, columns, others)
        gains = listed.gains(held, problem.excess)
        best = listed.candidates[simplest(listed.candidates, gains)]
        if best.name == parts[i].name or best.name in [one.name for one in others]:
            continue
        trial = searched(Profile.of(held), columns, best)
        if gain_of(held, columns, trial) > gain_of(held, columns, parts[i]) + AS_GOOD * problem.excess:
            parts = [*parts[:i], trial, *parts[i + 1 :]]
    return parts


def measured(
    problem: Regression, columns: Columns, parts: Sequence[Candidate], p: float, rivals: tuple[Rival, ...], scale: float
) -> Found:
    """Coefficients and numbers of the parts together, with the sds that both leave each other."""
    terms = [term for part in parts for term in part.terms]
    profile = Profile.of(problem)
    _, step, _ = profile.gain(columns(terms))
    # Derivatives with respect to numbers inside, at the coefficients found.
    jacobian, place = [columns(terms)], 0
    moved: list[Numbers] = []
    for part in parts:
        own = step[place : place + len(part.terms)]
        place += len(part.terms)
        free = Numbers(part)
        moved.append(free)
        for i in range(len(part.numbers)):
            h = np.zeros(len(part.numbers))
            h[i] = 0.05
            ahead, behind = (columns(free.at(sign * h).terms) @ own for sign in (1.0, -1.0))
            jacobian.append(((ahead - behind) / 0.1)[:, None])
    _, _, covariance = profile.gain(np.hstack(jacobian))
    covariance = covariance * scale
    count, sds, at = len(terms), [], len(terms)
    for free in moved:
        n = len(free.candidate.numbers)
        sds.append(free.sd(np.sqrt(np.maximum(np.diag(covariance)[at : at + n], 0.0))))
        at += n
    table = columns(terms)
    forms = forms_of(problem, table, [list(range(count))])
    gain = float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0]) / scale
    return Found(tuple(parts), step, covariance[:count, :count], tuple(sds), gain, p, rivals)
