"""What a flight's frames say of a force of unknown form: how far it has moved the disk by any moment, and what stays
open.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.flights.equation.model import STATES
from analysis.flights.noise import FlightNoise, alike, cells, response

Array = NDArray[np.float64]

# Ridges, absolute and relative, that keep an angle which nobody measured from a singular matrix: rounding's size.
RIDGE, RELATIVE_RIDGE = 1e-12, 1e-11


class ForcePath:
    """Best linear prediction of a flight under an unknown force, about a path without it that lies near the frames.

    ``white``: whitening of places and of angles; ``residual`` (N, 3) of the frames against that path, ``rows`` (N, 3,
    6) their derivatives with respect to its start state.  Under the force the state is another, ``step`` (6,) from that
    path's, ``covariance`` (6, 6); friction turns with the velocity, and the path from that state alone would lie where
    no derivative of it holds."""

    def __init__(
        self, noise: FlightNoise, times_s: Array, white: tuple[Array, Array], residual: Array, rows: Array
    ) -> None:
        self.noise, self.zero_s, self.times_s = noise, float(times_s[0]), times_s
        self.roots = (white[0], white[0], white[1])
        self.sizes = (noise.acceleration_m_per_s2, noise.acceleration_m_per_s2, noise.spin_rad_per_s2)
        self.rows = [root @ rows[:, m] for m, root in enumerate(self.roots)]
        missed = [root @ residual[:, m] for m, root in enumerate(self.roots)]
        information = np.sum([one.T @ one for one in self.rows], 0)
        # Unit diagonal first: an angle that nobody saw has twenty orders of magnitude less information than a place.
        size = np.sqrt(np.diag(information) + RIDGE)
        unit = information / np.outer(size, size) + RELATIVE_RIDGE * np.eye(STATES)
        self.covariance = np.linalg.inv(unit) / np.outer(size, size)
        self.step = self.covariance @ np.sum([a.T @ b for a, b in zip(self.rows, missed, strict=True)], 0)
        self.residual = [b - a @ self.step for a, b in zip(self.rows, missed, strict=True)]

    @property
    def misfit(self) -> float:
        """Sum of squares of the residuals turned into independent ones."""
        return float(np.sum([one @ one for one in self.residual]))

    def states_at(self, times_s: Array, out: Array, derivative: Array) -> Array:
        """States (n, 6) at ``times_s`` from those of the path without the force (``out``, ``derivative``)."""
        cross, _, _ = self._responses(times_s)
        states = out + derivative @ self.step
        for at, white, m in self._whitened(cross):
            states[:, at] += white @ self.residual[m]
        return states

    def at(self, times_s: Array, out: Array, derivative: Array) -> tuple[Array, Array]:
        """States and covariances at ``times_s`` from those of the path without the force (``out``, ``derivative``)."""
        cross, together, moved = self._responses(times_s)
        prior = moved @ together @ moved.transpose(0, 2, 1)
        states, open_rows = out + derivative @ self.step, derivative.copy()
        spread = np.zeros((len(times_s), STATES, STATES))
        for at, white, m in self._whitened(cross):
            states[:, at] += white @ self.residual[m]
            open_rows[:, at] -= white @ self.rows[m]
            spread[np.ix_(np.arange(len(times_s)), at, at)] = self.sizes[m] ** 2 * prior - white @ white.transpose(
                0, 2, 1
            )
        return states, spread + open_rows @ self.covariance @ open_rows.transpose(0, 2, 1)

    def _responses(self, times_s: Array) -> tuple[Array, Array, Array]:
        """Covariance (n, 2, N) of place and velocity at ``times_s`` with the frames' displacements under a unit force,
        how its cells go together, and what each moves by then."""
        inside = len(times_s) > 0 and times_s[0] >= self.times_s[0] and times_s[-1] <= self.times_s[-1]
        edges, together, to_own = self._own_cells if inside else self._cells(times_s)
        moved = np.stack(response(times_s, self.zero_s, edges), 1)
        return moved @ to_own, together, moved

    @cached_property
    def _own_cells(self) -> tuple[Array, Array, Array]:
        return self._cells(None)

    def _cells(self, times_s: Array | None) -> tuple[Array, Array, Array]:
        """Edges of the cells that cover the frames and ``times_s``, how the cells go together (C, C), and with the
        frames' displacements (C, N)."""
        edges = cells(self.times_s, self.noise.memory_s, times_s)
        together = alike(edges, self.noise.memory_s)
        own, _ = response(self.times_s, self.zero_s, edges)
        return edges, together, together @ own.T

    def _whitened(self, cross: Array) -> Iterator[tuple[NDArray[np.int64], Array, int]]:
        """Of each coordinate that the force moves: its two states, ``cross`` with whitened frames, its number."""
        for m, (root, size) in enumerate(zip(self.roots, self.sizes, strict=True)):
            if size > 0.0:
                yield np.array([m, m + 3]), size**2 * cross @ root.T, m
