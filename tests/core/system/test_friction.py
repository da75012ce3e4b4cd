"""Farkas' functions against mpmath's elliptic integrals, and the floor's friction in its limits."""

import math
from dataclasses import replace

import mpmath as mp
import numpy as np
import pytest

from analysis.simulations.floor_figure import ratio_change
from ovines.core import simulate
from ovines.core.system.friction import farkas, floor_friction
from ovines.core.system.named import named_scenario


def reference(ratio):
    """(48), (49) as printed, in 60 digits, with the modulus."""
    mp.mp.dps = 60
    e = mp.mpf(ratio)
    if e <= 1:
        big_e, big_k = mp.ellipe(e * e), mp.ellipk(e * e)
        force = mp.mpf(4) / 3 * ((e * e + 1) * big_e + (e * e - 1) * big_k) / (e * mp.pi)
        return force, mp.mpf(4) / 9 * ((4 - 2 * e * e) * big_e + (e * e - 1) * big_k) / mp.pi
    big_e, big_k = mp.ellipe(1 / e**2), mp.ellipk(1 / e**2)
    force = mp.mpf(4) / 3 * ((e * e + 1) * big_e - (e * e - 1) * big_k) / mp.pi
    return force, 4 * e / 9 * ((4 - 2 * e * e) * big_e + (2 * e * e - 5 + 3 / e**2) * big_k) / mp.pi


@pytest.mark.parametrize("power", np.linspace(-8, 8, 81))
def test_farkas_over_sixteen_decades(power):
    ratio = 10.0**power * 1.0000123
    for ours, true in zip(farkas(ratio), reference(ratio), strict=True):
        assert abs(ours / float(true) - 1) < 3e-15


@pytest.mark.parametrize("ratio", [1 - 1e-12, 1 - 1e-6, 1 + 1e-9, 0.9999])
def test_farkas_next_to_one(ratio):
    for ours, true in zip(farkas(ratio), reference(ratio), strict=True):
        assert abs(ours / float(true) - 1) < 5e-15


def test_values_limits_and_slopes_of_78_and_79():
    assert farkas(0.0) == (0.0, pytest.approx(2 / 3, rel=1e-15))
    assert farkas(math.inf) == (1.0, 0.0)
    assert farkas(1.0) == (pytest.approx(8 / (3 * math.pi), rel=1e-15), pytest.approx(8 / (9 * math.pi), rel=1e-15))
    h = 1e-6
    slope = [(a - b) / (2 * h) for a, b in zip(farkas(1 + h), farkas(1 - h), strict=True)]
    # the second derivative has a logarithm at 1: the difference converges as h ln h
    assert slope == [pytest.approx(4 / (3 * math.pi), abs=1e-5), pytest.approx(-4 / (3 * math.pi), abs=1e-5)]


def test_direct_integral_over_the_disk():
    """Force and torque of a uniformly loaded disk, integrated over its area: no elliptic integral involved."""
    speed, rim = 0.7, 1.3
    r, w = np.polynomial.legendre.leggauss(200)
    r, w = 0.5 * (r + 1), 0.5 * w
    angle = (np.arange(2000) + 0.5) * 2 * np.pi / 2000
    x, y = r[:, None] * np.cos(angle), r[:, None] * np.sin(angle)
    vx, vy = speed - rim * y, rim * x
    size = np.hypot(vx, vy)
    area = (w * r)[:, None] * (2 * np.pi / 2000) / np.pi
    force = np.sum(area * vx / size)
    torque = np.sum(area * (x * vy - y * vx) / size)
    assert farkas(speed / rim) == (pytest.approx(force, rel=1e-5), pytest.approx(torque, rel=1e-5))


def test_floor_friction_limits():
    ax, ay, torque = floor_friction(3.0, 4.0, 0.0, 0.01, 2.0, 1e-6, 1.0)
    assert (ax, ay, torque) == (pytest.approx(-1.2), pytest.approx(-1.6), 0.0)
    ax, ay, torque = floor_friction(0.0, 0.0, 50.0, 0.01, 2.0, 1e-6, 1.0)
    assert (ax, ay, torque) == (0.0, 0.0, pytest.approx(-2.0 * 0.01 * 2 / 3))
    assert floor_friction(3.0, 4.0, 50.0, 0.01, 2.0, 1e-6, 0.0) == (pytest.approx(-1.2), pytest.approx(-1.6), 0.0)
    assert floor_friction(0.0, 0.0, 0.0, 0.01, 2.0, 1e-6, 1.0) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("coupling", [0.0, 0.3, 1.0])
def test_friction_turns_over_with_the_motion(coupling):
    """The other way round the same size: force against the velocity, torque against the spin."""
    fx, fy, torque = floor_friction(0.3, -0.1, 20.0, 0.01, 2.0, 1e-3, coupling)
    for sx, sy, ss in ((-1, -1, -1), (1, 1, -1), (-1, 1, 1)):
        other = floor_friction(sx * 0.3, sy * -0.1, ss * 20.0, 0.01, 2.0, 1e-3, coupling)
        assert other == (pytest.approx(sx * fx), pytest.approx(sy * fy), pytest.approx(ss * torque))
    assert fx * 0.3 + fy * -0.1 < 0 and torque * 20.0 <= 0 and (torque == 0.0) == (coupling == 0.0)


@pytest.mark.parametrize("speed", [2e-4, 1e-3, 0.3])
def test_between_coulomb_and_farkas_is_the_linear_mixture(speed):
    """Coulomb with tanh(v / v_d), Farkas with its own, and a coupling of 0.3 takes three tenths of the one."""
    coulomb, farkas_law, mixed = (floor_friction(speed, 0.0, 20.0, 0.01, 2.0, 1e-3, c) for c in (0.0, 1.0, 0.3))
    assert coulomb[0] == pytest.approx(-2.0 * math.tanh(speed / 1e-3), rel=1e-12)
    for part in (0, 2):
        assert mixed[part] == pytest.approx(0.7 * coulomb[part] + 0.3 * farkas_law[part], rel=1e-12, abs=1e-15)


def test_how_the_ratio_changes_is_that_of_a_disk_that_slides_and_spins():
    """Fig. 18: against a simulated disk's own ratio of speeds; it falls through zero at 0.653 (Farkas et al. 2003)."""
    ratio = np.linspace(0.6, 0.7, 1001)
    change = ratio_change(ratio, *np.array([farkas(one) for one in ratio]).T, 0.5)
    crossing = ratio[np.flatnonzero((change[:-1] > 0) & (change[1:] <= 0))]
    assert crossing == pytest.approx([0.653], abs=1e-3)
    scenario = replace(named_scenario("farkas-stop", sample_rate_hz=20_000.0), tolerance=1e-12)
    run, floor, nes = simulate(scenario), scenario.friction, scenario.nes
    moving = run.motion["nes_vx_m_per_s"] > 0.3
    time_s, speed = run.time_s[moving], run.motion["nes_vx_m_per_s"][moving]
    rim = nes.radius_m * run.motion["nes_spin_rad_per_s"][moving]
    by_time = np.gradient(speed / rim, time_s) * rim / (floor.coefficient * floor.load_m_per_s2)
    own = ratio_change(speed / rim, *np.array([farkas(one) for one in speed / rim]).T, nes.inertia_factor)
    assert moving.sum() > 1000 and own.max() > 0.04
    np.testing.assert_allclose(by_time[1:-1], own[1:-1], atol=1e-6)
