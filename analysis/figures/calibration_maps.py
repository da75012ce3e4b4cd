"""What a calibration is worth, as pictures: where boards were seen, uncertainty over image and plane, the scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from analysis.figures.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    CYCLE,
    GREY,
    MM,
    ORANGE,
    RED,
    label,
    length_scale,
    new_figure,
)
from ovines.camera import Camera

Window = tuple[float, float, float, float]  # left, top, width, height on the sensor [px]
MAP = "viridis_r"
ARROW_SHARE = 0.04  # of the image's width: length of a residual at its 90th percentile
MOST_ARROWS = 1500
MAP_MARGINS_IN = (0.62, 0.62, 0.46, 0.32)  # room for the last map's scale at the right
SEEN_COLOUR = "#dbe7f1"
ROOM_SHARE = 0.12  # of the plane's map, left about it for what reaches beyond
EDGE_STEPS = 16  # of a window's side, whose outline on the plane ends where its rays no longer meet it
FEW_TICKS = 4  # along each axis of the scene: the labels of more run into each other


def _sensor(ax: Axes, size_px: tuple[int, int], window: Window | None) -> None:
    """The image's frame, v downwards, and the recording's window in it."""
    ax.set(xlim=(0, size_px[0]), ylim=(size_px[1], 0), aspect="equal")
    ax.tick_params(labelsize=7)
    if window is not None and window[2:] != size_px:
        left, top, width, height = window
        corners = [(left, top), (left + width, top), (left + width, top + height), (left, top + height)]
        ax.add_patch(Polygon(corners, fill=False, edgecolor=RED, lw=1.2, zorder=4))


def coverage_and_residuals(
    corners: pd.DataFrame, sizes_px: Mapping[str, tuple[int, int]], windows: Mapping[str, Window]
) -> Figure:
    """Where the board's points were seen, and their residuals, drawn much longer than they are."""
    names = list(sizes_px)
    figure, axes = new_figure(1, len(names), height_in=0.55 + 6.6 / len(names) * _shape(sizes_px))
    for ax, name in zip(axes[0], names, strict=True):
        own = corners[corners["camera"] == name]
        uv = own[["u_px", "v_px"]].to_numpy(float)
        residual = own[["residual_u_px", "residual_v_px"]].to_numpy(float)
        ax.plot(*uv.T, "s", color=SEEN_COLOUR, ms=5, mec="none", zorder=1, rasterized=True)
        typical = float(np.quantile(np.hypot(*residual.T), 0.9)) if len(own) else 1.0
        longer = ARROW_SHARE * sizes_px[name][0] / max(typical, 1e-9)
        few = slice(None, None, max(1, len(own) // MOST_ARROWS))
        ax.quiver(
            *uv[few].T, *(longer * residual[few]).T,
            angles="xy", scale_units="xy", scale=1, color=BLUE, width=0.002, headwidth=3, zorder=3,
        )  # fmt: skip
        _sensor(ax, sizes_px[name], windows.get(name))
        label(ax, "u (px)", "v (px)" if ax is axes[0, 0] else "", f"{name}: residuals × {longer:.0f}", math=False)
    return figure


def image_uncertainty(
    image: pd.DataFrame, sizes_px: Mapping[str, tuple[int, int]], windows: Mapping[str, Window]
) -> Figure:
    """Per camera: sd of the lens over the image; two halves of the views apart, and what their sd lets them be."""
    names, halves = list(sizes_px), bool(image["apart_sd_px"].notna().any())
    columns = 3 if halves else 1
    figure, axes = new_figure(
        len(names), columns, height_in=len(names) * (0.7 + 6.0 / columns * _shape(sizes_px) * (1 if halves else 0.6)),
        margins_in=MAP_MARGINS_IN, gap_in=(0.95, 0.55),
    )  # fmt: skip
    for row, name in zip(axes, names, strict=True):
        own = image[image["camera"] == name]
        apart = np.hypot(own["apart_u_px"], own["apart_v_px"])
        allowed = np.sqrt(2) * own["apart_sd_px"]
        most = float(np.nanmax([apart.quantile(0.98), allowed.quantile(0.98), 1e-6])) if halves else None
        shown: list[tuple[pd.Series, str, float | None]] = [(own["lens_sd_px"], f"{name}: lens sd (px)", None)]
        if halves:
            shown += [(apart, "halves apart (px)", most), (allowed, "foreseen (px)", most)]
        for ax, (values, title, top) in zip(row, shown, strict=True):
            _map(ax, own, "u_px", "v_px", values.to_numpy(float), figure, top)
            _sensor(ax, sizes_px[name], windows.get(name))
            label(ax, "u (px)", "v (px)" if ax is row[0] else "", title, math=False)
    return figure


def plane_uncertainty(
    plane: pd.DataFrame,
    cameras: Sequence[Camera],
    windows: Mapping[str, Window],
    ring: tuple[float, float, float] | None,
) -> Figure:
    """Sd of x, y and z of a point of the sliding plane; the windows' outlines on it, and the ring where it is known
    (x, y and radius).
    """
    figure, axes = new_figure(1, 3, height_in=2.3, margins_in=MAP_MARGINS_IN, gap_in=(1.0, 0.36))
    for ax, axis in zip(axes[0], "xyz", strict=True):
        sd_m = plane[f"{axis}_sd_m"].to_numpy(float)
        unit, factor = length_scale(sd_m)
        _map(ax, plane * MM, "x_m", "y_m", factor * sd_m, figure, None)
        for camera in cameras:
            if camera.name in windows:
                outline = _outline_on_plane(camera, windows[camera.name])
                ax.add_patch(Polygon(MM * outline, fill=False, edgecolor=RED, lw=1.0))
        if ring is not None:
            ax.add_patch(Circle((MM * ring[0], MM * ring[1]), MM * ring[2], fill=False, edgecolor=BLACK, lw=1.4))
        if len(plane):
            low, high = (MM * getattr(plane[["x_m", "y_m"]].to_numpy(float), end)(0) for end in ("min", "max"))
            room = ROOM_SHARE * (high - low).max()
            ax.set(xlim=(low[0] - room, high[0] + room), ylim=(low[1] - room, high[1] + room))
        ax.set_aspect("equal")
        ax.tick_params(labelsize=7)
        label(ax, "x (mm)", "y (mm)" if axis == "x" else "", f"sd of {axis} ({unit})", math=False)
    return figure


def scene(boards: pd.DataFrame, cameras: Sequence[Camera]) -> Figure:
    """Cameras and the boards of all views in space."""
    figure, axes = new_figure(
        1,
        1,
        height_in=5.0,
        margins_in=(0.5, 0.7, 0.45, 0.05),
        subplot_kw={"projection": "3d", "computed_zorder": False},
    )
    ax: Any = axes[0, 0]
    for c, camera in enumerate(cameras):
        colour = CYCLE[c % len(CYCLE)]
        own = boards[boards["camera"] == camera.name]
        for _, board in own.groupby("view"):
            corners = board.sort_values("corner")[["x_m", "y_m", "z_m"]].to_numpy(float)
            ax.plot(*np.vstack([corners, corners[:1]]).T, color=colour, lw=0.7, alpha=0.8)
        size_m = 0.12 * float(np.linalg.norm(camera.centre_m))
        width, height = camera.sensor_size_px
        edge = np.array([[0, 0, 1], [width, 0, 1], [width, height, 1], [0, height, 1]]) - [0.5, 0.5, 0]
        rays = np.linalg.solve(camera.matrix, edge.T).T @ camera.rotation  # a lens may have none at its corners
        far = camera.centre_m + size_m * rays / np.linalg.norm(rays, axis=-1, keepdims=True)
        for corner in far:
            ax.plot(*np.vstack([camera.centre_m, corner]).T, color=colour, lw=1.2)
        ax.plot(*np.vstack([far, far[:1]]).T, color=colour, lw=1.2)
        ax.text(*camera.centre_m, f" {camera.name}", color=colour, fontsize=8, parse_math=False)
    length_m = 0.1 * float(np.median([np.linalg.norm(camera.centre_m) for camera in cameras]))
    for axis, direction in zip("xyz", np.eye(3), strict=True):
        ax.plot(*np.vstack([0 * direction, length_m * direction]).T, color=AXIS_COLOURS[axis], lw=2)
        ax.text(*(1.15 * length_m * direction), axis, color=AXIS_COLOURS[axis], fontsize=8)
    ax.set_aspect("equal")
    ax.view_init(elev=22, azim=-70)
    ax.tick_params(labelsize=7)
    for axis in (ax.xaxis, ax.yaxis, ax.zaxis):
        axis.set_major_locator(MaxNLocator(FEW_TICKS))
    ax.set_xlabel("x (m)", fontsize=8)
    ax.set_ylabel("y (m)", fontsize=8)
    ax.set_zlabel("z (m)", fontsize=8)
    return figure


def pictures(views: Sequence[tuple[str, NDArray[Any], NDArray[Any], float]], columns: int = 4) -> Figure:
    """Small pictures of views: title, grey image, corners (n, 2) and reduction (picture pixels per sensor pixel)."""
    rows = -(-len(views) // columns)
    shape = max(image.shape[0] / image.shape[1] for _, image, _, _ in views)
    wide = (7.6 - 0.2 - 0.12 * (columns - 1)) / columns
    figure, axes = new_figure(
        rows,
        columns,
        height_in=rows * (wide * shape + 0.24) + 0.05,
        margins_in=(0.1, 0.1, 0.05, 0.24),
        gap_in=(0.12, 0.24),
    )
    for ax in axes.flat:
        ax.set_axis_off()
    for ax, (title, image, corners, reduction) in zip(axes.flat, views, strict=False):
        ax.imshow(image, cmap="gray", vmin=0, vmax=255, aspect="equal")
        ax.plot(*(reduction * corners).T, "o", color=ORANGE, ms=1.6, mec="none")
        ax.set(xlim=(-0.5, image.shape[1] - 0.5), ylim=(image.shape[0] - 0.5, -0.5))
        ax.set_title(title, fontsize=6.5, color=GREY, pad=2, parse_math=False)
    return figure


def _shape(sizes_px: Mapping[str, tuple[int, int]]) -> float:
    return max(height / width for width, height in sizes_px.values())


def _map(
    ax: Axes, table: pd.DataFrame, across: str, down: str, values: NDArray[Any], figure: Figure, most: float | None
) -> None:
    """Values over a grid of places, with the scale beside them; places without a value stay white."""
    x, y = np.unique(table[across].round(9)), np.unique(table[down].round(9))
    grid = np.full((len(y), len(x)), np.nan)
    grid[np.searchsorted(y, table[down].round(9)), np.searchsorted(x, table[across].round(9))] = values
    if len(x) < 2 or len(y) < 2:
        return
    top = most if most is not None else float(np.nanquantile(values, 0.98))
    drawn = ax.pcolormesh(x, y, grid, cmap=MAP, vmin=0, vmax=max(top, 1e-12), shading="nearest", rasterized=True)
    bar = figure.colorbar(drawn, cax=ax.inset_axes((1.04, 0.0, 0.05, 1.0)))
    bar.ax.tick_params(labelsize=7)
    bar.locator = MaxNLocator(4)
    bar.update_ticks()
    bar.outline.set_visible(False)


def _outline_on_plane(camera: Camera, window: Window) -> NDArray[np.float64]:
    """A window's outline (n, 2) on the plane z = 0, without what looks past it."""
    left, top, width, height = window
    along = np.arange(EDGE_STEPS)[:, None] / EDGE_STEPS
    corners = np.array([[left, top], [left + width, top], [left + width, top + height], [left, top + height]]) - 0.5
    border = np.concatenate([a + along * (b - a) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)])
    rays = camera.rays(border)
    rays = rays[rays[:, 2] * camera.centre_m[2] < 0]
    return np.asarray((camera.centre_m - camera.centre_m[2] / rays[:, 2:] * rays)[:, :2])
