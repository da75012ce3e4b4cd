"""Figures of one simulated run: paths, coordinates, velocities, impacts, energies, and what the thesis plots."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon
from numpy.typing import NDArray

from analysis.figures.style import (
    AXIS_COLOURS,
    BLACK,
    BLUE,
    DEG,
    GREEN,
    GREY,
    HOST_COLOUR,
    MM,
    NES_COLOUR,
    ORANGE,
    PURPLE,
    RED,
    SKY,
    label,
    legend,
    length_scale,
    new_figure,
    save_figure,
    shade,
)
from ovines.core import SimulationResult
from ovines.core.system.friction import farkas

Array = NDArray[np.float64]
STORED = {
    "nes_kinetic_j": ("NES sliding", BLUE), "nes_spin_j": ("NES spinning", SKY),
    "nes_potential_j": ("NES potential", GREEN), "host_kinetic_j": ("Host moving", RED),
    "host_spin_j": ("Host turning", ORANGE), "host_and_springs_j": ("Host and springs", PURPLE),
}  # fmt: skip
CHANNELS = {
    "restitution_loss_j": ("restitution", BLUE), "wall_friction_loss_j": ("wall friction", RED),
    "floor_sliding_loss_j": ("floor, sliding", GREEN), "floor_spinning_loss_j": ("floor, spinning", PURPLE),
    "drag_loss_j": ("drag", ORANGE), "damper_loss_j": ("dampers", SKY),
}  # fmt: skip
HEAVY_KG = 1e6  # a Host as heavy stands still: its own energy would hide the disk's
FAST_M_PER_S = 1e-3  # slower rebounds are lost in rounding


def make_run_figures(result: SimulationResult, folder: Path) -> list[Path]:
    """Every figure that this run has something for, PNG and SVG, in ``folder``; returns their paths.

    ``result`` of ``simulate(..., with_energies=True)``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return [
        save_figure(figure, folder / f"{name}.{ending}")
        for name, figure in figures(result)
        for ending in ("png", "svg")
    ]


def figures(result: SimulationResult) -> Iterator[tuple[str, Figure]]:
    """Name and figure, one after the other."""
    everywhere: tuple[Callable[[SimulationResult], Figure], ...] = (paths, coordinates, velocities, energies)
    for make in everywhere:
        yield make.__name__, make(result)
    if len(result.impacts):
        yield "impacts", impacts(result)
    if len(rebound_heights_m(result)) > 1:
        yield "rebound_heights", rebound_heights(result)
    if result.scenario.friction is not None:
        yield "floor_friction", floor_friction(result)


def names() -> list[str]:
    """File names that :func:`make_run_figures` may write."""
    every = ("paths", "coordinates", "velocities", "energies", "impacts", "rebound_heights", "floor_friction")
    return [f"{name}.{ending}" for name in every for ending in ("png", "svg")]


def held(result: SimulationResult) -> NDArray[np.bool_]:
    """Samples in sustained contact (n,)."""
    found = np.zeros(len(result.time_s), dtype=bool)
    for start, end in result.contacts:
        found |= (result.time_s >= start) & (result.time_s <= end)
    return found


def seen_from_host(result: SimulationResult) -> Array:
    """NES centre in the Host's own frame, turned back by its angle, (n, 2) m."""
    m = result.motion
    x, y = m["nes_x_m"] - m["host_x_m"], m["nes_y_m"] - m["host_y_m"]
    cos, sin = np.cos(m["host_angle_rad"]), np.sin(m["host_angle_rad"])
    return np.column_stack([cos * x + sin * y, cos * y - sin * x])


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
    for ax, name, factor, title in zip(
        axes[:, 0],
        ("x_m", "y_m", "angle_rad"),
        (scale, scale, DEG),
        (f"x ({unit})", f"y ({unit})", "angle (°)"),
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


def impacts(result: SimulationResult) -> Figure:
    """Impacts over time: speeds before and after, where, and what each took; after against before."""
    rows = result.impacts
    figure, axes = new_figure(3, 2, height_in=7.2, gap_in=(0.62, 0.72))
    time = rows["time_s"]
    for ax, side in ((axes[0, 0], "normal"), (axes[0, 1], "tangential")):
        before, after = rows[f"{side}_speed_before_m_per_s"], rows[f"{side}_speed_after_m_per_s"]
        ax.vlines(time, before, after, color=GREY, lw=0.5)
        ax.plot(time, before, ".", color=BLUE, ms=4, label="before")
        ax.plot(time, after, ".", color=RED, ms=4, label="after")
        ax.axhline(0.0, color=BLACK, lw=0.5)
        label(ax, "time (s)", "m/s", f"{side.capitalize()} speed")
    legend(axes[0, 1])
    _after_before(axes[1, 0], rows, "normal", "approach (m/s)", "rebound (m/s)", -1.0)
    stuck = rows["stuck"] > 0.5
    for chosen, colour, name in ((stuck, GREEN, "sticks"), (~stuck, ORANGE, "slides")):
        if chosen.any():
            _after_before(axes[1, 1], rows[chosen], "tangential", "before (m/s)", "after (m/s)", 1.0, colour, name)
    axes[1, 1].axline((0, 0), slope=1, color=GREY, lw=0.6)
    axes[1, 1].axline((0, 0), slope=-1, color=GREY, lw=0.6, ls="--")
    label(axes[1, 1], title="Tangential")
    legend(axes[1, 1])
    axes[2, 0].plot(time, np.degrees(rows["azimuth_rad"]), ".", color=BLUE, ms=4)
    axes[2, 0].set(ylim=(-185, 185), yticks=(-180, -90, 0, 90, 180))
    label(axes[2, 0], "time (s)", "azimuth (deg)", "Where")
    along = rows["wall_friction_loss_j"]
    _, scale, unit = _energy_unit(rows["energy_lost_j"])
    parts = (
        ("restitution", rows["energy_lost_j"] - along, BLUE),
        ("wall friction", along, RED),
        ("work of the wall", rows["work_j"], GREEN),
    )
    for name, values, colour in parts:
        if np.any(np.abs(values) > 0.0):
            axes[2, 1].plot(time, scale * values, ".", color=colour, ms=4, label=name)
    label(axes[2, 1], "time (s)", unit)
    legend(axes[2, 1])
    return figure


def energies(result: SimulationResult) -> Figure:
    """What is stored, and what was lost by each channel and done since the start, over time (Figs 21-28b)."""
    figure, axes = new_figure(2, 1, height_in=5.2, sharex=True)
    e = dict(result.energies)
    if result.scenario.host.motion == "sprung":  # each by itself only swings to and fro
        e["host_and_springs_j"] = np.sum(
            [e.pop(name) for name in ("host_kinetic_j", "host_spin_j", "spring_j")], axis=0
        )
    heavy = result.scenario.host.mass_kg is not None and result.scenario.host.mass_kg >= HEAVY_KG
    stored = {
        name: e[name]
        for name in STORED
        if name in e and np.any(e[name] != 0.0) and not (heavy and name.startswith("host"))
    }
    lost = {name: e[name] for name in CHANNELS if np.nanmax(np.abs(e[name]), initial=0.0) > 0.0}
    _, scale, unit = _energy_unit(*stored.values(), *lost.values(), e["work_j"])
    if len(stored) > 1:
        total = np.sum(list(stored.values()), axis=0)
        axes[0, 0].plot(e["time_s"], scale * total, color=BLACK, lw=1.3, label="together")
    for name, values in stored.items():
        axes[0, 0].plot(e["time_s"], scale * values, color=STORED[name][1], lw=0.8, label=STORED[name][0])
    for name, values in lost.items():
        axes[1, 0].plot(e["time_s"], scale * values, color=CHANNELS[name][1], lw=1.2, label=CHANNELS[name][0])
    if np.any(e["work_j"] != 0.0):
        who = "work of the ground" if result.scenario.host.motion == "sprung" else "work of the driver"
        axes[1, 0].plot(e["time_s"], scale * e["work_j"], "--", color=BLACK, lw=1.0, label=who)
    label(axes[0, 0], y=unit, title="Stored")
    label(axes[1, 0], "time (s)", unit, "Lost")
    for ax in axes[:, 0]:
        legend(ax)
    return figure


def rebound_heights_m(result: SimulationResult) -> Array:
    """Heights (m) to which a disk rises that falls along gravity onto a wall at rest, (k,); none where it does not."""
    gravity = np.hypot(*result.scenario.gravity_m_per_s2)
    rows, host = result.impacts, result.scenario.host
    heavy = host.motion == "fixed" or (host.motion == "free" and (host.mass_kg or 0.0) >= HEAVY_KG)
    straight = np.all(np.abs(rows["tangential_speed_before_m_per_s"]) < 1e-9 * (1.0 + rows[_BEFORE]))
    if gravity == 0.0 or not heavy or not straight or result.scenario.friction is not None:
        return np.zeros(0)
    speed = np.abs(rows["normal_speed_after_m_per_s"])
    return np.asarray(speed[speed > FAST_M_PER_S] ** 2 / (2.0 * gravity), dtype=float)


def rebound_heights(result: SimulationResult) -> Figure:
    """Height after each rebound, ratio of two successive ones, and its error against eps^2 (Figs 4-6)."""
    heights = rebound_heights_m(result)
    square = result.scenario.impact.restitution**2
    figure, axes = new_figure(1, 3, height_in=2.6, gap_in=(0.72, 0.4))
    rebound, ratio = np.arange(1, len(heights) + 1), heights[1:] / heights[:-1]
    axes[0, 0].semilogy(rebound, heights, ".", color=BLUE, ms=3)
    label(axes[0, 0], "rebound", "height (m)", "Height")
    axes[0, 1].plot(rebound[1:], ratio, ".", color=BLUE, ms=3, label="simulated")
    axes[0, 1].axhline(square, color=BLACK, lw=0.8, ls="--", label="restitution squared")
    axes[0, 1].set(ylim=(square - 0.1, square + 0.1))
    label(axes[0, 1], "rebound", "", "Successive ratio")
    legend(axes[0, 1], loc="lower left", bbox_to_anchor=None, ncols=1)
    error = np.abs(ratio / square - 1.0) if square > 0.0 else np.full(len(ratio), np.nan)
    axes[0, 2].semilogy(rebound[1:], np.maximum(error, 1e-17), ".", color=BLUE, ms=3)
    label(axes[0, 2], "rebound", "", "Its relative error")
    return figure


def floor_friction(result: SimulationResult) -> Figure:
    """The floor's law: share of the friction over the speed (Fig. 7), over the ratio of sliding to rim (Figs 13-17),
    and how that ratio changes by itself (Fig. 18).
    """
    friction = result.scenario.friction
    assert friction is not None
    figure, axes = new_figure(1, 3, height_in=2.8)
    slow = friction.regularisation_m_per_s
    speed = np.linspace(-6.0, 6.0, 400) * slow
    axes[0, 0].plot(MM * speed, np.tanh(speed / slow), color=BLUE, lw=1.2)
    axes[0, 0].axhline(1.0, color=GREY, lw=0.6, ls="--")
    axes[0, 0].axhline(-1.0, color=GREY, lw=0.6, ls="--")
    label(axes[0, 0], "speed (mm/s)", "share", f"Near rest, floor friction {friction.coefficient:g}")
    ratio = np.geomspace(1e-2, 1e2, 500)
    force, torque = np.array([farkas(one) for one in ratio]).T if friction.law == "farkas" else _coulomb(ratio)
    axes[0, 1].semilogx(ratio, force, color=BLUE, lw=1.2, label="sliding")
    axes[0, 1].semilogx(ratio, torque, color=RED, lw=1.2, label="spinning")
    label(axes[0, 1], "sliding speed over the rim's", "share", friction.law.capitalize())
    legend(axes[0, 1], loc="center left", bbox_to_anchor=None, ncols=1)
    change = ratio_change(ratio, force, torque, result.scenario.nes.inertia_factor)
    axes[0, 2].semilogx(ratio, change, color=BLUE, lw=1.2)
    axes[0, 2].axhline(0.0, color=GREY, lw=0.6, ls="--")
    for k in np.flatnonzero((change[:-1] > 0.0) & (change[1:] <= 0.0)):
        axes[0, 2].plot(ratio[k], 0.0, "o", color=BLACK, ms=4)
        axes[0, 2].text(1.4 * ratio[k], 0.02, f"both stop\nat once: {ratio[k]:.2f}", fontsize=7, color=BLACK)
    label(axes[0, 2], "sliding speed over the rim's", "change (1)", "How the ratio changes")
    return figure


def ratio_change(ratio: Array, force: Array, torque: Array, inertia_factor: float) -> Array:
    """How the ratio of sliding speed v to rim speed u changes where the floor alone acts, (u / (mu g)) d(ratio)/dt:
    ratio T / q - F, the f of Farkas et al. (2003) for a disk (q = 1/2).  Where it falls through zero, sliding and
    spinning end together.
    """
    return ratio * torque / inertia_factor - force


_BEFORE = "normal_speed_before_m_per_s"


def _coulomb(ratio: Array) -> tuple[Array, Array]:
    return np.ones_like(ratio), np.zeros_like(ratio)


def _length(result: SimulationResult) -> tuple[str, float]:
    """Metres for the thesis' large containers, millimetres for a rig."""
    size = result.scenario.host.radius_m or float(np.max(np.abs(result.scenario.host.polygon_m or ((1.0, 1.0),))))
    return ("m", 1.0) if size > 0.5 else length_scale(size)


def _energy_unit(*values: Array) -> tuple[str, float, str]:
    largest = max((float(np.nanmax(np.abs(one), initial=0.0)) for one in values), default=0.0)
    name, scale = next(
        ((name, scale) for name, scale in (("J", 1.0), ("mJ", 1e3), ("µJ", 1e6)) if largest * scale >= 1.0), ("µJ", 1e6)
    )
    return name, scale, f"energy ({name})"


def _after_before(
    ax: Axes, rows: NDArray[np.void], side: str, x: str, y: str, sign: float, colour: str = BLUE, name: str = ""
) -> None:
    before, after = rows[f"{side}_speed_before_m_per_s"], sign * rows[f"{side}_speed_after_m_per_s"]
    ax.plot(before, after, ".", color=colour, ms=4, label=name)
    label(ax, x, y, side.capitalize())


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
