"""What the causes of `causes.unexpected` do to the pictures and to their times."""

import numpy as np

from analysis.blind.recording.views import MARKERS, View, ViewErrors

HOST = [i for i, marker in enumerate(MARKERS) if marker.startswith("H")]
DISK = [i for i, marker in enumerate(MARKERS) if marker.startswith("N")]
SHADE_FROM_M = 0.012  # towards the lamp from the Host's middle, where the wall's shade begins
SHADE_M = 0.02  # from there to where it is full
FLUNG_RAD_PER_S = 40.0  # spin at which a loose sticker stands out half the way


def pulsed_s(time_s: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """How late the second camera is (n,) at `time_s` (n,): its own clock gains `sync_s` from one pulse of the first
    camera to the next, `sync_every_s` later, which sets it back; a pulse comes `sync_late_s` into the run."""
    if errors.sync_s == 0.0:
        return np.zeros(len(time_s))
    passed = (time_s - errors.sync_late_s) / errors.sync_every_s
    return errors.sync_s * (passed - np.floor(passed) - 0.5)


def flung(points_m: np.ndarray, angle_rad: np.ndarray, time_s: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """Points (frames, markers, 3) where one sticker of the disk has come loose and is flung outwards as it spins.

    It stands off by `flung_m` w^2 / (w^2 + `FLUNG_RAD_PER_S`^2), away from the middle one; w is the rate of the disk's
    `angle_rad` (frames,) at `time_s` (frames,).
    """
    if errors.flung_m == 0.0:
        return points_m
    square, out, loose = np.gradient(angle_rad, time_s) ** 2, points_m.copy(), DISK[errors.flung_marker]
    away = points_m[:, loose, :2] - points_m[:, DISK[0], :2]
    away /= np.hypot(*away.T)[:, None]
    out[:, loose, :2] += (errors.flung_m * square / (square + FLUNG_RAD_PER_S**2))[:, None] * away
    return out


def shaded(pixels: np.ndarray, points_m: np.ndarray, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera where a low lamp at `shade_rad` leaves a part of the floor in the
    ring's own shade.

    The disk's markers go dark there from the lamp's side on, and their centres move away from it in both cameras: by
    `shade_px` times how deep in the shade they are, from 0 at `SHADE_FROM_M` of the Host's middle to 1 `SHADE_M`
    farther.  `points_m` (frames, markers, 3) tells that; the Host's middle is the mean of its markers.
    """
    if errors.shade_px == 0.0:
        return pixels
    lamp = np.array([np.cos(errors.shade_rad), np.sin(errors.shade_rad)])
    near = (points_m[:, DISK, :2] - points_m[:, HOST, :2].mean(axis=1, keepdims=True)) @ lamp
    deep = np.clip((near - SHADE_FROM_M) / SHADE_M, 0.0, 1.0)
    middle, beside = view.pixels(np.array([[0.0, 0.0, 0.01], [*(-0.01 * lamp), 0.01]]))
    out = pixels.copy()
    out[:, DISK] += errors.shade_px * deep[..., None] * (beside - middle) / np.hypot(*(beside - middle))
    return out
