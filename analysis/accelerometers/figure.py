"""Figure of the Host's acceleration as cameras and accelerometers saw it."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.figures.style import BLACK, BLUE, RED, label, legend, new_figure, thinned

SHOWN_FRAMES = 250  # over which single periods can be distinguished


def accelerations_figure(table: pd.DataFrame) -> Figure:
    """``table`` as `accelerations.parquet` has it: per channel both curves in the run's middle, and their difference
    over the whole run.
    """
    channels = list(dict.fromkeys(table["channel"]))
    figure, axes = new_figure(len(channels), 2, height_in=0.6 + 2.1 * len(channels), gap_in=(0.65, 0.62), sharex="col")
    for (close, whole), name in zip(axes, channels, strict=True):
        one = table[table["channel"] == name]
        time_s = one["time_s"].to_numpy(float)
        own, seen = one["record_m_per_s2"].to_numpy(float), one["cameras_m_per_s2"].to_numpy(float)
        begin = max(0, len(one) // 2 - SHOWN_FRAMES // 2)
        middle = slice(begin, begin + SHOWN_FRAMES)
        close.plot(time_s[middle], seen[middle], color=RED, lw=1.1, label="cameras")
        close.plot(time_s[middle], own[middle], color=BLUE, lw=1.1, ls="--", label="record")
        whole.plot(*thinned(time_s, own - seen), color=BLACK, lw=0.7, label="record less cameras")
        whole.set_ylim(*_bounds(own - seen, seen))
        last = name == channels[-1]
        label(close, "time (s)" if last else "", "acceleration (m/s²)", name, math=False)
        label(whole, "time (s)" if last else "", "difference (m/s²)")
        legend(close)
        legend(whole)
    return figure


def _bounds(difference: np.ndarray, seen: np.ndarray) -> tuple[float, float]:
    """Limits that show the difference, and do not blow up what is far below the motion."""
    most = max(1.1 * float(np.abs(difference).max()), 0.02 * float(np.abs(seen).max()), 1e-9)
    return -most, most
