"""One camera, one frame: markers measured where their bodies are predicted, and the bodies' poses fitted to them."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.row import M11, M12, M22, N_FIT, OK, OUTLIERS, STRUCTURED, U, V, determinant
from vision.tracking.bodies.arrays import TrackState
from vision.tracking.bodies.gates import disc_radius_m, frames_lost, gate_m, is_locked
from vision.tracking.bodies.planar_pose import (
    ANGLE,
    AT_U,
    AT_V,
    DU_DX,
    DU_DY,
    DV_DX,
    DV_DY,
    N_PROJECTED,
    X,
    Y,
    project,
    px2_per_m2,
    robust_pose,
)
from vision.tracking.marker_validation import find, find_though_covered, nothing_there
from vision.tracking.relocate import lost_lock, relocate
from vision.tracking.state import SIZED, accept, predict, record

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

INDEPENDENT_FRAMES = 8  # that a camera is tracked through on its own before the two are compared
# What `follow` is asked to do with the bodies: measure them where their measured pose puts them, where their motion
# carries them, or track them through several frames.
AT_POSE, PREDICTED, THROUGH = range(3)
_SHAPE_EVERY = 4  # shape and blur change slowly: frames between two fits of them
_RELOCATED = 4  # frames after which a body lost is no longer near its prediction
# Radii of a disc, and turn, that the first measurement may have been off without a second.
_ASTRAY, _ASTRAY_RAD = 0.15, 0.02
# Radii of a disc outside the picture where it may be predicted and yet be seen: a prediction is off there.
_BESIDE = 0.7
_COVERABLE = 3  # markers from which a body without any plain one is not looked for among the covered


class Progress(NamedTuple):
    """What `follow` fills in from frame to frame: ``floats``, ``ints`` (f, ...) the state's memory before each,
    ``poses`` (f, b, 3), ``rows`` as `record`, ``n_rows`` (f + 1,) of them filled after each frame, n_rows[0]
    before the first.
    """

    floats: Floats
    ints: Ints
    poses: Floats
    rows: Floats
    n_rows: Ints


@compiled
def _circle_shape(at: Floats, radius_m: float, disc: Floats) -> None:
    """The ellipse in which a horizontal circle of `radius_m` is seen, disc[M11:S11], from the derivatives that
    `project` gave.
    """
    a, b, c, d = at[DU_DX], at[DU_DY], at[DV_DX], at[DV_DY]
    scale = 1.0 / ((a * d - b * c) * radius_m) ** 2
    disc[M11], disc[M12], disc[M22] = scale * (c * c + d * d), -scale * (a * c + b * d), scale * (a * a + b * b)


@compiled
def _measure_marker(
    image: NDArray[Any],
    state: TrackState,
    i: int,
    pose: Floats,
    hold_shape: bool,
    covered: bool,
    at: Floats,
    start: Floats,
) -> bool:
    """Measure marker `i`, plain or as one that is partly `covered`, where a body's `pose` puts it; `at` (N_PROJECTED,),
    `start` (N_FIT,): room.
    """
    markers, detections = state.markers, state.detections
    if markers.disc[i, M11] <= 0.0:
        return False
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    x = pose[X] + c * markers.place_m[i, 0] - s * markers.place_m[i, 1]
    y = pose[Y] + s * markers.place_m[i, 0] + c * markers.place_m[i, 1]
    project(state.geometry.camera, x, y, markers.place_m[i, 2], at)
    start[:] = markers.disc[i]
    beside = _BESIDE * determinant(start) ** -0.25
    if not (-beside < at[AT_U] < image.shape[1] + beside and -beside < at[AT_V] < image.shape[0] + beside):
        return False
    if start[OK] > 0.0 and nothing_there(image, start, at[AT_U], at[AT_V]):
        return False
    sized = markers.n_sized[i] >= SIZED and markers.radius_m[i] > 0.0
    if sized and start[OUTLIERS] >= STRUCTURED:
        _circle_shape(at, markers.radius_m[i], start)
    disc = detections.disc[i]
    disc[:] = start
    disc[U], disc[V] = at[AT_U], at[AT_V]
    detections.radius_m[i] = 0.0
    one = detections.disc[i : i + 1]
    if not (
        find_though_covered(image, start, hold_shape, sized, one)
        if covered
        else find(image, start, hold_shape, sized, one)
    ):
        return False
    du, dv = disc[U] - at[AT_U], disc[V] - at[AT_V]
    det = px2_per_m2(at)
    if disc[OUTLIERS] < STRUCTURED:
        detections.radius_m[i] = determinant(disc) ** -0.25 / math.sqrt(abs(det))
    detections.xy_m[i, 0] = x + (at[DV_DY] * du - at[DU_DY] * dv) / det
    detections.xy_m[i, 1] = y + (at[DU_DX] * dv - at[DV_DX] * du) / det
    return True


@compiled
def _measure_once(image: NDArray[Any], state: TrackState, body: int, hold_shape: bool) -> None:
    """Measure every marker of a body where its measured pose puts it, and replace that pose by theirs.

    A body of which no marker is plainly there has lost lock, and is not worth the dear fits: the search will find it.
    """
    at, start, pose = np.empty(N_PROJECTED), np.empty(N_FIT), state.measured.pose[body]
    lo, hi = state.geometry.first[body], state.geometry.first[body + 1]
    used = state.detections.used
    used[lo:hi] = 0
    seen = 0
    for covered in range(2):
        if covered == 0 or seen > 0 or hi - lo < _COVERABLE:
            for i in range(lo, hi):
                if used[i] == 0:
                    used[i] = _measure_marker(image, state, i, pose, hold_shape, covered == 1, at, start)
                    seen += used[i]
    state.measured.n_markers[body], state.measured.rms_m[body] = robust_pose(
        state.markers.place_m[lo:hi], state.detections.xy_m[lo:hi], used[lo:hi], hi - lo, gate_m(state, body), pose
    )


@compiled
def _measure(image: NDArray[Any], state: TrackState, body: int, frame: int) -> None:
    """Measure a body from the pose in `state.measured`; a second time where that was off.

    image : (h, w) uint8 or uint16
    """
    before = np.empty(3)
    hold_shape = (
        frame % _SHAPE_EVERY != 0
    )  # each marker's shape and blur of the frame before serve, where they still do
    pose = state.measured.pose[body]
    for _ in range(2):
        before[:] = pose
        _measure_once(image, state, body, hold_shape)
        known = 0
        for i in range(state.geometry.first[body], state.geometry.first[body + 1]):
            known += state.markers.disc[i, M11] > 0.0
        if not 2 <= state.measured.n_markers[body] < known:
            break
        if (
            math.hypot(pose[X] - before[X], pose[Y] - before[Y]) < _ASTRAY * disc_radius_m(state, body)
            and abs(pose[ANGLE] - before[ANGLE]) < _ASTRAY_RAD
        ):
            break


@compiled
def _predict_and_measure(image: NDArray[Any], state: TrackState, known: Ints, frame: int) -> None:
    """Measure all known bodies, (b,) 0/1, that were seen before: where their motion carries them, or relocated near
    there if they lost lock.
    """
    predict(state, frame)
    for b in range(len(known)):
        if not known[b] or state.bodies.last_frame[b] < 0:
            continue
        state.measured.pose[b] = state.measured.predicted[b]
        relocated = (
            frames_lost(state, b, frame) < _RELOCATED
            and lost_lock(image, state, b)
            and relocate(image, state, b, state.measured.pose[b])
        )
        for at_prediction in range(2):
            if at_prediction:
                state.measured.pose[b] = state.measured.predicted[b]
            _measure(image, state, b, frame)
            if not relocated or is_locked(state, b, frame):
                break


@compiled
def follow(
    job: int, images: tuple[NDArray[Any], ...], frames: Ints, state: TrackState, bodies: Ints, progress: Progress
) -> int:
    """Measure the bodies (b,) 0/1 of one camera; the one kernel of tracking, since each that Python calls holds all of
    the fits.

    job : AT_POSE or PREDICTED: in the first picture; THROUGH: track the bodies through the frames as long as this
        camera needs no other for it, and fill in `progress`
    images : INDEPENDENT_FRAMES of them
    frames : (f,) the numbers of those that count

    Returns how many frames that were.
    """
    if job == AT_POSE:
        for b in range(len(bodies)):
            if bodies[b]:
                _measure(images[0], state, b, frames[0])
        return 1
    for k in range(len(frames)):
        if job == THROUGH:
            for b in range(len(bodies)):
                if bodies[b] and frames_lost(state, b, frames[k]) > 0:
                    return k  # both cameras look for it
            progress.floats[k], progress.ints[k] = state.floats, state.ints
        _predict_and_measure(images[k], state, bodies, frames[k])
        if job == PREDICTED:
            break
        for b in range(len(bodies)):
            if bodies[b] and not is_locked(state, b, frames[k]):
                state.floats[:], state.ints[:] = progress.floats[k], progress.ints[k]
                return k
        for b in range(len(bodies)):
            if bodies[b]:
                accept(state, b, frames[k])
        progress.poses[k] = state.measured.pose
        progress.n_rows[k + 1] = record(state, frames[k], progress.rows, progress.n_rows[k])
    return len(frames)
