"""What an experimenter supposes at such a bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

from dataclasses import replace

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.state import AFLOAT, DENTS, SECTORS
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import draw_marks, leaning, papered
from analysis.blind.recording.picture import unfocused
from analysis.blind.recording.tracker import rounded
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
    random_states,
    rate_of,
    state_of,
    struck,
)

RUNS = 9
VIEW = draw_views(np.random.default_rng(3))[0]


def _numbers(name, field, seed=2, runs=RUNS):
    """Of every run (runs,), and what the truth says."""
    draft = draft_series(name, 1.0, np.random.default_rng(seed), runs)
    return np.array([getattr(physics_of_run(draft, run, DRIVE, 1.2), field) for run in range(runs)]), draft.parameters[
        name
    ]


def test_a_line_takes_the_same_energy_of_every_crossing():
    floor = FREE._replace(crossed_m_per_s2=1.5, crossed_m=0.004, crossed_rad=0.6)
    along = np.array([np.cos(0.6), np.sin(0.6)])
    for off in (0.0, 0.004, -0.006):
        for speed in (0.8, -0.8, 0.03):
            held = 1.5 * np.exp(-0.5 * (off / 0.004) ** 2) * np.tanh(speed / 0.05)
            (x, y), (vx, vy) = (0.004 + off) * along, speed * along
            assert rate_of(floor, x=x, y=y, vx=vx, vy=vy, spin=9.0) == pytest.approx((*(-held * along), 0.0))
    lost = np.sqrt(2.0 * np.pi) * 0.004 * 1.5
    for vx in (0.6, 1.5):
        for vy in (0.0, 0.2):
            line = floor._replace(crossed_m=0.0, crossed_rad=0.0)
            start = np.array([-0.025, 0.0, vx, vy, 0.0, 0.0])
            nodes = run_plant(line, STILL, start, 0.049 / vx, np.random.default_rng(0)).nodes
            assert nodes[-1, 1] > 0.02
            assert nodes[-1, 3:5] == pytest.approx((np.sqrt(vx**2 - 2.0 * lost), vy), rel=1e-4)


def test_a_face_rubs_itself_dry():
    floor = SLIDING._replace(damp=0.5, damp_s=0.4)
    for time in (-1e-3, 0.0, 0.2, 1.1):
        share = 1.0 + 0.5 * np.exp(-max(time, 0.0) / 0.4)
        assert rate_of(floor, time, vx=0.8)[0] == pytest.approx(-G * share, rel=1e-5)
    signs = {np.sign(_numbers("unknown_damp_face", "damp", seed=seed, runs=1)[0][0]) for seed in range(8)}
    assert signs == {-1.0, 1.0}


def test_a_wet_film_draws_down_what_is_slow():
    floor = SLIDING._replace(suction=0.8)
    for speed in (0.05, 0.3, 2.0):
        assert rate_of(floor, vy=speed)[1] == pytest.approx(-G * (1.0 + 0.8 / (1.0 + speed / 0.3)), rel=1e-3)
    # It is the speed over the floor, not that in the room.
    time = TIMES[7]
    position, velocity, _ = host_pose(time, HOST)
    along = rate_of(floor, time, HOST, x=position[0], vx=velocity[0] + 0.6)[0]
    assert along == pytest.approx(-G * (1.0 + 0.8 / 3.0), rel=1e-3)


def test_a_blower_is_on_and_off():
    blower = FREE._replace(blower_m_per_s2=0.5, blower_rad=0.7, blower_rad_per_s=16.0)
    for time in np.linspace(0.0, 1.2, 25):
        swing = np.sin(16.0 * time)
        push = 0.25 * (1.0 + np.tanh(swing / 0.05))
        out = rate_of(blower, time, HOST, vx=1.0, spin=5.0)
        assert out == pytest.approx((push * np.cos(0.7), push * np.sin(0.7), 0.0))
        assert abs(swing) < 0.2 or push == pytest.approx(0.5 * (swing > 0.0), abs=1e-3)


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in ({"damp": 0.7}, {"damp": -0.7}, {"suction": 0.9}):
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, SLIDING._replace(**changed), STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] < 0.0
    line = FREE._replace(crossed_m_per_s2=2.0, crossed_m=0.003, crossed_rad=2.0)
    for time, state in zip(TIMES, random_states(), strict=True):
        rates = derivative(time, state, line, STILL, disk_friction_table())
        assert rates[2:4] @ state[2:4] <= 0.0 and rates[5] == 0.0


def test_a_sector_of_the_wall_is_greased():
    for at, inside in ((0.0, True), (0.9, True), (-0.99, True), (1.01, False), (np.pi, False), (2.0 * np.pi, True)):
        wall = BARE._replace(sector=0.6, sector_rad=at, sector_half_rad=1.0)
        out = struck(wall, vx=1.0, vy=3.0)  # a disk that slips all along
        assert out[3] == pytest.approx(3.0 - 0.15 * (0.4 if inside else 1.0) * 1.7)
    assert struck(BARE._replace(sector=1.3), vx=1.0, vy=3.0)[3] == pytest.approx(3.0 - 0.02 * 0.15 * 1.7)


def test_a_wall_is_moist_by_chance():
    shares, truth = _numbers("unknown_moist_wall", "moist")
    assert shares.mean() == pytest.approx(0.0, abs=1e-12) and shares.std() == pytest.approx(truth["moist"])
    assert len(set(np.sign(np.diff(shares)))) == 2
    alone, truth = _numbers("unknown_moist_wall", "moist", runs=1)
    assert abs(alone[0]) == pytest.approx(truth["moist"])
    for share in (0.4, -0.5):  # a disk that slips all along
        out = struck(BARE._replace(moist=share), vx=1.0, vy=3.0)
        assert out[3] == pytest.approx(3.0 - 0.15 * (1.0 + share) * 1.7)


def test_each_blow_dents_its_place():
    liner = BARE._replace(hammered=0.05)
    for blows in (0, 1, 4):
        assert head_on(liner, 1.2, dents_0=blows, dents_3=9)[0] == pytest.approx(-1.2 * (0.7 - 0.05 * blows))
    for speed, more in ((1.0, 1.0), (0.2, 0.0)):  # a touch dents nothing
        kept = struck(liner, vx=speed, dents_0=2, dents_5=1)[DENTS:AFLOAT]
        assert kept.tolist() == [2.0 + more, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]
    assert not struck(BARE, vx=1.0)[DENTS:AFLOAT].any()
    motion = run_plant(liner, HOST, np.array([0.02, 0.01, -0.6, 0.5, 0.3, 40.0]), 0.5, np.random.default_rng(0))
    counts = np.zeros(SECTORS)
    for (time, approach, _), kick, normal in zip(motion.impacts, motion.kicks, motion.normals, strict=True):
        away, sector = np.array([np.cos(normal), np.sin(normal)]), int(normal % (2.0 * np.pi) * SECTORS / 2.0 / np.pi)
        assert time > 0.0 and -kick @ away == pytest.approx(approach * (1.7 - 0.05 * counts[sector]))
        counts[sector] += approach > 0.3
    assert counts.max() >= 2


def test_screws_give_beyond_a_speed():
    ring = BARE._replace(giving_s_per_m=0.1, giving_m_per_s=1.1)
    for speed in (0.3, 1.0, 1.1, 1.5, 3.0):
        assert head_on(ring, speed)[0] == pytest.approx(-speed * (0.7 - 0.1 * max(speed - 1.1, 0.0)))


def test_a_disk_climbs_in_hard_blows():
    ring = BARE._replace(climbing=0.3, climbing_m_per_s=1.2)
    for speed in (0.3, 1.19, 1.21, 3.0):
        before, out = energy(state_of(vx=speed)), struck(ring, vx=speed)
        share = 0.7 if speed > 1.2 else 1.0
        assert energy(out) == pytest.approx(before * 0.49 * share)


def test_a_side_of_the_rim_is_chamfered():
    disk = BARE._replace(chamfer_m=4e-4, chamfer_rad=0.5)
    for angle, azimuth in ((0.0, 0.5), (2.0, 2.2), (1.0, 4.0), (-3.0, 0.0), (0.3, 2.0), (0.3, -0.4)):
        away = np.remainder(azimuth - angle - 0.5 + np.pi, 2.0 * np.pi) - np.pi
        more = 2e-4 * (np.tanh((away + 1.2) / 0.5) - np.tanh((away - 1.2) / 0.5))
        c, s = np.cos(azimuth), np.sin(azimuth)
        gap, nx, ny = wall_gap(0.1, state_of(x=0.039 * c, y=0.039 * s, angle=angle), disk, STILL)
        assert gap == pytest.approx(0.001 + more, rel=1e-3) and (nx, ny) == pytest.approx((c, s), abs=0.02)
    assert first_contacts(disk, angle=-0.5)[0] == pytest.approx([0.01 + 4e-4 * np.tanh(2.4)], abs=1e-6)
    assert first_contacts(disk, angle=np.pi - 0.5)[0] == pytest.approx([0.01], abs=1e-6)
    # A spinning disk meets the wall at a chamfer's end as fast as the gap closes.
    for angle in (0.75, -1.75):
        state = state_of(x=0.039, vx=0.6, vy=0.3, angle=angle, spin=40.0)
        early, late = state.copy(), state.copy()
        for one, passed in ((early, -1e-6), (late, 1e-6)):
            one[[0, 1, 4]] += passed * np.array([0.6, 0.3, 40.0])
        closes = (wall_gap(0.1, early, disk, STILL)[0] - wall_gap(0.1, late, disk, STILL)[0]) / 2e-6
        _, nx, ny = wall_gap(0.1, state, disk, STILL)
        assert contact_velocity(0.1, state, disk, STILL, nx, ny)[0] == pytest.approx(closes, rel=0.02)
    post = disk._replace(obstacle_m=0.018)
    assert wall_gap(0.5, state_of(x=0.02), post, STILL)[0] == pytest.approx(0.002)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"sector": 0.7, "sector_half_rad": 1.0},
        {"moist": 0.8},
        {"hammered": 0.08},
        {"giving_s_per_m": 0.1},
        {"climbing": 0.4, "climbing_m_per_s": 0.8},
        {"chamfer_m": 5e-4, "chamfer_rad": 1.0},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_markers_stand_on_a_thick_card():
    nes = np.random.default_rng(3).normal(size=(5, 3))
    off = leaning(nes, ViewErrors(raised_m=4e-4)) - nes
    assert not off[:, :2].any() and off[:, 2] == pytest.approx(np.full(5, 4e-4))
    both = leaning(nes, ViewErrors(raised_m=4e-4, card_lean_rad=0.1, card_rad=0.3))
    assert both == pytest.approx(leaning(nes, ViewErrors(card_lean_rad=0.1, card_rad=0.3)) + [0.0, 0.0, 4e-4])
    assert leaning(nes, ViewErrors()) is nes


def test_markers_scatter_off_the_middle():
    beside = np.array([[0.0, 0.0], [150.0, 0.0], [0.0, -300.0]])
    pixels = np.tile(VIEW.centre_px + beside, (4000, 1, 1))
    rng, untouched = np.random.default_rng(5), np.random.default_rng(5)
    off = unfocused(pixels, VIEW, ViewErrors(unfocused_px=0.8), rng) - pixels
    assert off.std(axis=0) == pytest.approx(np.array([[0.0, 0.0], [0.4, 0.4], [0.8, 0.8]]), rel=0.05)
    assert rng.random() == untouched.random()  # other chances are as they were
    again = unfocused(pixels, VIEW, ViewErrors(unfocused_px=0.8), rng) - pixels
    assert not np.allclose(again, off, rtol=1e-5, atol=1e-8)  # the other camera's are its own
    assert unfocused(pixels, VIEW, ViewErrors(), rng) is pixels


def test_pixels_are_rounded():
    pixels = np.random.default_rng(3).uniform(0.0, 500.0, (30, 12, 2))
    seen = rounded(pixels, ViewErrors(rounded_px=1.5))
    assert np.abs(seen - pixels).max() <= 0.75 + 1e-9 and np.std(seen - pixels) == pytest.approx(1.5 / 12**0.5, rel=0.1)
    assert seen / 1.5 == pytest.approx(np.round(seen / 1.5))
    assert rounded(pixels, ViewErrors()) is pixels


def test_paper_swells_from_run_to_run():
    marks, errors = draw_marks((0.0, 0.0), np.random.default_rng(3)), ViewErrors(paper=(-0.004, 0.0, 0.004))
    for run, share in enumerate(errors.paper):
        seen = papered(marks, run, errors)
        assert seen.host_m[:, :2] == pytest.approx(marks.host_m[:, :2] * (1.0 + share))
        assert np.array_equal(seen.host_m[:, 2], marks.host_m[:, 2]) and seen.nes_m is marks.nes_m
    assert papered(marks, 0, replace(errors, paper=())) is marks
    paper = view_of(draft_series("unknown_swelling_paper", 1.0, np.random.default_rng(2), RUNS)).paper
    assert np.diff(paper) == pytest.approx(np.full(RUNS - 1, 2.0 * paper[-1] / (RUNS - 1))) and paper[-1] > 0.0


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; a place of the rim in a ring needs one;
    what counts blows needs blows that are over."""
    needs_a_blow_that_is_over(["unknown_hammered_liner", "unknown_climbing_disk", "unknown_greased_sector"])
    needs_a_round_wall("unknown_chamfered_side")
    for listed, ours in (
        ("friction_drift", "unknown_damp_face"),
        ("table_tilt", "unknown_switched_blower"),
        ("speed_dependent_restitution", "unknown_giving_screws"),
        ("speed_dependent_restitution", "unknown_climbing_disk"),
        ("restitution_drift", "unknown_hammered_liner"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_glue_line"), "triangle", "random")
    assert may_stand_together(("finite_contact_time", "unknown_raised_card"), "square", "chirp")
