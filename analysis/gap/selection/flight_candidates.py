"""The flights' side of the ladder: nominal fit, gain of every candidate and probe, held out run by run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray

from analysis.flights.evidence import Evidence, columns_of, gather, solve
from analysis.flights.fit import LENS_TERMS, ORIGIN, SHARED, FlightFits, fit_flights
from analysis.flights.noise import FlightNoise
from analysis.flights.parameters import INDEX, PARAMETERS
from analysis.flights.runs import Run
from analysis.gap.selection.flight_terms import EFFECT_TERMS, FlightTerm

Array = NDArray[np.float64]

# Prior sd of the lens residual's polynomials (m at the contact radius): what a good calibration leaves, GAP.md: 0.05 mm
# at most.
LENS_SD_M = 3e-5
ORIGIN_SD_M = 1e-3
ALL = tuple(range(len(SHARED)))
START_FRICTION = 0.25


@dataclass(frozen=True, eq=False)
class FlightModel:
    """Parameter vector, the markers' origin against the centre of mass, relative change of friction per run, and what
    is free.
    """

    parameters: Array
    origin_m: Array
    drift_per_run: float
    free: tuple[str, ...]

    def shared(self) -> Array:
        """Parameters that all flights share: the markers' origin (m) and the lens residual's terms."""
        return np.concatenate([self.origin_m, np.zeros(len(LENS_TERMS))])

    def of_run(self, number: int, runs: int) -> Array:
        """Parameters of one run: friction times 1 + drift (number - middle)."""
        p = self.parameters.copy()
        p[INDEX["friction"]] *= 1 + self.drift_per_run * (number - 0.5 * (runs - 1))
        return p


@dataclass(frozen=True, eq=False)
class FlightFit:
    """A fitted flight model: flights, evidence over all columns at the fit, covariance of what was free, misfit and
    count.
    """

    model: FlightModel
    fits: tuple[FlightFits, ...]
    evidence: tuple[Evidence, ...]
    covariance: Array
    columns: tuple[str, ...]
    misfit: float
    count: int
    correlation: float


@dataclass(frozen=True, eq=False)
class Gain:
    """What one term adds to a fit: fall of -2 log L in all and on held-out runs, estimate and sd per column, jackknife
    significance.
    """

    term: FlightTerm
    gain: float
    held_out: float
    estimate: Array
    sd: Array
    significance: float
    improved: float
    acceleration_m_per_s2: float
    per_run: Array = field(default_factory=lambda: np.zeros(0))


def nominal_model(effects: Sequence[str], friction: float | None = None) -> FlightModel:
    """The flight model of ``[model] effects`` before it is fitted."""
    p = np.zeros(len(PARAMETERS))
    free: list[str] = []
    if "floor_friction" in effects or "spin_coupling" in effects or "friction_drift" in effects:
        p[INDEX["friction"]] = friction if friction else START_FRICTION
        free.append("friction")
    if "spin_coupling" in effects:
        p[INDEX["coupling"]] = 1.0
    for term in EFFECT_TERMS:
        if term.name in effects:
            free += term.columns
    if "vertical_motion" in effects:
        p[INDEX["load"]] = 1.0
    return FlightModel(p, np.zeros(2), 0.0, tuple(free))


def fit(
    runs: Sequence[Run],
    model: FlightModel,
    *,
    rounds: int = 3,
    every_column: bool = True,
    correlation: float | None = None,
    skip: int | None = None,
) -> FlightFit:
    """Gauss-Newton on the shared parameters ``model.free`` and the origin; flights fitted anew each round.

    ``skip``: number of a run left out of the estimate of the shared parameters (its flights are fitted all the same).
    """
    names = [*model.free, *ORIGIN, *LENS_TERMS]
    rho = 0.0 if correlation is None else correlation
    evidence: list[Evidence] = []
    fits: list[FlightFits] = []
    for step in range(rounds + 1):
        last = step == rounds
        # Compiled code gives up Python's lock, so threads do; each round starts from the flights of the one before.
        fits = _in_threads(
            fit_flights,
            [
                (run.data, run.flights, model.of_run(i, len(runs)), model.shared(), fits[i] if fits else None)
                for i, run in enumerate(runs)
            ],
        )
        usual = _usual(fits)
        columns = ALL if last and every_column else columns_of([n for n in names if n in SHARED])
        evidence = _in_threads(gather, [(f, columns, FlightNoise(rho), usual) for f in fits])
        if correlation is None:
            rho = _correlation(evidence) if step >= 1 else 0.0
        kept = [e for i, e in enumerate(_with_drift(evidence, model, len(runs))) if i != skip]
        estimate, covariance, explained = solve_named(kept, names)
        if last:
            break
        model = _moved(model, names, estimate)
    # What the nuisances (lens residual, origin) still explain is no misfit.
    misfit = sum(e.misfit for e in evidence) - explained
    return FlightFit(
        model,
        tuple(fits),
        tuple(_with_drift(evidence, model, len(runs))),
        covariance,
        tuple(names),
        misfit,
        sum(e.count for e in evidence),
        rho,
    )


def _in_threads(function: Callable[..., Any], calls: Sequence[tuple[Any, ...]]) -> list[Any]:
    return Parallel(n_jobs=min(2, max(len(calls), 1)), prefer="threads")(
        delayed(function)(*arguments) for arguments in calls
    )


def _usual(fits: Sequence[FlightFits]) -> float:
    ratio = np.concatenate([f.misfit[f.freedom > 0] / f.freedom[f.freedom > 0] for f in fits]) if fits else np.ones(1)
    return float(np.median(ratio)) if len(ratio) else 1.0


def _correlation(evidence: Sequence[Evidence]) -> float:
    """AR(1) coefficient of the frames' errors; the fit of six unknowns per flight takes a little of it away."""
    lag = float(np.median([e.lag_one for e in evidence])) + 0.03
    return float(np.clip(lag, 0.0, 0.8)) if lag > 0.12 else 0.0


def _moved(model: FlightModel, names: Sequence[str], step: Array) -> FlightModel:
    p, origin, drift = model.parameters.copy(), model.origin_m.copy(), model.drift_per_run
    for name, value in zip(names, step, strict=True):
        if name in INDEX:
            limit = 0.3 if name in ("friction", "load", "coupling") else np.inf
            p[INDEX[name]] += float(np.clip(value, -limit, limit))
        elif name in ORIGIN:
            origin[ORIGIN.index(name)] += float(np.clip(value, -2e-3, 2e-3))
        elif name == "drift_run":
            drift += float(np.clip(value, -0.1, 0.1))
        # The lens residual is a nuisance: it is known too badly to correct positions with.
    p[INDEX["friction"]] = max(p[INDEX["friction"]], 0.0)
    return FlightModel(p, origin, drift, model.free)


DRIFT_RUN = len(SHARED)


def _with_drift(evidence: Sequence[Evidence], model: FlightModel, runs: int) -> list[Evidence]:
    """Evidence with one more column, friction changing from run to run: a multiple of the run's own friction column."""
    out = []
    friction = model.parameters[INDEX["friction"]]
    for i, e in enumerate(evidence):
        if INDEX["friction"] not in e.columns:
            out.append(e)
            continue
        at = e.columns.index(INDEX["friction"])
        factor = friction * (i - 0.5 * (runs - 1))
        row = e.information[at] * factor
        information = np.block([[e.information, row[:, None]], [row[None, :], np.array([[row[at] * factor]])]])
        out.append(
            Evidence(
                (*e.columns, DRIFT_RUN),
                information,
                np.append(e.score, e.score[at] * factor),
                e.misfit,
                e.count,
                e.flights,
                e.left_out,
                e.lag_product,
                e.lag_square,
            )
        )
    return out


def _indices(names: Sequence[str]) -> list[int]:
    return [DRIFT_RUN if n == "drift_run" else SHARED.index(n) for n in names]


def information_of(evidence: Evidence, names: Sequence[str]) -> Array | None:
    """A run's information about the named columns; None where it lacks one of them."""
    at = _indices(names)
    return evidence.take(at)[0] if set(at) <= set(evidence.columns) else None


def prior_of(names: Sequence[str]) -> Array:
    """Prior weights (1/sd^2) of named columns: lens terms and origins are known beforehand, causes are not."""
    return np.array(
        [1 / LENS_SD_M**2 if n.startswith("lens_") else (1 / ORIGIN_SD_M**2 if n in ORIGIN else 0.0) for n in names]
    )


def solve_named(evidence: Sequence[Evidence], names: Sequence[str]) -> tuple[Array, Array, float]:
    """:func:`analysis.flights.evidence.solve` for named columns."""
    return solve(evidence, _indices(names), prior_of(names))


def gain_of(base: FlightFit, term: FlightTerm) -> Gain:
    """Gain of one term on top of a fit, linearised there; cross-validated leaving out one run at a time."""
    without = list(base.columns)
    columns = [c for c in term.columns if c not in without]
    names = [*without, *columns]
    evidence = base.evidence
    if not columns or any(i not in evidence[0].columns for i in _indices(names)):
        return Gain(term, 0.0, 0.0, np.zeros(len(columns)), np.full(len(columns), np.inf), 0.0, 0.0, 0.0)
    (_d0, _, g0), (d1, c1, g1) = solve_named(evidence, without), solve_named(evidence, names)
    estimate, sd = d1[len(without) :], np.sqrt(np.diag(c1))[len(without) :]
    runs = len(evidence)
    per_run, estimates = np.zeros(runs), np.zeros((runs, len(columns)))
    for i in range(runs):
        rest = [e for j, e in enumerate(evidence) if j != i]
        # A single recording has nothing to hold out: its own fit stands in, and the caller says so.
        rest = rest or list(evidence)
        a, b = solve_named(rest, without)[0], solve_named(rest, names)[0]
        per_run[i] = _loss(evidence[i], without, a) - _loss(evidence[i], names, b)
        estimates[i] = b[len(without) :]
    if runs > 2:
        centred = estimates - estimates.mean(0)
        covariance = (runs - 1) / runs * centred.T @ centred + np.diag(0.25 * sd**2)
        significance = float(np.sqrt(max(float(estimate @ np.linalg.pinv(covariance, hermitian=True) @ estimate), 0.0)))
    else:
        significance = float(
            np.sqrt(np.nansum((estimate / np.where(sd > 0, sd, np.nan)) ** 2))
        )  # no sd: no information
    scale = [s for c, s in zip(term.columns, term.scale, strict=True) if c in columns]
    acceleration = float(np.sqrt(np.sum((estimate * np.array(scale)) ** 2)))
    return Gain(
        term,
        g1 - g0,
        float(per_run.sum()),
        estimate,
        sd,
        significance,
        float(np.mean(per_run > 0)),
        acceleration,
        per_run,
    )


def _loss(evidence: Evidence, names: Sequence[str], d: Array) -> float:
    information, score = evidence.take(_indices(names))
    return float(d @ information @ d - 2 * d @ score)


def gains(base: FlightFit, terms: Sequence[FlightTerm]) -> list[Gain]:
    """Gains of the given effects or probes, largest first."""
    return sorted((gain_of(base, t) for t in terms), key=lambda g: -g.gain)
