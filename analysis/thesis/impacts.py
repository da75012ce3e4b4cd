"""The thesis' own way to impacts and parameters (Secs 7.3.3 and 7.4), kept beside the careful one for
comparison.

Impacts are maxima of the smoothed acceleration norm, velocities are slopes of straight lines through a few
points on either side, and parameters minimise relative errors on a grid.  The straight lines are biased: the
Host accelerates at 60-90 m/s^2, so its velocity at the contact is not that of the points beside it, and a
floor brakes the NES on the way. ``analysis.contact.impacts`` and ``analysis.identify`` do it with a model of both
motions.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.recording import Recording
from ovines.recording_schema import ThesisMethod

Array = NDArray[np.float64]
USUAL = ThesisMethod()
STATE = ("nes_x_m", "nes_y_m", "nes_angle_rad", "host_x_m", "host_y_m", "host_angle_rad")


def method_of(recording: Recording) -> ThesisMethod:
    """What ``[thesis_method]`` says, or what is usual.

    Seen on ``practice-01`` (800 frames/s, 12 runs) with the usual choices: every impact above 1 m/s is found, 90 %
    between 0.6 and 1, half between 0.4 and 0.6, one in ten below; no peak without an impact.  Five points a side, the
    nearest left out, is the reading of "a few points".
    """
    return recording.settings.thesis_method or USUAL


def smoothed_acceleration(motion: pd.DataFrame, settings: ThesisMethod = USUAL) -> pd.DataFrame:
    """``frame, time_s, nes_vx_m_per_s, nes_vy_m_per_s, acceleration_m_per_s2`` on every frame from first to
    last.

    Savitzky-Golay smoothing of the NES centre, then central differences, as Sec. 7.3.3.  Missing frames are
    bridged by straight lines for the filter only; whatever its window or the differences touch of them is
    null in the result.
    """
    from scipy.signal import savgol_filter  # takes long to load, and few need it

    frames = np.arange(motion["frame"].min(), motion["frame"].max() + 1)
    full = motion.set_index("frame")[["time_s", "nes_x_m", "nes_y_m"]].reindex(frames)
    time_s = _bridged(frames, full["time_s"].to_numpy(float))
    position = full[["nes_x_m", "nes_y_m"]].to_numpy(float)
    seen = np.isfinite(position).all(1)
    out = pd.DataFrame({"frame": frames, "time_s": time_s})
    if seen.sum() <= settings.smoothing_frames + 4:
        return out.assign(nes_vx_m_per_s=np.nan, nes_vy_m_per_s=np.nan, acceleration_m_per_s2=np.nan)
    smooth = np.column_stack(
        [
            savgol_filter(_bridged(frames, column), settings.smoothing_frames, settings.polynomial_order)
            for column in position.T
        ]
    )
    velocity = np.gradient(smooth, time_s, axis=0)
    acceleration = np.linalg.norm(np.gradient(velocity, time_s, axis=0), axis=1)
    # A gap of one frame is ordinary and bridged; inside a longer one the filter sees straight lines only.
    run = np.convolve(~seen, [1, 1], "same").astype(int)
    reach = settings.smoothing_frames // 2 + 2  # the window's half, and one frame for each of the two differences
    spoilt = np.convolve((run > 1).astype(float), np.ones(2 * reach + 1), "same") > 0.5
    velocity[spoilt], acceleration[spoilt] = np.nan, np.nan
    return out.assign(nes_vx_m_per_s=velocity[:, 0], nes_vy_m_per_s=velocity[:, 1], acceleration_m_per_s2=acceleration)


def thesis_impacts(motion: pd.DataFrame, recording: Recording) -> pd.DataFrame:
    """Table ``thesis_impacts``: one row per maximum of the acceleration norm, with straight-line velocities.

    Normal speeds are positive towards the wall before and away from it after; tangential ones (contact point,
    relative to the wall, eq. (88)) are signed along e_theta.  With no angle in ``motion`` the spins, and with
    them the tangential speeds, are null.  A side with fewer than three points, or one that reaches over a
    neighbouring impact, is null: that impact has a time and no parameters.
    """
    from scipy.signal import find_peaks

    settings = method_of(recording)
    smooth = smoothed_acceleration(motion, settings)
    signal = smooth["acceleration_m_per_s2"].to_numpy(float)
    step_s = float(np.median(np.diff(smooth["time_s"]))) if len(smooth) > 1 else 1.0
    peaks, properties = find_peaks(
        np.nan_to_num(signal, nan=0.0),
        prominence=settings.prominence_m_per_s2,
        distance=max(1, round(settings.minimum_distance_s / step_s)),
    )
    state = motion.set_index("frame").reindex(smooth["frame"])
    values = np.column_stack(
        [state[name].to_numpy(float) if name in state else np.full(len(state), np.nan) for name in STATE]
    )
    if np.isnan(values[:, 5]).all():
        values[:, 5] = 0.0  # a Host whose angle nobody measured is taken not to turn
    time_s = smooth["time_s"].to_numpy(float)
    rows = []
    for i, peak in enumerate(peaks):
        lower = peaks[i - 1] if i else -1
        upper = peaks[i + 1] if i + 1 < len(peaks) else len(time_s)
        rows.append(_one_impact(time_s, values, (lower, peak, upper), recording, settings))
    table = pd.DataFrame(rows, columns=list(_one_impact_columns()))
    head = pd.DataFrame(
        {
            "impact": np.arange(len(peaks)),
            "frame": smooth["frame"].to_numpy()[peaks],
            "time_s": time_s[peaks],
            "acceleration_m_per_s2": signal[peaks],
            "prominence_m_per_s2": properties["prominences"],
        }
    )
    return pd.concat([head, table.astype(float)], axis=1)


def _one_impact_columns() -> tuple[str, ...]:
    return (
        "azimuth_rad",
        "normal_speed_before_m_per_s",
        "normal_speed_after_m_per_s",
        "tangential_speed_before_m_per_s",
        "tangential_speed_after_m_per_s",
        "spin_before_rad_per_s",
        "spin_after_rad_per_s",
        "restitution",
    )


def _one_impact(
    time_s: Array, values: Array, around: tuple[int, int, int], recording: Recording, settings: ThesisMethod
) -> tuple[float, ...]:
    lower, peak, upper = around
    skip, count = settings.points_left_out, settings.points_each_side
    before = slice(max(peak - skip - count, lower + skip + 1, 0), max(peak - skip, 0))
    after = slice(peak + skip + 1, min(peak + skip + 1 + count, upper - skip, len(time_s)))
    value_before, slope_before = _straight_lines(time_s[before] - time_s[peak], values[before])
    value_after, slope_after = _straight_lines(time_s[after] - time_s[peak], values[after])
    here = np.where(np.isfinite(values[peak]), values[peak], 0.5 * (value_before + value_after))
    normal = contact_normal(here[0:2] - here[3:5], here[5], recording)
    tangent = np.array([-normal[1], normal[0]])
    lever_nes, lever_host = _levers(recording)
    speeds = []
    for slope in (slope_before, slope_after):
        relative = slope[0:2] - slope[3:5]
        speeds.append((relative @ normal, relative @ tangent + lever_nes * slope[2] - lever_host * slope[5]))
    normal_before, normal_after = speeds[0][0], -speeds[1][0]
    restitution = normal_after / normal_before if normal_before > 0 else np.nan
    found = (
        np.arctan2(normal[1], normal[0]),
        normal_before,
        normal_after,
        speeds[0][1],
        speeds[1][1],
        slope_before[2],
        slope_after[2],
        restitution,
    )
    return tuple(float(value) for value in found)


def _straight_lines(time_s: Array, values: Array) -> tuple[Array, Array]:
    """Intercept and slope of each column by linear regression; NaN with fewer than three points."""
    value, slope = np.full(values.shape[1], np.nan), np.full(values.shape[1], np.nan)
    for j, column in enumerate(values.T):
        seen = np.isfinite(column)
        if seen.sum() >= 3:
            slope[j], value[j] = np.polyfit(time_s[seen], column[seen], 1)
    return value, slope


def contact_normal(relative_m: Array, host_angle_rad: float, recording: Recording) -> Array:
    """Unit normal (2,) from the NES towards the wall it is nearest to: circle (eq. 118), polygon side, or
    inner obstacle.
    """
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    distance = float(np.hypot(*relative_m))
    outward = relative_m / distance if distance > 0 else np.full(2, np.nan)
    if host is None:
        return outward
    if host.polygon_m is not None:
        turn = np.array(
            [
                [np.cos(host_angle_rad), -np.sin(host_angle_rad)],
                [np.sin(host_angle_rad), np.cos(host_angle_rad)],
            ]
        )
        corners = np.asarray(host.polygon_m, float) @ turn.T
        side = np.roll(corners, -1, axis=0) - corners
        normals = np.column_stack([side[:, 1], -side[:, 0]]) / np.linalg.norm(side, axis=1, keepdims=True)
        clearance = np.sum((corners - relative_m) * normals, axis=1)  # counter-clockwise: these normals point out
        outward, to_wall = normals[int(np.argmin(clearance))], float(np.min(clearance))
    else:
        to_wall = (host.inner_radius_m or np.inf) - distance
    if host.obstacle_radius_m is not None and nes is not None and distance - host.obstacle_radius_m < to_wall:
        return -relative_m / distance
    return outward


def _levers(recording: Recording) -> tuple[float, float]:
    """R_N and R_H of eq. (88).  A Host polygon turns about its centre too; its spin is small and its lever
    left out.
    """
    host, nes = recording.settings.bodies.host, recording.settings.bodies.nes
    return (
        0.0 if nes is None else nes.radius_m,
        0.0 if host is None or host.inner_radius_m is None else host.inner_radius_m,
    )


def _bridged(frames: Array, values: Array) -> Array:
    seen = np.isfinite(values)
    return np.interp(frames, frames[seen], values[seen]) if seen.any() else np.zeros(len(values))
