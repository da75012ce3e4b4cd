"""What is conjectured of a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import sheared, smeared
from tests.gap.blind.plant.rig import (
    BARE,
    FREE,
    SLIDING,
    STILL,
    TIMES,
    G,
    after_blow,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    random_states,
    rate_of,
    state_of,
    struck,
)

RUNS = 12


def test_a_blow_sets_a_disk_rattling():
    disk = SLIDING._replace(rattled_s_per_m=0.3)
    for late, approach in ((0.0, 1.0), (0.02, 1.8), (0.09, 0.4)):
        left = 1.0 - 0.3 * approach * np.exp(-late / 0.03)
        out = rate_of(disk, 0.1 + late, vx=1.0, impact_s=0.1, count=1, approach=approach)
        assert out == pytest.approx((-G * left, 0.0, 0.0), rel=1e-6)
    assert rate_of(disk, vx=1.0)[0] == pytest.approx(-G, rel=1e-6)  # no blow before
    assert rate_of(disk, 0.1, vx=1.0, impact_s=0.1, count=1, approach=5.0)[0] == 0.0


def test_a_speck_gets_under_the_disk_in_each_run():
    disk = SLIDING._replace(specked=0.4, specked_share=0.25, duration_s=0.8)
    for time, share in ((0.05, 0.0), (0.18, 0.0), (0.2, 0.5), (0.22, 1.0), (0.7, 1.0)):
        assert rate_of(disk, time, vy=0.7)[1] == pytest.approx(-G * (1.0 + 0.4 * share), rel=1e-5)
    shares = draft_series("unknown_caught_speck", 1.0, np.random.default_rng(2), RUNS).run_numbers["specked_share"]
    assert len(set(shares)) == RUNS and shares.min() >= 0.1 and shares.max() <= 0.5


def test_warm_air_flows_outwards_ever_more():
    air = FREE._replace(updraught_per_s2=30.0, duration_s=0.8)
    for time, share in ((-1e-3, 0.0), (0.2, 0.25), (0.8, 1.0), (0.9, 1.0)):
        out = rate_of(air, time, x=0.02, y=-0.01, vx=1.0, spin=20.0)
        assert out == pytest.approx((0.6 * share, -0.3 * share, 0.0), abs=1e-12)


def test_a_charge_is_drawn_to_its_image():
    charged = FREE._replace(image_m_per_s2=1.5)
    for gap in (0.0, 0.005, 0.02):
        pull = 1.5 / (1.0 + gap / 0.005) ** 2
        c, s = np.cos(0.6), np.sin(0.6)
        out = rate_of(charged, x=(0.04 - gap) * c, y=(0.04 - gap) * s)
        assert out == pytest.approx((pull * c, pull * s, 0.0), rel=6e-3, abs=1e-9)
    # What it gains is what the field gives: its energy is that of one over the way to the image.
    nodes = run_plant(charged, STILL, np.array([0.02, 0.0, 0.9, 0.0, 0.0, 0.0]), 0.015, np.random.default_rng(0)).nodes
    gaps, won = 0.04 - nodes[[0, -1], 1], 0.5 * (nodes[-1, 3] ** 2 - nodes[0, 3] ** 2)
    assert won == pytest.approx(1.5 * 0.005**2 * (1.0 / (gaps[1] + 0.005) - 1.0 / (gaps[0] + 0.005)), rel=1e-2)


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in ({"rattled_s_per_m": 0.9}, {"specked": 0.4, "specked_share": 0.1}):
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, SLIDING._replace(**changed), STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] <= 0.0


def test_soft_metal_hardens_where_it_is_struck():
    metal = BARE._replace(dinted_s_per_m=0.1)
    for last in (0.3, 1.1, 2.0):
        assert head_on(metal, count=1, approach=last)[0] == pytest.approx(-0.7 - 0.1 * (last - 1.1))
    assert head_on(metal, approach=2.0)[0] == pytest.approx(-0.7)  # none before
    assert head_on(metal, count=1, approach=9.0)[0] == pytest.approx(-0.98)


def test_clamps_slacken_with_the_logarithm_of_the_time():
    clamps = BARE._replace(slackened=0.05)
    for time in (0.0, 0.02, 0.3, 1.0):
        assert head_on(clamps, time=time)[0] == pytest.approx(-0.7 * (1.0 - 0.05 * np.log(1.0 + time / 0.02)))
    assert head_on(BARE._replace(slackened=2.0), time=1.0)[0] == pytest.approx(-0.05)


def test_grease_thickens_as_it_is_sheared():
    grease = BARE._replace(thickened_s_per_m=0.5)
    for slip in (1.2, -0.9):
        held = (
            0.15 * (1.0 + 0.5 * (abs(slip) - 0.4)) * 1.7
        )  # a third of the mass turns: three times as much of the slip
        assert struck(grease, vy=slip)[3] == pytest.approx(slip - np.sign(slip) * held)
    assert struck(BARE._replace(thickened_s_per_m=9.0), vy=0.1)[3] == pytest.approx(0.1 - 0.15 * 0.02 * 1.7)


def test_a_wall_holds_less_with_the_logarithm_of_the_slip():
    wall = BARE._replace(rate_weakened=0.4)
    for slip in (1.6, 3.0, -0.8):
        held = 0.15 * (1.0 - 0.4 * np.log((abs(slip) + 0.02) / 0.4)) * 1.7
        assert struck(wall, vy=slip)[3] == pytest.approx(slip - np.sign(slip) * held)
    assert struck(BARE._replace(rate_weakened=5.0), vy=3.0)[3] == pytest.approx(3.0 - 0.15 * 0.02 * 1.7)


def test_rubber_is_worked_soft_by_the_blows_of_a_run():
    rubber = BARE._replace(wall_friction=5.0, worked=0.8)
    for blows in (0, 1, 6, 40):
        value = 0.45 * (1.0 - 0.8 * (1.0 - np.exp(-blows / 3.0)))
        assert head_on(rubber, vy=0.2, count=blows)[1] == pytest.approx(-0.2 * value)
    assert head_on(rubber._replace(worked=2.0), vy=0.2, count=40)[1] == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("restitution", [1.0, 0.7])
def test_a_round_contact_lasts_the_longer_the_slower_it_is(restitution):
    """Hertz: the greatest depth goes with the power 4/5 of the approach, the duration with -1/5; what is given back
    does not depend on it (a little more than asked for, as the wall never pulls)."""
    contact, back, lasted = BARE._replace(hertz_contact_s=8e-4, restitution=restitution), [], []
    for speed in (0.5, 1.0, 2.0):
        start = np.array([0.0395, 0.0, speed, 0.0, 0.0, 0.0])
        nodes = run_plant(contact, STILL, start, 2e-3, np.random.default_rng(0)).nodes
        back.append(-nodes[-1, 3] / speed)
        lasted.append(np.ptp(nodes[nodes[:, 7] == 1.0, 0]))
        if restitution == 1.0:
            assert nodes[:, 1].max() - 0.04 == pytest.approx(8e-4 / 2.9432 * speed**0.8, rel=1e-2)
            assert lasted[-1] == pytest.approx(8e-4 * speed**-0.2, abs=5e-5)
    assert lasted[0] > lasted[1] > lasted[2]
    assert np.ptp(back) < 3e-3 and restitution - 1e-3 < back[0] < restitution + 0.03


@pytest.mark.further
def test_what_sticks_in_a_round_contact_comes_back_as_in_a_short_blow():
    plant = draft_series("unknown_round_contact", 1.0, np.random.default_rng(2), RUNS).plant
    numbers = {name: plant[name] for name in ("hertz_contact_s", "contact_shear_share", "tangential_restitution")}
    contact = BARE._replace(wall_friction=5.0, restitution=1.0, **numbers)
    out = after_blow(0.1, state_of(x=0.04, vx=1.0, vy=0.1), contact, STILL, np.zeros(2))
    assert out[3] + 0.01 * out[5] == pytest.approx(-0.1 * plant["tangential_restitution"], abs=0.01)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"dinted_s_per_m": 0.3},
        {"slackened": 0.1},
        {"thickened_s_per_m": 2.0},
        {"rate_weakened": 0.9},
        {"worked": 1.2},
        {"hertz_contact_s": 8e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_card_shears_its_glue_and_creeps_back():
    time, impact_s = np.linspace(0.0, 0.1, 51), np.array([0.02, 0.05])
    kicks, nes = np.array([[-2.0, 0.5], [1.0, 1.5]]), np.random.default_rng(3).normal(size=(51, 4))
    off = sheared(nes, time, impact_s, kicks, ViewErrors(sheared_s=1e-4)) - nes
    for instant, row in zip(time, off, strict=True):
        left = np.where(instant >= impact_s, np.exp(-(instant - impact_s) / 0.015), 0.0)
        assert row == pytest.approx([*(-1e-4 * left @ kicks), 0.0, 0.0], abs=1e-12)
    assert sheared(nes, time, impact_s, kicks, ViewErrors()) is nes


def test_a_long_shutter_finds_markers_behind():
    time, points = np.linspace(0.0, 0.1, 21), np.zeros((21, 12, 3))
    velocity = np.random.default_rng(3).normal(size=(12, 2))
    points[..., :2] = time[:, None, None] * velocity
    off = smeared(points, time, ViewErrors(smear_s2_per_m=3e-5)) - points
    assert off[..., :2] == pytest.approx(np.tile(-3e-5 * np.hypot(*velocity.T)[:, None] * velocity, (21, 1, 1)))
    assert not np.any(off[..., 2]) and smeared(points, time, ViewErrors()) is points


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; laws of a blow need blows that are over,
    also beside a round contact; an image needs a round wall."""
    impacts = ("hardening_dints", "slackening_clamps", "thickening_grease", "rate_weakened_wall", "worked_rubber")
    needs_a_blow_that_is_over(
        f"unknown_{name}" for name in (*impacts, "round_contact", "rattling_disk", "shearing_glue")
    )
    needs_a_round_wall("unknown_image_charge")
    for listed, ours in (
        ("nes_rocking", "unknown_rattling_disk"),
        ("friction_drift", "unknown_caught_speck"),
        ("restitution_drift", "unknown_slackening_clamps"),
        ("speed_dependent_restitution", "unknown_round_contact"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_round_contact"), "square", "chirp")
    assert may_stand_together(("motion_blur", "unknown_long_shutter"), "triangle", "random")
