"""How a camera's picture has changed since its calibration, as far as a few numbers tell it: a zoom, a turn, a
stretch, a lens that was focused anew or sits off its axis.

What a calibration leaves of a lens is smooth and has no form; what happens to a camera has one.  Each form is held
against the recordings beside a smooth field of any size.  It is told where the recordings are far likelier with it: one
number then does what a field without a form needs hundreds for.  With it the field has what rigid bodies leave open of
one without a form, its scale and its tilt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ovines.camera import Camera
from ovines.camera.bends import CHANGES, PERIODS_RAD, PictureChange, bend_px
from vision.lens.lattice import Lattice
from vision.smooth_field import AMPLITUDES_PX, Solved

Array = NDArray[np.float64]
#: information (P, P) and right side (P,) of the fields of both cameras
Block = tuple[Array, Array]
# What is believed of a change beforehand: RMS over the places of the markers (px).
EXPECTED_PX = 1.0
# A camera that was touched bends its picture by less (RMS, px): what asks for more is a window, a calibration or an
# identity that is wrong (a window that was forgotten asked for 13 px).
MOST_PX = 5.0
# Natural logarithm of the odds from which a change is told, for each of the forms that were tried.  Of 79 series with
# a smooth residual of the lens, or with other faults of the cameras, none came to more than 2.5, but for one whose
# markers bloom (10.7); lenses focused anew by 0.2 px at 300 px came to 59 and 63, beside such a residual to 26.
SURE = 6.0
MOST_CHANGES = 3
# Of the amplitudes that a smooth field beside a change may have, one in so many is tried.
EVERY = 3


@dataclass(frozen=True, eq=False)
class _Form:
    """One of the changes of one camera: its columns (P, K) of the fields' splines, 1 px RMS each, and what that is in
    the target's own ``unit``."""

    camera: int
    target: str
    columns: Array
    unit: float


@dataclass(frozen=True, eq=False)
class _Beside:
    """All forms beside a smooth field of one amplitude: ``evidence`` of the field alone, information (C, C) of the
    forms' columns and their right side (C,), the field integrated out."""

    evidence: float
    information: Array
    right: Array

    def log_odds(self, at: NDArray[np.int64]) -> float:
        """Evidence (log) with the columns ``at`` over that of no field at all."""
        information = self.information[np.ix_(at, at)] + np.eye(len(at)) / EXPECTED_PX**2
        factor = np.linalg.cholesky(information)
        along = solve_triangular(factor, self.right[at], lower=True)
        grown = np.log(np.diag(factor)).sum() + len(at) * np.log(EXPECTED_PX)
        return float(self.evidence + 0.5 * along @ along - grown)

    def sizes(self, at: NDArray[np.int64]) -> tuple[Array, Array]:
        """Mean (K,) and covariance (K, K) of the columns' sizes (px)."""
        covariance = np.linalg.inv(self.information[np.ix_(at, at)] + np.eye(len(at)) / EXPECTED_PX**2)
        return np.asarray(covariance @ self.right[at], float), np.asarray(covariance, float)


@dataclass(frozen=True, eq=False)
class Changed:
    """``changes`` found, the surest first, and what to believe of the fields for them: a covariance (P, P) as wide as
    is expected along each."""

    changes: tuple[PictureChange, ...]
    prior: Array


def find_changes(
    whole: Block,
    runs: Callable[[], Sequence[Block]],
    solve: Callable[[Block, Sequence[float]], Sequence[Solved]],
    amplitude_px: float,
    lattices: Sequence[Lattice],
    cameras: Sequence[Camera],
    places_px: Sequence[Array],
) -> Changed:
    """What is surely changed of two cameras' pictures.

    Parameters
    ----------
    whole, runs : of the whole series and of each run, in units of the noise
    solve : (data, amplitudes in px) -> the data under a smooth field of each of these
    amplitude_px : the likeliest without changes
    places_px : (N, 2) of each camera, where markers went
    """
    forms = _forms(lattices, cameras, places_px)
    columns = np.hstack([form.columns for form in forms])
    ends = np.cumsum([0, *(form.columns.shape[1] for form in forms)])
    where = [np.arange(first, last) for first, last in pairwise(ends)]
    amplitudes = sorted({*AMPLITUDES_PX[::EVERY], amplitude_px})
    besides = [_beside(solved, whole, columns) for solved in solve(whole, amplitudes)]

    def best(chosen: Sequence[int]) -> float:
        at = np.concatenate([where[k] for k in chosen]) if chosen else np.zeros(0, np.int64)
        return max(one.log_odds(at) for one in besides)

    chosen: list[int] = []
    while len(chosen) < MOST_CHANGES:
        others = [k for k in range(len(forms)) if k not in chosen]
        odds = {k: best([*chosen, k]) - best(chosen) for k in others}
        likeliest = max(odds, key=lambda k: odds[k])
        if odds[likeliest] < SURE + np.log(len(others)):
            break
        chosen.append(likeliest)
    if not chosen:
        return Changed((), np.zeros_like(whole[0]))
    at = np.concatenate([where[k] for k in chosen])
    number = int(np.argmax([one.log_odds(at) for one in besides]))
    mean, covariance = besides[number].sizes(at)
    prior = EXPECTED_PX**2 * columns[:, at] @ columns[:, at].T
    before, after = _by_run(runs(), lambda data: solve(data, [amplitudes[number]])[0], columns[:, at])
    if not after.sum() < before.sum():  # it does not hold in runs that it was not learnt from: of no camera
        return Changed((), np.zeros_like(whole[0]))
    changes, first = [], 0
    for k in chosen:
        own = slice(first, first + len(where[k]))
        without = best([other for other in chosen if other != k])
        told = (mean[own], covariance[own, own], best(chosen) - without, before, after)
        changes.append(_told(forms[k], cameras, *told))
        first = own.stop
    if max(one.size_px for one in changes) > MOST_PX:
        return Changed((), np.zeros_like(whole[0]))
    return Changed(tuple(changes), prior)


def _forms(lattices: Sequence[Lattice], cameras: Sequence[Camera], places_px: Sequence[Array]) -> list[_Form]:
    sizes = [2 * lattice.size for lattice in lattices]
    out = []
    for c, (lattice, camera, places) in enumerate(zip(lattices, cameras, places_px, strict=True)):
        middle = camera.matrix[:2, 2]
        for target in CHANGES:
            period = PERIODS_RAD.get(target)
            directions = (0.0,) if period is None else (0.0, period / 4)
            size = float(np.sqrt(np.mean(np.sum(bend_px(target, 0.0, places - middle) ** 2, 1))))
            columns = np.zeros((sum(sizes), len(directions)))
            for j, direction in enumerate(directions):
                moved = _spline_of(lattice, partial(_about, target, direction, middle))
                columns[sum(sizes[:c]) : sum(sizes[: c + 1]), j] = moved.T.ravel() / size
            out.append(_Form(c, target, columns, 1 / size))
    return out


def _about(target: str, direction_rad: float, middle_px: Array, uv_px: Array) -> Array:
    return bend_px(target, direction_rad, uv_px - middle_px)


def _spline_of(lattice: Lattice, field: Callable[[Array], Array]) -> Array:
    """Coefficients (size, 2) of the spline that a ``field`` of at most third degree is: its values at the sites, less
    the sixth of its second differences that cubic B-splines add."""
    at, step = lattice.sites_px, lattice.spacing_px
    middle = field(at)
    bent = sum((field(at + way) + field(at - way) - 2 * middle for way in step * np.eye(2)), np.zeros_like(middle))
    return np.asarray(middle - bent / 6, float)


def _beside(solved: Solved, data: Block, columns: Array) -> _Beside:
    information, right = data
    along = information @ columns
    half = solve_triangular(solved.factor, solved.root.T @ along, lower=True, check_finite=False)
    left = right - information @ solved.mean(right)
    return _Beside(solved.evidence, columns.T @ along - half.T @ half, columns.T @ left)


def _by_run(blocks: Sequence[Block], solve: Callable[[Block], Solved], columns: Array) -> tuple[Array, Array]:
    """Squares (R,) that changes and a smooth field, learnt from the other runs, take off each run, and how much of that
    the field takes beside the changes."""
    whole = np.sum([one[0] for one in blocks], 0), np.sum([one[1] for one in blocks], 0)
    at = np.arange(columns.shape[1])
    before, after = np.zeros(len(blocks)), np.zeros(len(blocks))
    for number, (information, right) in enumerate(blocks):
        others = whole[0] - information, whole[1] - right
        solved = solve(others)
        changed = columns @ _beside(solved, others, columns).sizes(at)[0]
        field = changed + solved.mean(others[1] - others[0] @ changed)
        by_changes, by_all = (float(2 * right @ one - one @ information @ one) for one in (changed, field))
        before[number], after[number] = max(by_all, by_changes), max(by_all, by_changes) - by_changes
    return before, after


def _told(
    form: _Form, cameras: Sequence[Camera], mean: Array, covariance: Array, log_odds: float, before: Array, after: Array
) -> PictureChange:
    """A change in its own unit: two columns are one size along one direction."""
    size = float(np.hypot(*mean)) if len(mean) > 1 else float(mean[0])
    direction = direction_sd = 0.0
    sd = float(np.sqrt(covariance[0, 0]))
    if len(mean) > 1:
        turns = 2 * np.pi / PERIODS_RAD[form.target]
        direction = float(np.arctan2(mean[1], mean[0]) / turns)
        along, across = mean / size, np.array([-mean[1], mean[0]]) / size
        sd = float(np.sqrt(along @ covariance @ along))
        direction_sd = float(np.sqrt(across @ covariance @ across) / size / turns)
    name, unit = cameras[form.camera].name, form.unit
    return PictureChange(
        name, form.target, size * unit, sd * unit, direction, direction_sd, abs(size), log_odds, before, after
    )
