"""Rolling shutter: rows read one after another, recognised from moving rigid bodies and taken out of their tracks.

A marker in a row that is read d later is seen where it is then.  Across a body that moves with velocity V its markers
are so shifted against each other by V d, which no pose explains; a lens or a layout does not follow the velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.camera import Camera
from ovines.recording import CameraSettings, Recording
from ovines.robust import huber_weight, residual_sd
from vision.frames.times import frame_times
from vision.markers.perspective import on_plane

Array = NDArray[np.float64]
SURE_SD = 8.0  # of the read-out time from which on it is there
LEAST_SHARE = 0.02  # of the frame's interval: a shorter one is a camera's clock
LONGEST_SHARE = 1.2  # of it: nothing is read longer than that
BLOCKS = 12  # of time, each left out once, for the sd
FEWEST_FRAMES = 5 * BLOCKS
FEWEST_MARKERS = 3
WRONG_SD = 4.0  # residuals that far off count no more than that: an impact's frame


@dataclass(frozen=True)
class Readout:
    """Time [s] from the first row of the window to its last, and its sd (0: stated)."""

    seconds: float
    sd_s: float


def without_rolling_shutter(
    tracks: pd.DataFrame,
    recording: Recording,
    cameras: Mapping[str, Camera],
    layouts_m: Mapping[str, Array],
) -> tuple[pd.DataFrame, list[str]]:
    """Tracks as if all rows were read at ``time_s``, and notes: cameras whose `readout_s` is given, or is surely seen.

    ``layouts_m``: per body its markers' places (m, 3), in the order of recording.toml.
    """
    notes: list[str] = []
    tracks = tracks.copy()
    for settings in recording.cameras:
        own = (tracks["camera"] == settings.name).to_numpy()
        if own.sum() < FEWEST_FRAMES or settings.readout_s == 0.0:
            continue
        view = tracks[own]
        frames = np.unique(view["frame"])
        times_s = dict(zip(frames, frame_times(recording, frames)[0], strict=True))
        view = view.assign(time_s=view["frame"].map(times_s).to_numpy(float))
        found = (
            Readout(settings.readout_s, 0.0)
            if settings.readout_s is not None
            else fitted_readout(view, settings, cameras[settings.name], recording, layouts_m)
        )
        if found is None:
            continue
        tracks.loc[own, ["u_px", "v_px"]] = _at_one_time(view, found.seconds, settings.window_px[1])
        if settings.readout_s is None:
            notes.append(
                f"{settings.name} reads its rows one after another, {1e3 * found.seconds:.3g} ms "
                f"(sd {1e3 * found.sd_s:.2g} ms) from the first to the last: taken out; say readout_s in its "
                f"[[cameras]] if you know it better, 0 for a camera that does not"
            )
    return tracks, notes


def fitted_readout(
    view: pd.DataFrame,
    settings: CameraSettings,
    camera: Camera,
    recording: Recording,
    layouts_m: Mapping[str, Array],
) -> Readout | None:
    """The read-out time of one camera's tracks (with ``time_s``) by its rigid bodies; None where none is sure."""
    equations = [
        part
        for body, layout in layouts_m.items()
        if body != "ground" and (part := _equations(view, settings, camera, recording.bodies[body].markers, layout))
    ]
    if not equations:
        return None
    time_s, a, b = (np.concatenate([part[k] for part in equations]) for k in range(3))
    interval_s = float(np.median(np.diff(np.unique(view["time_s"]))))

    def fit(stay: NDArray[np.bool_]) -> float:
        value, reach = 0.0, np.inf
        for _ in range(4):  # what lies far off (an impact, a wrong marker) counts no more than its neighbours
            off = b[stay] - value * a[stay]
            weight = huber_weight(off, reach)
            square = float(np.sum(weight * a[stay] ** 2))
            value = float(np.sum(weight * a[stay] * b[stay])) / square if square > 0 else 0.0
            reach = WRONG_SD * residual_sd(b[stay] - value * a[stay])
        return value

    edges = np.quantile(time_s, np.linspace(0, 1, BLOCKS + 1)[1:-1])
    block = np.searchsorted(edges, time_s)
    value = fit(np.ones(len(b), bool))
    without = np.array([fit(block != k) for k in range(BLOCKS)])
    sd = float(np.sqrt((BLOCKS - 1) / BLOCKS * np.sum((without - without.mean()) ** 2)))
    sure = abs(value) > SURE_SD * sd and LEAST_SHARE * interval_s < abs(value) < LONGEST_SHARE * interval_s
    return Readout(value, sd) if sure else None


def _equations(
    view: pd.DataFrame, settings: CameraSettings, camera: Camera, markers: tuple[str, ...], layout: Array
) -> tuple[Array, Array, Array] | None:
    """Times, coefficients of the read-out time and residuals [m], the body's pose taken out of both, and of each marker
    on the body what is there in all frames.
    """
    there = set(view["marker"].unique())
    names = [name for name in markers if name in there]
    if len(names) < FEWEST_MARKERS:
        return None
    place = layout[[markers.index(name) for name in names]]
    wide = view.pivot(index="time_s", columns="marker", values=["u_px", "v_px"])
    uv = np.stack([wide[axis][names].to_numpy(float) for axis in ("u_px", "v_px")], -1)
    whole = np.isfinite(uv).all((1, 2))
    uv, times = uv[whole], wide.index.to_numpy(float)[whole]
    if len(uv) < FEWEST_FRAMES:
        return None
    sensor = uv + np.asarray(settings.window_offset_px, float)
    seen = np.stack([on_plane(camera, sensor[:, k], place[k, 2])[:, :2] for k in range(len(names))], 1)
    z, w = seen[..., 0] + 1j * seen[..., 1], place[:, 0] + 1j * place[:, 1]
    about = w - w.mean()
    turn = np.sum(np.conj(about) * (z - z.mean(1, keepdims=True)), 1)
    turn = turn / np.abs(turn)
    residual = z - z.mean(1, keepdims=True) - turn[:, None] * about
    velocity = np.gradient(z, times, axis=0)
    late = _late(uv[..., 1], settings.window_px[1])
    shift = velocity * late
    shift = shift - shift.mean(1, keepdims=True)
    arm = 1j * turn[:, None] * about
    inside = [
        one - arm * (np.sum((np.conj(arm) * one).real, 1) / np.sum(np.abs(arm) ** 2, 1))[:, None]
        for one in (shift, residual)
    ]
    own = [np.conj(turn)[:, None] * one for one in inside]  # on the body: a marker off its layout is the same there
    a, b = (one - np.median(one.real, 0) - 1j * np.median(one.imag, 0) for one in own)
    flat = [np.concatenate([one.real.ravel(), one.imag.ravel()]) for one in (a, b)]
    return np.tile(np.repeat(times, len(names)), 2), flat[0], flat[1]


def _late(v_px: Array, height_px: int) -> Array:
    """When a row is read, in parts of the read-out time from the middle row."""
    return (v_px + 0.5) / height_px - 0.5


def _at_one_time(view: pd.DataFrame, readout_s: float, height_px: int) -> Array:
    """Pixels (n, 2) of the frame's own time: each marker's path, seen at its rows' times, interpolated by parabolas."""
    out = view[["u_px", "v_px"]].to_numpy(float, copy=True)
    for _, rows in view.reset_index(drop=True).groupby("marker", sort=False):
        rows = rows.sort_values("time_s")
        at, wanted = rows.index.to_numpy(), rows["time_s"].to_numpy(float)
        uv = rows[["u_px", "v_px"]].to_numpy(float)
        seen_s = wanted + readout_s * _late(uv[:, 1], height_px)
        if len(at) < 3 or (np.diff(seen_s) <= 0).any():
            continue
        k = np.clip(np.arange(len(at)), 1, len(at) - 2)
        t0, t1, t2 = seen_s[k - 1], seen_s[k], seen_s[k + 1]
        first = (uv[k] - uv[k - 1]) / (t1 - t0)[:, None]
        second = ((uv[k + 1] - uv[k]) / (t2 - t1)[:, None] - first) / (t2 - t0)[:, None]
        out[at] = uv[k - 1] + first * (wanted - t0)[:, None] + second * ((wanted - t0) * (wanted - t1))[:, None]
    return out
