"""The Host's motion: harmonics of the drive, further lines and a smooth path, and their path at any time."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from analysis.motion.host_lines import (
    basis,
)
from analysis.motion.host_table import PLACE_MISS, RATE_MISS, HostTable, quintics
from analysis.motion.smooth_path import SmoothPath

Array = NDArray[np.float64]
AXES = ("x", "y", "z", "angle")
# How well a table's pieces follow a line: its place (m, rad), and its share of all lines' accelerations.
TABLE_M, TABLE_SHARE = 5e-11, 5e-7
# A table goes on beyond a run's frames by this share of its length.
TABLE_MARGIN = 0.05
#: pieces of the shortest table: one line between two of them is slower than all of them
FEWEST_PIECES = 4


@dataclass(frozen=True, eq=False)
class HostMotion:
    """Motion of the Host in one run, each time in s, places in m, angles in rad.

    ``harmonics`` (4, 1 + 2 K): per axis x, y, z, angle: mean, cos and sin of k omega t; ``omega_rad_per_s`` of the
    main line (0 where there is none) with its sd; ``residual_sd`` (4,): robust spread of ``residual`` (N, 4), what is
    left per frame;
    ``phase_rad``: the drive's phase at ``zero_s``, of a sine along the axis that moves most; ``zero_s``: the time t
    from which the phases count (0 in the rig's frame).

    ``lines_rad_per_s`` (L,) with ``line_coefficients`` (4, 2 L), cos and sin: further lines; ``smooth``: per axis the
    path that no line explains, None where the lines leave only noise.  ``line_covariance`` (4, P, P) of each axis'
    mean, harmonics and lines (P = 1 + 2 K + 2 L; none: taken as exact).
    """

    harmonics: Array
    omega_rad_per_s: float
    omega_sd_rad_per_s: float
    residual_sd: Array
    phase_rad: float
    residual: Array
    zero_s: float = 0.0
    lines_rad_per_s: Array = field(default_factory=lambda: np.zeros(0))
    line_coefficients: Array = field(default_factory=lambda: np.zeros((4, 0)))
    smooth: tuple[SmoothPath | None, ...] = (None,) * 4
    line_covariance: Array | None = None

    @property
    def frequency_hz(self) -> float:
        """Of the main line."""
        return self.omega_rad_per_s / (2 * np.pi)

    @property
    def amplitude_m(self) -> float:
        """Of the main line along the axis that moves most."""
        if self.harmonics.shape[1] < 3:
            return 0.0
        return float(np.hypot(self.harmonics[:2, 1], self.harmonics[:2, 2]).max())

    @property
    def moves(self) -> bool:
        """Whether it does not stand still."""
        return bool(self.omega_rad_per_s or len(self.lines_rad_per_s) or any(self.smooth))

    @property
    def harmonic(self) -> bool:
        """Whether its harmonics are all there is."""
        return not len(self.lines_rad_per_s) and not any(self.smooth)

    @cached_property
    def omegas(self) -> Array:
        """Frequencies (rad/s) of every line: harmonics of the main one first."""
        overtones = (self.harmonics.shape[1] - 1) // 2
        return np.concatenate([self.omega_rad_per_s * np.arange(1, overtones + 1), self.lines_rad_per_s])

    @cached_property
    def coefficients(self) -> Array:
        """(4, 1 + 2 L): mean, then cos and sin of every line in :attr:`omegas`."""
        return np.hstack([self.harmonics, self.line_coefficients])

    def at(self, time_s: Array, derivative: int = 0) -> Array:
        """Position, velocity or acceleration (len(time_s), 4) of x, y, z, angle."""
        time_s = np.asarray(time_s, float) - self.zero_s
        path = basis(time_s, self.omegas, derivative) @ self.coefficients.T
        for axis, one in enumerate(self.smooth):
            if one is not None:
                path[:, axis] += one.at(time_s, derivative)
        return path

    def covariance(self, time_s: Array) -> Array:
        """Covariance (len(time_s), 4, 3, 3) of position, velocity and acceleration of each axis."""
        time_s = np.asarray(time_s, float) - self.zero_s
        found = np.zeros((len(time_s), 4, 3, 3))
        if self.line_covariance is not None:
            rows = np.stack([basis(time_s, self.omegas, order) for order in range(3)], 1)
            found += np.einsum("nap,xpq,nbq->nxab", rows, self.line_covariance, rows)
        for axis, one in enumerate(self.smooth):
            if one is not None:
                found[:, axis] += one.covariance(time_s)
        return found

    def table(self, first_s: float, last_s: float) -> HostTable:
        """The path between two times (and somewhat beyond) for compiled code."""
        key = (float(first_s), float(last_s))
        if key not in self._tables:
            self._tables[key] = _table(self, *key)
        return self._tables[key]

    @cached_property
    def _tables(self) -> dict[tuple[float, float], HostTable]:
        return {}


def _table(host: HostMotion, first_s: float, last_s: float) -> HostTable:
    margin = TABLE_MARGIN * (last_s - first_s)
    first_s, last_s = first_s - margin, last_s + margin
    sizes = np.hypot(host.coefficients[:, 1::2], host.coefficients[:, 2::2])
    strongest = float(np.sum(host.omegas**2 * sizes[:2]))
    step = (last_s - first_s) / FEWEST_PIECES or 1.0
    sixth, second = sizes @ host.omegas**6, sizes @ host.omegas**2
    if np.any(sixth > 0):
        step = min(step, (TABLE_M * PLACE_MISS / sixth.max()) ** (1 / 6))
    if np.any(sixth[:3] > 0):
        step = min(step, (TABLE_SHARE * RATE_MISS * second[:3].max() / sixth[:3].max()) ** 0.25)
    paths = [one for one in host.smooth if one is not None]
    if paths:  # all have the same knots: the pieces between them are theirs
        knot, start = paths[0].knot_s, paths[0].first_s + host.zero_s
        first_s = start - knot * np.ceil((start - first_s) / knot)
        step = knot / np.ceil(knot / step)
    count = max(int(np.ceil((last_s - first_s) / step)), 1)
    knots = np.asarray(first_s + step * np.arange(count + 1), float)
    value, rate, second_rate = (host.at(knots, order) * step**order for order in range(3))
    if paths:
        strongest += float(np.linalg.norm([np.abs(one.at(knots - host.zero_s, 2)).max() for one in paths[:2]]))
    return HostTable(quintics(value, rate, second_rate), float(first_s), float(step), strongest)
