"""Frames that one camera dropped.

A dropped frame leaves no hole in a folder of pictures; every later picture of that camera simply belongs to a later
instant.  Where things move, the rays of two pictures of different instants do not intersect: across the epipolar
lines (the residual that needs nothing but the calibration), and along them, where the markers' heights are known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pandas as pd

from ovines.camera import Camera, epipolar_residual_px
from ovines.robust import MEDIAN_TO_SD
from vision.compiled import compiled
from vision.markers.perspective import where_on_plane

_REACH = 3  # frames that one camera may lack more than the other; more where their numbers of pictures say so
_FARTHEST = 24  # of that many frames: beyond, the search takes too long
_FEWEST_FRAMES = 10  # from which on a shift can be distinguished from noise
_SWITCH = 30.0  # log-likelihood that a step from one shift to another must win: dropped frames are rare
_CAP = 25.0  # squared sigmas at which one residual stops counting: a bad point is no evidence
_LEAST_SD_PX = 0.15  # calibration and perspective leave this much in a residual, however sharp the centres
# Columns of a residual, and its weight in the mean over the markers: across the epipolar lines, and along them, where
# height that varies is in it.
ACROSS, ALONG = range(2)
_WEIGHTS = (3.0, 1.5)
# A shift from the first frame on is one of whole frames if it leaves this share of what its neighbours leave, and they
# leave so many of the least sd.
_WHOLE, _CLEAR_SDS = 0.25, 4.0
_FIRST_SWITCH = 0.9  # of _SWITCH for a shift from the first frame on: less than a change one frame later
_ROUNDS = 5
_ABOUT = 6  # frames on each side of a change among which the dropped one is looked for


@dataclass(frozen=True)
class DroppedFrames:
    """`camera` shows, from its own frame `from_frame` on, instants `n` frames later than the number says."""

    camera: str
    from_frame: int
    n: int
    gain: float  # log-likelihood won by saying so
    why: str = "from there on its pictures match the other camera's {n} later (epipolar residual)"

    def __str__(self) -> str:
        return (
            f"{self.camera} dropped {self.n} frame{'s' if self.n > 1 else ''} before its frame {self.from_frame}: "
            + self.why.format(n=self.n)
        )


class _View(NamedTuple):
    """Frame numbers (f,) of a camera, where it saw each marker (f, m, 2): undistorted x/z and y/z, and on its plane."""

    frames: np.ndarray
    xy: np.ndarray
    on_plane_m: np.ndarray


@dataclass(frozen=True, eq=False)
class _Evidence:
    """How far the cameras miss each other under every shift between them.

    ``frames`` (f,): the first camera's; ``shifts`` (s,): the second camera's frame f - shift is held against the first
    one's frame f; ``off_px`` (f, m, 2, s): markers across and along the epipolar lines, NaN where one of the two did
    not see them.
    """

    frames: np.ndarray
    shifts: np.ndarray
    off_px: np.ndarray


def find_dropped_frames(
    tracks: pd.DataFrame,
    cameras: Sequence[Camera],
    window_offset_px: Mapping[str, Sequence[int]],
    height_m: Mapping[str, float] | None = None,
) -> list[DroppedFrames]:
    """Frames that one of the two cameras dropped, from how what moves is missed by the other's picture.

    Every shift between the cameras has a likelihood in each frame; the most likely sequence of shifts that changes
    rarely (Viterbi) is taken.  `height_m`: of each marker over the sliding plane; without it only what moves across the
    epipolar lines is evidence.  A shift from the first frame on is reported where it is one of whole frames, a camera
    that started late; a clock that is late by part of a frame is not.
    """
    evidence = _evidence(tracks, cameras, window_offset_px, height_m or {})
    if len(evidence.frames) < _FEWEST_FRAMES:
        return []
    still = int(np.flatnonzero(evidence.shifts == 0)[0])
    cost = _cost(evidence, *_constant_scale(evidence))
    path, gain = _rare_changes(cost, still)
    for _ in range(_ROUNDS):  # what is normal is known once the shifts are
        middle, spread = _scale(_along(evidence.off_px, path))
        cost = _cost(evidence, middle[..., None], spread)
        before = path
        path, gain = _rare_changes(cost, still)
        if np.array_equal(path, before):
            break
    return _drops(evidence, cost, path, still, gain, [camera.name for camera in cameras])


def renumbered(tracks: pd.DataFrame, dropped: Sequence[DroppedFrames]) -> pd.DataFrame:
    """Tracks with the frames after each drop given their true numbers; times are left to the caller."""
    tracks = tracks.copy()
    for camera in {drop.camera for drop in dropped}:
        own = (tracks["camera"] == camera).to_numpy()
        tracks.loc[own, "frame"] = true_numbers(tracks.loc[own, "frame"].to_numpy(), dropped, camera)
    return tracks


def true_numbers(own_numbers: np.ndarray, dropped: Sequence[DroppedFrames], camera: str) -> np.ndarray:
    """Instants (n,) that a camera's own frame numbers (n,) show."""
    numbers = np.asarray(own_numbers)
    return numbers + sum(
        (drop.n * (numbers >= drop.from_frame) for drop in dropped if drop.camera == camera), np.zeros_like(numbers)
    )


def _evidence(
    tracks: pd.DataFrame, cameras: Sequence[Camera], offsets: Mapping[str, Sequence[int]], height_m: Mapping[str, float]
) -> _Evidence:
    marker, names = pd.factorize(tracks["marker"])
    heights = np.array([height_m.get(name, np.nan) for name in names])
    views = [_by_frame(tracks, marker, heights, camera, offsets[camera.name]) for camera in cameras]
    counts = [len(view.frames) for view in views]
    reach = min(max(_REACH, abs(counts[0] - counts[1]) + 1), _FARTHEST)
    shifts = np.arange(-reach, reach + 1)
    frames, others = views[0].frames, views[1].frames
    off = np.full((len(frames), len(heights), 2, len(shifts)), np.nan)
    if not min(counts):
        return _Evidence(frames[:0], shifts, off[:0])
    axis, px_per_m = _baseline(cameras)
    for k, shift in enumerate(shifts):
        at = np.searchsorted(others, frames - shift).clip(max=len(others) - 1)
        paired = others[at] == frames - shift
        partner = at[paired]
        off[paired, :, ACROSS, k] = epipolar_residual_px(cameras, views[0].xy[paired], views[1].xy[partner])
        off[paired, :, ALONG, k] = (views[0].on_plane_m[paired] - views[1].on_plane_m[partner]) @ axis * px_per_m
    comparable = np.isfinite(off[:, :, ACROSS])
    known = comparable.any((1, 2))
    return _Evidence(frames[known], shifts, off[known][:, comparable.any((0, 2))])


def _by_frame(
    tracks: pd.DataFrame, marker: np.ndarray, heights: np.ndarray, camera: Camera, offset_px: Sequence[int]
) -> _View:
    """What a camera saw of each marker; NaN where it did not."""
    own = (tracks["camera"] == camera.name).to_numpy()
    frames, row = np.unique(tracks["frame"].to_numpy()[own], return_inverse=True)
    sensor = tracks.loc[own, ["u_px", "v_px"]].to_numpy(float) + np.asarray(offset_px, float)
    seen, placed = (np.full((len(frames), len(heights), 2), np.nan) for _ in range(2))
    seen[row, marker[own]] = straight = camera.normalise(sensor)
    placed[row, marker[own]] = where_on_plane(camera, straight, heights[marker[own]])[:, :2]
    return _View(frames, seen, placed)


def _baseline(cameras: Sequence[Camera]) -> tuple[np.ndarray, float]:
    """Direction on the plane from one camera to the other, and pixels per metre there."""
    apart = (cameras[1].centre_m - cameras[0].centre_m)[:2]
    focal = float(np.sqrt(cameras[0].matrix[0, 0] * cameras[0].matrix[1, 1]))
    return apart / max(float(np.hypot(*apart)), 1e-9), focal / abs(float(cameras[0].centre_m[2]))


def _median(values: np.ndarray) -> np.ndarray:
    """Median over the first axis, NaN left out and where there is nothing else.  numpy's own takes ten times as
    long.
    """
    ordered = np.sort(values.reshape(len(values), -1).T, axis=1)  # NaN last
    count = np.isfinite(ordered).sum(1)
    row = np.arange(len(ordered))
    middle = 0.5 * (ordered[row, np.maximum(count - 1, 0) // 2] + ordered[row, count // 2])
    return np.asarray(np.where(count > 0, middle, np.nan).reshape(values.shape[1:]))


def _scale(off_px: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What is normal of residuals (f, ...): their median and robust spread."""
    middle = _median(off_px)
    return middle, MEDIAN_TO_SD * _median(np.abs(off_px - middle))


def _constant_scale(evidence: _Evidence) -> tuple[np.ndarray, np.ndarray]:
    """Of each marker: median of its residual under each constant shift (m, 2, s), and the spread (m, 2) under that
    which leaves least.
    """
    middle, spread = _scale(evidence.off_px)
    return middle, np.nanmin(np.where(np.isfinite(spread), spread, np.inf), axis=-1)


def _along(off_px: np.ndarray, path: np.ndarray) -> np.ndarray:
    """(f, m, 2) of (f, m, 2, s): under each frame's own shift."""
    return np.take_along_axis(off_px, path[:, None, None, None], axis=-1)[..., 0]


def _cost(evidence: _Evidence, middle: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """(f, s) half the sum of capped squared normalised residuals; a shift under which nothing can be compared costs
    what the best one does.
    """
    sd = np.maximum(np.where(np.isfinite(spread), spread, np.inf), _LEAST_SD_PX)
    square = np.minimum(((evidence.off_px - middle) / sd[..., None]) ** 2, _CAP)
    seen = np.isfinite(square)
    count = seen.sum(1)
    mean = np.where(seen, square, 0.0).sum(1) / np.maximum(count, 1)  # a body's markers err together: one vote
    known = count > 0
    least = np.where(known, mean, np.inf).min(-1, keepdims=True)
    mean = np.where(known, mean, np.where(np.isfinite(least), np.maximum(least, 1.0), 0.0))
    return np.asarray(sum(0.5 * weight * mean[:, part] for part, weight in enumerate(_WEIGHTS)))


@compiled
def _rare_changes(cost: np.ndarray, first: int) -> tuple[np.ndarray, float]:
    """Cheapest sequence of columns with a price on changing, and one on not beginning with `first`; what it saves
    against staying there.
    """
    n, k = cost.shape
    total, back = cost[0].copy(), np.zeros((n, k), np.int64)
    for column in range(k):
        if column != first:
            total[column] += _FIRST_SWITCH * _SWITCH
    for i in range(1, n):
        change = np.argmin(total)
        switched = total[change] + _SWITCH
        for column in range(k):
            back[i, column] = column if total[column] <= switched else change
            total[column] = min(total[column], switched) + cost[i, column]
    path = np.zeros(n, np.int64)
    path[-1] = np.argmin(total)
    for i in range(n - 1, 0, -1):
        path[i - 1] = back[i, path[i]]
    return path, cost[:, first].sum() - total.min()


def _whole_frames(evidence: _Evidence, path: np.ndarray) -> bool:
    """Whether the first shift leaves next to nothing of what its neighbours leave; a clock that is late by part of a
    frame does not.
    """
    start, k = path == path[0], int(path[0])
    near = [other for other in (k - 1, k, k + 1) if 0 <= other < len(evidence.shifts)]
    off = evidence.off_px[start][..., near]
    square, seen = (off - _median(off)) ** 2, np.isfinite(off)
    left = np.sqrt(np.where(seen, square, 0.0).sum((0, 1)) / np.maximum(seen.sum((0, 1)), 1))
    own, beside = left[:, near.index(k)], np.delete(left, near.index(k), axis=1).min(1)
    return bool(np.any((own < _WHOLE * beside) & (beside > _CLEAR_SDS * _LEAST_SD_PX)))


def _drops(
    evidence: _Evidence, cost: np.ndarray, path: np.ndarray, still: int, gain: float, names: Sequence[str]
) -> list[DroppedFrames]:
    found = []
    if path[0] != still and _whole_frames(evidence, path):
        n = int(evidence.shifts[path[0]])
        found.append(DroppedFrames(names[1] if n > 0 else names[0], 0, abs(n), gain))
    for k in map(int, np.flatnonzero(np.diff(path))):
        change = int(evidence.shifts[path[k + 1]] - evidence.shifts[path[k]])
        found.append(
            DroppedFrames(
                names[1] if change > 0 else names[0],
                _first_after(evidence, cost, k + 1, path, change > 0),
                abs(change),
                gain,
            )
        )
    return found


def _first_after(evidence: _Evidence, cost: np.ndarray, switch: int, path: np.ndarray, second: bool) -> int:
    """Number, in the dropping camera's own count, of its first frame after the drop.

    Around the drop the path is undecided (the dropped instant has no partner); each of the camera's own frames
    matches the other camera better under the shift before or under that after.
    """
    frames = evidence.frames
    row = {int(frame): i for i, frame in enumerate(frames)}
    own = [int(evidence.shifts[path[i]]) if second else 0 for i in (switch - 1, switch)]
    others = np.flatnonzero(np.diff(path)) + 1
    back, ahead = (min((abs(int(k)) // 2 for k in others - switch if k * sign > 0), default=_ABOUT) for sign in (-1, 1))
    here = int(frames[switch]) - own[1]
    about = range(max(here - min(back, _ABOUT), 0), here + min(ahead, _ABOUT) + 1)
    prefers = [
        cost[row[n + own[1]], path[switch]] - cost[row[n + own[0]], path[switch - 1]]
        if n + own[0] in row and n + own[1] in row
        else 0.0
        for n in about
    ]
    after = np.append(np.cumsum(prefers[::-1])[::-1], 0.0)
    return about.start + int(np.argmin(after))
