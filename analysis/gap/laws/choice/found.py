"""A formula that was chosen, and those beside it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate
from ovines.core.laws.terms import Term

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Rival:
    """Another formula: its ``gain`` on held-out runs against that of the chosen one, and whether the data tell it from
    that."""

    candidate: Candidate
    coefficients: Array
    covariance: Array
    gain: float
    told_apart: bool


@dataclass(frozen=True, eq=False)
class Found:
    """A chosen formula: its parts, coefficients of all terms with covariance (T, T), sds of the numbers inside,
    held-out ``gain`` over no law, ``p`` of the first part by chance, rivals of the strongest part."""

    parts: tuple[Candidate, ...]
    coefficients: Array
    covariance: Array
    number_sd: tuple[Array, ...]
    gain: float
    p: float
    rivals: tuple[Rival, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms of all parts, in the coefficients' order."""
        return tuple(term for part in self.parts for term in part.terms)

    def first(self, count: int) -> Found:
        """Its first ``count`` parts."""
        parts = self.parts[:count]
        terms = sum(len(part.terms) for part in parts)
        return replace(
            self, parts=parts, coefficients=self.coefficients[:terms], covariance=self.covariance[:terms, :terms],
            number_sd=self.number_sd[:count],
        )  # fmt: skip
