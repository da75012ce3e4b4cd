"""How a camera's picture has changed since its calibration, as far as a few numbers tell it: a zoom, a turn, a
stretch, a skew, a lens that was focused anew or sits off its axis; and what boards that were not true have made of both
cameras together.

What a calibration leaves of a lens is smooth and has no form; what happens to a camera has one.  Each form is held
against the recordings beside a smooth field of any size.  It is reported where the recordings are far likelier with it:
one number then does what a field without a form needs hundreds for.  With it the field has what rigid bodies leave open
of one without a form, its scale and its tilt.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ovines.camera import Camera
from ovines.camera.bends import PERIODS_RAD, STRETCH
from ovines.camera.boards import BOARD_STRETCH
from ovines.camera.changes import PictureChange
from vision.lens.forms import BOTH, SURE_SD, Form, StereoCoverage, all_forms, settled
from vision.smooth_field import AMPLITUDES_PX, Solved

Array = NDArray[np.float64]
#: information (P, P) and right side (P,) of the fields of both cameras
Block = tuple[Array, Array]
# What is believed of a change beforehand: RMS over the places of the markers (px).
EXPECTED_PX = 1.0
# The same of a scale by boards of another size than they were said to have: prints come out longer or shorter by some
# thousandths.
EXPECTED_SCALE = 3e-3
# A camera that was touched bends its picture by less (RMS, px): what asks for more is a window, a calibration or an
# identity that is wrong (a window that was forgotten asked for 13 px).
MOST_PX = 5.0
# Natural logarithm of the odds from which a change is reported, for each of the forms that were tried.  Of 79 series
# with a smooth residual of the lens, or with other faults of the cameras, none came to more than 2.5, but for one whose
# markers bloom (10.7); lenses focused anew by 0.2 px at 300 px came to 59 and 63, beside such a residual to 26.
SURE = 6.0
MOST_CHANGES = 3
# Changes hold in other runs where these tell such a share of what each asks for (cameras that had changed: 0.97 to
# 1.00; markers that bloom, which look like a skew: 0.44 and 0.64), or leave so many times what chance does.
HELD_SHARE, HELD_CHANCE = 0.8, 2.0
# Of the amplitudes that a smooth field beside a change may have, one in so many is tried.
EVERY = 3


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
    """``changes`` found, the surest first, what they do to the ``field`` (P,), and what to believe of it for them: a
    covariance (P, P) as wide as is expected along each."""

    changes: tuple[PictureChange, ...]
    prior: Array
    field: Array

    @classmethod
    def nothing(cls, size: int) -> Changed:
        """Nothing of fields of so many splines."""
        return cls((), np.zeros((size, size)), np.zeros(size))


def find_changes(
    whole: Block,
    runs: Callable[[], Sequence[Block]],
    solve: Callable[[Block, Sequence[float]], Sequence[Solved]],
    amplitude_px: float,
    seen: StereoCoverage,
) -> Changed:
    """What is surely changed of two cameras' pictures, or was wrong with the boards that they were calibrated on.

    Parameters
    ----------
    whole, runs : of the whole series and of each run, in units of the noise
    solve : (data, amplitudes in px) -> the data under a smooth field of each of these
    amplitude_px : the likeliest without changes
    seen : where markers went
    """
    forms = all_forms(seen)
    columns, where = _joined(forms)
    amplitudes = sorted({*AMPLITUDES_PX[::EVERY], amplitude_px})
    solved = solve(whole, amplitudes)
    besides = [_beside(one, whole, columns) for one in solved]

    def best(chosen: Sequence[int]) -> float:
        at = np.concatenate([where[k] for k in chosen]) if chosen else np.zeros(0, np.int64)
        likeliest = max(besides, key=lambda one: one.log_odds(at))
        if not any(forms[k].target == BOARD_STRETCH for k in chosen):
            return likeliest.log_odds(at)
        sizes = _sizes([forms[k] for k in chosen], likeliest.sizes(at))
        return likeliest.log_odds(at) + sum(
            _by_layouts(forms[k], *size, seen.scale)
            for k, size in zip(chosen, sizes, strict=True)
            if forms[k].target == BOARD_STRETCH
        )

    chosen: list[int] = []
    while len(chosen) < MOST_CHANGES:
        others = [k for k in range(len(forms)) if k not in chosen]
        odds = {k: best([*chosen, k]) - best(chosen) for k in others}
        likeliest = max(odds, key=lambda k: odds[k])
        if odds[likeliest] < SURE + np.log(len(others)):
            break
        chosen.append(likeliest)
    if not chosen:
        return Changed.nothing(len(whole[1]))
    at = np.concatenate([where[k] for k in chosen])
    number = int(np.argmax([one.log_odds(at) for one in besides]))
    sought = _sizes([forms[k] for k in chosen], besides[number].sizes(at))
    at_last = [settled(forms[k], *size, seen) for k, size in zip(chosen, sought, strict=True)]
    boards = any(form.camera == BOTH for form in at_last)
    while True:  # what stood beside a form of the boards that was not settled yet may be gone
        columns = _joined(at_last)[0]
        beside = _with_layouts(_beside(solved[number], whole, columns), at_last, seen.scale)
        mean, covariance = beside.sizes(np.arange(columns.shape[1]))
        sure = [float(size @ np.linalg.solve(own, size)) for size, own in _sizes(at_last, (mean, covariance))]
        least = int(np.argmin(sure))
        if not boards or len(at_last) == 1 or sure[least] > SURE_SD**2:
            break
        del chosen[least], sought[least], at_last[least]
    prior = EXPECTED_PX**2 * columns @ columns.T
    before, after = _by_run(runs(), lambda data: solve(data, [amplitudes[number]])[0], columns)
    if not _holds(before, after, columns.shape[1]):  # another one in each run is of no camera
        return Changed.nothing(len(whole[1]))
    changes = []
    for k, form, first, size in zip(chosen, at_last, sought, _sizes(at_last, (mean, covariance)), strict=True):
        odds_of = best(chosen) - best([other for other in chosen if other != k])
        if form.camera == BOTH:
            of_form = _of_boards(form, first, forms[k].units, size)
        else:
            of_form = _of_camera(form, seen.cameras, size)
        changes.append(replace(of_form, log_odds=odds_of, before=before, after=after))
    if max(one.size_px for one in changes) > MOST_PX:
        return Changed.nothing(len(whole[1]))
    return Changed(tuple(changes), prior, columns @ mean)


def _by_layouts(form: Form, mean: Array, covariance: Array, scale: tuple[float, float]) -> float:
    """How much likelier (log) the scale of the layouts is by a stretch of this size, which makes half of itself, than
    by a scale of its own."""
    half, half_sd, _, _ = (form.units[0] * one for one in _along(STRETCH, mean, covariance))
    by_stretch = (abs(scale[0]) - half) / float(np.hypot(scale[1], half_sd))
    alone = scale[0] / float(np.hypot(scale[1], EXPECTED_SCALE))
    narrower = np.hypot(scale[1], EXPECTED_SCALE) / np.hypot(scale[1], half_sd)
    return float(np.log(narrower) + (alone**2 - by_stretch**2) / 2)


def _with_layouts(beside: _Beside, forms: Sequence[Form], scale: tuple[float, float]) -> _Beside:
    """The same with what the scale of the layouts says of a stretch that is settled, half of which it is."""
    information, right = beside.information.copy(), beside.right.copy()
    for form, at in zip(forms, _joined(forms)[1], strict=True):
        if form.target == BOARD_STRETCH:
            half = form.units[0] / 2
            information[at, at] += (half / scale[1]) ** 2
            right[at] += half * scale[0] / scale[1] ** 2
    return replace(beside, information=information, right=right)


def _joined(forms: Sequence[Form]) -> tuple[Array, list[NDArray[np.int64]]]:
    """All columns, and which of them are each form's."""
    ends = np.cumsum([0, *(form.columns.shape[1] for form in forms)])
    return np.hstack([form.columns for form in forms]), [np.arange(*each) for each in pairwise(ends)]


def _sizes(forms: Sequence[Form], sizes: tuple[Array, Array]) -> list[tuple[Array, Array]]:
    """Mean and covariance of each form's own columns."""
    mean, covariance = sizes
    return [(mean[at], covariance[np.ix_(at, at)]) for at in _joined(forms)[1]]


def _beside(solved: Solved, data: Block, columns: Array) -> _Beside:
    information, right = data
    along = information @ columns
    half = solve_triangular(solved.factor, solved.root.T @ along, lower=True, check_finite=False)
    left = right - information @ solved.mean(right)
    return _Beside(solved.evidence, columns.T @ along - half.T @ half, columns.T @ left)


def _by_run(blocks: Sequence[Block], solve: Callable[[Block], Solved], columns: Array) -> tuple[Array, Array]:
    """Squares (R,) that changes take off each run beside a smooth field of its own, as it asks for itself, and what
    changes learnt from the other runs leave of these.

    The field is the lens, which is there with the changes and without."""
    whole = np.sum([one[0] for one in blocks], 0), np.sum([one[1] for one in blocks], 0)
    at = np.arange(columns.shape[1])
    before, after = np.zeros(len(blocks)), np.zeros(len(blocks))
    for number, block in enumerate(blocks):
        others = whole[0] - block[0], whole[1] - block[1]
        predicted = _beside(solve(others), others, columns).sizes(at)[0]
        own = _beside(solve(block), block, columns)
        asked = own.sizes(at)[0]
        by_own, by_others = (float(2 * own.right @ one - one @ own.information @ one) for one in (asked, predicted))
        before[number], after[number] = max(by_own, by_others), max(by_own, by_others) - by_others
    return before, after


def _holds(before: Array, after: Array, columns: int) -> bool:
    """Whether changes hold in runs (R,) that they were not learnt from: most of what each asks for is predicted by the
    others, or what is left is what chance makes of it."""
    chance = columns * len(after) ** 2 / max(len(after) - 1, 1)
    left = float(after.sum())
    return left < (1 - HELD_SHARE) * float(before.sum()) or left < min(HELD_CHANCE * chance, float(before.sum()))


def _of_camera(form: Form, cameras: Sequence[Camera], size_and_covariance: tuple[Array, Array]) -> PictureChange:
    """A change of one camera in its own unit: two columns are one size along one direction."""
    size, sd, direction, direction_sd = _along(form.target, *size_and_covariance)
    name, (unit,) = cameras[form.camera].name, form.units
    return PictureChange(name, form.target, size * unit, sd * unit, direction, direction_sd, abs(size))


def _along(target: str, mean: Array, covariance: Array) -> tuple[float, float, float, float]:
    """Size and direction (rad) with their sds, of one column or of two."""
    if len(mean) == 1:
        return float(mean[0]), float(np.sqrt(covariance[0, 0])), 0.0, 0.0
    turns = 2 * np.pi / PERIODS_RAD[target]
    size = float(np.hypot(*mean))
    along, across = mean / size, np.array([-mean[1], mean[0]]) / size
    return (
        size,
        float(np.sqrt(along @ covariance @ along)),
        float(np.arctan2(mean[1], mean[0]) / turns),
        float(np.sqrt(across @ covariance @ across) / size / turns),
    )


def _of_boards(
    form: Form, sought: tuple[Array, Array], units: tuple[float, ...], size_and_covariance: tuple[Array, Array]
) -> PictureChange:
    """What boards that were not true do, in its own unit, along or about what was ``sought``, in its ``units``."""
    (size,), ((variance,),) = size_and_covariance
    unit = form.units[0]
    change = PictureChange(
        "", form.target, float(size * unit), float(np.sqrt(variance) * unit), size_px=float(abs(size))
    )
    mean, covariance = sought
    if form.target == BOARD_STRETCH:
        return replace(change, direction_rad=form.at[0], direction_sd_rad=_along(STRETCH, mean, covariance)[3])
    sds = np.sqrt(np.diag(covariance)[1:]) * units[1:] / abs(change.value)
    return replace(change, place_m=form.at, place_sd_m=(float(sds[0]), float(sds[1])))
