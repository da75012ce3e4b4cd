"""What is probable on a real bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.state import AFLOAT, DENTS, SECTORS
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.clock import latest_s, woken_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import draw_marks, padded, printed, slid
from analysis.blind.recording.picture import released
from analysis.blind.recording.views import DISK, HOST, draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
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
from tests.gap.blind.plant.rig import HOST as DRIVEN

RUNS = 12
VIEW = draw_views(np.random.default_rng(3))[0]


def test_a_hub_brakes_any_spin_alike():
    hub = FREE._replace(hub_rad_per_s2=60.0)
    for spin, held in ((20.0, -60.0), (90.0, -60.0), (-20.0, 60.0), (3.0, -60.0 * np.tanh(1.0)), (0.0, 0.0)):
        assert rate_of(hub, vx=0.7, vy=-0.3, spin=spin) == pytest.approx((0.0, 0.0, held), abs=1e-3)
    start = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 50.0])
    nodes = run_plant(hub, STILL, start, 0.5, np.random.default_rng(0)).nodes
    assert np.interp(0.5, nodes[:, 0], nodes[:, 6]) == pytest.approx(50.0 - 60.0 * 0.502, rel=1e-3)


def test_dust_settles_until_it_is_wiped_off():
    every_seen = set()
    for seed in range(12):
        draft = draft_series("unknown_settling_dust", 1.0, np.random.default_rng(seed), RUNS)
        truth = draft.parameters["unknown_settling_dust"]
        every = int(truth["every"])
        shares = np.array([physics_of_run(draft, run, DRIVE, 1.2).dusted for run in range(RUNS)])
        evenly = np.linspace(-truth["dusted"], truth["dusted"], every)
        assert shares == pytest.approx(np.tile(evenly, 5)[:RUNS]) and truth["dusted"] > 0.0
        every_seen.add(every)
    assert every_seen == {3, 4, 5}
    for share in (0.3, -0.25):
        assert rate_of(SLIDING._replace(dusted=share), vx=0.8)[0] == pytest.approx(-G * (1.0 + share), rel=1e-5)


def test_friction_of_a_polymer_is_a_power_of_the_speed():
    floor = SLIDING._replace(powered=0.3)
    for speed in (0.05, 0.65, 2.0):
        assert rate_of(floor, vy=speed)[1] == pytest.approx(-G * ((speed + 0.05) / 0.7) ** 0.3, rel=1e-4)
    # It is the speed over the floor, not that in the room.
    time = TIMES[7]
    position, velocity, _ = host_pose(time, DRIVEN)
    along = rate_of(floor, time, DRIVEN, x=position[0], vx=velocity[0] + 0.65)[0]
    assert along == pytest.approx(-G, rel=1e-3)


def test_a_disk_that_spins_rides_on_air():
    state = {"vx": 0.8, "vy": 0.1}
    for spin in (0.0, 40.0, -90.0, 400.0):
        plain, riding = (rate_of(SLIDING._replace(riding_s=share), spin=spin, **state) for share in (0.0, 0.004))
        assert riding == pytest.approx(plain * max(1.0 - 0.004 * abs(spin), 0.1))


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in ({"hub_rad_per_s2": 90.0}, {"dusted": 0.5}, {"powered": 0.5}, {"powered": -0.4}, {"riding_s": 0.02}):
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, SLIDING._replace(**changed), STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] < 0.0


def test_a_wall_catches_what_comes_slowly():
    wall = BARE._replace(caught=0.8, caught_m_per_s=0.6)
    for speed in (0.2, 0.59, 0.61, 2.0):
        share = 0.2 if speed < 0.6 else 1.0
        assert head_on(wall, speed)[0] == pytest.approx(-speed * 0.7 * share)
    assert head_on(wall._replace(caught=1.3), 0.4)[0] == pytest.approx(-0.4 * 0.05)


def test_a_slip_heels_the_disk_over():
    ring = BARE._replace(heeled=0.15, wall_friction=0.0)
    for approach, slip in ((1.0, 0.0), (1.0, 0.5), (2.0, -1.0), (0.5, 0.9), (0.5, 3.0)):
        out = struck(ring, vx=approach, vy=slip)
        assert out[2] == pytest.approx(-approach * (0.7 - 0.15 * min(abs(slip) / approach, 2.0)))
        assert out[3] == pytest.approx(slip)


def test_a_ring_slips_all_at_once():
    ring = BARE._replace(jerked_m=3e-4, jerked_rad=0.4, jerked_share=0.5)
    state = state_of(x=0.039)
    for time, way in ((0.1, -3e-4), (0.6, 0.0), (0.605, 3e-4 * np.tanh(1.0)), (1.1, 3e-4)):
        gap = wall_gap(time, state, ring, STILL)[0]
        middle = way * np.array([np.cos(0.4), np.sin(0.4)])
        assert gap == pytest.approx(0.04 - np.hypot(*([0.039, 0.0] - middle)))
    for time in (0.59, 0.6, 0.604):  # its speed is the rate of its place
        early, late = (wall_gap(time + passed, state, ring, STILL)[0] for passed in (-1e-6, 1e-6))
        _, nx, ny = wall_gap(time, state, ring, STILL)
        approach = contact_velocity(time, state, ring, STILL, nx, ny)[0]
        assert approach == pytest.approx((early - late) / 2e-6, rel=1e-3)
    assert first_contacts(ring)[0] == pytest.approx([0.01 - 3e-4 * np.cos(0.4)], abs=2e-6)
    draft = draft_series("unknown_jerked_ring", 1.0, np.random.default_rng(2), RUNS)
    shares = {physics_of_run(draft, run, DRIVE, 1.2).jerked_share for run in range(RUNS)}
    assert len(shares) == RUNS and min(shares) >= 0.25 and max(shares) <= 0.6


def test_blows_knead_the_clay():
    ring = BARE._replace(clay_m=1e-4)
    dents = {"dents_0": 4.0, "dents_1": 1.0, "dents_7": 2.0}
    wide = 2.0 * np.pi / SECTORS
    for azimuth, blows in (
        (0.5 * wide, 4.0),
        (1.5 * wide, 1.0),
        (wide, 2.5),
        (0.75 * wide, 4.0 - 3.0 * 0.15625),
        (0.0, 3.0),
        (-0.5 * wide, 2.0),
        (4.0 * wide, 0.0),
    ):
        c, s = np.cos(azimuth), np.sin(azimuth)
        gap, nx, ny = wall_gap(0.1, state_of(x=0.038 * c, y=0.038 * s, **dents), ring, STILL)
        assert gap == pytest.approx(0.002 + 1e-4 * blows, rel=1e-3) and (nx, ny) == pytest.approx((c, s), abs=0.02)
    # The normal is that of the wall: the gap does not change along the tangent.
    at = 1.1 * wide
    state = state_of(x=0.0399 * np.cos(at), y=0.0399 * np.sin(at), **dents)
    _, nx, ny = wall_gap(0.1, state, ring, STILL)
    sides = []
    for way in (-1e-6, 1e-6):
        moved = state.copy()
        moved[:2] += way * np.array([-ny, nx])
        sides.append(wall_gap(0.1, moved, ring, STILL)[0])
    assert abs(sides[1] - sides[0]) / 2e-6 < 2e-4
    for speed, more in ((1.0, 1.0), (0.6, 0.0)):  # a light blow kneads nothing
        kept = struck(ring, vx=speed, dents_0=2, dents_5=1, dents_7=2)[DENTS:AFLOAT]
        assert kept.tolist() == [2.0 + more, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0]
    post = ring._replace(obstacle_m=0.018)  # what strikes the cylinder leaves the wall alone
    out = impact(0.1, state_of(x=0.018, vx=-1.0), post, STILL, np.zeros(2), 1.0)[0]
    assert out[2] == pytest.approx(0.7) and not out[DENTS:AFLOAT].any()
    motion = run_plant(ring, STILL, np.array([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), 0.4, np.random.default_rng(0))
    assert len(motion.impacts) > 2
    # Along x, between two sectors: each blow goes to the first of them, and lets the next there half as far again.
    far = np.abs(np.interp(motion.impacts[:, 0], motion.nodes[:, 0], motion.nodes[:, 1]))
    assert far[0] == pytest.approx(0.04, abs=1e-7) and far[2] == pytest.approx(0.04 + 5e-5, rel=1e-3)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"caught": 0.9, "caught_m_per_s": 0.8},
        {"heeled": 0.3},
        {"clay_m": 1e-4},
        {"jerked_m": 4e-4, "jerked_rad": 2.0, "jerked_share": 0.9},
    ):
        leaves_no_more_energy(BARE._replace(**changed))
    assert energy(struck(BARE._replace(heeled=0.3), vx=1.0)) == pytest.approx(0.5 * 0.49)


def test_a_camera_swings_on_its_tripod_as_a_run_begins():
    pixels, errors = (
        np.random.default_rng(3).uniform(0.0, 500.0, (5, 12, 2)),
        ViewErrors(button_px=2.0, button_rad=0.7, button_hz=10.0),
    )
    time = np.array([-1e-3, 0.0, 0.025, 0.05, 0.9])
    off = released(pixels, time, errors) - pixels
    passed = np.maximum(time, 0.0)
    swing = 2.0 * np.exp(-passed / 0.3) * np.cos(20.0 * np.pi * passed)
    for marker in range(12):
        assert off[:, marker] == pytest.approx(swing[:, None] * [np.cos(0.7), np.sin(0.7)], abs=1e-9)
    assert released(pixels, time, ViewErrors()) is pixels


def test_a_trigger_comes_to_its_pace():
    time, errors = np.array([-1e-3, 0.0, 0.3, 1.1]), ViewErrors(waking_s=-3e-4)
    assert woken_s(time, errors) == pytest.approx(-3e-4 * np.exp(-np.maximum(time, 0.0) / 0.3), abs=1e-12)
    assert not woken_s(time, ViewErrors()).any()
    assert latest_s(errors, 1.2) == pytest.approx(latest_s(ViewErrors(), 1.2) + 3e-4)
    signs = {
        np.sign(view_of(draft_series("unknown_waking_trigger", 1.0, np.random.default_rng(k), 1)).waking_s)
        for k in range(8)
    }
    assert signs == {-1.0, 1.0}


def test_prints_are_stretched_and_scaled():
    marks = draw_marks((1e-4, 2e-4), np.random.default_rng(3))
    longer = printed(marks, ViewErrors(print_stretch=0.006))
    larger = printed(marks, ViewErrors(print_scale=-0.02))
    for seen, drawn in ((longer.host_m, marks.host_m), (longer.nes_m, marks.nes_m)):
        assert seen == pytest.approx(drawn * [1.006, 1.0, 1.0])
    assert np.array_equal(larger.host_m, marks.host_m) and larger.nes_m == pytest.approx(
        marks.nes_m * [0.98, 0.98, 1.0]
    )
    assert printed(marks, ViewErrors()) is marks


def test_markers_stay_back_on_soft_pads():
    points, errors = np.random.default_rng(3).normal(size=(len(TIMES), 12, 3)), ViewErrors(pads_m=2e-4)
    off = padded(points, TIMES, DRIVEN, errors) - points
    pull = np.array([host_pose(t, DRIVEN)[2][:2] for t in TIMES]) / 78.5
    for marker in HOST:
        assert off[:, marker, :2] == pytest.approx(-2e-4 * pull, abs=1e-12)
    others = [marker for marker in range(12) if marker not in HOST]
    assert not off[:, others].any() and not off[..., 2].any()
    assert padded(points, TIMES, DRIVEN, ViewErrors()) is points


def test_a_sticker_slides_on_its_glue():
    points, angle, time = (
        np.random.default_rng(3).normal(size=(4, 12, 3)),
        np.array([0.3, 0.3, 1.2, -2.0]),
        np.array([-1e-3, 0.0, 0.5, 1.0]),
    )
    errors = ViewErrors(sliding_m_per_s=(3e-4, -1e-4), sliding_marker=3)
    off = slid(points, angle, time, errors) - points
    c, s = np.cos(angle), np.sin(angle)
    way = np.maximum(time, 0.0)[:, None] * np.column_stack([3e-4 * c + 1e-4 * s, 3e-4 * s - 1e-4 * c])
    assert off[:, DISK[3], :2] == pytest.approx(way, abs=1e-12)
    assert not np.delete(off, DISK[3], axis=1).any() and not off[..., 2].any()
    assert slid(points, angle, time, ViewErrors()) is points


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; a place of the wall needs a round one;
    what counts blows needs blows that are over."""
    needs_a_blow_that_is_over(["unknown_clay_liner", "unknown_catching_wall", "unknown_heeling_disk"])
    needs_a_round_wall("unknown_clay_liner")
    for listed, ours in (
        ("friction_drift", "unknown_settling_dust"),
        ("speed_dependent_restitution", "unknown_catching_wall"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_jerked_ring"), "triangle", "random")
    assert may_stand_together(("finite_contact_time", "unknown_padded_markers"), "square", "chirp")
