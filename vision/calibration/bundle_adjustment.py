"""Bundle adjustment of cameras and board poses, with the full least-squares covariance.

Unknowns: per camera sixteen intrinsics (fx, fy, cx, cy and OpenCV's twelve distortion terms; some held, at zero), a
spline over its image where it has one, and its pose in the world; per board view a pose, either in the one camera's
frame or, when both cameras saw the board at once, in the world.  Gauss-Newton with Levenberg's damping on the normal
equations, Huber weights, weak priors.  Rotations are updated by a rotation vector from the left, so none is ever near a
singularity.  OpenCV 5's own standard deviations of cx, cy come out far too small for a small board; these do not.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.lens_field import LensField
from ovines.robust import residual_sd
from vision.compiled import compiled
from vision.pinhole import FX, FY, INTRINSICS, N_INTRINSICS, lens_of, pinhole

Array = NDArray[np.float64]
Places = NDArray[np.intp]
POSE = ("rx", "ry", "rz", "tx", "ty", "tz")  # r: a rotation vector applied after the camera's own rotation
N_POSE = len(POSE)
N_ROTATION = 3  # of a pose's unknowns, then the translation
N_CAMERA = N_INTRINSICS + N_POSE  # unknowns of a camera
HUBER = 2.5  # sds of a point's residual (two coordinates) beyond which its weight falls
FIXED = -1  # number of the pose of the board that defines the world
_ROUNDS, _SAME_SD = 4, 0.05  # of sd and weights, which settle in two; relative change that ends them
# A rendered board's images differ by 14 % in the sd of their points, as much as 15 points tell of one; drawn together
# by more than that, images that are equally sharp lose less than a hundredth.
_SHARED_POINTS, _FEWEST_IMAGES = 40, 3
_CUT_SD = 4.0  # sds at which a residual is cut: an outlier is no wide noise
_LEAST_SIGMA_PX = 1e-4  # of an exact film: weights stay finite
_LEAST_FREEDOM = 0.1  # share of the residuals that the parameters leave at least
# Levenberg's damping: at first, after a step down and up, and its bounds.
_DAMPING, _DAMPING_DOWN, _DAMPING_UP, _LEAST_DAMPING, _MOST_DAMPING = 1e-4, 0.2, 8, 1e-9, 1e8
_SETTLED = 1e-6  # relative gain that ends a descent


@dataclass
class Sighting:
    """A board's points in one image: ``points_m`` (n, 3), ``uv_px`` (n, 2), seen by ``camera``, the board at ``pose``.

    ``pose`` FIXED: the board defines the world.  ``in_world``: the pose is board -> world, else board -> camera.
    ``share``: sd of this image's points over that of all the camera's, found by `adjust`: a tilted board's are less
    sharp.
    """

    camera: int
    pose: int
    in_world: bool
    points_m: Array
    uv_px: Array
    share: float = 1.0


@dataclass
class State:
    """``intrinsics`` (C, N_INTRINSICS); camera poses and board poses as rotation matrices and translations; each
    camera's spline, or none of any.
    """

    intrinsics: Array
    camera_rotation: Array
    camera_translation: Array
    rotation: Array
    translation: Array
    splines: tuple[LensField | None, ...] = ()

    def __post_init__(self) -> None:
        if not self.splines:
            self.splines = (None,) * len(self.intrinsics)

    def copy(self) -> State:
        """A state with arrays of its own."""
        own = {name: np.array(value) for name, value in vars(self).items() if name != "splines"}
        return State(**own, splines=self.splines)

    def lens(self, c: int) -> Camera:
        """Camera ``c``, by itself: its pose is the world's."""
        return Camera("", (0, 0), *lens_of(self.intrinsics[c]), np.eye(3), np.zeros(3), spline=self.splines[c])


@dataclass(frozen=True, eq=False)
class SplinePrior:
    """What is believed of a spline's numbers beforehand: ``mean_px`` (F,) and ``precision`` (F, F) [1/px^2]."""

    mean_px: Array
    precision: Array


@dataclass
class Setting:
    """What is free (C, N_INTRINSICS), priors (as many) means and sd, sd of fy/fx - 1, the defining board's pose; priors
    of the cameras' splines (one for each camera that has a spline, or none of any).
    """

    free: NDArray[np.bool_]
    prior: Array
    prior_sd: Array
    aspect_sd: float
    world_from_board: Array
    camera_poses_free: bool = True
    # the misfit of tied views is neither camera's: without this one takes all the weight and the other all the misfit
    one_sigma: bool = False
    sigma_px: Array = field(default_factory=lambda: np.ones(0))
    spline_priors: tuple[SplinePrior | None, ...] = ()

    def lens_free(self, state: State, c: int) -> NDArray[np.bool_]:
        """Which of a lens' numbers are free: the intrinsics, then the spline (N_INTRINSICS + F,)."""
        return np.concatenate([self.free[c], np.ones(len(spline_places(state.splines, c)), bool)])


@dataclass
class Adjusted:
    """The state found, sd of a pixel coordinate per camera, residuals (measured - projected) per sighting, and the
    covariance.

    ``covariance`` is over ``labels``: (camera, parameter) for intrinsics and camera poses, in that order, then for the
    cameras' splines.
    """

    state: State
    sigma_px: Array
    residuals_px: list[Array]
    camera_of: list[int]
    covariance: Array
    chi2: float
    labels: list[tuple[int, str]]

    def lens_covariance(self, c: int) -> Array:
        """Of camera ``c``'s intrinsics and spline, (N_INTRINSICS + F,) squared; NaN for what was held."""
        own = lens_places(self.state.splines, c)
        return self.covariance[np.ix_(own, own)]


def n_parameters(splines: Sequence[LensField | None]) -> int:
    """Of all cameras with these splines: N_CAMERA for each, then the splines' numbers."""
    return N_CAMERA * len(splines) + sum(0 if one is None else one.size for one in splines)


def spline_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where the numbers of camera ``c``'s spline stand among all cameras' parameters; empty where it has none."""
    first = N_CAMERA * len(splines) + n_parameters(splines[:c]) - N_CAMERA * c
    own = splines[c]
    return np.arange(first, first + (0 if own is None else own.size))


def lens_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where camera ``c``'s intrinsics and the numbers of its spline stand among all cameras' parameters."""
    return np.concatenate([np.arange(N_CAMERA * c, N_CAMERA * c + N_INTRINSICS), spline_places(splines, c)])


def adjust(sightings: Sequence[Sighting], start: State, setting: Setting, iterations: int = 40) -> Adjusted:
    """Minimise the robust weighted reprojection error; the pixel sd of each camera is estimated along the way."""
    cameras, state = len(start.intrinsics), start.copy()
    sigma = np.ones(cameras)
    if len(setting.sigma_px) == cameras:
        sigma = setting.sigma_px
    for sighting in sightings:
        sighting.share = 1.0
    for _ in range(_ROUNDS):
        setting.sigma_px = sigma
        state = _descend(sightings, state, setting, iterations)
        sigma = _spread(sightings, state, setting, _spline_freedom(sightings, state, setting))
        before = [sighting.share for sighting in sightings]
        _share_noise(sightings, state, setting, sigma)
        settled = np.allclose([sighting.share for sighting in sightings], before, rtol=_SAME_SD)
        if settled and np.allclose(sigma, setting.sigma_px, rtol=_SAME_SD):
            break
    setting.sigma_px = sigma
    cost, normal, _ = _normal(sightings, state, setting)
    kept = n_parameters(state.splines)
    used = np.flatnonzero(np.diag(normal)[:kept] > 0)
    covariance = np.full((kept, kept), np.nan)
    complement = _eliminated(normal, kept)[0][np.ix_(used, used)]
    scale = 1 / np.sqrt(np.diag(normal)[used])  # without it the pseudo-inverse would drop what is known least
    covariance[np.ix_(used, used)] = np.linalg.pinv(complement * np.outer(scale, scale), hermitian=True) * np.outer(
        scale, scale
    )
    labels = [(c, name) for c in range(cameras) for name in (*INTRINSICS, *POSE)]
    labels += [(c, name) for c, spline in enumerate(state.splines) if spline is not None for name in spline.labels]
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


def _normal(sightings: Sequence[Sighting], state: State, setting: Setting) -> tuple[float, Array, Array]:
    """Robust cost, normal matrix and right-hand side.  Unknown order: N_CAMERA per camera, the splines, then N_POSE per
    pose; held ones are zero.
    """
    kept = n_parameters(state.splines)
    size = kept + N_POSE * len(state.rotation)
    normal, right, cost = np.zeros((size, size)), np.zeros(size), 0.0
    places = [_camera_places(state.splines, c) for c in range(len(state.splines))]
    for sighting, (derivative, residual, sigma) in zip(sightings, _rows(sightings, state, setting), strict=True):
        where = places[sighting.camera]
        if sighting.pose != FIXED:
            where = np.concatenate([where, kept + N_POSE * sighting.pose + np.arange(N_POSE)])
        cost += add_rows(derivative, residual, sigma, where, normal, right)
    return cost + _add_priors(state, setting, normal, right), normal, right


def _camera_places(splines: Sequence[LensField | None], c: int) -> Places:
    """Where the numbers of camera ``c`` stand among all cameras': intrinsics, spline, pose."""
    return np.concatenate([lens_places(splines, c), np.arange(N_CAMERA * c + N_INTRINSICS, N_CAMERA * (c + 1))])


def _rows(sightings: Sequence[Sighting], state: State, setting: Setting) -> Iterator[tuple[Array, Array, float]]:
    """Of each sighting: derivatives (n, 2, P) of its pixels by its camera's numbers (:func:`_camera_places`; zero by
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
        step = _step(normal, right, damping, n_parameters(state.splines))
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


def information(sightings: Sequence[Sighting], state: State, setting: Setting, c: int = 0) -> tuple[Array, Array]:
    """What sightings alone say of camera ``c``'s spline: information (F, F) and right side (F,) of its numbers,
    everything else integrated out.
    """
    bare = replace(setting, spline_priors=())
    _, normal, right = _normal(sightings, state, bare)
    kept, own = n_parameters(state.splines), spline_places(state.splines, c)
    complement, inverses, coupling = _eliminated(normal, kept)
    left = right[:kept] - np.einsum("nkp,npq,nq->k", coupling, inverses, right[kept:].reshape(-1, N_POSE))
    others = np.setdiff1d(np.flatnonzero(np.diag(normal)[:kept] > 0), own)
    scale = 1 / np.sqrt(np.diag(complement)[others])
    scaled = complement[np.ix_(others, others)] * np.outer(scale, scale)
    beside = complement[np.ix_(own, others)] * scale
    solved = np.linalg.solve(scaled, np.column_stack([beside.T, left[others] * scale]))
    of_spline = complement[np.ix_(own, own)] - beside @ solved[:, :-1]
    spline = state.splines[c]
    assert spline is not None  # the caller asks for a camera that has one
    told = left[own] - beside @ solved[:, -1] + of_spline @ spline.values_px
    return 0.5 * (of_spline + of_spline.T), np.asarray(told, float)


def _spline_freedom(sightings: Sequence[Sighting], state: State, setting: Setting) -> Array:
    """How many numbers each camera's spline (C,) takes from its residuals: fewer than it has, by its prior."""
    taken = np.zeros(len(state.splines))
    for c, prior in enumerate(setting.spline_priors):
        if prior is not None and state.splines[c] is not None:
            told = information(sightings, state, setting, c)[0]
            taken[c] = np.trace(np.linalg.solve(told + prior.precision, told))
    return taken


def _share_noise(sightings: Sequence[Sighting], state: State, setting: Setting, sigma: Array) -> None:
    """Each image's own sd against its camera's, drawn to it as if :data:`_SHARED_POINTS` of its points had that one; of
    fewer images than :data:`_FEWEST_IMAGES` none is told from the others.
    """
    images = np.bincount([sighting.camera for sighting in sightings])
    for sighting, taken in zip(sightings, _taken(sightings, state, setting), strict=True):
        if images[sighting.camera] < _FEWEST_IMAGES:
            continue
        sd = sigma[sighting.camera]
        residual = (sighting.uv_px - project(sighting, state, setting)[0]) / sd
        count = len(residual)
        freedom = max(_LEAST_FREEDOM, 1 - taken / (2 * count))
        own = float(np.mean(np.minimum(residual**2, _CUT_SD**2))) / freedom
        sighting.share = float(np.sqrt((count * own + _SHARED_POINTS) / (count + _SHARED_POINTS)))


def _taken(sightings: Sequence[Sighting], state: State, setting: Setting) -> list[float]:
    """How many numbers the fit takes from each image's residuals: its pose, and of the lenses as much as it tells of
    them (the trace of its part of the hat matrix).  Images that tell most have the smallest residuals.
    """
    kept = n_parameters(state.splines)
    places = [_camera_places(state.splines, c) for c in range(len(state.splines))]
    whole = _normal([], state, setting)[1][:kept, :kept]  # the priors
    told = []
    for sighting, (derivative, residual, sigma) in zip(sightings, _rows(sightings, state, setting), strict=True):
        count = derivative.shape[-1]
        own, where = np.zeros((count, count)), places[sighting.camera]
        add_rows(derivative, residual, sigma, np.arange(count), own, np.zeros(count))
        lens, pose = np.split(own, [len(where)])
        if sighting.pose != FIXED:
            lens = lens - lens[:, len(where) :] @ np.linalg.pinv(pose[:, len(where) :], hermitian=True) @ pose
        told.append(lens[:, : len(where)])
        whole[np.ix_(where, where)] += told[-1]
    used = np.flatnonzero(np.diag(whole) > 0)
    scale = 1 / np.sqrt(np.diag(whole)[used])
    covariance = np.zeros((kept, kept))
    covariance[np.ix_(used, used)] = np.linalg.pinv(
        whole[np.ix_(used, used)] * np.outer(scale, scale), hermitian=True
    ) * np.outer(scale, scale)
    own_covariance = [covariance[np.ix_(where, where)] for where in places]
    poses = [0.0 if s.pose == FIXED else N_POSE * (0.5 if s.in_world else 1.0) for s in sightings]
    return [
        pose + float(np.sum(own_covariance[s.camera] * one))
        for s, pose, one in zip(sightings, poses, told, strict=True)
    ]


def _spread(sightings: Sequence[Sighting], state: State, setting: Setting, by_splines: Array) -> Array:
    """Robust sd of a pixel coordinate per camera, corrected for the fitted parameters."""
    cameras, sigma = len(state.intrinsics), []
    for c in range(cameras):
        own = [s for s in sightings if s.camera == c]
        if not own:
            sigma.append(1.0)
            continue
        residual = np.concatenate([(s.uv_px - project(s, state, setting)[0]).ravel() for s in own])
        taken = setting.free[c].sum() + by_splines[c] + sum(N_POSE * (0.5 if s.in_world else 1.0) for s in own)
        freedom = max(_LEAST_FREEDOM, 1 - taken / residual.size)
        sigma.append(max(_LEAST_SIGMA_PX, residual_sd(residual)) / np.sqrt(freedom))
    return np.full(cameras, np.sqrt(np.mean(np.square(sigma)))) if setting.one_sigma else np.array(sigma)
