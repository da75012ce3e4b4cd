"""When the two cameras take their frames, and how late the second one is."""

import numpy as np

from analysis.blind.plant.compiled import Floats
from analysis.blind.plant.host import HOST_M_PER_S2, host_pose
from analysis.blind.recording.errors import ViewErrors

EARLIEST_S = -1.9e-3  # just after the plant begins
SHOCK_M_PER_S = 1.0  # change of the disk's velocity in a blow after which a trigger is late by `shocked_s`
EXPOSED_M = 0.04  # from the Host's middle to where a camera's exposure is off by what its cause says: at the wall
EXPOSED_MOST = 1.5  # of that, in a corner of the wall
SHOCK_S = 0.04  # in which it recovers: most of a flight
WAKING_S = 0.3  # in which a trigger comes to its pace by two thirds: a quarter of a run
LOOP_S = 0.4  # in which a clock that is pulled in swings out: a third of a run


def latest_s(errors: ViewErrors, longest_s: float) -> float:
    """How late the second camera may be at most, in a run of `longest_s`."""
    late_s = abs(errors.clock_s) + 5 * errors.jitter_s + 1.5 * abs(errors.grounded_s)
    late_s += 0.5 * abs(errors.free_running) * longest_s + 0.5 * abs(errors.sync_s)
    late_s += max((abs(late) for late in errors.started_s), default=0.0)
    late_s += EXPOSED_MOST * abs(errors.exposure_s) + abs(errors.waking_s)
    late_s += 0.5 * errors.tick_s + abs(errors.loop_s)
    return late_s + 6.0 * abs(errors.shocked_s) + abs(errors.flicker_s)


def frame_times(frames: int, rate_hz: float, errors: ViewErrors, rng: np.random.Generator) -> Floats:
    """Times (n,) of the first camera's frames: scattered, uneven in the course of the run, every other one late, at a
    timer's ticks, or one of them skipped.

    Lamps on the mains flicker: a frame shows what is there when its exposure has had half of its light, sooner or later
    by `flicker_s` sin(2 pi `flicker_hz` t + `flicker_rad`), t the time in the run.
    A program takes the frames, whose timer ticks every `tick_s`: each at the first tick from when it is due on; half a
    tick, which all have in common, is in none of the times.
    """
    even = np.arange(frames) / rate_hz
    time_s = np.maximum(even + rng.normal(0.0, 1.0, frames) * errors.jitter_s, EARLIEST_S)
    share = np.arange(frames) / frames
    time_s += 4.0 * errors.uneven_s * share * (1.0 - share)
    time_s += errors.alternate_s * (np.arange(frames) % 2)
    time_s += errors.flicker_s * np.sin(2.0 * np.pi * errors.flicker_hz * even + errors.flicker_rad)
    if errors.tick_s > 0.0:
        time_s += errors.tick_s * (np.ceil(even / errors.tick_s) - even / errors.tick_s - 0.5)
    if errors.skipped_frame_share > 0.0:
        time_s = np.where(share < errors.skipped_frame_share, time_s, time_s + 1.0 / rate_hz)[:-1]
    return time_s


def of_the_second_camera(
    time_s: Floats,
    lines: Floats,
    impact_s: Floats,
    kicks: Floats,
    run: int,
    rate_hz: float,
    errors: ViewErrors,
) -> Floats:
    """Times (n,) of its frames in `run` where those of the first camera are `time_s`, one after the other at `rate_hz`;
    `lines` of the Host's path, `kicks` (k, 2) of the disk at `impact_s`."""
    late_s = grounded_s(time_s, lines, errors) + free_running_s(time_s, errors) + pulsed_s(time_s, errors)
    late_s += shocked_s(time_s, impact_s, kicks, errors) + looped_s(time_s, errors)
    late_s += woken_s(time_s, errors)
    late_s += dropped_s(len(time_s), run, rate_hz, errors)
    if errors.started_s:  # by a program, which is never as quick
        late_s += errors.started_s[run]
    return time_s + errors.clock_s + late_s


def grounded_s(time_s: Floats, lines: Floats, errors: ViewErrors) -> Floats:
    """How late its trigger on the amplifier's ground is (n,): by the Host's acceleration along x, of its
    `lines` (m, 7), `grounded_s` at `HOST_M_PER_S2`."""
    if errors.grounded_s == 0.0:
        return np.zeros(len(time_s))
    pull = np.array([host_pose(t, lines)[2][0] for t in time_s])
    return errors.grounded_s * pull / HOST_M_PER_S2


def free_running_s(time_s: Floats, errors: ViewErrors) -> Floats:
    """How late it is (n,) by a clock of its own that agrees in the middle of the run."""
    if errors.free_running == 0.0:
        return np.zeros(len(time_s))
    return errors.free_running * (time_s - 0.5 * (time_s[0] + time_s[-1]))


def pulsed_s(time_s: Floats, errors: ViewErrors) -> Floats:
    """How late it is (n,) where its own clock gains `sync_s` from one pulse of the first camera to the next,
    `sync_every_s` later, which sets it back; a pulse comes `sync_late_s` into the run."""
    if errors.sync_s == 0.0:
        return np.zeros(len(time_s))
    passed = (time_s - errors.sync_late_s) / errors.sync_every_s
    return errors.sync_s * (passed - np.floor(passed) - 0.5)


def looped_s(time_s: Floats, errors: ViewErrors) -> Floats:
    """How late it is (n,) where a loop pulls its clock in to the first camera's as a run begins, and overshoots: by
    `loop_s` exp(-t / `LOOP_S`) cos(2 pi `loop_hz` t), t the time in the run."""
    if errors.loop_s == 0.0:
        return np.zeros(len(time_s))
    passed = np.maximum(time_s, 0.0)
    return errors.loop_s * np.exp(-passed / LOOP_S) * np.cos(2.0 * np.pi * errors.loop_hz * passed)


def woken_s(time_s: Floats, errors: ViewErrors) -> Floats:
    """How late it is (n,) where its trigger comes to its pace as a run goes on: by `waking_s` exp(-t / `WAKING_S`), t
    the time in the run."""
    if errors.waking_s == 0.0:
        return np.zeros(len(time_s))
    return errors.waking_s * np.exp(-np.maximum(time_s, 0.0) / WAKING_S)


def exposed_s(place_m: Floats, errors: ViewErrors) -> Floats:
    """How late the second camera is (n,) where its exposure sets itself by the light and is stated by its beginning.

    Bare steel is bright on the lamp's side and dark opposite, and the middle of a longer exposure is later: by
    `exposure_s` s / `EXPOSED_M`, s the disk's place `place_m` (n, 2) in the Host along `exposure_rad`.
    """
    if errors.exposure_s == 0.0:
        return np.zeros(len(place_m))
    along = place_m @ np.array([np.cos(errors.exposure_rad), np.sin(errors.exposure_rad)])
    return errors.exposure_s * np.clip(along / EXPOSED_M, -EXPOSED_MOST, EXPOSED_MOST)


def shocked_s(time_s: Floats, impact_s: Floats, kicks: Floats, errors: ViewErrors) -> Floats:
    """How late it is (n,) where each blow shakes its trigger's worn relay, which then closes late and recovers.

    By `shocked_s` (|kick| / `SHOCK_M_PER_S`) exp(-since / `SHOCK_S`), of the last blow before: of those at `impact_s`
    (k,) with the disk's changes of velocity `kicks` (k, 2).
    """
    late = np.zeros(len(time_s))
    if errors.shocked_s == 0.0:
        return late
    for instant, kick in zip(impact_s, np.hypot(*kicks.T), strict=True):
        since = np.maximum(time_s - instant, 0.0)
        late = np.where(time_s >= instant, kick * np.exp(-since / SHOCK_S), late)
    return errors.shocked_s / SHOCK_M_PER_S * late


def dropped_s(frames: int, run: int, rate_hz: float, errors: ViewErrors) -> Floats:
    """How much later than its number says each of its frames (`frames`,) was taken in `run`: one frame later from where
    one was lost, `dropped_from` [run] of the run; there is none where that is 1."""
    if not errors.dropped_from:
        return np.zeros(frames)
    return np.where(np.arange(frames) >= errors.dropped_from[run] * frames, 1.0 / rate_hz, 0.0)
