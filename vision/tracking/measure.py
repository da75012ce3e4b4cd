"""One camera, one frame: markers looked for where their bodies should be, and the bodies laid through them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled, inlined
from vision.markers.fit import M11, N_FIT, OK, OUTLIERS, STRUCTURED
from vision.tracking.marker_validation import find, find_though_covered, nothing_there
from vision.tracking.planar_pose import project, robust_pose
from vision.tracking.relocate import jumped, seek
from vision.tracking.state import SIZED, Sight, accept, disc_m, gate_m, good, lost, predict, record, sure

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

_SHAPE_EVERY = 4  # shape and blur change slowly: frames between two fits of them
_SOUGHT = 4  # frames after which a body lost is no longer near its prediction
# Two cameras that differ by more do not see the same body: radii of the rig, the body's largest steps (one may have
# dropped a few frames), turn.
_APART, _APART_STEPS, _APART_RAD = 0.3, 4.0, 0.35
_ASTRAY = 0.15  # radii of a disc that the first look may have been off without a second
_BESIDE = (
    0.7  # radii of a disc outside the picture where it may be expected and yet be seen: there a prediction was off
)


@compiled
def _circle_shape(at: Floats, radius_m: float, row: Floats) -> None:
    """The ellipse in which a horizontal circle of `radius_m` is seen: row[M11:S11], from the derivatives that `project`
    gave.
    """
    a, b, c, d = at[2], at[3], at[4], at[5]
    scale = 1.0 / ((a * d - b * c) * radius_m) ** 2
    row[M11], row[M11 + 1], row[M11 + 2] = scale * (c * c + d * d), -scale * (a * c + b * d), scale * (a * a + b * b)


# Inlined, as `_follow` is: whatever calls a compiled function is compiled together with all that is below it.
@inlined
def _look_for(
    image: NDArray[Any], sight: Sight, i: int, pose: Floats, hold_shape: bool, covered: bool, at: Floats, start: Floats
) -> bool:
    """Look for marker `i`, plain or as one that is partly `covered`, where a body's `pose` puts it; `at` (6,), `start`
    (20,): room.
    """
    if sight.starts[i, 2] <= 0.0:
        return False
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x = pose[0] + c * sight.place_m[i, 0] - s * sight.place_m[i, 1]
    y = pose[1] + s * sight.place_m[i, 0] + c * sight.place_m[i, 1]
    project(sight.cam, x, y, sight.place_m[i, 2], at)
    start[:] = sight.starts[i]
    beside = _BESIDE * (start[2] * start[4] - start[3] ** 2) ** -0.25
    if not (-beside < at[0] < image.shape[1] + beside and -beside < at[1] < image.shape[0] + beside):
        return False
    if start[OK] > 0.0 and nothing_there(image, start, at[0], at[1]):
        return False
    sized = sight.sized[i] >= SIZED and sight.radius_m[i] > 0.0
    if sized and start[OUTLIERS] >= STRUCTURED:
        _circle_shape(at, sight.radius_m[i], start)
    fit = sight.fits[i]
    fit[:] = start
    fit[0], fit[1] = at[0], at[1]
    sight.seen_m[i] = 0.0
    one = sight.fits[i : i + 1]
    if not (
        find_though_covered(image, start, hold_shape, sized, one)
        if covered
        else find(image, start, hold_shape, sized, one)
    ):
        return False
    du, dv = fit[0] - at[0], fit[1] - at[1]
    det = at[2] * at[5] - at[3] * at[4]
    if fit[OUTLIERS] < STRUCTURED:
        sight.seen_m[i] = (fit[2] * fit[4] - fit[3] ** 2) ** -0.25 / math.sqrt(abs(det))
    sight.xy[i, 0] = x + (at[5] * du - at[3] * dv) / det
    sight.xy[i, 1] = y + (at[2] * dv - at[4] * du) / det
    return True


@inlined
def _follow(image: NDArray[Any], sight: Sight, body: int, hold_shape: bool) -> None:
    """Look for every marker of a body where `sight.found` puts it: replaced by what is found.

    A body of which no marker is plainly there has jumped, and is not worth the dear fits: the search will find it.
    """
    at, start, pose = np.empty(6), np.empty(N_FIT), sight.found[body]
    lo, hi = sight.first[body], sight.first[body + 1]
    sight.use[lo:hi] = 0
    seen = 0
    for covered in range(2):
        if covered == 0 or seen > 0 or hi - lo < 3:
            for i in range(lo, hi):
                if sight.use[i] == 0:
                    sight.use[i] = _look_for(image, sight, i, pose, hold_shape, covered == 1, at, start)
                    seen += sight.use[i]
    sight.n_seen[body], sight.rms_m[body] = robust_pose(
        sight.place_m[lo:hi], sight.xy[lo:hi], sight.use[lo:hi], hi - lo, gate_m(sight, body), pose
    )


@compiled
def look(image: NDArray[Any], sight: Sight, body: int, frame: int) -> None:
    """Follow a body from `sight.found`; a second look where the first was off.

    image : (h, w) uint8 or uint16
    """
    before = np.empty(3)
    hold_shape = (
        frame % _SHAPE_EVERY != 0
    )  # each marker's shape and blur of the frame before serve, where they still do
    found = sight.found[body]
    for _ in range(2):
        before[:] = found
        _follow(image, sight, body, hold_shape)
        known = 0
        for i in range(sight.first[body], sight.first[body + 1]):
            known += sight.starts[i, 2] > 0.0
        if not 2 <= sight.n_seen[body] < known:
            break
        if (
            math.hypot(found[0] - before[0], found[1] - before[1]) < _ASTRAY * disc_m(sight, body)
            and abs(found[2] - before[2]) < 0.02
        ):
            break


@compiled
def see(image: NDArray[Any], sight: Sight, known: Ints, frame: int) -> None:
    """Look for all known bodies, (b,) 0/1, that were seen before: where their motion carries them, or near there if
    they jumped.
    """
    for b in range(len(known)):
        if not known[b] or sight.last[b] < 0:
            continue
        sight.found[b] = sight.expected[b]
        leapt = lost(sight, b, frame) < _SOUGHT and jumped(image, sight, b) and seek(image, sight, b, sight.found[b])
        for at_expected in range(2):
            if at_expected:
                sight.found[b] = sight.expected[b]
            look(image, sight, b, frame)
            if not leapt or _settled(sight, b, frame):
                break


@compiled
def _settled(sight: Sight, body: int, frame: int) -> bool:
    """Whether this camera needs no other to know where the body is."""
    return sure(sight, body) and good(sight, body, frame)


@compiled
def apart_m(sight: Sight, body: int) -> float:
    """How far two cameras may differ about where a body is."""
    return max(_APART * sight.rig_m, _APART_STEPS * sight.step_m[body])


@compiled
def apart(one: Floats, other: Floats, within_m: float) -> bool:
    """Whether two cameras found a body at poses (3,) that cannot be one."""
    turn = one[2] - other[2]
    off = math.hypot(one[0] - other[0], one[1] - other[1])
    return off > within_m or abs(turn - 2.0 * math.pi * round(turn / (2.0 * math.pi))) > _APART_RAD


@compiled
def together(one: Floats, other: Floats, known: Ints, sight: Sight) -> int:
    """In how many frames from the first on two cameras' poses (f, b, 3) of the known bodies are one; `sight`: of
    either, for `apart_m`.
    """
    for k in range(min(len(one), len(other))):
        for b in range(len(known)):
            if known[b] and apart(one[k, b], other[k, b], apart_m(sight, b)):
                return k
    return min(len(one), len(other))


@compiled
def accept_steady(one: Sight, other: Sight, known: Ints, frame: int, settled: Ints) -> None:
    """Accept every body that both cameras surely see; `settled` (b,) 0/1: out.  What is left needs a closer look."""
    for b in range(len(known)):
        settled[b] = (
            known[b]
            and _settled(one, b, frame)
            and _settled(other, b, frame)
            and not apart(one.found[b], other.found[b], apart_m(one, b))
        )
        if settled[b]:
            accept(one, b, frame)
            accept(other, b, frame)


@compiled
def run_ahead(
    images: tuple[NDArray[Any], ...],
    frames: Ints,
    sight: Sight,
    known: Ints,
    before: tuple[Floats, Ints],
    poses: Floats,
    rows: Floats,
    n_rows: Ints,
) -> int:
    """Follow the bodies through several frames as long as this camera needs no other for it; how many frames that were.

    images, frames : as many pictures as there is room for, and the numbers (f,) of those that count
    before : room for `Sight.floats` and `Sight.ints` as they were before each frame, (f, ...) each
    poses : (f, b, 3) found;  rows, n_rows : as `record`, and how many rows were filled after each frame, n_rows[0]
    before the first
    """
    for k in range(len(frames)):
        for b in range(len(known)):
            if known[b] and lost(sight, b, frames[k]) > 0:
                return k  # both cameras look for it
        before[0][k], before[1][k] = sight.floats, sight.ints
        predict(sight, frames[k])
        see(images[k], sight, known, frames[k])
        for b in range(len(known)):
            if known[b] and not _settled(sight, b, frames[k]):
                sight.floats[:], sight.ints[:] = before[0][k], before[1][k]
                return k
        for b in range(len(known)):
            if known[b]:
                accept(sight, b, frames[k])
        poses[k] = sight.found
        n_rows[k + 1] = record(sight, frames[k], rows, n_rows[k])
    return len(frames)
