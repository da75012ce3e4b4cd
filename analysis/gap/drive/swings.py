"""Swings of the Host after pushes, beside its drive: recoil and ringing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from analysis.gap.drive.measured_path import MeasuredPath
from analysis.gap.drive.pairs import inverse_and_power
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
#: cells tried; neighbours are alike, so that the best gains less by chance than so many independent ones
CELLS = FREQUENCIES * len(DAMPINGS)
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
        return inverse_and_power(self.columns)[0]

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


@dataclass(frozen=True, eq=False)
class _Asked:
    """What is ``left`` in each of the ``paths`` (M, 2; whitened), asked for swings of an ``effect`` that answer the
    ``pushes`` of the series' runs."""

    effect: str
    paths: Sequence[MeasuredPath]
    pushes: Sequence[RunPushes]
    left: Sequence[Array]

    def sums(
        self, hz: Array, damping: Array, made: Callable[..., _Swinging] = _Swinging.of
    ) -> tuple[Array, Array, Array]:
        """Those of :meth:`_Swinging.sums` of each path (R, G)."""
        each = [
            made(self.effect, path, self.pushes[path.run], hz, damping).sums(one)
            for path, one in zip(self.paths, self.left, strict=True)
        ]
        top, bottom, began = (np.array(column) for column in zip(*each, strict=True))
        return top, bottom, began

    def taken(self, hz: Array, damping: Array, made: Callable[..., _Swinging] = _Swinging.of) -> Array:
        """All (G,) that swings and their starts take: without these, what a run began with would bend the frequency."""
        top, bottom, began = self.sums(hz, damping, made)
        return np.asarray(_gain(top, bottom) + began.sum(0))

    def best_near(self, hz: float, damping: float) -> tuple[float, float]:
        """Frequency (Hz) and damping of the swing that takes most near one of these."""
        found = minimize(
            lambda u: -float(self.taken(np.exp(u[:1]), _damping(u[1:]))[0]),
            np.array([np.log(hz), np.log(damping / (1 - damping))]),
            method="Nelder-Mead",
            options={"initial_simplex": None, "xatol": 1e-3, "fatol": 1e-2, "maxfev": 80},
        )
        return float(np.exp(found.x[0])), float(_damping(found.x[1:])[0])


def _gain(top: Array, bottom: Array) -> Array:
    """What swings (G,) of one share in all paths take, by the products (R, G) of their answers with what is left and
    with themselves."""
    # A push makes the Host give, not come.
    total = np.maximum(top.sum(0), 0.0)
    return np.asarray(total**2 / np.maximum(bottom.sum(0), 1e-300))


def _grid(paths: Sequence[MeasuredPath]) -> tuple[Array, Array]:
    """Frequencies (Hz) and damping ratios (G,) that are tried."""
    longest = max(float(np.ptp(path.time_s)) for path in paths)
    period = float(np.median([np.median(np.diff(path.time_s)) for path in paths]))
    grid = np.geomspace(LOWEST_PERIODS / longest, HIGHEST_SHARE / period, FREQUENCIES)
    hz, damping = (one.ravel() for one in np.meshgrid(grid, DAMPINGS, indexing="ij"))
    return hz, damping


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
    hz, damping = _grid(paths)
    white = [path.white(one) for path, one in zip(paths, left, strict=True)]
    asked = _Asked(effect, paths, pushes, white)
    start = int(np.argmax(asked.taken(hz, damping, tried.of)))
    f, zeta = asked.best_near(hz[start], damping[start])
    top, bottom = (one[:, 0] for one in asked.sums(np.array([f]), np.array([zeta]))[:2])
    share = float(max(top.sum(), 0.0) / max(bottom.sum(), 1e-300))
    rest_top, rest_bottom = (top.sum() - top, bottom.sum() - bottom) if len(paths) > 1 else (top, bottom)
    others = np.maximum(rest_top, 0.0) / np.maximum(rest_bottom, 1e-300)
    swing = Swing(
        effect, share, f, zeta, np.zeros((3, 3)), float(_gain(top[:, None], bottom[:, None])[0]),
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
    normal, scores = np.zeros((3, 3)), []
    for path, one in zip(paths, white, strict=True):
        whole, jacobian = swing_rows(swing, path, pushes[path.run], swing.start[path.run])
        normal += jacobian.T @ jacobian
        scores.append(jacobian.T @ (one - whole).ravel())
    inverse = np.asarray(np.linalg.pinv(normal, hermitian=True), float)
    if len(paths) < 4:
        return inverse
    spread = inverse @ np.einsum("ri,rj->ij", np.array(scores), np.array(scores)) @ inverse
    few = len(paths) / (len(paths) - 1) * student_over_normal(len(paths) - 1) ** 2
    wider = np.sqrt(np.maximum(few * np.diag(spread) / np.maximum(np.diag(inverse), 1e-300), 1.0))
    return inverse * np.outer(wider, wider)


def swing_rows(swing: Swing, path: MeasuredPath, run: RunPushes, start: Array) -> tuple[Array, Array]:
    """What a swing with its ``start`` (2, 2; m) does to a path (M, 2; whitened), and its derivatives (2 M, 3) by
    share, frequency and damping, beside any start."""
    hz = swing.frequency_hz * np.array([1, 1 - STEP, 1 + STEP, 1, 1])
    zeta = np.minimum(swing.damping * np.array([1, 1, 1, 1 - STEP, 1 + STEP]), 1 - 1e-6)
    answered, began = _answers(swing.effect, path, run, hz, zeta), _Began.of(path, hz, zeta)
    whole = swing.share * answered + np.einsum("mig,ia->mag", began.columns, start / path.sd)
    slopes = [
        answered[..., 0],
        (whole[..., 2] - whole[..., 1]) / (2 * STEP * swing.frequency_hz),
        (whole[..., 4] - whole[..., 3]) / (2 * STEP * swing.damping),
    ]
    here = _Began(began.columns[..., :1])
    jacobian = np.concatenate([here.without(slope[..., None])[0] for slope in slopes], -1).reshape(-1, 3)
    return whole[..., 0], jacobian
