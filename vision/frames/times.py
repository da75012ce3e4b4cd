"""When a frame was taken: the acquisition card's trigger times, with what the card missed filled in."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import ArrayLike

from ovines.recording import Recording, read_trigger
from vision.video import UNEVEN, VIDEO_SUFFIXES, presented

OTHER_RATE = 0.05  # by which a video's rate may differ from frame_rate_hz before it is slow motion

_LISTED = 5  # frames named in a note


def frame_times(recording: Recording, frames: ArrayLike) -> tuple[np.ndarray, list[str]]:
    """Times [s] of frame numbers (n,) and notes; a missing trigger is interpolated between its neighbours.

    Trigger pulses that the card missed leave the frames there: their times follow from the pulses about them
    (or, beyond the last one, from the median period).
    """
    frames = np.asarray(frames)
    trigger = recording.settings.time.trigger
    if not trigger:
        return _shown_times(recording, frames) or (recording.times_s(frames), [])
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


def _shown_times(recording: Recording, frames: np.ndarray) -> tuple[np.ndarray, list[str]] | None:
    """Times and notes where videos say more than ``frame_rate_hz``: frames at uneven times, or no rate was given."""
    shown = {}
    for camera in recording.cameras:
        files = recording.frame_files(camera.name) if camera.frames else []
        if len(files) == 1 and files[0].suffix.lower() in VIDEO_SUFFIXES:
            shown[camera.name] = presented(files[0])
    known = {name: one for name, one in shown.items() if one is not None}
    nominal_hz = recording.frame_rate_hz
    if not known or (nominal_hz is not None and all(one.even for one in known.values())):
        return None
    name, first = next(iter(known.items()))
    notes = []
    scale = 1.0
    if nominal_hz is not None and abs(first.rate_hz / nominal_hz - 1.0) > OTHER_RATE:
        scale = first.rate_hz / nominal_hz
        notes.append(
            f"{name}: its video shows {first.rate_hz:.4g} frames per second and frame_rate_hz says {nominal_hz:g}: "
            f"taken as slow motion, its times divided by {1 / scale:.4g}"
        )
    number, times_s = np.arange(len(first.times_s)), scale * first.times_s
    usual_s = scale / first.rate_hz
    times = np.interp(frames, number, times_s) + usual_s * np.maximum(frames - number[-1], 0)
    if first.even:
        notes.append(f"times are those of {name}'s video, {first.rate_hz:.6g} frames per second")
    else:
        most_s = scale * float(np.diff(first.times_s).max())
        notes.append(
            f"{name}: frames at uneven times (usually every {1e3 * usual_s:.3g} ms, once {1e3 * most_s:.3g} ms apart); "
            f"the video's presentation times are used"
        )
    for other, one in list(known.items())[1:]:
        count = min(len(one.times_s), len(first.times_s))
        apart_s = scale * float(np.abs(one.times_s[:count] - first.times_s[:count]).max())
        if apart_s > UNEVEN * usual_s:
            notes.append(
                f"{other} shows frames of one number up to {1e3 * apart_s:.3g} ms from {name}: cameras with clocks of "
                f"their own do not see one instant, and places between them are wrong by what moves meanwhile"
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
