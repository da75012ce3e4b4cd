"""What the experimenters of neighbouring fields would swear by: each cause does what its formula says (how much it
does: test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import may_stand_together
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.clock import latest_s, looped_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.picture import followed, read_out
from analysis.blind.recording.views import DISK, draw_views
from tests.gap.blind.plant.rig import (
    BARE,
    FREE,
    HOST,
    PLACE,
    SLIDING,
    STILL,
    TIMES,
    G,
    first_contacts,
    head_on,
    leaves_no_more_energy,
    needs_a_blow_that_is_over,
    of_group,
    random_states,
    rate_of,
    state_of,
    struck,
)

R = 0.01  # m: the disk


def test_a_nap_leads_a_disk_that_spins_aside_and_to_the_other_side_on_its_way_back():
    for share in (0.4, -0.4):
        cloth = SLIDING._replace(swerve=share, swerve_rad=0.7)
        for way in (0.0, 0.7, 2.0, 3.8):
            for speed, spin in ((1.0, 60.0), (0.5, -90.0), (1.2, 0.0)):
                along = speed * np.array([np.cos(way), np.sin(way)])
                got, plain = (rate_of(p, vx=along[0], vy=along[1], spin=spin) for p in (cloth, SLIDING))
                side = -G * 2.0 * share * np.cos(way - 0.7) * R * spin * speed / (speed**2 + (R * spin) ** 2)
                assert got - plain == pytest.approx((-side * np.sin(way), side * np.cos(way), 0.0), abs=1e-5)
    assert rate_of(cloth, spin=50.0) == pytest.approx(rate_of(SLIDING, spin=50.0))


def _rates(p, **numbers):
    """Of all that a state has, by name."""
    return dict(zip(PLACE, derivative(0.0, state_of(**numbers), p, STILL, disk_friction_table()), strict=True))


@pytest.mark.further
def test_beads_of_wax_hold_a_disk_that_goes_another_way_until_they_have_turned():
    wax = SLIDING._replace(beads=0.8)
    for turned in (0.0, 1.0, 2.5, np.pi):
        for size in (0.0, 0.6, 1.0):
            bead = size * np.array([np.cos(turned), np.sin(turned)])
            rates = _rates(wax, vx=0.7, bead_x=bead[0], bead_y=bead[1])
            assert rates["vx"] == pytest.approx(-G * (1.0 + 0.4 * (1.0 - bead[0])), rel=1e-5)
            assert [rates["bead_x"], rates["bead_y"]] == pytest.approx((0.7 * np.array([1.0, 0.0]) - 0.7 * bead) / 0.03)
    # On thirty millimetres they turn by two thirds, whatever the speed.
    for speed in (0.5, 2.0):
        bead, step = np.array([-1.0, 0.0]), 1e-5
        for _ in range(round(0.03 / speed / step)):
            rates = _rates(wax, vx=speed, bead_x=bead[0], bead_y=bead[1])
            bead = bead + step * np.array([rates["bead_x"], rates["bead_y"]])
        assert bead == pytest.approx((1.0 - 2.0 * np.exp(-1.0), 0.0), abs=1e-3)


def test_a_disk_runs_easily_where_the_flight_before_has_cleared_its_path():
    frost = SLIDING._replace(path=0.6)
    there, here = np.array([0.038, 0.01]), np.array([-0.02, 0.034])
    known = {"there_x": there[0], "there_y": there[1], "here_x": here[0], "here_y": here[1]}
    along = (here - there) / np.hypot(*(here - there))
    across = np.array([-along[1], along[0]])
    for passed in (0.0, 0.3, 1.0):
        for off in (0.0, 0.007, -0.02):
            x, y = there + passed * (here - there) + off * across
            left = 1.0 - 0.6 * np.exp(-0.5 * (off / 0.01) ** 2)
            assert rate_of(frost, x=x, y=y, vx=1.0, count=2, **known)[0] == pytest.approx(-G * left)
    x, y = here + 0.01 * along  # beyond its end
    assert rate_of(frost, x=x, y=y, vx=1.0, count=5, **known)[0] == pytest.approx(-G * (1.0 - 0.6 * np.exp(-0.5)))
    assert rate_of(frost, x=x, y=y, vx=1.0, count=1, **known)[0] == pytest.approx(-G)  # before there was one
    # A blow ends one flight and begins the next, from the Host's centre.
    position = host_pose(0.1, HOST)[0]
    after = struck(FREE, 0.1, HOST, here_x=0.02, here_y=-0.03)
    assert after[33:37] == pytest.approx([0.04, 0.0, 0.02, -0.03])
    assert abs(position[0]) > 1e-3


def test_debris_gathers_and_breaks_off_each_time_the_disk_has_gone_as_far():
    face = SLIDING._replace(clogged=0.4, clogged_m=0.2, clogged_share=0.3)
    for way, share in ((0.0, 0.3), (0.1, 0.8), (0.139, 0.995), (0.141, 0.005), (0.341, 0.005), (0.94, 0.0)):
        held = rate_of(face, vx=1.0, way=way + 1e-9)[0]
        assert held == pytest.approx(-G * (1.0 + 0.4 * (2.0 * share - 1.0)), rel=1e-5)
    mean = np.mean([rate_of(face, vx=1.0, way=way)[0] for way in np.linspace(0.0, 0.6, 600, endpoint=False)])
    assert mean == pytest.approx(-G, rel=1e-2)


def test_a_blow_leaves_the_disk_standing_on_its_edge_for_a_while():
    coin = SLIDING._replace(edged=0.8)
    for normal, late, approach in ((0.4, 0.0, 1.0), (2.0, 0.02, 0.3), (-1.0, 0.1, 2.0)):
        share = 0.8 * approach / (approach + 0.5) * np.exp(-late / 0.04)
        known = {"count": 3, "approach": approach, "normal": normal, "impact_s": 0.5 - late}
        for way in (0.0, 1.3, 4.0):
            along = np.array([np.cos(way), np.sin(way)])
            got = rate_of(coin, 0.5, vx=along[0], vy=along[1], **known)
            # What does not spin is held as a whole, and turned by what stands on one side of it.
            turn = -share * G * R * np.sin(way - normal) / (0.5 * R**2)
            assert got == pytest.approx((*(-G * along), turn), rel=1e-5, abs=1e-6)
        # A spin on the spot is held by the edge's whole lever, and goes off to one side.
        spun = rate_of(coin, 0.5, spin=50.0, **known)
        flat = rate_of(SLIDING, spin=50.0)
        assert spun[2] == pytest.approx((1.0 - share) * flat[2] - share * G * R / (0.5 * R**2), rel=1e-5)
        assert spun[:2] == pytest.approx(share * G * np.array([np.sin(normal), -np.cos(normal)]), rel=1e-5)
    assert rate_of(coin, vx=1.0) == pytest.approx(rate_of(SLIDING, vx=1.0))  # before any


def test_a_plate_that_vibrates_drives_the_disk_to_its_nodal_circles():
    plate = FREE._replace(nodal_m_per_s2=1.2, nodal_m=0.009)
    for time in TIMES[::7]:
        position, velocity, acceleration = host_pose(time, HOST)
        shaken = (acceleration[0] / 78.5) ** 2
        for radius, azimuth in ((0.004, 0.3), (0.014, 2.0), (0.026, 4.4), (0.039, 5.5)):
            out = np.array([np.cos(azimuth), np.sin(azimuth)])
            at = {"x": position[0] + radius * out[0], "y": radius * out[1], "vx": velocity[0]}
            push = -1.2 * shaken * np.sin(2.0 * np.pi * (radius - 0.009) / 0.02) * radius / (radius + 0.003)
            assert rate_of(plate, time, HOST, **at) == pytest.approx((*(push * out), 0.0), abs=1e-12)
    assert rate_of(plate, x=0.014) == pytest.approx(np.zeros(3))  # at rest it has none


def test_a_disk_hunts_by_the_way_and_does_no_work_on_it():
    feet = FREE._replace(hunting_m_per_s2=0.8)
    for slid in (0.0, 0.01, 0.02, 0.05):
        for way in (np.array([1.0, 0.5]), np.array([-0.2, 0.1]), np.array([0.0, 2.0])):
            push = 0.8 * np.sin(2.0 * np.pi * slid / 0.045) / np.hypot(*way)
            got = rate_of(feet, vx=way[0], vy=way[1], way=0.3 + slid, way_before=0.3, spin=30.0)
            assert got == pytest.approx((-push * way[1], push * way[0], 0.0), rel=1e-5, abs=1e-9)
    motion = run_plant(feet, STILL, np.array([-0.03, 0.0, 0.8, 0.0, 0.0, 0.0]), 0.06, np.random.default_rng(0))
    speed = np.hypot(motion.nodes[:, 3], motion.nodes[:, 4])
    assert len(motion.impacts) == 0 and speed == pytest.approx(np.full(len(speed), 0.8), rel=1e-6)


def test_no_flight_gains_energy_of_a_floor_at_rest():
    """Whatever the disk remembers, friction takes of its energy."""
    for changed in ({"swerve": 0.6}, {"beads": 1.1}, {"path": 0.9}, {"clogged": 0.5}, {"edged": 1.1}):
        p = SLIDING._replace(**changed)
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, p, STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * R**2 * rates[5] * state[5] < 0.0


def _rebound(p, azimuth=0.0, **numbers):
    """Restitution of a blow straight at the wall."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    state = state_of(x=0.04 * c, y=0.04 * s, vx=c, vy=s, **numbers)
    after = impact(0.1, state, p, STILL, np.zeros(2), 1.0)[0]
    return -(after[2] * c + after[3] * s)


def test_the_high_sides_of_wall_and_washer_mesh():
    mesh = BARE._replace(meshed=0.2, meshed_wall_rad=0.9, meshed_rim_rad=-0.4)
    for azimuth, angle in ((0.9, 1.3), (0.9 + np.pi, 1.3), (2.0, 0.4), (5.0, -3.0), (1.0, 7.0)):
        won = 0.2 * np.cos(azimuth - 0.9) * np.cos(azimuth - angle + 0.4)
        assert _rebound(mesh, azimuth, angle=angle) == pytest.approx(0.7 + won)
    assert _rebound(mesh._replace(meshed=0.9), 0.9, angle=1.3) == pytest.approx(0.98)  # none gives back all


def test_a_cushion_takes_running_side_otherwise_than_check_side():
    def lost(p, along, spin):
        """Slip that a light blow takes, over its normal impulse."""
        slip = along + R * spin
        return (slip - head_on(p, 0.1, spin, vy=along)[1]) / (1.7 * 0.1 * np.sign(slip))

    for share in (0.7, -0.5):
        cushion = BARE._replace(side=share)
        for along, spin in ((0.5, 60.0), (0.9, -40.0), (-0.5, -120.0), (-1.5, 30.0), (1.0, 0.0), (0.0, 90.0)):
            together = 2.0 * along * R * spin / (along**2 + (R * spin) ** 2)
            assert lost(cushion, along, spin) == pytest.approx(3.0 * 0.15 * (1.0 + share * together))
    assert lost(BARE._replace(side=-1.5), 0.5, 50.0) == pytest.approx(3.0 * 0.15 * 0.02)
    stuck = BARE._replace(side=0.7)
    assert head_on(stuck, 1.0, 1.0, vy=0.01) == pytest.approx(head_on(BARE, 1.0, 1.0, vy=0.01))  # where it sticks


def test_a_ring_hums_along_one_line():
    hum = BARE._replace(hum_m_per_s=0.12, hum_rad_per_s=1500.0, hum_phase_rad=0.6, hum_rad=0.4)
    for time in TIMES[::5]:
        moves = 0.12 * np.sin(1500.0 * time + 0.6) * np.tanh(1.0 / 0.2)
        out = head_on(hum, 1.0, time=time)
        # In the ring's own frame it comes back with its restitution, and so does its slip, where it sticks.
        assert out[0] - moves * np.cos(0.4) == pytest.approx(-0.7 * (1.0 - moves * np.cos(0.4)))
        assert out[1] - moves * np.sin(0.4) == pytest.approx(0.45 * moves * np.sin(0.4))
        # Nor is a slow one missed: it meets the wall on its way.
        slow = state_of(x=0.04, vx=1e-4)
        assert impact(time, slow, hum._replace(hum_m_per_s=0.17), STILL, np.zeros(2), 1.0)[1] > 0.0
    held = state_of(x=0.04, vx=0.5)
    with_it, without = (impact(0.1, held, p, STILL, np.zeros(2), 0.0)[0] for p in (hum, BARE))
    assert np.array_equal(with_it, without)  # what is held only lies there


def test_dampers_behind_a_liner_stiffen_it_as_they_are_pressed_onto_it():
    liner = BARE._replace(preload=1.3)
    for time in TIMES[::4]:
        pressed = 1.0 + 1.3 * host_pose(time, HOST)[2][0] / 78.5
        back = np.clip(0.45 * pressed, 0.0, 0.95)
        assert head_on(liner, 1.5, 20.0, time, HOST)[1] == pytest.approx(-back * 0.2, abs=1e-9)
    assert head_on(liner, 1.5, 20.0)[1] == pytest.approx(-0.45 * 0.2)  # at rest they hang
    assert head_on(liner, 0.1, 90.0, 0.05, HOST) == pytest.approx(head_on(BARE, 0.1, 90.0, 0.05, HOST))  # it slips


@pytest.mark.further
def test_a_loose_end_of_tape_is_wound_up_and_shed():
    tape = BARE._replace(spool_m=3e-4, spool_rad=2.0)
    for turned in (0.0, 20.0, -30.0, 300.0):
        more = 3e-4 * np.tanh(turned / 25.0)
        for azimuth in (0.3, 2.9, 5.0):
            at = {"x": 0.039 * np.cos(azimuth), "y": 0.039 * np.sin(azimuth), "angle": 2.0 + turned}
            gap, nx, ny = wall_gap(0.1, state_of(**at), tape, STILL)
            assert gap == pytest.approx(0.001 - more) and (nx, ny) == pytest.approx((np.cos(azimuth), np.sin(azimuth)))
        assert first_contacts(tape, angle=2.0 + turned)[0] == pytest.approx([0.01 - more], abs=1e-6)
        # A disk that spins meets the wall with the rate at which it winds.
        winds = 3e-4 * (1.0 - np.tanh(turned / 25.0) ** 2) * 60.0 / 25.0
        at = state_of(x=0.04, vx=0.5, spin=60.0, angle=2.0 + turned)
        assert contact_velocity(0.1, at, tape, STILL, 1.0, 0.0)[0] == pytest.approx(0.5 + winds)


def test_a_disk_planes_after_a_blow_that_leaves_it_fast():
    puck = BARE._replace(planing_m=3e-4)
    for left in (0.4, 0.9, 2.0):
        more = 3e-4 * (left**2 - 0.81) / (left**2 + 0.81)
        assert wall_gap(0.1, state_of(x=0.039, left=left), puck, STILL)[0] == pytest.approx(0.001 - more)
    assert wall_gap(0.1, state_of(x=0.039), puck, STILL)[0] == pytest.approx(0.001)  # before any it lies
    for speed, along, left in ((2.5, 0.3, 0.0), (0.3, 0.1, 2.0), (1.5, 1.0, 0.2)):
        after = struck(puck, 0.1, HOST, vx=speed, vy=along, left=left)
        moves = host_pose(0.1, HOST)[1][:2]
        assert after[37] == pytest.approx(np.hypot(*(after[2:4] - moves)))
        assert wall_gap(0.1, after, puck, HOST)[0] >= -1e-9  # it is put back as it now lies


@pytest.mark.further
def test_no_blow_leaves_more_energy():
    for changed in (
        {"meshed": 0.3, "meshed_wall_rad": 1.0, "meshed_rim_rad": 2.0},
        {"side": 1.2},
        {"side": -1.2},
        {"preload": 2.0},
        {"planing_m": 4e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_loop_pulls_the_second_cameras_clock_in():
    errors, time_s = ViewErrors(loop_s=-4e-4, loop_hz=3.0), np.linspace(-2e-3, 1.2, 500)
    late = looped_s(time_s, errors)
    passed = np.maximum(time_s, 0.0)
    assert late == pytest.approx(-4e-4 * np.exp(-passed / 0.4) * np.cos(6.0 * np.pi * passed), abs=1e-12)
    assert np.abs(late).max() <= latest_s(errors, 1.2) and not looped_s(time_s, ViewErrors()).any()


def test_a_steadied_picture_goes_after_the_disk():
    errors, view = ViewErrors(followed=0.005), draw_views(np.random.default_rng(1))[0]
    pixels = np.random.default_rng(2).uniform(500.0, 2500.0, (6, 12, 2))
    off = followed(pixels, view, errors) - pixels
    assert off == pytest.approx(np.repeat(off[:, :1], 12, axis=1))  # all markers alike, the floor's, too
    assert off[:, 0] == pytest.approx(-0.005 * (pixels[:, DISK].mean(axis=1) - view.centre_px))
    assert np.array_equal(followed(pixels, view, ViewErrors()), pixels)


def test_frames_have_the_even_rows_and_the_odd_ones_in_turn():
    errors, view = ViewErrors(interlaced_px=0.6), draw_views(np.random.default_rng(1))[0]
    pixels = np.random.default_rng(2).uniform(500.0, 2500.0, (5, 12, 2))
    off = read_out(pixels.copy(), view, 800.0, errors) - pixels
    assert np.array_equal(off[..., 0], np.zeros((5, 12)))
    assert off[..., 1] == pytest.approx(0.6 * np.array([1.0, -1.0, 1.0, -1.0, 1.0])[:, None] * np.ones((5, 12)))


def test_what_they_stand_beside():
    """What goes by the last blow needs one that is over, and no disk is tipped twice."""
    impacts = [cause.name for cause in of_group("borrowed") if cause.stage == "impact"]
    needs_a_blow_that_is_over(["unknown_cleared_path", "unknown_edge_stand", "unknown_planing_disk", *impacts])
    assert may_stand_together(("finite_contact_time", "unknown_wax_beads"), "square", "chirp")
    assert may_stand_together(("wall_centre_offset", "unknown_wound_tape"), "triangle", "random")
    assert not may_stand_together(("nes_rocking", "unknown_edge_stand"), "round", "sine")
