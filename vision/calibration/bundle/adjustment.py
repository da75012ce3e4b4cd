"""Bundle adjustment of cameras and board poses, with the full least-squares covariance.

Unknowns: per camera sixteen intrinsics (fx, fy, cx, cy and OpenCV's twelve distortion terms; some held, at zero), a
spline over its image where it has one, and its pose in the world; per board view a pose, either in the one camera's
frame or, when both cameras saw the board at once, in the world.  Gauss-Newton with Levenberg's damping on the normal
equations, Huber weights, weak priors.  Rotations are updated by a rotation vector from the left, so none is ever near a
singularity.  OpenCV 5's own standard deviations of cx, cy come out far too small for a small board; these do not.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ovines.robust import residual_sd
from vision.calibration.bundle.descent import descend, information, without_poses
from vision.calibration.bundle.equations import Rows, normal_equations, residuals_of, rows_of
from vision.calibration.bundle.unknowns import (
    FIXED,
    N_POSE,
    POSE,
    Adjusted,
    Observation,
    Setting,
    State,
    camera_places,
    n_parameters,
)
from vision.pinhole import INTRINSICS

Array = NDArray[np.float64]

_ROUNDS, _SAME_SD = 4, 0.05  # of sd and weights, which settle in two; relative change that ends them
# A rendered board's images differ by 14 % in the sd of their points, as much as 15 points tell of one; drawn together
# by more than that, images that are equally sharp lose less than a hundredth.
_SHARED_POINTS, _FEWEST_IMAGES = 40, 3
_CUT_SD = 4.0  # sds at which a residual is cut: an outlier is no wide noise
_LEAST_SIGMA_PX = 1e-4  # of an exact film: weights stay finite
_LEAST_FREEDOM = 0.1  # share of the residuals that the parameters leave at least


def adjust(observations: Sequence[Observation], start: State, setting: Setting, iterations: int = 40) -> Adjusted:
    """Minimise the robust weighted reprojection error; the pixel sd of each camera is estimated along the way."""
    cameras, state = len(start.intrinsics), start.copy()
    sigma = np.ones(cameras)
    if len(setting.sigma_px) == cameras:
        sigma = setting.sigma_px
    for observation in observations:
        observation.share = 1.0
    for _ in range(_ROUNDS):
        setting.sigma_px = sigma
        state = descend(observations, state, setting, iterations)
        sigma = _spread(observations, state, setting, _spline_freedom(observations, state, setting))
        before = [observation.share for observation in observations]
        _share_noise(observations, state, setting, sigma)
        settled = np.allclose([observation.share for observation in observations], before, rtol=_SAME_SD)
        if settled and np.allclose(sigma, setting.sigma_px, rtol=_SAME_SD):
            break
    setting.sigma_px = sigma
    cost, normal, _ = normal_equations(observations, state, setting)
    kept = n_parameters(state.splines)
    used = np.flatnonzero(np.diag(normal)[:kept] > 0)
    covariance = np.full((kept, kept), np.nan)
    complement = without_poses(normal, kept)[0][np.ix_(used, used)]
    scale = 1 / np.sqrt(np.diag(normal)[used])  # without it the pseudo-inverse would drop what is known least
    covariance[np.ix_(used, used)] = np.linalg.pinv(complement * np.outer(scale, scale), hermitian=True) * np.outer(
        scale, scale
    )
    labels = [(c, name) for c in range(cameras) for name in (*INTRINSICS, *POSE)]
    labels += [(c, name) for c, spline in enumerate(state.splines) if spline is not None for name in spline.labels]
    return Adjusted(
        state,
        sigma,
        residuals_of(observations, state, setting),
        [s.camera for s in observations],
        covariance,
        cost,
        labels,
    )


def _spline_freedom(observations: Sequence[Observation], state: State, setting: Setting) -> Array:
    """How many numbers each camera's spline (C,) takes from its residuals: fewer than it has, by its prior."""
    taken = np.zeros(len(state.splines))
    for c, prior in enumerate(setting.spline_priors):
        if prior is not None and state.splines[c] is not None:
            given = information(observations, state, setting, c)[0]
            taken[c] = np.trace(np.linalg.solve(given + prior.precision, given))
    return taken


def _share_noise(observations: Sequence[Observation], state: State, setting: Setting, sigma: Array) -> None:
    """Each image's own sd against its camera's, drawn to it as if :data:`_SHARED_POINTS` of its points had that one; of
    fewer images than :data:`_FEWEST_IMAGES` none is distinguished from the others.
    """
    images = np.bincount([observation.camera for observation in observations])
    left, taken_of = residuals_of(observations, state, setting), _taken(observations, state, setting)
    for observation, own_left, taken in zip(observations, left, taken_of, strict=True):
        if images[observation.camera] < _FEWEST_IMAGES:
            continue
        sd = sigma[observation.camera]
        residual = own_left / sd
        count = len(residual)
        freedom = max(_LEAST_FREEDOM, 1 - taken / (2 * count))
        own = float(np.mean(np.minimum(residual**2, _CUT_SD**2))) / freedom
        observation.share = float(np.sqrt((count * own + _SHARED_POINTS) / (count + _SHARED_POINTS)))


def _taken(observations: Sequence[Observation], state: State, setting: Setting) -> list[float]:
    """How many numbers the fit takes from each image's residuals: its pose, and of the lenses as much as it tells of
    them (the trace of its part of the hat matrix).  Images that tell most have the smallest residuals.
    """
    kept = n_parameters(state.splines)
    whole = normal_equations([], state, setting)[1][:kept, :kept]  # the priors
    cameras = []
    for c, rows in rows_of(observations, state, setting):
        where = camera_places(state.splines, c)
        couplings = np.zeros((len(rows.observations), len(where), N_POSE))
        inverses = np.zeros((len(rows.observations), N_POSE, N_POSE))
        sought = [k for k, observation in enumerate(rows.observations) if observation.pose != FIXED]
        for k, (_, coupling, posed, _) in zip(sought, rows.poses(), strict=True):
            couplings[k], inverses[k] = coupling, posed
        solved = couplings @ np.linalg.pinv(inverses, hermitian=True)
        by_poses = np.tensordot(solved, couplings, axes=((0, 2), (0, 2)))
        whole[np.ix_(where, where)] += rows.gram()[0] - by_poses
        cameras.append((where, rows, couplings, solved))
    used = np.flatnonzero(np.diag(whole) > 0)
    scale = 1 / np.sqrt(np.diag(whole)[used])
    covariance = np.zeros((kept, kept))
    covariance[np.ix_(used, used)] = np.linalg.pinv(
        whole[np.ix_(used, used)] * np.outer(scale, scale), hermitian=True
    ) * np.outer(scale, scale)
    taken = {}
    for where, rows, couplings, solved in cameras:
        own = covariance[np.ix_(where, where)]
        of_lenses = np.bincount(rows.observation, _variances(rows, own), len(rows.observations))
        of_lenses -= np.sum((own @ couplings) * solved, (1, 2))
        for observation, of_lens in zip(rows.observations, of_lenses, strict=True):
            pose = 0.0 if observation.pose == FIXED else N_POSE * (0.5 if observation.in_world else 1.0)
            taken[id(observation)] = pose + float(of_lens)
    return [taken[id(observation)] for observation in observations]


def _variances(rows: Rows, covariance: Array) -> Array:
    """What the camera's numbers, of ``covariance`` (P, P), leave open of each point (n,): both axes together."""
    own, size = rows.plain.shape[2], rows.basis.shape[1]
    out = np.zeros(len(rows.plain))
    for axis in range(2):
        there, plain = slice(own + axis * size, own + (axis + 1) * size), rows.plain[:, axis]
        out += np.sum((plain @ covariance[:own, :own]) * plain, 1)
        if size:
            across = 2 * plain @ covariance[:own, there] + rows.basis @ covariance[there, there]
            out += np.sum(across * rows.basis, 1)
    return out


def _spread(observations: Sequence[Observation], state: State, setting: Setting, by_splines: Array) -> Array:
    """Robust sd of a pixel coordinate per camera, corrected for the fitted parameters."""
    cameras, sigma = len(state.intrinsics), []
    left = residuals_of(observations, state, setting)
    for c in range(cameras):
        own = [s for s in observations if s.camera == c]
        if not own:
            sigma.append(1.0)
            continue
        residual = np.concatenate([one.ravel() for s, one in zip(observations, left, strict=True) if s.camera == c])
        taken = setting.free[c].sum() + by_splines[c] + sum(N_POSE * (0.5 if s.in_world else 1.0) for s in own)
        freedom = max(_LEAST_FREEDOM, 1 - taken / residual.size)
        sigma.append(max(_LEAST_SIGMA_PX, residual_sd(residual)) / np.sqrt(freedom))
    return np.full(cameras, np.sqrt(np.mean(np.square(sigma)))) if setting.one_sigma else np.array(sigma)
