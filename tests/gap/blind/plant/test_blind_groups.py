"""Each cause of the groups that are drawn only where they are asked for does as much as is stated and nothing else
(what their formulas say: test_plant_floor.py and the others)."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, physics_of_run
from analysis.blind.draw import ASKED_FOR, draw_cases
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.state import STATES
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.series import outline_series, run_outline
from tests.gap.blind.plant.rig import DRIVE, HOST, PLACE, TIMES, of_group, random_states

GROUPS = {group: of_group(group) for group in reversed(ASKED_FOR)}
EVERY = [cause for group in GROUPS.values() for cause in group]
# RMS over random states at severity 1, to a factor of two; the spread of sizes is 15 %.
ORDERS = {
    "unknown_canted_friction": ("force", 0.25),  # m/s^2
    "unknown_curling": ("force", 0.2),
    "unknown_lagging_friction": ("force", 2.4),  # all of the friction, at first
    "unknown_warped_washer": ("force", 0.6),
    "unknown_eddy_brake": ("force", 1.0),
    "unknown_rocking_table": ("force", 0.3),
    "unknown_spin_ratchet": ("torque", 80.0),  # rad/s^2
    "unknown_fading_grip": ("twist", 5.0),  # rad/s
    "unknown_bruised_wall": ("kick", 0.15),  # m/s
    "unknown_offset_blow": ("twist", 4.0),
    "unknown_greased_wall": ("kick", 0.04),
    "unknown_loose_chip": ("kick", 0.07),
    "unknown_chipped_disk": ("gap", 2e-4),  # m
    "unknown_creeping_liner": ("gap", 1.4e-4),
    "unknown_springy_liner": ("gap", 1.8e-4),
    "unknown_alternating_clock": ("pixels", 0.4),  # of the Host's markers
    "unknown_stuttering_camera": ("pixels", 0.75),
    "unknown_stretched_picture": ("pixels", 1.0),
    "unknown_air_cushion": ("force", 1.9),
    "unknown_coil_pull": ("force", 0.26),
    "unknown_loose_floor": ("friction", 1.4),
    "unknown_gritty_floor": ("friction", 0.7),
    "unknown_stuck_grain": ("friction", 0.13),
    "unknown_glue_thread": ("force", 1.1),
    "unknown_two_edges": ("kick", 0.07),
    "unknown_cohesive_wall": ("kick", 0.055),
    "unknown_taped_rim": ("twist", 3.3),
    "unknown_rolling_resistance": ("twist", 5.0),
    "unknown_overlapping_strip": ("gap", 1.45e-4),
    "unknown_loose_ring": ("gap", 1.75e-4),
    "unknown_shaken_camera": ("pixels", 0.7),
    "unknown_glare": ("pixels", 0.5),
    "unknown_napped_floor": ("friction", 0.6),
    "unknown_turning_floor": ("friction", 0.6),
    "unknown_stray_poles": ("force and torque", 0.4),
    "unknown_domed_disk": ("friction's torque", 35.0),
    "unknown_chattering_slide": ("friction", 0.65),
    "unknown_pitching_floor": ("friction", 0.4),
    "unknown_bellows": ("force", 0.35),
    "unknown_ringing_wall": ("kick", 0.08),
    "unknown_squeezed_grease": ("kick", 0.05),
    "unknown_sawtooth_wall": ("kick", 0.075),
    "unknown_seated_ring": ("kick", 0.06),
    "unknown_yielding_skin": ("twist", 3.5),
    "unknown_squashed_ring": ("gap", 1.8e-4),
    "unknown_slipping_ring": ("gap", 2.1e-4),
    "unknown_half_lid": ("pixels", 0.8),
    "unknown_grounded_trigger": ("pixels", 0.8),
    "unknown_leaf_springs": ("friction", 0.6),
    "unknown_tossed_disk": ("friction", 1.0),
    "unknown_punched_burr": ("friction's torque", 30.0),
    "unknown_alternating_field": ("torque", 200.0),
    "unknown_enclosed_air": ("force", 0.6),
    "unknown_soft_mat": ("force", 0.6),
    "unknown_brushed_pair": ("friction", 0.6),
    "unknown_leaning_wall": ("kick", 0.075),
    "unknown_turning_sleeve": ("twist", 5.0),
    "unknown_sprung_mount": ("kick", 0.09),
    "unknown_slipping_band": ("kick", 0.075),
    "unknown_tiring_liner": ("kick", 0.06),
    "unknown_refitted_ring": ("gap", 2.3e-4),
    "unknown_eccentric_tyre": ("gap", 2.5e-4),
    "unknown_free_running_camera": ("pixels", 0.7),
    "unknown_bent_tab": ("pixels", 0.9),
    "unknown_concentric_marks": ("friction", 0.5),
    "unknown_polished_track": ("friction", 0.77),
    "unknown_dust_bow": ("force", 0.55),
    "unknown_weathervane": ("torque", 19.0),
    "unknown_loose_core": ("torque", 38.0),
    "unknown_guide_play": ("force", 0.38),
    "unknown_rolled_sheet": ("kick", 0.055),
    "unknown_wandering_shim": ("kick", 0.052),
    "unknown_flash_heat": ("kick", 0.07),
    "unknown_rewetted_rim": ("kick", 0.07),
    "unknown_flattened_o_ring": ("twist", 1.7),
    "unknown_split_ring": ("gap", 1.9e-4),
    "unknown_trailing_ring": ("gap", 1.7e-4),
    "unknown_comet_tails": ("pixels", 0.8),
    "unknown_glinting_stickers": ("pixels", 0.7),
    "unknown_twisted_camera": ("pixels", 0.7),
    "unknown_smeared_drop": ("friction", 0.8),
    "unknown_bevelled_edge": ("friction", 0.6),
    "unknown_rumbling_guide": ("friction", 0.5),
    "unknown_spiral_face": ("torque", 38.0),
    "unknown_charged_disk": ("force", 0.4),
    "unknown_coin_wobble": ("force", 0.3),
    "unknown_combed_pile": ("kick", 0.07),
    "unknown_glued_rim": ("kick", 0.07),
    "unknown_shingled_liner": ("kick", 0.06),
    "unknown_rattling_weight": ("kick", 0.07),
    "unknown_swinging_ring": ("kick", 0.07),
    "unknown_orbiting_ring": ("gap", 1.9e-4),
    "unknown_packing_felt": ("gap", 2e-4),
    "unknown_shaded_wall": ("pixels", 0.7),
    "unknown_sync_pulses": ("pixels", 0.7),
    "unknown_flung_sticker": ("pixels", 0.35),
    "unknown_wound_wire": ("torque", 9.0),  # over one turn; a run has several
    "unknown_bristled_floor": ("friction", 0.5),
    "unknown_buckling_sheet": ("force", 0.4),
    "unknown_eddy_ring": ("force and torque", 0.4),
    "unknown_poled_disk": ("force and torque", 0.25),
    "unknown_wandering_bead": ("friction", 0.4),
    "unknown_cornered_rim": ("twist", 5.0),
    "unknown_shifted_band": ("kick", 0.05),
    "unknown_wiped_rim": ("kick", 0.07),
    "unknown_scaly_wall": ("kick", 0.07),
    "unknown_shot_filled_ring": ("kick", 0.06),
    "unknown_leaking_liner": ("gap", 1.8e-4),
    "unknown_swollen_band": ("gap", 1.7e-4),
    "unknown_shocked_trigger": ("pixels", 0.29),
    "unknown_coded_blocks": ("pixels", 0.73),
    "unknown_rubbery_card": ("pixels", 0.63),
    "unknown_stribeck_floor": ("friction", 0.55),
    "unknown_worn_middle": ("friction", 0.4),
    "unknown_scratched_floor": ("friction", 0.5),
    "unknown_dished_floor": ("force", 0.3),
    "unknown_lifted_disk": ("friction", 0.7),
    "unknown_ring_contact": ("friction's torque", 15.0),
    "unknown_soft_armature": ("kick", 0.09),
    "unknown_ragged_wall": ("kick", 0.08),
    "unknown_slip_weakened_wall": ("kick", 0.09),
    "unknown_warming_ring": ("kick", 0.06),
    "unknown_oblique_restitution": ("kick", 0.09),
    "unknown_chucked_ring": ("gap", 1.9e-4),
    "unknown_wall_bead": ("gap", 1.5e-4),
    "unknown_shaking_tripod": ("pixels", 0.7),
    "unknown_dropped_frame": ("pixels", 3.0),
    "unknown_marker_shadow": ("pixels", 0.6),
    "unknown_stray_field": ("force", 0.4),
    "unknown_clinging_disk": ("friction", 0.8),
    "unknown_swinging_floor": ("friction", 1.1),
    "unknown_oil_film": ("force and torque", 0.33),
    "unknown_screw_holes": ("friction", 0.55),
    "unknown_sinking_feet": ("force", 0.3),
    "unknown_drifted_dust": ("friction", 0.4),
    "unknown_ground_rim": ("kick", 0.06),
    "unknown_fibrous_lay": ("twist", 3.3),
    "unknown_worn_ends": ("kick", 0.07),
    "unknown_loosening_screws": ("kick", 0.14),
    "unknown_bottoming_pad": ("kick", 0.095),
    "unknown_nodding_ring": ("gap", 1.7e-4),
    "unknown_lapped_tape": ("gap", 1.8e-4),
    "unknown_flickering_lamps": ("pixels", 0.32),
    "unknown_bumped_camera": ("pixels", 0.6),
    "unknown_aged_contacts": ("friction", 1.1),
    "unknown_thinning_film": ("force and torque", 0.33),
    "unknown_air_jets": ("force", 0.5),
    "unknown_drumming_floor": ("friction", 0.5),
    "unknown_pulsing_air": ("friction", 0.5),
    "unknown_strengthening_floor": ("friction", 0.4),
    "unknown_slipping_edge": ("twist", 3.3),
    "unknown_wetted_wall": ("kick", 0.09),
    "unknown_chatter_marks": ("kick", 0.035),
    "unknown_run_in_wall": ("kick", 0.07),
    "unknown_hertzian_wall": ("kick", 0.06),
    "unknown_tipped_disk": ("gap", 1.8e-4),
    "unknown_warping_host": ("gap", 1.9e-4),
    "unknown_cold_camera": ("pixels", 0.6),
    "unknown_risen_markers": ("pixels", 0.6),
    "unknown_smoothed_tracks": ("pixels", 0.12),
    "unknown_bent_guide": ("force", 0.35),
    "unknown_shaker_magnet": ("force", 0.4),
    "unknown_stirred_air": ("torque", 1.9),  # of spins of 32 rad/s; a run has six times as fast ones
    "unknown_polished_lane": ("friction", 0.65),
    "unknown_knocked_dust": ("friction", 0.6),
    "unknown_cleaned_floor": ("friction", 0.4),
    "unknown_plastic_rim": ("kick", 0.05),
    "unknown_bolted_ring": ("kick", 0.06),
    "unknown_fouled_wall": ("kick", 0.065),
    "unknown_skimming_washer": ("kick", 0.08),
    "unknown_half_glued_liner": ("twist", 4.0),
    "unknown_worn_pockets": ("gap", 2.1e-4),
    "unknown_hinged_ring": ("gap", 2.2e-4),
    "unknown_program_start": ("pixels", 0.4),
    "unknown_leaning_card": ("pixels", 0.5),
    "unknown_refocused_lens": ("pixels", 0.6),
    "unknown_raised_sail": ("force", 0.2),  # of disks at 0.86 m/s along either axis; a run has faster ones
    "unknown_kinked_sheet": ("force", 0.45),
    "unknown_doming_sheet": ("force", 0.4),
    "unknown_faced_floor": ("friction", 0.45),
    "unknown_drying_spot": ("friction", 0.55),  # as a run begins
    "unknown_ribbed_floor": ("friction", 0.5),
    "unknown_swept_cushion": ("kick", 0.05),
    "unknown_flung_oil": ("kick", 0.06),
    "unknown_pivoted_ring": ("kick", 0.07),
    "unknown_bulging_lining": ("kick", 0.1),
    "unknown_sheared_gel": ("twist", 3.3),
    "unknown_thrown_tyre": ("gap", 1.2e-4),
    "unknown_relaxing_ring": ("gap", 2.5e-4),
    "unknown_knocked_lens": ("pixels", 0.9),
    "unknown_sagging_arm": ("pixels", 0.8),
    "unknown_blooming_markers": ("pixels", 0.7),
}
# What a cause changes of the state beside velocity and spin: the way over a floor that moves, what is remembered.
OWN = {
    "unknown_lagging_friction": ("lx", "ly"),
    "unknown_loose_floor": ("way",),
    "unknown_turning_floor": ("way",),
    "unknown_soft_mat": ("print_x", "print_y"),
    "unknown_sawtooth_wall": (
        "hard",
        "azimuth",
        "normal",
        "approach",
        "tired",
        "slipped",
        "struck",
    ),  # where it is struck, how hard
    "unknown_turning_sleeve": ("sleeve",),
    "unknown_loose_core": ("core",),
    "unknown_smeared_drop": ("oiled",),
    "unknown_clinging_disk": ("charge",),
    "unknown_aged_contacts": ("aged",),
    "unknown_swinging_floor": ("way",),
    "unknown_cornered_rim": ("hard", "azimuth", "approach", "tired", "struck"),
    "unknown_chatter_marks": ("hard", "azimuth", "normal", "approach", "tired", "slipped", "struck"),
    "unknown_ragged_wall": ("hard", "azimuth", "normal", "approach", "tired", "slipped", "struck"),
    "unknown_bulging_lining": ("hard", "azimuth", "normal", "approach", "tired", "slipped", "struck"),
}
# The camera that a cause acts in (of others: both), and of which body's markers its pixels are stated.
CAMERA = {
    "unknown_stuttering_camera": "VW1",
    "unknown_shaken_camera": "VW1",
    "unknown_grounded_trigger": "VW2",
    "unknown_free_running_camera": "VW2",
    "unknown_twisted_camera": "VW1",
    "unknown_sync_pulses": "VW2",
    "unknown_shocked_trigger": "VW2",
    "unknown_shaking_tripod": "VW1",
    "unknown_dropped_frame": "VW2",
    "unknown_bumped_camera": "VW1",
    "unknown_cold_camera": "VW1",
    "unknown_program_start": "VW2",
    "unknown_refocused_lens": "VW1",
    "unknown_knocked_lens": "VW1",
    "unknown_sagging_arm": "VW2",
}
OF_THE_DISK = (
    "unknown_glare",
    "unknown_half_lid",
    "unknown_comet_tails",
    "unknown_glinting_stickers",
    "unknown_shaded_wall",
    "unknown_flung_sticker",
    "unknown_rubbery_card",
    "unknown_marker_shadow",
    "unknown_risen_markers",
    "unknown_leaning_card",
    "unknown_blooming_markers",
)


def _physics(name):
    return physics_of_run(draft_series(name, 1.0, np.random.default_rng(1), 12), 0, DRIVE, 1.2)


@cache
def _done(name):
    """What the plant does with a cause ("none": without one): rates in the ring and states after a blow (60,
    STATES), gaps and normals at the wall (60, 3)."""
    p, table, free, there = _physics(name), disk_friction_table(), random_states(), random_states(True)
    chances = np.random.default_rng(2).normal(size=(60, 2))
    return (
        np.array([derivative(time, state, p, HOST, table) for time, state in zip(TIMES, free, strict=True)]),
        np.array([impact(t, s, p, HOST, c, 1.0)[0] for t, s, c in zip(TIMES, there, chances, strict=True)]),
        np.array([wall_gap(time, state, p, HOST) for time, state in zip(TIMES, there, strict=True)]),
    )


def _rms(off):
    return float(np.sqrt(np.mean(np.square(off))))


def _others(changes, name):
    """What a cause changes of the state beside velocity, spin and what is its own."""
    own = [2, 3, 5, *(PLACE.index(one) for one in OWN.get(name, ()))]
    return np.delete(changes, own, axis=1)


def test_every_one_has_its_stated_amount():
    assert ORDERS.keys() == {cause.name for cause in EVERY} and len(PLACE) == STATES


@pytest.mark.parametrize("name", [c.name for c in EVERY if c.stage != "measurement"])
def test_a_cause_changes_its_own_stage_by_the_stated_amount_and_no_other(name):
    rates, bounces, gaps = (a - b for a, b in zip(_done(name), _done("none"), strict=True))
    kind, stated = ORDERS[name]
    stage = CAUSES[name].stage
    if stage == "flight":
        assert np.all(bounces == 0.0) and np.all(gaps == 0.0)
        assert np.all(_others(rates, name) == 0.0)
        assert kind != "force" or np.all(rates[:, 5] == 0.0)
        assert kind != "torque" or np.all(rates[:, 2:4] == 0.0)
        turned = kind.endswith("torque") and kind != "force and torque"
        amount = _rms(rates[:, 5]) if turned else _rms(np.hypot(rates[:, 2], rates[:, 3]))
    elif stage == "impact":
        assert np.all(rates == 0.0) and np.all(gaps == 0.0)
        assert np.abs(_others(bounces, name)).max() < 1e-15  # m: what lies at the wall to the last bit
        amount = _rms(bounces[:, 5]) if kind == "twist" else _rms(np.hypot(bounces[:, 2], bounces[:, 3]))
    else:
        assert np.all(rates == 0.0)
        amount = _rms(gaps[:, 0])
    assert 0.5 * stated < amount < 2.0 * stated, amount


@cache
def _plain():
    """A run without a cause, and what it was made of."""
    outline = outline_series("none", 1.0, np.random.default_rng(4), 1, "white")
    return outline, run_outline(outline, np.random.default_rng(5), 8.0)


@pytest.mark.parametrize("name", [c.name for c in EVERY if c.stage == "measurement"])
def test_a_cause_in_the_cameras_moves_the_picture_and_not_the_disk(name):
    """The same seed with and without it: the same markers in the same frames, the same impacts, other pixels."""
    outline, plain = _plain()
    view = draft_series(name, 1.0, np.random.default_rng(1), 1).view
    with_it = replace(outline, draft=replace(outline.draft, view=view))
    seen = run_outline(with_it, np.random.default_rng(5), 8.0)
    for key in ("imp01", "H01"):
        assert np.array_equal(seen.states[key], plain.states[key])
    keys = ["camera", "frame", "marker"]
    both = seen.recordings[0][1].merge(plain.recordings[0][1], on=keys, suffixes=("", "_plain"))
    assert len(both) > 0.97 * len(plain.recordings[0][1])
    off = np.hypot(both.u_px - both.u_px_plain, both.v_px - both.v_px_plain)
    one = view.get("glare_camera", view.get("lid_camera", view.get("glint_camera")))
    camera = CAMERA.get(name) if one is None else f"VW{one + 1}"
    if camera is not None:
        assert off[both.camera != camera].max() == 0.0 and off[both.camera == camera].max() > 0.0
        both, off = both[both.camera == camera], off[both.camera == camera]
    ground = off[both.marker.str.startswith("G")]
    if name == "unknown_alternating_clock":
        assert off[both.frame % 2 == 0].max() == 0.0
    if name == "unknown_stuttering_camera":
        assert 0.02 < both[off > 0].frame.nunique() / both.frame.nunique() < 0.09
    if name == "unknown_stretched_picture":
        assert np.abs(both.u_px - both.u_px_plain).max() == 0.0
    if name == "unknown_half_lid":
        assert np.ptp(ground.groupby(both.marker).mean()) > 0.1
    if name in (
        "unknown_grounded_trigger",
        "unknown_free_running_camera",
        "unknown_sync_pulses",
        "unknown_shocked_trigger",
        "unknown_dropped_frame",
        "unknown_flickering_lamps",
        "unknown_program_start",
    ):
        assert ground.max() < 1e-9
    if name == "unknown_bent_tab":
        assert off[both.marker != f"H{view['tab_marker'] + 1}"].max() == 0.0
    amount = _rms(off[both.marker.str.startswith("N" if name in OF_THE_DISK else "H")])
    assert 0.5 * ORDERS[name][1] < amount < 2.0 * ORDERS[name][1], amount


@pytest.mark.parametrize("group", GROUPS)
def test_they_are_drawn_only_where_they_are_asked_for(group):
    """Beside a listed cause, too, before those of earlier groups; none twice before all have come (of 18 causes 17: one
    may be put back that cannot stand beside the listed one)."""
    ours, earlier = {c.name for c in GROUPS[group]}, tuple(GROUPS)[: tuple(GROUPS).index(group)]
    rng = np.random.default_rng
    kinds = ("none", "listed", "pair", "triple", group, "beside")
    drawn = [cause for case in draw_cases(60, rng(3), kinds) for cause in case.causes if cause in ours]
    assert len(drawn) == 20 and len(set(drawn)) >= min(17, len(ours))
    for kinds, count in (((group, "beside"), 60), ((*earlier, group, "beside"), 120 // (len(earlier) + 2))):
        beside = [case.causes for case in draw_cases(120, rng(3), kinds) if len(case.causes) == 2]
        assert len(beside) in (count, count + 1) and all(
            listed not in ours and other in ours for listed, other in beside
        )
    for others in ((), ("unknown", "later", "latest", "beside"), (*earlier, "beside")):
        assert not any(ours & set(case.causes) for case in draw_cases(200, rng(3), others))


# Six cases of each group and of those beside a listed cause, as they were drawn before the next group was written.
AS_BEFORE = {
    "overlooked": [
        "plane_tilt+unknown_loosening_screws",
        "unknown_nodding_ring",
        "unknown_worn_ends",
        "unknown_lapped_tape",
        "restitution_drift+unknown_flickering_lamps",
        "camera_clock_offset+unknown_oil_film",
    ],
    "reported": [
        "plane_tilt+unknown_hertzian_wall",
        "unknown_warping_host",
        "unknown_run_in_wall",
        "unknown_cold_camera",
        "restitution_drift+unknown_risen_markers",
        "camera_clock_offset+unknown_drumming_floor",
    ],
    "suspected": [
        "plane_tilt+unknown_half_glued_liner",
        "unknown_hinged_ring",
        "unknown_skimming_washer",
        "unknown_program_start",
        "restitution_drift+unknown_leaning_card",
        "camera_clock_offset+unknown_polished_lane",
    ],
    "refereed": [
        "plane_tilt+unknown_sheared_gel",
        "unknown_relaxing_ring",
        "unknown_bulging_lining",
        "unknown_knocked_lens",
        "restitution_drift+unknown_sagging_arm",
        "camera_clock_offset+unknown_faced_floor",
    ],
}


@pytest.mark.parametrize("group", AS_BEFORE)
def test_a_trial_of_an_earlier_group_is_drawn_as_before(group):
    cases = draw_cases(6, np.random.default_rng(1), (group, "beside"))
    assert [case.kind for case in cases] == AS_BEFORE[group]
