"""Pushes that come and go in time: a force of the room in pulses, Gaussian or sudden, its period, width and first
instant scanned.

No list of candidates can hold every period and instant.  The force of each short stretch of time is first fitted
freely, the same in all runs, and every train of pulses, single ones too, is then held against that profile at the
price of a small sum; the best of each width become candidates, and pay for having been looked for in the same data:
what the best train gains where each flight's sign is turned at random, with whatever structure the flights hold."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.flight_rows import FlightRegression
from analysis.gap.laws.regression.problem import Profile
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
# Stretches of a run in which the force is fitted by itself, and the widths in such stretches (of a Gaussian: its sd).
STRETCHES, WIDTHS = 120, {"pulses": (1.0, 2.0, 4.0), "gates": (2.0, 4.0, 8.0, 16.0)}
# Shortest period over the width: closer pulses are one force; longest over the run: a single pulse.
SHORTEST, LONGEST = {"pulses": 4.0, "gates": 2.0}, 2.0
# Firsts are tried so many widths apart.
APART = {"pulses": 1.0, "gates": 0.25}
# Turned series in which trains are looked for, too; the best of all of them is the price.
TURNS = 19


@dataclass(frozen=True, eq=False)
class TimeProfile:
    """Normal equations of a force along x and along y in each stretch of time: ``information`` (2, 2, B, B) and
    ``scores`` (K, 2, B), of the series (the first) and of those with turned signs, what all else explains taken out;
    ``middle_s`` (B,) of the stretches, from the run's start."""

    information: Array
    scores: Array
    middle_s: Array

    def gains(self, trains: Array) -> Array:
        """Fall of the sum of squares (K, N) that each of the ``trains`` (N, B) explains in the direction that suits it
        best, in each series."""
        x, y = (self.scores[:, axis] @ trains.T for axis in (0, 1))
        xx, xy, yy = (
            np.einsum("nb,nb->n", trains @ self.information[i, j], trains) for i, j in ((0, 0), (0, 1), (1, 1))
        )
        determinant = xx * yy - xy**2
        determined = determinant > 1e-9 * np.maximum(xx * yy, 1e-300)
        top = yy * x**2 - 2 * xy * x * y + xx * y**2
        return np.where(determined, top / np.where(determined, determinant, 1.0), 0.0)


def time_profile(problem: FlightRegression, run_s: float, rng: np.random.Generator) -> TimeProfile:
    """The force that the flights ask for in each of :data:`STRETCHES` of a run of ``run_s``, as they are and with signs
    that ``rng`` turns."""
    edges = np.linspace(0.0, run_s * (1 + 1e-9), STRETCHES + 1)

    def cut(known: Array) -> Array:
        number = np.searchsorted(edges, known[:, W.TIME], side="right") - 1
        return np.asarray(number[:, None] == np.arange(STRETCHES), float)

    ways = [problem.cut_columns(Term("fixed_direction", 1.0, x=angle), cut) for angle in (0.0, 0.5 * math.pi)]
    profile = Profile.of(problem.problem)
    count = len(problem.problem.residual)
    basis = profile.basis[:count]
    left = [one - basis @ (profile.basis[:count].T @ one) for one in ways]
    information = np.array([[a.T @ b for b in left] for a in left])
    blocks, block = np.unique(problem.problem.block, return_inverse=True)
    signs = np.vstack([np.ones(len(blocks)), rng.choice([-1.0, 1.0], (TURNS, len(blocks)))])
    turned = signs[:, block] * profile.residual[:count]
    scores = np.stack([turned @ one for one in left], 1)
    return TimeProfile(information, scores, 0.5 * (edges[1:] + edges[:-1]))


def pulse_candidates(problem: FlightRegression, run_s: float, rng: np.random.Generator) -> list[Candidate]:
    """The best train of each shape and width; none where the flights tell no profile."""
    profile = time_profile(problem, run_s, rng)
    stretch = run_s / STRETCHES
    best: dict[str, tuple[float, tuple[float, float, float]]] = {}
    price = 0.0
    for shape, share in ((shape, share) for shape, shares in WIDTHS.items() for share in shares):
        width = share * stretch
        for period in _periods(shape, width, run_s):
            first = np.arange(0.0, min(period, run_s), APART[shape] * width)
            gains = profile.gains(_trains(shape, width, period, first, profile.middle_s))
            price = max(price, float(gains[1:].max()))
            at = int(np.argmax(gains[0]))
            if gains[0, at] > best.get(shape, (0.0, ()))[0]:
                best[shape] = float(gains[0, at]), (width, float(period), float(first[at]))
    price /= problem.problem.excess
    found = {shape: _closer(profile, shape, numbers) for shape, (_, numbers) in best.items()}
    return [
        Candidate(
            f"force of the room in {shape}",
            partial(_train, shape),
            numbers,
            (0.3, 0.5 * stretch / run_s, 0.5 * APART[shape] * numbers[0]),
            (True, True, False),
            price,
        )
        for shape, numbers in found.items()
    ]


def _closer(profile: TimeProfile, shape: str, numbers: tuple[float, float, float]) -> tuple[float, float, float]:
    """Width, period and first instant that explain most of the profile, about those of the grid: shapes are held
    against each other at their best."""
    width, period, first = numbers
    run_s = float(profile.middle_s[-1])

    def at(step: Array) -> tuple[float, float, float]:
        moved = np.clip(step, -3.0, 3.0)
        by = 0.3 * width / run_s
        return (
            width * float(np.exp(0.3 * moved[0])),
            period * float(np.exp(by * moved[1])),
            first + width * moved[2] / 3,
        )

    def misfit(step: Array) -> float:
        own_width, own_period, own_first = at(step)
        return -float(
            profile.gains(_trains(shape, own_width, own_period, np.array([own_first]), profile.middle_s))[0, 0]
        )

    simplex = np.vstack([np.zeros(3), np.eye(3)])
    found = minimize(misfit, np.zeros(3), method="Nelder-Mead", options={"initial_simplex": simplex, "maxfev": 200})
    return at(found.x)


def _trains(shape: str, width: float, period: float, first: Array, middle_s: Array) -> Array:
    """How much of a pulse each stretch of time (B,) holds, for trains that begin at ``first`` (N,): (N, B)."""
    late = middle_s - first[:, None]
    late = late - period * np.floor(late / period + 0.5)
    if shape == "pulses":
        return np.asarray(np.exp(-0.5 * (late / width) ** 2))
    stretch = float(middle_s[1] - middle_s[0])
    return np.asarray(np.clip(0.5 * (width + stretch) - np.abs(late), 0.0, min(width, stretch)) / stretch)


def _train(shape: str, width: float, period: float, first: float) -> tuple[Term, Term]:
    factors = (Factor("time", shape, width, period, first),)
    return Term("fixed_direction", 1.0, factors), Term("fixed_direction", 1.0, factors, x=0.5 * math.pi)


def _periods(shape: str, width: float, run_s: float) -> Array:
    """Periods so close that a train of one falls out of step with the next by a width at the end of a run."""
    shortest, longest = SHORTEST[shape] * width, LONGEST * run_s
    count = max(int(math.log(longest / shortest) * run_s / width), 1)
    return np.geomspace(shortest, longest, count)
