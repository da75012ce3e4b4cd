"""Where the sliding plane is, by the bodies that move in it: ``layout_m`` has their markers' heights over it.

Slopes come from markers seen in the same frame: a Host that is lifted while it moves would else look like a tilt.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.recording import Recording
from ovines.recording_schema import PLACEMENT_SD_M
from ovines.robust import residual_sd

Array = NDArray[np.float64]
BLOCKS = 20  # of time, each left out once: what neighbouring frames share is no noise of single points
FEWEST_FRAMES = 2 * BLOCKS
SLOPES = 2  # unknowns before the markers' own: along x and along y


@dataclass(frozen=True)
class SlidingPlane:
    """``z = height_m + slope_x x + slope_y y`` of the plane in the world, with standard deviations, by ``bodies``."""

    bodies: tuple[str, ...]
    height_m: float
    slope_x: float
    slope_y: float
    sd: tuple[float, float, float]


def sliding_plane(points: pd.DataFrame, recording: Recording) -> SlidingPlane | None:
    """The plane of Host and NES from table ``points``; None where no body with a layout is seen long enough.

    Every marker may be off its layout by ``layout_sd_m``; that, and not the points' noise, usually sets the sd.
    """
    heights: dict[str, float] = {}
    off_m: dict[str, float] = {}
    bodies = []
    for name in ("host", "nes"):
        body = recording.bodies.get(name)
        if body is None or body.layout_m is None or not points["marker"].isin(body.markers).any():
            continue
        bodies.append(name)
        heights |= {marker: place[2] for marker, place in zip(body.markers, body.layout_m, strict=True)}
        off_m |= dict.fromkeys(body.markers, body.layout_sd_m or PLACEMENT_SD_M)
    own = points[points["marker"].isin(list(heights)) & points["z_m"].notna()]
    if own["frame"].nunique() < FEWEST_FRAMES:
        return None
    markers = sorted(own["marker"].unique())
    number = own["marker"].map({marker: i for i, marker in enumerate(markers)}).to_numpy(int)
    unknowns = np.zeros((len(own), SLOPES + len(markers)))
    unknowns[:, :SLOPES] = own[["x_m", "y_m"]].to_numpy(float)
    unknowns[np.arange(len(own)), SLOPES + number] = 1.0
    above_m = own["z_m"].to_numpy(float) - own["marker"].map(heights).to_numpy(float)
    frame = np.unique(own["frame"], return_inverse=True)[1]
    block = frame * BLOCKS // (frame.max() + 1)
    inside = _without_frame_means(np.column_stack([unknowns, above_m]), frame)
    slopes, level = inside[:, :-1], inside[:, -1]
    prior = np.diag(np.concatenate([np.zeros(SLOPES), [off_m[marker] ** -2 for marker in markers]]))
    noise_m = max(float(residual_sd(level)), 1e-9)
    sums = [(slopes[at].T @ slopes[at], slopes[at].T @ level[at]) for at in (block == k for k in range(BLOCKS))]
    means = np.array([np.append(unknowns[block == k].mean(0), above_m[block == k].mean()) for k in range(BLOCKS)])

    def plane(left_out: int | None) -> tuple[Array, Array, Array]:
        stay = [k for k in range(BLOCKS) if k != left_out]
        normal = sum(sums[k][0] for k in stay) / noise_m**2 + prior
        found = np.linalg.solve(normal, sum(sums[k][1] for k in stay) / noise_m**2)
        mean = means[stay].mean(0)
        return np.append(mean[-1] - mean[:-1] @ found, found[:SLOPES]), normal, mean[:-1]

    found, normal, mean = plane(None)
    without = np.array([plane(k)[0] for k in range(BLOCKS)])
    scatter = (BLOCKS - 1) / BLOCKS * np.sum((without - without.mean(0)) ** 2, 0)
    covariance = np.linalg.inv(normal)
    placed = np.append(mean @ covariance @ mean, np.diag(covariance)[:SLOPES])
    sd = np.sqrt(scatter + placed)
    height_m, slope_x, slope_y = map(float, found)
    return SlidingPlane(tuple(bodies), height_m, slope_x, slope_y, (float(sd[0]), float(sd[1]), float(sd[2])))


def _without_frame_means(values: Array, frame: NDArray[np.int64]) -> Array:
    """Rows less the mean of all rows of their frame."""
    count = np.bincount(frame)
    means = np.stack([np.bincount(frame, weights=column) / count for column in values.T], -1)
    return np.asarray(values - means[frame])
