"""Bundle adjustment of cameras and board poses, with the full least-squares covariance.

Unknowns: per camera sixteen intrinsics (fx, fy, cx, cy and OpenCV's twelve distortion terms; some held, at zero) and
its pose in the world; per board view a pose, either in the one camera's frame or, when both cameras saw the board at
once, in the world.  Gauss-Newton with Levenberg's damping on the normal equations, Huber weights, weak
priors.  Rotations are updated by a rotation vector from the left, so none is ever near a singularity.
OpenCV 5's own standard deviations of cx, cy come out far too small for a small board; these do not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.camera import LENS_TERMS, Camera
from ovines.robust import residual_sd

Array = NDArray[np.float64]
INTRINSICS = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
FX, FY, CX, CY, K1, K2, P1, P2, K3, K4, K5, K6, S1, S2, S3, S4 = range(16)  # their places
POSE = ("rx", "ry", "rz", "tx", "ty", "tz")  # r: a rotation vector applied after the camera's own rotation
N_INTRINSICS, N_POSE = len(INTRINSICS), len(POSE)
N_ROTATION = 3  # of a pose's unknowns, then the translation
N_CAMERA = N_INTRINSICS + N_POSE  # unknowns of a camera
HUBER = 2.5  # sds of a point's residual (two coordinates) beyond which its weight falls
FIXED = -1  # number of the pose of the board that defines the world
_ROUNDS, _SAME_SD = 4, 0.05  # of sd and weights, which settle in two; relative change that ends them
_LEAST_SIGMA_PX = 1e-4  # of an exact film: weights stay finite
_LEAST_FREEDOM = 0.1  # share of the residuals that the parameters leave at least
# Levenberg's damping: at first, after a step down and up, and its bounds.
_DAMPING, _DAMPING_DOWN, _DAMPING_UP, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 0.2, 8, 1e-9, 1e8
_SETTLED = 1e-6  # relative gain that ends a descent


@dataclass
class Sighting:
    """A board's points in one image: ``points_m`` (n, 3), ``uv_px`` (n, 2), seen by ``camera``, the board at ``pose``.

    ``pose`` FIXED: the board defines the world.  ``in_world``: the pose is board -> world, else board -> camera.
    """

    camera: int
    pose: int
    in_world: bool
    points_m: Array
    uv_px: Array


@dataclass
class State:
    """``intrinsics`` (C, N_INTRINSICS); camera poses and board poses as rotation matrices and translations."""

    intrinsics: Array
    camera_rotation: Array
    camera_translation: Array
    rotation: Array
    translation: Array

    def copy(self) -> State:
        """A state with arrays of its own."""
        return State(*(np.array(value) for value in vars(self).values()))


@dataclass
class Setting:
    """What is free (C, N_INTRINSICS), priors (as many) means and sd, sd of fy/fx - 1, the defining board's pose."""

    free: NDArray[np.bool_]
    prior: Array
    prior_sd: Array
    aspect_sd: float
    world_from_board: Array
    camera_poses_free: bool = True
    # the misfit of tied views is neither camera's: without this one takes all the weight and the other all the misfit
    one_sigma: bool = False
    sigma_px: Array = field(default_factory=lambda: np.ones(0))


@dataclass
class Adjusted:
    """The state found, sd of a pixel coordinate per camera, residuals (measured - projected) per sighting, and the
    covariance.

    ``covariance`` is over ``labels``: (camera, parameter) for intrinsics and camera poses, in that order.
    """

    state: State
    sigma_px: Array
    residuals_px: list[Array]
    camera_of: list[int]
    covariance: Array
    chi2: float
    labels: list[tuple[int, str]]


def adjust(sightings: Sequence[Sighting], start: State, setting: Setting, iterations: int = 40) -> Adjusted:
    """Minimise the robust weighted reprojection error; the pixel sd of each camera is estimated along the way."""
    cameras, state = len(start.intrinsics), start.copy()
    sigma = np.ones(cameras)
    if len(setting.sigma_px) == cameras:
        sigma = setting.sigma_px
    for _ in range(_ROUNDS):
        setting.sigma_px = sigma
        state = _descend(sightings, state, setting, iterations)
        sigma = _spread(sightings, state, setting)
        if np.allclose(sigma, setting.sigma_px, rtol=_SAME_SD):
            break
    setting.sigma_px = sigma
    cost, normal, _ = _normal(sightings, state, setting)
    kept = cameras * N_CAMERA
    used = np.flatnonzero(np.diag(normal)[:kept] > 0)
    covariance = np.full((kept, kept), np.nan)
    complement = _eliminated(normal, kept)[0][np.ix_(used, used)]
    scale = 1 / np.sqrt(np.diag(normal)[used])  # without it the pseudo-inverse would drop what is known least
    covariance[np.ix_(used, used)] = np.linalg.pinv(complement * np.outer(scale, scale), hermitian=True) * np.outer(
        scale, scale
    )
    labels = [(c, name) for c in range(cameras) for name in (*INTRINSICS, *POSE)]
    return Adjusted(
        state,
        sigma,
        [s.uv_px - project(s, state, setting)[0] for s in sightings],
        [s.camera for s in sightings],
        covariance,
        cost,
        labels,
    )


def project(
    sighting: Sighting, state: State, setting: Setting, derivatives: bool = False
) -> tuple[Array, Array, Array, Array]:
    """Pixels (n, 2) and, when wanted, derivatives by intrinsics (n, 2, N_INTRINSICS), camera pose
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
    uv, by_intrinsics, by_point = pinhole(x_camera, state.intrinsics[c])
    if not derivatives:
        return uv, by_intrinsics, by_point, by_point
    by_camera, by_pose = np.zeros((len(uv), 2, N_POSE)), np.zeros((len(uv), 2, N_POSE))
    if through:
        by_camera[..., :N_ROTATION], by_camera[..., N_ROTATION:] = by_point @ -_cross(rotated), by_point
        if sighting.pose != FIXED:
            chained = by_point @ state.camera_rotation[c]
            by_pose[..., :N_ROTATION], by_pose[..., N_ROTATION:] = chained @ -_cross(turned), chained
    else:
        by_pose[..., :N_ROTATION], by_pose[..., N_ROTATION:] = by_point @ -_cross(turned), by_point
    return uv, by_intrinsics, by_camera, by_pose


def lens_of(intrinsics: Array) -> tuple[Array, Array]:
    """Camera matrix (3, 3) and the distortion in OpenCV's order, as short as its terms allow (5, 8 or 12)."""
    fx, fy, cx, cy = intrinsics[:K1]
    terms = next(n for n in LENS_TERMS if not intrinsics[K1 + n :].any())
    return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), np.array(intrinsics[K1 : K1 + terms])


def intrinsics_of(camera: Camera) -> Array:
    """The camera's lens as ``State`` has it (N_INTRINSICS,)."""
    k, missing = camera.matrix, N_INTRINSICS - K1 - len(camera.distortion)
    return np.concatenate([[k[0, 0], k[1, 1], k[0, 2], k[1, 2]], camera.distortion, np.zeros(missing)])


def pinhole(x_camera: Array, intrinsics: Array) -> tuple[Array, Array, Array]:
    """OpenCV's lens of up to twelve terms: pixels (n, 2), derivatives by the intrinsics (n, 2, N_INTRINSICS) and by the
    point (n, 2, 3).
    """
    fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = intrinsics
    inverse = 1 / x_camera[:, 2]
    x, y = x_camera[:, 0] * inverse, x_camera[:, 1] * inverse
    r2 = x * x + y * y
    below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6))
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * r2 * k3) - radial * (k4 + r2 * (2 * k5 + 3 * r2 * k6))) / below
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + r2 * s2)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + r2 * s4)
    across, down = 2 * (s1 + 2 * s2 * r2), 2 * (s3 + 2 * s4 * r2)
    mixed = x * y * slope + 2 * p1 * x + 2 * p2 * y
    by_x = fx * np.stack([radial + x * x * slope + 2 * p1 * y + 6 * p2 * x + across * x, mixed + across * y], -1)
    by_y = fy * np.stack([mixed + down * x, radial + y * y * slope + 6 * p1 * y + 2 * p2 * x + down * y], -1)
    by_point = np.stack(
        [
            np.stack([by[:, 0] * inverse, by[:, 1] * inverse, -(by[:, 0] * x + by[:, 1] * y) * inverse], -1)
            for by in (by_x, by_y)
        ],
        -2,
    )
    by_intrinsics = np.zeros((len(x), 2, N_INTRINSICS))
    by_intrinsics[:, 0, FX], by_intrinsics[:, 1, FY] = xd, yd
    by_intrinsics[:, 0, CX] = by_intrinsics[:, 1, CY] = 1
    for axis, (focal, along) in enumerate(((fx, x), (fy, y))):
        power = focal * along * r2 / below
        for above, under in ((K1, K4), (K2, K5), (K3, K6)):
            by_intrinsics[:, axis, above], by_intrinsics[:, axis, under] = power, -radial * power
            power = power * r2
    by_intrinsics[:, 0, P1], by_intrinsics[:, 0, P2] = 2 * fx * x * y, fx * (r2 + 2 * x * x)
    by_intrinsics[:, 1, P1], by_intrinsics[:, 1, P2] = fy * (r2 + 2 * y * y), 2 * fy * x * y
    by_intrinsics[:, 0, S1], by_intrinsics[:, 0, S2] = fx * r2, fx * r2 * r2
    by_intrinsics[:, 1, S3], by_intrinsics[:, 1, S4] = fy * r2, fy * r2 * r2
    return np.stack([fx * xd + cx, fy * yd + cy], -1), by_intrinsics, by_point


def _cross(v: Array) -> Array:
    zero = 0 * v[:, 0]
    return np.stack(
        [
            np.stack([zero, -v[:, 2], v[:, 1]], -1),
            np.stack([v[:, 2], zero, -v[:, 0]], -1),
            np.stack([-v[:, 1], v[:, 0], zero], -1),
        ],
        -2,
    )


def _normal(sightings: Sequence[Sighting], state: State, setting: Setting) -> tuple[float, Array, Array]:
    """Robust cost, normal matrix and right-hand side.  Unknown order: N_CAMERA per camera, then N_POSE per pose; held
    ones are zero.
    """
    cameras, poses = len(state.intrinsics), len(state.rotation)
    size = N_CAMERA * cameras + N_POSE * poses
    normal, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    for sighting in sightings:
        c, sigma = sighting.camera, setting.sigma_px[sighting.camera]
        uv, by_intrinsics, by_camera, by_pose = project(sighting, state, setting, derivatives=True)
        residual = (sighting.uv_px - uv) / sigma
        length = np.linalg.norm(residual, axis=-1)
        weight = np.minimum(1.0, HUBER / np.maximum(length, 1e-12))
        cost += float(np.sum(np.where(length < HUBER, length**2, 2 * HUBER * length - HUBER**2)))
        by_intrinsics = by_intrinsics * setting.free[c]
        where = [*range(N_CAMERA * c, N_CAMERA * (c + 1))]
        blocks = [by_intrinsics, by_camera * setting.camera_poses_free]
        if sighting.pose != FIXED:
            first = N_CAMERA * cameras + N_POSE * sighting.pose
            where += range(first, first + N_POSE)
            blocks.append(by_pose)
        jacobian = np.concatenate(blocks, -1) / sigma
        weighted = (jacobian * weight[:, None, None]).reshape(-1, len(where))
        normal[np.ix_(where, where)] += weighted.T @ jacobian.reshape(-1, len(where))
        right[where] += weighted.T @ residual.reshape(-1)
    return cost + _add_priors(state, setting, normal, right), normal, right


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
    return cost


def _eliminated(normal: Array, kept: int) -> tuple[Array, Array, Array]:
    """Normal matrix of the first ``kept`` unknowns with the board poses solved for (Schur's complement).

    Poses do not touch each other: their part is made of 6 x 6 blocks, so that nothing large is ever inverted.
    Gives the complement (kept, kept), the blocks' inverses (n, 6, 6) and the coupling (n, kept, 6).
    """
    count = (len(normal) - kept) // N_POSE
    where = kept + np.arange(N_POSE * count).reshape(count, N_POSE)
    inverses = np.linalg.inv(normal[where[:, :, None], where[:, None, :]])
    coupling = normal[:kept][:, where].transpose(1, 0, 2)
    return (
        np.asarray(normal[:kept, :kept] - np.sum(coupling @ inverses @ coupling.transpose(0, 2, 1), 0)),
        np.asarray(inverses, float),
        coupling,
    )


def _step(normal: Array, right: Array, damping: float, kept: int) -> Array:
    """Levenberg's step, the diagonal raised by ``damping`` of itself; held unknowns (zero diagonal) stay."""
    scale = np.where(np.diag(normal) > 0, 1 / np.sqrt(np.where(np.diag(normal) > 0, np.diag(normal), 1.0)), 0.0)
    scaled, wanted = normal * np.outer(scale, scale), scale * right
    scaled[np.diag_indices_from(scaled)] = np.where(scale > 0, 1.0 + damping, 1.0)
    complement, inverses, coupling = _eliminated(scaled, kept)
    pose_wanted = wanted[kept:].reshape(-1, N_POSE)
    cameras = np.linalg.solve(complement, wanted[:kept] - np.einsum("nkp,npq,nq->k", coupling, inverses, pose_wanted))
    poses = np.einsum("npq,nq->np", inverses, pose_wanted - np.einsum("nkp,k->np", coupling, cameras))
    return np.asarray(scale * np.concatenate([cameras, poses.ravel()]))


def _descend(sightings: Sequence[Sighting], state: State, setting: Setting, iterations: int) -> State:
    damping = _DAMPING
    cost, normal, right = _normal(sightings, state, setting)
    for _ in range(iterations):
        step = _step(normal, right, damping, N_CAMERA * len(state.intrinsics))
        trial = _moved(state, step)
        new = _normal(sightings, trial, setting)
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
    for c in range(cameras):
        own = step[N_CAMERA * c : N_CAMERA * (c + 1)]
        turn, shift = np.split(own[N_INTRINSICS:], [N_ROTATION])
        trial.intrinsics[c] += own[:N_INTRINSICS]
        trial.camera_rotation[c] = cv2.Rodrigues(turn)[0] @ state.camera_rotation[c]
        trial.camera_translation[c] += shift
    for p, own in enumerate(step[N_CAMERA * cameras :].reshape(-1, N_POSE)):
        trial.rotation[p] = cv2.Rodrigues(own[:N_ROTATION])[0] @ state.rotation[p]
        trial.translation[p] += own[N_ROTATION:]
    return trial


def _spread(sightings: Sequence[Sighting], state: State, setting: Setting) -> Array:
    """Robust sd of a pixel coordinate per camera, corrected for the fitted parameters."""
    cameras, sigma = len(state.intrinsics), []
    for c in range(cameras):
        own = [s for s in sightings if s.camera == c]
        if not own:
            sigma.append(1.0)
            continue
        residual = np.concatenate([(s.uv_px - project(s, state, setting)[0]).ravel() for s in own])
        taken = setting.free[c].sum() + sum(N_POSE * (0.5 if s.in_world else 1.0) for s in own)
        freedom = max(_LEAST_FREEDOM, 1 - taken / residual.size)
        sigma.append(max(_LEAST_SIGMA_PX, residual_sd(residual)) / np.sqrt(freedom))
    return np.full(cameras, np.sqrt(np.mean(np.square(sigma)))) if setting.one_sigma else np.array(sigma)
