"""Causes in nobody's list that were written after the diagnosis of commit b3f4c7e, for a sealed trial of it, by
somebody who had not read it."""

import numpy as np

from analysis.blind.causes.unlisted import changes, seen
from analysis.blind.recording.draft import Cause, Draft, Rng, Truth, sign, spread, vector


def _eddy_brake(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.018, rng)
    out = {"eddy_per_s": 2.5 * size * spread(rng), "eddy_x_m": x, "eddy_y_m": y}
    draft.plant.update(out)
    return out


def _creeping_liner(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It goes on between the runs: each finds it somewhere else."""
    out = {"liner": 0.005 * size * spread(rng), "liner_rad_per_s": 2.0 * sign(rng)}
    draft.plant.update(out)
    draft.run_numbers["liner_rad"] = rng.uniform(0.0, np.pi, runs)
    return out


def _stretched_picture(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.view["stretched"] = 0.006 * size * spread(rng) * sign(rng)
    return {"stretched": draft.view["stretched"]}


NEWEST = [
    # A floor turned on a lathe, with a spiral of fine grooves.
    Cause("unknown_canted_friction", "flight", False, changes({"canted_rad": 0.12}, signed=True)),
    # The load moves to the leading edge, as under a curling stone.
    Cause("unknown_curling", "flight", False, changes({"curling": 0.2}, signed=True)),
    # Soft feet or an oil film: friction has to build up anew after each change of direction.
    Cause("unknown_lagging_friction", "flight", False, changes({"lag_s": 0.004})),
    # A bent washer stands on two points and drags them.
    Cause("unknown_warped_washer", "flight", False, changes({"warped": 0.3}, ("warped_rad",))),
    # A magnet under the Host's floor brakes what moves over it.
    Cause("unknown_eddy_brake", "flight", False, _eddy_brake),
    # The shaker rocks the table that the disk slides on.
    Cause("unknown_rocking_table", "flight", False, changes({"rocking": 0.005}, signed=True)),
    # A burr that catches in one sense of spin only.
    Cause("unknown_spin_ratchet", "flight", False, changes({"ratchet_rad_per_s2": 120.0}, signed=True)),
    # Hard blows plough: less of the slip comes back.
    Cause("unknown_fading_grip", "impact", False, changes({"fading_grip": 1.0})),
    # The wall's coating is still pressed in where it was hit the last time.
    Cause("unknown_bruised_wall", "impact", False, changes({"bruise": 0.35})),
    # A chamfer that leads the blow past the disk's centre.
    Cause("unknown_offset_blow", "impact", False, changes({"offset_blow_m": 1.5e-4}, signed=True)),
    # Grease that carries the disk the faster it slips.
    Cause("unknown_greased_wall", "impact", False, changes({"greased": 0.4})),
    # A loose chip in the ring, which now and then lies between.
    Cause("unknown_loose_chip", "impact", False, changes({"loose_chip": 0.25})),
    Cause("unknown_chipped_disk", "geometry", False, changes({"chip_m": 7e-4}, ("chip_rad",))),
    # An oval liner that is not fastened and turns in the Host.
    Cause("unknown_creeping_liner", "geometry", False, _creeping_liner),
    # A liner on a rubber bed, which stays back behind the Host's acceleration.
    Cause("unknown_springy_liner", "geometry", False, changes({"springy_m": 4e-4})),
    # A trigger of two channels, one late.
    Cause("unknown_alternating_clock", "measurement", False, seen("alternate_s", 1.6e-4)),
    # A camera that writes a full buffer's frame again where it misses one.
    Cause("unknown_stuttering_camera", "measurement", False, seen("stutter_share", 0.05)),
    # A film scaled to another height than its calibration.
    Cause("unknown_stretched_picture", "measurement", False, _stretched_picture),
]
