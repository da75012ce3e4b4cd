"""What chance alone gains: series without any effect, drawn with these runs' lengths, gaps and noise.

A parametric bootstrap.  Of the flights the scores are drawn with the covariance that their information gives, of the
impacts the whitened residuals; every candidate and probe is then fitted and held out as in the ladder, and the best of
them noted.  What the best reaches once in four hundred such series is the least a candidate must reach to be accepted.
What noise does not make (a lens residual, markers a little off) is not in it: that is what the fixed thresholds of
:mod:`analysis.gap.cause` are for.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from analysis.contact.law import LawData, fit_restitution
from analysis.contact.restitution import restitution_design, speed_scales_m_per_s
from analysis.gap.cause import SMALLEST_P
from analysis.gap.selection.flights.fit import FlightFit, information_of, prior_of
from analysis.gap.selection.flights.terms import FlightTerm
from analysis.gap.selection.impacts.restitution import SPOTS_BY_CHANCE, restitution_groups, spots
from analysis.statistics.robust import covariance_of

Array = NDArray[np.float64]
# Four stages draw lots of their own: one series in a hundred reaches any of their levels.
DRAWS, LEVEL = 400, 1 - 0.01 / 4
# A share of the draws above this is counted, to a fifth or better (20 of 400); a smaller one is read off the tail.
COUNTED_SHARE = 0.05


def flight_null_distribution(
    base: FlightFit, terms: Sequence[FlightTerm], rng: np.random.Generator, draws: int = DRAWS
) -> Array:
    """Best held-out gain (fall of -2 log L) over ``terms`` in each of ``draws`` series in which ``base`` is the truth:
    (draws,).

    The scores' variance is inflated by the misfit that ``base`` leaves, as far as it is above that of white noise.
    """
    without = list(base.columns)
    usable = [
        t for t in terms if set(t.columns) - set(without) and information_of(base.evidence[0], t.columns) is not None
    ]
    names = list(dict.fromkeys([*without, *(c for t in usable for c in t.columns)]))
    forms = [f for f in (information_of(e, names) for e in base.evidence) if f is not None]
    if not usable or not forms:
        return np.zeros(draws)
    excess = max(base.misfit / max(base.count, 1), 1.0)
    scores = [root_of(excess * form) @ rng.standard_normal((len(names), draws)) for form in forms]
    prior = np.diag(prior_of(names, base.fits[0].run.contact_radius_m))
    nested = [
        [names.index(n) for n in dict.fromkeys([*without, *columns])] for columns in [(), *(t.columns for t in usable)]
    ]
    held_out = [held_out_cost(forms, scores, at, prior).sum(0) for at in nested]
    return np.asarray(np.max(held_out[0] - np.array(held_out[1:]), 0))


def held_out_cost(forms: Sequence[Array], scores: Sequence[Array], at: Sequence[int], prior: Array) -> Array:
    """-2 log L (R, D) of each run of D series with the columns ``at`` fitted to its other runs.

    ``forms`` the runs' information (C, C), ``scores`` (C, D) each, ``prior`` (C, C)."""
    total, score = np.sum(forms, 0), np.sum(scores, 0)
    block = np.ix_(at, at)
    cost = []
    for form, own in zip(forms, scores, strict=True):
        # A single recording has nothing to hold out: its own fit stands in, as in the ladder.
        rest, rest_score = (total - form, score - own) if len(forms) > 1 else (total, score)
        estimate = covariance_of(rest[block] + prior[block]) @ rest_score[at]
        cost.append(np.einsum("ad,ad->d", estimate, form[block] @ estimate - 2 * own[at]))
    return np.array(cost)


def root_of(information: Array) -> Array:
    """A matrix (C, C) whose square is ``information``: what gives scores of its covariance."""
    values, vectors = np.linalg.eigh(information)
    return vectors * np.sqrt(np.maximum(values, 0.0))


def impact_null_distribution(data: LawData, base: Sequence[str], rng: np.random.Generator, draws: int = DRAWS) -> Array:
    """Best gain over all effects and probes of the restitution in each of ``draws`` series without any of them:
    (draws,).
    """
    design = restitution_design(data, base)
    groups = [(columns, 0.0) for _, columns, _ in restitution_groups(data, base)]
    groups += [(np.exp(-data.before / scale)[:, None], 0.0) for scale in speed_scales_m_per_s(data)]
    groups += [(bump[:, None], SPOTS_BY_CHANCE) for _, bump in spots(data)]
    scatter = fit_restitution(data, design)[2]
    sd = np.sqrt(data.normal_sd**2 + (scatter * data.before) ** 2)
    noise = rng.standard_normal((len(data), draws))
    held, _ = np.linalg.qr(design * (data.before / sd)[:, None])
    noise = noise - held @ (held.T @ noise)
    best = np.zeros(draws)
    for columns, penalty in groups:
        extra = columns * (data.before / sd)[:, None]
        extra = extra - held @ (held.T @ extra)
        u, size, _ = np.linalg.svd(extra, full_matrices=False)
        determined = size > 1e-9 * max(float(size.max(initial=0.0)), 1e-300)
        best = np.maximum(best, np.sum((u[:, determined].T @ noise) ** 2, 0) - penalty)
    return best


def threshold(null_distribution: Array, fixed: float) -> float:
    """The least gain that is accepted: ``fixed``, or what chance reaches once in four hundred series if that is more
    (``null_distribution`` may be empty: nothing was fitted)."""
    return max(fixed, float(np.quantile(null_distribution, LEVEL))) if len(null_distribution) else fixed


def by_chance(null_distribution: Array, value: float) -> float:
    """How often the best of a series without effect reaches ``value``: counted where it was drawn, beyond that by the
    Gumbel tail of what was drawn (maxima of many; mean and spread give its two parameters); 1 where nothing was
    fitted."""
    drawn = np.asarray(null_distribution, float)
    if not len(drawn):
        return 1.0
    share = float(np.mean(drawn >= value))
    scale = float(np.std(drawn)) * np.sqrt(6) / np.pi
    if share > COUNTED_SHARE or scale <= 0:
        return max(share, 1 / (len(drawn) + 1))
    at = (value - float(np.mean(drawn)) + np.euler_gamma * scale) / scale
    return float(max(-np.expm1(-np.exp(-at)), SMALLEST_P))


def chance_of_largest(gain: float, columns: int, tried: int) -> float:
    """How often the best of ``tried`` terms of ``columns`` unknowns gains so much by chance: chi-square, Bonferroni."""
    return float(np.clip(tried * chdtrc(columns, max(gain, 0.0)), SMALLEST_P, 1.0))


def chance_of_misfit(misfit: float, count: int) -> float:
    """How often noise alone leaves such a sum of squares over ``count`` numbers."""
    return float(np.clip(chdtrc(max(count, 1), max(misfit, 0.0)), SMALLEST_P, 1.0))
