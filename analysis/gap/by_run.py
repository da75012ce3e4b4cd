"""What each run by itself says of an effect, and how well the other runs foretell it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.statistics.robust import covariance_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ByRun:
    """Each run's ``information`` (R, P, P) of an effect's P sizes and its ``score`` (R, P): information times the sizes
    that this run by itself shows."""

    information: Array
    score: Array

    @classmethod
    def of_estimates(cls, estimates: Array, sd: Array) -> ByRun:
        """From one size (R,) of each run with its sd (R,)."""
        information = np.asarray(sd, float) ** -2.0
        return cls(information[:, None, None], (information * estimates)[:, None])

    @classmethod
    def of_forms(cls, information: Array, score: Array, own: Sequence[int]) -> ByRun:
        """From all C columns' ``information`` (R, C, C) and ``score`` (R, C): of the columns ``own``, whatever the
        others are in each run."""
        at = list(own)
        rest = [k for k in range(information.shape[1]) if k not in at]
        kept, pushed = [], []
        for whole, right in zip(information, score, strict=True):
            beside = whole[np.ix_(at, rest)] @ covariance_of(whole[np.ix_(rest, rest)])
            kept.append(whole[np.ix_(at, at)] - beside @ whole[np.ix_(rest, at)])
            pushed.append(right[at] - beside @ right[rest])
        return cls(np.array(kept), np.array(pushed))

    def moved(self, by: Array) -> ByRun:
        """The same of sizes that are larger by ``by`` (P,)."""
        return ByRun(self.information, self.score + self.information @ by)

    def squares(self, gain: float) -> tuple[Array, Array, Array]:
        """Squared errors over the variance per run (R,) of what a run shows: of a model without the effect, of one with
        the size that the other runs say, and of one that knows it.  ``gain``: what the size that all runs say takes of
        the first, in units of a variance that has errors in it which the runs share.

        A run without others has nothing to be foretold from, and is taken to know it."""
        whole, right = self.information.sum(0), self.score.sum(0)
        found = float(right @ covariance_of(whole) @ right)
        of_noise = gain / found if found > 0 else 0.0
        before, after, floor = np.zeros((3, len(self.score)))
        for run, (own, score) in enumerate(zip(self.information, self.score, strict=True)):
            covariance = covariance_of(own)
            shown = covariance @ score
            before[run], floor[run] = shown @ own @ shown, np.trace(own @ covariance)
            off = covariance_of(whole - own) @ (right - score) - shown
            after[run] = off @ own @ off if len(self.score) > 1 else floor[run]
        return of_noise * before, of_noise * after, of_noise * floor
