"""Causes and structure of the flights, with sizes and standard deviations, from a fit that holds their terms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.flights.equation.parameters import INDEX
from analysis.gap.cause import Cause, Structure
from analysis.gap.selection.flight_candidates import Gain, Units
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.null_distribution import by_chance
from analysis.gap.series import Series
from ovines.core.effects import EFFECTS

Array = NDArray[np.float64]


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


def friction_cause(name: str, trial: FlightFit, gain: float, units: Units) -> Cause:
    """Floor friction, or its spin coupling, as ``trial`` has it."""
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


def term_cause(gain: Gain, trial: FlightFit, series: Series, units: Units) -> Cause:
    """A named effect of the flights as ``trial``, which holds its term, has it."""
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
        # Fitted about the middle of the runs, stated about their start and the first of them, as the simulator has it.
        share = 1 - 0.5 * (len(series.runs) - 1) * trial.model.drift_per_run
        drift, middle_s = float(p[INDEX["drift"]]), -float(np.mean([r.data.time_s[0] for r in series.runs]))
        parameters = {
            "relative_per_s": (drift / (1 - drift * middle_s), _sd(trial, "drift") / (1 - drift * middle_s) ** 2),
            "relative_per_run": (float(trial.model.drift_per_run / share), _sd(trial, "drift_run") / share**2),
        }
    else:
        own = EFFECTS[name].in_flights
        assert own is not None and own.parameter, f"{name}: how do its unknowns tell its parameters?"
        parameters = {own.parameter: (float(p[INDEX[own.names[0]]]), _sd(trial, own.names[0]))}
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


def structure_of(probe: Gain, null_distribution: Array, units: Units) -> Structure:
    """A term without a name that the flights ask for."""
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
