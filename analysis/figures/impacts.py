"""Impacts: detection (thesis Fig. 63), restitution by both methods (Table 16), error map with its L (Fig.
64).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    BLUE,
    GREEN,
    MM,
    ORANGE,
    RED,
    label,
    legend,
    new_figure,
    robust_limits,
    shade,
    thinned,
)
from analysis.figures.trajectory import column

Array = NDArray[np.float64]


def impact_detection(
    motion: pd.DataFrame,
    smooth: pd.DataFrame,
    thesis: pd.DataFrame,
    impacts: pd.DataFrame | None,
    contacts_s: Sequence[tuple[float, float]] = (),
) -> Figure:
    """Acceleration norm with its maxima, and the NES coordinates with the impact times of both methods."""
    figure, axes = new_figure(2, 1, height_in=4.4, sharex=True, height_ratios=(1, 1.2))
    t, norm = thinned(smooth["time_s"], smooth["acceleration_m_per_s2"])
    axes[0, 0].plot(t, norm, color=BLUE, lw=0.9)
    axes[0, 0].plot(thesis["time_s"], thesis["acceleration_m_per_s2"], "v", color=ORANGE, ms=5, label="maxima (thesis)")
    label(axes[0, 0], y="acceleration norm (m/s²)")
    axes[0, 0].set_ylim(bottom=0)
    time_s = motion["time_s"].to_numpy(float)
    for axis, style in (("x", "-"), ("y", "--")):
        t, value = thinned(time_s, MM * column(motion, f"nes_{axis}_m"))
        axes[1, 0].plot(t, value, color=BLUE, ls=style, lw=1.0, label=f"NES {axis}")
    t, value = thinned(time_s, MM * column(motion, "host_x_m"))
    axes[1, 0].plot(t, value, color=RED, lw=0.7, label="Host x")
    if impacts is not None:
        for ax in axes[:, 0]:
            for i, time in enumerate(impacts["time_s"]):
                ax.axvline(time, color=GREEN, lw=0.7, alpha=0.8, label="impacts (flight model)" if i == 0 else None)
    for ax in axes[:, 0]:
        shade(ax, contacts_s, "sustained contact")
        legend(ax)
    label(axes[1, 0], "time (s)", "position (mm)")
    return figure


def restitution_by_both(
    impacts: pd.DataFrame | None, thesis: pd.DataFrame, restitution: float, restitution_sd: float
) -> Figure:
    """Restitution of each impact against its normal speed, by flight model and by straight lines."""
    figure, axes = new_figure(1, 2, height_in=3.0, gap_in=(0.25, 0.3), sharey=True)
    for ax, x_name, x_label in (
        (axes[0, 0], "time_s", "time (s)"),
        (axes[0, 1], "normal_speed_before_m_per_s", "normal speed before (m/s)"),
    ):
        ax.plot(
            thesis[x_name],
            thesis["restitution"],
            "v",
            color=ORANGE,
            ms=5,
            alpha=0.9,
            ls="none",
            label="straight lines (thesis)",
        )
        if impacts is not None:
            sd = np.nan_to_num(column(impacts, "restitution_sd"), nan=0.0)
            ax.errorbar(
                impacts[x_name],
                impacts["restitution"],
                yerr=sd,
                fmt="o",
                color=BLUE,
                ms=3.5,
                lw=0.8,
                capsize=0,
                label="flight model ± sd",
            )
        if np.isfinite(restitution):
            ax.axhline(restitution, color=BLACK, lw=0.9, label=f"identified: {restitution:.3f}")
            if np.isfinite(restitution_sd):
                ax.axhspan(restitution - restitution_sd, restitution + restitution_sd, color=BLACK, alpha=0.12, lw=0)
        label(ax, x_label)
    label(axes[0, 0], y="restitution")
    everything = np.concatenate([column(t, "restitution") for t in (impacts, thesis) if t is not None])
    everything = everything[np.isfinite(everything)]
    if len(everything):
        limits = robust_limits(everything, share=0.03, margin=0.15) or (0, 1)
        axes[0, 0].set_ylim(max(limits[0], -0.1), min(limits[1], 1.6))
    legend(axes[0, 1])
    return figure
