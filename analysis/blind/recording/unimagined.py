"""What the causes of `causes.unimagined` do to the pictures and to their times."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import host_pose
from analysis.blind.recording.views import View, ViewErrors

TRIGGER_AT_M_PER_S2 = 78.5  # 8 g of the Host, where a trigger on the amplifier's ground is late by `grounded_s`


def grounded_s(time_s: np.ndarray, lines: Floats, errors: ViewErrors) -> np.ndarray:
    """How late the second camera's trigger is (n,) at `time_s` (n,): by the Host's acceleration along the shaker's
    axis, of its `lines` (m, 7)."""
    if errors.grounded_s == 0.0:
        return np.zeros(len(time_s))
    pull = np.array([host_pose(t, lines)[2][0] for t in time_s])
    return errors.grounded_s * pull / TRIGGER_AT_M_PER_S2


def through_lid(pixels: np.ndarray, index: int, view: View, errors: ViewErrors) -> np.ndarray:
    """Pixels (frames, markers, 2) of one camera, those beyond the edge of a pane displaced across that edge."""
    if errors.lid_px == 0.0 or errors.lid_camera != index:
        return pixels
    at = np.array([*errors.lid_m, 0.01])  # as high as the markers
    across = 0.01 * np.array([np.cos(errors.lid_rad), np.sin(errors.lid_rad), 0.0])
    edge, beyond = view.pixels(np.array([at, at + across]))
    normal = (beyond - edge) / np.hypot(*(beyond - edge))
    covered = (pixels - edge) @ normal > 0.0
    return pixels + errors.lid_px * covered[..., None] * normal
