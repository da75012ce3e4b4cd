"""What one camera holds of the bodies from frame to frame, as arrays that compiled code changes in place: prediction,
belief, memory.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from vision.compiled import compiled
from vision.markers.fit import M11, OUTLIERS, S11, SD, STRUCTURED, U
from vision.tracking.planar_pose import project

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# How far a body may be off its prediction: in radii of the rig where it hardly moves, and in its largest step from one
# frame to the next. An impact turns a step round at most, and the other body's own adds: 2 (one + other) of them, with
# the faster one for both.
STRAY, BOUNCES = 0.12, 4.0
JUMP_RAD = 0.8  # the same for its turn
NEAR, NEAR_RAD = (
    0.3,
    0.1,
)  # radii of a disc, and turn, this near to its prediction a single marker is believed: discs do not overlap
# Radii of the rig that a marker may always lie off its place, by the calibration: once the body's own scatter is known,
# and before.
_FLOOR, _FIRST_FLOOR = 0.0012, 0.002
SIZED = 5  # frames with no other edge near, after which a marker's size counts as known
_SETTLED = 30  # frames after which a body's own scatter sets the gate
_LEARN_EVERY = 16
# numbers kept of a marker in a frame: frame, marker, height, pose of its body, centre and shape, sd of the centre
KEPT = 12


class Sight(NamedTuple):
    """Poses are (x, y, angle) of each body on its plane.  (b, ...): one per body, (n, ...): one per marker.

    ``cam``: `flat_pose.packed`; ``place_m`` (n, 3) markers in their bodies' frames, as this camera sees them; ``first``
    (b + 1,) first marker of each body; ``tolerance_m`` (b,); ``rig_m``: radius of the rig; ``pose``, ``velocity`` per
    frame, ``expected``, ``found`` (b, 3);
    ``step_m`` (b,) largest step from one frame to the next; ``last`` (b,) frame last seen; ``seen_times``,
    ``scatter_m``, ``n_seen``, ``rms_m`` (b,); ``starts``, ``fits`` (n, 20) when last seen, and now;
    ``xy`` (n, 2) world; ``use`` (n,) 0/1; ``radius_m``, ``seen_m`` (n,) known and now; ``sized``, ``learned`` (n,) how
    often.
    ``floats``, ``ints``: the memory in which all these lie but the first, ``first``, ``tolerance_m`` and ``rig_m``; a
    copy of it is a way back.
    """

    cam: Floats
    place_m: Floats
    first: Ints
    tolerance_m: Floats
    rig_m: float
    pose: Floats
    velocity: Floats
    change: Floats
    bend: Floats
    step_m: Floats
    expected: Floats
    found: Floats
    last: Ints
    seen_times: Ints
    scatter_m: Floats
    n_seen: Ints
    rms_m: Floats
    starts: Floats
    fits: Floats
    xy: Floats
    use: Ints
    radius_m: Floats
    seen_m: Floats
    sized: Ints
    learned: Ints
    floats: Floats
    ints: Ints


@compiled
def gate_m(sight: Sight, body: int) -> float:
    """How far a marker may lie from its place in the body."""
    widest, scatter = sight.tolerance_m[body], sight.scatter_m[body]
    if sight.seen_times[body] == 0:
        return widest
    settled = sight.seen_times[body] > _SETTLED
    return min(
        max(5.0 * scatter, _FLOOR * sight.rig_m) if settled else max(8.0 * scatter, _FIRST_FLOOR * sight.rig_m), widest
    )


@compiled
def disc_m(sight: Sight, body: int) -> float:
    """Radius of a body's markers as they looked last, the mean of those that were seen; 0 where none was."""
    at = np.empty(6)
    c, s = math.cos(sight.expected[body, 2]), math.sin(sight.expected[body, 2])
    total, seen = 0.0, 0
    for i in range(sight.first[body], sight.first[body + 1]):
        start, place = sight.starts[i], sight.place_m[i]
        det = start[M11] * start[M11 + 2] - start[M11 + 1] ** 2
        if det > 0.0:
            project(
                sight.cam,
                sight.expected[body, 0] + c * place[0] - s * place[1],
                sight.expected[body, 1] + s * place[0] + c * place[1],
                place[2],
                at,
            )
            total += det**-0.25 / math.sqrt(abs(at[2] * at[5] - at[3] * at[4]))
            seen += 1
    return total / max(seen, 1)


@compiled
def fastest_m(sight: Sight) -> float:
    """The largest step from one frame to the next that any body has made so far."""
    return float(sight.step_m.max())


@compiled
def stray_m(sight: Sight) -> float:
    """How far a body may be from where its last motion carries it, per frame since it was seen."""
    return max(STRAY * sight.rig_m, BOUNCES * fastest_m(sight))


@compiled
def lost(sight: Sight, body: int, frame: int) -> int:
    """Frames since the body was last seen, 0 when it was seen in the frame before."""
    return min(frame - sight.last[body] - 1, 10**6)


@compiled
def predict(sight: Sight, frame: int) -> None:
    """Expect every body where its last motion carries it, on the path it bends; nothing is seen yet."""
    sight.use[:] = 0
    sight.n_seen[:] = 0
    for b in range(len(sight.last)):
        ahead = max(min(frame - sight.last[b], 4), 0)
        for k in range(3):
            sight.expected[b, k] = sight.pose[b, k] + ahead * (
                sight.velocity[b, k] + 0.5 * (ahead + 1) * sight.bend[b, k]
            )


@compiled
def off_prediction(sight: Sight, body: int) -> tuple[float, float]:
    """How far the body was found from where it was expected: metres, and radians without whole turns."""
    x, y = sight.found[body, 0] - sight.expected[body, 0], sight.found[body, 1] - sight.expected[body, 1]
    turn = sight.found[body, 2] - sight.expected[body, 2]
    return math.hypot(x, y), abs(turn - 2.0 * math.pi * round(turn / (2.0 * math.pi)))


@compiled
def good(sight: Sight, body: int, frame: int) -> bool:
    """Whether what was found is the body, where it can be."""
    off, turned = off_prediction(sight, body)
    away = lost(sight, body, frame)
    if sight.n_seen[body] >= 2:
        return away > 3 or (off < stray_m(sight) * (1 + away) and turned < JUMP_RAD)
    return sight.n_seen[body] == 1 and off < NEAR * disc_m(sight, body) and away < 5


@compiled
def near(sight: Sight, body: int) -> bool:
    """Whether the body is where its last motion carries it, so that few markers suffice to name them."""
    off, turned = off_prediction(sight, body)
    return off < NEAR * disc_m(sight, body) and turned < NEAR_RAD


@compiled
def sure(sight: Sight, body: int) -> bool:
    """Whether the markers seen say which is which: one or two of many fit anything (look-alikes a quarter turn on).

    Two suffice of a body that hardly moves from frame to frame and is where it was expected.  Until its spin and its
    layout are known all of them have to be there, or it where it was: markers in a ring that turns by nearly their
    spacing seem to turn back.
    """
    if (
        sight.seen_times[body] <= _SETTLED
        and sight.n_seen[body] < sight.first[body + 1] - sight.first[body]
        and not near(sight, body)
    ):
        return False
    if sight.n_seen[body] >= min(3, sight.first[body + 1] - sight.first[body]):
        return True
    if sight.n_seen[body] < 2:
        return False
    step_m = math.hypot(sight.velocity[body, 0], sight.velocity[body, 1])
    return step_m < NEAR * disc_m(sight, body) and abs(sight.velocity[body, 2]) < NEAR_RAD and near(sight, body)


@compiled
def _agreed(one: float, other: float) -> float:
    """The smaller of two numbers of one sign; 0 of different ones."""
    return 0.0 if one * other <= 0.0 else min(one, other) if one > 0.0 else max(one, other)


@compiled
def accept(sight: Sight, body: int, frame: int) -> None:
    """Make what was found the body's state, and learn how this camera sees its layout."""
    gap = frame - sight.last[body]
    if gap == 1 and sight.n_seen[body] >= 2:
        step_m = math.hypot(sight.found[body, 0] - sight.pose[body, 0], sight.found[body, 1] - sight.pose[body, 1])
        sight.step_m[body] = max(sight.step_m[body], step_m)
    for k in range(3):
        change = 0.0
        if sight.n_seen[body] >= 2:
            velocity = (sight.found[body, k] - sight.pose[body, k]) / gap if 0 < gap <= 3 else 0.0
            change = velocity - sight.velocity[body, k] if gap == 1 else 0.0
            sight.velocity[body, k] = velocity
        # As far as two changes agree: a shaken Host bends its path in every frame, an impact once.
        sight.bend[body, k] = _agreed(change, sight.change[body, k])
        sight.change[body, k] = change
        sight.pose[body, k] = sight.found[body, k]
    sight.last[body] = frame
    for i in range(sight.first[body], sight.first[body + 1]):
        if sight.use[i]:
            _remember(sight, i)
    enough = sight.n_seen[body] >= min(3, sight.first[body + 1] - sight.first[body])
    if enough and (sight.seen_times[body] < 100 or frame % _LEARN_EVERY == 0):
        _learn(sight, body)


@compiled
def _remember(sight: Sight, i: int) -> None:
    """How a marker looks now; a shape through which other edges ran is not taken over from a marker of known size."""
    held = sight.sized[i] >= SIZED and sight.fits[i, OUTLIERS] >= STRUCTURED
    for k in range(sight.starts.shape[1]):
        if not (held and M11 <= k < S11):
            sight.starts[i, k] = sight.fits[i, k]
    if sight.seen_m[i] > 0.0:
        sight.sized[i] += 1
        sight.radius_m[i] += (sight.seen_m[i] - sight.radius_m[i]) / min(sight.sized[i], 50)


@compiled
def _learn(sight: Sight, body: int) -> None:
    """Each marker's place in the body, as a slowing mean; the scatter about them."""
    c, s = math.cos(sight.pose[body, 2]), math.sin(sight.pose[body, 2])
    for i in range(sight.first[body], sight.first[body + 1]):
        if sight.use[i]:
            x, y = sight.xy[i, 0] - sight.pose[body, 0], sight.xy[i, 1] - sight.pose[body, 1]
            gain = 1.0 / min(sight.learned[i] + 2, 200)
            sight.place_m[i, 0] += gain * (c * x + s * y - sight.place_m[i, 0])
            sight.place_m[i, 1] += gain * (c * y - s * x - sight.place_m[i, 1])
            sight.learned[i] += 1
    sight.seen_times[body] += 1
    sight.scatter_m[body] += (sight.rms_m[body] - sight.scatter_m[body]) / min(sight.seen_times[body], 50)


@compiled
def record(sight: Sight, frame: int, rows: Floats, n: int) -> int:
    """Append the markers seen to `rows` (enough, KEPT), of which `n` are filled; how many are now."""
    for b in range(len(sight.last)):
        for i in range(sight.first[b], sight.first[b + 1]):
            if sight.use[i]:
                row, fit = rows[n], sight.fits[i]
                row[0], row[1], row[2] = frame, i, sight.place_m[i, 2]
                row[3:6] = sight.found[b]
                row[6:11] = fit[U:S11]
                row[11] = fit[SD]
                n += 1
    return n
