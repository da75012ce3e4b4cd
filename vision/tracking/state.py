"""What a camera's tracker does with its state from frame to frame: predict, accept and learn, record."""

from __future__ import annotations

import math

from vision.compiled import compiled
from vision.markers.row import M11, OUTLIERS, S11, SD, STRUCTURED, U
from vision.tracking.bodies.arrays import Floats, Ints, TrackState
from vision.tracking.bodies.gates import NAMED
from vision.tracking.bodies.planar_pose import ANGLE, X, Y

SIZED = 5  # frames with no other edge near, after which a marker's size counts as known
_LEARN_EACH, _LEARN_EVERY = 100, 16  # times that each frame is learned from, and one frame in so many after them
_MEMORY, _PLACE_MEMORY = 50, 200  # frames over which sizes and scatter, and a marker's place, are averaged
_PREDICTED_FRAMES = 4  # frames over which a motion is carried on
_VELOCITY_GAP = 3  # frames between two poses that still give a velocity
# What `update` is asked to do.
PREDICT, ACCEPT, RECORD = range(3)
# Columns of a record, a marker seen in a frame: frame, number of the marker, its height, pose of its body, its disc's
# centre and shape (U to M22), sd of the centre.
FRAME, MARKER, HEIGHT, BODY_X, BODY_Y, BODY_ANGLE, DISC = range(7)
DISC_SD = DISC + S11 - U
N_RECORD = DISC_SD + 1


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
