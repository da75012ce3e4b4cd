"""The wall as its sources put it: contact radius and centre, each with its 90 % interval."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Ellipse

from analysis.contact.wall_sources import WallSource
from analysis.figures.style import BLUE, GREEN, GREY, MM, RED, label, legend, length_scale, new_figure
from analysis.statistics.student import NORMAL_90

# Semi-axes of an ellipse that holds 90 % of a normal pair, in sd.
PAIR_90 = 2.1460
COLOURS = {"Host markers": RED, "image edges": GREEN, "impacts": BLUE, "recording.toml": GREY}
LEGEND_SHARE = 0.13  # of the axes' height, that one line of the legend takes


def wall_comparison(sources: Sequence[WallSource]) -> Figure | None:
    """Left: contact radius of each source; right: the wall's centre in the Host's frame.  None where there is
    neither.
    """
    known = [s for s in sources if np.isfinite(s.contact_radius_m)]
    placed = [s for s in sources if np.all(np.isfinite(s.centre_m))]
    if not known and not placed:
        return None
    figure, axes = new_figure(1, 2, height_in=2.7, margins_in=(1.15, 0.12, 0.46, 0.32), gap_in=(0.85, 0.3))
    ax = axes[0, 0]
    middle = next((s.contact_radius_m for s in known), 0.0)
    unit, per_m = length_scale(
        [s.contact_radius_m - middle for s in known] + [NORMAL_90 * s.contact_radius_sd_m for s in known]
    )
    for row, source in enumerate(known):
        at, half = per_m * (source.contact_radius_m - middle), NORMAL_90 * per_m * source.contact_radius_sd_m
        if np.isfinite(half):
            ax.plot([at - half, at + half], [row, row], color=COLOURS[source.name], lw=2.2, alpha=0.6)
        ax.plot(at, row, "o", color=COLOURS[source.name], ms=5)
    ax.axvline(0.0, color=GREY, lw=0.8, ls="--")
    ax.set_yticks(range(len(known)), [s.name for s in known])
    ax.set_ylim(len(known) - 0.5, -0.5)
    ax.margins(x=0.12)
    label(ax, f"contact radius − {MM * middle:.3f} mm ({unit})", title="Contact radius, 90 %")
    ax = axes[0, 1]
    unit, per_m = length_scale(
        [x for s in placed for x in s.centre_m], [PAIR_90 * x for s in placed for x in s.centre_sd_m]
    )
    for source in placed:
        x, y = (per_m * c for c in source.centre_m)
        ax.plot(x, y, "o", color=COLOURS[source.name], ms=4, label=source.name)
        if np.all(np.isfinite(source.centre_sd_m)):
            width, height = (2 * PAIR_90 * per_m * sd for sd in source.centre_sd_m)
            ax.add_patch(Ellipse((x, y), width, height, facecolor=COLOURS[source.name], alpha=0.18))
            ax.add_patch(Ellipse((x, y), width, height, fill=False, edgecolor=COLOURS[source.name], lw=1))
    ax.plot(0, 0, "+", color=GREY, ms=9)
    ax.autoscale_view()
    low, high = ax.get_ylim()
    ax.update_datalim([(0, high + LEGEND_SHARE * len(placed) * (high - low))])  # room for the legend above the ellipses
    ax.autoscale_view()
    ax.set_aspect("equal", adjustable="datalim")
    label(ax, f"x ({unit})", f"y ({unit})", "Wall's centre from the layout's origin")
    legend(ax, loc="upper left", bbox_to_anchor=(0.0, 1.0), ncols=1)
    return figure
