"""Causes in nobody's list, an eleventh group: the sixteen that an experimenter at such a bench would name first, listed
before the plant was read by somebody who had read neither the diagnosis nor its laws.  Some of them are earlier causes
once more, in another form.  What each is and its law: the docstrings of `plant.plausible` and `recording.plausible`."""

import math

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, spread


def _scratched_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Scratched along the drive, more or less: it rubs most across that."""
    out = {"scratched": 0.3 * size * spread(rng), "scratched_rad": 0.5 * math.pi + float(rng.uniform(-0.4, 0.4))}
    draft.plant.update(out)
    return out


def _lifted_disk(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It settles within a flight or two."""
    out = {"lifted": 0.6 * size * spread(rng), "lifted_s": float(rng.uniform(0.03, 0.05))}
    draft.plant.update(out)
    return out


def _warming_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as much harder than on the mean at first as softer at last."""
    most = 0.1 * size * spread(rng)
    draft.run_numbers.update(warmed=most * np.linspace(-1.0, 1.0, runs))
    return {"warmed": most}


def _shaking_tripod(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In any direction of the picture, late by a quarter of the drive's period at most."""
    draft.view.update(
        tripod_px=1.0 * size * spread(rng),
        tripod_rad=float(rng.uniform(0.0, 2.0 * math.pi)),
        tripod_s=float(rng.uniform(0.0, 0.02)),
    )
    return {"tripod_px": draft.view["tripod_px"], "late_s": draft.view["tripod_s"]}


def _dropped_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """In four runs of ten at size 1, at a place of its own in each; in one at least."""
    count = min(max(round(0.4 * size * spread(rng) * runs), 1), runs) if size > 0.0 else 0
    lost = rng.permutation(runs) < count
    draft.view.update(dropped_from=tuple(np.where(lost, rng.uniform(0.3, 0.7, runs), 1.0).tolist()))
    return {"runs_dropped": float(count)}


PLAUSIBLE = [
    # Friction of plastic: it holds what creeps and lets run what runs.
    Cause("unknown_stribeck_floor", "flight", False, changes({"stribeck": 0.8})),
    # A floor plate that is worn in its middle, where most sliding is done: polished, or roughened.
    Cause("unknown_worn_middle", "flight", False, changes({"worn": 0.4}, signed=True)),
    # Scratches along the drive.
    Cause("unknown_scratched_floor", "flight", False, _scratched_floor),
    # A floor plate that sags between its screws.
    Cause("unknown_dished_floor", "flight", False, changes({"dished_per_m": 1.2})),
    # A blow beside the height of the mass centre lifts the disk.
    Cause("unknown_lifted_disk", "flight", False, _lifted_disk),
    # A punched washer that rests on a ring.
    Cause("unknown_ring_contact", "flight", False, changes({"ring_foot": 0.3})),
    # A shaker whose armature gives way along its axis.
    Cause("unknown_soft_armature", "impact", False, changes({"armature": 0.2})),
    # A wall that was sanded by hand, each of whose places looks somewhere else.
    Cause("unknown_ragged_wall", "impact", False, changes({"ragged_rad": 0.033})),
    # A wall whose friction falls with the slip's speed.
    Cause("unknown_slip_weakened_wall", "impact", False, changes({"rubbed_s_per_m": 1.25})),
    # A shaker that warms the ring from run to run.
    Cause("unknown_warming_ring", "impact", False, _warming_ring),
    # A wall that is sheared by oblique blows.
    Cause("unknown_oblique_restitution", "impact", False, changes({"oblique": 0.5}, signed=True)),
    # A ring turned in a chuck of three jaws.
    Cause("unknown_chucked_ring", "geometry", False, changes({"chucked_m": 2.6e-4}, ("chucked_rad",))),
    # A ring bent of a strip, whose ends are glued.
    Cause("unknown_wall_bead", "geometry", False, changes({"seam_bead_m": 5.5e-4}, ("seam_bead_rad",))),
    # A tripod on the shaker's own floor.
    Cause("unknown_shaking_tripod", "measurement", False, _shaking_tripod),
    # A recorder that loses frames.
    Cause("unknown_dropped_frame", "measurement", False, _dropped_frame),
    # A lamp that the wall stands in the way of.
    Cause("unknown_marker_shadow", "measurement", False, seen("shadow_m", 8e-4)),
]

# What the effect of each follows, in words: what a search would have to find.
FOLLOWS = {
    "unknown_stribeck_floor": "the slip's speed",
    "unknown_worn_middle": "the distance from the Host's centre",
    "unknown_scratched_floor": "the slip's direction in the Host, twice around",
    "unknown_dished_floor": "the place from the Host's centre",
    "unknown_lifted_disk": "the time since the last blow",
    "unknown_ring_contact": "the spin, where it slides slowly",
    "unknown_soft_armature": "the blow's direction against the drive's axis, twice around",
    "unknown_ragged_wall": "nothing: each blow's normal is its own",
    "unknown_slip_weakened_wall": "the size of the slip",
    "unknown_warming_ring": "the number of the run",
    "unknown_oblique_restitution": "the angle of incidence",
    "unknown_chucked_ring": "the azimuth of the blow, three times around",
    "unknown_wall_bead": "the azimuth of the blow, at one place",
    "unknown_shaking_tripod": "the Host's acceleration along the drive's axis, some time before",
    "unknown_dropped_frame": "the velocity in the picture, in some runs and from some frame on",
    "unknown_marker_shadow": "the way of each of the disk's markers to the wall",
}
