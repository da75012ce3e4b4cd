"""The missing law of the flights: found in their residuals, fitted again by their equation of motion, held out by
run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.fit import NO_ANGLE_SD_RAD, SHARED
from analysis.flights.parameters import LAW, LAW_TERMS
from analysis.flights.runs import Run
from analysis.gap.laws.dictionary.candidate import Candidate, law_at, with_sds
from analysis.gap.laws.dictionary.flights import flight_candidates
from analysis.gap.laws.dictionary.parts import RigScales
from analysis.gap.laws.evidence import evidence_of
from analysis.gap.laws.flight_rows import FlightRegression, flight_regression
from analysis.gap.laws.found_law import LawFound, in_world, others_of
from analysis.gap.laws.pulses import pulse_candidates
from analysis.gap.laws.regression import Halves, Profile, Regression, halves_of
from analysis.gap.laws.search import Found, find_law
from analysis.gap.prediction import predict
from analysis.gap.selection.flight_candidates import FlightFit, fit
from analysis.gap.selection.flight_steps import FlightSteps, without_needless
from analysis.motion.rig_frame import RigFrame
from ovines.core.laws.terms import MOST_TERMS, rows_of

Array = NDArray[np.float64]
# Rounds of fitting coefficients by the equation of motion, and the numbers inside by its residuals; steps of those are
# kept to so many of the search's.
ROUNDS, LONGEST_STEP, STEP = 2, 2.0, 0.05
FEWEST_FLIGHTS = 3
# Coefficients that a fit has turned about or blown up are no law.
LARGEST_FACTOR = 10.0
# Angles that miss by more than so many medians are wrong tracks.
CLIP_SD = 8.0


@dataclass(frozen=True, eq=False)
class FittedLaw:
    """A law in the flights' equation of motion: ``runs`` that hold it, their ``fit``, its ``parts``, ``values`` of
    coefficients and numbers inside, and their ``covariance``."""

    runs: tuple[Run, ...]
    fit: FlightFit
    parts: tuple[Candidate, ...]
    values: Array
    covariance: Array


def find_flight_law(
    runs: Sequence[Run], steps: FlightSteps, frame: RigFrame, rng: np.random.Generator
) -> tuple[LawFound | None, FlightSteps]:
    """The formula of what the flights lack beside the effects that ``steps`` name, None where chance would find as
    much; and the steps without the names that the law makes needless."""
    first = base = steps.named
    problem = flight_regression(base)
    if len(np.unique(problem.problem.block)) < FEWEST_FLIGHTS:
        return None, steps
    scales = RigScales.of(problem.known, float(runs[0].data.host.omega_rad_per_s))
    candidates = [*flight_candidates(scales), *pulse_candidates(problem, scales.run_s, rng)]
    found, p = find_law(problem.problem, problem.columns, candidates, rng)
    law = None if found is None else fitted_law(runs, base, found)
    if found is None or law is None:
        return None, steps
    fewer = without_needless(runs, law.fit, steps)
    if fewer is not steps:
        again = fitted_law(runs, fewer.named, found)
        if again is not None:
            law, steps, base = again, fewer, fewer.named
    paths = _paths(runs, base), _paths(law.runs, law.fit)
    lever_m = _lever_m(runs)
    before, after, floor = (
        _mean_square(runs, one, lever_m) for one in (*paths, [predict.free_paths(run) for run in runs])
    )
    floor = floor * min(1.0, float(after.sum() / floor.sum()))  # never above the best model
    rig_law = law_at(law.parts, law.values, law.covariance)
    told = LawFound(
        in_world(rig_law, frame),
        rig_law,
        with_sds(lambda v: in_world(law_at(law.parts, v), frame), law.values, law.covariance),
        p,
        before,
        after,
        floor,
        others_of(found, frame),
        evidence_of(problem, flight_regression(law.fit), rig_law),
        paths,
        (law.runs, law.fit),
        _halves(problem if base is first else flight_regression(base), law),
    )
    return told, steps


def _halves(problem: FlightRegression, law: FittedLaw) -> Halves | None:
    """A fitted law's size by halves of the runs, on the rows of the flights without it."""
    terms = [term for part in law.parts for term in part.terms]
    return halves_of(problem.problem, problem.columns(terms) @ law.values[: len(terms)])


def _lever_m(runs: Sequence[Run]) -> float:
    """The radius at which an angle's noise is as large as a place's: what a torque does counts like what a force does;
    0 where no angle was seen."""
    place = np.concatenate([run.data.xy_sd_m for run in runs])
    angle = np.concatenate([run.data.angle_sd_rad for run in runs])
    seen = angle < NO_ANGLE_SD_RAD
    return float(np.median(place[seen]) / np.median(angle[seen])) if np.any(seen) else 0.0


def _mean_square(runs: Sequence[Run], paths: Sequence[Array], lever_m: float) -> Array:
    """Squared errors (R,) of place and of the angle at ``lever_m`` (m^2) that add up to the mean over all frames."""
    errors = predict.errors_of(runs, paths, None, None, None)
    total = errors.flight.copy()
    for i, (run, path) in enumerate(zip(runs, paths, strict=True)):
        turned = np.abs(predict.measured_paths(run)[:, 2] - path[:, 2])
        turned = turned[np.isfinite(turned)]
        if lever_m > 0 and len(turned):
            limit = CLIP_SD * max(float(np.median(turned)), 1e-12)
            total[i] += lever_m**2 * float(np.sum(turned[turned < limit] ** 2))
    return np.asarray(total / max(float(errors.flight_count.sum()), 1.0), float)


def _paths(runs: Sequence[Run], fitted: FlightFit) -> list[Array]:
    fits = predict.flights_of(runs, predict.held_out_models(fitted))
    return [predict.flight_paths(run, one) for run, one in zip(runs, fits, strict=True)]


def fitted_law(runs: Sequence[Run], base: FlightFit, found: Found) -> FittedLaw | None:
    """The parts of a found law in the equation of motion, coefficients and numbers refined; None where the flights do
    not take it."""
    held = len(runs[0].data.law)
    if held + len(found.terms) > MOST_TERMS:
        return None
    parts, coefficients = found.parts, found.coefficients
    names = LAW_TERMS[held : held + len(coefficients)]
    for _ in range(ROUNDS):
        terms = [term for part in parts for term in part.terms]
        rows = rows_of([replace(t, coefficient=float(c)) for t, c in zip(terms, coefficients, strict=True)])
        held_runs = tuple(replace(run, data=replace(run.data, law=np.vstack([run.data.law, rows]))) for run in runs)
        p = base.model.parameters.copy()
        p[LAW + held : LAW + held + len(names)] = 1.0
        trial = fit(held_runs, replace(base.model, parameters=p, free=(*base.model.free, *names)))
        factors = trial.model.parameters[LAW + held : LAW + held + len(names)]
        if not np.all(np.abs(factors) < LARGEST_FACTOR):
            return None
        coefficients = coefficients * factors
        step, covariance = _refined(flight_regression(trial), trial, parts, coefficients, names)
        values = np.concatenate([coefficients, [n for part in parts for n in part.numbers]])
        if not np.any(step):
            break
        parts = _stepped(parts, step)
    return FittedLaw(held_runs, trial, tuple(found_at(parts, values)), values, covariance)


def found_at(parts: Sequence[Candidate], values: Array) -> list[Candidate]:
    """The parts at the numbers that stand behind the coefficients in ``values``."""
    numbers = values[sum(len(part.terms) for part in parts) :]
    out = []
    for part in parts:
        own, numbers = numbers[: len(part.numbers)], numbers[len(part.numbers) :]
        out.append(part.at(own.tolist()))
    return out


def _refined(
    problem: FlightRegression, trial: FlightFit, parts: Sequence[Candidate], coefficients: Array, names: Sequence[str]
) -> tuple[Array, Array]:
    """Step of the numbers inside, in steps of the search, and the covariance of coefficients and numbers."""
    columns = [SHARED.index(n) for n in sorted((n for n in trial.columns if n in SHARED), key=SHARED.index)]
    law = [columns.index(SHARED.index(n)) for n in names]
    others = [i for i in range(len(columns)) if i not in law]
    whole = problem.problem
    without = Regression(whole.residual, whole.nuisances[:, others], whole.prior[others], whole.block, whole.run)
    jacobian, sizes_inside = [whole.nuisances[:, law] / coefficients], []
    at = 0
    for part in parts:
        own = coefficients[at : at + len(part.terms)]
        at += len(part.terms)
        for i, (number, by, positive) in enumerate(zip(part.numbers, part.steps, part.positive, strict=True)):
            unit = abs(number) * by if positive else by
            moved = [list(part.numbers) for _ in range(2)]
            moved[0][i] += STEP * unit
            moved[1][i] -= STEP * unit
            ahead, behind = (problem.columns(part.at(m).terms) @ own for m in moved)
            jacobian.append(((ahead - behind) / (2 * STEP * unit))[:, None])
            sizes_inside.append(unit)
    _, step, covariance = Profile.of(without).gain(np.hstack(jacobian))
    covariance = covariance * whole.excess
    inside = step[len(names) :] / np.array(sizes_inside) if sizes_inside else np.zeros(0)
    return np.clip(inside, -LONGEST_STEP, LONGEST_STEP), _with_jackknife(covariance, trial, coefficients, names)


def _with_jackknife(covariance: Array, trial: FlightFit, coefficients: Array, names: Sequence[str]) -> Array:
    """Coefficients' sds no smaller than their scatter when one run is left out: lens and model errors scatter there."""
    runs = len(trial.evidence)
    if runs < 4:
        return covariance
    at = [list(trial.columns).index(n) for n in names]
    left_out = trial.forms.solved(trial.columns).left_out[:, at] * coefficients
    scatter = np.sqrt((runs - 1) / runs * np.sum((left_out - left_out.mean(0)) ** 2, 0))
    grown = np.ones(len(covariance))
    own = np.sqrt(np.maximum(np.diag(covariance)[: len(at)], 1e-300))
    grown[: len(at)] = np.maximum(1.0, scatter / own)
    return covariance * np.outer(grown, grown)


def _stepped(parts: Sequence[Candidate], step: Array) -> tuple[Candidate, ...]:
    out = []
    for part in parts:
        own, step = step[: len(part.numbers)], step[len(part.numbers) :]
        moved = [
            n * float(np.exp(s * size)) if positive else n + float(s) * size
            for n, s, size, positive in zip(part.numbers, own, part.steps, part.positive, strict=True)
        ]
        out.append(part.at(moved))
    return tuple(out)
