"""What flights and the floor's parameters are off by: noise, gross frames, an unknown force, runs that disagree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.flights.along_flights import unit_accelerations
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.cutting.runs import FINEST_SD_M
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.flights.equation.parameters import INDEX
from analysis.flights.evidence import Evidence, RunRows, linearised, usable_flights
from analysis.flights.fit import FlightFits
from analysis.flights.noise import GROSS_SD, PLAIN, FlightNoise, at_least, frame_noise
from analysis.flights.unknown_force import (
    beside_neighbours,
    best_model,
    force_evidence,
    gross_flights,
    refined,
    tried_forces,
)
from analysis.identification.floor.priors import HELD_M, LENS_SDS_M, lens_priors
from analysis.motion.host_path import HostMotion
from analysis.motion.rig_frame import CONTACT_RADIUS_M
from ovines.workers.threads import in_threads

Array = NDArray[np.float64]

# A slope of heights against places that no calibration leaves more of.
LENS_SLOPE = LENS_SDS_M[-1] / CONTACT_RADIUS_M
# Fewer runs, or flights, do not show how much they scatter.
FEWEST_RUNS, FEWEST_FLIGHTS = 5, 10
# Shapes that a force outside the law may have in every flight alike: drags, pulls, floors that are not the same
# everywhere or at every speed, what acts on the spin.
TORQUES = ("spin_decay", "spin_drive")
SHAPES = (
    *("viscous", "air", "host_drag", "magnus", *TORQUES, "centre_host", "radial_cubic", "wall_pull"),
    *("tilt_x", "tilt_y", "friction_radius", "friction_speed", "friction_since"),
)


def shapes_of_force(fits: Sequence[FlightFits], names: Sequence[str], noise: FlightNoise) -> dict[str, float]:
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


def without_gross(fits: Sequence[FlightFits], noise: FlightNoise) -> list[FlightFits]:
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


def errors_of(
    fits: Sequence[FlightFits], rows: Sequence[RunRows], noise: FlightNoise, coarse: bool = False
) -> tuple[FlightNoise, float]:
    """``noise`` with what the flights leave beyond it as an unknown force, and the size of the lens residual's terms:
    found together, for either may pass for the other.  ``coarse``: the force as far as to say whether there is one."""
    first = fits[0].run
    if not any(row.flights for row in rows):
        return noise, HELD_M
    columns = rows[0].columns
    priors = lens_priors(columns, columns, fits[0].shared)
    best, number, cost = best_model(force_evidence(rows, tried_forces(rows, noise, first.radius_m)), priors)
    return best if coarse else refined(rows, best, cost, priors[number])[0], LENS_SDS_M[number]


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
