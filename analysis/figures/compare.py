"""Measured against simulated: flights, impacts, whole runs."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, BLUE, DEG, GREY, MM, RED, label, legend, new_figure

QUANTITIES = {
    "impact_rate_hz": ("impacts per second", 1.0),
    "normal_speed_m_per_s": ("normal speed before an impact (m/s)", 1.0),
    "energy_j": ("kinetic energy (mJ)", 1e3),
    "azimuth_rad": ("azimuth of the impacts (°)", DEG),
}


def flights_ahead(flights: pd.DataFrame) -> Figure:
    """RMS error of each flight predicted from the impact before it, over time and against its length."""
    figure, axes = new_figure(1, 2, height_in=2.6, gap_in=(0.3, 0.3), sharey=True)
    error = MM * flights["rms_m"].to_numpy(float)
    axes[0, 0].plot(flights["start_s"], error, "o", color=BLUE, ms=4)
    axes[0, 1].plot(1e3 * (flights["end_s"] - flights["start_s"]), error, "o", color=BLUE, ms=4)
    label(axes[0, 0], "time (s)", "error of the flight (mm RMS)")
    label(axes[0, 1], "length of the flight (ms)")
    axes[0, 0].set_ylim(bottom=0)
    return figure


def impacts_ahead(impacts: pd.DataFrame) -> Figure:
    """Simulated against measured values after each impact; the line is perfect agreement."""
    shown = (
        ("normal_speed_after_m_per_s", "normal speed (m/s)"),
        ("tangential_speed_after_m_per_s", "tangential speed (m/s)"),
        ("spin_after_rad_per_s", "spin (rad/s)"),
    )
    figure, axes = new_figure(1, 3, height_in=2.7, gap_in=(0.55, 0.3))
    for ax, (name, title) in zip(axes[0], shown, strict=True):
        measured, simulated = impacts[name].to_numpy(float), impacts[f"simulated_{name}"].to_numpy(float)
        ax.plot(measured, simulated, "o", color=BLUE, ms=3.5, alpha=0.8)
        both = np.concatenate([measured, simulated])
        both = both[np.isfinite(both)]
        if len(both):
            ends = [both.min(), both.max()]
            ax.plot(ends, ends, color=BLACK, lw=0.8)
        label(ax, "measured", "simulated" if ax is axes[0, 0] else "", title=title)
    return figure


def run_distributions(samples: dict[str, tuple[NDArray[np.float64], NDArray[np.float64]]]) -> Figure:
    """Cumulative distributions of the whole run's quantities, measured and over the simulated runs."""
    names = [name for name in QUANTITIES if name in samples]
    figure, axes = new_figure(1, len(names), height_in=2.7, gap_in=(0.25, 0.3), sharey=True)
    for ax, name in zip(axes[0], names, strict=True):
        title, scale = QUANTITIES[name]
        measured, simulated = (scale * np.sort(values[np.isfinite(values)]) for values in samples[name])
        ax.plot(simulated, np.linspace(0, 1, len(simulated)), color=RED, lw=1.2, ls="--", label="simulated")
        if len(measured) == 1:
            ax.axvline(measured[0], color=BLUE, lw=1.4, label="measured")
        else:
            ax.step(measured, np.linspace(0, 1, len(measured)), color=BLUE, lw=1.4, label="measured", where="post")
        ax.axhline(0.5, color=GREY, lw=0.5)
        ax.locator_params(axis="x", nbins=4)
        ax.set_xlabel(title, fontsize=8)
    label(axes[0, 0], y="share below")
    legend(axes[0, -1])
    return figure
