"""Projection of a sighting with its derivatives, and the normal equations of all."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from vision.calibration.bundle.unknowns import (
    FIXED,
    N_CAMERA,
    N_POSE,
    N_ROTATION,
    Places,
    Setting,
    Sighting,
    State,
    camera_places,
    n_parameters,
    spline_places,
)
from vision.compiled import compiled
from vision.pinhole import FX, FY, pinhole

Array = NDArray[np.float64]

HUBER = 2.5  # sds of a point's residual (two coordinates) beyond which its weight falls


def project(
    sighting: Sighting, state: State, setting: Setting, derivatives: bool = False
) -> tuple[Array, Array, Array, Array]:
    """Pixels (n, 2) and, when wanted, derivatives by intrinsics and spline (n, 2, N_INTRINSICS + F), camera pose
    and board pose (n, 2, 6)."""
    c = sighting.camera
    if sighting.pose == FIXED:
        body = sighting.points_m @ setting.world_from_board.T
        in_world = turned = body
    else:
        turned = sighting.points_m @ state.rotation[sighting.pose].T
        in_world = turned + state.translation[sighting.pose]
    through = sighting.pose == FIXED or sighting.in_world
    rotated = in_world @ state.camera_rotation[c].T if through else in_world
    x_camera = rotated + state.camera_translation[c] if through else in_world
    uv, by_lens, by_point = pinhole(x_camera, state.intrinsics[c])
    spline = state.splines[c]
    if spline is not None:
        uv = spline.seen(uv)
    if not derivatives:
        return uv, by_lens, by_point, by_point
    if spline is not None:
        by_lens = np.concatenate([by_lens, spline.slopes(uv)], -1)
    by_camera, by_pose = np.zeros((len(uv), 2, N_POSE)), np.zeros((len(uv), 2, N_POSE))
    if through:
        by_camera[..., :N_ROTATION], by_camera[..., N_ROTATION:] = by_point @ -_cross(rotated), by_point
        if sighting.pose != FIXED:
            chained = by_point @ state.camera_rotation[c]
            by_pose[..., :N_ROTATION], by_pose[..., N_ROTATION:] = chained @ -_cross(turned), chained
    else:
        by_pose[..., :N_ROTATION], by_pose[..., N_ROTATION:] = by_point @ -_cross(turned), by_point
    return uv, by_lens, by_camera, by_pose


def _cross(v: Array) -> Array:
    crossed = np.zeros((len(v), 3, 3))
    crossed[:, 0, 1], crossed[:, 0, 2], crossed[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    crossed[:, 1, 0], crossed[:, 2, 0], crossed[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return crossed


def normal_equations(sightings: Sequence[Sighting], state: State, setting: Setting) -> tuple[float, Array, Array]:
    """Robust cost, normal matrix and right-hand side.  Unknown order: N_CAMERA per camera, the splines, then N_POSE per
    pose; held ones are zero.
    """
    kept = n_parameters(state.splines)
    size = kept + N_POSE * len(state.rotation)
    normal, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    places = [camera_places(state.splines, c) for c in range(len(state.splines))]
    for sighting, (derivative, residual, sigma) in zip(sightings, rows_of(sightings, state, setting), strict=True):
        where = places[sighting.camera]
        if sighting.pose != FIXED:
            where = np.concatenate([where, kept + N_POSE * sighting.pose + np.arange(N_POSE)])
        cost += add_rows(derivative, residual, sigma, where, normal, right)
    return cost + _add_priors(state, setting, normal, right), normal, right


def rows_of(sightings: Sequence[Sighting], state: State, setting: Setting) -> Iterator[tuple[Array, Array, float]]:
    """Of each sighting: derivatives (n, 2, P) of its pixels by its camera's numbers (:func:`camera_places`; zero by
    those that are held) and its own pose, unless that is FIXED; residuals (n, 2) and their sd [px].
    """
    free = [setting.lens_free(state, c).astype(float) for c in range(len(state.splines))]
    for sighting in sightings:
        uv, by_lens, by_camera, by_pose = project(sighting, state, setting, derivatives=True)
        blocks = [by_lens * free[sighting.camera], by_camera * setting.camera_poses_free]
        if sighting.pose != FIXED:
            blocks.append(by_pose)
        sigma = float(sighting.share * setting.sigma_px[sighting.camera])
        yield np.concatenate(blocks, -1), np.asarray(sighting.uv_px - uv), sigma


@compiled
def add_rows(derivative: Array, residual: Array, sigma: float, where: Places, normal: Array, right: Array) -> float:
    """Robust cost of a view's residuals (n, 2), in px, whose ``derivative`` (n, 2, P) is by the unknowns ``where``
    (P,); their part is added to ``normal`` and ``right``.
    """
    count, cost = len(where), 0.0
    rows, left = np.empty((2 * len(residual), count)), np.empty(2 * len(residual))
    for i in range(len(residual)):
        length = np.sqrt(residual[i, 0] ** 2 + residual[i, 1] ** 2) / sigma
        cost += length * length if length < HUBER else 2 * HUBER * length - HUBER * HUBER
        weight = np.sqrt(min(1.0, HUBER / max(length, 1e-12))) / sigma
        for axis in range(2):
            left[2 * i + axis] = weight * residual[i, axis]
            for j in range(count):
                rows[2 * i + axis, j] = weight * derivative[i, axis, j]
    across = np.ascontiguousarray(rows.T)
    own, pulled = across @ rows, across @ left
    for j in range(count):
        right[where[j]] += pulled[j]
        for k in range(count):
            normal[where[j], where[k]] += own[j, k]
    return cost


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
