"""The Host's motion as harmonics: frequency, amplitudes, a Host at rest, outliers."""

from __future__ import annotations

import numpy as np
import pytest

from analysis.motion.host_path import fit_host_motion

FREQUENCY_HZ = 11.03


def shaken(n=480, sd=1e-5, seed=1):
    t = np.arange(n) / 800
    w = 2 * np.pi * FREQUENCY_HZ
    exact = np.column_stack(
        [
            0.0164 * np.sin(w * t + 0.3) + 2e-5 * np.cos(2 * w * t),
            1e-4 * np.cos(w * t),
            5e-5 * np.sin(w * t),
            0.01 * np.sin(3 * w * t),
        ]
    )
    noise = np.random.default_rng(seed).standard_normal(exact.shape) * sd
    return t, exact, exact + noise, np.full_like(exact, sd)


@pytest.mark.parametrize("asked_hz", [11.0, None])
def test_frequency_and_place_within_their_noise(asked_hz):
    t, exact, seen, sd = shaken()
    host = fit_host_motion(t, seen, sd, asked_hz)
    assert abs(host.frequency_hz - FREQUENCY_HZ) < 4 * host.omega_sd_rad_per_s / (2 * np.pi)
    assert np.sqrt(np.mean((host.at(t) - exact) ** 2)) < 3e-6
    assert abs(host.amplitude_m - 0.0164) < 1e-5


def test_acceleration_is_the_second_derivative():
    t, _, seen, sd = shaken()
    host = fit_host_motion(t, seen, sd, 11.0)
    h = 1e-5
    numeric = (host.at(t + h) - 2 * host.at(t) + host.at(t - h)) / h**2
    np.testing.assert_allclose(host.at(t, 2)[:, 0], numeric[:, 0], rtol=1e-3, atol=0.05)


def test_outliers_and_gaps_do_no_harm():
    t, exact, seen, sd = shaken()
    seen[50, 0] += 2e-3
    seen[200:240] = np.nan
    host = fit_host_motion(t, seen, sd, 11.0)
    assert np.abs(host.at(t) - exact).max() < 2e-5


def test_the_phase_is_that_of_a_sine():
    t, _, seen, sd = shaken()
    assert fit_host_motion(t, seen, sd, 11.0).phase_rad == pytest.approx(0.3, abs=2e-3)


def test_a_host_at_rest_has_means_only():
    seen = np.full((50, 4), 0.01) + 1e-6 * np.random.default_rng(1).standard_normal((50, 4))
    host = fit_host_motion(np.arange(50) / 800, seen, np.full((50, 4), 1e-6), None)
    assert host.omega_rad_per_s == 0.0 and host.amplitude_m == 0.0
    np.testing.assert_allclose(host.at(np.array([0.0, 1.0])), 0.01, atol=1e-6)


def test_nothing_seen_is_a_host_at_the_origin():
    host = fit_host_motion(np.arange(5) / 800, np.full((5, 4), np.nan), np.full((5, 4), 1e-5), None)
    assert np.all(host.at(np.zeros(1)) == 0.0)
