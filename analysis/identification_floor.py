"""Floor and flights of the runs of one rig: what all flights share, fitted on all of them, and which terms they need."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.evidence import Evidence, columns_of, gather
from analysis.flight_edges import settled
from analysis.flight_model import INDEX, PARAMETERS
from analysis.flights import ORIGIN, SHARED, WARP, FlightFits, fit_flights
from analysis.noise_correlation import noise_correlation
from analysis.runs import Run

Array = NDArray[np.float64]

# Terms of the flight model that a name in [model] effects stands for; they are estimated along with the friction.
TERMS_OF = {"viscous_drag": ("viscous",), "air_drag": ("air",), "table_tilt": ("tilt_x", "tilt_y"), "friction_drift": ("drift",)}
# Lens residual of 0.03 mm per polynomial term (EXAMPLES' practice: up to 0.05 mm in all), markers' origin within 1 mm.
WARP_SD_M = 3e-5
ORIGIN_SD_M = 1e-3
# Fall of chi-square from which a friction law other than [model]'s is taken: one free parameter would give 10 once in 600 series.
ANOTHER_LAW = 25.0
# The same for further terms: what is left of a lens residual gave up to 250 on practice series that have none of them (480 once, for
# the central force), while the least listed effect there, a small air drag, gave thousands; below it the impacts do not notice.
ANOTHER_TERM = 300.0
MOST_ADDED = 3
# Parameters that no flight informs keep this sd, and are then reported as not determined.
WEAK_SD = 1e2
# Terms linear in the place are held: they cannot be told from length and attitude, and the Host does not share them.
PRIOR_SD = {**{name: WARP_SD_M if int(name[-2]) + int(name[-1]) > 1 else 1e-9 for name in WARP}, **dict.fromkeys(ORIGIN, ORIGIN_SD_M)}
# What else may bend a flight: each is taken up where the flights of all runs leave no doubt, and named.
CANDIDATES: dict[str, tuple[str, ...]] = {
    "table_tilt": ("tilt_x", "tilt_y"), "vertical_motion": ("load",), "viscous_drag": ("viscous",), "air_drag": ("air",),
    "friction_drift": ("drift",), "a force towards the Host's centre": ("centre_host",),
}
START_FRICTION = 0.25
ROUNDS = 5
# Fewer runs do not show how much they scatter.
FEWEST_RUNS = 5


@dataclass(frozen=True, eq=False)
class FloorFit:
    """Flights fitted with the best shared parameters: ``names`` of those estimated, ``estimate`` and ``covariance`` of them;
    ``correlation`` of neighbouring frames' errors, ``scale`` of the sds that the data show, ``misfit`` chi-square in all."""

    fits: tuple[FlightFits, ...]
    evidence: tuple[Evidence, ...]
    names: tuple[str, ...]
    estimate: Array
    covariance: Array
    correlation: float
    scale: float
    misfit: float
    coupling: float


def choose_floor(runs: Sequence[Run], effects: Sequence[str], angle: bool) -> tuple[list[Run], FloorFit, list[str]]:
    """The floor as ``[model]`` has it, with what else the flights need beyond doubt: friction, its spin coupling, further terms.

    A wrong flight law bends every extrapolation to an impact; the parameters of the impacts must not pay for it.  Returns the runs too:
    without the frames that no flight explains.
    """
    names = [term for effect in effects for term in TERMS_OF.get(effect, ())]
    load = 1.0 if "vertical_motion" in effects else 0.0
    friction, coupled = "floor_friction" in effects or "spin_coupling" in effects, "spin_coupling" in effects and angle
    if friction:
        names = ["friction", *names]
    floor, notes = fit_floor(runs, names, 1.0 if coupled else 0.0, load), []
    if not friction or (angle and not coupled):
        names = ["friction", *(n for n in names if n != "friction")]
        richer = fit_floor(runs, names, 1.0 if angle else 0.0, load)
        if floor.misfit - richer.misfit > ANOTHER_LAW * max(richer.scale, 1.0) ** 2:
            what = "the coupling of sliding and spinning friction" if friction else "floor friction"
            floor, notes = richer, [f"The flights need {what}, which [model] effects does not name; it was fitted along."]
    found = [settled(run, fits, floor.scale) for run, fits in zip(runs, floor.fits, strict=True)]
    if any(run is not None for run in found):
        runs = [new or run for new, run in zip(found, runs, strict=True)]
        floor = fit_floor(runs, floor.names, floor.coupling, load, floor)
    for _ in range(MOST_ADDED):
        added = _needed_term(floor, runs)
        if added is None:
            break
        richer = fit_floor(runs, [*floor.names, *CANDIDATES[added]], floor.coupling, load, floor)
        if not _confirmed(richer, CANDIDATES[added]):
            break
        floor = richer
        notes.append(f"The flights need {added}, which [model] effects does not name; it was fitted along.")
    return list(runs), floor, notes


def _needed_term(floor: FloorFit, runs: Sequence[Run]) -> str | None:
    """The candidate that lowers chi-square most (linearised), where that is beyond doubt; None where none does."""
    candidates = {name: terms for name, terms in CANDIDATES.items() if not set(terms) & set(floor.names)}
    if "vertical_motion" in candidates and floor.fits[0].parameters[INDEX["load"]] != 0.0:
        del candidates["vertical_motion"]
    columns = columns_of([*floor.names, *(t for terms in candidates.values() for t in terms), *ORIGIN, *WARP])
    evidence = [gather(fit, columns, floor.correlation) for fit in floor.fits]
    always = [*floor.names, *ORIGIN, *WARP]
    gains = {}
    for name, terms in {"": (), **candidates}.items():
        chosen = columns_of([*always, *terms])
        prior = np.array([PRIOR_SD.get(SHARED[c], WEAK_SD) for c in chosen]) ** -2.0
        offsets = [chosen.index(SHARED.index(n)) for n in (*ORIGIN, *WARP)]
        gains[name] = _step(evidence, chosen, prior, floor.fits[0].shared, offsets)[2]
    best = max(candidates, key=lambda name: gains[name], default=None)
    if best is None or gains[best] - gains[""] < ANOTHER_TERM * max(floor.scale, 1.0) ** 2:
        return None
    return best


def _confirmed(floor: FloorFit, terms: Sequence[str]) -> bool:
    """Whether fitted ``terms`` stand out of their covariance, in which the runs' disagreement is: what the model misses pulls each run its
    own way."""
    at = [floor.names.index(term) for term in terms]
    value = floor.estimate[at]
    return bool(value @ np.linalg.solve(floor.covariance[np.ix_(at, at)], value) > ANOTHER_LAW)


def fit_floor(runs: Sequence[Run], names: Sequence[str], coupling: float, load: float = 0.0, start: FloorFit | None = None) -> FloorFit:
    """Shared parameters ``names`` of the flight model on all flights of all runs, relinearised until they rest.

    ``start``: a fit with fewer of them, from which to go on."""
    parameters = np.zeros(len(PARAMETERS))
    parameters[INDEX["coupling"]], parameters[INDEX["load"]] = coupling, load
    if "friction" in names:
        parameters[INDEX["friction"]] = START_FRICTION
    shared = np.zeros(2 + len(WARP))
    fits: list[FlightFits] = []
    if start is not None:
        parameters, shared, fits = start.fits[0].parameters.copy(), start.fits[0].shared.copy(), list(start.fits)
    columns = columns_of([*names, *ORIGIN, *WARP])
    prior = np.array([PRIOR_SD.get(SHARED[c], WEAK_SD) for c in columns]) ** -2.0
    at = [columns.index(SHARED.index(n)) for n in names]
    offsets = [columns.index(SHARED.index(n)) for n in (*ORIGIN, *WARP)]
    correlation = 0.0
    for _ in range(ROUNDS):
        fits = [fit_flights(run.data, run.flights, parameters, shared, fits[k] if fits else None) for k, run in enumerate(runs)]
        evidence = [gather(fit, columns, correlation) for fit in fits]
        correlation = noise_correlation(evidence)
        step, covariance, _ = _step(evidence, columns, prior, shared, offsets)
        if np.all(np.abs(step) <= 0.05 * np.sqrt(np.diag(covariance))):
            break
        parameters = parameters.copy()
        for name, k in zip(names, at, strict=True):
            parameters[INDEX[name]] += step[k]
        parameters[0] = max(parameters[0], 0.0)
        shared = shared + step[offsets]
    # Whether errors go together is read off plain least squares; with that known each flight has a better estimate, and an honest sd.
    fits = [fit_flights(run.data, run.flights, parameters, shared, fits[k], correlation) for k, run in enumerate(runs)]
    evidence = [gather(fit, columns, correlation) for fit in fits]
    step, covariance, _ = _step(evidence, columns, prior, shared, offsets)
    count = sum(e.count for e in evidence) - len(names)
    misfit = sum(e.misfit for e in evidence)
    scale = float(np.sqrt(max(misfit / count, 1e-4))) if count > 0 else 1.0
    estimate = np.array([parameters[INDEX[n]] for n in names]) + step[at]
    fits = [replace(fit, covariances=fit.covariances * max(scale, 1.0) ** 2) for fit in fits]
    wider = between_runs(evidence, columns, step, covariance * max(scale, 1.0) ** 2)[at]
    return FloorFit(tuple(fits), tuple(evidence), tuple(names), estimate,
                    covariance[np.ix_(at, at)] * max(scale, 1.0) ** 2 * np.outer(wider, wider), correlation, scale, float(misfit), coupling)


def between_runs(evidence: Sequence[Evidence], columns: Sequence[int], step: Array, covariance: Array) -> Array:
    """Factor (P,) >= 1 on the sds by which the runs disagree more than their noise lets them.

    Runs are independent whatever correlates the frames within one: the sum of their scores' squares is the sandwich estimator clustered
    by runs (Liang and Zeger 1986).  1 with fewer than :data:`FEWEST_RUNS`."""
    told = [e for e in evidence if e.count > 0]
    if len(told) < FEWEST_RUNS:
        return np.ones(len(columns))
    scores = []
    for e in told:
        information, score = e.take(columns)
        scores.append(score - information @ step)
    left = np.array(scores)
    spread = covariance @ (left.T @ left) @ covariance * len(told) / (len(told) - 1)
    return np.sqrt(np.maximum(np.diag(spread) / np.diag(covariance), 1.0))


def _step(evidence: Sequence[Evidence], columns: Sequence[int], prior: Array, shared: Array,
          offsets: Sequence[int]) -> tuple[Array, Array, float]:
    """Step of the shared unknowns, their covariance, fall of chi-square; the prior draws offsets to zero, not to where they stand."""
    information, score = np.diag(prior), np.zeros(len(columns))
    score[list(offsets)] = -prior[list(offsets)] * shared
    for e in evidence:
        a, b = e.take(columns)
        information, score = information + a, score + b
    # Unit diagonal first: friction, metres and rates differ by ten orders of magnitude.
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
    return covariance @ score, covariance, float(score @ covariance @ score)
