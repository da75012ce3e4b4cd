"""Errors of the frames of one bounce sequence that go together: correlated from frame to frame, and a lens residual
that neighbours share.

Hops of the last chatter are 20 um high.  Errors that stay the same for a few frames look like another sequence: taken
as independent they moved hops by a third of a frame with sds of 0.05 frame (practice-08 and -10).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.flights.noise import FlightNoise, displacement

Array = NDArray[np.float64]

# What polynomials of degree four leave of a lens residual changes its sign within about this share of the contact
# radius.
LENS_LENGTH_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class SequenceNoise:
    """Whitening of standardised errors of N frames: lower triangles ``place`` and ``angle`` (N, N)."""

    place: Array
    angle: Array

    def whitened(self, values: Array) -> Array:
        """Standardised x, y, angle (n, 3, ...) of the first n frames to those of independent errors.

        A triangle's first rows do not know the later frames, so that any number of first frames will do."""
        n, out = len(values), np.empty_like(values)
        for columns, triangle in ((slice(0, 2), self.place), (slice(2, 3), self.angle)):
            part = values[:, columns]
            out[:, columns] = (triangle[:n, :n] @ np.ascontiguousarray(part).reshape(n, -1)).reshape(part.shape)
        return out


def sequence_noise(
    index: NDArray[np.int64],
    times_s: Array,
    xy_m: Array,
    sd: Array,
    noise: FlightNoise,
    lens_m: float,
    contact_radius_m: float,
) -> SequenceNoise:
    """Of frames ``index`` (N,) at ``times_s`` and ``xy_m`` (N, 2): errors of ``sd`` (N, 2: places, angles) as ``noise``
    correlates them, its unknown force, and for places a lens residual of sd ``lens_m`` that goes with the place."""
    together = (
        noise.correlation ** np.abs(np.subtract.outer(index, index)) if noise.correlation > 0 else np.eye(len(index))
    )
    moved = displacement(times_s, noise.memory_s) if noise.forced else np.zeros_like(together)
    apart = np.hypot(*(np.subtract.outer(xy_m[:, k], xy_m[:, k]) for k in (0, 1))) / (
        LENS_LENGTH_SHARE * contact_radius_m
    )
    lens = lens_m / sd[:, 0]
    places = together + np.outer(lens, lens) * np.exp(-0.5 * apart**2)
    covariances = [
        own + size**2 * moved / np.outer(one, one)
        for own, size, one in (
            (places, noise.acceleration_m_per_s2, sd[:, 0]),
            (together, noise.spin_rad_per_s2, sd[:, 1]),
        )
    ]
    return SequenceNoise(*(np.linalg.inv(np.linalg.cholesky(c)) for c in covariances))
