"""Candidates in the Host's path: it swings after pushes (recoil, ringing), and slow or other lines beside the drive."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.gap.drive.measured_path import MeasuredPath, whitened
from analysis.gap.drive.pushes import Pushes, RunPushes, answers
from analysis.statistics.student import student_over_normal

Array = NDArray[np.float64]
#: effects that a swing may be: the whole Host gives, or what carries its markers rings
SWINGS = ("host_recoil", "host_ringing")
# Frequencies tried: from a fraction of a period in the longest run to a share of the frame rate, so many.
LOWEST_PERIODS, HIGHEST_SHARE, FREQUENCIES = 0.5, 0.35, 48
DAMPINGS = (0.01, 0.03, 0.08, 0.2, 0.45, 0.8)
# What rings on for a hundred and fifty periods is no answer to a blow: a drive that swings as it likes was reported as
# a ringing without damping (a mass centre off the middle, random drive).
LEAST_DAMPING = 1e-3
# A line needs a spacing of this share of its width.
LINE_SPACING, LINES_TO = 0.25, 0.25
# ... and shows with this share of its power beside the drive.
LEAST_SEEN = 0.01
#: cells tried; neighbours are alike, so that the best gains less by chance than so many independent ones
CELLS = FREQUENCIES * len(DAMPINGS)
# Lines weighed together: as many as a processor's cache holds.
AT_ONCE = 32
# Steps of the differences: shares of frequency and damping.
STEP = 1e-3


@dataclass(frozen=True, eq=False)
class Swing:
    """A swing that is fitted: ``share`` (disk's mass over the one that swings) with frequency (Hz) and damping ratio,
    their covariance (3, 3), ``gain`` (fall of -2 log L) and ``held_out`` (R,), each run's by the others' share.

    Blows before a run's first frame leave it swinging: ``start`` (series' runs, 2, 2; m) are what :func:`fading` has of
    it along x and y from the times ``start_s`` (series' runs,) on; no part of the gain."""

    effect: str
    share: float
    frequency_hz: float
    damping: float
    covariance: Array
    gain: float
    held_out: Array
    start: Array
    start_s: Array

    @property
    def dies_out(self) -> bool:
        """Whether it ends before long, as what a blow has set going does."""
        return self.damping > LEAST_DAMPING

    def places(self, pushes: Sequence[RunPushes], run: int, time_s: Array) -> Array:
        """What it does to the Host (N, 2) at times (N,) of a run of the series, in m."""
        hz, damping = np.array([self.frequency_hz]), np.array([self.damping])
        one = answers(_answered(self.effect, pushes[run]), time_s, hz, damping)
        began = fading(time_s - self.start_s[run], hz, damping)
        return np.asarray(self.share * one[..., 0] + began[..., 0] @ self.start[run])


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


def _answered(effect: str, run: RunPushes) -> Pushes:
    """The pushes that a swing answers."""
    return run.whole if effect == "host_recoil" else run.normal


def fading(time_s: Array, frequency_hz: Array, damping: Array) -> Array:
    """Cosine and sine (N, 2, G) of free swings at times (N,; s) from their start."""
    omega = 2 * np.pi * frequency_hz
    turn = time_s[:, None] * omega * np.sqrt(1 - damping**2)
    size = np.exp(-np.maximum(time_s, 0.0)[:, None] * damping * omega)
    return np.stack([size * np.cos(turn), size * np.sin(turn)], 1)


@dataclass(frozen=True, eq=False)
class _Began:
    """What began before a run and fades in it, as swings (G) do: whitened cosine and sine ``columns`` (M, 2, G), for a
    frame of unit variance."""

    columns: Array

    @classmethod
    def of(cls, path: MeasuredPath, hz: Array, damping: Array) -> _Began:
        return cls(path.white(fading(path.time_s - path.time_s[0], hz, damping) * path.sd.reshape(1, 2, 1)))

    @cached_property
    def inverse(self) -> Array:
        """Inverse (2, 2, G) of the columns' products."""
        return _of_pair(self.columns)[0]

    def without(self, rows: Array) -> tuple[Array, Array]:
        """``rows`` (M, 2, G) of both axes without what the start explains, and its amplitudes (2, 2, G)."""
        sizes = np.einsum("ijg,jag->iag", self.inverse, np.einsum("mjg,mag->jag", self.columns, rows))
        return rows - np.einsum("mig,iag->mag", self.columns, sizes), sizes

    def taken(self, left: Array) -> Array:
        """How much (G,) of the squares of what is ``left`` (M, 2) any start takes."""
        count, _, swings = self.columns.shape
        cosine, sine = (self.columns.reshape(count, -1).T @ left).reshape(2, swings, 2)
        squares, both = self.inverse[[0, 1], [0, 1]], self.inverse[0, 1] + self.inverse[1, 0]
        own = squares[0] * np.sum(cosine**2, 1) + squares[1] * np.sum(sine**2, 1)
        return np.asarray(own + both * np.sum(cosine * sine, 1))


@dataclass(frozen=True, eq=False)
class _Swinging:
    """Swings (G) in one run beside any start: whitened ``columns`` (2 M, G; x and y in turn) of the answers to its
    pushes, their ``squares`` (G,), and what ``began`` before it."""

    columns: Array
    squares: Array
    began: _Began

    @classmethod
    def of(
        cls, effect: str, path: MeasuredPath, run: RunPushes, hz: Array, damping: Array, began: _Began | None = None
    ) -> _Swinging:
        began = began or _Began.of(path, hz, damping)
        columns = began.without(_answers(effect, path, run, hz, damping))[0].reshape(-1, len(hz))
        return cls(columns, np.einsum("mg,mg->g", columns, columns), began)

    def sums(self, left: Array) -> tuple[Array, Array, Array]:
        """Products (G,) of the answers with what is ``left`` (M, 2; whitened) and with themselves, beside any start,
        and what the start alone takes."""
        return left.ravel() @ self.columns, self.squares, self.began.taken(left)


def _answers(effect: str, path: MeasuredPath, run: RunPushes, hz: Array, damping: Array) -> Array:
    """Whitened answers (M, 2, G) of swings to a run's pushes."""
    return path.white(answers(_answered(effect, run), path.time_s, hz, damping))


@dataclass(frozen=True, eq=False)
class TriedSwings:
    """The grid of swings in each path, whitened: what is left in the paths changes none of it, so that a search for one
    term after the other need not make it again."""

    began: dict[MeasuredPath, _Began] = field(default_factory=dict)
    swinging: dict[tuple[str, MeasuredPath], _Swinging] = field(default_factory=dict)

    def of(self, effect: str, path: MeasuredPath, run: RunPushes, hz: Array, damping: Array) -> _Swinging:
        """Of one path; ``hz`` and ``damping`` (G,) are those of all calls."""
        if (effect, path) not in self.swinging:
            began = self.began[path] = self.began.get(path) or _Began.of(path, hz, damping)
            self.swinging[effect, path] = _Swinging.of(effect, path, run, hz, damping, began)
        return self.swinging[effect, path]


def best_swing(
    effect: str,
    paths: Sequence[MeasuredPath],
    pushes: Sequence[RunPushes],
    left: Sequence[Array],
    tried: TriedSwings | None = None,
) -> Swing:
    """The swing that takes most of what is ``left`` (N, 2; m) in the paths: a grid, then a search about its best.

    ``tried``: kept from one search in paths of the same times to the next."""
    tried = tried or TriedSwings()
    longest = max(float(np.ptp(path.time_s)) for path in paths)
    period = float(np.median([np.median(np.diff(path.time_s)) for path in paths]))
    grid = np.geomspace(LOWEST_PERIODS / longest, HIGHEST_SHARE / period, FREQUENCIES)
    hz, damping = (one.ravel() for one in np.meshgrid(grid, DAMPINGS, indexing="ij"))
    white = [path.white(one) for path, one in zip(paths, left, strict=True)]

    def sums(hz: Array, damping: Array, made: Callable[..., _Swinging]) -> tuple[Array, Array, Array]:
        """Those of each run (R, G)."""
        each = [
            made(effect, path, pushes[path.run], hz, damping).sums(one) for path, one in zip(paths, white, strict=True)
        ]
        top, bottom, began = (np.array(column) for column in zip(*each, strict=True))
        return top, bottom, began

    def gain(top: Array, bottom: Array) -> Array:
        # A push makes the Host give, not come.
        total = np.maximum(top.sum(0), 0.0)
        return np.asarray(total**2 / np.maximum(bottom.sum(0), 1e-300))

    def taken(hz: Array, damping: Array, made: Callable[..., _Swinging] = _Swinging.of) -> Array:
        """All that swings and their starts take: without these, what a run began with would bend the frequency."""
        top, bottom, began = sums(hz, damping, made)
        return np.asarray(gain(top, bottom) + began.sum(0))

    start = int(np.argmax(taken(hz, damping, tried.of)))
    found = minimize(
        lambda u: -float(taken(np.exp(u[:1]), _damping(u[1:]))[0]),
        np.array([np.log(hz[start]), np.log(damping[start] / (1 - damping[start]))]),
        method="Nelder-Mead",
        options={"initial_simplex": None, "xatol": 1e-3, "fatol": 1e-2, "maxfev": 80},
    )
    f, zeta = float(np.exp(found.x[0])), float(_damping(found.x[1:])[0])
    top, bottom = (one[:, 0] for one in sums(np.array([f]), np.array([zeta]), _Swinging.of)[:2])
    share = float(max(top.sum(), 0.0) / max(bottom.sum(), 1e-300))
    rest_top, rest_bottom = (top.sum() - top, bottom.sum() - bottom) if len(paths) > 1 else (top, bottom)
    others = np.maximum(rest_top, 0.0) / np.maximum(rest_bottom, 1e-300)
    swing = Swing(
        effect, share, f, zeta, np.zeros((3, 3)), float(gain(top[:, None], bottom[:, None])[0]),
        2 * others * top - others**2 * bottom, np.zeros((len(pushes), 2, 2)), np.zeros(len(pushes)),
    )  # fmt: skip
    swing = _with_starts(swing, paths, pushes, white)
    return replace(swing, covariance=_covariance(swing, paths, pushes, white))


def _with_starts(
    swing: Swing, paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], white: Sequence[Array]
) -> Swing:
    """``swing`` with what each run began with."""
    hz, damping = np.array([swing.frequency_hz]), np.array([swing.damping])
    start, start_s = np.zeros_like(swing.start), np.zeros_like(swing.start_s)
    for path, one in zip(paths, white, strict=True):
        answered = _answers(swing.effect, path, pushes[path.run], hz, damping)
        _, sizes = _Began.of(path, hz, damping).without(one[..., None] - swing.share * answered)
        start[path.run] = sizes[..., 0] * path.sd
        start_s[path.run] = path.time_s[0]
    return replace(swing, start=start, start_s=start_s)


def _damping(logit: Array) -> Array:
    return np.asarray(1 / (1 + np.exp(-logit)))


def _covariance(
    swing: Swing, paths: Sequence[MeasuredPath], pushes: Sequence[RunPushes], white: Sequence[Array]
) -> Array:
    """Of share, frequency and damping: by the runs' scores (a sandwich over runs, wider where these are few), never
    less than the noise gives."""
    hz = swing.frequency_hz * np.array([1, 1 - STEP, 1 + STEP, 1, 1])
    zeta = swing.damping * np.array([1, 1, 1, 1 - STEP, 1 + STEP])
    normal, scores = np.zeros((3, 3)), []
    for path, one in zip(paths, white, strict=True):
        near = hz, np.minimum(zeta, 1 - 1e-6)
        answered, began = _answers(swing.effect, path, pushes[path.run], *near), _Began.of(path, *near)
        whole = swing.share * answered + np.einsum("mig,ia->mag", began.columns, swing.start[path.run] / path.sd)
        slopes = [
            answered[..., 0],
            (whole[..., 2] - whole[..., 1]) / (2 * STEP * swing.frequency_hz),
            (whole[..., 4] - whole[..., 3]) / (2 * STEP * swing.damping),
        ]
        here = _Began(began.columns[..., :1])
        jacobian = np.concatenate([here.without(slope[..., None])[0] for slope in slopes], -1).reshape(-1, 3)
        normal += jacobian.T @ jacobian
        scores.append(jacobian.T @ (one - whole[..., 0]).ravel())
    inverse = np.asarray(np.linalg.pinv(normal, hermitian=True), float)
    if len(paths) < 4:
        return inverse
    spread = inverse @ np.einsum("ri,rj->ij", np.array(scores), np.array(scores)) @ inverse
    few = len(paths) / (len(paths) - 1) * student_over_normal(len(paths) - 1) ** 2
    wider = np.sqrt(np.maximum(few * np.diag(spread) / np.maximum(np.diag(inverse), 1e-300), 1.0))
    return inverse * np.outer(wider, wider)


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
    normal = _products(rows.reshape(-1, 2, len(hz))) - _products(by_drive.reshape(-1, 2, len(hz)))
    seen = normal[0] + normal[1] > LEAST_SEEN * len(rows)
    on = np.where(seen, (rows.T @ white).reshape(2, len(hz), 2).swapaxes(1, 2), 0.0)
    # ``white`` is without the drive, so that what the drive holds of the rows is none of their products with it.
    return np.einsum("jag,jag->g", np.einsum("ijg,jag->iag", _inverse(*normal), on), on)


def _turning(time_s: Array, hz: Array) -> Array:
    """Cosines and sines (N, 2 G) at evenly spaced frequencies, each from the one before by a turn: a third of the time
    that as many sines take."""
    turns = np.empty((len(hz), len(time_s)), complex)
    turns[0] = np.exp(2j * np.pi * hz[0] * time_s)
    step = np.exp(2j * np.pi * (hz[-1] - hz[0]) / max(len(hz) - 1, 1) * time_s)
    for k in range(1, len(hz)):
        np.multiply(turns[k - 1], step, out=turns[k])
    return np.concatenate([turns.real, turns.imag]).T


def _products(rows: Array) -> Array:
    """Of pairs of columns (M, 2, G): squares of both and the product (3, G)."""
    return np.array([np.einsum("mg,mg->g", rows[:, i], rows[:, j]) for i, j in ((0, 0), (1, 1), (0, 1))])


def _pairs(path: MeasuredPath, white: Array, hz: Array) -> tuple[Array, Array, Array]:
    """Of lines at ``hz`` (G,), each by itself: gains (G,), complex amplitudes (2, G) along x and y, and the sd (G,) of
    a part of them."""
    turn = 2 * np.pi * path.time_s[:, None] * hz
    # Whitened for a frame of unit variance; both axes hold the same columns over their own sd.
    rows = path.white(np.stack([np.cos(turn), np.sin(turn)], 1) * path.sd.reshape(1, 2, 1))
    inverse, power = _of_pair(rows)
    # A line that the drive holds nearly whole is part of the drive.
    on = np.where(power > LEAST_SEEN * len(rows), np.einsum("mjg,ma->jag", rows, white), 0.0)
    sizes = np.einsum("ijg,jag->iag", inverse, on)
    gain = np.einsum("jag,jag->g", sizes, on)
    amplitude = path.sd[:, None] * (sizes[0] + 1j * sizes[1])
    variance = 0.25 * np.sum(path.sd**2) * (inverse[0, 0] + inverse[1, 1])
    return gain, amplitude, np.sqrt(variance)


def _of_pair(rows: Array) -> tuple[Array, Array]:
    """Of pairs of columns (M, 2, G): the inverse (2, 2, G) of their products, and their power (G,)."""
    cc, ss, cs = (np.sum(rows[:, i] * rows[:, j], 0) for i, j in ((0, 0), (1, 1), (0, 1)))
    return _inverse(cc, ss, cs), cc + ss


def _inverse(cc: Array, ss: Array, cs: Array) -> Array:
    """Inverse (2, 2, G) of pairs' products."""
    determinant = np.maximum(cc * ss - cs**2, 1e-12 * cc * ss + 1e-300)
    return np.array([[ss, -cs], [-cs, cc]]) / determinant
