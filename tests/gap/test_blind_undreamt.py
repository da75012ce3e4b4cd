"""Each of the undreamt causes does what its formula says (how much it does: test_blind_groups.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, physics_of_run
from analysis.blind.causes.undreamt import UNDREAMT
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.wall.contact import impact
from analysis.blind.recording.clock import free_running_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import bent_m, draw_marks, world_points
from analysis.blind.series import outline_series, run_outline
from tests.gap.blind_rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    SLIDING,
    STILL,
    G,
    blows_at_rest,
    energy,
    first_contacts,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    needs_a_round_wall,
    rate_of,
    state_of,
    struck,
)

PINNED = {"impact_s": 0.08, "count": 3}  # the impact before: 20 ms ago where the time is 0.1 s


@pytest.mark.parametrize(
    ("changed", "state", "expected"),
    [
        # all weight on the rim: the same friction as it slides, half as much torque again as it spins, by 0.8 of it 0.4
        ({"burr": 0.8}, {"vx": 1.0}, (-G, 0.0, 0.0)),
        ({"burr": 1.0}, {"spin": 50.0}, (0.0, 0.0, -G * 0.01 / 5e-5)),
        ({"burr": 0.8}, {"spin": -50.0}, (0.0, 0.0, 1.4 * G * 0.01 * 2.0 / 3.0 / 5e-5)),
        # brushed marks along each other, across, and in between
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vx": 1.0, "angle": 0.3}, (-1.4 * G, 0.0, 0.0)),
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vy": 1.0, "angle": 0.3 + np.pi / 2}, (0.0, -0.6 * G, 0.0)),
        ({"brushed": 0.4, "brushed_rad": 0.3}, {"vy": 1.0, "angle": 0.3 - np.pi / 4}, (0.0, -G, 0.0)),
        # tossed up by a blow at 1.5 m/s 15 ms ago for 18.3 ms, then landing for as long, then as ever
        *(
            ({"toss": 0.06}, {"vx": 1.0, "impact_s": -s, "approach": 1.5}, (-load * G, 0.0, 0.0))
            for s, load in ((0.015, 0.0), (0.02, 2.0), (0.036, 2.0), (0.0375, 1.0))
        ),
        ({"toss": 0.06}, {"vx": 1.0, "impact_s": -0.015, "approach": 0.5}, (-G, 0.0, 0.0)),
    ],
)
def test_friction_by_its_formulas(changed, state, expected):
    assert rate_of(SLIDING._replace(**changed), **state) == pytest.approx(expected, abs=1e-3)


def test_a_burr_has_the_friction_of_a_circle():
    """The mean over a thousand points of a rim that slides and spins, against the plant's few."""
    burr = SLIDING._replace(burr=1.0)
    azimuth = 2.0 * np.pi * (np.arange(1000) + 0.5) / 1000
    rim = np.column_stack([np.cos(azimuth), np.sin(azimuth)])
    for spin in (10.0, 60.0, 250.0):
        slip = [0.8, 0.3] + 0.01 * spin * np.column_stack([-rim[:, 1], rim[:, 0]])
        slip /= np.hypot(*slip.T)[:, None]
        force, torque = slip.mean(axis=0), np.mean(rim[:, 0] * slip[:, 1] - rim[:, 1] * slip[:, 0])
        got = rate_of(burr, vx=0.8, vy=0.3, spin=spin)
        assert got[:2] == pytest.approx(-G * force, abs=0.01 * G)
        assert got[2] == pytest.approx(-G * torque * 0.01 / 5e-5, abs=0.01 * G * 0.01 / 5e-5)


def test_a_tossed_disk_loses_no_friction_but_has_it_later():
    """From a blow at 0.9 m/s on, 30 ms later it is as fast as any other, and 3.2 mm farther on."""
    start = np.array([0.031, 0.0, 0.9, 0.0, 0.0, 0.0])
    paths = []
    for toss in (0.0, 0.06):
        p = SLIDING._replace(restitution=0.8, toss=toss, wall_friction=0.0)
        motion = run_plant(p, STILL, start, 0.06, np.random.default_rng(0))
        late, approach, _ = motion.impacts[0]
        paths.append(state_at(motion, np.array([late + 0.03]))[0])
    up_s = 2.0 * 0.06 * approach / 9.81
    assert paths[1][2] == pytest.approx(paths[0][2], abs=2e-3)  # a step of the integrator's at either edge
    assert paths[0][0] - paths[1][0] == pytest.approx(G * up_s**2, abs=2e-5)


@pytest.mark.parametrize("time", [0.0, 0.02, 0.03])
def test_what_goes_with_the_host(time):
    """The load on an arc is the second rate of half its curvature times x squared; a field turns with the Host's
    acceleration; air that goes with the Host brakes and carries."""
    phase = DRIVE * time + 2.0
    x, v, a = 0.0164 * np.sin(phase), 0.0164 * DRIVE * np.cos(phase), -0.0164 * DRIVE**2 * np.sin(phase)
    h = 1e-4
    heights = 0.5 * 2.8 * (0.0164 * np.sin(DRIVE * (time + h * np.array([-1.0, 0.0, 1.0])) + 2.0)) ** 2
    load = 9.81 + np.diff(heights, 2)[0] / h**2
    got = rate_of(SLIDING._replace(arc_per_m=2.8), time, HOST, x=x, vx=v, vy=1.0)
    assert got == pytest.approx((0.0, -0.3 * load, 0.0), abs=1e-3)
    field = FREE._replace(alternating_rad_per_s2=400.0, alternating_rad=0.4)
    expected = (0.0, 0.0, 400.0 * a / 78.5 * np.sin(0.4 - 1.1))
    assert rate_of(field, time, HOST, angle=1.1) == pytest.approx(expected, abs=1e-9)
    air = FREE._replace(enclosed_per_m=0.4)
    assert rate_of(air, time, HOST) == pytest.approx((0.4 * v * abs(v), 0.0, 0.0), abs=1e-9)
    assert rate_of(air, time, HOST, vx=v, vy=-1.5) == pytest.approx((0.0, 0.4 * 1.5**2, 0.0), abs=1e-9)


def test_an_arc_is_seen_from_the_side():
    """The Host's height, and the disk's upon it, is half of the curvature times its x squared."""
    outline = outline_series("unknown_leaf_springs", 1.0, np.random.default_rng(4), 1, "white")
    (poses,) = run_outline(outline, np.random.default_rng(5), 8.0).poses
    arc = outline.draft.plant["arc_per_m"]
    for seen in poses:
        assert seen.host[:, 3] == pytest.approx(0.5 * arc * seen.host[:, 0] ** 2, abs=1e-12)
        assert np.array_equal(seen.nes[:, 2], seen.host[:, 3])
    assert 2e-4 < np.abs(poses[0].host[:, 3]).max() < 6e-4


def test_a_mat_pulls_back_to_where_the_disk_was():
    """At a steady speed the print stays behind by speed times its time; it starts below the disk."""
    mat = FREE._replace(mat_per_s2=20.0)
    assert rate_of(mat, x=0.02, y=-0.01, print_x=0.015) == pytest.approx((-0.1, 0.2, 0.0))
    light = FREE._replace(mat_per_s2=1e-6)
    motion = run_plant(light, STILL, np.array([-0.03, 0.0, 0.5, 0.0, 0.0, 0.0]), 0.1, np.random.default_rng(0))
    late = 0.08
    lost = 0.5 - state_at(motion, np.array([late - 2e-3]))[0, 2]
    behind = 0.5 * 0.04 * (late - 0.04 * (1.0 - np.exp(-late / 0.04)))  # the integral of what it stays behind
    assert lost == pytest.approx(1e-6 * behind, rel=1e-3)


def test_impacts_by_their_formulas():
    tired = BARE._replace(tired=0.07)
    assert head_on(tired)[0] == pytest.approx(-0.7)  # nothing was hit before
    loss = 0.07 * 1.5 * np.exp(-0.02 / 0.12)
    assert head_on(tired, tired=1.5, **PINNED)[0] == pytest.approx(-0.7 + loss)
    after = struck(tired, vx=2.0, tired=1.5, **PINNED)
    assert after[15:17] == pytest.approx([2.0, 1.5 * np.exp(-0.02 / 0.12) + 4.0])
    band = BARE._replace(band_m_per_s=0.08)
    for spin in (400.0, -400.0, 90.0):  # what is lost is the band's limit, whatever the blow
        for speed in (0.6, 2.0):
            assert head_on(band, speed, spin)[1] == pytest.approx(0.01 * spin - 3.0 * np.sign(spin) * 0.08)
    assert head_on(band, 1.0, 10.0)[1] == pytest.approx(-0.045)  # it sticks as before
    assert head_on(band, 0.1, 400.0)[1] == pytest.approx(4.0 - 3.0 * 0.15 * 1.7 * 0.1)  # as does a light blow slide


def test_a_leaning_wall_presses_the_rim_onto_the_floor():
    """Head-on without wall friction the floor takes its share of the rebound; a rim that slides along the wall loses it
    from its slip, at a third of the mass, and never turns round."""
    leans = BARE._replace(leaning=0.25, floor_friction=0.3, wall_friction=0.0)
    share = 0.25 * 0.3 * 1.7
    assert head_on(leans)[0] == pytest.approx(-0.7 + share)
    along = head_on(leans._replace(restitution=0.05), 1.0, 5e4)  # so fast that the rebound does not turn the slip
    assert along[1] == pytest.approx(500.0 - 3.0 * 0.25 * 0.3 * 1.05, abs=1e-3)
    assert abs(head_on(leans, 1.0, 1.0)[1]) < 0.01
    for time, state in blows_at_rest():
        pressed, plain = (
            impact(time, state, p, STILL, np.zeros(2), 1.0)[0] for p in (leans, leans._replace(leaning=0.0))
        )
        assert energy(pressed) <= energy(plain)
    state = state_of(x=0.04, vx=0.3, vy=1.0)
    held = [impact(0.1, state, p, STILL, np.zeros(2), 0.0)[0] for p in (leans, leans._replace(leaning=0.0))]
    assert np.array_equal(*held)


def test_a_sleeve_takes_momentum_and_carries_the_next_blow():
    """The disk's and the sleeve's momentum along the wall is kept, their slip comes back; what the sleeve has left of
    its speed is where the next blow's slip begins; a cylinder in the ring has no sleeve."""
    sleeve = BARE._replace(sleeve=0.8, wall_friction=0.9)
    out = struck(sleeve, vy=0.5)
    assert out[3] + out[17] / 0.8 == pytest.approx(0.5)
    assert out[3] + 0.01 * out[5] - out[17] == pytest.approx(-0.45 * 0.5)
    left = 0.2 * np.exp(-0.02 / 0.06)
    carried = struck(sleeve, sleeve=0.2, **PINNED)  # a blow without slip against the Host
    assert carried[3] + 0.01 * carried[5] - carried[17] == pytest.approx(0.45 * left)
    assert carried[3] + (carried[17] - left) / 0.8 == pytest.approx(0.0)
    inner = state_of(x=0.018, vx=-1.0, vy=0.5, sleeve=0.2, **PINNED)
    hit = [
        impact(0.1, inner, p._replace(obstacle_m=0.018), STILL, np.zeros(2), 1.0)[0]
        for p in (sleeve, sleeve._replace(sleeve=0.0))
    ]
    assert np.array_equal(hit[0][:6], hit[1][:6]) and hit[0][17] == pytest.approx(left)


def test_a_mount_gives_along_its_line_only():
    """Without wall friction, head-on: along the mount's line the ring takes its part of the speed, across it none; and
    no blow leaves more energy than one against a ring that stands."""
    gives = BARE._replace(mount=0.12, wall_friction=0.0)
    assert head_on(gives)[0] == pytest.approx(1.0 - 1.7 / 1.12)
    assert head_on(gives._replace(mount_rad=np.pi / 2))[0] == pytest.approx(-0.7)
    assert head_on(gives._replace(mount_rad=np.pi / 4))[0] == pytest.approx(1.0 - 1.7 / 1.06)
    leaves_no_more_energy(BARE._replace(mount=0.12, mount_rad=0.9))


def test_walls_stop_the_disk_where_their_formulas_say():
    """Head-on along x: the disk's middle gets to the told place."""
    refitted = BARE._replace(refit_x_m=3e-4, refit_y_m=-2e-4)
    assert first_contacts(refitted)[0][0] == pytest.approx(0.01 + 3e-4 + np.sqrt(0.04**2 - 2e-4**2) - 0.04, abs=1e-9)
    # where a rim's middle lies 0.4 mm from the disk's, 0.5 rad beside the contact
    tyre = BARE._replace(tyre_m=4e-4, tyre_rad=-0.2)
    reach = np.sqrt(0.04**2 - (4e-4 * np.sin(0.5)) ** 2) - 4e-4 * np.cos(0.5)
    assert first_contacts(tyre)[0][0] == pytest.approx(reach - 0.03, abs=1e-9)


@pytest.mark.parametrize(("runs", "before"), [(12, 6), (3, 2)])
def test_a_ring_is_refitted_once(runs, before):
    """From one side of its seat to the opposite one, 0.7 mm away, and it stays there."""
    draft = draft_series("unknown_refitted_ring", 1.0, np.random.default_rng(1), runs)
    places = [physics_of_run(draft, run, DRIVE, 1.2) for run in range(runs)]
    at = np.array([(p.refit_x_m, p.refit_y_m) for p in places])
    assert 0.85 * 7e-4 < np.hypot(*(at[0] - at[-1])) < 1.15 * 7e-4 and np.array_equal(at[0], -at[-1])
    assert np.all(at[:before] == at[0]) and np.all(at[before:] == at[-1])


def test_a_spinning_tyre_drives_the_disk_off():
    """At rest but for its spin, the contact's normal speed is the spin times the lever of the rim's middle."""
    tyre = BARE._replace(tyre_m=4e-4, tyre_rad=np.pi / 2)
    state = state_of(x=np.sqrt(0.04**2 - 4e-4**2), spin=-30.0)
    assert impact(0.0, state, tyre, STILL, np.zeros(2), 1.0)[1] == pytest.approx(30.0 * 4e-4, rel=1e-3)


def test_a_clock_of_its_own_gains_evenly():
    time = np.array([0.1, 0.4, 0.9])
    late = free_running_s(time, ViewErrors(free_running=1.2e-3))
    assert late == pytest.approx([-4.8e-4, -1.2e-4, 4.8e-4], abs=1e-12)
    assert np.all(free_running_s(time, ViewErrors()) == 0.0)


def test_a_tab_bends_back_and_leaves_the_other_markers():
    time, errors = np.array([0.0, 0.01, 0.033]), ViewErrors(tab_m=5e-4, tab_marker=2)
    pull = -0.0164 * DRIVE**2 * np.sin(DRIVE * time + 2.0) / 78.5
    bent = bent_m(time, HOST, errors)
    assert bent == pytest.approx(np.column_stack([-5e-4 * pull, np.zeros(3)]), abs=1e-12)
    marks, poses = draw_marks((0.0, 0.0), np.random.default_rng(1)), np.zeros((3, 4))
    moved = world_points(poses, poses, marks, errors, bent) - world_points(poses, poses, marks, ViewErrors())
    assert np.flatnonzero(np.abs(moved).max(axis=(0, 2))).tolist() == [5]  # G1 to G3, H1, H2, H3
    assert moved[:, 5, :2] == pytest.approx(bent, abs=1e-12)


def test_what_may_stand_together():
    """A sleeve needs a round wall, what remembers a blow one that does not last, no blow has two laws; and a
    small band is one that sits tight."""
    needs_a_round_wall("unknown_turning_sleeve")
    needs_a_blow_that_is_over(["unknown_tossed_disk", *(cause.name for cause in UNDREAMT if cause.stage == "impact")])
    tight, loose = (
        draft_series("unknown_slipping_band", size, np.random.default_rng(1), 1).plant["band_m_per_s"]
        for size in (0.3, 1.2)
    )
    assert tight == pytest.approx(2.0 * loose)
