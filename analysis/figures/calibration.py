"""Calibration quality: reprojection error of every view, and of the recording's own points."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures.style import BLUE, CYCLE, GREY, RED, label, legend, new_figure, robust_limits

SMALL_PX = 0.05  # below, ticks in px would be so long that they meet the axis' label


def view_errors(views: pd.DataFrame) -> Figure:
    """RMS reprojection error of each view of the board; dropped views hollow."""
    cameras = sorted(views["camera"].unique())
    figure, axes = new_figure(1, len(cameras), height_in=2.6, sharey=True)
    unit, per_px = ("0.001 px", 1e3) if views["rms_px"].max() < SMALL_PX else ("px", 1.0)
    for ax, camera in zip(axes[0], cameras, strict=True):
        table = views[views["camera"] == camera].reset_index(drop=True)
        used = table["used"].to_numpy(bool)
        rms = per_px * table["rms_px"].to_numpy(float)
        ax.bar(np.flatnonzero(used), rms[used], color=BLUE, label="used")
        if not used.all():
            ax.bar(np.flatnonzero(~used), rms[~used], fill=False, edgecolor=RED, hatch="//", label="dropped")
        label(ax, "view", f"RMS error ({unit})" if ax is axes[0, 0] else "", camera, math=False)
        legend(ax)
    return figure


def reprojection(points: pd.DataFrame) -> Figure:
    """Reprojection error of the triangulated markers: over time, and its distribution by marker.

    Examples
    --------
    >>> from analysis.figures.calibration import reprojection
    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, read_calibration(recording.calibration_file), recording)
    >>> reprojection(points).axes[0].get_ylabel()
    'median reprojection (px)'
    """
    figure, axes = new_figure(1, 2, height_in=2.6, width_ratios=(1.6, 1), gap_in=(0.8, 0.6))
    by_frame = points.groupby("time_s")["reprojection_px"].median()
    limits = robust_limits(points["reprojection_px"], share=0.01)
    unit, per_px = ("0.001 px", 1e3) if limits is not None and limits[1] < SMALL_PX else ("px", 1.0)
    axes[0, 0].plot(by_frame.index, per_px * by_frame.to_numpy(float), color=BLUE, lw=0.8)
    label(axes[0, 0], "time (s)", f"median reprojection ({unit})")
    axes[0, 0].set_ylim(bottom=0)
    markers = sorted(points["marker"].unique())
    for n, marker in enumerate(markers):
        error = points.loc[points["marker"] == marker, "reprojection_px"].dropna().to_numpy(float)
        if len(error):
            low, middle, high = per_px * np.quantile(error, [0.05, 0.5, 0.95])
            axes[0, 1].plot([n, n], [low, high], color=GREY, lw=2)
            axes[0, 1].plot(n, middle, "o", color=CYCLE[0], ms=3.5)
    axes[0, 1].set_xticks(
        range(len(markers)), markers, fontsize=7, rotation=90 if len(markers) > 8 else 0, parse_math=False
    )
    label(axes[0, 1], "marker", f"5 to 95 % ({unit})")
    if limits:
        axes[0, 1].set_ylim(0, per_px * limits[1])
    return figure
