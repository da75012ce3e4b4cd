"""Figure of the cameras' trigger as an acquisition card sampled it, over that of a perfect clock (thesis, Fig. 43)."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from analysis.figures.style import BLACK, BLUE, FONT_PT, GREY, ORANGE, label, legend, new_figure, thinned

Array = NDArray[np.float64]
SHOWN_PULSES = 5
MICRO = 1e6
MILLI = 1e3


def trigger_figure(time_s: Array, signal: Array, frames_s: Array, rate_hz: float | None, pulse: str) -> Figure:
    """The sampled ``signal`` (n,) at ``time_s`` over pulses of a perfect clock, and every interval of ``frames_s``.

    The perfect clock runs at ``rate_hz`` (None: at the mean rate) from the first frame shown; its pulses are as long as
    the measured ones in the middle.  ``frames_s``: (frames,) middles or rises of the pulses, as ``pulse`` says.
    """
    period_s = 1.0 / rate_hz if rate_hz else float(np.mean(np.diff(frames_s)))
    figure, axes = new_figure(2, 1, height_in=4.6, gap_in=(0.5, 0.66))
    close, whole = axes[:, 0]
    first = max(0, len(frames_s) // 2 - SHOWN_PULSES // 2)
    shown = slice(first, first + SHOWN_PULSES)
    begin, end = frames_s[shown][0] - 0.7 * period_s, frames_s[shown][-1] + 0.8 * period_s
    seen = (time_s >= begin) & (time_s <= end)
    low, high = (float(level) for level in np.percentile(signal, [1, 99]))
    length_s = _pulse_length_s(time_s[seen], signal[seen] > 0.5 * (low + high))
    start = frames_s[first] - (0.5 * length_s if pulse == "middle" else 0.0)
    edges, levels = [begin], [low]
    for n in range(-1, SHOWN_PULSES + 1):
        rise = start + n * period_s
        edges += [rise, rise, rise + length_s, rise + length_s]
        levels += [low, high, high, low]
    origin = frames_s[first]
    close.plot(
        MILLI * (np.array(edges) - origin), levels, color=ORANGE, lw=2.6, alpha=0.8, label=_clock(rate_hz, period_s)
    )
    close.plot(MILLI * (time_s[seen] - origin), signal[seen], color=BLUE, lw=0.9, label="measured")
    frame_numbers = np.arange(first, first + len(frames_s[shown]))
    for number, instant in zip(frame_numbers, frames_s[shown], strict=True):
        close.axvline(MILLI * (instant - origin), color=GREY, lw=0.7, ls=":")
        close.annotate(
            f"{number}", (MILLI * (instant - origin), high), (0, 3), textcoords="offset points", ha="center",
            fontsize=FONT_PT - 2, color=GREY,
        )  # fmt: skip
    close.set_xlim(MILLI * (begin - origin), MILLI * (end - origin))
    close.set_ylim(low - 0.12 * (high - low), high + 0.25 * (high - low))
    label(close, f"time after frame {first} (ms)", "signal")
    legend(close)
    off_us = MICRO * (np.diff(frames_s) - period_s)
    whole.plot(*thinned(np.arange(1, len(frames_s)), off_us), color=BLACK, lw=0.7, marker=".", ms=2)
    whole.axhline(0.0, color=ORANGE, lw=1.4)
    label(whole, "frame", "interval too long by (μs)")
    return figure


def _pulse_length_s(time_s: Array, above: NDArray[np.bool_]) -> float:
    """How long the signal is up on average over whole pulses; of none, the share of samples that are."""
    rises, falls = (np.flatnonzero(np.diff(above.astype(int)) == way) for way in (1, -1))
    falls = falls[falls > rises[0]] if len(rises) else falls[:0]
    if not len(falls):
        return float(np.mean(above) * (time_s[-1] - time_s[0]))
    return float(np.median(time_s[falls] - time_s[rises[: len(falls)]]))


def _clock(rate_hz: float | None, period_s: float) -> str:
    return f"perfect clock, {1.0 / period_s:.6g} per second" + ("" if rate_hz else " (the mean rate)")
