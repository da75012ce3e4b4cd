"""What turning during the exposure does to a marker's centre.

A marker at distance rho from the turning point runs along an arc of half angle beta = spin * exposure / 2 while the
shutter is open; the centre of its smeared picture is the mean over the arc, nearer to the turning point by
rho (1 - sin(beta) / beta), about rho beta^2 / 6: 40 um at 6 mm, 500 rad/s and 0.8 ms.  Travel along a straight line
leaves the mean where the middle of the exposure is.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vision.identity.matching import wrapped

Array = NDArray[np.float64]

_FARTHEST = 2  # frames between two angles that give a spin
_LARGEST_HALF_ANGLE = 1.0  # rad; beyond, a smear is no disc


def spins(frames: NDArray[np.int64], angle_rad: Array, times_s: Array) -> Array:
    """Spin [rad/s] at each frame of one body, (F,): from the neighbours before and after; 0 where there are none.

    An angle whose neighbour is farther off says nothing: the body was not seen between.  Whole turns do
    not count.
    """
    spin = np.zeros(len(frames))
    if len(frames) < 2:
        return spin
    near = np.diff(frames) <= _FARTHEST
    step = np.where(near, wrapped(np.diff(angle_rad)) / np.diff(times_s), np.nan)
    before, after = np.append(np.nan, step), np.append(step, np.nan)
    seen = np.isfinite(before).astype(int) + np.isfinite(after)
    return np.where(seen > 0, (np.nan_to_num(before) + np.nan_to_num(after)) / np.maximum(seen, 1), 0.0)


def arc_shift(offset_m: Array, spin_rad_per_s: Array, exposure_s: float) -> Array:
    """What must be added to marker places (n, 2) that lie `offset_m` (n, 2) from the turning point of their smear."""
    beta = np.minimum(0.5 * np.abs(spin_rad_per_s) * exposure_s, _LARGEST_HALF_ANGLE)
    return offset_m * (1.0 / np.sinc(beta / np.pi) - 1.0)[:, None]
