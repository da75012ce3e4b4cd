"""Unlisted causes in the clocks of the cameras."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, seen, sign, spread


def _skipped_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["skipped_frame_share"] = float(rng.uniform(0.3, 0.7))
    return {"at_share_of_run": draft.view["skipped_frame_share"]}


def _lost_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["lost_frame_share"] = float(rng.uniform(0.3, 0.7))
    return {"at_share_of_run": draft.view["lost_frame_share"]}


def _free_running_camera(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["free_running"] = 1.2e-3 * size * spread(rng) * sign(rng)
    return {"free_running": draft.view["free_running"]}


def _sync_pulses(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Three to six pulses in a run, the first of them somewhere in its first fifth of a second."""
    draft.view.update(
        sync_s=3.3e-4 * size * spread(rng) * sign(rng),
        sync_every_s=float(rng.uniform(0.2, 0.4)),
        sync_late_s=float(rng.uniform(0.0, 0.2)),
    )
    return {"sync_s": draft.view["sync_s"], "every_s": draft.view["sync_every_s"]}


def _settling_loop(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Late or early at first, in each run alike."""
    draft.view.update(loop_s=2.6e-4 * size * spread(rng) * sign(rng), loop_hz=float(rng.uniform(2.0, 5.0)))
    return {"loop_s": draft.view["loop_s"], "frequency_hz": draft.view["loop_hz"]}


def _dropped_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In four runs of ten at size 1, at a place of its own in each; in one at least."""
    count = min(max(round(0.4 * size * spread(rng) * runs), 1), runs) if size > 0.0 else 0
    lost = rng.permutation(runs) < count
    draft.view.update(dropped_from=tuple(np.where(lost, rng.uniform(0.3, 0.7, runs), 1.0).tolist()))
    return {"runs_dropped": float(count)}


def _program_start(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """As early as late, evenly spread over the runs, in no order."""
    most = 0.95e-4 * size * spread(rng)
    draft.view.update(started_s=tuple((most * rng.permutation(np.linspace(-1.0, 1.0, runs))).tolist()))
    return {"started_s": most}


def _drifting_oscillator(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much slower than its mean at first as faster at last, or the other way."""
    most = 0.002 * size * spread(rng) * sign(rng)
    draft.view.update(oscillator=tuple((most * np.linspace(-1.0, 1.0, runs)).tolist()))
    return {"oscillator": most}


def _flickering_lamps(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Twice the frequency of either continent's mains; its phase as the cameras' trigger finds it."""
    draft.view.update(
        flicker_s=1.2e-4 * size * spread(rng),
        flicker_hz=float(rng.choice([100.0, 120.0])),
        flicker_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
    )
    return {"flicker_s": draft.view["flicker_s"], "frequency_hz": draft.view["flicker_hz"]}


def _waking_trigger(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Late or early at first, in each run alike."""
    draft.view["waking_s"] = 2.1e-4 * size * spread(rng) * sign(rng)
    return {"waking_s": draft.view["waking_s"]}


def _exposure_control(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A lamp at any side."""
    draft.view.update(exposure_s=1.3e-4 * size * spread(rng), exposure_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"exposure_s": draft.view["exposure_s"], "angle_rad": draft.view["exposure_rad"]}


CLOCKS = [
    # --- the clock of both cameras ---
    Cause("unknown_uneven_clock", "measurement", seen("uneven_s", 1e-3)),
    Cause("unknown_skipped_frame", "measurement", _skipped_frame),
    # A clock of both cameras that drifts with the room's temperature.
    Cause(
        "unknown_drifting_oscillator",
        "measurement",
        _drifting_oscillator,
        follows="the time in the run, times the number of the run from the middle one",
        rivals=("frame_rate_error",),
        steady_only=True,
    ),
    # A trigger of two channels, one late.
    Cause("unknown_alternating_clock", "measurement", seen("alternate_s", 1.6e-4)),
    # Lamps on the mains, for a trigger that is on them, too.
    Cause(
        "unknown_flickering_lamps",
        "measurement",
        _flickering_lamps,
        follows="the phase of the lamps' light, and the velocity in the picture",
    ),
    # Frames that a program takes, by a timer that ticks.
    Cause(
        "unknown_ticking_timer",
        "measurement",
        seen("tick_s", 2.8e-4),
        follows="how far the time of a frame is from the next of many even ticks, and the velocity in the picture",
    ),
    # --- the second camera's own clock ---
    Cause("unknown_lost_frame", "measurement", _lost_frame),
    # A trigger line on the amplifier's ground: its threshold goes with the shaker's current.
    Cause("unknown_grounded_trigger", "measurement", seen("grounded_s", 4e-4)),
    # Two cameras started together in the middle of their buffers, each with a clock of its own.
    Cause("unknown_free_running_camera", "measurement", _free_running_camera),
    # A second camera that is set right by pulses, and runs free in between.
    Cause(
        "unknown_sync_pulses",
        "measurement",
        _sync_pulses,
        follows="the time since the last of some even pulses, and the velocity in the picture",
    ),
    # A second camera whose clock is pulled in to the first one's as a run begins.
    Cause(
        "unknown_settling_loop",
        "measurement",
        _settling_loop,
        follows="the time in the run, to and fro and dying out, and the velocity in the picture",
    ),
    # A second camera whose trigger takes a while from a run's beginning on to come to its pace.
    Cause(
        "unknown_waking_trigger",
        "measurement",
        _waking_trigger,
        follows="the time in the run, ever less, and the velocity in the picture",
    ),
    # A second camera whose trigger has a worn relay, on the rig's own bench.
    Cause(
        "unknown_shocked_trigger",
        "measurement",
        seen("shocked_s", 3e-5),
        follows="the time since the last blows, how hard they were, and the velocity in the picture",
    ),
    # A second camera that sets its exposure by the light it sees.
    Cause(
        "unknown_exposure_control",
        "measurement",
        _exposure_control,
        follows="the disk's place in the Host along one direction, and the velocity in the picture",
    ),
    # A recorder that loses frames.
    Cause(
        "unknown_dropped_frame",
        "measurement",
        _dropped_frame,
        follows="the velocity in the picture, in some runs and from some frame on",
    ),
    # A second camera that a program starts, sooner or later.
    Cause(
        "unknown_program_start",
        "measurement",
        _program_start,
        follows="the velocity in the picture, in each run by another share",
    ),
]
