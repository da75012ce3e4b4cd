"""The flights' step: nominal fit, missing friction, then terms by forward selection on held-out runs; probes for what
is left.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.model import GRAVITY_M_PER_S2
from analysis.flights.parameters import INDEX
from analysis.gap.cause import Cause, Structure
from analysis.gap.selection.flight_candidates import (
    FlightFit,
    FlightModel,
    Gain,
    fit,
    gains,
    nominal_model,
    solve_named,
)
from analysis.gap.selection.flight_terms import NEGLIGIBLE_M_PER_S2, terms
from analysis.gap.selection.null_distribution import flight_null_distribution, threshold
from analysis.gap.series import Series
from analysis.gap.thresholds import EQUIVALENT, GAIN, IMPROVED, LEFT_OVER, OVERRIDES, SIGNIFICANCE

Array = NDArray[np.float64]
# A lens residual of 0.05 mm over sharp markers (5 um) leaves a misfit of 2.4 (practice-05).
USUAL_MISFIT = 4.0
# A probe may gain this many times what chance does and differ between runs, because it only resembles the cause (a
# patch of the floor).
OVERWHELMING, SIGNIFICANCE_OF_SHAPE = 10.0, 3.0


def _accepted(gain: Gain, least: float) -> bool:
    """``least``: held-out gain that chance does not reach."""
    return (
        gain.gain > GAIN
        and gain.held_out > least
        and gain.significance > SIGNIFICANCE
        and gain.improved >= IMPROVED
        and gain.acceleration_m_per_s2 > NEGLIGIBLE_M_PER_S2
    )


@dataclass(frozen=True, eq=False)
class FlightSteps:
    """Recalibrated and final fit, what was accepted, gains of the named effects before any was added, probes
    after;
    ``null_distribution`` the best held-out gain in each of the series without effect that were drawn; ``left`` the
    gains of the named effects on the final fit."""

    nominal: FlightFit
    fitted: FlightFit
    causes: tuple[Cause, ...]
    gains: tuple[Gain, ...]
    probes: tuple[Gain, ...]
    structure: tuple[Structure, ...]
    null_distribution: Array
    left: tuple[Gain, ...]


def select_flight_effects(
    series: Series,
    effects: Sequence[str],
    withheld: frozenset[str],
    lens_residual_found: bool,
    rng: np.random.Generator,
) -> FlightSteps:
    """Nominal fit, then friction and its coupling if they are missing, then the terms by forward selection (two at
    most).
    """
    runs = series.runs
    base = nominal = fit(runs, nominal_model(effects))
    causes: list[Cause] = []
    for name, missing in (
        ("floor_friction", "floor_friction" not in effects and "spin_coupling" not in effects),
        ("spin_coupling", "floor_friction" in effects and "spin_coupling" not in effects),
    ):
        if not missing or name in withheld:
            continue
        # How far friction is coupled to the spin is an unknown of its own: 0 plain Coulomb, 1 a uniformly loaded disk.
        trial = fit(
            runs,
            _with_free(nominal_model([*effects, "floor_friction", "spin_coupling"]), (*base.model.free, "coupling")),
            rounds=4,
        )
        friction = trial.model.parameters[INDEX["friction"]]
        # Whitened alike and per number: a better model whitens less and keeps flights that the other had to leave out.
        before = fit(runs, base.model, rounds=0, correlation=trial.correlation)
        gain = (before.misfit / max(before.count, 1) - trial.misfit / max(trial.count, 1)) * min(
            before.count, trial.count
        )
        if gain > GAIN and friction * GRAVITY_M_PER_S2 > 3 * NEGLIGIBLE_M_PER_S2:
            causes.append(_friction_cause(name, trial, gain))
            base = trial
    named_terms, probe_terms = terms(withheld)
    null_distribution = flight_null_distribution(base, (*named_terms, *probe_terms), rng)
    least = threshold(null_distribution, GAIN / 2)
    every = gains(base, named_terms)
    first = every
    probes = gains(base, probe_terms)
    for _ in range(2):
        candidates = [g for g in (_measure_load(g, base, series) for g in every) if _accepted(g, least)]
        if not candidates or (causes and len(causes) >= 2):
            break
        best = max(candidates, key=lambda g: g.held_out)
        rivals = [p for p in (_measure_load(p, base, series) for p in probes) if _accepted(p, least)]
        if rivals and max(p.held_out for p in rivals) > 1.15 * best.held_out + OVERRIDES:
            break
        trial = fit(runs, _with_free(base.model, best.term.columns))
        causes.append(replace(_term_cause(best, trial, series), rivals=_rivals(best, every)))
        base = trial
        every, probes = gains(base, named_terms), gains(base, probe_terms)
    probes = [_measure_load(p, base, series) for p in probes]
    structure = _flight_structure(probes, causes, least)
    if not structure and not causes and not lens_residual_found:
        structure = _overwhelming(probes, least)
    return FlightSteps(
        nominal, base, tuple(causes), tuple(first), tuple(probes), tuple(structure), null_distribution, tuple(every)
    )


def _rivals(best: Gain, candidates: Sequence[Gain]) -> tuple[str, ...]:
    """Named effects that would have explained the held-out runs as well, taken in place of the best."""
    return tuple(
        g.term.name for g in candidates if g.term.name != best.term.name and best.held_out - g.held_out < EQUIVALENT
    )


def _with_free(model: FlightModel, names: Sequence[str]) -> FlightModel:
    return replace(model, free=tuple(dict.fromkeys((*model.free, *names))))


def _measure_load(gain: Gain, base: FlightFit, series: Series) -> Gain:
    """The load's term counts by the acceleration that the Host's measured z'' makes it give."""
    if gain.term.columns != ("load",) or not len(gain.estimate):
        return gain
    friction = base.model.parameters[INDEX["friction"]]
    rms = np.sqrt(np.mean([np.mean(r.data.host.at(r.data.time_s, 2)[:, 2] ** 2) for r in series.runs]))
    return replace(gain, acceleration_m_per_s2=float(abs(gain.estimate[0]) * friction * rms))


def _sd(fit_: FlightFit, name: str) -> float:
    """Standard deviation of a shared parameter: the larger of the fit's own and the jackknife over runs (lens and model
    errors scatter there).
    """
    at = list(fit_.columns).index(name)
    own = float(np.sqrt(fit_.covariance[at, at] * max(1.0, fit_.misfit / max(fit_.count, 1))))
    runs = len(fit_.evidence)
    if runs < 4:
        return own
    left_out = np.array(
        [solve_named([e for j, e in enumerate(fit_.evidence) if j != i], fit_.columns)[0][at] for i in range(runs)]
    )
    return max(own, float(np.sqrt((runs - 1) / runs * np.sum((left_out - left_out.mean()) ** 2))))


def _friction_cause(name: str, trial: FlightFit, gain: float) -> Cause:
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
    return Cause(name, "flight", parameters, size / NEGLIGIBLE_M_PER_S2, gain, "x", "free flight")


def _term_cause(gain: Gain, trial: FlightFit, series: Series) -> Cause:
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
        amplitude = np.array(
            [
                np.hypot(r.data.host.harmonics[2, 1], r.data.host.harmonics[2, 2])
                if r.data.host.harmonics.shape[1] > 2
                else 0.0
                for r in series.runs
            ]
        )
        load = p[INDEX["load"]]
        sd = np.hypot(
            _sd(trial, "load") * amplitude.mean() / max(abs(load), 0.1),
            np.std(amplitude) / np.sqrt(max(len(amplitude), 1)) + 1e-6,
        )
        parameters = {"amplitude_m": (float(amplitude.mean()), float(sd))}
    elif name == "friction_drift":
        # Fitted about the middle run, told about the first, as the simulator has it.
        share = 1 - 0.5 * (len(series.runs) - 1) * trial.model.drift_per_run
        parameters = {
            "relative_per_s": (float(p[INDEX["drift"]]), _sd(trial, "drift")),
            "relative_per_run": (float(trial.model.drift_per_run / share), _sd(trial, "drift_run") / share**2),
        }
    else:
        column, parameter = {"viscous_drag": ("viscous", "rate_per_s"), "air_drag": ("air", "rate_per_m")}[name]
        parameters = {parameter: (float(p[INDEX[column]]), _sd(trial, column))}
    return Cause(
        name,
        "flight",
        parameters,
        gain.acceleration_m_per_s2 / NEGLIGIBLE_M_PER_S2,
        gain.gain,
        _main_coordinate(gain),
        "free flight",
    )


def _main_coordinate(gain: Gain) -> str:
    if gain.term.name == "table_tilt":
        return "x" if abs(gain.estimate[0]) >= abs(gain.estimate[1]) else "y"
    return "x"


def _flight_structure(probes: Sequence[Gain], causes: Sequence[Cause], least: float) -> list[Structure]:
    strongest = max((c.strength for c in causes), default=0.0)
    out = []
    for probe in probes:
        strength = probe.acceleration_m_per_s2 / NEGLIGIBLE_M_PER_S2
        if _accepted(probe, least) and strength > LEFT_OVER * strongest:
            coordinate = "angle" if probe.term.columns[0] in ("spin_decay", "spin_drive") else "x"
            out.append(Structure("flight", "free flight", coordinate, probe.term.name, strength, probe.gain))
    return out


def _overwhelming(probes: Sequence[Gain], least: float) -> list[Structure]:
    """The best probe where chance and lens cannot have made it, though it holds unevenly: what it stands for is another
    shape of structure.
    """
    best = max(probes, key=lambda g: g.held_out, default=None)
    if (
        best is None
        or best.held_out < OVERWHELMING * least
        or best.significance < SIGNIFICANCE_OF_SHAPE
        or best.improved < IMPROVED
        or best.acceleration_m_per_s2 < NEGLIGIBLE_M_PER_S2
    ):
        return []
    return [
        Structure(
            "flight",
            "free flight",
            "x",
            f"something like {best.term.name}",
            best.acceleration_m_per_s2 / NEGLIGIBLE_M_PER_S2,
            best.gain,
        )
    ]


def unexplained_misfit(flight: FlightFit, found: Sequence[Structure]) -> list[Structure]:
    """Misfit of the flights beyond the noise, where no probe explains it."""
    excess = flight.misfit / max(flight.count, 1)
    if excess < USUAL_MISFIT or any(s.stage in ("flight", "measurement") for s in found):
        return []
    return [
        Structure(
            "flight",
            "free flight",
            "x",
            "none of the probes tested (misfit of the flights)",
            excess / USUAL_MISFIT,
            0.0,
        )
    ]
