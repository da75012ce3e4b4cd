"""Lines in the Host's path, slow or other, beside the drive: of one frequency in all runs, of any size in each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.gap.drive.measured_path import MeasuredPath, whitened
from analysis.gap.drive.pairs import inverse, inverse_and_power, products

Array = NDArray[np.float64]
# A line needs a spacing of this share of its width; they are looked for up to this share of the frame rate.
LINE_SPACING, LINES_TO = 0.25, 0.25
# ... and shows with this share of its power beside the drive.
LEAST_SEEN = 0.01
# Lines weighed together: as many as a processor's cache holds.
AT_ONCE = 32


@dataclass(frozen=True, eq=False)
class Line:
    """A line that is fitted: its frequency (Hz) with sd, per path the complex amplitudes (R, 2) of
    ``Re(A exp(-i w t))`` with their sds (R,), and its ``gain``; ``each`` (R,) path's part of it."""

    frequency_hz: float
    frequency_sd_hz: float
    amplitude: Array
    sd: Array
    gain: float
    each: Array

    def places(self, path: int, time_s: Array) -> Array:
        """The line (N, 2) in one of the paths at times (N,), in m."""
        turn = np.exp(-2j * np.pi * self.frequency_hz * time_s)
        return np.asarray(np.real(turn[:, None] * self.amplitude[path]))


def best_line(paths: Sequence[MeasuredPath], left: Sequence[Array], below_hz: float) -> Line:
    """The line of one frequency (at most ``below_hz``), of any amplitude and phase in each path, that takes most of
    what is ``left`` (N, 2; m)."""
    longest = max(float(np.ptp(path.time_s)) for path in paths)
    width = LINE_SPACING / longest
    white = [path.white(one) for path, one in zip(paths, left, strict=True)]

    def gain(hz: Array) -> Array:
        return np.sum([_gains(path, one, hz) for path, one in zip(paths, white, strict=True)], 0)

    grid = np.arange(width, below_hz, width)
    start = float(grid[int(np.argmax(gain(grid)))])
    # Twice finer about the best, to a four-hundredth of a line's width.
    for finer in (0.1, 0.01):
        near: Array = np.asarray(start + width * finer * np.arange(-10, 11), float)
        near = near[near > 0]
        start = float(near[int(np.argmax(gain(near)))])
    h = 0.1 * width
    below, middle, above = gain(np.array([start - h, start, start + h]))
    curvature = float(2 * middle - below - above) / h**2
    fitted = [_pairs(path, one, np.array([start])) for path, one in zip(paths, white, strict=True)]
    gains, amplitudes, sds = (np.array([one[k][..., 0] for one in fitted]) for k in range(3))
    sd = float(np.sqrt(2 / curvature)) if curvature > 0 else width
    return Line(start, sd, amplitudes, sds, float(gains.sum()), gains)


def _gains(path: MeasuredPath, white: Array, hz: Array) -> Array:
    """Gains (G,) of lines at ``hz`` (G,), evenly spaced, as :func:`_pairs` has them, from products with the drive
    alone: their own rows beside it are asked of one line only."""
    some = [_gains_of_some(path, white, hz[first : first + AT_ONCE]) for first in range(0, len(hz), AT_ONCE)]
    return np.concatenate(some)


def _gains_of_some(path: MeasuredPath, white: Array, hz: Array) -> Array:
    rows = whitened(_turning(path.time_s, hz), path.correlation)
    by_drive = path.held.T @ rows
    normal = products(rows.reshape(-1, 2, len(hz))) - products(by_drive.reshape(-1, 2, len(hz)))
    seen = normal[0] + normal[1] > LEAST_SEEN * len(rows)
    on = np.where(seen, (rows.T @ white).reshape(2, len(hz), 2).swapaxes(1, 2), 0.0)
    # ``white`` is without the drive, so that what the drive holds of the rows is none of their products with it.
    return np.einsum("jag,jag->g", np.einsum("ijg,jag->iag", inverse(*normal), on), on)


def _turning(time_s: Array, hz: Array) -> Array:
    """Cosines and sines (N, 2 G) at evenly spaced frequencies, each from the one before by a turn: a third of the time
    that as many sines take."""
    turns = np.empty((len(hz), len(time_s)), complex)
    turns[0] = np.exp(2j * np.pi * hz[0] * time_s)
    step = np.exp(2j * np.pi * (hz[-1] - hz[0]) / max(len(hz) - 1, 1) * time_s)
    for k in range(1, len(hz)):
        np.multiply(turns[k - 1], step, out=turns[k])
    return np.concatenate([turns.real, turns.imag]).T


def _pairs(path: MeasuredPath, white: Array, hz: Array) -> tuple[Array, Array, Array]:
    """Of lines at ``hz`` (G,), each by itself: gains (G,), complex amplitudes (2, G) along x and y, and the sd (G,) of
    a part of them."""
    turn = 2 * np.pi * path.time_s[:, None] * hz
    # Whitened for a frame of unit variance; both axes hold the same columns over their own sd.
    rows = path.white(np.stack([np.cos(turn), np.sin(turn)], 1) * path.sd.reshape(1, 2, 1))
    inverse, power = inverse_and_power(rows)
    # A line that the drive holds nearly whole is part of the drive.
    on = np.where(power > LEAST_SEEN * len(rows), np.einsum("mjg,ma->jag", rows, white), 0.0)
    sizes = np.einsum("ijg,jag->iag", inverse, on)
    gain = np.einsum("jag,jag->g", sizes, on)
    amplitude = path.sd[:, None] * (sizes[0] + 1j * sizes[1])
    variance = 0.25 * np.sum(path.sd**2) * (inverse[0, 0] + inverse[1, 1])
    return gain, amplitude, np.sqrt(variance)
