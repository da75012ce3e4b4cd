"""A series of recordings: parameters over the tests, with their trend."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures.style import BLACK, BLUE, FONT_PT, GREY, ORANGE, label, new_figure
from analysis.statistics.trend import weighted_trend


def parameter_trends(tests: pd.DataFrame, parameters: Sequence[tuple[str, str, float]]) -> Figure:
    """Each parameter over the tests with sd, its weighted mean and straight trend; bounds as arrows.

    ``tests``: one row per recording with ``<name>``, ``<name>_sd``, ``<name>_low``, ``<name>_high``;
    ``parameters``: (name, title, scale).
    """
    columns = 2 if len(parameters) > 1 else 1
    rows = -(-len(parameters) // columns)
    figure, axes = new_figure(
        rows,
        columns,
        height_in=0.95 + 1.9 * rows,
        margins_in=(0.72, 0.12, 0.46, 0.55),
        gap_in=(0.75, 0.35),
        sharex=True,
    )
    number = np.arange(1, len(tests) + 1)
    for n, (ax, (name, text, scale)) in enumerate(zip(axes.flat, parameters, strict=False)):
        value, sd = (scale * tests[column].to_numpy(float) for column in (name, f"{name}_sd"))
        ax.errorbar(number, value, yerr=np.nan_to_num(sd), fmt="o", ms=4, color=BLUE, lw=0.9, label="test ± sd")
        for end, marker in (("low", "^"), ("high", "v")):
            bound = scale * tests[f"{name}_{end}"].to_numpy(float)
            alone = ~np.isfinite(value) & np.isfinite(bound)
            if not alone.any():
                continue
            ax.plot(
                number[alone],
                bound[alone],
                marker,
                color=GREY,
                ms=6,
                ls="none",
                label="at least" if end == "low" else "at most",
            )
        trend = weighted_trend(number, value, sd)
        if trend is not None:
            ax.axhline(trend.mean, color=BLACK, lw=0.9, label="weighted mean")
            if trend.n > 2:
                ax.plot(
                    number,
                    trend.mean + trend.slope * (number - trend.centre),
                    color=ORANGE,
                    lw=1.0,
                    ls="--",
                    label="trend",
                )
        label(ax, x="test" if n + columns >= len(parameters) else "", title=text)
        ax.locator_params(axis="x", integer=True)
    for ax in axes.flat[len(parameters) :]:
        ax.set_visible(False)
    named = {text: handle for ax in axes.flat for handle, text in zip(*ax.get_legend_handles_labels(), strict=True)}
    figure.legend(list(named.values()), list(named), loc="upper right", ncols=5, frameon=False, fontsize=FONT_PT - 1)
    return figure
