"""When a frame was taken: the acquisition card's trigger times, with what the card missed filled in."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike

from ovines.recording import Recording, read_trigger

_LISTED = 5  # frames named in a note


def frame_times(recording: Recording, frames: ArrayLike) -> tuple[np.ndarray, list[str]]:
    """Times [s] of frame numbers (n,) and notes; a missing trigger is interpolated between its neighbours.

    Trigger pulses that the card missed leave the frames there: their times follow from the pulses about them
    (or, beyond the last one, from the median period).
    """
    frames = np.asarray(frames)
    trigger = recording.settings.time.trigger
    if not trigger:
        return recording.times_s(frames), []
    numbers, times_s = read_trigger(recording.path(trigger))
    notes = []
    base = first_number(recording)
    if (
        base > 0
        and len(frames)
        and numbers[0] == base
        and numbers[-1] > frames.max()
        and np.median(np.diff(numbers)) == 1
    ):
        numbers = numbers - base
        notes.append(f"{trigger} counts frames as the pictures' names do, from {base}; so frame 0 is its {base}")
    absent = ~np.isin(frames, numbers)
    times = np.interp(frames, numbers, times_s)
    if len(numbers) > 1:
        period = float(np.median(np.diff(times_s) / np.diff(numbers)))
        times = np.where(frames < numbers[0], times_s[0] + (frames - numbers[0]) * period, times)
        times = np.where(frames > numbers[-1], times_s[-1] + (frames - numbers[-1]) * period, times)
    elif absent.any():
        return recording.times_s(frames), []
    if len(frames) and numbers[-1] > frames.max():
        notes.append(
            f"{trigger} goes on for {int(np.sum(numbers > frames.max()))} frames after the last picture (frame "
            f"{frames.max()}): cameras stopped "
            "earlier, or dropped frames that nothing in the pictures shows"
        )
    if not absent.any():
        return times, notes
    first = ", ".join(str(n) for n in frames[absent][:_LISTED])
    more = ", ..." if absent.sum() > _LISTED else ""
    notes.append(
        f"{trigger} has no time for {int(absent.sum())} frames ({first}{more}); interpolated between the "
        "pulses about them"
    )
    return times, notes


def first_number(recording: Recording) -> int:
    """Number in the name of every camera's first picture; 0 where they differ, have none, or are videos or tables."""
    firsts = set()
    for camera in recording.cameras:
        files = recording.frame_files(camera.name) if camera.frames else []
        digits = re.findall(r"\d+", files[0].stem) if len(files) > 1 else []
        firsts.add(int(digits[-1]) if digits else 0)
    return firsts.pop() if len(firsts) == 1 else 0
