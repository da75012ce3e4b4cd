"""The choice of a formula: forward by held-out runs, numbers inside searched, what another may replace replaced, and a
chance that counts every candidate that was tried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.choice.found import Found, Rival
from analysis.gap.laws.choice.listed import PER_UNKNOWN, Listed, columns_of, with_parts
from analysis.gap.laws.choice.numbers_inside import Columns, Numbers, searched
from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.dictionary.modulated import Modulator
from analysis.gap.laws.dictionary.products import products
from analysis.gap.laws.regression.forms import (
    Forms,
    forms_of,
    gains_by_chance,
    gains_of_choice,
    held_out_gains,
)
from analysis.gap.laws.regression.problem import Profile, Regression
from analysis.gap.selection.null_distribution import by_chance
from ovines.core.laws.terms import Term, most_terms
from ovines.robust import huber_weight, residual_sd
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]
# Problems of noise drawn; one series in a thousand over four stages, also for further parts of a law; parts of a law at
# the most.  One in a hundred where a law is told only if it is believed, too: it is large, closes half, and is in both
# halves of the runs.  Where a probe has already found that something is left, a law only says what it follows: one such
# stage in a hundred gets one by chance.
DRAWS, LEVEL, LEVEL_BELIEVED, LEVEL_WHERE_LEFT, MOST_PARTS = 199, 0.001 / 4, 0.01 / 4, 0.01, 6
# What the best candidate leaves is searched for further parts, this many at the most, before it counts as noise; each
# must gain this share of what the best does, and so much: more than chance's best does in most problems.
MORE_PARTS, LEAST_MORE, LEAST_MORE_GAIN = 3, 0.05, 25.0
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
    asked = _asked(problem, columns, listed, (), rng, level)
    if asked.p > level:
        return None, asked.p
    found = _built(problem, columns, listed, asked, (rng, level), multipliers, most_parts)
    names = {one.name for one in listed.candidates}
    if found is not None and any(part.name not in names for part in found.parts):
        plain = _built(problem, columns, listed, asked, (rng, level), (), most_parts)
        if plain is not None and _worth_of(plain) + AS_GOOD >= _worth_of(found):
            found = plain
    return found, asked.p


@dataclass(frozen=True, eq=False)
class _Asked:
    """The ``best`` candidate beside the parts that a problem ``held`` has, the ``gains`` (G,) of all, and how often
    chance finds as much (``p``)."""

    held: Regression
    best: int
    gains: Array
    p: float


def _asked(
    problem: Regression,
    columns: Columns,
    listed: Listed,
    parts: Sequence[Candidate],
    rng: np.random.Generator,
    level: float,
) -> _Asked:
    """What runs held out want most beside ``parts``; the law's first part is asked for at ``level``."""
    least_p = LEVEL if parts else level
    scale, candidates = problem.excess, listed.candidates
    held = with_parts(problem, columns, parts)
    asked = listed.asked(held)
    forms, gains = listed.gains_in(asked, scale)
    best = _simplest(candidates, gains)
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
    return _Asked(held, best, gains, p)


def _built(
    problem: Regression,
    columns: Columns,
    listed: Listed,
    asked: _Asked,
    chance: tuple[np.random.Generator, float],
    multipliers: Sequence[Modulator],
    most_parts: int,
) -> Found | None:
    """The law, part by part; ``asked``: of the first; ``chance``: what draws, and the level at which that was asked."""
    rng, level = chance
    scale, candidates, first_p = problem.excess, listed.candidates, asked.p
    parts: list[Candidate] = []
    rivals: tuple[Rival, ...] = ()
    gained = 0.0
    while asked.gains[asked.best] >= LEAST_SHARE * gained:
        held, gains = asked.held, asked.gains
        beside, near, weighed = _left(held, columns, candidates[asked.best], scale)
        free = np.isfinite(listed.looked)
        nearer = np.full(len(gains), -np.inf)
        nearer[free] = (gains[free] + listed.looked[free]) * scale / beside - listed.looked[free]
        shortlist = shortlist_of(near, weighed, candidates, nearer, beside)
        shortlist = _with_products(near, weighed, shortlist, multipliers, beside)
        part, own = shortlist[0]
        terms = [term for one in (*parts, part) for term in one.terms]
        if own <= 0 or len(terms) > most_terms(terms):
            break
        if not parts:
            gained = float(gains[asked.best])
            rivals = _rivals(near, weighed, candidates, nearer, shortlist, beside)
        parts = _replaced(problem, columns, [*parts, part], listed)
        if len(parts) == most_parts:
            break
        asked = _asked(problem, columns, listed, parts, rng, level)
        if asked.p > LEVEL:
            break
    return _measured(problem, columns, parts, first_p, rivals, scale) if parts else None


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
        first = _simplest(listed.candidates, again)
        if again[first] < max(LEAST_MORE * float(gains[best]), LEAST_MORE_GAIN):
            break
        chosen.append(first)
    return chosen[1:]


def _left(problem: Regression, columns: Columns, best: Candidate, scale: float) -> tuple[float, Regression, Columns]:
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


def _simplest(candidates: Sequence[Candidate], gains: Array) -> int:
    """The best candidate, each of its unknowns having to earn its place."""
    return int(np.argmax(gains - PER_UNKNOWN * np.array([one.unknowns for one in candidates])))


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
    gained = [(one, _gain(problem, columns, one) / scale - one.looked) for one in trials]
    return sorted(gained, key=lambda one: -_worth(*one))


def _with_products(
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
    best = tried[_simplest(tried, gains - np.array([one.looked for one in tried]))]
    best = searched(Profile.of(problem), columns, best)
    gain = _gain(problem, columns, best) / scale - best.looked
    # Neither holds the other: by chance the best product of a true form gains its price, and a few more in some series.
    return [(best, gain), *shortlist] if _worth(best, gain) > _worth(*shortlist[0]) + AS_GOOD else shortlist


def _worth(candidate: Candidate, gain: float) -> float:
    return _paid(gain, candidate.unknowns)


def _worth_of(found: Found) -> float:
    """The gain of a whole law, its unknowns and the looking paid."""
    gain = found.gain - sum(part.looked for part in found.parts)
    return _paid(gain, sum(part.unknowns for part in found.parts))


def _paid(gain: float, unknowns: int) -> float:
    return gain * (1 - LEAST_SHARE * (unknowns - 1)) - PER_UNKNOWN * unknowns


def _rivals(
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
    told = [(one, gain) for one, gain in others if gain > 0]
    names, profile = [one.name for one, _ in shortlist], Profile.of(problem)
    for i in np.argsort(-gains):
        if len(told) >= NEIGHBOURS or gains[i] <= 0:
            break
        if candidates[i].name not in names:
            names.append(candidates[i].name)
            other = searched(profile, columns, candidates[i])
            told.append((other, _gain(problem, columns, other) / scale - other.looked))
    out = []
    for other, gain in sorted(told, key=lambda one: -one[1])[:NEIGHBOURS]:
        _, step, covariance = profile.gain(columns(other.terms))
        out.append(Rival(other, step, covariance * scale, gain / ours if ours > 0 else 0.0, ours - gain > AS_GOOD))
    return tuple(out)


def _gain(problem: Regression, columns: Columns, one: Candidate) -> float:
    table, groups = columns_of([one], columns, problem.block)
    forms = forms_of(problem, table, groups)
    return float(held_out_gains(forms, np.ones((1, len(forms.fold))))[0, 0])


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
        best = listed.candidates[_simplest(listed.candidates, gains)]
        if best.name == parts[i].name or best.name in [one.name for one in others]:
            continue
        trial = searched(Profile.of(held), columns, best)
        if _gain(held, columns, trial) > _gain(held, columns, parts[i]) + AS_GOOD * problem.excess:
            parts = [*parts[:i], trial, *parts[i + 1 :]]
    return parts


def _measured(
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
