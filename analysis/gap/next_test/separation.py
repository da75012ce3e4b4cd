"""By how many standard deviations simulated recordings separate an effect, or a law, from its rival."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.regression.problem import scaled_inverse

Array = NDArray[np.float64]


class Separation(NamedTuple):
    """By how many standard deviations, ``sd``, one recording in a setting separates the two, and the standard error of
    that over where recordings begin (NaN of a single one).
    """

    setting: str
    sd: float
    error: float


class Information(NamedTuple):
    """``size`` (K,) of the effect, and what each recording says of it and of everything unknown beside it: (M, M),
    the effect's parameters first; ``prior`` (M, M)."""

    size: Array
    forms: list[Array]
    prior: Array

    @staticmethod
    def of_rows(moved: Array, unknown: Array, prior: Array, run: NDArray[np.int64]) -> Information:
        """Of whitened rows: what a law does to them, ``moved`` (M,), beside ``unknown`` columns (M, P) with prior
        weights (P,), of recordings ``run`` (M,)."""
        rows = np.column_stack([moved, unknown])
        forms = [rows[run == one].T @ rows[run == one] for one in np.unique(run)]
        return Information(np.ones(1), forms, np.diag(np.concatenate([[0.0], prior])))

    def separation(self, forms: Sequence[Array], recordings: int) -> float:
        """Size over its sd in one recording of these: how far the data would be from the nearest that anything else
        explains."""
        own, known = len(self.size), np.sum(forms, 0) + self.prior
        beside = known[:own, own:] @ scaled_inverse(known[own:, own:]) @ known[own:, :own]
        square = float(self.size @ (known[:own, :own] - beside) @ self.size)
        return float(np.sqrt(max(square, 0.0) / recordings))


def separation_of(information: Information | None, recordings: int) -> tuple[float, float]:
    """Standard deviations in one recording of so many, and their standard error by leaving beginnings out in turn."""
    if information is None or not information.forms:
        return 0.0, float("nan")
    forms = information.forms
    value, n = information.separation(forms, recordings), len(forms)
    if n < 2 or n < recordings:  # some recordings say nothing at all: how often that is nobody knows from so few
        return value, float("nan")
    left_out = [information.separation(forms[:i] + forms[i + 1 :], n - 1) for i in range(n)]
    return value, float(np.sqrt((n - 1) / n * np.sum((np.array(left_out) - np.mean(left_out)) ** 2)))
