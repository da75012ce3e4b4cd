"""A disk whose picture in one view goes with its angle: markers that glint, or are lit from one side, are found off
their places to and fro as the disk turns.

Lenses, windows and late cameras know nothing of the disk's angle; both views then miss each other by a cosine of it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from analysis.gap.cause import Structure, two_sided
from analysis.gap.measurement.body_residuals import SURE_SD, over_runs
from analysis.gap.measurement.body_rows import BodyRows, body_rows
from analysis.gap.measurement.fixed_markers import still_px
from analysis.gap.series import Series
from analysis.statistics.correlation import slow_mean
from analysis.statistics.robust import least_squares

Array = NDArray[np.float64]
# Frames and turns of a run that tell a cosine of the angle from a place; rounds of its robust fit, and what keeps that
# solvable.
FEWEST_FRAMES, FEWEST_TURNS, ROUNDS, RIDGE = 60, 1.5, 6, 1e-12
# Degree of the polynomials over the disk's places that a lens residual may be.  Waves of 53 series without a cause that
# goes with the disk's angle were at most 0.045 px, and within three of their sds.
LENS_DEGREE = 3
GOES_WITH = "the disk's angle: its markers are seen off their places in one view"


def turning_picture(series: Series) -> list[Structure]:
    """What says that the disk's markers are off by a cosine of its angle; nothing without two views."""
    if series.points is None or series.cameras is None or "epipolar_px" not in series.points[0]:
        return []
    least_px = still_px(series)
    seen = list(_runs(series))
    if not seen:
        return []
    waves = [over_runs([one[0][i] for one in seen], [one[1][i] for one in seen]) for i in range(2)]  # lines, heights
    sizes = [(float(np.hypot(*wave)), float(np.max(sd))) for wave, sd in waves]
    size, sd = max((one for one in sizes if one[0] > SURE_SD * one[1]), default=(0.0, 1.0))
    if size < least_px:
        return []
    sure = size / sd
    return [Structure("measurement", "all", "x", GOES_WITH, size / least_px, sure**2, size, "px", two_sided(sure))]


def _runs(series: Series) -> Iterator[tuple[tuple[Array, Array], tuple[Array, Array]]]:
    """Per run whose disk turns enough: cosine and sine (2,) of lines and of heights, in pixels of the second view, and
    their sds."""
    assert series.points is not None
    for points, motion, run in zip(series.points, series.motions, series.runs, strict=True):
        block = body_rows(series, points, motion, run, "nes")
        if block is None:
            continue
        angle = motion["nes_angle_rad"].to_numpy(float)[np.round(block.share * len(motion)).astype(int)]
        known = np.isfinite(angle)
        if known.sum() < FEWEST_FRAMES or np.ptp(angle[known]) < 2 * np.pi * FEWEST_TURNS:
            continue
        late = block.late()
        lines = _wave(block, angle, block.line_px, block.line_sd_px, block.line_per_px, late[0], series)
        heights = _wave(block, angle, block.height_m, block.height_sd_m, block.height_per_px, late[1], series)
        yield (lines[0], heights[0]), (lines[1], heights[1])


def _wave(
    block: BodyRows, angle: Array, value: Array, value_sd: Array, per_px: Array, late: Array, series: Series
) -> tuple[Array, Array]:
    """Cosine and sine (2,) of the angle in what lines or heights are off, over what a pixel makes of them, and sds."""
    a, b = block.x_m / series.contact_radius_m, block.y_m / series.contact_radius_m
    shapes = [a**i * b ** (n - i) for n in range(LENS_DEGREE + 1) for i in range(n + 1)]
    swing = [np.cos(block.phase_rad), np.sin(block.phase_rad)]
    unit = float(np.median(np.hypot(*per_px.T)))
    design = np.column_stack([unit * np.cos(angle), unit * np.sin(angle), *shapes, *swing, late])
    fine = np.isfinite(design).all(1) & np.isfinite(value) & np.isfinite(value_sd)
    if fine.sum() < FEWEST_FRAMES:
        return np.full(2, np.nan), np.full(2, np.inf)
    fit = least_squares(design[fine], value[fine], value_sd[fine], rounds=ROUNDS, ridge=RIDGE)
    left = np.clip(fit.residual, -3.0, 3.0)
    grown = slow_mean(left) * max(float(np.std(left)), 1.0)
    return fit.coefficients[:2], np.sqrt(np.diag(fit.covariance)[:2]) * grown
