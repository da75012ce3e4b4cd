"""What the causes of `causes.undreamt` do to the pictures and to their times."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import host_pose
from analysis.blind.recording.views import ViewErrors

TAB_AT_M_PER_S2 = 78.5  # 8 g of the Host, where a marker's tab is bent by `tab_m`


def free_running_s(time_s: np.ndarray, errors: ViewErrors) -> np.ndarray:
    """How late the second camera is (n,) at `time_s` (n,), by a clock that agrees in the middle of the run."""
    if errors.free_running == 0.0:
        return np.zeros(len(time_s))
    return errors.free_running * (time_s - 0.5 * (time_s[0] + time_s[-1]))


def bent_m(time_s: np.ndarray, lines: Floats, errors: ViewErrors) -> np.ndarray:
    """How far the Host's marker on a tab stays back (n, 2) at `time_s` (n,), by the acceleration of its `lines`
    (m, 7)."""
    if errors.tab_m == 0.0:
        return np.zeros((len(time_s), 2))
    pull = np.array([host_pose(t, lines)[2][:2] for t in time_s])
    return -errors.tab_m * pull / TAB_AT_M_PER_S2


def risen_m(host_x_m: np.ndarray, arc_per_m: float) -> np.ndarray:
    """How far a Host on leaf springs has risen (n,) where it stands off its middle along x."""
    return 0.5 * arc_per_m * host_x_m**2
