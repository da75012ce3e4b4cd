"""How far a body's markers are from where its pose puts them, and what a median or a mean of that is worth."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from analysis.gap.series import Series
from analysis.motion.bodies import bodies_clouds
from analysis.statistics.correlation import slow_mean
from analysis.statistics.robust import MEDIAN_SD
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Markers stay where they are within this share of the contact radius (0.05 mm of 40 mm); one that moves by more has
# come loose.
LOOSE_SHARE = 1.25e-3
SURE_SD = 6.0
# Two views of a marker share a delay of one of them by where it stands: this share of it may differ between markers.
SHARE_OF_CLOCK = 0.2
FEWEST_FRAMES = 40
# An sd of nil (a marker that the fit of three passes through) is no infinite weight.
FINEST_M = 1e-12


def loose_m(series: Series) -> float:
    """How far a marker moves at the least that has come loose (m)."""
    return LOOSE_SHARE * series.contact_radius_m


@lru_cache(maxsize=2)
def marker_residuals(series: Series, body: str) -> tuple[tuple[int, Array, Array], ...]:
    """Per run: its number, the body's angle (N,) and its markers against its pose (N, M, 2) in the room (m, NaN where
    unseen); of the two that were asked for last they are at hand.
    """
    return tuple(_residuals(series, body))


def _residuals(series: Series, body: str) -> Iterator[tuple[int, Array, Array]]:
    assert series.points is not None and series.layouts is not None
    layout = series.layouts[body][:, :2]
    for number, (points, motion, recording) in enumerate(
        zip(series.points, series.motions, series.recordings, strict=True)
    ):
        cloud = bodies_clouds(points, recording)[body]
        table = motion.set_index("frame").reindex(cloud.frame)
        angle = table[f"{body}_angle_rad"].to_numpy(float)
        turned = np.stack(
            [
                np.cos(angle)[:, None] * layout[:, 0] - np.sin(angle)[:, None] * layout[:, 1],
                np.sin(angle)[:, None] * layout[:, 0] + np.cos(angle)[:, None] * layout[:, 1],
            ],
            -1,
        )
        place = table[[f"{body}_x_m", f"{body}_y_m"]].to_numpy(float)
        yield number, angle, cloud.position_m[..., :2] - place[:, None, :] - turned


def on_body(angle: Array, world: Array) -> Array:
    """Residuals (N, M, 2) in the body's frame, ``angle`` (N,) being the body's."""
    c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.stack([c * world[..., 0] + s * world[..., 1], -s * world[..., 0] + c * world[..., 1]], -1)


def middle_of(values: Array) -> tuple[float, float]:
    """Median and its standard error, neighbouring frames' errors being correlated."""
    seen = values[np.isfinite(values)]
    if len(seen) < FEWEST_FRAMES:
        return np.nan, np.inf
    middle = float(np.median(seen))
    off = seen - middle
    sd = residual_sd(off)
    return middle, MEDIAN_SD * sd * slow_mean(off) / float(np.sqrt(len(seen)))


def over_runs(values: list[Array], sds: list[Array]) -> tuple[Array, Array]:
    """Weighted mean over runs and its sd, whichever is larger of the one stated and the one seen between the runs."""
    value, sd = np.array(values), np.maximum(np.array(sds), FINEST_M)
    weight = np.where(np.isfinite(value), 1 / sd**2, 0.0)
    total = np.maximum(weight.sum(0), 1e-300)
    mean = np.sum(weight * np.nan_to_num(value), 0) / total
    count = np.maximum((weight > 0).sum(0), 1)
    spread = np.sqrt(np.sum(weight * (np.nan_to_num(value) - mean) ** 2, 0) / total / np.maximum(count - 1, 1))
    return np.where(weight.sum(0) > 0, mean, np.nan), np.maximum(1 / np.sqrt(total), spread)
