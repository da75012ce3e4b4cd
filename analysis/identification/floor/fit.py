"""Floor and flights of the runs of one rig: what all flights share, fitted on all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import LENS_TERMS
from analysis.flights.cutting.runs import Run
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.evidence import (
    Evidence,
    RunRows,
    columns_of,
    linearised,
    weighed,
    without_own,
)
from analysis.flights.fit import ORIGIN, SHARED, FlightFits, fit_flights
from analysis.flights.noise import PLAIN, FlightNoise
from analysis.identification.floor.errors import (
    disagreement,
    errors_of,
    lift_sd,
    noise_of,
    shapes_of_force,
    without_gross,
)
from analysis.identification.floor.priors import HELD_M, LENS_SD_M, prior_of
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# Vertical acceleration of the floor in step with the drive, over gravity: each run has its own.
LIFT = ("friction_cos", "friction_sin")
START_FRICTION = 0.25
# Rounds until the shared parameters rest (a step within this share of their sds): with the stated noise, then with that
# found.
FIRST_ROUNDS, ROUNDS, RESTS_SD = 3, 5, 0.05
# An unknown force is found where the first fit stands, which a wrong law leads astray: it is found again until it rests
# (logarithm), so often at most.
MOST_STAGES, FORCE_RESTS = 4, 0.2


@dataclass(frozen=True, eq=False)
class FloorFit:
    """Flights fitted with the best shared parameters: ``names`` of those estimated, ``estimate`` and ``covariance`` of
    them;
    ``noise`` of the frames and what no law explains, ``coupling`` of sliding and spinning friction, ``lens_sd_m`` prior
    of the lens residual's terms (none where the flights show none), ``per_run`` relative change of friction per run
    about the middle one with its sd, where it was fitted."""

    fits: tuple[FlightFits, ...]
    evidence: tuple[Evidence, ...]
    names: tuple[str, ...]
    estimate: Array
    covariance: Array
    noise: FlightNoise
    coupling: float
    lens_sd_m: float
    per_run: tuple[float, float] | None = None


@dataclass(frozen=True, eq=False)
class _Standing:
    """Where a fit of the floor stands: its ``runs``, ``parameters`` of the flight model, ``shared`` offsets, and the
    flights as they were fitted last, with these or with those of the step before."""

    runs: Sequence[Run]
    parameters: Array
    shared: Array
    fits: list[FlightFits]

    def fitted(self, noise: FlightNoise) -> _Standing:
        """With the flights fitted anew, from where they were."""
        fits = in_threads(
            fit_flights,
            [
                (run.data, run.flights, self.parameters, self.shared, self.fits[k] if self.fits else None, noise)
                for k, run in enumerate(self.runs)
            ],
        )
        return replace(self, fits=fits)

    def moved(self, names: Sequence[str], columns: Sequence[int], step: Array) -> _Standing:
        """By a ``step`` of the shared ``columns``, of which ``names`` are parameters."""
        parameters = self.parameters.copy()
        for name in names:
            parameters[INDEX[name]] += step[columns.index(SHARED.index(name))]
        parameters[INDEX["friction"]] = max(parameters[INDEX["friction"]], 0.0)
        offsets = [columns.index(SHARED.index(n)) for n in (*ORIGIN, *LENS_TERMS)]
        return replace(self, parameters=parameters, shared=self.shared + step[offsets])


@dataclass(frozen=True, eq=False)
class FirstLook:
    """A fit of the floor in which frames count as independent, with the noise stated, and no force is sought: where it
    stands, and the rows of its last round."""

    stands: _Standing
    rows: Sequence[RunRows]

    @property
    def fits(self) -> tuple[FlightFits, ...]:
        """The flights of each run."""
        return tuple(self.stands.fits)

    @property
    def origin_m(self) -> Array:
        """The markers' origin (2,) from the mass centre, in the disk's frame."""
        return self.stands.shared[:2]


def first_look(
    runs: Sequence[Run], names: Sequence[str], held: Mapping[str, float], start: FloorFit | None = None
) -> FirstLook:
    """The first part of :func:`fit_floor`, which may go on from it."""
    noise = PLAIN if start is None else start.noise.without_force()
    columns = columns_of([*names, *ORIGIN, *LENS_TERMS])
    return FirstLook(*_at_rest(_started(runs, names, held, start), names, columns, noise, LENS_SD_M, FIRST_ROUNDS))


def fit_floor(
    runs: Sequence[Run],
    names: Sequence[str],
    held: Mapping[str, float],
    start: FloorFit | None = None,
    look: FirstLook | None = None,
) -> FloorFit:
    """Shared parameters ``names`` of the flight model on all flights of all runs, relinearised until they rest; those
    ``held`` stay where they are.

    First as if frames were independent, which tells how they are not; then weighed by that.  ``start``: a fit with
    fewer of them, from which to go on; ``look``: the first part, where it is known."""
    columns = columns_of([*names, *ORIGIN, *LENS_TERMS])
    look = look or first_look(runs, names, held, start)
    stands, noise, lens_sd = _first_errors(look.stands, look.rows, columns)
    return _weighed(stands, names, columns, noise, lens_sd)


def fit_floor_again(runs: Sequence[Run], before: FloorFit, held: Mapping[str, float]) -> FloorFit:
    """:func:`fit_floor` of what ``before`` has estimated from the same flights, under laws of the ``runs`` that are
    nearly the same: from where it ended and with its noise and force, which are found anew until they rest.

    ``held``: the parameters where they begin."""
    # Frames that are gross beside one law are so beside the other.
    runs = [replace(run, data=replace(fit.run, law=run.data.law)) for run, fit in zip(runs, before.fits, strict=True)]
    fits = [replace(fit, run=run.data, _force_paths={}) for run, fit in zip(runs, before.fits, strict=True)]
    parameters, names = before.fits[0].parameters.copy(), before.names
    for term, value in held.items():
        parameters[INDEX[term]] = value
    stands = _Standing(runs, parameters, before.fits[0].shared.copy(), fits)
    return _weighed(stands, names, columns_of([*names, *ORIGIN, *LENS_TERMS]), before.noise, before.lens_sd_m)


def _weighed(
    stands: _Standing, names: Sequence[str], columns: list[int], noise: FlightNoise, lens_sd: float
) -> FloorFit:
    """The fit at rest, weighed by the noise and the force that it leaves itself."""
    for stage in range(1, 1 + MOST_STAGES):
        if lens_sd == HELD_M:
            stands = replace(stands, shared=np.concatenate([stands.shared[:2], np.zeros(len(LENS_TERMS))]))
        stands, rows = _at_rest(stands, names, columns, noise, lens_sd, ROUNDS)
        if not noise.forced or stage == MOST_STAGES:
            break
        # Noise is estimated on fits without a force, which would follow it.
        before, (noise, lens_sd) = noise, errors_of(stands.fits, rows, noise.without_force())
        if _force_rests(before, noise):
            break
    if stands.fits[0].parameters is not stands.parameters:
        stands = stands.fitted(noise)
    return _estimated(stands, names, columns, noise, lens_sd)


def _started(runs: Sequence[Run], names: Sequence[str], held: Mapping[str, float], start: FloorFit | None) -> _Standing:
    """Where the fit of ``names`` begins: without any, or where ``start`` ended."""
    if start is None:
        parameters, shared, fits = np.zeros(len(PARAMETERS)), np.zeros(2 + len(LENS_TERMS)), []
        for term, value in held.items():
            parameters[INDEX[term]] = value
        if "friction" in names:
            parameters[INDEX["friction"]] = START_FRICTION
    else:
        parameters, shared = start.fits[0].parameters.copy(), start.fits[0].shared.copy()
        fits = [replace(fit, run=run.data, gross=frozenset()) for run, fit in zip(runs, start.fits, strict=True)]
    return _Standing(runs, parameters, shared, fits)


def _at_rest(
    stands: _Standing, names: Sequence[str], columns: list[int], noise: FlightNoise, lens_sd: float, rounds: int
) -> tuple[_Standing, list[RunRows]]:
    """Where the shared parameters rest, or stand after so many ``rounds``; and the rows of the last one."""
    rows: list[RunRows] = []
    for _ in range(rounds):
        stands = stands.fitted(noise)
        rows = in_threads(linearised, [(fit, columns) for fit in stands.fits])
        evidence = in_threads(weighed, [(one, noise) for one in rows])
        prior, pull = prior_of(columns, stands.shared, lens_sd)
        step, covariance = _step(evidence, columns, prior, pull)
        if np.all(np.abs(step) <= RESTS_SD * np.sqrt(np.diag(covariance))):
            break
        stands = stands.moved(names, columns, step)
    return stands, rows


def _first_errors(
    stands: _Standing, rows: Sequence[RunRows], columns: Sequence[int]
) -> tuple[_Standing, FlightNoise, float]:
    """Noise and size of the lens residual as the fit with the stated noise shows them; where there is a force, without
    what is gross."""
    frames = noise_of(stands.fits)
    noise, lens_sd = errors_of(stands.fits, rows, frames, coarse=True)
    if not noise.forced:
        return stands, noise, lens_sd
    fits = without_gross(stands.fits, frames)
    runs = [replace(run, data=fit.run) for run, fit in zip(stands.runs, fits, strict=True)]
    noise, lens_sd = errors_of(fits, in_threads(linearised, [(fit, columns) for fit in fits]), frames)
    return replace(stands, runs=runs, fits=fits), noise, lens_sd


def _force_rests(before: FlightNoise, noise: FlightNoise) -> bool:
    """Whether the unknown force is about as large as before."""
    sizes = [max(one.acceleration_m_per_s2, HELD_M) for one in (noise, before)]
    return bool(abs(np.log(sizes[0] / sizes[1])) < FORCE_RESTS)


def _estimated(
    stands: _Standing, names: Sequence[str], columns_kept: Sequence[int], noise: FlightNoise, lens_sd: float
) -> FloorFit:
    """The fit where it ``stands``, its evidence in ``columns_kept``; ``names`` with their covariance, whatever the
    force has of any shape."""
    fits = stands.fits
    shapes = shapes_of_force(fits, names, noise)
    columns = columns_of([*names, *shapes, *ORIGIN, *LENS_TERMS])
    at = [columns.index(SHARED.index(n)) for n in names]
    open_evidence = in_threads(_whatever_the_lift, [(fit, columns, noise) for fit in fits])
    evidence = [one.only(columns_kept) for one in open_evidence] if shapes else open_evidence
    prior, pull = prior_of(columns, stands.shared, lens_sd)
    for name, sd in shapes.items():
        prior[columns.index(INDEX[name])] = sd**-2.0
    step, covariance = _step(open_evidence, columns, prior, pull)
    estimate = np.array([stands.parameters[INDEX[n]] for n in names]) + step[at]
    wider = disagreement(open_evidence, step, covariance)[at]
    return FloorFit(
        tuple(fits),
        tuple(evidence),
        tuple(names),
        estimate,
        covariance[np.ix_(at, at)] * np.outer(wider, wider),
        noise,
        float(stands.parameters[INDEX["coupling"]]),
        lens_sd,
    )


def _whatever_the_lift(fits: FlightFits, columns: Sequence[int], noise: FlightNoise) -> Evidence:
    """Evidence of one run in the shared ``columns``, whatever vertical motion of the floor its Host's path leaves open.

    A floor that rises with the drive is lighter whenever the Host moves one way: a disk that slides to and fro sees a
    mean force along the drive, as a tilt would be."""
    sd = lift_sd(fits.run.host, with_z=fits.parameters[INDEX["load"]] == 0.0)
    if fits.parameters[INDEX["friction"]] == 0.0 or sd == 0.0:
        return weighed(linearised(fits, columns), noise)
    seen = linearised(fits, columns_of([SHARED[c] for c in columns] + [*LIFT]))
    return without_own(weighed(seen, noise), columns_of(LIFT), np.full(len(LIFT), sd**-2.0))


def _step(evidence: Sequence[Evidence], columns: Sequence[int], prior: Array, pull: Array) -> tuple[Array, Array]:
    """Step of the shared unknowns and their covariance; the prior draws offsets to zero, not to where they stand."""
    information, score = np.diag(prior), pull.copy()
    for e in evidence:
        a, b = e.take(columns)
        information, score = information + a, score + b
    # Unit diagonal first: friction, metres and rates differ by ten orders of magnitude.
    size = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(size, size)) / np.outer(size, size)
    return covariance @ score, covariance
