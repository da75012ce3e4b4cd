"""The impact law: Luding's equations, energy never created, momentum kept."""

import numpy as np
import pytest

from ovines.core.impact import impulses, luding


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
