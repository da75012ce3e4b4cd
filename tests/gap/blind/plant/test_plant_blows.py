"""Friction of the wall, the direction of a blow and what it leaves behind: each cause does what its formula says."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, physics_of_run
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import impact
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    HOST,
    PLACE,
    STILL,
    TIMES,
    blows_at_rest,
    energy,
    head_on,
    leaves_no_more_energy,
    state_of,
    struck,
)

PINNED = {"impact_s": 0.08, "count": 3}  # the impact before: 20 ms ago where the time is 0.1 s
R, INERTIA = 0.01, 0.5 * 0.01**2  # m, m^2


def slid_to(share, slip, speed=1.0):
    """Slip after a blow that is held at the Coulomb limit."""
    return slip - 3.0 * np.sign(slip) * 0.15 * share * 1.7 * speed


def test_a_hard_blow_ploughs_grease_carries_and_a_chamfer_turns():
    assert head_on(BARE._replace(fading_grip=0.8), 3.0, 10.0)[1] == pytest.approx(-0.45 * 0.2 * 0.1)
    assert head_on(BARE._replace(fading_grip=0.8), 0.4, 10.0)[1] == pytest.approx(-0.45 * 0.6 * 0.1)
    slides = 4.0 - 3.0 * 0.15 * (1 - 0.4 * (1 - np.exp(-4.0 / 0.4))) * 1.7
    assert head_on(BARE._replace(greased=0.4), 1.0, 400.0)[1] == pytest.approx(slides)
    assert head_on(BARE._replace(offset_blow_m=1.5e-4))[2] == pytest.approx(-1.5e-4 * 1.7 / 5e-5)


def test_cohesion_tape_and_rolling_resistance():
    tacky = BARE._replace(cohesion_m_per_s=0.07)
    for speed, spin in ((1.0, 400.0), (0.1, 400.0), (0.1, -400.0)):  # it slides: what is lost is the limit
        lost = 3.0 * (0.15 * 1.7 * speed + 0.07)
        assert head_on(tacky, speed, spin)[1] == pytest.approx(np.sign(spin) * (4.0 - lost))
    assert head_on(tacky, 1.0, 10.0)[1] == pytest.approx(-0.045)  # it sticks as before
    taped = BARE._replace(taped=0.9, taped_rad=0.4)
    assert head_on(taped, 1.0, 10.0, angle=-0.4)[1] == pytest.approx(-0.45 * 0.1 * 0.1, abs=1e-5)
    assert head_on(taped, 1.0, 10.0, angle=np.pi - 0.4)[1] == pytest.approx(-0.045, abs=1e-5)
    rolls = BARE._replace(rolling_arm_m=2e-4, wall_friction=0.0)
    most = 2e-4 * 1.7 / 5e-5
    assert [head_on(rolls, spin=s)[2] for s in (30.0, -30.0, 5.0)] == pytest.approx([30.0 - most, most - 30.0, 0.0])
    assert head_on(rolls, 2.0, 30.0)[2] == pytest.approx(30.0 - 2.0 * most)


def test_an_impact_off_the_centre_of_mass_keeps_both_its_laws():
    """With cohesion and an arm of the normal: the normal rebounds as asked for, the tangential impulse is the limit."""
    p = BARE._replace(cohesion_m_per_s=0.07, mass_y_m=4e-4)
    state = state_of(x=0.04, y=4e-4, vx=1.0, spin=400.0)
    out, approach, _ = impact(0.1, state, p, STILL, np.zeros(2), 1.0)
    pushed = out[2:4] - state[2:4]
    assert out[2] + 4e-4 * out[5] == pytest.approx(-0.7 * approach)  # of the contact, 0.4 mm beside the mass's centre
    assert pushed[1] == pytest.approx(-(0.15 * abs(pushed[0]) + 0.07))


def test_squeezed_grease_and_a_soft_skin():
    for speed in (0.3, 1.0, 2.0):  # it slides: what is lost is the limit
        lost = 3.0 * 0.15 * (1.0 + 0.9 * (1.0 - np.exp(-speed / 0.8))) * 1.7 * speed
        assert head_on(BARE._replace(squeezed=0.9), speed, 800.0)[1] == pytest.approx(8.0 - lost)
    for spin in (3.0, -30.0):  # it sticks
        back = 0.45 / (1.0 + 1.5 * 0.01 * abs(spin) / 0.3)
        assert head_on(BARE._replace(skin=1.5), 1.0, spin)[1] == pytest.approx(-back * 0.01 * spin)


def test_a_band_hands_on_no_more_than_its_limit():
    band = BARE._replace(band_m_per_s=0.08)
    for spin in (400.0, -400.0, 90.0):  # what is lost is the band's limit, whatever the blow
        for speed in (0.6, 2.0):
            assert head_on(band, speed, spin)[1] == pytest.approx(0.01 * spin - 3.0 * np.sign(spin) * 0.08)
    assert head_on(band, 1.0, 10.0)[1] == pytest.approx(-0.045)  # it sticks as before
    assert head_on(band, 0.1, 400.0)[1] == pytest.approx(4.0 - 3.0 * 0.15 * 1.7 * 0.1)  # as does a light blow slide


def test_flash_heat_oil_that_creeps_back_and_a_rubber_ring():
    flash = BARE._replace(flash=0.6)
    for speed, spin in ((1.0, 400.0), (0.5, -300.0)):
        left = 1.0 - 0.6 * (1.0 - np.exp(-speed * abs(R * spin) / 0.3))
        slip = R * spin - 3.0 * np.sign(spin) * 0.15 * left * 1.7 * speed
        assert head_on(flash, speed, spin)[1] == pytest.approx(slip)
    oiled = BARE._replace(creeping=0.8)
    assert head_on(oiled, 1.0, 400.0)[1] == pytest.approx(4.0 - 3.0 * 0.15 * 0.2 * 1.7)  # nothing was hit before
    left = 1.0 - 0.8 * (1.0 - np.exp(-0.02 / 0.025))
    again = head_on(oiled, 1.0, 400.0, impact_s=0.08, count=3)
    assert again[1] == pytest.approx(4.0 - 3.0 * 0.15 * left * 1.7)
    ring = BARE._replace(o_ring_s_per_m=0.25, wall_friction=0.0)
    for speed, left in ((1.0, 0.75), (2.0, 0.5), (5.0, 0.0)):
        assert head_on(ring, speed, -80.0)[2] == pytest.approx(-80.0 * left)


def test_a_combed_pile_and_a_glued_rim():
    combed = BARE._replace(combed=0.7)
    for spin, last in ((400.0, 0.5), (400.0, -0.5), (-300.0, 0.2)):
        share = 1.0 - 0.7 * np.tanh(R * spin / 0.3) * np.tanh(last / 0.3)
        assert head_on(combed, 1.0, spin, slipped=last)[1] == pytest.approx(slid_to(share, R * spin))
    assert struck(combed, spin=-120.0)[PLACE.index("slipped")] == pytest.approx(-1.2)
    glued = BARE._replace(glued=0.7, glued_rad=0.4)
    for angle, more in ((-0.4, 0.7), (np.pi - 0.4, -0.7), (np.pi / 2 - 0.4, 0.0)):
        assert head_on(glued, 1.0, 400.0, angle=angle)[1] == pytest.approx(slid_to(1.0 + more, 4.0))


def test_a_ring_that_swings_carries_the_slip():
    swinging = BARE._replace(swinging_m_per_s=0.3, swinging_rad=0.6, wall_friction=5.0)
    for time in TIMES[::9]:
        surface = 0.3 * host_pose(time, HOST)[1][0] * np.cos(0.6) / 1.136
        slip = head_on(swinging, 1.0, 10.0, time, HOST)[1]
        assert slip - surface == pytest.approx(-0.45 * (0.1 - surface))


def test_a_wiped_rim_and_scales():
    for wiped in (0.5, -0.5):
        assert head_on(BARE._replace(wiped=wiped), 1.0, 400.0)[1] == pytest.approx(slid_to(1.0 + wiped, 4.0))
    draft = draft_series("unknown_wiped_rim", 1.0, np.random.default_rng(1), 7)
    runs = np.array([physics_of_run(draft, run, DRIVE, 1.2).wiped for run in range(7)])
    assert np.abs(runs) == pytest.approx(np.full(7, draft.parameters["unknown_wiped_rim"]["wiped"]))
    assert np.sum(runs > 0.0) == draft.parameters["unknown_wiped_rim"]["runs_wiped"] == 4
    scaly = BARE._replace(scaly=0.7, scaly_rad=0.4)
    for spin in (400.0, -400.0):
        share = 1.0 + 0.7 * np.tanh(R * spin / 0.3) * np.sin(0.4)
        assert head_on(scaly, 1.0, spin)[1] == pytest.approx(slid_to(share, R * spin))
    other = struck(scaly, x=-0.08, vx=-1.0, spin=400.0)  # at the wall's other side the same sense runs back
    share = 1.0 - 0.7 * np.tanh(4.0 / 0.3) * np.sin(0.4)
    assert -other[3] + R * other[5] == pytest.approx(slid_to(share, 4.0))


def test_wall_friction_that_falls_with_the_slip():
    rubbed = BARE._replace(rubbed_s_per_m=1.25)
    for spin in (400.0, -400.0, 200.0):
        slip = R * spin
        assert head_on(rubbed, 1.0, spin)[1] == pytest.approx(slid_to(1.0 / (1.0 + 1.25 * abs(slip)), slip))


@pytest.mark.further
def test_a_ragged_wall_turns_each_blow_by_its_own_angle():
    """A smooth and perfect wall mirrors the disk's velocity in the turned tangent."""
    mirror = BARE._replace(restitution=0.98, wall_friction=0.0, ragged_rad=0.05)
    for chance in (-2.0, 0.0, 1.0):
        after, turned = struck(mirror, chance=chance), 0.05 * chance
        pushed = -1.98 * np.cos(turned)
        assert after[2:4] == pytest.approx((1.0 + pushed * np.cos(turned), pushed * np.sin(turned)))
    held = impact(0.1, state_of(x=0.04, vx=0.5), mirror, STILL, np.zeros(2), 0.0)[0]
    assert held[2:4] == pytest.approx((0.0, 0.0), abs=1e-12)  # what is held lies against the mean wall
    p = BARE._replace(wall_friction=0.0, ragged_rad=0.05, restitution_scatter=0.0)
    rng = np.random.default_rng(3)
    start = np.array([0.0, 0.0, 3.0, 0.0, 0.0, 0.0])
    kicks = [run_plant(p, STILL, start, 0.02, rng).kicks[0] for _ in range(400)]  # each is of another run
    assert np.std([np.arctan2(-ky, -kx) for kx, ky in kicks]) == pytest.approx(0.05, rel=0.15)


def test_a_corner_leads_the_blow_past_the_disks_middle():
    """A smooth wall: all that the disk gets is the normal impulse, at its lever; the struck point rebounds as any."""
    smooth = BARE._replace(wall_friction=0.0, cornered_m=3e-4, corners=5.0, cornered_rad=0.2)
    for speed, angle, spin in ((1.0, 0.0, 0.0), (0.1, 0.3, 30.0), (2.0, -1.0, -60.0)):
        lever = 3e-4 * np.sin(5.0 * (-angle - 0.2))
        lever *= np.tanh(speed / 0.2)
        state = struck(smooth, angle=angle, vx=speed, spin=spin)
        pushed = state[2] - speed
        assert pushed < 0.0 and state[3] == pytest.approx(0.0, abs=1e-12)
        assert state[5] - spin == pytest.approx(-lever * pushed / INERTIA)
        assert state[2] - lever * state[5] == pytest.approx(-0.7 * (speed - lever * spin))


def test_leaning_teeth_turn_the_blow_and_give_no_energy():
    """Head-on without wall friction: the impulse is along the teeth's normal, 0.045 rad beside the wall's; with it,
    no blow leaves more energy than it finds; what is held meets the wall itself."""
    saw = BARE._replace(saw_rad=0.045)
    out = impact(0.1, state_of(x=0.04, vx=1.0), saw._replace(wall_friction=0.0), STILL, np.zeros(2), 1.0)[0]
    pushed = -1.7 * np.cos(0.045) * np.array([np.cos(0.045), np.sin(0.045)])
    assert out[2:4] == pytest.approx([1.0 + pushed[0], pushed[1]]) and out[5] == 0.0
    leaves_no_more_energy(saw)
    state = state_of(x=0.04, vx=0.3, vy=1.0)
    held = [impact(0.1, state, p, STILL, np.zeros(2), 0.0)[0] for p in (saw, BARE)]
    assert np.array_equal(*held)


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


@pytest.mark.others_further
@pytest.mark.parametrize(
    "changed",
    [
        {"flash": 0.7},
        {"creeping": 0.8},
        {"o_ring_s_per_m": 0.3},
        {"sheet": 0.14},
        {"combed": 0.8},
        {"glued": 0.9},
        {"shingled": 0.14},
        {"rattling": 0.14},
        {"cornered_m": 4e-4, "cornered_rad": 0.3},
        {"shifted": 0.14},
        {"shot": 0.14},
        {"wiped": 0.7},
        {"wiped": -0.7},
        {"scaly": 0.95},
        {"armature": 0.28},
        {"armature": 0.28, "restitution": 0.98},
        {"warmed": -0.138},
        {"oblique": 0.69},
        {"oblique": -0.69},
        {"rubbed_s_per_m": 1.8},
        {"ground": 1.1},
        {"worn_ends": 0.96},
        {"lay": 1.17},
        {"lay": -1.17, "wall_friction": 0.6},
        {"loosened": 0.41},
        {"pad": 0.9},
        {"lap_m": 9e-4},
        {"chucked_m": 3.6e-4, "chucked_rad": 0.4},
        {"seam_bead_m": 7.6e-4, "seam_bead_rad": 0.1},
    ],
)
def test_no_blow_leaves_more_energy(changed):
    leaves_no_more_energy(BARE._replace(**changed))
