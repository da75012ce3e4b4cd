"""Bodies are rigid: what their markers do against each other is the measurement's doing.

A lens residual goes with a marker's place, a wrong layout is the same in every frame; neither makes a marker's residual
differ between the halves of a run, from run to run, or with the body's velocity; nor does a lens move one marker alone,
or by more than the picture's stretch (:mod:`analysis.gap.measurement.loose_markers`).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.gap.cause import EXCHANGED, SMALLEST_P, Structure, two_sided
from analysis.gap.measurement.body_residuals import (
    FEWEST_FRAMES,
    SHARE_OF_CLOCK,
    SURE_SD,
    loose_m,
    marker_residuals,
    middle_of,
    on_body,
    over_runs,
)
from analysis.gap.measurement.loose_markers import VELOCITY, Loose, loose_marker, with_its_body
from analysis.gap.series import Series, Triangulate
from ovines.plausibility.exchanged import Exchange, exchanged_labels
from ovines.recording import Recording
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Of so many frames markers with each other's name are no slip of a few.
SHARE_OF_FRAMES = 1e-3
# A marker seen this much later than the rest is no noise.
LATE_S = 2e-5


def exchanged_structure(series: Series) -> list[Structure]:
    """Pairs of markers that have each other's name for a while in one of the cameras, as ``size`` the share of the
    frames; nothing without tracks of two cameras.  Frame by frame their bodies are measured without them."""
    cameras, again = series.cameras, series.triangulate
    if series.tracks is None or cameras is None or again is None or series.points is None:
        return []
    found: dict[tuple[str, str], list[tuple[str, Exchange]]] = {}
    for recording, run, points, tracks in zip(
        series.recordings, series.runs, series.points, series.tracks, strict=True
    ):
        bodies = {name: body.markers for name, body in recording.bodies.items()}
        for one in exchanged_labels(points, tracks, cameras, bodies, partial(_again, again, series, recording)):
            found.setdefault(one.markers, []).append((run.data.name, one))
    count = sum(len(run.data.time_s) for run in series.runs)
    out = []
    for markers, places in found.items():
        share = sum(one.frames for _, one in places) / count
        (name, first), others = places[0], len({name for name, _ in places}) - 1
        more = f", and in {others} other run{'s' if others > 1 else ''}" if others else ""
        where = f"{name}, frames {first.first} to {first.last}{more}"
        goes_with = f"{EXCHANGED} {' and '.join(markers)}, exchanged in one of the cameras: {where}"
        out.append(
            Structure("measurement", "all", "all", goes_with, share / SHARE_OF_FRAMES, 0.0, share, "1", SMALLEST_P)
        )
    return out


def _again(triangulate: Triangulate, series: Series, recording: Recording, tracks: pd.DataFrame) -> pd.DataFrame:
    """Points of tracks of one of the recordings, as those of the series."""
    return triangulate(tracks, series.cameras or (), recording, series.window_px)


def rigid_structure(series: Series, clock_s: float = 0.0) -> list[Structure]:
    """Markers that moved on their body, and Host markers that are seen at times of their own; nothing without marker
    points.

    ``clock_s``: by how much one camera is known to be late.  Markers share it, each with another part of it.
    """
    loose = loose_markers(series, clock_s)
    out = [one.structure for one in loose]
    if series.points is not None and series.layouts is not None and not any(one.with_what == VELOCITY for one in loose):
        out += _late(list(marker_residuals(series, "host")), series, clock_s)
    return out


def loose_markers(series: Series, clock_s: float = 0.0) -> list[Loose]:
    """The marker of each body that moves most on it from part to part of the series, and the one that moves as its body
    does; nothing without marker points."""
    if series.points is None or series.layouts is None:
        return []
    out = []
    for body in ("host", "nes"):
        moved = _moved(list(marker_residuals(series, body)), series, body)
        # What slips once goes with a spin that changes, too.
        slipped = {one.marker for one in moved}
        out += [*moved, *(one for one in with_its_body(series, body, clock_s) if one.marker not in slipped)]
    return out


def _moved(residuals: list[tuple[int, Array, Array]], series: Series, body: str) -> list[Loose]:
    """The marker whose place on the body differs most between the halves of the runs, by as much in each or by more in
    a longer one, or in one run from the others."""
    if not residuals:
        return []
    changes, change_sds, places, place_sds, frames = [], [], [], [], []
    for _, angle, world in residuals:
        own = on_body(angle, world)
        (first, first_sd), (second, second_sd) = _centres(own[: len(own) // 2]), _centres(own[len(own) // 2 :])
        place, place_sd = _centres(own)
        changes.append(second - first)
        change_sds.append(np.hypot(first_sd, second_sd))
        places.append(place)
        place_sds.append(place_sd)
        frames.append(len(own))
    found: list[tuple[float, float, int, str]] = []
    as_long = np.mean(frames) / np.array(frames)
    for shares in (np.ones(len(frames)), as_long):  # what slides goes farther in a longer run
        by = shares[:, None, None]
        change, change_sd = over_runs(list(by * np.array(changes)), list(by * np.array(change_sds)))
        found += _surely_moved(np.abs(change)[None], change_sd[None], "within the runs", loose_m(series))
    if len(places) > 2:
        apart = np.abs(np.array(places) - np.nanmedian(places, axis=0))
        found += _surely_moved(apart, np.array(place_sds), "from run to run", loose_m(series))
    if not found:
        return []
    size, sd, marker, when = max(found)
    return [loose_marker(series, body, marker, when, (size, sd))]


def _surely_moved(size: Array, sd: Array, when: str, least_m: float) -> Iterator[tuple[float, float, int, str]]:
    """Of sizes (runs, M, 2) with their sds those beyond ``least_m`` and chance: size, sd, marker's number, and when it
    moved.
    """
    for at in np.argwhere((size > least_m) & (size > SURE_SD * sd)):
        yield float(size[tuple(at)]), float(sd[tuple(at)]), int(at[1]), when


def _centres(own: Array) -> tuple[Array, Array]:
    """Medians and standard errors (M, 2) of residuals (N, M, 2)."""
    pairs = np.array([[middle_of(own[:, m, a]) for a in range(2)] for m in range(own.shape[1])])
    return pairs[..., 0], pairs[..., 1]


def _late(residuals: list[tuple[int, Array, Array]], series: Series, clock_s: float) -> list[Structure]:
    """Host markers whose residual goes with the Host's velocity: seen earlier or later than the others (rows read one
    after the other).
    """
    delays, sds = [], []
    for number, _, world in residuals:
        host = series.runs[number].data.host
        if not host.moves or len(world) != len(series.runs[number].data.time_s):
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
