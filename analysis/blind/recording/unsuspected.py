"""What the causes of `causes.unsuspected` do to the pictures."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import host_pose
from analysis.blind.recording.views import MARKERS, View, ViewErrors

TWIST_AT_M_PER_S2 = 78.5  # 8 g of the Host, where the first camera is turned by `twisted_rad`
DISK = [i for i, marker in enumerate(MARKERS) if marker.startswith("N")]


def twist_rad(time_s: np.ndarray, lines: Floats, errors: ViewErrors) -> np.ndarray:
    """How far the first camera is turned about its axis (n,) at `time_s` (n,).

    It hangs on the shaker's own frame, which takes the drive's reaction: by the Host's acceleration along the
    shaker's axis, of its `lines` (m, 7).
    """
    if errors.twisted_rad == 0.0:
        return np.zeros(len(time_s))
    pull = np.array([host_pose(t, lines)[2][0] for t in time_s])
    return errors.twisted_rad * pull / TWIST_AT_M_PER_S2


def twisted(pixels: np.ndarray, turn_rad: np.ndarray, view: View) -> np.ndarray:
    """Pixels (frames, markers, 2) of a camera turned about its axis by `turn_rad` (frames,)."""
    c, s = np.cos(turn_rad)[:, None], np.sin(turn_rad)[:, None]
    u, v = np.moveaxis(pixels - view.centre_px, -1, 0)
    return np.stack([c * u - s * v, s * u + c * v], axis=-1) + view.centre_px


def trailed(pixels: np.ndarray, frame_rate_hz: float, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) in which the disk's markers, bright on bare steel, draw tails: they are found where
    they were `comet_s` before, along their own way in the picture."""
    if errors.comet_s == 0.0:
        return pixels
    out = pixels.copy()
    out[:, DISK] -= np.gradient(pixels[:, DISK], axis=0) * frame_rate_hz * errors.comet_s
    return out


def glinted(pixels: np.ndarray, points_m: np.ndarray, index: int, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera in which the disk's stickers glint.

    They are of foil and stand up at one edge: as the disk turns, that edge lights up towards the lamp and goes dark
    again, and their centres move to and fro towards it by `glint_px` times the cosine of the disk's angle from
    `glint_rad`.  `points_m` (frames, markers, 3) tells the angle: of the line from N2 to N4.
    """
    if errors.glint_px == 0.0 or errors.glint_camera != index:
        return pixels
    x, y = (points_m[:, DISK[3], i] - points_m[:, DISK[1], i] for i in (0, 1))
    lit = errors.glint_px * np.cos(np.arctan2(y, x) - errors.glint_rad)
    out = pixels.copy()
    out[:, DISK] += lit[:, None, None] * np.array([np.cos(errors.lamp_rad), np.sin(errors.lamp_rad)])
    return out
