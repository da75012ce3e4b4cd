"""Noise that grows with the Host's speed: frames at scattered times, or markers that are smeared.

A frame that is late moves a body along its way; a marker smeared over the exposure is found less well in any direction.
The squares of the Host's residual tell the two apart: along each axis ``noise^2 + jitter^2 v_axis^2 + blur^2 |v|^2``.
Each run has a noise of its own: a short run under a strong random drive leaves more of its path, and goes faster.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.runs import Run
from analysis.gap.by_run import ByRun
from analysis.gap.finding import Finding, judge
from analysis.gap.series import Series
from analysis.gap.thresholds import NEGLIGIBLE_FRAMES, SIGNIFICANCE
from analysis.motion.host_fit import fit_host_motion
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Residuals of the Host beyond this are outliers, not jitter: one in 16,000 of Gaussian ones.
CLIP_SD = 4.0
# How well a scatter is known from a drawn one of its size, beside its own noise: with it the true one lies in the 90 %
# interval in 22 of 24 series (three drives, four runs each; errors of 0.3 % on the mean, 8.7 % at most).
SHARE_OF_SIZE = 0.02
# Runs that are drawn: what a fit takes is much the same in all.  The lesser of the two squares is drawn as this share
# of the greater at the least; where a unit of jitter and one of blur are seen as nearly alike as this (condition), what
# is drawn tells neither from the other.
DRAWN_RUNS, LEAST_DRAWN, MOST_ALIKE = 4, 0.01, 1e3
Pairs = list[tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class _Squares:
    """Coefficients ``sizes`` (K,) of squares that grow with the speed, their ``errors`` (sd), and what each of A axes
    says of their own noises and of these: ``information`` (A, A + K, A + K) and ``score`` (A, A + K)."""

    sizes: Array
    errors: Array
    information: Array
    score: Array

    def by_run(self, column: int, runs: NDArray[np.int64], count: int) -> ByRun:
        """What each of ``count`` runs says of one of them; ``runs`` (R,) those with axes, each with as many."""
        axes, columns = self.score.shape
        information, score = np.zeros((count, columns, columns)), np.zeros((count, columns))
        at = np.repeat(runs, axes // len(runs))
        np.add.at(information, at, self.information)
        np.add.at(score, at, self.score)
        return ByRun.of_forms(information, score, [axes + column])


def speed_noise(series: Series) -> list[Finding]:
    """``trigger_jitter`` and ``motion_blur``; nothing where no Host moves.

    Where nothing is smeared, the axis that moves most tells the jitter by itself.  The fit of the Host's path takes a
    part of either with it, and leaves some of the one in the form of the other: how much, a drawn scatter of the same
    size tells, which is fitted in the same way."""
    moving = [number for number, run in enumerate(series.runs) if run.data.host.moves]
    runs = [series.runs[number] for number in moving]
    pairs = [_residuals(run.data.host.residual, run.data.host.at(run.data.time_s, 1)) for run in runs]
    at = np.array([number for number, pair in zip(moving, pairs, strict=True) if len(pair[0])], np.int64)
    pairs = [pair for pair in pairs if len(pair[0])]
    if not pairs:
        return []
    least_s = {effect: share * series.period_s for effect, share in NEGLIGIBLE_FRAMES.items()}
    rng = np.random.default_rng(len(pairs))
    squares = _both(pairs)
    sizes, errors = squares.sizes, squares.errors
    if any(size > SIGNIFICANCE * error for size, error in zip(sizes, errors, strict=True)):
        unit = [max(float(size), LEAST_DRAWN * float(np.max(sizes))) for size in sizes]
        drawn = [_drawn(runs, np.sqrt(unit[0]), 0.0, rng), _drawn(runs, 0.0, np.sqrt(unit[1]), rng)]
        sizes, errors = _given_back(sizes, errors, drawn, _both)
    blur = _finding("motion_blur", sizes[1], errors[1], least_s["motion_blur"])
    blur = replace(blur, by_run=squares.by_run(1, at, len(series.runs)))
    if not blur.found:
        axis = int(np.argmax(np.max([np.max(np.abs(velocity), 0) for _, velocity in pairs], 0)))
        squares = _along(pairs, axis)
        sizes, errors = squares.sizes, squares.errors
        if sizes[0] > SIGNIFICANCE * errors[0]:
            drawn = [_drawn(runs, np.sqrt(sizes[0]), 0.0, rng)]
            sizes, errors = _given_back(sizes, errors, drawn, partial(_along, axis=axis))
    jitter = _finding("trigger_jitter", sizes[0], errors[0], least_s["trigger_jitter"])
    return [replace(jitter, by_run=squares.by_run(0, at, len(series.runs))), blur]


def _both(pairs: Pairs) -> _Squares:
    """Squares of jitter and blur, s^2, from two axes of each run."""
    return _variances(
        [
            (residual[:, axis], np.column_stack([velocity[:, axis] ** 2, np.sum(velocity**2, 1)]))
            for residual, velocity in pairs
            for axis in range(2)
        ]
    )


def _along(pairs: Pairs, axis: int) -> _Squares:
    """Square of the jitter, s^2, along one axis."""
    return _variances([(residual[:, axis], velocity[:, axis : axis + 1] ** 2) for residual, velocity in pairs])


def _given_back(
    sizes: Array, errors: Array, drawn: Sequence[tuple[Pairs, Pairs]], squares_of: Callable[[Pairs], _Squares]
) -> tuple[Array, Array]:
    """Squares (K,) and their sds with what the Host's fit took of them, by what it takes of the K that were ``drawn``;
    as they are where these do not show it."""
    if not all(len(pairs) for pair in drawn for pairs in pair):
        return sizes, errors
    was, seen = (np.column_stack([squares_of(pair[k]).sizes for pair in drawn]) for k in (0, 1))
    if not np.all(np.minimum(np.diag(seen), np.diag(was)) > 0) or np.linalg.cond(seen / np.diag(was)) > MOST_ALIKE:
        return sizes, errors
    true = was @ np.linalg.inv(seen)
    return true @ sizes, np.sqrt(true**2 @ errors**2)


def _drawn(runs: Sequence[Run], jitter_s: float, blur_s: float, rng: np.random.Generator) -> tuple[Pairs, Pairs]:
    """Residuals and velocities of the Host in runs that are drawn about its fitted paths, with the noise that they
    have and a jitter or blur: as drawn, and after a fit like theirs."""
    drawn, fitted = [], []
    for run in runs[:: -(-len(runs) // DRAWN_RUNS)]:
        host, time_s, sd = run.data.host, run.data.time_s, run.host_table[:, 4:]
        velocity = host.at(time_s, 1)
        off = velocity * (jitter_s * rng.standard_normal(len(time_s)))[:, None] + sd * rng.standard_normal(sd.shape)
        blur_m = blur_s * np.hypot(*velocity[:, :2].T)
        off[:, :2] += blur_m[:, None] * rng.standard_normal((len(time_s), 2))
        off[~np.isfinite(run.host_table[:, :4])] = np.nan
        again = fit_host_motion(time_s, host.at(time_s) + off, sd, host.frequency_hz or None)
        drawn.append(_residuals(off, velocity))
        fitted.append(_residuals(again.residual, again.at(time_s, 1)))
    full = [k for k, (residual, _) in enumerate(fitted) if len(residual)]
    return [drawn[k] for k in full], [fitted[k] for k in full]


def _residuals(residual: Array, velocity: Array) -> tuple[Array, Array]:
    """The Host's residual (N, 2) about its median and velocity (N, 2) in the frames that saw it."""
    ok = np.isfinite(residual[:, :2]).all(1)
    seen = residual[ok, :2]
    return seen - np.median(seen, 0) if len(seen) else seen, velocity[ok, :2]


def _finding(effect: str, size: float, error: float, negligible: float) -> Finding:
    """A scatter whose square is ``size`` with an sd of ``error``."""
    sd = float(np.sqrt(max(size, 0.0)))
    sd_error = float(np.hypot(error / (2 * max(sd, np.sqrt(error))), SHARE_OF_SIZE * sd))
    return judge(effect, {"sd_s": (sd, sd_error)}, sd, size / error, negligible)


def _variances(axes: list[tuple[Array, Array]]) -> _Squares:
    """Coefficients of the columns (N, K) that residuals (N,) of several axes and runs share, beside a noise of each
    one's own.

    By maximum likelihood (weighted regression of the squares, iterated), outliers beyond 4 sd left out; the sds allow
    for noise that is correlated from frame to frame."""
    shared = axes[0][1].shape[1]
    residual = np.concatenate([one for one, _ in axes])
    columns = np.zeros((len(residual), len(axes) + shared))
    start, at = np.zeros(columns.shape[1]), 0
    for k, (one, grows) in enumerate(axes):
        columns[at : at + len(one), k] = 1.0
        columns[at : at + len(one), len(axes) :] = grows
        start[k], at = residual_sd(one) ** 2, at + len(one)
    solution, least = start, columns @ (1e-3 * start) + 1e-16
    for _ in range(12):
        variance = np.maximum(columns @ solution, least)
        near = residual**2 < CLIP_SD**2 * variance
        weighted = columns[near] / variance[near, None]
        covariance = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
        solution = covariance @ (weighted.T @ (residual[near] ** 2 / variance[near]))
    z = residual / np.sqrt(variance)
    # Not `analysis.statistics.correlation`: outliers are left out as above, and z has the unit variance just fitted.
    lag = float(np.clip(np.mean(z[1:] * z[:-1] * (near[1:] & near[:-1])), 0.0, 0.9))
    # The squares of Gaussian noise have variance 2, and the square of its correlation.
    per_frame = 2 * (1 + lag**2) / (1 - lag**2)
    errors = np.sqrt(per_frame * np.diag(covariance)[len(axes) :])
    axis, square = np.repeat(np.arange(len(axes)), [len(one) for one, _ in axes])[near], (residual**2 / variance)[near]
    rows = [(weighted[axis == k], square[axis == k]) for k in range(len(axes))]
    information = np.array([one.T @ one for one, _ in rows]) / per_frame
    score = np.array([one.T @ each for one, each in rows]) / per_frame
    return _Squares(solution[len(axes) :], errors, information, score)
