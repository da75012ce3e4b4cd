"""Bodies are rigid: what their markers do against each other is the measurement's doing.

A lens residual goes with a marker's place, a wrong layout is the same in every frame; neither makes a marker's residual
differ between the halves of a run, from run to run, or with the body's velocity.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.gap.cause import Structure, two_sided
from analysis.gap.series import Series
from analysis.motion.bodies import bodies_clouds
from analysis.statistics.robust import MEDIAN_SD
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Markers are glued within 0.05 mm; one that moves by more has come loose.  A marker seen this much later than the rest
# is no noise.
LOOSE_M, LATE_S = 5e-5, 2e-5
SURE_SD = 6.0
# Two views of a marker share a delay of one of them by where it stands: this share of it may differ between markers.
SHARE_OF_CLOCK = 0.2
FEWEST_FRAMES = 40


def rigid_structure(series: Series, clock_s: float = 0.0) -> list[Structure]:
    """Markers that moved on their body, and Host markers that are seen at times of their own; nothing without marker
    points.

    ``clock_s``: by how much one camera is known to be late.  Markers share it, each with another part of it.
    """
    if series.points is None or series.layouts is None:
        return []
    out = []
    for body in ("host", "nes"):
        residuals = list(marker_residuals(series, body))
        if residuals:
            out += _moved(residuals, series, body)
            out += _late(residuals, series, clock_s) if body == "host" else []
    return out


def marker_residuals(series: Series, body: str) -> Iterator[tuple[int, Array, Array]]:
    """Per run: its number, the body's angle (N,) and its markers against its pose (N, M, 2) in the room (m, NaN where
    unseen).
    """
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
    near = np.clip(off, -3 * sd, 3 * sd)
    lag = float(np.clip(np.sum(near[1:] * near[:-1]) / max(np.sum(near**2), 1e-300), 0.0, 0.9))
    return middle, MEDIAN_SD * sd * float(np.sqrt((1 + lag) / (1 - lag) / len(seen)))


def _moved(residuals: list[tuple[int, Array, Array]], series: Series, body: str) -> list[Structure]:
    """The marker whose place on the body differs most between the halves of the runs, or in one run from the others."""
    changes, change_sds, places, place_sds = [], [], [], []
    for _, angle, world in residuals:
        own = on_body(angle, world)
        (first, first_sd), (second, second_sd) = _centres(own[: len(own) // 2]), _centres(own[len(own) // 2 :])
        place, place_sd = _centres(own)
        changes.append(second - first)
        change_sds.append(np.hypot(first_sd, second_sd))
        places.append(place)
        place_sds.append(place_sd)
    change, change_sd = over_runs(changes, change_sds)
    found = list(_surely_moved(np.abs(change)[None], change_sd[None], "within the runs"))
    if len(places) > 2:
        apart = np.abs(np.array(places) - np.nanmedian(places, axis=0))
        found += _surely_moved(apart, np.array(place_sds), "from run to run")
    if not found:
        return []
    size, sd, marker, when = max(found)
    name = series.recordings[0].bodies[body].markers[marker]
    return [
        Structure(
            "measurement",
            "all",
            "x",
            f"marker {name}, which moves on its body {when}",
            size / LOOSE_M,
            (size / sd) ** 2,
            size,
            "m",
            two_sided(size / sd),
        )
    ]


def _surely_moved(size: Array, sd: Array, when: str) -> Iterator[tuple[float, float, int, str]]:
    """Of sizes (runs, M, 2) with their sds those beyond placement and chance: size, sd, marker's number, and when it
    moved.
    """
    for at in np.argwhere((size > LOOSE_M) & (size > SURE_SD * sd)):
        yield float(size[tuple(at)]), float(sd[tuple(at)]), int(at[1]), when


def _centres(own: Array) -> tuple[Array, Array]:
    """Medians and standard errors (M, 2) of residuals (N, M, 2)."""
    pairs = np.array([[middle_of(own[:, m, a]) for a in range(2)] for m in range(own.shape[1])])
    return pairs[..., 0], pairs[..., 1]


def over_runs(values: list[Array], sds: list[Array]) -> tuple[Array, Array]:
    """Weighted mean over runs and its sd, whichever is larger of the one told and the one seen between the runs."""
    value, sd = np.array(values), np.array(sds)
    weight = np.where(np.isfinite(value), 1 / sd**2, 0.0)
    total = np.maximum(weight.sum(0), 1e-300)
    mean = np.sum(weight * np.nan_to_num(value), 0) / total
    count = np.maximum((weight > 0).sum(0), 1)
    spread = np.sqrt(np.sum(weight * (np.nan_to_num(value) - mean) ** 2, 0) / total / np.maximum(count - 1, 1))
    return np.where(weight.sum(0) > 0, mean, np.nan), np.maximum(1 / np.sqrt(total), spread)


def _late(residuals: list[tuple[int, Array, Array]], series: Series, clock_s: float) -> list[Structure]:
    """Host markers whose residual goes with the Host's velocity: seen earlier or later than the others (rows read one
    after the other).
    """
    delays, sds = [], []
    for number, _, world in residuals:
        host = series.runs[number].data.host
        if host.omega_rad_per_s == 0 or len(world) != len(series.runs[number].data.time_s):
            continue
        velocity = host.at(series.runs[number].data.time_s, 1)[:, :2]
        along = velocity / max(float(np.sqrt(np.mean(np.sum(velocity**2, 1)))), 1e-9)
        slope = np.full((world.shape[1], 2), np.nan)
        for m in range(world.shape[1]):
            r = np.sum(world[:, m] * along, 1)
            slope[m] = _slope(np.sum(velocity * along, 1), r)
        delays.append(slope[:, 0])
        sds.append(slope[:, 1])
    if not delays:
        return []
    delay, sd = over_runs(delays, sds)
    worst = int(np.nanargmax(np.abs(delay) / sd)) if np.isfinite(delay).any() else 0
    size = float(np.abs(delay[worst]))
    if not np.isfinite(size) or size < LATE_S + SHARE_OF_CLOCK * abs(clock_s) or size < SURE_SD * sd[worst]:
        return []
    return [
        Structure(
            "measurement",
            "all",
            "x",
            "the Host's velocity, by another delay at each of its markers",
            size / LATE_S,
            float((size / sd[worst]) ** 2),
            size,
            "s",
            two_sided(size / float(sd[worst])),
        )
    ]


def _slope(x: Array, y: Array) -> tuple[float, float]:
    """Slope and sd of a straight line, gross errors cut at 4 robust sd."""
    seen = np.isfinite(x) & np.isfinite(y)
    if seen.sum() < FEWEST_FRAMES or np.std(x[seen]) == 0:
        return np.nan, np.inf
    for _ in range(2):
        a = np.column_stack([np.ones(seen.sum()), x[seen]])
        c = np.linalg.lstsq(a, y[seen], rcond=None)[0]
        off = y - c[0] - c[1] * x
        spread = max(residual_sd(off[seen]), 1e-12)
        seen &= np.abs(off) < 4 * spread
    return float(c[1]), float(spread / np.sqrt(seen.sum()) / np.std(x[seen]))
