"""Where on the Host's plane the residual lies, and the re-simulated trajectory beside the measured one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, BLUE, DEG, GREY, RED, label, legend, logarithmic, new_figure
from analysis.flights.cutting.first_wall import from_host
from analysis.flights.cutting.runs import Run
from analysis.gap.ladder import Ladder
from analysis.gap.page.figures.panels import give_room
from analysis.gap.prediction.predict import QUANTITIES

Array = NDArray[np.float64]
MODELS = ("recalibrated", "with_effect")
SQUARES = 22
# A residual this many times the run's median is a wrong frame or a missed impact; it would colour its square alone.
WILD = 8.0


@dataclass(frozen=True, eq=False)
class Paths:
    """Predictions of one run: frames (N,), times, measured (N, 3) and per model (N, 3) of x, y (m) and angle (rad)."""

    run: Run
    frame: NDArray[np.int64]
    time_s: Array
    measured: Array
    models: dict[str, Array]


def paths_of(ladder: Ladder, predictions: pd.DataFrame) -> list[Paths]:
    """The predictions' table as arrays, a run each; runs without a prediction are left out."""
    if predictions.empty:
        return []
    out = []
    by_run = dict(tuple(predictions.groupby("run", sort=False)))
    for run in ladder.series.runs:
        table = by_run.get(run.data.name)
        if table is None or table.empty:
            continue
        parts = [table[table["quantity"] == q].set_index("frame") for q in QUANTITIES]
        frame = parts[0].index.to_numpy(np.int64)
        models = {m: np.column_stack([p[m].reindex(frame).to_numpy(float) for p in parts]) for m in MODELS}
        measured = np.column_stack([p["measured"].reindex(frame).to_numpy(float) for p in parts])
        out.append(Paths(run, frame, parts[0]["time_s"].to_numpy(float), measured, models))
    return out


def same_models(paths: list[Paths]) -> bool:
    """Nothing was added: the two models predict the same."""
    return all(np.array_equal(p.models["recalibrated"], p.models["with_effect"], equal_nan=True) for p in paths)


def where_map(paths: list[Paths]) -> Figure:
    """RMS of the held-out residual (µm) in squares of the Host's plane, for each model on one colour scale."""
    shown = MODELS[1:] if same_models(paths) else MODELS
    place: list[Array] = []
    errors: dict[str, list[Array]] = {m: [] for m in shown}
    for p in paths:
        place.append(in_host(p))
        for m in shown:
            e = np.hypot(*(p.measured[:, :2] - p.models[m][:, :2]).T)
            limit = WILD * np.nanmedian(e) if np.isfinite(e).any() else np.inf
            errors[m].append(np.where(e < limit, e, np.nan))
    xy = 1e3 * np.concatenate(place)
    outlines = [1e3 * edge for edge in paths[0].run.data.wall.edges_m()]
    reach = 1.02 * float(np.abs(outlines[0]).max())
    edges = np.linspace(-reach, reach, SQUARES + 1)
    maps = {m: 1e6 * _rms_map(xy, np.concatenate(errors[m]), edges) for m in shown}
    finite = np.concatenate([v[np.isfinite(v) & (v > 0)] for v in maps.values()])
    figure, axes = new_figure(1, 2, height_in=3.4, margins_in=(0.62, 0.9, 0.5, 0.32), gap_in=(0.5, 0.3))
    norm = LogNorm(*np.quantile(finite, [0.02, 0.98])) if len(finite) > 3 and np.ptp(finite) > 0 else None
    mesh: Any = None
    for ax, m in zip(axes[0], shown, strict=False):
        mesh = ax.pcolormesh(edges, edges, maps[m].T, norm=norm, cmap="viridis")
        for outline in outlines:
            ax.plot(*outline.T, color=GREY, lw=0.8)
        ax.set_aspect("equal")
        title = (
            "nominal model"
            if len(shown) == 1
            else {"recalibrated": "recalibrated", "with_effect": "with the effect"}[m]
        )
        label(ax, "x from the Host's centre (mm)", "y (mm)" if m == shown[0] else "", title)
    if len(shown) == 1:
        axes[0, 1].set_visible(False)
    bar = figure.colorbar(mesh, cax=figure.add_axes((0.9 if len(shown) == 2 else 0.51, 0.16, 0.018, 0.72)))
    bar.set_label("RMS of the residual (µm)", fontsize=8)
    bar.ax.tick_params(labelsize=7.5)
    return figure


def in_host(path: Paths) -> Array:
    """Where the NES was in the predicted frames (N, 2), seen from the Host and in its directions (m)."""
    relative, angle = from_host(path.run.data)
    c, s = np.cos(angle), np.sin(angle)
    own = np.column_stack([c * relative[:, 0] + s * relative[:, 1], c * relative[:, 1] - s * relative[:, 0]])
    return own[pd.Index(path.run.frame).get_indexer(path.frame)]


def _rms_map(xy: Array, error: Array, edges: Array) -> Array:
    ok = np.isfinite(error) & np.isfinite(xy).all(1)
    total, _, _ = np.histogram2d(xy[ok, 0], xy[ok, 1], [edges, edges], weights=error[ok] ** 2)
    count, _, _ = np.histogram2d(xy[ok, 0], xy[ok, 1], [edges, edges])
    return np.sqrt(np.where(count >= 2, total / np.maximum(count, 1), np.nan))


@dataclass(frozen=True, eq=False)
class FlightErrors:
    """RMS of the residual (m) of each predicted flight, per model, and the models' difference; which run and frames it
    is.
    """

    path: int
    first: int
    last: int
    rms: dict[str, float]
    apart: float


def flight_errors(paths: list[Paths]) -> list[FlightErrors]:
    """One entry per flight that was predicted on five frames or more."""
    out = []
    for number, p in enumerate(paths):
        for flight in p.run.flights:
            frames = p.run.frame[[flight.first, flight.last]]
            at = np.flatnonzero((p.frame >= frames[0]) & (p.frame <= frames[1]))
            error = {m: np.hypot(*(p.measured[at, :2] - p.models[m][at, :2]).T) for m in MODELS}
            if any(np.count_nonzero(np.isfinite(e)) < 5 for e in error.values()):
                continue
            apart = np.hypot(*(p.models["recalibrated"][at, :2] - p.models["with_effect"][at, :2]).T)
            out.append(
                FlightErrors(
                    number,
                    int(at[0]),
                    int(at[-1]),
                    {m: float(np.sqrt(np.nanmean(e**2))) for m, e in error.items()},
                    float(np.sqrt(np.nanmean(apart**2))),
                )
            )
    return out


def flights_figure(errors: list[FlightErrors], chosen: FlightErrors) -> Figure:
    """Every flight's RMS with the effect against without: below the diagonal it helps."""
    figure, axes = new_figure(1, 2, height_in=3.0, gap_in=(0.75, 0.3))
    a = 1e3 * np.array([e.rms["recalibrated"] for e in errors])
    b = 1e3 * np.array([e.rms["with_effect"] for e in errors])
    ax = axes[0, 0]
    ends = np.array([min(a.min(), b.min()), max(a.max(), b.max())]) * np.array([0.7, 1.4])
    ax.plot(ends, ends, color=BLACK, lw=0.8)
    ax.plot(a, b, "o", ms=3, color=BLUE, alpha=0.6, mew=0, label="a flight each")
    ax.plot(
        1e3 * chosen.rms["recalibrated"],
        1e3 * chosen.rms["with_effect"],
        "o",
        ms=8,
        mfc="none",
        mec=RED,
        label="shown below",
    )
    logarithmic(ax, "x")
    logarithmic(ax, "y")
    label(ax, "recalibrated (mm RMS)", "with the effect (mm RMS)", "each flight")
    legend(ax, loc="upper left", bbox_to_anchor=(0.02, 1.0), ncols=1)
    ax = axes[0, 1]
    for values, colour, name in ((a, RED, "recalibrated"), (b, BLUE, "with the effect")):
        ax.plot(np.sort(values), np.arange(1, len(values) + 1) / len(values), color=colour, lw=1.3, label=name)
    logarithmic(ax, "x")
    label(ax, "error of a flight (mm RMS)", "share of the flights below")
    legend(ax)
    return figure


def chosen_flight(errors: list[FlightErrors]) -> FlightErrors | None:
    """Where the two models are furthest apart; where they are the same, the flight that is predicted worst."""
    if not errors:
        return None
    same = all(e.apart == 0 for e in errors)
    return max(errors, key=lambda e: e.rms["with_effect"] if same else e.apart)


def trajectory(path: Paths, chosen: FlightErrors) -> Figure:
    """Measured and re-simulated path in the plane and over time around the chosen flight; differences in mm below."""
    first, last = max(chosen.first - 25, 0), min(chosen.last + 25, len(path.frame) - 1)
    at = np.arange(first, last + 1)
    time_ms = 1e3 * (path.time_s - path.time_s[0])  # a clock may have run for days
    t = time_ms[at]
    one = np.array_equal(path.models["recalibrated"], path.models["with_effect"], equal_nan=True)
    styles = (
        [("with_effect", BLUE, "-", "nominal model")]
        if one
        else [("recalibrated", RED, "--", "without the effect"), ("with_effect", BLUE, "-", "with the effect")]
    )
    figure, axes = new_figure(2, 3, height_in=4.4, margins_in=(0.7, 0.12, 0.5, 0.42), gap_in=(0.78, 0.3), sharex="col")
    breaks = _breaks(path, at)
    for column, (name, scale, unit, finer, change) in enumerate(
        (("x", 1e3, "mm", 1e3, "mm"), ("y", 1e3, "mm", 1e3, "mm"), ("angle", DEG, "°", 1e3 * DEG, "10⁻³ °"))
    ):
        top, bottom = axes[:, column]
        measured = path.measured[at, column]
        top.plot(t, scale * measured, ".", ms=3.5, color=GREY, label="measured")
        for model, colour, style, words in styles:
            predicted = np.where(breaks, np.nan, path.models[model][at, column])
            top.plot(t, scale * predicted, style, color=colour, lw=1.1, label=words)
            bottom.plot(t, finer * (predicted - measured), style, color=colour, lw=1.1)
        bottom.axhline(0, color=BLACK, lw=0.7)
        for ax in (top, bottom):
            ax.axvspan(time_ms[chosen.first], time_ms[chosen.last], color=GREY, alpha=0.12, lw=0)
        label(top, "", f"{name} ({unit})")
        label(bottom, "time in the run (ms)", f"model − measured ({change})")
        give_room(top)
        give_room(bottom)
    legend(axes[0, 0], loc="lower left", bbox_to_anchor=(0, 1.02))
    return figure


def _breaks(path: Paths, at: NDArray[np.int64]) -> NDArray[np.bool_]:
    """First frame of each flight, where a line must not be drawn from the flight before."""
    starts = {int(path.run.frame[f.first]) for f in path.run.flights}
    return np.array([int(f) in starts for f in path.frame[at]])
