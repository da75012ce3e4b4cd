"""Where a body went that is not where its motion carries it: an impact between two frames.

Around each marker's expected place a coarse map says how much the picture looks like that marker; the pose under which all maps
agree best is where the exact fits begin.  It takes 0.03 to 0.3 ms, where finding all discs nearby and matching them to the layout
takes 8, and cannot take one marker for another: the search goes not half as far as the markers are apart.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.centre import CONTRAST
from vision.compiled import compiled
from vision.flat_pose import project
from vision.sight import Sight

Floats = NDArray[np.float64]

_JUMPED = 0.5  # mean likeness below which the body is not where it was expected
_THERE = 0.6  # and from which it is where the maps say
_AROUND = 8  # pixels asked in a marker's surroundings
_FARTHER = 2.2  # times what it moved from frame to frame: a body that bounces straight back
_LEAST_M = 3e-4
_STEP = 0.4  # marker radii between two places asked; the fits begin from twice as far
_MOST_STEPS = 24


@compiled
def _ring(start: Floats, ring: Floats) -> None:
    """Offsets (_AROUND, 2) [px] of an ellipse one and a half times as large as the marker's."""
    # With M = C C', the points C'^-1 (cos, sin) lie on the edge.
    a = math.sqrt(start[2])
    b = start[3] / a
    c = math.sqrt(max(start[4] - b * b, 1e-12))
    for k in range(_AROUND):
        angle = 2.0 * math.pi * k / _AROUND
        y = math.sin(angle) / c
        ring[k, 0], ring[k, 1] = 1.5 * (math.cos(angle) - b * y) / a, 1.5 * y


@compiled
def _likeness(image: NDArray[Any], start: Floats, ring: Floats, u: float, v: float) -> float:
    """How much the picture at (u, v) looks like the marker, 0 to 1: its middle against its surroundings, in parts of the contrast."""
    height, width = image.shape
    inside = outside = 0.0
    for k in range(_AROUND):
        j, i = round(u + ring[k, 0]), round(v + ring[k, 1])
        if not (0 <= i < height and 0 <= j < width):
            return 0.0
        outside += image[i, j]
    for k in range(0, _AROUND, 2):
        j, i = round(u + 0.3 * ring[k, 0]), round(v + 0.3 * ring[k, 1])
        inside += image[i, j]
    told = (inside / (_AROUND // 2) - outside / _AROUND) / start[CONTRAST]
    return min(max(told, 0.0), 1.0)


@compiled
def _spread(sight: Sight, lo: int, hi: int) -> tuple[float, float]:
    """The least distance of two of a body's markers, and the largest of one from its origin [m]."""
    least, far = 1e9, 1e-9
    for i in range(lo, hi):
        far = max(far, math.hypot(sight.place_m[i, 0], sight.place_m[i, 1]))
        for j in range(lo, i):
            least = min(least, math.hypot(sight.place_m[i, 0] - sight.place_m[j, 0], sight.place_m[i, 1] - sight.place_m[j, 1]))
    return least, far


@compiled
def _expect(sight: Sight, body: int, i: int, arm: Floats, at: Floats) -> bool:
    """Marker `i` from its body's origin, in the world's directions (2,), and where it is expected, as `project`; False if never seen."""
    c, s = math.cos(sight.expected[body, 2]), math.sin(sight.expected[body, 2])
    arm[0], arm[1] = c * sight.place_m[i, 0] - s * sight.place_m[i, 1], s * sight.place_m[i, 0] + c * sight.place_m[i, 1]
    project(sight.cam, sight.expected[body, 0] + arm[0], sight.expected[body, 1] + arm[1], sight.place_m[i, 2], at)
    return sight.starts[i, 2] > 0.0 and sight.starts[i, CONTRAST] != 0.0


@compiled
def jumped(image: NDArray[Any], sight: Sight, body: int) -> bool:
    """Whether a body is surely not where it was expected: most of its markers are not."""
    ring, arm, at = np.empty((_AROUND, 2)), np.empty(2), np.empty(6)
    total, asked = 0.0, 0
    for i in range(sight.first[body], sight.first[body + 1]):
        if _expect(sight, body, i, arm, at):
            _ring(sight.starts[i], ring)
            total += _likeness(image, sight.starts[i], ring, at[0], at[1])
            asked += 1
    return asked >= 3 and total < _JUMPED * asked


@compiled
def _maps(image: NDArray[Any], sight: Sight, body: int, step_m: float, side: int, maps: Floats, arms: Floats) -> None:
    """Likeness of each marker (n, 2 side + 1, 2 side + 1) at places a step apart [y, x] about its expected one; its arm (n, 2)."""
    ring, at = np.empty((_AROUND, 2)), np.empty(6)
    lo = sight.first[body]
    maps[:] = 0.0
    for k in range(len(maps)):
        if _expect(sight, body, lo + k, arms[k], at):
            _ring(sight.starts[lo + k], ring)
            for y in range(-side, side + 1):
                for x in range(-side, side + 1):
                    u, v = at[0] + step_m * (at[2] * x + at[3] * y), at[1] + step_m * (at[4] * x + at[5] * y)
                    maps[k, y + side, x + side] = _likeness(image, sight.starts[lo + k], ring, u, v)


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
    steps = min(int(min(0.45 * least_m, _FARTHER * moved_m + _LEAST_M) / step_m) + 1, _MOST_STEPS)
    side = 2 * steps  # the body's step, and its marker's by turning
    maps = np.empty((hi - lo, 2 * side + 1, 2 * side + 1))
    _maps(image, sight, body, step_m, side, maps, arms)
    best, found, wide = _THERE * asked, False, 2 * steps + 1
    total = np.empty((wide, wide))
    for turn in range(-steps, steps + 1):
        total[:] = 0.0
        for k in range(hi - lo):
            y0, x0 = steps + round(turn * arms[k, 0] / far_m), steps - round(turn * arms[k, 1] / far_m)
            total += maps[k, y0:y0 + wide, x0:x0 + wide]
        for y in range(wide):
            for x in range(wide):
                if total[y, x] > best:
                    best, found = total[y, x], True
                    pose[0] = sight.expected[body, 0] + (x - steps) * step_m
                    pose[1] = sight.expected[body, 1] + (y - steps) * step_m
                    pose[2] = sight.expected[body, 2] + turn * step_m / far_m
    return found
