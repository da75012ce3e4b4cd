"""Causes in nobody's list, a tenth group, written for a sealed trial by somebody who had read neither the diagnosis nor
its laws.  What each is and its law: the docstrings of `plant.untold` and `recording.untold`."""

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread


def _wandering_bead(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A bead that is put back between the runs, and goes round in each of them alike."""
    out = {
        "bead": 0.75 * size * spread(rng),
        "bead_rad": float(rng.uniform(0.0, 6.283)),
        "bead_rad_per_s": float(rng.uniform(3.0, 7.0)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _cornered_rim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Filed by hand, to as many corners as it happens."""
    out = {
        "cornered_m": 4e-4 * size * spread(rng),
        "corners": float(rng.integers(4, 8)),
        "cornered_rad": float(rng.uniform(0.0, 6.283)),
    }
    draft.plant.update(out)
    return out


def _wiped_rim(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Before half of the runs, whichever."""
    most = 0.55 * size * spread(rng)
    side = np.where(rng.permutation(runs) % 2 == 0, 1.0, -1.0)
    draft.run_numbers.update(wiped=most * side)
    return {"wiped": most, "runs_wiped": float(np.sum(side > 0.0))}


def _rubbery_card(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that each of its swings is in several frames."""
    draft.view.update(card_s=1.35e-3 * size * spread(rng), card_hz=float(rng.uniform(25.0, 60.0)))
    return {"card_s": draft.view["card_s"], "frequency_hz": draft.view["card_hz"]}


UNTOLD = [
    # A wire from the ceiling, for a charge or a sensor, that the disk's turns wind up.
    Cause("unknown_wound_wire", "flight", False, changes({"wound_per_s2": 3.5}, ("wound_rad",))),
    # A floor of upright bristles, whose tips stay back as the Host is accelerated.
    Cause("unknown_bristled_floor", "flight", False, changes({"bristled": 0.5}, signed=True)),
    # A thin floor sheet that buckles under its own inertia.
    Cause("unknown_buckling_sheet", "flight", False, changes({"buckled_per_s2": 25.0}, signed=True)),
    # A magnetised washer near a ring of aluminium.
    Cause("unknown_eddy_ring", "flight", False, changes({"eddied_per_s": 2.0})),
    # A magnetised washer in a ring of steel.
    Cause("unknown_poled_disk", "flight", False, changes({"poled_m_per_s2": 0.4}, ("poled_rad",))),
    # A bead of oil that the drive shakes round the floor.
    Cause("unknown_wandering_bead", "flight", False, _wandering_bead),
    # A rim filed by hand, to blunt corners.
    Cause("unknown_cornered_rim", "impact", False, _cornered_rim),
    # A loose rubber band around the rim, which each blow pushes to the other side.
    Cause("unknown_shifted_band", "impact", False, changes({"shifted": 0.12})),
    # A rim that is wiped before some of the runs.
    Cause("unknown_wiped_rim", "impact", False, _wiped_rim),
    # A wall ground from one side to the other, its scales all lying towards there.
    Cause("unknown_scaly_wall", "impact", False, changes({"scaly": 0.8}, ("scaly_rad",))),
    # A hollow ring filled with lead shot.
    Cause("unknown_shot_filled_ring", "impact", False, changes({"shot": 0.12})),
    # A liner full of air, which blows press out and a pump brings back.
    Cause("unknown_leaking_liner", "geometry", False, changes({"leaking_m": 3e-4})),
    # A slack rubber band around the washer, which the spin draws wide.
    Cause("unknown_swollen_band", "geometry", False, changes({"swollen_m": 2.4e-4})),
    # A second camera whose trigger has a worn relay, on the rig's own bench.
    Cause("unknown_shocked_trigger", "measurement", False, seen("shocked_s", 3e-5)),
    # Films coded too coarsely, in blocks.
    Cause("unknown_coded_blocks", "measurement", False, seen("blocked_px", 0.75)),
    # The disk's markers are on a card, and that on soft glue.
    Cause("unknown_rubbery_card", "measurement", False, _rubbery_card),
]

# What the effect of each follows, in words: what a search would have to find.
FOLLOWS = {
    "unknown_wound_wire": "the disk's angle, whole turns counted",
    "unknown_bristled_floor": "the Host's acceleration along the slip",
    "unknown_buckling_sheet": "the place from the Host's centre, times the Host's acceleration along the drive's axis",
    "unknown_eddy_ring": "the speed of the rim along the wall, and the way to the wall",
    "unknown_poled_disk": "the angle between the disk and the radius from the Host's centre, twice around",
    "unknown_wandering_bead": "the place in the Host against one that goes round with the time in the run",
    "unknown_cornered_rim": "the place on the disk's rim that is struck, several times around it",
    "unknown_shifted_band": "the place on the disk's rim that is struck against the last one",
    "unknown_wiped_rim": "the number of the run, in no order",
    "unknown_scaly_wall": "the direction of the slip in the Host",
    "unknown_shot_filled_ring": "the size of the Host's acceleration",
    "unknown_leaking_liner": "how hard and how long ago the last blows were",
    "unknown_swollen_band": "the square of the spin",
    "unknown_shocked_trigger": "the time since the last blows, how hard they were, and the velocity in the picture",
    "unknown_coded_blocks": "the place in the picture, once in eight pixels",
    "unknown_rubbery_card": "the time since the last blows and their changes of spin",
}
