"""What all forms of laws of the measurement are made by."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from analysis.gap.laws.dictionary.candidate import Candidate, waves
from analysis.gap.laws.dictionary.parts import plain
from analysis.gap.laws.regression.problem import Regression
from ovines.core.laws import words as W
from ovines.core.laws.terms import Factor, Term

Array = NDArray[np.float64]
#: the terms of a target that factors make, as a product
Make = Callable[..., tuple[Term, ...]]
# What a blow leaves swinging fades in so many usual flights.
SWINGS_FADE = (0.3, 1.0)


class Rows(Protocol):
    """Rows of frames: the ``problem`` without a law, what laws ``known`` of each frame (N, KNOWN_SIZE), and the
    frame ``at`` (M,) of each row."""

    @property
    def problem(self) -> Regression:
        """Without a law."""

    @property
    def known(self) -> Array:
        """By laws, of each frame."""

    @property
    def at(self) -> NDArray[np.int64]:
        """Frame of each row."""


def followed(word: str, make: Make, name: str, *factors: Factor | tuple[Factor, ...]) -> Candidate:
    """The target with the factors, or products of them, each with a coefficient of its own."""
    products = [one if isinstance(one, tuple) else (one,) for one in factors]
    return plain(f"{word}, {name}", *(term for product in products for term in make(*product)))


def scaled(make: Make, quantity: str, function: str, scale: float) -> tuple[Term, ...]:
    """A factor with a number inside."""
    return make(Factor(quantity, function, 1.0, scale))


def period_s_of(known: Array) -> float:
    """Of the frames (s)."""
    return float(np.median(np.diff(known[:, W.TIME])))


def usual_flight_s(known: Array) -> float | None:
    """Time (s) that a flight usually takes, by the frames that a blow was before; None without any."""
    since = known[:, W.SINCE]
    struck = since[(since < 0.5 * W.LONG_AGO_S) & (known[:, W.LAST_APPROACH] > 0)]
    return 2 * float(np.median(struck)) if len(struck) else None


def swung(make: Make, rate: float, fades_s: float, size: str = "last_approach") -> tuple[Term, ...]:
    """What a blow leaves swinging by its ``size``."""
    fades = Factor(size), Factor("since", "exponential", 1.0, fades_s)
    return tuple(term for wave in waves("since", 1.0, 1.0 / rate) for term in make(*fades, wave))
