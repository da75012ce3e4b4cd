"""Times, places and standard deviations of an entry's table that cannot be, or contradict recording.toml."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pandas as pd

from ovines.plausibility.motion import STILL_M
from ovines.plausibility.warning import FEWEST, G_M_PER_S2, PlausibilityWarning
from ovines.recording import Recording, read_trigger

# Frame times that say another rate than frame_rate_hz: a cheap clock is off by 1e-4, another setting by more.  Ten
# times off is a unit or a digit.
RATE_DOUBTFUL, RATE_MOST = 0.01, 8.0
LONGEST_PAUSE = 100  # times the rest of the recording: a digit too many in a time, not a pause
SHORTEST_STEP_S = 1e-9  # no camera takes a picture per nanosecond
LEAST_FRICTION = 1e-3  # a puck on air; steel on a plate has a hundred times that


def exact_sds(recording: Recording, table: pd.DataFrame | None) -> Iterator[PlausibilityWarning]:
    """Standard deviations of 0: infinitely sure, which no fit can weigh."""
    if table is None:
        return
    for name in [column for column in table.columns if "_sd_" in column or column == "sd_px"]:
        exact = table[name].to_numpy(float) == 0.0
        if exact.any():
            yield PlausibilityWarning(
                f"{recording.entry()}.parquet: {name} is 0 in row {int(exact.argmax())}"
                + (f" and in {int(exact.sum()) - 1} more" if exact.sum() > 1 else ""),
                "a standard deviation above 0, or null where it is unknown",
                "write null, also for a Host that stands still",
            )


def pauses(recording: Recording, table: pd.DataFrame | None) -> Iterator[PlausibilityWarning]:
    """One step of the clock that is far longer than all the others together, or steps that are no time at all."""
    if table is None or len(table) < FEWEST:
        return
    instants = table[["frame", "time_s"]].drop_duplicates("frame").sort_values("frame")
    frames, times_s = instants["frame"].to_numpy(), instants["time_s"].to_numpy(float)
    if len(frames) < FEWEST:
        return
    step_s = np.diff(times_s)
    longest = int(step_s.argmax())
    rest_s = float(step_s.sum() - step_s[longest])
    if step_s[longest] > LONGEST_PAUSE * rest_s:
        yield PlausibilityWarning(
            f"{recording.entry()}.parquet: frame {frames[longest]} is followed by frame {frames[longest + 1]} after "
            f"{step_s[longest]:.6g} s",
            f"pauses in proportion to a recording of {rest_s:.4g} s",
            "correct the times, or split the recording there",
        )
    elif float(np.median(step_s)) < SHORTEST_STEP_S:
        yield PlausibilityWarning(
            f"{recording.entry()}.parquet: frames {float(np.median(step_s)):.3g} s apart",
            "times in seconds",
            "correct the times",
        )


def paces(recording: Recording, table: pd.DataFrame | None) -> Iterator[PlausibilityWarning]:
    """A disk so slow for its frames that the least friction would have stopped it from one to the next."""
    if table is None or "nes_x_m" not in table or len(table) < FEWEST:
        return
    values = table[["time_s", "nes_x_m", "nes_y_m"]].to_numpy(float)
    values = values[np.isfinite(values).all(1)]
    if len(values) < FEWEST or float(np.ptp(values[:, 1:], axis=0).max()) < STILL_M:
        return
    step_s = np.diff(values[:, 0])
    speed_m_per_s = float(
        np.quantile(np.hypot(*np.diff(values[:, 1:], axis=0).T) / step_s, 0.95)
    )  # it may rest most of the time
    apart_s = float(np.median(step_s))
    if speed_m_per_s < LEAST_FRICTION * G_M_PER_S2 * apart_s:
        yield PlausibilityWarning(
            f"{recording.entry()}.parquet: the NES moves at {speed_m_per_s:.3g} m/s, in frames {apart_s:.4g} s apart",
            f"times in seconds: friction with a coefficient of {LEAST_FRICTION:g} would stop it from one frame to the "
            f"next",
            "correct the times (are they in milliseconds?)",
        )


def rates(recording: Recording, table: pd.DataFrame | None) -> Iterator[tuple[PlausibilityWarning, float]]:
    """Frame times beside ``frame_rate_hz``, and the ratio of the two rates."""
    nominal_hz = recording.frame_rate_hz
    if nominal_hz is None:
        return
    if recording.settings.time.trigger:
        frames, times_s = read_trigger(recording.path(recording.settings.time.trigger))
        name = recording.settings.time.trigger
    elif table is not None and len(table):
        instants = table[["frame", "time_s"]].drop_duplicates("frame").sort_values("frame")
        frames, times_s = instants["frame"].to_numpy(), instants["time_s"].to_numpy(float)
        name = f"{recording.entry()}.parquet"
    else:
        return
    if len(frames) < 3:
        return
    stated_hz = 1.0 / float(np.median(np.diff(times_s) / np.diff(frames)))
    ratio = stated_hz / nominal_hz
    unit = "; are the times in milliseconds?" if abs(math.log(ratio * 1e3)) < RATE_DOUBTFUL else ""
    yield (
        PlausibilityWarning(
            f"frame_rate_hz = {nominal_hz:g}",
            f"the times of {name} run at {stated_hz:.6g} frames per second{unit}",
            f"correct frame_rate_hz, or the times of {name} (seconds)",
            ("time", "frame_rate_hz"),
        ),
        ratio,
    )
