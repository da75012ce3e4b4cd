"""Frames and instants: times of the frames, and frames that one camera dropped.

A dropped frame leaves no hole in a folder of pictures; every later picture of that camera simply belongs to a later
instant.  The epipolar residual tells: two pictures of different instants do not meet in space where things move.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike

from ovines.camera import Camera, epipolar_residual_px
from ovines.recording import Recording, read_trigger

_SHIFTS = (-2, -1, 0, 1, 2)
_SWITCH = 30.0  # log-likelihood that a step from one shift to another must win: dropped frames are rare
_CAP = 25.0  # squared sigmas at which one residual stops counting: a bad point is no evidence
_LEAST_SD_PX = 0.15  # calibration and perspective leave this much in a residual, however sharp the centres


@dataclass(frozen=True)
class DroppedFrames:
    """`camera` shows, from its own frame `from_frame` on, instants `n` frames later than the number says."""

    camera: str
    from_frame: int
    n: int
    gain: float  # log-likelihood won by saying so

    def __str__(self) -> str:
        return (f"{self.camera} dropped {self.n} frame{'s' if self.n > 1 else ''} before its frame {self.from_frame}: "
                f"from there on its pictures meet the other camera's {self.n} later (epipolar residual)")


def frame_times(recording: Recording, frames: ArrayLike) -> tuple[np.ndarray, list[str]]:
    """Times [s] of frame numbers (n,) and notes; a missing trigger is interpolated between its neighbours.

    Trigger pulses that the card missed leave the frames there: their times follow from the pulses about them
    (or, beyond the last one, from the median period).
    """
    frames = np.asarray(frames)
    trigger = recording.settings.time.trigger
    if not trigger:
        return recording.times_s(frames), []
    numbers, times_s = read_trigger(recording.path(trigger))
    absent = ~np.isin(frames, numbers)
    times = np.interp(frames, numbers, times_s)
    if len(numbers) > 1:
        period = float(np.median(np.diff(times_s) / np.diff(numbers)))
        times = np.where(frames < numbers[0], times_s[0] + (frames - numbers[0]) * period, times)
        times = np.where(frames > numbers[-1], times_s[-1] + (frames - numbers[-1]) * period, times)
    elif absent.any():
        return recording.times_s(frames), []
    if not absent.any():
        return times, []
    first = ", ".join(str(n) for n in frames[absent][:5])
    more = ", ..." if absent.sum() > 5 else ""
    note = (f"{trigger} has no time for {int(absent.sum())} frames ({first}{more}); interpolated between the "
            "pulses about them")
    return times, [note]


def find_dropped_frames(tracks: pd.DataFrame, cameras: Sequence[Camera],
                        window_offset_px: Mapping[str, Sequence[int]]) -> list[DroppedFrames]:
    """Frames that one of the two cameras dropped, from the epipolar residuals of what moves.

    For every shift of -2..2 frames between the cameras each frame has a likelihood; the most likely sequence of shifts
    that changes rarely (Viterbi) is taken.  A shift from the beginning on is no dropped frame and not told.
    """
    cost, frames = _shift_costs(tracks, cameras, window_offset_px)
    if len(frames) < 10:
        return []
    path, gain = _rare_changes(cost)
    found = []
    for k in map(int, np.flatnonzero(np.diff(path))):
        change = _SHIFTS[path[k + 1]] - _SHIFTS[path[k]]
        camera = cameras[1] if change > 0 else cameras[0]
        found.append(DroppedFrames(camera.name, _first_after(cost, frames, k + 1, path, change > 0), abs(change), gain))
    return found


def renumbered(tracks: pd.DataFrame, dropped: Sequence[DroppedFrames]) -> pd.DataFrame:
    """Tracks with the frames after each drop given their true numbers; times are left to the caller."""
    tracks = tracks.copy()
    own_number = tracks["frame"].to_numpy(copy=True)
    for drop in dropped:
        after = (tracks["camera"] == drop.camera).to_numpy() & (own_number >= drop.from_frame)
        tracks.loc[after, "frame"] += drop.n
    return tracks


def _shift_costs(tracks: pd.DataFrame, cameras: Sequence[Camera], offsets: Mapping[str, Sequence[int]]
                 ) -> tuple[np.ndarray, np.ndarray]:
    """(frames, shifts) half the sum of capped squared normalised residuals; frames without evidence are left out."""
    marker = pd.factorize(tracks["marker"])[0]
    (frames, first), (others, second) = (_rays_by_frame(tracks, marker, camera, offsets[camera.name]) for camera in cameras)
    if not len(frames) or not len(others):
        return np.empty((0, len(_SHIFTS))), np.empty(0, int)
    residual = np.full((*first.shape[:2], len(_SHIFTS)), np.nan)
    for k, shift in enumerate(_SHIFTS):  # the second camera's frame f - shift is held against the first one's frame f
        at = np.searchsorted(others, frames - shift).clip(max=len(others) - 1)
        meets = others[at] == frames - shift
        residual[meets, :, k] = epipolar_residual_px(cameras, first[meets], second[at[meets]])
    complete = np.all(np.isfinite(residual), axis=-1)
    markers, told = np.any(complete, axis=0), np.any(complete, axis=1)
    if not told.any():
        return np.empty((0, len(_SHIFTS))), np.empty(0, int)
    residual[~complete] = np.nan
    off = residual[told][:, markers]
    off -= np.nanmedian(off[..., _SHIFTS.index(0)], axis=0)[:, None]
    spread = 1.4826 * np.nanmedian(np.abs(off).min(-1), axis=0)
    off /= np.maximum(spread, _LEAST_SD_PX)[:, None]
    cost = np.nanmean(0.5 * np.minimum(off**2, _CAP), axis=1)  # the mean: a body's markers err together, one vote
    return 3.0 * cost, frames[told]


def _rays_by_frame(tracks: pd.DataFrame, marker: np.ndarray, camera: Camera, offset_px: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Frame numbers (f,) of a camera and where it saw each marker (f, markers, 2), undistorted; NaN where it did not."""
    own = (tracks["camera"] == camera.name).to_numpy()
    frames, row = np.unique(tracks["frame"].to_numpy()[own], return_inverse=True)
    seen = np.full((len(frames), marker.max(initial=-1) + 1, 2), np.nan)
    seen[row, marker[own]] = camera.normalise(tracks.loc[own, ["u_px", "v_px"]].to_numpy(float) + np.asarray(offset_px, float))
    return frames, seen


def _first_after(cost: np.ndarray, frames: np.ndarray, switch: int, path: np.ndarray, second: bool) -> int:
    """Number, in the dropping camera's own count, of its first frame after the drop.

    Around the drop the path is undecided (the dropped instant has no partner); each of the camera's own frames
    is asked whether it meets the other camera better before or after.
    """
    row = {int(frame): i for i, frame in enumerate(frames)}
    own = [_SHIFTS[path[i]] if second else 0 for i in (switch - 1, switch)]
    about = range(int(frames[switch]) - own[1] - 6, int(frames[switch]) - own[1] + 7)
    prefers = [cost[row[n + own[1]], path[switch]] - cost[row[n + own[0]], path[switch - 1]]
               if n + own[0] in row and n + own[1] in row else 0.0 for n in about]
    after = np.append(np.cumsum(prefers[::-1])[::-1], 0.0)
    return about.start + int(np.argmin(after))


def _rare_changes(cost: np.ndarray) -> tuple[np.ndarray, float]:
    """Cheapest sequence of columns with a price on changing; and what it saves against never changing."""
    n, k = cost.shape
    total, back = cost[0].copy(), np.zeros((n, k), int)
    for i in range(1, n):
        change = int(np.argmin(total))
        stay = total <= total[change] + _SWITCH
        back[i] = np.where(stay, np.arange(k), change)
        total = np.where(stay, total, total[change] + _SWITCH) + cost[i]
    path = np.zeros(n, int)
    path[-1] = int(np.argmin(total))
    for i in range(n - 1, 0, -1):
        path[i - 1] = back[i, path[i]]
    return path, float(cost.sum(0).min() - total.min())
