"""The forms of what may have become of two cameras' pictures, as columns of the splines of their fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.camera.bends import CHANGES, PERIODS_RAD, bend_px
from ovines.camera.boards import BOARD_BOW, BOARD_STRETCH, board_bend_px
from vision.lens.lattice import Lattice

Array = NDArray[np.float64]
# What boards do has a direction or a place of its own: sought along these as sizes, then settled.
BOTH = -1
# What boards do, and what is beside it, counts from so many of its sds on, once settled, and a bow's middle is
# determined; that lies no further off than so many times the RMS distance at which markers went.
SURE_SD, FURTHEST = 3.0, 3.0
# Of the polynomial that a board's doing is in a picture: a bow is of third degree in the world, and a view that leans
# makes 0.4 % of it more.
DEGREE = 5


@dataclass(frozen=True, eq=False)
class StereoCoverage:
    """What a pair of ``cameras`` saw: the ``lattices`` of their fields, places of markers of both bodies ``places_px``
    (N, 2) of each, ``points_m`` (N, 3) between their rays, and by which share the markers' layouts came out too large
    (``scale``, with its sd)."""

    cameras: Sequence[Camera]
    lattices: Sequence[Lattice]
    places_px: Sequence[Array]
    points_m: Array
    scale: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Form:
    """One of the changes of one camera, or of ``BOTH``: its columns (P, K) of the fields' splines, 1 px RMS each, and
    what each is in ``units`` of its own; the direction or place ``at``, of what boards do."""

    camera: int
    target: str
    columns: Array
    units: tuple[float, ...]
    at: tuple[float, float] = (0.0, 0.0)


def all_forms(seen: StereoCoverage) -> list[Form]:
    """What may have become of each camera, and what boards may have made of both."""
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
            out.append(Form(c, target, columns, (1 / size,)))
    return [*out, *_of_boards(seen)]


def _of_boards(seen: StereoCoverage) -> list[Form]:
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
        Form(BOTH, BOARD_STRETCH, *stretch),
        Form(BOTH, BOARD_BOW, *square, (float(middle[0]), float(middle[1]))),
    ]


def _middle(seen: StereoCoverage) -> Array:
    return np.asarray(seen.points_m[:, :2].mean(0), float)


def _board_columns(seen: StereoCoverage, moves: Callable[[Array, Array], Array]) -> tuple[Array, tuple[float, ...]]:
    """Columns (P, K) of what ``moves`` (K, N, 2) of places about the middle do to both pictures, 1 px RMS each, and
    what that is in their own units."""
    by_point = [camera.project_with_jacobian(seen.points_m)[1][..., :2] for camera in seen.cameras]
    found = [_both(seen, [np.einsum("nij,nj->ni", one, moved) for one in by_point]) for moved in moves(*_off(seen))]
    return np.column_stack([column for column, _ in found]), tuple(unit for _, unit in found)


def _off(seen: StereoCoverage) -> Array:
    """Places (2, N) about the middle of where markers went."""
    return np.asarray((seen.points_m[:, :2] - _middle(seen)).T, float)


def _both(seen: StereoCoverage, moved_px: Sequence[Array]) -> tuple[Array, float]:
    """The column (P,) of what moves pixels of both cameras by ``moved_px`` (N, 2) of each, 1 px RMS, and what that is
    in its own unit."""
    size = float(np.sqrt(np.mean([np.sum(one**2, 1) for one in moved_px])))
    fields = {c: _smooth(seen.places_px[c], one) for c, one in enumerate(moved_px)}
    return _column(seen.lattices, fields) / size, 1 / size


def _smooth(uv_px: Array, moved_px: Array) -> Callable[[Array], Array]:
    """The polynomial that is nearest to moves (N, 2) of pixels (N, 2): it goes on where no marker went."""
    middle = uv_px.mean(0)
    unit = float(np.abs(uv_px - middle).max())

    def powers(uv: Array) -> Array:
        a, b = (np.vander(one, DEGREE + 1, increasing=True) for one in ((uv - middle) / unit).T)
        return np.hstack([a[:, i : i + 1] * b[:, : DEGREE + 1 - i] for i in range(DEGREE + 1)])

    coefficients = np.linalg.lstsq(powers(uv_px), moved_px, rcond=None)[0]
    return lambda uv: np.asarray(powers(uv) @ coefficients, float)


def _column(lattices: Sequence[Lattice], fields: Mapping[int, Callable[[Array], Array]]) -> Array:
    """One column (P,) of the splines of all lattices: the field of each camera that has one."""
    return np.concatenate(
        [
            spline_of(lattice, fields[c]).T.ravel() if c in fields else np.zeros(2 * lattice.size)
            for c, lattice in enumerate(lattices)
        ]
    )


def settled(form: Form, mean: Array, covariance: Array, seen: StereoCoverage) -> Form:
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
    column, unit = _both(seen, moved)
    return Form(BOTH, form.target, column[:, None], (unit,), at)


def _bow_middle(form: Form, mean: Array, covariance: Array, seen: StereoCoverage) -> tuple[float, float]:
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


def spline_of(lattice: Lattice, field: Callable[[Array], Array]) -> Array:
    """Coefficients (size, 2) of the spline that a ``field`` of at most third degree is (nearly: one of fifth): its
    values at the sites, less the sixth of its second differences that cubic B-splines add."""
    at, step = lattice.sites_px, lattice.spacing_px
    middle = field(at)
    bent = sum((field(at + way) + field(at - way) - 2 * middle for way in step * np.eye(2)), np.zeros_like(middle))
    return np.asarray(middle - bent / 6, float)
