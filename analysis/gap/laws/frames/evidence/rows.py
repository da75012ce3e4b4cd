"""Frames as a regression: what still markers, two views and the Host's path say of cameras and clocks in each frame.

Three kinds of rows, each over its own noise.  Ground markers tell shift, zoom and turn of each camera's picture; their
noise is what they do apart, so that what they do together is no noise, however slowly it goes.  Epipolar lines and
heights of both bodies tell a delay of the second camera, and without ground markers its picture.  The Host's path
beside its drive tells a delay of all cameras (:mod:`analysis.gap.laws.frames.evidence.clock`).  A law gives a size in
each frame; how the rows answer a unit of each target stands in ``units``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.special import gammaincinv

from analysis.flights.cutting.runs import Run
from analysis.gap.laws.frames.evidence.known import every_frame
from analysis.gap.laws.regression.problem import Regression
from analysis.gap.measurement.body_rows import body_rows
from analysis.gap.series import Series
from analysis.statistics.robust import least_squares
from ovines.camera import Camera
from ovines.camera.bends import bend_px
from ovines.core.laws import words as W
from ovines.core.laws.kernel import sizes
from ovines.core.laws.targets import NES_PICTURE, PICTURE
from ovines.core.laws.terms import Term, rows_of
from ovines.robust import residual_sd

Array = NDArray[np.float64]
Key = tuple[str, int]
# What two views may say of one of them, in the order of columns.
OF_VIEW = ("camera_delay", *PICTURE, *NES_PICTURE)
# Rows of so long a part of a run share what noise did to them: longer than a body takes through a lens residual.
BLOCKS_OF_RUN = 8
# Parts of a run whose delay is free when the noise of two views is measured, and the degree of what a lens residual
# makes of epipolar lines and heights over the places of the bodies.
FREE_PARTS, LENS_DEGREE = 24, 4
# Rounds in which those delays and everything else are fitted in turns.
BACKFITS = 6
# Gross errors count as so many sds.
CLIP_SD = 5.0
# Frames that a path must have.
FEWEST_FRAMES = 60


@dataclass(frozen=True, eq=False)
class FrameRows:
    """The ``problem`` without a law, what laws ``known`` of each frame (N, KNOWN_SIZE), the frame ``at`` (M,) of each
    row, and what a ``unit`` (M,) of each target of a camera adds to it; ``bases`` of each run, orthonormal (N_r, Q),
    over its ``rows``, what is projected out of every column of rows that follow each other in time."""

    problem: Regression
    known: Array
    at: NDArray[np.int64]
    units: dict[Key, Array]
    bases: tuple[tuple[slice, Array], ...] = ()

    def columns(self, terms: Sequence[Term]) -> Array:
        """Rows (M, T) that a unit of each term adds to the residuals' model."""
        size = size_of(terms, self.known)
        out = np.zeros((len(self.at), len(terms)))
        for j, term in enumerate(terms):
            if (unit := self.units.get(key_of(term))) is not None:
                out[:, j] = unit * size[self.at, j]
        return without_bases(out, self.bases)

    def cut_columns(self, term: Term, cut: Callable[[Array], Array]) -> Array:
        """Columns (M, B) of a term times the weights (N, B) that ``cut`` gives what is known; beside a drive without
        what is late by a constant or evenly more in a run, which its phase and frequency take but for traces."""
        size, weight = size_of([term], self.known), cut(self.known)
        unit = self.units.get(key_of(term), np.zeros(len(self.at)))
        share = weight @ (weight.T @ self.known[:, W.SHARE] / np.maximum(weight.sum(0), 1e-300))
        even = without_bases(unit[:, None] * np.column_stack([weight.sum(1), share])[self.at], self.bases)
        out = without_bases(unit[:, None] * (weight * size)[self.at], self.bases)
        return without_bases(out, [(rows, _span(even[rows])) for rows, _ in self.bases])


def _span(columns: Array) -> Array:
    """Orthonormal basis (N, Q) of what ``columns`` (N, C) span."""
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(u[:, s > 1e-9 * max(s.max(initial=0.0), 1e-300)], float)


def without_bases(columns: Array, bases: Sequence[tuple[slice, Array]]) -> Array:
    """``columns`` (M, C) or a column (M,) without what orthonormal bases explain of their rows."""
    out = columns.copy()
    for rows, basis in bases:
        out[rows] -= basis @ (basis.T @ out[rows])
    return out


def key_of(term: Term) -> Key:
    """Target and camera (or marker) of a term; all cameras are number 0."""
    return term.target, int(term.x)


def size_of(terms: Sequence[Term], known: Array) -> Array:
    """Coefficient times factors (N, T) of each term in each frame."""
    out = np.empty((len(known), len(terms)))
    sizes(rows_of(terms), known, out)
    return out


def _blocks(known: Array, at: NDArray[np.int64]) -> NDArray[np.int64]:
    part = np.minimum((known[:, W.SHARE] * BLOCKS_OF_RUN).astype(np.int64), BLOCKS_OF_RUN - 1)
    return (known[:, W.RUN].astype(np.int64) * BLOCKS_OF_RUN + part)[at]


def problem_of(residual: Array, nuisances: Array, known: Array, at: NDArray[np.int64]) -> Regression:
    """Rows over their noise, each of a frame ``at`` (M,), that share it with those of the same part of a run."""
    run = known[:, W.RUN].astype(np.int64)[at]
    return Regression(residual, nuisances, np.zeros(nuisances.shape[1]), _blocks(known, at), run)


def picture_rows(series: Series, camera: int) -> FrameRows | None:
    """What the ground markers say of one camera's picture; None without two of them in its tracks."""
    ground = series.recordings[0].bodies.get("ground")
    if ground is None or series.tracks is None or series.cameras is None or len(ground.markers) < 2:
        return None
    known, _ = every_frame(series)
    pairs = zip(series.tracks, series.runs, strict=True)
    seen = np.vstack([_pixels(tracks, series, camera, run, ground.markers) for tracks, run in pairs])
    enough = np.isfinite(seen[..., 0]).sum(0) > FEWEST_FRAMES
    if np.count_nonzero(enough) < 2:
        return None
    seen = seen[:, enough]
    moved = seen - np.nanmedian(seen, axis=0)
    markers = moved.shape[1]
    places = np.nanmedian(seen, axis=0)
    # How each coordinate of each marker moves with a unit of each of four numbers, (2 K, 4).
    motion = picture_motion(series.cameras[camera], places).reshape(2 * markers, len(PICTURE))
    flat = moved.reshape(len(moved), 2 * markers)
    sd = np.array([residual_sd(column[np.isfinite(column)]) for column in flat.T])
    # About each run's own place: a picture that lies apart in one run is no gross error.
    for run in np.unique(known[:, W.RUN]):
        own = known[:, W.RUN] == run
        here = np.nan_to_num(np.nanmedian(flat[own], axis=0))
        flat[own] = here + np.clip(flat[own] - here, -CLIP_SD * sd, CLIP_SD * sd)
    noise = _noise_apart(flat, motion)
    if not noise > 0:
        return None
    at, column = np.nonzero(np.isfinite(flat))
    units = {(name, camera): motion[column, j] / noise for j, name in enumerate(PICTURE)}
    nuisances = (column[:, None] == np.arange(2 * markers)) / noise
    return FrameRows(problem_of(flat[at, column] / noise, nuisances, known, at), known, at, units)


def _noise_apart(moved: Array, motion: Array) -> float:
    """Noise (px) of coordinates (N, 2 K) that no ``motion`` (2 K, 4) of the picture makes; of two markers, which leave
    nothing of the kind, from frame to frame."""
    whole = moved[np.isfinite(moved).all(1)]
    free = motion.shape[0] - motion.shape[1]
    if not len(whole):
        return 0.0
    if free == 0:
        return float(np.median([residual_sd(np.diff(column)) for column in whole.T]) / np.sqrt(2))
    basis = np.linalg.qr(motion)[0]
    apart = np.sum((whole - np.median(whole, 0)) ** 2, 1) - np.sum(((whole - np.median(whole, 0)) @ basis) ** 2, 1)
    return float(np.sqrt(np.median(apart) / (2 * gammaincinv(0.5 * free, 0.5))))


def _pixels(
    tracks: pd.DataFrame, series: Series, camera: int, run: Run, markers: Sequence[str]
) -> Array:  # fmt: skip
    """Pixels of the whole sensor (N, K, 2) of ``markers`` in the frames of a run, NaN where unseen."""
    assert series.cameras is not None
    name = series.cameras[camera].name
    own = tracks[(tracks["camera"] == name) & tracks["marker"].isin(list(markers))]
    offset = series.recordings[0].window_offset_px.get(name, (0, 0))
    out = np.full((len(run.frame), len(markers), 2), np.nan)
    at = np.searchsorted(run.frame, own["frame"].to_numpy())
    inside = (at < len(run.frame)) & (run.frame[np.minimum(at, len(run.frame) - 1)] == own["frame"].to_numpy())
    number = own["marker"].map({marker: k for k, marker in enumerate(markers)}).to_numpy(int)
    for axis, column in enumerate(("u_px", "v_px")):
        out[at[inside], number[inside], axis] = own[column].to_numpy(float)[inside] + offset[axis]
    return out


def picture_motion(camera: Camera, pixels: Array) -> Array:
    """How pixels (N, 2) move with a unit of each of :data:`PICTURE`, (N, 2, 4)."""
    place_px = pixels - camera.matrix[:2, 2]
    return np.stack([bend_px(target, 0.0, place_px) for target in PICTURE], -1)


def view_rows(series: Series, targets: Sequence[str], camera: int = 1) -> FrameRows | None:
    """What two views of both bodies say of ``targets`` (:data:`OF_VIEW`) of one ``camera``; None of series without two
    views."""
    if series.points is None or series.cameras is None or "epipolar_px" not in series.points[0]:
        return None
    known, begins = every_frame(series)
    runs = len(series.runs)
    parts: list[tuple[Array, Array, Array, NDArray[np.int64], Array]] = []
    for number, (points, motion, run) in enumerate(zip(series.points, series.motions, series.runs, strict=True)):
        for kind, body in enumerate(("host", "nes")):
            block = body_rows(series, points, motion, run, body, camera)
            if block is None:
                continue
            x, y = block.x_m, block.y_m
            at = begins[number] + np.round(block.share * len(motion)).astype(np.int64)
            place = np.column_stack([x, y, np.zeros(len(x))])
            moves = picture_motion(series.cameras[camera], series.cameras[camera].project(place))
            moves = np.concatenate([moves, (body == "nes") * moves[..., :2]], axis=2)
            shapes = _over_places(x, y, series.contact_radius_m)
            swing = np.zeros((len(x), 2 * runs))
            if run.data.host.omega_rad_per_s:
                swing[:, 2 * number], swing[:, 2 * number + 1] = np.cos(block.phase_rad), np.sin(block.phase_rad)
            lines = (block.line_px, block.line_sd_px, block.line_per_px)
            heights = (block.height_m, block.height_sd_m, block.height_per_px)
            for what, ((value, sd, derivative), late) in enumerate(zip((lines, heights), block.late(), strict=True)):
                unit = np.column_stack([late, np.einsum("ni,nij->nj", derivative, moves)])
                own = np.zeros((len(x), 2 * shapes.shape[1] + 4 + 2 * runs))
                own[:, what * shapes.shape[1] : (what + 1) * shapes.shape[1]] = shapes
                own[:, 2 * shapes.shape[1] + 2 * kind + what] = 1.0
                own[:, 2 * shapes.shape[1] + 4 :] = swing * what
                rows = np.hstack([unit, own]) / sd[:, None]
                fine = np.isfinite(rows).all(1) & np.isfinite(value)
                label = np.full(np.count_nonzero(fine), 2 * kind + what)
                columns = rows[fine, : len(OF_VIEW)], rows[fine, len(OF_VIEW) :]
                parts.append((value[fine] / sd[fine], *columns, at[fine], label))
    if not parts:
        return None
    value, unit, own, at, kinds = (np.concatenate(each) for each in zip(*parts, strict=True))
    value, weight = _over_noise(value, np.column_stack([unit[:, :1], own]), unit[:, 0], known, at, kinds)
    unit, own = unit * weight[:, None], own * weight[:, None]
    units: dict[Key, Array] = {(name, camera): unit[:, OF_VIEW.index(name)] for name in targets}
    # A constant delay and window are effects of the library, whether or not they were found.
    of_run = own.shape[1] - 2 * runs
    used = np.any(own[:, :of_run] != 0, 0)
    nuisances = np.column_stack([unit[:, :3], own[:, :of_run][:, used]])
    # What the Host rises and falls in a run no other run tells: held out, it would be left whole.
    bases = _own_of_runs(own[:, of_run:], known[at, W.RUN])
    nuisances, value = (without_bases(one, bases) for one in (nuisances, value))
    return FrameRows(problem_of(value, nuisances, known, at), known, at, units, bases)


def _own_of_runs(own: Array, run: Array) -> tuple[tuple[slice, Array], ...]:
    """Orthonormal bases of the columns ``own`` (M, Q) that are not nil in each ``run`` (M,), over its rows."""
    begins = np.flatnonzero(np.diff(run, prepend=-1.0))
    parts = [slice(int(a), int(b)) for a, b in zip(begins, [*begins[1:], len(run)], strict=True)]
    columns_of_runs = [(rows, own[rows][:, np.any(own[rows] != 0, 0)]) for rows in parts]
    return tuple((rows, np.linalg.qr(columns)[0]) for rows, columns in columns_of_runs if columns.shape[1])


def _over_places(x: Array, y: Array, radius_m: float) -> Array:
    """Polynomials over the places of a body (N, Q), but for the constant."""
    a, b = x / radius_m, y / radius_m
    powers = [(i, n - i) for n in range(1, LENS_DEGREE + 1) for i in range(n + 1)]
    return np.column_stack([a**i * b**j for i, j in powers])


def _over_noise(
    value: Array, nuisances: Array, delay: Array, known: Array, at: NDArray[np.int64], kinds: Array
) -> tuple[Array, Array]:
    """Values over the noise that they show beside a delay that is free in every part of a run, gross ones clipped; and
    what rows are to be multiplied with."""
    part = (known[:, W.RUN] * FREE_PARTS + np.floor(known[:, W.SHARE] * FREE_PARTS)).astype(np.int64)[at]
    late = np.zeros(len(value))
    for _ in range(BACKFITS):
        fit = least_squares(nuisances, value - late, np.ones(len(value)), rounds=2, ridge=1e-12)
        left = value - nuisances @ fit.coefficients
        limit = CLIP_SD * residual_sd(left)
        slope = np.bincount(part, delay * np.clip(left, -limit, limit)) / np.maximum(
            np.bincount(part, delay**2), 1e-300
        )
        late = slope[part] * delay
    free = left - late
    weight = np.ones(len(value))
    for kind in np.unique(kinds):
        weight[kinds == kind] = 1 / max(residual_sd(free[kinds == kind]), 1e-12)
    gross = np.abs(free * weight) > CLIP_SD
    weight[gross] *= CLIP_SD / np.abs(free * weight)[gross]
    return value * weight, weight
