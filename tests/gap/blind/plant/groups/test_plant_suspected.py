"""What an experimenter suspects first: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import CAUSES, draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.clock import latest_s, of_the_second_camera
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import draw_marks, world_points
from analysis.blind.recording.picture import Shaking, by_the_first_camera
from analysis.blind.recording.views import draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    TIMES,
    G,
    energy,
    first_contacts,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    of_group,
    rate_of,
    state_of,
    struck,
)

R = 0.01  # m


def test_a_floor_leans_by_the_hosts_place_on_its_guide():
    bent = FREE._replace(guide_per_s2=25.0, guide_rad=2.0)
    for time in TIMES[::13]:
        push = 25.0 * host_pose(time, HOST)[0][0] * np.array([np.cos(2.0), np.sin(2.0)])
        assert rate_of(bent, time, HOST, vx=0.5, spin=20.0) == pytest.approx((*push, 0.0), abs=1e-9)


def test_a_magnet_draws_more_the_nearer_and_nothing_in_the_middle():
    for side in (1.0, -1.0):
        magnet = FREE._replace(magnet_m_per_s2=0.4 * side)
        for x in (0.0, 0.03, -0.05):
            push = 0.4 * side * ((0.15 / (0.15 - side * x)) ** 4 - 1.0)
            assert rate_of(magnet, 0.1, HOST, x=x, y=0.01) == pytest.approx((push, 0.0, 0.0), abs=1e-9)


def test_air_brakes_the_spin_with_its_square():
    stirred = FREE._replace(stirred=2e-3)
    for spin in (0.0, 50.0, -200.0):
        assert rate_of(stirred, vx=1.0, spin=spin) == pytest.approx((0.0, 0.0, -2e-3 * spin * abs(spin)), abs=1e-9)


def test_a_lane_through_the_middle_is_polished():
    lane = SLIDING._replace(lane=0.6, lane_rad=0.3)
    for along, across in ((0.0, 0.0), (0.03, 0.0), (-0.02, 0.008), (0.01, -0.02)):
        x, y = along * np.cos(0.3) - across * np.sin(0.3), along * np.sin(0.3) + across * np.cos(0.3)
        left = 1.0 - 0.6 * np.exp(-0.5 * (across / 0.01) ** 2)
        assert rate_of(lane, x=x, y=y, vx=1.0)[0] == pytest.approx(-G * left)


def test_dust_that_a_blow_has_knocked_loose_is_left_behind():
    dusty = SLIDING._replace(debris_s_per_m=0.5)
    assert rate_of(dusty, vx=1.0, approach=1.5)[0] == pytest.approx(-G)  # before any blow
    for slid in (0.0, 0.03, 0.2):
        more = 1.0 + 0.5 * 1.5 * np.exp(-slid / 0.03)
        got = rate_of(dusty, vx=1.0, approach=1.5, count=2, way=0.7 + slid, way_before=0.7)[0]
        assert got == pytest.approx(-G * more)


def test_a_floor_is_cleaned_once_and_a_wall_fouled_from_run_to_run():
    for seed in range(5):
        draft = draft_series("unknown_cleaned_floor", 1.0, np.random.default_rng(seed), 6)
        runs = np.array([physics_of_run(draft, run, DRIVE, 1.2).cleaned for run in range(6)])
        first = int(draft.parameters["unknown_cleaned_floor"]["from_run"]) - 1
        assert 2 <= first <= 4 and 0.85 * 0.17 < runs[-1] < 1.15 * 0.17
        assert runs == pytest.approx(runs[-1] * np.where(np.arange(6) < first, -1.0, 1.0))
    assert rate_of(SLIDING._replace(cleaned=0.2), vx=1.0)[0] == pytest.approx(-1.2 * G)
    draft = draft_series("unknown_fouled_wall", 1.0, np.random.default_rng(1), 5)
    fouled = np.array([physics_of_run(draft, run, DRIVE, 1.2).fouled for run in range(5)])
    assert fouled == pytest.approx(fouled[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 0.5 < fouled[-1] < 1.15 * 0.5


def _wall_friction(p, speed=1.0, spin=600.0):
    """The wall's friction in a blow that is held at the Coulomb limit."""
    return (0.01 * spin - head_on(p, speed, spin)[1]) / (3.0 * 1.7 * speed)


def test_friction_of_a_fouled_wall_and_of_a_disk_that_skims():
    assert _wall_friction(BARE._replace(fouled=-0.4)) == pytest.approx(0.15 * 0.6)
    skims = BARE._replace(skimmed=0.8)
    for speed, spin in ((1.0, 600.0), (1.0, -200.0), (2.0, 300.0)):
        ratio = 0.01 * abs(spin) / speed
        left = 0.15 * (1.0 - 0.8 * ratio**2 / (ratio**2 + 0.25))
        assert abs(_wall_friction(skims, speed, spin)) == pytest.approx(left)


def test_a_rim_that_yields_loses_more_in_hard_blows():
    plastic = BARE._replace(plastic=0.9)
    for speed, root in ((0.9, 1.0), (2.0, 0.45**0.25), (0.45, 2.0**0.25), (0.05, 1.3)):  # no more in the lightest
        assert head_on(plastic, speed)[0] == pytest.approx(-0.7 * (1.0 + 0.9 * (root - 1.0)) * speed)
    assert head_on(plastic._replace(plastic=3.0), 0.05)[0] == pytest.approx(-0.98 * 0.05)  # no wall gives back all


def test_four_bolts_stiffen_the_ring():
    for off in (0.0, 0.2, -0.5):
        for bolt in range(4):
            bolts = BARE._replace(bolts=0.15, bolts_rad=off + bolt * 0.5 * np.pi)
            assert -head_on(bolts)[0] == pytest.approx(0.7 + 0.15 * np.exp(-0.5 * (off / 0.3) ** 2))
    between = BARE._replace(bolts=0.15, bolts_rad=0.25 * np.pi)
    assert -head_on(between)[0] == pytest.approx(0.7 + 0.15 * np.exp(-0.5 * (0.25 * np.pi / 0.3) ** 2))


def test_a_liner_comes_back_less_where_it_is_loose():
    for off in (0.0, 1.4, np.pi):
        liner = BARE._replace(liner_grip=0.8, liner_grip_rad=off)
        back = 0.45 * (1.0 + 0.8 * np.tanh(np.cos(off) / 0.3))
        assert head_on(liner, spin=25.0)[1] == pytest.approx(-back * 0.25)
    loosest = BARE._replace(liner_grip=1.3, liner_grip_rad=np.pi)
    assert head_on(loosest, spin=25.0)[1] == pytest.approx(0.0, abs=1e-12)  # sticks, and no more
    tightest = BARE._replace(liner_grip=1.3)
    assert head_on(tightest, spin=25.0)[1] == pytest.approx(-0.95 * 0.25)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"plastic": 1.0},
        {"bolts": 0.2},
        {"skimmed": 1.0},
        {"liner_grip": 1.3},
        {"pockets_m": 5e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))
    assert energy(struck(BARE._replace(fouled=0.7), spin=60.0)) < energy(state_of(vx=1.0, spin=60.0))


def test_pockets_at_both_ends_of_the_drive():
    worn = BARE._replace(pockets_m=5e-4)
    assert first_contacts(worn)[0][0] == pytest.approx(R + 5e-4, abs=2e-7)
    for azimuth, deep in ((0.0, 1.0), (np.pi, 1.0), (0.4, np.exp(-0.5)), (np.pi - 0.4, np.exp(-0.5)), (1.5, 9e-4)):
        state = state_of(x=0.04 * np.cos(azimuth), y=0.04 * np.sin(azimuth))
        assert wall_gap(0.0, state, worn, STILL)[0] == pytest.approx(5e-4 * deep, abs=2e-6)
    for azimuth in np.arange(0.05, 6.2, 0.37):  # the normal is that of the curve that the gap tells
        c, s = np.cos(azimuth), np.sin(azimuth)
        _, nx, ny = wall_gap(0.0, state_of(x=0.04 * c, y=0.04 * s), worn, STILL)
        beside = [azimuth - 1e-4, azimuth + 1e-4]
        gap = [wall_gap(0.0, state_of(x=0.04 * np.cos(a), y=0.04 * np.sin(a)), worn, STILL)[0] for a in beside]
        slope = (gap[1] - gap[0]) / 2e-4 / 0.04
        assert (ny * c - nx * s) / (nx * c + ny * s) == pytest.approx(-slope, abs=2e-3)


def test_a_ring_on_one_screw_stays_back_along_one_line():
    hinged, line = BARE._replace(hinged_m=5e-4, hinged_rad=0.6), np.array([np.cos(0.6), np.sin(0.6)])
    for time in TIMES[::13]:
        position, velocity, pull = host_pose(time, HOST)
        off = -5e-4 * (pull[0] * line[0]) / 78.5 * line
        jerk = (host_pose(time + 1e-6, HOST)[2][0] - host_pose(time - 1e-6, HOST)[2][0]) / 2e-6
        moves = -5e-4 * (jerk * line[0]) / 78.5 * line
        for azimuth in (0.0, 0.6, 2.3):
            out = np.array([np.cos(azimuth), np.sin(azimuth)])
            x, y = position[:2] + 0.04 * out
            gap, nx, ny = wall_gap(time, state_of(x=x, y=y), hinged, HOST)
            assert gap == pytest.approx(off @ out, abs=5e-6)
            met = contact_velocity(time, state_of(x=x, y=y, vx=velocity[0] + 1.0), hinged, HOST, nx, ny)
            assert met[0] == pytest.approx(nx - moves @ [nx, ny], abs=1e-6)


def test_a_program_starts_the_second_camera():
    errors = view_of(draft_series("unknown_program_start", 1.0, np.random.default_rng(3), 5))
    most = max(errors.started_s)
    assert 0.85 * 0.95e-4 < most < 1.15 * 0.95e-4
    assert sorted(errors.started_s) == pytest.approx(most * np.linspace(-1.0, 1.0, 5), abs=1e-12)
    none = np.zeros(0), np.zeros((0, 2))
    for run in range(5):
        late = of_the_second_camera(TIMES, HOST, *none, run, 800.0, errors) - TIMES
        assert late == pytest.approx(np.full(60, errors.started_s[run]), abs=1e-12)
    assert latest_s(errors, 1.2) == pytest.approx(most)


def test_a_card_leans_in_the_disk():
    marks, pose = draw_marks((0.0, 0.0), np.random.default_rng(1)), np.array([[0.0, 0.0, 0.0, 0.0]])
    errors = ViewErrors(card_lean_rad=0.06, card_rad=0.5 * np.pi)
    for angle in (0.0, 2.0):
        turned = pose + [0.0, 0.0, 0.0, angle]
        leans = world_points(turned, pose, marks, errors) - world_points(turned, pose, marks, ViewErrors())
        assert leans[0, 7:, 2] == pytest.approx(0.06 * marks.nes_m[:, 1])
        assert not leans[0, :7].any() and not leans[..., :2].any()


def test_a_lens_focused_anew():
    view = draw_views(np.random.default_rng(1))[0]
    pixels = view.centre_px + np.array([[[300.0, 0.0], [0.0, -150.0], [180.0, 240.0]]])
    seen = by_the_first_camera(pixels.copy(), np.zeros(1), view, Shaking(), ViewErrors(refocused_px=2.0))
    assert seen[0] - pixels[0] == pytest.approx(np.array([[2.0, 0.0], [0.0, -0.25], [1.2, 1.6]]))


def test_what_they_stand_beside():
    """Pockets are of a round ring, what goes by the last blow needs one that is over, one law does not stand twice."""
    needs_a_round_wall("unknown_worn_pockets")
    impacts = [cause.name for cause in of_group("suspected") if cause.stage == "impact"]
    needs_a_blow_that_is_over(["unknown_knocked_dust", *impacts])
    for listed, ours in (
        ("friction_drift", "unknown_cleaned_floor"),
        ("speed_dependent_restitution", "unknown_plastic_rim"),
    ):
        assert CAUSES[listed].listed and not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("finite_contact_time", "unknown_polished_lane"), "square", "chirp")
