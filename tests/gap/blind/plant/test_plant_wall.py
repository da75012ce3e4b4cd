"""The wall's and the disk's shape, and where the wall lies: each cause does what its formula says."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, physics_of_run
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import impact, wall_gap
from analysis.blind.plant.wall.shape import split_reach
from tests.gap.blind.plant.rig import BARE, DRIVE, HOST, STILL, TIMES, first_contacts, state_of, struck

R = 0.01


def test_a_chip_a_turning_liner_and_one_on_springs():
    """Head-on along x: the disk's middle gets to the returned place, at the returned time."""

    def stopped(p, host=STILL):
        return first_contacts(p, host)[0][0]

    assert stopped(BARE._replace(chip_m=7e-4, chip_rad=-0.7)) == pytest.approx(0.0107, abs=1e-9)
    turning = BARE._replace(liner=0.005, liner_rad=0.3, liner_rad_per_s=2.0)
    late = stopped(turning)
    assert late == pytest.approx(0.01 + 0.04 * 0.005 * np.cos(2 * (0.3 + 2.0 * (late - 2e-3))), abs=1e-9)
    springy = BARE._replace(springy_m=4e-4)
    late = stopped(springy, HOST)
    swing = DRIVE * (late - 2e-3) + 2.0
    host = 0.0164 * (np.sin(swing) - np.sin(2.0 - DRIVE * 2e-3))
    shift = 4e-4 * 0.0164 * DRIVE**2 * np.sin(swing) / 78.5
    assert late == pytest.approx(0.01 + host + shift, abs=1e-9)


def test_a_chips_flank_strikes_as_the_disk_turns():
    """At rest but for its spin, the disk's middle is driven off as fast as its reach falls."""
    chipped = BARE._replace(chip_m=7e-4, chip_rad=0.2)
    falls = np.diff([7e-4 * np.exp(-0.5 * ((turn + 0.2) / 0.35) ** 2) for turn in (1e-5, -1e-5)])[0] / 2e-5
    for spin, expected in ((30.0, 30.0 * falls), (-30.0, 0.0)):  # the chip leaves the wall, or comes to it
        state = state_of(x=0.0407, spin=spin)  # where the wall stops it, but for the flank's slope
        assert impact(0.0, state, chipped, STILL, np.zeros(2), 1.0)[1] == pytest.approx(expected, rel=1e-3)


def test_a_springy_liners_speed_is_part_of_the_blow():
    state = state_of(x=0.06, vx=1.0)
    springy = BARE._replace(springy_m=4e-4)
    hard, soft = (impact(0.05, state, p, HOST, np.zeros(2), 1.0)[1] for p in (BARE, springy))
    liner = 4e-4 / 78.5 * 0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0)
    assert hard - soft == pytest.approx(liner, abs=1e-6)


def test_a_strips_joint_and_a_loose_ring():
    """Head-on along x: the disk's middle gets to the returned place."""

    def stopped(p):
        return first_contacts(p, angle=0.0, duration_s=0.2)[0][:2]

    for joint in (0.05, -0.05, 2.0):
        reach = 6e-4 * (-0.5 * np.tanh(joint / 0.08) + joint / (2 * np.pi))
        assert stopped(BARE._replace(joint_m=6e-4, joint_rad=joint))[0] == pytest.approx(0.01 + reach, abs=1e-9)
    # the first blow finds the ring in the middle and pushes it 0.25 mm on; the second, at the other side, meets it so
    first, second = stopped(BARE._replace(loose_ring_m=2.5e-4))
    assert first == pytest.approx(0.01, abs=1e-9)
    assert second == pytest.approx(0.01 + (0.08 - 2.5e-4) / 0.7, abs=1e-9)


@pytest.mark.further
def test_a_pushed_ring_never_comes_back_upon_the_disk():
    """Whatever the direction of the blow before, the gap after a blow is not negative."""
    rng = np.random.default_rng(1)
    loose = BARE._replace(loose_ring_m=2.5e-4)
    for azimuth, last in rng.uniform(0.0, 2.0 * np.pi, (20, 2)):
        out = np.array([np.cos(azimuth), np.sin(azimuth)])
        ring = 2.5e-4 * np.array([np.cos(last), np.sin(last)])
        x, y = ring + 0.04 * out
        state = state_of(x=x, y=y, vx=out[0], vy=out[1], count=1, normal=last)
        assert wall_gap(0.0, state, loose, STILL)[0] == pytest.approx(0.0, abs=1e-12)
        after = impact(0.0, state, loose, STILL, np.zeros(2), 1.0)[0]
        assert wall_gap(0.0, after, loose, STILL)[0] > -1e-12
        assert after[14] == pytest.approx(np.arctan2(out[1], out[0]))


def test_a_ring_that_slips_and_one_that_is_squashed():
    """Head-on along x: the disk's middle gets to the returned place, at the returned time."""
    (late,), (approach,), _ = first_contacts(BARE._replace(slipping_m=3.5e-4, slipping_rad=0.4))
    way = 3.5e-4 * (2.0 * (late - 2e-3) / 1.2 - 1.0)
    x = way * np.cos(0.4) + np.sqrt(0.04**2 - (way * np.sin(0.4)) ** 2)
    assert late == pytest.approx(x - 0.03, abs=1e-9)
    assert approach == pytest.approx(
        1.0 - 7e-4 / 1.2 * np.cos(0.4), abs=1e-5
    )  # the wall's own speed; normal 3 mrad off
    (late, *_), _, _ = first_contacts(BARE._replace(squash_m=3.5e-4, squash_rad=0.5), HOST)
    swing = DRIVE * (late - 2e-3) + 2.0
    host = 0.0164 * (np.sin(swing) - np.sin(2.0 - DRIVE * 2e-3))
    start = -0.0164 * DRIVE**2 * np.sin(swing) * np.cos(0.5) / 78.5
    assert late == pytest.approx(0.01 + host + 3.5e-4 * start * np.cos(-1.0), abs=1e-9)


def test_a_squashed_rings_speed_is_part_of_the_blow_but_a_cylinder_stands():
    squashed = BARE._replace(squash_m=3.5e-4, squash_rad=0.5)
    jerk = -0.0164 * DRIVE**3 * np.cos(DRIVE * 0.05 + 2.0) * np.cos(0.5)
    moves = 3.5e-4 / 78.5 * jerk * np.cos(-1.0)
    position, velocity, _ = host_pose(0.05, HOST)
    for far, along, expected in ((0.045, 1.0, moves), (0.018, -1.0, 0.0)):
        state = state_of(x=position[0] + far, vx=velocity[0] + along)
        pair = (impact(0.05, state, p._replace(obstacle_m=0.018), HOST, np.zeros(2), 1.0)[1] for p in (BARE, squashed))
        assert np.subtract(*pair) == pytest.approx(expected, abs=1e-4)  # the wall's slope: 0.01 rad


def test_a_refitted_ring_and_an_eccentric_tyre():
    """Head-on along x: the disk's middle gets to the returned place."""
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


@pytest.mark.further
def test_a_split_ring_and_one_that_trails():
    """Head-on along x; a ring that trails has the speed of its own place's change; halves that are askew are smooth but
    at their joint."""
    for turn, more in ((np.pi / 2, 0.0), (-0.4, 2.5e-4 * np.cos(0.4)), (0.4, -2.5e-4 * np.cos(0.4))):
        split = BARE._replace(split_m=5e-4, split_rad=turn)
        assert first_contacts(split)[0][0] == pytest.approx(R + more, abs=2e-7)
    for azimuth in np.linspace(-3.0, 3.0, 31):
        low, high = (split_reach(azimuth + d, split)[0] for d in (-1e-6, 1e-6))
        assert split_reach(azimuth, split)[1] == pytest.approx((high - low) / 2e-6, abs=1e-8)
    trails = BARE._replace(trailing_m=4e-4)
    h = 1e-6
    for time in TIMES[::9]:
        state = state_of(x=0.03)
        gaps = [wall_gap(time + d, state, trails, HOST)[0] - wall_gap(time + d, state, BARE, HOST)[0] for d in (-h, h)]
        velocity, acceleration = host_pose(time, HOST)[1][0], host_pose(time, HOST)[2][0]
        assert np.mean(gaps) == pytest.approx(-4e-4 * velocity / 1.136, abs=1e-10)
        hit = struck(trails, time, HOST)
        own = -4e-4 * acceleration / 1.136
        assert np.diff(gaps)[0] / (2.0 * h) == pytest.approx(own, abs=1e-5)
        assert hit[2] - velocity == pytest.approx(own - 0.7 * (1.0 - own), abs=1e-4)


def test_a_packed_liner_and_a_ring_that_rolls_round():
    """Head-on along x; a ring that rolls round in its seat has the speed of its own place's change; a liner is packed
    from run to run, by as much to either side of the mean."""
    packed = BARE._replace(packed_m=2e-4)
    assert first_contacts(packed)[0][0] == pytest.approx(R + 2e-4, abs=2e-7)
    draft = draft_series("unknown_packing_felt", 1.0, np.random.default_rng(1), 5)
    runs = [physics_of_run(draft, run, DRIVE, 1.2).packed_m for run in range(5)]
    assert np.diff(runs) == pytest.approx(np.full(4, 0.5 * runs[-1])) and sum(runs) == pytest.approx(0.0)
    orbits = BARE._replace(orbit_m=3e-4, orbit_rad=0.5, orbit_rad_per_s=60.0)  # faster than any, for its own speed
    h = 1e-6
    for time in (0.1, 0.123, 0.31):
        at = 0.5 + 60.0 * time
        state = state_of(x=0.03)
        gaps = [wall_gap(time + d, state, orbits, STILL)[0] for d in (-h, h)]
        assert np.mean(gaps) == pytest.approx(0.01 + 3e-4 * np.cos(at), abs=3e-6)  # and a little of the wall's curve
        own = -3e-4 * 60.0 * np.sin(at)
        assert np.diff(gaps)[0] / (2.0 * h) == pytest.approx(own, abs=3e-4)
        hit = struck(orbits, time)
        assert hit[2] == pytest.approx(own - 0.7 * (1.0 - own), abs=1e-3)


def test_a_swollen_band_and_a_leaking_liner():
    """Head-on along x, of a disk that has not spun; then at any spin, and after other blows."""
    swollen = BARE._replace(swollen_m=3e-4)
    assert first_contacts(swollen)[0][0] == pytest.approx(R + 3e-4, abs=2e-7)
    assert first_contacts(BARE._replace(leaking_m=3e-4))[0][0] == pytest.approx(R - 3e-4, abs=2e-7)
    for spin, share in ((0.0, -1.0), (40.0, 0.0), (-120.0, 0.8)):
        assert wall_gap(0.1, state_of(x=0.03, spin=spin), swollen, STILL)[0] == pytest.approx(R - 3e-4 * share)
    around = swollen._replace(obstacle_m=0.018)  # a cylinder, too, is met where the band is
    assert wall_gap(0.1, state_of(x=0.02, spin=-120.0), around, STILL)[0] == pytest.approx(0.002 - 3e-4 * 0.8)
    leaking = BARE._replace(leaking_m=3e-4)
    for late in (0.0, 0.12):
        pressed = 3.0 * np.exp(-late / 0.12)
        gap = wall_gap(0.1 + late, state_of(x=0.03, tired=3.0, impact_s=0.1), leaking, STILL)[0]
        assert gap == pytest.approx(R + 3e-4 * (pressed - 3.0) / (pressed + 3.0))


def test_a_band_that_widens_in_a_blow_pushes_the_disk_off_the_wall():
    """Else it would be struck anew at once."""
    swollen = BARE._replace(swollen_m=3e-4, wall_friction=1.0)
    after = struck(swollen, vy=2.0)
    assert abs(after[5]) > 60.0 and wall_gap(0.1, after, swollen, STILL)[0] == pytest.approx(0.0, abs=1e-9)


def test_a_chucked_ring_and_a_bead_stop_the_disk_where_their_formulas_say():
    for way, more in ((0.0, 3e-4), (np.pi / 3, -3e-4), (2.0 * np.pi / 3, 3e-4)):
        chucked = BARE._replace(chucked_m=3e-4, chucked_rad=way)
        assert first_contacts(chucked)[0][0] == pytest.approx(R + more, abs=2e-7)
    for off, near in ((0.0, 1.0), (0.25, np.exp(-0.5)), (-0.5, np.exp(-2.0)), (np.pi, 0.0)):
        bead = BARE._replace(seam_bead_m=6e-4, seam_bead_rad=off)
        assert first_contacts(bead)[0][0] == pytest.approx(R - 6e-4 * near, abs=2e-7)


@pytest.mark.parametrize("wall", [{"chucked_m": 3e-4, "chucked_rad": 0.4}, {"seam_bead_m": 7e-4, "seam_bead_rad": 0.2}])
def test_normals_stand_on_the_walls(wall):
    """Along the wall the way to it does not change; along the normal it does one for one."""
    p, h = BARE._replace(**wall), 1e-6
    for azimuth in np.linspace(-3.0, 3.0, 13):
        at = 0.0397 * np.array([np.cos(azimuth), np.sin(azimuth)])
        _, nx, ny = wall_gap(0.1, state_of(x=at[0], y=at[1]), p, STILL)

        def gap(dx, dy, at=at):
            return wall_gap(0.1, state_of(x=at[0] + dx, y=at[1] + dy), p, STILL)[0]

        assert (gap(h * nx, h * ny) - gap(-h * nx, -h * ny)) / (2.0 * h) == pytest.approx(-1.0, abs=5e-3)
        assert (gap(-h * ny, h * nx) - gap(h * ny, -h * nx)) / (2.0 * h) == pytest.approx(0.0, abs=5e-3)
