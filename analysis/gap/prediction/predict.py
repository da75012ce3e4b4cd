"""How far: what the models predict on runs that were held out of every fit behind them, one flight and one impact
ahead.

Flight ahead: the flight's own start values are fitted, everything shared (friction, effects, markers' origin) comes
from the other runs.  Impact ahead: the state before an impact, carried through wall and law that the other runs
determine.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.contact.effect_rows import CONTACT_TIME
from analysis.contact.law import LawData, fit_restitution, predicted_tangential, stick_impulse
from analysis.contact.restitution import conditions, held_restitution, restitution_design, rig_sizes
from analysis.contact.tangential.lasting import LastingContact, stiffness_of
from analysis.flights.cutting.runs import Run
from analysis.flights.fit import FlightFits, fit_flights
from analysis.flights.noise import correlated
from analysis.flights.stated_terms import share_at_start, stated_sizes
from analysis.gap.selection.flights.fit import FlightFit
from analysis.gap.selection.flights.model import FlightModel, moved, nominal_model, run_places
from analysis.gap.selection.impacts.fit import ImpactFit
from analysis.motion.rig_frame import RigFrame
from ovines.recording_schema import Nominal

Array = NDArray[np.float64]
QUANTITIES = ("nes_x_m", "nes_y_m", "nes_angle_rad")


@dataclass(frozen=True)
class Errors:
    """Sums of squares per run: flights (m^2, rad^2), impacts ((m/s)^2), spins ((rad/s)^2), with their counts."""

    flight: Array
    flight_count: Array
    impact: Array
    impact_count: Array
    spin: Array

    def rms(self) -> dict[str, float | None]:
        """RMS over all runs, by the names of diagnosis.json; None where nothing was predicted."""

        def one(total: Array, count: Array) -> float | None:
            return float(np.sqrt(total.sum() / count.sum())) if count.sum() else None

        return {
            "flight_m": one(self.flight, self.flight_count),
            "impact_m_per_s": one(self.impact, self.impact_count),
            "spin_rad_per_s": one(self.spin, self.impact_count),
        }

    def never_above(self, models: Sequence[Errors]) -> Errors:
        """This floor where it is none of ``models``' errors: what a model predicts better than a floor by chance is the
        floor."""

        def capped(total: Array, count: Array, others: Sequence[tuple[Array, Array]]) -> Array:
            if not (total.sum() > 0 and count.sum()):
                return total
            means = [float(one.sum() / n.sum()) for one, n in others if n.sum()]
            return total * min([1.0, *(mean * float(count.sum() / total.sum()) for mean in means)])

        return replace(
            self,
            flight=capped(self.flight, self.flight_count, [(one.flight, one.flight_count) for one in models]),
            impact=capped(self.impact, self.impact_count, [(one.impact, one.impact_count) for one in models]),
            spin=capped(self.spin, self.impact_count, [(one.spin, one.impact_count) for one in models]),
        )


def held_out_models(fitted: FlightFit) -> list[FlightModel]:
    """For each run the flight model that the other runs give (one linear step from the joint fit)."""
    if len(fitted.fits) < 2:
        return [fitted.model]
    return [moved(fitted.model, fitted.columns, step) for step in fitted.forms.solved(fitted.columns).left_out]


def flights_of(runs: Sequence[Run], models: Sequence[FlightModel]) -> list[FlightFits]:
    """Every run's flights fitted with that run's own (held-out) shared parameters."""
    places = run_places([run.data for run in runs])
    return [
        fit_flights(run.data, run.flights, model.of_run(place), model.shared())
        for run, model, place in zip(runs, models, places, strict=True)
    ]


def given_model(
    effects: Sequence[str], friction: float | None, stated: Mapping[str, float], starts_s: Sequence[float]
) -> FlightModel | None:
    """The flight model as ``[model]`` gives it, ``stated`` terms included; None where it lacks a number that a flight
    needs.  ``starts_s`` of the runs: a friction that drifts is given at the start of the first."""
    middle = None if friction is None else friction / share_at_start(stated, starts_s)
    model = nominal_model(effects, stated, middle)
    return model if (friction is not None or not model.free) else None


def flight_paths(run: Run, fits: FlightFits) -> Array:
    """Predicted x, y, angle (N, 3) of a run at its frames; NaN outside flights."""
    data = run.data
    out = np.full((len(data.time_s), 3), np.nan)
    for k, flight in enumerate(fits.flights):
        index = np.arange(flight.first, flight.last + 1)
        states = fits.path(k, data.time_s[index])
        c, s = np.cos(states[:, 2]), np.sin(states[:, 2])
        ox, oy = fits.shared[:2]
        out[index] = np.column_stack([states[:, 0] + c * ox - s * oy, states[:, 1] + s * ox + c * oy, states[:, 2]])
    return out


def free_paths(run: Run, correlation: float) -> Array:
    """The noise floor: free cubics over pieces of at most 24 frames of each flight, scaled back for what they swallow
    of noise of this ``correlation`` from frame to frame.
    """
    data = run.data
    measured = measured_paths(run)
    out = np.full_like(measured, np.nan)
    for flight in run.flights:
        index = np.arange(flight.first, flight.last + 1)
        index = index[np.isfinite(data.xy_m[index, 0])]
        for piece in np.array_split(index, max(1, -(-len(index) // 24))):
            if len(piece) < 6:
                continue
            t = data.time_s[piece]
            q, _ = np.linalg.qr(np.vander((t - t.mean()) / max(t[-1] - t[0], 1e-9) * 2, 4))
            residual = measured[piece] - q @ (q.T @ np.nan_to_num(measured[piece]))
            swallowed = float(np.sum(q * (correlated(piece, correlation) @ q)))
            out[piece] = measured[piece] - residual * np.sqrt(len(piece) / (len(piece) - swallowed))
    return out


def measured_paths(run: Run) -> Array:
    """Measured x, y (m) and angle (rad) of a run's frames, (N, 3); NaN where nothing was seen."""
    return np.column_stack([run.data.xy_m, np.where(run.data.angle_sd_rad < 1e3, run.data.angle_rad, np.nan)])


def predicted_impacts(
    impacts: ImpactFit,
    restitution_terms: Sequence[str],
    restitution: Array | None = None,
    tangential: Callable[[LawData], Array] | None = None,
) -> tuple[Array, Array]:
    """After-impact velocity error (K, 2: normal, tangential; m/s) and spin error (K,) one impact ahead, law held out by
    run.

    ``restitution`` (K,) of each impact and ``tangential``, impulses per mass (K,) of impacts, fix the law instead (the
    model as given).
    """
    data = impacts.data
    design = restitution_design(data, restitution_terms)
    error, spin = np.zeros((len(data), 2)), np.zeros(len(data))
    radius = impacts.junctions.radius_m
    for run in np.unique(data.at.run):
        here = data.at.run == run
        others = ~here if np.any(~here) else here
        each = (
            restitution[here]
            if restitution is not None
            else design[here] @ fit_restitution(data.part(others), design[others])[0]
        )
        normal_after = each * data.before[here]
        # One impact ahead the normal impulse is the predicted one, not the measured.
        ahead = data.part(here)
        ahead = replace(ahead, normal_impulse=ahead.impulse_with(normal_after))
        impulse = tangential(ahead) if tangential else impacts.without(run).tangential_impulse(ahead)
        error[here, 0] = data.after[here] - normal_after
        error[here, 1] = data.tangential_impulse[here] - impulse
        change = impulse / (data.inertia_factor * radius)
        measured = (data.angular[here] + data.tangential_impulse[here]) / (data.inertia_factor * radius)
        spin[here] = measured - change
    return error, spin


def stated_restitution(data: LawData, model: Nominal, frame: RigFrame) -> Array:
    """Restitution (K,) of each impact as ``[model]`` states it, with the effects on it that have sizes."""
    assert model.restitution is not None
    slope, offset, _ = held_restitution(conditions(data), rig_sizes(stated_sizes(model), frame))
    each = offset + slope * model.restitution
    return np.asarray(np.clip(each, 0.0, 1.0), float)


def stated_tangential(model: Nominal) -> Callable[[LawData], Array]:
    """Tangential impulse per mass (K,), m/s, of impacts as ``[model]`` states their law."""
    friction, beta = model.wall_friction, model.tangential_restitution
    assert friction is not None and beta is not None
    if CONTACT_TIME not in model.effects or model.restitution is None:
        return lambda data: predicted_tangential(data, friction, beta)
    law = LastingContact(friction, stiffness_of(beta, model.restitution), model.restitution, np.nan)
    return lambda data: law.impulse(stick_impulse(data, 0.0), data.normal_impulse)


def errors_of(
    runs: Sequence[Run],
    paths: Sequence[Array],
    impact_error: Array | None,
    spin_error: Array | None,
    impact_run: NDArray[np.int64] | None,
) -> Errors:
    """Errors per run; flights clipped at 8 robust sd so that a wrong track is not taken for a gap."""
    n = len(runs)
    flight, count = np.zeros(n), np.zeros(n)
    for i, (run, path) in enumerate(zip(runs, paths, strict=True)):
        residual = np.hypot(*(measured_paths(run)[:, :2] - path[:, :2]).T)
        residual = residual[np.isfinite(residual)]
        if len(residual):
            limit = 8 * max(float(np.median(residual)), 1e-9)
            residual = residual[residual < limit]
            flight[i], count[i] = np.sum(residual**2), len(residual)
    impact, spins, hits = np.zeros(n), np.zeros(n), np.zeros(n)
    if impact_error is not None and spin_error is not None and impact_run is not None:
        for i in range(n):
            here = (impact_run == i) & np.isfinite(impact_error[:, 0])
            impact[i], spins[i], hits[i] = (
                np.sum(impact_error[here] ** 2),
                np.sum(spin_error[here] ** 2),
                np.count_nonzero(here),
            )
    return Errors(flight, count, impact, hits, spins)


def shrinkage(
    recalibrated: Array, with_effect: Array, floor: Array, rng: np.random.Generator, draws: int = 400
) -> tuple[float, float, float]:
    """(E_recal^2 - E_effect^2) / (E_recal^2 - E_floor^2) and its 90 % interval by bootstrap over runs (sums of squares
    per run).
    """

    def ratio(weight: Array) -> float:
        top, bottom = weight @ (recalibrated - with_effect), weight @ (recalibrated - floor)
        return float(np.clip(top / bottom, 0.0, 1.0)) if bottom > 0 else 0.0

    n = len(recalibrated)
    samples = [ratio(np.bincount(rng.integers(0, n, n), minlength=n).astype(float)) for _ in range(draws)]
    low, high = np.quantile(samples, [0.05, 0.95])
    value = ratio(np.ones(n))
    return value, float(min(low, value)), float(max(high, value))


def table(runs: Sequence[Run], columns: Mapping[str, Sequence[Array] | None], frame: RigFrame) -> pd.DataFrame:
    """Table ``predictions`` from paths per run (``measured`` and the models' columns; None gives nulls), in the
    world.
    """
    parts = []
    columns = {
        name: None if paths is None else [frame.world_places(path) for path in paths] for name, paths in columns.items()
    }
    for i, run in enumerate(runs):
        measured = frame.world_places(measured_paths(run))
        known = np.any([np.isfinite(p[i][:, 0]) for p in columns.values() if p is not None], axis=0)
        for j, quantity in enumerate(QUANTITIES):
            part = pd.DataFrame(
                {
                    "run": run.data.name,
                    "frame": run.frame[known],
                    "time_s": run.data.time_s[known] + frame.middle_s[i],
                    "quantity": quantity,
                    "measured": measured[known, j],
                }
            )
            for name, paths in columns.items():
                part[name] = paths[i][known, j] if paths is not None else np.nan
            parts.append(part)
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()
