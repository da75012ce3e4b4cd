"""What the causes of `causes.plausible` do to the pictures and to their times."""

import numpy as np

from analysis.blind.plant.accelerations import host_pose
from analysis.blind.plant.compiled import Floats
from analysis.blind.recording.views import MARKERS, ViewErrors

TRIPOD_AT_M_PER_S2 = 78.5  # 8 g of the Host, where the first camera's picture moves by `tripod_px`
RING_M = 0.05  # radius of the ring, whose wall throws a shadow
SHADOW_M = 0.01  # from the wall, within which it reaches
DISK = [i for i, marker in enumerate(MARKERS) if marker.startswith("N")]


def tripod_px(time_s: Floats, lines: Floats, errors: ViewErrors) -> Floats:
    """How far the first camera's picture is moved (n, 2) at `time_s` (n,): the shaker shakes the room's floor, and with
    it a tripod.

    By `tripod_px` along `tripod_rad` in the picture, times the Host's acceleration along the shaker's axis (of its
    `lines` (m, 7)), `tripod_s` before, over `TRIPOD_AT_M_PER_S2`: under a sine an oscillation of the drive's frequency.
    """
    pull = np.array([host_pose(t - errors.tripod_s, lines)[2][0] for t in time_s]) / TRIPOD_AT_M_PER_S2
    along = np.array([np.cos(errors.tripod_rad), np.sin(errors.tripod_rad)])
    return errors.tripod_px * pull[:, None] * along


def dropped_s(frames: int, run: int, rate_hz: float, errors: ViewErrors) -> Floats:
    """How much later than its number says each of the second camera's frames (`frames`,) was taken in `run`: one frame
    later from where one was lost, `dropped_from` [run] of the run; there is none where that is 1."""
    if not errors.dropped_from:
        return np.zeros(frames)
    return np.where(np.arange(frames) >= errors.dropped_from[run] * frames, 1.0 / rate_hz, 0.0)


def shadowed(points_m: Floats, host: Floats, errors: ViewErrors) -> Floats:
    """Points (n, 12, 3) where the disk's markers are found: near the wall a part of each lies in its shadow, and its
    middle is found too far inwards.

    Towards the Host's centre (x, y of `host` (n, 4)) by `shadow_m` (1 - gap / `SHADOW_M`), gap its way to the wall.
    """
    if errors.shadow_m == 0.0:
        return points_m
    out = points_m.copy()
    away = points_m[:, DISK, :2] - host[:, None, :2]
    radius = np.maximum(np.hypot(away[..., 0], away[..., 1]), 1e-9)
    hidden = np.clip(1.0 - (RING_M - radius) / SHADOW_M, 0.0, 1.0)
    out[:, DISK, :2] -= errors.shadow_m * (hidden / radius)[..., None] * away
    return out
