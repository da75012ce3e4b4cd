"""Projection of observations with their derivatives, and the normal equations of all.

All observations of a camera are projected together, and a spline's part of the equations is put together by what it is:
its numbers along u move pixels along u alone, those along v as much along v.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ovines.robust import huber_loss, huber_weight
from vision.calibration.bundle.unknowns import (
    FIXED,
    N_CAMERA,
    N_POSE,
    N_ROTATION,
    Observation,
    Setting,
    State,
    n_parameters,
    spline_places,
)
from vision.pinhole import FX, FY, N_INTRINSICS, pinhole

Array = NDArray[np.float64]

HUBER = 2.5  # sds of a point's residual (two coordinates) beyond which its weight falls


class _Projected(NamedTuple):
    """Of the points of several observations by one camera: pixels (n, 2), derivatives by the intrinsics (n, 2,
    N_INTRINSICS), the camera's pose and the board's (n, 2, N_POSE), and of either axis by the spline (n, G).
    """

    uv: Array
    by_lens: Array
    by_camera: Array
    by_pose: Array
    basis: Array


class Rows(NamedTuple):
    """The weighted equations of a camera's ``observations``: derivatives of n points by the camera's numbers and pose
    ``plain`` (n, 2, N_CAMERA), of either axis by the spline ``basis`` (n, G), by the board's pose ``posed`` (n, 2,
    N_POSE); ``residual`` (n, 2); ``observation`` (n,) to which each point belongs; ``cost`` of all.
    """

    observations: Sequence[Observation]
    plain: Array
    basis: Array
    posed: Array
    residual: Array
    observation: NDArray[np.intp]
    cost: float

    def gram(self) -> tuple[Array, Array]:
        """Normal matrix (P, P) and right side (P,) of the camera's own numbers (`camera_places`)."""
        size, own = self.basis.shape[1], self.plain.shape[2]
        flat = self.plain.reshape(-1, own)
        matrix, right = np.zeros((own + 2 * size, own + 2 * size)), np.empty(own + 2 * size)
        matrix[:own, :own], right[:own] = flat.T @ flat, flat.T @ self.residual.ravel()
        if size:
            both = self.basis.T @ self.basis
            for axis in range(2):
                there = slice(own + axis * size, own + (axis + 1) * size)
                matrix[there, there], right[there] = both, self.basis.T @ self.residual[:, axis]
                matrix[there, :own] = self.basis.T @ self.plain[:, axis]
                matrix[:own, there] = matrix[there, :own].T
        return matrix, right

    def poses(self) -> Iterator[tuple[Observation, Array, Array, Array]]:
        """Of each observation whose pose is sought: it, its pose's coupling with the camera's numbers (P, N_POSE),
        normal matrix and right side.
        """
        size, own = self.basis.shape[1], self.plain.shape[2]
        ends = np.searchsorted(self.observation, np.arange(len(self.observations) + 1))
        for observation, first, end in zip(self.observations, ends, ends[1:], strict=False):
            if observation.pose == FIXED:
                continue
            posed, basis = self.posed[first:end], self.basis[first:end]
            flat, coupling = posed.reshape(-1, N_POSE), np.empty((own + 2 * size, N_POSE))
            coupling[:own] = self.plain[first:end].reshape(-1, own).T @ flat
            if size:
                coupling[own : own + size], coupling[own + size :] = basis.T @ posed[:, 0], basis.T @ posed[:, 1]
            yield observation, coupling, flat.T @ flat, flat.T @ self.residual[first:end].ravel()


def project(
    observation: Observation, state: State, setting: Setting, derivatives: bool = False
) -> tuple[Array, Array, Array, Array]:
    """Pixels (n, 2) and, when wanted, derivatives by intrinsics and spline (n, 2, N_INTRINSICS + F), camera pose
    and board pose (n, 2, 6)."""
    uv, by_lens, by_camera, by_pose, basis = _projected([observation], state, setting, derivatives)
    if basis.size:
        zero = np.zeros_like(basis)
        bent = np.stack([np.concatenate([basis, zero], 1), np.concatenate([zero, basis], 1)], 1)
        by_lens = np.concatenate([by_lens, bent], -1)
    return uv, by_lens, by_camera, by_pose


def residuals_of(observations: Sequence[Observation], state: State, setting: Setting) -> list[Array]:
    """Measured less projected pixels (n, 2) of each observation."""
    out: list[Array] = [np.empty((0, 2))] * len(observations)
    for c in range(len(state.splines)):
        numbers = [k for k, observation in enumerate(observations) if observation.camera == c]
        if numbers:
            own = [observations[k] for k in numbers]
            uv = _projected(own, state, setting, False).uv
            for k, seen in zip(numbers, np.split(uv, np.cumsum([len(one.uv_px) for one in own])[:-1]), strict=True):
                out[k] = np.asarray(observations[k].uv_px - seen)
    return out


def _projected(observations: Sequence[Observation], state: State, setting: Setting, derivatives: bool) -> _Projected:
    """The points of observations by one camera, below each other; without ``derivatives`` those are empty."""
    c = observations[0].camera
    number = np.repeat(np.arange(len(observations)), [len(one.points_m) for one in observations])
    fixed = [one.pose == FIXED for one in observations]
    turns = np.stack(
        [
            setting.world_from_board if held else state.rotation[one.pose]
            for one, held in zip(observations, fixed, strict=True)
        ]
    )
    shifts = np.stack(
        [np.zeros(3) if held else state.translation[one.pose] for one, held in zip(observations, fixed, strict=True)]
    )
    through = np.array([held or one.in_world for one, held in zip(observations, fixed, strict=True)])[number, None]
    turned = np.einsum("nij,nj->ni", turns[number], np.concatenate([one.points_m for one in observations]))
    placed = turned + shifts[number]
    rotated = np.where(through, placed @ state.camera_rotation[c].T, placed)
    uv, by_lens, by_point = pinhole(
        np.where(through, rotated + state.camera_translation[c], rotated), state.intrinsics[c]
    )
    spline, basis = state.splines[c], np.empty((len(uv), 0))
    if spline is not None:
        uv = spline.seen(uv)
    if not derivatives:
        nothing = np.empty((len(uv), 2, 0))
        return _Projected(uv, nothing, nothing, nothing, basis)
    if spline is not None:
        basis = spline.basis(uv)
    chained = np.where(through[..., None], by_point @ state.camera_rotation[c], by_point)
    by_pose, by_camera = np.empty((len(uv), 2, N_POSE)), np.empty((len(uv), 2, N_POSE))
    by_pose[..., :N_ROTATION], by_pose[..., N_ROTATION:] = _crossed(turned, chained), chained
    by_camera[..., :N_ROTATION], by_camera[..., N_ROTATION:] = _crossed(rotated, by_point), by_point
    return _Projected(uv, by_lens, by_camera * through[..., None], by_pose, basis)


def _crossed(v: Array, rows: Array) -> Array:
    """v (n, 3) times each of rows (n, 2, 3): what a turn about v's origin does where a step does ``rows``."""
    (x, y, z), (a, b, c) = v.T[..., None], np.moveaxis(rows, -1, 0)
    return np.stack([y * c - z * b, z * a - x * c, x * b - y * a], -1)


def normal_equations(observations: Sequence[Observation], state: State, setting: Setting) -> tuple[float, Array, Array]:
    """Robust cost, normal matrix and right-hand side.  Unknown order: N_CAMERA per camera, the splines, then N_POSE per
    pose; held ones are zero.
    """
    kept = n_parameters(state.splines)
    size = kept + N_POSE * len(state.rotation)
    normal, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for c, rows in rows_of(observations, state, setting):
        bent = spline_places(state.splines, c)
        parts = [(slice(N_CAMERA * c, N_CAMERA * (c + 1)), slice(0, N_CAMERA))]
        if len(bent):
            parts.append((slice(bent[0], bent[-1] + 1), slice(N_CAMERA, None)))
        own, pulled = rows.gram()
        for there, here in parts:
            right[there] += pulled[here]
            for beside, other in parts:
                normal[there, beside] += own[here, other]
        for observation, coupling, posed, moved in rows.poses():
            pose = slice(kept + N_POSE * observation.pose, kept + N_POSE * (observation.pose + 1))
            normal[pose, pose] += posed
            right[pose] += moved
            for there, here in parts:
                normal[there, pose] += coupling[here]
                normal[pose, there] += coupling[here].T
        cost += rows.cost
    return cost + _add_priors(state, setting, normal, right), normal, right


def rows_of(observations: Sequence[Observation], state: State, setting: Setting) -> Iterator[tuple[int, Rows]]:
    """Of each camera that saw something: its number and equations, robustly weighted; zero by what is held."""
    for c in range(len(state.splines)):
        own = [observation for observation in observations if observation.camera == c]
        if not own:
            continue
        seen = _projected(own, state, setting, True)
        counts = [len(one.uv_px) for one in own]
        residual = np.concatenate([one.uv_px for one in own]) - seen.uv
        sigma = np.repeat([one.share * setting.sigma_px[c] for one in own], counts)
        length = np.hypot(*residual.T) / sigma
        cost = huber_loss(length, HUBER).sum()
        weight = np.sqrt(huber_weight(length, HUBER)) / sigma
        plain = np.empty((len(residual), 2, N_CAMERA))
        plain[..., :N_INTRINSICS] = seen.by_lens * (setting.free[c] * weight[:, None])[:, None]
        plain[..., N_INTRINSICS:] = seen.by_camera * (setting.camera_poses_free * weight)[:, None, None]
        number = np.repeat(np.arange(len(own)), counts)
        yield (
            c,
            Rows(
                own,
                plain,
                seen.basis * weight[:, None],
                seen.by_pose * weight[:, None, None],
                residual * weight[:, None],
                number,
                float(cost),
            ),
        )


def _add_priors(state: State, setting: Setting, normal: Array, right: Array) -> float:
    cost = 0.0
    for c, values in enumerate(state.intrinsics):
        for k in np.flatnonzero(setting.free[c] & np.isfinite(setting.prior_sd[c])):
            pull = (setting.prior[c, k] - values[k]) / setting.prior_sd[c, k]
            normal[N_CAMERA * c + k, N_CAMERA * c + k] += setting.prior_sd[c, k] ** -2
            right[N_CAMERA * c + k] += pull / setting.prior_sd[c, k]
            cost += pull**2
        if setting.free[c, FX] and setting.free[c, FY]:
            sd = setting.aspect_sd * values[FX]
            pull, where = (values[FX] - values[FY]) / sd, [N_CAMERA * c + FX, N_CAMERA * c + FY]
            normal[np.ix_(where, where)] += np.array([[1, -1], [-1, 1]]) / sd**2
            right[where] += np.array([-pull, pull]) / sd
            cost += pull**2
    for c, prior in enumerate(setting.spline_priors):
        spline, own = state.splines[c], spline_places(state.splines, c)
        if prior is not None and spline is not None:
            off = prior.mean_px - spline.values_px
            normal[np.ix_(own, own)] += prior.precision
            right[own] += prior.precision @ off
            cost += float(off @ prior.precision @ off)
    return cost
