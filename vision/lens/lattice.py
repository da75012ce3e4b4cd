"""A lattice of uniform cubic B-splines over the part of a sensor where markers went."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Knots: splines 150 px apart follow waves of 1,000 px to a thousandth of their height, 250 px apart to a hundredth.
SPACING_PX = 150.0
MOST_SPLINES = 200  # over a larger part of a sensor they stand further apart


@dataclass(frozen=True)
class Lattice:
    """Sites (i, j) ``spacing_px`` for ``first_u`` <= i < ``first_u`` + ``n_u`` and alike along v; sensor pixels.

    Sites lie at multiples of the spacing on the sensor, wherever the window is.
    """

    spacing_px: float
    first_u: int
    first_v: int
    n_u: int
    n_v: int

    @property
    def size(self) -> int:
        """Splines of the lattice."""
        return self.n_u * self.n_v

    @property
    def sites_px(self) -> Array:
        """Where the splines stand, (size, 2), u slower than v."""
        u = self.spacing_px * (self.first_u + np.arange(self.n_u))
        v = self.spacing_px * (self.first_v + np.arange(self.n_v))
        return np.stack(np.meshgrid(u, v, indexing="ij"), -1).reshape(-1, 2)

    def nodes_px(self, per_site: int) -> Array:
        """Pixels (n, 2) of a grid with ``per_site`` steps per spacing, from the first site that is surrounded to the
        last.
        """
        axes = [
            self.spacing_px * (first + np.linspace(1, n - 2, per_site * (n - 3) + 1))
            for first, n in ((self.first_u, self.n_u), (self.first_v, self.n_v))
        ]
        return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 2)

    def basis(self, uv_px: Array) -> Array:
        """Value of every spline at pixels (n, 2): (n, size).  Pixels beyond the lattice see its edge."""
        along_u = _splines(uv_px[:, 0] / self.spacing_px - self.first_u, self.n_u)
        along_v = _splines(uv_px[:, 1] / self.spacing_px - self.first_v, self.n_v)
        return (along_u[:, :, None] * along_v[:, None, :]).reshape(len(uv_px), self.size)


def lattice_over(uv_px: Array) -> Lattice:
    """The finest lattice whose splines cover all pixels (n, 2); NaN is left out."""
    low, high = np.nanmin(uv_px, 0), np.nanmax(uv_px, 0)
    spacing = SPACING_PX
    while True:
        first = np.floor(low / spacing).astype(int) - 1
        n_u, n_v = np.floor(high / spacing).astype(int) + 3 - first
        if n_u * n_v <= MOST_SPLINES:
            return Lattice(spacing, int(first[0]), int(first[1]), int(n_u), int(n_v))
        spacing *= 1.1


def _splines(at: Array, n: int) -> Array:
    """Cubic B-splines about 0 .. n - 1 at ``at`` (m,), in units of the spacing: (m, n)."""
    at = np.clip(at, 1.0, n - 2.0 - 1e-9)  # beyond it not all four splines are there
    cell = np.floor(at).astype(int)
    t = at - cell
    four = np.stack([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], -1) / 6
    out = np.zeros((len(at), n))
    out[np.arange(len(at))[:, None], cell[:, None] + np.arange(-1, 3)] = four
    return out
