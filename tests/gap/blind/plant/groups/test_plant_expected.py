"""What an experimenter would expect at such a bench: each cause does what its formula says (how much it does:
test_blind_severity.py)."""

import numpy as np
import pytest

from analysis.blind.causes.named import draft_series, may_stand_together, physics_of_run, view_of
from analysis.blind.plant.dynamics import run_plant
from analysis.blind.plant.flight.accelerations import derivative
from analysis.blind.plant.flight.disk_friction import disk_friction_table
from analysis.blind.plant.host import host_pose
from analysis.blind.plant.wall.contact import contact_velocity, wall_gap
from analysis.blind.recording.errors import ViewErrors
from analysis.blind.recording.markers import crept, misread
from tests.gap.blind.plant.rig import (
    BARE,
    DRIVE,
    FREE,
    HOST,
    PLACE,
    SLIDING,
    STILL,
    TIMES,
    G,
    blows_at_rest,
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
HEATED_MEAN = 1.0 - (1.0 - np.exp(-3.0)) / 3.0  # of 1 - exp(-t / 0.4 s) over a run of 1.2 s


def _numbers(name, *fields, seed=2, runs=RUNS):
    """Of every run (runs, fields), and what the truth says."""
    draft = draft_series(name, 1.0, np.random.default_rng(seed), runs)
    of_runs = [physics_of_run(draft, run, DRIVE, 1.2) for run in range(runs)]
    return np.array([[getattr(p, field) for field in fields] for p in of_runs]), draft.parameters[name]


def test_a_disk_breaks_away_below_a_speed():
    floor = SLIDING._replace(breakaway=0.6)
    for speed, share in ((0.1, 1.6), (0.6, 1.6), (1.0, 1.3), (1.4, 1.0), (3.0, 1.0)):
        assert rate_of(floor, vx=speed)[0] == pytest.approx(-G * share, rel=5e-4)


def test_oil_carries_what_runs():
    floor = SLIDING._replace(mixed=0.5, mixed_m_per_s=1.3)
    for speed in (0.05, 0.5, 1.3, 2.6):
        share = 1.0 + 0.5 * np.exp(-((speed / 1.3) ** 2))
        assert rate_of(floor, vy=speed)[1] == pytest.approx(-G * share, rel=1e-5)
    # It is the speed over the floor, not that in the room.
    time = TIMES[7]
    velocity = host_pose(time, HOST)[1]
    along = rate_of(floor, time, HOST, x=host_pose(time, HOST)[0][0], vx=velocity[0] + 0.7)[0]
    assert along == pytest.approx(-G * (1.0 + 0.5 * np.exp(-((0.7 / 1.3) ** 2))), rel=1e-5)


def test_a_bench_warms_in_the_first_runs():
    shares, truth = _numbers("unknown_warming_bench", "bench")
    cold = np.exp(-np.arange(RUNS) / 3.0)
    assert shares[:, 0] == pytest.approx(truth["bench"] * (cold - cold.mean())) and truth["bench"] > 0.0
    for share in (0.3, -0.1):
        assert rate_of(SLIDING._replace(bench=share), vx=0.8)[0] == pytest.approx(-G * (1.0 + share), rel=1e-5)


def test_a_film_loses_its_grip_in_a_run():
    film = FREE._replace(fading_film_per_s=0.5)
    for time in (0.0, 0.2, 1.1):
        rate = 0.5 * np.exp(-time / 0.4)
        assert rate_of(film, time, vx=0.8, vy=-0.3, spin=20.0) == pytest.approx((-0.8 * rate, 0.3 * rate, -20.0 * rate))
    # What goes with the Host is not sheared.
    time = TIMES[5]
    position, velocity, _ = host_pose(time, HOST)
    assert rate_of(film, time, HOST, x=position[0], vx=velocity[0]) == pytest.approx(np.zeros(3), abs=1e-12)


def test_air_in_layers_drags_with_the_power_three_halves():
    air = FREE._replace(laminar_m_per_s2=0.2)
    for speed in (0.3, 1.0, 3.0):
        out = rate_of(air, vx=0.6 * speed, vy=0.8 * speed, spin=12.0)
        assert out == pytest.approx((-0.12 * speed**1.5, -0.16 * speed**1.5, 0.0))


def test_a_magnet_of_the_room_pulls_evenly_more_along_a_line():
    magnet = FREE._replace(lab_pull_per_s2=15.0, lab_pull_m=0.004, lab_pull_rad=0.5)
    along = np.array([np.cos(0.5), np.sin(0.5)])
    for time in TIMES[::15]:  # wherever the Host is
        for place in ((0.0, 0.0), (0.02, -0.01), (-0.03, 0.015)):
            push = 15.0 * (along @ place - 0.004) * along
            assert rate_of(magnet, time, HOST, x=place[0], y=place[1], vx=1.0) == pytest.approx((*push, 0.0))
    motion = run_plant(magnet, STILL, np.array([-0.03, 0.004, 0.8, 0.1, 0.0, 0.0]), 0.06, np.random.default_rng(0))
    x, y, vx, vy = motion.nodes[:, 1:5].T
    whole = 0.5 * (vx**2 + vy**2) - 7.5 * (along[0] * x + along[1] * y - 0.004) ** 2
    assert len(motion.impacts) == 0 and np.ptp(vx) > 1e-3 and whole == pytest.approx(np.full(len(x), whole[0]))
    sides = {
        np.sign(_numbers("unknown_lab_magnet", "lab_pull_per_s2", seed=seed, runs=1)[0][0, 0]) for seed in range(8)
    }
    assert sides == {-1.0, 1.0}


def test_each_blow_charges_the_disk():
    charged = FREE._replace(struck_charge_m_per_s2=0.06)
    assert rate_of(charged, x=0.03) == pytest.approx(np.zeros(3))
    for blows in (1, 4, 20):
        for radius, azimuth in ((0.02, 0.4), (0.039, 3.0)):
            out = np.array([np.cos(azimuth), np.sin(azimuth)])
            pull = 0.06 * blows * (0.01 / (0.05 - radius)) ** 2 * radius / np.hypot(radius, 0.002)
            at = {"x": radius * out[0], "y": radius * out[1], "blows": blows, "spin": 9.0}
            assert rate_of(charged, **at) == pytest.approx((*(pull * out), 0.0))
    # Between two blows it is a field: what is won on the way out is lost on the way in.
    start = np.array([-0.02, 0.01, 0.9, 0.1, 0.0, 0.0])
    motion = run_plant(charged._replace(struck_charge_m_per_s2=0.6), STILL, start, 0.3, np.random.default_rng(0))
    between = (motion.nodes[:, 0] > motion.impacts[0, 0] + 1e-9) & (motion.nodes[:, 0] < motion.impacts[1, 0] - 1e-9)
    x, y, vx, vy = motion.nodes[between, 1:5].T
    steps = np.linspace(0.0, 0.041, 20001)
    pull = 0.6 * (0.01 / (0.05 - steps)) ** 2 * steps / np.hypot(steps, 0.002)
    height = np.concatenate([[0.0], np.cumsum(0.5 * (pull[1:] + pull[:-1]) * np.diff(steps))])
    whole = 0.5 * (vx**2 + vy**2) - np.interp(np.hypot(x, y), steps, height)
    assert np.ptp(np.hypot(vx, vy)) > 1e-3 and whole == pytest.approx(np.full(len(x), whole[0]), abs=1e-6)


def test_no_flight_gains_energy_of_a_floor_at_rest():
    for changed in ({"breakaway": 0.7}, {"mixed": 0.7}, {"bench": -0.3}, {"fading_film_per_s": 0.6}):
        p = SLIDING._replace(**changed)
        for time, state in zip(TIMES, random_states(), strict=True):
            rates = derivative(time, state, p, STILL, disk_friction_table())
            assert rates[2:4] @ state[2:4] + 0.5 * 0.01**2 * rates[5] * state[5] < 0.0
    for time, state in zip(TIMES, random_states(), strict=True):
        rates = derivative(time, state, FREE._replace(laminar_m_per_s2=0.3), STILL, disk_friction_table())
        assert rates[2:4] @ state[2:4] < 0.0 and rates[5] == 0.0


def test_a_viscoelastic_wall_loses_with_the_fifth_root():
    wall = BARE._replace(viscoelastic=0.3)
    for speed in (0.2, 0.8, 1.2, 3.0):
        value = 0.7 - 0.3 * (speed**0.2 - 1.2**0.2)
        assert head_on(wall, speed)[0] == pytest.approx(-speed * value)
    assert head_on(wall, 0.05)[0] == pytest.approx(-0.05 * (0.7 - 0.3 * (0.2**0.2 - 1.2**0.2)))
    # Where it is 1 at no speed, it is the textbooks' own.
    own = BARE._replace(restitution=1.0 - 0.25 * 1.2**0.2, viscoelastic=0.25)
    assert head_on(own, 2.0)[0] == pytest.approx(-2.0 * (1.0 - 0.25 * 2.0**0.2))


def test_a_dashpot_takes_more_of_hard_blows():
    wall = BARE._replace(dashpot_s_per_m=0.2)
    for speed in (0.3, 1.2, 2.5):
        assert head_on(wall, speed)[0] == pytest.approx(-speed * 0.7 * 1.24 / (1.0 + 0.2 * speed))
    own = BARE._replace(restitution=1.0 / 1.24, dashpot_s_per_m=0.2)
    assert head_on(own, 2.0)[0] == pytest.approx(-2.0 / 1.4)


def test_blows_heat_the_washer():
    washer = BARE._replace(heated=0.2)
    for heat in (0.0, 5.0, 12.0):
        assert head_on(washer, 1.0, heat=heat)[0] == pytest.approx(-0.7 * (1.0 - 0.02 * heat))
    # What a blow takes is what the disk has less after it; nothing is kept where nothing heats.
    for speed, spin in ((1.0, 0.0), (2.0, 40.0), (0.7, -15.0)):
        before = energy(state_of(vx=speed, vy=0.4, spin=spin))
        out = struck(washer, vx=speed, vy=0.4, spin=spin, heat=3.0)
        assert out[PLACE.index("heat")] == pytest.approx(3.0 + before - energy(out))
        assert struck(BARE, vx=speed, heat=3.0)[PLACE.index("heat")] == 3.0
    moving = struck(washer, host=HOST, vx=1.0)  # against the wall, wherever it goes
    assert moving[PLACE.index("heat")] == pytest.approx(0.5 * (1.0 - 0.7**2))


def test_an_oiled_wall_drags_with_the_slip():
    wet = BARE._replace(wet_wall=1.0)
    for slip in (0.02, 0.3, 1.5):
        for speed in (0.4, 2.0):
            out = struck(wet, vx=speed, vy=slip)
            assert out[2:4] == pytest.approx((-0.7 * speed, 0.9 * slip))
            assert out[5] == pytest.approx(-0.1 * slip * 0.01 / (0.5 * 0.01**2))
    dry, half = struck(BARE, vx=1.0, vy=0.3), struck(BARE._replace(wet_wall=0.5), vx=1.0, vy=0.3)
    assert half[3] == pytest.approx(0.5 * (dry[3] + 0.27))


def test_a_wall_is_cleaned_once():
    shares, truth = _numbers("unknown_cleaned_wall", "cleaned_wall")
    first = int(truth["from_run"]) - 1
    assert 0.3 * RUNS < first < 0.7 * RUNS
    assert shares[:, 0] == pytest.approx(truth["cleaned_wall"] * np.where(np.arange(RUNS) < first, -1.0, 1.0))
    for share in (0.4, -0.5):  # a disk that slips all along
        out = struck(BARE._replace(cleaned_wall=share), vx=1.0, vy=3.0)
        assert out[3] == pytest.approx(3.0 - 0.15 * (1.0 + share) * 1.7)


def test_no_blow_leaves_more_energy():
    for changed in (
        {"viscoelastic": 0.5},
        {"dashpot_s_per_m": 0.3},
        {"heated": 0.2},
        {"wet_wall": 1.0},
        {"wet_wall": 0.6, "mass_x_m": 4e-4},
        {"cleaned_wall": 0.8},
        {"flat_m": 8e-4, "flat_rad": 1.0},
    ):
        leaves_no_more_energy(BARE._replace(**changed))
    assert len(list(blows_at_rest())) == len(TIMES)


def test_a_ring_is_flat_at_one_place():
    ring = BARE._replace(flat_m=8e-4, flat_rad=0.6)
    half_rad = np.arccos(1.0 - 8e-4 / 0.04)
    for off in (0.0, 0.5 * half_rad, -0.9 * half_rad):
        c, s = np.cos(0.6 + off), np.sin(0.6 + off)
        far = 0.0392 / np.cos(off)
        x, y = (far - 1e-5) * c, (far - 1e-5) * s
        gap, nx, ny = wall_gap(0.1, state_of(x=x, y=y), ring, STILL)
        assert (nx, ny) == pytest.approx((np.cos(0.6), np.sin(0.6)), abs=1e-4)  # its normal is one all along
        assert gap == pytest.approx(1e-5 * np.cos(off), rel=1e-3)
    for off in (1.05 * half_rad, 2.0, -1.1 * half_rad):
        c, s = np.cos(0.6 + off), np.sin(0.6 + off)
        gap, nx, ny = wall_gap(0.1, state_of(x=0.039 * c, y=0.039 * s), ring, STILL)
        assert gap == pytest.approx(0.001) and (nx, ny) == pytest.approx((c, s))
    assert first_contacts(ring._replace(flat_rad=0.0))[0] == pytest.approx([0.01 - 8e-4], abs=1e-6)
    for seed in range(6):
        (at,) = _numbers("unknown_flat_spot", "flat_rad", seed=seed, runs=1)[0][0]
        assert abs(np.sin(at)) < np.sin(0.4) + 1e-9


def test_a_ring_widens_ever_more_slowly():
    ring = BARE._replace(heating_m=8e-4)
    for time in (0.0, 0.1, 0.5, 1.2):
        wider = 8e-4 * (1.0 - np.exp(-time / 0.4) - HEATED_MEAN)
        for azimuth in (0.3, 4.0):
            c, s = np.cos(azimuth), np.sin(azimuth)
            gap, nx, ny = wall_gap(time, state_of(x=0.039 * c, y=0.039 * s), ring, STILL)
            assert gap == pytest.approx(0.001 + wider) and (nx, ny) == pytest.approx((c, s))
    later = wall_gap(0.1001, state_of(x=0.039), ring, STILL)[0] - wall_gap(0.0999, state_of(x=0.039), ring, STILL)[0]
    approach = contact_velocity(0.1, state_of(x=0.04, vx=1.0), ring, STILL, 1.0, 0.0)[0]
    assert approach == pytest.approx(1.0 - later / 2e-4)
    post = ring._replace(obstacle_m=0.018)  # a cylinder does not warm
    assert wall_gap(0.5, state_of(x=0.02), post, STILL)[0] == pytest.approx(0.002)
    assert contact_velocity(0.1, state_of(x=0.018, vx=-1.0), post, STILL, -1.0, 0.0)[0] == 1.0
    # A disk that is pressed onto it goes with it, and does not rattle.
    pressed = ring._replace(tilt_x_m_per_s2=40.0, restitution=0.3)
    motion = run_plant(pressed, STILL, np.array([0.03, 0.0, 1.0, 0.0, 0.0, 0.0]), 0.1, np.random.default_rng(0))
    assert len(motion.impacts) < 20


def test_a_sticker_creeps_at_each_blow():
    time_s, angle = np.linspace(0.0, 0.9, 10), np.linspace(0.3, 5.0, 10)
    impacts = np.array([[0.15, 1.0, 0.0], [0.25, 0.1, 0.0], [0.35, 2.0, 0.5], [0.75, 0.5, 0.1]])
    points = np.random.default_rng(3).uniform(-0.05, 0.05, (10, 12, 3))
    seen = crept(points, angle, time_s, impacts, ViewErrors(creeping_m=(2e-5, -1e-5), creeping_marker=3))
    blows = np.array([0, 0, 1, 1, 2, 2, 2, 2, 3, 3])  # a touch is none
    off = seen - points
    assert not np.delete(off, 7 + 3, axis=1).any() and not off[..., 2].any()
    c, s = np.cos(angle), np.sin(angle)
    way = np.column_stack([2e-5 * c + 1e-5 * s, 2e-5 * s - 1e-5 * c])
    assert off[:, 10, :2] == pytest.approx(blows[:, None] * way)
    assert crept(points, angle, time_s, impacts, ViewErrors()) is points
    draws = [view_of(draft_series("unknown_creeping_sticker", 1.0, np.random.default_rng(k), 3)) for k in range(30)]
    assert {view.creeping_marker for view in draws} == {1, 2, 3, 4}


def test_markers_are_printed_around_another_point():
    nes = np.random.default_rng(3).normal(size=(20, 4))
    seen = misread(nes, ViewErrors(reading_rad=0.03, reading_at_rad=0.8))
    assert np.array_equal(seen[:, :3], nes[:, :3])
    assert seen[:, 3] == pytest.approx(nes[:, 3] + 0.03 * np.sin(nes[:, 3] - 0.8))
    assert misread(nes, ViewErrors()) is nes


def test_what_they_stand_beside():
    """What is of the same physics as a listed one does not stand beside that; a place around a ring needs one; what
    counts blows needs blows that are over."""
    needs_a_blow_that_is_over(["unknown_struck_charge", "unknown_heated_washer", "unknown_oiled_wall"])
    for name in ("unknown_struck_charge", "unknown_flat_spot", "unknown_heated_ring"):
        needs_a_round_wall(name)
    for listed, ours in (
        ("friction_drift", "unknown_warming_bench"),
        ("viscous_drag", "unknown_fading_film"),
        ("viscous_drag", "unknown_boundary_layer"),
        ("air_drag", "unknown_boundary_layer"),
        ("table_tilt", "unknown_lab_magnet"),
        ("speed_dependent_restitution", "unknown_viscoelastic_wall"),
        ("speed_dependent_restitution", "unknown_damped_contact"),
        ("restitution_drift", "unknown_heated_washer"),
    ):
        assert not may_stand_together((listed, ours), "round", "sine")
    assert may_stand_together(("table_tilt", "unknown_breakaway"), "triangle", "random")
    assert may_stand_together(("finite_contact_time", "unknown_creeping_sticker"), "square", "chirp")
