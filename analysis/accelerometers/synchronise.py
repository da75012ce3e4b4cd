"""The record's clock against the cameras': offset and scale that make the record, integrated twice, follow the Host.

Both displacements lose what is slower than the drive by the same projection (a spline whose knots lie one period
apart), so that neither a sensor's drift nor a world that moved counts.  The path that is left is linear in each
channel's gain, and the clock follows from Gauss-Newton steps.  Standard deviations come from leaving out blocks of the
run, one at a time: noise that is correlated within a block counts as what it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, CubicSpline
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.signal import fftconvolve

from analysis.statistics.correlation import slow_mean

Array = NDArray[np.float64]
STEPS = 8  # of Gauss and Newton; three or four do
SETTLED = 1e-6  # of a period: the last step of all
BLOCKS = 20  # of the run, for standard deviations
LEAST_OVERLAP = 0.5  # of the shorter of run and record
MOST_OFF = 2e-3  # clocks of cameras and cards differ by 1e-4 at most; a wrong rate is reported by `ovines check`
MOST_TRIED, NEAREST = 24, 6  # offsets: those that correlate best, and those nearest to what is stated
# Another offset is ruled out where it leaves more by so many sd of the frames' noise, and by this share: the record's
# own noise, integrated, differs from offset to offset, too.
CLEAR, CLEAR_SHARE = 5.0, 0.25
LEAST_SHARE = 0.5  # of the Host's displacement that a record must follow to be this run's


class SlowPart:
    """What is slower than the drive: the cubic spline of knots ``apart_s`` apart that fits best."""

    def __init__(self, time_s: Array, apart_s: float) -> None:
        self.time_s = time_s
        knots = np.arange(time_s[0] + apart_s, time_s[-1] - 0.5 * apart_s, apart_s)
        kept, last = [], 0
        for knot, place in zip(knots, np.searchsorted(time_s, knots), strict=True):
            if place - last >= 4 and len(time_s) - place >= 4:  # gaps: a piece needs frames to stand on
                kept.append(knot)
                last = place
        ends = [time_s[0]] * 4, [time_s[-1]] * 4
        self.design = BSpline.design_matrix(time_s, np.concatenate([ends[0], kept, ends[1]]), 3)
        normal = (self.design.T @ self.design).tocsr()
        banded = np.zeros((4, normal.shape[0]))  # a spline overlaps three others
        for below in range(4):
            banded[below, : normal.shape[0] - below] = normal.diagonal(-below)
        banded[0] += 1e-12 * banded[0].max()
        self.factor = cholesky_banded(banded, lower=True)

    def without(self, values: Array) -> Array:
        """``values`` (N, ...) less their slow part."""
        flat = values.reshape(len(values), -1)
        slow = self.design @ cho_solve_banded((self.factor, True), self.design.T @ flat)
        return np.asarray(flat - slow).reshape(values.shape)


@dataclass(frozen=True, eq=False)
class Clock:
    """``time of the cameras = offset_s + scale * time of the record``, and what the fit says of it.

    ``middle_sd_s``: of that time in the middle of the run; ``gain`` (channels,): the Host's displacement over the
    record's; ``others_s``: further offsets that fit as well; ``share`` (channels,) of the Host's displacement that the
    record follows.
    """

    offset_s: float
    offset_sd_s: float
    scale: float
    scale_sd: float
    middle_sd_s: float
    gain: Array
    gain_sd: Array
    share: Array
    others_s: tuple[float, ...]

    def record_time_s(self, time_s: Array) -> Array:
        """Times of the record at times of the cameras."""
        return np.asarray((time_s - self.offset_s) / self.scale)


class Integrated:
    """The record as velocity and displacement at any time of its own clock, (n, channels); its mean and the drift of
    its integrals count for nothing.
    """

    def __init__(self, time_s: Array, acceleration_m_per_s2: Array) -> None:
        self.first_s, self.last_s = float(time_s[0]), float(time_s[-1])
        whole = CubicSpline(time_s, acceleration_m_per_s2 - acceleration_m_per_s2.mean(0))
        self.velocity, self.displacement = whole.antiderivative(1), whole.antiderivative(2)


@dataclass(frozen=True, eq=False)
class _Fit:
    """A fit from one offset: parameters (u, k, gains), residuals and Jacobian (channels, N, ...) in their sd."""

    values: Array
    residual: Array
    jacobian: Array
    inside: NDArray[np.bool_]
    share: Array

    @property
    def sign(self) -> int:
        """1 where all channels that follow the Host do so, -1 where all follow it turned round, else 0."""
        signs = np.sign(self.values[2:][self.share >= LEAST_SHARE])
        return 0 if not len(signs) or np.any(signs != signs[0]) else int(signs[0])


def synchronise(
    time_s: Array, displacement_m: Array, record: Integrated, period_s: float, start_s: float
) -> Clock | None:
    """The clock that makes the record follow the Host; None where it follows no part of the run.  Negative gains:
    no offset is as good as one with which the record follows the Host turned round.

    Parameters
    ----------
    time_s : (N,) of the cameras
    displacement_m : (N, channels) of the Host along each channel
    record : integrated, by the stated sensitivities
    period_s : of what is strongest in the Host's motion
    start_s : the cameras' time at the record's time 0, as far as known
    """
    middle_s = _middle(time_s)
    tried: list[tuple[float, float]] = []
    longest = min(time_s[-1] - time_s[0], record.last_s - record.first_s)
    step = period_s / (4 * longest)
    for k in 1 + step * np.arange(-int(MOST_OFF / step), int(MOST_OFF / step) + 1):
        tried += [(u, k) for u in _alike(time_s, displacement_m, record, period_s, k, middle_s, start_s)]
    fits = [_fitted(time_s, displacement_m, record, period_s, one) for one in tried]
    fine = [one for one in fits if one is not None and one.sign]
    if not fine:
        return None
    cost = [float(np.mean(one.residual**2)) for one in fine]
    best = fine[int(np.argmin(cost))]
    stated = [abs(middle_s - one.values[1] * one.values[0] - start_s) for one in fine]
    near = 0.25 * period_s

    def again(fit: _Fit, frames: NDArray[np.bool_]) -> _Fit | None:
        start = (float(fit.values[0] + (_middle(time_s[frames]) - middle_s) / fit.values[1]), float(fit.values[1]))
        return _fitted(time_s[frames], displacement_m[frames], record, period_s, start)

    alike = [one for one in fine if not _clearly_worse(one, best, again)]
    alike = [one for one in alike if one.sign > 0] or alike
    chosen = alike[int(np.argmin([stated[fine.index(one)] for one in alike]))]
    others: list[float] = []
    for one in alike:
        offset = float(middle_s - one.values[1] * one.values[0])
        known = [float(middle_s - chosen.values[1] * chosen.values[0]), *others]
        if min(abs(offset - other) for other in known) > near:
            others.append(offset)
    return _clock(chosen, middle_s, tuple(sorted(others)))


def _middle(time_s: Array) -> float:
    return 0.5 * float(time_s[0] + time_s[-1])


def _alike(
    time_s: Array, displacement_m: Array, record: Integrated, period_s: float, k: float, middle_s: float, start_s: float
) -> list[float]:
    """Times of the record at the cameras' middle for which both displacements correlate: peaks over the offset."""
    step = float(np.median(np.diff(time_s)))
    grid = np.arange(time_s[0], time_s[-1], step)
    host = np.stack([np.interp(grid, time_s, one) for one in displacement_m.T], -1)
    own = np.arange(record.first_s, record.last_s, step / k)
    if min(len(grid), len(own)) < 16:
        return []
    host = SlowPart(grid, period_s).without(host)
    moved = SlowPart(own, period_s).without(record.displacement(own))
    ones = fftconvolve(np.ones(len(grid)), np.ones(len(own)))
    score = np.zeros(len(grid) + len(own) - 1)
    for x, s in zip(host.T, moved.T, strict=True):
        both = fftconvolve(x, s[::-1])
        power = fftconvolve(x**2, np.ones(len(s))) * fftconvolve(np.ones(len(x)), s[::-1] ** 2)
        alike = both / np.sqrt(np.maximum(power, 1e-12 * power.max()))
        score += np.mean(x**2) * alike * np.abs(alike)  # against each other counts against
    score = np.abs(score)  # what fits turned round is reported, too
    score[ones < LEAST_OVERLAP * min(len(grid), len(own))] = 0.0
    peaks = 1 + np.flatnonzero((score[1:-1] >= score[:-2]) & (score[1:-1] > score[2:]) & (score[1:-1] > 0))
    # sample i of the record lies at sample i + peak - (len(own) - 1) of the grid
    times = record.first_s + (middle_s - grid[0] - step * (peaks - (len(own) - 1))) / k
    by_score = np.argsort(-score[peaks])[:MOST_TRIED]
    by_place = np.argsort(np.abs(middle_s - k * times - start_s))[:NEAREST]
    return [float(times[i]) for i in sorted({*by_score.tolist(), *by_place.tolist()})]


def _fitted(
    time_s: Array,
    displacement_m: Array,
    record: Integrated,
    period_s: float,
    start: tuple[float, float],
) -> _Fit | None:
    """Gauss-Newton steps from a time of the record at the cameras' middle, and a scale."""
    u, k = start
    middle_s, fit = _middle(time_s), None
    for _ in range(STEPS):
        at = u + (time_s - middle_s) / k
        inside = (at >= record.first_s) & (at <= record.last_s)
        if inside.sum() < max(16, LEAST_OVERLAP * min(len(time_s), (record.last_s - record.first_s) * k / np.median(
            np.diff(time_s)
        ))):  # fmt: skip
            return None
        slow = SlowPart(time_s[inside], period_s)
        since = time_s[inside] - middle_s
        x = slow.without(displacement_m[inside])
        s = k**2 * record.displacement(at[inside])
        v = record.velocity(at[inside])
        s, by_u, by_k = slow.without(s), slow.without(k**2 * v), slow.without(2 * s / k - v * since[:, None])
        power = np.sum(s**2, 0)
        if np.any(power == 0):
            return None
        gain = np.sum(x * s, 0) / power
        left = x - gain * s
        sd = np.maximum(np.sqrt(np.mean(left**2, 0)), 1e-12)
        count = x.shape[1]
        jacobian = np.zeros((count, len(since), 2 + count))
        for c in range(count):
            jacobian[c, :, 0], jacobian[c, :, 1] = gain[c] * by_u[:, c] / sd[c], gain[c] * by_k[:, c] / sd[c]
            jacobian[c, :, 2 + c] = s[:, c] / sd[c]
        residual = (left / sd).T
        share = 1 - np.sum(left**2, 0) / np.maximum(np.sum(x**2, 0), 1e-300)
        fit = _Fit(np.concatenate([[u, k], gain]), left.T, jacobian, inside, share)
        flat = jacobian.reshape(-1, 2 + count)
        size = np.linalg.norm(flat, axis=0)
        scaled = flat / size
        move = np.linalg.lstsq(scaled.T @ scaled, scaled.T @ residual.ravel(), rcond=1e-12)[0] / size
        if abs(move[0]) < SETTLED * period_s:
            break
        # a step beyond a quarter of a period, or of all clocks, is none
        u += float(np.clip(move[0], -0.25 * period_s, 0.25 * period_s))
        k = float(np.clip(k + move[1], 1 - 2 * MOST_OFF, 1 + 2 * MOST_OFF))
    return fit


def _clearly_worse(one: _Fit, best: _Fit, again: Callable[[_Fit, NDArray[np.bool_]], _Fit | None]) -> bool:
    """Whether frames that both have, each fitted ``again`` to these alone, prefer ``best`` by more than noise does that
    is correlated as its residuals are."""
    if one is best:
        return False
    both = one.inside & best.inside
    if both.sum() < LEAST_OVERLAP * best.inside.sum():
        return True
    other, own = again(one, both), again(best, both)
    if other is None or own is None or other.residual.shape != own.residual.shape:
        return True
    more, share = 0.0, 0.0
    for theirs, left in zip(other.residual, own.residual, strict=True):
        power = max(float(np.sum(left**2)), 1e-300)
        more += (float(np.sum(theirs**2)) - power) / (power / len(left) * slow_mean(left, np.inf) ** 2)
        share = max(share, float(np.sum(theirs**2)) / power - 1)
    return more > CLEAR**2 and share > CLEAR_SHARE


def _clock(fit: _Fit, middle_s: float, others_s: tuple[float, ...]) -> Clock:
    """The fit with standard deviations from its blocks."""
    u, k, gain = fit.values[0], fit.values[1], fit.values[2:]
    sd = np.maximum(np.sqrt(np.mean(fit.residual**2, 1)), 1e-300)
    weighted = fit.residual / sd[:, None]
    blocks = np.array_split(np.arange(weighted.shape[1]), BLOCKS)
    normal = np.array([np.einsum("cni,cnj->ij", fit.jacobian[:, b], fit.jacobian[:, b]) for b in blocks])
    slope = np.array([np.einsum("cni,cn->i", fit.jacobian[:, b], weighted[:, b]) for b in blocks])
    without = zip(normal.sum(0) - normal, slope.sum(0) - slope, strict=True)
    moved = np.array([np.linalg.lstsq(n, g, rcond=1e-12)[0] for n, g in without])
    offset = middle_s - (k + moved[:, 1]) * (u + moved[:, 0])
    factor = np.sqrt((BLOCKS - 1) / BLOCKS)

    def spread(values: Array) -> Array:
        return np.asarray(factor * np.sqrt(np.sum((values - values.mean(0)) ** 2, 0)))

    return Clock(
        float(middle_s - k * u), float(spread(offset)), float(k), float(spread(moved[:, 1])),
        float(k * spread(moved[:, 0])), gain, spread(moved[:, 2:]), fit.share, others_s,
    )  # fmt: skip
