"""What an analysis of failure modes and effects foresees, part by part: each cause does what its formula says (how much
it does: test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant, state_at
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, impact, wall_gap
from analysis.blind.recording.clock import frame_times, latest_s
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import played
from analysis.blind.recording.picture import hazed
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
    film,
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

R = 0.01  # m: the disk
PLACES = ((0.0, 0.0), (0.02, 0.01), (0.004, -0.03), (-0.03, 0.02), (0.0395, 0.0))


def _of_the_series(name, number, runs=5, seed=2):
    """What each run of a series with a cause has of a number of the plant."""
    draft = draft_series(name, 1.0, np.random.default_rng(seed), runs)
    return np.array([getattr(physics_of_run(draft, run, DRIVE, 1.2), number) for run in range(runs)])


def test_a_disk_that_climbs_onto_the_higher_plate_loses_the_energy_of_its_height():
    """And wins it back on the way down: the push is along one direction, always to the same side."""
    step = FREE._replace(plates_m_per_s2=1.2, plates_m=0.004, plates_rad=0.8)
    out, along = np.array([np.cos(0.8), np.sin(0.8)]), np.array([-np.sin(0.8), np.cos(0.8)])
    for s, t in ((0.004, 0.0), (0.009, 0.02), (-0.006, -0.02), (0.03, 0.01)):
        x, y = s * out + t * along
        push = -1.2 * np.exp(-0.5 * ((s - 0.004) / 0.005) ** 2)
        assert rate_of(step, x=x, y=y, vx=0.3, spin=20.0) == pytest.approx((*(push * out), 0.0), abs=1e-12)
    height = 1.2 * 0.005 * np.sqrt(2.0 * np.pi)  # m^2/s^2
    for way in (1.0, -1.0):
        start = np.array([*(-0.028 * way * out), *(0.5 * way * out), 0.0, 0.0])
        motion = run_plant(step, STILL, start, 0.11, np.random.default_rng(0))
        assert len(motion.impacts) == 0
        end = state_at(motion, np.array([0.108]))[0]
        assert end[2] ** 2 + end[3] ** 2 == pytest.approx(0.25 - 2.0 * way * height, rel=1e-3)


def test_a_floor_brushed_outwards_holds_by_how_far_a_slip_goes_outwards():
    for share in (0.4, -0.4):
        brushed = SLIDING._replace(outward=share)
        for azimuth in (0.0, 1.1, 2.9, 4.4):
            out = 0.03 * np.array([np.cos(azimuth), np.sin(azimuth)])
            for turned in (0.0, 0.5 * np.pi, np.pi, 2.2):
                way = np.array([np.cos(azimuth + turned), np.sin(azimuth + turned)])
                held = G * (1.0 + share * np.cos(turned) * 0.03 / 0.033)
                got = rate_of(brushed, x=out[0], y=out[1], vx=way[0], vy=way[1])
                assert got[:2] == pytest.approx(-held * way, rel=1e-5)
    # As fast at the rim as it slides it has less of it.
    whole, spun = (
        rate_of(SLIDING._replace(outward=0.4), x=0.03, vx=1.0, spin=w)[0] / rate_of(SLIDING, x=0.03, vx=1.0, spin=w)[0]
        for w in (0.0, 100.0)
    )
    assert spun - 1.0 == pytest.approx((whole - 1.0) / np.sqrt(2.0), rel=1e-5)
    assert rate_of(SLIDING._replace(outward=0.4), vx=1.0)[0] == pytest.approx(-G)  # in the middle nothing is outwards


def test_a_magnet_below_one_end_of_the_stroke_draws_the_disk_down_there():
    """By the place in the room: the same place of the Host is held more or less as the Host goes."""
    for share in (0.25, -0.25):
        drawn = SLIDING._replace(beneath=share)
        for time in TIMES[::7]:
            position, velocity, _ = host_pose(time, HOST)
            for x in (-0.03, 0.0, 0.02):
                got = rate_of(drawn, time, HOST, x=position[0] + x, y=0.02, vx=velocity[0], vy=1.0)
                assert got[1] == pytest.approx(-G * max(1.0 + share * (position[0] + x) / 0.02, 0.0))
    assert rate_of(SLIDING._replace(beneath=1.0), x=-0.03, vx=1.0)[0] == pytest.approx(0.0)  # it pushes nothing up


def test_a_hysteresis_brake_takes_the_same_energy_of_every_metre():
    """In the room, whatever the Host and its floor do; the spin is left alone."""
    braked = FREE._replace(hysteresis_m_per_s2=0.6)
    for time, host in ((0.0, STILL), (0.3, HOST)):
        for way in (np.array([1.0, 0.5]), np.array([-0.4, 0.3]), np.array([0.0, 2.0])):
            speed = np.hypot(*way)
            got = rate_of(braked, time, host, vx=way[0], vy=way[1], spin=40.0)
            assert got == pytest.approx((*(-0.6 * way / np.hypot(speed, 0.02)), 0.0), abs=1e-12)
    assert rate_of(braked) == pytest.approx(np.zeros(3))
    motion = run_plant(braked, STILL, np.array([-0.03, 0.0, 0.8, 0.0, 0.0, 0.0]), 0.06, np.random.default_rng(0))
    end = state_at(motion, np.array([0.055]))[0]
    assert 0.64 - end[2] ** 2 == pytest.approx(2.0 * 0.6 * (end[0] + 0.03), rel=2e-3)


def test_a_scaly_face_bites_in_one_sense_of_spin():
    for share in (0.5, -0.5):
        scaly = SLIDING._replace(scaly_face=share)
        for speed, spin in ((1.0, 60.0), (1.0, -60.0), (0.3, 100.0), (0.0, -50.0)):
            part = R * spin / np.hypot(speed, R * spin)
            got, plain = (rate_of(p, vx=speed, spin=spin) for p in (scaly, SLIDING))
            assert got == pytest.approx(plain * (1.0 + share * part), rel=1e-5)
        assert rate_of(scaly, vx=1.0) == pytest.approx(rate_of(SLIDING, vx=1.0))
    assert rate_of(SLIDING._replace(scaly_face=1.4), vx=0.1, spin=-90.0) == pytest.approx(np.zeros(3), abs=1e-9)


def test_a_washer_is_put_in_with_one_face_down_or_the_other():
    course = _of_the_series("unknown_turned_washer", "turned", 12)
    most = np.abs(course).max()
    assert np.all(np.abs(course) == most) and np.sum(course > 0.0) == 6 and 0.85 * 0.18 < most < 1.15 * 0.18
    orders = {tuple(_of_the_series("unknown_turned_washer", "turned", 12, seed) > 0.0) for seed in range(6)}
    assert len(orders) == 6
    for share in (-0.2, 0.2):
        assert rate_of(SLIDING._replace(turned=share), vx=1.0)[0] == pytest.approx(-G * (1.0 + share))


def _rebound(p, azimuth=0.0, **numbers):
    """Restitution of a blow straight at the wall."""
    c, s = np.cos(azimuth), np.sin(azimuth)
    state = state_of(x=0.04 * c, y=0.04 * s, vx=c, vy=s, **numbers)
    after = impact(0.1, state, p, STILL, np.zeros(2), 1.0)[0]
    return -(after[2] * c + after[3] * s)


def test_a_washer_is_hard_at_one_side():
    hard = BARE._replace(hardened=0.15, hardened_rad=0.9)
    for azimuth, angle in ((0.0, 0.0), (2.0, 0.4), (5.0, -3.0), (1.0, 7.0)):
        won = 0.15 * np.cos(azimuth - angle - 0.9)
        assert _rebound(hard, azimuth, angle=angle) == pytest.approx(0.7 + won)
    assert _rebound(hard._replace(hardened=0.9), 0.9) == pytest.approx(0.98)  # no washer gives back all


def test_one_screw_of_the_ring_backs_out_in_the_course_of_a_series():
    course = _of_the_series("unknown_backed_screw", "backed")
    assert course == pytest.approx(course[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 0.2 < course[-1] < 1.15 * 0.2  # never the other way
    for backed in (-0.2, 0.2):
        for azimuth in (1.3, 1.3 + np.pi, 2.0, 5.0):
            lost = backed * np.cos(0.5 * (azimuth - 1.3)) ** 2
            assert _rebound(BARE._replace(backed=backed, backed_rad=1.3), azimuth) == pytest.approx(0.7 - lost)
    assert _rebound(BARE._replace(backed=-0.9)) == pytest.approx(0.98)


def _lost(p, *args, **numbers):
    """Slip that a light blow of a disk which spins fast takes, over its normal impulse."""
    return (R * 90.0 - head_on(p, 0.1, 90.0, *args, **numbers)[1]) / (1.7 * 0.1)


def test_a_blow_presses_oil_out_of_a_sintered_ring_for_the_next():
    ring = BARE._replace(sintered=0.8)
    assert _lost(BARE) == pytest.approx(3.0 * 0.15)
    for approach in (0.0, 0.2, 0.7, 3.0):
        left = 1.0 - 0.8 * approach**2 / (approach**2 + 0.49)
        assert _lost(ring, approach=approach, count=3) == pytest.approx(3.0 * 0.15 * left)
    assert _lost(ring, approach=2.0) == pytest.approx(3.0 * 0.15)  # before any it is dry
    assert _lost(ring._replace(sintered=1.5), approach=9.0, count=1) == pytest.approx(3.0 * 0.15 * 0.02)
    stuck = {"approach": 2.0, "count": 3}
    assert head_on(ring, 1.0, 1.0, **stuck) == pytest.approx(head_on(BARE, 1.0, 1.0))  # where it sticks


def test_powder_that_the_drive_shakes_carries_the_disk_whichever_way_the_host_goes():
    powder = BARE._replace(shaken=0.7)
    for time in TIMES[::7]:
        left = 1.0 - 0.7 * abs(host_pose(time, HOST)[2][0]) / 78.5
        assert _lost(powder, time, HOST) == pytest.approx(3.0 * 0.15 * left)
    assert _lost(powder) == pytest.approx(3.0 * 0.15)  # at rest it lies


def test_rubber_keeps_the_set_of_its_last_shear():
    rubber = BARE._replace(shear_set=0.6)
    for spin in (20.0, -20.0, 8.0):
        for slipped in (1.0, -1.0, 0.05, 0.0):
            alike = np.tanh(R * spin / 0.1) * np.tanh(slipped / 0.1)
            back = 0.45 * (1.0 + 0.6 * alike)
            got = head_on(rubber, spin=spin, slipped=slipped, count=2)[1]
            assert got == pytest.approx(-back * R * spin, abs=1e-12)
    most = head_on(BARE._replace(shear_set=2.0), 3.0, 20.0, slipped=1.0, count=2)[1]
    assert most == pytest.approx(-0.95 * 0.2, abs=1e-12)  # never more than it can
    assert head_on(rubber, 0.1, 90.0, slipped=1.0) == pytest.approx(head_on(BARE, 0.1, 90.0))  # it slips


def test_no_blow_leaves_more_energy():
    for changed in (
        {"hardened": 0.3, "hardened_rad": 1.0},
        {"backed": -0.3, "backed_rad": 1.0},
        {"sintered": 1.2},
        {"shaken": 1.2},
        {"shear_set": 1.4},
        {"peeling_m": 7e-4, "peeling_rad": 2.0},
        {"crept_x_m": 3e-4, "crept_y_m": -2e-4},
    ):
        leaves_no_more_energy(BARE._replace(**changed))


def test_a_ring_creeps_in_its_clamps_from_run_to_run():
    x, y = (_of_the_series("unknown_creeping_clamps", f"crept_{axis}_m") for axis in "xy")
    for axis in (x, y):
        assert axis == pytest.approx(axis[-1] * np.array([-1.0, -0.5, 0.0, 0.5, 1.0]))
    assert 0.85 * 3.1e-4 < np.hypot(x[-1], y[-1]) < 1.15 * 3.1e-4
    crept = BARE._replace(crept_x_m=3e-4, crept_y_m=-2e-4)
    for azimuth in np.arange(0.05, 6.2, 0.37):
        place = 0.04 * np.array([np.cos(azimuth), np.sin(azimuth)])
        gap, nx, ny = wall_gap(0.1, state_of(x=place[0], y=place[1]), crept, STILL)
        off = place - [3e-4, -2e-4]
        assert (gap, nx, ny) == pytest.approx((0.04 - np.hypot(*off), *(off / np.hypot(*off))), abs=1e-12)
    assert first_contacts(crept)[0] == pytest.approx([0.0103], abs=1e-6)


def test_tape_peels_off_the_rim_blow_by_blow():
    tape = BARE._replace(peeling_m=6e-4, peeling_rad=0.5)
    for blows, off in ((0, 0.0), (8, 1.0 - np.exp(-1.0)), (1000, 1.0)):
        for azimuth, angle in ((0.5, 0.0), (2.0, 0.9), (4.0, 3.5), (5.5, -1.0)):
            away = np.angle(np.exp(1j * (azimuth - angle - 0.5))) / 0.7
            end = 6e-4 * off * np.exp(-0.5 * away**2)
            at = {"x": 0.04 * np.cos(azimuth), "y": 0.04 * np.sin(azimuth), "angle": angle, "count": blows}
            gap, nx, ny = wall_gap(0.1, state_of(**at), tape, STILL)
            assert gap == pytest.approx(-end, abs=3e-6)
            slope = (nx * at["y"] - ny * at["x"]) / (nx * at["x"] + ny * at["y"])
            assert slope == pytest.approx(end * away / 0.7 / 0.04, abs=2e-4)
            # Beside the tape's top the contact lies beside the normal through the disk's middle.
            arm = np.array(contact_velocity(0.1, state_of(**at), tape, STILL, nx, ny)[2:])
            assert arm @ [-ny, nx] == pytest.approx(-end * away / 0.7, abs=2e-5)
    for blows in (0, 5, 30):  # it is put back onto the wall with the tape as the blow has left it
        after = struck(tape, angle=0.1, count=blows)
        assert after[13] == blows + 1 and wall_gap(0.1, after, tape, STILL)[0] >= -1e-9


def test_haze_goes_over_one_cameras_picture_in_waves():
    errors = ViewErrors(haze_px=0.8, haze_rad=0.6, haze_rad_per_s=40.0, haze_phase_rad=1.1, haze_camera=1)
    view, along = draw_views(np.random.default_rng(1))[1], np.array([np.cos(0.6), np.sin(0.6)])
    pixels, time_s = np.random.default_rng(2).uniform(500.0, 2500.0, (6, 12, 2)), np.linspace(0.0, 1.0, 6)
    off = hazed(pixels, time_s, 1, view, errors) - pixels
    assert off @ [-along[1], along[0]] == pytest.approx(np.zeros((6, 12)), abs=1e-9)
    place = (pixels - view.centre_px) @ along
    waves = np.sin(2.0 * np.pi * place / 250.0 - 40.0 * time_s[:, None] + 1.1)
    assert off @ along == pytest.approx(0.8 * waves)
    # A crest goes on by 250 px in a period.
    crest = hazed(pixels + 250.0 * 0.1 * 40.0 / (2.0 * np.pi) * along, time_s + 0.1, 1, view, errors)
    assert crest - pixels - 250.0 * 0.1 * 40.0 / (2.0 * np.pi) * along == pytest.approx(off)
    assert np.array_equal(hazed(pixels, time_s, 0, view, errors), pixels)
    assert np.array_equal(hazed(pixels, time_s, 1, view, ViewErrors()), pixels)


def test_frames_are_taken_at_a_timers_ticks():
    tick = 3.1e-4
    errors = ViewErrors(tick_s=tick)
    ticking, even = (frame_times(200, 800.0, e, np.random.default_rng(1)) for e in (errors, ViewErrors()))
    taken = (ticking + 0.5 * tick) / tick
    assert taken == pytest.approx(np.round(taken), abs=1e-6)
    late = ticking + 0.5 * tick - even
    assert late.min() > -1e-12 and late.max() < tick and np.std(late) == pytest.approx(tick / np.sqrt(12.0), rel=0.02)
    assert np.abs(ticking - even).max() <= latest_s(errors, 1.2) + 1e-12
    (seen, _), (plain, _) = film("unknown_ticking_timer", 1.0), film("none", 1.0)
    off = (seen - plain).dropna()
    markers = off.index.get_level_values("marker")
    assert off[markers.str.startswith("G")].abs().max().max() < 1e-9  # what stands still is where it was
    both = [off.loc[camera].loc[(slice(None), "H1"), "u_px"].abs().mean() for camera in ("VW1", "VW2")]
    assert both[0] > 0.05 and both[0] == pytest.approx(both[1], rel=0.2)


def test_a_card_with_play_lies_where_the_last_blow_has_thrown_it():
    errors, nes = ViewErrors(card_play_rad=0.02), np.zeros((7, 4))
    nes[:, 3] = np.linspace(0.0, 0.6, 7)
    time_s, blows = 0.1 * np.arange(7), np.array([[0.15, 30.0], [0.35, -20.0], [0.45, 1.0]])
    turned = played(nes, time_s, blows, errors) - nes
    assert not turned[:, :3].any()
    assert turned[:, 3] == pytest.approx(-0.02 * np.tanh([0.0, 0.0, 15.0, 15.0, -10.0, 0.5, 0.5]))
    assert np.array_equal(played(nes, time_s, blows, ViewErrors()), nes)
    assert view_of(draft_series("unknown_card_play", 1.0, np.random.default_rng(2), 5)).card_play_rad > 0.0


def test_what_they_stand_beside():
    """Tape needs a round ring, what goes by the last blow one that is over, and no floor changes twice from run to
    run."""
    needs_a_round_wall("unknown_peeling_tape")
    impacts = [cause.name for cause in of_group("foreseen") if cause.stage == "impact"]
    needs_a_blow_that_is_over(["unknown_peeling_tape", "unknown_card_play", *impacts])
    assert may_stand_together(("finite_contact_time", "unknown_lapped_plates"), "square", "chirp")
    assert may_stand_together(("wall_ellipticity", "unknown_creeping_clamps"), "cylinder", "random")
    assert not may_stand_together(("friction_drift", "unknown_turned_washer"), "round", "sine")
