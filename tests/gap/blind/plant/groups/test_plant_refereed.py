"""What a referee would ask about: each cause does what its formula says (how much it does: test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.light import bloomed
from analysis.blind.recording.picture import Shaking, by_the_first_camera, by_the_second_camera
from analysis.blind.recording.views import DISK, View, draw_views
from analysis.blind.recording.views import HOST as HOST_MARKERS
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
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    of_group,
    rate_of,
    state_of,
    struck,
)

R, WALL, MASS = 0.01, 0.05, 0.0246  # m, m, kg: the disk, the ring
INERTIA = 0.5 * MASS * R**2


def test_a_sail_takes_the_air_across_it_only():
    sail = FREE._replace(sail_per_m=0.4, sail_rad=0.5)
    for angle in (0.0, 0.9, 4.0):
        out = np.array([np.cos(angle + 0.5), np.sin(angle + 0.5)])
        for way in (out, -2.0 * out):
            push = -0.4 * np.hypot(*way) * way  # all of it, against its way
            assert rate_of(sail, vx=way[0], vy=way[1], angle=angle) == pytest.approx((*push, 0.0))
        assert rate_of(sail, vx=-out[1], vy=out[0], angle=angle, spin=30.0) == pytest.approx(np.zeros(3), abs=1e-12)
        askew = rate_of(sail, vx=out[0] - 3.0 * out[1], vy=out[1] + 3.0 * out[0], angle=angle)
        assert askew == pytest.approx((*(-0.4 * out), 0.0))


def test_a_kinked_sheet_slopes_either_way_from_a_line():
    """Its push is the slope of a roof whose height it tells."""
    kinked, out = FREE._replace(kink_m_per_s2=0.5, kink_m=0.008, kink_rad=1.2), np.array([np.cos(1.2), np.sin(1.2)])

    def height(x, y):
        return -0.5 * 0.006 * np.log(np.cosh((np.array([x, y]) @ out - 0.008) / 0.006))

    for x, y in ((0.0, 0.0), (0.02, 0.01), (0.004, 0.006), (-0.03, 0.02)):
        slope = [(height(x + 1e-7, y) - height(x - 1e-7, y)) / 2e-7, (height(x, y + 1e-7) - height(x, y - 1e-7)) / 2e-7]
        assert rate_of(kinked, x=x, y=y) == pytest.approx((-slope[0], -slope[1], 0.0), abs=1e-6)
    for off, side in ((0.025, 1.0), (-0.025, -1.0)):
        x, y = (0.008 + off) * out
        assert rate_of(kinked, x=x, y=y)[:2] == pytest.approx(0.5 * side * out, abs=1e-3)


def test_a_sheet_domes_from_run_to_run():
    draft = draft_series("unknown_doming_sheet", 1.0, np.random.default_rng(2), 5)
    runs = [physics_of_run(draft, run, DRIVE, 1.2).doming_per_s2 for run in range(5)]
    assert runs == pytest.approx(runs[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 15.0 < abs(runs[-1]) < 1.15 * 15.0
    for time in TIMES[::13]:
        x, y = host_pose(time, HOST)[0][:2] + [0.02, -0.01]
        got = rate_of(FREE._replace(doming_per_s2=12.0), time, HOST, x=x, y=y, vx=0.3)
        assert got == pytest.approx((0.24, -0.12, 0.0), abs=1e-12)


def test_scales_of_a_faced_floor_lie_all_one_way_round():
    faced = SLIDING._replace(faced=0.4)
    for azimuth in (0.0, 2.0, 4.5):
        for radius in (0.01, 0.035):
            out = np.array([np.cos(azimuth), np.sin(azimuth)])
            around = np.array([-out[1], out[0]])
            for way, share in ((around, 1.0), (-around, -1.0), (out, 0.0), ((out + around) / np.sqrt(2.0), 0.5**0.5)):
                got = rate_of(faced, x=radius * out[0], y=radius * out[1], vx=way[0], vy=way[1])[:2]
                assert got == pytest.approx(-G * (1.0 + 0.4 * share * radius / (radius + 0.003)) * way, abs=1e-5)
    assert rate_of(faced, vx=1.0)[0] == pytest.approx(-G)


def test_a_spot_dries_in_the_course_of_a_run():
    spot = SLIDING._replace(drying=0.8, drying_x_m=0.01, drying_y_m=-0.005, drying_s=0.6)
    for time, wet in ((-1e-3, 1.0), (0.0, 1.0), (0.6, np.exp(-1.0)), (1.2, np.exp(-2.0))):
        for far in (0.0, 0.016, 0.03):
            left = 1.0 - 0.8 * wet * np.exp(-0.5 * (far / 0.016) ** 2)
            got = rate_of(spot, time, x=0.01 + far * np.cos(0.7), y=-0.005 + far * np.sin(0.7), vx=1.0)[0]
            assert got == pytest.approx(-G * left)
    assert rate_of(spot._replace(drying=1.4), x=0.01, y=-0.005, vx=1.0)[0] == pytest.approx(0.0)  # no floor pushes


def test_ribs_hold_a_floor_in_three_directions():
    ribs = SLIDING._replace(ribs=0.5, ribs_rad=0.4)
    assert rate_of(ribs, vx=1.0)[0] == pytest.approx(-G)
    around = np.arange(12) * np.pi / 6.0
    for radius in (0.02, 0.04):
        places = [(radius * np.cos(0.4 + a), radius * np.sin(0.4 + a)) for a in around]
        got = np.array([-rate_of(ribs, x=x, y=y, vx=1.0)[0] / G for x, y in places])
        assert got[::4] == pytest.approx(np.full(3, 1.0 + 0.5 * radius / 0.04))  # over the ribs
        assert got[2::4] == pytest.approx(np.full(3, 1.0 - 0.5 * radius / 0.04))  # half-way between them
        assert got.mean() == pytest.approx(1.0)


def test_dust_that_a_disk_has_swept_together_cushions_its_blow():
    swept = BARE._replace(swept=0.2)
    for slid in (0.0, 0.04, 0.5):
        got = head_on(swept, 1.3, way=0.9 + slid, way_before=0.9, count=2)[0]
        assert got == pytest.approx(-1.3 * (0.7 - 0.2 * (1.0 - np.exp(-slid / 0.04))))


def test_spin_draws_oil_onto_the_rim():
    oiled = BARE._replace(flung_oil=0.8)
    for speed, spin in ((0.1, 60.0), (0.2, 150.0), (0.1, -60.0)):  # beyond the Coulomb limit
        left = 1.0 - 0.8 * spin**2 / (spin**2 + 1600.0)
        lost = R * spin - head_on(oiled, speed, spin)[1]
        assert lost == pytest.approx(np.sign(spin) * 3.0 * 0.15 * left * 1.7 * speed)
    assert head_on(oiled, vy=0.9) == pytest.approx(head_on(BARE, vy=0.9))  # slips, but does not spin


def _with_a_ring(p, state, after):
    """What a ring on its screw takes of a blow at azimuth 0, and how the contact then moves: its spin (rad/s), the
    disk's velocity against it (normal, tangential) and both energies (J)."""
    mass = MASS / p.pivoted
    turning = 2.0 * mass * WALL**2
    contact = np.array([WALL, 0.0])
    from_screw = contact - WALL * np.array([np.cos(p.pivoted_rad), np.sin(p.pivoted_rad)])
    push = MASS * (after[2:4] - state[2:4])  # on the disk; the ring takes the opposite one
    spin = -(from_screw[0] * push[1] - from_screw[1] * push[0]) / turning
    rim = after[2:4] + after[5] * np.array([0.0, R])
    against = rim - spin * np.array([-from_screw[1], from_screw[0]])
    return against, push, MASS * energy(after) + 0.5 * turning * spin**2


@pytest.mark.parametrize("screw", [0.3, 1.6, -1.2, 2.9])
def test_a_blow_turns_a_ring_about_its_screw(screw):
    """Momentum, angular momentum, restitution and friction of two bodies, of which the plant tells one."""
    p = BARE._replace(pivoted=0.3, pivoted_rad=screw, wall_friction=5.0)
    for vy, spin in ((0.0, 0.0), (0.3, 0.0), (-0.2, 40.0)):
        state, after = state_of(x=0.04, vx=1.0, vy=vy, spin=spin), struck(p, vy=vy, spin=spin)
        against, push, left = _with_a_ring(p, state, after)
        assert against == pytest.approx((-0.7, -0.45 * (vy + R * spin)), abs=1e-12)
        assert INERTIA * (after[5] - spin) == pytest.approx(R * push[1], abs=1e-15)
        assert left <= MASS * energy(state)
    slips = p._replace(wall_friction=0.1)
    state, after = state_of(x=0.04, vx=1.0, spin=300.0), struck(slips, spin=300.0)
    against, push, left = _with_a_ring(slips, state, after)
    assert against[0] == pytest.approx(-0.7) and against[1] > 0.0
    assert push[1] == pytest.approx(0.1 * push[0]) and left < MASS * energy(state)


def test_a_ring_gives_nothing_to_a_blow_at_its_screw_nor_to_one_on_a_cylinder():
    p = BARE._replace(pivoted=0.5, pivoted_rad=0.0)
    assert head_on(p, vy=0.2, spin=10.0) == pytest.approx(head_on(BARE, vy=0.2, spin=10.0))
    askew = p._replace(pivoted_rad=1.5, obstacle_m=0.018)
    meets = state_of(x=0.018, vx=-1.0, spin=20.0)
    got, plain = (impact(0.1, meets, q, STILL, np.zeros(2), 1.0)[0] for q in (askew, BARE._replace(obstacle_m=0.018)))
    assert np.array_equal(got, plain) and got[2] > 0.0


def test_a_soft_lining_bulges_before_the_disk():
    """A blow without friction is along the normal of the bulge, and takes 1.7 of the approach along it."""
    soft = BARE._replace(piled_rad=0.08, wall_friction=0.0)
    for vy, spin in ((0.5, 0.0), (-0.5, 0.0), (0.0, 60.0), (0.2, -90.0)):
        leans = 0.08 * np.tanh((vy + R * spin) / 0.4)
        normal = np.array([np.cos(leans), np.sin(leans)])
        after = struck(soft, vy=vy, spin=spin)
        kick = after[2:4] - [1.0, vy]
        assert kick == pytest.approx(-1.7 * (np.array([1.0, vy]) @ normal) * normal, abs=1e-9)
        assert after[5] == pytest.approx(spin)
        assert kick[1] * (vy + R * spin) < 0.0  # against the slip
    assert np.array_equal(struck(soft), struck(BARE._replace(wall_friction=0.0)))
    held = state_of(x=0.04, vx=0.01, vy=0.5)
    got, plain = (impact(0.1, held, q, STILL, np.zeros(2), 0.0)[0] for q in (BARE._replace(piled_rad=0.08), BARE))
    assert np.array_equal(got, plain)


def test_a_gel_comes_back_from_the_last_blow():
    gel = BARE._replace(gel=0.9)
    for since in (0.005, 0.08, 0.3):
        back = 0.45 * (1.0 - 0.9 * np.exp(-since / 0.08))
        assert head_on(gel, spin=25.0, impact_s=0.1 - since, count=3)[1] == pytest.approx(-back * 0.25)
    assert head_on(gel, spin=25.0)[1] == pytest.approx(-0.45 * 0.25, rel=1e-5)  # none before
    assert head_on(gel._replace(gel=1.3), spin=25.0, impact_s=0.099)[1] == pytest.approx(0.0, abs=1e-12)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"swept": 0.2},
        {"flung_oil": 1.0},
        {"pivoted": 0.3, "pivoted_rad": 1.4},
        {"piled_rad": 0.09},
        {"gel": 1.3},
        {"relaxing_m": 6e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_spin_throws_a_tyre_to_its_heavy_side():
    tyre = BARE._replace(thrown_m=4e-4, thrown_rad=0.5)
    for spin, share in ((0.0, 0.0), (40.0, 0.5), (-40.0, 0.5), (120.0, 0.9)):
        for angle, azimuth in ((0.3, 0.0), (2.0, 4.0)):
            state = state_of(x=0.04 * np.cos(azimuth), y=0.04 * np.sin(azimuth), angle=angle, spin=spin)
            off = 4e-4 * share * np.array([np.cos(angle + 0.5), np.sin(angle + 0.5)])
            reached = np.hypot(*(state[:2] + off))
            assert wall_gap(0.0, state, tyre, STILL)[0] == pytest.approx(0.04 - reached, abs=1e-12)
    for angle in (0.0, 1.5, 4.0):  # a blow that stops the spin, or brings it, leaves the disk in the ring
        for spin in (0.0, 60.0):
            after = struck(tyre, vy=0.8, angle=angle, spin=spin)
            assert wall_gap(0.1, after, tyre, STILL)[0] > -1e-9


def test_a_ring_relaxes_in_its_seat():
    ring = BARE._replace(relaxing_m=4e-4, relaxing_rad=0.7)
    for time, course in ((0.0, -1.0), (0.6, 0.0), (0.9, 0.5), (1.2, 1.0)):
        for azimuth in np.arange(0.05, 6.2, 0.37):
            c, s = np.cos(azimuth), np.sin(azimuth)
            gap, nx, ny = wall_gap(time, state_of(x=0.04 * c, y=0.04 * s), ring, STILL)
            assert gap == pytest.approx(4e-4 * course * np.cos(2.0 * (azimuth - 0.7)), abs=2e-6)
            slope = -8e-4 * course * np.sin(2.0 * (azimuth - 0.7)) / 0.04
            assert (nx * s - ny * c) / (nx * c + ny * s) == pytest.approx(slope, abs=1e-3)
            met = contact_velocity(time, state_of(x=0.04 * c, y=0.04 * s, vx=0.5), ring, STILL, nx, ny)
            moves = 8e-4 / 1.2 * np.cos(2.0 * (azimuth - 0.7))
            assert met[0] == pytest.approx(0.5 * nx - moves, abs=1e-5)
    cylinder = ring._replace(obstacle_m=0.018)  # which does not move
    met = contact_velocity(0.3, state_of(x=0.018, vx=-1.0), cylinder, STILL, -1.0, 0.0)
    assert met[0] == pytest.approx(1.0, abs=1e-12)


def test_a_knocked_lens_bends_as_opencvs_tangential_terms():
    """At one focal length the decentring is p1 and p2 of a camera that the calibration takes for straight."""
    drawn = draw_views(np.random.default_rng(1))[0]

    def pixels(*tangential):
        view = View(
            "VW1",
            np.full(2, 6000.0),
            drawn.centre_px,
            np.array([0.0, 0.0, *tangential, 0.0]),
            drawn.rotation,
            drawn.translation_m,
            drawn.window_offset_px,
        )
        points = np.random.default_rng(2).uniform(-0.06, 0.06, (4, 12, 3)) * [1.0, 1.0, 0.0]
        return view, view.pixels(points)

    errors = ViewErrors(knocked_px=0.8, knocked_rad=0.6)
    view, plain = pixels(0.0, 0.0)
    seen = by_the_first_camera(plain.copy(), np.zeros(4), view, Shaking(), errors)
    bent = pixels(*(0.8 * 6000.0 / 300.0**2 * np.array([np.sin(0.6), np.cos(0.6)])))[1]
    assert np.hypot(*(seen - plain).T).max() > 0.5 and seen == pytest.approx(bent, abs=1e-9)


def test_an_arm_gives_within_a_run():
    view = draw_views(np.random.default_rng(1))[1]
    away = np.random.default_rng(2).normal(0.0, 200.0, (5, 12, 2))
    seen = by_the_second_camera(view.centre_px + away, view, ViewErrors(sagging_rad=5e-3)) - view.centre_px
    for frame, share in enumerate((-1.0, -0.5, 0.0, 0.5, 1.0)):
        c, s = np.cos(5e-3 * share), np.sin(5e-3 * share)
        assert seen[frame] == pytest.approx(away[frame] @ np.array([[c, s], [-s, c]]), abs=1e-9)
    turns = [
        view_of(draft_series("unknown_sagging_arm", 1.0, np.random.default_rng(seed), 3)).sagging_rad
        for seed in range(8)
    ]
    assert min(turns) < 0.0 < max(turns)


def test_bright_markers_bloom():
    pixels = np.random.default_rng(1).uniform(0.0, 1e6, (3, 12, 2))  # none near another
    h, n = HOST_MARKERS[2], DISK[1]
    for far in (5.0, 45.0, 90.0):
        pixels[1, n] = pixels[1, h] + far * np.array([0.6, 0.8])
        off = bloomed(pixels, ViewErrors(bloom_px=2.0)) - pixels
        pull = 2.0 * far / 45.0 * np.exp(0.5 - 0.5 * (far / 45.0) ** 2)
        assert off[1, n] == pytest.approx(-pull * np.array([0.6, 0.8]), abs=1e-6)
        off[1, n] = 0.0
        assert not off.any()


def test_what_they_stand_beside():
    """Two are of a round ring, what goes by the last blow or jumps with the spin needs blows that are over."""
    for name in ("unknown_pivoted_ring", "unknown_relaxing_ring"):
        needs_a_round_wall(name)
    impacts = [cause.name for cause in of_group("refereed") if cause.stage == "impact"]
    needs_a_blow_that_is_over(["unknown_thrown_tyre", *impacts])
    assert may_stand_together(("finite_contact_time", "unknown_kinked_sheet"), "square", "chirp")
    assert may_stand_together(("wall_ellipticity", "unknown_relaxing_ring"), "cylinder", "random")
