"""Measurement first: clocks, windows, scale, frame rate, plane, jitter and blur, each from a residual of its own.

Lengths are held against the design, the drive's frequency against what was asked, the Host's residual against its
speed (:mod:`analysis.gap.measurement.speed_noise`); what two views tell of clocks, windows and the plane is in
:mod:`analysis.gap.measurement.two_views`.
"""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from analysis.gap.by_run import ByRun
from analysis.gap.cause import THAN_STATED, Structure, two_sided
from analysis.gap.finding import Finding, judge
from analysis.gap.measurement.speed_noise import speed_noise
from analysis.gap.measurement.two_views import two_views
from analysis.gap.series import Series, layouts_of
from analysis.gap.thresholds import NEGLIGIBLE, SIGNIFICANCE
from ovines.recording_schema import PLACEMENT_SD_M

Array = NDArray[np.float64]
# No drive's frequency is known better than to this share.
LEAST_RATIO_SD = 1e-7
# Two markers lie along a line: they say nothing of what is across.
MARKERS_OF_A_LINE = 2


@dataclass(frozen=True, eq=False)
class MeasurementTests:
    """``lens_residual_found``: the cameras' epipolar lines show a residual of the lens (or there are no two views
    to tell).  ``lens_learnt``: points were triangulated with a field that the recordings have taught.
    ``clock_change``: the second camera's delay differs between parts of the runs; ``misprinted``: markers
    that lie on their body otherwise than ``layout_m`` says.
    """

    findings: dict[str, Finding]
    notes: list[str] = field(default_factory=list)
    lens_residual_found: bool = True
    lens_learnt: bool = False
    clock_change: Structure | None = None
    misprinted: tuple[Structure, ...] = ()


def measurement_tests(series: Series) -> MeasurementTests:
    """All measurement tests that the series' entry allows."""
    findings: dict[str, Finding] = {}
    notes: list[str] = []
    views, strains = two_views(series, notes), _strains(series, series.layouts)
    for finding in (_frame_rate(series), _length_scale(series, strains), *speed_noise(series), *views.findings):
        if finding is not None:
            # A delay that changes within a run moves the Host along its velocity, as late frames do.
            passes = views.change is not None and finding.effect == "trigger_jitter"
            findings[finding.effect] = replace(finding, found=False) if passes else finding
    learnt = _is_learnt(series)
    misprinted = (*([] if learnt else _printed(strains)), *((views.raised,) if views.raised is not None else ()))
    return MeasurementTests(findings, notes, views.seen, learnt, views.change, misprinted)


def _is_learnt(series: Series) -> bool:
    """Whether points were triangulated with a lens field that the recordings have taught."""
    return series.cameras is not None and series.cameras[0].field is not None


def _frame_rate(series: Series) -> Finding | None:
    """True over nominal frame rate: asked over seen drive frequency, mean over runs weighted by their precision."""
    pairs = [
        (
            r.excitation.frequency_hz / run.data.host.frequency_hz,
            run.data.host.omega_sd_rad_per_s / run.data.host.omega_rad_per_s,
        )
        if r.excitation is not None and r.excitation.frequency_hz and run.data.host.omega_rad_per_s > 0
        else (1.0, np.inf)  # says nothing
        for r, run in zip(series.recordings, series.runs, strict=True)
    ]
    ratio, sd = np.array(pairs).T
    known = np.count_nonzero(np.isfinite(sd))
    if not known:
        return None
    sd = np.maximum(sd, LEAST_RATIO_SD)
    weight = 1 / sd**2
    mean = float(np.sum(weight * ratio) / weight.sum())
    spread = float(np.sqrt(np.sum(weight * (ratio - mean) ** 2) / weight.sum() / max(known - 1, 1)))
    error = max(1 / np.sqrt(weight.sum()), spread, LEAST_RATIO_SD)
    found = judge("frame_rate_error", {"ratio": (mean, error)}, abs(mean - 1), abs(mean - 1) / error)
    return replace(found, by_run=ByRun.of_estimates(ratio - 1, sd))


@dataclass(frozen=True, eq=False)
class _Strain:
    """How much longer a body's markers lie apart than their design says: the ``mean`` of all directions, the direction
    of the ``most`` and of the ``least`` change, their difference's ``apart_sd``, and the mean's ``sd``; where the
    ``most`` is, in the body (rad)."""

    mean: float
    most: float
    least: float
    sd: float
    apart_sd: float
    most_rad: float

    @property
    def one_way(self) -> bool:
        """Whether they lie farther apart along one direction than across it: a printer that stretches its sheets."""
        apart = self.most - self.least
        return abs(apart) > max(SIGNIFICANCE * self.apart_sd, NEGLIGIBLE["length_scale_error"])


def _strains(series: Series, layouts: Mapping[str, Array] | None) -> dict[str, _Strain]:
    """Of the bodies with a design in ``layout_m``, from their markers' places ``layouts`` as they were seen.  A lens
    field that was learnt stretches the Host, which never turns, as a printer does: ``one_way`` is then said of none."""
    strains, learnt = {}, _is_learnt(series)
    for name, layout in (layouts or {}).items():
        body = series.recordings[0].bodies[name]
        if body.layout_m is None:
            continue
        centre = getattr(body, "centre_marker", None)
        # The centre marker has an effect of its own; without it the scale does not hear of that.
        keep = [name != "nes" or m != centre for m in body.markers]
        design, seen = (one[keep, :2] - one[keep, :2].mean(0) for one in (np.asarray(body.layout_m, float), layout))
        sd_m, square = body.layout_sd_m or PLACEMENT_SD_M, float(np.sum(design**2))
        if square == 0.0:
            continue
        mean, sd = float(np.sum(design * (seen - design))) / square, sd_m / np.sqrt(square)
        most = least = mean
        apart_sd, most_rad = np.inf, 0.0
        if (
            not learnt
            and len(design) > MARKERS_OF_A_LINE
            and np.linalg.matrix_rank(design, tol=1e-3 * np.sqrt(square)) == 2
        ):
            change = np.linalg.lstsq(design, seen - design, rcond=None)[0]
            values, ways = np.linalg.eigh(0.5 * (change + change.T))
            order = np.argsort(np.abs(values))
            least, most = (float(v) for v in values[order])
            apart_sd = sd_m * np.sqrt(float(np.trace(np.linalg.inv(design.T @ design))))
            most_rad = float(np.arctan2(*ways[::-1, order[1]]))
        strains[name] = _Strain(mean, most, least, float(sd), float(apart_sd), most_rad)
    return strains


def _length_scale(series: Series, strains: Mapping[str, _Strain]) -> Finding | None:
    """Reported over true length, from the markers' places against their design (both bodies), across what a printer has
    stretched."""
    if not strains:
        return None
    stretched = [name for name, s in strains.items() if s.one_way]
    mean, sd = _mean_strain(strains, stretched)
    found = judge("length_scale_error", {"scale": (1.0 + mean, sd)}, abs(mean), abs(mean) / sd)
    if not found.found or series.points is None:
        return found
    runs = zip(series.recordings, series.points, strict=True)
    each = [_mean_strain(_strains(series, layouts_of([r], [points])), stretched)[0] for r, points in runs]
    # Where markers were glued is drawn once for all runs.
    by_run = ByRun.of_estimates(np.array(each), np.full(len(each), sd * np.sqrt(len(each))))
    return replace(found, by_run=by_run)


def _mean_strain(strains: Mapping[str, _Strain], stretched: Container[str]) -> tuple[float, float]:
    """Mean over the bodies, with its sd; of those that a printer has ``stretched``, the strain across that."""
    scale, weight = np.array([(s.least if name in stretched else s.mean, s.sd**-2.0) for name, s in strains.items()]).T
    return float(np.sum(scale * weight) / weight.sum()), float(weight.sum() ** -0.5)


def _printed(strains: Mapping[str, _Strain]) -> list[Structure]:
    """Markers that were printed in another shape or size than ``layout_m`` says: along one direction of a body, or of
    the NES and not of the Host.  No length scale does this."""
    one_way = [(name, s) for name, s in strains.items() if s.one_way]
    if one_way:
        name, s = max(one_way, key=lambda each: abs(each[1].most - each[1].least) / each[1].apart_sd)
        way = f"along one direction of it ({np.degrees(s.most_rad) % 180.0:.0f} degrees)"
        return [_misprint(name, s.most - s.least, s.apart_sd, way)]
    if len(strains) > 1:
        nes, host = strains["nes"], strains["host"]
        apart, sd = nes.mean - host.mean, float(np.hypot(nes.sd, host.sd))
        if abs(apart) > max(SIGNIFICANCE * sd, NEGLIGIBLE["length_scale_error"]):
            return [_misprint("nes", apart, sd, "as the Host's do not")]
    return []


def _misprint(body: str, strain: float, sd: float, way: str) -> Structure:
    who, farther = {"nes": "NES", "host": "Host"}[body], "farther apart" if strain > 0 else "closer together"
    return Structure(
        "measurement",
        "all",
        "x",
        f"the {who}'s markers, which lie {100 * abs(strain):.2g} % {farther} {THAN_STATED}, {way}",
        abs(strain) / max(NEGLIGIBLE["length_scale_error"], SIGNIFICANCE * sd),
        (strain / sd) ** 2,
        abs(strain),
        "1",
        two_sided(abs(strain) / sd),
    )
