"""Calibration quality: reprojection error of every view, and of the recording's own points."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures.style import BLUE, CYCLE, GREY, RED, label, legend, new_figure, robust_limits

Window = tuple[float, float]
MAP = "Blues"
MOST_DOTS = 1500
ARROW_STEPS = 1.2  # length of an arrow at the 90th percentile, in steps of the grid
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


def lens_field(field: pd.DataFrame, tracks: pd.DataFrame | None, windows: Mapping[str, Window]) -> Figure:
    """What each lens model leaves over, as arrows much longer than they are, on its sd; ``windows``: left and top of
    each camera's window on its sensor [px], for the markers of ``tracks`` that taught it.
    """
    cameras = sorted(field["camera"].unique())
    figure, axes = new_figure(1, len(cameras), height_in=2.4, margins_in=(0.62, 0.62, 0.46, 0.32))
    size = np.hypot(field["du_px"], field["dv_px"]).to_numpy(float)
    sd = np.hypot(field["du_sd_px"], field["dv_sd_px"]).to_numpy(float) / np.sqrt(2)
    known = float(np.quantile(sd, 0.9))
    for ax, camera in zip(axes[0], cameras, strict=True):
        own = field[field["camera"] == camera]
        u, v = np.unique(own["u_px"]), np.unique(own["v_px"])
        rows = own.sort_values(["v_px", "u_px"])
        grid = np.hypot(rows["du_sd_px"], rows["dv_sd_px"]).to_numpy(float).reshape(len(v), len(u)) / np.sqrt(2)
        drawn = ax.pcolormesh(u, v, grid, cmap=MAP, vmin=0, vmax=known, shading="gouraud", rasterized=True)
        if tracks is not None:
            seen = tracks[tracks["camera"] == camera]
            seen = seen.iloc[:: max(1, len(seen) // MOST_DOTS)]
            left, top = windows.get(camera, (0.0, 0.0))
            ax.plot(seen["u_px"] + left, seen["v_px"] + top, ".", color="white", ms=1.5, alpha=0.6, rasterized=True)
        step = float(np.diff(u).min()) if len(u) > 1 else 1.0
        longer = ARROW_STEPS * step / max(float(np.quantile(size, 0.9)), 1e-12)
        ax.quiver(
            own["u_px"],
            own["v_px"],
            longer * own["du_px"],
            longer * own["dv_px"],
            angles="xy",
            scale_units="xy",
            scale=1,
            width=0.004,
            color=RED,
            zorder=3,
        )
        ax.set(xlim=(u[0], u[-1]), ylim=(v[-1], v[0]), aspect="equal")
        ax.locator_params(nbins=4)
        label(ax, "u on the sensor (px)", "v (px)" if ax is axes[0, 0] else "", camera, math=False)
    bar = figure.colorbar(drawn, cax=axes[0, -1].inset_axes((1.04, 0.0, 0.05, 1.0)))  # one scale for all
    bar.ax.tick_params(labelsize=7)
    bar.ax.locator_params(axis="y", nbins=4)
    bar.ax.set_title("sd (px)", fontsize=8)
    bar.outline.set_visible(False)
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
