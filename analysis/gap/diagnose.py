"""From the ladder to the answer: verdict, equivalent set, parameters with intervals, how far the gap shrinks, what
would have been seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.law import LawData, fit_restitution
from analysis.gap.cause import Cause
from analysis.gap.ladder import Ladder, run_ladder
from analysis.gap.next_test.choice import NextTests, next_tests
from analysis.gap.prediction import predict
from analysis.gap.prediction.detectable import detectable_sizes
from analysis.gap.prediction.direct_shrinkage import own_shrinkage
from analysis.gap.prediction.held_out_errors import Errors4, held_out_errors
from analysis.gap.prediction.unexplained import unexplained_flights
from analysis.gap.selection.impact_candidates import restitution_design
from analysis.gap.series import Series
from analysis.gap.tests_by_hand import NEXT_TEST, NONE_TEST, unknown_test
from analysis.gap.thresholds import LEFT_OVER

Array = NDArray[np.float64]
NORMAL_90 = 1.645


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """``summary`` is diagnosis.json; ``predictions`` the table; ``ladder`` and ``errors`` what the figures show."""

    summary: dict[str, Any]
    predictions: pd.DataFrame
    ladder: Ladder
    errors: dict[str, predict.Errors | None]


def diagnose(series: Series, rng: np.random.Generator, withheld: frozenset[str] = frozenset()) -> Diagnosis:
    """Where the gap of a series lies, which effect causes it, how far it shrinks with it (see ``docs/gap.md``).

    ``withheld``: effects taken out of the library for a trial (GAP.md, check b)."""
    ladder = run_ladder(series, rng, withheld)
    verdict, causes = decide(ladder)
    errors, table = held_out_errors(ladder, causes if verdict == "effect" else ())
    left = unexplained_flights(ladder, errors)
    if left is not None and verdict != "unknown":
        ladder = replace(ladder, structure=(left, *ladder.structure))
        verdict, causes = "unknown", ()
        errors, table = held_out_errors(ladder, ())
    gap: dict[str, Any] = {name: (e.rms() if e is not None else None) for name, e in errors.items()}
    gap |= _shrinkage(ladder, causes if verdict == "effect" else (), errors, rng)
    tests = next_tests(ladder, causes) if verdict == "effect" else None
    stage = causes[0].stage if verdict == "effect" else (ladder.structure[0].stage if verdict == "unknown" else None)
    summary = {
        "format": 1,
        "verdict": verdict,
        "effects": [c.effect for c in causes] if verdict == "effect" else [],
        "equivalent": _equivalent(causes) if verdict == "effect" else [],
        "stage": stage,
        "probabilities": _probabilities(ladder, verdict, causes),
        "parameters": {
            c.effect: {n: _interval(v) for n, v in series.frame.world_parameters(c.effect, c.parameters).items()}
            for c in causes
        }
        if verdict == "effect"
        else {},
        "where": _where(ladder, causes, verdict),
        "gap": gap,
        "detectable": detectable_sizes(ladder),
        "next_test": _next_test(ladder, verdict, causes, tests),
        "next_tests": None if tests is None else tests.entry(),
        "goes_with": [
            {
                "stage": s.stage,
                "phase": s.phase,
                "coordinate": s.coordinate,
                "goes_with": s.goes_with,
                "times_negligible": s.strength,
            }
            for s in ladder.structure
        ]
        if verdict == "unknown"
        else [],
        "nominal": _nominal_shift(ladder),
        "time": time_shares(ladder),
    }
    return Diagnosis(summary, table, ladder, errors)


def _shrinkage(ladder: Ladder, causes: tuple[Cause, ...], errors: Errors4, rng: np.random.Generator) -> dict[str, Any]:
    """Shrinkage with interval, and of which error: held-out flights or impacts, or the residual that is the effect's
    own.
    """
    if not causes:
        return {"shrinkage": 0.0, "shrinkage_low": 0.0, "shrinkage_high": 0.0, "shrinkage_of": "flight_m"}
    first = causes[0]
    own, measure = own_shrinkage(ladder, first, rng), "the effect's own residual"
    more: dict[str, Any] = {}
    if own is not None:
        value = (own.value, own.low, own.high)
        if own.without_m is not None:
            measure, more = "contact_m", {"contact_m": {"without_effect": own.without_m, "with_effect": own.with_m}}
    else:
        kind = "impact" if first.stage == "impact" else "flight"
        measure = "impact_m_per_s" if kind == "impact" else "flight_m"
        recalibrated, final, floor = (_of(errors[k], kind) for k in ("recalibrated", "with_effect", "noise_floor"))
        value = predict.shrinkage(recalibrated, final, floor, rng)
    return {
        "shrinkage": value[0],
        "shrinkage_low": value[1],
        "shrinkage_high": value[2],
        "shrinkage_of": measure,
        **more,
    }


def _of(errors: predict.Errors | None, kind: str) -> Array:
    return np.zeros(1) if errors is None else errors.impact if kind == "impact" else errors.flight


def decide(ladder: Ladder) -> tuple[str, tuple[Cause, ...]]:
    """Verdict and the named causes, two at most, stronger first."""
    strongest = max((c.strength for c in ladder.causes), default=0.0)
    structure = max((s.strength for s in ladder.structure), default=0.0)
    if ladder.structure and structure > LEFT_OVER * strongest:
        return "unknown", ()
    if not ladder.causes:
        return "none", ()
    return "effect", ladder.causes[:2]


def _interval(value_sd: tuple[float, float]) -> dict[str, float]:
    value, sd = value_sd
    return {"value": value, "low": value - NORMAL_90 * sd, "high": value + NORMAL_90 * sd}


def _equivalent(causes: tuple[Cause, ...]) -> list[str]:
    """The named causes and whatever would have explained the same residual as well."""
    return list(dict.fromkeys([*(c.effect for c in causes), *(r for c in causes for r in c.rivals)]))


def _probabilities(ladder: Ladder, verdict: str, causes: tuple[Cause, ...]) -> dict[str, float]:
    """Softmax of capped evidence over named effects, none and unknown: a ranking, calibrated only as far as the blind
    trial says.
    """
    score = {"none": 6.0 if verdict == "none" else 0.0, "unknown": 6.0 if verdict == "unknown" else 0.5}
    for cause in ladder.causes:
        score[cause.effect] = 4.0 + np.log1p(cause.strength) if cause in causes else 1.5
    if verdict == "effect" and causes:
        score[causes[0].effect] += 1.5
    for name in (*(g.term.name for g in ladder.flights.gains), *(g.name for g in ladder.impacts.gains)):
        score.setdefault(name, -2.0)
    values = np.exp(np.array(list(score.values())) - max(score.values()))
    return {k: float(round(v, 4)) for k, v in zip(score, values / values.sum(), strict=True)}


def _where(ladder: Ladder, causes: tuple[Cause, ...], verdict: str) -> list[dict[str, Any]]:
    items = (
        [(c.stage, c.phase, c.coordinate, c.strength) for c in causes]
        if verdict == "effect"
        else [(s.stage, s.phase, s.coordinate, s.strength) for s in ladder.structure]
        if verdict == "unknown"
        else []
    )
    merged: dict[tuple[str, str, str], float] = {}
    for stage, phase, coordinate, strength in items:
        key = (stage, phase, coordinate)
        merged[key] = max(merged.get(key, 0.0), strength**2)
    total = sum(merged.values()) or 1.0
    return [
        {"stage": k[0], "phase": k[1], "coordinate": k[2], "excess": round(v / total, 4)}
        for k, v in sorted(merged.items(), key=lambda item: -item[1])
    ]


def _next_test(ladder: Ladder, verdict: str, causes: tuple[Cause, ...], tests: NextTests | None) -> str:
    if verdict == "effect":
        by_hand = NEXT_TEST[causes[0].effect]
        return by_hand if tests is None else f"{tests.words()} By hand: {by_hand}"
    if verdict == "unknown":
        return unknown_test(ladder.structure[0].stage, ladder.structure[0].goes_with)
    return NONE_TEST


def _nominal_shift(ladder: Ladder) -> dict[str, Any]:
    """Nominal parameters as given, recalibrated, and with the effect: recalibration can hide a gap by bending them."""
    model = ladder.series.recordings[0].model
    out: dict[str, Any] = {
        "floor_friction": {
            "as_given": model.floor_friction if model else None,
            "recalibrated": predict.friction_of(ladder.flights.nominal.model),
            "with_effect": predict.friction_of(ladder.flights.fitted.model),
        }
    }
    if ladder.impacts.fitted is not None:
        before, after = ladder.both_impacts()
        for name in ("restitution", "wall_friction", "tangential_restitution"):
            out[name] = {
                "as_given": getattr(model, name, None) if model else None,
                "recalibrated": getattr(before.law, name),
                "with_effect": getattr(after.law, name),
            }
        out["restitution_scatter"] = {
            "as_given": None,
            "recalibrated": before.law.scatter,
            "with_effect": _scatter(after.data, ladder.impacts.restitution_terms),
        }
    return out


def _scatter(data: LawData, restitution_terms: Sequence[str]) -> float:
    return float(fit_restitution(data, restitution_design(data, restitution_terms))[2])


def time_shares(ladder: Ladder) -> dict[str, float]:
    """Seconds of the series in free flight, sustained contact and left out (too short, unseen, or a flight that nothing
    fits).
    """
    flight = contact = total = 0.0
    for run in ladder.series.runs:
        t = run.data.time_s
        period = float(np.median(np.diff(t))) if len(t) > 1 else 0.0
        total += t[-1] - t[0] + period
        flight += sum(t[f.last] - t[f.first] + period for f in run.flights)
        contact += sum(t[b] - t[a] + period for a, b in run.segments.contact)
    return {
        "free_flight_s": float(flight),
        "sustained_contact_s": float(contact),
        "left_out_s": float(max(total - flight - contact, 0.0)),
    }
