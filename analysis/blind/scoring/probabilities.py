"""Do the probabilities of the answers mean what they say?  Brier and log score, and how often what was given a
probability is true."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np

from analysis.blind.scoring.intervals import Figure, mean, wilson
from analysis.blind.scoring.marks import EITHER, Row

EDGES = (0.0, 0.01, 0.05, 0.2, 0.5, 0.8, 0.95, 0.99, 1.0)
#: on a bench: in one series of five there is a cause that nobody listed, as the diagnosis has it before anything is
#: measured; a trial may hold many more
UNLISTED_SHARE = 0.2
LEAST = 1e-4  # a probability counts as at least this, and at most one less this, in the log score


def claims_of(row: Row) -> list[tuple[str, float, bool]]:
    """Each name, its probability, and whether it is true.  ``unknown`` is true where an unlisted cause is there.  What
    counts for the same as a true cause (``EITHER``), or is said to be equivalent to a named true one, is left out."""
    true = {cause for cause in row.truth.sizes if not cause.startswith("unknown_")}
    same = {name for cause in true for name in EITHER.get(cause, ())} - true
    if set(row.answer.named) & (true | same):
        same |= set(row.answer.equivalent) - true
    out = []
    for name, probability in row.answer.probabilities.items():
        if name in same:
            continue
        if name == "none":
            is_true = not row.truth.sizes
        elif name == "unknown":
            is_true = row.truth.unlisted
        else:
            is_true = name in true
        out.append((name, probability, is_true))
    return out


def probability_figures(rows: list[Row], rng: np.random.Generator) -> list[Figure]:
    """Brier and log score, each the mean over cases of the mean over what was given a probability."""
    said = [row for row in rows if claims_of(row)]
    claims = [claims_of(row) for row in said]
    if not claims:
        return []
    effects = [[c for c in one if c[0] not in ("none", "unknown")] for one in claims]
    verdicts = [[c for c in one if c[0] in ("none", "unknown")] for one in claims]
    asked = [(row.truth.unlisted, _brier(one)) for row, one in zip(said, verdicts, strict=True) if one]
    return [
        mean("Brier score, effects", [_brier(one) for one in effects if one], rng, 0.03, at_most=True),
        mean("Brier score, none and unknown", [_brier(one) for one in verdicts if one], rng, 0.03, at_most=True),
        _as_on_a_bench("Brier score, none and unknown, an unlisted cause in one of five", asked, rng),
        mean("log score, effects (0 is best)", [_log(one) for one in effects if one], rng),
        mean("log score, none and unknown (0 is best)", [_log(one) for one in verdicts if one], rng),
    ]


def _as_on_a_bench(name: str, scores: list[tuple[bool, float]], rng: np.random.Generator) -> Figure:
    """Mean of ``scores`` (whether an unlisted cause is there, score) as if one in :data:`UNLISTED_SHARE` had one; none
    where all have, or none has.  The interval is from cases of either kind drawn again."""
    kinds = [np.array([value for unlisted, value in scores if unlisted == kind]) for kind in (True, False)]
    if not all(len(one) for one in kinds):
        return Figure(name, None, None, None, 0)
    shares = (UNLISTED_SHARE, 1.0 - UNLISTED_SHARE)
    draws = sum(
        share * one[rng.integers(len(one), size=(2000, len(one)))].mean(1)
        for share, one in zip(shares, kinds, strict=True)
    )
    value = sum(share * float(one.mean()) for share, one in zip(shares, kinds, strict=True))
    low, high = (float(np.quantile(draws, one)) for one in (0.05, 0.95))
    return Figure(name, value, low, high, len(scores), "<= 0.03", value <= 0.03)


def _brier(claims: list[tuple[str, float, bool]]) -> float:
    return float(np.mean([(p - is_true) ** 2 for _, p, is_true in claims]))


def _log(claims: list[tuple[str, float, bool]]) -> float:
    p = np.clip([p if is_true else 1.0 - p for _, p, is_true in claims], LEAST, 1.0 - LEAST)
    return float(-np.mean(np.log(p)))


def reliability(rows: list[Row]) -> list[dict[str, Any]]:
    """For each band of probabilities (``EDGES``): how many claims fell into it, their mean probability, the share that
    was true with its 90 % interval (Wilson), whether the mean lies inside."""
    claims = [claim for row in rows for claim in claims_of(row)]
    p, true = np.array([c[1] for c in claims]), np.array([c[2] for c in claims], dtype=bool)
    out = []
    for low, high in pairwise(EDGES):
        inside = (p >= low) & ((p < high) if high < 1.0 else (p <= high))
        n = int(inside.sum())
        if not n:
            continue
        right, given = int(true[inside].sum()), float(p[inside].mean())
        band = wilson(right, n)
        out.append(
            {
                "from": low,
                "to": high,
                "claims": n,
                "mean_probability": given,
                "share_true": right / n,
                "low": band[0],
                "high": band[1],
                "holds": band[0] <= given <= band[1],
            }
        )
    return out
