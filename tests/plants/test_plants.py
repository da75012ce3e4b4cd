"""The plant against closed forms: what it is used to judge must not be its own opinion."""

from __future__ import annotations

import numpy as np
import pytest

from ovines.commands.recording.check import NAME  # the command that the written folder must satisfy
from tests.plants import LAWS, Spec, make_recording, make_series, write_series
from tests.plants.kernel import GRAVITY_M_PER_S2, LINE_COLUMNS, Physics, host_at, run, sliding_table, struck

TABLE = sliding_table()
AT_REST = np.zeros((1, LINE_COLUMNS))


def physics(**changed: float) -> Physics:
    fields = dict.fromkeys(Physics._fields, 0.0)
    fields |= {
        "reach_m": 0.04,
        "radius_m": 0.01,
        "inertia_factor": 0.5,
        "restitution": 0.7,
        "tangential_restitution": 0.4,
        "wall_friction": 0.15,
        "smoothing_m_per_s": 2e-4,
        "step_s": 2e-5,
    }
    return Physics(**(fields | changed))


def gone(p: Physics, start: list[float], duration_s: float, host: np.ndarray = AT_REST):
    state = np.array([*start, 0.0, -1.0])
    return run(duration_s, 1e9, state, p, host, np.zeros((0, 3)), TABLE, np.zeros((500, 2)))


def test_straight_flights_and_mirror_reflections_without_friction():
    """A disk in a smooth ring at rest: chords by the quadratic formula, mirror reflections less two per cent."""
    p = physics(restitution=0.98, wall_friction=0.0)
    nodes, impacts, _ = gone(p, [0.0, 0.013, 0.0, 1.9, 0.35, 3.0], 0.1)
    position, velocity, now = np.array([0.0, 0.013]), np.array([1.9, 0.35]), 0.0
    for impact in impacts:
        along, square = position @ velocity, velocity @ velocity
        flight = (-along + np.sqrt(along**2 + square * (p.reach_m**2 - position @ position))) / square
        position, now = position + velocity * flight, now + flight
        normal = position / np.linalg.norm(position)
        assert impact[0] == pytest.approx(now, abs=1e-11)
        assert impact[1] == pytest.approx(velocity @ normal, rel=1e-9)
        velocity = velocity - 1.98 * (velocity @ normal) * normal
    assert len(impacts) > 2
    assert np.ptp(nodes[:, 6]) < 1e-12  # a smooth wall turns nothing


def test_a_plain_slide_stops_where_coulomb_says_and_its_spin_decays_alone():
    p = physics(friction=0.2, spin_decay_per_s=2.0)
    nodes, impacts, _ = gone(p, [0.0, 0.0, 0.0, 0.3, 0.0, 30.0], 0.5)
    assert not len(impacts)
    stop = 0.3**2 / (2 * 0.2 * GRAVITY_M_PER_S2)
    # below the smoothing speed v_d the disk creeps: at most v_d^2 / (mu g) times a logarithm farther
    assert nodes[-1, 1] == pytest.approx(stop, abs=20 * p.smoothing_m_per_s**2 / (0.2 * GRAVITY_M_PER_S2))
    early = nodes[nodes[:, 0] < 0.1]
    assert np.allclose(early[:, 1], 0.3 * early[:, 0] - 0.1 * GRAVITY_M_PER_S2 * early[:, 0] ** 2, atol=1e-9)
    assert nodes[-1, 6] == pytest.approx(30 * np.exp(-2.0 * 0.5), rel=1e-6)


def test_friction_of_a_sliding_and_spinning_disk_is_the_integral_over_its_area():
    node, weight = np.polynomial.legendre.leggauss(400)
    r, w = 0.5 * (node + 1), 0.5 * weight
    phi = 2 * np.pi * (np.arange(4000) + 0.5) / 4000
    x, y = r[:, None] * np.cos(phi), r[:, None] * np.sin(phi)
    for angle in (0.0, 0.1, 0.5, 0.7, 0.9, 1.3, np.pi / 2):
        speed, rim = np.cos(angle), np.sin(angle)
        ux, uy = speed - rim * y, rim * x
        size = np.hypot(ux, uy)
        force, torque = (2 * (w * r) @ part.mean(axis=1) for part in (ux / size, (x * uy - y * ux) / size))
        place = angle / (np.pi / 2) * (len(TABLE) - 1)
        interpolated = [np.interp(place, np.arange(len(TABLE)), TABLE[:, k]) for k in (0, 1)]
        assert interpolated == pytest.approx(
            [force, torque], abs=2e-5
        )  # the area sum's own error at the disk's resting point


@pytest.mark.further
def test_ten_thousand_impacts_keep_the_law_and_none_makes_energy():
    rng, inertia, radius = np.random.default_rng(3), 0.5 * 0.01**2, 0.01
    slides = 0
    for _ in range(10_000):
        eps, mu, beta, azimuth = rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(-1, 1), rng.uniform(0, 2 * np.pi)
        n = np.array([np.cos(azimuth), np.sin(azimuth)])
        t = np.array([-n[1], n[0]])
        state = np.array([0, 0, 0, *rng.normal(size=2), rng.normal(0, 100), 0, 0])
        if state[3:5] @ n <= 0:
            state[3:5] *= -1
        new, slid = struck(state, *n, *(radius * n), eps, mu, beta, inertia)
        slip = [s[3:5] @ t + radius * s[5] for s in (state, new)]
        jn, jt = (new[3:5] - state[3:5]) @ n, (new[3:5] - state[3:5]) @ t
        assert new[3:5] @ n == pytest.approx(-eps * (state[3:5] @ n), abs=1e-12)
        assert radius * jt == pytest.approx(inertia * (new[5] - state[5]), abs=1e-12)
        if slid:
            assert abs(jt) == pytest.approx(mu * abs(jn), abs=1e-12)
            assert slip[1] * slip[0] > -beta * slip[0] ** 2 - 1e-12
        else:
            assert slip[1] == pytest.approx(-beta * slip[0], abs=1e-12)
            assert abs(jt) <= mu * abs(jn) + 1e-12
        energy = [s[3] ** 2 + s[4] ** 2 + inertia * s[5] ** 2 for s in (state, new)]
        assert energy[1] <= energy[0] * (1 + 1e-12)
        slides += slid
    assert 1000 < slides < 9000


def test_a_disk_that_the_wall_carries_is_let_go_when_the_wall_slows():
    """The Host at A sin(wt), the disk at rest against its +x wall: pushed until the Host's acceleration turns, at half
    a period.
    """
    omega = 2 * np.pi * 10.0
    host = np.array([[0, 0.01, omega, 0.0, 0.0, -1.0, 0.0, 0.0]])
    p = physics()
    early = 1e-3
    where, speed, _ = host_at(early, host)
    shifted = np.array([[0, 0.01, omega, omega * early, 0.0, -1.0, 0.0, 0.0]])
    _, _, held = gone(p, [where[0] + p.reach_m * (1 - 1e-9), 0.0, 0.0, speed[0], 0.0, 0.0], 0.049 + 0.012, shifted)
    assert held[0, 0] < 2e-3
    assert held[0, 1] == pytest.approx(np.pi / omega - early, abs=2 * p.step_s)


@pytest.mark.parametrize(
    "line",
    [
        [0, 0.01, 60.0, 0.4, 0.0, -1.0, 0.0, 0.0],
        [1, 0.01, 60.0, 0.4, 40.0, -1.0, 0.0, 0.0],
        [0, 0.01, 60.0, 0.4, 0.0, 0.0, 0.15, 0.0],
        [2, 0.01, 60.0, 0.0, 0.0, 0.1, 0.0, 25.0],
    ],
)
def test_speed_and_acceleration_of_a_line_are_its_derivatives(line):
    """A sine, a chirp, a start-up, and what rings after an instant; before it there is nothing."""
    lines, axis, step = np.array([line]), line[0], 1e-5
    for time in (0.12, 0.31, 0.5):
        before, now, after = (host_at(time + k * step, lines) for k in (-1, 0, 1))
        assert (after[0][axis] - before[0][axis]) / (2 * step) == pytest.approx(now[1][axis], rel=1e-5, abs=1e-7)
        assert (after[1][axis] - before[1][axis]) / (2 * step) == pytest.approx(now[2][axis], rel=1e-5, abs=1e-4)
    assert line[5] < 0 or not np.any(host_at(line[5] - 1e-3, lines))


def test_a_spinning_disk_under_lift_goes_in_a_circle():
    """Without a floor's friction: a force across the velocity turns it by lift times spin per second."""
    p = physics(lift=0.02)
    nodes, impacts, _ = gone(p, [0.0, 0.0, 0.0, 0.3, 0.0, 1000.0], 0.08)
    assert len(impacts) == 0
    turned = 0.02 * 1000.0 * nodes[-1, 0]
    assert np.allclose(nodes[-1, 4:6], [0.3 * np.cos(turned), 0.3 * np.sin(turned)], rtol=0, atol=1e-9)


def test_a_host_that_recoils_takes_the_momentum():
    """A disk of a thousandth of the Host's mass: the Host gets a thousandth of the disk's change of speed."""
    p = physics(recoil_share=1e-3, recoil_rad_per_s=60.0, recoil_decay_per_s=20.0)
    lines = np.zeros((1001, LINE_COLUMNS))
    lines[1:, 0] = -1.0
    state = np.array([0.0, 0.0, 0.0, 1.5, 0.0, 0.0, 0.0, -1.0])
    nodes, impacts, _ = run(0.04, 1e9, state, p, lines, np.zeros((0, 3)), TABLE, np.zeros((500, 2)))
    assert len(impacts) == 1
    assert host_at(impacts[0, 0] + 1e-9, lines)[1][0] == pytest.approx(1e-3 * (1.5 - nodes[-1, 4]), rel=1e-6)


@pytest.mark.others_further
@pytest.mark.parametrize("law", LAWS)
def test_no_law_leaves_the_ring_or_tells_another_truth_than_it_followed(law):
    _, motion, truth = make_recording(Spec(law, periods=4.0, noise="white", at_origin=True), np.random.default_rng(5))
    p, states, impacts = truth["rig"].physics, truth["states"], truth["impacts"]
    away = np.hypot(states["nes_x_m"] - states["host_x_m"], states["nes_y_m"] - states["host_y_m"])
    assert away.max() < p.reach_m * (1 + 1e-6)
    assert len(impacts) > 3
    stuck = impacts[impacts["slides"] == 0]
    rebound = impacts["normal_speed_after_m_per_s"] / impacts["normal_speed_before_m_per_s"]
    if law != "rough_wall":  # there the law holds along a normal that the ring does not have
        assert np.allclose(rebound, impacts["restitution"], atol=1e-9)
        assert np.allclose(
            stuck["tangential_speed_after_m_per_s"],
            -p.tangential_restitution * stuck["tangential_speed_before_m_per_s"],
            atol=1e-9,
        )
    off = (motion["nes_x_m"] - states["nes_x_m"]) / motion["nes_x_sd_m"]
    assert 0.8 < off.std() < 1.25


def test_moving_the_world_moves_the_answers_and_nothing_else(tmp_path, ovines):
    runs = make_series(Spec(periods=4.0), np.random.default_rng(6), 2)
    place = runs[0].truth["place"]
    host = runs[0].motion[["host_x_m", "host_y_m"]].mean().to_numpy()
    assert np.hypot(*(host - place[:2])) < runs[0].truth["rig"].amplitude_m
    checked = ovines(NAME, write_series(runs, tmp_path / "series"))
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_a_square_sends_a_disk_round_as_unfolding_it_says():
    """Without friction and with full restitution a square is a chain of mirrors: each coordinate by itself."""
    p = physics(restitution=0.98, wall_friction=0.0, sides=4.0)
    nodes, impacts, _ = gone(p, [0.01, 0.0, 0.0, 1.0, 0.7, 0.0], 0.3)
    for at, speed in ((0.01, 1.0), (0.0, 0.7)):
        now, times = 0.0, []
        while True:
            now += (p.reach_m - np.sign(speed) * at) / abs(speed)
            if now > 0.3:
                break
            times.append(now)
            at, speed = np.sign(speed) * p.reach_m, -0.98 * speed
        near = [np.min(np.abs(impacts[:, 0] - t)) for t in times]
        assert len(times) >= 3 and max(near) < 1e-10
    assert np.abs(nodes[:, 1:3]).max() < p.reach_m * (1 + 1e-9)


def test_a_disk_is_thrown_back_by_a_cylinder():
    p = physics(cylinder_m=0.015, wall_friction=0.0)
    _, impacts, _ = gone(p, [0.03, 0.009, 0.0, -1.0, 0.0, 0.0], 0.03)
    x = np.sqrt(0.015**2 - 0.009**2)
    assert impacts[0, 0] == pytest.approx(0.03 - x, abs=1e-12)
    assert impacts[0, 1] == pytest.approx(x / 0.015, rel=1e-9)
    assert impacts[0, 4] == pytest.approx(np.arctan2(0.009, x), abs=1e-9)
