"""Smoothing and peaks as `scipy.signal` has them, whose loading takes half a second of every run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def savitzky_golay(values: Array, window: int, order: int) -> Array:
    """``values`` (n,) smoothed: each is that of the polynomial of ``order`` through the ``window`` (odd, at most n)
    around it; the first and last half window lie on the polynomials of the first and last window.
    """
    half = window // 2
    powers = (np.arange(-half, half + 1) / half)[:, None] ** np.arange(order + 1)
    smoothing = powers @ np.linalg.pinv(powers)  # of a window: what is measured -> its polynomial
    out = np.empty(len(values))
    out[half : len(values) - half] = np.convolve(values, smoothing[half][::-1], "valid")
    out[:half] = smoothing[:half] @ values[:window]
    out[len(values) - half :] = smoothing[half + 1 :] @ values[-window:]
    return out


def highest(values: Array, prominence: float, distance: int) -> tuple[NDArray[np.int64], Array]:
    """Places of the maxima of ``values`` (n,), and the prominence of each: its height over the higher of the lowest
    values that part it from something higher, or from an end, on either side.

    Of maxima closer than ``distance`` the highest stays, then those of at least ``prominence``.  A plateau's place is
    its middle; neither end is a maximum.
    """
    found = _maxima(values)
    prominences = values[found] - np.maximum(_lowest_before(values, found), _lowest_before(values[::-1], -found - 1))
    kept = _apart(found, values[found], distance) & (prominences >= prominence)
    return found[kept], prominences[kept]


def _maxima(values: Array) -> NDArray[np.int64]:
    steps = np.diff(values)
    moves = np.flatnonzero(steps)  # where it rises or falls; between them it is level
    rises = steps[moves] > 0
    tops = np.flatnonzero(rises[:-1] & ~rises[1:])
    return (moves[tops] + 1 + moves[tops + 1]) // 2


def _lowest_before(values: Array, found: NDArray[np.int64]) -> Array:
    """Lowest value between each maximum and the nearest higher one before it, or the first value."""
    at = np.arange(len(values))[found]
    order = np.argsort(at)
    lowest = np.empty(len(at))
    higher: list[tuple[float, float]] = []  # heights that fall, each with the lowest value before it
    last = 0
    for place in order:
        height, low = float(values[at[place]]), float(values[last : at[place]].min())
        if last == 0:
            higher.append((float(values[0]), np.inf))
        while higher and higher[-1][0] <= height:
            low = min(low, higher.pop()[1])
        lowest[place] = low
        higher.append((height, low))
        last = at[place]
    return lowest


def _apart(found: NDArray[np.int64], heights: Array, distance: int) -> NDArray[np.bool_]:
    kept = np.ones(len(found), bool)
    for i in np.argsort(heights)[::-1]:
        if kept[i]:
            near = slice(*np.searchsorted(found, [found[i] - distance + 1, found[i] + distance]))
            kept[near] = False
            kept[i] = True
    return kept
