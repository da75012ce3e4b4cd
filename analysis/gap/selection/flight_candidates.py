"""The flights' side of the ladder: fits, and the gain of every candidate and probe, held out run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.flights.along_flights import unit_accelerations
from analysis.flights.evidence import Evidence, columns_of, covariance_of, gather, solve
from analysis.flights.fit import LENS_TERMS, ORIGIN, SHARED, FlightFits, RunData, fit_flights
from analysis.flights.noise import PLAIN, FlightNoise
from analysis.flights.parameters import GIVEN, INDEX, LAW, LAW_TERMS, PARAMETERS
from analysis.flights.runs import Run
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.gap.selection.flight_terms import EFFECT_TERMS, NEGLIGIBLE_BEND, FlightTerm
from analysis.identification.floor import noise_of
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# Prior sds over the contact radius: of the lens residual's polynomials (0.03 mm of 40 mm: what a good calibration
# leaves, GAP.md: 0.05 mm at most), and of the markers' origin.
LENS_SD_SHARE, ORIGIN_SD_SHARE = 7.5e-4, 0.025
# Terms of a written law are columns where a run holds one; what a flight is given is none.
ALL = tuple(i for i, name in enumerate(SHARED) if name not in (*LAW_TERMS, *GIVEN))
START_FRICTION = 0.25


@dataclass(frozen=True, eq=False)
class FlightModel:
    """Parameter vector, the markers' origin against the centre of mass, relative change of friction per run, and what
    is free; ``stated``: what ``[model]`` holds (:func:`analysis.flights.stated_terms.stated_terms`).
    """

    parameters: Array
    origin_m: Array
    drift_per_run: float
    free: tuple[str, ...]
    stated: Mapping[str, float] = field(default_factory=dict)

    def shared(self) -> Array:
        """Parameters that all flights share: the markers' origin (m) and the lens residual's terms."""
        return np.concatenate([self.origin_m, np.zeros(len(LENS_TERMS))])

    def of_run(self, place: RunPlace) -> Array:
        """Parameters of one run.  Friction drifts from each run's start on, as the floor does: long runs pass their
        middle, where time counts from, later than short ones.
        """
        p = self.parameters.copy()
        later = 1 + p[INDEX["drift"]] * place.later_s
        p[INDEX["friction"]] *= later * (1 + self.drift_per_run * place.number)
        p[INDEX["drift"]] /= later
        return p


@dataclass(frozen=True)
class RunPlace:
    """A run among its series: ``number`` counted from the middle one, ``later_s`` from its start to its middle, less
    the runs' mean of that."""

    number: float
    later_s: float


def run_places(runs: Sequence[RunData]) -> list[RunPlace]:
    """Places of the runs of a series."""
    start = np.array([-run.time_s[0] for run in runs])
    number = np.arange(len(runs)) - 0.5 * (len(runs) - 1)
    return [RunPlace(float(n), float(s)) for n, s in zip(number, start - start.mean(), strict=True)]


@dataclass(frozen=True)
class Units:
    """The rig's own scale of accelerations: RMS (m/s^2) that a unit of each column makes along the flights, and the one
    below which nothing is named.
    """

    acceleration_m_per_s2: dict[str, float]
    negligible_m_per_s2: float

    def of(self, column: str) -> float:
        """RMS acceleration (m/s^2) of a unit of a column."""
        return self.acceleration_m_per_s2.get(column, 0.0)


def rig_units(fitted: FlightFit) -> Units:
    """Units of the rig that a fit's flights show."""
    units, speed = unit_accelerations(fitted.fits)
    runs = np.arange(len(fitted.fits)) - 0.5 * (len(fitted.fits) - 1)
    friction = fitted.model.parameters[INDEX["friction"]]
    units[DRIFT_OF_RUN] = float(units["friction"] * friction * np.sqrt(np.mean(runs**2)))
    radius = fitted.fits[0].run.contact_radius_m
    return Units(units, NEGLIGIBLE_BEND * speed**2 / radius)


@dataclass(frozen=True, eq=False)
class Solved:
    """A linear solution: ``step`` (P,) of what was free, ``covariance``, ``cost`` (-2 log L against the linearisation
    point), ``held_out`` (R,) the same of each run by the others' solution ``left_out`` (R, P)."""

    step: Array
    covariance: Array
    cost: float
    held_out: Array
    left_out: Array


@dataclass(frozen=True, eq=False)
class Forms:
    """The runs' quadratic forms in the columns ``names`` (C): ``information`` (R, C, C) and ``score`` (R, C)."""

    names: tuple[str, ...]
    information: Array
    score: Array
    contact_radius_m: float

    @cached_property
    def total(self) -> Array:
        """Information of all runs (C, C)."""
        return np.asarray(self.information.sum(0))

    def at(self, names: Sequence[str]) -> list[int]:
        """Places of columns."""
        return [self.names.index(n) for n in names]

    def solved(self, free: Sequence[str], fixed: Sequence[str] = (), at: Array | None = None) -> Solved:
        """``free`` columns fitted with ``fixed`` ones moved to ``at``; everything else stays where it is."""
        a, b = self.at(free), self.at(fixed)
        moved_to = np.zeros(0) if at is None else at
        prior = prior_of(free, self.contact_radius_m)
        pushed = self.score[:, a] - self.information[:, a][:, :, b] @ moved_to
        inner = self.information[:, a][:, :, a]
        constant = np.einsum("i,rij,j->r", moved_to, self.information[:, b][:, :, b], moved_to) - 2 * (
            self.score[:, b] @ moved_to
        )
        whole, score = inner.sum(0) + np.diag(prior), pushed.sum(0)
        covariance = covariance_of(whole)
        step = covariance @ np.where(np.diag(covariance) > 0, score, 0.0)
        cost = float(constant.sum() - score @ step)
        left_out = np.empty((len(inner), len(a)))
        for i in range(len(inner)):
            # A single recording has nothing to hold out: its own fit stands in, and the caller says so.
            own = (inner[i], pushed[i]) if len(inner) > 1 else (0.0, 0.0)
            left_out[i] = covariance_of(whole - own[0]) @ (score - own[1])
        held_out = constant + np.einsum("ri,rij,rj->r", left_out, inner, left_out) - 2 * np.sum(left_out * pushed, 1)
        return Solved(step, covariance, cost, held_out, left_out)


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
    noise: FlightNoise

    @cached_property
    def forms(self) -> Forms:
        """The evidence as arrays over the runs, lens residual's prior in :func:`prior_of`."""
        columns = self.evidence[0].columns
        return Forms(
            tuple(DRIFT_OF_RUN if c == DRIFT_RUN else SHARED[c] for c in columns),
            np.array([e.information for e in self.evidence]),
            np.array([e.score for e in self.evidence]),
            self.fits[0].run.contact_radius_m,
        )


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


def nominal_model(
    effects: Sequence[str], stated: Mapping[str, float] | None = None, friction: float | None = None
) -> FlightModel:
    """The flight model of ``[model] effects`` before it is fitted; ``stated`` terms are held."""
    stated = stated or {}
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
    for name in set(stated) & set(INDEX):
        p[INDEX[name]] = stated[name]
    return FlightModel(p, np.zeros(2), stated.get(DRIFT_OF_RUN, 0.0), tuple(n for n in free if n not in stated), stated)


def fit(
    runs: Sequence[Run],
    model: FlightModel,
    *,
    rounds: int = 3,
    every_column: bool = True,
    noise: FlightNoise | None = None,
) -> FlightFit:
    """Gauss-Newton on the shared parameters ``model.free`` and the origin; flights fitted anew each round.

    ``noise`` of the frames: by default what no law of flight can touch, from the flights' own residuals.
    """
    names = [*model.free, *ORIGIN, *LENS_TERMS]
    places = run_places([run.data for run in runs])
    held = range(LAW, LAW + len(runs[0].data.law))
    frames = PLAIN if noise is None else noise
    evidence: list[Evidence] = []
    fits: list[FlightFits] = []
    for step in range(rounds + 1):
        last = step == rounds
        # Each round starts from the flights of the one before.
        fits = in_threads(
            fit_flights,
            [
                (run.data, run.flights, model.of_run(places[i]), model.shared(), fits[i] if fits else None)
                for i, run in enumerate(runs)
            ],
        )
        usual = _usual(fits)
        columns = sorted((*ALL, *held)) if last and every_column else columns_of([n for n in names if n in SHARED])
        if noise is None and step == 1:
            frames = noise_of(fits)
        evidence = in_threads(gather, [(f, columns, frames, usual) for f in fits])
        estimate, covariance, explained = solve_named(
            _with_drift(evidence, model, places), names, runs[0].data.contact_radius_m
        )
        if last:
            break
        model = moved(model, names, estimate)
    # What the nuisances (lens residual, origin) still explain is no misfit.
    misfit = sum(e.misfit for e in evidence) - explained
    return FlightFit(
        model,
        tuple(fits),
        tuple(_with_drift(evidence, model, places)),
        covariance,
        tuple(names),
        misfit,
        sum(e.count for e in evidence),
        frames,
    )


def _usual(fits: Sequence[FlightFits]) -> float:
    ratio = np.concatenate([f.misfit[f.freedom > 0] / f.freedom[f.freedom > 0] for f in fits]) if fits else np.ones(1)
    return float(np.median(ratio)) if len(ratio) else 1.0


def moved(model: FlightModel, names: Sequence[str], step: Array) -> FlightModel:
    """``model`` after a ``step`` (P,) in the columns ``names``; steps too long for a linearisation are shortened."""
    p, origin, drift = model.parameters.copy(), model.origin_m.copy(), model.drift_per_run
    for name, value in zip(names, step, strict=True):
        if name in INDEX:
            limit = 0.3 if name in ("friction", "load", "coupling") else np.inf
            p[INDEX[name]] += float(np.clip(value, -limit, limit))
        elif name in ORIGIN:
            origin[ORIGIN.index(name)] += float(np.clip(value, -2e-3, 2e-3))
        elif name == DRIFT_OF_RUN:
            drift += float(np.clip(value, -0.1, 0.1))
        # The lens residual is a nuisance: it is known too badly to correct positions with.
    p[INDEX["friction"]] = max(p[INDEX["friction"]], 0.0)
    return replace(model, parameters=p, origin_m=origin, drift_per_run=drift)


DRIFT_RUN = len(SHARED)


def _with_drift(evidence: Sequence[Evidence], model: FlightModel, places: Sequence[RunPlace]) -> list[Evidence]:
    """Evidence with one more column, friction changing from run to run: a multiple of the run's own friction column;
    and the drift within a run counted from its start.
    """
    out = []
    friction = model.parameters[INDEX["friction"]]
    for place, e in zip(places, evidence, strict=True):
        if INDEX["friction"] not in e.columns:
            out.append(e)
            continue
        at = e.columns.index(INDEX["friction"])
        turn = np.vstack([np.eye(len(e.columns)), np.zeros(len(e.columns))]).T
        turn[at, -1] = friction * place.number
        if INDEX["drift"] in e.columns:
            turn[at, e.columns.index(INDEX["drift"])] = friction * place.later_s
        out.append(
            Evidence(
                (*e.columns, DRIFT_RUN),
                turn.T @ e.information @ turn,
                turn.T @ e.score,
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
    return [DRIFT_RUN if n == DRIFT_OF_RUN else SHARED.index(n) for n in names]


def information_of(evidence: Evidence, names: Sequence[str]) -> Array | None:
    """A run's information about the named columns; None where it lacks one of them."""
    at = _indices(names)
    return evidence.take(at)[0] if set(at) <= set(evidence.columns) else None


def prior_of(names: Sequence[str], contact_radius_m: float) -> Array:
    """Prior weights (1/sd^2) of named columns: lens terms and origins are known beforehand, causes are not."""
    lens, origin = ((share * contact_radius_m) ** -2 for share in (LENS_SD_SHARE, ORIGIN_SD_SHARE))
    return np.array([lens if n.startswith("lens_") else (origin if n in ORIGIN else 0.0) for n in names])


def solve_named(
    evidence: Sequence[Evidence], names: Sequence[str], contact_radius_m: float
) -> tuple[Array, Array, float]:
    """:func:`analysis.flights.evidence.solve` for named columns."""
    return solve(evidence, _indices(names), prior_of(names, contact_radius_m))


def value_of(model: FlightModel, column: str) -> float:
    """Where a shared column stands in a model; 0 for the lens residual, which is never moved."""
    if column == DRIFT_OF_RUN:
        return model.drift_per_run
    if column in ORIGIN:
        return float(model.origin_m[ORIGIN.index(column)])
    return float(model.parameters[INDEX[column]]) if column in INDEX else 0.0


def gain_of(base: FlightFit, term: FlightTerm, units: Units) -> Gain:
    """What a term adds to the rest of a fit, whether the fit holds it or not; linearised there, each run held out.

    Without the term its columns stand at zero, or where ``[model]`` states them, not where the fit has moved them."""
    forms = base.forms
    columns = [c for c in term.columns if c in forms.names]
    # A column that no flight feels (drift of a friction that is nil) says nothing.
    columns = [c for c in columns if forms.total[forms.at([c])[0], forms.at([c])[0]] > 0]
    others = [c for c in base.columns if c not in term.columns]
    none = np.zeros(len(columns))
    if not columns:
        return Gain(term, 0.0, 0.0, none, np.full(len(term.columns), np.inf), 0.0, 0.0, 0.0)
    value = np.array([value_of(base.model, c) - base.model.stated.get(c, 0.0) for c in columns])
    with_term, without = forms.solved([*others, *columns]), forms.solved(others, columns, -value)
    estimate = value + with_term.step[len(others) :]
    sd = np.sqrt(np.diag(with_term.covariance))[len(others) :]
    per_run = without.held_out - with_term.held_out
    estimates = value + with_term.left_out[:, len(others) :]
    runs = len(per_run)
    if runs > 2:
        centred = estimates - estimates.mean(0)
        covariance = (runs - 1) / runs * centred.T @ centred + np.diag(0.25 * sd**2)
        significance = float(np.sqrt(max(float(estimate @ np.linalg.pinv(covariance, hermitian=True) @ estimate), 0.0)))
    else:
        # A column without sd has no information.
        significance = float(np.sqrt(np.nansum((estimate / np.where(sd > 0, sd, np.nan)) ** 2)))
    size = float(np.sqrt(np.sum((estimate * np.array([units.of(c) for c in columns])) ** 2)))
    return Gain(
        term,
        without.cost - with_term.cost,
        float(per_run.sum()),
        estimate,
        sd,
        significance,
        float(np.mean(per_run > 0)),
        size,
        per_run,
    )


def gains(base: FlightFit, terms: Sequence[FlightTerm], units: Units) -> list[Gain]:
    """Gains of the given effects or probes, largest first."""
    return sorted((gain_of(base, t, units) for t in terms), key=lambda g: -g.gain)
