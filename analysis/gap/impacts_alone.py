"""The diagnosis of impacts by themselves: their stage of the ladder, the same answer, everything else left open.

Law refitted, restitution's effects by forward selection, probes for what is left, each judged as beside a motion
(:mod:`analysis.gap.selection.impact_steps`); predictions one impact ahead, the law learnt on the other runs, or on the
other impacts where there is one run.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.effect_rows import reported_effects
from analysis.contact.given_impacts import given_law_data
from analysis.contact.law import Law, LawData, fit_law, fit_restitution, predicted_tangential
from analysis.contact.restitution import RESTITUTION_EFFECTS, restitution_design
from analysis.gap.cause import NONE_TESTED, Cause, Structure
from analysis.gap.estimates import value_of
from analysis.gap.prediction.detectable import of_impacts
from analysis.gap.prediction.probabilities import ABSENT, probability_of, probability_of_left
from analysis.gap.selection.impact_laws import select_laws
from analysis.gap.selection.impact_steps import USUAL_SCATTER, WIDE_SCATTER
from analysis.gap.selection.null_distribution import by_chance, chance_of_misfit, impact_null_distribution
from analysis.gap.tests_by_hand import NONE_TEST, test_by_hand, unknown_test
from analysis.identification.given_impacts import identify_impacts
from analysis.statistics.student import NORMAL_90
from ovines.errors import InputError
from ovines.recording import Recording
from ovines.recording_schema import Nominal

Array = NDArray[np.float64]
FEWEST = 8
FOLDS = 5  # of a single run's impacts, of which each is predicted by the others
DRAWS, BAND = 400, (0.05, 0.95)
NOTHING = {"flight_m": None, "impact_m_per_s": None, "spin_rad_per_s": None}


@dataclass(frozen=True, eq=False)
class _Fit:
    data: LawData
    law: Law


def diagnose_impacts(
    tables: Sequence[pd.DataFrame],
    recordings: Sequence[Recording],
    rng: np.random.Generator,
    withheld: frozenset[str] = frozenset(),
) -> dict[str, Any]:
    """diagnosis.json of recordings that bring tables ``given_impacts`` alone; `InputError` for fewer than eight."""
    data, tangential = _usable(tables, recordings)
    model = recordings[0].model
    effects = model.effects if model else ()
    held = [name for name in effects if name in RESTITUTION_EFFECTS]
    fit = _Fit(data, _law_of(data, tangential))
    null = impact_null_distribution(data, held, rng)
    finite = "finite_contact_time" in effects or not tangential  # then nothing tangential is probed
    causes, terms, _, left, probes, structure = select_laws(fit, held, finite, withheld, null)
    table = _identified(tables, recordings, [cause.effect for cause in causes])
    plain = _identified(tables, recordings, []) if causes else table
    sizes = reported_effects(table, [cause.effect for cause in causes])
    causes = [replace(cause, parameters=sizes.get(cause.effect, cause.parameters)) for cause in causes]
    structure += _scatter(data, terms, structure)
    gained = [gain.gain for gain in probes if gain.residual == "restitution"]
    left_p = min([1.0, by_chance(null, max(gained)) if gained else 1.0, *(one.p for one in structure)])
    detectable = of_impacts(fit, {gain.name: gain for gain in left}, finite)
    return {
        **_found(causes, structure),
        "probabilities": _probabilities(causes, detectable, left_p),
        "parameters": _sizes(causes),
        "where": _where([*causes, *structure]),
        "gap": _gap(fit, held, terms, recordings[0], rng) | {"left_p": left_p},
        "detectable": detectable,
        "next_test": _next_test(causes, structure),
        "next_tests": None,
        "nominal": _nominal(model, plain, table),
        "time": {"free_flight_s": 0.0, "sustained_contact_s": 0.0, "left_out_s": 0.0},
    }


def _usable(tables: Sequence[pd.DataFrame], recordings: Sequence[Recording]) -> tuple[LawData, bool]:
    """The impacts that a law can be learnt from, and whether they tell anything tangential."""
    nes = recordings[0].settings.bodies.nes
    if nes is None:
        raise InputError(
            f"{recordings[0].folder}/recording.toml: no [bodies.nes]", "its radius_m and inertia_factor", "add them"
        )
    data = given_law_data(tables, nes)
    # No clock began with the run: times count from its first impact.
    first = np.array([np.min(data.at.time_s[data.at.run == run], initial=np.inf) for run in range(len(tables))])
    data = data.from_starts(first)
    known = np.isfinite(data.tangential_impulse)
    if known.any():  # a law is diagnosed as a whole
        data = data.part(known)
    if len(data) < FEWEST:
        raise InputError(
            f"{len(data)} usable impacts in {len(tables)} recordings",
            f"{FEWEST} and more",
            "record longer, or more runs",
        )
    return data, bool(known.any())


def _found(causes: Sequence[Cause], structure: Sequence[Structure]) -> dict[str, Any]:
    """The head of diagnosis.json: the verdict, and what it rests on."""
    return {
        "format": 2,
        "verdict": "unknown" if structure else "effect" if causes else "none",
        "effects": [cause.effect for cause in sorted(causes, key=lambda one: -one.weight)],
        "equivalent": list(dict.fromkeys(name for cause in causes for name in (cause.effect, *cause.rivals))),
        "stage": "impact" if causes or structure else None,
        "left": [one.entry() for one in sorted(structure, key=lambda one: -one.weight)],
        "laws": [],
    }


def _sizes(causes: Sequence[Cause]) -> dict[str, Any]:
    """Parameters of each effect with their 90 % intervals."""
    return {
        cause.effect: {
            name: {"value": value, "low": value - NORMAL_90 * sd, "high": value + NORMAL_90 * sd}
            for name, (value, sd) in cause.parameters.items()
        }
        for cause in causes
    }


def _where(found: Sequence[Cause | Structure]) -> list[dict[str, Any]]:
    """The coordinate of an impact in which the strongest shows."""
    if not found:
        return []
    coordinate = max(found, key=lambda one: one.weight).coordinate
    return [{"stage": "impact", "phase": "impact", "coordinate": coordinate, "excess": 1.0}]


def _nominal(model: Nominal | None, plain: pd.DataFrame, table: pd.DataFrame) -> dict[str, Any]:
    """The contact law as it was given, and as it was found without the effects and with them."""
    return {
        name: {
            "as_given": getattr(model, name, None) if model else None,
            "recalibrated": _value(plain, name),
            "with_effect": _value(table, name),
        }
        for name in ("restitution", "wall_friction", "tangential_restitution")
    }


def _identified(tables: Sequence[pd.DataFrame], recordings: Sequence[Recording], found: Sequence[str]) -> pd.DataFrame:
    """Table ``identification`` of the impacts with what was ``found``: how large it is, is its to say."""
    first = recordings[0]
    known = first.model or Nominal(effects=())
    better = known.model_copy(update={"effects": (*known.effects, *(n for n in found if n not in known.effects))})
    named = replace(first, settings=first.settings.model_copy(update={"model": better}))
    return identify_impacts(tables, [named, *recordings[1:]]).identification


def _value(table: pd.DataFrame, name: str) -> float:
    """Of a parameter in table ``identification``; NaN where the impacts give none."""
    value = value_of(table, name)[0]
    return np.nan if value is None else value


def _law_of(data: LawData, tangential: bool) -> Law:
    if tangential:
        return fit_law(data)
    (restitution,), _, scatter, misfit = fit_restitution(data)
    return Law(float(restitution), scatter, np.nan, np.nan, misfit, np.nan, np.nan)


def _scatter(data: LawData, terms: Sequence[str], found: Sequence[Structure]) -> list[Structure]:
    """Scatter beyond what is usual that goes with nothing."""
    scatter = float(fit_restitution(data, restitution_design(data, terms))[2])
    if found or scatter <= WIDE_SCATTER:
        return []
    chance = chance_of_misfit(len(data) * (scatter / USUAL_SCATTER) ** 2, len(data))
    what = f"{NONE_TESTED} (scatter from impact to impact)"
    return [Structure("impact", "impact", "normal", what, scatter / USUAL_SCATTER, 0.0, scatter, "1", chance)]


def _probabilities(causes: Sequence[Cause], detectable: dict[str, Any], left_p: float) -> dict[str, float]:
    out = {
        name: probability_of(one["measured"], one["measured_sd"], one["size"])
        if one["measured"] is not None
        else 1 - ABSENT
        for name, one in detectable.items()
    }
    out |= {c.effect: probability_of(c.strength, c.strength / np.sqrt(max(c.gain, 1.0)), 1.0) for c in causes}
    left = probability_of_left(left_p, 1.0)
    out |= {"unknown": left, "none": float(np.prod([1 - p for p in out.values()]) * (1 - left))}
    return {name: float(round(p, 4)) for name, p in out.items()}


def _next_test(causes: Sequence[Cause], structure: Sequence[Structure]) -> str:
    said = [test_by_hand(max(causes, key=lambda one: one.weight).effect)] if causes else []
    said += [unknown_test("impact", max(structure, key=lambda one: one.weight).goes_with)] if structure else []
    return " ".join(said) or NONE_TEST


def _gap(
    fit: _Fit, held: Sequence[str], terms: Sequence[str], recording: Recording, rng: np.random.Generator
) -> dict[str, Any]:
    """Errors of the contact point's speed after impacts that were held out, and how far the effects close the gap."""
    data, model = fit.data, recording.model
    folds = data.at.run if len(np.unique(data.at.run)) > 1 else np.arange(len(data)) % FOLDS
    effect, plain = _errors(fit, terms, folds), _errors(fit, held, folds)
    scatter = float(fit_restitution(data, restitution_design(data, terms))[2])
    floor = np.sqrt(data.normal_sd**2 + (scatter * data.before) ** 2)
    given = None
    if model is not None and model.restitution is not None and not held:
        given = NOTHING | {"impact_m_per_s": float(_rms(data.after - model.restitution * data.before))}
    # Of the normal speed alone: no effect of the library changes the tangential law.
    closed, whole = plain[0] ** 2 - effect[0] ** 2, plain[0] ** 2 - floor**2
    share = _share(closed, whole) if len(terms) > len(held) else 0.0
    drawn = [_share(closed[at], whole[at]) for at in rng.integers(0, len(data), (DRAWS, len(data)))] if share else [0.0]
    low, high = (float(x) for x in np.quantile(drawn, BAND))
    named = [name for name in terms if name not in held]
    out: dict[str, Any] = {
        name: NOTHING | {"impact_m_per_s": float(_rms(np.hypot(*errors)))}
        for name, errors in (("recalibrated", plain), ("with_effect", effect))
    }
    sd = np.hypot(floor, np.where(np.isfinite(fit.law.tangential_scatter), data.tangential_sd, 0.0))
    out |= {"as_given": given, "noise_floor": NOTHING | {"impact_m_per_s": float(_rms(sd))}}
    by_effect = {}
    for name in named:
        rest = _errors(fit, [one for one in terms if one != name], folds)[0] ** 2 - effect[0] ** 2
        by_effect[name] = {"shrinkage": _share(rest, whole), "low": low, "high": high}
    return out | {"shrinkage": share, "shrinkage_low": low, "shrinkage_high": high, "by_effect": by_effect}


def _errors(fit: _Fit, terms: Sequence[str], folds: NDArray[np.int64]) -> Array:
    """Errors (2, K) of normal speed and tangential impulse after each impact, m/s, the restitution learnt elsewhere."""
    data, design = fit.data, restitution_design(fit.data, terms)
    error = np.zeros((2, len(data)))
    for fold in np.unique(folds):
        here = folds == fold
        c = fit_restitution(data.part(~here), design[~here])[0]
        error[0, here] = data.after[here] - design[here] @ c * data.before[here]
    if np.isfinite(fit.law.wall_friction):
        error[1] = data.tangential_impulse - predicted_tangential(
            data, fit.law.wall_friction, fit.law.tangential_restitution
        )
    return error


def _share(closed: Array, whole: Array) -> float:
    total = float(np.sum(whole))
    return float(np.sum(closed)) / total if total > 0 else 0.0


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
