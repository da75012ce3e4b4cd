"""Measurement first: clocks, windows, scale, frame rate, plane and jitter, each from a residual of its own.

Two views leave one residual over (epipolar), and bodies that stand on a plane leave a second (their height).  At a body's centre with
velocity V, seen by a second camera that is late by d and whose window lies w off::

    epipolar = n . (w + d J V)          height = M_z . (w + d J V) + a x + b y + Host's own z(t)

n, M and J being the derivative of residual, point and pixel.  Host and NES share the Host's own vertical motion and differ in place and
velocity, which separates a tilted plane, a late clock and real vertical motion.  Lengths are held against the design, the drive's
frequency against what was asked, the Host's residual against its speed.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.gap.series import Series
from analysis.motion import PLACEMENT_SD_M, VELOCITY_REACH
from ovines.camera import Camera, triangulate_points

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Finding:
    """One measurement effect: its parameters with sd, how many sd it is from nothing, and whether it is more than negligible."""

    effect: str
    parameters: dict[str, tuple[float, float]]
    significance: float
    size: float
    found: bool


@dataclass(frozen=True, eq=False)
class MeasurementTests:
    findings: dict[str, Finding]
    notes: list[str] = field(default_factory=list)


#: smallest size that is called an effect; below it lies what calibration, placement and lens leave over on a good rig
NEGLIGIBLE = {"camera_clock_offset": 3e-5, "sensor_window_offset": 0.35, "length_scale_error": 1.6e-3, "frame_rate_error": 2.5e-4,
              "plane_tilt": 1.7e-3, "trigger_jitter": 7e-6}
SIGNIFICANT = 5.0


def measurement_tests(series: Series) -> MeasurementTests:
    """All measurement tests that the series' entry allows."""
    findings: dict[str, Finding] = {}
    notes: list[str] = []
    for finding in (_frame_rate(series), _length_scale(series), _jitter(series), *_views(series, notes)):
        if finding is not None:
            findings[finding.effect] = finding
    return MeasurementTests(findings, notes)


def _judge(effect: str, parameters: dict[str, tuple[float, float]], size: float, significance: float) -> Finding:
    return Finding(effect, parameters, float(significance), float(size),
                   bool(size > NEGLIGIBLE[effect] and significance > SIGNIFICANT))


def _frame_rate(series: Series) -> Finding | None:
    """True over nominal frame rate: asked over seen drive frequency, mean over runs weighted by their precision."""
    pairs = [(r.excitation.frequency_hz / run.data.host.frequency_hz, run.data.host.omega_sd_rad_per_s / run.data.host.omega_rad_per_s)
             for r, run in zip(series.recordings, series.runs, strict=True)
             if r.excitation is not None and r.excitation.frequency_hz and run.data.host.omega_rad_per_s > 0]
    if not pairs:
        return None
    ratio, sd = np.array(pairs).T
    weight = 1 / np.maximum(sd, 1e-7) ** 2
    mean = float(np.sum(weight * ratio) / weight.sum())
    spread = float(np.sqrt(np.sum(weight * (ratio - mean) ** 2) / weight.sum() / max(len(ratio) - 1, 1))) if len(ratio) > 1 else 0.0
    error = max(1 / np.sqrt(weight.sum()), spread, 1e-7)
    return _judge("frame_rate_error", {"ratio": (mean, error)}, abs(mean - 1), abs(mean - 1) / error)


def _length_scale(series: Series) -> Finding | None:
    """Reported over true length, from the markers' places against their design (both bodies)."""
    if series.layouts is None:
        return None
    top = bottom = 0.0
    for name, layout in series.layouts.items():
        body = series.recordings[0].bodies[name]
        if body.layout_m is None:
            continue
        design = np.asarray(body.layout_m, float)[:, :2]
        centred, seen = design - design.mean(0), layout[:, :2] - layout[:, :2].mean(0)
        if name == "nes" and getattr(body, "centre_marker", None) in body.markers:
            # The centre marker has an effect of its own; without it the scale does not hear of that.
            keep = [m != body.centre_marker for m in body.markers]
            centred, seen = design[keep] - design[keep].mean(0), layout[keep, :2] - layout[keep, :2].mean(0)
        variance = (body.layout_sd_m or PLACEMENT_SD_M) ** 2
        top += np.sum(centred * seen) / variance
        bottom += np.sum(centred**2) / variance
    if bottom == 0:
        return None
    scale, sd = top / bottom, 1 / np.sqrt(bottom)
    return _judge("length_scale_error", {"scale": (float(scale), float(sd))}, abs(scale - 1), abs(scale - 1) / sd)


def _jitter(series: Series) -> Finding | None:
    """Scatter of the frames' times: variance of the Host's residual along its motion against its speed squared."""
    rows, times, speeds = [], [], []
    for run in series.runs:
        host = run.data.host
        if host.omega_rad_per_s == 0:
            continue
        velocity = host.at(run.data.time_s, 1)[:, :2]
        axis = int(np.argmax(np.abs(velocity).max(0)))
        residual, speed = host.residual[:, axis], np.abs(velocity[:, axis])
        ok = np.isfinite(residual)
        rows.append(residual[ok] - np.median(residual[ok]))
        speeds.append(speed[ok])
        times.append(len(rows[-1]))
    if not rows:
        return None
    residual, speed = np.concatenate(rows), np.concatenate(speeds)
    v2 = speed**2
    # Robust: mean of clipped squares in speed classes, then a line in v^2.
    edges = np.quantile(v2, np.linspace(0, 1, 13))
    classes = np.clip(np.searchsorted(edges, v2, side="right") - 1, 0, 11)
    x = np.array([v2[classes == c].mean() for c in range(12)])
    y = np.array([(1.4826 * np.median(np.abs(residual[classes == c]))) ** 2 for c in range(12)])
    n = np.array([np.count_nonzero(classes == c) for c in range(12)])
    for _ in range(3):
        w = np.sqrt(n / 2.7) / np.maximum(y, 1e-14)
        a = np.column_stack([np.ones(12), x]) * w[:, None]
        covariance = np.linalg.inv(a.T @ a)
        _base, slope = covariance @ (a.T @ (y * w))
        y = np.maximum(y, 1e-14)
    error = float(np.sqrt(covariance[1, 1]))
    sd = float(np.sqrt(max(slope, 0.0)))
    return _judge("trigger_jitter", {"sd_s": (sd, error / (2 * max(sd, np.sqrt(error))))}, sd, slope / error)


def _views(series: Series, notes: list[str]) -> list[Finding | None]:
    """Clock, window and plane from epipolar residual and height of both bodies, by one robust linear fit."""
    if series.points is None or series.cameras is None or "epipolar_px" not in series.points[0]:
        notes.append("no two views at this entry: camera clocks, windows and the plane cannot be tested")
        return []
    n_runs = len(series.runs)
    rows, values, sds, groups = [], [], [], []
    for number, (points, motion, run) in enumerate(zip(series.points, series.motions, series.runs, strict=True)):
        for body in ("host", "nes"):
            block = _body_rows(series, points, motion, run, body)
            if block is None:
                continue
            epipolar, height, x, y, j_v, n2, m_z, e_sd, z_sd, phase = block
            shared_e = np.column_stack([n2, np.sum(n2 * j_v, 1), np.zeros((len(x), 2))])
            shared_z = np.column_stack([m_z, np.sum(m_z * j_v, 1), x, y])
            own = np.zeros((len(x), 2 * n_runs))
            own[:, 2 * number], own[:, 2 * number + 1] = np.cos(phase), np.sin(phase)
            rows += [np.hstack([shared_e, np.zeros_like(own)]), np.hstack([shared_z, own if run.data.host.omega_rad_per_s else 0 * own])]
            values += [epipolar, height]
            sds += [e_sd, z_sd]
            groups += [np.full(2 * len(x), number)]
    if not rows:
        return []
    a, b, sd = np.vstack(rows), np.concatenate(values), np.concatenate(sds)
    ok = np.isfinite(a).all(1) & np.isfinite(b) & np.isfinite(sd)
    a, b, sd = a[ok], b[ok], sd[ok]
    weight = 1 / sd
    ridge = 1e-12 * np.eye(a.shape[1])
    for _ in range(6):
        aw = a * weight[:, None]
        covariance = np.linalg.pinv(aw.T @ aw + ridge, hermitian=True)
        solution = covariance @ (aw.T @ (b * weight))
        z = (b - a @ solution) / sd
        scale = max(1.0, 1.4826 * float(np.median(np.abs(z))))
        weight = 1 / (sd * scale) / np.sqrt(1 + (z / scale / 3) ** 2)
    error = np.sqrt(np.diag(covariance))
    # A lens residual bends epipolar lines and heights alike; what it does to the former tells what to allow in the latter.
    warp_px = _structure(a, b - a @ solution)
    height_per_px = float(np.median(np.abs(a[np.flatnonzero(a[:, 3] != 0), 0]))) if np.any(a[:, 3] != 0) else 0.0
    lever = float(np.std(a[a[:, 3] != 0, 3:5])) or 1.0
    lens = warp_px * height_per_px / (2 * lever)
    moving = a[np.flatnonzero(a[:, 3] != 0), 2]
    speed = max(float(np.std(moving)) / max(height_per_px, 1e-12), 1.0) if len(moving) else 1.0
    (wu, wv, delay, slope_x, slope_y), (su, sv, sd_delay, sx, sy) = solution[:5], error[:5]
    window, tilt = np.hypot(wu, wv), np.hypot(slope_x, slope_y)
    return [
        _judge("sensor_window_offset", {"u_px": (wu, np.hypot(su, 0.5 * warp_px)), "v_px": (wv, np.hypot(sv, 0.5 * warp_px))}, window,
               window / max(su, sv)),
        # The lens residual, over the pixels per second that the bodies move: a tenth of it survives the average over places.
        _judge("camera_clock_offset", {"offset_s": (delay, np.hypot(sd_delay, 0.1 * warp_px / speed))}, abs(delay), abs(delay) / sd_delay),
        # z = a x + b y is the world turned by b about x and by -a about y.
        _judge("plane_tilt", {"x_rad": (slope_y, np.hypot(sy, lens)), "y_rad": (-slope_x, np.hypot(sx, lens))}, tilt,
               tilt / max(sx, sy, lens)),
    ]


def _structure(a: Array, residual: Array) -> float:
    """RMS (px) of what the epipolar residual shows in squares of 10 mm of the room beyond its noise: the lens residual."""
    rows = np.flatnonzero((a[:, 3] == 0) & (a[:, 4] == 0))
    heights = np.flatnonzero((a[:, 3] != 0) | (a[:, 4] != 0))
    if len(rows) != len(heights) or len(rows) < 50:
        return 0.0
    place = np.floor(a[heights, 3:5] / 0.01).astype(int)
    r = residual[rows]
    keys = place[:, 0] * 1000 + place[:, 1]
    total, weight = 0.0, 0
    for key in np.unique(keys):
        part = r[keys == key]
        if len(part) >= 20:
            part = part[np.abs(part - np.median(part)) < 5 * 1.4826 * np.median(np.abs(part - np.median(part))) + 1e-12]
            total += (part.mean() ** 2 - part.var() / len(part)) * len(part)
            weight += len(part)
    return float(np.sqrt(max(total, 0.0) / weight)) if weight else 0.0


def _body_rows(series: Series, points, motion, run, body: str):
    """Per frame of one body: epipolar residual, height, place, pixel velocity of the second view, and the derivatives."""
    recording = series.recordings[0]
    markers = recording.bodies[body].markers
    layout = series.layouts[body]
    frames = motion["frame"].to_numpy()
    part = points[points["marker"].isin(list(markers))]
    mean = part.groupby("frame")["epipolar_px"].median().reindex(frames).to_numpy(float)
    count = part.groupby("frame")["epipolar_px"].count().reindex(frames).to_numpy(float)
    sd_px = 1.4826 * np.nanmedian(np.abs(part["epipolar_px"] - part["epipolar_px"].median())) if len(part) else np.nan
    x, y, z = (motion[f"{body}_{a}_m"].to_numpy(float) for a in "xyz")
    z_sd = motion[f"{body}_z_sd_m"].to_numpy(float)
    if body == "host":
        velocity = run.data.host.at(run.data.time_s, 1)[:, :3] * np.array([1, 1, 0])
    else:
        velocity = np.column_stack([motion[f"nes_v{a}_m_per_s"].to_numpy(float) for a in "xy"] + [np.zeros(len(x))])
        # The local parabola smears a velocity step over its reach: frames beside a kink say nothing of velocity.
        near = np.zeros(len(x), bool)
        for gap in run.segments.gaps:
            near[max(0, gap - VELOCITY_REACH):gap + VELOCITY_REACH + 2] = True
        velocity[near] = np.nan
    use = np.isfinite(mean) & np.isfinite(x) & np.isfinite(z) & np.isfinite(velocity[:, 0])
    if use.sum() < 20:
        return None
    at = np.flatnonzero(use)
    place = np.column_stack([x[at], y[at], np.full(len(at), float(np.mean(layout[:, 2])))])
    n2, m_z, j_v = _derivatives(series.cameras, place, velocity[at])
    phase = run.data.host.omega_rad_per_s * run.data.time_s[at]
    return (mean[at], z[at], x[at], y[at], j_v, n2, m_z, np.maximum(sd_px, 1e-3) * 1.25 / np.sqrt(count[at]), z_sd[at], phase)


def _derivatives(cameras: tuple[Camera, ...], place: Array, velocity: Array) -> tuple[Array, Array, Array]:
    """d(epipolar)/d(u, v of the second view), d(z)/d(the same), and the second view's pixel velocity (all (N, 2))."""
    uv = [camera.project(place) for camera in cameras]
    one = np.ones(len(place))
    base = triangulate_points(cameras, uv, [one, one])
    step = 0.5
    epipolar, height = np.empty((len(place), 2)), np.empty((len(place), 2))
    for axis in range(2):
        moved = uv[1].copy()
        moved[:, axis] += step
        shifted = triangulate_points(cameras, [uv[0], moved], [one, one])
        epipolar[:, axis] = (shifted.epipolar_px - base.epipolar_px) / step
        height[:, axis] = (shifted.points_m[:, 2] - base.points_m[:, 2]) / step
    _, jacobian = cameras[1].project_with_jacobian(place)
    return epipolar, height, np.einsum("nij,nj->ni", jacobian, velocity)
