"""Measurement first: clocks, windows, scale, frame rate, plane and jitter, each from a residual of its own.

Lengths are held against the design, the drive's frequency against what was asked, the Host's residual against its
speed; what two views tell of clocks, windows and the plane is in :mod:`analysis.gap.measurement.two_views`.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from analysis.gap.finding import Finding, judge
from analysis.gap.measurement.two_views import two_views
from analysis.gap.series import Series
from analysis.motion.bodies import PLACEMENT_SD_M
from ovines.robust import residual_sd

Array = NDArray[np.float64]
# Residuals of the Host beyond this are outliers, not jitter: one in 16,000 of Gaussian ones.
CLIP_SD = 4.0
# The Host's fit of harmonics takes 1 to 3 % of the scatter with it (six series with known jitter).
JITTER_SHARE = 0.02


@dataclass(frozen=True, eq=False)
class MeasurementTests:
    """``lens_residual_found``: the cameras' epipolar lines show a residual of the lens (or there are no two views
    to tell).  ``lens_learnt``: points were triangulated with a field that the recordings have taught.
    """

    findings: dict[str, Finding]
    notes: list[str] = field(default_factory=list)
    lens_residual_found: bool = True
    lens_learnt: bool = False


def measurement_tests(series: Series) -> MeasurementTests:
    """All measurement tests that the series' entry allows."""
    findings: dict[str, Finding] = {}
    notes: list[str] = []
    views, lens_residual_found = two_views(series, notes)
    for finding in (_frame_rate(series), _length_scale(series), _jitter(series), *views):
        if finding is not None:
            findings[finding.effect] = finding
    learnt = series.cameras is not None and series.cameras[0].field is not None
    return MeasurementTests(findings, notes, lens_residual_found, learnt)


def _frame_rate(series: Series) -> Finding | None:
    """True over nominal frame rate: asked over seen drive frequency, mean over runs weighted by their precision."""
    pairs = [
        (
            r.excitation.frequency_hz / run.data.host.frequency_hz,
            run.data.host.omega_sd_rad_per_s / run.data.host.omega_rad_per_s,
        )
        for r, run in zip(series.recordings, series.runs, strict=True)
        if r.excitation is not None and r.excitation.frequency_hz and run.data.host.omega_rad_per_s > 0
    ]
    if not pairs:
        return None
    ratio, sd = np.array(pairs).T
    weight = 1 / np.maximum(sd, 1e-7) ** 2
    mean = float(np.sum(weight * ratio) / weight.sum())
    spread = (
        float(np.sqrt(np.sum(weight * (ratio - mean) ** 2) / weight.sum() / max(len(ratio) - 1, 1)))
        if len(ratio) > 1
        else 0.0
    )
    error = max(1 / np.sqrt(weight.sum()), spread, 1e-7)
    return judge("frame_rate_error", {"ratio": (mean, error)}, abs(mean - 1), abs(mean - 1) / error)


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
        centre = getattr(body, "centre_marker", None)
        if name == "nes" and centre in body.markers:
            # The centre marker has an effect of its own; without it the scale does not hear of that.
            keep = [m != centre for m in body.markers]
            centred, seen = design[keep] - design[keep].mean(0), layout[keep, :2] - layout[keep, :2].mean(0)
        variance = (body.layout_sd_m or PLACEMENT_SD_M) ** 2
        top += np.sum(centred * seen) / variance
        bottom += np.sum(centred**2) / variance
    if bottom == 0:
        return None
    scale, sd = top / bottom, 1 / np.sqrt(bottom)
    return judge("length_scale_error", {"scale": (float(scale), float(sd))}, abs(scale - 1), abs(scale - 1) / sd)


def _jitter(series: Series) -> Finding | None:
    """Scatter of the frames' times: variance of the Host's residual along its motion, noise plus jitter times speed
    squared.

    By maximum likelihood (weighted regression of the squares, iterated), outliers beyond 4 sd left out; the sd allows
    for noise that is correlated from frame to frame.
    """
    residuals, speeds = [], []
    for run in series.runs:
        host = run.data.host
        if host.omega_rad_per_s == 0:
            continue
        velocity = host.at(run.data.time_s, 1)[:, :2]
        axis = int(np.argmax(np.abs(velocity).max(0)))
        residual, speed = host.residual[:, axis], np.abs(velocity[:, axis])
        ok = np.isfinite(residual)
        residuals.append(residual[ok] - np.median(residual[ok]))
        speeds.append(speed[ok])
    if not residuals:
        return None
    residual, v2 = np.concatenate(residuals), np.concatenate(speeds) ** 2
    noise, slope = residual_sd(residual) ** 2, 0.0
    least = 1e-3 * noise + 1e-16
    columns = np.column_stack([np.ones(len(v2)), v2])
    for _ in range(12):
        variance = np.maximum(noise + slope * v2, least)
        near = residual**2 < CLIP_SD**2 * variance
        weighted = columns[near] / variance[near, None]
        covariance = np.linalg.pinv(weighted.T @ weighted, hermitian=True)
        noise, slope = covariance @ (weighted.T @ (residual[near] ** 2 / variance[near]))
    z = residual / np.sqrt(variance)
    lag = float(np.clip(np.mean(z[1:] * z[:-1] * (near[1:] & near[:-1])), 0.0, 0.9))
    # The squares of Gaussian noise have variance 2, and the square of its correlation.
    error = float(np.sqrt(2 * covariance[1, 1] * (1 + lag**2) / (1 - lag**2)))
    sd = float(np.sqrt(max(slope, 0.0)))
    return judge(
        "trigger_jitter",
        {"sd_s": (sd, float(np.hypot(error / (2 * max(sd, np.sqrt(error))), JITTER_SHARE * sd)))},
        sd,
        slope / error,
    )
