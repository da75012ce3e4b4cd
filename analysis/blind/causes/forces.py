"""Unlisted causes in flights beside the floor's friction: slopes, what lies on it, air."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread, vector


def _sway(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"sway_m_per_s2": 0.35 * size * spread(rng), "sway_rad_per_s": float(rng.uniform(8.0, 30.0))}
    draft.plant.update(out, sway_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _rocking_frame(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Before the drive or behind it, by a quarter of its period or an eighth less or more."""
    out = {"frame_m_per_s2": 0.55 * size * spread(rng), "frame_rad": sign(rng) * float(rng.uniform(0.785, 2.356))}
    draft.plant.update(out)
    return out


def _opened_door(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """The same way in each run, and in each from a time of its own on."""
    out = {"gust_m_per_s2": 0.7 * size * spread(rng), "gust_rad": float(rng.uniform(0.0, 2.0 * np.pi))}
    draft.plant.update(out)
    draft.run_numbers["gust_share"] = rng.uniform(0.1, 0.5, runs)
    return out


def _gumming_film(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, at last three times as much as at first."""
    mean = 0.32 * size * spread(rng)
    draft.run_numbers.update(gummed_per_s=mean * np.linspace(0.5, 1.5, runs))
    return {"gummed_per_s": mean}


def _ridge(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"ridge_m_per_s2": 1.2 * size * spread(rng), "ridge_m": float(rng.uniform(-0.015, 0.015))}
    draft.plant.update(out, ridge_rad=float(rng.uniform(0.0, np.pi)))
    return out


def _slam(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """At its own time in each run, in half of the runs only."""
    out = {"slam_m_per_s2": 1.2 * size * spread(rng), "slam_rad": float(rng.uniform(0.0, 2.0 * np.pi))}
    draft.plant.update(out)
    draft.run_numbers["slam_s"] = np.where(rng.permutation(runs) % 2 == 0, rng.uniform(0.05, 0.3, runs), 1e3)
    return out


def _coin_wobble(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Slow enough that the disk goes aside before it is pushed back."""
    out = {"wobble_per_s": 0.6 * size * spread(rng), "wobble_rad_per_s": float(rng.uniform(50.0, 110.0)) * sign(rng)}
    draft.plant.update(out)
    return out


def _sinking_feet(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, as far to one side of the mean at first as to the other at last."""
    x, y = vector(0.3 * size * spread(rng), rng)
    course = np.linspace(-1.0, 1.0, runs)
    draft.run_numbers.update(feet_x_m_per_s2=x * course, feet_y_m_per_s2=y * course)
    return {"feet_x_m_per_s2": x, "feet_y_m_per_s2": y}


def _relevelled_table(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Once, somewhere in the middle of the series: as far to one side of the mean before as to the other from then
    on."""
    x, y = vector(0.28 * size * spread(rng), rng)
    first = max(round(runs * float(rng.uniform(0.35, 0.65))), 1)
    side = np.where(np.arange(runs) < first, -1.0, 1.0)
    draft.run_numbers.update(levelled_x_m_per_s2=x * side, levelled_y_m_per_s2=y * side)
    return {"levelled_x_m_per_s2": x, "levelled_y_m_per_s2": y, "from_run": float(first + 1)}


def _glue_line(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Along any line that passes within 12 mm of the Host's centre."""
    out = {"crossed_m_per_s2": 1.6 * size * spread(rng), "crossed_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, crossed_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _switched_blower(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Two to four times in a run; what switches it also starts the recordings."""
    out = {
        "blower_m_per_s2": 0.55 * size * spread(rng),
        "blower_rad": float(rng.uniform(0.0, 2.0 * np.pi)),
        "blower_rad_per_s": float(rng.uniform(10.0, 21.0)),
    }
    draft.plant.update(out)
    return out


def _kinked_sheet(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """A roof or a valley, along any line that passes within 12 mm of the Host's centre."""
    out = {"kink_m_per_s2": 0.5 * size * spread(rng) * sign(rng), "kink_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, kink_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _turned_up_edge(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """At any end, up or down, from a line on that passes the Host's centre on that side."""
    out = {"flap_per_s2": 45.0 * size * spread(rng) * sign(rng), "flap_m": float(rng.uniform(0.0, 0.01))}
    draft.plant.update(out, flap_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _lapped_plates(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Along any line that passes within 12 mm of the Host's centre."""
    out = {"plates_m_per_s2": 0.9 * size * spread(rng), "plates_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, plates_rad=float(rng.uniform(0.0, 2.0 * np.pi)))
    return out


def _doming_sheet(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Evenly from run to run, from a dish to a dome that is as deep, or back."""
    most = 15.0 * size * spread(rng) * sign(rng)
    draft.run_numbers.update(doming_per_s2=most * np.linspace(-1.0, 1.0, runs))
    return {"doming_per_s2": most}


def _nodal_circles(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Wherever the plate is at rest."""
    out = {"nodal_m_per_s2": 1.0 * size * spread(rng), "nodal_m": float(rng.uniform(0.005, 0.025))}
    draft.plant.update(out)
    return out


FORCES = [
    # --- a floor that is not level ---
    Cause("unknown_central", "flight", changes({"central_per_s2": 13.3})),
    Cause("unknown_swaying_floor", "flight", _sway),
    Cause("unknown_ridge", "flight", _ridge),
    Cause("unknown_saddle_floor", "flight", changes({"saddle_per_s2": 12.0}, ("saddle_rad",))),
    Cause("unknown_sagging_table", "flight", changes({"sag_m_per_s2": 0.2}, ("sag_rad",))),
    Cause("unknown_bowl_rim", "flight", changes({"bowl_m_per_s2": 1.5}, signed=True)),
    Cause("unknown_slam", "flight", _slam),
    # Rubber feet of the table that sink in from run to run.
    Cause("unknown_sinking_feet", "flight", _sinking_feet, follows="the number of the run"),
    # A table that somebody levels anew between two runs.
    Cause("unknown_relevelled_table", "flight", _relevelled_table, follows="the number of the run, from one on"),
    # A floor that was turned slightly conical.
    Cause(
        "unknown_coned_floor",
        "flight",
        changes({"cone_m_per_s2": 0.4}, signed=True),
        follows="the direction from the Host's centre, whatever the distance",
    ),
    # A floor plate that sags between its screws.
    Cause(
        "unknown_dished_floor",
        "flight",
        changes({"dished_per_m": 1.2}),
        follows="the place from the Host's centre",
    ),
    # A floor of sheet that was once bent along a line.
    Cause(
        "unknown_kinked_sheet",
        "flight",
        _kinked_sheet,
        follows="on which side of a line of the Host's floor the disk is",
    ),
    # A floor of sheet that was bent at one end.
    Cause(
        "unknown_turned_up_edge",
        "flight",
        _turned_up_edge,
        follows="how far beyond a line of the Host's floor the disk is, on one side of it",
    ),
    # A line of dried glue across the floor.
    Cause(
        "unknown_glue_line",
        "flight",
        _glue_line,
        follows="the place near a line of the Host's floor, against the speed across it",
    ),
    # A floor of two plates, of which one stands a millimetre higher.
    Cause(
        "unknown_lapped_plates",
        "flight",
        _lapped_plates,
        follows="the place near a line of the Host's floor, always towards one side of it",
    ),
    # A floor of sheet that came off a roll.
    Cause(
        "unknown_bowed_sheet",
        "flight",
        changes({"bowed_per_s2": 17.0}, ("bowed_rad",), signed=True),
        follows="the place along one direction from the Host's centre, along that direction only",
    ),
    # A floor plate of plastic that the shaker warms from run to run.
    Cause(
        "unknown_doming_sheet",
        "flight",
        _doming_sheet,
        follows="the place from the Host's centre, times the number of the run from the middle one",
    ),
    # The shaker rocks the table that the disk slides on.
    Cause("unknown_rocking_table", "flight", changes({"rocking": 0.005}, signed=True)),
    # A carriage with play in its guide leans one way there and the other way back.
    Cause(
        "unknown_guide_play",
        "flight",
        changes({"lean_m_per_s2": 0.4}, ("lean_rad",)),
        follows="the sense in which the Host moves along the drive's axis",
    ),
    # A bent guide, on which the Host leans by its place.
    Cause(
        "unknown_bent_guide",
        "flight",
        changes({"guide_per_s2": 30.0}, ("guide_rad",)),
        follows="the Host's place along the drive's axis",
    ),
    # A thin floor sheet that buckles under its own inertia.
    Cause(
        "unknown_buckling_sheet",
        "flight",
        changes({"buckled_per_s2": 25.0}, signed=True),
        follows="the place from the Host's centre, times the Host's acceleration along the drive's axis",
    ),
    # A floor plate whose own vibrations gather what lies on it, as a feeder's do.
    Cause(
        "unknown_nodal_circles",
        "flight",
        _nodal_circles,
        follows="the distance from the Host's centre, once in twenty millimetres, times the square of its acceleration",
    ),
    # --- what lies on it, and how the disk stands ---
    # A washer on feet that hunts like a wheelset.
    Cause(
        "unknown_hunting_disk",
        "flight",
        changes({"hunting_m_per_s2": 0.7}, signed=True),
        follows="the way slid since the last blow, to and fro, across the slip",
    ),
    # A mat keeps the disk's print for a while, and the disk would fall back into it.
    Cause("unknown_soft_mat", "flight", changes({"mat_per_s2": 20.0})),
    # Dust that the disk sweeps together and pushes along, until a blow scatters it.
    Cause("unknown_dust_bow", "flight", changes({"bow_m_per_s2": 0.8}), follows="the way slid since the last blow"),
    # A blow leaves the washer wobbling like a coin.
    Cause(
        "unknown_coin_wobble",
        "flight",
        _coin_wobble,
        follows="the time since the last blow, its normal and its approach speed",
        short_blows=True,
    ),
    # A floor that was oiled against rust.
    Cause(
        "unknown_oil_film",
        "flight",
        changes({"oil_film_per_s": 0.3}),
        follows="the slip over the Host's floor, and the spin over it",
        rivals=("viscous_drag",),
    ),
    # A floor whose oil warms as it is sheared, or is rubbed off, and is laid anew before each run.
    Cause(
        "unknown_fading_film",
        "flight",
        changes({"fading_film_per_s": 0.4}),
        follows="the slip over the Host's floor, ever less in the course of the run",
        rivals=("viscous_drag",),
    ),
    # A floor's film of grease, which gathers dust and gums up from run to run.
    Cause(
        "unknown_gumming_film",
        "flight",
        _gumming_film,
        follows="the slip over the Host's floor, ever more from run to run",
        rivals=("viscous_drag",),
    ),
    # Grease of the ring's joint, which has crept onto the floor.
    Cause(
        "unknown_crept_grease",
        "flight",
        changes({"crept_film_per_s": 0.35}),
        follows="the slip over the Host's floor, with the fourth power of the way from the Host's centre",
        rivals=("viscous_drag",),
    ),
    # A film of air below the disk, which a blow fills and which thins until the next.
    Cause(
        "unknown_thinning_film",
        "flight",
        changes({"thin_film_per_s": 0.5}),
        follows="the slip over the Host's floor, the more the longer since the last blow",
        rivals=("viscous_drag",),
    ),
    # A frame that rocks with the drive, and not in step with it.
    Cause(
        "unknown_rocking_frame",
        "flight",
        _rocking_frame,
        follows="the drive's phase, along its axis",
        steady_only=True,
    ),
    # A floor plate that nobody has clamped, and that tips from stop to stop.
    Cause(
        "unknown_unclamped_floor",
        "flight",
        changes({"unclamped_m_per_s2": 0.55}, ("unclamped_rad",)),
        follows="the sense of the Host's acceleration along the drive's axis",
    ),
    # A washer that does not stand level, and creeps to one side of itself as its floor shakes.
    Cause(
        "unknown_creeping_washer",
        "flight",
        changes({"leaning_m_per_s2": 0.5}, ("leaning_rad",)),
        follows="the disk's angle once around, in a push in the plane",
    ),
    # --- air ---
    Cause("unknown_magnus", "flight", changes({"magnus": 0.005}, signed=True)),
    Cause("unknown_rail_drag", "flight", changes({"rail_per_s": 0.7}, ("rail_rad",))),
    Cause("unknown_air_stream", "flight", changes({"stream_per_s": 1.6}, ("stream_rad",))),
    Cause("unknown_cubic_drag", "flight", changes({"cubic_s_per_m2": 0.26})),
    # Air that flows past the disk in layers.
    Cause(
        "unknown_boundary_layer",
        "flight",
        changes({"laminar_m_per_s2": 0.1}),
        follows="the velocity in the room, times the root of its size",
        rivals=("viscous_drag", "air_drag"),
    ),
    # The amplifier's fan, which blows past the rig.
    Cause(
        "unknown_cooling_fan",
        "flight",
        changes({"fan_per_m": 0.04}, ("fan_rad",)),
        follows="the velocity against air that moves through the room, with its square",
        rivals=("air_drag",),
    ),
    # A disk that stirs the air around it as it spins.
    Cause(
        "unknown_churned_air",
        "flight",
        changes({"churned": 0.0014}),
        follows="the velocity in the room, times the size of the spin",
    ),
    # A blower that switches itself on and off.
    Cause(
        "unknown_switched_blower",
        "flight",
        _switched_blower,
        follows="the time in the run, on and off by even beats, along one direction of the room",
        rivals=("table_tilt",),
    ),
    # A door that is opened in each run, and the draught from there on.
    Cause(
        "unknown_opened_door",
        "flight",
        _opened_door,
        follows="the time in the run, from one on, along one direction of the room",
        rivals=("table_tilt",),
    ),
    # Lamps that are switched on for each run, and the air that rises over the warm floor.
    Cause(
        "unknown_warm_updraught",
        "flight",
        changes({"updraught_per_s2": 40.0}),
        follows="the place from the Host's centre, times the time in the run",
    ),
    # A sticker of the disk that has folded up.
    Cause(
        "unknown_raised_sail",
        "flight",
        changes({"sail_per_m": 0.11}, ("sail_rad",)),
        follows="the square of the velocity along one line of the disk",
    ),
    # A thick washer presses the air out between its rim and the wall, and draws it in again.
    Cause("unknown_air_cushion", "flight", changes({"cushion_per_s": 6.0}), round_only=True),
    # A thick washer, whose film of air is pressed out between two faces.
    Cause(
        "unknown_squeezed_air",
        "flight",
        changes({"air_gap_m_per_s": 0.002}),
        follows="the speed along the radius in the Host, over the way to the wall",
        round_only=True,
    ),
    # The moving Host pumps air through a gap below its wall.
    Cause("unknown_bellows", "flight", changes({"bellows_m_per_s2": 0.7}, signed=True)),
    # Below a lid the air goes with the ring, and carries the disk.
    Cause("unknown_enclosed_air", "flight", changes({"enclosed_per_m": 0.4})),
    # An air table, whose jets push the disk from hole to hole.
    Cause(
        "unknown_air_jets",
        "flight",
        changes({"jets_m_per_s2": 0.5}, ("jets_x_rad", "jets_y_rad")),
        follows="the place in the Host, once in eighteen millimetres along either axis",
    ),
]
