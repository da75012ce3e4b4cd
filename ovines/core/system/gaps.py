"""Gaps in a measured Host motion: how far a spline over one misses the path, tried where nothing is missing."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ovines.core.refusal import require

LONG = 1.5  # of a table's usual step: longer, frames are missing
UNEVEN = 0.1  # of the steps: with more long ones the table has no step of its own, and no gaps
SIDE = 8  # frames on either side that a trial's spline is given
TRIALS = 40
SHARE = 1e-3  # of the span that an axis moves over: as much may be missed
NOISE = 5.0  # times what one left-out frame is missed by: below, noise is what is missed


def refuse_gaps(time_s: np.ndarray, axes: dict[str, np.ndarray], duration_s: float) -> None:
    """Refuse a table whose spline cannot carry the path over a gap within the run.

    A gap as long is made where the table has none, and bridged as the spline bridges it: missed by more than a
    thousandth of what the axis moves over, and by more than five times what a single left-out frame is missed by, it is
    no measured motion any more.  Both are the table's own, whatever the rig's size and rate.
    """
    steps = np.diff(time_s)
    usual = float(np.median(steps))
    long = steps > LONG * usual
    within = long & (time_s[:-1] < duration_s) & (time_s[1:] > 0.0)
    if not within.any() or long.mean() > UNEVEN:
        return
    longest = int(np.argmax(np.where(within, steps, 0.0)))
    missing = round(float(steps[longest]) / usual) - 1
    found = f"a Host table with a gap of {steps[longest]:.3g} s ({missing} frames) at {time_s[longest]:.6g} s"
    expected = "a motion measured throughout, or gaps that a spline carries it over"
    do = "give the missing frames, or a run that lies before or after the gap"
    for name, values in axes.items():
        span = float(np.ptp(values))
        if span == 0.0:
            continue
        missed = _missed(time_s, values, long, max(missing, 1))
        require(
            missed is not None, f"{found}, and nowhere else as many frames in a row to try a spline on", expected, do
        )
        single = _missed(time_s, values, long, 1)
        assert missed is not None and single is not None  # what holds many frames holds one
        fine = missed <= max(SHARE * span, NOISE * single)
        require(fine, f"{found}: a spline over as many of {name} misses them by up to {missed:.3g}", expected, do)


def _missed(time_s: np.ndarray, values: np.ndarray, long: np.ndarray, missing: int) -> float | None:
    """The most that splines miss of ``missing`` frames in a row (None: no row is long enough)."""
    worst = [_trial(time_s, values, start, missing) for start in _rows(long, missing + 2 * SIDE)]
    return max(worst, default=None)


def _rows(long: np.ndarray, length: int) -> Iterator[int]:
    """Where rows of that many frames without a gap begin: some, spread over the table."""
    broken = np.concatenate([[0], np.cumsum(long)])
    starts = np.arange(len(broken) - length + 1)
    whole = starts[broken[starts + length - 1] == broken[starts]]
    yield from (int(one) for one in whole[:: max(len(whole) // TRIALS, 1)])


def _trial(time_s: np.ndarray, values: np.ndarray, start: int, missing: int) -> float:
    """What a spline misses of the frames in the middle, given those on either side."""
    from scipy.interpolate import CubicSpline  # slow to load

    row = slice(start, start + missing + 2 * SIDE)
    t, true = time_s[row], values[row]
    kept = np.ones(len(t), dtype=bool)
    kept[SIDE : SIDE + missing] = False
    return float(np.max(np.abs(CubicSpline(t[kept], true[kept])(t[~kept]) - true[~kept])))
