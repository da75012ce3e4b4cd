"""The impact law: Luding's equations, energy never created, momentum kept."""

import numpy as np
import pytest

from ovines.core.system import parameters as P
from ovines.core.system.impact import effective_restitution, impulses, luding


def thesis_impact(un, ut, eps, mu, beta0, m_n, q_n, m_h, q_h):
    """(95)-(107) as printed: impulse along normal and tangent."""
    m = 1 / (1 / m_n + 1 / m_h)
    q = m * (1 / (q_n * m_n) + 1 / (q_h * m_h))
    beta1 = -1 + mu * (1 + eps) * (1 + q) * abs(un) / abs(ut)
    beta = min(beta0, beta1)
    return -m * (1 + eps) * un, -m / (1 + q) * (1 + beta) * ut, q


def test_two_thousand_random_impacts():
    rng = np.random.default_rng(3)
    for _ in range(2000):
        eps, mu, beta0 = rng.uniform(0, 1), rng.uniform(0, 2), rng.uniform(-1, 1)
        m_n, q_n, m_h, q_h = rng.uniform(0.01, 3, 4)
        un, ut = rng.uniform(0.01, 5), rng.normal()
        p_n, p_t, q = thesis_impact(un, ut, eps, mu, beta0, m_n, q_n, m_h, q_h)
        k_nn = 1 / m_n + 1 / m_h
        k_tt = k_nn + 1 / (q_n * m_n) + 1 / (q_h * m_h)
        ours = impulses(un, ut, k_nn, 0.0, k_tt, eps, mu, beta0)
        assert ours[:2] == (pytest.approx(p_n, rel=1e-12), pytest.approx(p_t, rel=1e-9, abs=1e-13))
        after = luding(un, ut, eps, mu, beta0, q)
        assert after[0] == pytest.approx(un + k_nn * p_n, rel=1e-9, abs=1e-12)
        assert after[1] == pytest.approx(ut + k_tt * p_t, rel=1e-9, abs=1e-9)
        assert after[2] == ours[2]
        # energy the impulse takes from the relative motion: never negative
        assert -0.5 * (p_n * (un + after[0]) + p_t * (ut + after[1])) > -1e-12


def test_smooth_no_rebound_and_full_reversal():
    assert luding(1.0, 0.3, 0.5, 10.0, -1.0, 2.0)[1] == pytest.approx(0.3)
    assert luding(1.0, 0.3, 0.5, 10.0, 0.0, 2.0)[1] == pytest.approx(0.0)
    assert luding(1.0, 0.3, 0.5, 10.0, 1.0, 2.0)[1] == pytest.approx(-0.3)
    assert luding(1.0, 0.3, 0.5, 0.0, 0.5, 2.0)[1] == pytest.approx(0.3)  # mu_c = 0 means beta = -1 (ERRATA)


def with_law(**values):
    p = np.zeros(P.N_FLOATS)
    for name, value in values.items():
        p[getattr(P, name)] = value
    return p


def test_restitution_falls_with_speed_and_swings_with_azimuth():
    """Closed forms; each effect alone is off where its parameter is 0, and the value stays within 0..1."""
    plain = with_law(RESTITUTION=0.7)
    assert effective_restitution(1.3, 0.4, 0.0, plain) == 0.7
    falling = with_law(RESTITUTION=0.8, RESTITUTION_FAST=0.5, RESTITUTION_SPEED=0.25)
    for speed in (0.0, 0.1, 0.25, 2.0):
        assert effective_restitution(speed, 0.0, 0.0, falling) == pytest.approx(
            0.5 + 0.3 * np.exp(-speed / 0.25), rel=1e-14
        )
    swing = with_law(RESTITUTION=0.7, RESTITUTION_SWING=0.1, RESTITUTION_DIRECTION=0.5)
    for azimuth in (0.5, 1.5, 0.5 + np.pi):
        assert effective_restitution(1.0, azimuth, 0.0, swing) == pytest.approx(
            0.7 + 0.1 * np.cos(azimuth - 0.5), rel=1e-14
        )
    assert (
        effective_restitution(
            1.0, 0.5, 0.0, with_law(RESTITUTION=0.95, RESTITUTION_SWING=0.1, RESTITUTION_DIRECTION=0.5)
        )
        == 1.0
    )
    assert (
        effective_restitution(
            1.0, 0.5, 0.0, with_law(RESTITUTION=0.05, RESTITUTION_SWING=-0.1, RESTITUTION_DIRECTION=0.5)
        )
        == 0.0
    )


def test_coupled_impulses_leave_what_the_law_says():
    """With an off-centre mass normal and tangent act on each other: the velocities after, from the impulses, are the
    law's.
    """
    rng = np.random.default_rng(8)
    kinds = set()
    for _ in range(500):
        k_nn, k_tt = rng.uniform(10, 100, 2)
        k_nt = rng.uniform(-0.3, 0.3) * np.sqrt(k_nn * k_tt)
        eps, mu, beta0 = rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(-1, 1)
        un, ut = rng.uniform(0.01, 5), rng.normal()
        p_n, p_t, stuck = impulses(un, ut, k_nn, k_nt, k_tt, eps, mu, beta0)
        after_n, after_t = un + k_nn * p_n + k_nt * p_t, ut + k_nt * p_n + k_tt * p_t
        assert after_n == pytest.approx(-eps * un, rel=1e-9, abs=1e-11)
        if stuck:
            assert after_t == pytest.approx(-beta0 * ut, rel=1e-9, abs=1e-11) and abs(p_t) <= mu * abs(p_n)
        else:
            assert abs(p_t) == pytest.approx(mu * abs(p_n), rel=1e-12) and p_t * ut <= 0.0
        kinds.add((stuck, ut > 0))
    assert len(kinds) == 4
