"""Numbers inside a candidate - ranges, places, angles - moved to where they explain most."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.gap.laws.dictionary.candidate import Candidate
from analysis.gap.laws.regression.problem import Profile
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]
Columns = Callable[[Sequence[Term]], Array]
# Evaluations of the search inside a candidate, per number; places and angles stay within so many of their steps: a
# patch of the floor a metre away is a polynomial that poses as a place.
TRIALS, FARTHEST = 40, 10.0


def searched(profile: Profile, columns: Columns, candidate: Candidate) -> Candidate:
    """The candidate at the numbers that explain most of all runs, without those that change nothing there."""
    if not candidate.numbers:
        return candidate
    free = Numbers(candidate)

    def misfit(moved: Array) -> float:
        return -profile.gain(columns(free.at(moved).terms))[0]

    n = len(candidate.numbers)
    simplex = np.vstack([np.zeros(n), np.eye(n)])
    found = minimize(
        misfit,
        np.zeros(n),
        method="Nelder-Mead",
        options={"initial_simplex": simplex, "maxfev": TRIALS * n, "xatol": 0.01, "fatol": 0.05},
    )
    return free.at(found.x).settled()


@dataclass(frozen=True)
class Numbers:
    """A candidate's numbers in units of their steps, scales by their logarithm, about where it stands."""

    candidate: Candidate

    def at(self, moved: Array) -> Candidate:
        """The candidate with its numbers ``moved`` (I,) by so many steps."""
        one = self.candidate
        numbers = [
            number * float(np.exp(np.clip(m * step, -4, 4)))
            if positive
            else number + float(np.clip(m, -FARTHEST, FARTHEST)) * step
            for number, m, step, positive in zip(one.numbers, moved, one.steps, one.positive, strict=True)
        ]
        return one.at(numbers)

    def sd(self, moved_sd: Array) -> Array:
        """Sds (I,) of the numbers from those in steps."""
        one = self.candidate
        return np.array(
            [
                (abs(number) if positive else 1.0) * step * sd
                for number, sd, step, positive in zip(one.numbers, moved_sd, one.steps, one.positive, strict=True)
            ]
        )
