"""One look for every figure: colours that colour-blind readers can tell apart, units on axes, light frames.

Figures are built with matplotlib's objects (no pyplot, no global state), so they can be drawn in any thread
or notebook.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from matplotlib.transforms import ScaledTranslation
from numpy.typing import ArrayLike, NDArray

from ovines.io.atomic_write import written_whole

FigureFormat = Literal["svg", "png", "pdf"]

# Okabe and Ito, Color Universal Design (2008); black last, yellow left out: it vanishes on white.
BLUE, ORANGE, GREEN, PURPLE, SKY, RED, BLACK = (
    "#0072B2",
    "#E69F00",
    "#009E73",
    "#CC79A7",
    "#56B4E9",
    "#D55E00",
    "#222222",
)
CYCLE = (BLUE, RED, GREEN, PURPLE, ORANGE, SKY, BLACK)
LINE_STYLES = ("-", "--", "-.", ":")
NES_COLOUR, HOST_COLOUR = BLUE, RED
AXIS_COLOURS = {"x": BLUE, "y": RED, "z": GREEN}
GREY = "#7a8594"
WIDTH_IN = 7.6
FONT_PT = 9.0
MM = 1e3
DEG = 180.0 / np.pi  # pages show angles in degrees, small tilts in mrad
MOST_DEGREES = 1000.0  # of an axis; more digits would stand in the axis' label


def new_figure(
    rows: int = 1,
    columns: int = 1,
    height_in: float = 2.8,
    *,
    margins_in: tuple[float, float, float, float] = (0.62, 0.12, 0.46, 0.32),
    gap_in: tuple[float, float] = (0.5, 0.36),
    **options: Any,
) -> tuple[Figure, NDArray[Any]]:
    """A figure of the page's width with (rows, columns) styled axes; ``options`` go to ``Figure.subplots``.

    ``margins_in`` (left, right, bottom, top) and ``gap_in`` (between columns, between rows) are inches.
    Fixed, because matplotlib's own fitting of margins draws every figure twice and took half of a report's
    time.
    """
    figure = Figure(figsize=(WIDTH_IN, height_in))
    FigureCanvasAgg(figure)
    left, right, bottom, top = margins_in
    width = (WIDTH_IN - left - right - gap_in[0] * (columns - 1)) / columns
    height = (height_in - bottom - top - gap_in[1] * (rows - 1)) / rows
    figure.subplots_adjust(
        left=left / WIDTH_IN,
        right=1 - right / WIDTH_IN,
        bottom=bottom / height_in,
        top=1 - top / height_in,
        wspace=gap_in[0] / width,
        hspace=gap_in[1] / height,
    )
    axes = figure.subplots(rows, columns, squeeze=False, **options)
    for ax in axes.flat:
        _quiet(ax)
    return figure, axes


def label(ax: Axes, x: str = "", y: str = "", title: str = "", math: bool = True) -> None:
    """Axis labels and title at fixed distances: in line from panel to panel, and drawn a fifth faster.

    ``math=False`` for a title that is somebody's name and may hold a dollar sign.
    """
    if x:
        ax.set_xlabel(x, fontsize=FONT_PT)
    if y:
        ax.set_ylabel(y, fontsize=FONT_PT)
    place_labels(ax)
    if title or not ax.get_title(loc="left"):
        ax.set_title(title, fontsize=FONT_PT, loc="left", fontweight="bold", y=1.0, pad=4, parse_math=math)


def place_labels(ax: Axes, grown: float = 1.0) -> None:
    """Axis labels at their distances from the axes, ``grown`` times as far for a font as much larger."""
    inches = ax.get_figure().dpi_scale_trans  # type: ignore[union-attr]
    if ax.get_xlabel():
        ax.xaxis.set_label_coords(0.5, 0.0, ax.transAxes + ScaledTranslation(0, -0.27 * grown, inches))
    if ax.get_ylabel():
        ax.yaxis.set_label_coords(0.0, 0.5, ax.transAxes + ScaledTranslation(-0.42 * grown, 0, inches))


def angle_scale(angle_rad: ArrayLike) -> tuple[str, float]:
    """Unit of an axis of angles and its number per radian: degrees, or turns of a body that has made several."""
    angle = np.abs(np.asarray(angle_rad, float))
    if DEG * np.max(angle[np.isfinite(angle)], initial=0.0) < MOST_DEGREES:
        return "°", DEG
    return "turns", float(0.5 / np.pi)


def logarithmic(ax: Axes, which: Literal["x", "y"]) -> None:
    """A logarithmic axis whose labels stand apart: 1, 2 and 5 of each decade as plain numbers, however short it is."""
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    axis = ax.xaxis if which == "x" else ax.yaxis
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def legend(ax: Axes, **options: Any) -> None:
    """A legend in one line above the axes' right end (``options`` may put it elsewhere), if there is anything
    to name.
    """
    if ax.get_legend_handles_labels()[0]:
        ax.legend(
            **{
                "fontsize": FONT_PT - 1,
                "frameon": False,
                "handlelength": 1.5,
                "borderaxespad": 0.1,
                "ncols": 6,
                "columnspacing": 1.2,
                "loc": "lower right",
                "bbox_to_anchor": (1.0, 1.0),
            }
            | options
        )


def thinned(x: ArrayLike, *curves: ArrayLike, points: int = 1200) -> tuple[NDArray[np.float64], ...]:
    """Long curves cut to about ``points`` without losing their extremes: smallest and largest value of each
    bin are kept.

    Gaps (NaN) stay gaps as long as they fill a bin.  All curves are thinned at the same places, those of the
    first.
    """
    x = np.asarray(x, float)
    arrays = [np.asarray(curve, float) for curve in curves]
    if len(x) <= points:
        return (x, *arrays)
    bin_size = -(-len(x) // (points // 2))
    bins = -(-len(x) // bin_size)
    padded = np.full((bins, bin_size), np.nan)
    padded.flat[: len(x)] = arrays[0]
    starts = np.arange(bins) * bin_size
    lowest = starts + np.argmin(np.where(np.isnan(padded), np.inf, padded), axis=1)
    highest = starts + np.argmax(np.where(np.isnan(padded), -np.inf, padded), axis=1)
    keep = np.unique(np.concatenate([lowest, highest]))
    return (x[keep], *(a[keep] for a in arrays))


def robust_limits(values: ArrayLike, share: float = 0.005, margin: float = 0.08) -> tuple[float, float] | None:
    """Axis limits that show all but the wildest ``share`` at either end; None where nothing is finite."""
    finite = np.asarray(values, float)
    finite = finite[np.isfinite(finite)]
    if not len(finite):
        return None
    low, high = np.quantile(finite, [share, 1 - share])
    pad = margin * (high - low) or 0.5 * abs(high) or 1.0
    return float(low - pad), float(high + pad)


def data_uri(figure: Figure, image: FigureFormat) -> str:
    """The figure as the source of an HTML image."""
    buffer = io.BytesIO()
    _save(figure, buffer, image)
    kind = {"svg": "image/svg+xml", "png": "image/png", "pdf": "application/pdf"}[image]
    return f"data:{kind};base64,{base64.b64encode(buffer.getvalue()).decode('ascii')}"


def save_figure(figure: Figure, path: Path) -> Path:
    """Write the figure, whole or not at all; the format is the suffix."""
    with written_whole(path) as temporary, temporary.open("wb") as stream:
        _save(figure, stream, path.suffix.lstrip("."))  # type: ignore[arg-type]
    return path


def length_scale(*lengths_m: ArrayLike) -> tuple[str, float]:
    """Unit for an axis that shows these lengths, and how many of it make a metre: µm below 0.1 mm, else mm."""
    finite = [np.abs(np.asarray(one, float)[np.isfinite(one)]) for one in lengths_m]
    largest = max((float(np.quantile(one, 0.99)) for one in finite if one.size), default=1.0)
    return ("µm", 1e6) if largest < 1e-4 else ("mm", 1e3)


def shade(ax: Axes, spans_s: Sequence[tuple[float, float]], name: str, colour: str = GREY) -> None:
    """Grey bands over the time axis, named once."""
    for i, (start, end) in enumerate(spans_s):
        ax.axvspan(start, end, color=colour, alpha=0.18, lw=0, label=name if i == 0 else None)


def _save(figure: Figure, target: Any, image: FigureFormat) -> None:
    # No date and a fixed salt: the same data give the same file. Text as paths: the page looks alike on every
    # machine.
    with matplotlib.rc_context({"svg.hashsalt": "ovines", "svg.fonttype": "path", "path.simplify_threshold": 0.3}):
        # The title and the creator say whose a file is (ovines.pipeline.ownership): only such files are removed with
        # their page.
        metadata = {
            "svg": {"Date": None, "Title": "ovines"},
            "pdf": {"CreationDate": None, "Creator": "ovines"},
            "png": {"Software": "ovines"},
        }[image]
        figure.savefig(target, format=image, dpi=150, metadata=metadata, facecolor="white")


def _quiet(ax: Axes) -> None:
    ax.tick_params(which="both", labelsize=FONT_PT - 1, colors="#38424f", width=0.6, length=2.5)
    ax.grid(True, color="#e3e7ec", lw=0.6)
    ax.set_axisbelow(True)
    for side, spine in ax.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color("#9aa4b1")
        spine.set_linewidth(0.8)
