"""What the Host's own path tells of a recording: the frequency and level of its drive, and the noise of its places."""

from __future__ import annotations

import math

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.plausibility.warning import FEWEST, G_M_PER_S2, PlausibilityWarning
from ovines.recording import Recording
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# The drive that the Host follows against the one that was asked for: shakers keep their frequency to 1e-4, and a run of
# three periods tells it to some per cent.
DRIVE_DOUBTFUL = 0.05
PERIODS = 3  # fewer periods of a drive in a run say little about its frequency
# Orders of the differences that tell noise from motion: the 6th leaves nothing of a drive at a fortieth of the frame
# rate, the 10th nothing of one at a tenth; the smaller scatter counts.
ORDERS = (6, 10)
SD_FACTOR = 2.0  # correlated noise makes the factor smaller, never larger
LEVEL_FACTOR = 1.5  # a shaker's level is set to some per cent
LEADS = 0.5  # share of the whole movement that the strongest sine must explain to be the drive
MOST_STEPS = 10_000_000  # of a clock: above, a gap is the mistake


def drive_warnings(table: pd.DataFrame, recording: Recording) -> list[str]:
    """Where the Host's measured shaking is not what ``[excitation]`` says: a wrong frame rate or scale shows here
    first.

    ``table``: motion, points or tracks.
    """
    drive = recording.excitation
    if drive is None or drive.axis == "z":
        return []
    places = host_places(table, recording)
    measured = dominant(*places) if places is not None else None
    if measured is None:
        return []
    measured_hz, amplitude = measured
    if abs(measured_hz / drive.frequency_hz - 1) > DRIVE_DOUBTFUL:
        warning = PlausibilityWarning(
            f"[excitation] frequency_hz = {drive.frequency_hz:g}",
            f"the Host shakes at {measured_hz:.4g} Hz, {measured_hz / drive.frequency_hz:.3g} times that",
            "correct frequency_hz, or frame_rate_hz (or the times) by that factor",
            ("excitation", "frequency_hz"),
        )
        return [warning.text(recording)]
    if drive.acceleration_g is None or "u_px" in table:
        return []
    level_g = amplitude * (2 * math.pi * measured_hz) ** 2 / G_M_PER_S2
    if 1 / LEVEL_FACTOR < level_g / drive.acceleration_g < LEVEL_FACTOR:
        return []
    warning = PlausibilityWarning(
        f"[excitation] acceleration_g = {drive.acceleration_g:g}",
        f"the Host shakes by {1e3 * amplitude:.3g} mm at {measured_hz:.4g} Hz, which is {level_g:.3g} g",
        "correct acceleration_g, or the lengths of the calibration",
        ("excitation", "acceleration_g"),
    )
    return [warning.text(recording)]


def host_places(table: pd.DataFrame, recording: Recording) -> tuple[Array, Array] | None:
    """Times (N,) and places (N, 2) of the Host, or of its marker seen most often: m, or px of one camera."""
    rows, columns, _ = _of_the_host(table, recording)
    values = rows[["time_s", *columns]].to_numpy(float)
    values = values[np.isfinite(values).all(1)]
    return (values[:, 0], values[:, 1:]) if len(values) >= FEWEST else None


def _of_the_host(table: pd.DataFrame, recording: Recording) -> tuple[pd.DataFrame, list[str], list[str]]:
    """Rows of the Host, or of its marker seen most often (in one camera), the columns of its place, and those of their
    sds.
    """
    if "host_x_m" in table:
        return table, ["host_x_m", "host_y_m"], ["host_x_sd_m", "host_y_sd_m"]
    host = recording.bodies.get("host")
    seen = table[table["marker"].isin(host.markers if host is not None else ())]
    if len(seen):
        seen = seen[seen["marker"] == seen["marker"].value_counts().index[0]]
    if "camera" not in seen:
        return seen, ["x_m", "y_m"], ["x_sd_m", "y_sd_m"]
    return seen[seen["camera"] == seen["camera"].iloc[0]] if len(seen) else seen, ["u_px", "v_px"], ["sd_px", "sd_px"]


def sd_warnings(table: pd.DataFrame, recording: Recording) -> list[str]:
    """Where the Host's places scatter from frame to frame far more than their sd says: nothing made from them is as
    sure as it claims.

    By high differences from frame to frame, which leave nothing of a smooth motion and much of the noise; of the Host,
    because impacts throw the NES off any smooth path.
    """
    rows, columns, sds = _of_the_host(table, recording)
    rows = rows.sort_values("frame")
    factors = []
    for column, sd in zip(columns, sds, strict=True):
        given = float(rows[sd].median()) if sd in rows and rows[sd].notna().any() else math.nan
        found = [scatter(rows["frame"].to_numpy(), rows[column].to_numpy(float), order) for order in ORDERS]
        if given > 0 and None not in found:
            factors.append(min(one for one in found if one is not None) / given)
    if not factors or max(factors) < SD_FACTOR:
        return []
    warning = PlausibilityWarning(
        f"{sds[0]} and {sds[1]}" if sds[0] != sds[1] else sds[0],
        f"the Host's places scatter {max(factors):.2g} times as much from frame to frame",
        "give the sd that the places have, or null where it is unknown: results would claim to be surer than they are",
    )
    return [warning.text(recording)]


def scatter(frames: NDArray[np.int64], values: Array, order: int) -> float | None:
    """Sd of noise that is independent from frame to frame, by differences of an ``order``; None where too few frames
    follow each other.
    """
    steps = np.diff(frames)
    if len(steps) < order + FEWEST:
        return None
    in_a_row = np.convolve(steps == 1, np.ones(order), "valid") == order
    left = np.abs(np.diff(values, order))[in_a_row]
    left = left[np.isfinite(left)]
    if len(left) < FEWEST:
        return None
    return residual_sd(left) / math.sqrt(math.comb(2 * order, order))


def dominant(times_s: Array, places: Array) -> tuple[float, float] | None:
    """Frequency [Hz] and amplitude (unit of ``places``, (N, axes)) of the strongest sine; None where none clearly
    leads.
    """
    at = times_s - times_s[0]
    span_s, step_s = float(at[-1]), float(np.median(np.diff(at)))
    moved = places - places.mean(0)
    total = float((moved**2).sum())
    if span_s <= 0 or step_s <= 0 or total == 0.0 or not FEWEST <= span_s / step_s <= MOST_STEPS:
        return None
    even_s = np.arange(0.0, span_s, step_s)  # gaps are bridged: for the coarse place of the peak alone
    power = np.sum([np.abs(np.fft.rfft(np.interp(even_s, at, axis))) ** 2 for axis in moved.T], 0)
    if len(power) <= PERIODS:
        return None
    bin_hz = 1.0 / (len(even_s) * step_s)
    coarse_hz = (PERIODS + int(np.argmax(power[PERIODS:]))) * bin_hz
    fine_hz = coarse_hz + np.arange(-10, 11) * 0.1 * bin_hz
    tried = [_explained(hz, at, moved) for hz in fine_hz]
    best = int(np.argmax([gain for gain, _ in tried]))
    return (float(fine_hz[best]), tried[best][1]) if tried[best][0] >= LEADS * total else None


def _explained(hz: float, at: Array, moved: Array) -> tuple[float, float]:
    """Squares that a sine of this frequency takes from ``moved``, and its amplitude along the longer axis of its
    path.
    """
    waves = np.stack([np.cos(2 * np.pi * hz * at), np.sin(2 * np.pi * hz * at), np.ones(len(at))], -1)
    fit = np.linalg.lstsq(waves, moved, rcond=None)[0]
    return float(((waves[:, :2] @ fit[:2]) ** 2).sum()), float(np.linalg.svd(fit[:2], compute_uv=False)[0])
