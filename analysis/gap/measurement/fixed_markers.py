"""Ground markers stand still: what they do instead is the cameras' doing.

A camera that sways moves them together from frame to frame.  One that creeps, turns or zooms moves them slowly, which
single frames hide in their noise: means over parts of the runs show it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.gap.cause import SMALLEST_P, Structure, two_sided
from analysis.gap.measurement.body_residuals import FINEST_M, SURE_SD, middle_of, over_runs
from analysis.gap.series import Series
from ovines.robust import spread

Array = NDArray[np.float64]

# Ground markers that move by more than this share of the contact radius are no longer noise (12 um of 40 mm); a lens
# residual leaves a still marker still.
STILL_SHARE = 3e-4
# Parts of a run, in time, whose means are held against each other.
PARTS = 4
# A camera whose picture of the ground changes by so many times the other's is named.
CLEARLY = 3.0
AXES = ("x_m", "y_m")
# What a picture of still markers may do.
TOGETHER, GROWS, TURNS = "move together", "change their distances", "turn"
# Motion from frame to frame that is less than this of its noise is as likely an error of the noise's sd.
LEAST_OF_NOISE = 0.7


def still_px(series: Series) -> float:
    """What a still marker may move, in pixels of the second camera; for a series with cameras."""
    assert series.cameras is not None
    camera = series.cameras[1]
    away_m = float(np.linalg.norm(camera.centre_m))
    return STILL_SHARE * series.contact_radius_m * float(camera.matrix[0, 0]) / away_m


def ground_motion(series: Series) -> list[Structure]:
    """:class:`analysis.gap.cause.Structure` when the ground markers move, together from frame to frame or in any way
    over the runs, by more than their noise; else nothing.
    """
    ground = series.recordings[0].bodies.get("ground")
    if ground is None or series.points is None or not ground.markers:
        return []
    still_m = STILL_SHARE * series.contact_radius_m
    parts = [points[points["marker"].isin(list(ground.markers))] for points in series.points]
    found = _together(parts, still_m)
    if found and found[0].goes_with.endswith(TOGETHER):
        return found
    # What a picture does slowly is reported with its camera and time.
    return _slow(parts, ground.markers, series, still_m) or found


def _together(parts: Sequence[pd.DataFrame], still_m: float) -> list[Structure]:
    """Motion that all ground markers share from frame to frame: a shift, or a picture that grows or turns."""
    ways: dict[str, list[tuple[float, float]]] = {}
    for part in parts:
        for way, own in _shared(part).items():
            ways.setdefault(way, []).append(own)
    out = []
    for way, each in ways.items():
        size = float(np.sqrt(np.median([excess for excess, _ in each])))
        noise = float(np.median([sd for _, sd in each]))
        if size >= still_m and size >= LEAST_OF_NOISE * noise:
            goes_with = f"the ground markers, which {way}" + ("" if way == TOGETHER else " from frame to frame")
            gain, p = (size / noise) ** 2, two_sided(size / noise)
            out.append(Structure("measurement", "all", "x", goes_with, size / still_m, gain, size, "m", p))
    return sorted(out, key=lambda one: -one.strength)[:1]


def _shared(part: pd.DataFrame) -> dict[str, tuple[float, float]]:
    """What the markers of a run do together: variance (m^2) from frame to frame beyond noise, and that noise's sd (m),
    by the way they do it.
    """
    if part.empty:
        return {}
    wide = [part.pivot_table(index="frame", columns="marker", values=axis) for axis in AXES]
    moved = np.stack([one - one.median() for one in wide], -1)
    count = np.median(np.isfinite(moved[..., 0]).sum(1))
    sd = np.array([float(part[f"{axis[0]}_sd_m"].median()) for axis in AXES])
    shift = np.nanmean(moved, axis=1)
    shift_sd = sd / np.sqrt(max(count, 1))
    out = {TOGETHER: (max(_beyond(shift[:, k], shift_sd[k]) for k in (0, 1)), float(np.median(shift_sd)))}
    whole = np.isfinite(moved).all((1, 2))
    if moved.shape[1] < 2 or not whole.any():
        return out
    middle = np.stack([one.median().to_numpy(float) for one in wide], -1)
    arm = middle - middle.mean(0)
    arm /= np.linalg.norm(arm)
    for way, along in ((GROWS, arm), (TURNS, np.column_stack([-arm[:, 1], arm[:, 0]]))):
        one_sd = float(np.sqrt(np.sum((along * sd) ** 2)))
        out[way] = (_beyond(np.einsum("nka,ka->n", moved[whole], along), one_sd), one_sd)
    return out


def _beyond(values: Array, sd: float) -> float:
    return float(max(spread(values) ** 2 - sd**2, 0.0))


def _slow(parts: Sequence[pd.DataFrame], markers: Sequence[str], series: Series, still_m: float) -> list[Structure]:
    """What the markers' means over parts of the runs, and over runs, do: they move together, turn, or change their
    distances."""
    places = [_by_part(part, markers, AXES) for part in parts]
    off, sd, when = _changes(places)
    if not len(off):
        return []
    sure = np.where(np.abs(off) > still_m, np.abs(off) / sd, 0.0)
    most = np.unravel_index(int(np.argmax(sure)), sure.shape)
    if not sure[most] > SURE_SD:
        return []
    size = float(np.abs(off[most]))
    middle = np.array([[np.nanmedian(part.loc[part["marker"] == m, axis]) for axis in AXES]
                       for part in (pd.concat(parts),) for m in markers])  # fmt: skip
    whose = _camera(series, markers, when[most[0]])
    return [
        Structure(
            "measurement",
            "all",
            "x",
            f"the {when[most[0]]}: the ground markers {_what(off[most[0]], middle)}{whose}",
            size / still_m,
            float(sure[most] ** 2),
            size,
            "m",
            max(min(1.0, sure.size * two_sided(float(sure[most]))), SMALLEST_P),
        )
    ]


def slow_motion(series: Series) -> tuple[Array, Array] | None:
    """What each ground marker does in the parts of a run, on the mean of all runs: (PARTS, markers, 2) in m with sds;
    None without ground markers."""
    ground = series.recordings[0].bodies.get("ground")
    if ground is None or series.points is None or not ground.markers:
        return None
    each = [points[points["marker"].isin(list(ground.markers))] for points in series.points]
    offs, sds, _, _ = _within_runs([_by_part(part, ground.markers, AXES) for part in each])
    return over_runs(offs, sds)


def _by_part(seen: pd.DataFrame, markers: Sequence[str], columns: Sequence[str]) -> tuple[Array, Array]:
    """Middles and standard errors (PARTS, markers, 2) of a run's markers in its parts."""
    frames = seen["frame"].to_numpy(float)
    first, last = (frames.min(), frames.max() + 1) if len(frames) else (0.0, 1.0)
    number = np.minimum((frames - first) / (last - first) * PARTS, PARTS - 1).astype(int)
    name = seen["marker"].to_numpy()
    pairs = np.full((PARTS, len(markers), 2, 2), np.nan)
    pairs[..., 1] = np.inf
    for part in range(PARTS):
        for i, marker in enumerate(markers):
            here = (number == part) & (name == marker)
            for j, column in enumerate(columns):
                pairs[part, i, j] = middle_of(seen.loc[here, column].to_numpy(float))
    return pairs[..., 0], pairs[..., 1]


def _within_runs(
    places: Sequence[tuple[Array, Array]],
) -> tuple[list[Array], list[Array], list[Array], list[Array]]:
    """Of each run: its parts against its mean (PARTS, markers, 2) with sds, and the mean (markers, 2) with its."""
    offs, sds, means, mean_sds = [], [], [], []
    for place, stated_sd in places:
        sd = np.maximum(stated_sd, FINEST_M)  # rounded pixels may be alike to every digit
        weight = 1 / sd**2
        total = weight.sum(0)
        mean = np.sum(weight * np.nan_to_num(place), 0) / np.where(total > 0, total, 1.0)
        offs.append(place - mean)
        # A part's share of the mean is no error of the difference.
        sds.append(np.where(weight > 0, np.sqrt(np.maximum(sd**2 - 1 / np.maximum(total, 1e-300), 0.0)), np.inf))
        means.append(np.where(total > 0, mean, np.nan))
        mean_sds.append(np.where(total > 0, 1 / np.sqrt(np.maximum(total, 1e-300)), np.inf))
    return offs, sds, means, mean_sds


def _changes(places: Sequence[tuple[Array, Array]]) -> tuple[Array, Array, list[str]]:
    """Changes (K, markers, 2) with sds, and when each is: of parts of a run against the run, in single runs and in the
    mean of all, and of runs against each other."""
    offs, sds, means, mean_sds = _within_runs(places)
    all_runs, all_sds = over_runs(offs, sds)
    off, sd = np.concatenate([*offs, all_runs]), np.concatenate([*sds, all_sds])
    when = ["time within a run"] * len(off)
    if len(places) > 2:
        off = np.concatenate([off, np.array(means) - np.nanmedian(means, axis=0)])
        sd = np.concatenate([sd, np.array(mean_sds)])
        when += ["run"] * len(means)
    return np.nan_to_num(off), np.maximum(sd, 1e-12), when


def _what(moved: Array, middle: Array) -> str:
    """The chief part of the displacements (markers, 2) of markers at ``middle`` (markers, 2)."""
    arm = middle - middle.mean(0)
    along = moved - moved.mean(0)
    square = max(float(np.sum(arm**2)), 1e-300)
    grown = float(np.sum(arm * along)) / np.sqrt(square)
    turned = float(np.sum(arm[:, 0] * along[:, 1] - arm[:, 1] * along[:, 0])) / np.sqrt(square)
    shares = {
        TOGETHER: float(np.linalg.norm(moved.mean(0))) * np.sqrt(len(moved)),
        GROWS: abs(grown),
        TURNS: abs(turned),
    }
    return max(shares, key=lambda name: shares[name])


def _camera(series: Series, markers: Sequence[str], when: str) -> str:
    """The camera whose picture of the markers changes, where tracks tell it."""
    if series.tracks is None or series.cameras is None:
        return ""
    sizes = {}
    for camera in dict.fromkeys(series.tracks[0]["camera"]):
        own = [
            _by_part(t[(t["camera"] == camera) & t["marker"].isin(list(markers))], markers, ("u_px", "v_px"))
            for t in series.tracks
        ]
        off, sd, times = _changes(own)
        here = np.array([one == when for one in times])
        sizes[str(camera)] = float(np.max(np.where(np.isfinite(sd[here]), np.abs(off[here]) / sd[here], 0.0)))
    first, *rest = sorted(sizes, key=lambda name: -sizes[name])
    return f" in the picture of {first}" if rest and sizes[first] > CLEARLY * sizes[rest[0]] else ""
