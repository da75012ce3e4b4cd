"""How much the Host gives as the disk hits it: the disk's mass over the Host's, and over its moment of inertia.

At an impact the Host's velocity steps by that share of the disk's step, the other way, whatever carries it: a drive,
springs, or nothing at all.  Its path has a corner there.  The frames near by tell the corner from any smooth motion, so
that nothing need be known of the springs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from analysis.flights.cutting.run_data import RunData
from analysis.motion.host_path import HostMotion
from analysis.motion.smooth_path import smooth_path

Array = NDArray[np.float64]
# A corner is looked for in so many frames to either side, beside a polynomial of this degree; fewer frames than this on
# a side tell nothing.
REACH, DEGREE, FEWEST_FRAMES = 8, 3, 4
# So many impacts say how well a share is known, and it counts from so many sds on, where every other impact by itself
# says half of it at the least.
FEWEST_IMPACTS, SURE_SD, LEAST_OF_HALF = 20, 5.0, 0.5
# An impact with a frame farther off (robust sds) tells nothing.
GROSS_SD = 5.0


class Gives(NamedTuple):
    """How the Host answers an impulse: ``share``, the disk's mass over the Host's, and ``turn_per_m2``, the disk's mass
    over the Host's moment of inertia (1/m^2); 0 where it does not surely give."""

    share: float = 0.0
    turn_per_m2: float = 0.0

    def along(self, arm_m: Array) -> Array:
        """Speed of the wall, over that of the disk's centre, by an impulse along it at an ``arm_m`` (K,) from the
        Host's centre."""
        return np.asarray(self.share + self.turn_per_m2 * arm_m**2, float)


#: a Host of which no blow is seen
TOO_HEAVY = Gives()


def host_gives(runs: Sequence[RunData], moments: Sequence[Array], steps: Sequence[Array]) -> Gives:
    """How the Host gives, by the corners of its path.

    ``moments`` (K,; s) of each run's impacts, ``steps`` (K, 3): of the disk's velocity in the room there (m/s), and its
    moment about the Host's centre (m^2/s)."""
    each = [
        [corner for run, at, step in zip(runs, moments, steps, strict=True) for corner in _corners(run, at, step, axes)]
        for axes in ((0, 1), (3,))
    ]
    return Gives(*map(_sure_share, each))


def _sure_share(corners: Sequence[tuple[float, float]]) -> float:
    """The share by all corners, 0 where it is not surely more."""
    if len(corners) < FEWEST_IMPACTS:
        return 0.0
    products, squares = np.array(corners).T
    share = float(products.sum() / squares.sum())
    # By the impacts' own scatter: noise that goes on from frame to frame is in it.
    sd = float(np.sqrt(np.sum((products - share * squares) ** 2)) / squares.sum())
    halves = [float(products[k::2].sum() / squares[k::2].sum()) for k in range(2)]
    return share if share > SURE_SD * sd and min(halves) > LEAST_OF_HALF * share else 0.0


def _corners(run: RunData, moments: Array, steps: Array, axes: Sequence[int]) -> list[tuple[float, float]]:
    """Products of what the Host's path along some of its ``axes`` shows at each impact with what a Host as heavy as the
    disk would (or one of 1 m^2 of inertia over it), and the squares of that."""
    host, time_s = run.host, run.time_s
    if len(host.residual) != len(time_s):
        return []
    place, steps = _beside_lines(host, time_s, axes), steps[:, :2] if len(axes) > 1 else steps[:, 2:]
    gross = GROSS_SD * np.maximum(host.residual_sd[list(axes)], 1e-300)
    bounds = np.concatenate([[-np.inf], moments, [np.inf]])
    out = []
    for k, (moment, step) in enumerate(zip(moments, steps, strict=True)):
        near = np.abs(time_s - moment) < REACH * run.period_s
        near &= (time_s > bounds[k]) & (time_s < bounds[k + 2]) & np.isfinite(place).all(1)
        after = time_s[near] > moment
        if min(np.count_nonzero(after), np.count_nonzero(~after)) < FEWEST_FRAMES:
            continue
        time = (time_s[near] - moment) / run.period_s
        smooth, _ = np.linalg.qr(np.vander(time, DEGREE + 1))
        ramp = np.maximum(time, 0.0) * run.period_s
        ramp -= smooth @ (smooth.T @ ramp)
        here = place[near] - smooth @ (smooth.T @ place[near])
        shown = ramp @ here / (ramp @ ramp)
        if np.any(np.abs(here - np.outer(ramp, shown)) > gross):
            continue
        out.append((-float(ramp @ here @ step), float(ramp @ ramp) * float(step @ step)))
    return out


def _beside_lines(host: HostMotion, time_s: Array, axes: Sequence[int]) -> Array:
    """Measured places (N, A) of the Host along ``axes`` without the lines of its drive, which have no corners."""
    place = host.residual[:, list(axes)].copy()
    for column, axis in enumerate(axes):
        smooth = host.smooth[axis]
        if smooth is not None:
            place[:, column] += smooth.at(time_s - host.zero_s)
    return place


def at_corners(run: RunData, moments: Array, steps: Array, gives: Gives) -> tuple[Array, Array, Array]:
    """Pose, rate and second rate (K, 4) of a Host that ``gives``, at the impacts of a run as :func:`host_gives` has
    them; the rate in the middle of its step.

    A smooth path cuts corners, so it is laid through the places without them, and they are put on it."""
    host, axes = run.host, [0, 1, 3]
    own = -np.column_stack([gives.share * steps[:, :2], gives.turn_per_m2 * steps[:, 2]])
    smooth = list(host.smooth)
    places = _beside_lines(host, run.time_s, axes) - _ramps(run.time_s, moments) @ own
    for column, axis in enumerate(axes):
        path = smooth[axis]
        if path is None:
            own[:, column] = 0.0
        elif own[:, column].any():
            smooth[axis] = smooth_path(run.time_s - host.zero_s, places[:, column], path.correlation)
    without = replace(host, smooth=tuple(smooth))
    pose, rate, second_rate = (without.at(moments, order) for order in range(3))
    pose[:, axes] += _ramps(moments, moments) @ own
    rate[:, axes] += np.heaviside(moments[:, None] - moments, 0.5) @ own
    return pose, rate, second_rate


def _ramps(time_s: Array, moments: Array) -> Array:
    """Times since each of the moments (N, K; s), 0 before."""
    return np.maximum(time_s[:, None] - moments, 0.0)
