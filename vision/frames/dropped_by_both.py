"""Frames that both cameras dropped at once: no picture misses another, but the Host's path jumps.

The Host moves smoothly.  Where its path jumps by what it travels in a whole frame or more, and goes on as before,
instants are missing of which the times know nothing (a trigger that paused shows in its own times and leaves no jump).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from vision.frames.dropped import DroppedFrames, true_numbers
from vision.markers.perspective import on_plane

Array = NDArray[np.float64]

MOST = 8  # frames
_SIDE = 5  # frames on each side of a place through which one cubic must run
# Times the usual sum of squares: from there on it is a jump, and at most so much may stay once the gap is known.
_JUMP, _HEALED = 40.0, 5.0
_CUBIC = 4  # coefficients
_EVEN = 1e-9  # of a run's length, by which its frames may differ from being evenly spaced
_REASON = "so did the other camera: the Host's path jumps there by what it travels in that time"


def find_common_gaps(
    tracks: pd.DataFrame,
    cameras: Sequence[Camera],
    window_offset_px: Mapping[str, Sequence[int]],
    height_m: Mapping[str, float],
    markers: Sequence[str],
) -> dict[str, list[tuple[int, int]]]:
    """Per camera: (frame before which instants are missing, how many), ascending; as many in both, at most _SIDE frames
    apart.

    Parameters
    ----------
    tracks : with times, and frame numbers that are equal for equal instants
    height_m : of each marker over the sliding plane
    markers : those of a body that moves smoothly: the Host's
    """
    jumps = [
        _jumps(tracks[tracks["camera"] == camera.name], camera, window_offset_px[camera.name], height_m, markers)
        for camera in cameras
    ]
    both: dict[str, list[tuple[int, int]]] = {camera.name: [] for camera in cameras}
    for frame, n in jumps[0]:
        partner = next(((other, k) for other, k in jumps[1] if k == n and abs(other - frame) <= _SIDE), None)
        if partner is not None:
            jumps[1].remove(partner)
            for camera, gap in zip(cameras, ((frame, n), partner), strict=True):
                both[camera.name].append(gap)
    return both


def as_dropped(
    gaps: Mapping[str, Sequence[tuple[int, int]]], dropped: Sequence[DroppedFrames], tracks: pd.DataFrame
) -> list[DroppedFrames]:
    """The gaps as frames that each camera dropped, in its own numbers, those of `tracks`; the gaps are counted as they
    are after `dropped`.
    """
    found = []
    for camera, own in gaps.items():
        numbers = np.unique(tracks.loc[tracks["camera"] == camera, "frame"].to_numpy())
        after = [numbers[np.searchsorted(true_numbers(numbers, dropped, camera), frame)] for frame, _ in own]
        found += [DroppedFrames(camera, int(frame), n, 0.0, _REASON) for frame, (_, n) in zip(after, own, strict=True)]
    return found


def _jumps(
    tracks: pd.DataFrame,
    camera: Camera,
    offset_px: Sequence[int],
    height_m: Mapping[str, float],
    markers: Sequence[str],
) -> list[tuple[int, int]]:
    windows, times_s, first_after = _windows(tracks, camera, offset_px, height_m, markers)
    if not len(windows):
        return []
    plain = _left(windows, times_s, 0.0)
    usual = float(np.median(plain))
    period = float(np.median(np.diff(times_s, axis=1)))
    jumping = np.flatnonzero(plain > _JUMP * usual)
    left = np.stack([_left(windows[jumping], times_s[jumping], k * period) for k in range(1, MOST + 1)], -1)
    found: list[tuple[int, int]] = []
    for i in np.argsort(left.min(-1, initial=np.inf)):
        frame = int(first_after[jumping[i]])
        if left[i].min() < _HEALED * usual and all(abs(frame - other) > _SIDE for other, _ in found):
            found.append((frame, int(np.argmin(left[i])) + 1))
    return sorted(found)


def _windows(
    tracks: pd.DataFrame,
    camera: Camera,
    offset_px: Sequence[int],
    height_m: Mapping[str, float],
    markers: Sequence[str],
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Runs of 2 _SIDE frames without a hole: places (w, frames, series) of the markers on their planes, NaN where
    unseen; times; middle frame.
    """
    own = tracks[tracks["marker"].isin(list(markers))]
    frames = np.unique(own["frame"].to_numpy(np.int64))
    if len(frames) < 2 * _SIDE:
        return np.empty((0, 2 * _SIDE, 0)), np.empty((0, 2 * _SIDE)), np.empty(0, np.int64)
    place = np.full((len(frames), len(markers), 2), np.nan)
    times_s = np.empty(len(frames))
    row = np.searchsorted(frames, own["frame"].to_numpy(np.int64))
    column = own["marker"].map({marker: i for i, marker in enumerate(markers)}).to_numpy(int)
    heights = np.array([height_m[marker] for marker in markers])[column]
    place[row, column] = on_plane(
        camera, own[["u_px", "v_px"]].to_numpy(float) + np.asarray(offset_px, float), heights
    )[:, :2]
    times_s[row] = own["time_s"].to_numpy(float)
    view = np.lib.stride_tricks.sliding_window_view
    whole = np.flatnonzero(frames[2 * _SIDE - 1 :] - frames[: len(frames) - 2 * _SIDE + 1] == 2 * _SIDE - 1)
    series = view(place.reshape(len(frames), -1), 2 * _SIDE, axis=0)[whole].transpose(0, 2, 1)
    return series, view(times_s, 2 * _SIDE)[whole], frames[whole + _SIDE]


def _left(windows: Array, times_s: Array, gap_s: float) -> Array:
    """Mean square (w,) that cubics leave of the series which are complete, when the second half is later by `gap_s`."""
    late = times_s + gap_s * (np.arange(2 * _SIDE) >= _SIDE)
    t = (late - late.mean(1, keepdims=True)) / np.ptp(late, axis=1)[:, None]
    if len(t) and np.all(np.ptp(t, axis=0) < _EVEN):
        t = t[:1]  # frames evenly spaced: one basis serves all
    basis = np.linalg.qr(t[..., None] ** np.arange(_CUBIC))[0]
    complete: NDArray[np.bool_] = np.all(np.isfinite(windows), axis=1)
    series = np.where(complete[:, None], windows, 0.0)
    series = series - series.mean(1, keepdims=True)
    misfit = series - basis @ (basis.transpose(0, 2, 1) @ series)
    return np.sum(misfit**2, axis=(1, 2)) / np.maximum(complete.sum(1), 1)
