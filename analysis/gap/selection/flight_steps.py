"""The flights' step: nominal fit, missing friction, then the set of terms that held-out runs ask for, named or not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.model import GRAVITY_M_PER_S2
from analysis.flights.parameters import INDEX, LAW_TERMS
from analysis.flights.runs import Run
from analysis.flights.stated_terms import DRIFT_OF_RUN, stated_terms
from analysis.gap.cause import Cause, Structure
from analysis.gap.selection.flight_candidates import (
    FlightFit,
    FlightModel,
    Gain,
    Units,
    fit,
    gain_of,
    gains,
    nominal_model,
    rig_units,
)
from analysis.gap.selection.flight_terms import EFFECT_TERMS, FlightTerm, terms
from analysis.gap.selection.left_in_flights import left_in_flights
from analysis.gap.selection.null_distribution import by_chance, flight_null_distribution, threshold
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT, GAIN, IMPROVED, OVERRIDES, SIGNIFICANCE

Array = NDArray[np.float64]
# A probe is taken in place of a name where it explains this many times more.
PROBE_SHARE = 1.15
# Terms added at the most; each is a refit of all flights.
MOST_TERMS = 8


def _accepted(gain: Gain, least: float, units: Units) -> bool:
    """``least``: held-out gain that chance does not reach."""
    return (
        gain.gain > GAIN
        and gain.held_out > least
        and gain.significance > SIGNIFICANCE
        and gain.improved >= IMPROVED
        and gain.acceleration_m_per_s2 > units.negligible_m_per_s2
    )


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
    first = every = gains(base, named_terms, units)
    probes = gains(base, probe_terms, units)
    chosen: list[FlightTerm] = []
    rivals: dict[str, tuple[str, ...]] = {}
    seen = {frozenset[str]()}
    for _ in range(MOST_TERMS):
        best = _next_term(every, probes, chosen, least, units)
        added = [best.term] if best is not None else _together(runs, base, chosen, every, least, units)
        if not added:
            break
        trial = [*chosen, *added]
        fitted = _fitted(runs, base, chosen, trial)
        while (needless := _needless(fitted, trial, added[-1], least, units)) is not None:
            kept = [t for t in trial if t is not needless]
            fitted, trial = _fitted(runs, fitted, trial, kept), kept
        names = frozenset(t.name for t in trial)
        if names in seen:
            break
        seen.add(names)
        if best is not None and best.term.named:
            rivals[best.term.name] = _rivals(best, every)
        base, chosen = fitted, trial
        every, probes = gains(base, named_terms, units), gains(base, probe_terms, units)
    last = {g.term.name: g for g in (*every, *probes)}
    # What was missing first was measured before the others were in.
    causes = [replace(c, parameters=_friction_cause(c.effect, base, c.gain, units).parameters) for c in causes]
    causes += [
        replace(_term_cause(last[t.name], base, series, units), rivals=rivals.get(t.name, ()))
        for t in chosen
        if t.named
    ]
    structure = [_structure(last[t.name], null_distribution, units) for t in chosen if not t.named]
    strongest = max((c.strength for c in causes), default=0.0) * units.negligible_m_per_s2
    left, left_p = left_in_flights(runs, base, units, rng, strongest)
    if left is not None and not structure:
        structure = [left]
    by_name = _fitted(runs, base, chosen, [t for t in chosen if t.named]) if structure and chosen else base
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


def first_flights(series: Series, effects: Sequence[str]) -> FlightFit:
    """The flights of the nominal model as impacts need them: one step of its parameters, nothing else asked."""
    runs = series.runs
    stated = stated_terms(series.recordings[0].model, series.frame, [run.data.start_s for run in runs])
    return fit(runs, nominal_model(effects or ["floor_friction"], stated), rounds=1, every_column=False)


def without_needless(runs: Sequence[Run], with_law: FlightFit, steps: FlightSteps) -> FlightSteps:
    """``steps`` without the named effects that are no longer accepted beside a law (``with_law``: a fit that holds it):
    they had imitated a part of it."""
    least = threshold(steps.null_distribution, GAIN / 2)
    chosen = [t for t in EFFECT_TERMS if t.name in {c.effect for c in steps.causes}]
    asked = [gain_of(with_law, t, steps.units) for t in chosen]
    lost = [g for g in asked if not _accepted(g, least, steps.units)]
    if not lost:
        return steps
    names = {g.term.name for g in lost}
    return replace(
        steps,
        causes=tuple(c for c in steps.causes if c.effect not in names),
        named=_fitted(runs, steps.named, chosen, [t for t in chosen if t.name not in names]),
        left=(*steps.left, *lost),
        kept=tuple(g for g in steps.kept if g.term.name not in names),
    )


def sized_beside(with_law: FlightFit, steps: FlightSteps, series: Series) -> FlightSteps:
    """``steps`` whose causes have the sizes that they have beside a law (``with_law``: a fit that holds it)."""
    causes = []
    for cause in steps.causes:
        term = next((t for t in EFFECT_TERMS if t.name == cause.effect), None)
        own = (
            _friction_cause(cause.effect, with_law, cause.gain, steps.units)
            if term is None
            else _term_cause(gain_of(with_law, term, steps.units), with_law, series, steps.units)
        )
        causes.append(replace(cause, parameters=own.parameters))
    return replace(steps, causes=tuple(causes))


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
            _with_free(
                nominal_model([*effects, "floor_friction", "spin_coupling"], base.model.stated),
                (*base.model.free, "coupling", *beside),
            ),
            rounds=4,
        )
        friction = trial.model.parameters[INDEX["friction"]]
        # Whitened alike and per number: a better model whitens less and keeps flights that the other had to leave out.
        before = fit(runs, _with_free(base.model, beside), rounds=4 if beside else 0, noise=trial.noise)
        gain = (before.misfit / max(before.count, 1) - trial.misfit / max(trial.count, 1)) * min(
            before.count, trial.count
        )
        units = rig_units(trial)
        if gain > GAIN and friction * GRAVITY_M_PER_S2 > 3 * units.negligible_m_per_s2:
            causes.append(_friction_cause(name, trial, gain, units))
            base = fit(runs, _without(trial.model, set(beside))) if beside else trial
    return base, causes


def _without(model: FlightModel, columns: set[str]) -> FlightModel:
    """``model`` without these columns: they are what `[model]` states, or nil."""
    parameters = model.parameters.copy()
    for column in columns & set(INDEX):
        parameters[INDEX[column]] = model.stated.get(column, 0.0)
    return replace(
        model,
        parameters=parameters,
        drift_per_run=model.stated.get(DRIFT_OF_RUN, 0.0) if DRIFT_OF_RUN in columns else model.drift_per_run,
        free=tuple(n for n in model.free if n not in columns),
    )


def _next_term(
    every: Sequence[Gain], probes: Sequence[Gain], chosen: Sequence[FlightTerm], least: float, units: Units
) -> Gain | None:
    """The accepted term that held-out runs ask for most; a probe only where it explains clearly more than any name."""
    open_ = [[g for g in group if g.term not in chosen and _accepted(g, least, units)] for group in (every, probes)]
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
    fitted = _fitted(runs, base, chosen, [*chosen, first])
    others = gains(fitted, tuple(g.term for g in every if g.term not in (*chosen, first)), units)
    second = _next_term(others, (), chosen, least, units)
    if second is None:
        return []
    both = [first, second.term]
    fitted = _fitted(runs, fitted, [*chosen, first], [*chosen, *both])
    return both if all(_accepted(gain_of(fitted, term, units), least, units) for term in both) else []


def _needless(
    fitted: FlightFit, chosen: Sequence[FlightTerm], newest: FlightTerm, least: float, units: Units
) -> FlightTerm | None:
    """The chosen term that is no longer accepted beside the others, the weakest first; the newest stays."""
    lost = [g for g in (gain_of(fitted, t, units) for t in chosen if t is not newest) if not _accepted(g, least, units)]
    return min(lost, key=lambda g: g.held_out).term if lost else None


def _fitted(
    runs: Sequence[Run], base: FlightFit, before: Sequence[FlightTerm], after: Sequence[FlightTerm]
) -> FlightFit:
    """``base``, which holds the terms ``before``, refitted with those of ``after``."""
    held = [c for t in after for c in t.columns]
    model = _without(base.model, {c for t in before for c in t.columns} - set(held))
    return fit(runs, _with_free(model, held))


def _rivals(best: Gain, candidates: Sequence[Gain]) -> tuple[str, ...]:
    """Named effects that would have explained the held-out runs as well, taken in place of the best."""
    return tuple(
        g.term.name for g in candidates if g.term.name != best.term.name and best.held_out - g.held_out < EQUIVALENT
    )


def _with_free(model: FlightModel, names: Sequence[str]) -> FlightModel:
    return replace(model, free=tuple(dict.fromkeys((*model.free, *names))))


def _sd(fit_: FlightFit, name: str) -> float:
    """Standard deviation of a shared parameter: the larger of the fit's own and the jackknife over runs (lens and model
    errors scatter there).
    """
    at = list(fit_.columns).index(name)
    own = float(np.sqrt(fit_.covariance[at, at] * max(1.0, fit_.misfit / max(fit_.count, 1))))
    runs = len(fit_.evidence)
    if runs < 4:
        return own
    left_out = fit_.forms.solved(fit_.columns).left_out[:, at]
    return max(own, float(np.sqrt((runs - 1) / runs * np.sum((left_out - left_out.mean()) ** 2))))


def _friction_cause(name: str, trial: FlightFit, gain: float, units: Units) -> Cause:
    friction = float(trial.model.parameters[INDEX["friction"]])
    parameters = (
        {"coefficient": (friction, _sd(trial, "friction"))}
        if name == "floor_friction"
        else {"coupling": (float(trial.model.parameters[INDEX["coupling"]]), _sd(trial, "coupling"))}
    )
    size = (
        friction
        * GRAVITY_M_PER_S2
        * (1.0 if name == "floor_friction" else 0.3 * abs(float(trial.model.parameters[INDEX["coupling"]])))
    )
    return Cause(name, "flight", parameters, size / units.negligible_m_per_s2, gain, "x", "free flight")


def _term_cause(gain: Gain, trial: FlightFit, series: Series, units: Units) -> Cause:
    p, name = trial.model.parameters, gain.term.name
    if name == "table_tilt":
        ax, ay = p[INDEX["tilt_x"]], p[INDEX["tilt_y"]]
        size = float(np.hypot(ax, ay))
        sd = float(np.hypot(ax * _sd(trial, "tilt_x"), ay * _sd(trial, "tilt_y")) / max(size, 1e-9))
        parameters = {
            "tilt_rad": (size / GRAVITY_M_PER_S2, sd / GRAVITY_M_PER_S2),
            "direction_rad": (
                float(np.arctan2(ay, ax)),
                float(np.hypot(_sd(trial, "tilt_x"), _sd(trial, "tilt_y")) / max(size, 1e-9)),
            ),
        }
    elif name == "vertical_motion":
        amplitude = np.array([_vertical_amplitude_m(r.data) for r in series.runs])
        load = p[INDEX["load"]]
        sd = np.hypot(
            _sd(trial, "load") * amplitude.mean() / max(abs(load), 0.1),
            np.std(amplitude) / np.sqrt(max(len(amplitude), 1)) + 1e-6,
        )
        parameters = {"amplitude_m": (float(amplitude.mean()), float(sd))}
    elif name == "friction_drift":
        # Fitted about the middle of the runs, told about their start and the first of them, as the simulator has it.
        share = 1 - 0.5 * (len(series.runs) - 1) * trial.model.drift_per_run
        drift, middle_s = float(p[INDEX["drift"]]), -float(np.mean([r.data.time_s[0] for r in series.runs]))
        parameters = {
            "relative_per_s": (drift / (1 - drift * middle_s), _sd(trial, "drift") / (1 - drift * middle_s) ** 2),
            "relative_per_run": (float(trial.model.drift_per_run / share), _sd(trial, "drift_run") / share**2),
        }
    else:
        column, parameter = {"viscous_drag": ("viscous", "rate_per_s"), "air_drag": ("air", "rate_per_m")}[name]
        parameters = {parameter: (float(p[INDEX[column]]), _sd(trial, column))}
    return Cause(
        name,
        "flight",
        parameters,
        gain.acceleration_m_per_s2 / units.negligible_m_per_s2,
        gain.gain,
        _main_coordinate(gain),
        "free flight",
    )


def _vertical_amplitude_m(run: RunData) -> float:
    """Of the Host's vertical motion: of its line at the drive's frequency, or what a line as strong as its path has."""
    host = run.host
    if not host.harmonic:
        return float(np.sqrt(2) * np.std(host.at(run.time_s)[:, 2]))
    return float(np.hypot(*host.harmonics[2, 1:3])) if host.harmonics.shape[1] > 2 else 0.0


def _main_coordinate(gain: Gain) -> str:
    if gain.term.name == "table_tilt":
        return "x" if abs(gain.estimate[0]) >= abs(gain.estimate[1]) else "y"
    return "x"


def _structure(probe: Gain, null_distribution: Array, units: Units) -> Structure:
    coordinate = "angle" if probe.term.columns[0] in ("spin_decay", "spin_drive") else "x"
    size = probe.acceleration_m_per_s2
    return Structure(
        "flight",
        "free flight",
        coordinate,
        probe.term.name,
        size / units.negligible_m_per_s2,
        probe.gain,
        size,
        "m/s^2",
        by_chance(null_distribution, probe.held_out),
    )
