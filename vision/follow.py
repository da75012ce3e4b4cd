"""One camera, one frame: markers looked for where their bodies should be, and the bodies laid through them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.centre import M11, N_FIT, OK, OUTLIERS, STRUCTURED
from vision.compiled import compiled
from vision.flat_pose import project, robust_pose
from vision.same_disc import find, find_though_covered, nothing_there
from vision.sight import SIZED, Sight, accept, gate_m, good, sure

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SHAPE_EVERY = 4  # shape and blur change slowly: frames between two fits of them
_APART_M, _APART_RAD = 0.015, 0.35  # two cameras that differ by more do not see the same body


@compiled
def _circle_shape(at: Floats, radius_m: float, row: Floats) -> None:
    """The ellipse in which a horizontal circle of `radius_m` is seen: row[M11:S11], from the derivatives that `project` gave."""
    a, b, c, d = at[2], at[3], at[4], at[5]
    scale = 1.0 / ((a * d - b * c) * radius_m) ** 2
    row[M11], row[M11 + 1], row[M11 + 2] = scale * (c * c + d * d), -scale * (a * c + b * d), scale * (a * a + b * b)


@compiled
def _look_for(image: NDArray[Any], sight: Sight, i: int, pose: Floats, hold_shape: bool, covered: bool, at: Floats, start: Floats) -> bool:
    """Look for marker `i`, plain or as one that is partly `covered`, where a body's `pose` puts it; `at` (6,), `start` (20,): room."""
    if sight.starts[i, 2] <= 0.0:
        return False
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + c * sight.place_m[i, 0] - s * sight.place_m[i, 1]
    y = pose[1] + s * sight.place_m[i, 0] + c * sight.place_m[i, 1]
    project(sight.cam, x, y, sight.place_m[i, 2], at)
    if not (-5.0 < at[0] < image.shape[1] + 5.0 and -5.0 < at[1] < image.shape[0] + 5.0):
        return False
    start[:] = sight.starts[i]
    if start[OK] > 0.0 and nothing_there(image, start, at[0], at[1]):
        return False
    sized = sight.sized[i] >= SIZED and sight.radius_m[i] > 0.0
    if sized and start[OUTLIERS] >= STRUCTURED:
        _circle_shape(at, sight.radius_m[i], start)
    fit = sight.fits[i]
    fit[:] = start
    fit[0], fit[1] = at[0], at[1]
    sight.seen_m[i] = 0.0
    one = sight.fits[i:i + 1]
    if not (find_though_covered(image, start, sized, one) if covered else find(image, start, hold_shape, sized, one)):
        return False
    du, dv = fit[0] - at[0], fit[1] - at[1]
    det = at[2] * at[5] - at[3] * at[4]
    if fit[OUTLIERS] < STRUCTURED:
        sight.seen_m[i] = (fit[2] * fit[4] - fit[3] ** 2) ** -0.25 / math.sqrt(abs(det))
    sight.xy[i, 0] = x + (at[5] * du - at[3] * dv) / det
    sight.xy[i, 1] = y + (at[2] * dv - at[4] * du) / det
    return True


@compiled
def _follow(image: NDArray[Any], sight: Sight, body: int, hold_shape: bool) -> None:
    """Look for every marker of a body where `sight.found` puts it: replaced by what is found.

    A body of which no marker is plainly there has jumped, and is not worth the dear fits: the search will find it.
    """
    at, start, pose = np.empty(6), np.empty(N_FIT), sight.found[body]
    lo, hi = sight.first[body], sight.first[body + 1]
    seen = 0
    for i in range(lo, hi):
        sight.use[i] = _look_for(image, sight, i, pose, hold_shape, False, at, start)
        seen += sight.use[i]
    for i in range(lo, hi):
        if sight.use[i] == 0 and (seen > 0 or hi - lo < 3):
            sight.use[i] = _look_for(image, sight, i, pose, hold_shape, True, at, start)
    sight.n_seen[body], sight.rms_m[body] = robust_pose(
        sight.place_m[lo:hi], sight.xy[lo:hi], sight.use[lo:hi], hi - lo, gate_m(sight, body), pose)


@compiled
def look(image: NDArray[Any], sight: Sight, active: Ints, hold_shape: bool) -> None:
    """Follow the active bodies, (b,) 0/1, from `sight.found`; a second look where the first was off.

    image : (h, w) uint8 or uint16;  hold_shape : keep each marker's shape and blur of the frame before, where they still serve
    """
    before = np.empty(3)
    for b in range(len(active)):
        if not active[b]:
            continue
        before[:] = sight.found[b]
        _follow(image, sight, b, hold_shape)
        known = 0
        for i in range(sight.first[b], sight.first[b + 1]):
            known += sight.starts[i, 2] > 0.0
        found = sight.found[b]
        moved = math.hypot(found[0] - before[0], found[1] - before[1]) > 2e-4 or abs(found[2] - before[2]) > 0.02
        if moved and 2 <= sight.n_seen[b] < known:
            _follow(image, sight, b, hold_shape)


@compiled
def hold_shape(frame: int) -> bool:
    """Whether shapes and blurs of the frame before are to serve in this one."""
    return frame % _SHAPE_EVERY != 0


@compiled
def see(image: NDArray[Any], sight: Sight, known: Ints, frame: int) -> None:
    """Look for all known bodies, (b,) 0/1, that were seen before where their motion carries them."""
    active = np.zeros(len(known), np.int64)
    for b in range(len(known)):
        active[b] = known[b] and sight.last[b] >= 0
        sight.found[b] = sight.expected[b] if active[b] else sight.found[b]
    look(image, sight, active, hold_shape(frame))


@compiled
def apart(one: Sight, other: Sight, body: int) -> bool:
    """Whether the cameras found a body at places that cannot be one."""
    turn = one.found[body, 2] - other.found[body, 2]
    off = math.hypot(one.found[body, 0] - other.found[body, 0], one.found[body, 1] - other.found[body, 1])
    return off > _APART_M or abs(turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))) > _APART_RAD


@compiled
def accept_steady(one: Sight, other: Sight, known: Ints, frame: int, settled: Ints) -> None:
    """Accept every body that both cameras surely see; `settled` (b,) 0/1: out.  What is left needs a closer look."""
    for b in range(len(known)):
        settled[b] = 0
        if (known[b] and sure(one, b) and sure(other, b) and good(one, b, frame) and good(other, b, frame)
                and not apart(one, other, b)):
            accept(one, b, frame)
            accept(other, b, frame)
            settled[b] = 1
