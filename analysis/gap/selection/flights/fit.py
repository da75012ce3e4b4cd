"""The flights' model fitted: evidence of all runs, solved whole and with each run held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import GIVEN, INDEX, LAW, LAW_TERMS
from analysis.flights.evidence import Evidence, columns_of, gather, solve
from analysis.flights.fit import ORIGIN, SHARED, FlightFits, fit_flights
from analysis.flights.noise import PLAIN, FlightNoise
from analysis.flights.stated_terms import DRIFT_OF_RUN
from analysis.gap.selection.flights.model import FlightModel, RunPlace, moved, run_places, too_long
from analysis.identification.floor.errors import noise_of
from analysis.statistics.robust import covariance_of
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# Prior sds over the contact radius: of the lens residual's polynomials (0.03 mm of 40 mm: what a good calibration
# leaves: 0.05 mm at most), and of the markers' origin.
LENS_SD_SHARE, ORIGIN_SD_SHARE = 7.5e-4, 0.025
# Terms of a written law are columns where a run holds one.
ALL = tuple(i for i, name in enumerate(SHARED) if name not in (*LAW_TERMS, *GIVEN))
DRIFT_RUN = len(SHARED)
# Shortened steps at the most: a load of the floor that nobody stated goes from 0 to 1.
MOST_SHORTENED = 4


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
    to_go, shortened = rounds, 0
    for step in range(rounds + MOST_SHORTENED + 1):
        last = to_go == 0
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
        # A shortened step has not arrived: it takes none of the rounds.
        more = too_long(names, estimate) and shortened < MOST_SHORTENED
        shortened, to_go = (shortened + 1, to_go) if more else (shortened, to_go - 1)
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
            turn[at, e.columns.index(INDEX["drift"])] = model.friction_per_drift(place)
        out.append(
            Evidence(
                (*e.columns, DRIFT_RUN),
                turn.T @ e.information @ turn,
                turn.T @ e.score,
                e.misfit,
                e.count,
                e.flights,
                e.left_out,
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
