"""Impacts of one simulated run, and the heights to which a falling disk rises again."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    RED,
    label,
    legend,
    new_figure,
)
from analysis.simulations.energy_figure import HEAVY_KG, energy_unit
from ovines.core import SimulationResult

Array = NDArray[np.float64]
FAST_M_PER_S = 1e-3  # slower rebounds are lost in rounding
_BEFORE = "normal_speed_before_m_per_s"


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
    _, scale, unit = energy_unit(rows["energy_lost_j"])
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


def _after_before(
    ax: Axes, rows: NDArray[np.void], side: str, x: str, y: str, sign: float, colour: str = BLUE, name: str = ""
) -> None:
    before, after = rows[f"{side}_speed_before_m_per_s"], sign * rows[f"{side}_speed_after_m_per_s"]
    ax.plot(before, after, ".", color=colour, ms=4, label=name)
    label(ax, x, y, side.capitalize())
