"""A calibration against itself: two halves of the views solved apart, and what their residuals have in common.

A lens model that is wrong by something smooth leaves the same residuals wherever it is used (the field), and two sets
of views answer it with different lenses (the halves).  Noise does neither, beyond what the covariance says.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander2d
from numpy.typing import NDArray
from scipy.special import chdtrc, fdtrc

from vision.calibration.bundle.adjustment import adjust
from vision.calibration.bundle.equations import project
from vision.calibration.bundle.unknowns import Observation
from vision.calibration.single_camera import Single, observations_of, only_poses
from vision.calibration.targets.boards import Board
from vision.pinhole import pinhole
from vision.validation.image_map import ImageMap

Array = NDArray[np.float64]
FEWEST_VIEWS = 8  # for two halves of four
DEGREES = 4, 9  # of the fields looked for: a bend over the whole image, and waves of a quarter of it
MOST_POINTS = 150  # of a board whose own errors can be separated from the lens'
SEEN = 0.05  # of the largest: smaller ways in which halves may differ show nowhere in the image
FLAG = 0.01  # probability by chance below which each of the two tests speaks
LEAST_FIELD_PX = 0.005  # RMS of a field that is worth a word: dots a hundred pixels wide show a tenth of it


@dataclass(frozen=True)
class Halves:
    """``apart_px`` (n, 2): the second half's lens minus the first's, over the map; ``sd_px`` (n,) what the covariance
    lets it be; ``p`` of so much by chance.
    """

    apart_px: Array
    sd_px: Array
    p: float


@dataclass(frozen=True)
class Field:
    """What residuals have in common by their place in the image: RMS [px] over points beyond what noise makes, and the
    probability ``p`` of so much by chance.
    """

    rms_px: float
    p: float


def compare_halves(single: Single, board: Board, at: ImageMap) -> Halves | None:
    """Every other view against the rest; None for fewer than FEWEST_VIEWS views."""
    if len(single.views) < FEWEST_VIEWS:
        return None
    lenses, covariances = [], []
    for first in (0, 1):
        stay = list(range(first, len(single.views), 2))
        start = only_poses(single.adjusted.state, stay)
        views = [single.views[k] for k in stay]
        found = adjust(observations_of(views, board, start), start, copy(single.setting))
        spline = found.state.splines[0]
        lenses.append(np.concatenate([found.state.intrinsics[0], [] if spline is None else spline.values_px]))
        covariances.append(np.nan_to_num(found.lens_covariance(0)))
    covariance = covariances[0] + covariances[1]
    change = lenses[1] - lenses[0]
    free = np.flatnonzero(np.diag(covariance) > 0)
    scale = np.sqrt(np.diag(covariance)[free])
    values, vectors = np.linalg.eigh(covariance[np.ix_(free, free)] / np.outer(scale, scale))
    values = np.maximum(values, 1e-12)
    white = vectors.T @ (change[free] / scale) / np.sqrt(values)  # of variance 1 where only noise parts the halves
    moves = at.slopes[at.visited][..., free].reshape(-1, len(free)) * scale @ vectors * np.sqrt(values)
    _, size, ways = np.linalg.svd(moves, full_matrices=False)
    seen = size > SEEN * size[0]
    p = float(chdtrc(seen.sum(), np.sum((ways[seen] @ white) ** 2)))
    return Halves(at.moved(change), at.sd_px(covariance), p)


def residual_field(single: Single, board: Board) -> Field:
    """Whether smooth fields over the image explain residuals that the lens, the poses and the board's own errors
    leave.
    """
    found = single.adjusted
    points_m, several = board.points_m(), len(board.points_m()) <= MOST_POINTS
    uv = np.concatenate([view.uv_px for view in single.views])
    low, span = uv.min(0), np.ptp(uv, axis=0)
    tested = [_Sums(degree, 2 * len(points_m) * several) for degree in DEGREES]
    for observation, residual in zip(
        observations_of(single.views, board, found.state), found.residuals_px, strict=True
    ):
        seen, by_lens, _, by_pose = project(observation, found.state, single.setting, derivatives=True)
        fixed = [by_lens[..., single.setting.lens_free(found.state, 0)].reshape(2 * len(residual), -1)]
        if several:
            fixed.append(_board_slopes(observation, single, len(points_m)))
        posed = np.linalg.qr(by_pose.reshape(-1, by_pose.shape[-1]))[0]
        place = 2 * (seen - low) / span - 1  # as predicted: the place as measured would bring the noise in
        for sums in tested:
            sums.add(residual.ravel(), posed, np.column_stack(fixed), place)
    fields = [sums.field() for sums in tested]
    p = min(1.0, len(fields) * min(field.p for field in fields))
    return Field(max(fields, key=lambda field: -field.p).rms_px, p)


def _board_slopes(observation: Observation, single: Single, count: int) -> Array:
    """Derivatives (2 n, 2 count) of a view's pixels by where the board's points lie on it."""
    state = single.adjusted.state
    turn, shift = state.rotation[observation.pose], state.translation[observation.pose]
    slope = pinhole(observation.points_m @ turn.T + shift, state.intrinsics[0])[2] @ turn[:, :2]
    out = np.zeros((len(slope), 2, count, 2))
    out[np.arange(len(slope)), :, single.views[observation.pose].points] = slope
    return out.reshape(2 * len(slope), 2 * count)


class _Sums:
    """Normal equations of residuals by what is fixed (lens, board) and a field, the poses projected out."""

    def __init__(self, degree: int, board: int) -> None:
        self.degree, self.board = degree, board
        self.rows = self.posed = 0
        self.squares = 0.0
        self.normal: Array = np.empty((0, 0))
        self.right: Array = np.empty(0)
        self.fixed = 0

    def add(self, residual: Array, posed: Array, fixed: Array, place: Array) -> None:
        terms = legvander2d(place[:, 0], place[:, 1], [self.degree, self.degree])
        across, down = np.divmod(np.arange(terms.shape[1]), self.degree + 1)
        terms = terms[:, across + down <= self.degree]
        waves = np.zeros((len(residual), 2 * terms.shape[1]))
        waves[0::2, : terms.shape[1]] = waves[1::2, terms.shape[1] :] = terms
        every = np.column_stack([fixed, waves])
        every, residual = every - posed @ (posed.T @ every), residual - posed @ (posed.T @ residual)
        if not self.rows:
            self.normal, self.right = np.zeros((every.shape[1],) * 2), np.zeros(every.shape[1])
        self.normal += every.T @ every
        self.right += every.T @ residual
        self.squares += float(residual @ residual)
        self.rows, self.posed, self.fixed = self.rows + len(residual), self.posed + posed.shape[1], fixed.shape[1]

    def field(self) -> Field:
        """Fisher's F of what the field explains beyond the fixed part."""
        without, taken = self._explained(self.fixed)
        whole, rank = self._explained(len(self.normal))
        more, freedom = rank - taken, self.rows - self.posed - rank
        if more < 1 or freedom < more:
            return Field(0.0, 1.0)
        variance = max(self.squares - whole, 1e-30) / freedom
        gain = max(whole - without, 0.0)
        p = float(fdtrc(more, freedom, gain / more / variance))
        return Field(float(np.sqrt(2 * max(gain - more * variance, 0.0) / self.rows)), p)

    def _explained(self, count: int) -> tuple[float, int]:
        """Squares that the first ``count`` columns explain, and their rank."""
        scale = np.sqrt(np.maximum(np.diag(self.normal)[:count], 1e-300))
        values, vectors = np.linalg.eigh(self.normal[:count, :count] / np.outer(scale, scale))
        good = values > _RANK * values[-1]
        along = vectors[:, good].T @ (self.right[:count] / scale)
        return float(np.sum(along**2 / values[good])), int(good.sum())


_RANK = 1e-9  # smallest eigenvalue over the largest that counts


def flagged(halves: Halves | None, field: Field) -> tuple[bool, bool]:
    """Whether the halves contradict each other, and whether residuals hang together by more than a trifle."""
    return halves is not None and halves.p < FLAG, field.p < FLAG and field.rms_px > LEAST_FIELD_PX
