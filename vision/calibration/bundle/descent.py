"""Levenberg's steps on the normal equations, board poses solved for first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from vision.calibration.bundle.equations import normal_equations
from vision.calibration.bundle.unknowns import (
    N_CAMERA,
    N_POSE,
    N_ROTATION,
    Observation,
    Setting,
    State,
    n_parameters,
    spline_places,
)
from vision.pinhole import N_INTRINSICS

Array = NDArray[np.float64]

# Levenberg's damping: at first, after a step down and up, and its bounds.
_DAMPING, _DAMPING_DOWN, _DAMPING_UP, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 0.2, 8, 1e-9, 1e8
_SETTLED = 1e-6  # relative gain that ends a descent


def without_poses(normal: Array, kept: int) -> tuple[Array, Array, Array]:
    """Normal matrix of the first ``kept`` unknowns with the board poses solved for (Schur's complement).

    Poses do not touch each other: their part is made of 6 x 6 blocks, so that nothing large is ever inverted.
    Gives the complement (kept, kept), the blocks' inverses (n, 6, 6) and the coupling (kept, 6 n).
    """
    count = (len(normal) - kept) // N_POSE
    where = kept + np.arange(N_POSE * count).reshape(count, N_POSE)
    inverses = np.asarray(np.linalg.inv(normal[where[:, :, None], where[:, None, :]]), float)
    coupling = normal[:kept, kept:]
    solved = np.einsum("knp,npq->knq", coupling.reshape(kept, count, N_POSE), inverses).reshape(kept, -1)
    return np.asarray(normal[:kept, :kept] - solved @ coupling.T), inverses, coupling


def _by_blocks(blocks: Array, wanted: Array) -> Array:
    """Blocks (n, 6, 6) along the diagonal, times (6 n,)."""
    return np.asarray((blocks @ wanted.reshape(-1, N_POSE, 1)).ravel())


def _step(normal: Array, right: Array, damping: float, kept: int) -> Array:
    """Levenberg's step, the diagonal raised by ``damping`` of itself; held unknowns (zero diagonal) stay."""
    scale = np.where(np.diag(normal) > 0, 1 / np.sqrt(np.where(np.diag(normal) > 0, np.diag(normal), 1.0)), 0.0)
    scaled, wanted = normal * np.outer(scale, scale), scale * right
    scaled[np.diag_indices_from(scaled)] = np.where(scale > 0, 1.0 + damping, 1.0)
    complement, inverses, coupling = without_poses(scaled, kept)
    cameras = np.linalg.solve(complement, wanted[:kept] - coupling @ _by_blocks(inverses, wanted[kept:]))
    poses = _by_blocks(inverses, wanted[kept:] - cameras @ coupling)
    return np.asarray(scale * np.concatenate([cameras, poses]))


def descend(observations: Sequence[Observation], state: State, setting: Setting, iterations: int) -> State:
    """The state in which the cost is least, from ``state`` on, after so many ``iterations`` at the most."""
    damping = _DAMPING
    cost, normal, right = normal_equations(observations, state, setting)
    for _ in range(iterations):
        step = _step(normal, right, damping, n_parameters(state.splines))
        trial = _moved(state, step)
        new = normal_equations(observations, trial, setting)
        if new[0] <= cost:
            gain, state = cost - new[0], trial
            cost, normal, right = new
            damping = max(_LEAST_DAMPING, _DAMPING_DOWN * damping)
            if gain < _SETTLED * max(cost, 1.0):
                break
        else:
            damping *= _DAMPING_UP
            if damping > _MOST_DAMPING:
                break
    return state


def _moved(state: State, step: Array) -> State:
    trial, cameras = state.copy(), len(state.intrinsics)
    trial.splines = tuple(
        None if one is None else one.with_values(one.values_px + step[spline_places(state.splines, c)])
        for c, one in enumerate(state.splines)
    )
    for c in range(cameras):
        own = step[N_CAMERA * c : N_CAMERA * (c + 1)]
        turn, shift = np.split(own[N_INTRINSICS:], [N_ROTATION])
        trial.intrinsics[c] += own[:N_INTRINSICS]
        trial.camera_rotation[c] = cv2.Rodrigues(turn)[0] @ state.camera_rotation[c]
        trial.camera_translation[c] += shift
    for p, own in enumerate(step[n_parameters(state.splines) :].reshape(-1, N_POSE)):
        trial.rotation[p] = cv2.Rodrigues(own[:N_ROTATION])[0] @ state.rotation[p]
        trial.translation[p] += own[N_ROTATION:]
    return trial


def information(observations: Sequence[Observation], state: State, setting: Setting, c: int = 0) -> tuple[Array, Array]:
    """What observations alone say of camera ``c``'s spline: information (F, F) and right side (F,) of its numbers,
    everything else integrated out.
    """
    bare = replace(setting, spline_priors=())
    _, normal, right = normal_equations(observations, state, bare)
    kept, own = n_parameters(state.splines), spline_places(state.splines, c)
    complement, inverses, coupling = without_poses(normal, kept)
    left = right[:kept] - coupling @ _by_blocks(inverses, right[kept:])
    others = np.setdiff1d(np.flatnonzero(np.diag(normal)[:kept] > 0), own)
    scale = 1 / np.sqrt(np.diag(complement)[others])
    scaled = complement[np.ix_(others, others)] * np.outer(scale, scale)
    beside = complement[np.ix_(own, others)] * scale
    solved = np.linalg.solve(scaled, np.column_stack([beside.T, left[others] * scale]))
    of_spline = complement[np.ix_(own, own)] - beside @ solved[:, :-1]
    spline = state.splines[c]
    assert spline is not None  # the caller asks for a camera that has one
    right_of_spline = left[own] - beside @ solved[:, -1] + of_spline @ spline.values_px
    return 0.5 * (of_spline + of_spline.T), np.asarray(right_of_spline, float)
