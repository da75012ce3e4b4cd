"""What the causes of `causes.unforeseen` do to the pictures."""

import numpy as np

from analysis.blind.recording.views import View, ViewErrors

SHAKE_DECAY_S = 0.04  # of a tripod on the bench: gone before the next impact but one
GLARE_M = 0.008  # from a lamp's reflection to where it displaces markers most


def shake_px(time_s: np.ndarray, impact_s: np.ndarray, kicks: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """How far the first camera's picture is off along u (n,) at `time_s` (n,): it swings after each impact, by the
    disk's change of velocity along x, `kicks` (k, 2) at `impact_s` (k,)."""
    off = np.zeros(len(time_s))
    if errors.shaken_px == 0.0:
        return off
    for instant, kick in zip(impact_s, kicks[:, 0], strict=True):
        late = np.maximum(time_s - instant, 0.0)
        off += kick * np.exp(-late / SHAKE_DECAY_S) * np.sin(2.0 * np.pi * errors.shaken_hz * late)
    return errors.shaken_px * off


def glared(pixels: np.ndarray, index: int, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera, those near a lamp's reflection drawn towards it, by `glare_px` at most
    (`GLARE_M` from it)."""
    if errors.glare_px == 0.0 or errors.glare_camera != index:
        return pixels
    at = np.array([*errors.glare_m, 0.01])  # as high as the markers
    spot, beside = view.pixels(np.array([at, at + [GLARE_M, 0.0, 0.0]]))
    away = (pixels - spot) / np.hypot(*(beside - spot))
    pull = np.exp(0.5 - 0.5 * np.sum(away**2, axis=-1, keepdims=True))
    return pixels - errors.glare_px * pull * away
