"""What written laws may know along a fitted flight: the vectors of :mod:`ovines.core.laws.words`."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Legendre
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flights import parameters as P
from analysis.flights.fit import NO_ANGLE_SD_RAD, FlightFits, seen_frames, with_impact_before
from analysis.flights.model import ANGLE, STATES, FlightRig, acceleration, known_of, start_step
from analysis.flights.noise import CLIP_SD
from ovines.core.laws import words as W

Array = NDArray[np.float64]
# Of the polynomial that leads a path to its frames, and how many frames each of its degrees needs.
MOST_DEGREES, FRAMES_PER_DEGREE = 6, 6


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
        limit = CLIP_SD * np.median(np.abs(residual[:, m])) / 0.6745
        path = Legendre.fit(inside, np.clip(residual[:, m], -limit, limit), degree, domain=[-1, 1])
        out[:, m], out[:, m + 3] = path(asked), path.deriv()(asked) * 2 / span
    return out


@compiled
def _fill(times: Array, states: Array, p: Array, without: Array, rig: FlightRig, known: Array, damping: Array) -> None:
    moved = np.empty(STATES)
    for i in range(len(times)):
        known_of(times[i], states[i], p, rig, known[i])
        rubbed = acceleration(times[i], states[i], p, rig)
        free = acceleration(times[i], states[i], without, rig)
        known[i, W.FX], known[i, W.FY], known[i, W.FT] = rubbed.x - free.x, rubbed.y - free.y, rubbed.spin - free.spin
        for j in range(3):
            step = start_step(3 + j)
            for m in range(STATES):
                moved[m] = states[i, m]
            moved[3 + j] += step
            one = acceleration(times[i], moved, p, rig)
            damping[i, 0, j] = (one.x - rubbed.x) / step
            damping[i, 1, j] = (one.y - rubbed.y) / step
            damping[i, 2, j] = (one.spin - rubbed.spin) / step


def known_states(fits: FlightFits, k: int, times: Array) -> tuple[Array, Array]:
    """What laws know (N, KNOWN_SIZE), and how the acceleration answers velocity and spin (N, 3, 3; 1/s), along the
    path that flight ``k`` really took, at sorted ``times``: the fitted one, led to the frames where it misses them
    smoothly."""
    times = np.ascontiguousarray(times)
    states = fits.flown(k, times)[0] + _missed(fits, k, times)
    p = with_impact_before(fits.parameters, fits.run, fits.flights, k)
    without, known, damping = p.copy(), np.zeros((len(times), W.KNOWN_SIZE)), np.zeros((len(times), 3, 3))
    without[P.FRICTION] = 0.0
    _fill(times, states, p, without, fits.run.flight_rig, known, damping)
    return known, damping
