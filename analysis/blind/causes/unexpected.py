"""Causes in nobody's list, an eighth group, written for a sealed trial by somebody who had read neither the diagnosis
nor its laws.  What each is and its law: the docstrings of `plant.unexpected` and `recording.unexpected`."""

import numpy as np

from analysis.blind.causes.unlisted import changes
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


def _smeared_drop(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A drop of oil between the Host's middle and its wall."""
    x, y = vector(0.016, rng)
    out = {"drop": 0.65 * size * spread(rng), "drop_x_m": x, "drop_y_m": y}
    draft.plant.update(out)
    return out


def _coin_wobble(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Slow enough that the disk goes aside before it is pushed back."""
    out = {"wobble_per_s": 0.6 * size * spread(rng), "wobble_rad_per_s": float(rng.uniform(50.0, 110.0)) * sign(rng)}
    draft.plant.update(out)
    return out


def _swinging_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Its weight stands across the drive's axis, within 0.6 rad: what stands along it does not swing."""
    out = {
        "swinging_m_per_s": 0.4 * size * spread(rng) * sign(rng),
        "swinging_rad": float(rng.uniform(-0.6, 0.6)),
    }
    draft.plant.update(out)
    return out


def _orbiting_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A ring that falls back to its place between the runs, and rolls round in each of them alike."""
    out = {
        "orbit_m": 2.7e-4 * size * spread(rng),
        "orbit_rad": float(rng.uniform(0.0, 6.283)),
        "orbit_rad_per_s": float(rng.uniform(4.0, 8.0)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _packing_felt(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as far inwards of the mean at first as outwards at last."""
    most = 2e-4 * size * spread(rng)
    draft.run_numbers.update(packed_m=most * np.linspace(-1.0, 1.0, runs))
    return {"packed_m": most}


def _shaded_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A low lamp at any side."""
    draft.view.update(shade_px=2.2 * size * spread(rng), shade_rad=float(rng.uniform(0.0, 6.283)))
    return {"shade_px": draft.view["shade_px"], "angle_rad": draft.view["shade_rad"]}


def _sync_pulses(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Three to six pulses in a run, the first of them somewhere in its first fifth of a second."""
    draft.view.update(
        sync_s=3.3e-4 * size * spread(rng) * sign(rng),
        sync_every_s=float(rng.uniform(0.2, 0.4)),
        sync_late_s=float(rng.uniform(0.0, 0.2)),
    )
    return {"sync_s": draft.view["sync_s"], "every_s": draft.view["sync_every_s"]}


def _flung_sticker(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Any sticker but the middle one."""
    draft.view.update(flung_m=3e-4 * size * spread(rng), flung_marker=int(rng.integers(1, 5)))
    return {"flung_m": draft.view["flung_m"], "marker": float(draft.view["flung_marker"] + 1)}


UNEXPECTED = [
    # A drop of oil on the floor: a disk that has been there carries some of it along.
    Cause("unknown_smeared_drop", "flight", False, _smeared_drop),
    # A washer whose edge is bevelled at one side only.
    Cause("unknown_bevelled_edge", "flight", False, changes({"bevel": 0.4}, ("bevel_rad",))),
    # A guide with worn bearings, whose rumble shakes the load off the floor.
    Cause("unknown_rumbling_guide", "flight", False, changes({"rumble": 0.4})),
    # A washer faced on a lathe: its spiral groove turns it as it slides.
    Cause("unknown_spiral_face", "flight", False, changes({"spiral_rad_per_s2": 32.0}, signed=True)),
    # Dry air and a plastic floor: the disk is charged as it slides, until it touches the ring.
    Cause("unknown_charged_disk", "flight", False, changes({"charged_per_s2": 26.0})),
    # A blow leaves the washer wobbling like a coin.
    Cause("unknown_coin_wobble", "flight", False, _coin_wobble),
    # A velvet liner, whose pile lies as the last blow has combed it.
    Cause("unknown_combed_pile", "impact", False, changes({"combed": 0.9})),
    # The markers' glue has run over one side of the rim.
    Cause("unknown_glued_rim", "impact", False, changes({"glued": 0.7}, ("glued_rad",))),
    # A liner wound with overlaps, like shingles.
    Cause("unknown_shingled_liner", "impact", False, changes({"shingled": 0.11}, signed=True)),
    # A weight in the washer's hole whose glue has failed: it rattles.
    Cause("unknown_rattling_weight", "impact", False, changes({"rattling": 0.12})),
    # A ring that is heavier at one side and turns in its seat.
    Cause("unknown_swinging_ring", "impact", False, _swinging_ring),
    # A ring in a seat too wide for it, in which it rolls round.
    Cause("unknown_orbiting_ring", "geometry", False, _orbiting_ring),
    # A felt liner that is packed down from run to run.
    Cause("unknown_packing_felt", "geometry", False, _packing_felt),
    # A low lamp, and the ring's own shade.
    Cause("unknown_shaded_wall", "measurement", False, _shaded_wall),
    # A second camera that is set right by pulses, and runs free in between.
    Cause("unknown_sync_pulses", "measurement", False, _sync_pulses),
    # A sticker that has come loose and is flung outwards by the spin.
    Cause("unknown_flung_sticker", "measurement", False, _flung_sticker),
]

# What the effect of each follows, in words: what a search would have to find.
FOLLOWS = {
    "unknown_smeared_drop": "the way slid since the disk was last at one place of the Host's floor",
    "unknown_bevelled_edge": "the angle between the slip and the disk",
    "unknown_rumbling_guide": "the square of the Host's speed",
    "unknown_spiral_face": "the slip's speed",
    "unknown_charged_disk": "the place from the Host's centre, times the way slid since the last blow",
    "unknown_coin_wobble": "the time since the last blow, its normal and its approach speed",
    "unknown_combed_pile": "the sense of the slip against that of the last blow's",
    "unknown_glued_rim": "the place on the disk's rim that is struck, once around it",
    "unknown_shingled_liner": "the slip with its sense",
    "unknown_rattling_weight": "the angle between this blow's normal and the last one's",
    "unknown_swinging_ring": "the Host's velocity along one direction",
    "unknown_orbiting_ring": "the azimuth of the blow against one that goes round with the time in the run",
    "unknown_packing_felt": "the number of the run",
    "unknown_shaded_wall": "the place of the disk's markers in the Host, along one direction",
    "unknown_sync_pulses": "the time since the last of some even pulses, and the velocity in the picture",
    "unknown_flung_sticker": "the square of the spin",
}
