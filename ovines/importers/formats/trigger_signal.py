"""The cameras' trigger as an acquisition card sampled it, to frame times (thesis Fig. 43)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from ovines.errors import InputError

Array = NDArray[np.float64]
# A pulse begins above and ends below these shares of the signal's swing: noise in between makes no pulse of its own.
HIGH, LOW = 0.7, 0.3
LEAST_SWING = 5.0  # of the levels' own scatter: less is no pulse train
EARLY = 0.5  # of the usual period: pulses closer than this are no two frames


def frame_times_s(time_s: Array, signal: Array, pulse: Literal["middle", "rise"]) -> Array:
    """Times (frames,) of the pulses in ``signal`` (n,) at ``time_s`` (n,): where half of the swing is passed, between
    samples by a straight line. ``middle`` of a pulse that lasts as long as the exposure, or its ``rise``.

    A pulse that the record's ends cut is left out.
    """
    low, high = np.percentile(signal, [1, 99])
    middle = 0.5 * (low + high)
    scatter = max(float(np.std(part)) for part in (signal[signal <= middle], signal[signal > middle]) if len(part))
    if not high - low > LEAST_SWING * scatter or high == low:
        raise InputError(
            f"a signal between {low:g} and {high:g} that scatters by {scatter:.2g}",
            "pulses: two levels, well apart",
            "check which column is the trigger",
        )
    state = np.where(signal > low + HIGH * (high - low), 1, np.where(signal < low + LOW * (high - low), 0, -1))
    known = np.flatnonzero(state >= 0)
    turns = np.flatnonzero(np.diff(state[known]) != 0)
    before, after, rising = known[turns], known[turns + 1], state[known[turns + 1]] == 1
    crossed = np.array([_crossing(time_s, signal, a, b, middle) for a, b in zip(before, after, strict=True)])
    rises, falls = crossed[rising], crossed[~rising]
    if pulse == "rise":
        times = rises
    else:
        falls = falls[falls > rises[0]] if len(rises) else falls
        times = 0.5 * (rises[: len(falls)] + falls[: len(rises)])
    if len(times) < 2:
        raise InputError(f"{len(times)} pulses", "a pulse for each frame, two or more", "record the whole run")
    period = float(np.median(np.diff(times)))
    if (early := np.flatnonzero(np.diff(times) < EARLY * period)).size:
        raise InputError(
            f"pulses {early[0]} and {early[0] + 1} are {1e3 * np.diff(times)[early[0]]:.3g} ms apart, others "
            f"{1e3 * period:.3g} ms",
            "a pulse for each frame",
            "filter the record, or take out what is no trigger",
        )
    return np.asarray(times, dtype=float)


def read_signal(path: Path) -> tuple[Array, Array]:
    """``time_s`` and the one other column of a CSV file, (n,) each."""
    do = "write a header time_s,NAME and a row per sample"
    try:
        table = pd.read_csv(path.absolute(), skipinitialspace=True)
        table.columns = [str(name).strip() for name in table.columns]
        values = table.to_numpy(dtype=float)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: {str(error)[:200]}", "a CSV file of numbers: time_s and the signal", do) from None
    if len(table.columns) != 2 or table.columns[0] != "time_s" or len(table) < 4:
        raise InputError(f"{path}: {len(table)} rows of {', '.join(table.columns)[:80]}", "time_s and one signal", do)
    if not np.isfinite(values).all() or np.any(np.diff(values[:, 0]) <= 0):
        raise InputError(f"{path}: times or values that are no increasing, finite numbers", "one sample per row", do)
    return values[:, 0], values[:, 1]


def _crossing(time_s: Array, signal: Array, before: int, after: int, level: float) -> float:
    """Where the signal passes ``level`` between two samples on its two sides."""
    inside = slice(before, after + 1)
    side = signal[inside] > level
    k = before + int(np.flatnonzero(side != side[0])[0]) - 1
    share = (level - signal[k]) / (signal[k + 1] - signal[k])
    return float(time_s[k] + share * (time_s[k + 1] - time_s[k]))
