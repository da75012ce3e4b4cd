"""Markers of rigid bodies against where their bodies' poses put them, as normal equations of the lens fields.

Per frame the poses of Host and NES on their plane (x, y, angle) and the height that they share are unknown, and are
projected out.  What stays open beside them has columns of its own: the markers' places on their bodies, a tilted plane,
a camera that is late, a window that lies elsewhere.  A field is only what none of them explains.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera, midpoints
from ovines.recording import Recording
from ovines.recording_schema import PLACEMENT_SD_M
from ovines.robust import spread
from vision.lens.lattice import Lattice
from vision.triangulate import FIRST_GUESS_SD_PX

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOVING = ("host", "nes")
FEWEST_MARKERS = 3  # of a body in a frame: its pose takes three numbers
CLIP_SD = 6.0  # beyond it a marker is an outlier; the field itself widens the spread
_N_POSE = 7  # x, y, angle of the two bodies, and their height
_FRAMES_AT_ONCE = 400
# Columns beside the fields: three of each marker (along its body's x, y, z), then these.
PLANE_X, PLANE_Y, LATE, WINDOW_U, WINDOW_V = range(5)
N_SHARED = 5
# Their prior sds: a marker's place along its body's x, y, z [m]; that of one that stands still, which no design tells;
MARKER_SD_M, STILL_SD_M = (1e-3, 1e-3, 1e-4), (1e-2, 1e-2, 1e-2)
# a tilted plane (x, y) [rad], a late camera [s], a window elsewhere (u, v) [px].
SHARED_SD = (0.1, 0.1, 1e-2, 100.0, 100.0)


@dataclass(frozen=True, eq=False)
class StereoObservations:
    """Markers of one run that both cameras saw, as arrays over F frames, M markers and two cameras.

    ``uv_px`` (F, M, 2, 2) full-sensor pixels by camera, NaN where not seen by both; ``sd_px`` (F, M, 2); ``frame``
    (F,); ``time_s`` (F,); ``body`` (M,) number of the marker's body, -1 for what stands still; ``layout_m`` (M, 3) its
    design place on the body, in the world for what stands still; ``points_m`` (F, M, 3) between both rays;
    ``layout_sd_m`` of how markers are placed.
    """

    frame: NDArray[np.int64]
    time_s: Array
    uv_px: Array
    sd_px: Array
    body: NDArray[np.int64]
    layout_m: Array
    points_m: Array
    layout_sd_m: float

    def between(self, first: int, last: int) -> StereoObservations:
        """The frames from number ``first`` up to ``last``."""
        part = slice(first, last)
        return replace(
            self,
            frame=self.frame[part],
            time_s=self.time_s[part],
            uv_px=self.uv_px[part],
            sd_px=self.sd_px[part],
            points_m=self.points_m[part],
        )

    def without(self, marker: int) -> StereoObservations:
        """The same where ``marker`` was never seen, in the frames that still show enough of its body."""
        uv_px, points_m = self.uv_px.copy(), self.points_m.copy()
        uv_px[:, marker], points_m[:, marker] = np.nan, np.nan
        own = self.body == self.body[marker]
        keep = np.isfinite(points_m[:, own, 0]).sum(1) >= FEWEST_MARKERS
        return replace(
            self,
            frame=self.frame[keep],
            time_s=self.time_s[keep],
            uv_px=uv_px[keep],
            sd_px=self.sd_px[keep],
            points_m=points_m[keep],
        )


@dataclass(frozen=True, eq=False)
class Linear:
    """Whitened residuals of a stretch of frames, the poses projected out.

    ``basis`` per camera (F, M, K), times the weight; ``others`` (F, M, 2, 2, Q); ``residual`` (F, M, 2, 2);
    ``poses`` (F, M, 2, 2, N_POSE) orthonormal columns; ``prior`` (Q,) weights (1/sd^2) of the other columns' numbers.
    """

    basis: tuple[Array, Array]
    others: Array
    residual: Array
    poses: Array
    prior: Array


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """``matrix`` (P, P), ``right`` (P,) over [u and v splines of the first camera, of the second, other columns];
    the first ``n_field`` are splines.  ``prior`` (P - n_field,) weights (1/sd^2) of the other columns' numbers, not in
    the matrix.
    """

    matrix: Array
    right: Array
    n_field: int
    prior: Array

    def __add__(self, other: NormalEquations) -> NormalEquations:
        return NormalEquations(self.matrix + other.matrix, self.right + other.right, self.n_field, self.prior)


def markers_of(recording: Recording) -> list[str]:
    """Names of the markers of a run in their order: what stands still, Host, NES."""
    bodies = recording.bodies
    still = list(bodies["ground"].markers) if "ground" in bodies else []
    return [*still, *(marker for name in MOVING for marker in bodies[name].markers)]


def observations_of(tracks: pd.DataFrame, cameras: Sequence[Camera], recording: Recording) -> StereoObservations | None:
    """Arrays of one run's tracks; None where Host and NES with three markers each and their layouts are not given."""
    bodies = recording.bodies
    if any(name not in bodies or bodies[name].layout_m is None for name in MOVING):
        return None
    if any(len(bodies[name].markers) < FEWEST_MARKERS for name in MOVING):
        return None
    markers = markers_of(recording)
    known = tracks["marker"].isin(markers).to_numpy() & tracks["camera"].isin([one.name for one in cameras]).to_numpy()
    if not known.any():
        return None
    frames, at = np.unique(tracks["frame"].to_numpy()[known], return_inverse=True)
    shape = (len(frames), len(markers))
    time_s, uv, sd = np.full(len(frames), np.nan), np.full((*shape, 2, 2), np.nan), np.full((*shape, 2), np.nan)
    number = pd.Index(markers).get_indexer(tracks["marker"][known])
    for c in reversed(range(2)):  # times are the first camera's
        own = tracks["camera"].to_numpy()[known] == cameras[c].name
        view = tracks[known][own]
        offset = np.asarray(recording.window_offset_px.get(cameras[c].name, (0, 0)), float)
        uv[at[own], number[own], c] = view[["u_px", "v_px"]].to_numpy(float) + offset
        sd[at[own], number[own], c] = view["sd_px"].to_numpy(float)
        time_s[at[own]] = view["time_s"].to_numpy(float)
    uv[np.isnan(uv).any((-1, -2))] = np.nan
    xyz = midpoints(cameras, [uv[:, :, c].reshape(-1, 2) for c in range(2)]).reshape(*shape, 3)
    uv[np.isnan(xyz[..., 0])] = np.nan
    sd = np.where(np.isfinite(sd), sd, np.nanmedian(sd) if np.isfinite(sd).any() else FIRST_GUESS_SD_PX)
    sd = np.maximum(sd, 0.5 * np.nanmedian(sd))  # no marker outweighs the others
    still = len(markers) - sum(len(bodies[name].markers) for name in MOVING)
    body = np.array([-1] * still + [k for k, name in enumerate(MOVING) for _ in bodies[name].markers])
    places = np.zeros((still, 3))  # of a marker that both cameras never saw at once: used nowhere
    located = np.isfinite(xyz[:, :still, 0]).any(0)
    places[located] = np.nanmedian(xyz[:, np.flatnonzero(located)], 0)
    layout = np.concatenate([places, *(np.asarray(bodies[name].layout_m, float) for name in MOVING)])
    enough = [np.isfinite(xyz[:, body == k, 0]).sum(1) >= FEWEST_MARKERS for k in range(len(MOVING))]
    keep = np.logical_and.reduce(enough)
    placed = [bodies[name].layout_sd_m or PLACEMENT_SD_M for name in MOVING]
    return StereoObservations(frames[keep], time_s[keep], uv[keep], sd[keep], body, layout, xyz[keep], max(placed))


def poses_of(run: StereoObservations) -> Array:
    """x, y, angle of each moving body and its height, (F, 2, 4) [m, m, rad, m]: the rigid fit in the plane."""
    out = np.empty((len(run.frame), len(MOVING), 4))
    for k in range(len(MOVING)):
        own = run.body == k
        seen = np.isfinite(run.points_m[:, own, 0])
        count = seen.sum(1)
        layout = run.layout_m[own]
        xyz = np.where(seen[..., None], run.points_m[:, own], 0.0)
        middle = xyz.sum(1) / count[:, None]
        design = (seen[..., None] * layout).sum(1) / count[:, None]
        a, b = layout[None, :, :2] - design[:, None, :2], (xyz - middle[:, None])[..., :2] * seen[..., None]
        angle = np.arctan2(
            (a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]).sum(1),
            (a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1]).sum(1),
        )
        turned = np.stack(
            [
                np.cos(angle) * design[:, 0] - np.sin(angle) * design[:, 1],
                np.sin(angle) * design[:, 0] + np.cos(angle) * design[:, 1],
            ],
            -1,
        )
        out[:, k] = np.column_stack([middle[:, :2] - turned, angle, middle[:, 2] - design[:, 2]])
    return out


def layouts_scale(runs: Sequence[StereoObservations]) -> tuple[float, float]:
    """By which share the markers of both bodies lie too far apart, against the design of their layouts, and its sd."""
    top = bottom = squares = 0.0
    for run in runs:
        for k in range(len(MOVING)):
            own = run.body == k
            seen = np.isfinite(run.points_m[:, own, 0])[..., None]
            count = np.maximum(seen.sum(1, keepdims=True), 1)
            apart = []
            for places in (np.broadcast_to(run.layout_m[own], run.points_m[:, own].shape), run.points_m[:, own]):
                flat = np.where(seen, places[..., :2], 0.0)
                apart.append(np.where(seen, flat - flat.sum(1, keepdims=True) / count, 0.0))
            designed, measured = (np.sum(one**2, (1, 2)) for one in apart)
            top += float(np.sqrt(designed * measured).sum())
            bottom += float(designed.sum())
            squares += float(designed.mean()) / len(runs)
    if bottom == 0:
        return 0.0, np.inf
    return top / bottom - 1, max(one.layout_sd_m for one in runs) / float(np.sqrt(squares))


@dataclass(frozen=True, eq=False)
class Fitted:
    """A run's markers where the rigid fits put them: ``poses`` of :func:`poses_of`, ``world_m`` (F, M, 3), ``uv_px``
    (F, M, 2 cameras, 2), the second camera's ``speed_px_per_s`` (F, M, 2), ``residual_px`` as ``uv_px``, and which
    markers to ``use`` (F, M).
    """

    poses: Array
    world_m: Array
    uv_px: Array
    speed_px_per_s: Array
    residual_px: Array
    use: Bools

    def part(self, frames: slice) -> Fitted:
        """Of these frames."""
        return Fitted(
            self.poses[frames],
            self.world_m[frames],
            self.uv_px[frames],
            self.speed_px_per_s[frames],
            self.residual_px[frames],
            self.use[frames],
        )


def linear_parts(run: StereoObservations, cameras: Sequence[Camera], lattices: Sequence[Lattice]) -> Iterator[Linear]:
    """The run as whitened linear equations, some hundred frames at a time."""
    poses = poses_of(run)
    world = _modelled(run, poses)
    uv = np.stack([camera.project(world) for camera in cameras], 2)
    speed = np.gradient(uv[:, :, 1], run.time_s, axis=0) if len(run.frame) > 2 else np.zeros_like(uv[:, :, 1])
    residual = run.uv_px - uv
    fitted = Fitted(poses, world, uv, speed, residual, _without_outliers(residual))
    for first in range(0, len(run.frame), _FRAMES_AT_ONCE):
        part = slice(first, first + _FRAMES_AT_ONCE)
        yield _linear(run.body, run.sd_px[part], fitted.part(part), cameras, lattices)


def _modelled(run: StereoObservations, poses: Array) -> Array:
    """Where poses put the markers in the world, (F, M, 3), a shared height for both bodies."""
    out = np.broadcast_to(run.layout_m, (len(run.frame), *run.layout_m.shape)).copy()
    height = poses[:, :, 3].mean(1)
    for k in range(len(MOVING)):
        own = run.body == k
        c, s = np.cos(poses[:, k, 2])[:, None], np.sin(poses[:, k, 2])[:, None]
        x, y = run.layout_m[own, 0], run.layout_m[own, 1]
        out[:, own, 0] = poses[:, k, :1] + c * x - s * y
        out[:, own, 1] = poses[:, k, 1:2] + s * x + c * y
        out[:, own, 2] = height[:, None] + run.layout_m[own, 2]
    return out


def _without_outliers(residual: Array) -> Bools:
    """Markers (F, M) whose residuals are like those of the same marker in the other frames."""
    use: Bools = np.asarray(np.isfinite(residual).all((-1, -2)))
    for m in range(residual.shape[1]):
        own = residual[:, m].reshape(len(residual), -1)
        if use[:, m].any():
            middle = np.nanmedian(own, 0)
            scale = np.array([spread(one) for one in own.T])
            use[:, m] &= (np.abs(own - middle) < CLIP_SD * scale + 1e-9).all(1)
    return use


def _linear(
    body: NDArray[np.int64], sd_px: Array, fitted: Fitted, cameras: Sequence[Camera], lattices: Sequence[Lattice]
) -> Linear:
    x, poses = fitted.world_m, fitted.poses
    frames, markers = fitted.use.shape
    weight = np.where(fitted.use[..., None], 1 / sd_px, 0.0)  # (F, M, 2)
    by_point = np.stack([camera.project_with_jacobian(x)[1] for camera in cameras], 2) * weight[..., None, None]
    by_pose = np.zeros((frames, markers, 2, 2, _N_POSE))
    others = np.zeros((frames, markers, 2, 2, 3 * markers + N_SHARED))
    for k in range(len(MOVING)):
        own = np.flatnonzero(body == k)
        arm = x[:, own] - np.concatenate([poses[:, k, :2], np.zeros((frames, 1))], 1)[:, None]
        by_pose[:, own, ..., 3 * k : 3 * k + 2] = by_point[:, own, ..., :2]
        turn = np.stack([-arm[..., 1], arm[..., 0]], -1)
        turned = np.einsum("fmcij,fmj->fmci", by_point[:, own, ..., :2], turn)
        by_pose[:, own, ..., 3 * k + 2 : 3 * k + 3] = turned[..., None]
        by_pose[:, own, ..., 6:] = by_point[:, own, ..., 2:]
        cosine, sine = np.cos(poses[:, k, 2])[:, None, None], np.sin(poses[:, k, 2])[:, None, None]
        for m in own:
            along = by_point[:, m]
            others[:, m, ..., 3 * m] = cosine * along[..., 0] + sine * along[..., 1]
            others[:, m, ..., 3 * m + 1] = -sine * along[..., 0] + cosine * along[..., 1]
            others[:, m, ..., 3 * m + 2] = along[..., 2]
    for m in np.flatnonzero(body < 0):
        others[:, m, ..., 3 * m : 3 * m + 3] = by_point[:, m]
    shared = others[..., 3 * markers :]
    on_plane = by_point[..., 2] * (body >= 0)[:, None, None]  # what stands still is where it was seen
    shared[..., PLANE_X] = on_plane * x[:, :, None, None, 0]
    shared[..., PLANE_Y] = on_plane * x[:, :, None, None, 1]
    shared[:, :, 1, :, LATE] = fitted.speed_px_per_s * weight[:, :, 1, None]
    shared[:, :, 1, 0, WINDOW_U] = shared[:, :, 1, 1, WINDOW_V] = weight[:, :, 1]
    values = np.where(fitted.use[..., None, None], fitted.residual_px, 0.0) * weight[..., None]
    q = np.linalg.qr(by_pose.reshape(frames, -1, _N_POSE))[0].reshape(by_pose.shape)
    # At the pixels of the poses: those that were measured would multiply their noise with itself.
    basis = tuple(
        lattice.basis(fitted.uv_px[:, :, c].reshape(-1, 2)).reshape(frames, markers, -1) * weight[:, :, c, None]
        for c, lattice in enumerate(lattices)
    )
    sds = [STILL_SD_M if one < 0 else MARKER_SD_M for one in body]
    return Linear((basis[0], basis[1]), others, values, q, np.concatenate([*sds, SHARED_SD]) ** -2.0)


def accumulate(part: Linear) -> NormalEquations:
    """Normal equations of a stretch of frames, the poses projected out."""
    frames = len(part.residual)
    n_other = part.others.shape[-1]
    sizes = [basis.shape[-1] for basis in part.basis]
    n_field = 2 * sum(sizes)
    # Most splines lie where no marker went in these frames: nothing is learnt of them.
    near = [np.flatnonzero(basis.any((0, 1))) for basis in part.basis]
    first = sum(2 * len(one) for one in near)
    total = first + n_other
    matrix, right = np.zeros((total, total)), np.zeros(total)
    others = part.others.reshape(frames, -1, n_other)
    values = part.residual.reshape(frames, -1)
    q = part.poses.reshape(frames, -1, _N_POSE)
    on_poses = np.empty((frames, _N_POSE, total))
    columns_of = np.empty(total, np.int64)
    columns_of[first:] = np.arange(n_field, n_field + n_other)
    at = before = 0
    for c, own in enumerate(near):
        basis = np.ascontiguousarray(part.basis[c][:, :, own])
        flat = basis.reshape(-1, len(own))
        inner = flat.T @ flat
        for axis in range(2):
            block = slice(at, at + len(own))
            columns_of[block] = before + own
            matrix[block, block] = inner
            matrix[block, first:] = flat.T @ part.others[:, :, c, axis].reshape(-1, n_other)
            right[block] = flat.T @ part.residual[:, :, c, axis].reshape(-1)
            on_poses[:, :, block] = part.poses[:, :, c, axis].transpose(0, 2, 1) @ basis
            at, before = at + len(own), before + sizes[c]
    flat = others.reshape(-1, n_other)
    matrix[first:, first:] = flat.T @ flat
    matrix[first:, :first] = matrix[:first, first:].T
    right[first:] = flat.T @ values.reshape(-1)
    on_poses[:, :, first:] = q.transpose(0, 2, 1) @ others
    along = np.einsum("frp,fr->fp", q, values)
    flat = on_poses.reshape(-1, total)
    matrix -= flat.T @ flat
    right -= flat.T @ along.reshape(-1)
    whole, whole_right = np.zeros((n_field + n_other,) * 2), np.zeros(n_field + n_other)
    whole[np.ix_(columns_of, columns_of)], whole_right[columns_of] = matrix, right
    return NormalEquations(whole, whole_right, n_field, part.prior)
