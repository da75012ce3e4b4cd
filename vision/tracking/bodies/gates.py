"""Where a body can be in a frame, and whether what was measured there is the body."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from vision.compiled import compiled
from vision.markers.row import determinant
from vision.tracking.bodies.arrays import Floats, TrackState
from vision.tracking.bodies.planar_pose import ANGLE, N_PROJECTED, X, Y, project, px2_per_m2, wrapped_turn

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
KNOWN_SCATTER = 30  # frames after which a body's own scatter sets the gate
_LONGEST_LOST = 10**6  # frames that are counted; a body never seen is lost for longer
# Frames lost after which two markers are believed anywhere, and after which a single one is not believed.
_LONG_LOST, _SINGLE_LOST = 3, 5
NAMED = 3  # markers that say which is which: two of many fit anything
# Two cameras that differ by more do not see the same body: radii of the rig, the body's largest steps (one may have
# dropped a few frames), turn.
_APART, _APART_STEPS, _APART_RAD = 0.3, 4.0, 0.35


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
