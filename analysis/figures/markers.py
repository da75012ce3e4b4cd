"""Markers: tracks over a frame, coordinates (thesis Figs 54, 60), Host distances (55), circles (56)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from analysis.figures.style import (
    AXIS_COLOURS,
    CYCLE,
    FONT_PT,
    GREEN,
    GREY,
    HOST_COLOUR,
    LINE_STYLES,
    MM,
    NES_COLOUR,
    label,
    legend,
    length_scale,
    new_figure,
    robust_limits,
    thinned,
)
from analysis.motion.host_circle import marker_positions
from ovines.robust import residual_sd, spread

# White letters stay readable on white markers.
OUTLINE = [withStroke(linewidth=2, foreground="#222222")]
BODY_COLOURS = {"nes": NES_COLOUR, "host": HOST_COLOUR, "ground": GREEN}


def tracks_over_frame(
    tracks: pd.DataFrame,
    bodies: Mapping[str, Sequence[str]],
    window_px: Mapping[str, Sequence[int]],
    frames: Mapping[str, NDArray[Any]] | None = None,
) -> Figure:
    """Every marker's path in each camera's window, over a frame of it where there is one.

    ``bodies``: markers by body name, for the colours; ``window_px``: (width, height) per camera; ``frames``:
    grey image (height, width) per camera.
    """
    cameras = sorted(tracks["camera"].unique())
    sizes = [
        tuple(window_px[camera])
        if camera in window_px
        else tuple(tracks.loc[tracks["camera"] == camera, ["u_px", "v_px"]].max() + 20)
        for camera in cameras
    ]
    views = [_around(tracks[tracks["camera"] == camera], size) for camera, size in zip(cameras, sizes, strict=True)]
    height = min(sum(6.8 * (v[3] - v[2]) / (v[1] - v[0]) + 0.8 for v in views), 9.0)
    figure, axes = new_figure(len(cameras), 1, height_in=height, gap_in=(0.5, 0.7))
    body_of = {marker: body for body, markers in bodies.items() for marker in markers}
    for ax, camera, view in zip(axes[:, 0], cameras, views, strict=True):
        image = (frames or {}).get(camera)
        if image is not None:
            _show_part(ax, image, view)
        ax.grid(False)
        for marker, path in tracks[tracks["camera"] == camera].groupby("marker", sort=True):
            path = path.sort_values("frame")
            u, v = (path[c].to_numpy(float) for c in ("u_px", "v_px"))
            lost = np.flatnonzero(np.diff(path["frame"].to_numpy()) > 1) + 1
            u, v = np.insert(u, lost, np.nan), np.insert(v, lost, np.nan)
            colour = BODY_COLOURS.get(body_of.get(str(marker), ""), GREY)
            ax.plot(u, v, color=colour, lw=0.6, alpha=0.8)
            ax.plot(u[:1], v[:1], "o", ms=3.5, mfc="none", mec=colour, mew=1.0)
            ax.annotate(
                str(marker),
                (u[0], v[0]),
                xytext=(4, 4),
                textcoords="offset points",
                fontsize=FONT_PT - 1.5,
                color="white" if image is not None else "#222222",
                path_effects=OUTLINE if image is not None else None,
                parse_math=False,
            )
        ax.set(xlim=view[:2], ylim=(view[3], view[2]), aspect="equal")
        label(ax, "u (px)", "v (px)", camera, math=False)
    return figure


def _show_part(ax: Axes, image: NDArray[Any], view: tuple[float, float, float, float]) -> None:
    """The part of a frame that ``view`` shows, thinned to what a page can show, black to white of its type or
    its own range.
    """
    left, right, top, bottom = (round(edge) for edge in view)
    left, top = max(left, 0), max(top, 0)
    part = image[top : bottom + 1, left : right + 1]
    if not part.size:
        return
    step = max(1, part.shape[1] // 1400)
    brightest = 255 if image.dtype == np.uint8 else max(float(part.max()), 1.0)
    extent = (left - 0.5, left + part.shape[1] - 0.5, top + part.shape[0] - 0.5, top - 0.5)
    ax.imshow(part[::step, ::step], cmap="gray", vmin=0, vmax=brightest, extent=extent, aspect="equal")


def _around(path: pd.DataFrame, size: Sequence[float]) -> tuple[float, float, float, float]:
    """The part of the window (left, right, top, bottom) that the markers of one camera use, with a margin."""
    u, v = path["u_px"].to_numpy(float), path["v_px"].to_numpy(float)
    margin = 0.06 * max(np.ptp(u), np.ptp(v)) + 20
    return (
        max(u.min() - margin, -0.5),
        min(u.max() + margin, size[0] - 0.5),
        max(v.min() - margin, -0.5),
        min(v.max() + margin, size[1] - 0.5),
    )


def coordinates(points: pd.DataFrame, markers: Sequence[str], columns: int = 3) -> Figure:
    """x, y, z of each marker against time, each from its own median, in mm: counterpart of Figs 54 and 60.

    Examples
    --------
    >>> from analysis.figures.markers import coordinates
    >>> from ovines.notebook import read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, read_calibration(recording.calibration_file), recording)
    >>> len(coordinates(points, ["G1", "H1", "N1"]).axes)
    3
    """
    columns = min(columns, len(markers))
    rows = -(-len(markers) // columns)
    figure, axes = new_figure(
        rows,
        columns,
        height_in=0.8 + 1.35 * rows,
        margins_in=(0.55, 0.1, 0.46, 0.34),
        gap_in=(0.42, 0.3),
        sharex=True,
    )
    _, time_s, position_m = marker_positions(points, tuple(markers))
    for i, (ax, marker) in enumerate(zip(axes.flat, markers, strict=False)):
        for k, (axis, colour) in enumerate(AXIS_COLOURS.items()):
            with np.errstate(all="ignore"):
                value = MM * position_m[:, i, k]
                value = value - np.nanmedian(value) if np.isfinite(value).any() else value
            t, value = thinned(time_s, value, points=500)
            ax.plot(t, value, color=colour, lw=0.9, ls=LINE_STYLES[k], label=axis)
        last, first = i + columns >= len(markers), i % columns == 0
        label(ax, "time (s)" if last else "", "mm" if first else "", marker, math=False)
        ax.locator_params(axis="both", nbins=4)
    for ax in axes.flat[len(markers) :]:
        ax.set_visible(False)
    legend(axes[0, -1] if len(markers) >= columns else axes.flat[0])
    return figure


def distance_scatter(points: pd.DataFrame, markers: Sequence[str]) -> pd.DataFrame:
    """``pair, mean_m, sd_m, frames`` of the distances between markers of one body, which a rigid body keeps
    constant.

    The sd is robust (from the median deviation): one lost track must not speak for the whole recording.
    """
    _, _, position_m = marker_positions(points, tuple(markers))
    rows = []
    for i, j in combinations(range(len(markers)), 2):
        distance = np.linalg.norm(position_m[:, i] - position_m[:, j], axis=1)
        distance = distance[np.isfinite(distance)]
        if len(distance):
            middle = float(np.median(distance))
            rows.append(
                (
                    f"{markers[i]}–{markers[j]}",
                    middle,
                    spread(distance),
                    len(distance),
                )
            )
    return pd.DataFrame(rows, columns=["pair", "mean_m", "sd_m", "frames"])


def host_distances(points: pd.DataFrame, markers: Sequence[str]) -> Figure:
    """Each distance between Host markers minus its median, with robust sd: counterpart of Fig. 55."""
    _, time_s, position_m = marker_positions(points, tuple(markers))
    pairs = list(combinations(range(len(markers)), 2))[:12]
    columns = min(3, len(pairs))
    rows = -(-len(pairs) // columns)
    figure, axes = new_figure(
        rows,
        columns,
        height_in=0.75 + 1.3 * rows,
        margins_in=(0.75, 0.12, 0.46, 0.28),
        gap_in=(0.2, 0.3),
        sharex=True,
        sharey=True,
    )
    distances = [np.linalg.norm(position_m[:, i] - position_m[:, j], axis=1) for i, j in pairs]
    middles = [np.nanmedian(one) if np.isfinite(one).any() else np.nan for one in distances]
    unit, per_m = length_scale(*(one - middle for one, middle in zip(distances, middles, strict=True)))
    everything = [per_m * (one - middle) for one, middle in zip(distances, middles, strict=True)]
    for n, (ax, (i, j)) in enumerate(zip(axes.flat, pairs, strict=False)):
        scatter = residual_sd(everything[n])
        t, shown = thinned(time_s, everything[n], points=500)
        ax.plot(t, shown, color=CYCLE[0], lw=0.7)
        ax.axhspan(-scatter, scatter, color=CYCLE[4], alpha=0.25, lw=0)
        title = f"{markers[i]}–{markers[j]}: {MM * middles[n]:.2f} mm, sd {scatter:.2g} {unit}"
        last, first = n + columns >= len(pairs), n % columns == 0
        label(ax, "time (s)" if last else "", f"deviation ({unit})" if first else "", title, math=False)
        ax.locator_params(axis="both", nbins=4)
    limits = robust_limits(np.concatenate(everything)) if everything else None
    if limits:
        axes.flat[0].set_ylim(*limits)
    for ax in axes.flat[len(pairs) :]:
        ax.set_visible(False)
    return figure


def circle_centres(circles: pd.DataFrame) -> Figure:
    """Distances between the centres of the four three-marker circles, and of their mean from the
    least-squares one: Fig. 56.
    """
    figure, axes = new_figure(1, 2, height_in=2.9, gap_in=(0.75, 0.3), width_ratios=(2.2, 1))
    time_s = circles["time_s"].to_numpy(float)

    def centre(name: str) -> NDArray[np.float64]:
        return circles[[f"{name}_x_m", f"{name}_y_m", f"{name}_z_m"]].to_numpy(float)

    ax, names = axes[0, 0], [f"circle{k}" for k in range(1, 5)]
    pairs = list(combinations(range(4), 2))
    distances = [np.linalg.norm(centre(names[i]) - centre(names[j]), axis=1) for i, j in pairs]
    unit, per_m = length_scale(*distances)
    for n, (i, j) in enumerate(pairs):
        t, distance = thinned(time_s, per_m * distances[n], points=500)
        ax.plot(t, distance, color=CYCLE[n], lw=0.7, label=f"{i + 1}–{j + 1}")
    difference = per_m * np.linalg.norm(centre("mean") - centre("fit"), axis=1)
    t, difference = thinned(time_s, difference, points=500)
    ax.plot(t, difference, color="black", lw=1.0, label="mean–fit")
    label(ax, "time (s)", f"distance of centres ({unit})")
    limits = robust_limits(per_m * np.concatenate(distances))
    if limits:
        ax.set_ylim(0, limits[1])
    legend(ax, ncols=7, columnspacing=0.8, handlelength=1.1)
    ax = axes[0, 1]
    radii = [circles[f"{name}_radius_m"].to_numpy(float) for name in (*names, "mean", "fit")]
    middle_m = np.nanmedian(radii[-1]) if np.isfinite(radii[-1]).any() else 0.0
    unit, per_m = length_scale(*(radius - middle_m for radius in radii))
    for n, radius in enumerate(radii):
        radius = per_m * (radius[np.isfinite(radius)] - middle_m)
        if len(radius):
            low, middle, high = np.quantile(radius, [0.05, 0.5, 0.95])
            ax.plot([n, n], [low, high], color=CYCLE[0], lw=2, alpha=0.6)
            ax.plot(n, middle, "o", color=CYCLE[0], ms=4)
    ax.set_xticks(range(6), ["1", "2", "3", "4", "mean", "fit"])
    label(ax, "circle", f"radius − {MM * middle_m:.3f} mm ({unit}), 5 to 95 %")
    return figure
