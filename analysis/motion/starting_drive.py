"""The frequency of a drive that starts or dies away: a sine whose size changes while its phase goes on.

A line fitted through a start gives way to it: of twelve runs of 0.5 to 1.1 s that begin with a rise of 0.15 s its
frequency scattered by 1.5 %.  A size that changes is real, a frequency that is off turns the phase further and further:
that tells the two apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.motion.host_lines import basis
from analysis.statistics.correlation import slow_mean
from ovines.robust import spread

Array = NDArray[np.float64]
# The size over a run: polynomials of this degree at the most, one for so many periods of the drive.
DEGREE, PERIODS_A_TERM = 14, 0.8
# Phases tried in half a turn, frequencies to both sides of the line (turns over the run), rounds from the best, each
# without frames that are off by more than so many sds.  Twelve starts bent a line by 0.31 turns at
# the most; farther off a size that goes through zero makes another frequency of it.
PHASES, TURNS, ROUNDS, GROSS_SD = 8, np.linspace(-0.5, 0.5, 5), 6, 6.0
# It is one sine where it leaves no more than this many times what the path left that follows every frame, and a part of
# their noise: 1.0 to 1.8 times in 24 starts.
AS_GOOD = 2.5
# Steps of the derivatives: rad over the run, rad.
STEP = 1e-4


@dataclass(frozen=True)
class InPhase:
    """The frequency of a sine of changing size, with its sd (rad/s), and the spread of what it leaves (m)."""

    omega_rad_per_s: float
    sd_rad_per_s: float
    left_m: float


def in_phase(time_s: Array, way_m: Array, guess_rad_per_s: float, overtones: int = 1) -> InPhase | None:
    """The sine of changing size that ``way_m`` (N,) (nan where unseen) is along one axis, beside ``overtones`` (the
    sine itself being the first) of steady size; None where its frames or periods are too few, or where it would be half
    a turn over the run from the line ``guess_rad_per_s``.

    >>> t = np.linspace(0.0, 0.6, 480)
    >>> found = in_phase(t, 0.01 * (1 - np.exp(-t / 0.15)) * np.sin(70.0 * t) + 1e-9 * np.cos(9e3 * t), 72.0)
    >>> round(found.omega_rad_per_s, 2)
    70.0
    """
    seen = np.isfinite(way_m)
    duration = float(np.ptp(time_s[seen])) if seen.any() else 0.0
    degree = int(min(DEGREE, guess_rad_per_s * duration / (2 * np.pi) / PERIODS_A_TERM))
    if degree < 1 or np.count_nonzero(seen) < 4 * (degree + 2 * overtones):
        return None
    middle = float(np.mean(time_s[seen]))
    t, way = np.asarray(time_s[seen] - middle, float), way_m[seen]
    size = np.polynomial.legendre.legvander(2 * t / duration, degree)

    def left(omega: float, phase: float, keep: NDArray[np.bool_]) -> Array:
        beside = basis(t, omega * np.arange(2.0, overtones + 1))
        design = np.column_stack([beside, size * np.cos(omega * t + phase)[:, None]])
        return np.asarray(way - design @ np.linalg.lstsq(design[keep], way[keep], rcond=None)[0], float)

    keep = np.ones(len(t), bool)
    tried = [
        (guess_rad_per_s + 2 * np.pi * turns / duration, phase)
        for turns in TURNS
        for phase in np.arange(PHASES) * np.pi / PHASES
    ]
    omega, phase = min(tried, key=lambda one: float(np.sum(left(one[0], one[1], keep) ** 2)))
    unit, variance = 1 / duration, 0.0
    for _ in range(ROUNDS):
        now = left(omega, phase, keep)
        keep = np.abs(now - np.median(now)) < GROSS_SD * max(spread(now), 1e-15)
        moved = (left(omega + STEP * unit, phase, keep), left(omega, phase + STEP, keep))
        slopes = np.column_stack([(one - now)[keep] / STEP for one in moved])
        inverse = np.linalg.pinv(slopes.T @ slopes, hermitian=True)
        step, variance = -inverse @ (slopes.T @ now[keep]), float(inverse[0, 0])
        omega, phase = omega + float(step[0]) * unit, phase + float(step[1])
    if abs(omega - guess_rad_per_s) * duration > 2 * np.pi * TURNS[-1]:
        return None
    rest = left(omega, phase, keep)[keep]
    sd = np.sqrt(variance) * unit * float(np.std(rest)) * slow_mean(rest)
    return InPhase(float(omega), float(sd), spread(rest))
