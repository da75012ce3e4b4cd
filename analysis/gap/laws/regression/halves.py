"""A law's size by halves of the runs, or of the impacts that it acts in, and how single runs scatter about it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.regression.problem import Profile, Regression, part_of
from analysis.statistics.student import NORMAL_90

Array = NDArray[np.float64]
# Sizes are known no better than to a hundredth each (scale, clock, a form that is nearly right): halves that differ by
# less than both say the same, however narrow noise makes their intervals (0.5 % of a fan's law, known to 0.2 %).
ALIKE = 0.02
# Runs tell nothing of a law of which what is fitted along takes all but this share of the square: one run of a law that
# goes with the run.
LEAST_SHARE_LEFT = 1e-6


@dataclass(frozen=True)
class Halves:
    """A law's size, 1 being the reported one, fitted to every second run alone (the first, third, ...) and to the
    others, with sds; of a law that acts in too few runs for that, to every second flight or impact that it acts in."""

    sizes: tuple[float, float]
    sds: tuple[float, float]

    @property
    def agree(self) -> bool:
        """Whether the two 90 % intervals overlap, or the sizes differ by less than is ever known."""
        return abs(self.sizes[0] - self.sizes[1]) <= max(NORMAL_90 * (self.sds[0] + self.sds[1]), ALIKE)

    @property
    def both_show_it(self) -> bool:
        """Whether each half alone is sure that the law is there."""
        return all(size > NORMAL_90 * sd for size, sd in zip(self.sizes, self.sds, strict=True))

    def entry(self) -> dict[str, Any]:
        """As diagnosis.json has it."""
        pairs = zip(self.sizes, self.sds, strict=True)
        sizes = [{"value": v, "low": v - NORMAL_90 * sd, "high": v + NORMAL_90 * sd} for v, sd in pairs]
        return {"agree": self.agree, "sizes": sizes}


def second_half(problem: Regression) -> NDArray[np.bool_]:
    """Which rows (M,) are of every second run, from the second on."""
    return np.asarray(np.unique(problem.run, return_inverse=True)[1] % 2 == 1, bool)


def second_acting(problem: Regression, moved: Array) -> NDArray[np.bool_]:
    """Which rows (M,) are of every second flight or impact that a law does something to; the others it leaves alone
    are shared out by turns, too."""
    numbers, block = np.unique(problem.block, return_inverse=True)
    acts = np.bincount(block, moved != 0.0, len(numbers)) > 0
    turn = np.where(acts, np.cumsum(acts), np.cumsum(~acts))
    return np.asarray(turn[block] % 2 == 0, bool)


def halves_of(problem: Regression, moved: Array) -> Halves | None:
    """Sizes of what a law does to the rows (M,) by halves of the runs, every nuisance fitted anew to each; None of one
    run, or where a half tells nothing.

    A law of the few blows that slide may act in two or three runs, of which one half then has nothing to say: the
    blows that it acts in are halved in place of the runs."""
    if len(np.unique(problem.run)) < 2:
        return None
    scatter = scatter_of_runs(problem, moved)
    for second in (second_half(problem), second_acting(problem, moved)):
        fits = [_size(part_of(problem, own), moved[own]) for own in (~second, second)]
        if all(sd > 0 for _, sd in fits):
            (first, first_sd), (other, other_sd) = fits
            return Halves((first, other), (scatter * first_sd, scatter * other_sd))
    return None


def scatter_of_runs(problem: Regression, moved: Array) -> float:
    """By how much the sizes that single runs ask for scatter about those of their halves, over their own sds; 1 at the
    least, and where no half has two runs."""
    second = second_half(problem)
    squares, free = 0.0, 0
    for half in (~second, second):
        each = [
            _size(part_of(problem, problem.run == run), moved[problem.run == run])
            for run in np.unique(problem.run[half])
        ]
        size, sd = np.array([one for one in each if one[1] > 0]).reshape(-1, 2).T
        if len(size) > 1:
            mean = float(np.sum(size / sd**2) / np.sum(1 / sd**2))
            squares, free = squares + float(np.sum(((size - mean) / sd) ** 2)), free + len(size) - 1
    return max(1.0, float(np.sqrt(squares / free))) if free else 1.0


def _size(problem: Regression, moved: Array) -> tuple[float, float]:
    """Size and sd of what a law does to the rows, every nuisance fitted along; an sd of 0 where they tell nothing."""
    _, size, covariance = Profile.of(problem).gain(moved[:, None])
    if not 0 < covariance[0, 0] * float(moved @ moved) < 1 / LEAST_SHARE_LEFT:
        return 0.0, 0.0
    excess = replace(problem, residual=problem.residual - size[0] * moved).excess
    return float(size[0]), float(np.sqrt(covariance[0, 0] * excess))
