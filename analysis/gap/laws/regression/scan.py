"""Waves of rates that no list holds, all held against a residual at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
# Instants (s) or angles (rad), and sizes (of the largest), that are the same, but for rounding.
SAME_INSTANT, SAME_SIZE = 1e-8, 1e-8
# Frequencies at a time: their cosines over all frames fit into a cache of some megabytes.
AT_ONCE = 64


@dataclass(frozen=True, eq=False)
class Scan:
    """Values (N,) of a ``clock`` - instants, angles - by which something swings with a ``size`` (N,), those of all rows
    (M,) among them ``at``, and what is ``left`` in these."""

    clock: Array
    size: Array
    at: NDArray[np.int64]
    left: Array

    @classmethod
    def of(cls, at: NDArray[np.int64], left: Array, clock: Array, size: Array) -> Scan:
        """``clock`` and ``size`` of each frame or impact, and the one ``at`` (M,) which each row is; what is at one
        instant in all runs is one."""
        both = np.round(np.column_stack([clock / SAME_INSTANT, size / max(np.abs(size).max(), 1e-300) / SAME_SIZE]))
        _, first, number = np.unique(both, axis=0, return_index=True, return_inverse=True)
        return cls(clock[first], size[first], number.reshape(-1)[at], left)

    def gains(self, ways: Array, signs: Array, rates: Array) -> Array:
        """Falls of the sum of squares (W, K, F) that a cosine and a sine of each rate explain of what is left with the
        ``signs`` (K, M), by each of ``ways`` (M, W) in which the rows answer."""
        count, out = len(self.clock), np.zeros((ways.shape[1], len(signs), len(rates)))
        weight = np.array([np.bincount(self.at, way**2, count) for way in ways.T]) * self.size**2
        moved = [way * self.left for way in ways.T]
        score = np.array([np.bincount(self.at, way * sign, count) for way in moved for sign in signs]) * self.size
        for first in range(0, len(rates), AT_ONCE):
            turn = np.outer(self.clock, rates[first : first + AT_ONCE])
            c, s = np.cos(turn), np.sin(turn)
            a, b, ab = (np.asarray(weight @ one)[:, None] for one in (c * c, s * s, c * s))
            x, y = ((score @ one).reshape(len(weight), len(signs), -1) for one in (c, s))
            square = (b * x**2 - 2 * ab * x * y + a * y**2) / np.maximum(a * b - ab**2, 1e-300)
            out[:, :, first : first + AT_ONCE] = square
        return out
