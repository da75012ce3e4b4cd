"""Checks on the fit of a rig: flights predicted ahead, what no law explains, lens residual, noise, and the impacts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from analysis.checks.impacts import check_impacts
from analysis.checks.row import DIAGNOSE, Row, figure, row
from analysis.flights.cutting.pieces import Flight, seen_frames
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD, RunData
from analysis.flights.fit import FlightFits, fit_flights
from analysis.flights.noise import FlightNoise
from analysis.identification.fit import RigFit
from analysis.identification.floor.law import FORMS, SURE_FORCE
from analysis.identification.floor.priors import HELD_M
from ovines.recording import Recording

Array = NDArray[np.float64]

# Error (RMS) of flights' second halves over what noise and their first halves make likely: 0.76 to 1.2 on clean plants
# with ten flights and more, 1.5 at worst with four, 0.87 to 1.4 on 23 of 24 practice runs of one rig; 1.6 to 9 under
# nine wrong laws out of ten (least: a weak sticky patch, 1.4).  Each flight tells some four independent errors, so the
# RMS of n of them scatters by 1 / sqrt(8 n): three of these are allowed above AHEAD.
AHEAD, FEWEST_AHEAD, CLIP_SD, ERRORS_PER_FLIGHT, ALLOWED_SD = 1.2, 12, 10.0, 4, 3.0
# Probability of a force from which it counts although flights are predicted well ahead without it.
SURE_ALONE = 0.999
# A lens residual that the flights ask for, over the noise of a frame: none to 2.4 on 29 of 30 clean runs of plants (a
# third of them filmed through lenses that leave one), none to 3.2 on 24 practice runs of one rig, to 14 on a larger one
# at 40 frames a period; 4 to 22 where a sticky patch, gusts, a pull or a tilt bend the flights and are taken for it.
LENS_OVER_NOISE = 3.5
# What a wrong law of flight falsifies: floor friction, and with it the wall's, which rests on small differences of
# speeds along the wall (up to 14 sd off under a pull towards the wall); restitution was at most 3.3 sd off.
FLOWN = "wall_friction,floor_friction"
# Noise over the sds given: 0.83 to 1.21 on clean runs of plants, 0.66 to 1.13 on practice runs.
NOISE = (0.5, 1.5)


def check_fit(rig: RigFit, run: int, recording: Recording, farthest_m: float) -> list[Row | None]:
    """Rows on ``rig`` as ``run`` of it shows them; ``farthest_m``: how far past the stated wall the disk came (< 0:
    not to it).
    """
    return [
        ahead := _flights_ahead(rig.floor.fits[run], rig.floor.noise),
        _force(rig, ahead.state == "holds"),
        _lens(rig, run),
        _noise(rig),
        *check_impacts(rig, recording, farthest_m),
    ]


def _flights_ahead(fits: FlightFits, noise: FlightNoise) -> Row:
    value, flights = ahead_over_noise(fits, noise)
    name = "second half of a flight, predicted from its first, over noise"
    if not np.isfinite(value):
        return row(name, np.nan, AHEAD, None, "No flight is long enough to be predicted.")
    limit = AHEAD + ALLOWED_SD / np.sqrt(2 * ERRORS_PER_FLIGHT * flights)
    return row(
        name,
        value,
        limit,
        bool(value < limit),
        f"Flights end {value:.2g} times as far from where their first half says as noise makes likely.",
        FLOWN,
        f"The law of flight misses something. {DIAGNOSE}.",
    )


def ahead_over_noise(fits: FlightFits, noise: FlightNoise) -> tuple[float, int]:
    """RMS error of the second halves of flights, predicted from fits to their first halves, over what noise makes of
    it, and the number of flights; NaN without long ones."""
    plain = noise.without_force()
    squares: list[Array] = []
    for k, flight in enumerate(fits.flights):
        index = seen_frames(fits.run, flight)
        if len(index) < FEWEST_AHEAD:
            continue
        half = int(index[len(index) // 2 - 1])
        first = fit_flights(
            fits.run, [Flight(flight.first, half, False)], fits.parameters, fits.shared, _start(fits, k), plain
        )
        later = index[index > half]
        squares.append(_standard(first, later, fits.run, plain) ** 2)
    if not squares:
        return float("nan"), 0
    return float(np.sqrt(np.mean(np.minimum(np.concatenate([s.ravel() for s in squares]), CLIP_SD**2)))), len(squares)


def _start(fits: FlightFits, k: int) -> FlightFits:
    return replace(fits, states=fits.states[k : k + 1], _force_paths={})


def _standard(first: FlightFits, later: NDArray[np.int64], run: RunData, noise: FlightNoise) -> Array:
    """Errors (n, 2 or 3) of frames ``later`` against a flight's first half, over their sds."""
    _, spread = first.propagate(0, run.time_s[later])
    angle = run.angle_sd_rad[later] < NO_ANGLE_SD_RAD
    sd = np.column_stack([noise.scale * run.xy_sd_m[later]] * 2 + [noise.angle_scale * run.angle_sd_rad[later]])
    own = np.sqrt(np.diagonal(spread, axis1=1, axis2=2)[:, :3] + sd**2)
    error = first.residuals(0, later) / own
    return error if angle.all() else error[:, :2]


def _force(rig: RigFit, foreseen: bool) -> Row:
    """``foreseen``: flights are predicted well ahead without it.  A force of a known form that was fitted along is in
    no list of effects either: its numbers are right if its form is."""
    noise, radius_m = rig.floor.noise, rig.runs[0].data.radius_m
    size = max(noise.acceleration_m_per_s2, noise.spin_rad_per_s2 * radius_m)
    formed = [name for name, terms in FORMS.items() if set(terms) & set(rig.floor.names)]
    said = "None is seen."
    if noise.sure > SURE_FORCE:
        said = f"Something acts on the disk that nothing listed explains: {noise.force_in_words(radius_m).rstrip(',')}."
    elif formed:
        said = f"Something acts on the disk that no listed effect is: {' and '.join(formed)}, fitted along."
    return row(
        "force that no law describes",
        size,
        0.0,
        bool(noise.sure <= (SURE_ALONE if foreseen else SURE_FORCE)) and not formed,
        said,
        FLOWN,
        f"The law of flight misses something. {DIAGNOSE}.",
    )


def _lens(rig: RigFit, run: int) -> Row:
    """A missing force and a lens residual bend paths alike: only a calibration, or the Host's path, separates them."""
    lens_m = rig.floor.lens_sd_m if rig.floor.lens_sd_m > HELD_M else 0.0
    value = lens_m / float(np.median(rig.runs[run].data.xy_sd_m) * max(rig.floor.noise.scale, 1.0))
    return row(
        "lens residual that the flights ask for, over noise",
        value,
        LENS_OVER_NOISE,
        value < LENS_OVER_NOISE,
        f"The flights ask for a lens residual of {figure(value)} times the noise of a frame: the calibration leaves "
        f"one, or the law of flight misses something."
        if value >= LENS_OVER_NOISE
        else "No more than noise hides.",
        FLOWN,
        f"The law of flight misses something, or the calibration does. {DIAGNOSE}.",
    )


def _noise(rig: RigFit) -> Row:
    """Too large is judged by what is new in each frame, which few frames determine; too small by all of it."""
    noise = rig.floor.noise
    all_of_it = [noise.scale, *([noise.angle_scale] if rig.angle else [])]
    new = [value * np.sqrt(1 - noise.correlation**2) for value in all_of_it]
    value = max(new) if max(new) > NOISE[1] else min(all_of_it, key=lambda v: min(v, 1.0))
    holds = bool(max(new) <= NOISE[1] and min(all_of_it) >= NOISE[0])
    return row(
        "noise over the sds given",
        value,
        NOISE[1] if value > 1 else NOISE[0],
        holds,
        f"From frame to frame places scatter by {figure(value)} times their stated sds.",
        "",
        "Check sd_px of the tracks or the _sd_ columns of the motion; intervals here follow the scatter that is seen.",
    )
