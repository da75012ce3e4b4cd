"""Which causes a series may have at once."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together
from tests.gap.blind.plant.rig import needs_a_blow_that_is_over, needs_a_round_wall, of_group


def test_what_remembers_a_blow_does_not_stand_beside_a_contact_that_lasts():
    names = ("unknown_loose_ring", "unknown_glue_thread", "unknown_two_edges")
    needs_a_blow_that_is_over(names)
    assert all(may_stand_together(("table_tilt", name), "round", "sine") for name in names)


def test_a_frame_rate_is_wrong_only_where_a_frequency_was_asked_for():
    """Nothing else in a recording knows how long a second is."""
    assert may_stand_together(("frame_rate_error",), "round", "start_up")
    assert not any(may_stand_together(("frame_rate_error",), "round", d) for d in ("chirp", "random", "two_lines"))


def test_only_a_round_wall_is_squashed_and_no_blow_has_two_laws():
    needs_a_round_wall("unknown_squashed_ring")
    needs_a_blow_that_is_over(cause.name for cause in of_group("unimagined") if cause.stage == "impact")


def test_a_sleeve_and_what_remembers_a_blow():
    """A sleeve needs a round wall, what remembers a blow one that does not last, no blow has two laws; and a
    small band is one that sits tight."""
    needs_a_round_wall("unknown_turning_sleeve")
    needs_a_blow_that_is_over(
        ["unknown_tossed_disk", *(cause.name for cause in of_group("undreamt") if cause.stage == "impact")]
    )
    tight, loose = (
        draft_series("unknown_slipping_band", size, np.random.default_rng(1), 1).plant["band_m_per_s"]
        for size in (0.3, 1.2)
    )
    assert tight == pytest.approx(2.0 * loose)


def test_halves_of_a_ring_and_a_ring_that_trails():
    """Halves of a ring need a round wall, no blow has two laws."""
    needs_a_round_wall("unknown_split_ring")
    assert may_stand_together(("table_tilt", "unknown_trailing_ring"), "square", "sine")
    needs_a_blow_that_is_over(cause.name for cause in of_group("unsuspected") if cause.stage == "impact")


def test_a_liner_a_ring_that_turns_and_a_wobble():
    """A liner and a ring that turns need a round wall, no blow has two laws, a wobble needs a blow that is over."""
    for name in ("unknown_packing_felt", "unknown_swinging_ring"):
        needs_a_round_wall(name)
    assert may_stand_together(("table_tilt", "unknown_orbiting_ring"), "square", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_charged_disk"), "round", "sine")
    alone = ["unknown_coin_wobble", *(cause.name for cause in of_group("unexpected") if cause.stage == "impact")]
    needs_a_blow_that_is_over(alone)


def test_metal_rings_and_what_is_left_of_a_blow():
    """A ring of aluminium or steel is round, no blow has two laws, what is left of a blow needs one that is over."""
    for name in ("unknown_eddy_ring", "unknown_poled_disk"):
        needs_a_round_wall(name)
    assert may_stand_together(("table_tilt", "unknown_leaking_liner"), "square", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_wound_wire"), "round", "sine")
    alone = ["unknown_leaking_liner", "unknown_swollen_band", "unknown_rubbery_card"]
    needs_a_blow_that_is_over([*alone, *(cause.name for cause in of_group("untold") if cause.stage == "impact")])


def test_tape_an_oil_film_and_a_ring_that_swings():
    """Tape has a reach in a round ring, two drags of one law do not stand together, what swings needs short blows."""
    needs_a_round_wall("unknown_lapped_tape")
    assert not may_stand_together(("viscous_drag", "unknown_oil_film"), "round", "sine")
    assert may_stand_together(("air_drag", "unknown_oil_film"), "triangle", "random")
    assert may_stand_together(("finite_contact_time", "unknown_clinging_disk"), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_nodding_ring"), "square", "sine")
    alone = ["unknown_nodding_ring", *(cause.name for cause in of_group("overlooked") if cause.stage == "impact")]
    needs_a_blow_that_is_over(alone)


def test_lobes_beads_and_shadows():
    """Lobes, beads and shadows are of a round wall; two of one law do not stand together, and no blow has two laws."""
    for name in ("unknown_chucked_ring", "unknown_wall_bead", "unknown_marker_shadow"):
        needs_a_round_wall(name)
    for rivals in (
        ("nes_rocking", "unknown_lifted_disk"),
        ("unknown_hop", "unknown_lifted_disk"),
        ("wall_lobes", "unknown_chucked_ring"),
        ("restitution_drift", "unknown_warming_ring"),
    ):
        assert not may_stand_together(rivals, "round", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_lifted_disk"), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_soft_armature"), "square", "chirp")
    needs_a_blow_that_is_over(cause.name for cause in of_group("plausible") if cause.stage == "impact")
