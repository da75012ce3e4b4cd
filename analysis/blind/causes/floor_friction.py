"""Unlisted causes in the floor's friction and load, by the place on it, the speed and the direction of sliding."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread, vector


def _patch(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.018, rng)
    out = {"patch_amplitude": 0.9 * size * spread(rng), "patch_x_m": x, "patch_y_m": y}
    draft.plant.update(out)
    return out


def _seam(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"seam": 0.5 * size * spread(rng), "seam_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, seam_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _polished_track(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A track where the disk has mostly run: somewhat inside the wall, or half-way to it."""
    out = {"track": 0.5 * size * spread(rng), "track_m": float(rng.uniform(0.018, 0.028))}
    draft.plant.update(out)
    return out


def _polished_lane(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Along the drive, more or less."""
    out = {"lane": 0.5 * size * spread(rng), "lane_rad": float(rng.uniform(-0.4, 0.4))}
    draft.plant.update(out)
    return out


def _wandering_bead(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A bead that is put back between the runs, and goes round in each of them alike."""
    out = {
        "bead": 0.75 * size * spread(rng),
        "bead_rad": float(rng.uniform(0.0, 6.283)),
        "bead_rad_per_s": float(rng.uniform(3.0, 7.0)) * sign(rng),
    }
    draft.plant.update(out)
    return out


def _chattering_slide(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"chatter": 0.6 * size * spread(rng), "chatter_m_per_s": float(rng.uniform(0.5, 0.9))}
    draft.plant.update(out)
    return out


def _scratched_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Scratched along the drive, more or less: it rubs most across that."""
    out = {"scratched": 0.3 * size * spread(rng), "scratched_rad": 0.5 * np.pi + float(rng.uniform(-0.4, 0.4))}
    draft.plant.update(out)
    return out


def _drying_spot(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Where somebody drips cleaning fluid before each run, between the Host's middle and its wall."""
    x, y = vector(0.014, rng)
    out = {
        "drying": 0.75 * size * spread(rng),
        "drying_x_m": x,
        "drying_y_m": y,
        "drying_s": float(rng.uniform(0.4, 0.8)),
    }
    draft.plant.update(out)
    return out


def _shivering_floor(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """By the root of the severity: what is faster than the floor loses with the square of its speed."""
    draft.plant["shiver_m_per_s"] = 1.0 * np.sqrt(size * spread(rng))
    return {"shiver_m_per_s": draft.plant["shiver_m_per_s"]}


FLOOR_FRICTION = [
    # --- how much of the disk stands on the floor, with which load ---
    Cause("unknown_hop", "flight", changes({"hop_s": 0.012}), rivals=("nes_rocking",)),
    # A weld spatter under the disk, beside its middle.
    Cause("unknown_stuck_grain", "flight", changes({"grain": 0.35}, ("grain_rad",))),
    # A dished washer stands on its inner part only.
    Cause("unknown_domed_disk", "flight", changes({"dome": 0.6})),
    # A table on leaf springs moves on an arc: it rises as it leaves its middle, or sinks.
    Cause("unknown_leaf_springs", "flight", changes({"arc_per_m": 2.8}, signed=True)),
    # A blow tosses the disk up, the harder the higher; then it lands.
    Cause("unknown_tossed_disk", "flight", changes({"toss": 0.06}), short_blows=True),
    # A washer is punched, and has a burr around its rim.
    Cause("unknown_punched_burr", "flight", changes({"burr": 0.8})),
    # A punched washer that rests on a ring.
    Cause(
        "unknown_ring_contact",
        "flight",
        changes({"ring_foot": 0.3}),
        follows="the spin, where it slides slowly",
    ),
    # Three drops of the markers' glue, hardened below the washer.
    Cause(
        "unknown_three_feet",
        "flight",
        changes({"feet": 0.75}, ("feet_rad",)),
        follows="the slip and the spin, as of three points, and the disk's angle three times around",
    ),
    # --- by the place on the floor ---
    Cause("unknown_patchy_friction", "flight", _patch),
    Cause("unknown_grooved_floor", "flight", changes({"groove": 0.5}, ("groove_rad", "groove_phase_rad"))),
    Cause("unknown_dusty_rim", "flight", changes({"rim": 0.7})),
    Cause("unknown_floor_seam", "flight", _seam),
    # A track around the centre, polished in months of use.
    Cause("unknown_polished_track", "flight", _polished_track, follows="the distance from the Host's centre"),
    # A lane through the middle, along which the drive has sent the disk for months.
    Cause(
        "unknown_polished_lane",
        "flight",
        _polished_lane,
        follows="the place across one line through the Host's centre",
    ),
    # A bead of oil that the drive shakes round the floor.
    Cause(
        "unknown_wandering_bead",
        "flight",
        _wandering_bead,
        follows="the place in the Host against one that goes round with the time in the run",
    ),
    # A floor plate that is worn in its middle, where most sliding is done: polished, or roughened.
    Cause(
        "unknown_worn_middle",
        "flight",
        changes({"worn": 0.4}, signed=True),
        follows="the distance from the Host's centre",
    ),
    # A floor that is wiped in its middle, and hardly at its edge; or that wiping roughens.
    Cause(
        "unknown_unswept_edge",
        "flight",
        changes({"unswept": 0.4}, signed=True),
        follows="the square of the distance from the Host's centre, in the friction",
    ),
    # A floor plate held by four countersunk screws.
    Cause(
        "unknown_screw_holes",
        "flight",
        changes({"screws": 0.6}, ("screws_rad",)),
        follows="the place in the Host, at four places a quarter turn from each other",
    ),
    # A spot of cleaning fluid that dries in the course of each run.
    Cause(
        "unknown_drying_spot",
        "flight",
        _drying_spot,
        follows="the time in the run, at one place of the Host's floor",
    ),
    # A thin floor on three ribs.
    Cause(
        "unknown_ribbed_floor",
        "flight",
        changes({"ribs": 0.45}, ("ribs_rad",)),
        follows="the azimuth of the disk's place in the Host, three times around",
    ),
    # Frost on the floor, which each flight clears from its path and which has come back after the next.
    Cause(
        "unknown_cleared_path",
        "flight",
        changes({"path": 0.6}),
        follows="the way off the straight line between the last two blows",
        short_blows=True,
    ),
    # A puddle of oil that is thrown to and fro as the drive shakes it.
    Cause(
        "unknown_swashing_puddle",
        "flight",
        changes({"puddle": 0.7}),
        follows="the place in the Host against one that goes with its acceleration",
    ),
    # A draught that blows the dust to one side of the floor.
    Cause(
        "unknown_drifted_dust",
        "flight",
        changes({"drifted": 0.4}, ("drifted_rad",)),
        follows="the place along one direction of the Host, and for the torque the slip across it",
    ),
    # --- by the speed, and late ---
    Cause("unknown_weakening_friction", "flight", changes({"weakening": 0.5})),
    Cause("unknown_lubricated_spin", "flight", changes({"film": 0.4})),
    Cause("unknown_lift", "flight", changes({"lift": 0.5})),
    # Soft feet or an oil film: friction has to build up anew after each change of direction.
    Cause("unknown_lagging_friction", "flight", changes({"lag_s": 0.004})),
    # At one sliding speed the washer chatters and floats.
    Cause("unknown_chattering_slide", "flight", _chattering_slide),
    # Friction of plastic: it holds what creeps and lets run what runs.
    Cause("unknown_stribeck_floor", "flight", changes({"stribeck": 0.8}), follows="the slip's speed"),
    # A film of oil that carries what runs, and through which what creeps touches.
    Cause(
        "unknown_mixed_lubrication",
        "flight",
        changes({"mixed": 0.5}),
        follows="the square of the slip's speed, where it is slow",
    ),
    # Friction of rest that is more than of sliding.
    Cause(
        "unknown_breakaway",
        "flight",
        changes({"breakaway": 0.6}),
        follows="whether the slip is slower than some speed",
    ),
    # A wet film, whose suction what slides fast leaves behind.
    Cause(
        "unknown_sucked_disk",
        "flight",
        changes({"suction": 0.85}),
        follows="one over one and the slip's speed",
    ),
    # Friction whose junctions are the stronger the faster they are sheared.
    Cause(
        "unknown_strengthening_floor",
        "flight",
        changes({"strengthening": 0.22}),
        follows="the logarithm of the slip's speed",
    ),
    # A trace of grease below the disk, which stiffens as it is sheared.
    Cause(
        "unknown_stiffening_grease",
        "flight",
        changes({"stiffened_s_per_m": 0.2}),
        follows="the slip's speed, evenly, in the friction",
        rivals=("viscous_drag",),
    ),
    # A floor of a polymer, whose friction goes with a power of the speed.
    Cause(
        "unknown_polymer_floor",
        "flight",
        changes({"powered": 0.25}),
        follows="a power of the slip's speed",
    ),
    # Air that the disk draws below itself as it spins.
    Cause(
        "unknown_riding_disk",
        "flight",
        changes({"riding_s": 0.0023}),
        follows="the size of the spin over the Host's floor, in the friction",
    ),
    # --- by the direction of sliding ---
    Cause("unknown_anisotropic_friction", "flight", changes({"anisotropy": 0.25}, ("anisotropy_phase_rad",))),
    # A floor turned on a lathe, with a spiral of fine grooves.
    Cause("unknown_canted_friction", "flight", changes({"canted_rad": 0.12}, signed=True)),
    # The load moves to the leading edge, as under a curling stone.
    Cause("unknown_curling", "flight", changes({"curling": 0.2}, signed=True)),
    # A cloth whose nap leads a disk that spins aside, as it does a snooker ball.
    Cause(
        "unknown_nap_swerve",
        "flight",
        changes({"swerve": 0.4}, ("swerve_rad",), signed=True),
        follows="the spin times the slip's share along one direction of the Host, across the slip",
    ),
    # A bent washer stands on two points and drags them.
    Cause("unknown_warped_washer", "flight", changes({"warped": 0.3}, ("warped_rad",))),
    # A brushed floor or a felt: smooth one way, rough the other.
    Cause("unknown_napped_floor", "flight", changes({"nap": 0.35}, ("nap_rad",))),
    # Floor and washer are both brushed: they hold on to each other where their marks lie alike.
    Cause("unknown_brushed_pair", "flight", changes({"brushed": 0.4}, ("brushed_rad",))),
    # A floor faced on a lathe: circles around the Host's centre, which hold what slides across them.
    Cause(
        "unknown_concentric_marks",
        "flight",
        changes({"rings": 0.25}),
        follows="the angle between the slip and the radius from the Host's centre",
    ),
    # A floor faced on a lathe, whose scales all lie one way round.
    Cause(
        "unknown_faced_floor",
        "flight",
        changes({"faced": 0.35}, signed=True),
        follows="the slip's share round the Host's centre, with its sense",
    ),
    # A floor that is wiped and brushed from its middle outwards.
    Cause(
        "unknown_outward_brush",
        "flight",
        changes({"outward": 0.35}, signed=True),
        follows="the slip's share away from the Host's centre, with its sense",
    ),
    # A washer faced on a lathe, whose scales bite in one sense of spin.
    Cause(
        "unknown_scaly_face",
        "flight",
        changes({"scaly_face": 0.45}, signed=True),
        follows="the spin's share of the speed over the floor, with its sense",
    ),
    # A washer whose edge is bevelled at one side only.
    Cause(
        "unknown_bevelled_edge",
        "flight",
        changes({"bevel": 0.4}, ("bevel_rad",)),
        follows="the angle between the slip and the disk",
    ),
    # A floor of upright bristles, whose tips stay back as the Host is accelerated.
    Cause(
        "unknown_bristled_floor",
        "flight",
        changes({"bristled": 0.5}, signed=True),
        follows="the Host's acceleration along the slip",
    ),
    # A floor of felt, whose fibres lean the way that the disk has come.
    Cause(
        "unknown_felted_floor",
        "flight",
        changes({"leant": 0.5}),
        follows="the slip's direction over the last ten millimetres, in the friction's direction",
    ),
    # A disk that raises a film of oil once it has slid fast, and keeps it until it is slow.
    Cause(
        "unknown_floating_disk",
        "flight",
        changes({"afloat": 0.3}),
        follows="whether the slip was above one speed since it was last below another one",
    ),
    # A floor that a motor makes shiver along the drive, too fast for the cameras.
    Cause(
        "unknown_shivering_floor",
        "flight",
        _shivering_floor,
        follows="the slip along the drive's axis and across it, less of the friction the slower it is",
    ),
    # Scratches along the drive.
    Cause(
        "unknown_scratched_floor",
        "flight",
        _scratched_floor,
        follows="the slip's direction in the Host, twice around",
    ),
]
