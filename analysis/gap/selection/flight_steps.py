"""The flights' step: nominal fit, missing friction, then the set of terms that held-out runs ask for, named or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.flights.equation.parameters import INDEX, LAW_TERMS
from analysis.flights.stated_terms import stated_terms
from analysis.gap.cause import Cause, Structure
from analysis.gap.selection.flight_candidates import Gain, Units, accepted, driving, gain_of, gains, rig_units
from analysis.gap.selection.flight_causes import friction_cause, structure_of, term_cause
from analysis.gap.selection.flights.fit import FlightFit, fit
from analysis.gap.selection.flights.model import nominal_model, with_free, without_columns
from analysis.gap.selection.flights.terms import EFFECT_TERMS, FlightTerm, terms
from analysis.gap.selection.left_in_flights import left_in_flights
from analysis.gap.selection.null_distribution import flight_null_distribution, threshold
from analysis.gap.selection.own_friction import holding_friction, own_friction, with_own_friction
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT, GAIN, OVERRIDES

Array = NDArray[np.float64]
# A probe is taken in place of a name where it explains this many times more.
PROBE_SHARE = 1.15
#: effects that are friction itself, not a term beside it
FRICTION = ("floor_friction", "spin_coupling")
# What friction goes with that each run has of its own.
OWN_FRICTION = "the run: friction of each by itself"
# Terms added at the most; each is a refit of all flights.
MOST_TERMS = 8
# Beside what a missing spin coupling is judged.
BESIDE_COUPLING = ("viscous", "tilt_x", "tilt_y")


@dataclass(frozen=True, eq=False)
class FlightSteps:
    """Recalibrated and final fit, what was accepted, gains of the named effects before any was added, probes
    after;
    ``null_distribution`` the best held-out gain in each of the series without effect that were drawn; ``left`` the
    gains of the named effects on the final fit, ``kept`` those of what it holds, ``units`` the rig's scale of
    accelerations;
    ``named`` the final fit without the probes, which the named effects alone give; ``left_p`` how often chance makes
    what is left look as it does."""

    nominal: FlightFit
    fitted: FlightFit
    causes: tuple[Cause, ...]
    gains: tuple[Gain, ...]
    probes: tuple[Gain, ...]
    structure: tuple[Structure, ...]
    null_distribution: Array
    left: tuple[Gain, ...]
    units: Units
    kept: tuple[Gain, ...]
    named: FlightFit
    left_p: float


def select_flight_effects(
    series: Series,
    effects: Sequence[str],
    withheld: frozenset[str],
    lens_residual_found: bool,
    rng: np.random.Generator,
) -> FlightSteps:
    """Nominal fit, then the set of terms, named or not, that these flights ask for: each addition is refitted, and what
    it makes needless is taken out again.

    Probes that explain more than any name stay in the model as structure, so that a cause which nobody listed neither
    hides a listed one nor is hidden by it."""
    runs = series.runs
    stated = stated_terms(series.recordings[0].model, series.frame, [run.data.start_s for run in runs])
    stated |= dict.fromkeys(LAW_TERMS[: len(runs[0].data.law)], 1.0)
    nominal = fit(runs, nominal_model(effects, stated))
    base, causes = _missing_friction(runs, nominal, effects, withheld)
    units = rig_units(base)
    named_terms, probe_terms = terms(withheld)
    # What is stated with a size may be of another one: it stays among the candidates.
    known = {c for e in EFFECT_TERMS if e.name in effects for c in e.columns if c not in stated}
    named_terms = tuple(t for t in named_terms if not known & set(t.columns))
    null_distribution = flight_null_distribution(base, (*named_terms, *probe_terms), rng)
    least = threshold(null_distribution, GAIN / 2)
    grown = _grown(runs, base, named_terms, probe_terms, least, units)
    own = _beside_own_friction(runs, grown, named_terms, probe_terms, least, units)
    base, chosen, rivals, first, every, probes = grown if own is None else own[0]
    last = {g.term.name: g for g in (*every, *probes)}
    # What was missing first was measured before the others were in.
    causes = [replace(c, parameters=friction_cause(c.effect, base, c.gain, units).parameters) for c in causes]
    causes += [
        replace(term_cause(last[t.name], base, series, units), rivals=rivals.get(t.name, ())) for t in chosen if t.named
    ]
    structure = [structure_of(last[t.name], null_distribution, units) for t in chosen if not t.named]
    strongest = max((c.strength for c in causes), default=0.0) * units.negligible_m_per_s2
    if own is not None:
        structure = [own[1], *structure]
    left, left_p = left_in_flights(runs, base, units, rng, strongest)
    if left is not None and not structure:
        structure = [left]
    by_name = refitted(runs, base, chosen, [t for t in chosen if t.named]) if structure and chosen else base
    return FlightSteps(
        nominal,
        base,
        tuple(causes),
        tuple(first),
        tuple(probes),
        tuple(structure),
        null_distribution,
        tuple(g for g in every if g.term not in chosen),
        units,
        tuple(last[t.name] for t in chosen),
        by_name,
        min([left_p, *(s.p for s in structure)]),
    )


class _Grown(NamedTuple):
    """A fit with all terms that it asks for: which they are, which others would have done in place of each, gains of
    the named terms before any was added (``first``) and on it, gains of the probes on it."""

    base: FlightFit
    chosen: list[FlightTerm]
    rivals: dict[str, tuple[str, ...]]
    first: list[Gain]
    every: list[Gain]
    probes: list[Gain]


def _grown(
    runs: Sequence[Run],
    base: FlightFit,
    named_terms: Sequence[FlightTerm],
    probe_terms: Sequence[FlightTerm],
    least: float,
    units: Units,
) -> _Grown:
    """``base`` and the terms that held-out runs ask for, one after the other."""

    def asked(fitted: FlightFit) -> tuple[list[Gain], list[Gain]]:
        """Gains of the named terms, and of the probes with what drives."""
        named = gains(fitted, named_terms, units)
        return named, [*gains(fitted, probe_terms, units), *driving(named)]

    every, probes = asked(base)
    first = every
    chosen: list[FlightTerm] = []
    rivals: dict[str, tuple[str, ...]] = {}
    seen = {frozenset[str]()}
    for _ in range(MOST_TERMS):
        best = _next_term(every, probes, chosen, least, units)
        added = [best.term] if best is not None else _together(runs, base, chosen, every, least, units)
        if not added:
            break
        trial = [*chosen, *added]
        fitted = refitted(runs, base, chosen, trial)
        while (needless := _needless(fitted, trial, added[-1], least, units)) is not None:
            kept = [t for t in trial if t is not needless]
            fitted, trial = refitted(runs, fitted, trial, kept), kept
        names = frozenset(t.name for t in trial)
        if names in seen:
            break
        seen.add(names)
        if best is not None and best.term.named:
            rivals[best.term.name] = _rivals(best, every)
        base, chosen = fitted, trial
        every, probes = asked(base)
    return _Grown(base, chosen, rivals, first, every, probes)


def _beside_own_friction(
    runs: Sequence[Run],
    grown: _Grown,
    named_terms: Sequence[FlightTerm],
    probe_terms: Sequence[FlightTerm],
    least: float,
    units: Units,
) -> tuple[_Grown, Structure] | None:
    """The terms that flights ask for whose friction is each run's own, and that friction as structure; None where no
    name is asked for beside it that is not without it, or where the runs' frictions do not surely differ."""
    base, chosen = grown.base, grown.chosen
    if own_friction(base) is None:
        return None
    free = [t for t in named_terms if t not in chosen and t.name != "friction_drift"]
    found = [g for g in gains(with_own_friction(base), free, units) if accepted(g, least, units)]
    if not found:
        return None
    added = max(found, key=lambda g: g.held_out).term
    own = own_friction(base, added.columns)
    if own is None or own.acceleration_m_per_s2 < units.negligible_m_per_s2:
        return None
    held = holding_friction(runs, own, base)
    start = refitted(held, base, chosen, [t for t in chosen if t.named])
    again = _grown(held, start, [t for t in named_terms if t.name != "friction_drift"], probe_terms, least, units)
    if added not in again.chosen:
        return None
    size = own.acceleration_m_per_s2
    structure = Structure(
        "flight", "free flight", "x", OWN_FRICTION, size / units.negligible_m_per_s2, own.gain, size, "m/s^2", own.p
    )
    return again._replace(first=grown.first), structure


def first_flights(series: Series, effects: Sequence[str]) -> FlightFit:
    """The flights of the nominal model as impacts need them: one step of its parameters, nothing else asked."""
    runs = series.runs
    stated = stated_terms(series.recordings[0].model, series.frame, [run.data.start_s for run in runs])
    return fit(runs, nominal_model(effects or ["floor_friction"], stated), rounds=1, every_column=False)


def _missing_friction(
    runs: Sequence[Run], nominal: FlightFit, effects: Sequence[str], withheld: frozenset[str]
) -> tuple[FlightFit, list[Cause]]:
    """Floor friction, or its spin coupling, where the nominal model lacks it and the flights need it."""
    base, causes = nominal, []
    for name, missing in (
        ("floor_friction", "floor_friction" not in effects and "spin_coupling" not in effects),
        ("spin_coupling", "floor_friction" in effects and "spin_coupling" not in effects),
    ):
        if not missing or name in withheld:
            continue
        # A drag or a tilt that is not found yet makes as much noise as a coupling tells: it is judged beside them.
        held = {*base.model.free, *base.model.stated}
        beside = tuple(one for one in BESIDE_COUPLING if name == "spin_coupling" and one not in held)
        # How far friction is coupled to the spin is an unknown of its own: 0 plain Coulomb, 1 a uniformly loaded disk.
        trial = fit(
            runs,
            with_free(
                nominal_model([*effects, "floor_friction", "spin_coupling"], base.model.stated),
                (*base.model.free, "coupling", *beside),
            ),
            rounds=4,
        )
        friction = trial.model.parameters[INDEX["friction"]]
        # Whitened alike and per number: a better model whitens less and keeps flights that the other had to leave out.
        before = fit(runs, with_free(base.model, beside), rounds=4 if beside else 0, noise=trial.noise)
        gain = (before.misfit / max(before.count, 1) - trial.misfit / max(trial.count, 1)) * min(
            before.count, trial.count
        )
        units = rig_units(trial)
        if gain > GAIN and friction * GRAVITY_M_PER_S2 > 3 * units.negligible_m_per_s2:
            causes.append(friction_cause(name, trial, gain, units))
            base = fit(runs, without_columns(trial.model, set(beside))) if beside else trial
    return base, causes


def _next_term(
    every: Sequence[Gain], probes: Sequence[Gain], chosen: Sequence[FlightTerm], least: float, units: Units
) -> Gain | None:
    """The accepted term that held-out runs ask for most; a probe only where it explains clearly more than any name."""
    open_ = [[g for g in group if g.term not in chosen and accepted(g, least, units)] for group in (every, probes)]
    name, probe = (max(group, key=lambda g: g.held_out, default=None) for group in open_)
    if name is None or (probe is not None and probe.held_out > PROBE_SHARE * name.held_out + OVERRIDES):
        return probe
    return name


def _together(
    runs: Sequence[Run],
    base: FlightFit,
    chosen: Sequence[FlightTerm],
    every: Sequence[Gain],
    least: float,
    units: Units,
) -> list[FlightTerm]:
    """Two named terms of which each is accepted beside the other only, none where there are none: friction that changes
    from run to run makes runs disagree on all that scales with it, and is hidden by that."""
    held_back = [g for g in every if g.term not in chosen and min(g.gain - GAIN, g.held_out - least) > 0]
    if not held_back:
        return []
    first = max(held_back, key=lambda g: g.held_out).term
    fitted = refitted(runs, base, chosen, [*chosen, first])
    others = gains(fitted, tuple(g.term for g in every if g.term not in (*chosen, first)), units)
    second = _next_term(others, (), chosen, least, units)
    if second is None:
        return []
    both = [first, second.term]
    fitted = refitted(runs, fitted, [*chosen, first], [*chosen, *both])
    return both if all(accepted(gain_of(fitted, term, units), least, units) for term in both) else []


def _needless(
    fitted: FlightFit, chosen: Sequence[FlightTerm], newest: FlightTerm, least: float, units: Units
) -> FlightTerm | None:
    """The chosen term that is no longer accepted beside the others, the weakest first; the newest stays."""
    lost = [g for g in (gain_of(fitted, t, units) for t in chosen if t is not newest) if not accepted(g, least, units)]
    return min(lost, key=lambda g: g.held_out).term if lost else None


def refitted(
    runs: Sequence[Run], base: FlightFit, before: Sequence[FlightTerm], after: Sequence[FlightTerm]
) -> FlightFit:
    """``base``, which holds the terms ``before``, refitted with those of ``after``."""
    held = [c for t in after for c in t.columns]
    model = without_columns(base.model, {c for t in before for c in t.columns} - set(held))
    return fit(runs, with_free(model, held))


def _rivals(best: Gain, candidates: Sequence[Gain]) -> tuple[str, ...]:
    """Named effects that would have explained the held-out runs as well, taken in place of the best."""
    return tuple(
        g.term.name for g in candidates if g.term.name != best.term.name and best.held_out - g.held_out < EQUIVALENT
    )
