"""What one camera's tracker holds of the bodies from frame to frame, as arrays that compiled code changes in place:
prediction, gates, learning.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.row import M11, N_FIT, OUTLIERS, S11, SD, STRUCTURED, U, determinant
from vision.tracking.planar_pose import ANGLE, N_PROJECTED, X, Y, project, px2_per_m2, wrapped_turn

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# How far a body may be off its prediction: in radii of the rig where it hardly moves, and in its largest step from one
# frame to the next.  An impact turns a step round at most, and the other body's own adds: 2 (one + other) of them, with
# the faster one for both.
SEARCH_RADIUS, SEARCH_STEPS = 0.12, 4.0
GATE_RAD = 0.8  # the same for its turn
# Radii of a disc, and turn, within which of its prediction a single marker is believed: discs do not overlap.
NEAR, NEAR_RAD = 0.3, 0.1
# Radii of the rig that a marker may always lie off its place, by the calibration: once the body's own scatter is known,
# and before.
_FLOOR, _FIRST_FLOOR = 0.0012, 0.002
_GATE_SCATTERS, _FIRST_GATE_SCATTERS = 5.0, 8.0  # times that scatter, once it is known and before
SIZED = 5  # frames with no other edge near, after which a marker's size counts as known
KNOWN_SCATTER = 30  # frames after which a body's own scatter sets the gate
_LEARN_EACH, _LEARN_EVERY = 100, 16  # times that each frame is learned from, and one frame in so many after them
_MEMORY, _PLACE_MEMORY = 50, 200  # frames over which sizes and scatter, and a marker's place, are averaged
_LONGEST_LOST = 10**6  # frames that are counted; a body never seen is lost for longer
_PREDICTED_FRAMES = 4  # frames over which a motion is carried on
_VELOCITY_GAP = 3  # frames between two poses that still give a velocity
# Frames lost after which two markers are believed anywhere, and after which a single one is not believed.
_LONG_LOST, _SINGLE_LOST = 3, 5
NAMED = 3  # markers that say which is which: two of many fit anything
# Two cameras that differ by more do not see the same body: radii of the rig, the body's largest steps (one may have
# dropped a few frames), turn.
_APART, _APART_STEPS, _APART_RAD = 0.3, 4.0, 0.35
# What `update` is asked to do.
PREDICT, ACCEPT, RECORD = range(3)
# Columns of a record, a marker seen in a frame: frame, number of the marker, its height, pose of its body, its disc's
# centre and shape (U to M22), sd of the centre.
FRAME, MARKER, HEIGHT, BODY_X, BODY_Y, BODY_ANGLE, DISC = range(7)
DISC_SD = DISC + S11 - U
N_RECORD = DISC_SD + 1


class ViewGeometry(NamedTuple):
    """What stays: ``camera`` (`planar_pose.packed`), ``first`` (b + 1,) first marker of each body, ``tolerance_m`` (b,)
    by which its markers may lie off the layout, ``rig_m`` radius of the rig.
    """

    camera: Floats
    first: Ints
    tolerance_m: Floats
    rig_m: float


class BodyStates(NamedTuple):
    """Bodies when last seen: ``pose`` (b, 3), ``velocity``, ``velocity_change`` and ``acceleration`` per frame (b, 3);
    ``step_m`` (b,) largest step from one frame to the next, ``scatter_m`` (b,) usual rms of its markers, ``last_frame``
    (b,), ``n_learned`` (b,) frames learned from.
    """

    pose: Floats
    velocity: Floats
    velocity_change: Floats
    acceleration: Floats
    step_m: Floats
    scatter_m: Floats
    last_frame: Ints
    n_learned: Ints


class BodyMeasurements(NamedTuple):
    """Bodies in this frame: ``predicted`` and measured ``pose`` (b, 3), ``rms_m`` (b,) and number (b,) of the markers
    behind it.
    """

    predicted: Floats
    pose: Floats
    rms_m: Floats
    n_markers: Ints


class MarkerStates(NamedTuple):
    """Markers when last seen: ``place_m`` (n, 3) in the body's frame, as this camera sees it, ``disc`` (n, 20) columns
    of `vision.markers.row`, ``radius_m`` (n,); ``n_sized``, ``n_placed`` (n,) frames behind radius and place.
    """

    place_m: Floats
    disc: Floats
    radius_m: Floats
    n_sized: Ints
    n_placed: Ints


class MarkerDetections(NamedTuple):
    """Markers in this frame: ``disc`` (n, 20), ``xy_m`` (n, 2) in the world, ``radius_m`` (n,), ``used`` (n,) 0/1."""

    disc: Floats
    xy_m: Floats
    radius_m: Floats
    used: Ints


class TrackState(NamedTuple):
    """What a camera's tracker knows.  Poses are (x, y, angle) of each body on its plane; b bodies, n markers.

    ``floats``, ``ints``: the memory in which all arrays but the geometry's lie; a copy of it is a way back.
    """

    geometry: ViewGeometry
    bodies: BodyStates
    measured: BodyMeasurements
    markers: MarkerStates
    detections: MarkerDetections
    floats: Floats
    ints: Ints


class BodyStatus(NamedTuple):
    """How a camera stands with a body in this frame.

    ``gate_m``: how far a marker may lie from its place in it; ``frames_lost``: frames since it was last seen, 0 when
    it was seen in the frame before; ``search_radius_m``: how far it may be from where its last motion carries it;
    ``agreement_m``: how far the other camera may differ about where it is; ``off_m``, ``turned_rad``: how far it was
    measured from where it was predicted; ``within_gate``: whether what was measured is the body, where it can be;
    ``near_prediction``: whether it is where its last motion carries it, so that few markers suffice to name them;
    ``identified``: whether the markers seen say which is which; ``locked``: whether this camera needs no other to know
    where it is.
    """

    gate_m: float
    frames_lost: int
    search_radius_m: float
    agreement_m: float
    off_m: float
    turned_rad: float
    within_gate: bool
    near_prediction: bool
    identified: bool
    locked: bool


def new_state(camera: Floats, first: Ints, tolerance_m: Floats, rig_m: float) -> TrackState:
    """A state of nothing seen; see `ViewGeometry`."""
    b, n = len(first) - 1, int(first[-1])
    poses = 6 * 3 * b
    floats = np.zeros(poses + 3 * b + n * (3 + 2 * N_FIT + 2 + 2))
    ints = np.zeros(3 * b + 3 * n, np.int64)
    free_floats, free_ints = floats, ints

    def some(*shape: int) -> Floats:
        nonlocal free_floats
        own, free_floats = np.split(free_floats, [math.prod(shape)])
        return own.reshape(shape)

    def counts(size: int) -> Ints:
        nonlocal free_ints
        own, free_ints = np.split(free_ints, [size])
        return own

    return TrackState(
        ViewGeometry(camera, first, tolerance_m, rig_m),
        BodyStates(some(b, 3), some(b, 3), some(b, 3), some(b, 3), some(b), some(b), counts(b), counts(b)),
        BodyMeasurements(some(b, 3), some(b, 3), some(b), counts(b)),
        MarkerStates(some(n, 3), some(n, N_FIT), some(n), counts(n), counts(n)),
        MarkerDetections(some(n, N_FIT), some(n, 2), some(n), counts(n)),
        floats,
        ints,
    )


@compiled
def gate_m(state: TrackState, body: int) -> float:
    """How far a marker may lie from its place in the body."""
    widest, scatter = state.geometry.tolerance_m[body], state.bodies.scatter_m[body]
    if state.bodies.n_learned[body] == 0:
        return widest
    if state.bodies.n_learned[body] > KNOWN_SCATTER:
        return min(max(_GATE_SCATTERS * scatter, _FLOOR * state.geometry.rig_m), widest)
    return min(max(_FIRST_GATE_SCATTERS * scatter, _FIRST_FLOOR * state.geometry.rig_m), widest)


@compiled
def disc_radius_m(state: TrackState, body: int) -> float:
    """Radius of a body's markers as they looked last, the mean of those that were seen; 0 where none was."""
    at, pose = np.empty(N_PROJECTED), state.measured.predicted[body]
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    total, seen = 0.0, 0
    for i in range(state.geometry.first[body], state.geometry.first[body + 1]):
        place = state.markers.place_m[i]
        det = determinant(state.markers.disc[i])
        if det > 0.0:
            x, y = pose[X] + c * place[0] - s * place[1], pose[Y] + s * place[0] + c * place[1]
            project(state.geometry.camera, x, y, place[2], at)
            total += det**-0.25 / math.sqrt(abs(px2_per_m2(at)))
            seen += 1
    return total / max(seen, 1)


@compiled
def _search_radius_m(state: TrackState) -> float:
    """How far a body may be from where its last motion carries it, per frame since it was seen."""
    fastest_m = 0.0
    for step_m in state.bodies.step_m:
        fastest_m = max(fastest_m, step_m)
    return max(SEARCH_RADIUS * state.geometry.rig_m, SEARCH_STEPS * fastest_m)


@compiled
def frames_lost(state: TrackState, body: int, frame: int) -> int:
    """Frames since the body was last seen, 0 when it was seen in the frame before."""
    return min(frame - state.bodies.last_frame[body] - 1, _LONGEST_LOST)


@compiled
def predict(state: TrackState, frame: int) -> None:
    """Predict every body's pose from its last velocity and acceleration; nothing is seen yet."""
    bodies = state.bodies
    state.detections.used[:] = 0
    state.measured.n_markers[:] = 0
    for b in range(len(bodies.last_frame)):
        ahead = max(min(frame - bodies.last_frame[b], _PREDICTED_FRAMES), 0)
        for k in range(3):
            state.measured.predicted[b, k] = bodies.pose[b, k] + ahead * (
                bodies.velocity[b, k] + 0.5 * (ahead + 1) * bodies.acceleration[b, k]
            )


@compiled
def _off_prediction(state: TrackState, body: int) -> tuple[float, float]:
    """How far the body was measured from where it was predicted: metres, and radians without whole turns."""
    pose, predicted = state.measured.pose[body], state.measured.predicted[body]
    off_m = math.hypot(pose[X] - predicted[X], pose[Y] - predicted[Y])
    return off_m, abs(wrapped_turn(pose[ANGLE], predicted[ANGLE]))


@compiled
def _within_gate(state: TrackState, body: int, frame: int) -> bool:
    """Whether what was measured is the body, where it can be."""
    off, turned = _off_prediction(state, body)
    lost, n_markers = frames_lost(state, body, frame), state.measured.n_markers[body]
    if n_markers >= 2:
        return lost > _LONG_LOST or (off < _search_radius_m(state) * (1 + lost) and turned < GATE_RAD)
    return n_markers == 1 and off < NEAR * disc_radius_m(state, body) and lost < _SINGLE_LOST


@compiled
def _near_prediction(state: TrackState, body: int) -> bool:
    """Whether the body is where its last motion carries it, so that few markers suffice to name them."""
    off, turned = _off_prediction(state, body)
    return off < NEAR * disc_radius_m(state, body) and turned < NEAR_RAD


@compiled
def _identified(state: TrackState, body: int) -> bool:
    """Whether the markers seen say which is which: one or two of many fit anything (look-alikes a quarter turn on).

    Two suffice of a body that hardly moves from frame to frame and is where it was predicted.  Until its spin and its
    layout are known all of them have to be there, or it where it was: markers in a ring that turns by nearly their
    spacing seem to turn back.
    """
    n_markers, n_all = state.measured.n_markers[body], state.geometry.first[body + 1] - state.geometry.first[body]
    if state.bodies.n_learned[body] <= KNOWN_SCATTER and n_markers < n_all and not _near_prediction(state, body):
        return False
    if n_markers >= min(NAMED, n_all):
        return True
    if n_markers < 2:
        return False
    velocity = state.bodies.velocity[body]
    slow = math.hypot(velocity[X], velocity[Y]) < NEAR * disc_radius_m(state, body) and abs(velocity[ANGLE]) < NEAR_RAD
    return slow and _near_prediction(state, body)


@compiled
def is_locked(state: TrackState, body: int, frame: int) -> bool:
    """Whether this camera needs no other to know where the body is."""
    return _identified(state, body) and _within_gate(state, body, frame)


@compiled
def status(state: TrackState, body: int, frame: int) -> BodyStatus:
    """How a camera stands with a body; see `BodyStatus`."""
    off_m, turned_rad = _off_prediction(state, body)
    lost, identified, within = (
        frames_lost(state, body, frame),
        _identified(state, body),
        _within_gate(state, body, frame),
    )
    return BodyStatus(
        gate_m(state, body),
        lost,
        _search_radius_m(state) * (1 + lost),
        max(_APART * state.geometry.rig_m, _APART_STEPS * state.bodies.step_m[body]),
        off_m,
        turned_rad,
        within,
        _near_prediction(state, body),
        identified,
        identified and within,
    )


def disagree(one: Floats, other: Floats, within_m: float | Floats) -> Any:
    """Whether two cameras measured bodies at poses (..., 3) that cannot be one; within_m : (...,)."""
    off = np.hypot(one[..., X] - other[..., X], one[..., Y] - other[..., Y])
    turn = one[..., ANGLE] - other[..., ANGLE]
    turn = turn - 2.0 * math.pi * np.round(turn / (2.0 * math.pi))
    return (off > within_m) | (np.abs(turn) > _APART_RAD)


@compiled
def _agreed(one: float, other: float) -> float:
    """The smaller of two numbers of one sign; 0 of different ones."""
    return 0.0 if one * other <= 0.0 else min(one, other) if one > 0.0 else max(one, other)


@compiled
def accept(state: TrackState, body: int, frame: int) -> None:
    """Make what was measured the body's state, and learn how this camera sees its layout."""
    bodies, pose, n_markers = state.bodies, state.measured.pose[body], state.measured.n_markers[body]
    gap = frame - bodies.last_frame[body]
    if gap == 1 and n_markers >= 2:
        step_m = math.hypot(pose[X] - bodies.pose[body, X], pose[Y] - bodies.pose[body, Y])
        bodies.step_m[body] = max(bodies.step_m[body], step_m)
    for k in range(3):
        change = 0.0
        if n_markers >= 2:
            velocity = (pose[k] - bodies.pose[body, k]) / gap if 0 < gap <= _VELOCITY_GAP else 0.0
            change = velocity - bodies.velocity[body, k] if gap == 1 else 0.0
            bodies.velocity[body, k] = velocity
        # As far as two changes agree: a shaken Host curves in every frame, an impact acts once.
        bodies.acceleration[body, k] = _agreed(change, bodies.velocity_change[body, k])
        bodies.velocity_change[body, k] = change
        bodies.pose[body, k] = pose[k]
    bodies.last_frame[body] = frame
    for i in range(state.geometry.first[body], state.geometry.first[body + 1]):
        if state.detections.used[i]:
            _remember(state, i)
    enough = n_markers >= min(NAMED, state.geometry.first[body + 1] - state.geometry.first[body])
    if enough and (bodies.n_learned[body] < _LEARN_EACH or frame % _LEARN_EVERY == 0):
        _learn(state, body)


@compiled
def _remember(state: TrackState, i: int) -> None:
    """How a marker looks now; a shape through which other edges ran is not taken over from a marker of known size."""
    markers, detections = state.markers, state.detections
    held = markers.n_sized[i] >= SIZED and detections.disc[i, OUTLIERS] >= STRUCTURED
    for k in range(markers.disc.shape[1]):
        if not (held and M11 <= k < S11):
            markers.disc[i, k] = detections.disc[i, k]
    if detections.radius_m[i] > 0.0:
        markers.n_sized[i] += 1
        markers.radius_m[i] += (detections.radius_m[i] - markers.radius_m[i]) / min(markers.n_sized[i], _MEMORY)


@compiled
def _learn(state: TrackState, body: int) -> None:
    """Each marker's place in the body, as a slowing mean; the scatter about them."""
    bodies, markers = state.bodies, state.markers
    pose = bodies.pose[body]
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    for i in range(state.geometry.first[body], state.geometry.first[body + 1]):
        if state.detections.used[i]:
            x, y = state.detections.xy_m[i, 0] - pose[X], state.detections.xy_m[i, 1] - pose[Y]
            gain = 1.0 / min(markers.n_placed[i] + 2, _PLACE_MEMORY)
            markers.place_m[i, 0] += gain * (c * x + s * y - markers.place_m[i, 0])
            markers.place_m[i, 1] += gain * (c * y - s * x - markers.place_m[i, 1])
            markers.n_placed[i] += 1
    bodies.n_learned[body] += 1
    rms_m, scatter_m = state.measured.rms_m[body], bodies.scatter_m[body]
    bodies.scatter_m[body] += (rms_m - scatter_m) / min(bodies.n_learned[body], _MEMORY)


@compiled
def record(state: TrackState, frame: int, rows: Floats, n: int) -> int:
    """Append the markers seen to `rows` (enough, N_RECORD), of which `n` are filled; how many are now."""
    for b in range(len(state.bodies.last_frame)):
        for i in range(state.geometry.first[b], state.geometry.first[b + 1]):
            if state.detections.used[i]:
                row, disc = rows[n], state.detections.disc[i]
                row[FRAME], row[MARKER], row[HEIGHT] = frame, i, state.markers.place_m[i, 2]
                row[BODY_X:DISC] = state.measured.pose[b]
                row[DISC:DISC_SD] = disc[U:S11]
                row[DISC_SD] = disc[SD]
                n += 1
    return n


@compiled
def update(job: int, state: TrackState, bodies: Ints, frame: int, rows: Floats, n: int) -> int:
    """PREDICT all bodies, ACCEPT the bodies (b,) 0/1 as measured, or RECORD the markers seen; how many `rows` are
    filled.
    """
    if job == PREDICT:
        predict(state, frame)
    elif job == ACCEPT:
        for b in range(len(bodies)):
            if bodies[b]:
                accept(state, b, frame)
    else:
        return record(state, frame, rows, n)
    return n
