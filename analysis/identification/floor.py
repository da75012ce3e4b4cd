"""Floor and flights of the runs of one rig: what all flights share, fitted on all of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.along_flights import unit_accelerations
from analysis.flights.cutting.run_data import LENS_TERMS, NO_ANGLE_SD_RAD, RunData
from analysis.flights.evidence import (
    Evidence,
    RunRows,
    columns_of,
    linearised,
    usable_flights,
    weighed,
    without_own,
)
from analysis.flights.fit import ORIGIN, SHARED, FlightFits, fit_flights
from analysis.flights.model import GRAVITY_M_PER_S2
from analysis.flights.noise import GROSS_SD, PLAIN, FlightNoise, at_least, frame_noise
from analysis.flights.parameters import INDEX, PARAMETERS
from analysis.flights.runs import FINEST_SD_M, Run
from analysis.flights.unknown_force import (
    beside_neighbours,
    best_model,
    force_evidence,
    gross_flights,
    refined,
    tried_forces,
)
from analysis.identification.floor_priors import HELD_M, LENS_SD_M, LENS_SDS_M, lens_priors, prior_of
from analysis.motion.host_path import HostMotion
from analysis.motion.rig_frame import CONTACT_RADIUS_M
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# A slope of heights against places that no calibration leaves more of.
LENS_SLOPE = LENS_SDS_M[-1] / CONTACT_RADIUS_M
# Vertical acceleration of the floor in step with the drive, over gravity: each run has its own.
LIFT = ("friction_cos", "friction_sin")
START_FRICTION = 0.25
# Rounds until the shared parameters rest (a step within this share of their sds): with the stated noise, then with that
# found.
FIRST_ROUNDS, ROUNDS, RESTS_SD = 3, 5, 0.05
# An unknown force is found where the first fit stands, which a wrong law leads astray: it is found again until it rests
# (logarithm), so often at most.
MOST_STAGES, FORCE_RESTS = 4, 0.2
# Fewer runs, or flights, do not show how much they scatter.
FEWEST_RUNS, FEWEST_FLIGHTS = 5, 10
# Shapes that a force outside the law may have in every flight alike: drags, pulls, floors that are not the same
# everywhere or at every speed, what acts on the spin.
TORQUES = ("spin_decay", "spin_drive")
SHAPES = (
    *("viscous", "air", "host_drag", "magnus", *TORQUES, "centre_host", "radial_cubic", "wall_pull"),
    *("tilt_x", "tilt_y", "friction_radius", "friction_speed", "friction_since"),
)


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


def fit_floor(
    runs: Sequence[Run], names: Sequence[str], held: Mapping[str, float], start: FloorFit | None = None
) -> FloorFit:
    """Shared parameters ``names`` of the flight model on all flights of all runs, relinearised until they rest; those
    ``held`` stay where they are.

    First as if frames were independent, which tells how they are not; then weighed by that.  ``start``: a fit with
    fewer of them, from which to go on."""
    columns = columns_of([*names, *ORIGIN, *LENS_TERMS])
    stands = _started(runs, names, held, start)
    noise, lens_sd = PLAIN if start is None else start.noise.without_force(), LENS_SD_M
    for stage in range(1 + MOST_STAGES):
        rounds = FIRST_ROUNDS if stage == 0 else ROUNDS
        stands, rows = _at_rest(stands, names, columns, noise, lens_sd, rounds)
        if stage == 0:
            stands, noise, lens_sd = _first_errors(stands, rows, columns)
        elif noise.forced and stage < MOST_STAGES:
            # Noise is estimated on fits without a force, which would follow it.
            before, (noise, lens_sd) = noise, _errors(stands.fits, rows, noise.without_force())
            if _force_rests(before, noise):
                break
        else:
            break
        if lens_sd == HELD_M:
            stands = replace(stands, shared=np.concatenate([stands.shared[:2], np.zeros(len(LENS_TERMS))]))
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
    noise, lens_sd = _errors(stands.fits, rows, frames)
    if not noise.forced:
        return stands, noise, lens_sd
    fits = _without_gross(stands.fits, frames)
    runs = [replace(run, data=fit.run) for run, fit in zip(stands.runs, fits, strict=True)]
    noise, lens_sd = _errors(fits, in_threads(linearised, [(fit, columns) for fit in fits]), frames)
    return replace(stands, runs=runs, fits=fits), noise, lens_sd


def _force_rests(before: FlightNoise, noise: FlightNoise) -> bool:
    """Whether the unknown force is about as large as before."""
    sizes = [max(one.acceleration_m_per_s2, HELD_M) for one in (noise, before)]
    return bool(abs(np.log(sizes[0] / sizes[1])) < FORCE_RESTS)


def _estimated(
    stands: _Standing, names: Sequence[str], told: Sequence[int], noise: FlightNoise, lens_sd: float
) -> FloorFit:
    """The fit where it ``stands``, its evidence in the columns ``told``; ``names`` with their covariance, whatever the
    force has of any shape."""
    fits = stands.fits
    shapes = _shapes(fits, names, noise)
    columns = columns_of([*names, *shapes, *ORIGIN, *LENS_TERMS])
    at = [columns.index(SHARED.index(n)) for n in names]
    open_evidence = in_threads(_whatever_the_lift, [(fit, columns, noise) for fit in fits])
    evidence = [one.only(told) for one in open_evidence] if shapes else open_evidence
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


def _shapes(fits: Sequence[FlightFits], names: Sequence[str], noise: FlightNoise) -> dict[str, float]:
    """Prior sds of the :data:`SHAPES` that a force which no law explains may have in every flight alike, besides the
    terms ``names``: together as strong as the force; none without one.

    What pulls the same way in every flight is no noise that many flights average out."""
    if not noise.acceleration_m_per_s2 > 0.0:
        return {}
    unit, _ = unit_accelerations(fits)
    held = fits[0].parameters
    felt = [n for n in SHAPES if n not in names and held[INDEX[n]] == 0.0 and unit[n] > 0.0]
    rim_m = fits[0].run.radius_m * fits[0].run.inertia_factor
    force = noise.acceleration_m_per_s2 / np.sqrt(len(felt))
    torque = rim_m * noise.spin_rad_per_s2 / np.sqrt(len(TORQUES))  # as the force at the rim that makes it
    return {n: float((max(force, torque) if n in TORQUES else force) / unit[n]) for n in felt}


def lift_sd(host: HostMotion, with_z: bool) -> float:
    """What is not known of the floor's vertical acceleration in step with the drive: each of its cosine and sine over
    gravity.

    The path's error in height - noise, and the slope of what a calibration leaves, which makes the drive itself look
    like one - and, ``with_z``, the vertical motion that was measured and is no part of the law."""
    if host.omega_rad_per_s == 0.0:
        return 0.0
    x, y, z = host.harmonics[:3, 1:3]
    frames = max(int(np.isfinite(host.residual[:, 2]).sum()), 1)
    noise_m = float(np.nan_to_num(host.residual_sd[2])) * np.sqrt(2 / frames)
    slope_m = LENS_SLOPE * float(np.sqrt(np.sum(x**2) + np.sum(y**2)))
    square = noise_m**2 + slope_m**2 + (float(z @ z) if with_z else 0.0)
    return host.omega_rad_per_s**2 * float(np.sqrt(square)) / GRAVITY_M_PER_S2


def noise_of(fits: Sequence[FlightFits]) -> FlightNoise:
    """Noise of the frames from what no law of flight can touch; the stated one without a flight."""
    if not any(fit.flights for fit in fits):
        return PLAIN
    first = fits[0].run
    angle = any(np.any(fit.run.angle_sd_rad < NO_ANGLE_SD_RAD) for fit in fits)
    noise = frame_noise(
        [fit.standard_residuals(k) for fit in fits for k in range(len(fit.flights)) if not fit.rests(k)],
        first.period_s / first.own_units[1],
        angle,
    )
    sds = np.concatenate([fit.run.xy_sd_m for fit in fits]), np.concatenate([fit.run.angle_sd_rad for fit in fits])
    return at_least(
        noise, FINEST_SD_M / float(np.median(sds[0])), FINEST_SD_M / first.radius_m / float(np.median(sds[1]))
    )


def _without_gross(fits: Sequence[FlightFits], noise: FlightNoise) -> list[FlightFits]:
    """``fits`` (without a force) in which a gross frame has a wider sd and gross flights are marked: before a force is
    sought that bends every flight, which would follow a single wrong frame, or an impact within a flight."""
    fits = [replace(fit, run=_wider_at_gross_frames(fit, noise), _force_paths={}) for fit in fits]
    rows = in_threads(linearised, [(fit, ()) for fit in fits])
    frames = np.array([len(flight.index) for row in rows for flight in row.flights])
    gross = gross_flights(force_evidence(rows, tried_forces(rows, noise, fits[0].run.radius_m)), frames)
    ends = np.cumsum([len(row.flights) for row in rows])[:-1]
    marked = []
    for fit, out in zip(fits, np.split(gross, ends), strict=True):
        good = usable_flights(fit)
        good[np.flatnonzero(good)[out]] = False
        # Those too that misfit far more than the others: any path fits under a force that is strong enough.
        marked.append(replace(fit, gross=frozenset(np.flatnonzero(~good).tolist())))
    return marked


def _wider_at_gross_frames(fits: FlightFits, noise: FlightNoise) -> RunData:
    """The run with sds of its frames that grow with the square of what a frame stands out of its neighbours by."""
    run, scales = fits.run, np.array([noise.scale, noise.scale, noise.angle_scale])
    wider = np.ones((len(run.time_s), 3))
    for k in range(len(fits.flights)):
        standard = fits.standard_residuals(k)
        wider[standard.index] = np.maximum(1.0, (beside_neighbours(standard.residual / scales) / GROSS_SD) ** 2)
    return replace(
        run,
        xy_sd_m=run.xy_sd_m * np.max(wider[:, :2], axis=1),
        angle_sd_rad=run.angle_sd_rad * wider[:, 2],
    )


def _errors(fits: Sequence[FlightFits], rows: Sequence[RunRows], noise: FlightNoise) -> tuple[FlightNoise, float]:
    """``noise`` with what the flights leave beyond it as an unknown force, and the size of the lens residual's terms:
    found together, for either may pass for the other."""
    first = fits[0].run
    if not any(row.flights for row in rows):
        return noise, HELD_M
    columns = rows[0].columns
    priors = lens_priors(columns, columns, fits[0].shared)
    best, number, cost = best_model(force_evidence(rows, tried_forces(rows, noise, first.radius_m)), priors)
    return refined(rows, best, cost, priors[number])[0], LENS_SDS_M[number]


def disagreement(evidence: Sequence[Evidence], step: Array, covariance: Array) -> Array:
    """Factor (P,) >= 1 on the sds by which flights, and runs, disagree more than their noise lets them.

    Flights of a run share nothing but the law; runs are independent whatever goes on within one.  The sum of their
    scores' squares is the sandwich estimator clustered by either (Liang and Zeger 1986); the larger counts.  1 with
    fewer than :data:`FEWEST_FLIGHTS` or :data:`FEWEST_RUNS`."""
    informed = [e for e in evidence if e.count > 0]
    clusters = [
        ([part for e in informed for part in e.parts], FEWEST_FLIGHTS),
        ([(e.information, e.score) for e in informed], FEWEST_RUNS),
    ]
    factor = np.ones(len(step))
    for parts, fewest in clusters:
        if len(parts) >= fewest:
            scores = np.array([score - information @ step for information, score in parts])
            factor = np.maximum(factor, sandwich_factor(scores, covariance))
    return factor


def sandwich_factor(scores: Array, covariance: Array) -> Array:
    """Factor (P,) on the sds of ``covariance`` (P, P) by which independent clusters' ``scores`` (C, P) scatter."""
    spread = np.sum((scores @ covariance) ** 2, 0) * len(scores) / (len(scores) - 1)
    return np.asarray(np.sqrt(spread / np.diag(covariance)), float)


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
