"""Paths, coordinates and velocities of one simulated run."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from analysis.figures.style import (
    AXIS_COLOURS,
    BLACK,
    GREY,
    HOST_COLOUR,
    NES_COLOUR,
    RED,
    angle_scale,
    label,
    legend,
    length_scale,
    new_figure,
    shade,
)
from ovines.core import SimulationResult

Array = NDArray[np.float64]


def paths(result: SimulationResult) -> Figure:
    """Path in the room with the Host's, and path seen from the Host with walls and impacts (thesis Figs 2a, 3a)."""
    figure, axes = new_figure(1, 2, height_in=4.0)
    room, ring = axes[0]
    m = result.motion
    unit, scale = _length(result)
    room.plot(scale * m["nes_x_m"], scale * m["nes_y_m"], color=NES_COLOUR, lw=0.8, label="NES")
    room.plot(scale * m["host_x_m"], scale * m["host_y_m"], color=HOST_COLOUR, lw=1.2, label="Host")
    room.plot(scale * m["nes_x_m"][0], scale * m["nes_y_m"][0], "o", color=NES_COLOUR, ms=4)
    label(room, f"x ({unit})", f"y ({unit})", "In the room")
    legend(room)
    seen = scale * seen_from_host(result)
    ring.plot(*seen.T, color=NES_COLOUR, lw=0.8)
    ring.plot(*seen[0], "o", color=NES_COLOUR, ms=4)
    along = np.where(held(result)[:, None], seen, np.nan)
    if np.isfinite(along).any():
        ring.plot(*along.T, color=RED, lw=1.8, label="held")
    _draw_walls(ring, result, scale)
    label(ring, f"x ({unit})", f"y ({unit})", "From the Host")
    legend(ring)
    for ax in (room, ring):
        ax.set_aspect("equal", adjustable="datalim")
    return figure


def coordinates(result: SimulationResult) -> Figure:
    """Coordinates and angles over time (Figs 2b, 3b, 28b)."""
    figure, axes = new_figure(3, 1, height_in=5.4, sharex=True)
    unit, scale = _length(result)
    of_angle, per_rad = angle_scale([result.motion["nes_angle_rad"], result.motion["host_angle_rad"]])
    for ax, name, factor, title in zip(
        axes[:, 0],
        ("x_m", "y_m", "angle_rad"),
        (scale, scale, per_rad),
        (f"x ({unit})", f"y ({unit})", f"angle ({of_angle})"),
        strict=True,
    ):
        for body, colour in (("nes", NES_COLOUR), ("host", HOST_COLOUR)):
            shown = {"nes": "NES", "host": "Host"}[body]
            ax.plot(result.time_s, factor * result.motion[f"{body}_{name}"], color=colour, lw=0.9, label=shown)
        _mark_contacts(ax, result)
        label(ax, y=title)
    label(axes[0, 0], title="Coordinates")
    label(axes[2, 0], x="time (s)")
    legend(axes[0, 0])
    return figure


def velocities(result: SimulationResult) -> Figure:
    """NES relative to the Host over time: along x, along y, and its rim by turning (Figs 34b, 35b)."""
    figure, axes = new_figure(3, 1, height_in=5.4, sharex=True)
    m, radius = result.motion, result.scenario.nes.radius_m
    spin = m["nes_spin_rad_per_s"] - m["host_spin_rad_per_s"]
    shown = (
        ("along x (m/s)", m["nes_vx_m_per_s"] - m["host_vx_m_per_s"], AXIS_COLOURS["x"]),
        ("along y (m/s)", m["nes_vy_m_per_s"] - m["host_vy_m_per_s"], AXIS_COLOURS["y"]),
        ("rim: R spin (m/s)", radius * spin, AXIS_COLOURS["z"]),
    )
    for ax, (title, values, colour) in zip(axes[:, 0], shown, strict=True):
        ax.plot(result.time_s, values, color=colour, lw=0.9)
        _mark_contacts(ax, result)
        label(ax, y=title)
    label(axes[0, 0], title="NES relative to the Host")
    label(axes[2, 0], x="time (s)")
    legend(axes[0, 0])
    return figure


def seen_from_host(result: SimulationResult) -> Array:
    """NES centre in the Host's own frame, turned back by its angle, (n, 2) m."""
    m = result.motion
    x, y = m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"]
    cos, sin = np.cos(m["host_angle_rad"]), np.sin(m["host_angle_rad"])
    return np.column_stack([cos * x + sin * y, cos * y - sin * x])


def held(result: SimulationResult) -> NDArray[np.bool_]:
    """Samples in sustained contact (n,)."""
    found = np.zeros(len(result.time_s), dtype=bool)
    for start, end in result.contacts:
        found |= (result.time_s >= start) & (result.time_s <= end)
    return found


def _length(result: SimulationResult) -> tuple[str, float]:
    """Metres for the thesis' large containers, millimetres for a rig."""
    size = result.scenario.host.radius_m or float(np.max(np.abs(result.scenario.host.polygon_m or ((1.0, 1.0),))))
    return ("m", 1.0) if size > 0.5 else length_scale(size)


def _mark_contacts(ax: Axes, result: SimulationResult) -> None:
    if not any(np.any(line.get_ydata()) for line in ax.lines):  # nothing but zero: no scale of rounding
        ax.set_ylim(-1.0, 1.0)
    shade(ax, [(float(start), float(end)) for start, end in result.contacts], "held by the wall")
    if 0 < len(result.impacts) <= 200:
        ax.plot(
            result.impacts["time_s"], np.zeros(len(result.impacts)), "|", color=BLACK, ms=6, mew=0.7,
            transform=ax.get_xaxis_transform(), label="impact",
        )  # fmt: skip


def _draw_walls(ax: Axes, result: SimulationResult, scale: float) -> None:
    """The wall, where the NES' centre may go, and the cylinder."""
    host, nes_m = result.scenario.host, result.scenario.nes.radius_m
    if host.radius_m is not None:
        ax.add_patch(Circle((0, 0), scale * host.radius_m, fill=False, ec=BLACK, lw=1.0))
        ax.add_patch(Circle((0, 0), scale * (host.radius_m - nes_m), fill=False, ec=GREY, lw=0.7, ls="--"))
    if host.polygon_m is not None:
        ax.add_patch(Polygon(scale * np.asarray(host.polygon_m), fill=False, ec=BLACK, lw=1.0))
    if host.obstacle_radius_m is not None:
        ax.add_patch(Circle((0, 0), scale * host.obstacle_radius_m, fc="#d9dde2", ec=BLACK, lw=1.0))
    at = result.impacts["azimuth_rad"]
    if host.radius_m is not None and len(at) and host.obstacle_radius_m is None:
        turned = at - np.interp(result.impacts["time_s"], result.time_s, result.motion["host_angle_rad"])
        ax.plot(*(scale * host.radius_m * np.array([np.cos(turned), np.sin(turned)])), ".", color=RED, ms=3,
                label="impact")  # fmt: skip
    ax.autoscale_view()
