"""Checks on the measured motion alone, no law of flight or contact believed: turns at the wall, peaks, drive, exposure,
the Host's path.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from analysis.checks.row import ALL, DIAGNOSE, LAW, Row, figure, row
from analysis.flights.equation.model import GRAVITY_M_PER_S2
from analysis.identification.fit import RigFit
from analysis.motion.drive import jump
from analysis.statistics.robust import smooth_noise
from analysis.walls.drawn import motion_gaps, stated_wall
from analysis.walls.wall import Wall
from ovines.plausibility.host_signal import ORDERS, dominant, scatter
from ovines.recording import Recording
from ovines.robust import residual_sd

Array = NDArray[np.float64]

# An approach counts from twice the change of speed that the Host's and a floor's acceleration make in as many frames,
# and from six sd of it.
SLOPE_FRAMES, JUMP_OVER_FORCES, JUMP_SD = 3, 2.0, 6.0
# The Host's acceleration is that of a parabola through this long on either side (s): 1 % low ((w t)^2 / 14) at 11 Hz.
PARABOLA_S, FEWEST_IN_HALF = 0.006, 3
# ... and from this speed on a ring of 40 mm (a Froude number of 0.24): slower impacts are not promised.
APPROACH_M_PER_S, RING_M = 0.15, 0.04
# ... where the disk comes this near to the wall, as a share of the contact radius.
NEAR_SHARE = 0.05
# A found impact this near (frames) explains it.
SAME_FRAMES = 2.0
# Approaches that no impact explains: on 72 clean runs of plants every one is explained, on 29 of 30 practice runs
# without an effect; one wrong frame may look like one.
EXPLAINED = 0.95
# Peaks of the thesis' method that turn the disk back at the wall, faster than this on a ring of 40 mm, and are no
# impact: its filter merges impacts a few frames apart.  On 72 clean runs of plants all are impacts or contact, on 29 of
# 30 practice runs too.
PEAK_M_PER_S, PEAKS_FOUND, PEAK_FRAMES = 0.5, 0.8, 3.0
# Measured drive against the one asked for: a shaker keeps its frequency to 1e-4 (clean runs: 2e-4 at most); its level
# to a fifth (clean runs with harmonics: 1.00 to 1.08 times).
DRIVE_HZ_SHARE, DRIVE_LEVEL_FACTOR = 0.01, 1.3
# The Host's distance from its path over the larger of its sd and what its frames scatter by, in the worst tenth of
# the run: 1.1 to 1.9 on clean runs of plants, to 2.6 on practice runs (a tenth holds few frames there); hundreds and
# more where the drive's phase jumps.
HOST_OFF, HOST_PARTS = 5.0, 10
FEWEST_HOST_FRAMES = 10
# Parabolas through the frames on either side of an instant differ by 3.7 to 8.2 robust sds at the most on 90 practice
# runs.
JUMP_SD_OF_HOST = 20.0
# A fit of the drive's frequency starts from the one asked for and may hang there: farther than this from the strongest
# sine it is wrong, if the run holds so many periods of that sine that it is not taken from the run's own length.
HZ_APART, FEWEST_PERIODS = 0.05, 4.0
# A frequency is off beyond this many sds of it, too: a short run determines it badly.
HZ_SD = 4.0
# Rounding of exposure and frame rate as they are written down.
CLOCK_SHARE = 1e-3


def check_motion(
    rig: RigFit,
    run: int,
    motion: pd.DataFrame,
    recording: Recording,
    impacts: pd.DataFrame,
    flights: pd.DataFrame,
    thesis: pd.DataFrame | None,
) -> list[Row | None]:
    """Rows on ``run``; ``motion``, ``impacts``, ``flights`` and ``thesis`` (thesis_impacts; None: not compared) are the
    world's tables of it.
    """
    return [
        _approaches(motion, recording, impacts, flights),
        _peaks(thesis, motion, recording, impacts, flights),
        *_drive(rig, run, motion, recording),
        _host_path(rig, run),
        _host_jump(rig, run),
        _exposure(recording, motion),
    ]


def approaches(motion: pd.DataFrame, wall: Wall) -> Array:
    """Times (s) at which the disk turns back from a surface of the ``wall`` faster than forces turn it: from places
    alone, no law assumed.
    """
    time = motion["time_s"].to_numpy(float)
    if len(time) < 4 * SLOPE_FRAMES:
        return np.zeros(0)
    step = float(np.median(np.diff(time)))
    forces = _host_acceleration(motion[["host_x_m", "host_y_m"]].to_numpy(float), step) + GRAVITY_M_PER_S2
    found = [one for out in motion_gaps(motion, wall).T for one in _turned_back(time, out, step, forces, wall.size_m)]
    kept: list[float] = []
    for _, moment in sorted(found, reverse=True):
        if all(abs(moment - other) > SLOPE_FRAMES * step for other in kept):
            kept.append(moment)
    return np.array(sorted(kept))


def _turned_back(time: Array, out: Array, step: float, forces: Array, size_m: float) -> list[tuple[float, float]]:
    """Change of speed and time of each approach to one surface, ``out`` (N,) past it, that turns back."""
    noise = smooth_noise(out)
    found = []
    n, span = len(out), (SLOPE_FRAMES - 1) * step
    for i in range(SLOPE_FRAMES - 1, n - SLOPE_FRAMES):
        if time[i + SLOPE_FRAMES] - time[i - SLOPE_FRAMES + 1] > (2 * SLOPE_FRAMES - 0.5) * step:
            continue  # frames are missing here
        # Between frames i and i + 1; a frame's own place may lie across the impact.
        before, after = (out[i] - out[i - SLOPE_FRAMES + 1]) / span, (out[i + SLOPE_FRAMES] - out[i + 1]) / span
        jump = before - after
        limit = max(JUMP_OVER_FORCES * forces[i] * (span + step), JUMP_SD * 2 * noise / span)
        near = max(out[i], out[i + 1]) + max(before, 0.0) * step > -NEAR_SHARE * size_m
        if before > _on_this_ring(APPROACH_M_PER_S, size_m) and after < 0 and jump > limit and near:
            found.append((jump, time[i] + 0.5 * step))
    return found


def _on_this_ring(speed_m_per_s: float, contact_radius_m: float) -> float:
    """A speed on a ring of RING_M as it is on one of this radius under the same gravity."""
    return float(speed_m_per_s * np.sqrt(contact_radius_m / RING_M))


def _host_acceleration(host: Array, step_s: float) -> Array:
    """Largest acceleration of the Host (m/s^2) around each frame, of a parabola through so many frames that noise is
    small in it.
    """
    half = max(round(PARABOLA_S / step_s), FEWEST_IN_HALF)
    t = np.arange(-half, half + 1) * step_s
    weights = np.linalg.pinv(np.vander(t, 3))[0] * 2
    columns = [
        np.convolve(np.nan_to_num(c, nan=float(np.nanmean(c)) if np.isfinite(c).any() else 0.0), weights[::-1], "same")
        for c in host.T
    ]
    size = np.hypot(*columns)
    size[:half] = size[half] if len(size) > 2 * half else 0.0
    size[-half:] = size[-half - 1] if len(size) > 2 * half else 0.0
    return np.asarray(size, float)


def _explained(times_s: Array, within_s: float, impacts: pd.DataFrame, flights: pd.DataFrame) -> NDArray[np.bool_]:
    """Which of ``times_s`` are an impact's, or lie in contact or chatter."""
    known = impacts["time_s"].to_numpy(float)
    explained = np.array([bool(len(known) and np.min(np.abs(known - t)) < within_s) for t in times_s], bool)
    held = flights[flights["kind"].isin(["contact", "chatter"])]
    for start, end in zip(held["start_s"], held["end_s"], strict=True):
        explained |= (times_s > start - within_s) & (times_s < end + within_s)
    return explained


def _approaches(motion: pd.DataFrame, recording: Recording, impacts: pd.DataFrame, flights: pd.DataFrame) -> Row:
    turned = approaches(motion, stated_wall(recording))
    name = "approaches to the wall explained"
    if not len(turned):
        return row(name, np.nan, EXPLAINED, None, "The disk never turns back from the wall fast enough to tell.")
    step = float(np.median(np.diff(motion["time_s"])))
    explained = _explained(turned, SAME_FRAMES * step, impacts, flights)
    share = float(explained.mean())
    lost = ", ".join(f"{t:.3f}" for t in turned[~explained][:5])
    holds = bool(share >= EXPLAINED or (~explained).sum() <= 1 < 0.1 * len(turned))
    return row(
        name,
        share,
        EXPLAINED,
        holds,
        f"{int(explained.sum())} of {len(turned)} times that the disk turns back from the wall are impacts or contact."
        + ("" if not lost else f" Not explained: at {lost} s."),
        ALL,
        "Look at these moments with `ovines view`; check window offsets, sds and inner_radius_m - radius_m.",
    )


def _peaks(
    thesis: pd.DataFrame | None,
    motion: pd.DataFrame,
    recording: Recording,
    impacts: pd.DataFrame,
    flights: pd.DataFrame,
) -> Row | None:
    """Peaks that turn the disk back at the wall.  Where frames are many per flight the thesis' filter shows peaks of
    noise too, in mid-flight.
    """
    if thesis is None:
        return None
    name = "peaks of the acceleration (thesis' method) that are impacts"
    wall = stated_wall(recording)
    time, out = motion["time_s"].to_numpy(float), motion_gaps(motion, wall).max(axis=1)
    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    before, after = (thesis[f"normal_speed_{side}_m_per_s"].to_numpy(float) for side in ("before", "after"))
    reach = np.array([np.nanmax(out[np.abs(time - t) < PEAK_FRAMES * step], initial=-np.inf) for t in thesis["time_s"]])
    turns = (
        (before > _on_this_ring(PEAK_M_PER_S, wall.size_m))
        & (after > 0)
        & (reach + before * step > -NEAR_SHARE * wall.size_m)
    )
    moments = thesis["time_s"].to_numpy(float)[turns]
    if not len(moments):
        return row(
            name, np.nan, PEAKS_FOUND, None, "The acceleration has no peak that turns the disk back at the wall."
        )
    explained = _explained(moments, PEAK_FRAMES * step, impacts, flights)
    share = float(explained.mean())
    holds = bool(share >= PEAKS_FOUND or (~explained).sum() <= 1)
    return row(
        name,
        share,
        PEAKS_FOUND,
        holds,
        f"{int(explained.sum())} of {len(moments)} peaks of the acceleration are among the impacts.",
        LAW,
        f"Look at the others with `ovines view`. {DIAGNOSE}.",
    )


def _drive(rig: RigFit, run: int, motion: pd.DataFrame, recording: Recording) -> list[Row]:
    asked = recording.excitation
    if asked is None or asked.axis == "z":
        return []
    frame_factor = np.sqrt(stated_wall(recording).size_m / rig.runs[run].data.contact_radius_m)
    host = rig.runs[run].data.host
    if host.moves and not host.omega_rad_per_s:
        return []  # a sweep or a random drive has no line to be held against the one asked for
    measured = host.frequency_hz / float(frame_factor)
    seen = motion[["time_s", "host_x_m", "host_y_m"]].to_numpy(float)
    seen = seen[np.isfinite(seen).all(1)]
    strongest = dominant(seen[:, 0], seen[:, 1:]) if len(seen) >= FEWEST_HOST_FRAMES else None
    sd = host.omega_sd_rad_per_s / (2 * np.pi) / float(frame_factor)
    if (
        strongest is not None
        and abs(measured / strongest[0] - 1) > HZ_APART
        and strongest[0] * np.ptp(seen[:, 0]) > FEWEST_PERIODS
    ):
        measured, sd = strongest[0], 0.0
    off, unsure = abs(measured / asked.frequency_hz - 1), HZ_SD * sd / asked.frequency_hz
    rows = [
        row(
            "drive frequency against the one asked for",
            measured,
            asked.frequency_hz,
            bool(off < max(DRIVE_HZ_SHARE, unsure)),
            f"The Host moves at {measured:.4g} Hz, [excitation] says {asked.frequency_hz:.4g} Hz.",
            ALL,
            "Check frame_rate_hz (or the trigger's times) and [excitation] frequency_hz.",
        )
    ]
    if asked.acceleration_g is not None and host.omega_rad_per_s > 0 and off < max(DRIVE_HZ_SHARE, unsure):
        level = (
            float(np.linalg.norm(host.at(np.linspace(0, 2 * np.pi / host.omega_rad_per_s, 64), 2)[:, :2], axis=1).max())
            / GRAVITY_M_PER_S2
        )
        ratio = level / asked.acceleration_g
        rows.append(
            row(
                "drive level against the one asked for",
                level,
                asked.acceleration_g,
                bool(1 / DRIVE_LEVEL_FACTOR < ratio < DRIVE_LEVEL_FACTOR),
                f"The Host is accelerated by {level:.3g} g at most, [excitation] says {asked.acceleration_g:.3g} g.",
                ALL,
                "Check frame_rate_hz, the calibration's lengths (board's square size) and [excitation] acceleration_g.",
            )
        )
    return rows


def _host_path(rig: RigFit, run: int) -> Row | None:
    """The Host must move along the path that every flight and impact is reckoned with, from the first frame to the
    last.
    """
    value = host_off(rig, run)
    if value is None:
        return None
    return row(
        "the Host's places against its path, over their scatter",
        value,
        HOST_OFF,
        value < HOST_OFF,
        f"Where it fits worst, the Host lies {figure(value)} times as far from its path as its places scatter.",
        ALL,
        "Look at the Host's path in the report: do drive, times and markers change during the recording? Split it "
        "there.",
    )


def _host_jump(rig: RigFit, run: int) -> Row | None:
    """No Host jumps from one frame to the next: where two recordings are glued, or frames are missing unsaid, it
    does."""
    data = rig.runs[run].data
    found = jump(data.time_s, data.host)
    if found is None:
        return None
    return row(
        "the Host's largest jump between frames, over its scatter",
        found.sds,
        JUMP_SD_OF_HOST,
        found.sds < JUMP_SD_OF_HOST,
        f"The Host jumps by {figure(found.sds)} times what its places scatter, {found.frame} frames after the first: "
        "its path is not that of one motion.",
        ALL,
        "Look at the Host's path in the report there: are two recordings glued, or frames missing? Split it there.",
    )


def host_off(rig: RigFit, run: int) -> float | None:
    """RMS distance of the Host from its path in the worst tenth of a run, over its scatter or its sd, the larger;
    None with too few frames.
    """
    data, places = rig.runs[run].data, rig.runs[run].host_table[:, :2]
    residual = places - data.host.at(data.time_s)[:, :2]
    frames = rig.runs[run].frame
    worst = None
    for axis in (0, 1):
        known = np.isfinite(places[:, axis])
        found = [scatter(frames[known], places[known, axis], order) for order in ORDERS]
        least = [one for one in found if one is not None and one > 0]
        if not least or known.sum() < HOST_PARTS * FEWEST_HOST_FRAMES:
            continue
        noise = np.fmax(min(least), float(np.nanmedian(rig.runs[run].host_table[known, 4 + axis])))
        size = max(residual_sd(part) for part in np.array_split(residual[known, axis], HOST_PARTS))
        worst = max(worst or 0.0, size / noise)
    return worst


def _exposure(recording: Recording, motion: pd.DataFrame) -> Row | None:
    given = [camera.exposure_s for camera in recording.cameras if camera.exposure_s is not None]
    if not given or len(motion) < 2:
        return None
    period = float(np.median(np.diff(motion["time_s"]) / np.maximum(np.diff(motion["frame"]), 1)))
    return row(
        "exposure against the frame interval",
        max(given),
        period,
        bool(max(given) <= period * (1 + CLOCK_SHARE)),
        f"Exposed for {1e3 * max(given):.3g} ms, a frame every {1e3 * period:.3g} ms.",
        ALL,
        "Check exposure_s and frame_rate_hz.",
    )
