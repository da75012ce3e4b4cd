"""Measurement first: clocks, windows, scale, frame rate, plane, jitter and blur, each from a residual of its own.

Lengths are held against the design, the drive's frequency against what was asked, the Host's residual against its
speed (:mod:`analysis.gap.measurement.speed_noise`); what two views tell of clocks, windows and the plane is in
:mod:`analysis.gap.measurement.two_views`.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.cause import Structure
from analysis.gap.finding import Finding, judge
from analysis.gap.measurement.speed_noise import speed_noise
from analysis.gap.measurement.two_views import two_views
from analysis.gap.series import Series
from ovines.recording_schema import PLACEMENT_SD_M

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MeasurementTests:
    """``lens_residual_found``: the cameras' epipolar lines show a residual of the lens (or there are no two views
    to tell).  ``lens_learnt``: points were triangulated with a field that the recordings have taught.
    ``clock_change``: the second camera's delay differs between parts of the runs; ``raised``: the NES's markers lie
    higher than their layout says.
    """

    findings: dict[str, Finding]
    notes: list[str] = field(default_factory=list)
    lens_residual_found: bool = True
    lens_learnt: bool = False
    clock_change: Structure | None = None
    raised: Structure | None = None


def measurement_tests(series: Series) -> MeasurementTests:
    """All measurement tests that the series' entry allows."""
    findings: dict[str, Finding] = {}
    notes: list[str] = []
    views = two_views(series, notes)
    for finding in (_frame_rate(series), _length_scale(series), *speed_noise(series), *views.findings):
        if finding is not None:
            # A delay that changes within a run moves the Host along its velocity, as late frames do.
            passes = views.change is not None and finding.effect == "trigger_jitter"
            findings[finding.effect] = replace(finding, found=False) if passes else finding
    learnt = series.cameras is not None and series.cameras[0].field is not None
    return MeasurementTests(findings, notes, views.seen, learnt, views.change, views.raised)


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
