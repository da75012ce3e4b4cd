"""Figure of a sweep: a curve with its spread over one parameter, a map over two."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures.style import BLUE, FONT_PT, GREEN, label, legend, new_figure

SHOWN = {
    "impacts_per_s": "impacts per second",
    "contact_share": "share of time on the wall",
    "speed_m_per_s": "speed at the end (m/s)",
    "spin_rad_per_s": "|spin| at the end (rad/s)",
}


def sweep_figure(table: pd.DataFrame) -> Figure:
    """``table`` as `sweep.parquet` has it: medians with 5 to 95 % (mean dashed) over one parameter, means over two."""
    names = [name for name in (table["parameter"].iloc[0], table["other_parameter"].iloc[0]) if isinstance(name, str)]
    figure, axes = new_figure(2, 2, height_in=5.2, gap_in=(0.95 if len(names) == 2 else 0.6, 0.62))
    for ax, (what, title) in zip(axes.ravel(), SHOWN.items(), strict=True):
        if len(names) == 1:
            x = table["value"]
            ax.fill_between(
                x, table[f"{what}_low"], table[f"{what}_high"], color=BLUE, alpha=0.18, lw=0, label="5-95 %"
            )
            ax.plot(x, table[f"{what}_median"], ".-", color=BLUE, lw=1.2, ms=4, label="median")
            ax.plot(x, table[f"{what}_mean"], color=GREEN, lw=1.0, ls="--", label="mean")
            label(ax, in_words(names[0]), "", title)
            if ax is axes[0, 0]:
                legend(ax)
            continue
        grid = table.pivot(index="other_value", columns="value", values=f"{what}_mean")
        image = ax.pcolormesh(
            grid.columns, grid.index, np.asarray(grid, dtype=float), cmap="viridis", shading="nearest"
        )
        ax.grid(False)
        figure.colorbar(image, ax=ax, pad=0.03).ax.tick_params(labelsize=FONT_PT - 1)
        label(ax, in_words(names[0]), in_words(names[1]), title)
    return figure


def in_words(name: str) -> str:
    """A parameter's name as an axis has it: its unit in brackets."""
    for suffix, unit in (
        ("_rad_per_s", "rad/s"), ("_m_per_s", "m/s"), ("_rad", "rad"), ("_hz", "Hz"), ("_m", "m"), ("_g", "g"),
    ):  # fmt: skip
        if name.endswith(suffix):
            return f"{name.removesuffix(suffix).replace('_', ' ')} ({unit})"
    return name.replace("_", " ")
