"""Figures of Lyapunov exponents, Poincare sections, bifurcation diagrams, branches of orbits, maps of basins."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from analysis.figures.style import BLACK, BLUE, CYCLE, GREEN, GREY, RED, label, legend, new_figure
from analysis.simulations.sweep_figure import in_words
from ovines.core.orbits.lyapunov import Lyapunov
from ovines.core.orbits.periodic import Branch
from ovines.core.orbits.section import Basins, Bifurcation
from ovines.core.sensitivity.run import STATES

GONE = "#e3e7ec"  # outside the walls


def lyapunov_figure(found: Lyapunov) -> Figure:
    """Running means of the exponents over time, with their last values."""
    figure, axes = new_figure(1, 1, height_in=3.0)
    ax = axes[0, 0]
    for j, value in enumerate(found.exponents_per_s):
        name = f"{value:.4g} ± {found.sd_per_s[j]:.1g} 1/s"
        ax.plot(found.time_s, found.history_per_s[:, j], color=CYCLE[j % len(CYCLE)], lw=1.0, label=name)
        ax.axhline(value, color=CYCLE[j % len(CYCLE)], lw=0.7, ls="--")
    ax.axhline(0.0, color=GREY, lw=0.8)
    spread = np.ptp(found.exponents_per_s) or float(np.max(np.abs(found.exponents_per_s))) or 1.0
    ax.set_ylim(found.exponents_per_s.min() - 0.5 * spread, found.exponents_per_s.max() + 0.5 * spread)
    label(ax, "time (s)", "exponent (1/s)", "Lyapunov exponents, running means")
    legend(ax)
    return figure


def section_figure(states: np.ndarray, axes_named: tuple[str, str]) -> Figure:
    """``states`` (runs, periods, 12) of a section, two of them against each other."""
    figure, axes = new_figure(1, 1, height_in=4.6, margins_in=(0.7, 0.3, 0.46, 0.32))
    ax = axes[0, 0]
    x, y = (states[:, :, STATES.index(name)].ravel() for name in axes_named)
    ax.plot(x, y, ".", color=BLUE, ms=1.5 if len(x) > 500 else 4.0, mew=0, rasterized=True)
    label(ax, in_words(axes_named[0]), in_words(axes_named[1]), "Poincaré section, once per period of the drive")
    return figure


def bifurcation_figure(found: Bifurcation, shown: str) -> Figure:
    """One state of the section, and the impacts per period, over the number that varies."""
    figure, axes = new_figure(2, 1, height_in=5.0, sharex=True, gridspec_kw={"height_ratios": (2.4, 1.0)})
    top, low = axes[:, 0]
    values = np.repeat(found.values, found.states.shape[1])
    top.plot(values, found.states[:, :, STATES.index(shown)].ravel(), ".", color=BLUE, ms=1.5, mew=0, rasterized=True)
    low.plot(found.values, found.impacts, ".-", color=RED, ms=2.5, lw=0.8)
    top.locator_params(axis="y", nbins=5)  # short numbers: the label stands at a fixed distance
    label(top, "", in_words(shown), "Once per period of the drive")
    label(low, in_words(found.over), "impacts per period")
    return figure


def branch_figure(branch: Branch, curves: Sequence[tuple[str, np.ndarray, np.ndarray]] = ()) -> Figure:
    """Impact speeds and sizes of the multipliers along a branch; ``curves`` (name, value, speed) beside it."""
    figure, axes = new_figure(2, 1, height_in=5.2, sharex=True)
    top, low = axes[:, 0]
    values = np.array([orbit.value for orbit in branch.orbits])
    stable = np.array([orbit.stable for orbit in branch.orbits])
    most = max(len(orbit.impact_time_s) for orbit in branch.orbits)
    speeds = np.full((len(values), most), np.nan)
    sizes = np.array([np.abs(orbit.multipliers) for orbit in branch.orbits])
    for row, orbit in zip(speeds, branch.orbits, strict=True):
        row[: len(orbit.impact_time_s)] = orbit.impact_speed_m_per_s
    for name, at, speed in curves:
        top.plot(at, speed, color=GREY, lw=3.5, alpha=0.6, label=name)
    for ax, lines, colour in ((top, speeds, BLUE), (low, sizes, GREEN)):
        for j, line in enumerate(lines.T):
            for which, style, name in ((stable, "-", "stable"), (~stable, ":", "unstable")):
                shown = np.where(which, line, np.nan)
                if np.isfinite(shown).any():
                    ax.plot(values, shown, style, color=colour, lw=1.4, label=name if j == 0 else None)
    low.axhline(1.0, color=BLACK, lw=0.7)
    label(top, "", "impact speed (m/s)", "Impacts of the orbit")
    label(low, in_words(branch.over), "|multiplier|", "Floquet multipliers")
    legend(top)
    return figure


def basins_figure(found: Basins) -> Figure:
    """Which attractor each start ends on."""
    figure, axes = new_figure(1, 1, height_in=5.0, margins_in=(0.72, 2.3, 0.5, 0.32))
    ax = axes[0, 0]
    count = len(found.attractors)
    colours = [GONE, *(CYCLE[j % len(CYCLE)] for j in range(count))]
    ax.pcolormesh(
        found.x[1], found.y[1], found.labels, cmap=ListedColormap(colours), vmin=-1.5, vmax=count - 0.5,
        shading="nearest", rasterized=True,
    )  # fmt: skip
    ax.grid(False)
    label(ax, in_words(found.x[0]), in_words(found.y[0]), "Basins of attraction")
    handles = []
    for attractor, colour in zip(found.attractors[:12], colours[1:], strict=False):
        name = f"period {attractor.period}" if attractor.period else "no period"
        text = f"{name}, {attractor.impacts:.3g} impacts\na period, {100 * attractor.share:.3g} %"
        handles.append(Patch(color=colour, label=text))
    ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.02, 1.0), fontsize=8, frameon=False)
    return figure
