"""Measurement residuals: second view against speed and place, heights, frame times, lengths; before and after the
corrections.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, BLUE, CYCLE, FONT_PT, GREY, RED, label, legend, new_figure
from analysis.gap.finding import Finding
from analysis.gap.ladder import Ladder
from analysis.gap.measurement.body_rows import body_rows
from analysis.gap.measurement.fixed_markers import PARTS, slow_motion
from analysis.gap.page.figures.impacts import impact_panels
from analysis.gap.page.figures.panels import Panel, draw_panel, give_room
from ovines.robust import residual_sd

Array = NDArray[np.float64]
#: runs whose frames the figure shows; six hold thousands of frames and keep the page quick
MOST_RUNS = 6


def view_panels(ladder: Ladder) -> list[Panel]:
    """Epipolar residual against velocity and place, height against place: as measured, and with what was found taken
    out.

    What the corrections took out is put back by the linear relation the tests rest on
    (``analysis.gap.measurement.two_views``). Empty at entries without two views.
    """
    series = ladder.series
    if (
        series.points is None
        or series.cameras is None
        or series.layouts is None
        or "epipolar_px" not in series.points[0]
    ):
        return []
    found = {f.effect: {k: v[0] for k, v in f.parameters.items()} for f in ladder.findings}
    window = found.get("sensor_window_offset", {})
    w = np.array([window.get("u_px", 0.0), window.get("v_px", 0.0)])
    delay = found.get("camera_clock_offset", {}).get("offset_s", 0.0)
    tilt = found.get("plane_tilt", {})
    slope = np.array([-tilt.get("y_rad", 0.0), tilt.get("x_rad", 0.0)])
    blocks = []
    for points, motion, run in list(zip(series.points, series.motions, series.runs, strict=True))[:MOST_RUNS]:
        for body in ("host", "nes"):
            block = body_rows(series, points, motion, run, body)
            if block is not None:
                epipolar, height, x, y = block.line_px, block.height_m, block.x_m, block.y_m
                across, rising = block.late()
                # What a late clock makes of lines stays in the data, what it makes of heights was taken out, as a
                # window and a plane were.
                e_before, e_after = epipolar + block.line_per_px @ w, epipolar - delay * across
                z_before = height + block.height_per_px @ w + np.column_stack([x, y]) @ slope + delay * rising
                z_after = height
                if body == "host":  # rides up and down with the shaker: its height says nothing of the plane
                    z_before, z_after = np.full_like(height, np.nan), np.full_like(height, np.nan)
                blocks.append(
                    np.column_stack([across, 1e3 * x, 1e3 * y, e_before, e_after, 1e6 * z_before, 1e6 * z_after])
                )
    if not blocks:
        return []
    across, x, y, e_before, e_after, z_before, z_after = np.vstack(blocks).T
    if np.isfinite(z_before).any():  # none of the NES' markers is left where only the Host was seen
        z_before, z_after = z_before - np.nanmedian(z_before), z_after - np.nanmedian(z_after)
    e, z = "epipolar residual (px)", "height of the NES (µm)"
    return [
        Panel(1e-3 * across, e_before, 1e-3 * across, e_after, "speed across the epipolar line (1000 px/s)", e),
        Panel(x, e_before, x, e_after, "x in the room (mm)", e),
        Panel(x, z_before, x, z_after, "x in the room (mm)", z),
        Panel(y, z_before, y, z_after, "y in the room (mm)", z),
    ]


def measured_figure(ladder: Ladder) -> Figure | None:
    """The two views' residuals, the frame times and rates, and the lengths; None where none of them can be shown."""
    panels = view_panels(ladder)
    rows = (2 if panels else 0) + 1
    figure, axes = new_figure(
        rows, 2, height_in=0.8 + 2.1 * rows, margins_in=(0.72, 0.12, 0.5, 0.42), gap_in=(0.82, 0.6)
    )
    one = not any(f.effect in ("camera_clock_offset", "sensor_window_offset", "plane_tilt") for f in ladder.findings)
    for ax, panel in zip(axes.flat, panels, strict=False):
        draw_panel(ax, panel, one)
    if panels:
        _name_curves(axes[0, 0], one)
    drawn = _jitter(axes[-1, 0], ladder), _rates_or_lengths(axes[-1, 1], ladder)
    return figure if panels or any(drawn) else None


def _name_curves(ax: Axes, one: bool) -> None:
    names = ["as measured"] if one else ["as measured", "corrected"]
    lines = [c for c in ax.containers if c.get_label()]
    ax.legend(lines, names, fontsize=FONT_PT - 1, frameon=False, loc="lower left", bbox_to_anchor=(0, 1.06), ncols=2)


def _finding(ladder: Ladder, effect: str) -> Finding | None:
    return next((f for f in ladder.findings if f.effect == effect), None)


def _jitter(ax: Axes, ladder: Ladder) -> bool:
    """Variance of the Host's residual along its motion against its speed squared; a slope is scatter of the frames'
    times.
    """
    speeds, before, after, across = [], [], [], []
    jitter = _finding(ladder, "trigger_jitter")
    for run in ladder.series.runs:
        host, t = run.data.host, run.data.time_s
        if not host.moves:
            continue
        velocity = host.at(t, 1)[:, :2]
        axis = int(np.argmax(np.abs(velocity).max(0)))
        residual = host.residual[:, axis] - np.nanmedian(host.residual[:, axis])
        # The correction moved the frames' times; moving them back gives what was measured.
        late = t - np.polyval(np.polyfit(run.frame, t, 1), run.frame) if jitter is not None else np.zeros(len(t))
        speeds.append(np.abs(velocity[:, axis]))
        after.append(1e6 * residual)
        before.append(1e6 * (residual + velocity[:, axis] * late))
        across.append(1e6 * (host.residual[:, 1 - axis] - np.nanmedian(host.residual[:, 1 - axis])))
    if not speeds:
        ax.set_visible(False)
        return False
    v2 = np.concatenate(speeds) ** 2
    curves = (
        (before, RED if jitter else BLUE, "as measured"),
        (after, BLUE, "corrected"),
        (across, GREY, "across its way"),
    )
    for values, colour, name in curves:
        if name == "corrected" and jitter is None:
            continue
        y = np.concatenate(values)
        ok = np.isfinite(y) & np.isfinite(v2)
        edges = np.quantile(v2[ok], np.linspace(0, 1, 13))
        which = np.clip(np.searchsorted(edges, v2[ok], side="right") - 1, 0, 11)
        parts = [(v2[ok][which == k], y[ok][which == k]) for k in range(12) if np.count_nonzero(which == k) > 3]
        x = np.array([p[0].mean() for p in parts])
        variance = np.array([residual_sd(p[1]) ** 2 for p in parts])
        ax.errorbar(
            x,
            variance,
            variance * np.sqrt(2.7 / np.array([len(p[1]) for p in parts])),
            fmt="o-",
            ms=3.4,
            lw=1.1,
            color=colour,
            label=name,
        )
    ax.set_ylim(bottom=0)
    label(ax, "Host's speed squared (m²/s²)", "variance of its residual (µm²)")
    give_room(ax)
    legend(ax)
    return True


def _rates_or_lengths(ax: Axes, ladder: Ladder) -> bool:
    """Asked over seen drive frequency by run; lengths stand in the table of tests and in the figure of the layout."""
    rate = _finding(ladder, "frame_rate_error")
    factor = rate.parameters["ratio"][0] if rate else 1.0
    rows = [
        (
            n + 1,
            r.excitation.frequency_hz / run.data.host.frequency_hz,
            run.data.host.omega_sd_rad_per_s / run.data.host.omega_rad_per_s,
        )
        for n, (r, run) in enumerate(zip(ladder.series.recordings, ladder.series.runs, strict=True))
        if r.excitation is not None and r.excitation.frequency_hz and run.data.host.omega_rad_per_s > 0
    ]
    if not rows:
        ax.set_visible(False)
        return False
    number, ratio, sd = np.array(rows).T
    if rate:
        ax.errorbar(number, 1e6 * (ratio * factor - 1), 1e6 * sd, fmt="s", ms=3.4, color=RED, label="as measured")
    ax.errorbar(
        number, 1e6 * (ratio - 1), 1e6 * sd, fmt="o", ms=3.4, color=BLUE, label="corrected" if rate else "as measured"
    )
    ax.axhline(0, color=BLACK, lw=0.7)
    label(ax, "run", "drive asked / seen − 1 (10⁻⁶)")
    give_room(ax)
    if rate:
        legend(ax)
    return True


def layout_figure(ladder: Ladder) -> Figure | None:
    """Markers where the series sees them, against their layout, both bodies; arrows are magnified, the circle is 0.1
    mm.
    """
    series = ladder.series
    if series.layouts is None:
        return None
    bodies = [b for b in ("host", "nes") if b in series.layouts and series.recordings[0].bodies[b].layout_m is not None]
    if not bodies:
        return None
    figure, axes = new_figure(1, 2, height_in=3.7, margins_in=(0.62, 0.12, 0.5, 0.55), gap_in=(0.7, 0.3))
    scale_found = _finding(ladder, "length_scale_error")
    factor = scale_found.parameters["scale"][0] if scale_found else 1.0
    for ax, body in zip(axes[0], bodies, strict=False):
        names = list(series.recordings[0].bodies[body].markers)
        design = 1e3 * np.asarray(series.recordings[0].bodies[body].layout_m, float)[:, :2]
        seen = 1e3 * series.layouts[body][:, :2]
        if body == "nes":
            seen = seen + 1e3 * ladder.flights.fitted.model.origin_m
        reach = float(np.abs(design).max()) or 1.0
        magnified = reach / 3 / max(float(np.nanmax(np.abs(seen * factor - design))), 0.15)
        ax.plot(*design.T, "+", color=BLACK, ms=6, label="layout")
        for values, colour, name in (
            (seen * factor, RED if scale_found else BLUE, "as measured"),
            (seen, BLUE, "corrected"),
        ):
            if name == "corrected" and scale_found is None:
                continue
            tips = design + magnified * (values - design)
            for a, b in zip(design, tips, strict=True):
                ax.plot([a[0], b[0]], [a[1], b[1]], color=colour, lw=1.3)
            ax.plot(*tips.T, ".", color=colour, ms=4, label=name)
        turn = np.linspace(0, 2 * np.pi, 60)
        for k, (place, marker) in enumerate(zip(design, names, strict=True)):
            ax.plot(
                place[0] + 0.1 * magnified * np.cos(turn),
                place[1] + 0.1 * magnified * np.sin(turn),
                color=GREY,
                lw=0.6,
                label="0.1 mm" if k == 0 else None,
            )
            ax.annotate(
                marker,
                place,
                xytext=(4, 4),
                textcoords="offset points",
                fontsize=6.5,
                color="#38424f",
                parse_math=False,
            )
        ax.set_aspect("equal", adjustable="datalim")
        ax.margins(0.12)
        label(ax, "x (mm)", "y (mm)", {"host": "Host", "nes": "NES"}[body] + f", errors × {magnified:.0f}")
        legend(ax, loc="lower left", bbox_to_anchor=(-0.02, 1.07), fontsize=7, columnspacing=0.8)
    for ax in axes[0][len(bodies) :]:
        ax.set_visible(False)
    return figure


def ground_figure(ladder: Ladder) -> Figure | None:
    """What the ground markers do over a run (µm), where they should stand still: together in each run, and each of them
    on the mean of all runs; None without ground markers.
    """
    series = ladder.series
    ground = series.recordings[0].bodies.get("ground")
    if ground is None or not ground.markers or series.points is None:
        return None
    figure, axes = new_figure(2, 2, height_in=4.8, gap_in=(0.6, 0.8), sharey="row")
    for number, points in enumerate(series.points[:MOST_RUNS]):
        part = points[points["marker"].isin(list(ground.markers))]
        for ax, axis in zip(axes[0], "xy", strict=True):
            moved = part[f"{axis}_m"] - part.groupby("marker")[f"{axis}_m"].transform("median")
            together = 1e6 * moved.groupby(part["time_s"]).mean()
            ax.plot(
                together.index,
                together.to_numpy(),
                lw=0.7,
                color=CYCLE[number % len(CYCLE)],
                label=series.names[number],
            )
    for ax, axis in zip(axes[0], "xy", strict=True):
        label(ax, "time (s)", f"{axis} of the ground markers (µm)")
    legend(axes[0, 1], fontsize=7, columnspacing=0.7, handlelength=0.8)
    slow = slow_motion(series)
    assert slow is not None
    off, sd = (1e6 * one for one in slow)
    share = (np.arange(PARTS) + 0.5) / PARTS
    for i, marker in enumerate(ground.markers):
        for column, ax in enumerate(axes[1]):
            here = np.isfinite(sd[:, i, column])
            ax.errorbar(
                share[here], off[here, i, column], sd[here, i, column], fmt="o-", ms=3, lw=0.8,
                color=CYCLE[i % len(CYCLE)], label=marker,
            )  # fmt: skip
    for ax, axis in zip(axes[1], "xy", strict=True):
        label(ax, "share of the run", f"{axis} of each, all runs (µm)")
    legend(axes[1, 1], fontsize=7, columnspacing=0.7, handlelength=0.8)
    return figure


def direct_shrinkage(ladder: Ladder, effect: str) -> tuple[str, float, float, str] | None:
    """(name, RMS as measured, RMS corrected, unit) of the residual that a measurement effect or a centre shows itself
    in; None for others.
    """
    if effect in ("wall_centre_offset", "mass_centre_offset"):
        contact = impact_panels(ladder, effect)
        return (
            ("contact distance against the wall", _robust_rms(contact[0].before), _robust_rms(contact[0].after), "µm")
            if contact
            else None
        )
    at = {"camera_clock_offset": 0, "sensor_window_offset": 0, "plane_tilt": 2}.get(effect)
    panels = view_panels(ladder) if at is not None else []
    if at is None or not panels:
        return None
    before, after = (_robust_rms(v) for v in (panels[at].before, panels[at].after))
    return (
        ("residual between the two views", before, after, "px")
        if at == 0
        else ("height over the plane", before, after, "µm")
    )


def _robust_rms(values: Array) -> float:
    """RMS with the outermost hundredth left out: wrong matches are not what a correction is judged by."""
    size = np.abs(values[np.isfinite(values)])
    return float(np.sqrt(np.mean(size[size <= np.quantile(size, 0.99)] ** 2))) if len(size) else float("nan")
