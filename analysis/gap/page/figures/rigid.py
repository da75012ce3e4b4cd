"""Bodies against themselves: each marker's place on its body over the run, and against the Host's velocity or
acceleration."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, CYCLE, label, legend, new_figure
from analysis.gap.ladder import Ladder
from analysis.gap.measurement.body_residuals import marker_residuals, on_body
from analysis.gap.measurement.loose_markers import ACCELERATION
from analysis.gap.page.figures.panels import binned, give_room

Array = NDArray[np.float64]


def rigid_figure(ladder: Ladder) -> Figure | None:
    """Host's and NES' markers over the share of a run (µm, the axis of the body that moves more), and the Host's
    against its velocity, or its acceleration where a marker goes with that; one curve a marker, medians over bins with
    standard errors.  None without marker points."""
    series = ladder.measured
    if series.points is None or series.layouts is None:
        return None
    figure, axes = new_figure(1, 3, height_in=2.9, gap_in=(0.75, 0.3), margins_in=(0.72, 0.12, 0.5, 0.55))
    for ax, body in zip(axes[0], ("host", "nes"), strict=False):
        parts = [
            (np.linspace(0, 1, len(world)), on_body(angle, world)) for _, angle, world in marker_residuals(series, body)
        ]
        share, own = np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])
        for m, marker in enumerate(series.recordings[0].bodies[body].markers):
            axis = int(np.argmax([_change(share, own[:, m, a]) for a in range(2)]))
            _curve(ax, share, 1e6 * own[:, m, axis], m, marker)
        label(
            ax,
            "share of the run",
            "place on the body (µm)" if body == "host" else "",
            "Host" if body == "host" else "NES",
        )
    pulled = any(one.goes_with.endswith(ACCELERATION) for one in ladder.structure)
    for number, _, world in marker_residuals(series, "host"):
        run = series.runs[number]
        if not run.data.host.moves or len(world) != len(run.data.time_s):
            continue
        moves = run.data.host.at(run.data.time_s, 2 if pulled else 1)[:, :2]
        along = moves / max(float(np.sqrt(np.mean(np.sum(moves**2, 1)))), 1e-9)
        for m, marker in enumerate(series.recordings[0].bodies["host"].markers):
            _curve(axes[0, 2], np.sum(moves * along, 1), 1e6 * np.sum(world[:, m] * along, 1), m, marker)
        break
    what, unit = ("acceleration", "m/s²") if pulled else ("speed", "m/s")
    label(axes[0, 2], f"Host's {what}² / its RMS ({unit})", f"along its {what} (µm)", "Host")
    for ax in axes[0]:
        ax.axhline(0, color=BLACK, lw=0.7)
        give_room(ax)
        legend(ax, loc="lower left", bbox_to_anchor=(0, 1.08), fontsize=6.5, columnspacing=0.6, handlelength=0.8)
    return figure


def _change(share: Array, values: Array) -> float:
    """Size of the difference between the medians of the two halves."""
    first, second = (values[half & np.isfinite(values)] for half in (share < 0.5, share >= 0.5))
    return abs(float(np.median(second) - np.median(first))) if len(first) and len(second) else 0.0


def _curve(ax: Axes, x: Array, y: Array, number: int, name: str) -> None:
    ok = np.isfinite(x) & np.isfinite(y)
    if ok.sum() < 10:
        return
    centres, medians, errors = binned(x[ok], y[ok])
    ax.errorbar(
        centres, medians, errors, fmt="o-", ms=2.6, lw=1.0, elinewidth=0.8, color=CYCLE[number % len(CYCLE)], label=name
    )
