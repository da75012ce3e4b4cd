"""How a camera's picture has changed since its calibration, as far as a few numbers tell it: a zoom, a turn, a
stretch, a skew, a lens that was focused anew or sits off its axis; and what boards that were not true have made of both
cameras together.

What a calibration leaves of a lens is smooth and has no form; what happens to a camera has one.  Each form is held
against the recordings beside a smooth field of any size.  It is told where the recordings are far likelier with it: one
number then does what a field without a form needs hundreds for.  With it the field has what rigid bodies leave open of
one without a form, its scale and its tilt.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from ovines.camera import Camera
from ovines.camera.bends import CHANGES, PERIODS_RAD, STRETCH, bend_px
from ovines.camera.boards import BOARD_BOW, BOARD_STRETCH, board_bend_px
from ovines.camera.changes import PictureChange
from vision.lens.lattice import Lattice
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
# Natural logarithm of the odds from which a change is told, for each of the forms that were tried.  Of 79 series with
# a smooth residual of the lens, or with other faults of the cameras, none came to more than 2.5, but for one whose
# markers bloom (10.7); lenses focused anew by 0.2 px at 300 px came to 59 and 63, beside such a residual to 26.
SURE = 6.0
MOST_CHANGES = 3
# Changes hold in other runs where these tell such a share of what each asks for (cameras that had changed: 0.97 to
# 1.00; markers that bloom, which look like a skew: 0.44 and 0.64), or leave so many times what chance does.
HELD_SHARE, HELD_CHANCE = 0.8, 2.0
# Of the amplitudes that a smooth field beside a change may have, one in so many is tried.
EVERY = 3
# What boards do has a direction or a place of its own: sought along these as sizes, then settled.
BOTH = -1
# What boards do counts from so many of its sds on, once settled, and a bow's middle is told; that lies no further off
# than so many times the RMS distance at which markers went.
SURE_SD, FURTHEST = 3.0, 3.0
# Of the polynomial that a board's doing is in a picture: a bow is of third degree in the world, and a view that leans
# makes 0.4 % of it more.
DEGREE = 5


@dataclass(frozen=True, eq=False)
class Seen:
    """What a pair of ``cameras`` saw: the ``lattices`` of their fields, places of markers of both bodies ``places_px``
    (N, 2) of each, ``points_m`` (N, 3) between their rays, and by which share the markers' layouts came out too large
    (``scale``, with its sd)."""

    cameras: Sequence[Camera]
    lattices: Sequence[Lattice]
    places_px: Sequence[Array]
    points_m: Array
    scale: tuple[float, float]


@dataclass(frozen=True, eq=False)
class _Form:
    """One of the changes of one camera, or of ``BOTH``: its columns (P, K) of the fields' splines, 1 px RMS each, and
    what each is in ``units`` of its own; the direction or place ``at``, of what boards do."""

    camera: int
    target: str
    columns: Array
    units: tuple[float, ...]
    at: tuple[float, float] = (0.0, 0.0)


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
    seen: Seen,
) -> Changed:
    """What is surely changed of two cameras' pictures, or was wrong with the boards that they were calibrated on.

    Parameters
    ----------
    whole, runs : of the whole series and of each run, in units of the noise
    solve : (data, amplitudes in px) -> the data under a smooth field of each of these
    amplitude_px : the likeliest without changes
    seen : where markers went
    """
    forms = _forms(seen)
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
        return Changed((), np.zeros_like(whole[0]))
    at = np.concatenate([where[k] for k in chosen])
    number = int(np.argmax([one.log_odds(at) for one in besides]))
    sought = _sizes([forms[k] for k in chosen], besides[number].sizes(at))
    settled = [_settled(forms[k], *size, seen) for k, size in zip(chosen, sought, strict=True)]
    while True:  # what boards seemed to do beside a form that was not settled yet may be gone
        columns = _joined(settled)[0]
        told = _with_layouts(_beside(solved[number], whole, columns), settled, seen.scale)
        mean, covariance = told.sizes(np.arange(columns.shape[1]))
        sure = [abs(size[0]) / np.sqrt(sd[0, 0]) for size, sd in _sizes(settled, (mean, covariance))]
        gone = [n for n, form in enumerate(settled) if form.camera == BOTH and sure[n] < SURE_SD]
        if not gone or len(settled) == 1:
            break
        del chosen[gone[0]], sought[gone[0]], settled[gone[0]]
    prior = EXPECTED_PX**2 * columns @ columns.T
    before, after = _by_run(runs(), lambda data: solve(data, [amplitudes[number]])[0], columns)
    if not _holds(before, after, columns.shape[1]):  # another one in each run is of no camera
        return Changed((), np.zeros_like(whole[0]))
    changes = []
    for k, form, first, size in zip(chosen, settled, sought, _sizes(settled, (mean, covariance)), strict=True):
        odds_of = best(chosen) - best([other for other in chosen if other != k])
        if form.camera == BOTH:
            of_form = _of_boards(form, first, forms[k].units, size)
        else:
            of_form = _of_camera(form, seen.cameras, size)
        changes.append(replace(of_form, log_odds=odds_of, before=before, after=after))
    if max(one.size_px for one in changes) > MOST_PX:
        return Changed((), np.zeros_like(whole[0]))
    return Changed(tuple(changes), prior)


def _by_layouts(form: _Form, mean: Array, covariance: Array, scale: tuple[float, float]) -> float:
    """How much likelier (log) the scale of the layouts is by a stretch of this size, which makes half of itself, than
    by a scale of its own."""
    half, half_sd, _, _ = (form.units[0] * one for one in _along(STRETCH, mean, covariance))
    by_stretch = (abs(scale[0]) - half) / float(np.hypot(scale[1], half_sd))
    alone = scale[0] / float(np.hypot(scale[1], EXPECTED_SCALE))
    narrower = np.hypot(scale[1], EXPECTED_SCALE) / np.hypot(scale[1], half_sd)
    return float(np.log(narrower) + (alone**2 - by_stretch**2) / 2)


def _with_layouts(beside: _Beside, forms: Sequence[_Form], scale: tuple[float, float]) -> _Beside:
    """The same with what the scale of the layouts says of a stretch that is settled, half of which it is."""
    information, right = beside.information.copy(), beside.right.copy()
    for form, at in zip(forms, _joined(forms)[1], strict=True):
        if form.target == BOARD_STRETCH:
            half = form.units[0] / 2
            information[at, at] += (half / scale[1]) ** 2
            right[at] += half * scale[0] / scale[1] ** 2
    return replace(beside, information=information, right=right)


def _joined(forms: Sequence[_Form]) -> tuple[Array, list[NDArray[np.int64]]]:
    """All columns, and which of them are each form's."""
    ends = np.cumsum([0, *(form.columns.shape[1] for form in forms)])
    return np.hstack([form.columns for form in forms]), [np.arange(*each) for each in pairwise(ends)]


def _sizes(forms: Sequence[_Form], told: tuple[Array, Array]) -> list[tuple[Array, Array]]:
    """Mean and covariance of each form's own columns."""
    mean, covariance = told
    return [(mean[at], covariance[np.ix_(at, at)]) for at in _joined(forms)[1]]


def _forms(seen: Seen) -> list[_Form]:
    out = []
    for c, (camera, places) in enumerate(zip(seen.cameras, seen.places_px, strict=True)):
        middle = camera.matrix[:2, 2]
        for target in CHANGES:
            period = PERIODS_RAD.get(target)
            directions = (0.0,) if period is None else (0.0, period / 4)
            size = float(np.sqrt(np.mean(np.sum(bend_px(target, 0.0, places - middle) ** 2, 1))))
            columns = np.column_stack(
                [
                    _column(seen.lattices, {c: partial(_about, target, direction, middle)}) / size
                    for direction in directions
                ]
            )
            out.append(_Form(c, target, columns, (1 / size,)))
    return [*out, *_board_forms(seen)]


def _board_forms(seen: Seen) -> list[_Form]:
    """A stretch by two sizes, along two directions and shorter across, as poses and layouts leave a scale open; a bow
    about the middle of where markers went, and by two sizes where its own middle lies."""
    middle = _middle(seen)
    stretch = _board_columns(seen, lambda a, b: np.stack([np.column_stack([a, -b]), np.column_stack([b, a])]))
    square = _board_columns(
        seen,
        lambda a, b: np.stack(
            [
                (a * a + b * b)[:, None] * np.column_stack([a, b]),
                np.column_stack([3 * a * a + b * b, 2 * a * b]),
                np.column_stack([2 * a * b, a * a + 3 * b * b]),
            ]
        ),
    )
    return [
        _Form(BOTH, BOARD_STRETCH, *stretch),
        _Form(BOTH, BOARD_BOW, *square, (float(middle[0]), float(middle[1]))),
    ]


def _middle(seen: Seen) -> Array:
    return np.asarray(seen.points_m[:, :2].mean(0), float)


def _board_columns(seen: Seen, moves: Callable[[Array, Array], Array]) -> tuple[Array, tuple[float, ...]]:
    """Columns (P, K) of what ``moves`` (K, N, 2) of places about the middle do to both pictures, 1 px RMS each, and
    what that is in their own units."""
    a, b = (seen.points_m[:, :2] - _middle(seen)).T
    moved = np.concatenate([moves(a, b), np.zeros((len(moves(a, b)), len(a), 1))], -1)
    pixels = [np.einsum("nij,knj->kni", one.project_with_jacobian(seen.points_m)[1], moved) for one in seen.cameras]
    fields = [{c: _smooth(seen.places_px[c], each[k]) for c, each in enumerate(pixels)} for k in range(len(pixels[0]))]
    sizes = [float(np.sqrt(np.mean([np.sum(each[k] ** 2, 1) for each in pixels]))) for k in range(len(pixels[0]))]
    columns = [_column(seen.lattices, field) / size for field, size in zip(fields, sizes, strict=True)]
    return np.column_stack(columns), tuple(1 / size for size in sizes)


def _smooth(uv_px: Array, moved_px: Array) -> Callable[[Array], Array]:
    """The polynomial that is nearest to moves (N, 2) of pixels (N, 2): it goes on where no marker went."""
    middle = uv_px.mean(0)
    unit = float(np.abs(uv_px - middle).max())

    def powers(uv: Array) -> Array:
        a, b = ((uv - middle) / unit).T
        return np.column_stack([a**i * b**j for i in range(DEGREE + 1) for j in range(DEGREE + 1 - i)])

    coefficients = np.linalg.lstsq(powers(uv_px), moved_px, rcond=None)[0]
    return lambda uv: np.asarray(powers(uv) @ coefficients, float)


def _column(lattices: Sequence[Lattice], fields: Mapping[int, Callable[[Array], Array]]) -> Array:
    """One column (P,) of the splines of all lattices: the field of each camera that has one."""
    return np.concatenate(
        [
            _spline_of(lattice, fields[c]).T.ravel() if c in fields else np.zeros(2 * lattice.size)
            for c, lattice in enumerate(lattices)
        ]
    )


def _settled(form: _Form, mean: Array, covariance: Array, seen: Seen) -> _Form:
    """What boards do, along the direction or about the place that the sizes say, as one column; others as they are.

    A print that is too long along one direction is one that is too short across it but for the scale, which the
    markers' layouts tell."""
    if form.camera != BOTH:
        return form
    if form.target == BOARD_STRETCH:
        direction = float(np.arctan2(mean[1], mean[0])) / 2 + (np.pi / 2 if seen.scale[0] < 0 else 0.0)
        at = (direction % np.pi, 0.0)
    else:
        at = _bow_middle(form, mean, covariance, seen)
    height_m = float(np.median(seen.points_m[:, 2]))
    moved = [
        board_bend_px(form.target, *at, camera, height_m, places)
        for camera, places in zip(seen.cameras, seen.places_px, strict=True)
    ]
    if form.target == BOARD_STRETCH:  # wherever the world's origin is: a shift of all points is nobody's
        moved = [one - one.mean(0) for one in moved]
    size = float(np.sqrt(np.mean([np.sum(one**2, 1) for one in moved])))
    column = _column(seen.lattices, {c: _smooth(seen.places_px[c], one) for c, one in enumerate(moved)}) / size
    return _Form(BOTH, form.target, column[:, None], (1 / size,), at)


def _bow_middle(form: _Form, mean: Array, covariance: Array, seen: Seen) -> tuple[float, float]:
    """Where a bow k |y - d|^2 (y - d) has its middle d: what it holds of second powers is -k d."""
    if abs(mean[0]) < SURE_SD * np.sqrt(covariance[0, 0]):
        return form.at
    third, *second = mean * form.units
    off = -np.array(second) / third
    rms_m = float(np.sqrt(np.mean(np.sum((seen.points_m[:, :2] - form.at) ** 2, 1))))
    off *= min(1.0, FURTHEST * rms_m / max(float(np.hypot(*off)), 1e-300))
    return float(form.at[0] + off[0]), float(form.at[1] + off[1])


def _about(target: str, direction_rad: float, middle_px: Array, uv_px: Array) -> Array:
    return bend_px(target, direction_rad, uv_px - middle_px)


def _spline_of(lattice: Lattice, field: Callable[[Array], Array]) -> Array:
    """Coefficients (size, 2) of the spline that a ``field`` of at most third degree is (nearly: one of fifth): its
    values at the sites, less the sixth of its second differences that cubic B-splines add."""
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
    """Squares (R,) that changes take off each run beside a smooth field of its own, as it asks for itself, and what
    changes learnt from the other runs leave of these.

    The field is the lens, which is there with the changes and without."""
    whole = np.sum([one[0] for one in blocks], 0), np.sum([one[1] for one in blocks], 0)
    at = np.arange(columns.shape[1])
    before, after = np.zeros(len(blocks)), np.zeros(len(blocks))
    for number, block in enumerate(blocks):
        others = whole[0] - block[0], whole[1] - block[1]
        told = _beside(solve(others), others, columns).sizes(at)[0]
        own = _beside(solve(block), block, columns)
        asked = own.sizes(at)[0]
        by_own, by_told = (float(2 * own.right @ one - one @ own.information @ one) for one in (asked, told))
        before[number], after[number] = max(by_own, by_told), max(by_own, by_told) - by_told
    return before, after


def _holds(before: Array, after: Array, columns: int) -> bool:
    """Whether changes hold in runs (R,) that they were not learnt from: most of what each asks for is told by the
    others, or what is left is what chance makes of it."""
    chance = columns * len(after) ** 2 / max(len(after) - 1, 1)
    left = float(after.sum())
    return left < (1 - HELD_SHARE) * float(before.sum()) or left < min(HELD_CHANCE * chance, float(before.sum()))


def _of_camera(form: _Form, cameras: Sequence[Camera], told: tuple[Array, Array]) -> PictureChange:
    """A change of one camera in its own unit: two columns are one size along one direction."""
    size, sd, direction, direction_sd = _along(form.target, *told)
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
    form: _Form, sought: tuple[Array, Array], units: tuple[float, ...], told: tuple[Array, Array]
) -> PictureChange:
    """What boards that were not true do, in its own unit, along or about what was ``sought``, in its ``units``."""
    (size,), ((variance,),) = told
    unit = form.units[0]
    change = PictureChange(
        "", form.target, float(size * unit), float(np.sqrt(variance) * unit), size_px=float(abs(size))
    )
    mean, covariance = sought
    if form.target == BOARD_STRETCH:
        return replace(change, direction_rad=form.at[0], direction_sd_rad=_along(STRETCH, mean, covariance)[3])
    sds = np.sqrt(np.diag(covariance)[1:]) * units[1:] / abs(change.value)
    return replace(change, place_m=form.at, place_sd_m=(float(sds[0]), float(sds[1])))
