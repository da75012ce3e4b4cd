"""The ladder and the ranking of its candidates; the panel in which every residual is shown before and after."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator
from matplotlib.transforms import ScaledTranslation
from numpy.typing import NDArray

from analysis.figures.style import (
    BLACK,
    BLUE,
    FONT_PT,
    GREEN,
    GREY,
    ORANGE,
    RED,
    label,
    legend,
    new_figure,
    robust_limits,
)
from analysis.gap.prediction.predict import Errors
from analysis.statistics.robust import MEDIAN_SD
from ovines.robust import spread

Array = NDArray[np.float64]
#: step -> (its name under a bar, colour)
STEPS = {
    "as_given": ("as\ngiven", ORANGE),
    "recalibrated": ("recali-\nbrated", RED),
    "with_effect": ("with the\neffect", BLUE),
    "noise_floor": ("noise\nfloor", GREEN),
}
BINS = 12


def ladder_figure(errors: Mapping[str, Errors | None]) -> Figure:
    """Steps that ``errors`` names: RMS of the held-out predictions at each step: all runs (bar) and each run (dots);
    flights, impacts, spins.
    """
    figure, axes = new_figure(1, 3, height_in=2.9, margins_in=(0.5, 0.12, 0.45, 0.32), gap_in=(0.5, 0.3))
    panels = (
        ("flight", "flight_count", 1e3, "flight ahead (mm RMS)"),
        ("impact", "impact_count", 1e3, "impact ahead (mm/s RMS)"),
        ("spin", "impact_count", 1.0, "spin ahead (rad/s RMS)"),
    )
    shown = {step: STEPS[step] for step in STEPS if step in errors}
    for ax, (total, count, scale, title) in zip(axes[0], panels, strict=True):
        heights = []
        for at, (step, (_, colour)) in enumerate(shown.items()):
            e = errors.get(step)
            value = _rms(e, total, count, scale)
            if e is None or value is None:
                ax.text(
                    at,
                    0.03,
                    "not\ngiven" if step == "as_given" else "none",
                    ha="center",
                    va="bottom",
                    fontsize=7,
                    color=GREY,
                    transform=ax.get_xaxis_transform(),
                )
                continue
            ax.bar(at, value, 0.62, color=colour, alpha=0.85)
            n = getattr(e, count)
            per_run = scale * np.sqrt(getattr(e, total)[n > 0] / n[n > 0])
            spread = np.linspace(-0.2, 0.2, len(per_run)) if len(per_run) > 1 else np.zeros(1)
            ax.plot(at + spread, per_run, "o", ms=2.4, color=BLACK, alpha=0.7, mew=0)
            ax.annotate(
                f"{value:.2g}" if value < 100 else f"{value:.0f}",
                (at, max(value, per_run.max())),
                ha="center",
                va="bottom",
                fontsize=FONT_PT - 1.5,
                xytext=(0, 2),
                textcoords="offset points",
            )
            heights += [one for one in (value, *per_run) if one > 0]
        if heights and max(heights) > 8 * min(heights):
            ax.set_yscale("log")
            ax.set_ylim(0.6 * min(heights), 2.2 * max(heights))
        elif heights:
            ax.set_ylim(0, 1.15 * max(heights))
        ax.set_xticks(range(len(shown)), [name for name, _ in shown.values()], fontsize=FONT_PT - 2)
        ax.set_xlim(-0.6, len(shown) - 0.4)
        ax.grid(False, axis="x")
        label(ax, title=title)
    return figure


def _rms(errors: Errors | None, total: str, count: str, scale: float) -> float | None:
    if errors is None or not getattr(errors, count).sum():
        return None
    return float(scale * np.sqrt(getattr(errors, total).sum() / getattr(errors, count).sum()))


@dataclass(frozen=True, eq=False)
class Candidate:
    """One row of the ranking: its name, whether the library knows it, and what it gains on each held-out run (-2 log
    L).
    """

    name: str
    named: bool
    per_run: Array
    accepted: bool = False


def ranking_figure(candidates: Sequence[Candidate], threshold: float, title: str) -> Figure:
    """Gain per held-out run: mean (bar) and each run (dots), named effects in blue, probes in grey, accepted ones in
    green.
    """
    rows = sorted(candidates, key=lambda c: c.per_run.sum())
    figure, axes = new_figure(1, 1, height_in=0.95 + 0.185 * len(rows), margins_in=(3.3, 0.55, 0.5, 0.3))
    ax = axes[0, 0]
    for at, row in enumerate(rows):
        mean = float(row.per_run.mean())
        ax.barh(at, mean, 0.66, color=GREEN if row.accepted else (BLUE if row.named else GREY), alpha=0.75, lw=0)
        ax.plot(row.per_run, np.full(len(row.per_run), at), "o", ms=2.3, color=BLACK, alpha=0.65, mew=0)
        ax.annotate(
            f"{row.per_run.sum():.0f}".replace("-0", "0").replace("-", "−"),
            (1.0, at),
            xycoords=ax.get_yaxis_transform(),
            xytext=(3, 0),
            textcoords="offset points",
            fontsize=FONT_PT - 2,
            va="center",
            color="#38424f",
        )
    ax.axvline(0, color=BLACK, lw=0.8)
    ax.axvline(threshold, color=ORANGE, lw=1.0, ls="--", label="threshold")
    ax.plot([], [], "s", color=GREEN, label="accepted", ms=5)
    ax.plot([], [], "s", color=BLUE, label="effect of the library", ms=5)
    ax.plot([], [], "s", color=GREY, label="probe", ms=5)
    ax.set_xscale("symlog", linthresh=max(threshold, 1.0))
    decades = [10.0**k for k in range(1, 9) if 10.0**k >= threshold / 4]  # smaller ones would stand on each other
    ax.xaxis.set_major_locator(FixedLocator([*(-one for one in decades), 0.0, *decades]))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.0f}".replace("-", "−")))
    ax.set_yticks(range(len(rows)), [r.name for r in rows], fontsize=FONT_PT - 1.5, parse_math=False)
    ax.set_ylim(-0.7, len(rows) - 0.3)
    ax.grid(False, axis="y")
    label(ax, "fall of −2 log L on a held-out run (sum over runs at the right)")
    ax.annotate(
        title,
        (0, 1),
        xycoords=figure.transFigure,
        xytext=(4, -4),
        textcoords="offset points",
        va="top",
        fontsize=FONT_PT,
        fontweight="bold",
    )
    legend(ax)
    return figure


@dataclass(frozen=True, eq=False)
class Panel:
    """One residual against one covariate: values of the recalibrated model and of the one with the effect, each with
    its covariate.
    """

    x: Array
    before: Array
    x_after: Array
    after: Array
    x_name: str
    y_name: str
    circular: bool = False
    title: str = ""


def residual_panels(
    panels: Sequence[Panel], columns: int = 2, one_model: bool = False, before: str = "recalibrated"
) -> Figure:
    """Residuals before and after: faint dots, and means over bins of equal count with their standard error."""
    rows = -(-len(panels) // columns)
    figure, axes = new_figure(
        rows, columns, height_in=0.75 + 2.05 * rows, margins_in=(0.72, 0.12, 0.5, 0.42), gap_in=(0.82, 0.6)
    )
    for ax, panel in zip(axes.flat, panels, strict=False):
        draw_panel(ax, panel, one_model, before)
        if ax is axes[0, 0]:
            legend(ax, loc="lower left", bbox_to_anchor=(0, 1.1))
    for ax in axes.flat[len(panels) :]:
        ax.set_visible(False)
    return figure


def draw_panel(ax: Axes, panel: Panel, one_model: bool = False, before: str = "recalibrated") -> None:
    """One panel; ``one_model`` where nothing was added, so that two equal curves do not hide each other."""
    names = ("", "as the nominal model leaves it") if one_model else (before, "with the effect")
    curves = [] if one_model else [(panel.x, panel.before, RED, names[0], "s")]
    values: list[Array] = []
    for x, y, colour, name, marker in [*curves, (panel.x_after, panel.after, BLUE, names[1], "o")]:
        ok = np.isfinite(x) & np.isfinite(y)
        x, y = x[ok], y[ok]
        if len(x) < 2:
            continue
        keep = np.random.default_rng(0).permutation(len(x))[:700]
        ax.plot(x[keep], y[keep], ".", ms=3.0, color=colour, alpha=0.4, mew=0, rasterized=True)
        centres, means, errors = binned(x, y, panel.circular)
        ax.errorbar(centres, means, errors, fmt=marker + "-", ms=3.4, lw=1.1, elinewidth=0.9, color=colour, label=name)
        values.append(y)
    ax.axhline(0, color=BLACK, lw=0.7)
    limits = robust_limits(np.concatenate(values), share=0.02, margin=0.15) if values else None
    if limits:
        ax.set_ylim(min(limits[0], 0), max(limits[1], 0))
    label(ax, panel.x_name, panel.y_name, panel.title)
    give_room(ax)


def give_room(ax: Axes) -> None:
    """Fewer ticks, and the label further out: residuals have long numbers."""
    ax.yaxis.set_major_locator(MaxNLocator(5))
    left = ScaledTranslation(-0.53, 0, ax.figure.dpi_scale_trans)
    ax.yaxis.set_label_coords(0.0, 0.5, ax.transAxes + left)


def binned(x: Array, y: Array, circular: bool = False, bins: int = BINS) -> tuple[Array, Array, Array]:
    """Centres, medians and standard errors of ``y`` over bins of ``x``: of equal count, of equal width for angles;
    empty bins are left out.
    """
    if not len(x):
        return np.zeros(0), np.zeros(0), np.zeros(0)
    few = max(min(bins, len(x) // 5), 1)
    edges = (
        np.linspace(-np.pi, np.pi, few + 1) * (180 / np.pi) if circular else np.quantile(x, np.linspace(0, 1, few + 1))
    )
    which = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, few - 1)
    rows = []
    for b in range(few):
        part = y[which == b]
        if len(part):
            middle = float(np.median(part))
            rows.append((float(np.mean(x[which == b])), middle, MEDIAN_SD * spread(part) / np.sqrt(len(part))))
    centres, middles, errors = np.array(rows).T
    return centres, middles, errors
