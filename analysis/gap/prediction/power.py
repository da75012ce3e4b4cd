"""How much of what is in nobody's list this series would have shown.

Causes of the probes' kinds, of any size from negligible to a hundred times that (every decade alike) and of any
direction, are put into this rig's own quadratic forms and impacts, with its noise; those that would have been accepted
are counted.  What is left unseen is what "nothing is left" may still hide.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.special import chndtr

from analysis.contact.restitution import restitution_design
from analysis.gap.ladder import Ladder
from analysis.gap.selection.flight_candidates import Units
from analysis.gap.selection.flight_steps import FlightSteps
from analysis.gap.selection.flights.fit import FlightFit, prior_of
from analysis.gap.selection.flights.terms import FlightTerm, terms
from analysis.gap.selection.impact_steps import ImpactSteps
from analysis.gap.selection.impacts.gain import negligible_share
from analysis.gap.selection.impacts.restitution import SPOTS_BY_CHANCE, restitution_groups, spots
from analysis.gap.selection.null_distribution import held_out_cost, root_of, threshold
from analysis.gap.thresholds import GAIN, IMPACT_GAIN, IMPROVED
from analysis.statistics.robust import covariance_of

Array = NDArray[np.float64]
# Causes drawn of each kind, and the largest in units of the negligible one.
DRAWS, LARGEST = 60, 100.0
# No restitution differs from its mean by more than this (RMS).
MOST_RESTITUTION = 0.3


def share_seen(ladder: Ladder, rng: np.random.Generator) -> dict[str, float]:
    """Share of causes in nobody's list that would have been seen, by stage: ``flight``, and ``impact`` where a law was
    fitted."""
    out = {"flight": flights_seen(ladder.flights, rng)}
    if ladder.impacts.fitted is not None:
        out["impact"] = impacts_seen(ladder.impacts, rng)
    return out


def flights_seen(steps: FlightSteps, rng: np.random.Generator) -> float:
    """Share of forces of the probes' kinds that the flights would have shown."""
    base, least = steps.fitted, threshold(steps.null_distribution, GAIN / 2)
    names = base.forms.names
    kinds = [t for t in terms(frozenset())[1] if set(t.columns) <= set(names) - set(base.columns)]
    seen = [_seen(base, kind, least, steps.units, rng) for kind in kinds]
    return float(np.mean(seen)) if seen else 0.0


def _seen(base: FlightFit, kind: FlightTerm, least: float, units: Units, rng: np.random.Generator) -> float:
    """Share of drawn forces of one ``kind`` that would have been accepted."""
    others, columns = [c for c in base.columns if c not in kind.columns], list(kind.columns)
    at = base.forms.at([*others, *columns])
    forms = [information[np.ix_(at, at)] for information in base.forms.information]
    unit = np.array([units.of(c) for c in columns])
    if not np.all(unit > 0) or not forms:
        return 0.0
    direction = rng.standard_normal((len(columns), DRAWS))
    size = units.negligible_m_per_s2 * LARGEST ** rng.random(DRAWS)
    force = np.zeros((len(at), DRAWS))
    force[len(others) :] = direction / np.linalg.norm(direction, axis=0) * size / unit[:, None]
    excess = max(base.misfit / max(base.count, 1), 1.0)
    scores = [form @ force + root_of(excess * form) @ rng.standard_normal(force.shape) for form in forms]
    prior = np.diag(prior_of([*others, *columns], base.forms.contact_radius_m))
    nested = list(range(len(others))), list(range(len(at)))
    without, whole = (held_out_cost(forms, scores, one, prior) for one in nested)
    total, score = np.sum(forms, 0) + prior, np.sum(scores, 0)
    estimates = [covariance_of(total[np.ix_(one, one)]) @ score[one] for one in nested]
    gain = np.sum(score * estimates[1], 0) - np.sum(score[: len(others)] * estimates[0], 0)
    found = np.linalg.norm(estimates[1][len(others) :] * unit[:, None], axis=0)
    accepted = (gain > GAIN) & ((without - whole).sum(0) > least) & (found > units.negligible_m_per_s2)
    return float(np.mean(accepted & (np.mean(without > whole, 0) >= IMPROVED)))


def impacts_seen(steps: ImpactSteps, rng: np.random.Generator) -> float:
    """Share of laws of the restitution, of the probes' kinds, that the impacts would have shown."""
    assert steps.fitted is not None
    data, law = steps.fitted.data, steps.fitted.law
    smallest = negligible_share("restitution", steps.shape.finite)
    least = threshold(steps.null_distribution, IMPACT_GAIN)
    kinds = [(columns, 0.0) for _, columns, named in restitution_groups(data, steps.restitution_terms) if not named]
    kinds += [(bump[:, None], SPOTS_BY_CHANCE) for _, bump in spots(data)]
    weight = data.before / np.sqrt(data.normal_sd**2 + (law.scatter * data.before) ** 2)
    held, _ = np.linalg.qr(restitution_design(data, steps.restitution_terms) * weight[:, None])
    seen = []
    for columns, penalty in kinds:
        direction = rng.standard_normal((columns.shape[1], DRAWS))
        change = columns @ direction
        spread = np.std(change, axis=0)
        size = np.minimum(smallest * LARGEST ** rng.random(DRAWS), MOST_RESTITUTION)
        change = change * (size / np.where(spread > 0, spread, np.inf)) * weight[:, None]
        change -= held @ (held.T @ change)
        seen.append(1.0 - chndtr(least + penalty, columns.shape[1], np.sum(change**2, 0)))
    return float(np.mean(seen)) if seen else 0.0
