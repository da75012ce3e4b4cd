"""Where frames next to blows are seen beside the two ways that meet there, and what a law of it says."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, GREY, RED, label, legend, new_figure
from analysis.gap.laws.found_law import LawFound
from analysis.gap.laws.frames.bodies.at_blows import corner_rows, seen_off
from analysis.gap.laws.frames.bodies.sharpened import frames_about
from analysis.gap.laws.frames.evidence.rows import size_of
from analysis.gap.series import Series

Array = NDArray[np.float64]
# Bins in a frame, and the fewest frames that one shows.
IN_A_FRAME, FEWEST = 2, 5
MS, US = 1e3, 1e6


def blow_figure(series: Series, law: LawFound) -> Figure | None:
    """How far frames about blows are seen along the change of velocity, over that change, by the time from the blow;
    and the ``law``.  None where too few frames lie there."""
    terms = law.rig_law.terms
    reach = frames_about(terms, series.period_s)
    rows = corner_rows(series, reach)
    if rows is None:
        return None
    said = rows.weight * rows.off_m(terms)
    bends = rows.problem.nuisances
    beside = replace(rows.problem, residual=rows.problem.residual - said)
    left = rows.problem.residual - bends @ beside.fitted(bends, beside.prior)
    jump = rows.jump_m / series.period_s * rows.weight
    edges = np.arange(-reach - 0.5, reach + 0.5 + 1e-9, 1 / IN_A_FRAME)
    delays = []
    for low, high in pairwise(edges):
        own = (rows.after >= low) & (rows.after < high)
        if np.count_nonzero(own) < FEWEST:
            continue
        information = float(np.sum(jump[own] ** 2))
        delays.append((np.mean(rows.after[own]), np.sum(jump[own] * left[own]) / information, 1 / np.sqrt(information)))
    at_blow = rows.known[np.abs(rows.after) < 1.0]
    if not delays or not len(at_blow):
        return None
    at, off_s, sd_s = np.array(delays).T
    figure, axes = new_figure(margins_in=(0.85, 0.12, 0.46, 0.36))
    ax = axes[0, 0]
    ax.axhline(0.0, color=GREY, lw=0.8)
    ax.errorbar(MS * series.period_s * at, US * off_s, US * sd_s, fmt="o", ms=3.5, lw=1, color=RED, label="seen")
    fine = np.linspace(edges[0], edges[-1], 20 * len(edges))
    # Shares that follow the gap: as they are at the blow.
    shares = np.tile(size_of(terms, at_blow).mean(0), (len(fine), 1))
    by_law = seen_off(fine, shares, [term.x / series.period_s for term in terms])
    ax.plot(MS * series.period_s * fine, US * series.period_s * by_law, color=BLACK, lw=1.2, label="the law")
    label(ax, "time from the blow [ms]", "off along the change of velocity\n[µm per m/s of it]", math=False)
    legend(ax)
    return figure
