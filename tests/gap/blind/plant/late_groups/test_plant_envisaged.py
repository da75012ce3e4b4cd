"""What is envisaged of a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import shaking_of
from analysis.blind.recording.tracker import clicked_off_px, dragged, guessed, hopped
from analysis.blind.recording.views import DISK, HOST_M
from tests.gap.blind.plant.rig import (
    BARE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    G,
    after_blow,
    energy,
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
HELD = 0.15 * 1.7  # impulse along a bare wall at 1 m/s where the disk slips


def test_grease_creeps_onto_the_floor_from_the_wall():
    grease = FREE._replace(crept_film_per_s=0.8)
    for radius, share in ((0.0, 0.0), (0.02, 0.0625), (0.04, 1.0)):
        out = rate_of(grease, x=radius * np.cos(0.6), y=radius * np.sin(0.6), vx=1.0, vy=-0.5, spin=20.0)
        assert out == pytest.approx(0.8 * share * np.array([-1.0, 0.5, -20.0]), abs=1e-12)
    # over the floor, not in the room
    moving = host_pose(0.1, HOST)
    out = rate_of(grease, 0.1, HOST, x=moving[0][0] + 0.02, vx=moving[1][0] + 1.0)
    assert out == pytest.approx((-0.05, 0.0, 0.0), abs=1e-9)


def test_a_disk_that_spins_stirs_the_air():
    for spin in (0.0, 30.0, -80.0):
        out = rate_of(FREE._replace(churned=0.01), vx=1.0, vy=-2.0, spin=spin)
        assert out == pytest.approx((-0.01 * abs(spin), 0.02 * abs(spin), 0.0), abs=1e-12)


def test_a_blow_on_the_dirty_side_leaves_dirt_under_the_disk():
    dirt = SLIDING._replace(dirty_side=0.4, dirty_rad=0.5)
    for azimuth in (0.5, 1.2, -2.6):
        out = rate_of(dirt, 0.1, vx=1.0, impact_s=0.05, count=1, azimuth=azimuth)
        assert out == pytest.approx((-G * (1.0 + 0.4 * np.cos(azimuth - 0.5)), 0.0, 0.0), rel=1e-6)
    assert rate_of(dirt, vx=1.0, azimuth=0.5)[0] == pytest.approx(-G, rel=1e-6)  # no blow before
    assert rate_of(dirt._replace(dirty_side=3.0), vx=1.0, count=1, azimuth=0.5 + np.pi)[0] == 0.0


@pytest.mark.parametrize(
    "changed", [{"crept_film_per_s": 3.0}, {"churned": 0.01}, {"floor_friction": 0.2, "dirty_side": 0.9}]
)
def test_no_flight_leaves_more_energy(changed):
    p, table = FREE._replace(**changed), disk_friction_table()
    for state in random_states():
        rate = derivative(0.1, state, p, STILL, table)
        assert state[2:4] @ rate[2:4] + 0.5e-4 * state[5] * rate[5] <= 1e-12
    nodes = run_plant(p, STILL, np.array([0.02, 0.0, 0.9, 0.3, 0.0, 40.0]), 0.1, np.random.default_rng(0)).nodes
    last = [energy(np.array([*node[1:5], 0.0, node[6]])) for node in nodes]
    assert np.diff(last).max() <= 1e-9


def test_what_needs_a_little_more_friction_sticks():
    wall = BARE._replace(static=1.0)
    for slip in (0.3, 0.8, -1.0):  # a third of the mass turns: it needs 1.45 slip / 3 of twice 0.255
        assert head_on(wall, vy=slip)[1] == pytest.approx(-0.45 * slip)
    assert struck(BARE, vy=0.8)[3] == pytest.approx(0.8 - HELD)
    for slip in (1.1, -2.0):  # what slips is held as before
        assert struck(wall, vy=slip)[3] == pytest.approx(slip - np.sign(slip) * HELD)


def test_a_rim_that_spins_fast_gives_back_less():
    rim = BARE._replace(wall_friction=5.0, limp_s=0.006)
    for spin in (0.0, 40.0, -90.0):
        slip = 0.2 + 0.01 * spin
        assert head_on(rim, vy=0.2, spin=spin)[1] == pytest.approx(-0.45 * (1.0 - 0.006 * abs(spin)) * slip)
    assert head_on(rim, spin=400.0)[1] == pytest.approx(0.0, abs=1e-12)


def test_a_wall_that_is_not_clean_holds_otherwise_at_each_blow():
    wall = BARE._replace(contaminated=0.5)
    for chance in (0.0, 1.3, -0.8):
        held = HELD * np.exp(0.5 * chance - 0.125)
        assert struck(wall, chance=chance, vy=1.9)[3] == pytest.approx(1.9 - held)
    drawn = np.random.default_rng(1).normal(size=4000)
    assert np.exp(0.5 * drawn - 0.125).mean() == pytest.approx(1.0, abs=0.02)


def test_blows_burnish_the_wall_where_they_strike():
    wall = BARE._replace(burnished=0.9)
    for blows in (0, 1, 3):
        held = HELD * (1.0 - 0.9 * (1.0 - np.exp(-blows)))
        assert struck(wall, vy=1.2, dents_0=blows, dents_3=5)[3] == pytest.approx(1.2 - held)
    assert struck(BARE._replace(burnished=2.0), vy=1.2, dents_0=9)[3] == pytest.approx(1.2 - 0.02 * HELD)
    # Each harder blow counts where it strikes, a touch does not.
    once = after_blow(0.1, state_of(x=0.04, vx=1.0, dents_0=2), wall, STILL, np.zeros(2))
    assert once[40:48].tolist() == [3.0, *[0.0] * 7]
    assert not np.any(after_blow(0.1, state_of(x=0.04, vx=0.1), wall, STILL, np.zeros(2))[40:])


def test_the_guide_rattles_the_wall_as_it_moves():
    wall = BARE._replace(dithered=0.8)
    for time in (0.1, 0.12, 0.13):
        share = 1.0 - 0.8 * abs(host_pose(time, HOST)[1][0]) / 1.136
        assert struck(wall, time, HOST, vy=1.2)[3] == pytest.approx(1.2 - HELD * share)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"static": 3.0},
        {"limp_s": 0.01},
        {"contaminated": 1.0},
        {"burnished": 0.9},
        {"dithered": 0.8},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_templates_are_clicked_anew_in_each_run():
    errors = view_of(draft_series("unknown_clicked_templates", 1.0, np.random.default_rng(2), RUNS))
    off = np.array([clicked_off_px(run, errors) for run in range(RUNS)])
    assert off.shape == (RUNS, 2, 12, 2) and len(set(off.ravel())) == off.size
    assert off.std() == pytest.approx(errors.clicked_px, rel=0.1)
    none = np.zeros((0, 2))
    seen = shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, errors).clicked_px
    assert seen is not None and np.array_equal(seen, off[4])
    assert shaking_of(np.zeros(3), STILL, np.zeros(0), none, 4, ViewErrors()).clicked_px is None


def test_two_labels_hop_and_hop_back():
    errors = view_of(draft_series("unknown_hopping_labels", 1.0, np.random.default_rng(2), RUNS))
    assert len(set(errors.hopped)) == RUNS and min(errors.hopped) >= 0.2 and max(errors.hopped) <= 0.7
    one, other = errors.hopped_markers
    assert one != other and {one, other} <= {1, 2, 3, 4} and 0.04 < errors.hopped_s < 0.06
    pixels = np.random.default_rng(3).normal(size=(400, 12, 2))
    out = hopped(pixels, 0.25, 800.0, errors)
    last = 100 + round(800.0 * errors.hopped_s)
    swapped = list(range(12))
    swapped[DISK[one]], swapped[DISK[other]] = DISK[other], DISK[one]
    assert np.array_equal(out[100:last], pixels[100:last, swapped])
    assert np.array_equal(out[:100], pixels[:100]) and np.array_equal(out[last:], pixels[last:])
    for size in (0.5, 1.2):
        longer = view_of(draft_series("unknown_hopping_labels", size, np.random.default_rng(2), RUNS))
        assert longer.hopped_s == pytest.approx(size * errors.hopped_s)


def test_a_dead_band_drags_markers_behind():
    errors, still = ViewErrors(dead_band_px=0.8), np.zeros((5, 12, 2))
    way = np.arange(5.0)[:, None, None] * np.array([1.2, -1.6])  # 2 px from frame to frame
    out = dragged(still + way, errors)
    assert out[1:] == pytest.approx((still + way)[1:] - 0.8 * np.array([0.6, -0.8]))
    shaken = still + np.array([0.0, 0.7, -0.7, 0.5, 0.0])[:, None, None] * np.array([1.0, 0.0])
    assert np.array_equal(dragged(shaken, errors), still)
    assert dragged(shaken, ViewErrors()) is shaken
    there_and_back = still + np.array([0.0, 3.0, 2.0, 1.0, 1.0])[:, None, None] * np.array([1.0, 0.0])
    assert dragged(there_and_back, errors)[:, 0, 0] == pytest.approx([0.0, 2.2, 2.2, 1.8, 1.8])


def test_a_tracker_guesses_where_the_wall_hides_a_marker():
    errors = ViewErrors(guessed=0.4)
    points = np.zeros((6, 12, 3))
    points[:, 3:7], points[:, DISK] = HOST_M - [*HOST_M[:, :2].mean(axis=0), 0.0], 0.0
    points[:, DISK[0], 0], points[:, DISK[1], 1] = 0.05, 0.0425  # at the wall, half as near as it hides
    pixels = np.zeros((6, 12, 2))
    pixels[..., 0] = np.array([0.0, 1.0, 2.0, 1.0, 0.0, -1.0])[:, None]  # turns back after the third frame
    off = guessed(pixels, points, errors)[..., 0] - pixels[..., 0]
    for marker, share in ((DISK[0], 0.4), (DISK[1], 0.2)):
        first = 2.0 * share
        second = share * 2.0 * first
        assert off[:5, marker] == pytest.approx([0.0, 0.0, 0.0, first, second])
        assert off[5, marker] == pytest.approx(share * (2.0 * second - first))
    assert not np.any(off[:, [*range(7), *DISK[2:]]]) and guessed(pixels, points, ViewErrors()) is pixels


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; laws of a blow need blows that are over;
    the wall that hides is round."""
    impacts = ("static_friction", "limp_rim", "contaminated_wall", "burnished_wall", "dithered_wall")
    needs_a_blow_that_is_over(f"unknown_{name}" for name in (*impacts, "dirty_side"))
    needs_a_round_wall("unknown_guessing_tracker")
    assert not may_stand_together(("viscous_drag", "unknown_crept_grease"), "round", "sine")
    assert may_stand_together(("air_drag", "unknown_churned_air"), "square", "chirp")
    assert may_stand_together(("motion_blur", "unknown_dead_band"), "triangle", "random")
