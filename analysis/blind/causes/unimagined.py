"""Causes in nobody's list that were written after the diagnosis of commit 4722b05, for a sealed trial of it, by
somebody who had read neither the diagnosis nor its laws."""

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


def _chattering_slide(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"chatter": 0.6 * size * spread(rng), "chatter_m_per_s": float(rng.uniform(0.5, 0.9))}
    draft.plant.update(out)
    return out


def _ringing_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {
        "ringing": 0.25 * size * spread(rng) * sign(rng),
        "ringing_rad_per_s": 2.0 * np.pi * float(rng.uniform(25.0, 60.0)),
    }
    draft.plant.update(out)
    return out


def _squashed_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Held at one side, within 0.6 rad of the drive's axis: what stands across it is not squashed."""
    clamp = float(rng.uniform(-0.6, 0.6)) + (np.pi if rng.random() < 0.5 else 0.0)
    out = {"squash_m": 3.5e-4 * size * spread(rng) * sign(rng), "squash_rad": clamp}
    draft.plant.update(out)
    return out


def _half_lid(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    edge = vector(0.012, rng)
    draft.view.update(
        lid_px=1.2 * size * spread(rng) * sign(rng),
        lid_m=edge,
        lid_rad=float(rng.uniform(0.0, 2.0 * np.pi)),
        lid_camera=int(rng.integers(2)),
    )
    return {"lid_px": draft.view["lid_px"], "x_m": edge[0], "y_m": edge[1], "edge_rad": draft.view["lid_rad"]}


UNIMAGINED = [
    # A brushed floor or a felt: smooth one way, rough the other.
    Cause("unknown_napped_floor", "flight", False, changes({"nap": 0.35}, ("nap_rad",))),
    # A floor plate on one screw in its middle, which creeps round under the drive.
    Cause("unknown_turning_floor", "flight", False, changes({"floor_turn_rad_per_s": 7.0}, signed=True)),
    # A magnetised washer between two opposed magnets under the Host: pushed as it lies, and turned off the middle.
    Cause("unknown_stray_poles", "flight", False, changes({"poles_m_per_s2": 0.4}, ("poles_rad",))),
    # A dished washer stands on its inner part only.
    Cause("unknown_domed_disk", "flight", False, changes({"dome": 0.6})),
    # At one sliding speed the washer chatters and floats.
    Cause("unknown_chattering_slide", "flight", False, _chattering_slide),
    # The shaker's table pitches as it is accelerated: one side of the floor presses, the other gives way.
    Cause("unknown_pitching_floor", "flight", False, changes({"pitching": 0.6}, signed=True)),
    # The moving Host pumps air through a gap below its wall.
    Cause("unknown_bellows", "flight", False, changes({"bellows_m_per_s2": 0.7}, signed=True)),
    # The ring still rings from the blow before.
    Cause("unknown_ringing_wall", "impact", False, _ringing_wall),
    # A hard blow squeezes the grease out and meets the metal.
    Cause("unknown_squeezed_grease", "impact", False, changes({"squeezed": 0.6})),
    # Teeth all leaning one way, as a turning tool leaves them: they strike beside the wall's normal.
    Cause("unknown_sawtooth_wall", "impact", False, changes({"saw_rad": 0.045}, signed=True)),
    # A ring that its own inertia presses into its seat, or lifts from it.
    Cause("unknown_seated_ring", "impact", False, changes({"seated": 0.13}, signed=True)),
    # A soft skin gives back the less of a slip the farther it is sheared.
    Cause("unknown_yielding_skin", "impact", False, changes({"skin": 1.5})),
    # A thin ring clamped at one side, squashed as the Host starts one way and stretched as it starts the other.
    Cause("unknown_squashed_ring", "geometry", False, _squashed_ring),
    # A ring that slips in its clamps in the course of a run.
    Cause("unknown_slipping_ring", "geometry", False, changes({"slipping_m": 3.5e-4}, ("slipping_rad",))),
    # A pane over one half of the rig, put there after the calibration.
    Cause("unknown_half_lid", "measurement", False, _half_lid),
    # A trigger line on the amplifier's ground: its threshold goes with the shaker's current.
    Cause("unknown_grounded_trigger", "measurement", False, seen("grounded_s", 4e-4)),
]
