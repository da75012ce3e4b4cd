"""Relocates a body that lost lock, by template matching: an impact between two frames took it from its prediction.

Around each marker's predicted place a coarse score map says how much the picture looks like that marker; the pose under
which all maps agree best is where the exact fits begin.  It takes 0.03 to 0.3 ms, where finding all discs nearby and
matching them to the layout takes 8, and cannot take one marker for another: the search goes not half as far as the
markers are apart.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, inlined
from vision.markers.row import CONTRAST, LEVEL, M11, M12, M22, determinant
from vision.tracking.bodies.arrays import TrackState
from vision.tracking.bodies.gates import NAMED
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
)

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_LOST = 0.5  # mean score below which the body is not where it was predicted
_FOUND = 0.6  # and from which it is where the maps say
_AROUND, _WITHIN = 8, 4  # pixels read in a marker's surroundings, and inside it
_AROUND_RADII, _WITHIN_RADII = 1.5, 0.45  # how far from its middle
_LEAST_SCORE = 0.1  # of a middle over the usual background: less is background, as most places are
_STEPS_MOVED = 2.2  # times what it moved from frame to frame: a body that bounces straight back
_LEAST = 0.2  # marker radii that are searched at least
_STEP = 0.4  # marker radii between two places scored; the fits begin from twice as far
_MOST_STEPS = 24
_APART = 0.45  # of the markers' least distance, up to which the search goes: none is taken for another
_NEVER = 1e9  # metres, more than any distance of markers
_ORIGIN_M = 1e-9  # distance of a lone marker from its body's origin at least


@compiled
def _template(disc: Floats, template: Ints) -> None:
    """Whole pixels (_AROUND + _WITHIN + 1, 2) from a marker's middle: on an ellipse larger than it, then within it;
    last how far they reach.
    """
    template[:] = 0
    # With M = C C', the points C'^-1 (cos, sin) lie on the edge.
    a = math.sqrt(disc[M11])
    b = disc[M12] / a
    c = math.sqrt(max(disc[M22] - b * b, 1e-12))
    for k in range(_AROUND + _WITHIN):
        angle = 2.0 * math.pi * k / _AROUND if k < _AROUND else 2.0 * math.pi * (k - _AROUND) / _WITHIN
        far = _AROUND_RADII if k < _AROUND else _WITHIN_RADII
        y = math.sin(angle) / c
        template[k, 0], template[k, 1] = round(far * (math.cos(angle) - b * y) / a), round(far * y)
        template[-1, 0], template[-1, 1] = (
            max(template[-1, 0], abs(template[k, 0])),
            max(template[-1, 1], abs(template[k, 1])),
        )


@inlined
def _template_score(image: NDArray[Any], level: float, contrast: float, template: Ints, u: float, v: float) -> float:
    """How much the picture at (u, v) looks like the marker, 0 to 1: its middle against its surroundings, in parts of
    the contrast.
    """
    height, width = image.shape
    row, col = math.floor(v + 0.5), math.floor(u + 0.5)
    reach_u, reach_v = template[-1, 0], template[-1, 1]
    if not (reach_u <= col < width - reach_u and reach_v <= row < height - reach_v):
        return 0.0
    inside = outside = 0
    for k in range(_AROUND, _AROUND + _WITHIN):
        inside += image[row + template[k, 1], col + template[k, 0]]
    if (inside / _WITHIN - level) / contrast < _LEAST_SCORE:
        return 0.0
    for k in range(_AROUND):
        outside += image[row + template[k, 1], col + template[k, 0]]
    score = (inside / _WITHIN - outside / _AROUND) / contrast
    return min(max(score, 0.0), 1.0)


@compiled
def _spread(place_m: Floats) -> tuple[float, float]:
    """The least distance of two of a body's markers (n, 3), and the largest of one from its origin [m]."""
    least, far = _NEVER, _ORIGIN_M
    for i in range(len(place_m)):
        far = max(far, math.hypot(place_m[i, 0], place_m[i, 1]))
        for j in range(i):
            least = min(least, math.hypot(place_m[i, 0] - place_m[j, 0], place_m[i, 1] - place_m[j, 1]))
    return least, far


@compiled
def _predict_marker(state: TrackState, body: int, i: int, arm: Floats, at: Floats) -> bool:
    """Marker `i` from its body's origin, in the world's directions (2,), and where it is predicted, as `project`; False
    if never seen.
    """
    pose, place = state.measured.predicted[body], state.markers.place_m[i]
    c, s = math.cos(pose[ANGLE]), math.sin(pose[ANGLE])
    arm[0], arm[1] = c * place[0] - s * place[1], s * place[0] + c * place[1]
    project(state.geometry.camera, pose[X] + arm[0], pose[Y] + arm[1], place[2], at)
    return state.markers.disc[i, M11] > 0.0 and state.markers.disc[i, CONTRAST] != 0.0


@compiled
def lost_lock(image: NDArray[Any], state: TrackState, body: int) -> bool:
    """Whether a body is not where it was predicted: most of its markers are not."""
    template, arm, at = np.empty((_AROUND + _WITHIN + 1, 2), np.int64), np.empty(2), np.empty(N_PROJECTED)
    total, scored = 0.0, 0
    for i in range(state.geometry.first[body], state.geometry.first[body + 1]):
        if _predict_marker(state, body, i, arm, at):
            disc = state.markers.disc[i]
            _template(disc, template)
            total += _template_score(image, disc[LEVEL], disc[CONTRAST], template, at[AT_U], at[AT_V])
            scored += 1
    return scored >= NAMED and total < _LOST * scored


@compiled
def _score_maps(image: NDArray[Any], state: TrackState, body: int, step_m: float, maps: Floats, arms: Floats) -> None:
    """Template score of each marker (n, 2 side + 1, 2 side + 1) at places a step apart [y, x] about its predicted one;
    its arm (n, 2).
    """
    template, at = np.empty((_AROUND + _WITHIN + 1, 2), np.int64), np.empty(N_PROJECTED)
    lo, side = state.geometry.first[body], maps.shape[1] // 2
    maps[:] = 0.0
    for k in range(len(maps)):
        if _predict_marker(state, body, lo + k, arms[k], at):
            disc = state.markers.disc[lo + k]
            _template(disc, template)
            level, contrast = disc[LEVEL], disc[CONTRAST]
            for y in range(-side, side + 1):
                for x in range(-side, side + 1):
                    u = at[AT_U] + step_m * (at[DU_DX] * x + at[DU_DY] * y)
                    v = at[AT_V] + step_m * (at[DV_DX] * x + at[DV_DY] * y)
                    maps[k, y + side, x + side] = _template_score(image, level, contrast, template, u, v)


@compiled
def relocate(image: NDArray[Any], state: TrackState, body: int, pose: Floats) -> bool:
    """Put into `pose` (3,) where, about the prediction, a body's markers are; False where they are not."""
    lo, hi = state.geometry.first[body], state.geometry.first[body + 1]
    least_m, far_m = _spread(state.markers.place_m[lo:hi])
    moved_m = math.hypot(state.bodies.velocity[body, X], state.bodies.velocity[body, Y])
    arms, at, predicted = np.empty((hi - lo, 2)), np.empty(N_PROJECTED), state.measured.predicted[body]
    step_m, scored = _NEVER, 0
    for i in range(lo, hi):
        if _predict_marker(state, body, i, arms[0], at):
            px_per_m = math.sqrt(abs(px2_per_m2(at)))
            step_m = min(step_m, _STEP * determinant(state.markers.disc[i]) ** -0.25 / px_per_m)
            scored += 1
    if scored < NAMED:
        return False
    reach_m = min(_APART * least_m, _STEPS_MOVED * moved_m + _LEAST / _STEP * step_m)
    steps = min(int(reach_m / step_m) + 1, _MOST_STEPS)
    side = 2 * steps  # the body's step, and its marker's by turning
    maps = np.empty((hi - lo, 2 * side + 1, 2 * side + 1))
    _score_maps(image, state, body, step_m, maps, arms)
    best, found, wide = _FOUND * scored, False, 2 * steps + 1
    total, offsets = np.empty(wide), np.empty((hi - lo, 2), np.int64)
    for turn in range(-steps, steps + 1):
        for k in range(hi - lo):
            offsets[k, 0] = steps + round(turn * arms[k, 0] / far_m)
            offsets[k, 1] = steps - round(turn * arms[k, 1] / far_m)
        for y in range(wide):
            total[:] = 0.0
            for k in range(hi - lo):
                line, first = maps[k, y + offsets[k, 0]], offsets[k, 1]
                for x in range(wide):
                    total[x] += line[first + x]
            for x in range(wide):
                if total[x] > best:
                    best, found = total[x], True
                    pose[X] = predicted[X] + (x - steps) * step_m
                    pose[Y] = predicted[Y] + (y - steps) * step_m
                    pose[ANGLE] = predicted[ANGLE] + turn * step_m / far_m
    return found
