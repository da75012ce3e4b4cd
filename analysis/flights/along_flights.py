"""Along fitted flights: what written laws may know there (the vectors of :mod:`ovines.core.laws.words`), and how
strongly each term of the flight model pushes the disk.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from analysis.compiled import making_arrays
from analysis.flights.cutting.flight_rig import FlightRig
from analysis.flights.cutting.impact_before import impact_before
from analysis.flights.cutting.pieces import seen_frames
from analysis.flights.cutting.run_data import NO_ANGLE_SD_RAD
from analysis.flights.equation import parameters as P
from analysis.flights.equation.law_slopes import law_work
from analysis.flights.equation.model import ANGLE, STATES, VX, VY, accelerated, known_of, workspace
from analysis.flights.equation.parameters import INDEX, PARAMETERS
from analysis.flights.equation.slopes import acceleration_slopes
from analysis.flights.fit import FlightFits, with_contacts_before, with_impact_before
from analysis.flights.noise import CLIP_SD
from analysis.motion.host_table import host_at
from ovines.core.laws import words as W
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Of the polynomial that leads a path to its frames, and how many frames each of its degrees needs.
MOST_DEGREES, FRAMES_PER_DEGREE = 6, 6
# Every so many frames of a flight are enough for a root mean square.
STRIDE = 4


def _missed(fits: FlightFits, k: int, times: Array) -> Array:
    """What the fitted path misses (N, 6) as polynomials through the frames' residuals.

    A law is asked where the disk was, not where a model without it takes the disk: beside a wall that differs."""
    index = seen_frames(fits.run, fits.flights[k])
    residual, run = fits.residuals(k, index), fits.run
    degree = min(MOST_DEGREES, len(index) // FRAMES_PER_DEGREE)
    out = np.zeros((len(times), STATES))
    if degree < 2:
        return out
    first, span = run.time_s[index[0]], max(run.time_s[index[-1]] - run.time_s[index[0]], 1e-12)
    # Of degree two and more: what a start state could have taken up is not missed.
    inside, asked = 2 * (run.time_s[index] - first) / span - 1, 2 * (times - first) / span - 1
    for m in range(3):
        sd = run.angle_sd_rad[index] if m == ANGLE else run.xy_sd_m[index]
        if not np.median(sd) < NO_ANGLE_SD_RAD:
            continue
        limit = CLIP_SD * residual_sd(residual[:, m])
        path = Legendre.fit(inside, np.clip(residual[:, m], -limit, limit), degree, domain=[-1, 1])
        out[:, m], out[:, m + 3] = path(asked), path.deriv()(asked) * 2 / span
    return out


@making_arrays
def _fill(times: Array, states: Array, p: Array, without: Array, rig: FlightRig, known: Array, damping: Array) -> None:
    work, slopes, none = law_work(), np.empty((3, STATES)), np.empty((0, len(p)))
    room = workspace()
    for i in range(len(times)):
        known_of(times[i], states[i], p, rig, known[i])
        rubbed = acceleration_slopes(times[i], states[i], p, rig, work, slopes, none)
        free = accelerated(times[i], states[i], without, rig, room)
        known[i, W.FX], known[i, W.FY], known[i, W.FT] = rubbed.x - free.x, rubbed.y - free.y, rubbed.spin - free.spin
        damping[i] = slopes[:, 3:]


def known_states(fits: FlightFits, k: int, times: Array) -> tuple[Array, Array]:
    """What laws know (N, KNOWN_SIZE), and how the acceleration answers velocity and spin (N, 3, 3; 1/s), along the
    path that flight ``k`` really took, at sorted ``times``: the fitted one, led to the frames where it misses them
    smoothly."""
    times = np.ascontiguousarray(times)
    states = fits.flown(k, times, derivatives=False)[0] + _missed(fits, k, times)
    p = with_impact_before(fits.parameters, fits.run, fits.flights, k)
    p = with_contacts_before(p, fits.run, fits.flights, k)
    without, known, damping = p.copy(), np.zeros((len(times), W.KNOWN_SIZE)), np.zeros((len(times), 3, 3))
    without[P.FRICTION] = 0.0
    _fill(times, states, p, without, fits.run.flight_rig._replace(way=fits.run.way), known, damping)
    return known, damping


def unit_accelerations(fits: Sequence[FlightFits]) -> tuple[dict[str, float], float]:
    """RMS acceleration (m/s^2) that a unit of each parameter adds along the fitted flights, and the disk's RMS speed
    against the Host (m/s).

    A torque counts as the force at the rim that would make it."""
    total, speed, count = np.zeros(len(PARAMETERS)), 0.0, 0
    for fit in fits:
        p = fit.parameters.copy()
        for k, flight in enumerate(fit.flights):
            p[INDEX["impact_before_s"]] = impact_before(fit.run, fit.flights, k)
            times = fit.run.time_s[flight.first : flight.last + 1 : STRIDE]
            states, _ = fit.flown(k, np.ascontiguousarray(times), derivatives=False)
            speed += _add(times, states, p, fit.run.flight_rig, total)
            count += len(times)
    root = np.sqrt(total / max(count, 1))
    return {name: float(root[i]) for name, i in INDEX.items()}, float(np.sqrt(speed / max(count, 1)))


@making_arrays
def _add(times: Array, states: Array, p: Array, rig: FlightRig, total: Array) -> float:
    """Adds to ``total`` (P,) the squares at each of ``times`` (N,) and ``states`` (N, 6); returns those of the speed
    against the Host."""
    rim = rig.radius_m * rig.inertia_factor
    speed, work, slopes, every = 0.0, law_work(), np.empty((3, STATES)), np.empty((3, len(p)))
    for i in range(len(times)):
        acceleration_slopes(times[i], states[i], p, rig, work, slopes, every)
        host = host_at(times[i], rig.host)
        speed += (states[i, VX] - host.vx) ** 2 + (states[i, VY] - host.vy) ** 2
        for j in range(len(p)):
            total[j] += every[0, j] ** 2 + every[1, j] ** 2 + (rim * every[2, j]) ** 2
    return speed
