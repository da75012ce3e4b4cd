"""What the flights of a run say about the parameters that all flights share, as one quadratic form.

Shared unknowns - floor friction, every effect and probe of :mod:`analysis.flight_model`, the markers' origin against the centre of
mass, the lens residual - enter linearised about the current fit.  Eliminating each flight's own start state (Schur complement) leaves
``misfit - 2 d.score + d.information.d`` per run, on which candidates are fitted, ranked and cross-validated by linear algebra
alone.  Neighbouring frames' errors are correlated (AR(1)); residuals are whitened before they are squared.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from analysis.compiled import compiled
from analysis.flight_model import INDEX, PARAMETERS, STATES, fly_with_derivatives
from analysis.flights import ORIGIN, SHARED, WARP_POWERS, FlightFits, _arguments, warp_basis

Array = NDArray[np.float64]

# Steps of the differences, each in its parameter's unit: small against what matters, large against rounding.
STEPS = np.full(len(PARAMETERS), 1e-3)
STEPS[INDEX["coupling"]] = -1e-2
STEPS[INDEX["load"]] = 1e-2
STEPS[INDEX["magnus"]] = 1e-5

# A flight whose misfit per degree of freedom is this many times the run's median holds something else than flight (a hidden
# impact, a wrong track); it is counted and left out, not allowed to speak for the floor.
OUTLYING_FLIGHT = 8.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """Quadratic form of one run in the shared unknowns ``columns`` (indices into ``SHARED``).

    ``count`` observations, ``flights`` used, ``left_out`` flights (too much misfit); ``lag_product`` and ``lag_square`` sums of neighbouring
    frames' residuals' products and mean squares, ``lengths`` the frames of each flight used."""

    columns: tuple[int, ...]
    information: Array
    score: Array
    misfit: float
    count: int
    flights: int
    left_out: int
    lag_product: float
    lag_square: float
    lengths: tuple[int, ...]

    @property
    def lag_one(self) -> float:
        """Correlation of neighbouring frames' residuals."""
        return self.lag_product / self.lag_square if self.lag_square > 0 else 0.0

    def take(self, columns: Sequence[int]) -> tuple[Array, Array]:
        """Information and score of a subset of the columns."""
        at = [self.columns.index(c) for c in columns]
        return self.information[np.ix_(at, at)], self.score[at]


def gather(fits: FlightFits, columns: Sequence[int], correlation: float = 0.0, median_misfit: float | None = None) -> Evidence:
    """The quadratic form of one run at its fitted flights (``correlation`` of neighbouring frames' errors)."""
    run = fits.run
    columns = tuple(columns)
    free = np.array([c for c in columns if c < len(PARAMETERS)], np.int64)
    offsets = np.array([c - len(PARAMETERS) for c in columns if c >= len(PARAMETERS)], np.int64)
    total = np.zeros((len(columns), len(columns)))
    score = np.zeros(len(columns))
    sums = np.zeros(4)
    ratio = fits.misfit / np.maximum(fits.freedom, 1)
    usual = median_misfit if median_misfit is not None else (float(np.median(ratio[fits.freedom > 0])) if np.any(fits.freedom > 0) else 1.0)
    good = (ratio < OUTLYING_FLIGHT * max(usual, 0.3)) & (fits.freedom >= 3)
    parameters = fits.parameters.copy()
    lengths = []
    for k in np.flatnonzero(good):
        f = fits.flights[k]
        parameters[INDEX["impact_before_s"]] = impact_before(fits, int(k))
        index = np.arange(f.first, f.last + 1)
        index = index[np.isfinite(run.xy_m[index, 0])]
        lengths.append(len(index))
        observed = np.column_stack([run.xy_m[index], run.angle_rad[index]])
        sd = np.column_stack([run.xy_sd_m[index], run.xy_sd_m[index], run.angle_sd_rad[index]])
        _flight_evidence(fits.states[k], fits.reference_s[k], run.time_s[index], index, observed, sd, parameters, fits.shared,
                         warp_basis(run.xy_m[index], run.contact_radius_m), free, STEPS[free], offsets, len(WARP_POWERS), correlation,
                         *_arguments(run), total, score, sums)
    # The columns of the model's parameters come first in the loops below, the observation's after them.
    return Evidence(columns, total, score, float(sums[0]), int(sums[1]), int(good.sum()), int((~good).sum()), float(sums[2]), float(sums[3]),
                    tuple(lengths))


def impact_before(fits: FlightFits, k: int) -> float:
    """When flight ``k`` began, if at an impact that ended the flight before; long ago otherwise."""
    started = k > 0 and fits.flights[k - 1].joined
    return float(fits.run.time_s[fits.flights[k].first]) if started else -1e6


@compiled
def _flight_evidence(state: Array, t0: float, time: Array, index: NDArray[np.int64], observed: Array, sd: Array, parameters: Array,
                     shared: Array, basis: Array, free: NDArray[np.int64], steps: Array, offsets: NDArray[np.int64], n_warp: int,
                     correlation: float, harmonics: Array, omega: float, radius: float, inertia: float, contact_radius: float,
                     phase: float, total: Array, score: Array, sums: Array) -> None:
    n, n_free, n_off = len(time), len(free), len(offsets)
    width = STATES + n_free + n_off
    out, derivative = np.empty((n, STATES)), np.empty((n, STATES, STATES + n_free))
    fly_with_derivatives(state, t0, time, parameters, free, steps, harmonics, omega, radius, inertia, contact_radius, phase, out,
                         derivative)
    rows, residual = np.zeros((n, 3, width)), np.zeros((n, 3))
    for i in range(n):
        c, s = np.cos(out[i, 2]), np.sin(out[i, 2])
        model_x = out[i, 0] + c * shared[0] - s * shared[1]
        model_y = out[i, 1] + s * shared[0] + c * shared[1]
        for w in range(n_warp):
            model_x += basis[i, w] * shared[2 + w]
            model_y += basis[i, w] * shared[2 + n_warp + w]
        residual[i, 0] = observed[i, 0] - model_x
        residual[i, 1] = observed[i, 1] - model_y
        residual[i, 2] = observed[i, 2] - out[i, 2]
        for m in range(3):
            for j in range(STATES + n_free):
                rows[i, m, j] = derivative[i, m, j]
        rows[i, 0, 2] -= s * shared[0] + c * shared[1]
        rows[i, 1, 2] += c * shared[0] - s * shared[1]
        for j in range(n_off):
            at = STATES + n_free + j
            o = offsets[j]
            if o == 0:
                rows[i, 0, at], rows[i, 1, at] = c, s
            elif o == 1:
                rows[i, 0, at], rows[i, 1, at] = -s, c
            elif o < 2 + n_warp:
                rows[i, 0, at] = basis[i, o - 2]
            else:
                rows[i, 1, at] = basis[i, o - 2 - n_warp]
        for m in range(3):
            w = 1.0 / sd[i, m]
            if abs(residual[i, m]) * w > 6.0:
                w *= 6.0 / (abs(residual[i, m]) * w)
            residual[i, m] *= w
            for j in range(width):
                rows[i, m, j] *= w
    for i in range(1, n):
        if index[i] == index[i - 1] + 1:
            for m in range(3):
                sums[2] += residual[i, m] * residual[i - 1, m]
                sums[3] += 0.5 * (residual[i, m] ** 2 + residual[i - 1, m] ** 2)
    if correlation != 0.0:
        for i in range(n - 1, 0, -1):
            rho = correlation ** (index[i] - index[i - 1])
            scale = 1.0 / np.sqrt(1.0 - rho * rho)
            for m in range(3):
                residual[i, m] = (residual[i, m] - rho * residual[i - 1, m]) * scale
                for j in range(width):
                    rows[i, m, j] = (rows[i, m, j] - rho * rows[i - 1, m, j]) * scale
    _without_states(rows.reshape(n * 3, width), residual.reshape(n * 3), total, score, sums)


@compiled
def _without_states(rows: Array, residual: Array, total: Array, score: Array, sums: Array) -> None:
    """Add what whitened ``rows`` (3 n, STATES + shared) tell of the shared unknowns once the flight's own state is solved for."""
    local = np.ascontiguousarray(rows[:, :STATES])
    outer = np.ascontiguousarray(rows[:, STATES:])
    normal = local.T @ local
    size = np.empty(STATES)
    for a in range(STATES):
        normal[a, a] += 1e-10 * normal[a, a] + 1e-12
        size[a] = np.sqrt(normal[a, a])
    # Unit diagonal first: an angle that nobody saw has twenty orders of magnitude less information than a place.
    inverse = np.linalg.inv(normal / np.outer(size, size)) / np.outer(size, size)
    # What is left of the rows, squared: the difference of the squares may come out below zero.
    left = outer - local @ (inverse @ (local.T @ outer))
    unexplained = residual - local @ (inverse @ (local.T @ residual))
    total += left.T @ left
    score += left.T @ unexplained
    sums[0] += np.dot(unexplained, unexplained)
    sums[1] += len(residual) - STATES


def columns_of(names: Sequence[str]) -> list[int]:
    """Indices into ``SHARED``; those of the flight model come first, as :func:`gather` orders them."""
    indices = [SHARED.index(name) for name in names]
    return sorted(indices)


def solve(evidence: Sequence[Evidence], columns: Sequence[int], prior: Array) -> tuple[Array, Array, float]:
    """Estimate, covariance and gain (fall of -2 log L) of the shared unknowns ``columns`` over runs; ``prior`` their 1/variance."""
    information = np.diag(np.asarray(prior, float))
    score = np.zeros(len(columns))
    for e in evidence:
        a, b = e.take(columns)
        information = information + a
        score = score + b
    covariance = covariance_of(information)
    score = np.where(np.diag(covariance) > 0, score, 0.0)
    estimate = covariance @ score
    return estimate, covariance, float(estimate @ score)


def covariance_of(information: Array) -> Array:
    """Inverse of an information matrix, scaled to a unit diagonal first, with a whisper of ridge; a column without information has no
    variance either (its unknown keeps its value)."""
    diagonal = np.diag(information)
    told = np.isfinite(diagonal) & (diagonal > 0)
    scale = np.where(told, 1 / np.sqrt(np.where(told, diagonal, 1.0)), 0.0)
    scaled = np.where(np.outer(told, told), information, 0.0) * np.outer(scale, scale)
    return np.linalg.inv(scaled + 1e-11 * np.eye(len(scale))) * np.outer(scale, scale)


NUISANCE_ORIGIN = columns_of(ORIGIN)
