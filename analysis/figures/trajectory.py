"""Motion: relative trajectory (thesis Figs 57, 61), angle and spin (58, 62), velocities (59, 61)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from analysis.figures.style import (
    AXIS_COLOURS,
    BLACK,
    DEG,
    GREY,
    HOST_COLOUR,
    LINE_STYLES,
    MM,
    NES_COLOUR,
    ORANGE,
    angle_scale,
    label,
    legend,
    new_figure,
    robust_limits,
    thinned,
)
from analysis.walls.drawn import drawn_wall
from analysis.walls.wall import Wall
from ovines.recording_schema import Host, Nes

Array = NDArray[np.float64]


def relative_position(motion: pd.DataFrame) -> Array:
    """NES centre seen from the Host's centre in the Host's own frame, (F, 2) m: the Host's angle is turned
    back.
    """
    relative = motion[["nes_x_m", "nes_y_m"]].to_numpy(float) - motion[["host_x_m", "host_y_m"]].to_numpy(float)
    angle = np.nan_to_num(column(motion, "host_angle_rad"), nan=0.0)
    cos, sin = np.cos(angle), np.sin(angle)
    return np.column_stack([cos * relative[:, 0] + sin * relative[:, 1], -sin * relative[:, 0] + cos * relative[:, 1]])


def column(table: pd.DataFrame, name: str) -> Array:
    """A column as floats; NaN throughout where the table lacks it."""
    return table[name].to_numpy(float) if name in table else np.full(len(table), np.nan)


def velocity(motion: pd.DataFrame, name: str, rate: str) -> Array:
    """The rate column where the table has it, else central differences of the position (NaN beside gaps)."""
    given = column(motion, rate)
    if np.isfinite(given).any() or len(motion) < 3:
        return given
    return np.gradient(column(motion, name), motion["time_s"].to_numpy(float))


def _circle(ax: Axes, radius_m: float, name: str, **style: Any) -> None:
    ax.add_patch(Circle((0, 0), MM * radius_m, fill=False, label=name, **style))


def _outlines(ax: Axes, host: Host, nes: Nes | None) -> None:
    """Wall, contact edge and obstacle as recording.toml has them."""
    if host.polygon_m is not None:
        corners = MM * np.asarray(host.polygon_m, float)
        ax.add_patch(Polygon(corners, fill=False, ec=HOST_COLOUR, lw=1.6, label="wall"))
    elif host.inner_radius_m is not None:
        _circle(ax, host.inner_radius_m, "wall", ec=HOST_COLOUR, lw=1.6)
    if host.obstacle_radius_m:
        radius = MM * host.obstacle_radius_m
        ax.add_patch(Circle((0, 0), radius, color=HOST_COLOUR, alpha=0.3, lw=0, label="obstacle"))
    if nes is not None:
        _edges(ax, drawn_wall(host, nes), "contact edge: wall − NES radius", color=HOST_COLOUR, ls="--")


def _edges(ax: Axes, wall: Wall, name: str, **style: Any) -> None:
    """The curves that the disk's centre cannot pass."""
    for k, edge in enumerate(wall.edges_m()):
        ax.plot(*(MM * edge.T), lw=1.0, label=name if k == 0 else None, **style)


def relative_trajectory(
    motion: pd.DataFrame,
    host: Host | None,
    nes: Nes | None,
    wall: Wall | None = None,
    impacts: pd.DataFrame | None = None,
) -> Figure:
    """Path of the NES centre in the Host's frame with the wall and the contact edge; the edge as the impacts put it
    where that ``wall`` is given, contacts where ``impacts`` are.

    Examples
    --------
    >>> from analysis.figures.trajectory import relative_trajectory
    >>> from ovines.notebook import analyse, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, read_calibration(recording.calibration_file), recording)
    >>> bodies = recording.settings.bodies
    >>> figure = relative_trajectory(analyse(points, recording), bodies.host, bodies.nes)
    >>> figure.axes[0].get_xlabel()
    "x from the Host's centre (mm)"
    """
    figure, axes = new_figure(1, 1, height_in=5.0, margins_in=(0.62, 2.5, 0.46, 0.12))
    ax = axes[0, 0]
    position = MM * relative_position(motion)
    ax.plot(position[:, 0], position[:, 1], color=NES_COLOUR, lw=0.8, label="NES centre")
    nes_radius = 0.0 if nes is None else nes.radius_m
    if host is not None:
        _outlines(ax, host, nes)
    if wall is not None:
        _edges(ax, wall, "contact edge from impacts", color=BLACK, ls=":")
    if impacts is not None and len(impacts):
        time_s = motion["time_s"].to_numpy(float)
        seen = np.isfinite(position).all(1)
        if seen.sum() > 1:
            x, y = (np.interp(impacts["time_s"].to_numpy(float), time_s[seen], position[seen, k]) for k in (0, 1))
            ax.plot(x, y, "o", ms=4, mfc="white", mec=BLACK, mew=0.9, label="impact", ls="none")
    if nes_radius:
        finite = position[np.isfinite(position).all(1)]
        if len(finite):
            ax.add_patch(Circle(finite[0], MM * nes_radius, fc=GREY, alpha=0.25, lw=0, label="NES at the start"))
    ax.set_aspect("equal")
    ax.autoscale_view()
    label(ax, "x from the Host's centre (mm)", "y from the Host's centre (mm)")
    legend(ax, ncols=1, loc="center left", bbox_to_anchor=(1.02, 0.5), handlelength=2.2)
    return figure


def angle_and_spin(motion: pd.DataFrame, rotation: pd.DataFrame | None = None) -> Figure:
    """NES angle by rigid fit and by marker triplets, their difference, and the spin of both: Figs 58, 62.

    ``rotation``: the table of that name; None: the rigid fit alone.

    Examples
    --------
    >>> from analysis.figures.trajectory import angle_and_spin
    >>> from ovines.notebook import analyse, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, read_calibration(recording.calibration_file), recording)
    >>> len(angle_and_spin(analyse(points, recording)).axes)
    2
    """
    rows = 3 if rotation is not None else 2
    figure, axes = new_figure(rows, 1, height_in=1.65 * rows + 0.5, sharex=True)
    time_s, angle = motion["time_s"].to_numpy(float), column(motion, "nes_angle_rad")
    unit, per_rad = angle_scale(angle)
    t, value = thinned(time_s, per_rad * angle)
    axes[0, 0].plot(t, value, color=NES_COLOUR, lw=1.2, label="rigid fit")
    spin = velocity(motion, "nes_angle_rad", "nes_spin_rad_per_s")
    t, value = thinned(time_s, spin)
    axes[1, 0].plot(t, value, color=NES_COLOUR, lw=1.0, label="rigid fit", zorder=3)
    if rotation is not None:
        clock, triplet = rotation["time_s"].to_numpy(float), column(rotation, "nes_angle_triplet_rad")
        t, value = thinned(clock, per_rad * triplet)
        axes[0, 0].plot(t, value, color=ORANGE, lw=1.0, ls="--", label="marker triplets")
        t, value = thinned(clock, np.gradient(triplet, clock) if len(clock) > 2 else triplet)
        axes[1, 0].plot(t, value, color=ORANGE, lw=0.8, label="triplets, differentiated")
        difference = 1e3 * DEG * (triplet - column(rotation, "nes_angle_fit_rad"))
        spread = 1e3 * DEG * column(rotation, "nes_angle_triplet_spread_rad")
        t, difference, spread = thinned(clock, difference, spread)
        axes[2, 0].fill_between(t, -spread, spread, color=GREY, alpha=0.3, lw=0, label="± spread of the triplets")
        axes[2, 0].plot(t, difference, color=ORANGE, lw=0.8, label="triplets − rigid fit")
        label(axes[2, 0], "time (s)", "difference (10⁻³ °)")
        limits = robust_limits(np.concatenate([difference, spread, -spread]))
        if limits:
            axes[2, 0].set_ylim(*limits)
        legend(axes[2, 0])
    label(axes[0, 0], y=f"angle ({unit})")
    label(axes[1, 0], x="time (s)" if rows == 2 else "", y="spin (rad/s)")
    limits = robust_limits(spin, share=0.002)
    if limits:
        axes[1, 0].set_ylim(*limits)
    legend(axes[0, 0])
    legend(axes[1, 0])
    return figure


def velocities(motion: pd.DataFrame) -> Figure:
    """Velocity components of NES and Host in the world frame: Figs 59, 61.

    Examples
    --------
    >>> from analysis.figures.trajectory import velocities
    >>> from ovines.notebook import analyse, read_calibration, read_recording, read_table, triangulate
    >>> recording = read_recording("sample_data/series_tilted/run-01")
    >>> tracks = read_table(recording.folder / "tracks.parquet", "tracks")
    >>> points = triangulate(tracks, read_calibration(recording.calibration_file), recording)
    >>> [axes.get_title(loc="left") for axes in velocities(analyse(points, recording)).axes]
    ['NES', 'Host']
    """
    axes_present = [a for a in "xyz" if any(np.isfinite(column(motion, f"{b}_{a}_m")).any() for b in ("nes", "host"))]
    figure, axes = new_figure(2, 1, height_in=4.2, sharex=True)
    time_s = motion["time_s"].to_numpy(float)
    for ax, body, title in zip(axes[:, 0], ("nes", "host"), ("NES", "Host"), strict=True):
        shown = []
        for k, axis in enumerate(axes_present):
            speed = velocity(motion, f"{body}_{axis}_m", f"{body}_v{axis}_m_per_s")
            shown.append(speed)
            t, speed = thinned(time_s, speed)
            ax.plot(t, speed, color=AXIS_COLOURS[axis], ls=LINE_STYLES[k], lw=1.0, label=f"v{axis}")
        limits = robust_limits(np.concatenate(shown), share=0.002) if shown else None
        if limits:
            ax.set_ylim(*limits)
        label(ax, y="velocity (m/s)", title=title)
    label(axes[1, 0], x="time (s)")
    legend(axes[0, 0])
    return figure
