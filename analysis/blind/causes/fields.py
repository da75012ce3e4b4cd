"""Unlisted causes in flights beside the floor's friction: magnets, charge and threads; torques."""

import numpy as np

from analysis.blind.cause import Cause, Draft, Rng, Truth, changes, sign, spread, vector


def _pull(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.02, rng)
    out = {"pull_m_per_s2": 0.7 * size * spread(rng), "pull_x_m": x, "pull_y_m": y}
    draft.plant.update(out)
    return out


def _lab_magnet(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    """Along any direction of the room, towards either side or off it, with none within 12 mm of its middle."""
    out = {"lab_pull_per_s2": 16.0 * size * spread(rng) * sign(rng), "lab_pull_m": float(rng.uniform(-0.012, 0.012))}
    draft.plant.update(out, lab_pull_rad=float(rng.uniform(0.0, np.pi)))
    return out


def _tether(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.03, rng)
    out = {"tether_per_s2": 40.0 * size * spread(rng), "tether_x_m": x, "tether_y_m": y}
    draft.plant.update(out)
    return out


def _eddy_brake(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    x, y = vector(0.018, rng)
    out = {"eddy_per_s": 2.5 * size * spread(rng), "eddy_x_m": x, "eddy_y_m": y}
    draft.plant.update(out)
    return out


def _windmill(draft: Draft, size: float, rng: Rng, runs: int) -> Truth:
    out = {"windmill_per_s": 1.2 * size * spread(rng), "windmill_rad_per_s": 150.0 * sign(rng)}
    draft.plant.update(out)
    return out


FIELDS = [
    # --- magnets, charge and threads ---
    Cause("unknown_magnetic_pull", "flight", _pull),
    Cause("unknown_wall_pull", "flight", changes({"wall_pull_m_per_s2": 2.5}, signed=True)),
    Cause("unknown_swirl", "flight", changes({"swirl_per_s2": 10.0}, signed=True)),
    Cause("unknown_tether", "flight", _tether),
    # A magnet under the Host's floor brakes what moves over it.
    Cause("unknown_eddy_brake", "flight", _eddy_brake),
    # The shaker's magnet is not shielded, and the table not far enough from it.
    Cause(
        "unknown_stray_field",
        "flight",
        changes({"stray_field_per_s": 0.2}, signed=True),
        follows="the velocity in the room, and the place in it along the drive's axis",
    ),
    # A washer of hard steel in the shaker's uneven field.
    Cause(
        "unknown_hysteresis_drag",
        "flight",
        changes({"hysteresis_m_per_s2": 0.45}),
        follows="the direction of the velocity in the room, whatever its size",
    ),
    # The shaker's coil draws the steel, whichever way its current flows.
    Cause("unknown_coil_pull", "flight", changes({"coil_m_per_s2": 0.5}, ("coil_rad",))),
    # The shaker's magnet draws the steel, and the table was levelled against it in the middle.
    Cause(
        "unknown_shaker_magnet",
        "flight",
        changes({"magnet_m_per_s2": 0.45}, signed=True),
        follows="the place in the room along the drive's axis",
    ),
    # A magnet that stands in the room beside the rig.
    Cause(
        "unknown_lab_magnet",
        "flight",
        _lab_magnet,
        follows="the place in the room along one direction, along that direction only",
        rivals=("table_tilt",),
    ),
    # Residue of an adhesive tape on the wall: it holds on to what leaves, until it tears.
    Cause("unknown_glue_thread", "flight", changes({"thread_m_per_s2": 5.0}), round_only=True, short_blows=True),
    # A steel ring that was turned in a magnetic chuck.
    Cause(
        "unknown_magnetised_ring",
        "flight",
        changes({"ring_poles_m_per_s2": 1.2}, ("ring_poles_rad",)),
        follows="the way to the wall, and the azimuth of the disk's place in the Host twice around",
        round_only=True,
    ),
    # A magnetised washer between two opposed magnets under the Host: pushed as it lies, and turned off the middle.
    Cause("unknown_stray_poles", "flight", changes({"poles_m_per_s2": 0.4}, ("poles_rad",))),
    # Dry air and a plastic floor: the disk is charged as it slides, until it touches the ring.
    Cause(
        "unknown_charged_disk",
        "flight",
        changes({"charged_per_s2": 26.0}),
        follows="the place from the Host's centre, times the way slid since the last blow",
    ),
    # A disk with a charge that stays, and its image in a ring of metal.
    Cause(
        "unknown_image_charge",
        "flight",
        changes({"image_m_per_s2": 1.2}),
        follows="one over the square of the way to the wall, always as much",
        round_only=True,
    ),
    # A plastic ring, which charges the disk with each blow and draws it.
    Cause(
        "unknown_struck_charge",
        "flight",
        changes({"struck_charge_m_per_s2": 0.06}),
        follows="the number of blows so far, over the square of the way from the disk's middle to the wall",
        round_only=True,
        short_blows=True,
    ),
    # A magnetised washer near a ring of aluminium.
    Cause(
        "unknown_eddy_ring",
        "flight",
        changes({"eddied_per_s": 2.0}),
        follows="the speed of the rim along the wall, and the way to the wall",
        round_only=True,
    ),
    # A magnetised washer in a ring of steel.
    Cause(
        "unknown_poled_disk",
        "flight",
        changes({"poled_m_per_s2": 0.4}, ("poled_rad",)),
        follows="the angle between the disk and the radius from the Host's centre, twice around",
        round_only=True,
    ),
    # --- torques ---
    Cause("unknown_spin_drag", "flight", changes({"spin_drag_per_s": 1.5})),
    # Stickers that stand up at their edges, and stir the air.
    Cause("unknown_stirred_air", "flight", changes({"stirred": 0.0016}), follows="the spin times its size"),
    Cause("unknown_compass_needle", "flight", changes({"needle_rad_per_s2": 350.0}, ("needle_rad",))),
    Cause("unknown_windmill", "flight", _windmill),
    Cause("unknown_bistable_disk", "flight", changes({"bistable_rad_per_s2": 300.0}, ("bistable_rad",))),
    # A burr that catches in one sense of spin only.
    Cause("unknown_spin_ratchet", "flight", changes({"ratchet_rad_per_s2": 120.0}, signed=True)),
    # The shaker's alternating field turns a magnetised washer to and fro.
    Cause("unknown_alternating_field", "flight", changes({"alternating_rad_per_s2": 400.0}, ("alternating_rad",))),
    # A sticker that has come off at one end and stands up like a fin.
    Cause(
        "unknown_weathervane",
        "flight",
        changes({"vane_rad_per_s2": 11.0}, ("vane_rad",)),
        follows="the angle between the disk and its way through the room, and the square of its speed",
    ),
    # A weight in the washer's hole that turns in its soft glue.
    Cause(
        "unknown_loose_core",
        "flight",
        changes({"core_per_s": 1.6}),
        follows="the spin against its mean over the last 30 ms",
    ),
    # A burr around the washer's hole, on which it turns as on a pivot.
    Cause(
        "unknown_rubbing_hub",
        "flight",
        changes({"hub_rad_per_s2": 55.0}),
        follows="the sense of the spin over the Host's floor, whatever its size",
    ),
    # A washer faced on a lathe: its spiral groove turns it as it slides.
    Cause(
        "unknown_spiral_face", "flight", changes({"spiral_rad_per_s2": 32.0}, signed=True), follows="the slip's speed"
    ),
    # A wire from the ceiling, for a charge or a sensor, that the disk's turns wind up.
    Cause(
        "unknown_wound_wire",
        "flight",
        changes({"wound_per_s2": 3.5}, ("wound_rad",)),
        follows="the disk's angle, whole turns counted",
    ),
]
