"""Wall friction and tangential restitution: the error map with its L (thesis Fig. 64), and the regimes."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm
from matplotlib.contour import ContourSet
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from analysis.contact.law_map import REGION_90, ErrorMap
from analysis.figures.style import BLACK, GREEN, RED, label, legend, new_figure
from analysis.figures.trajectory import column

Array = NDArray[np.float64]
_LEVELS = (0.0, 2.3, REGION_90, 9.2, 20.0, 50.0, 100.0, 300.0, 1000.0, 3000.0)


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
        inset.tick_params(labelsize=7, length=2, colors=BLACK)
        for axis in (inset.xaxis, inset.yaxis):
            axis.set_major_locator(MaxNLocator(3, prune="both"))  # the first and the last would stand half outside
        for text in (*inset.get_xticklabels(), *inset.get_yticklabels()):
            text.set_path_effects([withStroke(linewidth=2, foreground="white")])  # on light and on dark ground
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


def _deviance(ax: Axes, joint: ErrorMap) -> ContourSet:
    """Filled contours of the deviance; the 90 % region outlined."""
    x, y, z = joint.wall_friction, joint.tangential_restitution, joint.deviance.T
    mesh = ax.contourf(
        x, y, z, levels=_LEVELS, norm=BoundaryNorm(_LEVELS, 256, extend="max"), cmap="cividis", extend="max"
    )
    ax.contour(x, y, z, levels=[REGION_90], colors=[RED], linewidths=1.5)
    ax.plot([], [], color=RED, lw=1.5, label="90 % region")
    ax.grid(False)
    return mesh


def _draw_l_shapes(ax: Axes, impacts: pd.DataFrame, joint: ErrorMap, inertia_factor: float, restitution: float) -> None:
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
