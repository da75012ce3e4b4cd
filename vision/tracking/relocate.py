"""Where a body went that is not where its motion carries it: an impact between two frames.

Around each marker's expected place a coarse map says how much the picture looks like that marker; the pose under which
all maps agree best is where the exact fits begin.  It takes 0.03 to 0.3 ms, where finding all discs nearby and matching
them to the layout takes 8, and cannot take one marker for another: the search goes not half as far as the markers are
apart.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, inlined
from vision.markers.fit import CONTRAST, LEVEL
from vision.tracking.planar_pose import project
from vision.tracking.state import Sight

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_JUMPED = 0.5  # mean likeness below which the body is not where it was expected
_THERE = 0.6  # and from which it is where the maps say
_AROUND, _WITHIN = 8, 4  # pixels asked in a marker's surroundings, and inside it
_FARTHER = 2.2  # times what it moved from frame to frame: a body that bounces straight back
_LEAST_LIKENESS = 0.1
_LEAST = 0.2  # marker radii that are searched at least
_STEP = 0.4  # marker radii between two places asked; the fits begin from twice as far
_MOST_STEPS = 24


@compiled
def _ring(start: Floats, ring: Ints) -> None:
    """Whole pixels (_AROUND + _WITHIN + 1, 2) from a marker's middle: on an ellipse one and a half times as large as
    it, then within it; how far they reach.
    """
    ring[:] = 0
    # With M = C C', the points C'^-1 (cos, sin) lie on the edge.
    a = math.sqrt(start[2])
    b = start[3] / a
    c = math.sqrt(max(start[4] - b * b, 1e-12))
    for k in range(_AROUND + _WITHIN):
        angle = 2.0 * math.pi * k / _AROUND if k < _AROUND else 2.0 * math.pi * (k - _AROUND) / _WITHIN
        far = 1.5 if k < _AROUND else 0.45
        y = math.sin(angle) / c
        ring[k, 0], ring[k, 1] = round(far * (math.cos(angle) - b * y) / a), round(far * y)
        ring[-1, 0], ring[-1, 1] = max(ring[-1, 0], abs(ring[k, 0])), max(ring[-1, 1], abs(ring[k, 1]))


@inlined
def _likeness(image: NDArray[Any], level: float, contrast: float, ring: Ints, u: float, v: float) -> float:
    """How much the picture at (u, v) looks like the marker, 0 to 1: its middle against its surroundings, in parts of
    the contrast.
    """
    height, width = image.shape
    row, col = math.floor(v + 0.5), math.floor(u + 0.5)
    reach_u, reach_v = ring[-1, 0], ring[-1, 1]
    if not (reach_u <= col < width - reach_u and reach_v <= row < height - reach_v):
        return 0.0
    inside = outside = 0
    for k in range(_AROUND, _AROUND + _WITHIN):
        inside += image[row + ring[k, 1], col + ring[k, 0]]
    if (inside / _WITHIN - level) / contrast < _LEAST_LIKENESS:
        return 0.0  # as its surroundings always were: most places, and soon told
    for k in range(_AROUND):
        outside += image[row + ring[k, 1], col + ring[k, 0]]
    told = (inside / _WITHIN - outside / _AROUND) / contrast
    return min(max(told, 0.0), 1.0)


@compiled
def _spread(sight: Sight, lo: int, hi: int) -> tuple[float, float]:
    """The least distance of two of a body's markers, and the largest of one from its origin [m]."""
    least, far = 1e9, 1e-9
    for i in range(lo, hi):
        far = max(far, math.hypot(sight.place_m[i, 0], sight.place_m[i, 1]))
        for j in range(lo, i):
            least = min(
                least, math.hypot(sight.place_m[i, 0] - sight.place_m[j, 0], sight.place_m[i, 1] - sight.place_m[j, 1])
            )
    return least, far


@compiled
def _expect(sight: Sight, body: int, i: int, arm: Floats, at: Floats) -> bool:
    """Marker `i` from its body's origin, in the world's directions (2,), and where it is expected, as `project`; False
    if never seen.
    """
    c, s = math.cos(sight.expected[body, 2]), math.sin(sight.expected[body, 2])
    arm[0], arm[1] = (
        c * sight.place_m[i, 0] - s * sight.place_m[i, 1],
        s * sight.place_m[i, 0] + c * sight.place_m[i, 1],
    )
    project(sight.cam, sight.expected[body, 0] + arm[0], sight.expected[body, 1] + arm[1], sight.place_m[i, 2], at)
    return sight.starts[i, 2] > 0.0 and sight.starts[i, CONTRAST] != 0.0


@compiled
def jumped(image: NDArray[Any], sight: Sight, body: int) -> bool:
    """Whether a body is surely not where it was expected: most of its markers are not."""
    ring, arm, at = np.empty((_AROUND + _WITHIN + 1, 2), np.int64), np.empty(2), np.empty(6)
    total, asked = 0.0, 0
    for i in range(sight.first[body], sight.first[body + 1]):
        if _expect(sight, body, i, arm, at):
            _ring(sight.starts[i], ring)
            total += _likeness(image, sight.starts[i, LEVEL], sight.starts[i, CONTRAST], ring, at[0], at[1])
            asked += 1
    return asked >= 3 and total < _JUMPED * asked


@compiled
def _maps(image: NDArray[Any], sight: Sight, body: int, step_m: float, side: int, maps: Floats, arms: Floats) -> None:
    """Likeness of each marker (n, 2 side + 1, 2 side + 1) at places a step apart [y, x] about its expected one; its arm
    (n, 2).
    """
    ring, at = np.empty((_AROUND + _WITHIN + 1, 2), np.int64), np.empty(6)
    lo = sight.first[body]
    maps[:] = 0.0
    for k in range(len(maps)):
        if _expect(sight, body, lo + k, arms[k], at):
            _ring(sight.starts[lo + k], ring)
            level, contrast = sight.starts[lo + k, LEVEL], sight.starts[lo + k, CONTRAST]
            for y in range(-side, side + 1):
                for x in range(-side, side + 1):
                    u, v = at[0] + step_m * (at[2] * x + at[3] * y), at[1] + step_m * (at[4] * x + at[5] * y)
                    maps[k, y + side, x + side] = _likeness(image, level, contrast, ring, u, v)


@compiled
def seek(image: NDArray[Any], sight: Sight, body: int, pose: Floats) -> bool:
    """Put into `pose` (3,) where, about the expectation, a body's markers are; False where they are not."""
    lo, hi = sight.first[body], sight.first[body + 1]
    least_m, far_m = _spread(sight, lo, hi)
    moved_m = math.hypot(sight.velocity[body, 0], sight.velocity[body, 1])
    arms, at = np.empty((hi - lo, 2)), np.empty(6)
    step_m, asked = 1e9, 0
    for i in range(lo, hi):
        if _expect(sight, body, i, arms[0], at):
            start = sight.starts[i]
            px_per_m = math.sqrt(abs(at[2] * at[5] - at[3] * at[4]))
            step_m = min(step_m, _STEP * (start[2] * start[4] - start[3] ** 2) ** -0.25 / px_per_m)
            asked += 1
    if asked < 3:
        return False
    steps = min(int(min(0.45 * least_m, _FARTHER * moved_m + _LEAST / _STEP * step_m) / step_m) + 1, _MOST_STEPS)
    side = 2 * steps  # the body's step, and its marker's by turning
    maps = np.empty((hi - lo, 2 * side + 1, 2 * side + 1))
    _maps(image, sight, body, step_m, side, maps, arms)
    best, found, wide = _THERE * asked, False, 2 * steps + 1
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
                    pose[0] = sight.expected[body, 0] + (x - steps) * step_m
                    pose[1] = sight.expected[body, 1] + (y - steps) * step_m
                    pose[2] = sight.expected[body, 2] + turn * step_m / far_m
    return found
