"""Impacts: detection (thesis Fig. 63), restitution by both methods (Table 16), error map with its L (Fig.
64).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.error_map import REGION_90, ErrorMap
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
    axes[0, 0].plot(
        thesis["time_s"], thesis["acceleration_m_per_s2"], "v", color=ORANGE, ms=5, label="maxima (thesis)"
    )
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
                ax.axvline(
                    time, color=GREEN, lw=0.7, alpha=0.8, label="impacts (flight model)" if i == 0 else None
                )
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
                ax.axhspan(
                    restitution - restitution_sd, restitution + restitution_sd, color=BLACK, alpha=0.12, lw=0
                )
        label(ax, x_label)
    label(axes[0, 0], y="restitution")
    everything = np.concatenate([column(t, "restitution") for t in (impacts, thesis) if t is not None])
    everything = everything[np.isfinite(everything)]
    if len(everything):
        limits = robust_limits(everything, share=0.03, margin=0.15) or (0, 1)
        axes[0, 0].set_ylim(max(limits[0], -0.1), min(limits[1], 1.6))
    legend(axes[0, 1])
    return figure


def error_maps(
    joint: ErrorMap,
    close: ErrorMap | None,
    thesis_grid: tuple[Array, Array, Array] | None,
    impacts: pd.DataFrame,
    identified: tuple[float, float],
    inertia_factor: float,
    restitution: float,
) -> Figure:
    """Joint likelihood of wall friction and tangential restitution, and the thesis' mean relative error
    beside it.

    ``close``: the same likelihood near its maximum, shown as an inset; ``thesis_grid``: (wall_friction,
    tangential_restitution, mean J_t) by straight lines.  The thin L's are the zero sets of the eight impacts
    with the largest tangential speeds; ``identified`` is what identification settled on (NaN: not
    determined).
    """
    figure, axes = new_figure(
        1, 2, height_in=4.2, margins_in=(0.62, 0.35, 0.46, 0.3), gap_in=(0.55, 0.3), sharey=True, sharex=True
    )
    ax = axes[0, 0]
    mesh = _deviance(ax, joint)
    _draw_l_shapes(ax, impacts, joint, inertia_factor, restitution)
    if close is not None:
        inset = ax.inset_axes((0.48, 0.1, 0.5, 0.34))
        _deviance(inset, close)
        inset.tick_params(labelsize=7, length=2, colors="white")
        inset.locator_params(nbins=3)
        for spine in inset.spines.values():
            spine.set_color("white")
        ax.indicate_inset_zoom(inset, edgecolor="white", alpha=0.9)
    for place in (ax, *ax.child_axes):
        if np.isfinite(identified).all():
            place.plot(*identified, "*", ms=10, mfc="white", mec=BLACK, label="identified", ls="none")
    label(
        ax,
        r"wall friction $\mu_c$",
        r"tangential restitution $\beta_0$",
        title="joint likelihood, flight model",
    )
    bar = figure.colorbar(mesh, ax=ax, ticks=_LEVELS[:-1:2], pad=0.02, fraction=0.05, aspect=30)
    bar.ax.tick_params(labelsize=7)
    bar.ax.set_title("$-2\\ln L$", fontsize=7)
    ax = axes[0, 1]
    if thesis_grid is None:
        ax.set_visible(False)
    else:
        mu, beta, error = thesis_grid
        mesh = ax.contourf(mu, beta, error.T, levels=12, cmap="cividis")
        i, j = np.unravel_index(np.argmin(error), error.shape)
        ax.plot(mu[i], beta[j], "X", ms=9, mfc="white", mec=BLACK, label="minimum", ls="none")
        bar = figure.colorbar(mesh, ax=ax, pad=0.02, fraction=0.05, aspect=30)
        bar.ax.set_title("mean $J_t$", fontsize=7)
        bar.ax.tick_params(labelsize=7)
        label(ax, r"wall friction $\mu_c$", title="mean relative error, thesis")
    for ax in axes[0]:
        ax.grid(False)
        ax.set(
            xlim=(joint.wall_friction[0], joint.wall_friction[-1]),
            ylim=(joint.tangential_restitution[0], joint.tangential_restitution[-1]),
        )
        legend(ax, loc="upper left", bbox_to_anchor=(0.01, 0.99), ncols=1, frameon=True, framealpha=0.7)
    return figure


_LEVELS = (0.0, 2.3, REGION_90, 9.2, 20.0, 50.0, 100.0, 300.0, 1000.0, 3000.0)


def _deviance(ax: Axes, joint: ErrorMap) -> ContourSet:
    """Filled contours of the deviance; the 90 % region outlined."""
    x, y, z = joint.wall_friction, joint.tangential_restitution, joint.deviance.T
    mesh = ax.contourf(x, y, z, levels=_LEVELS, norm=BoundaryNorm(_LEVELS, 256), cmap="cividis", extend="max")
    ax.contour(x, y, z, levels=[REGION_90], colors=[RED], linewidths=1.5)
    ax.plot([], [], color=RED, lw=1.5, label="90 % region")
    ax.grid(False)
    return mesh


def _draw_l_shapes(
    ax: Axes, impacts: pd.DataFrame, joint: ErrorMap, inertia_factor: float, restitution: float
) -> None:
    v_t, v_a, v_n = (
        column(impacts, f"{name}_m_per_s")
        for name in ("tangential_speed_before", "tangential_speed_after", "normal_speed_before")
    )
    named = False
    for k in np.argsort(-np.nan_to_num(np.abs(v_t), nan=-1.0))[:8]:
        if not (np.isfinite(v_t[k] + v_a[k] + v_n[k]) and abs(v_t[k]) > 0 and v_n[k] > 0):
            continue
        beta = -v_a[k] / v_t[k]
        mu = (1 + beta) * abs(v_t[k]) / v_n[k] / ((1 + restitution) * (1 + 1 / inertia_factor))
        ax.plot(
            [mu, mu, joint.wall_friction[-1]],
            [joint.tangential_restitution[-1], beta, beta],
            color=BLACK,
            lw=0.6,
            alpha=0.9,
            label=None if named else "zero set of one impact",
        )
        named = True


def regimes(
    impacts: pd.DataFrame,
    restitution: float,
    wall_friction: float,
    tangential_restitution: float,
    inertia_factor: float,
) -> Figure:
    """Effective tangential restitution against the incidence |v_t|/|v_n|: where sticking ends and sliding
    begins.
    """
    figure, axes = new_figure(1, 1, height_in=3.0)
    ax = axes[0, 0]
    v_t, v_a, v_n = (
        column(impacts, f"{name}_m_per_s")
        for name in ("tangential_speed_before", "tangential_speed_after", "normal_speed_before")
    )
    with np.errstate(all="ignore"):
        ratio, beta = np.abs(v_t) / v_n, -v_a / v_t
        sd = np.hypot(
            np.nan_to_num(column(impacts, "tangential_speed_after_sd_m_per_s")),
            beta * np.nan_to_num(column(impacts, "tangential_speed_before_sd_m_per_s")),
        ) / np.abs(v_t)
    regime = (
        impacts["regime"].astype(object).where(impacts["regime"].notna(), "").to_numpy()
        if "regime" in impacts
        else np.full(len(impacts), "")
    )
    for name, colour, marker, text in (
        ("stick", GREEN, "o", r"sticks: informs $\beta_0$"),
        ("slide", RED, "s", r"slides: informs $\mu_c$"),
        ("", BLACK, "x", "informs neither"),
    ):
        chosen = (regime == name) & np.isfinite(beta)
        if chosen.any():
            ax.errorbar(
                ratio[chosen],
                beta[chosen],
                yerr=np.minimum(sd[chosen], 2),
                fmt=marker,
                ms=4,
                color=colour,
                lw=0.7,
                label=text,
            )
    shown = ratio[np.isfinite(ratio)]
    grid = np.linspace(0.01, max(1.0, float(np.quantile(shown, 0.97)) * 1.1) if len(shown) else 2.0, 300)
    if np.isfinite(wall_friction) and np.isfinite(tangential_restitution):
        law = np.minimum(
            tangential_restitution, -1 + wall_friction * (1 + restitution) * (1 + 1 / inertia_factor) / grid
        )
        ax.plot(grid, law, color=BLACK, lw=1.1, label="Luding law with the identified values")
    ax.set(xlim=(0, grid[-1]), ylim=(-1.4, 1.4))
    label(ax, r"incidence $|v_t|/v_n$", r"effective $\beta$ = $-v_t^+/v_t^-$")
    legend(ax, loc="upper right")
    return figure
