"""Unlisted causes in the shape and the place of wall and disk."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread, vector


def _dented_wall(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(dent_m=4e-4 * size * spread(rng) * sign(rng), dent_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return {"dent_m": draft.plant["dent_m"]}


def _flat_spot(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Within 0.4 rad of the drive's axis, at either end: where a ring has been struck flat."""
    side = 0.0 if rng.random() < 0.5 else np.pi
    at = side + float(rng.uniform(-0.4, 0.4))
    out = {"flat_m": 1.05e-3 * size * spread(rng), "flat_rad": at}
    draft.plant.update(out)
    return out


def _packing_felt(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as far inwards of the mean at first as outwards at last."""
    most = 2e-4 * size * spread(rng)
    draft.run_numbers.update(packed_m=most * np.linspace(-1.0, 1.0, runs))
    return {"packed_m": most}


def _creeping_clamps(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as far to one side of the mean at first as to the other at last."""
    x, y = vector(3.1e-4 * size * spread(rng), rng)
    course = np.linspace(-1.0, 1.0, runs)
    draft.run_numbers.update(crept_x_m=x * course, crept_y_m=y * course)
    return {"crept_x_m": x, "crept_y_m": y}


def _rebolted_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """As far off in each run, to all sides in no order."""
    most = 3.1e-4 * size * spread(rng)
    to = rng.uniform(0.0, 2.0 * np.pi) + 2.0 * np.pi * rng.permutation(runs) / runs
    draft.run_numbers.update(rebolted_x_m=most * np.cos(to), rebolted_y_m=most * np.sin(to))
    return {"rebolted_m": most}


def _oval_disk(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    draft.plant.update(oval=0.004 * size * spread(rng), oval_rad=float(rng.uniform(0.0, np.pi)))
    return {"oval": draft.plant["oval"]}


def _creeping_liner(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """It goes on between the runs: each finds it somewhere else."""
    out = {"liner": 0.005 * size * spread(rng), "liner_rad_per_s": 2.0 * sign(rng)}
    draft.plant.update(out)
    draft.run_numbers["liner_rad"] = rng.uniform(0.0, np.pi, runs)
    return out


def _squashed_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Held at one side, within 0.6 rad of the drive's axis: what stands across it is not squashed."""
    clamp = float(rng.uniform(-0.6, 0.6)) + (np.pi if rng.random() < 0.5 else 0.0)
    out = {"squash_m": 3.5e-4 * size * spread(rng) * sign(rng), "squash_rad": clamp}
    draft.plant.update(out)
    return out


def _refitted_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Put back once, half-way through the series."""
    x, y = vector(3.5e-4 * size * spread(rng), rng)
    side = np.where(np.arange(runs) < (runs + 1) // 2, 1.0, -1.0)
    draft.run_numbers.update(refit_x_m=x * side, refit_y_m=y * side)
    return {"refit_x_m": x, "refit_y_m": y, "runs_before": float((runs + 1) // 2)}


def _jerked_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The same way in each run, and in each at a time of its own; it is put back before the next."""
    out = {"jerked_m": 3.2e-4 * size * spread(rng), "jerked_rad": float(rng.uniform(0.0, 2.0 * np.pi))}
    draft.plant.update(out)
    draft.run_numbers["jerked_share"] = rng.uniform(0.25, 0.6, runs)
    return out


def _cast_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Each of its waves of a phase of its own."""
    out = {"uneven_m": 1.65e-4 * size * spread(rng)}
    out.update({f"uneven_{order}_rad": float(rng.uniform(0.0, 2.0 * np.pi)) for order in range(8, 13)})
    draft.plant.update(out)
    return out


def _quivering_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that it throws no disk back by more than the blow has lost; the next blow finds it in its first swing."""
    out = {"quiver_m": 9.5e-4 * size * spread(rng), "quiver_rad_per_s": 2.0 * np.pi * float(rng.uniform(9.0, 13.0))}
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


def _nodding_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """So slow that the next blow finds it somewhere in its first swings."""
    out = {
        "nodding": 0.02 * size * spread(rng),
        "nodding_rad_per_s": 2.0 * np.pi * float(rng.uniform(20.0, 32.0)),
    }
    draft.plant.update(out)
    return out


def _warping_host(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as long along its line at first as across it at last."""
    most = 2.9e-4 * size * spread(rng)
    draft.plant.update(warping_rad=float(rng.uniform(0.0, np.pi)))
    draft.run_numbers.update(warping_m=most * np.linspace(-1.0, 1.0, runs))
    return {"warping_m": most}


def _hinged_ring(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Its screw stands askew to the drive's axis, to either side."""
    out = {"hinged_m": 6.5e-4 * size * spread(rng), "hinged_rad": float(rng.uniform(0.4, 0.9)) * sign(rng)}
    draft.plant.update(out)
    return out


GEOMETRY = [
    # --- the wall's shape ---
    Cause("unknown_dented_wall", "geometry", _dented_wall, round_only=True),
    Cause("unknown_stepped_wall", "geometry", changes({"step_m": 4e-4}, ("step_rad",)), round_only=True),
    # A ring bent of a strip, its ends one upon the other.
    Cause(
        "unknown_overlapping_strip",
        "geometry",
        changes({"joint_m": 6e-4}, ("joint_rad",), signed=True),
        round_only=True,
    ),
    # A ring made of two halves, put together askew along their joint.
    Cause(
        "unknown_split_ring",
        "geometry",
        changes({"split_m": 5.5e-4}, ("split_rad",), signed=True),
        follows="the azimuth in the Host",
        round_only=True,
    ),
    # A ring turned in a chuck of three jaws.
    Cause(
        "unknown_chucked_ring",
        "geometry",
        changes({"chucked_m": 2.6e-4}, ("chucked_rad",)),
        follows="the azimuth of the blow, three times around",
        rivals=("wall_lobes",),
        round_only=True,
    ),
    # A ring bent of a strip, whose ends are glued.
    Cause(
        "unknown_wall_bead",
        "geometry",
        changes({"seam_bead_m": 5.5e-4}, ("seam_bead_rad",)),
        follows="the azimuth of the blow, at one place",
        round_only=True,
    ),
    # A ring that something has struck flat.
    Cause(
        "unknown_flat_spot",
        "geometry",
        _flat_spot,
        follows="the azimuth of the blow, at one place as deep as a chord",
        round_only=True,
    ),
    # A ring that warms and widens in each run.
    Cause(
        "unknown_heated_ring",
        "geometry",
        changes({"heating_m": 7.5e-4}),
        follows="the time in the run, ever less, all around",
        round_only=True,
    ),
    # A ring whose blows have worn it at both ends of the drive.
    Cause(
        "unknown_worn_pockets",
        "geometry",
        changes({"pockets_m": 4e-4}),
        follows="the azimuth of the blow, at both ends of the drive's axis",
        round_only=True,
    ),
    # A ring that was sprung into its seat, and that the drive shakes round again in the course of each run.
    Cause(
        "unknown_relaxing_ring",
        "geometry",
        changes({"relaxing_m": 4.5e-4}, ("relaxing_rad",)),
        follows="the time in the run, and the azimuth of the blow twice around",
        round_only=True,
    ),
    # A felt liner that is packed down from run to run.
    Cause("unknown_packing_felt", "geometry", _packing_felt, follows="the number of the run", round_only=True),
    # A Host of wood or plastic, which warps from run to run.
    Cause(
        "unknown_warping_host",
        "geometry",
        _warping_host,
        follows="the number of the run, and the azimuth of the blow twice around",
        round_only=True,
    ),
    # A ring that was cast and never turned.
    Cause(
        "unknown_cast_ring",
        "geometry",
        _cast_ring,
        follows="the azimuth, eight to twelve times around",
        round_only=True,
    ),
    # A thin ring that each blow leaves oval, held so by its seat.
    Cause(
        "unknown_pressed_ring",
        "geometry",
        changes({"pressed_m": 2.6e-4}),
        follows="the angle between the azimuth and the last blow's normal, twice around",
        round_only=True,
        short_blows=True,
    ),
    # A thin ring that each blow springs oval, and that quivers until the next.
    Cause(
        "unknown_quivering_ring",
        "geometry",
        _quivering_ring,
        follows="the time since the last blow, to and fro, and the azimuth twice around from that blow's normal",
        round_only=True,
        short_blows=True,
    ),
    # A ring lined with clay, which blows knead and which is smoothed before each run.
    Cause(
        "unknown_clay_liner",
        "geometry",
        changes({"clay_m": 1.1e-4}),
        follows="how many blows the place of the wall has had, in its radius",
        round_only=True,
        short_blows=True,
    ),
    # A wall that is hollowed out at its foot, and a disk with a rounded edge.
    Cause(
        "unknown_coved_wall",
        "geometry",
        changes({"coved_m": 2.6e-4}),
        follows="the approach speed, in how far the disk gets",
        round_only=True,
        short_blows=True,
    ),
    # --- the disk's shape ---
    Cause("unknown_oval_disk", "geometry", _oval_disk, round_only=True),
    Cause("unknown_lobed_disk", "geometry", changes({"trilobe": 0.004}, ("trilobe_rad",)), round_only=True),
    Cause("unknown_chipped_disk", "geometry", changes({"chip_m": 7e-4}, ("chip_rad",)), round_only=True),
    # A washer whose edge was chamfered along one side.
    Cause(
        "unknown_chamfered_side",
        "geometry",
        changes({"chamfer_m": 3.6e-4}, ("chamfer_rad",)),
        follows="whether the place on the disk's rim that is struck lies along one side of it",
        round_only=True,
    ),
    # A sleeve on the washer's rim that is thicker at one side.
    Cause("unknown_eccentric_tyre", "geometry", changes({"tyre_m": 4e-4}, ("tyre_rad",))),
    # Tape around the rim, whose end lies on its beginning.
    Cause(
        "unknown_lapped_tape",
        "geometry",
        changes({"lap_m": 8e-4}, ("lap_rad",), signed=True),
        follows="the place on the disk's rim that is struck, once around it and back at one place",
        round_only=True,
    ),
    # Tape around the rim, whose end is pressed on before each run and peels off.
    Cause(
        "unknown_peeling_tape",
        "geometry",
        changes({"peeling_m": 6e-4}, ("peeling_rad",)),
        follows="the number of blows so far, at one place of the disk's rim",
        round_only=True,
        short_blows=True,
    ),
    # Tape around the rim whose end is loose, and which the disk winds up and sheds as it turns.
    Cause(
        "unknown_wound_tape",
        "geometry",
        changes({"spool_m": 3e-4}, ("spool_rad",), signed=True),
        follows="the disk's angle, whole turns counted, in its radius",
    ),
    # A soft tyre that blows flatten where they strike, put on anew before each run.
    Cause(
        "unknown_flattened_rim",
        "geometry",
        changes({"flattened_m": 5.2e-4}),
        follows="how many blows the place of the disk's rim has had, in its radius",
        round_only=True,
        short_blows=True,
    ),
    # A disk with a bevelled rim that a blow sets planing on its film of air.
    Cause(
        "unknown_planing_disk",
        "geometry",
        changes({"planing_m": 2.7e-4}),
        follows="the disk's speed over the Host's floor after the last blow, in its radius",
        short_blows=True,
    ),
    # A disk that a blow tips, and that strikes with another edge until it lies flat.
    Cause(
        "unknown_tipped_disk",
        "geometry",
        changes({"tipped_m": 6.3e-4}),
        follows="the time since the last blow, and its approach speed",
        rivals=("nes_rocking",),
        short_blows=True,
    ),
    # A slack rubber band around the washer, which the spin draws wide.
    Cause(
        "unknown_swollen_band",
        "geometry",
        changes({"swollen_m": 2.4e-4}),
        follows="the square of the spin",
        short_blows=True,
    ),
    # A slack tyre that is heavier at one side, and that the spin throws out there.
    Cause(
        "unknown_thrown_tyre",
        "geometry",
        changes({"thrown_m": 3.2e-4}, ("thrown_rad",)),
        follows="the square of the spin, and the place on the disk's rim that is struck",
        short_blows=True,
    ),
    # --- where the wall lies and how it moves ---
    Cause("unknown_breathing_wall", "geometry", changes({"breathing_m": 2e-4}, signed=True), round_only=True),
    # An oval liner that is not fastened and turns in the Host.
    Cause("unknown_creeping_liner", "geometry", _creeping_liner, round_only=True),
    # A liner on a rubber bed, which stays back behind the Host's acceleration.
    Cause("unknown_springy_liner", "geometry", changes({"springy_m": 4e-4})),
    # A ring that is taken off and bolted on again between the runs.
    Cause(
        "unknown_rebolted_ring",
        "geometry",
        _rebolted_ring,
        follows="the number of the run, in no order, and the contact's normal",
    ),
    # A ring of which each blow takes off as much, and that is made good between the runs.
    Cause(
        "unknown_receding_wall",
        "geometry",
        changes({"receding_m": 3.5e-5}),
        follows="the number of blows so far, all around",
        short_blows=True,
    ),
    # A ring with play in its seat along the drive, thrown from stop to stop.
    Cause(
        "unknown_seat_play",
        "geometry",
        changes({"play_m": 2.8e-4}),
        follows="the sense of the Host's acceleration along the drive's axis, and the contact's normal along it",
    ),
    # A ring that is screwed down at one side only.
    Cause(
        "unknown_hinged_ring",
        "geometry",
        _hinged_ring,
        follows="the Host's acceleration along one line, and the contact's normal along it",
    ),
    # A ring that lies in its groove with play, and stays where the last blow has pushed it.
    Cause("unknown_loose_ring", "geometry", changes({"loose_ring_m": 2.5e-4}), short_blows=True),
    # A ring whose screws slip a step in each blow, and that is put back before each run.
    Cause(
        "unknown_walking_ring",
        "geometry",
        changes({"walked_m": 1.4e-4}),
        follows="the sum of the normals of the blows so far, along the contact's normal",
        short_blows=True,
    ),
    # A thin ring clamped at one side, squashed as the Host starts one way and stretched as it starts the other.
    Cause("unknown_squashed_ring", "geometry", _squashed_ring, round_only=True),
    # A ring that slips in its clamps in the course of a run.
    Cause("unknown_slipping_ring", "geometry", changes({"slipping_m": 3.5e-4}, ("slipping_rad",))),
    # A ring that slips in its clamps once in each run, all at once.
    Cause(
        "unknown_jerked_ring",
        "geometry",
        _jerked_ring,
        follows="the time in the run, from one on, and the contact's normal",
    ),
    # A ring that lies to one side of its seat, until it is taken out for cleaning and then lies to the other.
    Cause("unknown_refitted_ring", "geometry", _refitted_ring),
    # A ring that creeps in its clamps from run to run.
    Cause(
        "unknown_creeping_clamps",
        "geometry",
        _creeping_clamps,
        follows="the number of the run from the middle one, and the contact's normal",
    ),
    # A ring on thick double-sided tape, which trails behind the Host's velocity.
    Cause(
        "unknown_trailing_ring",
        "geometry",
        changes({"trailing_m": 3.7e-4}),
        follows="the Host's velocity along the contact's normal",
    ),
    # A ring on soft screws, which a cable to the room pulls back.
    Cause(
        "unknown_tugged_ring",
        "geometry",
        changes({"tugged_m": 4.6e-4}),
        follows="the Host's place in the room along the contact's normal",
    ),
    # A ring with play in its seat, which a cable or a cover in the room drags back.
    Cause(
        "unknown_dragging_ring",
        "geometry",
        changes({"dragging_m": 2.9e-4}),
        follows="the sense of the Host's velocity along the drive's axis, and the contact's normal along it",
    ),
    # A ring in a seat too wide for it, in which it rolls round.
    Cause(
        "unknown_orbiting_ring",
        "geometry",
        _orbiting_ring,
        follows="the azimuth of the blow against one that goes round with the time in the run",
    ),
    # An inner ring on rubber feet, which swings on after each blow.
    Cause(
        "unknown_nodding_ring",
        "geometry",
        _nodding_ring,
        follows="the time since the last blows, and their impulses along the contact's normal",
        short_blows=True,
    ),
    # A liner full of air, which blows press out and a pump brings back.
    Cause(
        "unknown_leaking_liner",
        "geometry",
        changes({"leaking_m": 3e-4}),
        follows="how hard and how long ago the last blows were",
        short_blows=True,
    ),
]
